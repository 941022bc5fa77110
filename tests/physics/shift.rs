//! The shift of one scattering event: T⁻¹(T(x)) = x for every kind, and analytic Jacobians against
//! numeric determinants, over geometry, roughness and index.

use crate::common::{self, polygons};
use gdpt::bsdf::{Bsdf, Eval, Evals, Lobe};
use gdpt::frame::Frame;
use gdpt::lanes::Vec3x8;
use gdpt::load::{mtl::MtlMaterial, sidecar::CameraTable};
use gdpt::scene::{Scene, SceneSettings};
use gdpt::shift::{self, Death, JointsX8, ShiftedX8};
use gdpt::vertex::{ScatteringX8, Vertex, VerticesX8};
use glam::{Vec2, Vec3};
use proptest::prelude::*;
use wide::f32x8;

/// A direction of an offset path: what all lanes say, as all have the same vertices here.
struct Shifted {
    wi: Vec3,
    jacobian: f32,
}

impl Shifted {
    fn of(lanes: &ShiftedX8) -> Result<Self, Death> {
        let valid = lanes.eval.valid.to_bitmask();
        assert!(valid == 0 || valid == 255 && lanes.no_lobe == 0);
        if valid == 0 {
            let no_lobe = lanes.no_lobe & 1 == 1;
            return Err(if no_lobe { Death::Lobe } else { Death::Side });
        }
        assert_eq!(lanes.wi.lane(0), lanes.wi.lane(7));
        Ok(Self {
            wi: lanes.wi.lane(0),
            jacobian: lanes.jacobian.as_array()[5],
        })
    }
}

/// What all lanes say.
fn held(eval: &Evals<f32x8>) -> Option<Eval> {
    (eval.valid.to_bitmask() == 255).then(|| Eval {
        value: eval.value.lane(3),
        pdf: eval.pdf.as_array()[3],
    })
}

/// Seen from where the vertex was met.
fn eval_alone(scene: &Scene, at: &Vertex, wi: Vec3) -> Option<Eval> {
    held(&VerticesX8::splat(scene, at).eval::<false>(scene, Vec3x8::splat(wi)))
}

fn eval_seen_from(scene: &Scene, at: &Vertex, wo: Vec3, wi: Vec3) -> Option<Eval> {
    let at = VerticesX8::splat(scene, at);
    let (wo, wi) = (Vec3x8::splat(wo), Vec3x8::splat(wi));
    held(&at.eval_seen_from::<false>(scene, wo, wi))
}

fn normal(scene: &Scene, at: &Vertex) -> Vec3 {
    VerticesX8::splat(scene, at).normal.lane(0)
}

fn frame(scene: &Scene, at: &Vertex) -> Frame {
    Frame::new(normal(scene, at).into())
}

fn copy_half_vector(
    scene: &Scene,
    x: &Vertex,
    scattering: &ScatteringX8,
    y: &Vertex,
) -> Result<Shifted, Death> {
    let [x, y] = [x, y].map(|v| VerticesX8::splat(scene, v));
    Shifted::of(&shift::copy_half_vector(scene, &x, scattering, &y))
}

/// Joins `y` to the point `next` on a surface with normal `ng`, which `x` sees in the direction `wi`.
fn reconnect(
    scene: &Scene,
    (x, wi): (&Vertex, Vec3),
    (next, ng): (Vec3, Vec3),
    y: &Vertex,
) -> Result<Shifted, Death> {
    let [from, wi, next, ng] = [x.position, wi, next, ng].map(Vec3x8::splat);
    let joints = JointsX8::new(from, wi, next, ng, 0);
    let y = VerticesX8::splat(scene, y);
    Shifted::of(&shift::reconnect::<false>(scene, &joints, &y))
}

fn same_direction(scene: &Scene, wi: Vec3, y: &Vertex) -> Result<Shifted, Death> {
    let [wi, zero] = [wi, Vec3::ZERO].map(Vec3x8::splat);
    let joints = JointsX8::new(zero, wi, zero, zero, 255);
    let y = VerticesX8::splat(scene, y);
    Shifted::of(&shift::reconnect::<false>(scene, &joints, &y))
}

