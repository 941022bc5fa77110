//! `gdpt reconstruct` from files to files.

use super::{COVERAGE, Ended, HALF_A, check_same_size, coverage_channel};
use super::{reconstruction, thread_pool};
use crate::cli::ReconstructArgs;
use crate::denoise::Features;
use crate::develop::Plate;
use crate::error::{Error, Result, Warnings};
use crate::estimate::{Estimate, Planes};
use crate::exposure::Metered;
use crate::film::Window;
use crate::image::Image;
use crate::load::environment::Background;
use crate::load::exr::{self, ExrFile};
use crate::output;
use crate::output::exr::Layers;
use crate::output::format::Format;
use crate::output::stats::{Shown, solving};
use crate::picture::{self, Direct};
use crate::progress::Reporter;
use crate::reconstruct::error_estimate::HalfPictures;
use crate::reconstruct::{Alpha, Kind, Solution, Source};
use glam::Vec3;
use std::path::Path;

/// What the files hold.
struct Input {
    /// All samples, or half A.
    first: Estimate,
    /// Half B.
    second: Option<Estimate>,
    samples: [u64; 2],
    direct: Direct,
    /// The share of each pixel that the scene covers.
    coverage: Vec<f32>,
    background: Background,
    /// Reflectance of what is seen, where it is known.
    albedo: Option<Image>,
    /// Normals of what is seen, where they are known.
    normal: Option<Image>,
    /// Layers and texts that the output takes over.
    rest: ExrFile,
}

