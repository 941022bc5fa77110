//! How often walks to light are made: as often as they pay.
//!
//! A walk costs rays and takes noise away; how much, depends on the scene. So before the first pass a few paths are
//! traced that walk wherever they can, and what they bring is written down. A path found with the densities p_b (BSDF
//! sampling) and p_w (walks) that adds v to a sample would add a second moment of v² (p_b + p_w) / (p_b + q p_w) if
//! only the share q of walks were made: so those few paths tell the variance for every share, and the rays that they
//! trace the cost. The shares with the least variance times cost are taken. The few paths are not in the picture, so it
//! stays unbiased, and they depend on scene, camera and settings alone, so its bits do too.

use super::{Context, Manifold, PathSettings, PathTracer, Step, Tile};
use crate::manifold::Through;
use crate::scene::Scene;
use crate::scene::reflectors::{Reflectors, Sequence};
use crate::sums::TileSums;
use crate::trace::{RayKind, Traverse};
use glam::Vec3;
use rayon::prelude::*;

/// Of the walks that may be made so many are, each in (0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares {
    /// Straight on through glass, from vertices in whose light samples' way there is some.
    pub passages: f32,
    /// By flat mirrors, from vertices to which they may show light.
    pub flat_mirrors: f32,
    /// By curved ones, or flat and curved ones.
    pub curved_mirrors: f32,
}

/// A kind of walks that has a share of its own. Those through balls of glass have none: by which of their ways walks go
/// depends on how bright these are already, and what they bring is too rare to be learned from few paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Passage,
    FlatMirrors,
    CurvedMirrors,
}

impl Kind {
    /// That of walks through these reflectors.
    pub(super) fn of(through: &Through, reflectors: &Reflectors) -> Option<Self> {
        match through {
            Through::Passage => Some(Self::Passage),
            Through::Mirrors(_) | Through::Microfacet(..) => {
                Some(Self::by_mirrors(&through.mirrors(), reflectors))
            }
            Through::Ball(..) => None,
        }
    }

    /// That of walks by these mirrors.
    #[inline]
    pub(super) fn by_mirrors(by: &Sequence, reflectors: &Reflectors) -> Self {
        if reflectors.are_flat(by) {
            Self::FlatMirrors
        } else {
            Self::CurvedMirrors
        }
    }
}

/// As many kinds as there are.
const KINDS: usize = 3;
/// Shares to choose from.
const CHOICE: [f32; 6] = [1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125];
/// Columns and rows of the tiles in which paths are traced, and samples there.
const TILE: [u32; 2] = [8, 4];
const SAMPLES: u64 = 4;
/// Most tiles.
const TILES: u32 = 256;
/// Of the picture's tiles at most one in so many.
const SPARSE: u32 = 16;
/// The paths of the picture are others.
const OTHER_SEED: u64 = 0x9e37_79b9_7f4a_7c15;
/// Rays of other kinds to which a walk's ray amounts, and one more for each walk: so much time they take, about.
const COST: f64 = 1.8;

impl Default for Shares {
    /// Where nothing has been learned.
    fn default() -> Self {
        Self {
            flat_mirrors: 0.1875,
            curved_mirrors: 0.1875,
            ..Self::ALL
        }
    }
}

impl Shares {
    /// All of them.
    pub const ALL: Self = Self {
        passages: 1.0,
        flat_mirrors: 1.0,
        curved_mirrors: 1.0,
    };

    /// Those with which paths in this scene have the least variance times cost. Pictures from differences are best with the
    /// same, or nearly: what walks leave out weighs on the reconstruction as rare bright samples.
    pub fn learn(scene: &Scene, tracer: &dyn Traverse, settings: &PathSettings) -> Self {
        if settings.manifold != Manifold::Auto || !settings.walks(scene) {
            return Self::default();
        }
        let tiles = tiles(scene.camera.width, scene.camera.height);
        let settings = PathSettings {
            seed: settings.seed ^ OTHER_SEED,
            ..*settings
        };
        let observe = |&tile: &Tile| Observed::of(scene, tracer, &settings, tile);
        let observed: Vec<Observed> = tiles.par_iter().map(observe).collect();
        Self::of_least_cost(&observed)
    }