/// A scene with these materials; those that are transparent are solid.
fn scene(materials: Vec<MtlMaterial>) -> Scene {
    scene_with_panes(materials, &[])
}

/// The same, in which these of the materials are on triangles of their own, so that they are thin.
fn scene_with_panes(mut materials: Vec<MtlMaterial>, panes: &[usize]) -> Scene {
    let corners: &[[f32; 3]] = &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut triangles = vec![(corners, materials.len())];
    materials.push(common::lambert(0.5));
    let apart: Vec<_> = (0..panes.len())
        .map(|i| [0, 1, 2].map(|c| [corners[c][0], corners[c][1], 2.0 + i as f32]))
        .collect();
    triangles.extend(apart.iter().zip(panes).map(|(t, &m)| (t.as_slice(), m)));
    let settings = SceneSettings {
        camera: CameraTable {
            origin: Some([0.0, 0.0, 5.0]),
            ..Default::default()
        },
        size: (4, 4),
        environment: Default::default(),
        roughness_threshold: 0.05,
        ..Default::default()
    };
    polygons(&triangles, materials, &settings)
}

fn metal(roughness: f32) -> MtlMaterial {
    MtlMaterial {
        pm: Some(1.0),
        pr: Some(roughness),
        ks: Some([0.9; 3]),
        ..Default::default()
    }
}

fn plastic(roughness: f32) -> MtlMaterial {
    MtlMaterial {
        kd: Some([0.5; 3]),
        pr: Some(roughness),
        ..Default::default()
    }
}

fn glass(roughness: f32, index: f32) -> MtlMaterial {
    MtlMaterial {
        illum: Some(7),
        pr: Some(roughness),
        ni: Some(index),
        ..Default::default()
    }
}

/// Lambert that lets light pass straight through in part.
fn half_open(opacity: f32) -> MtlMaterial {
    MtlMaterial {
        opacity: Some(opacity),
        ..common::lambert(0.5)
    }
}

fn vertex(scene: &Scene, position: Vec3, normal: Vec3, wo: Vec3, material: u32) -> Vertex {
    Vertex {
        position,
        ng: normal,
        ns: normal,
        wo,
        offset: 1e-6,
        material,
        parameters: scene.materials[material as usize].parameters,
    }
}

/// A triangle whose normals lean far over: many directions see it from the front and its shading normal
/// from behind. What base and offset path say of the vertex that they share must not depend on which of
/// them came first.
#[test]
fn a_shared_vertex_looks_the_same_to_both_paths() {
    let mut rng = common::Rng(6);
    let (mut differ, mut alive) = (0, 0);
    for material in [common::lambert(0.5), metal(0.6), glass(0.6, 1.5)] {
        let settings = SceneSettings {
            size: (4, 4),
            environment: Vec3::ONE.into(),
            roughness_threshold: 0.05,
            ..Default::default()
        };
        let mut warnings = gdpt::error::Warnings::new(true);
        let obj = gdpt::load::obj::ObjFile {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            normals: vec![
                Vec3::new(2.0, 0.0, 1.0),
                Vec3::new(1.5, 0.5, 1.0),
                Vec3::new(2.0, -0.5, 1.0),
            ],
            normal_triangles: vec![[0, 1, 2]],
            material_of: vec![0],
            materials: vec![material],
            ..Default::default()
        };
        let scene = Scene::build(std::path::Path::new("x"), obj, &settings, &mut warnings).unwrap();
        for _ in 0..5000 {
            let hit = gdpt::trace::rays::Hit {
                triangle: 0,
                u: 0.3,
                v: 0.3,
                t: 1.0,
            };
            let (x_wo, y_wo) = (rng.unit_vector(), rng.unit_vector());
            if x_wo.z * y_wo.z <= 0.0 {
                continue; // the shift is dead
            }
            let seen = |wo: Vec3| match gdpt::vertex::Interaction::new(&scene, Some(hit), -wo) {
                gdpt::vertex::Interaction::Surface(v) => v,
                other => panic!("{other:?}"),
            };
            let (x, y) = (seen(x_wo), seen(y_wo));
            let wi = rng.unit_vector();
            let by_y = eval_alone(&scene, &y, wi);
            assert_eq!(eval_seen_from(&scene, &x, y_wo, wi), by_y);
            assert_eq!(
                eval_seen_from(&scene, &y, x_wo, wi),
                eval_alone(&scene, &x, wi)
            );
            differ += u32::from(normal(&scene, &x) != normal(&scene, &y));
            alive += u32::from(by_y.is_some());
        }
    }
    assert!(differ > 500 && alive > 500, "{differ} {alive}");
}

