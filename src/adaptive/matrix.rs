//! Symmetric matrices, one or four at a time.

use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Vec3, Vec4};

/// A symmetric matrix in single precision: xx, yy, zz and yz, xz, xy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Matrix {
    pub diagonal: Vec3,
    pub off: Vec3,
}

impl Matrix {
    /// In four lanes.
    #[inline(always)]
    pub fn splat(&self) -> [[Vec4; 3]; 2] {
        [self.diagonal, self.off].map(|vector| vector.to_array().map(Vec4::splat))
    }

    /// The product with a vector.
    #[inline(always)]
    pub fn times(&self, p: Vec3) -> Vec3 {
        let (d, o) = (self.diagonal, self.off);
        Mat3::from_cols(Vec3::new(d.x, o.z, o.y), Vec3::new(o.z, d.y, o.x), Vec3::new(o.y, o.x, d.z)) * p
    }

    /// The sum of the squares of its nine entries.
    pub fn square(&self) -> f32 {
        self.diagonal.length_squared() + 2.0 * self.off.length_squared()
    }

    /// `a b^T + b a^T`, halved.
    #[inline(always)]
    pub fn product(a: Vec3, b: Vec3) -> Self {
        let off = Vec3::new(a.y * b.z + a.z * b.y, a.x * b.z + a.z * b.x, a.x * b.y + a.y * b.x);
        Self { diagonal: a * b, off: 0.5 * off }
    }

    #[inline(always)]
    pub fn scaled(&self, factor: f32) -> Self {
        Self { diagonal: self.diagonal * factor, off: self.off * factor }
    }

    #[inline(always)]
    pub fn plus(&self, other: Self) -> Self {
        Self { diagonal: self.diagonal + other.diagonal, off: self.off + other.off }
    }
}

/// The product of matrices, their diagonals and what is off them, with vectors, lane by lane.
#[inline(always)]
pub(super) fn times_lanes([d, o]: [[Vec4; 3]; 2], [x, y, z]: [Vec4; 3]) -> [Vec4; 3] {
    [d[0] * x + o[2] * y + o[1] * z, o[2] * x + d[1] * y + o[0] * z, o[1] * x + o[0] * y + d[2] * z]
}