/// Makes the picture again.
pub fn reconstruct(args: &ReconstructArgs) -> Result<Ended> {
    let inputs = [&args.input, &args.primal, &args.dx, &args.dy, &args.direct];
    let inputs: Vec<&Path> = inputs.into_iter().flatten().map(|p| p.as_path()).collect();
    output::check_outputs(&inputs, &[&args.output])?;
    let format = Format::of(&args.output, args.format)?;
    let pool = thread_pool(args.making.threads)?;
    let mut input = match (&args.input, &args.primal, &args.dx, &args.dy) {
        (Some(path), ..) => own_file(path)?,
        (None, Some(primal), Some(dx), Some(dy)) => {
            three_files(primal, dx, dy, args.direct.as_deref())?
        }
        _ => {
            let message = "needs the file of a render, or --primal, --dx and --dy";
            return Err(Error::Setting(message.into()));
        }
    };

    // Method.
    let has_halves = input.second.is_some();
    let kind = match args.reconstruct {
        Some(kind) if kind.needs_halves() && !has_halves => {
            let message = format!(
                "{} needs the two halves that a render's own file has",
                kind.name()
            );
            return Err(Error::Setting(message));
        }
        Some(kind) => kind,
        None if has_halves => Kind::Weighted,
        None => Kind::L2,
    };
    if args.making.alpha == Some(Alpha::Auto) && !has_halves {
        let message = "--alpha auto needs the variances that a render's own file has";
        return Err(Error::Setting(message.into()));
    }
    let mut warnings = Warnings::new(false);
    let threads = pool.current_num_threads();
    let method = reconstruction(kind, args.making.alpha, threads, &mut warnings)?;
    Reporter::new(args.making.quiet).warnings(warnings.list());

    // Picture.
    let Input {
        first,
        second,
        samples,
        direct,
        coverage,
        background,
        albedo,
        normal,
        rest,
    } = &mut input;
    let (width, height) = (first.primal.width, first.primal.height);
    let planes = |half: usize, channel: usize| -> Planes {
        let estimate = if half == 0 {
            Some(&*first)
        } else {
            second.as_ref()
        };
        estimate.map(|e| e.channel(channel)).unwrap_or_default()
    };
    let features = match (&*albedo, &*normal) {
        (Some(albedo), Some(normal)) if method.denoises() => Some(Features {
            albedo: albedo.clone(),
            normal: normal.clone(),
        }),
        _ => None,
    };
    let source = Source {
        size: (width, height),
        samples: *samples,
        planes: &planes,
        features: features.as_ref(),
    };
    let made = pool.install(|| picture::make(method, &source, direct));

    let plate = Plate {
        image: &made.image,
        coverage,
        background: *background,
    };
    let lit = || -> Vec<bool> {
        let primals = || [Some(&*first), second.as_ref()].into_iter().flatten();
        let is_lit = |pixel| primals().any(|e| e.primal.get(pixel) != Vec3::ZERO);
        (0..width * height).map(is_lit).collect()
    };
    let shown = (format != Format::Exr).then(|| Shown {
        exposure: args.making.exposure.stops(&Metered {
            image: &made.image,
            direct: &direct.all,
            lit: &lit(),
            coverage,
            albedo: albedo.as_ref(),
        }),
        tone: args.making.tone,
    });
    let depth = rest.channels.get("depth.Z");
    let nothing = depth.is_some_and(|depth| depth.iter().all(|&d| d == 0.0));

    // File.
    match (format, shown) {
        (Format::Display(encoding), Some(shown)) => plate
            .pixels(shown.exposure, shown.tone)
            .write(&args.output, encoding)?,
        _ => {
            let mut layers = Layers::default();
            layers.picture(&plate.linear());
            layers.channel(coverage_channel(plate.background), coverage.clone());
            if let Some(error) = &made.error {
                layers.colour("error", error);
            }
            let replaced = |name: &str| {
                ["R", "G", "B", "A", COVERAGE].contains(&name) || name.starts_with("error.")
            };
            for (name, values) in std::mem::take(&mut rest.channels) {
                if !replaced(&name) {
                    layers.channel(&name, values);
                }
            }
            let (name, alpha) = picture::describe(method);
            rest.texts.insert("gdpt.reconstruct".into(), name.into());
            rest.texts.insert("gdpt.alpha".into(), alpha);
            for (name, value) in rest.texts.iter().filter(|(_, value)| !value.is_empty()) {
                layers.attribute(name, value.clone());
            }
            layers.write_crop(&args.output, window(rest))?;
        }
    }
    if !args.making.quiet {
        let Solution {
            iterations,
            residual,
        } = made.solution;
        let mut text = solving(made.seconds, iterations, residual);
        if let Some(error) = made.rel_mse.filter(|_| !nothing) {
            text += &format!("\nestimated relMSE {error:.2e}");
        }
        if let Some(shown) = shown {
            text += &format!("\n{}", shown.summary());
        }
        let text = format!("{text}\nwrote {}\n", output::name_of(&args.output));
        output::print_beside(&[&args.output], &text)?;
    }
    Ok(Ended::Done)
}

/// Where its pixels are in a picture: a crop's at its place.
fn window(file: &ExrFile) -> Window {
    let (width, height) = (file.size.0 as u32, file.size.1 as u32);
    let place = u32::try_from(file.position.0)
        .ok()
        .zip(u32::try_from(file.position.1).ok());
    let crop = place.map(|(x, y)| Window {
        x,
        y,
        width,
        height,
        picture: (file.picture.0 as u32, file.picture.1 as u32),
    });
    crop.filter(Window::is_valid)
        .unwrap_or(Window::whole(width, height))
}

fn image(file: &ExrFile, path: &Path, layer: &str) -> Result<Image> {
    let channels = file.colour(layer).ok_or_else(|| {
        let dot = if layer.is_empty() { "" } else { "." };
        let message = format!("has no channels {layer}{dot}R, {layer}{dot}G, {layer}{dot}B");
        Error::input(path, None, message)
    })?;
    if !channels.iter().copied().flatten().all(|v| v.is_finite()) {
        let message = format!("has values that are not finite in '{layer}'");
        return Err(Error::input(path, None, message));
    }
    Ok(Image {
        width: file.size.0,
        height: file.size.1,
        channels: channels.map(Vec::clone),
    })
}

