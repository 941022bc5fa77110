//! What textures make of a material, point by point.

use super::content::{self, Alpha};
use super::material::{Class, SMOOTHEST_ALPHA};
use super::mesh::Mesh;
use super::texture::{Meaning, Texture};
use crate::bsdf::{Bsdf, Parameters, plastic};
use crate::load::map::{Channel, MapStatement};
use crate::load::mtl::MtlMaterial;
use glam::{Vec2, Vec3};
use serde::Serialize;

/// The textures of a material.
#[derive(Clone, Debug, Serialize)]
pub struct Textures {
    /// For [`Bsdf::colour`].
    pub colour: Option<Colour>,
    /// Factor on the reflectance of plastic's coat.
    pub specular: Option<Texture>,
    /// For the share of plastic that is metal.
    pub metallic: Option<Texture>,
    /// For the GGX alpha.
    pub roughness: Option<Roughness>,
    /// Factor on the emitted radiance.
    pub emission: Option<Texture>,
    /// What turns the shading normal.
    pub relief: Option<Relief>,
    /// Points at most this rough are of class specular.
    pub roughness_threshold: f32,
}

/// What gives a colour.
#[derive(Clone, Debug, Serialize)]
pub enum Colour {
    /// A picture.
    Texture(Texture),
    /// The vertices; where they have none, the plain value holds.
    Vertices {
        /// Of all of the file.
        mean: Vec3,
    },
}

impl Colour {
    /// A typical value.
    pub fn mean(&self) -> Vec3 {
        match self {
            Colour::Texture(map) => map.mean().clamp(Vec3::ZERO, Vec3::ONE),
            Colour::Vertices { mean } => *mean,
        }
    }
}

/// Where on a mesh textures are asked.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// One of its triangles.
    pub triangle: u32,
    /// Barycentric coordinates of its second and third corner.
    pub barycentric: [f32; 2],
    /// Texture coordinates.
    pub uv: Vec2,
}

/// What gives the GGX alpha.
#[derive(Clone, Debug, Serialize)]
pub enum Roughness {
    /// Roughness `Pr`, whose square it is.
    Pr(Texture),
    /// A factor on this Phong exponent `Ns`.
    Ns(Texture, f32),
}

/// Phong exponents from here up are perfect mirrors.
pub(super) const MIRROR_EXPONENT: f32 = 1000.0;

/// The GGX alpha of a Phong exponent, not negative.
pub(super) fn phong_alpha(exponent: f32) -> f32 {
    if exponent >= MIRROR_EXPONENT {
        0.0
    } else {
        (2.0 / (exponent + 2.0)).sqrt()
    }
}

impl Roughness {
    fn alpha(&self, uv: Vec2) -> f32 {
        match self {
            Roughness::Pr(map) => map.value(uv).clamp(0.0, 1.0).powi(2),
            Roughness::Ns(map, exponent) => phong_alpha(exponent * map.value(uv).max(0.0)),
        }
    }

    fn texture(&self) -> &Texture {
        match self {
            Roughness::Pr(map) | Roughness::Ns(map, _) => map,
        }
    }
}

/// What turns the shading normal.
#[derive(Clone, Debug, Serialize)]
pub enum Relief {
    /// Normals in the frame of the texture: x to the right, y upwards, z outwards, each (1 + n)/2; and a factor
    /// on their slopes.
    Normals(Texture, f32),
    /// Heights in units of a texture's pixel, and a factor on them: between neighbours that differ by the full
    /// range, factor 1 gives a slope of 45°.
    Heights(Texture, f32),
}

/// The texture that cuts holes into the surface: `map_d`, or else the alpha channel of `map_Kd` if it is made for
/// that. Where both are one picture without alpha, it cuts nothing: dark colours are no holes.
pub fn opacity(m: &MtlMaterial) -> Option<Texture> {
    let is_there = |map: &&MapStatement| map.bitmap.is_some();
    let colour = m.map("map_kd").filter(is_there);
    match (m.map("map_d").filter(is_there), colour) {
        (Some(map), colour) => {
            let texture = Texture::new(map, Meaning::Opacity)?;
            let by_grey = map.channel == Channel::Auto && !texture.has_alpha();
            let same = colour.is_some_and(|c| map.same_picture(c));
            (!by_grey || !same).then_some(texture)
        }
        (None, Some(map)) if content::alpha(map) == Alpha::Cutout => {
            let channel = Channel::Alpha;
            let map = MapStatement {
                channel,
                ..map.clone()
            };
            Texture::new(&map, Meaning::Opacity)
        }
        (None, _) => None,
    }
}

