//! Which pictures a call makes: each scene with where its picture goes.

use super::frames::{self, Frame};
use super::limits;
use crate::app::MADE_UP_FORMAT;
use crate::cli::{CropFlag, RenderArgs};
use crate::error::{Error, Result};
use crate::load::scene_name;
use crate::output::format::Format;
use crate::output::{check_outputs, is_stream};
use crate::part::{Part, Samples};
use std::fs;
use std::path::{Path, PathBuf};

/// A scene with where its picture goes.
pub(in crate::app::render) struct Target<'a> {
    pub(in crate::app::render) scene: &'a Path,
    pub(in crate::app::render) output: PathBuf,
    /// What the picture is written as; `None` where the output is a film.
    pub(in crate::app::render) format: Option<Format>,
    /// Which samples of it.
    pub(in crate::app::render) samples: Samples,
    /// With `--turntable`, the views that go to files in place of `output`.
    pub(in crate::app::render) frames: Option<Vec<Frame>>,
}

/// The extension of films.
const FILM: &str = "gdpt";

impl Target<'_> {
    /// Where the film goes, if it is no picture.
    pub(in crate::app::render) fn film(&self) -> Option<&Path> {
        self.format.is_none().then_some(&*self.output)
    }
}

/// The pictures that the flags ask for, all of which can be written. Folders are made.
pub(super) fn of_flags(args: &RenderArgs) -> Result<Vec<Target<'_>>> {
    if args.scenes.len() > 1 {
        let of_one_scene = [
            ("--preview", args.preview.is_some()),
            ("--stats", args.stats.is_some()),
            ("--checkpoint", args.checkpoint.is_some()),
        ];
        if let Some((flag, _)) = of_one_scene.iter().find(|(_, given)| *given) {
            let message = format!("{flag} is for one scene; render the scenes one by one");
            return Err(Error::Setting(message));
        }
    }
    let folder = folder(args)?;
    let targets = args.scenes.iter().map(|scene| {
        let (output, format) = match &folder {
            Some(folder) => {
                let format = args.format.unwrap_or(MADE_UP_FORMAT);
                let format = args.part.is_none().then_some(format);
                (folder.join(made_up(args, scene, format)), format)
            }
            None => {
                let output = args.output.clone().unwrap_or_default();
                let format = match output.extension() {
                    Some(extension) if extension.eq_ignore_ascii_case(FILM) => None,
                    _ => Some(Format::of(&output, args.format)?),
                };
                (output, format)
            }
        };
        let samples = limits::samples(args, format.is_none())?;
        if args.cryptomatte && format != Some(Format::Exr) {
            let message = "--cryptomatte makes layers: give -o a name that ends in .exr";
            return Err(Error::Setting(message.into()));
        }
        let frames = frames::of_flags(args, &output, format)?;
        // A film is asked about by itself.
        if folder.is_some() && format.is_some() {
            let files: Vec<&Path> = match &frames {
                Some(frames) => frames.iter().map(|frame| &*frame.file).collect(),
                None => vec![&output],
            };
            let in_working_folder = args.output.is_none();
            if let Some(file) = not_ours(scene, &files, in_working_folder) {
                let message = format!("is there already; -o {} replaces it", output.display());
                return Err(Error::input(file, None, message));
            }
        }
        Ok(Target {
            scene,
            output,
            format,
            samples,
            frames,
        })
    });
    let targets = targets.collect::<Result<Vec<_>>>()?;
    check(args, &targets)?;
    Ok(targets)
}

/// The name of a scene's picture, or of its film; of its parts and crops all have names of their own.
fn made_up(args: &RenderArgs, scene: &Path, format: Option<Format>) -> String {
    let mut name = scene_name(scene);
    if let (Some(frame), None) = (args.frame, format) {
        name += &format!("-{frame:03}");
    }
    if let Some(CropFlag { first, end }) = args.crop {
        name += &format!("-{}-{}-{}-{}", first.0, first.1, end.0, end.1);
    }
    if let Some(Part { number, parts }) = args.part {
        let digits = parts.to_string().len();
        name += &format!("-{number:0digits$}-of-{parts}");
    }
    let extension = format.map_or(FILM, Format::extension);
    format!("{name}.{extension}")
}

/// The folder for pictures whose names are made up of their scenes'; `None` where the picture has a name.
fn folder(args: &RenderArgs) -> Result<Option<PathBuf>> {
    let Some(output) = &args.output else {
        return Ok(Some(PathBuf::new()));
    };
    let ends_as_folder = output.to_string_lossy().ends_with(std::path::is_separator);
    if ends_as_folder {
        fs::create_dir_all(output).map_err(Error::io(output, "the folder cannot be made"))?;
    }
    if ends_as_folder || output.is_dir() {
        return Ok(Some(output.clone()));
    }
    if args.scenes.len() > 1 && !is_stream(output) {
        let message = "several scenes need a folder for their pictures: end its name with /";
        return Err(Error::input(output, None, message));
    }
    Ok(None)
}

/// A file that is there under a name that nobody gave, and is not to be written over: beside a scene, a
/// picture of its name may well be its texture. In another folder that was named it is taken for the picture
/// of an earlier call.
fn not_ours<'a>(scene: &Path, files: &[&'a Path], in_working_folder: bool) -> Option<&'a Path> {
    let folder = |path: &Path| {
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
        fs::canonicalize(parent.unwrap_or(Path::new("."))).ok()
    };
    let there = files.iter().find(|file| {
        file.symlink_metadata().is_ok() && (in_working_folder || folder(file) == folder(scene))
    });
    there.copied()
}

/// Checks all files together.
fn check(args: &RenderArgs, targets: &[Target]) -> Result<()> {
    let inputs: Vec<&Path> = args.scenes.iter().map(PathBuf::as_path).collect();
    let pictures = targets.iter().map(|target| match &target.frames {
        Some(frames) => &*frames[0].file,
        None => &*target.output,
    });
    // A film may be named as its own checkpoint.
    let is_film = |path: &Path| targets.iter().any(|target| target.film() == Some(path));
    let checkpoint = args.checkpoint.as_deref().filter(|path| !is_film(path));
    let others = [args.preview.as_deref(), args.stats.as_deref(), checkpoint];
    let outputs: Vec<&Path> = pictures.chain(others.into_iter().flatten()).collect();
    check_outputs(&inputs, &outputs)
}
