//! What textures make of a material, point by point.

use super::material::{Class, SMOOTHEST_ALPHA};
use super::texture::Texture;
use crate::bsdf::{Bsdf, Texel, plastic};
use glam::{Vec2, Vec3};

/// The textures of a material.
#[derive(Clone, Debug)]
pub struct Textures {
    /// For [`Bsdf::colour`].
    pub colour: Option<Texture>,
    /// Factor on the reflectance of plastic's coat.
    pub specular: Option<Texture>,
    /// Roughness `Pr`, whose square is the GGX alpha.
    pub roughness: Option<Texture>,
    /// Factor on the emitted radiance.
    pub emission: Option<Texture>,
    /// What turns the shading normal.
    pub relief: Option<Relief>,
    /// Points at most this rough are of class specular.
    pub roughness_threshold: f32,
}

/// What turns the shading normal.
#[derive(Clone, Debug)]
pub enum Relief {
    /// Normals in the frame of the texture: x to the right, y upwards, z outwards, each (1 + n)/2.
    Normals(Texture),
    /// Heights in units of texture coordinates, and a factor on them.
    Heights(Texture, f32),
}

impl Textures {
    /// Whether there are any.
    pub fn any(&self) -> bool {
        self.named().next().is_some()
    }

    /// All of them, with what they stand for.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &Texture)> {
        let relief = self.relief.as_ref().map(|relief| match relief {
            Relief::Normals(t) => ("normals", t),
            Relief::Heights(t, _) => ("bumps", t),
        });
        let map = |name, t| Option::as_ref(t).map(|t| (name, t));
        [
            map("colour", &self.colour),
            map("specular", &self.specular),
            map("roughness", &self.roughness),
            map("emission", &self.emission),
            relief,
        ]
        .into_iter()
        .flatten()
    }

    /// The values at `uv`, `plain` where there is no texture.
    #[inline]
    pub fn texel(&self, bsdf: &Bsdf, plain: &Texel, uv: Vec2) -> Texel {
        let mut texel = *plain;
        if let Some(map) = &self.colour {
            texel.colour = map.colour(uv).clamp(Vec3::ZERO, Vec3::ONE);
        }
        if let Some(map) = &self.specular {
            texel.specular = (2.0 * map.value(uv)).clamp(0.0, 1.0);
        }
        if let Some(map) = &self.roughness {
            let smoothest = match bsdf {
                Bsdf::Plastic { .. } => plastic::SMOOTHEST,
                _ => SMOOTHEST_ALPHA,
            };
            texel.alpha = map.value(uv).clamp(0.0, 1.0).powi(2).max(smoothest);
        }
        texel
    }

    /// Rough or specular at a point, where the roughness varies; else `plain`.
    #[inline]
    pub fn class(&self, bsdf: &Bsdf, texel: &Texel, plain: Class) -> Class {
        if self.roughness.is_none() {
            return plain;
        }
        Class::of(&bsdf.with(texel), self.roughness_threshold)
    }
}

impl Relief {
    /// The shading normal `ns` turned, where `along` and `up` are the changes of the position with the
    /// texture coordinates. A unit vector, or `ns` where it cannot be turned.
    pub fn turn(&self, ns: Vec3, (along, up): (Vec3, Vec3), uv: Vec2) -> Vec3 {
        // The same directions in the plane of the shading normal.
        let in_plane = |d: Vec3| d - ns * d.dot(ns);
        let (along, up) = (in_plane(along), in_plane(up));
        let turned = match self {
            Relief::Normals(map) => {
                let n = map.colour(uv) * 2.0 - Vec3::ONE;
                along.normalize_or_zero() * n.x + up.normalize_or_zero() * n.y + ns * n.z
            }
            Relief::Heights(map, factor) => {
                // The gradient of the height along the surface, whose height is in units of the texture.
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
