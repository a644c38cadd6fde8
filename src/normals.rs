//! One normal for each point, and if wanted its curvature, as every method hands them over.

use crate::error::Error;
use crate::parallel::{self, Filling};
use crate::points::CHUNK;
use glam::{Mat4, Vec3, Vec4};
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

    /// What one task hands its normals over with; all are written when it is dropped.
    pub fn writer(&self) -> Writer<'_> {
        Writer { normals: self, gathered: [Vec4::ZERO; GATHERED + 4], length: 0 }
    }

    /// Counts points that were given a normal other than zero.
    pub fn add_resolved(&self, points: u64) {
        self.resolved.fetch_add(points, Relaxed);
    }

    /// All that was taken.
    ///
    /// # Safety
    /// As many points must have been taken as [`Normals::new`] was told, and every [`Writer`] dropped.
    pub unsafe fn complete(self) -> Found {
        // SAFETY: all points were written, by the caller's promise, or zeroed before.
        let (normals, curvature) =
            unsafe { (self.normals.complete(), self.curvature.map(|curvature| curvature.complete())) };
        let normals = bytemuck::cast_vec::<Vec3, [f32; 3]>(normals).into_flattened();
        Found { normals, curvature, resolved: self.resolved.into_inner() }
    }
}

/// When more normals than these are gathered, they are written: with four more they take 4 KiB.
const GATHERED: usize = 252;

/// Takes the normals of a task. They go to places all over the memory, and every place has to be waited for; of those
/// that are written right after each other the processor waits for many at once.
pub(crate) struct Writer<'a> {
    normals: &'a Normals,
    /// Of each point x, y, z and the bits of its number; those from `length` on mean nothing.
    gathered: [Vec4; GATHERED + 4],
    length: usize,
}

impl Writer<'_> {
    /// Whether the curvature of each point was asked for, and must be written too.
    pub fn has_curvature(&self) -> bool {
        self.normals.curvature.is_some()
    }

    /// Takes the normal of a point, of either sign, and its curvature; zero if nothing determines them.
    ///
    /// # Safety
    /// At most once for each point.
    #[inline(always)]
    pub unsafe fn write(&mut self, point: u32, normal: Vec3, curvature: f32) {
        // SAFETY: by the caller's promise.
        unsafe {
            self.write_lanes([point].into_iter(), normal.to_array().map(Vec4::splat));
            self.write_curvature(point, curvature);
        }
    }

    /// Takes the normals of at most four points, lane by lane, of either sign.
    ///
    /// # Safety
    /// At most once for each point, which is written later.
    #[inline(always)]
    pub unsafe fn write_lanes(&mut self, points: impl Iterator<Item = u32>, normals: [Vec4; 3]) {
        let [x, y, z] = face(normals);
        let mut numbers = [0; 4];
        let mut count = 0;
        for (number, point) in numbers.iter_mut().zip(points) {
            *number = point;
            count += 1;
        }
        let rows = Mat4::from_cols(x, y, z, bytemuck::cast(numbers)).transpose();
        let rows = [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis];
        // All four; the next overwrite those too many.
        self.gathered[self.length..self.length + 4].copy_from_slice(&rows);
        self.length += count;
        if self.length > GATHERED {
            self.flush();
        }
    }

    /// Takes the curvature of a point, unless it was not asked for.
    ///
    /// # Safety
    /// At most once for each point.
    #[inline(always)]
    pub unsafe fn write_curvature(&self, point: u32, curvature: f32) {
        if let Some(all) = &self.normals.curvature {
            // SAFETY: by the caller's promise.
            unsafe { all.write(point as usize, curvature) };
        }
    }

    /// Writes what was gathered.
    #[inline(never)]
    fn flush(&mut self) {
        let length = std::mem::take(&mut self.length);
        for row in bytemuck::cast_slice::<Vec4, [f32; 4]>(&self.gathered[..length]) {
            let [x, y, z, point] = *row;
            // SAFETY: by the promise of who called `write_lanes`.
            unsafe { self.normals.normals.write(point.to_bits() as usize, Vec3::new(x, y, z)) };
        }
    }
}

impl Drop for Writer<'_> {
    fn drop(&mut self) {
        self.flush();
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
