//! What MTL parameters mean.

use super::mesh::Mesh;
use super::texture::{Meaning, Texture};
use super::textured::{Relief, Textures};
use crate::bsdf::plastic::{self, Coat};
use crate::bsdf::{Bsdf, Texel};
use crate::error::{Error, Result, Warnings};
use crate::load::mtl::MtlMaterial;
use glam::Vec3;
use std::path::Path;

/// Whether the shift reconnects at a vertex or copies its half vector (method.md section 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Class {
    /// Offset paths may be reconnected here, and light is sampled here.
    Rough,
    /// Offset paths copy the half vector.
    Specular,
}

/// A material of the scene.
#[derive(Clone, Debug)]
pub struct Material {
    /// Its name in the MTL.
    pub name: String,
    /// How it scatters, textures aside. A light scatters nothing, whatever stands here.
    pub bsdf: Bsdf,
    /// The values that textures may replace.
    pub texel: Texel,
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

/// Diffuse reflectance of what has no `Kd`.
const GREY: f32 = 0.5;
/// Phong exponents from here up are perfect mirrors.
const MIRROR_EXPONENT: f32 = 1000.0;
/// Below this the GGX roughness cannot be told from a perfectly smooth surface in 32-bit floats.
pub(super) const SMOOTHEST_ALPHA: f32 = 1e-4;
/// At an index this near to 1 light passes unbent, however rough the surface is; and half vectors, of
/// length |index − 1|, would be made of rounding errors.
const SAME_INDEX: f32 = 1e-3;
/// Refractive index of a coat of which none is given.
const COAT_INDEX: f32 = 1.5;
/// Phong exponent of a surface with `Ks` and without `Ns`.
const DULL_EXPONENT: f32 = 10.0;

impl Material {
    /// Interprets an MTL material, by the tables of the README.
    pub fn from_mtl(
        m: &MtlMaterial,
        roughness_threshold: f32,
        path: &Path,
        warnings: &mut Warnings,
    ) -> Result<Self> {
        let colour = |c: Option<[f32; 3]>, default: f32| c.map_or(Vec3::splat(default), Vec3::from);
        let mut warn = |what: &str| {
            warnings.push(format!("{}: material '{}': {what}", path.display(), m.name))
        };

        // Textures: they take the place of the plain values; of those that are missing, grey does.
        let texture = |key: &str, meaning| m.map(key).and_then(|map| Texture::new(map, meaning));
        let missing = |key: &str| m.map(key).is_some_and(|map| map.bitmap.is_none());
        let kd_map = texture("map_kd", Meaning::Colour);
        let ks_map = texture("map_ks", Meaning::Colour);
        let pr_map = texture("map_pr", Meaning::Data);
        let ke_map = texture("map_ke", Meaning::Colour);
        let relief = match (texture("norm", Meaning::Data), m.map("map_bump")) {
            (Some(normals), _) => Some(Relief::Normals(normals)),
            (None, Some(map)) => Texture::new(map, Meaning::Data)
                .map(|heights| Relief::Heights(heights, map.multiplier)),
            (None, None) => None,
        };

        // Emission.
        let mut emission = colour(m.ke, 0.0);
        if emission.min_element() < 0.0 {
            return Err(Error::input(
                path,
                None,
                format!("material '{}' has a negative Ke", m.name),
            ));
        }
        if ke_map.is_some() && emission == Vec3::ZERO {
            emission = Vec3::ONE;
        }
        // Reflectances.
        let mut reflectance = |c: Vec3, name: &str| -> Result<Vec3> {
            if c.min_element() < 0.0 || c.max_element() > 1.0 {
                warn(&format!("{name} is outside of 0 to 1 and clamped"))?;
            }
            Ok(c.clamp(Vec3::ZERO, Vec3::ONE))
        };
        let plain = |given: Option<[f32; 3]>, key: &str| {
            if missing(key) { Some([GREY; 3]) } else { given }
        };
        let kd = reflectance(colour(plain(m.kd, "map_kd"), GREY), "Kd")?;
        let given_ks = plain(m.ks, "map_ks");
        let ks = reflectance(colour(given_ks, 0.0), "Ks")?;
        let tint = reflectance(colour(m.tf, 1.0), "Tf")?;
        // Programs that know no highlights write Ns 0 beside a white Ks.
        let specular = (ks != Vec3::ZERO || ks_map.is_some()) && m.ns.is_none_or(|ns| ns > 0.0);

        // Roughness and transparency.
        let metallic = m.pm.unwrap_or(0.0).clamp(0.0, 1.0);
        let has_roughness = m.pr.is_some() || m.map("map_pr").is_some();
        let pr_alpha = |pr: f32| pr.clamp(0.0, 1.0).powi(2);
        let alpha = pr_alpha(m.pr.unwrap_or(if missing("map_pr") { GREY } else { 0.0 }));
        let phong_alpha = |ns: f32| {
            if ns >= MIRROR_EXPONENT {
                0.0
            } else {
                (2.0 / (ns.max(0.0) + 2.0)).sqrt()
            }
        };
        let see_through = m.opacity.is_some_and(|d| d < 1.0);
        let transparent = see_through && m.ni.is_some();
        if see_through && m.ni.is_none() && !matches!(m.illum, Some(5 | 6 | 7 | 9)) {
            warn("is transparent (d, Tr) but has no Ni; it is taken as opaque")?;
        }
        // What scatters. Metals have the colour Ks; files that know of metals alone (Pm) may give it as Kd.
        let metal_is_kd = given_ks.is_none() && ks_map.is_none() && m.pm.is_some();
        let (metal, metal_map) = if metal_is_kd {
            (kd, &kd_map)
        } else {
            (ks, &ks_map)
        };
        let diffuse = kd != Vec3::ZERO || kd_map.is_some();
        let (bsdf, colour_map) = if metallic >= 1.0 {
            (conductor(metal, alpha, pr_map.is_some()), metal_map)
        } else if matches!(m.illum, Some(5 | 6 | 7 | 9)) || transparent {
            let glass = glass(
                m.ni.unwrap_or(1.5),
                alpha,
                tint,
                pr_map.is_some(),
                path,
                &m.name,
            )?;
            (glass, &None)
        } else if m.illum == Some(3) {
            let alpha = if has_roughness {
                alpha
            } else {
                phong_alpha(m.ns.unwrap_or(MIRROR_EXPONENT))
            };
            if m.kd.is_some() && diffuse && emission == Vec3::ZERO {
                warn("has a diffuse and a specular part and illum 3; the diffuse part is dropped")?;
            }
            (conductor(ks, alpha, pr_map.is_some()), &ks_map)
        } else if metallic > 0.0
            || (specular && m.illum.is_none_or(|illum| illum > 1))
            || (has_roughness && given_ks.is_none())
        {
            let alpha = if has_roughness {
                alpha
            } else {
                phong_alpha(m.ns.unwrap_or(DULL_EXPONENT))
            };
            let smooth = alpha < plastic::SMOOTHEST && pr_map.is_none();
            let coat = Coat {
                f0: coat_f0(m.ni),
                // What modelling programs write for an ordinary dielectric is 0.5.
                tint: if ks_map.is_some() || given_ks.is_none() {
                    Vec3::ONE
                } else {
                    (2.0 * ks).min(Vec3::ONE)
                },
                metallic,
                metal: ks_map
                    .as_ref()
                    .map_or(metal, |map| map.mean().clamp(Vec3::ZERO, Vec3::ONE)),
                metal_is_albedo: metal_is_kd,
                alpha: if smooth {
                    0.0
                } else {
                    alpha.max(plastic::SMOOTHEST)
                },
            };
            (Bsdf::Plastic { albedo: kd, coat }, &kd_map)
        } else {
            (Bsdf::Lambert { albedo: kd }, &kd_map)
        };

        // Class and survival.
        let emission = (emission != Vec3::ZERO).then_some(emission);
        let class = if emission.is_some() || bsdf.roughness() > roughness_threshold {
            Class::Rough
        } else {
            Class::Specular
        };
        let mut typical = bsdf.texel();
        if let Some(map) = colour_map {
            typical.colour = map.mean().clamp(Vec3::ZERO, Vec3::ONE);
        }
        let survival = match bsdf.with(&typical) {
            scatters @ (Bsdf::Lambert { .. } | Bsdf::Plastic { .. }) => {
                scatters.albedo().max_element().clamp(0.1, 0.95)
            }
            _ => 0.95,
        };
        let textures = Textures {
            colour: colour_map.clone(),
            specular: ks_map.filter(|_| matches!(bsdf, Bsdf::Plastic { .. })),
            roughness: pr_map.filter(|_| bsdf.texel().alpha > 0.0),
            emission: ke_map,
            relief,
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

    /// The texture that cuts holes into the surface.
    pub fn opacity(m: &MtlMaterial) -> Option<Texture> {
        m.map("map_d")
            .and_then(|map| Texture::new(map, Meaning::Opacity))
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

fn glass(
    ior: f32,
    alpha: f32,
    tint: Vec3,
    textured: bool,
    path: &Path,
    name: &str,
) -> Result<Bsdf> {
    if !(0.1..=10.0).contains(&ior) {
        let message =
            format!("material '{name}': the refractive index Ni {ior} is outside of 0.1 to 10");
        return Err(Error::input(path, None, message));
    }
    if (alpha < SMOOTHEST_ALPHA && !textured) || (ior - 1.0).abs() < SAME_INDEX {
        Ok(Bsdf::Glass { ior, tint })
    } else {
        let alpha = alpha.max(SMOOTHEST_ALPHA);
        Ok(Bsdf::RoughGlass { ior, alpha, tint })
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
