//! BSDFs in lanes, which may be of several kinds: each kind is evaluated for all lanes and kept where it is meant.
//! Paths are packed by kind, so that it is mostly one.

use super::dielectric::Glass;
use super::plastic::{Coat, Coats, Plastic};
use super::thin::Pane;
use super::{Bsdf, Evals, Samples, conductor, lambert};
use crate::lanes::{Float, Mask, Vector, copy_bit};

/// The kinds of [`Bsdf`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// [`Bsdf::Lambert`]
    Lambert,
    /// [`Bsdf::Mirror`]
    Mirror,
    /// [`Bsdf::Conductor`]
    Conductor,
    /// [`Bsdf::Glass`]
    Glass,
    /// [`Bsdf::RoughGlass`]
    RoughGlass,
    /// [`Bsdf::Thin`]
    Thin,
    /// [`Bsdf::RoughThin`]
    RoughThin,
    /// [`Bsdf::Plastic`]
    Plastic,
}

impl Kind {
    /// All, in the order of their numbers.
    pub const ALL: [Kind; 8] = [
        Kind::Lambert,
        Kind::Mirror,
        Kind::Conductor,
        Kind::Glass,
        Kind::RoughGlass,
        Kind::Thin,
        Kind::RoughThin,
        Kind::Plastic,
    ];

    /// Those that have microfacets and nothing else.
    pub const MICROFACETS: [Kind; 3] = [Kind::Conductor, Kind::RoughGlass, Kind::RoughThin];
}

/// Of which kinds lanes are.
#[derive(Clone, Copy, Debug)]
pub struct Kinds {
    /// A bit for each lane, for each kind.
    lanes: [u32; Kind::ALL.len()],
    /// A bit for each kind that there may be.
    there: u32,
}

impl Kinds {
    /// No lanes.
    pub const NONE: Self = Self {
        lanes: [0; Kind::ALL.len()],
        there: 0,
    };

    /// Says of which kind a lane is.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, kind: Kind) {
        self.lanes.iter_mut().for_each(|bits| *bits &= !(1 << lane));
        self.lanes[kind as usize] |= 1 << lane;
        self.there |= 1 << kind as u32;
    }

    /// Says that a lane is of the kind of lane `from` of `others`.
    #[inline(always)]
    pub fn copy(&mut self, lane: usize, others: &Self, from: usize) {
        for (bits, others) in self.lanes.iter_mut().zip(others.lanes) {
            copy_bit(bits, lane, others, from);
        }
        self.there |= others.there;
    }

    /// The lanes of [`Kind::MICROFACETS`].
    #[inline(always)]
    pub fn spreading(&self) -> u32 {
        let kinds = Kind::MICROFACETS.into_iter();
        kinds.fold(0, |lanes, kind| lanes | self.lanes[kind as usize])
    }

    /// The kinds that are there, each with its lanes.
    #[inline(always)]
    fn there(&self) -> impl Iterator<Item = (Kind, u32)> {
        let mut rest = self.there;
        std::iter::from_fn(move || {
            (rest != 0).then(|| {
                let kind = rest.trailing_zeros() as usize % Kind::ALL.len();
                rest &= rest - 1;
                (Kind::ALL[kind], self.lanes[kind])
            })
        })
    }
}

/// [`Parameters`](super::Parameters) in lanes.
#[derive(Clone, Copy, Debug)]
pub struct PackedParameters<F> {
    /// What [`Bsdf::colour`] is.
    pub colour: Vector<F>,
    /// GGX roughness where there is one.
    pub alpha: F,
    /// Factor on the reflectance of plastic's coat.
    pub specular: F,
    /// Share of plastic that is metal.
    pub metallic: F,
}

/// BSDFs in lanes.
#[derive(Clone, Copy, Debug)]
pub struct Packed<F, B> {
    /// Which lanes are of which kind; where nothing is said there is no BSDF.
    pub kinds: Kinds,
    /// Gives the BSDF of each lane, textures aside.
    pub bsdf: B,
    /// The values that textures may give.
    pub parameters: PackedParameters<F>,
}

impl<'a, F: Float, B: Fn(usize) -> &'a Bsdf> Packed<F, B> {
    #[inline(always)]
    fn glass(&self) -> Glass<F> {
        Glass {
            ior: self.ior(),
            tint: self.parameters.colour,
        }
    }

    #[inline(always)]
    fn pane(&self) -> Pane<F> {
        Pane {
            ior: F::from_lanes(|lane| (self.bsdf)(lane).pane_index()),
            tint: self.parameters.colour,
        }
    }

    /// [`Bsdf::ior`]
    #[inline(always)]
    pub fn ior(&self) -> F {
        F::from_lanes(|lane| (self.bsdf)(lane).ior())
    }

