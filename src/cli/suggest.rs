//! What was meant by a flag that there is not: other programs' names for what ours do.

use super::Cli;
use clap::CommandFactory;
use clap::error::{ContextKind, ContextValue, Error, ErrorKind};
use std::ffi::OsString;
use std::path::Path;

/// Our flags, with what others call them, without dashes. By likeness of letters alone, `--samples` would be
/// taken for `--sample`, and `--width` for `--weights`.
const SYNONYMS: &[(&str, &[&str])] = &[
    (
        "spp",
        &[
            "samples",
            "num-samples",
            "nsamples",
            "sample-count",
            "samples-per-pixel",
            "pixelsamples",
            "max-samples",
            "passes",
            "iterations",
            "quality",
        ],
    ),
    (
        "size",
        &[
            "width",
            "height",
            "w",
            "res",
            "resolution",
            "dimensions",
            "dim",
            "image-size",
            "geometry",
            "resize",
            "xres",
            "yres",
        ],
    ),
    (
        "output",
        &[
            "out",
            "outfile",
            "out-file",
            "output-file",
            "outputfile",
            "output-path",
            "image",
            "write",
            "save",
        ],
    ),
    ("format", &["type", "file-format", "output-format", "ext"]),
    (
        "time",
        &[
            "timeout",
            "time-limit",
            "max-time",
            "seconds",
            "duration",
            "budget",
        ],
    ),
    (
        "error",
        &[
            "noise",
            "threshold",
            "max-error",
            "target-error",
            "noise-threshold",
            "tolerance",
        ],
    ),
    (
        "depth",
        &[
            "bounces",
            "max-depth",
            "maxdepth",
            "max-bounces",
            "path-length",
            "max-path-length",
            "ray-depth",
        ],
    ),
    (
        "origin",
        &[
            "eye",
            "position",
            "pos",
            "from",
            "lookfrom",
            "camera-position",
            "cam",
            "camera-origin",
        ],
    ),
    (
        "target",
        &[
            "lookat",
            "look-at",
            "at",
            "center",
            "centre",
            "interest",
            "camera-target",
        ],
    ),
    (
        "up",
        &["up-axis", "vup", "upvector", "z-up", "zup", "y-up", "axis"],
    ),
    (
        "fov",
        &["fovy", "field-of-view", "angle", "focal-length", "fov-y"],
    ),
    (
        "aperture",
        &[
            "lens-radius",
            "lens",
            "fstop",
            "f-stop",
            "dof",
            "aperture-radius",
        ],
    ),
    (
        "focus",
        &["focus-distance", "focal-distance", "focaldistance"],
    ),
    (
        "environment",
        &[
            "env", "envmap", "env-map", "hdri", "hdr", "ibl", "sky-map", "skybox", "world",
        ],
    ),
    (
        "background",
        &["bg", "backdrop", "background-color", "background-colour"],
    ),
    ("exposure", &["ev", "brightness", "stops", "gain"]),
    (
        "tone",
        &[
            "tonemap",
            "tone-map",
            "tonemapping",
            "tone-mapping",
            "view-transform",
        ],
    ),
    (
        "textures",
        &[
            "texture-path",
            "texture-dir",
            "texture-folder",
            "texdir",
            "search-path",
        ],
    ),
    ("method", &["integrator", "algorithm", "renderer", "mode"]),
    (
        "reconstruct",
        &["reconstruction", "poisson", "solver", "solve"],
    ),
    ("denoise", &["denoiser", "denoising", "oidn", "clean"]),
    (
        "threads",
        &["nthreads", "num-threads", "jobs", "cores", "cpus", "j"],
    ),
    ("seed", &["random-seed", "rng-seed", "rng"]),
    ("quiet", &["silent", "no-progress", "q"]),
    ("resume", &["continue", "restart"]),
    ("every", &["checkpoint-every", "interval", "save-every"]),
    ("stats", &["json", "statistics", "report", "log"]),
    ("json", &["stats", "format-json"]),
    ("preview", &["png", "thumbnail"]),
    (
        "crop",
        &[
            "crop-window",
            "cropwindow",
            "pixelbounds",
            "region",
            "border",
            "tile",
        ],
    ),
    ("part", &["slice", "chunk", "shard", "job", "subset"]),
    ("frame", &["frame-number", "render-frame", "f"]),
    ("partial", &["incomplete", "allow-missing"]),
    (
        "turntable",
        &["frames", "views", "spin", "orbit", "animation"],
    ),
    (
        "watch",
        &["tev", "display-server", "display", "live", "viewer"],
    ),
    ("backend", &["accelerator", "accel", "bvh", "embree"]),
    (
        "filter",
        &["pixel-filter", "pixelfilter", "rfilter", "antialias"],
    ),
    (
        "smooth",
        &[
            "smoothing",
            "crease",
            "crease-angle",
            "smooth-angle",
            "auto-smooth",
        ],
    ),
];

