//! Walks to light, for paths with offset paths and without: by what they are tried, with what probability, and what they
//! bring, in lanes.

use super::Context;
use crate::bsdf::ggx;
use crate::lanes::{Float, LANES, Vec3x8, lanes_of, lanes_where, mask_of, positive};
use crate::manifold::{Start, Through, Walks};
use crate::sampler::{self, Dimension, Sampler};
use crate::scene::Scene;
use crate::scene::light::Source;
use crate::scene::light_sample::{LightEnd, LightSamplesX8};
use crate::scene::reflectors::{Branch, Choice, Sequence, Target, Targets};
use crate::trace::rays::HitsX8;
use crate::vertex::{Interaction, VerticesX8};
use wide::f32x8;

/// The numbers for light sampling through mirrors at x_k.
pub(super) fn draw<'a>(
    samplers: impl IntoIterator<Item = &'a [Sampler; LANES]>,
    k: u32,
    numbers: &mut Vec<[f32x8; 4]>,
) {
    sampler::draw_blocks(samplers, Dimension::Mirrored(k), [0, 1, 2, 3], numbers);
}

/// Where a walk from the vertex in a lane, x_k, begins.
pub(super) fn start(vertices: &VerticesX8, lane: usize, k: u32) -> Start {
    Start {
        position: vertices.position.lane(lane),
        ng: vertices.ng.lane(lane),
        offset: vertices.offset.lane(lane),
        k,
    }
}

/// A walk to be made from a vertex in a lane: to where, and by what.
pub(super) type Way = (LightEnd, Through);

/// Walks to be made from eight vertices.
pub(super) type Ways = [Option<Way>; LANES];

/// Where samples of light are.
fn targets(light: &LightSamplesX8) -> Targets<f32x8> {
    Targets {
        place: light.position,
        distant: mask_of(light.far),
    }
}

/// Ways to samples of light by mirrors from the vertices x_k in `lanes`, where they are tried, and the probabilities
/// P(σ) of that; with `u` in [0, 1).
pub(super) fn by_mirrors(
    context: Context,
    (from, k): (Vec3x8, u32),
    samplers: &[Sampler; LANES],
    light: &LightSamplesX8,
    lanes: u32,
    u: f32x8,
) -> (Ways, f32x8) {
    let lanes = lanes & light.valid.to_bitmask();
    let targets = targets(light);
    let reflectors = &context.scene.reflectors;
    let Choice {
        by,
        mut probability,
    } = reflectors.choose(from, &targets, lanes, u, context.always());
    let mut ways = [None; LANES];
    for lane in lanes_of(lanes) {
        let (Some(end), Some(by)) = (light.lane(lane), by[lane]) else {
            continue;
        };
        let share = context.share(&by);
        if samplers[lane].coin(k) >= share {
            continue;
        }
        probability.set_lane(lane, probability.lane(lane) * share);
        let mut through = Through::Mirrors(by);
        if let Some((reflector, alpha)) = rough(context.scene, &by) {
            let [u0, u1, ..] = samplers[lane].draw(Dimension::Microfacet(k));
            through = Through::Microfacet(reflector, ggx::sample_any(alpha, [u0, u1]).into());
            let density = probability.lane(lane) * of_microfacet(context.scene, &through);
            probability.set_lane(lane, density);
        }
        ways[lane] = Some((end, through));
    }
    (ways, probability)
}

/// The reflector of a sequence that is a little rough, which is there alone, and its alpha.
fn rough(scene: &Scene, by: &Sequence) -> Option<(u32, f32)> {
    let &[reflector] = by.numbers() else {
        return None;
    };
    let alpha = scene.reflectors.alpha(reflector);
    (alpha > 0.0).then_some((reflector, alpha))
}

/// The density, per solid angle, of the normal of the microfacet that reflects, 1 where there is none: any of the
/// reflector, seen straight from above.
fn of_microfacet(scene: &Scene, through: &Through) -> f32 {
    match *through {
        Through::Microfacet(reflector, normal) => {
            let alpha = scene.reflectors.alpha(reflector);
            normal.z * ggx::density::<f32>(normal.into(), alpha)
        }
        Through::Passage | Through::Mirrors(_) | Through::Ball(..) => 1.0,
    }
}

