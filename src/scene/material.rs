//! What MTL parameters mean.

use crate::bsdf::Bsdf;
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
    /// How it scatters. A light scatters nothing, whatever stands here.
    pub bsdf: Bsdf,
    /// Rough or specular, by the roughness threshold. A light counts as rough.
    pub class: Class,
    /// Radiance emitted on the front side; `None` where it does not emit.
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
const SMOOTHEST_ALPHA: f32 = 1e-4;
/// At an index this near to 1 light passes unbent, however rough the surface is; and half vectors, of
/// length |index − 1|, would be made of rounding errors.
const SAME_INDEX: f32 = 1e-3;

impl Material {
    /// Interprets an MTL material. Says which lobe is dropped where there is more than one.
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

        let emission = colour(m.ke, 0.0);
        if emission.min_element() < 0.0 {
            return Err(Error::input(
                path,
                None,
                format!("material '{}' has a negative Ke", m.name),
            ));
        }
        for map in &m.maps {
            warn(&format!(
                "{map} and other textures are not supported yet; the plain value is used"
            ))?;
        }
        let mut reflectance = |c: Vec3, name: &str| -> Result<Vec3> {
            if c.min_element() < 0.0 || c.max_element() > 1.0 {
                warn(&format!("{name} is outside of 0 to 1 and clamped"))?;
            }
            Ok(c.clamp(Vec3::ZERO, Vec3::ONE))
        };
        let kd = reflectance(colour(m.kd, GREY), "Kd")?;
        let ks = reflectance(colour(m.ks, 0.0), "Ks")?;
        let tint = reflectance(colour(m.tf, 1.0), "Tf")?;

        let metallic = m.pm.unwrap_or(0.0);
        let has_roughness = m.pr.is_some();
        let alpha = m.pr.unwrap_or(0.0).clamp(0.0, 1.0).powi(2);
        let transparent = m.opacity.is_some_and(|d| d < 1.0) && m.ni.is_some();
        if m.opacity.is_some_and(|d| d < 1.0)
            && m.ni.is_none()
            && !matches!(m.illum, Some(5 | 6 | 7 | 9))
        {
            warn("is transparent (d, Tr) but has no Ni; it is taken as opaque")?;
        }
        let bsdf = if metallic >= 1.0 {
            conductor(ks, alpha)
        } else if matches!(m.illum, Some(5 | 6 | 7 | 9)) || transparent {
            glass(m.ni.unwrap_or(1.5), alpha, tint, path, &m.name)?
        } else if m.illum == Some(3) {
            if has_roughness {
                conductor(ks, alpha)
            } else {
                match m.ns.unwrap_or(MIRROR_EXPONENT) {
                    ns if ns >= MIRROR_EXPONENT => conductor(ks, 0.0),
                    ns => conductor(ks, (2.0 / (ns.max(0.0) + 2.0)).sqrt()),
                }
            }
        } else {
            Bsdf::Lambert { albedo: kd }
        };

        let emission = (emission != Vec3::ZERO).then_some(emission);
        if emission.is_none() {
            let metallic_part = metallic > 0.0 && metallic < 1.0;
            match bsdf {
                Bsdf::Lambert { .. }
                    if (ks != Vec3::ZERO && m.illum != Some(1)) || metallic_part =>
                {
                    warn("has a diffuse and a specular part; the specular part is dropped")?;
                }
                Bsdf::Mirror { .. } | Bsdf::Conductor { .. }
                    if m.kd.is_some_and(|kd| kd != [0.0; 3]) && metallic < 1.0 =>
                {
                    warn("has a diffuse and a specular part; the diffuse part is dropped")?;
                }
                _ => {}
            }
        }
        let class = if emission.is_some() || bsdf.roughness() > roughness_threshold {
            Class::Rough
        } else {
            Class::Specular
        };
        let survival = match bsdf {
            Bsdf::Lambert { albedo } => albedo.max_element().clamp(0.1, 0.95),
            _ => 0.95,
        };
        Ok(Self {
            name: m.name.clone(),
            bsdf,
            class,
            emission,
            survival,
        })
    }
}

fn conductor(f0: Vec3, alpha: f32) -> Bsdf {
    if alpha < SMOOTHEST_ALPHA {
        Bsdf::Mirror { f0 }
    } else {
        Bsdf::Conductor { f0, alpha }
    }
}

fn glass(ior: f32, alpha: f32, tint: Vec3, path: &Path, name: &str) -> Result<Bsdf> {
    if !(0.1..=10.0).contains(&ior) {
        let message =
            format!("material '{name}': the refractive index Ni {ior} is outside of 0.1 to 10");
        return Err(Error::input(path, None, message));
    }
    if alpha < SMOOTHEST_ALPHA || (ior - 1.0).abs() < SAME_INDEX {
        Ok(Bsdf::Glass { ior, tint })
    } else {
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
    fn dropped_lobes_are_named() {
        let both = MtlMaterial {
            kd: Some([0.5; 3]),
            ks: Some([0.5; 3]),
            illum: Some(2),
            ..Default::default()
        };
        assert_eq!(read(both.clone()).1, 1);
        assert_eq!(
            read(MtlMaterial {
                illum: Some(3),
                ..both.clone()
            })
            .1,
            1
        );
        assert_eq!(read(MtlMaterial { ks: None, ..both }).1, 0);
    }
}
