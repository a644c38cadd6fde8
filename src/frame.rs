//! The axes along which 'auto' sorts a cloud: its own, so that where and how a cloud lies changes nothing but rounding.

use crate::parallel::{self, Scatter};
use crate::points::{Bounds, Bulk, CHUNK, Points};
use glam::{DVec3, Vec3, Vec4, Vec4Swizzles};

/// Rounds of the power iteration for an axis.
const ROUNDS: usize = 16;

/// An origin and orthogonal axes.
pub(crate) struct Frame {
    /// In the positions' coordinates.
    origin: DVec3,
    /// The unit vectors along the axes.
    pub axes: [Vec3; 3],
    /// The step that coordinates of the positions were rounded to, if they were.
    pub step: f64,
}

impl Frame {
    /// The frame of the positions themselves.
    pub const GIVEN: Self = Self { origin: DVec3::ZERO, axes: Vec3::AXES, step: 0.0 };

    /// A frame that moves and turns with the points.
    ///
    /// Its axes lie askew of those of smallest fourth cumulant, which for a box, and a cube, too, are across its faces: grids
    /// along faces are the worst, as a step of the grid takes or leaves a whole face. What has no such axes, as a ball, is
    /// given some by chance. A power iteration for cumulants finds them: Hyvärinen and Oja, "A Fast Fixed-Point Algorithm for
    /// Independent Component Analysis", Neural Computation 9 (1997).
    #[optimize(size)]
    #[inline(never)]
    pub fn of(points: &Points) -> Self {
        let Bulk { median, mut sample, step, .. } = Bulk::of_points(points);
        let count = sample.len() as f64;
        // Relative to the median first, so that where the cloud is changes no bit.
        let mut mean = DVec3::ZERO;
        for point in &mut sample {
            *point -= median;
            mean += *point / count;
        }
        let mut axes = [DVec3::ZERO; 3];
        for i in 0..2 {
            let Some(&first) = sample.get(i) else { break };
            let axis = first - mean;
            // Of a length from 1 to 2, by a power of two that changes no bit: its seventh power would not be a number.
            let mut axis = axis / f64::from_bits(axis.length().to_bits() >> 52 << 52);
            for _ in 0..ROUNDS {
                let squares: f64 = sample.iter().map(|&point| (point - mean).dot(axis).powi(2)).sum();
                let mut next = DVec3::ZERO;
                for &point in &sample {
                    let offset = point - mean;
                    let along = offset.dot(axis);
                    next += offset * (along * (3.0 * squares - count * along * along));
                }
                axis = (next - axes[0] * axes[0].dot(next)).normalize();
            }
            axes[i] = axis;
        }
        axes[2] = axes[0].cross(axes[1]);
        // Mirrored at their diagonal: the cosines between the old axes and the new ones are 2/3, 2/3 and -1/3, as far as
        // three can be from three.
        let middle = (axes[0] + axes[1] + axes[2]) * (2.0 / 3.0);
        // Not so where all points lie on a line, or are one.
        let is_orthonormal = (middle.length_squared() - 4.0 / 3.0).abs() < 1e-6;
        if !is_orthonormal {
            return Self::GIVEN;
        }
        Self { origin: median, axes: axes.map(|axis| (middle - axis).as_vec3()), step }
    }

    /// Moves positions into this frame, and tells their box there.
    pub fn turn(&self, positions: &mut [Vec3]) -> Bounds {
        let count = positions.len();
        let positions = Scatter::new(positions);
        Bounds::of_chunks(count, &|i| {
            // SAFETY: each point belongs to one chunk.
            let chunk = unsafe { positions.slice(parallel::piece(count, CHUNK, i)) };
            self.turn_chunk(chunk);
            chunk
        })
    }

    #[inline(never)]
    fn turn_chunk(&self, chunk: &mut [Vec3]) {
        let [x, y, z] = [0, 1, 2].map(|i| Vec4::new(self.axes[0][i], self.axes[1][i], self.axes[2][i], 0.0));
        let origin = self.origin.as_vec3();
        for point in &mut *chunk {
            let offset = *point - origin;
            *point = (x * offset.x + y * offset.y + z * offset.z).xyz();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, EulerRot};

    /// The surface of a box with these sides, regularly covered, then turned.
    fn surface(sides: DVec3, turn: DMat3) -> Points<'static> {
        let points = (0..60_000).map(|i| {
            let (face, along) = (i % 3, i / 6);
            let mut place = DVec3::ZERO;
            place[face] = if i % 6 < 3 { 0.5 } else { -0.5 };
            place[(face + 1) % 3] = (along % 100) as f64 / 99.0 - 0.5;
            place[(face + 2) % 3] = (along / 100) as f64 / 99.0 - 0.5;
            turn * (sides * place)
        });
        Points::from_vec(points.flat_map(|point| point.as_vec3().to_array()).collect()).unwrap()
    }

    #[test]
    fn axes_lie_askew_of_faces() {
        for sides in [DVec3::ONE, DVec3::new(1.0, 2.0, 4.0), DVec3::new(1.0, 1.0, 0.2)] {
            for (a, b, c) in [(0.0, 0.0, 0.0), (0.3, 1.1, -0.5), (2.0, -0.7, 0.9)] {
                let turn = DMat3::from_euler(EulerRot::XYZ, a, b, c);
                let frame = Frame::of(&surface(sides, turn));
                for (i, axis) in frame.axes.into_iter().enumerate() {
                    assert!((axis.length() - 1.0).abs() < 1e-6 && axis.dot(frame.axes[(i + 1) % 3]).abs() < 1e-6);
                    let mut cosines = [0, 1, 2].map(|face| turn.col(face).dot(axis.as_dvec3()).abs());
                    cosines.sort_by(f64::total_cmp);
                    assert!((cosines[0] - 1.0 / 3.0).abs() < 0.05, "{sides}, {a} {b} {c}: {cosines:?}");
                    assert!((cosines[2] - 2.0 / 3.0).abs() < 0.05, "{sides}, {a} {b} {c}: {cosines:?}");
                }
            }
        }
    }

    #[test]
    fn what_has_no_axes_keeps_those_given() {
        let line = (0..1000).flat_map(|i| [i as f32, 2.0 * i as f32, 0.0]).collect();
        for positions in [vec![], vec![1.0, 2.0, 3.0], [1.0, 2.0, 3.0].repeat(100), line, [f32::NAN; 30].to_vec()] {
            assert_eq!(Frame::of(&Points::from_vec(positions).unwrap()).axes, Vec3::AXES);
        }
    }
}
