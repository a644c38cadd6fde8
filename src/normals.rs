//! One normal for each point, as every method hands them over.

use crate::error::Error;
use crate::parallel::{self, Filling};
use crate::points::CHUNK;
use glam::{Vec3, Vec4};
use std::mem::MaybeUninit;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The normals of all points of the input while they are found, point by point and in any order.
pub(crate) struct Normals {
    normals: Filling<Vec3>,
    resolved: AtomicU64,
}

impl Normals {
    /// For `count` points, of which `expected` will be written; if these are not all, the others are zero.
    pub fn new(count: usize, expected: usize) -> Result<Self, Error> {
        let normals = Filling::new(count, "the normals")?;
        if expected < count {
            // SAFETY: each normal belongs to one chunk, and nothing else is written meanwhile.
            parallel::each(count.div_ceil(CHUNK), &|i| unsafe {
                normals.slice(parallel::piece(count, CHUNK, i)).fill(MaybeUninit::new(Vec3::ZERO));
            });
        }
        Ok(Self { normals, resolved: AtomicU64::new(0) })
    }

    /// Takes the normal of a point, of either sign; zero if nothing determines one.
    ///
    /// # Safety
    /// At most once for each point.
    #[inline(always)]
    pub unsafe fn write(&self, point: u32, normal: Vec3) {
        // SAFETY: by the caller's promise.
        unsafe { self.write_lanes([point].into_iter(), normal.to_array().map(Vec4::splat)) }
    }

    /// Takes the normals of up to four points, lane by lane, of either sign.
    ///
    /// # Safety
    /// At most once for each point.
    #[inline(always)]
    pub unsafe fn write_lanes(&self, points: impl Iterator<Item = u32>, normals: [Vec4; 3]) {
        let [x, y, z] = face(normals).map(|lanes| lanes.to_array());
        for (i, point) in points.take(4).enumerate() {
            // SAFETY: by the caller's promise.
            unsafe { self.normals.write(point as usize, Vec3::new(x[i], y[i], z[i])) };
        }
    }

    /// Counts points that were given a normal other than zero.
    pub fn add_resolved(&self, points: u64) {
        self.resolved.fetch_add(points, Relaxed);
    }

    /// `nx0 ny0 nz0 nx1 ...`, and how many of the points were resolved.
    ///
    /// # Safety
    /// As many points must have been written as [`Normals::new`] was told.
    pub unsafe fn complete(self) -> (Vec<f32>, u64) {
        // SAFETY: all points were written, by the caller's promise, or zeroed before.
        let normals = unsafe { self.normals.complete() };
        (bytemuck::cast_vec::<Vec3, [f32; 3]>(normals).into_flattened(), self.resolved.into_inner())
    }
}

/// Chooses the signs: `x + 2y + 4z >= 0`, a plane that few man-made walls are parallel to.
#[inline(always)]
fn face([x, y, z]: [Vec4; 3]) -> [Vec4; 3] {
    let side = x + 2.0 * y + 4.0 * z;
    // On the plane itself the first component that is not zero decides.
    let first = Vec4::select(x.cmpeq(Vec4::ZERO), y, x);
    let side = Vec4::select(side.cmpeq(Vec4::ZERO), first, side);
    let sign = Vec4::select(side.cmplt(Vec4::ZERO), Vec4::NEG_ONE, Vec4::ONE);
    // Adding zero turns -0 into 0.
    [x, y, z].map(|lanes| lanes * sign + Vec4::ZERO)
}
