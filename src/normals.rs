//! One normal for each point, and if wanted its curvature, as every method hands them over.

use crate::error::Error;
use crate::frame::Frame;
use crate::lanes::{inverse_root, load, transposed};
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
    /// For each axis of the input what those of the directions have along it.
    axes: [Vec3; 3],
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
    /// For `count` points, of which `expected` will be written; if these are not all, the others are zero. Directions are in
    /// `frame`.
    pub fn new(count: usize, expected: usize, curvature: bool, frame: &Frame) -> Result<Self, Error> {
        let normals = Filling::new(count, "the normals")?;
        // Else nobody can ask for it.
        let curvature = cfg!(feature = "full") && curvature;
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
        Ok(Self { normals, curvature, resolved: AtomicU64::new(0), axes: frame.axes })
    }

    /// What one task hands its normals over with; all are written when it is dropped.
    pub fn writer(&self) -> Writer<'_> {
        Writer { normals: self, gathered: [[0.0; GATHERED + 4]; 4], length: 0, rows: [[0.0; 4]; GATHERED + 4] }
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

/// Directions gathered before they are written. Four more may come at once, so there is room for 256: 4 KiB, and 4 KiB of
/// rows.
const GATHERED: usize = 252;

/// Takes directions, and writes the unit normals of a task. They go to places all over the memory, and every place has to be
/// waited for; of those that are written right after each other the processor waits for many at once. So it does for their
/// roots.
#[repr(C, align(16))]
pub(crate) struct Writer<'a> {
    /// x, y and z of each direction, and the bits of the point's number; what stands from `length` on means nothing. First
    /// and aligned, so that no four lie across two cache lines.
    gathered: [[f32; GATHERED + 4]; 4],
    /// What is written: of each point x, y and z of the unit normal, and the bits of its number.
    rows: [[f32; 4]; GATHERED + 4],
    length: usize,
    normals: &'a Normals,
}

impl Writer<'_> {
    /// Whether the curvature of each point was asked for, and must be written too.
    pub fn has_curvature(&self) -> bool {
        cfg!(feature = "full") && self.normals.curvature.is_some()
    }

    /// Takes the direction of the normal of a point: of either sign and any length from 1e-19 on, or exactly zero if nothing
    /// determines it. Callers replace what is shorter than [`SHORT`].
    ///
    /// # Safety
    /// At most once for each point.
    #[inline(always)]
    pub unsafe fn write(&mut self, point: u32, direction: Vec3) {
        // SAFETY: by the caller's promise.
        unsafe { self.write_lanes(Vec4::splat(f32::from_bits(point)), 1, direction.to_array().map(Vec4::splat)) };
    }

    /// Takes the directions of `count` points, one to four, lane by lane, as [`Writer::write`] does. `points` has the bits
    /// of their numbers.
    ///
    /// # Safety
    /// At most once for each point, which is written later.
    #[inline(always)]
    pub unsafe fn write_lanes(&mut self, points: Vec4, count: usize, [x, y, z]: [Vec4; 3]) {
        // It never is more, but so the compiler knows.
        let length = self.length.min(GATHERED);
        for (row, lanes) in self.gathered.iter_mut().zip([x, y, z, points]) {
            // All four; the next overwrite those too many.
            row[length..length + 4].copy_from_slice(&lanes.to_array());
        }
        self.length = length + count;
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
        let [a, b, c] = self.normals.axes;
        for (four, rows) in self.rows.chunks_exact_mut(4).enumerate().take(length.div_ceil(4)) {
            let [x, y, z, points] = self.gathered.each_ref().map(|row| load(&row[4 * four..]));
            let [x, y, z] = [0, 1, 2].map(|i| a[i] * x + b[i] * y + c[i] * z);
            let square = x * x + y * y + z * z;
            // Zero stays zero: this is the square of 1e-19.
            let scale = inverse_root(square.max(Vec4::splat(f32::MIN_POSITIVE)));
            let [x, y, z] = face([x, y, z].map(|lanes| lanes * scale));
            rows.copy_from_slice(&transposed([x, y, z, points]).map(|row| row.to_array()));
        }
        for [x, y, z, point] in &self.rows[..length] {
            // SAFETY: by the promise of who called `write_lanes`.
            unsafe { self.normals.normals.write(point.to_bits() as usize, Vec3::new(*x, *y, *z)) };
        }
    }
}

impl Drop for Writer<'_> {
    fn drop(&mut self) {
        self.flush();
    }
}

/// A direction that is no longer than this tells nothing.
pub(crate) const SHORT: f32 = 1e-6;

/// Chooses the signs: `x + 2y + 4z >= 0`, a plane that few man-made walls are parallel to.
#[inline(always)]
fn face([x, y, z]: [Vec4; 3]) -> [Vec4; 3] {
    let side = x + 2.0 * y + 4.0 * z;
    // On the plane itself the first component that is not zero decides.
    let first = Vec4::select(x.cmpeq(Vec4::ZERO), y, x);
    let side = Vec4::select(side.cmpeq(Vec4::ZERO), first, side);
    let sign = Vec4::ONE.copysign(side);
    // Adding zero turns -0 into 0.
    [x, y, z].map(|lanes| lanes * sign + Vec4::ZERO)
}
