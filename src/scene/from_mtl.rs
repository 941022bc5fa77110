//! What MTL parameters mean: a material as it is written to a material of the scene, by the tables of the
//! README.

use super::material::{Class, Material, SMOOTHEST_ALPHA};
use super::passage::{FAINT, Passage, passage};
use super::ranges;
use super::remarks::{Kind, Remarks};
use super::texture::{Meaning, Texture};
use super::textured::{Colour, MIRROR_EXPONENT, Relief, Roughness, Textures, phong_alpha};
use crate::bsdf::Bsdf;
use crate::bsdf::fresnel::SAME_INDEX;
use crate::bsdf::plastic::{self, Coat};
use crate::load::mtl::MtlMaterial;
use glam::Vec3;

/// Diffuse reflectance of what has no `Kd`.
const GREY: f32 = 0.5;
/// Refractive index of a coat of which none is given.
const COAT_INDEX: f32 = 1.5;
/// Phong exponent of a surface with `Ks` and without `Ns`.
const DULL_EXPONENT: f32 = 10.0;
/// A Lambert part of which what reflects leaves more than this share of light is not left out.
const VISIBLE: f32 = 0.12;

impl Material {
    /// Interprets an MTL material, by the tables of the README. Where the file has colours at its vertices,
    /// `vertices` is their mean.
    pub fn from_mtl(
        m: &MtlMaterial,
        vertices: Option<Vec3>,
        roughness_threshold: f32,
        remarks: &mut Remarks,
    ) -> Self {
        let (m, changes) = ranges::clamped(m);
        if !changes.is_empty() {
            let what = format!("outside of its range, {}", changes.join(", "));
            remarks.add(Kind::Warning, &m.name, what);
        }
        let maps = Maps::of(&m, vertices);
        let emission = emission(&m, &maps);
        // What a light scatters does not matter.
        let mut unheard = Remarks::default();
        let mut reading = Reading {
            m: &m,
            colours: Colours::of(&m, &maps),
            maps: &maps,
            remarks: match emission {
                Some(_) => &mut unheard,
                None => remarks,
            },
        };
        let (bsdf, colour_map) = reading.scattering();
        let survival = survival(&bsdf, colour_map.as_ref());
        let textures = Textures {
            colour: colour_map,
            specular: maps.ks.filter(|_| matches!(bsdf, Bsdf::Plastic { .. })),
            metallic: maps
                .metallic
                .filter(|_| matches!(bsdf, Bsdf::Plastic { .. })),
            roughness: maps.roughness.filter(|_| bsdf.parameters().alpha > 0.0),
            emission: maps.ke,
            relief: maps.relief,
            roughness_threshold,
        };
        let mut material = Self {
            name: m.name,
            bsdf,
            parameters: bsdf.parameters(),
            textures: textures.any().then(|| Box::new(textures)),
            class: Class::Rough,
            emission,
            survival,
        };
        material.class = material.class_by(roughness_threshold);
        material
    }
}

/// The textures that are there. They take the place of the plain values.
struct Maps {
    /// Of `map_Kd`, or of the vertices where there is none.
    kd: Option<Colour>,
    ks: Option<Texture>,
    ke: Option<Texture>,
    metallic: Option<Texture>,
    /// Of `map_Pr`, or of `map_Ns` where there is no word of `Pr`.
    roughness: Option<Roughness>,
    relief: Option<Relief>,
}

impl Maps {
    fn of(m: &MtlMaterial, vertices: Option<Vec3>) -> Self {
        let texture = |key: &str, meaning| m.map(key).and_then(|map| Texture::new(map, meaning));
        Self {
            kd: texture("map_kd", Meaning::Colour)
                .map(Colour::Texture)
                .or(vertices.map(|mean| Colour::Vertices { mean })),
            ks: texture("map_ks", Meaning::Colour),
            ke: texture("map_ke", Meaning::Colour),
            metallic: texture("map_pm", Meaning::Data),
            roughness: match pr_alpha(m) {
                Some(_) => texture("map_pr", Meaning::Data).map(Roughness::Pr),
                None => texture("map_ns", Meaning::Data)
                    .map(|map| Roughness::Ns(map, m.ns.unwrap_or(MIRROR_EXPONENT))),
            },
            relief: Relief::of(m),
        }
    }

