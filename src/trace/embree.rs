//! The ring around Embree: the one Rust file with `unsafe`. Everything public here is safe.
#![allow(unsafe_code)]

use super::rays::{AnyBatch, ClosestBatch, HitBlock, RayBlock};
use super::{RayKind, Traverse};
use crate::error::{Error, Result};
use crate::scene::mesh::Mesh;
use std::ffi::CString;
use std::mem::{align_of, size_of};
use std::sync::Arc;

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

/// A committed Embree scene with one triangle mesh.
pub struct Embree {
    scene: Owned<sys::RTCSceneTy>,
    /// Embree reads positions and indices from here.
    _mesh: Arc<Mesh>,
    _device: Owned<sys::RTCDeviceTy>,
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
unsafe impl Send for Embree {}
// SAFETY: as above; `&Embree` only traces.
unsafe impl Sync for Embree {}

impl Embree {
    /// Builds Embree's tree over `mesh` with at most `threads` threads.
    pub fn new(mesh: Arc<Mesh>, threads: usize) -> Result<Self> {
        let config =
            CString::new(format!("threads={threads},set_affinity=0")).expect("no NUL inside");
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
            let pointer = sys::rtcNewScene(device.pointer);
            if pointer.is_null() {
                return Err(last_error(device.pointer));
            }
            let scene = Owned {
                pointer,
                release: sys::rtcReleaseScene,
            };
            sys::rtcSetSceneFlags(scene.pointer, sys::RTCSceneFlags::RTC_SCENE_FLAG_ROBUST);
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
                0,
                size_of::<[u32; 3]>(),
                mesh.triangles.len(),
            );
            sys::rtcCommitGeometry(geometry.pointer);
            sys::rtcAttachGeometry(scene.pointer, geometry.pointer);
            sys::rtcCommitScene(scene.pointer);
            if sys::rtcGetDeviceError(device.pointer) != sys::RTCError::RTC_ERROR_NONE {
                return Err(Error::Traversal(
                    "Embree could not build its tree; is there enough memory?".into(),
                ));
            }
            Ok(Self {
                scene,
                _mesh: mesh,
                _device: device,
            })
        }
    }
}

/// Embree's word on what failed, with its last error message where it has one.
unsafe fn last_error(device: sys::RTCDevice) -> Error {
    // SAFETY: null is allowed and asks for the error of the failed rtcNewDevice on this thread.
    let code = unsafe { sys::rtcGetDeviceError(device) };
    Error::Traversal(format!("Embree failed with error {code}"))
}

impl Traverse for Embree {
    fn closest(&self, batch: &mut ClosestBatch, kind: RayKind) {
        debug_assert!(batch.len <= batch.blocks.len() * super::rays::LANES);
        // SAFETY: the blocks have Embree's layout (asserted above) and alignment, and hold `len` rays.
        unsafe {
            sys::gdpt_closest(
                self.scene.pointer,
                batch.blocks.as_mut_ptr().cast(),
                batch.len,
                i32::from(kind.is_coherent()),
            );
        }
    }

    fn any(&self, batch: &mut AnyBatch, kind: RayKind) {
        debug_assert!(batch.len <= batch.blocks.len() * super::rays::LANES);
        // SAFETY: as for `closest`.
        unsafe {
            sys::gdpt_any(
                self.scene.pointer,
                batch.blocks.as_mut_ptr().cast(),
                batch.len,
                i32::from(kind.is_coherent()),
            );
        }
    }
}
