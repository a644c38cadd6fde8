//! One normal for each point, as every method hands them over.

use crate::error::Error;
use crate::parallel::{self, Filling};
use crate::points::CHUNK;
use glam::Vec3;
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
        unsafe { self.normals.write(point as usize, face(normal)) }
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

/// Chooses the sign: `x + 2y + 4z >= 0`, a plane that few man-made walls are parallel to.
fn face(normal: Vec3) -> Vec3 {
    let side = normal.dot(Vec3::new(1.0, 2.0, 4.0));
    // On the plane itself the first component that is not zero decides.
    let side = if side != 0.0 {
        side
    } else if normal.x != 0.0 {
        normal.x
    } else {
        normal.y
    };
    // Adding zero turns -0 into 0.
    if side < 0.0 { Vec3::ZERO - normal } else { normal + Vec3::ZERO }
}