    /// That of walks of a kind.
    #[inline]
    pub(super) fn of(&self, kind: Kind) -> f32 {
        match kind {
            Kind::Passage => self.passages,
            Kind::FlatMirrors => self.flat_mirrors,
            Kind::CurvedMirrors => self.curved_mirrors,
        }
    }

    /// In words.
    pub fn describe(&self) -> String {
        let Self {
            passages,
            flat_mirrors,
            curved_mirrors,
        } = self;
        format!(
            "{passages} of those straight on through glass, {flat_mirrors} of those by flat mirrors, \
             {curved_mirrors} of those by curved ones"
        )
    }

    fn of_least_cost(observed: &[Observed]) -> Self {
        // Errors are relative, as in relMSE: dark tiles count as much as bright ones.
        let mean = observed.iter().map(|o| o.mean).sum::<f64>() / observed.len() as f64;
        let floor = (0.05 * mean).powi(2).max(f64::MIN_POSITIVE);
        let (mut variance, mut moments) = (0.0, [[0.0; CHOICE.len()]; KINDS]);
        let (mut rays, mut walks, mut again) = (0.0, [0.0; KINDS], [0.0; KINDS]);
        for o in observed {
            let weight = 1.0 / (o.mean * o.mean + floor);
            variance += weight * o.variance;
            rays += o.rays as f64;
            for kind in 0..KINDS {
                walks[kind] += COST * o.ledger.walks[kind] as f64;
                again[kind] += COST * o.ledger.again[kind] as f64;
                for (moment, of_tile) in moments[kind].iter_mut().zip(&o.moments[kind]) {
                    *moment += weight * of_tile;
                }
            }
        }
        // Of what walks do not bring.
        let rest = (variance - moments.iter().map(|m| m[0]).sum::<f64>()).max(0.0);
        let mut best = (f64::INFINITY, [0; KINDS]);
        let all = 0..CHOICE.len();
        let some = all.clone().flat_map(|p| all.clone().map(move |f| [p, f]));
        for at in some.flat_map(|[p, f]| all.clone().map(move |c| [p, f, c])) {
            let of = |kind: usize| moments[kind][at[kind]];
            let noise = rest + (0..KINDS).map(of).sum::<f64>();
            let of = |kind: usize| f64::from(CHOICE[at[kind]]) * walks[kind] + again[kind];
            let cost = rays + (0..KINDS).map(of).sum::<f64>();
            if noise * cost < best.0 {
                best = (noise * cost, at);
            }
        }
        let [passages, mut flat_mirrors, mut curved_mirrors] = best.1.map(|at| CHOICE[at]);
        // Of a kind that has not been seen nothing is known; it is tried where the other is.
        if walks[Kind::FlatMirrors as usize] == 0.0 {
            flat_mirrors = curved_mirrors;
        } else if walks[Kind::CurvedMirrors as usize] == 0.0 {
            curved_mirrors = flat_mirrors;
        }
        Self {
            passages,
            flat_mirrors,
            curved_mirrors,
        }
    }
}

/// Tiles spread over a picture of this size.
fn tiles(width: u32, height: u32) -> Vec<Tile> {
    let [columns, rows] = [width.div_ceil(TILE[0]), height.div_ceil(TILE[1])];
    let all = columns * rows;
    let count = (all / SPARSE).clamp(1, TILES);
    let tile = |n: u32| {
        // One of each stretch of tiles, each time at another place of it.
        let [low, high] = [n, n + 1].map(|n| u64::from(n) * u64::from(all) / u64::from(count));
        let place = ((u64::from(n) * 0x9e37_79b9) >> 8) % (high - low);
        let number = (low + place) as u32;
        let [x, y] = [number % columns * TILE[0], number / columns * TILE[1]];
        Tile {
            x,
            y,
            width: TILE[0].min(width - x),
            height: TILE[1].min(height - y),
        }
    };
    (0..count).map(tile).collect()
}

/// What walks of plain paths cost and bring.
#[derive(Debug, Default)]
pub(super) struct Ledger {
    entries: Vec<Entry>,
    /// Rays of walks to light and number of these walks, by kind.
    walks: [u64; KINDS],
    /// The same of walks that ask whether they would have found what BSDF sampling has.
    again: [u64; KINDS],
}

