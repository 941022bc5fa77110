//! Reflectors are found among the triangles of a scene, once.

use super::connected::{Edges, Surface, normal, surfaces};
use super::course::COURSES;
use super::sides::{Side, outsides};
use super::{
    BALLS, Ball, Bounds, Course, Curved, Form, MANY, NONE, PAIRS, Plane, Reflector, Reflectors,
    Slab, Sphere, patch,
};
use crate::bsdf::{Bsdf, fresnel};
use crate::lanes::{LANES, Vec3x8, positive};
use crate::scene::light_grid::{Emitter, LightGrid};
use crate::scene::material::{Class, Material};
use crate::scene::mesh::Mesh;
use glam::Vec3;
use wide::f32x8;

/// Points of a curved reflector where a search may begin.
const GUESSES: usize = 48;
/// Boxes that rays are tested against one by one; of more, one around all.
const BOXES: usize = 16;

impl Reflectors {
    /// The reflectors among the triangles of `mesh`.
    pub fn new(mesh: &Mesh, materials: &[Material]) -> Self {
        let of_them = |is: fn(&Material) -> bool| -> Vec<u32> {
            let are: Vec<bool> = materials.iter().map(is).collect();
            let triangles = 0..mesh.triangles.len() as u32;
            triangles
                .filter(|&t| are[mesh.material_of[t as usize] as usize])
                .collect()
        };
        let members = of_them(|m| is_single(m) || is_nearly_single(m));
        if members.is_empty() {
            return Self::default();
        }
        if let Some(&t) = of_them(|m| is_single(m) && has_relief(m)).first() {
            let name = &materials[mesh.material_of[t as usize] as usize].name;
            return Self {
                hindrance: Some(format!("'{name}' has relief")),
                ..Self::default()
            };
        }

        let edges = Edges::new(mesh, &members);
        let surfaces = surfaces(mesh, &members, &edges);
        let mut of_triangle = vec![NONE; mesh.triangles.len()];
        let mut list: Vec<Reflector> = Vec::with_capacity(surfaces.len());
        for surface in &surfaces {
            let number = list.len() as u32;
            for &t in &surface.triangles {
                of_triangle[t as usize] = number;
            }
            list.push(Reflector::new(mesh, materials, surface, number));
        }
        let sides = outsides(mesh, &members, &edges, &of_triangle, &list);
        for side in &sides {
            let outside = side.outside;
            let Reflector {
                form,
                is_metal,
                is_across,
                ..
            } = &mut list[side.reflector as usize];
            match form {
                // Glass reflects inside too.
                Form::Plane(plane) => {
                    plane.normal *= outside;
                    plane.one_sided = *is_metal;
                    *is_across = !*is_metal && side.is_across;
                }
                Form::Curved(curved) => {
                    curved.look(outside);
                    // A dent is none.
                    let bulges = |sphere: &Sphere| {
                        let mut points = curved.points.iter();
                        let centre = Vec3x8::splat(sphere.centre);
                        points.all(|&(p, normal)| positive(normal.dot(p - centre)).all())
                    };
                    let surface = &surfaces[side.reflector as usize];
                    curved.sphere = Sphere::of(mesh, &surface.triangles).filter(bulges);
                }
            }
        }

        let (slabs, mut courses) = slabs(&mut list, &sides, materials);

        // What is curved and no sphere is cut up, unless there are many.
        let parts = surfaces.into_iter().map(|surface| surface.triangles);
        patch::cut_up(mesh, &mut list, parts.collect(), &mut of_triangle);

        // Balls, whose glass is inside.
        let mut balls = Vec::new();
        for (number, reflector) in list.iter().enumerate() {
            if let Form::Curved(Curved {
                sphere: Some(sphere),
                ..
            }) = reflector.form
                && let Bsdf::Glass { ior, .. } = materials[reflector.material as usize].bsdf
                && let Some(ball) = Ball::new(sphere, ior)
            {
                balls.push((number as u32, ball));
            }
        }
        balls.sort_by(|(_, a), (_, b)| b.sphere.radius.total_cmp(&a.sphere.radius));
        balls.truncate(BALLS);

        // What lets light pass, and the choice among many.
        let passing = |r: &&Reflector| !r.is_metal && !r.focuses;
        let mut passages: Vec<Bounds> = list.iter().filter(passing).map(|r| r.bounds).collect();
        if passages.len() > BOXES {
            passages = vec![passages.into_iter().fold(EMPTY, around)];
        }
        let mut pairs = Vec::new();
        let is_a_course = |pair: [usize; 2]| {
            let numbers = pair.map(|r| r as u32);
            courses.iter().any(|course: &Course| course.has(&numbers))
        };
        for (a, b) in (0..list.len()).flat_map(|a| (0..list.len()).map(move |b| (a, b))) {
            if let (Form::Plane(p), Form::Plane(q)) = (&list[a].form, &list[b].form)
                && a != b
                && !is_a_course([a, b])
                && list[a].alpha.max(list[b].alpha) == 0.0
                && p.is_seen_from(&list[b].bounds)
                && q.is_seen_from(&list[a].bounds)
            {
                pairs.push([a as u32, b as u32]);
            }
        }
        // Among many, single ones alone are chosen.
        if list.len() >= MANY {
            pairs.clear();
            courses.clear();
        }
        if pairs.len() > PAIRS {
            let brighter = |a: &[u32; 2], b: &[u32; 2]| {
                let [a, b] = [a, b].map(|pair| pair.map(|r| &list[r as usize]));
                Reflector::send(b).total_cmp(&Reflector::send(a))
            };
            pairs.sort_by(brighter);
            pairs.truncate(PAIRS);
            pairs.sort_unstable();
        }
        let grid = (list.len() >= MANY).then(|| {
            let emitter = |r: &Reflector| Emitter {
                bounds: r.bounds,
                normal: None,
                power: f64::from(r.reflectance * r.area).max(f64::MIN_POSITIVE),
            };
            let emitters: Vec<Emitter> = list.iter().map(emitter).collect();
            LightGrid::new(&emitters, mesh.bounds)
        });
        Self {
            of_triangle,
            passages,
            pairs,
            worth: list
                .iter()
                .zip(0..)
                .filter(|(r, number)| r.surface == *number)
                .map(|(r, _)| r.worth())
                .sum::<f32>()
                .clamp(1e-3, 1.0),
            balls,
            slabs,
            courses,
            grid,
            list,
            hindrance: None,
        }
    }
}

