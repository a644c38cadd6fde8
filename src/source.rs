//! What is sorted into a grid: points in space, or those of another grid.

use crate::lattice::Lattice;
use crate::points::{CHUNK, Points};
use glam::{IVec3, Vec3};
use std::ops::Range;

/// Points on their way into the cubes of a lattice.
pub(crate) struct Source<'a> {
    pub lattice: Lattice,
    pub positions: &'a [Vec3],
    /// The numbers that the points have, if not their own here.
    pub numbers: Option<&'a [u32]>,
    /// What the positions are relative to, if they come from another grid.
    pub other: Option<OtherGrid<'a>>,
}

/// A grid of cubes twice or half as large. Positions from there are places in its bricks, brick by brick: so nothing is
/// rounded but what is finer than places are, and a cube is always a part of that of twice its edge.
pub(crate) struct OtherGrid<'a> {
    /// The edge of its cubes, in those of the lattice.
    pub edge: f64,
    /// The places of its bricks.
    pub bricks: &'a [IVec3],
    /// For each of these its last point, plus one.
    pub ends: &'a [u32],
}

impl<'a> Source<'a> {
    /// The points of a cloud.
    pub fn new(points: &'a Points, lattice: Lattice) -> Self {
        Self { lattice, positions: &points.positions, numbers: None, other: None }
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// How many chunks of [`CHUNK`] points there are: the tasks of passes over them.
    pub fn chunks(&self) -> usize {
        self.len().div_ceil(CHUNK)
    }

    /// Some points part by part, each with the lattice for its positions.
    pub fn parts(&self, points: Range<usize>) -> impl Iterator<Item = (Lattice, Range<usize>)> {
        let mut start = points.start;
        std::iter::from_fn(move || {
            if start == points.end {
                return None;
            }
            let (lattice, end) = self.part(start);
            let part = start..end.min(points.end);
            start = part.end;
            Some((lattice, part))
        })
    }

    /// The lattice for the position of a point and those after it, and where they end.
    #[optimize(size)]
    #[inline(never)]
    fn part(&self, point: usize) -> (Lattice, usize) {
        let Some(OtherGrid { edge, bricks, ends }) = &self.other else { return (self.lattice, self.len()) };
        let brick = ends.partition_point(|&end| end as usize <= point);
        (self.lattice.for_places_in(bricks[brick], *edge), ends[brick] as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::CUBES;
    use crate::points::Bounds;
    use glam::DVec3;

    /// Also where bricks without points come first, last or in between, and where cuts are between bricks.
    #[test]
    fn parts_are_those_of_the_bricks() {
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::splat(100.0), finite: 2 };
        let lattice = Lattice::new(&bounds, &|| DVec3::ZERO, 1.0, CUBES);
        let ends = [0, 2, 2, 5, 5, 6, 6];
        let bricks: Vec<IVec3> = (0..7).map(IVec3::splat).collect();
        let brick_of = [1, 1, 3, 3, 3, 5];
        let positions = [Vec3::ONE; 6];
        let other = OtherGrid { edge: 2.0, bricks: &bricks, ends: &ends };
        let source = Source { lattice, positions: &positions, numbers: None, other: Some(other) };
        for start in 0..=6 {
            for end in start..=6 {
                let mut next = start;
                for (lattice, part) in source.parts(start..end) {
                    assert_eq!(part.start, next);
                    assert!(!part.is_empty());
                    next = part.end;
                    for point in part {
                        // A place 1 from the corner of a brick of edge 8.
                        let place = f64::from(8 * brick_of[point] + 2);
                        assert_eq!(lattice.brick(positions[point]), Some(DVec3::splat((place / 4.0).floor())));
                    }
                }
                assert_eq!(next, end);
            }
        }
    }
}
