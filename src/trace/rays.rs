//! Batches of rays in blocks of 8, structure of arrays inside a block: the layout of Embree's packets,
//! so that nothing is copied on the way to the kernels.

use crate::lanes::{Float, LANES, Vec3x8, lanes_of};
use glam::Vec3;
use wide::f32x8;

/// In `prim_id`: nothing was hit.
const INVALID: u32 = u32::MAX;

/// Eight rays; the layout of `RTCRay8`.
#[repr(C, align(32))]
#[derive(Clone, Debug)]
pub struct RayBlock {
    pub(super) org: [[f32; LANES]; 3],
    pub(super) tnear: [f32; LANES],
    pub(super) dir: [[f32; LANES]; 3],
    time: [f32; LANES],
    pub(super) tfar: [f32; LANES],
    mask: [u32; LANES],
    id: [u32; LANES],
    flags: [u32; LANES],
}

/// Eight rays and their closest hits; the layout of `RTCRayHit8`.
#[repr(C, align(32))]
#[derive(Clone, Debug)]
pub struct HitBlock {
    pub(super) ray: RayBlock,
    ng: [[f32; LANES]; 3],
    pub(super) u: [f32; LANES],
    pub(super) v: [f32; LANES],
    pub(super) prim_id: [u32; LANES],
    pub(super) geom_id: [u32; LANES],
    inst_id: [u32; LANES],
    inst_prim_id: [u32; LANES],
}

const _: () = assert!(size_of::<RayBlock>() == 384 && size_of::<HitBlock>() == 672);

impl RayBlock {
    const EMPTY: Self = Self {
        org: [[0.0; LANES]; 3],
        tnear: [0.0; LANES],
        dir: [[0.0; LANES]; 3],
        time: [0.0; LANES],
        tfar: [-1.0; LANES],
        mask: [u32::MAX; LANES],
        id: [0; LANES],
        flags: [0; LANES],
    };

    #[inline]
    fn set(&mut self, lane: usize, ray: &Ray) {
        for axis in 0..3 {
            self.org[axis][lane] = ray.origin[axis];
            self.dir[axis][lane] = ray.direction[axis];
        }
        self.tnear[lane] = 0.0;
        self.tfar[lane] = ray.length;
    }

    #[inline]
    pub(super) fn get(&self, lane: usize) -> Ray {
        let at = |v: &[[f32; LANES]; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]);
        Ray {
            origin: at(&self.org),
            direction: at(&self.dir),
            length: self.tfar[lane],
        }
    }
}

impl HitBlock {
    const EMPTY: Self = Self {
        ray: RayBlock::EMPTY,
        ng: [[0.0; LANES]; 3],
        u: [0.0; LANES],
        v: [0.0; LANES],
        prim_id: [INVALID; LANES],
        geom_id: [INVALID; LANES],
        inst_id: [INVALID; LANES],
        inst_prim_id: [INVALID; LANES],
    };
}

/// A ray from `origin` over the distances from 0 to `length`, in units of `direction`'s length.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes; any length but 0.
    pub direction: Vec3,
    /// How far; infinity is fine.
    pub length: f32,
}

impl Ray {
    /// A ray without end.
    #[inline]
    pub fn without_end(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            length: f32::INFINITY,
        }
    }
}

/// A point where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// The triangle.
    pub triangle: u32,
    /// Barycentric coordinate of the second corner.
    pub u: f32,
    /// Barycentric coordinate of the third corner.
    pub v: f32,
    /// Distance in units of the direction's length.
    pub t: f32,
}

/// The hits of a block, in lanes.
#[derive(Clone, Copy, Debug)]
pub struct HitsX8 {
    /// The rays' directions.
    pub direction: Vec3x8,
    /// The triangles; 0 where nothing is hit.
    pub triangle: [u32; LANES],
    /// Barycentric coordinates of the second corners.
    pub u: f32x8,
    /// Barycentric coordinates of the third corners.
    pub v: f32x8,
    /// Distances in units of the directions' lengths.
    pub t: f32x8,
    /// A bit for each lane: whether anything is hit.
    pub found: u32,
}

