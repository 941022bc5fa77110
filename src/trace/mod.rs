//! Traversal: closest and any hits for batches of rays, on one of several backends.
//!
//! **Same hit for the same ray.** Backends agree on which triangle is hit and on its distance up to
//! the rounding of 32-bit floats (relative 1e-5 of the distance or of the scene's size). Where triangles overlap
//! or a ray meets an edge, which of the triangles is reported is open. Embree and the BVH leave no gaps
//! between triangles larger than rounding; the BVH's edge test may miss a shared edge that a ray hits
//! exactly.

pub mod brute;
pub mod bvh;
#[cfg(feature = "embree")]
pub mod embree;
pub mod rays;

use crate::error::Result;
use crate::scene::mesh::Mesh;
use rays::{AnyBatch, ClosestBatch};
use std::sync::Arc;

/// What the rays of a batch have in common; a backend chooses its fastest way by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RayKind {
    /// Camera rays of neighbouring pixels: closest hit, coherent.
    Primary,
    /// Base paths after scattering: closest hit, incoherent.
    Bounce,
    /// To points on lights: any hit.
    Shadow,
    /// From offset vertices to the base path's next vertex, or to the environment: any hit.
    Reconnection,
    /// Offset paths that follow a copied half vector: closest hit.
    Continuation,
    /// Walks through mirrors and glass to a light: closest hit, incoherent.
    Walk,
}

impl RayKind {
    /// All kinds, in the order of [`RayKind::index`].
    pub const ALL: [RayKind; 6] = [
        RayKind::Primary,
        RayKind::Bounce,
        RayKind::Shadow,
        RayKind::Reconnection,
        RayKind::Continuation,
        RayKind::Walk,
    ];

    /// A number for tables of counts.
    #[inline]
    pub fn index(self) -> usize {
        self as usize
    }

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        [
            "primary",
            "bounce",
            "shadow",
            "reconnection",
            "continuation",
            "walk",
        ][self.index()]
    }

    /// Whether the closest hit is wanted, or any.
    #[inline]
    pub fn wants_closest(self) -> bool {
        matches!(
            self,
            RayKind::Primary | RayKind::Bounce | RayKind::Continuation | RayKind::Walk
        )
    }
}

/// How a batch goes through the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TraversalMode {
    /// Rays that go together.
    pub width: Width,
    /// Whether the tree is told that they are alike.
    pub coherent: bool,
}

/// How many rays go through the tree together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Width {
    /// One by one.
    Single = 1,
    /// Packets of 4.
    Packet4 = 4,
    /// Packets of 8: the layout of the batches, so nothing is copied.
    Packet8 = 8,
    /// Packets of 16.
    Packet16 = 16,
}

impl TraversalMode {
    /// One by one; all that a backend without packets knows.
    pub const SINGLE: TraversalMode = TraversalMode {
        width: Width::Single,
        coherent: false,
    };
    /// Packets of 8, the tree not told anything.
    pub const PACKET8: TraversalMode = TraversalMode {
        width: Width::Packet8,
        coherent: false,
    };
    /// Packets of 8 that are alike.
    pub const COHERENT8: TraversalMode = TraversalMode {
        width: Width::Packet8,
        coherent: true,
    };

    /// Such as `single`, `packet 8` or `packet 8 coherent`.
    pub fn name(self) -> String {
        let width = match self.width {
            Width::Single => "single".to_owned(),
            packet => format!("packet {}", packet as u32),
        };
        if self.coherent {
            width + " coherent"
        } else {
            width
        }
    }
}

/// Finds what rays hit. Results are functions of the rays alone.
pub trait Traverse: Sync + Send {
    /// The fastest way for a kind of rays; the table of the backend.
    fn mode(&self, kind: RayKind) -> TraversalMode;
    /// All ways that the backend knows.
    fn modes(&self) -> &'static [TraversalMode];
    /// Finds the closest hit of every ray, going one of [`Traverse::modes`].
    fn closest_by(&self, batch: &mut ClosestBatch, way: TraversalMode);
    /// Finds whether anything blocks each ray.
    fn any_by(&self, batch: &mut AnyBatch, way: TraversalMode);
    /// Bytes that the acceleration structure takes, without the mesh.
    fn memory(&self) -> usize;

    /// Finds the closest hit of every ray the fastest way.
    fn closest(&self, batch: &mut ClosestBatch, kind: RayKind) {
        self.closest_by(batch, self.mode(kind));
    }

    /// Finds whether anything blocks each ray, the fastest way.
    fn any(&self, batch: &mut AnyBatch, kind: RayKind) {
        self.any_by(batch, self.mode(kind));
    }
}

/// Which implementation traces the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum Backend {
    /// Intel Embree 4.
    #[cfg(feature = "embree")]
    Embree,
    /// The pure-Rust BVH (obvhs).
    Bvh,
}

impl Backend {
    /// The one that is used where none is asked for.
    pub const DEFAULT: Backend = {
        #[cfg(feature = "embree")]
        {
            Backend::Embree
        }
        #[cfg(not(feature = "embree"))]
        {
            Backend::Bvh
        }
    };

    /// Builds the acceleration structure over `mesh`, with at most `threads` threads.
    pub fn build(self, mesh: &Arc<Mesh>, threads: usize) -> Result<Box<dyn Traverse>> {
        Ok(match self {
            #[cfg(feature = "embree")]
            Backend::Embree => Box::new(embree::Embree::new(
                mesh.clone(),
                threads,
                embree::Build::Robust,
            )?),
            Backend::Bvh => {
                let _ = threads; // obvhs builds on one thread
                Box::new(bvh::Bvh::new(mesh))
            }
        })
    }

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            #[cfg(feature = "embree")]
            Backend::Embree => "embree",
            Backend::Bvh => "bvh",
        }
    }
}