/// The slabs of glass among reflectors with these sides, and the courses inside of them with more than one reflection, the
/// largest first. Those with one are given to their reflectors.
fn slabs(
    list: &mut [Reflector],
    sides: &[Side],
    materials: &[Material],
) -> (Vec<Slab>, Vec<Course>) {
    let (mut slabs, mut courses) = (Vec::new(), Vec::new());
    for sides in sides.chunk_by(|a, b| a.body == b.body) {
        let index = |side: &Side| {
            let material = list[side.reflector as usize].material;
            match materials[material as usize].bsdf {
                // Of a hole in glass the index is that inside of the hole.
                Bsdf::Glass { ior, .. } if side.outside > 0.0 => Some(ior),
                _ => None,
            }
        };
        let Some(ior) = index(&sides[0]) else {
            continue;
        };
        if sides.iter().any(|side| index(side) != Some(ior)) {
            continue;
        }
        let sides: Vec<u32> = sides.iter().map(|side| side.reflector).collect();
        let surface = sides.iter().map(|&side| list[side as usize].area).sum();
        let own = Slab::of_body(list, &sides, ior);
        let large = own.iter().filter(|slab| slab.is_large(surface));
        for (place, slab) in large.enumerate() {
            let upright = sides.iter().filter_map(|&side| match &list[side as usize] {
                Reflector {
                    is_across: true,
                    form: Form::Plane(plane),
                    ..
                } if plane.is_upright_on(&slab.faces[0]) => Some((side, plane.clone())),
                _ => None,
            });
            let upright: Vec<_> = upright.collect();
            let (several, single) = Course::all(slab, &upright);
            for (number, course) in single {
                list[number as usize].courses.push(course);
            }
            if place == 0 {
                courses.push(several);
            }
        }
        slabs.extend(own);
    }
    courses.sort_by(|a, b| b[0].area().total_cmp(&a[0].area()));
    let mut courses = courses.concat();
    courses.truncate(COURSES);
    (Slab::largest(slabs), courses)
}

impl Curved {
    /// It is seen on one side alone: 1 for that of its normals, -1 for the other.
    pub(super) fn look(&mut self, outside: f32) {
        self.points
            .iter_mut()
            .for_each(|p| p.1 = p.1 * f32x8::splat(outside));
        if let Some(patch) = &mut self.patch {
            patch.look(outside);
        }
        self.outside = Some(outside);
    }
}

impl Reflector {
    /// See [`Reflectors::worth`].
    fn worth(&self) -> f32 {
        if self.is_metal {
            self.reflectance
        } else {
            4.0 * self.reflectance
        }
    }

