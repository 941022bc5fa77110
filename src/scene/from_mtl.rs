//! What MTL parameters mean: a material as it is written to a material of the scene, by the tables of the
//! README.

use super::material::{Class, Material, SMOOTHEST_ALPHA};
use super::texture::{Meaning, Texture};
use super::textured::{Relief, Textures};
use crate::bsdf::Bsdf;
use crate::bsdf::plastic::{self, Coat};
use crate::error::{Error, Result, Warnings};
use crate::load::mtl::MtlMaterial;
use glam::Vec3;
use std::path::Path;

/// Diffuse reflectance of what has no `Kd`.
const GREY: f32 = 0.5;
/// Phong exponents from here up are perfect mirrors.
const MIRROR_EXPONENT: f32 = 1000.0;
/// At an index this near to 1 light passes unbent, however rough the surface is; and half vectors, of
/// length |index − 1|, would be made of rounding errors.
const SAME_INDEX: f32 = 1e-3;
/// Refractive index of a coat of which none is given.
const COAT_INDEX: f32 = 1.5;
/// Phong exponent of a surface with `Ks` and without `Ns`.
const DULL_EXPONENT: f32 = 10.0;

impl Material {
    /// Interprets an MTL material, by the tables of the README. `path` is for messages.
    pub fn from_mtl(
        m: &MtlMaterial,
        roughness_threshold: f32,
        path: &Path,
        warnings: &mut Warnings,
    ) -> Result<Self> {
        let mut reading = Reading { m, path, warnings };
        let maps = Maps::of(m);
        let emission = reading.emission(&maps)?;
        let colours = reading.colours(&maps)?;
        let (bsdf, colour_map) = reading.scattering(&colours, &maps, emission.is_some())?;
        let class = if emission.is_some() || bsdf.roughness() > roughness_threshold {
            Class::Rough
        } else {
            Class::Specular
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
            name: m.name.clone(),
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
    /// Factor on transmitted light.
    tint: Vec3,
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
}

/// An MTL material being read, with what messages need.
struct Reading<'a> {
    m: &'a MtlMaterial,
    path: &'a Path,
    warnings: &'a mut Warnings,
}

impl Reading<'_> {
    fn warn(&mut self, what: &str) -> Result<()> {
        let (path, name) = (self.path.display(), &self.m.name);
        self.warnings
            .push(format!("{path}: material '{name}': {what}"))
    }

    /// Emitted radiance, or the factor on its texture.
    fn emission(&self, maps: &Maps) -> Result<Option<Vec3>> {
        let emission = self.m.ke.map_or(Vec3::ZERO, Vec3::from);
        if emission.min_element() < 0.0 {
            let message = format!("material '{}' has a negative Ke", self.m.name);
            return Err(Error::input(self.path, None, message));
        }
        if maps.ke.is_some() && emission == Vec3::ZERO {
            return Ok(Some(Vec3::ONE));
        }
        Ok((emission != Vec3::ZERO).then_some(emission))
    }

    fn colours(&mut self, maps: &Maps) -> Result<Colours> {
        let m = self.m;
        let plain = |given: Option<[f32; 3]>, map: &str| {
            if is_missing(m, map) {
                Some([GREY; 3])
            } else {
                given
            }
        };
        let given_ks = plain(m.ks, "map_ks");
        Ok(Colours {
            kd: self.reflectance("Kd", plain(m.kd, "map_kd"), GREY)?,
            ks: self.reflectance("Ks", given_ks, 0.0)?,
            ks_given: given_ks.is_some(),
            ks_textured: maps.ks.is_some(),
            tint: self.reflectance("Tf", m.tf, 1.0)?,
        })
    }

    /// A colour, clamped to [0, 1].
    fn reflectance(&mut self, key: &str, given: Option<[f32; 3]>, default: f32) -> Result<Vec3> {
        let c = given.map_or(Vec3::splat(default), Vec3::from);
        if c.min_element() < 0.0 || c.max_element() > 1.0 {
            self.warn(&format!("{key} is outside of 0 to 1 and clamped"))?;
        }
        Ok(c.clamp(Vec3::ZERO, Vec3::ONE))
    }

