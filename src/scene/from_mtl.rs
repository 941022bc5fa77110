//! What MTL parameters mean: a material as it is written to a material of the scene, by the tables of the
//! README.

use super::material::{Class, Material, SMOOTHEST_ALPHA};
use super::passage::{FAINT, Passage, passage};
use super::ranges;
use super::texture::{Meaning, Texture};
use super::textured::{Relief, Textures};
use crate::bsdf::Bsdf;
use crate::bsdf::fresnel::SAME_INDEX;
use crate::bsdf::plastic::{self, Coat};
use crate::error::{Result, Warnings};
use crate::load::mtl::MtlMaterial;
use glam::Vec3;
use std::path::Path;

/// Diffuse reflectance of what has no `Kd`.
const GREY: f32 = 0.5;
/// Phong exponents from here up are perfect mirrors.
const MIRROR_EXPONENT: f32 = 1000.0;
/// Refractive index of a coat of which none is given.
const COAT_INDEX: f32 = 1.5;
/// Phong exponent of a surface with `Ks` and without `Ns`.
const DULL_EXPONENT: f32 = 10.0;
/// A Lambert part of which what reflects leaves more than this share of light is not left out.
const VISIBLE: f32 = 0.12;

impl Material {
    /// Interprets an MTL material, by the tables of the README. `path` is for messages.
    pub fn from_mtl(
        m: &MtlMaterial,
        roughness_threshold: f32,
        path: &Path,
        warnings: &mut Warnings,
    ) -> Result<Self> {
        let (m, changes) = ranges::clamped(m);
        let maps = Maps::of(&m);
        let mut reading = Reading { m, path, warnings };
        if !changes.is_empty() {
            reading.warn(&format!("outside of its range, {}", changes.join(", ")))?;
        }
        let emission = reading.emission(&maps);
        let colours = reading.colours(&maps);
        let (bsdf, colour_map) = reading.scattering(&colours, &maps, emission.is_some())?;
        let class = match emission {
            Some(_) => Class::Rough,
            None => Class::of(&bsdf, roughness_threshold),
        };
        let survival = survival(&bsdf, colour_map.as_ref());
        let textures = Textures {
            colour: colour_map,
            specular: maps.ks.filter(|_| matches!(bsdf, Bsdf::Plastic { .. })),
            roughness: maps.pr.filter(|_| bsdf.texel().alpha > 0.0),
            emission: maps.ke,
            relief: maps.relief,
            roughness_threshold,
        };
        Ok(Self {
            name: reading.m.name,
            bsdf,
            texel: bsdf.texel(),
            textures: textures.any().then(|| Box::new(textures)),
            class,
            emission,
            survival,
        })
    }

    /// The texture that cuts holes into the surface.
    pub fn opacity(m: &MtlMaterial) -> Option<Texture> {
        m.map("map_d")
            .and_then(|map| Texture::new(map, Meaning::Opacity))
    }
}

/// The textures that are there. They take the place of the plain values.
struct Maps {
    kd: Option<Texture>,
    ks: Option<Texture>,
    ke: Option<Texture>,
    pr: Option<Texture>,
    relief: Option<Relief>,
}

impl Maps {
    fn of(m: &MtlMaterial) -> Self {
        let texture = |key: &str, meaning| m.map(key).and_then(|map| Texture::new(map, meaning));
        let relief = match (texture("norm", Meaning::Data), m.map("map_bump")) {
            (Some(normals), _) => Some(Relief::Normals(normals)),
            (None, Some(map)) => Texture::new(map, Meaning::Data)
                .map(|heights| Relief::Heights(heights, map.multiplier)),
            (None, None) => None,
        };
        Self {
            kd: texture("map_kd", Meaning::Colour),
            ks: texture("map_ks", Meaning::Colour),
            ke: texture("map_ke", Meaning::Colour),
            pr: texture("map_pr", Meaning::Data),
            relief,
        }
    }
}

/// Whether a texture is named that cannot be read: grey takes its place.
fn is_missing(m: &MtlMaterial, key: &str) -> bool {
    m.map(key).is_some_and(|map| map.bitmap.is_none())
}

/// Reflectances in [0, 1].
struct Colours {
    kd: Vec3,
    ks: Vec3,
    /// Whether `Ks` is given, or stands for a texture that is missing.
    ks_given: bool,
    /// Whether there is a texture of it.
    ks_textured: bool,
}

impl Colours {
    /// Metals have the colour `Ks`; files that know of metals alone (`Pm`) may give it as `Kd`.
    fn metal_is_kd(&self, m: &MtlMaterial) -> bool {
        !self.ks_given && !self.ks_textured && m.pm.is_some()
    }

    fn metal(&self, m: &MtlMaterial) -> Vec3 {
        if self.metal_is_kd(m) {
            self.kd
        } else {
            self.ks
        }
    }

    fn has_ks(&self) -> bool {
        self.ks != Vec3::ZERO || self.ks_textured
    }
}

