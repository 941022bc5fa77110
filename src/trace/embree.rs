//! The ring around Embree: with `denoise.rs` the one file that has `unsafe`. Everything public here is safe.
#![allow(unsafe_code)]

use super::rays::{AnyBatch, ClosestBatch, HitBlock, RayBlock};
use super::{RayKind, TraversalMode, Traverse, Width};
use crate::error::{Error, Result};
use crate::scene::mesh::Mesh;
use std::ffi::CString;
use std::mem::{align_of, size_of};
use std::sync::Arc;
use std::sync::atomic::{AtomicIsize, Ordering};

// Generated; not all of it is used.
#[allow(
    dead_code,
    missing_docs,
    non_upper_case_globals,
    non_camel_case_types,
    non_snake_case,
    clippy::all
)]
mod sys {
    include!(concat!(env!("OUT_DIR"), "/embree.rs"));
}

// Our blocks are Embree's packets.
const _: () = assert!(
    size_of::<RayBlock>() == size_of::<sys::RTCRay8>()
        && size_of::<HitBlock>() == size_of::<sys::RTCRayHit8>()
        && align_of::<RayBlock>() >= 32
        && align_of::<HitBlock>() >= 32
        && std::mem::offset_of!(RayBlock, dir) == std::mem::offset_of!(sys::RTCRay8, dir_x)
        && std::mem::offset_of!(RayBlock, tfar) == std::mem::offset_of!(sys::RTCRay8, tfar)
        && std::mem::offset_of!(HitBlock, u)
            == std::mem::offset_of!(sys::RTCRayHit8, hit) + std::mem::offset_of!(sys::RTCHit8, u)
        && std::mem::offset_of!(HitBlock, prim_id)
            == std::mem::offset_of!(sys::RTCRayHit8, hit)
                + std::mem::offset_of!(sys::RTCHit8, primID)
);

/// What the tree is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Build {
    /// No gaps between triangles.
    Robust,
    /// Faster by a quarter; of a million rays in a closed room about one slips through a shared edge, which is a bright
    /// dot where the sun shines outside.
    Fast,
}

/// A committed Embree scene: one geometry of the triangles, and one of those with holes if there are any.
pub struct Embree {
    scene: Owned<sys::RTCSceneTy>,
    /// What Embree's filter asks with.
    cutouts: Option<Arc<sys::GdptCutouts>>,
    /// Embree reads positions and indices from here.
    _mesh: Arc<Mesh>,
    _device: Owned<sys::RTCDeviceTy>,
    /// Embree adds up its allocations here until the device is gone: dropped last.
    bytes: Box<AtomicIsize>,
}

/// A counted reference to one of Embree's objects, released when dropped.
struct Owned<T> {
    pointer: *mut T,
    release: unsafe extern "C" fn(*mut T),
}

impl<T> Drop for Owned<T> {
    fn drop(&mut self) {
        // SAFETY: the pointer came from Embree's constructor for this type, and is released once.
        unsafe { (self.release)(self.pointer) }
    }
}

// SAFETY: after rtcCommitScene the scene is only read, which Embree allows from any number of threads
// (Embree manual, "Thread safety": all API calls are thread safe, except modifying one object at once).
// `cutouts` is only read too, and so is the mesh it points to, which `_mesh` keeps.
unsafe impl Send for Embree {}
// SAFETY: as above; `&Embree` only traces.
unsafe impl Sync for Embree {}