impl HitsX8 {
    /// The hit in a lane where there is one.
    #[inline]
    pub fn lane(&self, lane: usize) -> Hit {
        Hit {
            triangle: self.triangle[lane],
            u: self.u.as_array()[lane],
            v: self.v.as_array()[lane],
            t: self.t.as_array()[lane],
        }
    }
}

/// Rays whose closest hits are wanted.
#[derive(Debug, Default)]
pub struct ClosestBatch {
    pub(super) blocks: Vec<HitBlock>,
    pub(super) len: usize,
}

/// Rays of which it is wanted whether anything blocks them.
#[derive(Debug, Default)]
pub struct AnyBatch {
    pub(super) blocks: Vec<RayBlock>,
    pub(super) len: usize,
}

impl ClosestBatch {
    /// A batch of these rays.
    pub fn of(rays: &[Ray]) -> Self {
        let mut batch = Self::default();
        rays.iter().for_each(|ray| _ = batch.push(ray));
        batch
    }

    /// Forgets all rays; keeps the memory.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are no rays.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds a ray; the result is what to ask [`ClosestBatch::hit`] for.
    #[inline]
    pub fn push(&mut self, ray: &Ray) -> u32 {
        let (block, lane) = (self.len / LANES, self.len % LANES);
        if block == self.blocks.len() {
            self.blocks.push(HitBlock::EMPTY);
        }
        let hits = &mut self.blocks[block];
        hits.ray.set(lane, ray);
        hits.prim_id[lane] = INVALID;
        hits.geom_id[lane] = INVALID;
        self.len += 1;
        (self.len - 1) as u32
    }

    /// What a ray hit, after tracing.
    #[inline]
    pub fn hit(&self, index: u32) -> Option<Hit> {
        let (block, lane) = (index as usize / LANES, index as usize % LANES);
        let b = &self.blocks[block];
        (b.prim_id[lane] != INVALID).then(|| Hit {
            triangle: b.prim_id[lane],
            u: b.u[lane],
            v: b.v[lane],
            t: b.ray.tfar[lane],
        })
    }

    /// The triangle that a ray hit, after tracing.
    #[inline]
    pub fn triangle(&self, index: u32) -> Option<u32> {
        let triangle = self.blocks[index as usize / LANES].prim_id[index as usize % LANES];
        (triangle != INVALID).then_some(triangle)
    }

    /// [`ClosestBatch::hits_of`] with the directions of the rays.
    #[inline(always)]
    pub fn gathered_hits(&self, rays: &[u32; LANES], lanes: u32) -> HitsX8 {
        let mut direction = Vec3x8::ZERO;
        for lane in lanes_of(lanes) {
            direction.set(lane, self.ray(rays[lane]).direction);
        }
        self.hits_of(rays, lanes, direction)
    }

    /// What the rays of a block hit, after tracing; where there are no rays there are no hits.
    #[inline(always)]
    pub fn hits(&self, block: usize) -> HitsX8 {
        let rays = self.len - block * LANES;
        let block = &self.blocks[block];
        let mut found = 0;
        let mut triangle = block.prim_id;
        for (lane, triangle) in triangle.iter_mut().enumerate() {
            let hit = lane < rays && *triangle != INVALID;
            found |= u32::from(hit) << lane;
            *triangle = if hit { *triangle } else { 0 };
        }
        HitsX8 {
            direction: block.ray.dir.into(),
            triangle,
            u: block.u.into(),
            v: block.v.into(),
            t: block.ray.tfar.into(),
            found,
        }
    }

