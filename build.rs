//! Finds Embree 4, binds it, and compiles the C shim in `ffi/`. Does nothing without the feature `embree`.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "embree")]
    embree::build();
}

#[cfg(feature = "embree")]
mod embree {
    use std::path::{Path, PathBuf};

    /// A place that holds Embree's headers and library.
    struct Prefix {
        include: PathBuf,
        lib: PathBuf,
        /// Whether the loader finds the library there without a run path.
        system: bool,
    }

    pub fn build() {
        println!("cargo::rerun-if-env-changed=EMBREE_ROOT");
        println!("cargo::rerun-if-changed=ffi/shim.c");
        println!("cargo::rerun-if-changed=ffi/shim.h");
        let prefix = match find() {
            Ok(prefix) => prefix,
            Err(message) => {
                println!("cargo::error={message}");
                std::process::exit(1);
            }
        };
        println!(
            "cargo::rerun-if-changed={}",
            prefix.include.join("embree4/rtcore_config.h").display()
        );

        // The C shim, then Embree: the linker resolves from left to right.
        cc::Build::new()
            .file("ffi/shim.c")
            .include(&prefix.include)
            .flag_if_supported("-std=c11")
            .opt_level(3)
            .warnings_into_errors(true)
            .compile("gdpt_shim");
        println!("cargo::rustc-link-search=native={}", prefix.lib.display());
        println!("cargo::rustc-link-lib=dylib=embree4");
        if !prefix.system {
            println!("cargo::rustc-link-arg=-Wl,-rpath,{}", prefix.lib.display());
        }

        let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"))
            .join("embree.rs");
        bindgen::Builder::default()
            .header("ffi/shim.h")
            .clang_arg(format!("-I{}", prefix.include.display()))
            .allowlist_function("rtc(NewDevice|ReleaseDevice|GetDeviceError|GetDeviceProperty|NewScene|ReleaseScene)")
            .allowlist_function("rtc(SetSceneFlags|SetSceneBuildQuality|CommitScene|NewGeometry|ReleaseGeometry)")
            .allowlist_function("rtc(SetSharedGeometryBuffer|CommitGeometry|AttachGeometryByID|SetDeviceErrorFunction)")
            .allowlist_function("gdpt_.*")
            .allowlist_type("RTC(RayHit8|Ray8)")
            .allowlist_var("RTC_INVALID_GEOMETRY_ID")
            .default_enum_style(bindgen::EnumVariation::ModuleConsts)
            .generate_comments(false)
            .layout_tests(true)
            .generate()
            .expect("bindgen could not read Embree's headers; is libclang complete? ffi/setup.sh installs it")
            .write_to_file(out)
            .expect("OUT_DIR can be written");
    }

    fn find() -> Result<Prefix, String> {
        let mut seen = Vec::new();
        let roots: Vec<PathBuf> = match std::env::var_os("EMBREE_ROOT") {
            Some(root) => vec![root.into()],
            None => {
                let data = std::env::var_os("XDG_DATA_HOME")
                    .map(PathBuf::from)
                    .or_else(|| {
                        std::env::var_os("HOME")
                            .map(|home| PathBuf::from(home).join(".local/share"))
                    });
                data.map(|d| d.join("gdpt/embree4"))
                    .into_iter()
                    .chain([PathBuf::from("/usr/local"), PathBuf::from("/usr")])
                    .collect()
            }
        };
        for root in roots {
            match look_in(&root) {
                Ok(prefix) => return Ok(prefix),
                Err(Some(why)) => seen.push(why),
                Err(None) => {}
            }
        }
        let seen = if seen.is_empty() {
            String::new()
        } else {
            format!(" ({})", seen.join("; "))
        };
        Err(format!(
            "Embree 4.3 or later was not found{seen}. Run ffi/setup.sh, or set EMBREE_ROOT to its prefix, \
             or build with --no-default-features for the pure-Rust BVH alone."
        ))
    }

    /// `Err(Some(why))` where there is an Embree that does not serve, `Err(None)` where there is none.
    fn look_in(root: &Path) -> Result<Prefix, Option<String>> {
        let include = root.join("include");
        let config = include.join("embree4/rtcore_config.h");
        let Ok(text) = std::fs::read_to_string(&config) else {
            let old = include.join("embree3/rtcore.h");
            return Err(old
                .exists()
                .then(|| format!("{} has Embree 3", root.display())));
        };
        let number = |name: &str| -> u32 {
            text.lines()
                .find_map(|l| l.strip_prefix(&format!("#define {name} ")))
                .and_then(|v| v.trim().parse().ok())
                .unwrap_or(0)
        };
        let (major, minor) = (number("RTC_VERSION_MAJOR"), number("RTC_VERSION_MINOR"));
        if major != 4 || minor < 3 {
            return Err(Some(format!(
                "{} has Embree {major}.{minor}",
                root.display()
            )));
        }
        let arch = std::env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default();
        let candidates = [
            root.join("lib"),
            root.join("lib64"),
            root.join(format!("lib/{arch}-linux-gnu")),
        ];
        match candidates
            .into_iter()
            .find(|d| d.join("libembree4.so").exists())
        {
            Some(lib) => Ok(Prefix {
                include,
                lib,
                system: root == Path::new("/usr"),
            }),
            None => Err(Some(format!(
                "{} has Embree's headers but no libembree4.so",
                root.display()
            ))),
        }
    }
}