    #[inline(always)]
    fn plastic(&self) -> Plastic<F> {
        let coats = std::array::from_fn(|lane| (self.bsdf)(lane).coat());
        Plastic {
            albedo: self.parameters.colour,
            coat: Coats::of(&coats).with(&coats, &self.parameters),
        }
    }

    /// [`Bsdf::eval`]
    #[inline(always)]
    pub fn eval(&self, wo: Vector<F>, wi: Vector<F>) -> Evals<F> {
        let mut evals = Evals::none();
        for (kind, lanes) in self.kinds.there() {
            let of_kind = match kind {
                Kind::Lambert => lambert::eval(self.parameters.colour, wo.z, wi.z),
                Kind::Conductor => {
                    conductor::eval(self.parameters.colour, self.parameters.alpha, wo, wi)
                }
                Kind::RoughGlass => self.glass().eval(self.parameters.alpha, wo, wi),
                Kind::RoughThin => self.pane().eval(self.parameters.alpha, wo, wi),
                Kind::Plastic => self.plastic().eval(wo, wi),
                Kind::Mirror | Kind::Glass | Kind::Thin => continue,
            };
            evals = Evals::select(F::Mask::of_bits(lanes), of_kind, evals);
        }
        evals
    }

    /// [`Bsdf::eval_delta`], for transmission where `transmits`.
    #[inline(always)]
    pub fn eval_delta(&self, wo: Vector<F>, transmits: F::Mask) -> Evals<F> {
        let mut evals = Evals::none();
        for (kind, lanes) in self.kinds.there() {
            let mut lanes = F::Mask::of_bits(lanes);
            let of_kind = match kind {
                Kind::Glass => self.glass().eval_smooth(wo, transmits),
                Kind::Mirror => {
                    lanes = lanes & !transmits;
                    conductor::eval_mirror(self.parameters.colour, wo)
                }
                Kind::Thin => self.pane().eval_smooth(wo, transmits),
                Kind::Plastic => self.plastic().eval_single(wo, transmits),
                Kind::Lambert | Kind::Conductor | Kind::RoughGlass | Kind::RoughThin => continue,
            };
            evals = Evals::select(lanes, of_kind, evals);
        }
        evals
    }

    /// [`Bsdf::sample`]
    #[inline(always)]
    pub fn sample(&self, wo: Vector<F>, u: [F; 3]) -> Samples<F> {
        let [u0, u1, u_lobe] = u;
        let direction = [u0, u1];
        let mut samples = Samples::none();
        for (kind, lanes) in self.kinds.there() {
            let of_kind = match kind {
                Kind::Lambert => lambert::sample(self.parameters.colour, wo.z, direction),
                Kind::Mirror => conductor::sample_mirror(self.parameters.colour, wo),
                Kind::Conductor => {
                    conductor::sample(self.parameters.colour, self.parameters.alpha, wo, direction)
                }
                Kind::Glass => self.glass().sample_smooth(wo, u_lobe),
                Kind::RoughGlass => {
                    self.glass()
                        .sample(self.parameters.alpha, wo, direction, u_lobe)
                }
                Kind::Thin => self.pane().sample_smooth(wo, u_lobe),
                Kind::RoughThin => {
                    let alpha = self.parameters.alpha;
                    self.pane().sample(alpha, wo, direction, u_lobe)
                }
                Kind::Plastic => self.plastic().sample(wo, direction, u_lobe),
            };
            samples = Samples::select(F::Mask::of_bits(lanes), of_kind, samples);
        }
        samples.leaves(wo)
    }
}

impl Bsdf {
    /// Which it is.
    #[inline(always)]
    pub fn kind(&self) -> Kind {
        match self {
            Bsdf::Lambert { .. } => Kind::Lambert,
            Bsdf::Mirror { .. } => Kind::Mirror,
            Bsdf::Conductor { .. } => Kind::Conductor,
            Bsdf::Glass { .. } => Kind::Glass,
            Bsdf::RoughGlass { .. } => Kind::RoughGlass,
            Bsdf::Thin { .. } => Kind::Thin,
            Bsdf::RoughThin { .. } => Kind::RoughThin,
            Bsdf::Plastic { .. } => Kind::Plastic,
        }
    }

    #[inline(always)]
    fn pane_index(&self) -> f32 {
        match *self {
            Bsdf::Thin { ior, .. } | Bsdf::RoughThin { ior, .. } => ior,
            _ => 1.0,
        }
    }