    /// About how much of light the first may send on from the second.
    fn send([a, b]: [&Self; 2]) -> f32 {
        let middle = |r: &Self| 0.5 * (r.bounds.0 + r.bounds.1);
        let apart = middle(a).distance_squared(middle(b));
        a.reflectance * b.reflectance * a.area * b.area / (apart + a.area + b.area)
    }

    /// That of a surface, which has this number.
    fn new(mesh: &Mesh, materials: &[Material], surface: &Surface, number: u32) -> Self {
        let Surface {
            ref triangles,
            is_plane,
        } = *surface;
        let material = mesh.material_of[triangles[0] as usize];
        let corners = || triangles.iter().flat_map(|&t| mesh.corners(t));
        let form = if is_plane {
            // Of the largest, whose normal is the most exact.
            let largest = triangles
                .iter()
                .max_by(|a, b| mesh.area(**a).total_cmp(&mesh.area(**b)));
            let largest = *largest.unwrap_or(&triangles[0]);
            Form::Plane(Plane::new(
                mesh.corners(largest),
                normal(mesh, largest),
                corners(),
            ))
        } else {
            Form::Curved(Curved {
                points: spread(mesh, triangles),
                outside: None,
                sphere: None,
                patch: None,
            })
        };
        let bsdf = &materials[material as usize].bsdf;
        let (reflectance, is_metal) = match *bsdf {
            Bsdf::Glass { ior, .. } => (fresnel::dielectric(1.0, ior), false),
            Bsdf::Thin { ior, .. } => (2.0 * fresnel::dielectric(1.0, ior), false),
            _ => (bsdf.colour().element_sum() / 3.0, true),
        };
        Self {
            material,
            surface: number,
            focuses: matches!(bsdf, Bsdf::Glass { .. }) && !is_plane,
            is_across: false,
            courses: Vec::new(),
            alpha: match *bsdf {
                Bsdf::Conductor { alpha, .. } => alpha,
                _ => 0.0,
            },
            triangles: triangles.len() as u32,
            area: triangles.iter().map(|&t| mesh.area(t)).sum(),
            form,
            reflectance,
            is_metal,
            bounds: bounds(mesh, triangles),
        }
    }
}

/// Whether all light that meets the material goes on in single directions.
fn is_single(material: &Material) -> bool {
    let smooth = matches!(
        material.bsdf,
        Bsdf::Mirror { .. } | Bsdf::Glass { .. } | Bsdf::Thin { .. }
    );
    smooth && material.class == Class::Specular && material.emission.is_none()
}

/// Whether it is metal that spreads light so little that directions are nearly single ones: everywhere as little.
fn is_nearly_single(material: &Material) -> bool {
    matches!(material.bsdf, Bsdf::Conductor { .. })
        && material.class == Class::Specular
        && material.emission.is_none()
        && material.is_even()
}

fn has_relief(material: &Material) -> bool {
    let textures = material.textures.as_ref();
    textures.is_some_and(|t| t.relief.is_some())
}

/// Points in the middle of triangles, evenly by area, and the normals there.
pub(super) fn spread(mesh: &Mesh, triangles: &[u32]) -> Vec<(Vec3x8, Vec3x8)> {
    let total: f64 = triangles.iter().map(|&t| f64::from(mesh.area(t))).sum();
    let count = GUESSES.min(triangles.len());
    let mut points = Vec::with_capacity(count);
    let mut so_far = 0.0;
    for &t in triangles {
        so_far += f64::from(mesh.area(t));
        let due = (points.len() as f64 + 0.5) / count as f64 * total;
        if so_far >= due && points.len() < count {
            let point = mesh.point(t, 1.0 / 3.0, 1.0 / 3.0);
            points.push((point.position, point.ns));
        }
    }
    let eight = points.chunks(LANES).map(|some| {
        // The last ones repeat one.
        let at = |lane: usize| some[lane.min(some.len() - 1)];
        [
            Vec3x8::from_lanes(|lane| at(lane).0),
            Vec3x8::from_lanes(|lane| at(lane).1),
        ]
    });
    eight.map(|[p, n]| (p, n)).collect()
}

/// What encloses triangles.
pub(super) fn bounds(mesh: &Mesh, triangles: &[u32]) -> Bounds {
    let corners = triangles.iter().flat_map(|&t| mesh.corners(t));
    corners.fold(EMPTY, |b, p| around(b, (p, p)))
}

const EMPTY: Bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);

fn around(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}
