//! Four numbers at once, where glam 0.34 takes them one by one, four vectors, and the transposed of four times four.

use glam::{Mat4, Vec4};
use std::simd::{StdFloat, f32x4, simd_swizzle};

/// The first four of some numbers.
#[inline(always)]
pub(crate) fn load(numbers: &[f32]) -> Vec4 {
    bytemuck::cast::<[f32; 4], _>(numbers[..4].try_into().unwrap())
}

/// The lanes that stand before those of `four`, where `before` are the four before them.
#[inline(always)]
pub(crate) fn after(before: Vec4, four: Vec4) -> Vec4 {
    let [before, four] = [before, four].map(|lanes| f32x4::from_array(lanes.to_array()));
    Vec4::from_array(simd_swizzle!(before, four, [3, 4, 5, 6]).to_array())
}

/// Rows for columns.
#[inline(always)]
pub(crate) fn transposed([a, b, c, d]: [Vec4; 4]) -> [Vec4; 4] {
    let Mat4 { x_axis, y_axis, z_axis, w_axis } = Mat4::from_cols(a, b, c, d).transpose();
    [x_axis, y_axis, z_axis, w_axis]
}

/// The product of vectors, lane by lane.
#[inline(always)]
pub(crate) fn dot(a: [Vec4; 3], b: [Vec4; 3]) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// What is above zero, and zero for the rest: in WebAssembly maxima take several times as long.
#[inline(always)]
pub(crate) fn positive(lanes: Vec4) -> Vec4 {
    Vec4::select(lanes.cmpgt(Vec4::ZERO), lanes, Vec4::ZERO)
}

/// The square root of each lane.
#[inline(always)]
pub(crate) fn root(lanes: Vec4) -> Vec4 {
    bytemuck::cast(f32x4::from_array(lanes.to_array()).sqrt().to_array())
}

/// Each lane to the power of 2^`doublings`: of `1 + x / 2^doublings` nearly `exp(x)`, and the same bits everywhere.
#[inline(always)]
pub(crate) fn power(mut lanes: Vec4, doublings: usize) -> Vec4 {
    (0..doublings).for_each(|_| lanes *= lanes);
    lanes
}

/// One over the square root of each lane.
#[inline(always)]
pub(crate) fn inverse_root(lanes: Vec4) -> Vec4 {
    Vec4::ONE / root(lanes)
}