/// What `gdpt render` wrote.
fn own_file(path: &Path) -> Result<Input> {
    let file = exr::load(path)?;
    let samples = file.texts.get("gdpt.samples").and_then(|n| n.parse().ok());
    let Some(samples) = samples.filter(|&n: &u64| n > 0) else {
        let message = "is no file that gdpt render wrote; use --primal, --dx and --dy";
        return Err(Error::input(path, None, message));
    };
    // Of one sample there is none, which the file has as infinite.
    let variance = |layer: &str, known: bool| {
        if known {
            image(&file, path, layer)
        } else {
            Ok(unknown(file.size))
        }
    };
    let estimate = |prefix: &str, known| -> Result<Estimate> {
        let layer = |name: &str| image(&file, path, &format!("{prefix}{name}"));
        let variance = |name: &str| variance(&format!("{prefix}{name}_variance"), known);
        Ok(Estimate {
            primal: layer("primal")?,
            dx: layer("dx")?,
            dy: layer("dy")?,
            primal_variance: variance("primal")?,
            dx_variance: variance("dx")?,
            dy_variance: variance("dy")?,
        })
    };
    // Sample n belongs to half n mod 2.
    let halves = [samples.div_ceil(2), samples / 2];
    let known = |n: u64| n > 1;
    let all = estimate("", known(samples))?;
    let direct = image(&file, path, "direct")?;
    let background = background(&file, path)?;
    let coverage = coverage(&file, path, background)?;
    let albedo = file.colour("albedo").is_some();
    let albedo = albedo.then(|| image(&file, path, "albedo")).transpose()?;
    let normal = normal(&file);
    if halves[1] == 0 {
        return Ok(Input {
            first: all,
            second: None,
            samples: halves,
            direct: Direct {
                halves: HalfPictures::Alike([direct.clone(), direct.clone()]),
                all: direct,
            },
            coverage,
            background,
            albedo,
            normal,
            rest: file,
        });
    }
    let a = estimate(HALF_A, known(halves[0]))?;
    let direct_a = image(&file, path, &format!("{HALF_A}direct"))?;
    let b = rest_of(&all, &a, halves);
    let direct_b = other_mean(&direct, &direct_a, halves);
    Ok(Input {
        first: a,
        second: Some(b),
        samples: halves,
        direct: Direct {
            halves: HalfPictures::Alike([direct_a, direct_b]),
            all: direct,
        },
        coverage,
        background,
        albedo,
        normal,
        rest: file,
    })
}

/// The normals, if the file has any that are finite.
fn normal(file: &ExrFile) -> Option<Image> {
    let [x, y, z] = ["X", "Y", "Z"].map(|axis| file.channels.get(&format!("normal.{axis}")));
    let channels = [x?, y?, z?].map(Vec::clone);
    let finite = channels.iter().flatten().all(|v| v.is_finite());
    finite.then_some(Image {
        width: file.size.0,
        height: file.size.1,
        channels,
    })
}

/// What is behind the scene; the environment in files that say nothing of it.
fn background(file: &ExrFile, path: &Path) -> Result<Background> {
    let Some(text) = file.texts.get("gdpt.background") else {
        return Ok(Background::Environment);
    };
    text.parse()
        .map_err(|e| Error::input(path, None, format!("its background {e}")))
}

/// The share of each pixel that the scene covers.
fn coverage(file: &ExrFile, path: &Path, background: Background) -> Result<Vec<f32>> {
    let name = coverage_channel(background);
    match file.channels.get(name) {
        Some(channel) => {
            let share = |&c: &f32| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1.0) };
            Ok(channel.iter().map(share).collect())
        }
        None if background == Background::Environment => Ok(vec![1.0; file.size.0 * file.size.1]),
        None => {
            let message = format!("has the background {background}, but no channel {name}");
            Err(Error::input(path, None, message))
        }
    }
}

