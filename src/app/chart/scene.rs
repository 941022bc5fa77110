//! The references and the runs of one scene.

use super::Plan;
use crate::chart::report::{SceneReport, View};
use crate::chart::run::{Finished, Run};
use crate::chart::{Row, Tracing, name_of};
use crate::compare::{self, References};
use crate::error::Result;
use crate::gradient::Weights;
use crate::image::Image;
use crate::output::colour_map;
use crate::output::png::Pixels;
use crate::picture;
use crate::progress::Steps;
use crate::render::Method;
use crate::scene::Scene;
use crate::trace::{Backend, Traverse};
use xxhash_rust::xxh3::xxh3_64;

/// Seeds of the references, far from those of the runs.
const REFERENCE_SEEDS: [u64; 2] = [0x7265_6665_7265_6e63, 0x7265_6665_7265_6e64];
/// Differences are shown this much brighter than pictures, in stops.
const DIFFERENCE_STOPS: f32 = 2.0;

impl Plan<'_> {
    /// Measures one scene; `None` if it was interrupted.
    pub(super) fn scene(
        &self,
        name: &str,
        scene: &Scene,
        rows: &mut Vec<Row>,
        steps: &mut Steps,
    ) -> Result<Option<SceneReport>> {
        let scene_hash = scene.hash();

        // References.
        let backend = self.args.backends.first().copied();
        let backend = backend.unwrap_or(Backend::DEFAULT);
        let tracer = self.build(scene, backend)?;
        let mut references = Vec::new();
        for (index, seed) in REFERENCE_SEEDS.into_iter().enumerate() {
            steps.begin(&format!("{name}: reference {} of 2", index + 1));
            let tracing = Tracing {
                method: self.args.reference,
                weights: Weights::Mis,
                backend,
            };
            let run = self.run(scene, &*tracer, tracing, seed, self.reference_seconds);
            let what = format!("{name}-reference-{}", index + 1);
            let key = self.key(scene_hash, &run);
            let kept = self.store.images(&what, &key, &[""]);
            let image = match kept.and_then(|mut images| images.pop()) {
                Some(image) => image,
                None => match self.pool.install(|| run.reference(self.stop)) {
                    Some(image) => {
                        self.store.keep_images(&what, &key, &[("", &image)])?;
                        image
                    }
                    None => return Ok(None),
                },
            };
            references.push(image);
            steps.done(self.reference_seconds);
        }
        let references = References::Two(&references[0], &references[1]);

        // Runs.
        let reference = references.mean();
        let depends_on = (scene_hash, hash(&reference));
        let mut report = SceneReport {
            about: format!(
                "{}x{} pixels, {} triangles; two references of {} s each",
                scene.camera.width,
                scene.camera.height,
                scene.mesh.triangles.len(),
                self.reference_seconds
            ),
            views: vec![View {
                name: "reference".into(),
                picture: Pixels::tone_mapped(&reference, self.args.exposure),
                heat: None,
            }],
            differences: Vec::new(),
            name: name.to_owned(),
        };
        let mut built = (backend, tracer);
        for &tracing in &self.tracings {
            if built.0 != tracing.backend {
                built = (tracing.backend, self.build(scene, tracing.backend)?);
            }
            for seed in 0..self.args.seeds {
                let label = [name_of(tracing.method), name_of(tracing.weights)].join(" ");
                steps.begin(&format!(
                    "{name}: {label}, {}, seed {} of {}",
                    tracing.backend.name(),
                    seed + 1,
                    self.args.seeds
                ));
                let run = self.run(scene, &*built.1, tracing, seed, self.run_seconds);
                let Some((found, images)) = self.measure(name, &run, references, depends_on)?
                else {
                    return Ok(None);
                };
                if seed == 0 {
                    self.show(&found, &images, references, &mut report);
                }
                rows.extend(found);
                self.write_csv(rows)?;
                steps.done(self.run_seconds);
            }
        }
        Ok(Some(report))
    }

    fn build(&self, scene: &Scene, backend: Backend) -> Result<Box<dyn Traverse>> {
        backend.build(&scene.mesh, self.pool.current_num_threads())
    }

    fn run<'s>(
        &self,
        scene: &'s Scene,
        tracer: &'s dyn Traverse,
        tracing: Tracing,
        seed: u64,
        seconds: f64,
    ) -> Run<'s> {
        Run {
            scene,
            tracer,
            tracing,
            depth: self.args.depth,
            seed,
            sampler: self.args.sampler,
            seconds,
        }
    }

    /// All that a run depends on, but for the references.
    fn key(&self, scene_hash: u64, run: &Run) -> String {
        format!(
            "{scene_hash:016x} {:?} {:?} {} {}",
            run.tracing,
            run.settings(),
            run.seconds,
            self.pool.current_num_threads()
        )
    }

    /// A run's rows, and for the first seed its pictures and differences; from the store where it has
    /// them. `None` if it was interrupted.
    fn measure(
        &self,
        name: &str,
        run: &Run,
        references: References,
        (scene_hash, reference_hash): (u64, u64),
    ) -> Result<Option<(Vec<Row>, Vec<Image>)>> {
        let reconstructions = match run.tracing.method {
            Method::Pt => &self.primals,
            Method::Gpt => &self.reconstructions,
        };
        let what = format!(
            "{name}-{}-{}-{}",
            name_of(run.tracing.method),
            run.tracing.backend.name(),
            run.seed
        );
        let key = format!(
            "{} {reconstructions:?} {reference_hash:016x}",
            self.key(scene_hash, run)
        );
        let names = || reconstructions.iter().map(|&m| picture::describe(m).0);
        let layers: Vec<&str> = names().chain(["dx", "dy"]).collect();
        let with_pictures = run.seed == 0;
        if let Some(rows) = self.store.rows(&what, &key) {
            if !with_pictures {
                return Ok(Some((rows, Vec::new())));
            }
            if let Some(images) = self.store.images(&what, &key, &layers) {
                return Ok(Some((rows, images)));
            }
        }
        let measure = || run.measure(name, reconstructions, references, self.stop);
        let Some(finished) = self.pool.install(measure) else {
            return Ok(None);
        };
        let Finished {
            rows,
            pictures: mut images,
            estimate,
        } = finished;
        if with_pictures {
            images.extend([estimate.dx, estimate.dy]);
            let named = layers.iter().copied().zip(&images);
            self.store
                .keep_images(&what, &key, &named.collect::<Vec<_>>())?;
        }
        self.store.keep_rows(&what, &key, &rows)?;
        Ok(Some((rows, images)))
    }

    /// Adds what the first run of a kind made to the report.
    fn show(
        &self,
        rows: &[Row],
        images: &[Image],
        references: References,
        report: &mut SceneReport,
    ) {
        let [pictures @ .., dx, dy] = images else {
            return;
        };
        for (row, picture) in rows.iter().filter(|r| r.last).zip(pictures) {
            let errors = compare::relative_errors(picture, references);
            report.views.push(View {
                name: format!("{} ({:.1} s)", row.curve(), row.seconds),
                picture: Pixels::tone_mapped(picture, self.args.exposure),
                heat: Some(colour_map::heat_map(&errors, picture.width)),
            });
        }
        let is_pt = rows.iter().any(|r| r.method == name_of(Method::Pt));
        if !is_pt && report.differences.is_empty() {
            let exposure = self.args.exposure + DIFFERENCE_STOPS;
            for (name, image) in [("to the right", dx), ("downwards", dy)] {
                let pixels = colour_map::signed(image, exposure);
                report.differences.push((name.to_owned(), pixels));
            }
        }
    }
}

/// A fingerprint of an image.
fn hash(image: &Image) -> u64 {
    let values = image.channels.iter().flatten();
    xxh3_64(&values.flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
}