/// A unit vector within 90° of `n`, from two numbers in [0, 1); `keep` keeps it off the horizon.
fn upper(n: Vec3, u: (f32, f32), keep: f32) -> Vec3 {
    let z = keep + (1.0 - keep) * u.0;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let phi = std::f32::consts::TAU * u.1;
    to_world(
        &Frame::new(n.into()),
        Vec3::new(r * phi.cos(), r * phi.sin(), z),
    )
}

fn to_world(frame: &Frame, v: Vec3) -> Vec3 {
    Vec3::from(frame.to_world(v.into())).normalize()
}

fn to_local(frame: &Frame, v: Vec3) -> Vec3 {
    frame.to_local(v.into()).into()
}

fn scattering(scene: &Scene, at: &Vertex, wi: Vec3, lobe: Lobe) -> ScatteringX8 {
    let eval = eval_alone(scene, at, wi).unwrap_or(Eval {
        value: Vec3::ONE,
        pdf: 1.0,
    });
    let frame = frame(scene, at);
    let local_wi = to_local(&frame, wi);
    let local_wo = to_local(&frame, at.wo);
    let straight = match lobe {
        Lobe::Reflection => Vec3::new(-local_wo.x, -local_wo.y, local_wo.z),
        Lobe::Transmission => -local_wo,
    };
    let bsdf = at.bsdf(scene);
    let single = bsdf.eval_delta(local_wo, lobe).is_some();
    let delta = matches!(bsdf, Bsdf::Mirror { .. } | Bsdf::Glass { .. })
        || (single && local_wi.abs_diff_eq(straight, 1e-4));
    let lanes = |yes: bool| if yes { 255 } else { 0 };
    ScatteringX8 {
        wi: Vec3x8::splat(wi),
        local_wi: Vec3x8::splat(local_wi),
        value: Vec3x8::splat(eval.value),
        pdf: f32x8::splat(eval.pdf),
        valid: 255,
        delta: lanes(delta),
        transmits: lanes(lobe == Lobe::Transmission),
    }
}

/// |dω_y/dω_x| by central differences in tangent planes; None where the shift bends too strongly for these, as near the
/// grazing directions that refraction ends in: those of the whole and of half a step differ.
fn numeric_jacobian(wi: Vec3, shift: impl Fn(Vec3) -> Option<Vec3>) -> Option<f64> {
    const STEP: f32 = 2e-3;
    let tangents = |n: Vec3| {
        let frame = Frame::<f32>::new(n.into());
        [frame.s, frame.t].map(Vec3::from)
    };
    let ([s, t], to) = (tangents(wi), tangents(shift(wi)?));
    let with_step = |step: f32| {
        let column = |axis: Vec3| -> Option<Vec2> {
            let at = |sign: f32| shift((wi + axis * (sign * step)).normalize());
            let difference = (at(1.0)? - at(-1.0)?) / (2.0 * step);
            Some(Vec2::new(difference.dot(to[0]), difference.dot(to[1])))
        };
        Some(f64::from(column(s)?.perp_dot(column(t)?)).abs())
    };
    let (whole, half) = (with_step(STEP)?, with_step(STEP / 2.0)?);
    // What is left at half a step is a third of the difference.
    ((whole / half - 1.0).abs() < 0.03).then_some(half)
}