    /// What scatters, and the texture of [`Bsdf::colour`].
    fn scattering(
        &mut self,
        colours: &Colours,
        maps: &Maps,
        emits: bool,
    ) -> Result<(Bsdf, Option<Texture>)> {
        let m = self.m;
        let metallic = m.pm.unwrap_or(0.0).clamp(0.0, 1.0);
        // Programs that know no highlights write Ns 0 beside a white Ks.
        let specular =
            (colours.ks != Vec3::ZERO || maps.ks.is_some()) && m.ns.is_none_or(|ns| ns > 0.0);
        let transparent = self.is_transparent()?;
        let textured = maps.pr.is_some();
        if metallic >= 1.0 {
            let metal = colours.metal(m);
            let map = if colours.metal_is_kd(m) {
                &maps.kd
            } else {
                &maps.ks
            };
            let alpha = pr_alpha(m).unwrap_or(0.0);
            Ok((conductor(metal, alpha, textured), map.clone()))
        } else if transparent {
            Ok((self.glass(colours.tint, textured)?, None))
        } else if m.illum == Some(3) {
            let diffuse = colours.kd != Vec3::ZERO || maps.kd.is_some();
            if m.kd.is_some() && diffuse && !emits {
                self.warn(
                    "has a diffuse and a specular part and illum 3; the diffuse part is dropped",
                )?;
            }
            let metal = conductor(colours.ks, alpha(m, MIRROR_EXPONENT), textured);
            Ok((metal, maps.ks.clone()))
        } else if metallic > 0.0
            || (specular && m.illum.is_none_or(|illum| illum > 1))
            || (pr_alpha(m).is_some() && !colours.ks_given)
        {
            let albedo = colours.kd;
            let coat = coat(m, colours, maps);
            Ok((Bsdf::Plastic { albedo, coat }, maps.kd.clone()))
        } else {
            let albedo = colours.kd;
            Ok((Bsdf::Lambert { albedo }, maps.kd.clone()))
        }
    }

    /// Whether light passes through.
    fn is_transparent(&mut self) -> Result<bool> {
        let m = self.m;
        let by_illum = matches!(m.illum, Some(5 | 6 | 7 | 9));
        let by_opacity = m.opacity.is_some_and(|d| d < 1.0);
        if by_opacity && m.ni.is_none() && !by_illum {
            self.warn("is transparent (d, Tr) but has no Ni; it is taken as opaque")?;
        }
        Ok(by_illum || (by_opacity && m.ni.is_some()))
    }

    /// `textured`: a texture gives the roughness, so that it may be anything.
    fn glass(&self, tint: Vec3, textured: bool) -> Result<Bsdf> {
        let ior = self.m.ni.unwrap_or(1.5);
        if !(0.1..=10.0).contains(&ior) {
            let message = format!(
                "material '{}': the refractive index Ni {ior} is outside of 0.1 to 10",
                self.m.name
            );
            return Err(Error::input(self.path, None, message));
        }
        let alpha = pr_alpha(self.m).unwrap_or(0.0);
        if (alpha < SMOOTHEST_ALPHA && !textured) || (ior - 1.0).abs() < SAME_INDEX {
            Ok(Bsdf::Glass { ior, tint })
        } else {
            let alpha = alpha.max(SMOOTHEST_ALPHA);
            Ok(Bsdf::RoughGlass { ior, alpha, tint })
        }
    }
}

/// GGX roughness by `Pr`, if that or its texture is given.
fn pr_alpha(m: &MtlMaterial) -> Option<f32> {
    let map = m.map("map_pr");
    (m.pr.is_some() || map.is_some()).then(|| {
        let default = if is_missing(m, "map_pr") { GREY } else { 0.0 };
        m.pr.unwrap_or(default).clamp(0.0, 1.0).powi(2)
    })
}

/// GGX roughness by `Pr`, or else by the Phong exponent `Ns`, which is `exponent` if absent.
fn alpha(m: &MtlMaterial, exponent: f32) -> f32 {
    pr_alpha(m).unwrap_or_else(|| {
        let ns = m.ns.unwrap_or(exponent);
        if ns >= MIRROR_EXPONENT {
            0.0
        } else {
            (2.0 / (ns.max(0.0) + 2.0)).sqrt()
        }
    })
}