/// A variance that is not known.
fn unknown((width, height): (usize, usize)) -> Image {
    Image {
        width,
        height,
        channels: [(); 3].map(|()| vec![f32::INFINITY; width * height]),
    }
}

/// The mean of half B from the mean of all samples and of half A.
fn other_mean(all: &Image, a: &Image, [na, nb]: [u64; 2]) -> Image {
    combine(all, a, |all, a| {
        ((na + nb) as f64 * all - na as f64 * a) / nb as f64
    })
}

fn combine(x: &Image, y: &Image, f: impl Fn(f64, f64) -> f64) -> Image {
    let channel = |c: usize| {
        let pairs = x.channels[c].iter().zip(&y.channels[c]);
        pairs
            .map(|(x, y)| f(f64::from(*x), f64::from(*y)) as f32)
            .collect()
    };
    Image {
        width: x.width,
        height: x.height,
        channels: std::array::from_fn(channel),
    }
}

/// Half B from all samples and half A: undoes what [`crate::film::Film::estimate`] made of the sums.
fn rest_of(all: &Estimate, a: &Estimate, samples: [u64; 2]) -> Estimate {
    let [na, nb] = samples.map(|n| n as f64);
    let n = na + nb;
    // The sum of squares from the variance of a mean; `share` of the mean's square was subtracted.
    let squares = |variance: &Image, mean: &Image, n: f64, share: f64| {
        combine(variance, mean, |v, m| n * (v * (n - 1.0) + share * m * m))
    };
    let variance = |all: (&Image, &Image), a: (&Image, &Image), b: &Image, share: f64| {
        if samples[1] < 2 {
            return unknown((b.width, b.height));
        }
        let all = squares(all.0, all.1, n, share);
        let a = squares(a.0, a.1, na, share);
        let sum = combine(&all, &a, |all, a| all - a);
        combine(&sum, b, |sum, m| {
            ((sum / nb - share * m * m) / (nb - 1.0)).max(0.0)
        })
    };
    let primal = other_mean(&all.primal, &a.primal, samples);
    let dx = other_mean(&all.dx, &a.dx, samples);
    let dy = other_mean(&all.dy, &a.dy, samples);
    Estimate {
        primal_variance: variance(
            (&all.primal_variance, &all.primal),
            (&a.primal_variance, &a.primal),
            &primal,
            1.0,
        ),
        dx_variance: variance(
            (&all.dx_variance, &all.dx),
            (&a.dx_variance, &a.dx),
            &dx,
            0.5,
        ),
        dy_variance: variance(
            (&all.dy_variance, &all.dy),
            (&a.dy_variance, &a.dy),
            &dy,
            0.5,
        ),
        primal,
        dx,
        dy,
    }
}

/// Images of another renderer, one a file.
fn three_files(primal: &Path, dx: &Path, dy: &Path, direct: Option<&Path>) -> Result<Input> {
    let read = |path: &Path| -> Result<Image> { image(&exr::load(path)?, path, "") };
    let first = read(primal)?;
    let (width, height) = (first.width, first.height);
    let of_same_size = |path: &Path| {
        let image = read(path)?;
        check_same_size(path, &image, primal, &first)?;
        Ok(image)
    };
    let direct = match direct {
        Some(path) => of_same_size(path)?,
        None => Image::new(width, height),
    };
    Ok(Input {
        first: Estimate {
            dx: of_same_size(dx)?,
            dy: of_same_size(dy)?,
            primal: first,
            ..Estimate::new(width, height)
        },
        second: None,
        samples: [1, 0],
        direct: Direct {
            halves: HalfPictures::Alike([direct.clone(), direct.clone()]),
            all: direct,
        },
        coverage: vec![1.0; width * height],
        background: Background::Environment,
        albedo: None,
        normal: None,
        rest: ExrFile {
            size: (width, height),
            ..ExrFile::default()
        },
    })
}