fn pair() -> impl Strategy<Value = (f32, f32)> {
    (0.02f32..0.98, 0.0f32..1.0)
}

/// Two neighbouring vertices: a small step and a slightly turned normal.
#[derive(Debug, Clone)]
struct Neighbours {
    normal: (f32, f32),
    turn: (f32, f32),
    wo: (f32, f32),
    step: (f32, f32, f32),
}

fn neighbours() -> impl Strategy<Value = Neighbours> {
    let small = -0.15f32..0.15;
    (
        pair(),
        (small.clone(), small.clone()),
        pair(),
        (small.clone(), small.clone(), small),
    )
        .prop_map(|(normal, turn, wo, step)| Neighbours {
            normal,
            turn,
            wo,
            step,
        })
}

impl Neighbours {
    /// `side` is -1 for paths that come from behind the surface.
    fn vertices(&self, scene: &Scene, side: f32, materials: (u32, u32)) -> (Vertex, Vertex) {
        let n = upper(Vec3::Z, self.normal, 0.1);
        let f = Frame::<f32>::new(n.into());
        let m = (n + Vec3::from(f.s * self.turn.0 + f.t * self.turn.1)).normalize();
        let wo = upper(n * side, self.wo, 0.2);
        let step = Vec3::new(self.step.0, self.step.1, self.step.2);
        let y_wo = (wo + step * 0.5).normalize();
        (
            vertex(scene, Vec3::ZERO, n, wo, materials.0),
            vertex(scene, step, m, y_wo, materials.1),
        )
    }
}

/// Shifts there and back: the way back must succeed, end where it began, and undo the Jacobian.
fn check_round_trip(
    wi: Vec3,
    there: &Shifted,
    back: Result<Shifted, Death>,
    tolerance: f32,
) -> Result<(), TestCaseError> {
    let back = back.map_err(|d| TestCaseError::fail(format!("the way back is dead: {d:?}")))?;
    prop_assert!(
        (back.wi - wi).length() < tolerance,
        "{} instead of {}",
        back.wi,
        wi
    );
    let product = there.jacobian * back.jacobian;
    prop_assert!(
        (product - 1.0).abs() < 50.0 * tolerance,
        "Jacobians multiply to {product}"
    );
    Ok(())
}

fn check_copy(
    scene: &Scene,
    x: &Vertex,
    y: &Vertex,
    wi: Vec3,
    lobe: Lobe,
    numeric: bool,
) -> Result<bool, TestCaseError> {
    let shift = |wi: Vec3| copy_half_vector(scene, x, &scattering(scene, x, wi, lobe), y);
    let Ok(there) = shift(wi) else {
        return Ok(false);
    };
    let back = copy_half_vector(scene, y, &scattering(scene, y, there.wi, lobe), x);
    check_round_trip(wi, &there, back, 1e-3)?;
    if numeric {
        let Some(jacobian) = numeric_jacobian(wi, |wi| shift(wi).ok().map(|s| s.wi)) else {
            return Ok(false);
        };
        let error = (f64::from(there.jacobian) / jacobian - 1.0).abs();
        prop_assert!(
            error < 0.03,
            "{} against numeric {jacobian}",
            there.jacobian
        );
    }
    Ok(true)
}