    /// `map_Ks` as a colour.
    fn ks_colour(&self) -> Option<Colour> {
        self.ks.clone().map(Colour::Texture)
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
    fn of(m: &MtlMaterial, maps: &Maps) -> Self {
        let plain = |given: Option<[f32; 3]>, map: &str| {
            if is_missing(m, map) {
                Some([GREY; 3])
            } else {
                given
            }
        };
        let ks = plain(m.ks, "map_ks");
        Self {
            kd: plain(m.kd, "map_kd").unwrap_or([GREY; 3]).into(),
            ks: ks.unwrap_or_default().into(),
            ks_given: ks.is_some(),
            ks_textured: maps.ks.is_some(),
        }
    }

    /// Metals have the colour `Ks`; files that know of metals alone (`Pm`) may give it as `Kd`, and where a texture
    /// says which points are metal, it is that of the points.
    fn metal_is_kd(&self, m: &MtlMaterial) -> bool {
        let plain = !self.ks_given && !self.ks_textured && m.pm.is_some();
        plain || m.map("map_pm").is_some()
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

/// Emitted radiance, or the factor on its texture.
fn emission(m: &MtlMaterial, maps: &Maps) -> Option<Vec3> {
    let emission = m.ke.map_or(Vec3::ZERO, Vec3::from);
    if maps.ke.is_some() && emission == Vec3::ZERO {
        return Some(Vec3::ONE);
    }
    (emission != Vec3::ZERO).then_some(emission)
}

/// What scatters, and what gives [`Bsdf::colour`].
type Scattering = (Bsdf, Option<Colour>);

/// An MTL material being read, and what there is to say about it.
struct Reading<'a> {
    m: &'a MtlMaterial,
    colours: Colours,
    maps: &'a Maps,
    remarks: &'a mut Remarks,
}

impl Reading<'_> {
    fn scattering(&mut self) -> Scattering {
        let (m, maps, colours) = (self.m, self.maps, &self.colours);
        let metallic = match &maps.metallic {
            Some(map) => map.mean().x.clamp(0.0, 1.0),
            None => m.pm.unwrap_or(0.0),
        };
        // Phong exponents are those of highlights.
        let textured = matches!(maps.roughness, Some(Roughness::Pr(_)));
        if metallic >= 1.0 && maps.metallic.is_none() {
            let map = if colours.metal_is_kd(m) {
                maps.kd.clone()
            } else {
                maps.ks_colour()
            };
            let alpha = pr_alpha(m).unwrap_or(0.0);
            return (conductor(colours.metal(m), alpha, textured), map);
        }
        let (passage, remark) = passage(m);
        if let Some(remark) = remark {
            self.remarks.add(Kind::Note, &m.name, remark);
        }
        let (opacity, through) = match passage {
            Passage::Glass { ior, tint } => {
                let alpha = pr_alpha(m).unwrap_or(0.0);
                return (glass(ior, alpha, tint, textured), None);
            }
            Passage::Straight { opacity, tint } => (opacity, (1.0 - opacity) * tint),
            Passage::Opaque => (1.0, Vec3::ZERO),
        };
        let reflects = matches!(m.illum, Some(3 | 5 | 8)) && colours.has_ks();
        if reflects
            && opacity == 1.0
            && let Some(metal) = self.reflector()
        {
            return metal;
        }
        // Programs that know no highlights write Ns 0 beside a white Ks.
        let colours = &self.colours;
        let shines = colours.has_ks() && m.ns.is_none_or(|ns| ns > 0.0);
        let coat = if reflects {
            Some(mirror_coat(m, colours, maps))
        } else if metallic > 0.0
            || maps.metallic.is_some()
            || (shines && m.illum.is_none_or(|illum| illum > 1))
            || (pr_alpha(m).is_some() && !colours.ks_given)
        {
            Some(coat(m, metallic, colours, maps))
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
        (bsdf, maps.kd.clone())
    }

    /// What reflects by illum 3, 5 or 8 with the reflectance `Ks`; `None` where a Lambert part shows beside it.
    fn reflector(&mut self) -> Option<Scattering> {
        let (m, maps) = (self.m, self.maps);
        let Colours { kd, ks, .. } = self.colours;
        let alpha = alpha(m, MIRROR_EXPONENT);
        let metal = |f0, map| (conductor(f0, alpha, maps.roughness.is_some()), map);
        let textured = matches!(maps.kd, Some(Colour::Texture(_)));
        let shaded = textured || (m.kd.is_some() && kd.max_element() > FAINT);
        if !shaded {
            return Some(metal(ks, maps.ks_colour()));
        }
        // Blender writes illum 3 for metals, whose colour is Kd, beside the default of its dielectric's Ks.
        let plain_half = ks == Vec3::splat(0.5) && maps.ks.is_none();
        if plain_half && m.illum == Some(3) && m.pm.is_none() {
            let what =
                "illum 3 beside Ks 0.5 is taken as a metal of the colour Kd, as Blender writes it";
            self.remarks.add(Kind::Note, &m.name, what);
            return Some(metal(kd, maps.kd.clone()));
        }
        let left = kd.max_element() * (1.0 - ks.max_element());
        if left > VISIBLE && maps.ks.is_none() {
            return None;
        }
        let illum = m.illum.unwrap_or_default();
        let what = format!("Ks and illum {illum} make a mirror; Kd is left out");
        self.remarks.add(Kind::Warning, &m.name, what);
        Some(metal(ks, maps.ks_colour()))
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
    pr_alpha(m).unwrap_or_else(|| phong_alpha(m.ns.unwrap_or(exponent)))
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
        alpha: coat_alpha(alpha(m, MIRROR_EXPONENT), maps.roughness.is_some()),
        ..Coat::NONE
    }
}

/// The coat of plastic.
fn coat(m: &MtlMaterial, metallic: f32, colours: &Colours, maps: &Maps) -> Coat {
    Coat {
        f0: coat_f0(m.ni),
        // What modelling programs write for an ordinary dielectric is 0.5.
        tint: if maps.ks.is_some() || !colours.ks_given {
            Vec3::ONE
        } else {
            (2.0 * colours.ks).min(Vec3::ONE)
        },
        metallic,
        metal: match &maps.ks {
            Some(map) => map.mean().clamp(Vec3::ZERO, Vec3::ONE),
            None => colours.metal(m),
        },
        metal_is_albedo: colours.metal_is_kd(m),
        alpha: coat_alpha(alpha(m, DULL_EXPONENT), maps.roughness.is_some()),
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
fn survival(bsdf: &Bsdf, colour: Option<&Colour>) -> f32 {
    let mut typical = bsdf.parameters();
    if let Some(map) = colour {
        typical.colour = map.mean();
    }
    match bsdf.with(&typical) {
        scatters @ (Bsdf::Lambert { .. } | Bsdf::Plastic { .. }) => {
            scatters.albedo().max_element().clamp(0.1, 0.95)
        }
        _ => 0.95,
    }
}
