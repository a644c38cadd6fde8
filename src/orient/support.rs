//! On which of two planes through a place the points about it lie.

use crate::error::Error;
use crate::lanes::positive;
use crate::lists::grow;
use glam::{Vec3, Vec4};

/// The points in and round a cube: where they are, in edges.
pub(super) struct Support {
    /// Of four points each: x, y and z.
    fours: Vec<[Vec4; 3]>,
    /// Whether they were gathered.
    is_filled: bool,
}

impl Support {
    pub fn new() -> Self {
        Self { fours: Vec::new(), is_filled: false }
    }

    /// Forgets the points.
    pub fn clear(&mut self) {
        self.fours.clear();
        self.is_filled = false;
    }

    /// Gathers the points, no more than `count` of them, if that is not done yet.
    pub fn fill(
        &mut self,
        count: usize,
        mut points: impl Iterator<Item = Vec3>,
        what: &'static str,
    ) -> Result<(), Error> {
        if self.is_filled {
            return Ok(());
        }
        self.is_filled = true;
        grow(&mut self.fours, count.div_ceil(4), what)?;
        while let Some(first) = points.next() {
            // Where there is none, beyond any reach.
            let mut next = || points.next().unwrap_or(Vec3::MAX);
            let four = [first, next(), next(), next()];
            self.fours.push(
                [four.map(|point| point.x), four.map(|point| point.y), four.map(|point| point.z)].map(Vec4::from),
            );
        }
        Ok(())
    }

    /// How much lies on the planes through a place across two directions: points up to an edge away, and so far off the plane,
    /// the nearer to both the more. A point at the place itself is worth 1.
    pub fn of_planes(&self, place: Vec3, directions: [Vec3; 2], thickness: f32) -> [f32; 2] {
        let scale = 1.0 / (thickness * thickness);
        let [x, y, z] = place.to_array().map(Vec4::splat);
        let directions = directions.map(|direction| direction.to_array().map(Vec4::splat));
        let mut sums = [Vec4::ZERO; 2];
        for [other_x, other_y, other_z] in &self.fours {
            let (dx, dy, dz) = (*other_x - x, *other_y - y, *other_z - z);
            let near = positive(Vec4::ONE - (dx * dx + dy * dy + dz * dz));
            for (sum, [along_x, along_y, along_z]) in sums.iter_mut().zip(&directions) {
                let off = dx * *along_x + dy * *along_y + dz * *along_z;
                *sum += near * positive(Vec4::ONE - scale * (off * off));
            }
        }
        sums.map(Vec4::element_sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet of points, of which the last four are not complete.
    #[test]
    fn points_lie_on_the_plane_of_their_sheet() {
        let sheet = (0..81).map(|i| 0.2 * Vec3::new((i % 9) as f32 - 4.0, (i / 9) as f32 - 4.0, 0.0));
        let mut support = Support::new();
        support.fill(81, sheet.clone(), "a test").unwrap();
        support.fill(81, sheet, "a test").unwrap();
        let [on, across] = support.of_planes(Vec3::ZERO, [Vec3::Z, Vec3::X], 0.1);
        let near = |x: f32, y: f32| (1.0 - x * x - y * y).max(0.0);
        let places = || (-4..=4).map(|i| 0.2 * i as f32);
        let expected: f32 = places().flat_map(|x| places().map(move |y| near(x, y))).sum();
        assert!((on - expected).abs() < 1e-4, "{on}, not {expected}");
        // Only one row.
        let expected: f32 = places().map(|y| near(0.0, y)).sum();
        assert!((across - expected).abs() < 1e-4, "{across}, not {expected}");
        support.clear();
        assert_eq!(support.of_planes(Vec3::ZERO, [Vec3::Z, Vec3::X], 0.1), [0.0; 2]);
    }
}