/// The lanes of those `unseen` from which straight ways on through glass are tried, at x_k.
pub(super) fn straight_on(
    context: Context,
    samplers: &[Sampler; LANES],
    k: u32,
    unseen: u32,
) -> u32 {
    let share = context.shares.passages;
    if share == 1.0 {
        return unseen;
    }
    lanes_where(unseen, |lane| samplers[lane].coin(STRAIGHT_ON + k) < share)
}

/// The lanes of those `seen` from the points `from` to whose light slabs of glass lead as well, a step aside.
pub(super) fn steps_aside(scene: &Scene, from: Vec3x8, light: &LightSamplesX8, seen: u32) -> u32 {
    if seen == 0 || !scene.reflectors.have_slabs() {
        return 0;
    }
    lanes_where(seen, |lane| {
        let end = light.lane(lane);
        end.is_some_and(|end| {
            let way = scene.reflectors.aside(from.lane(lane), &end.target);
            way.is_some()
        })
    })
}

/// The first of the coins for straight ways on, beyond those for mirrors.
const STRAIGHT_ON: u32 = 1 << 20;

/// Calls `ask` with the ways to samples of light through balls of glass from the vertices x_k in `lanes`, where they are
/// tried: with the lane, the way and its probability P(σ).
#[inline(always)]
pub(super) fn by_balls(
    context: Context,
    (from, k): (Vec3x8, u32),
    samplers: &[Sampler; LANES],
    light: &LightSamplesX8,
    lanes: u32,
    mut ask: impl FnMut(usize, Way, f32),
) {
    let lanes = lanes & light.valid.to_bitmask();
    if lanes == 0 {
        return;
    }
    let targets = targets(light);
    let coins = f32x8::from_lanes(|lane| samplers[lane].coin(!k));
    for (reflector, ball) in context.scene.reflectors.balls() {
        // Lights that have their backs to all of it.
        let height = light
            .ng
            .dot(Vec3x8::splat(ball.sphere.centre) - light.position);
        let behind = height
            .simd_lt(f32x8::splat(-ball.sphere.radius))
            .to_bitmask();
        let lanes = lanes & !(behind & !light.far & !light.punctual);
        if lanes == 0 {
            continue;
        }
        let probabilities = ball.probabilities(from, &targets, context.always(), coins);
        // By reference: arrays of lanes that are taken apart by value are copied to and fro.
        for (&branch, probability) in Branch::ALL.iter().zip(&probabilities) {
            for lane in lanes_of(lanes & positive(*probability).to_bitmask()) {
                let probability = probability.lane(lane);
                if coins.lane(lane) < probability
                    && let Some(end) = light.lane(lane)
                {
                    ask(lane, (end, Through::Ball(*reflector, branch)), probability);
                }
            }
        }
    }
}

/// The probabilities P(σ) of trying these ways from the points `from`: of those by microfacets densities, in the
/// measure of their normals.
pub(super) fn probability(context: Context, from: Vec3x8, ways: &Ways) -> f32x8 {
    let reflectors = &context.scene.reflectors;
    let targets = || Targets::gather(|lane| ways[lane].as_ref().map(|(end, _)| end.target));
    // Straight on.
    let mut probability = f32x8::splat(context.shares.passages);
    let mirrors = ways.map(|way| {
        let by = way?.1.mirrors();
        (!by.numbers().is_empty()).then_some(by)
    });
    if mirrors.iter().any(Option::is_some) {
        let by_mirrors = reflectors.probability(&mirrors, from, &targets(), context.always());
        let lanes = (0..LANES).fold(0, |bits, lane| {
            bits | u32::from(mirrors[lane].is_some()) << lane
        });
        let share = |lane: usize| mirrors[lane].map_or(0.0, |by| context.share(&by));
        let mut by_mirrors = by_mirrors * f32x8::from_lanes(share);
        for (lane, way) in ways.iter().enumerate() {
            if let Some((_, through @ Through::Microfacet(..))) = way {
                let density = by_mirrors.lane(lane) * of_microfacet(context.scene, through);
                by_mirrors.set_lane(lane, density);
            }
        }
        probability = mask_of(lanes).select(by_mirrors, probability);
    }
    for &(reflector, ball) in reflectors.balls() {
        let through_it = |way: &Option<Way>| match *way {
            Some((_, Through::Ball(r, branch))) if r == reflector => Some(branch),
            _ => None,
        };
        if ways.iter().any(|way| through_it(way).is_some()) {
            let by_branch = ball.probabilities(from, &targets(), context.always(), f32x8::ZERO);
            for (lane, way) in ways.iter().enumerate() {
                if let Some(branch) = through_it(way) {
                    probability.set_lane(lane, by_branch[branch.number()].lane(lane));
                }
            }
        }
    }
    probability
}

