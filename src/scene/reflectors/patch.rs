//! Patches of curved surfaces. A bowl may show a light in several places; cut up by where its parts look, each part
//! shows it about once, and a search that begins there finds it.

use super::find::{bounds, spread};
use super::{Curved, Form, MANY, Reflector, Targets};
use crate::lanes::{Float, Vec3x8, positive};
use crate::scene::mesh::Mesh;
use glam::Vec3;
use wide::f32x8;

/// What a patch may show is told by this: a point in the middle of it, and how far the others are from that and look
/// elsewhere.
#[derive(Clone, Debug)]
pub struct Patch {
    middle: Vec3,
    /// Unit.
    normal: Vec3,
    /// Largest angle between that and a normal of the patch, or nearly all of its microfacets.
    turned: f32,
    /// Largest distance from the middle.
    radius: f32,
    /// Whether it is seen on the side of its normals alone.
    one_sided: bool,
}

/// Patches are cut until no normal is turned from that of the middle by more than this.
const MOST_TURNED: f32 = 0.4;
/// For so many times GGX's alpha most microfacets are turned from their surface.
const MICROFACETS: f32 = 4.0;
/// As a tangent: no angle is larger.
const ANY: f32 = 1e6;

impl Patch {
    /// That of `triangles`, seen on both sides.
    fn new(mesh: &Mesh, triangles: &[u32]) -> Self {
        let mut sum = [glam::DVec3::ZERO; 2];
        let mut total = 0.0;
        for &t in triangles {
            let (area, point) = (f64::from(mesh.area(t)), mesh.point(t, 1.0 / 3.0, 1.0 / 3.0));
            sum[0] += point.position.as_dvec3() * area;
            sum[1] += point.ns.as_dvec3() * area;
            total += area;
        }
        let middle = (sum[0] / total).as_vec3();
        let normal = sum[1].normalize_or(glam::DVec3::Z).as_vec3();
        let corners = || triangles.iter().flat_map(|&t| mesh.corners(t));
        let normals = triangles.iter().flat_map(|&t| normals_of(mesh, t));
        Self {
            middle,
            normal,
            turned: normals.map(|n| normal.angle_between(n)).fold(0.0, f32::max),
            radius: corners().map(|p| p.distance(middle)).fold(0.0, f32::max),
            one_sided: false,
        }
    }

    /// It is seen on one side alone: 1 for that of its normals, -1 for the other.
    pub(super) fn look(&mut self, outside: f32) {
        self.normal *= outside;
        self.one_sided = true;
    }

    /// Where it may show the targets to the points `from`: a half vector may be a normal of it.
    #[inline(always)]
    pub(super) fn shows(&self, from: Vec3x8, targets: &Targets<f32x8>) -> <f32x8 as Float>::Mask {
        let middle = Vec3x8::splat(self.middle);
        let here = from - middle;
        let there = Vec3x8::select(targets.distant, targets.place, targets.place - middle);
        let half = here.normalize() + there.normalize();
        let length = half.dot(half).root();
        // Elsewhere on the patch the ways are others, by angles of which these are the tangents, or by any; and so
        // is the half vector.
        let squared = f32x8::splat(self.radius * self.radius);
        let tangent = |way: Vec3x8| {
            let beyond = way.dot(way) - squared;
            f32x8::select(
                positive(beyond),
                (squared / beyond).root(),
                f32x8::splat(ANY),
            )
        };
        let moved = (tangent(here) + tangent(there).only(!targets.distant)) / length;
        // What is moved by so much of its length is turned by the arcsine, which is below this.
        let rest = f32x8::ONE - moved * moved;
        let turned = f32x8::select(positive(rest), moved / rest.root(), f32x8::splat(ANY));
        let most = f32x8::splat(self.turned) + turned;
        let cos = half.dot(Vec3x8::splat(self.normal)) / length;
        let cos = if self.one_sided { cos } else { cos.magnitude() };
        // The cosine of an angle is above 1 less half its square.
        positive(cos - f32x8::ONE + most * most * f32x8::splat(0.5))
    }
}

