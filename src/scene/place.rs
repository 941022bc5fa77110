//! Places as keys: corners in one place count as one, also where a file has them twice, as programs double them along
//! the seams of textures.

use glam::Vec3;

/// A position, for maps.
pub(super) type Place = [u32; 3];

/// The key of a position. The sum has no -0, which would be another place than 0.
pub(super) fn place(p: Vec3) -> Place {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}
