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
    pub other: Option<Other<'a>>,
}

/// A grid of cubes twice or half as large. Positions from there are places in its bricks, brick by brick: so nothing is rounded
/// but what is finer than places are, and a cube is always a part of that of twice its edge.
pub(crate) struct Other<'a> {
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
        let Some(Other { edge, bricks, ends }) = &self.other else { return (self.lattice, self.len()) };
        let brick = ends.partition_point(|&end| end as usize <= point);
        (self.lattice.for_places_in(bricks[brick], *edge), ends[brick] as usize)
    }
}