/// An MTL material being read, with what messages need.
struct Reading<'a> {
    m: MtlMaterial,
    path: &'a Path,
    warnings: &'a mut Warnings,
}

impl Reading<'_> {
    fn message(&self, what: &str) -> String {
        format!(
            "{}: material '{}': {what}",
            self.path.display(),
            self.m.name
        )
    }

    fn warn(&mut self, what: &str) -> Result<()> {
        self.warnings.push(self.message(what))
    }

    /// Emitted radiance, or the factor on its texture.
    fn emission(&self, maps: &Maps) -> Option<Vec3> {
        let emission = self.m.ke.map_or(Vec3::ZERO, Vec3::from);
        if maps.ke.is_some() && emission == Vec3::ZERO {
            return Some(Vec3::ONE);
        }
        (emission != Vec3::ZERO).then_some(emission)
    }

    fn colours(&self, maps: &Maps) -> Colours {
        let m = &self.m;
        let plain = |given: Option<[f32; 3]>, map: &str| {
            if is_missing(m, map) {
                Some([GREY; 3])
            } else {
                given
            }
        };
        let ks = plain(m.ks, "map_ks");
        Colours {
            kd: plain(m.kd, "map_kd").unwrap_or([GREY; 3]).into(),
            ks: ks.unwrap_or_default().into(),
            ks_given: ks.is_some(),
            ks_textured: maps.ks.is_some(),
        }
    }

    /// What scatters, and the texture of [`Bsdf::colour`].
    fn scattering(
        &mut self,
        colours: &Colours,
        maps: &Maps,
        emits: bool,
    ) -> Result<(Bsdf, Option<Texture>)> {
        let metallic = self.m.pm.unwrap_or(0.0);
        let textured = maps.pr.is_some();
        if metallic >= 1.0 {
            let map = if colours.metal_is_kd(&self.m) {
                &maps.kd
            } else {
                &maps.ks
            };
            let alpha = pr_alpha(&self.m).unwrap_or(0.0);
            return Ok((
                conductor(colours.metal(&self.m), alpha, textured),
                map.clone(),
            ));
        }
        let (passage, remark) = passage(&self.m);
        if let Some(remark) = remark.filter(|_| !emits) {
            self.warnings.note(self.message(remark));
        }
        let (opacity, through) = match passage {
            Passage::Glass { ior, tint } => {
                let alpha = pr_alpha(&self.m).unwrap_or(0.0);
                return Ok((glass(ior, alpha, tint, textured), None));
            }
            Passage::Straight { opacity, tint } => (opacity, (1.0 - opacity) * tint),
            Passage::Opaque => (1.0, Vec3::ZERO),
        };
        let reflects = matches!(self.m.illum, Some(3 | 5 | 8)) && colours.has_ks();
        if reflects
            && opacity == 1.0
            && let Some(metal) = self.reflector(colours, maps, emits)?
        {
            return Ok(metal);
        }
        // Programs that know no highlights write Ns 0 beside a white Ks.
        let m = &self.m;
        let shines = colours.has_ks() && m.ns.is_none_or(|ns| ns > 0.0);
        let coat = if reflects {
            Some(mirror_coat(m, colours, maps))
        } else if metallic > 0.0
            || (shines && m.illum.is_none_or(|illum| illum > 1))
            || (pr_alpha(m).is_some() && !colours.ks_given)
        {
            Some(coat(m, colours, maps))
        } else {
            (opacity < 1.0).then_some(Coat::NONE)
        };
        let albedo = colours.kd;
        let bsdf = match coat {
            Some(coat) => Bsdf::Plastic {
                albedo,
                coat: Coat {
                    opacity,
                    through,
                    ..coat
                },
            },
            None => Bsdf::Lambert { albedo },
        };
        Ok((bsdf, maps.kd.clone()))
    }

    /// What reflects by illum 3, 5 or 8 with the reflectance `Ks`; `None` where a Lambert part is too bright
    /// beside it to be left out.
    fn reflector(
        &mut self,
        colours: &Colours,
        maps: &Maps,
        emits: bool,
    ) -> Result<Option<(Bsdf, Option<Texture>)>> {
        let &Colours { kd, ks, .. } = colours;
        let textured = maps.pr.is_some();
        let alpha = alpha(&self.m, MIRROR_EXPONENT);
        let has_kd = self.m.kd.is_some() || maps.kd.is_some();
        let bright = has_kd && (kd.max_element() > FAINT || maps.kd.is_some());
        // Blender writes illum 3 for metals, whose colour is Kd, beside the default of its dielectric's Ks.
        let by_blender = self.m.illum == Some(3) && ks == Vec3::splat(0.5) && maps.ks.is_none();
        if bright && by_blender && self.m.pm.is_none() {
            let note =
                "illum 3 beside Ks 0.5 is taken as a metal of the colour Kd, as Blender writes it";
            self.warnings.note(self.message(note));
            return Ok(Some((conductor(kd, alpha, textured), maps.kd.clone())));
        }
        if bright && !emits {
            let left = kd.max_element() * (1.0 - ks.max_element());
            if left > VISIBLE && maps.ks.is_none() {
                return Ok(None);
            }
            let illum = self.m.illum.unwrap_or_default();
            self.warn(&format!(
                "reflects by Ks and illum {illum}; its Kd is left out"
            ))?;
        }
        Ok(Some((conductor(ks, alpha, textured), maps.ks.clone())))
    }
}

