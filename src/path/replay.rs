//! One sample of one pixel rendered again, step by step in words: what to look at where a sample is not
//! finite, or too bright.

use super::bounce::{Progress, Step};
use super::{Context, PathSettings, PathTracer, Tile, Wavefront, trace_any, trace_closest};
use crate::gradient::{Base, Neighbour, Shift, Weights};
use crate::scene::Scene;
use crate::shift::{self, Carried, Death, Offset};
use crate::sums::{PixelSample, TileSums};
use crate::trace::{RayKind, Traverse};
use crate::vertex::{End, Vertex};
use glam::Vec3;

/// What a sample is made of.
#[derive(Clone, Debug)]
pub struct Replay {
    /// Line by line.
    pub lines: Vec<String>,
    /// The sample, to the bit as in a render.
    pub sample: PixelSample,
}

/// Renders sample `sample` of the pixel (`x`, `y`) with `N` = 4 offset paths, or none with `N` = 0.
pub fn replay<const N: usize>(
    scene: &Scene,
    tracer: &dyn Traverse,
    settings: &PathSettings,
    (x, y): (u32, u32),
    sample: u64,
) -> Replay {
    let context = Context {
        scene,
        tracer,
        settings,
        // The bits are the same.
        in_lanes: false,
    };
    let tile = Tile {
        x,
        y,
        width: 1,
        height: 1,
    };
    let mut sums = TileSums::default();
    sums.reset(1);
    let mut paths = PathTracer::<N>::default();
    let mut log = Log { lines: Vec::new() };

    // The steps are those of PathTracer::render.
    paths.front.samples.push(PixelSample::default());
    paths.front.primary_step(context, tile, sample, &mut sums);
    log.primary(&paths.front, context);
    log.hand_over(&mut paths, context, 1);
    for k in 1..settings.depth {
        if paths.is_done() {
            break;
        }
        log.step(&mut paths.front, context, k);
        log.step(&mut paths.suffixes, context, k);
        log.hand_over(&mut paths, context, k + 1);
    }
    log.suffix(&paths);
    paths.collect();
    let weight = settings.position(sample).weight;
    let mut sample = paths.front.samples[0];
    if weight != 1.0 {
        log.say(0, format!("all of it counts {weight} by the pixel filter"));
        sample.scale(weight);
    }
    log.sample(&sample, N);
    Replay {
        lines: log.lines,
        sample,
    }
}

struct Log {
    lines: Vec<String>,
}

/// A vector with so many digits that the number can be told.
fn vector(v: Vec3) -> String {
    format!("({:.6e}, {:.6e}, {:.6e})", v.x, v.y, v.z)
}

fn name(j: usize) -> &'static str {
    ["right", "left", "down", "up"][Neighbour::ALL[j] as usize]
}

fn carried(c: &Carried) -> String {
    let throughput = vector(c.throughput);
    format!("f(y)|T'|/p(x) {throughput}, p(y)|T'|/p(x) {:.6e}", c.ratio)
}

fn surface(scene: &Scene, v: &Vertex) -> String {
    let class = format!("{:?}", v.class(scene)).to_lowercase();
    format!(
        "at {}, normal {}, material '{}' ({class})",
        vector(v.position),
        vector(v.normal()),
        scene.materials[v.material as usize].name
    )
}

fn end(scene: &Scene, end: &End) -> String {
    match end {
        End::Surface(v) => format!("a surface {}", surface(scene, v)),
        End::Light(l) if l.front => {
            format!(
                "a light at {}, radiance {}",
                vector(l.position),
                vector(l.radiance)
            )
        }
        End::Light(l) => format!("the back of a light at {}", vector(l.position)),
        End::Environment(direction) => {
            let radiance = vector(scene.environment.radiance(*direction));
            format!("the environment, radiance {radiance}")
        }
    }
}

impl Log {
    fn say(&mut self, indent: usize, text: String) {
        self.lines
            .push(format!("{:indent$}{text}", "", indent = 2 * indent));
    }

