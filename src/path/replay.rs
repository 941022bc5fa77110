//! One sample of one pixel rendered again, step by step in words: what to look at where a sample is not
//! finite, or too bright.

use super::base::{BasePaths, Block};
use super::bounce::Flight;
use super::{Context, Counts, PathSettings, PathTracer, Shares, Step, Tile};
use crate::gradient::{Base, Neighbour, Offset, Weights};
use crate::lanes::Vector;
use crate::scene::Scene;
use crate::shift::{CarriedX8, Death};
use crate::sums::{PixelSample, TileSums};
use crate::trace::Traverse;
use crate::vertex::VerticesX8;
use glam::Vec3;
use wide::f32x8;

/// What a sample is made of.
#[derive(Clone, Debug)]
pub struct Replay {
    /// Line by line.
    pub lines: Vec<String>,
    /// The sample, to the bit as in a render.
    pub sample: PixelSample,
}

/// Renders sample `sample` of the pixel (`x`, `y`) with `N` = 4 offset paths, or none with `N` = 0: a tile of one
/// pixel, whose paths are in the first lane of the first block.
pub fn replay<const N: usize>(
    scene: &Scene,
    tracer: &dyn Traverse,
    settings: &PathSettings,
    (x, y): (u32, u32),
    sample: u64,
) -> Replay {
    let shares = Shares::learn(scene, tracer, settings);
    let context = Context::new(scene, tracer, settings, shares);
    let tile = Tile {
        x,
        y,
        width: 1,
        height: 1,
    };
    let mut sums = TileSums::default();
    sums.reset(1);
    let mut paths = PathTracer::<N>::default();
    let mut log = Log {
        lines: Vec::new(),
        deaths: [0; Death::ALL.len()],
        lit: Vec3::ZERO,
        shares: 0,
    };
    if context.walks {
        log.say(0, format!("walks to light: {}", shares.describe()));
    }
    // As in scenes that are not diffuse, where all is known of each vertex; the bits are the same.
    paths.trace_in::<false, false>(context, tile, sample, &mut sums, &mut |paths, step| {
        log.step(context, paths, step);
    });
    let weight = settings.position(sample).weight;
    let mut sample = paths.samples[0];
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

/// The lane that a replay looks at.
const LANE: usize = 0;

struct Log {
    lines: Vec<String>,
    /// Dead shifts that have been told.
    deaths: [u64; Death::ALL.len()],
    /// Light of the shared rest of the path that has been told.
    lit: Vec3,
    /// Shared rests that have been told.
    shares: usize,
}

/// A vector with so many digits that the number can be told.
fn vector(v: Vec3) -> String {
    format!("({:.6e}, {:.6e}, {:.6e})", v.x, v.y, v.z)
}

fn name(j: usize) -> &'static str {
    ["right", "left", "down", "up"][Neighbour::ALL[j] as usize]
}

fn carried(c: &CarriedX8) -> String {
    let throughput = vector(c.throughput.lane(LANE));
    let ratio = c.ratio.as_array()[LANE];
    format!("f(y)|T'|/p(x) {throughput}, p(y)|T'|/p(x) {ratio:.6e}")
}

fn is_set(lanes: u32) -> bool {
    lanes >> LANE & 1 == 1
}

fn surface(scene: &Scene, vertices: &VerticesX8) -> String {
    let class = if is_set(vertices.rough) {
        "rough"
    } else {
        "specular"
    };
    format!(
        "at {}, normal {}, material '{}' ({class})",
        vector(vertices.position.lane(LANE)),
        vector(vertices.normal.lane(LANE)),
        scene.materials[vertices.material(LANE) as usize].name
    )
}

/// The only lane of numbers for the gradient.
fn base_of(base: &Base<f32x8>) -> Base {
    Base {
        value: Vector::from(base.value.lane(LANE)),
        densities: base.densities.as_array()[LANE],
    }
}

fn shift_of(shift: &Offset<f32x8>) -> Offset {
    Offset {
        value: Vector::from(shift.value.lane(LANE)),
        densities: shift.densities.as_array()[LANE],
    }
}

impl Log {
    fn say(&mut self, indent: usize, text: String) {
        self.lines
            .push(format!("{:indent$}{text}", "", indent = 2 * indent));
    }