/// The coat of plastic.
fn coat(m: &MtlMaterial, colours: &Colours, maps: &Maps) -> Coat {
    let alpha = alpha(m, DULL_EXPONENT);
    let smooth = alpha < plastic::SMOOTHEST && maps.pr.is_none();
    Coat {
        f0: coat_f0(m.ni),
        // What modelling programs write for an ordinary dielectric is 0.5.
        tint: if maps.ks.is_some() || !colours.ks_given {
            Vec3::ONE
        } else {
            (2.0 * colours.ks).min(Vec3::ONE)
        },
        metallic: m.pm.unwrap_or(0.0).clamp(0.0, 1.0),
        metal: match &maps.ks {
            Some(map) => map.mean().clamp(Vec3::ZERO, Vec3::ONE),
            None => colours.metal(m),
        },
        metal_is_albedo: colours.metal_is_kd(m),
        alpha: if smooth {
            0.0
        } else {
            alpha.max(plastic::SMOOTHEST)
        },
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

#[cfg(test)]
mod tests {
    use super::*;

    fn read(m: MtlMaterial) -> (Material, usize) {
        let mut warnings = Warnings::new(false);
        let material = Material::from_mtl(&m, 0.1, Path::new("x.obj"), &mut warnings).unwrap();
        (material, warnings.list().len())
    }

    #[test]
    fn mtl_parameters_mean_what_the_readme_says() {
        let base = MtlMaterial {
            kd: Some([0.2, 0.3, 0.4]),
            ..Default::default()
        };
        let ks = Some([0.9; 3]);
        let f0 = Vec3::splat(0.9);
        assert_eq!(
            read(base.clone()).0.bsdf,
            Bsdf::Lambert {
                albedo: Vec3::new(0.2, 0.3, 0.4)
            }
        );
        let metal = MtlMaterial {
            pm: Some(1.0),
            pr: Some(0.5),
            ks,
            ..Default::default()
        };
        assert_eq!(
            read(metal.clone()).0.bsdf,
            Bsdf::Conductor { f0, alpha: 0.25 }
        );
        assert_eq!(read(metal.clone()).0.class, Class::Rough);
        assert_eq!(
            read(MtlMaterial {
                pr: Some(0.0),
                ..metal
            })
            .0
            .bsdf,
            Bsdf::Mirror { f0 }
        );
        let phong = MtlMaterial {
            illum: Some(3),
            ns: Some(48.0),
            ks,
            ..Default::default()
        };
        assert_eq!(
            read(phong.clone()).0.bsdf,
            Bsdf::Conductor { f0, alpha: 0.2 }
        );
        assert_eq!(
            read(MtlMaterial {
                ns: Some(1000.0),
                ..phong
            })
            .0
            .bsdf,
            Bsdf::Mirror { f0 }
        );
        for illum in [5, 6, 7, 9] {
            let glass = MtlMaterial {
                illum: Some(illum),
                ni: Some(1.5),
                ..Default::default()
            };
            assert_eq!(
                read(glass).0.bsdf,
                Bsdf::Glass {
                    ior: 1.5,
                    tint: Vec3::ONE
                }
            );
        }
        let tr = MtlMaterial {
            opacity: Some(0.1),
            ni: Some(1.3),
            pr: Some(0.5),
            tf: Some([1.0, 0.5, 0.5]),
            ..Default::default()
        };
        let tint = Vec3::new(1.0, 0.5, 0.5);
        assert_eq!(
            read(tr).0.bsdf,
            Bsdf::RoughGlass {
                ior: 1.3,
                alpha: 0.25,
                tint
            }
        );
        let missing = read(MtlMaterial::default()).0;
        assert_eq!(
            missing.bsdf,
            Bsdf::Lambert {
                albedo: Vec3::splat(0.5)
            }
        );
        let light = read(MtlMaterial {
            ke: Some([1.0, 0.0, 0.0]),
            ..Default::default()
        })
        .0;
        assert_eq!((light.emission, light.class), (Some(Vec3::X), Class::Rough));
    }

    #[test]
    fn diffuse_and_specular_parts_make_plastic() {
        let coat_of = |m: MtlMaterial| match read(m).0.bsdf {
            Bsdf::Plastic { coat, .. } => Some(coat),
            _ => None,
        };
        let both = MtlMaterial {
            kd: Some([0.5; 3]),
            ks: Some([0.5; 3]),
            ns: Some(198.0),
            illum: Some(2),
            ..Default::default()
        };
        let coat = coat_of(both.clone()).unwrap();
        assert!((coat.f0 - 0.04).abs() < 1e-6 && (coat.alpha - 0.1).abs() < 1e-6);
        assert_eq!((coat.tint, coat.metallic), (Vec3::ONE, 0.0));
        let with = |change: &dyn Fn(&mut MtlMaterial)| {
            let mut m = both.clone();
            change(&mut m);
            coat_of(m)
        };
        // No highlight by illum 1, none with a black Ks, none with Ns 0.
        assert_eq!(with(&|m| m.ns = Some(0.0)), None);
        assert_eq!(with(&|m| m.illum = Some(1)), None);
        assert_eq!(with(&|m| m.ks = Some([0.0; 3])), None);
        let faint = with(&|m| m.ks = Some([0.25; 3])).unwrap();
        assert_eq!(faint.tint, Vec3::splat(0.5));
        assert!(with(&|m| m.ns = Some(1000.0)).unwrap().is_smooth());
        let rough = with(&|m| (m.pr, m.ks) = (Some(0.5), None)).unwrap();
        assert_eq!((rough.alpha, rough.tint), (0.25, Vec3::ONE));
        let mixed = with(&|m| m.pm = Some(0.25)).unwrap();
        assert_eq!((mixed.metallic, mixed.metal), (0.25, Vec3::splat(0.5)));
        // illum 3 is metal alone.
        let metal = MtlMaterial {
            illum: Some(3),
            ..both
        };
        assert_eq!(read(metal).1, 1);
    }
}
