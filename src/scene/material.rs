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
    /// Offset paths copy the half vector. Where directions are not single ones, paths are aimed at lights.
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

/// Vertices at most this rough copy half vectors, and paths by them are aimed at lights, or walked to these. Chosen by the
/// last table of scenes/failures/README.md: that leaves a tenth of the error and less, in two to four times the time;
/// at 0.0225, on scenes/mirrors.obj, whose lamp is wide, 0.84 in 1.34 times the time.
pub const ROUGHNESS_THRESHOLD: f32 = 0.02;

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