    fn step<const N: usize>(&mut self, context: Context, paths: &PathTracer<N>, step: Step) {
        let scene = context.scene;
        let weights = context.settings.weights;
        let base = &paths.base;
        match step {
            Step::Primary => self.primary(scene, base, &paths.samples[0]),
            Step::Light(k) => {
                if let [light] = &base.lights[..] {
                    let (base, shifts, lanes) = light.resolve(&base.shadow);
                    if is_set(lanes) {
                        let what = format!("x{k}: a point on a light");
                        self.complete(&what, &base, &shifts, weights);
                    }
                }
            }
            Step::Walked(k) => self.walked(context, paths, k),
            Step::WalkedAgain(k) => {
                if let ([flight], [block]) = (&base.flights[..], &base.blocks[..])
                    && is_set(flight.by_chain)
                {
                    self.walked(context, paths, k);
                    if !is_set(flight.walked) {
                        let (base, shifts) = flight.complete::<false>(block);
                        self.complete("no walk finds this path", &base, &shifts, weights);
                    }
                }
            }
            Step::Aimed(k) => {
                if let ([flight], [block]) = (&base.flights[..], &base.blocks[..]) {
                    if is_set(flight.alive) {
                        self.say(0, format!("x{k}: aimed at a point on a light"));
                        self.followed(scene, (flight, block), weights, k);
                    } else {
                        self.say(0, format!("x{k}: aimed at a light that is not seen"));
                    }
                    self.tell_deaths(&base.counts);
                }
            }
            Step::Followed(k) => {
                if let ([flight], [block]) = (&base.flights[..], &base.blocks[..]) {
                    self.followed(scene, (flight, block), weights, k);
                }
            }
            Step::Arrived(k) => self.arrived(scene, base, k),
            Step::HandedOver(_) => self.handed_over(paths),
            Step::Plain(k) => self.plain(scene, paths, k),
        }
    }

    /// Walks from x_k to light.
    fn walked<const N: usize>(&mut self, context: Context, paths: &PathTracer<N>, k: u32) {
        let weights = context.settings.weights;
        for walked in paths.base.walked(context, LANE) {
            self.say(0, format!("x{k}: {}", walked.text));
            if let Some((base, shifts)) = walked.complete {
                self.complete("what it brings", &base, &shifts, weights);
            }
        }
    }

    fn primary<const N: usize>(
        &mut self,
        scene: &Scene,
        base: &BasePaths<N>,
        sample: &PixelSample,
    ) {
        match &base.blocks[..] {
            [block] => {
                let met = surface(scene, &block.vertices);
                self.say(0, format!("x1: the camera sees a surface {met}"));
                self.tell_deaths(&base.counts);
                self.offsets(scene, base, block, 1);
            }
            _ => {
                let what = if sample.coverage > 0.0 {
                    "a light"
                } else if scene.shows_environment() {
                    "the environment"
                } else {
                    "the background"
                };
                let radiance = vector(sample.direct);
                self.say(
                    0,
                    format!("x1: the camera sees {what}, radiance {radiance}"),
                );
            }
        }
    }

    /// Where the offset paths are, before they scatter at vertex k.
    fn offsets<const N: usize>(
        &mut self,
        scene: &Scene,
        base: &BasePaths<N>,
        block: &Block<N>,
        k: u32,
    ) {
        for (j, offset) in block.offsets.iter().enumerate() {
            let c = carried(&offset.carried);
            let text = if is_set(offset.free()) {
                let at = surface(scene, &base.own[0][j]);
                format!("y{k} {at}; {c}")
            } else if is_set(offset.joined()) {
                format!("joined at x{k}; {c}")
            } else if is_set(offset.connected()) {
                format!("connected; {c}")
            } else {
                "dead".to_owned()
            };
            self.say(1, format!("{}: {text}", name(j)));
        }
    }