    fn primary<const N: usize>(&mut self, front: &Wavefront<N>, context: Context) {
        let scene = context.scene;
        // The pixel itself: in the middle of its border, or first.
        let alone = N == 0 || context.scene.camera.lens.is_some();
        let own = if alone { 0 } else { 4 };
        if let Some(Some(met)) = front.ends.get(own) {
            let met = match met {
                End::Environment(_) if !scene.shows_environment() => "the background".to_owned(),
                met => end(scene, met),
            };
            self.say(0, format!("x1: the camera sees {met}"));
        }
        for path in &front.paths {
            self.offsets(scene, &path.offsets, 1);
        }
    }

    /// Where the offset paths are, before they scatter at vertex k.
    fn offsets(&mut self, scene: &Scene, offsets: &[Offset], k: u32) {
        for (j, offset) in offsets.iter().enumerate() {
            let text = match offset {
                Offset::Free { vertex, carried: c } => {
                    format!("y{k} {}; {}", surface(scene, vertex), carried(c))
                }
                Offset::Joined { carried: c, .. } => format!("joined at x{k}; {}", carried(c)),
                Offset::Connected(c) => format!("connected; {}", carried(c)),
                Offset::Dead => "dead".to_owned(),
            };
            self.say(1, format!("{}: {text}", name(j)));
        }
    }

    /// Light and bounce at x_k, as `Wavefront::step` does them.
    fn step<const N: usize>(&mut self, wave: &mut Wavefront<N>, context: Context, k: u32) {
        if wave.paths.is_empty() {
            return;
        }
        let scene = context.scene;
        let weights = context.settings.weights;

        // Light.
        wave.light_paths.clear();
        wave.light_step(context, k);
        for light_path in &wave.light_paths {
            let (base, shifts) = light_path.resolve(&wave.shadow);
            self.complete(
                &format!("x{k}: a point on a light"),
                &base,
                &shifts,
                weights,
            );
        }

        // Bounce.
        let deaths = wave.counts.deaths;
        wave.scatter(context, k);
        if wave.paths.is_empty() {
            self.say(0, format!("x{k}: the path ends (absorbed, or by roulette)"));
            return;
        }
        trace_closest(context, &mut wave.bounce, RayKind::Bounce, &mut wave.counts);
        wave.follow(context, k);
        let kind = RayKind::Reconnection;
        trace_any(context, &mut wave.reconnection, kind, &mut wave.counts);
        let kind = RayKind::Continuation;
        trace_closest(context, &mut wave.continuation, kind, &mut wave.counts);
        self.bounce(wave, scene, k);
        if let ([bounce], [path]) = (&wave.bounces[..], &wave.paths[..])
            && super::bounce::leads_to_light(context, &bounce.end, k)
            && !matches!(bounce.end, End::Surface(_))
        {
            let mut counts = wave.counts.clone();
            let rays = (&wave.reconnection, &wave.continuation);
            let (base, shifts) = bounce.complete(scene, path, rays.0, rays.1, &mut counts);
            self.complete("the light is reached", &base, &shifts, weights);
        }
        wave.arrive(context, k);
        for (before, death) in deaths.iter().zip(Death::ALL) {
            let count = wave.counts.deaths[death as usize] - before;
            if count > 0 {
                self.say(1, format!("{count} dead: {}", death.name()));
            }
        }
        for path in &wave.paths {
            let throughput = vector(path.throughput);
            self.say(0, format!("x{}: f/p {throughput}", k + 1));
            self.offsets(scene, &path.offsets, k + 1);
        }
    }

