//! The shift: how an offset path follows its base path, vertex by vertex (Kettunen et al. 2015,
//! section 5.2).
//!
//! Every decision is symmetric: seen from the offset path, with base and offset exchanged, it comes out
//! the same, so that T_ji(T_ij(x)) = x.

use crate::bsdf::{Eval, Lobe, half_vector};
use crate::geometry::solid_angle_per_area;
use crate::lanes::Vector;
use crate::scene::Scene;
use crate::scene::material::Class;
use crate::vertex::{End, LightPoint, Scattering, Vertex};
use glam::Vec3;

/// The state of an offset path, up to the base path's current vertex x_k.
#[derive(Clone, Copy, Debug)]
pub enum Offset {
    /// At a vertex y_k of its own.
    Free {
        /// y_k
        vertex: Vertex,
        /// What it carries.
        carried: Carried,
    },
    /// It has just joined the base path at x_k, which it sees from y_{k-1}.
    Joined {
        /// Unit direction from x_k to y_{k-1}.
        wo: Vec3,
        /// What it carries.
        carried: Carried,
    },
    /// It has shared the base path's vertices and directions for a while.
    Connected(Carried),
    /// The shift has failed.
    Dead,
}

/// What an offset path carries along, up to its current vertex, the scattering there excluded.
#[derive(Clone, Copy, Debug)]
pub struct Carried {
    /// f(y)|T'|/p(x): the offset path's throughput, times the Jacobian, over the base path's density.
    pub throughput: Vec3,
    /// p(y)|T'|/p(x): the densities' ratio.
    pub ratio: f32,
}

impl Carried {
    /// At the primary hit, where both are 1.
    pub const START: Self = Self {
        throughput: Vec3::ONE,
        ratio: 1.0,
    };

    /// One scattering event further. `eval` is the offset path's, `jacobian` that of the shift of this
    /// direction, `pdf` the base path's density with its roulette, `survival` the offset path's.
    #[inline]
    pub fn scatter(&self, eval: &Eval, jacobian: f32, pdf: f32, survival: f32) -> Self {
        let scale = jacobian / pdf;
        Self {
            throughput: self.throughput * eval.value * scale,
            ratio: self.ratio * eval.pdf * survival * scale,
        }
    }

    #[inline]
    fn is_finite(&self) -> bool {
        self.throughput.is_finite() && self.ratio.is_finite()
    }
}

/// Why a shift failed; for the statistics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Death {
    /// A ray hits nothing, or a light, where the other path's hits a surface.
    Missed,
    /// The classes of the two vertices differ.
    Class,
    /// The reconnection is blocked.
    Blocked,
    /// A direction lies on the other side of a surface, or of a light.
    Side,
    /// The lobe does not exist at the offset vertex, or there is total internal reflection.
    Lobe,
    /// A value is not finite.
    NotFinite,
}

impl Death {
    /// All reasons, in the order of their numbers.
    pub const ALL: [Death; 6] = [
        Death::Missed,
        Death::Class,
        Death::Blocked,
        Death::Side,
        Death::Lobe,
        Death::NotFinite,
    ];

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        ["missed", "class", "blocked", "side", "lobe", "not_finite"][self as usize]
    }
}

/// How an offset path that is still free goes on from y_k when the base path goes x_k → x_{k+1}.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// y_k is joined to x_{k+1}.
    Reconnect,
    /// y_k copies the half vector of x_k.
    Copy,
}

/// Reconnect where x_k and x_{k+1} are rough (y_k has the class of x_k, or it would be dead).
#[inline]
pub fn way(at: Class, next: Class) -> Way {
    if at == Class::Rough && next == Class::Rough {
        Way::Reconnect
    } else {
        Way::Copy
    }
}

/// The first vertices of a base path and of an offset path through a neighbouring pixel.
#[inline]
pub fn primary(scene: &Scene, base: &Vertex, offset: &End) -> Result<Offset, Death> {
    let vertex = same_kind(scene, base, offset)?;
    Ok(Offset::Free {
        vertex,
        carried: Carried::START,
    })
}

/// The offset path's vertex, where it is a surface of the base vertex's class.
#[inline]
fn same_kind(scene: &Scene, base: &Vertex, offset: &End) -> Result<Vertex, Death> {
    match offset {
        End::Surface(vertex) if vertex.class(scene) == base.class(scene) => Ok(*vertex),
        End::Surface(_) => Err(Death::Class),
        End::Light(_) | End::Environment(_) => Err(Death::Missed),
    }
}

/// A direction of the offset path at y_k, before it is known whether the way is free.
#[derive(Clone, Copy, Debug)]
pub struct Shifted {
    /// Unit direction at y_k in the world.
    pub wi: Vec3,
    /// The offset path's BSDF with the cosine, and its density.
    pub eval: Eval,
    /// |T'| of this direction, solid angle at y_k over solid angle at x_k.
    pub jacobian: f32,
}

/// The point x_{k+1} at which offset paths may join the base path, as it is seen from x_k.
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    /// Where it is.
    pub position: Vec3,
    /// Geometric normal of its surface.
    pub ng: Vec3,
    /// On which side of the surface the base path arrives.
    side: f32,
    /// Solid angle at x_k over area at x_{k+1}.
    solid_angle_per_area: f32,
}

impl Joint {
    /// The point `position` on a surface with normal `ng`, which the base path reached from x_k (`base`)
    /// in direction `wi`.
    #[inline]
    pub fn new(base: &Vertex, wi: Vec3, position: Vec3, ng: Vec3) -> Result<Self, Death> {
        // A point in the surface's own plane sees neither side of it.
        let (_, solid_angle_per_area) =
            solid_angle_per_area(base.position, position, ng).ok_or(Death::Side)?;
        Ok(Self {
            position,
            ng,
            side: ng.dot(wi),
            solid_angle_per_area,
        })
    }
}