impl Textures {
    /// Whether anything varies from point to point.
    pub fn any(&self) -> bool {
        self.has_vertex_colours() || self.named().next().is_some()
    }

    /// Whether the colour is that of the vertices.
    pub fn has_vertex_colours(&self) -> bool {
        matches!(self.colour, Some(Colour::Vertices { .. }))
    }

    /// All pictures, with what they stand for.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &Texture)> {
        let relief = self.relief.as_ref().map(|relief| match relief {
            Relief::Normals(t, _) => ("normals", t),
            Relief::Heights(t, _) => ("bumps", t),
        });
        let map = |name, t| Option::as_ref(t).map(|t| (name, t));
        [
            match &self.colour {
                Some(Colour::Texture(map)) => Some(("colour", map)),
                Some(Colour::Vertices { .. }) | None => None,
            },
            map("specular", &self.specular),
            map("metal", &self.metallic),
            self.roughness.as_ref().map(|r| ("roughness", r.texture())),
            map("emission", &self.emission),
            relief,
        ]
        .into_iter()
        .flatten()
    }

    /// The values at a place, `plain` where there is no texture.
    #[inline]
    pub fn parameters(&self, bsdf: &Bsdf, plain: &Parameters, place: Place) -> Parameters {
        let uv = place.uv;
        let mut parameters = *plain;
        match &self.colour {
            Some(Colour::Texture(map)) => {
                parameters.colour = map.colour(uv).clamp(Vec3::ZERO, Vec3::ONE);
            }
            Some(Colour::Vertices { .. }) => {
                let [u, v] = place.barycentric;
                let colour = place.mesh.colour(place.triangle, u, v);
                parameters.colour = colour.unwrap_or(plain.colour);
            }
            None => {}
        }
        if let Some(map) = &self.specular {
            parameters.specular = (2.0 * map.value(uv)).clamp(0.0, 1.0);
        }
        if let Some(map) = &self.metallic {
            parameters.metallic = map.value(uv).clamp(0.0, 1.0);
        }
        if let Some(roughness) = &self.roughness {
            let smoothest = match bsdf {
                Bsdf::Plastic { .. } => plastic::SMOOTHEST,
                _ => SMOOTHEST_ALPHA,
            };
            parameters.alpha = roughness.alpha(uv).max(smoothest);
        }
        parameters
    }

    /// Rough or specular at a point, where the roughness varies; else `plain`.
    #[inline]
    pub fn class(&self, bsdf: &Bsdf, parameters: &Parameters, plain: Class) -> Class {
        if self.roughness.is_none() {
            return plain;
        }
        Class::of(&bsdf.with(parameters), self.roughness_threshold)
    }
}

impl Relief {
    /// The relief of a material. Programs name normal maps as bumps and the other way round, so the picture
    /// says which it is.
    pub fn of(m: &MtlMaterial) -> Option<Self> {
        let map = ["norm", "map_bump"]
            .iter()
            .find_map(|key| m.map(key).filter(|map| map.bitmap.is_some()))?;
        let texture = Texture::new(map, Meaning::Data)?;
        Some(if content::holds_normals(map) {
            Relief::Normals(texture, map.multiplier)
        } else {
            Relief::Heights(texture, map.multiplier)
        })
    }

    /// The shading normal `ns` turned, where `along` and `up` are the changes of the position with the
    /// texture coordinates. A unit vector, or `ns` where it cannot be turned.
    pub fn turn(&self, ns: Vec3, (along, up): (Vec3, Vec3), uv: Vec2) -> Vec3 {
        // The same directions in the plane of the shading normal.
        let in_plane = |d: Vec3| d - ns * d.dot(ns);
        let (along, up) = (in_plane(along), in_plane(up));
        let turned = match self {
            Relief::Normals(map, factor) => {
                let n = map.colour(uv) * 2.0 - Vec3::ONE;
                let n = n * Vec3::new(*factor, *factor, 1.0);
                along.normalize_or_zero() * n.x + up.normalize_or_zero() * n.y + ns * n.z
            }
            Relief::Heights(map, factor) => {
                // The gradient of the height along the surface.
                let slope = map.slope(uv) * *factor;
                let gradient = |d: Vec3, s: f32| d.normalize_or_zero() * s;
                ns - gradient(along, slope.x) - gradient(up, slope.y)
            }
        };
        turned
            .try_normalize()
            .filter(|n| n.is_finite())
            .unwrap_or(ns)
    }
}
