//! Materials: how a surface scatters and what it emits.

use super::mesh::Mesh;
use super::texture::Texture;
use super::textured::Textures;
use crate::bsdf::packed::Kind;
use crate::bsdf::{Bsdf, Parameters};
use glam::Vec3;
use serde::Serialize;

/// Whether the shift reconnects at a vertex or copies its half vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub enum Class {
    /// Offset paths may be reconnected here, and light is sampled here.
    Rough,
    /// Offset paths copy the half vector. Where directions are not single ones, paths are aimed at lights, those without
    /// offset paths by ordinary light samples.
    Specular,
}

impl Class {
    /// By the roughness threshold.
    pub fn of(bsdf: &Bsdf, roughness_threshold: f32) -> Self {
        if bsdf.roughness() > roughness_threshold {
            Class::Rough
        } else {
            Class::Specular
        }
    }
}

/// A material of the scene.
#[derive(Clone, Debug, Serialize)]
pub struct Material {
    /// Its name in the MTL.
    pub name: String,
    /// How it scatters, textures aside. A light scatters nothing, whatever stands here.
    pub bsdf: Bsdf,
    /// The values that textures may replace.
    pub parameters: Parameters,
    /// What varies over the surface, if anything does.
    pub textures: Option<Box<Textures>>,
    /// Rough or specular, by the roughness threshold. A light counts as rough.
    pub class: Class,
    /// Radiance emitted on the front side, or the factor of a texture; `None` where it does not emit.
    pub emission: Option<Vec3>,
    /// Probability with which Russian roulette lets a path go on. A function of the material alone, so
    /// that base and offset path have one where they share a vertex.
    pub survival: f32,
}

/// Below this the GGX roughness cannot be told from a perfectly smooth surface in 32-bit floats.
pub(super) const SMOOTHEST_ALPHA: f32 = 1e-4;

/// Vertices at most this rough copy half vectors, and paths by them are aimed at lights, or walked to these. Chosen by
/// relMSE times time of 64 samples, weighted, over that with a threshold below: of balls of metal with alpha 0.0225 it is
/// 0.4 on a floor and 0.95 in scenes/mirrors.obj, with 0.04 0.5 and 1.2, with 0.09 1.3 on a floor; of path tracing 0.07 and
/// 0.6, 0.08 and 0.6, and 0.2. See the last table of scenes/failures/README.md, too.
pub const ROUGHNESS_THRESHOLD: f32 = 0.045;

/// On planes the threshold is so many times higher. There the same product is, with alpha 0.04, 0.15 for a floor of metal
/// (path tracing 0.03), 0.3 (0.25) for blocks in scenes/cornell.obj and 0.7 (0.5) for the mirror of scenes/mirrors.obj; for
/// a slab of glass 0.4 (1.1).
pub const FLAT: f32 = 2.0;

impl Material {
    /// The same on an open sheet, where it is both boundaries of a pane in one; `None` for what is opaque or
    /// emits.
    pub fn thin(&self, roughness_threshold: f32) -> Option<Self> {
        let bsdf = self.bsdf.thin().filter(|_| self.emission.is_none())?;
        Some(Self {
            bsdf,
            parameters: bsdf.parameters(),
            class: Class::of(&bsdf, roughness_threshold),
            ..self.clone()
        })
    }

    /// Its class by this roughness threshold.
    pub fn class_by(&self, roughness_threshold: f32) -> Class {
        match self.emission {
            Some(_) => Class::Rough,
            None => Class::of(&self.bsdf, roughness_threshold),
        }
    }

    /// Whether it is as rough everywhere and has no relief.
    pub fn is_even(&self) -> bool {
        let textures = self.textures.as_ref();
        textures.is_none_or(|t| t.roughness.is_none() && t.relief.is_none())
    }

    /// Whether it may be of class specular and spread light even so.
    pub fn spreads_little(&self) -> bool {
        let textures = self.textures.as_ref();
        let is_specular =
            self.class == Class::Specular || textures.is_some_and(|t| t.roughness.is_some());
        let has_microfacets = Kind::MICROFACETS.contains(&self.bsdf.kind());
        self.emission.is_none() && is_specular && has_microfacets
    }

    /// The texture of the emitted radiance.
    #[inline]
    pub fn emission_map(&self) -> Option<&Texture> {
        self.textures.as_ref()?.emission.as_ref()
    }

    /// Radiance emitted on the front side at a point of a triangle of this material. Not inlined: scenes
    /// without textures shall not have it in their loops.
    #[cold]
    #[inline(never)]
    pub fn radiance(&self, mesh: &Mesh, triangle: u32, u: f32, v: f32) -> Vec3 {
        let factor = self.emission.unwrap_or(Vec3::ZERO);
        match self.emission_map() {
            Some(map) => factor * map.colour(mesh.texcoord(triangle, u, v)).max(Vec3::ZERO),
            None => factor,
        }
    }
}