impl Embree {
    /// Builds Embree's tree over `mesh` with at most `threads` threads.
    pub fn new(mesh: Arc<Mesh>, threads: usize, build: Build) -> Result<Self> {
        let config =
            CString::new(format!("threads={threads},set_affinity=0")).expect("no NUL inside");
        let bytes = Box::new(AtomicIsize::new(0));
        // SAFETY: each call gets objects from the calls before it, checked for null. The shared buffers
        // stay where they are as long as the scene, which holds the Arc; `positions` has one more
        // element than the triangles use, so that Embree's 16-byte reads stay inside.
        unsafe {
            let pointer = sys::rtcNewDevice(config.as_ptr());
            if pointer.is_null() {
                return Err(last_error(std::ptr::null_mut()));
            }
            let device = Owned {
                pointer,
                release: sys::rtcReleaseDevice,
            };
            // Embree writes to `bytes` atomically, until the device is released, before `bytes` is.
            sys::gdpt_count_memory(device.pointer, bytes.as_ptr());
            let pointer = sys::rtcNewScene(device.pointer);
            if pointer.is_null() {
                return Err(last_error(device.pointer));
            }
            let scene = Owned {
                pointer,
                release: sys::rtcReleaseScene,
            };
            if build == Build::Robust {
                sys::rtcSetSceneFlags(scene.pointer, sys::RTCSceneFlags::RTC_SCENE_FLAG_ROBUST);
            }
            let first = mesh
                .cutouts
                .as_ref()
                .map_or(mesh.triangles.len(), |c| c.first as usize);
            // An Arc for its pointer, which stays valid when the struct around it moves; it is not shared.
            #[allow(clippy::arc_with_non_send_sync)]
            let cutouts = mesh.cutouts.as_ref().map(|cutouts| {
                Arc::new(sys::GdptCutouts {
                    mesh: Arc::as_ptr(&mesh).cast(),
                    is_open: Some(is_open),
                    first: cutouts.first,
                    mode: sys::gdpt_float_mode(),
                })
            });
            // An empty geometry keeps the numbers: 0 for the rest, 1 for those with holes.
            let parts = [0..first, first..mesh.triangles.len()];
            let count = 1 + usize::from(cutouts.is_some());
            for (part, triangles) in parts.into_iter().take(count).enumerate() {
                let pointer = sys::rtcNewGeometry(
                    device.pointer,
                    sys::RTCGeometryType::RTC_GEOMETRY_TYPE_TRIANGLE,
                );
                if pointer.is_null() {
                    return Err(last_error(device.pointer));
                }
                let geometry = Owned {
                    pointer,
                    release: sys::rtcReleaseGeometry,
                };
                sys::rtcSetSharedGeometryBuffer(
                    geometry.pointer,
                    sys::RTCBufferType::RTC_BUFFER_TYPE_VERTEX,
                    0,
                    sys::RTCFormat::RTC_FORMAT_FLOAT3,
                    mesh.positions.as_ptr().cast(),
                    0,
                    size_of::<glam::Vec3>(),
                    mesh.positions.len() - 1,
                );
                sys::rtcSetSharedGeometryBuffer(
                    geometry.pointer,
                    sys::RTCBufferType::RTC_BUFFER_TYPE_INDEX,
                    0,
                    sys::RTCFormat::RTC_FORMAT_UINT3,
                    mesh.triangles.as_ptr().cast(),
                    triangles.start * size_of::<[u32; 3]>(),
                    size_of::<[u32; 3]>(),
                    triangles.len(),
                );
                if let (1, Some(cutouts)) = (part, &cutouts) {
                    sys::gdpt_cut_out(geometry.pointer, Arc::as_ptr(cutouts));
                }
                sys::rtcCommitGeometry(geometry.pointer);
                sys::rtcAttachGeometryByID(scene.pointer, geometry.pointer, part as u32);
            }
            sys::rtcCommitScene(scene.pointer);
            if sys::rtcGetDeviceError(device.pointer) != sys::RTCError::RTC_ERROR_NONE {
                return Err(Error::Traversal(
                    "Embree could not build its tree; is there enough memory?".into(),
                ));
            }
            Ok(Self {
                scene,
                cutouts,
                _mesh: mesh,
                _device: device,
                bytes,
            })
        }
    }
}