    /// The scattering at x_k, and how offset paths follow.
    fn followed<const N: usize>(
        &mut self,
        scene: &Scene,
        (flight, block): (&Flight<N>, &Block<N>),
        weights: Weights,
        k: u32,
    ) {
        if !is_set(flight.alive) {
            let text = format!("x{k}: the path ends (absorbed, or by roulette)");
            return self.say(0, text);
        }
        let s = &flight.scattering;
        let lobe = if is_set(s.transmits) {
            "transmission"
        } else {
            "reflection"
        };
        self.say(
            0,
            format!(
                "x{k}: scatters ({lobe}) along {}, BSDF with cosine {}, density {:.6e}",
                vector(s.wi.lane(LANE)),
                vector(s.value.lane(LANE)),
                s.pdf.as_array()[LANE]
            ),
        );
        let met = if is_set(flight.surfaces) {
            format!("a surface {}", surface(scene, &block.vertices))
        } else if is_set(flight.ends) {
            format!("light, radiance {}", vector(flight.radiance.lane(LANE)))
        } else {
            "nothing that leads to light".to_owned()
        };
        self.say(0, format!("x{}: {met}", k + 1));
        for (j, (offset, follower)) in block.offsets.iter().zip(&flight.followers).enumerate() {
            let how = if is_set(follower.blocked) {
                "is blocked"
            } else if is_set(follower.joins) {
                "reconnects"
            } else if is_set(follower.copies & follower.arrived) {
                "copies the half vector"
            } else if is_set(follower.copies) {
                "copies the half vector, which leads to something else"
            } else if is_set(offset.alive()) {
                "shares the direction"
            } else {
                continue;
            };
            let jacobian = if is_set(offset.free()) {
                follower.jacobian.as_array()[LANE]
            } else {
                1.0
            };
            let c = carried(&offset.carried);
            self.say(1, format!("{}: {how}, |T'| {jacobian:.6e}; {c}", name(j)));
        }
        if is_set(flight.ends & !flight.by_chain) {
            let (base, shifts) = flight.complete::<false>(block);
            self.complete("the light is reached", &base, &shifts, weights);
        }
    }

    /// The shifts that have died since this was told last.
    fn tell_deaths(&mut self, counts: &Counts) {
        for (death, told) in Death::ALL.into_iter().zip(self.deaths) {
            let count = counts.deaths[death as usize] - told;
            if count > 0 {
                self.say(1, format!("{count} dead: {}", death.name()));
            }
        }
        self.deaths = counts.deaths;
    }

    /// Where the paths are at x_{k+1}.
    fn arrived<const N: usize>(&mut self, scene: &Scene, base: &BasePaths<N>, k: u32) {
        self.tell_deaths(&base.counts);
        for &at in &base.live {
            let block = &base.blocks[at as usize];
            let throughput = vector(block.throughput.lane(LANE));
            self.say(0, format!("x{}: f/p {throughput}", k + 1));
            self.offsets(scene, base, block, k + 1);
        }
    }

    /// A complete path with its shifts, and what they add.
    fn complete(
        &mut self,
        what: &str,
        base: &Base<f32x8>,
        shifts: &[Offset<f32x8>],
        weights: Weights,
    ) {
        let base = base_of(base);
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
            let shift = &shift_of(shift);
            let (value, weight) = (vector(shift.value.into()), base.weight(shift, weights));
            let adds = vector(base.difference(shift, weights).into());
            let densities = shift.densities;
            let text = format!("Y {value}, densities {densities:.6e}, w {weight:.6e}; + {adds}");
            self.say(1, format!("{}: {text}", name(j)));
        }
    }

    fn handed_over<const N: usize>(&mut self, paths: &PathTracer<N>) {
        for share in &paths.shares[self.shares..] {
            let text =
                "all offset paths are connected or dead: what follows counts from f/p = 1 for all";
            self.say(0, text.to_owned());
            let primal = vector(share.primal);
            self.say(1, format!("primal: its light times {primal}"));
            for (j, to) in share.to.iter().enumerate() {
                self.say(1, format!("{}: its light times {}", name(j), vector(*to)));
            }
        }
        self.shares = paths.shares.len();
    }

    /// What the shared rest of the path has gathered, and where it is.
    fn plain<const N: usize>(&mut self, scene: &Scene, paths: &PathTracer<N>, k: u32) {
        let [lit] = paths.plain.gathered[..] else {
            return;
        };
        if lit != self.lit {
            let text = format!("x{k}: its light is now {}", vector(lit));
            self.say(0, text);
            self.lit = lit;
        }
        match paths.plain.first() {
            Some((vertices, throughput)) => {
                let (at, throughput) = (surface(scene, vertices), vector(throughput.lane(LANE)));
                self.say(0, format!("x{}: a surface {at}; f/p {throughput}", k + 1));
            }
            None => self.say(0, "it ends".to_owned()),
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
