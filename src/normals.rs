//! One normal for each point, and if wanted its curvature, as every method hands them over.

use crate::error::Error;
use crate::parallel::{self, Filling};
use crate::points::CHUNK;
use glam::{Vec3, Vec4};
use std::mem::MaybeUninit;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The normals of all points of the input while they are found, point by point and in any order.
pub(crate) struct Normals {
    normals: Filling<Vec3>,
    /// The surface variation of the same points, if it was asked for.
    curvature: Option<Filling<f32>>,
    resolved: AtomicU64,
}

/// What was found for all points.
pub(crate) struct Found {
    /// `nx0 ny0 nz0 nx1 ...`
    pub normals: Vec<f32>,
    /// The surface variation of each point, if it was asked for.
    pub curvature: Option<Vec<f32>>,
    /// How many of the points were resolved.
    pub resolved: u64,
}

impl Normals {
    /// For `count` points, of which `expected` will be written; if these are not all, the others are zero.
    pub fn new(count: usize, expected: usize, curvature: bool) -> Result<Self, Error> {
        let normals = Filling::new(count, "the normals")?;
        let curvature = curvature.then(|| Filling::new(count, "the curvature")).transpose()?;
        if expected < count {
            // SAFETY: each point belongs to one chunk, and nothing else is written meanwhile.
            parallel::each(count.div_ceil(CHUNK), &|i| unsafe {
                let piece = parallel::piece(count, CHUNK, i);
                normals.slice(piece.clone()).fill(MaybeUninit::new(Vec3::ZERO));
                if let Some(curvature) = &curvature {
                    curvature.slice(piece).fill(MaybeUninit::new(0.0));
                }
            });
        }
        Ok(Self { normals, curvature, resolved: AtomicU64::new(0) })
    }

    /// Whether the curvature of each point was asked for, and must be written too.
    pub fn has_curvature(&self) -> bool {
        self.curvature.is_some()
    }

    /// Takes the normal of a point, of either sign, and its curvature; zero if nothing determines them.
    ///
    /// # Safety
    /// At most once for each point.
    #[inline(always)]
    pub unsafe fn write(&self, point: u32, normal: Vec3, curvature: f32) {
        // SAFETY: by the caller's promise.
        unsafe {
            self.write_lanes([point].into_iter(), normal.to_array().map(Vec4::splat));
            self.write_curvature(point, curvature);
        }
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

    /// Takes the curvature of a point, unless it was not asked for.
    ///
    /// # Safety
    /// At most once for each point.
    #[inline(always)]
    pub unsafe fn write_curvature(&self, point: u32, curvature: f32) {
        if let Some(all) = &self.curvature {
            // SAFETY: by the caller's promise.
            unsafe { all.write(point as usize, curvature) };
        }
    }

    /// Counts points that were given a normal other than zero.
    pub fn add_resolved(&self, points: u64) {
        self.resolved.fetch_add(points, Relaxed);
    }

    /// All that was taken.
    ///
    /// # Safety
    /// As many points must have been written as [`Normals::new`] was told.
    pub unsafe fn complete(self) -> Found {
        // SAFETY: all points were written, by the caller's promise, or zeroed before.
        let (normals, curvature) =
            unsafe { (self.normals.complete(), self.curvature.map(|curvature| curvature.complete())) };
        let normals = bytemuck::cast_vec::<Vec3, [f32; 3]>(normals).into_flattened();
        Found { normals, curvature, resolved: self.resolved.into_inner() }
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