/// GGX roughness by `Pr`, if that or its texture is given.
fn pr_alpha(m: &MtlMaterial) -> Option<f32> {
    let map = m.map("map_pr");
    (m.pr.is_some() || map.is_some()).then(|| {
        let default = if is_missing(m, "map_pr") { GREY } else { 0.0 };
        m.pr.unwrap_or(default).powi(2)
    })
}

/// GGX roughness by `Pr`, or else by the Phong exponent `Ns`, which is `exponent` if absent.
fn alpha(m: &MtlMaterial, exponent: f32) -> f32 {
    pr_alpha(m).unwrap_or_else(|| {
        let ns = m.ns.unwrap_or(exponent);
        if ns >= MIRROR_EXPONENT {
            0.0
        } else {
            (2.0 / (ns + 2.0)).sqrt()
        }
    })
}

/// GGX roughness of a coat, 0 for a smooth one.
fn coat_alpha(alpha: f32, textured: bool) -> f32 {
    if alpha < plastic::SMOOTHEST && !textured {
        0.0
    } else {
        alpha.max(plastic::SMOOTHEST)
    }
}

/// What reflects with the reflectance `Ks` over a Lambert part.
fn mirror_coat(m: &MtlMaterial, colours: &Colours, maps: &Maps) -> Coat {
    // Textures say twice what they replace.
    let f0 = if maps.ks.is_some() {
        0.5
    } else {
        colours.ks.max_element()
    };
    Coat {
        f0,
        tint: if maps.ks.is_some() {
            Vec3::ONE
        } else {
            colours.ks / f0
        },
        alpha: coat_alpha(alpha(m, MIRROR_EXPONENT), maps.pr.is_some()),
        ..Coat::NONE
    }
}

/// The coat of plastic.
fn coat(m: &MtlMaterial, colours: &Colours, maps: &Maps) -> Coat {
    Coat {
        f0: coat_f0(m.ni),
        // What modelling programs write for an ordinary dielectric is 0.5.
        tint: if maps.ks.is_some() || !colours.ks_given {
            Vec3::ONE
        } else {
            (2.0 * colours.ks).min(Vec3::ONE)
        },
        metallic: m.pm.unwrap_or(0.0),
        metal: match &maps.ks {
            Some(map) => map.mean().clamp(Vec3::ZERO, Vec3::ONE),
            None => colours.metal(m),
        },
        metal_is_albedo: colours.metal_is_kd(m),
        alpha: coat_alpha(alpha(m, DULL_EXPONENT), maps.pr.is_some()),
        ..Coat::NONE
    }
}

/// The reflectance of a coat at normal incidence. Programs that know no index write 1.
fn coat_f0(index: Option<f32>) -> f32 {
    let index = index.filter(|&ni| ni > 1.0).unwrap_or(COAT_INDEX);
    ((index - 1.0) / (index + 1.0)).powi(2)
}

/// `textured`: a texture gives the roughness, so that it may be anything.
fn conductor(f0: Vec3, alpha: f32, textured: bool) -> Bsdf {
    if alpha < SMOOTHEST_ALPHA && !textured {
        Bsdf::Mirror { f0 }
    } else {
        Bsdf::Conductor {
            f0,
            alpha: alpha.max(SMOOTHEST_ALPHA),
        }
    }
}

/// `textured`: a texture gives the roughness, so that it may be anything. `tint` is of the whole way through.
fn glass(ior: f32, alpha: f32, tint: Vec3, textured: bool) -> Bsdf {
    // Each of two boundaries takes its half.
    let tint = tint.map(f32::sqrt);
    if (alpha < SMOOTHEST_ALPHA && !textured) || (ior - 1.0).abs() < SAME_INDEX {
        Bsdf::Glass { ior, tint }
    } else {
        let alpha = alpha.max(SMOOTHEST_ALPHA);
        Bsdf::RoughGlass { ior, alpha, tint }
    }
}

/// Probability of roulette to let a path go on, by what is scattered with a typical value of the texture.
fn survival(bsdf: &Bsdf, colour: Option<&Texture>) -> f32 {
    let mut typical = bsdf.texel();
    if let Some(map) = colour {
        typical.colour = map.mean().clamp(Vec3::ZERO, Vec3::ONE);
    }
    match bsdf.with(&typical) {
        scatters @ (Bsdf::Lambert { .. } | Bsdf::Plastic { .. }) => {
            scatters.albedo().max_element().clamp(0.1, 0.95)
        }
        _ => 0.95,
    }
}