    /// The scattering at x_k, and how offset paths follow.
    fn bounce<const N: usize>(&mut self, wave: &Wavefront<N>, scene: &Scene, k: u32) {
        let ([bounce], [path]) = (&wave.bounces[..], &wave.paths[..]) else {
            return;
        };
        let s = &bounce.scattering;
        let lobe = format!("{:?}", s.lobe).to_lowercase();
        self.say(
            0,
            format!(
                "x{k}: scatters ({lobe}) along {}, BSDF with cosine {}, density {:.6e}",
                vector(s.wi),
                vector(s.eval.value),
                bounce.pdf
            ),
        );
        self.say(0, format!("x{}: {}", k + 1, end(scene, &bounce.end)));
        for (j, (offset, follower)) in path.offsets.iter().zip(&bounce.followers).enumerate() {
            let (how, c) = match &follower.progress {
                Progress::Dead => continue,
                Progress::Shared(c) => ("shares the direction".to_owned(), c),
                Progress::Reconnecting { ray, carried, .. } => {
                    let blocked = wave.reconnection.is_blocked(*ray);
                    let word = if blocked { "is blocked" } else { "reconnects" };
                    (word.to_owned(), carried)
                }
                Progress::Copying { ray, carried } => {
                    let direction = wave.continuation.ray(*ray).direction;
                    let met = End::new(scene, wave.continuation.hit(*ray), direction);
                    (
                        format!("copies the half vector and meets {}", end(scene, &met)),
                        carried,
                    )
                }
            };
            let jacobian = match offset {
                Offset::Free { vertex, .. } => {
                    let step = Step::of(scene, &path.vertex, bounce);
                    let shifted = step.and_then(|step| match step {
                        Step::Join(joint, _) => shift::reconnect(scene, &joint, vertex),
                        Step::Environment => shift::same_direction(scene, s.wi, vertex),
                        Step::Copy => shift::copy_half_vector(scene, &path.vertex, s, vertex),
                    });
                    shifted.map_or(f32::NAN, |shifted| shifted.jacobian)
                }
                _ => 1.0,
            };
            self.say(
                1,
                format!("{}: {how}, |T'| {jacobian:.6e}; {}", name(j), carried(c)),
            );
        }
    }

    /// A complete path with its shifts, and what they add.
    fn complete(&mut self, what: &str, base: &Base, shifts: &[Shift], weights: Weights) {
        self.say(
            0,
            format!(
                "{what}: F {}, densities {:.6e}; primal + {}",
                vector(base.value.into()),
                base.densities,
                vector(base.primal().into())
            ),
        );
        for (j, shift) in shifts.iter().enumerate() {
            let (value, weight) = (vector(shift.value.into()), base.weight(shift, weights));
            let adds = vector(base.difference(shift, weights).into());
            let densities = shift.densities;
            let text = format!("Y {value}, densities {densities:.6e}, w {weight:.6e}; + {adds}");
            self.say(1, format!("{}: {text}", name(j)));
        }
    }

    fn hand_over<const N: usize>(&mut self, paths: &mut PathTracer<N>, context: Context, k: u32) {
        let before = paths.shares.len();
        paths.hand_over(context, k);
        for share in &paths.shares[before..] {
            let text =
                "all offset paths are connected or dead: what follows counts from f/p = 1 for all";
            self.say(0, text.to_owned());
            self.say(
                1,
                format!("primal: its light times {}", vector(share.primal)),
            );
            for (j, to) in share.to.iter().enumerate() {
                self.say(1, format!("{}: its light times {}", name(j), vector(*to)));
            }
        }
    }

    /// What the shared rest of the path gathered.
    fn suffix<const N: usize>(&mut self, paths: &PathTracer<N>) {
        for gathered in &paths.suffixes.samples {
            self.say(0, format!("its light: {}", vector(gathered.primal)));
        }
    }

    fn sample(&mut self, sample: &PixelSample, shifts: usize) {
        self.say(0, "the sample:".to_owned());
        self.say(1, format!("seen directly {}", vector(sample.direct)));
        self.say(1, format!("primal {}", vector(sample.primal)));
        for (j, to) in sample.to.iter().take(shifts).enumerate() {
            self.say(1, format!("{}: {}", name(j), vector(*to)));
        }
        if !sample.is_finite() {
            self.say(1, "not finite: it is dropped".to_owned());
        }
    }
}