/// The error with a hint at what was meant, where that is known.
pub(super) fn improve(mut error: Error, arguments: &[OsString]) -> Error {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.clone()),
        _ => None,
    };
    let hint = match error.kind() {
        ErrorKind::UnknownArgument => {
            text(ContextKind::InvalidArg).and_then(|flag| meant(&flag, arguments))
        }
        ErrorKind::InvalidSubcommand => text(ContextKind::InvalidSubcommand)
            .filter(|name| looks_like_scene(name))
            .map(|scene| format!("gdpt render {scene}")),
        _ => None,
    };
    if let Some(hint) = hint {
        // In place of what looks alike, and of how that would be used.
        error.remove(ContextKind::SuggestedArg);
        error.remove(ContextKind::Usage);
        let hint = format!("what does that here is '{hint}'").into();
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![hint]));
    }
    error
}

/// The flag that was meant by `given`, of those that the command has.
fn meant(given: &str, arguments: &[OsString]) -> Option<String> {
    let cli = Cli::command();
    let mut arguments = arguments.iter().skip(1).filter_map(|a| a.to_str());
    let command = arguments.by_ref().find_map(|a| cli.find_subcommand(a))?;
    let has = |name: &str| command.get_arguments().any(|a| a.get_long() == Some(name));
    // A long name after one dash is read as several short ones.
    let single = given
        .strip_prefix('-')
        .filter(|rest| !rest.starts_with('-'));
    let word = match single {
        Some(short) => arguments
            .filter_map(|a| a.strip_prefix('-'))
            .find(|a| !a.starts_with('-') && a.starts_with(short))?,
        None => given,
    };
    let name = word.trim_start_matches('-').split('=').next()?;
    let name = name.to_ascii_lowercase().replace('_', "-");
    if has(&name) {
        return Some(format!("--{name}"));
    }
    SYNONYMS
        .iter()
        .filter(|(ours, _)| has(ours))
        .find(|(_, others)| others.contains(&name.as_str()))
        .map(|(ours, _)| format!("--{ours}"))
}

/// Whether a command's name is rather the file that is to be rendered.
fn looks_like_scene(name: &str) -> bool {
    let lower = name.to_ascii_lowercase();
    lower.ends_with(".obj") || lower.ends_with(".obj.gz") || Path::new(name).is_file()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hint(line: &str) -> Option<String> {
        let arguments: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        let error = Cli::of(&arguments).unwrap_err();
        let text = error.render().to_string();
        let (_, after) = text.split_once("tip: what does that here is '")?;
        Some(after.split_once('\'')?.0.to_owned())
    }

    #[test]
    fn names_of_other_programs_lead_to_ours() {
        for (line, flag) in [
            ("gdpt render a.obj --samples 4", "--spp"),
            ("gdpt render a.obj --samples=4", "--spp"),
            ("gdpt render a.obj --width 640", "--size"),
            ("gdpt render a.obj --output-file x.png", "--output"),
            ("gdpt render a.obj --hdri sky.hdr", "--environment"),
            ("gdpt render --max_depth 3 a.obj", "--depth"),
            ("gdpt render a.obj -spp 16", "--spp"),
            ("gdpt render a.obj --SPP 16", "--spp"),
            ("gdpt info a.obj --resolution 3x3", "--size"),
            ("gdpt info a.obj --stats x.json", "--json"),
            ("gdpt render a.obj --json x.json", "--stats"),
            ("gdpt a.obj", "gdpt render a.obj"),
        ] {
            assert_eq!(hint(line).as_deref(), Some(flag), "{line}");
        }
    }

    #[test]
    fn flags_that_the_command_lacks_are_not_hinted_at() {
        for line in [
            "gdpt info a.obj --samples 4",
            "gdpt render a.obj --frobnicate",
            "gdpt rendre a.obj",
        ] {
            assert_eq!(hint(line), None, "{line}");
        }
    }

    #[test]
    fn no_word_has_two_meanings_in_one_command() {
        for command in Cli::command().get_subcommands() {
            let has = |name: &str| command.get_arguments().any(|a| a.get_long() == Some(name));
            let words = SYNONYMS.iter().filter(|(ours, _)| has(ours));
            let mut words: Vec<&str> = words
                .flat_map(|(_, others)| others.iter().copied())
                .collect();
            let count = words.len();
            words.sort_unstable();
            words.dedup();
            assert_eq!(words.len(), count, "{}", command.get_name());
        }
    }
}
