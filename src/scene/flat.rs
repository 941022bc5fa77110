//! Which materials are on planes: there class specular pays up to a greater roughness. A plane throws what it shows of a
//! lamp to one place, so walks find much, and copied half vectors stay beside each other; what is curved scatters both.

use super::material::{FLAT, Material};
use super::mesh::Mesh;
use super::reflectors::planes;
use crate::bsdf::packed::Kind;

/// So much of a material's surface has to be in few planes.
const MOST: f32 = 0.9;
/// So few: the sides of a box, and some.
const FEW: usize = 8;

/// Makes what is on planes and not much rougher than the threshold of class specular.
pub fn let_planes_be_specular(mesh: &Mesh, materials: &mut [Material], roughness_threshold: f32) {
    let threshold = FLAT * roughness_threshold;
    let would_be = |m: &Material| {
        let has_microfacets = Kind::MICROFACETS.contains(&m.bsdf.kind());
        has_microfacets && m.is_even() && m.class != m.class_by(threshold)
    };
    let candidates: Vec<bool> = materials.iter().map(would_be).collect();
    if !candidates.contains(&true) {
        return;
    }
    let mut triangles = vec![Vec::new(); materials.len()];
    for (t, &material) in (0..).zip(&mesh.material_of) {
        if candidates[material as usize] {
            triangles[material as usize].push(t);
        }
    }
    for (material, triangles) in materials.iter_mut().zip(&triangles) {
        if !triangles.is_empty() && are_on_planes(mesh, triangles) {
            material.class = material.class_by(threshold);
        }
    }
}

/// Whether most of the area of triangles is in few planes.
fn are_on_planes(mesh: &Mesh, triangles: &[u32]) -> bool {
    let all: f32 = triangles.iter().map(|&t| mesh.area(t)).sum();
    let mut areas = planes(mesh, triangles);
    areas.sort_by(|a, b| b.total_cmp(a));
    areas.iter().take(FEW).sum::<f32>() >= MOST * all
}
