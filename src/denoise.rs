//! The ring around Open Image Denoise, a library that is looked for when a render asks for it: beside Embree's file the
//! one with `unsafe`. Everything public here is safe.
#![allow(unsafe_code)]

use crate::error::{Error, Result};
use crate::image::Image;
use libloading::Library;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// What is seen, in mirrors and through glass, too: it tells the denoiser where edges are.
#[derive(Clone, Debug)]
pub struct Features {
    /// Reflectance, in [0, 1].
    pub albedo: Image,
    /// Shading normals, 0 where nothing is hit.
    pub normal: Image,
}

/// A device of the library.
pub struct Denoiser {
    api: Api,
    device: *mut c_void,
    /// Of the library.
    pub version: String,
}

// SAFETY: the library locks the device in each of its functions ("the API is thread-safe", its manual, section
// Open Image Denoise API); the pointer stays valid, as a denoiser is never given away.
unsafe impl Send for Denoiser {}
// SAFETY: as above.
unsafe impl Sync for Denoiser {}

impl std::fmt::Debug for Denoiser {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Denoiser {}", self.version)
    }
}

impl PartialEq for Denoiser {
    /// There is but one.
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

/// The library's functions, by its header of version 2. They live as long as the library, which is never unloaded.
#[derive(Clone, Copy)]
struct Api {
    new_device: unsafe extern "C" fn(c_int) -> *mut c_void,
    set_device_int: unsafe extern "C" fn(*mut c_void, *const c_char, c_int),
    set_device_bool: unsafe extern "C" fn(*mut c_void, *const c_char, bool),
    get_device_int: unsafe extern "C" fn(*mut c_void, *const c_char) -> c_int,
    commit_device: unsafe extern "C" fn(*mut c_void),
    get_device_error: unsafe extern "C" fn(*mut c_void, *mut *const c_char) -> c_int,
    new_filter: unsafe extern "C" fn(*mut c_void, *const c_char) -> *mut c_void,
    release_filter: unsafe extern "C" fn(*mut c_void),
    set_image: SetImage,
    set_filter_bool: unsafe extern "C" fn(*mut c_void, *const c_char, bool),
    commit_filter: unsafe extern "C" fn(*mut c_void),
    execute_filter: unsafe extern "C" fn(*mut c_void),
}

/// `oidnSetSharedFilterImage`: filter, name, pixels, format, width, height, byte offset, bytes per pixel and row.
type SetImage = unsafe extern "C" fn(
    *mut c_void,
    *const c_char,
    *mut c_void,
    c_int,
    usize,
    usize,
    usize,
    usize,
    usize,
);

/// `OIDN_DEVICE_TYPE_CPU`
const CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`
const FLOAT3: c_int = 3;
/// What the library is called.
const NAME: &str = "libOpenImageDenoise.so.2";
/// What to run where it is missing.
const SETUP: &str = "ffi/setup.sh --denoiser installs it, GDPT_OIDN names it elsewhere";

impl Denoiser {
    /// The library's device of `threads` threads; the first call decides how many. Fails where the library is not
    /// there, or is not of version 2.
    pub fn get(threads: usize) -> Result<&'static Self> {
        static DENOISER: OnceLock<std::result::Result<Denoiser, String>> = OnceLock::new();
        DENOISER
            .get_or_init(|| Self::load(threads))
            .as_ref()
            .map_err(|message| Error::Setting(message.clone()))
    }

    fn load(threads: usize) -> std::result::Result<Self, String> {
        let path = place();
        // SAFETY: loading runs the library's initialisers, which do nothing that outlives them but registering its
        // own device types.
        let library = unsafe { Library::new(&path) }.map_err(|_| {
            format!(
                "Open Image Denoise is not there ({}): {SETUP}",
                path.display()
            )
        })?;
        let api = Api::of(&library)
            .ok_or_else(|| format!("{} is no Open Image Denoise 2: {SETUP}", path.display()))?;
        // It stays for good: its functions are kept.
        std::mem::forget(library);
        // SAFETY: the functions are called as the header has them, with texts that end with 0; the device is
        // checked for null.
        unsafe {
            let device = (api.new_device)(CPU);
            if device.is_null() {
                return Err(format!("Open Image Denoise: {}", api.error(device)));
            }
            (api.set_device_int)(device, c"numThreads".as_ptr(), threads as c_int);
            (api.set_device_bool)(device, c"setAffinity".as_ptr(), false);
            (api.commit_device)(device);
            let version = [c"versionMajor", c"versionMinor", c"versionPatch"];
            let version = version.map(|name| (api.get_device_int)(device, name.as_ptr()));
            let failure = api.error(device);
            if !failure.is_empty() {
                return Err(format!("Open Image Denoise: {failure}"));
            }
            let denoiser = Self {
                api,
                device,
                version: version.map(|n| n.to_string()).join("."),
            };
            // Whether it works at all.
            denoiser
                .run(&Image::new(2, 2), None)
                .map_err(|failure| format!("Open Image Denoise: {failure}"))?;
            Ok(denoiser)
        }
    }

    /// An image without its noise: linear, of any brightness, finite and not negative. The same bits for any number of
    /// threads.
    ///
    /// # Panics
    /// Where the library fails, which it did not in [`Denoiser::get`]: it has run out of memory.
    pub fn denoise(&self, noisy: &Image, features: Option<&Features>) -> Image {
        self.run(noisy, features)
            .unwrap_or_else(|failure| panic!("Open Image Denoise: {failure}"))
    }

    fn run(
        &self,
        noisy: &Image,
        features: Option<&Features>,
    ) -> std::result::Result<Image, String> {
        let (width, height) = (noisy.width, noisy.height);
        let api = &self.api;
        let mut inputs = vec![(c"color", interleaved(noisy))];
        if let Some(features) = features {
            inputs.push((c"albedo", interleaved(&features.albedo)));
            inputs.push((c"normal", interleaved(&features.normal)));
        }
        let mut output = vec![[0f32; 3]; width * height];
        inputs
            .iter()
            .for_each(|(_, pixels)| assert_eq!(pixels.len(), output.len()));
        // SAFETY: all images have width · height pixels of three floats without gaps, and stay where they are until
        // the filter, which alone knows of them, has run and is released. The library writes to the output alone.
        let failure = unsafe {
            let filter = (api.new_filter)(self.device, c"RT".as_ptr());
            if filter.is_null() {
                api.error(self.device)
            } else {
                let set = |name: &CStr, pixels: *mut [f32; 3]| {
                    let pixels = pixels.cast();
                    (api.set_image)(
                        filter,
                        name.as_ptr(),
                        pixels,
                        FLOAT3,
                        width,
                        height,
                        0,
                        0,
                        0,
                    );
                };
                for (name, pixels) in &mut inputs {
                    set(name, pixels.as_mut_ptr());
                }
                set(c"output", output.as_mut_ptr());
                (api.set_filter_bool)(filter, c"hdr".as_ptr(), true);
                (api.commit_filter)(filter);
                (api.execute_filter)(filter);
                (api.release_filter)(filter);
                api.error(self.device)
            }
        };
        if !failure.is_empty() {
            return Err(failure);
        }
        Ok(Image {
            width,
            height,
            channels: std::array::from_fn(|c| output.iter().map(|pixel| pixel[c]).collect()),
        })
    }
}

impl Api {
    /// `None` where a function is missing.
    fn of(library: &Library) -> Option<Self> {
        /// A function's pointer.
        ///
        /// # Safety
        /// `T` must be the type that the header has.
        unsafe fn function<T: Copy>(library: &Library, name: &CStr) -> Option<T> {
            // SAFETY: by the caller.
            unsafe { library.get::<T>(name.to_bytes_with_nul()) }
                .ok()
                .map(|f| *f)
        }
        // SAFETY: the types are those of the header of version 2.
        unsafe {
            Some(Self {
                new_device: function(library, c"oidnNewDevice")?,
                set_device_int: function(library, c"oidnSetDeviceInt")?,
                set_device_bool: function(library, c"oidnSetDeviceBool")?,
                get_device_int: function(library, c"oidnGetDeviceInt")?,
                commit_device: function(library, c"oidnCommitDevice")?,
                get_device_error: function(library, c"oidnGetDeviceError")?,
                new_filter: function(library, c"oidnNewFilter")?,
                release_filter: function(library, c"oidnReleaseFilter")?,
                set_image: function(library, c"oidnSetSharedFilterImage")?,
                set_filter_bool: function(library, c"oidnSetFilterBool")?,
                commit_filter: function(library, c"oidnCommitFilter")?,
                execute_filter: function(library, c"oidnExecuteFilter")?,
            })
        }
    }

    /// The last failure of a device, or of making one where it is null; empty if there is none.
    fn error(&self, device: *mut c_void) -> String {
        let mut message = std::ptr::null();
        // SAFETY: the library takes null for the failure of making a device; the message is its own text, which
        // lives until the next call from this thread.
        unsafe {
            if (self.get_device_error)(device, &mut message) == 0 {
                String::new()
            } else if message.is_null() {
                "failed".to_owned()
            } else {
                CStr::from_ptr(message).to_string_lossy().into_owned()
            }
        }
    }
}

/// Where the library is: as `GDPT_OIDN` says (a file, or a folder with it or its `lib`), or where `ffi/setup.sh` puts it,
/// or else where the system looks.
fn place() -> PathBuf {
    if let Some(named) = std::env::var_os("GDPT_OIDN").filter(|named| !named.is_empty()) {
        let named = PathBuf::from(named);
        let inside = [named.join(NAME), named.join("lib").join(NAME)];
        return inside.into_iter().find(|p| p.is_file()).unwrap_or(named);
    }
    let home = |name: &str| std::env::var_os(name).map(PathBuf::from);
    let data = home("XDG_DATA_HOME").or_else(|| Some(home("HOME")?.join(".local/share")));
    let own = data.map(|data| data.join("gdpt/oidn/lib").join(NAME));
    own.filter(|path| path.is_file())
        .unwrap_or_else(|| Path::new(NAME).to_owned())
}

/// The pixels one after the other.
fn interleaved(image: &Image) -> Vec<[f32; 3]> {
    let [r, g, b] = &image.channels;
    let pixels = r.iter().zip(g).zip(b);
    pixels.map(|((&r, &g), &b)| [r, g, b]).collect()
}