proptest! {
    #![proptest_config(common::cases(1000))]

    #[test]
    fn reconnection(n in neighbours(), next_normal in pair(), direction in pair(), distance in 0.5f32..3.0) {
        let scene = scene(vec![common::lambert(0.5)]);
        let (x, y) = n.vertices(&scene, 1.0, (0, 0));
        let wi = upper(x.ng, direction, 0.1);
        let ng = upper(-wi, next_normal, 0.3);
        let next = x.position + wi * distance;
        let join = |x: &Vertex, wi, y: &Vertex| reconnect(&scene, (x, wi), (next, ng), y);
        let Ok(there) = join(&x, wi, &y) else {
            return Err(TestCaseError::reject("not shiftable"));
        };
        check_round_trip(wi, &there, join(&y, there.wi, &x), 1e-5)?;
        // The base direction moves the point on the plane at x_{k+1}; the offset direction follows.
        let jacobian = numeric_jacobian(wi, |w| {
            let t = (next - x.position).dot(ng) / w.dot(ng);
            Some((x.position + w * t - y.position).normalize())
        }).unwrap();
        let error = (f64::from(there.jacobian) / jacobian - 1.0).abs();
        prop_assert!(error < 0.02, "{} against numeric {jacobian}", there.jacobian);
    }

    #[test]
    fn same_direction_to_the_environment(n in neighbours(), direction in pair()) {
        let scene = scene(vec![common::lambert(0.5)]);
        let (x, y) = n.vertices(&scene, 1.0, (0, 0));
        let wi = upper(x.ng, direction, 0.05);
        let Ok(there) = same_direction(&scene, wi, &y) else {
            return Err(TestCaseError::reject("not shiftable"));
        };
        check_round_trip(wi, &there, same_direction(&scene, there.wi, &x), 1e-6)?;
        prop_assert_eq!(there.jacobian, 1.0);
    }

    /// Rough metal to rough metal; and before a specular vertex Lambert to Lambert, and what plastic scatters
    /// from rough coats and from below smooth ones.
    #[test]
    fn reflection_copies(n in neighbours(), wi in pair(), pr in (0.1f32..1.0, 0.1f32..1.0), which in 0usize..4) {
        let scene = scene(vec![
            metal(pr.0), metal(pr.1), common::lambert(0.5), plastic(pr.0.max(0.2)), plastic(0.0)
        ]);
        let materials = [(0, 1), (2, 2), (3, 4), (4, 2)][which];
        for side in [1.0, -1.0] {
            let (x, y) = n.vertices(&scene, side, materials);
            let wi = upper(x.ng * side, wi, 0.1);
            if !check_copy(&scene, &x, &y, wi, Lobe::Reflection, true)? {
                return Err(TestCaseError::reject("not shiftable"));
            }
        }
    }

    /// Refraction between two rough glasses of different index, in both directions. Microfacet
    /// normals are drawn near the surface normal, so that most can be shifted.
    #[test]
    fn refraction_copies(
        n in neighbours(), facet in (0.8f32..1.0, 0.0f32..1.0), index in (1.1f32..2.2, 1.1f32..2.2),
        same in any::<bool>(), inside in any::<bool>(),
    ) {
        let other = if same { index.0 } else { index.1 };
        let scene = scene(vec![glass(0.5, index.0), glass(0.6, other)]);
        let side = if inside { -1.0 } else { 1.0 };
        let (x, y) = n.vertices(&scene, side, (0, 1));
        let h = upper(x.ng * side, facet, 0.7);
        let eta = if inside { 1.0 / index.0 } else { index.0 };
        let (wi, bends) = gdpt::bsdf::fresnel::refract::<f32>(x.wo.into(), h.into(), eta);
        if !bends {
            return Err(TestCaseError::reject("total internal reflection"));
        }
        let wi = Vec3::from(wi);
        if x.wo.dot(h) < 0.2 || wi.dot(h).abs() < 0.2 || eval_alone(&scene, &x, wi).is_none() {
            return Err(TestCaseError::reject("grazing"));
        }
        // A tilted facet may refract to the side from which the light came: nothing passes there.
        let shading = normal(&scene, &x);
        if shading.dot(x.wo) * shading.dot(wi) > 0.0 {
            return Err(TestCaseError::reject("on the same side"));
        }
        if !check_copy(&scene, &x, &y, wi, Lobe::Transmission, true)? {
            return Err(TestCaseError::reject("not shiftable"));
        }
    }

    #[test]
    fn smooth_copies(
        n in neighbours(), index in (1.0f32..2.2, 1.0f32..2.2), inside in any::<bool>(), which in 0usize..11,
    ) {
        let scene = scene_with_panes(vec![
            metal(0.0), metal(0.0), glass(0.0, index.0), glass(0.0, index.1), plastic(0.0), plastic(0.05),
            glass(0.0, index.0), glass(0.0, index.1), half_open(0.3), half_open(0.8)
        ], &[6, 7]);
        let side = if inside { -1.0 } else { 1.0 };
        let (materials, lobe) = [
            ((0, 1), Lobe::Reflection), ((2, 3), Lobe::Reflection), ((2, 3), Lobe::Transmission),
            ((0, 2), Lobe::Reflection), ((4, 5), Lobe::Reflection),
            ((6, 7), Lobe::Reflection), ((6, 7), Lobe::Transmission), ((6, 2), Lobe::Transmission),
            ((2, 7), Lobe::Reflection), ((8, 9), Lobe::Transmission), ((8, 6), Lobe::Transmission),
        ][which];
        let (x, y) = n.vertices(&scene, side, materials);
        let bsdf = x.bsdf(&scene);
        let wo = to_local(&frame(&scene, &x), x.wo);
        prop_assume!(bsdf.eval_delta(wo, lobe).is_some());
        // The one direction of this lobe.
        let sampled = [0.0, 0.9999999].map(|u| bsdf.sample(wo, [0.5, 0.5, u]));
        let single = sampled.into_iter().flatten().find(|s| s.lobe == lobe && s.delta);
        let wi = to_world(&frame(&scene, &x), single.expect("drawn first or last").wi);
        prop_assume!(check_copy(&scene, &x, &y, wi, lobe, false)?);
        // What passes a pane, or the holes of a surface, goes straight on.
        if lobe == Lobe::Transmission && which > 4 && materials.1 != 2 {
            let s = scattering(&scene, &x, wi, lobe);
            let there = copy_half_vector(&scene, &x, &s, &y).expect("it went there and back");
            prop_assert!((there.wi + y.wo).length() < 1e-6 && there.jacobian == 1.0);
        }
    }

    /// Through two rough panes, and from a pane to a body: the half vector is that of the mirrored direction.
    #[test]
    fn copies_through_rough_panes(
        n in neighbours(), wi in pair(), index in (1.1f32..2.2, 1.1f32..2.2),
        roughness in (0.3f32..0.9, 0.3f32..0.9), below in any::<bool>(), to_body in any::<bool>(),
    ) {
        let scene = scene_with_panes(vec![
            glass(roughness.0, index.0), glass(roughness.1, index.1), glass(roughness.1, index.1)
        ], &[0, 1]);
        let side = if below { -1.0 } else { 1.0 };
        let (x, y) = n.vertices(&scene, side, (0, if to_body { 2 } else { 1 }));
        let is_thin = matches!(x.bsdf(&scene), Bsdf::RoughThin { .. });
        prop_assert!(is_thin);
        let wi = upper(x.ng * -side, wi, 0.1);
        if !check_copy(&scene, &x, &y, wi, Lobe::Transmission, true)? {
            return Err(TestCaseError::reject("not shiftable"));
        }
    }

    /// A mirror and a nearly smooth metal have no lobe in common, nor has metal one to transmit.
    #[test]
    fn lobes_that_do_not_exist_are_dead(n in neighbours(), wi in pair()) {
        let scene = scene(vec![metal(0.0), metal(0.2), glass(0.5, 1.5)]);
        let (x, y) = n.vertices(&scene, 1.0, (1, 0));
        let s = scattering(&scene, &x, upper(x.ng, wi, 0.1), Lobe::Reflection);
        prop_assert!(copy_half_vector(&scene, &x, &s, &y).is_err());
        let (x, y) = n.vertices(&scene, 1.0, (2, 1));
        let s = scattering(&scene, &x, upper(-x.ng, wi, 0.1), Lobe::Transmission);
        prop_assert!(copy_half_vector(&scene, &x, &s, &y).is_err());
    }
}