/// Embree's filter asks it through C whether a hit is on a hole.
unsafe extern "C" fn is_open(mesh: *const std::ffi::c_void, triangle: u32, u: f32, v: f32) -> i32 {
    // SAFETY: the pointer is that of the `Arc<Mesh>` which `Embree` holds as long as it traces.
    let mesh = unsafe { &*mesh.cast::<Mesh>() };
    i32::from(mesh.is_open(triangle, u, v))
}

/// Embree's word on what failed, with its last error message where it has one.
unsafe fn last_error(device: sys::RTCDevice) -> Error {
    // SAFETY: null is allowed and asks for the error of the failed rtcNewDevice on this thread.
    let code = unsafe { sys::rtcGetDeviceError(device) };
    Error::Traversal(format!("Embree failed with error {code}"))
}

/// The fastest way for each kind of rays, in the order of [`RayKind::index`]; by `gdpt bench` on
/// scenes/glossy.obj and on the large scene of scenes/make.py.
const MODES: [TraversalMode; RayKind::ALL.len()] = [
    TraversalMode::COHERENT8,
    TraversalMode::PACKET8,
    TraversalMode::PACKET8,
    TraversalMode::PACKET8,
    TraversalMode::PACKET8,
    TraversalMode::PACKET8,
];

const fn mode(width: Width, coherent: bool) -> TraversalMode {
    TraversalMode { width, coherent }
}

impl Traverse for Embree {
    fn mode(&self, kind: RayKind) -> TraversalMode {
        MODES[kind.index()]
    }

    fn modes(&self) -> &'static [TraversalMode] {
        const ALL: [TraversalMode; 7] = [
            TraversalMode::SINGLE,
            mode(Width::Packet4, false),
            mode(Width::Packet4, true),
            TraversalMode::PACKET8,
            TraversalMode::COHERENT8,
            mode(Width::Packet16, false),
            mode(Width::Packet16, true),
        ];
        &ALL
    }

    fn closest_by(&self, batch: &mut ClosestBatch, way: TraversalMode) {
        debug_assert!(batch.len <= batch.blocks.len() * crate::lanes::LANES);
        // SAFETY: the blocks have Embree's layout (asserted above) and alignment, and hold `len` rays.
        unsafe {
            sys::gdpt_closest(
                self.scene.pointer,
                batch.blocks.as_mut_ptr().cast(),
                batch.len,
                way.width as u32,
                i32::from(way.coherent),
            );
        }
        if let Some(cutouts) = &self.cutouts {
            batch.number_on(cutouts.first);
        }
    }

    fn any_by(&self, batch: &mut AnyBatch, way: TraversalMode) {
        debug_assert!(batch.len <= batch.blocks.len() * crate::lanes::LANES);
        // SAFETY: as for `closest_by`.
        unsafe {
            sys::gdpt_any(
                self.scene.pointer,
                batch.blocks.as_mut_ptr().cast(),
                batch.len,
                way.width as u32,
                i32::from(way.coherent),
            );
        }
    }

    fn memory(&self) -> usize {
        self.bytes.load(Ordering::Relaxed).max(0) as usize
    }
}

/// The bare C loops, for benches: packets of 8 without anything of ours but the floating-point mode.
/// Rays beyond the last full block are left out.
impl Embree {
    /// Closest hits, as a program in C would find them.
    pub fn bare_closest(&self, batch: &mut ClosestBatch) {
        // SAFETY: as for `closest_by`.
        unsafe {
            sys::gdpt_bare_closest(
                self.scene.pointer,
                batch.blocks.as_mut_ptr().cast(),
                batch.len,
            );
        }
    }

    /// Any hits, as a program in C would find them.
    pub fn bare_any(&self, batch: &mut AnyBatch) {
        // SAFETY: as for `closest_by`.
        unsafe {
            sys::gdpt_bare_any(
                self.scene.pointer,
                batch.blocks.as_mut_ptr().cast(),
                batch.len,
            );
        }
    }
}