    #[inline(always)]
    fn coat(&self) -> &Coat {
        match self {
            Bsdf::Plastic { coat, .. } => coat,
            _ => &Coat::NONE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::{Eval, Lobe};
    use crate::lanes::{LANES, mask_of};
    use glam::Vec3;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use wide::f32x8;

    /// One of each kind.
    fn all(colour: Vec3, alpha: f32, ior: f32) -> Vec<Bsdf> {
        let tint = colour;
        let coat = Coat {
            f0: 0.04,
            tint: Vec3::new(1.0, 0.5, 0.9),
            metallic: 0.2,
            metal: Vec3::new(0.9, 0.6, 0.2),
            // A smooth one now and then.
            alpha: if alpha < 0.3 { 0.0 } else { alpha },
            opacity: 0.7,
            through: 0.2 * colour,
            ..Coat::NONE
        };
        vec![
            Bsdf::Lambert { albedo: colour },
            Bsdf::Mirror { f0: colour },
            Bsdf::Conductor { f0: colour, alpha },
            Bsdf::Glass { ior, tint },
            Bsdf::RoughGlass { ior, alpha, tint },
            Bsdf::Thin { ior, tint },
            Bsdf::RoughThin { ior, alpha, tint },
            Bsdf::Plastic {
                albedo: colour,
                coat,
            },
        ]
    }

    fn packed<'a>(bsdfs: &'a [Bsdf; LANES]) -> Packed<f32x8, impl Fn(usize) -> &'a Bsdf> {
        let mut kinds = Kinds::NONE;
        for (lane, bsdf) in bsdfs.iter().enumerate() {
            kinds.set(lane, bsdf.kind());
        }
        Packed {
            kinds,
            bsdf: move |lane| &bsdfs[lane],
            parameters: PackedParameters {
                colour: Vector::from_lanes(|lane| bsdfs[lane].parameters().colour),
                alpha: f32x8::from_lanes(|lane| bsdfs[lane].parameters().alpha),
                specular: f32x8::from_lanes(|lane| bsdfs[lane].parameters().specular),
                metallic: f32x8::from_lanes(|lane| bsdfs[lane].parameters().metallic),
            },
        }
    }

    fn held(evals: &Evals<f32x8>, lane: usize) -> Option<Eval> {
        (evals.valid.bits() >> lane & 1 == 1).then(|| Eval {
            value: evals.value.lane(lane),
            pdf: evals.pdf.lane(lane),
        })
    }

    #[test]
    fn kinds_are_listed_by_their_numbers() {
        let kinds = all(Vec3::ONE, 0.5, 1.5).into_iter().map(|bsdf| bsdf.kind());
        assert_eq!(kinds.collect::<Vec<_>>(), Kind::ALL);
        for (number, kind) in Kind::ALL.into_iter().enumerate() {
            assert_eq!(kind as usize, number);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(7), failure_persistence: None, ..Default::default() })]

        /// A block with lanes of many kinds gives each lane the bits of its BSDF alone.
        #[test]
        fn lanes_have_the_bits_of_each_bsdf_alone(
            colour in (0f32..1.0, 0f32..1.0, 0f32..1.0), alpha in 0.02f32..1.0, ior in 0.6f32..2.5,
            wo in (-1f32..1.0, -1f32..1.0, -1f32..1.0), wi in (-1f32..1.0, -1f32..1.0, -1f32..1.0),
            u in [0f32..1.0, 0f32..1.0, 0f32..1.0], transmits in any::<bool>(),
        ) {
            let unit = |v: (f32, f32, f32)| Vec3::from(v).try_normalize();
            let (Some(wo), Some(wi)) = (unit(wo), unit(wi)) else {
                return Err(TestCaseError::reject("no direction"));
            };
            let all = all(colour.into(), alpha, ior);
            for first in 0..all.len().div_ceil(LANES) {
            let bsdfs: [Bsdf; LANES] = std::array::from_fn(|lane| all[(first * LANES + lane) % all.len()]);
            let lanes = packed(&bsdfs);
            let (wos, wis) = (Vector::splat(wo), Vector::splat(wi));
            let lobe = if transmits { Lobe::Transmission } else { Lobe::Reflection };
            let evals = lanes.eval(wos, wis);
            let deltas = lanes.eval_delta(wos, mask_of(if transmits { 255 } else { 0 }));
            let samples = lanes.sample(wos, u.map(f32x8::splat));
            for (lane, bsdf) in bsdfs.iter().enumerate() {
                prop_assert_eq!(held(&evals, lane), bsdf.eval(wo, wi));
                prop_assert_eq!(held(&deltas, lane), bsdf.eval_delta(wo, lobe));
                let alone = bsdf.sample(wo, u);
                let eval = alone.map(|s| Eval { value: s.value, pdf: s.pdf });
                prop_assert_eq!(held(&samples.eval, lane), eval);
                if let Some(alone) = alone {
                    prop_assert_eq!(samples.wi.lane(lane), alone.wi);
                    let bit = |mask: f32x8| mask.bits() >> lane & 1 == 1;
                    prop_assert_eq!(bit(samples.delta), alone.delta);
                    prop_assert_eq!(bit(samples.transmits), alone.lobe == Lobe::Transmission);
                }
            }
            }
        }
    }
}