/// The light that the ray in a lane has met, if light sampling could have chosen it.
pub(super) fn light_end(scene: &Scene, hits: &HitsX8, lane: usize) -> Option<LightEnd> {
    match Interaction::in_lane(scene, hits, lane) {
        Interaction::Light(light) => Some(LightEnd {
            target: Target::Surface {
                position: light.position,
                ng: light.ng,
                offset: light.offset,
            },
            radiance: light.radiance,
            source: scene.lights.of_triangle(light.triangle)?,
        }),
        Interaction::Environment(direction) => scene.environment.map().map(|_| LightEnd {
            target: Target::Direction(direction),
            radiance: scene.environment.radiance(direction),
            source: Source::Sky,
        }),
        Interaction::Surface(_) => None,
    }
}

/// The chains of eight vertices to light, in lanes.
pub(super) struct LinksX8 {
    /// Unit directions at the vertices.
    pub(super) wi: Vec3x8,
    /// What arrives per measure of the end: radiance, coefficients and 𝒢.
    pub(super) arriving: Vec3x8,
    /// The probabilities of the lobes, and 𝒢.
    pub(super) per_pdf: f32x8,
    /// The densities p_L P(σ), see [`probability`].
    pub(super) by_walk: f32x8,
    /// The lanes with a chain that is no longer than paths may be.
    pub(super) valid: u32,
    /// Of these the lanes whose last segment is free.
    pub(super) free: u32,
}

impl LinksX8 {
    /// What has become of `walks` in `lanes`, from the vertices `from`, which are x_k; `probability` is that of the
    /// ways, P(σ).
    pub(super) fn new(
        context: Context,
        solved: &Walks,
        (from, k): (&VerticesX8, u32),
        walks: &[u32; LANES],
        (ways, probability): (&Ways, f32x8),
        lanes: u32,
    ) -> Self {
        let mut links = Self {
            wi: Vec3x8::ZERO,
            arriving: Vec3x8::ZERO,
            per_pdf: f32x8::ZERO,
            by_walk: f32x8::ZERO,
            valid: 0,
            free: 0,
        };
        for lane in lanes_of(lanes) {
            let (Ok(link), Some((end, _))) = (solved.link(walks[lane]), &ways[lane]) else {
                continue;
            };
            if !fits(context, k, link.vertices) {
                continue;
            }
            links.wi.set(lane, link.wi);
            let falloff = context.scene.falloff(end.source, -link.arrival);
            let arriving = end.radiance * link.factor * (link.geometry * falloff);
            links.arriving.set(lane, arriving);
            // No ray meets a light without extent.
            if end.has_extent() {
                let per_pdf = link.probability * link.geometry;
                links.per_pdf.set_lane(lane, per_pdf);
            }
            let by_light = context.scene.light_density(end, from.position.lane(lane));
            links.by_walk.set_lane(lane, by_light);
            links.valid |= 1 << lane;
            links.free |= u32::from(link.free) << lane;
        }
        links.by_walk *= probability;
        links
    }
}

/// Whether a path whose chain begins at x_k is no longer than paths may be.
pub(super) fn fits(context: Context, k: u32, vertices: u32) -> bool {
    k + vertices < context.settings.depth
}

/// The light samples of a block, and the lanes from which they are not seen, or by way of slabs as well.
pub(super) type Unseen = (LightSamplesX8, u32);