/// Reconnects y_k (`offset`) to x_{k+1}.
/// |T'| = (cosθ'/cosθ)(|x_k - x_{k+1}|²/|y_k - x_{k+1}|²).
#[inline]
pub fn reconnect(scene: &Scene, joint: &Joint, offset: &Vertex) -> Result<Shifted, Death> {
    let (direction, there) =
        solid_angle_per_area(offset.position, joint.position, joint.ng).ok_or(Death::Side)?;
    // Both must see the same side of the surface at x_{k+1}.
    if joint.ng.dot(direction) * joint.side <= 0.0 {
        return Err(Death::Side);
    }
    let eval = offset.eval(scene, direction).ok_or(Death::Side)?;
    Ok(Shifted {
        wi: direction,
        eval,
        jacobian: there / joint.solid_angle_per_area,
    })
}

/// The environment is reached in the same direction: |T'| = 1.
#[inline]
pub fn same_direction(scene: &Scene, wi: Vec3, offset: &Vertex) -> Result<Shifted, Death> {
    let eval = offset.eval(scene, wi).ok_or(Death::Side)?;
    Ok(Shifted {
        wi,
        eval,
        jacobian: 1.0,
    })
}

/// Copies the half vector of the scattering event at x_k (`base`) to y_k (`offset`), frame to frame.
/// Single directions have |T'| = 1, the probability of their choice being inside the densities.
#[inline]
pub fn copy_half_vector(
    scene: &Scene,
    base: &Vertex,
    scattering: &Scattering,
    offset: &Vertex,
) -> Result<Shifted, Death> {
    let (base_bsdf, offset_bsdf) = (base.bsdf(scene), offset.bsdf(scene));
    let lobe = scattering.lobe;
    let transmits = lobe == Lobe::Transmission;
    let (x_frame, y_frame) = (base.frame(), offset.frame());
    let x_wo = x_frame.to_local(base.wo.into());
    let y_wo = y_frame.to_local(offset.wo.into());
    // Inside stays inside, and a single direction stays one.
    if x_wo.z * y_wo.z <= 0.0 {
        return Err(Death::Side);
    }
    if !offset_bsdf.has(lobe) {
        return Err(Death::Lobe);
    }
    let carried = |ior: f32, h: Vector<f32>| {
        let (wi, holds) = half_vector::to_direction::<f32>(transmits, ior, y_wo, h);
        if holds { Ok(wi) } else { Err(Death::Lobe) }
    };
    let (local_wi, eval, jacobian) = if scattering.delta {
        let wi = carried(offset_bsdf.ior(), Vector::new(0.0, 0.0, y_wo.z.signum()))?;
        let eval = offset_bsdf.eval_delta(y_wo.into(), lobe);
        (wi, eval.ok_or(Death::Lobe)?, 1.0)
    } else {
        let (x_ior, y_ior) = (base_bsdf.ior(), offset_bsdf.ior());
        let x_wi = scattering.local_wi.into();
        let (h, holds) = half_vector::from_directions::<f32>(x_ior, x_wo, x_wi);
        if !holds {
            return Err(Death::Lobe);
        }
        let wi = carried(y_ior, h)?;
        let eval = offset_bsdf.eval(y_wo.into(), wi.into());
        let jacobian = half_vector::jacobian::<f32>(transmits, y_ior, y_wo, wi, h)
            / half_vector::jacobian::<f32>(transmits, x_ior, x_wo, x_wi, h);
        (wi, eval.ok_or(Death::Lobe)?, jacobian)
    };
    let wi = Vec3::from(y_frame.to_world(local_wi)).normalize();
    if !offset.agrees(wi, local_wi.z) || !offset.agrees(offset.wo, y_wo.z) {
        return Err(Death::Side);
    }
    Ok(Shifted { wi, eval, jacobian })
}

/// The offset path once a copied direction has been followed: y_{k+1} must be of x_{k+1}'s kind.
#[inline]
pub fn arrive(
    scene: &Scene,
    base: &Vertex,
    offset: &End,
    carried: Carried,
) -> Result<Offset, Death> {
    let vertex = same_kind(scene, base, offset)?;
    finite(Offset::Free { vertex, carried })
}

/// The light that an offset path reaches by a copied direction, where the base path reached one.
#[inline]
pub fn arrive_at_light(offset: &End) -> Result<LightPoint, Death> {
    match offset {
        End::Light(light) if light.front => Ok(*light),
        End::Light(_) => Err(Death::Side),
        End::Surface(_) | End::Environment(_) => Err(Death::Missed),
    }
}

/// `offset`, or dead if it carries anything that is not finite.
#[inline]
pub fn finite(offset: Offset) -> Result<Offset, Death> {
    let good = match &offset {
        Offset::Free { carried, .. }
        | Offset::Joined { carried, .. }
        | Offset::Connected(carried) => carried.is_finite(),
        Offset::Dead => true,
    };
    if good {
        Ok(offset)
    } else {
        Err(Death::NotFinite)
    }
}

#[cfg(test)]
mod tests {
    use super::Death;

    /// Tables of counts go by these numbers.
    #[test]
    fn deaths_are_numbered_in_order() {
        for (index, death) in Death::ALL.into_iter().enumerate() {
            assert_eq!(death as usize, index);
        }
    }
}