/// Light of a kind that walks may find.
#[derive(Debug)]
struct Entry {
    kind: Kind,
    /// The number of the path.
    path: u32,
    light: Vec3,
    /// Density of BSDF sampling over that of walks; infinite where these do not find it.
    by_bsdf: f32,
}

impl Ledger {
    /// A walk to light has taken so many rays.
    pub(super) fn walk(&mut self, kind: Option<Kind>, rays: u32) {
        if let Some(kind) = kind {
            self.walks[kind as usize] += 1 + u64::from(rays);
        }
    }

    /// A walk to what BSDF sampling has found has.
    pub(super) fn walk_again(&mut self, kind: Option<Kind>, rays: u32) {
        if let Some(kind) = kind {
            self.again[kind as usize] += 1 + u64::from(rays);
        }
    }

    /// A path has gathered light; `by_bsdf` as in [`Entry`].
    pub(super) fn bring(&mut self, kind: Option<Kind>, path: u32, light: Vec3, by_bsdf: f32) {
        if let Some(kind) = kind {
            self.entries.push(Entry {
                kind,
                path,
                light,
                by_bsdf,
            });
        }
    }
}

/// What paths of a tile have shown.
struct Observed {
    /// The mean of their samples.
    mean: f64,
    /// The sum of the pixels' variances.
    variance: f64,
    /// The sum of second moments of what walks may find, for each share of them.
    moments: [[f64; CHOICE.len()]; KINDS],
    /// Rays but for those of walks.
    rays: u64,
    ledger: Ledger,
}

impl Observed {
    fn of(scene: &Scene, tracer: &dyn Traverse, settings: &PathSettings, tile: Tile) -> Self {
        let context = Context::new(scene, tracer, settings, Shares::ALL);
        let mut paths = PathTracer::<0>::default();
        paths.plain.ledger = Some(Ledger::default());
        let mut sums = TileSums::default();
        let pixels = (tile.width * tile.height) as usize;
        sums.reset(pixels);
        let mut of_pixels = vec![[0.0; 2]; pixels];
        let mut moments = [[0.0; CHOICE.len()]; KINDS];
        let mut ledger = Ledger::default();
        for sample in 0..SAMPLES {
            let mut weights = Vec::new();
            let watch = &mut |paths: &PathTracer<0>, step| {
                if let Step::HandedOver(_) = step {
                    let new = paths.shares[weights.len()..].iter();
                    weights.extend(new.map(|share| share.primal));
                }
            };
            paths.trace_in::<false, false>(context, tile, sample, &mut sums, watch);
            for (sums, of_pixel) in of_pixels.iter_mut().zip(&paths.samples) {
                let light = grey(of_pixel.primal);
                sums[0] += light;
                sums[1] += light * light;
            }
            let of_sample = paths.plain.ledger.replace(Ledger::default());
            let of_sample = of_sample.unwrap_or_default();
            for entry in &of_sample.entries {
                let light = grey(weights[entry.path as usize] * entry.light);
                for (moment, &share) in moments[entry.kind as usize].iter_mut().zip(&CHOICE) {
                    let more = if entry.by_bsdf.is_finite() {
                        (entry.by_bsdf + 1.0) / (entry.by_bsdf + share)
                    } else {
                        1.0
                    };
                    *moment += light * light * f64::from(more) / SAMPLES as f64;
                }
            }
            for kind in 0..KINDS {
                ledger.walks[kind] += of_sample.walks[kind];
                ledger.again[kind] += of_sample.again[kind];
            }
        }
        let n = SAMPLES as f64;
        let variance = |[sum, squares]: &[f64; 2]| (squares - sum * sum / n) / (n - 1.0);
        let rays = [&paths.counts, &paths.base.counts, &paths.plain.counts];
        let but_walks = |counts: &&super::Counts| {
            counts.rays.iter().sum::<u64>() - counts.rays[RayKind::Walk.index()]
        };
        Self {
            mean: of_pixels.iter().map(|sums| sums[0]).sum::<f64>() / (n * pixels as f64),
            variance: of_pixels.iter().map(variance).sum(),
            moments,
            rays: rays.iter().map(but_walks).sum(),
            ledger,
        }
    }
}

fn grey(light: Vec3) -> f64 {
    f64::from(light.element_sum() / 3.0)
}
