//! BSDFs in lanes, which may be of several kinds: each kind is evaluated for all lanes and kept where it is meant.
//! Paths are packed by kind, so that it is mostly one.

use super::dielectric::Glass;
use super::plastic::{Coat, Coats, Plastic};
use super::thin::Pane;
use super::{Bsdf, Eval, Evals, Lobe, Sampled, Samples, conductor, lambert};
use crate::lanes::{Float, Mask, Vector};
use glam::Vec3;

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

    /// Of one lane.
    #[inline(always)]
    fn one(kind: Kind) -> Self {
        let mut kinds = Self::NONE;
        kinds.set(0, kind);
        kinds
    }

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
            *bits = *bits & !(1 << lane) | (others >> from & 1) << lane;
        }
        self.there |= others.there;
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

/// [`Texel`](super::Texel) in lanes.
#[derive(Clone, Copy, Debug)]
pub struct Texels<F> {
    /// What [`Bsdf::colour`] is.
    pub colour: Vector<F>,
    /// GGX roughness where there is one.
    pub alpha: F,
    /// Factor on the reflectance of plastic's coat.
    pub specular: F,
}

/// BSDFs in lanes.
#[derive(Clone, Copy, Debug)]
pub struct Packed<F, B> {
    /// Which lanes are of which kind; where nothing is said there is no BSDF.
    pub kinds: Kinds,
    /// Gives the BSDF of each lane, textures aside.
    pub bsdf: B,
    /// The values that textures may give.
    pub texels: Texels<F>,
}

impl<'a, F: Float, B: Fn(usize) -> &'a Bsdf> Packed<F, B> {
    #[inline(always)]
    fn glass(&self) -> Glass<F> {
        Glass {
            ior: self.ior(),
            tint: self.texels.colour,
        }
    }

    #[inline(always)]
    fn pane(&self) -> Pane<F> {
        Pane {
            ior: F::from_lanes(|lane| (self.bsdf)(lane).pane_index()),
            tint: self.texels.colour,
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
            albedo: self.texels.colour,
            coat: Coats::of(&coats).with(&coats, &self.texels),
        }
    }

    /// [`Bsdf::eval`]
    #[inline(always)]
    pub fn eval(&self, wo: Vector<F>, wi: Vector<F>) -> Evals<F> {
        let mut evals = Evals::none();
        for (kind, lanes) in self.kinds.there() {
            let of_kind = match kind {
                Kind::Lambert => lambert::eval(self.texels.colour, wo.z, wi.z),
                Kind::Conductor => conductor::eval(self.texels.colour, self.texels.alpha, wo, wi),
                Kind::RoughGlass => self.glass().eval(self.texels.alpha, wo, wi),
                Kind::RoughThin => self.pane().eval(self.texels.alpha, wo, wi),
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
                    conductor::eval_mirror(self.texels.colour, wo)
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
                Kind::Lambert => {
                    let (wi, eval) = lambert::sample(self.texels.colour, wo.z, direction);
                    Samples {
                        wi,
                        eval,
                        ..Samples::none()
                    }
                }
                Kind::Mirror => conductor::sample_mirror(self.texels.colour, wo),
                Kind::Conductor => {
                    conductor::sample(self.texels.colour, self.texels.alpha, wo, direction)
                }
                Kind::Glass => self.glass().sample_smooth(wo, u_lobe),
                Kind::RoughGlass => self
                    .glass()
                    .sample(self.texels.alpha, wo, direction, u_lobe),
                Kind::Thin => self.pane().sample_smooth(wo, u_lobe),
                Kind::RoughThin => {
                    let alpha = self.texels.alpha;
                    self.pane().sample(alpha, wo, direction, u_lobe)
                }
                Kind::Plastic => self.plastic().sample(wo, direction, u_lobe),
            };
            samples = Samples::select(F::Mask::of_bits(lanes), of_kind, samples);
        }
        let flat = wo.z.equals(F::ZERO) | samples.wi.z.equals(F::ZERO);
        let eval = &mut samples.eval;
        eval.holds = eval.holds & eval.pdf.above(F::ZERO) & !flat;
        samples
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

    /// In a single lane.
    #[inline(always)]
    fn packed<'a>(&'a self) -> Packed<f32, impl Fn(usize) -> &'a Bsdf> {
        let texel = self.texel();
        Packed {
            kinds: Kinds::one(self.kind()),
            bsdf: move |_| self,
            texels: Texels {
                colour: texel.colour.into(),
                alpha: texel.alpha,
                specular: texel.specular,
            },
        }
    }

    /// Value and density for `wo` → `wi`, single directions left out. `None` where sampling cannot produce
    /// `wi` at all (wrong side, no such lobe): a path through such a pair is outside the sampled path space.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Option<Eval> {
        self.packed().eval(wo.into(), wi.into()).held()
    }

    /// The single direction of a smooth material, of plastic's smooth coat, or straight through plastic, seen from
    /// `wo`: coefficient and probability. `None` for a lobe that the material does not have.
    #[inline]
    pub fn eval_delta(&self, wo: Vec3, lobe: Lobe) -> Option<Eval> {
        let transmits = lobe == Lobe::Transmission;
        self.packed().eval_delta(wo.into(), transmits).held()
    }

    /// Draws `wi` with `u` in [0, 1)³: direction (0, 1) and lobe (2). `None`: the path ends here.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<Sampled> {
        self.packed().sample(wo.into(), u).held()
    }
}