/// Cuts up what is curved and no sphere, as long as there are not many reflectors; `parts` are the triangles of each of
/// the list.
pub(super) fn cut_up(
    mesh: &Mesh,
    list: &mut Vec<Reflector>,
    mut parts: Vec<Vec<u32>>,
    of_triangle: &mut [u32],
) {
    let mut pieces = Vec::new();
    for (reflector, part) in list.iter().zip(&mut parts) {
        if let Form::Curved(Curved { sphere: None, .. }) = reflector.form {
            let triangles = std::mem::take(part);
            pieces.push(Piece::new(mesh, reflector.surface, triangles));
        }
    }
    let surfaces = pieces.len();
    let most = surfaces + (MANY - 1).saturating_sub(list.len());
    while pieces.len() < most {
        let worth = |piece: &Piece| piece.area * piece.patch.turned;
        let to_cut = pieces
            .iter_mut()
            .filter(|piece| piece.may_be_cut && piece.patch.turned > MOST_TURNED);
        // Of equal ones the last: any, but always the same.
        let Some(piece) = to_cut.max_by(|a, b| worth(a).total_cmp(&worth(b))) else {
            break;
        };
        match piece.halves(mesh) {
            Some([a, b]) => {
                *piece = a;
                pieces.push(b);
            }
            None => piece.may_be_cut = false,
        }
    }
    // The first of a surface has its number.
    for (index, piece) in pieces.into_iter().enumerate() {
        let number = if index < surfaces {
            piece.of
        } else {
            list.len() as u32
        };
        for &t in &piece.triangles {
            of_triangle[t as usize] = number;
        }
        let whole = &list[piece.of as usize];
        let reflector = piece.reflector(mesh, whole);
        if index < surfaces {
            list[number as usize] = reflector;
        } else {
            list.push(reflector);
        }
    }
}

/// A part of a curved surface.
struct Piece {
    /// The number of the surface.
    of: u32,
    triangles: Vec<u32>,
    patch: Patch,
    area: f32,
    /// Whether nobody has found yet that there is no cut through it.
    may_be_cut: bool,
}

impl Piece {
    fn new(mesh: &Mesh, of: u32, triangles: Vec<u32>) -> Self {
        Self {
            of,
            patch: Patch::new(mesh, &triangles),
            area: triangles.iter().map(|&t| mesh.area(t)).sum(),
            triangles,
            may_be_cut: true,
        }
    }

    /// What it is as a reflector, as a part of `whole`.
    fn reflector(mut self, mesh: &Mesh, whole: &Reflector) -> Reflector {
        self.patch.turned += MICROFACETS * whole.alpha;
        let mut curved = Curved {
            points: spread(mesh, &self.triangles),
            outside: None,
            sphere: None,
            patch: Some(self.patch),
        };
        if let Form::Curved(Curved {
            outside: Some(outside),
            ..
        }) = whole.form
        {
            curved.look(outside);
        }
        Reflector {
            triangles: self.triangles.len() as u32,
            area: self.area,
            form: Form::Curved(curved),
            bounds: bounds(mesh, &self.triangles),
            ..whole.clone()
        }
    }

    /// Cut across the axis, of places or normals, along which it varies most.
    fn halves(&self, mesh: &Mesh) -> Option<[Self; 2]> {
        let (low, high) = bounds(mesh, &self.triangles);
        // As far apart as opposite normals.
        let per_length = 2.0 / (high - low).max_element();
        let features = |t: u32| {
            let point = mesh.point(t, 1.0 / 3.0, 1.0 / 3.0);
            let place = (point.position - low) * per_length;
            let (p, n) = (place.as_dvec3(), point.ns.as_dvec3());
            [p.x, p.y, p.z, n.x, n.y, n.z]
        };
        let (mut total, mut first, mut second) = (0.0, [0.0; 6], [0.0; 6]);
        for &t in &self.triangles {
            let area = f64::from(mesh.area(t));
            total += area;
            for (axis, x) in features(t).into_iter().enumerate() {
                first[axis] += area * x;
                second[axis] += area * x * x;
            }
        }
        let variance = |axis: usize| second[axis] / total - (first[axis] / total).powi(2);
        let axis = (0..6).max_by(|&a, &b| variance(a).total_cmp(&variance(b)))?;
        let middle = first[axis] / total;
        let (a, b): (Vec<u32>, Vec<u32>) = self
            .triangles
            .iter()
            .partition(|&&t| features(t)[axis] < middle);
        let both = !(a.is_empty() || b.is_empty());
        both.then(|| [a, b].map(|triangles| Self::new(mesh, self.of, triangles)))
    }
}

/// By what a triangle may reflect: the normals of its corners, and its own where these are seen from behind.
fn normals_of(mesh: &Mesh, triangle: u32) -> impl Iterator<Item = Vec3> {
    let own = mesh.point(triangle, 1.0 / 3.0, 1.0 / 3.0).ng;
    let corners = mesh.corner_normals(triangle);
    corners.into_iter().flatten().chain([own])
}