    /// What rays from all over the batch hit, after tracing: in each of `lanes` the ray that `rays` names,
    /// with the direction that it has.
    #[inline(always)]
    pub fn hits_of(&self, rays: &[u32; LANES], lanes: u32, direction: Vec3x8) -> HitsX8 {
        let mut hits = HitsX8 {
            direction,
            triangle: [0; LANES],
            u: f32x8::ZERO,
            v: f32x8::ZERO,
            t: f32x8::ZERO,
            found: 0,
        };
        for lane in lanes_of(lanes) {
            if let Some(hit) = self.hit(rays[lane]) {
                hits.triangle[lane] = hit.triangle;
                hits.u.set_lane(lane, hit.u);
                hits.v.set_lane(lane, hit.v);
                hits.t.set_lane(lane, hit.t);
                hits.found |= 1 << lane;
            }
        }
        hits
    }

    /// Hits on the second geometry get the numbers from `first` on.
    #[cfg(feature = "embree")]
    pub(super) fn number_on(&mut self, first: u32) {
        for block in &mut self.blocks[..self.len.div_ceil(LANES)] {
            for (geometry, triangle) in block.geom_id.iter_mut().zip(&mut block.prim_id) {
                if *geometry == 1 {
                    *geometry = 0;
                    *triangle += first;
                }
            }
        }
    }

    /// The ray as it was added, except that `length` is the distance of the hit once it is traced.
    #[inline]
    pub fn ray(&self, index: u32) -> Ray {
        self.blocks[index as usize / LANES]
            .ray
            .get(index as usize % LANES)
    }

    /// Replaces every ray's result by what `find` says.
    pub(super) fn trace_each(&mut self, mut find: impl FnMut(Ray) -> Option<Hit>) {
        for index in 0..self.len {
            let (block, lane) = (&mut self.blocks[index / LANES], index % LANES);
            if let Some(hit) = find(block.ray.get(lane)) {
                block.ray.tfar[lane] = hit.t;
                block.u[lane] = hit.u;
                block.v[lane] = hit.v;
                block.prim_id[lane] = hit.triangle;
                block.geom_id[lane] = 0;
            }
        }
    }
}

impl AnyBatch {
    /// A batch of these rays.
    pub fn of(rays: &[Ray]) -> Self {
        let mut batch = Self::default();
        rays.iter().for_each(|ray| _ = batch.push(ray));
        batch
    }

    /// The ray as it was added, until it is traced.
    #[inline]
    pub fn ray(&self, index: u32) -> Ray {
        self.blocks[index as usize / LANES].get(index as usize % LANES)
    }

    /// Forgets all rays; keeps the memory.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are no rays.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds a ray; the result is what to ask [`AnyBatch::is_blocked`] for.
    #[inline]
    pub fn push(&mut self, ray: &Ray) -> u32 {
        let (block, lane) = (self.len / LANES, self.len % LANES);
        if block == self.blocks.len() {
            self.blocks.push(RayBlock::EMPTY);
        }
        self.blocks[block].set(lane, ray);
        self.len += 1;
        (self.len - 1) as u32
    }

    /// Whether something blocks the ray, after tracing.
    #[inline]
    pub fn is_blocked(&self, index: u32) -> bool {
        self.blocks[index as usize / LANES].tfar[index as usize % LANES] < 0.0
    }

    /// [`AnyBatch::is_blocked`] in each of `lanes`, for the ray that `rays` names: a bit for each.
    #[inline(always)]
    pub fn blocked(&self, rays: &[u32; LANES], lanes: u32) -> u32 {
        lanes_of(lanes).fold(0, |bits, lane| {
            bits | u32::from(self.is_blocked(rays[lane])) << lane
        })
    }

    /// Replaces every ray's result by what `blocked` says.
    pub(super) fn trace_each(&mut self, mut blocked: impl FnMut(Ray) -> bool) {
        for index in 0..self.len {
            let (block, lane) = (&mut self.blocks[index / LANES], index % LANES);
            if blocked(block.get(lane)) {
                block.tfar[lane] = f32::NEG_INFINITY;
            }
        }
    }
}
