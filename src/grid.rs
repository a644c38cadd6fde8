//! Points sorted into cubes, and the moments of each cube.

use crate::bricks::{Bricks, set_bits};
use crate::error::Error;
use crate::lattice::{Lattice, cube_centre, cube_in_brick};
use crate::parallel::{self, Scatter};
use crate::pca::Moments;
use crate::points::{CHUNK, Points, reserve};
use crate::progress::Stage;
use bytemuck::{Pod, Zeroable};
use glam::{IVec3, Vec3};
use std::ops::Range;

/// The number of a brick that no point lies in.
const OUTSIDE: u32 = u32::MAX;

/// A point in its brick.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Placed {
    /// The place in the brick, in edges, 0 to 4.
    pub local: Vec3,
    /// Which point of the input it is.
    pub point: u32,
}

/// The cubes that hold points, brick by brick, and their points, cube by cube.
///
/// Bricks lie in the order of [`Bricks`], the cubes of a brick in the order of their bits, the points of a cube in the
/// order of the input: the same for any number of threads.
pub(crate) struct Grid {
    pub bricks: Bricks,
    /// For each brick, one bit for each of its 64 cubes that is occupied.
    pub masks: Vec<u64>,
    /// For each brick its first cube; one more at the end.
    pub first_cube: Vec<u32>,
    /// For each brick its first point; one more at the end.
    pub first_point: Vec<u32>,
    /// For each cube its last point, plus one.
    pub cube_end: Vec<u32>,
    /// The points within the grid, sorted.
    pub placed: Vec<Placed>,
}

impl Grid {
    /// Sorts the points into cubes: three passes over the input, each parallel, and one over the sorted points.
    pub fn sort(points: &Points, lattice: &Lattice, stage: &Stage) -> Result<Self, Error> {
        let bricks = Bricks::find(points, lattice, &stage.part(0.0..0.2))?;
        let (first_point, mut placed) = sort_into_bricks(points, lattice, &bricks, stage)?;
        let (masks, cube_end) = sort_bricks(&first_point, &mut placed, &stage.part(0.8..1.0))?;
        let mut first_cube = Vec::new();
        reserve(&mut first_cube, masks.len() + 1, "the grid")?;
        let mut total = 0;
        first_cube.push(0);
        for mask in &masks {
            total += mask.count_ones();
            first_cube.push(total);
        }
        Ok(Self { bricks, masks, first_cube, first_point, cube_end, placed })
    }

    /// How many cubes hold points.
    pub fn cubes(&self) -> usize {
        self.cube_end.len()
    }

    /// The moments of every cube (the ten sums behind the paper's Eq. 5 and 6).
    pub fn moments(&self, stage: &Stage) -> Result<Vec<Moments>, Error> {
        let mut moments = Vec::new();
        reserve(&mut moments, self.cubes(), "the cubes")?;
        moments.resize(self.cubes(), Moments::default());
        let blocks = blocks(&self.first_point);
        let pieces = split(&mut moments, blocks.iter().map(|bricks| self.first_cube[bricks.end] as usize));
        stage.run(blocks.into_iter().zip(pieces).collect(), |(bricks, moments): (Range<usize>, &mut [Moments])| {
            let mut moments = moments.iter_mut();
            for brick in bricks {
                for ((points, bit), moments) in self.cubes_of(brick).zip(&mut moments) {
                    let centre = cube_centre(bit);
                    *moments = Moments::of(points.iter().map(|placed| placed.local - centre));
                }
            }
        })?;
        Ok(moments)
    }

    /// The occupied cubes of a brick in their order: the points of each, and its bit in the mask.
    pub fn cubes_of(&self, brick: usize) -> impl Iterator<Item = (&[Placed], u32)> {
        let cubes = self.first_cube[brick] as usize..self.first_cube[brick + 1] as usize;
        let mut start = self.first_point[brick] as usize;
        self.cube_end[cubes].iter().zip(set_bits(self.masks[brick])).map(move |(&end, bit)| {
            let points = &self.placed[start..end as usize];
            start = end as usize;
            (points, bit)
        })
    }

    /// Runs of bricks that hold some ten thousand points each: the tasks of the later stages.
    pub fn blocks(&self) -> Vec<Range<usize>> {
        blocks(&self.first_point)
    }
}

/// Sorts the points by brick: a counting sort, stable, so its result does not depend on how the input is cut.
fn sort_into_bricks(
    points: &Points,
    lattice: &Lattice,
    bricks: &Bricks,
    stage: &Stage,
) -> Result<(Vec<u32>, Vec<Placed>), Error> {
    let count = points.len();
    // Each piece of the input counts for itself. Few pieces when there are many bricks: at most 8 bytes a point.
    let pieces = (2 * count / bricks.len().max(1)).clamp(1, (4 * parallel::threads()).max(16));
    let piece = count.div_ceil(pieces).max(CHUNK);

    let mut keys: Vec<u32> = Vec::new();
    reserve(&mut keys, count, "the sorting keys")?;
    keys.resize(count, OUTSIDE);
    let tasks = points.positions.chunks(piece).zip(keys.chunks_mut(piece)).collect();
    let mut counts = stage.part(0.2..0.4).run(tasks, |(positions, keys): (&[Vec3], &mut [u32])| {
        let mut counts: Vec<u32> = Vec::new();
        reserve(&mut counts, bricks.len(), "the grid")?;
        counts.resize(bricks.len(), 0);
        for (key, &point) in keys.iter_mut().zip(positions) {
            if let Some(number) = lattice.locate(point).and_then(|(brick, _)| bricks.number(brick)) {
                *key = number;
                counts[number as usize] += 1;
            }
        }
        Ok(counts)
    })?;
    let mut counts = counts.drain(..).collect::<Result<Vec<Vec<u32>>, Error>>()?;

    // Where each piece writes its first point of each brick.
    let mut first_point = Vec::new();
    reserve(&mut first_point, bricks.len() + 1, "the grid")?;
    let mut total = 0;
    for brick in 0..bricks.len() {
        first_point.push(total);
        for counts in &mut counts {
            total += std::mem::replace(&mut counts[brick], total);
        }
    }
    first_point.push(total);

    let mut placed: Vec<Placed> = Vec::new();
    reserve(&mut placed, total as usize, "the sorted points")?;
    placed.resize(total as usize, Placed::zeroed());
    let target = Scatter::new(&mut placed);
    let tasks = points.positions.chunks(piece).zip(keys.chunks(piece)).zip(counts).enumerate().collect();
    stage.part(0.4..0.8).run(tasks, |(i, ((positions, keys), mut next)): (usize, ((&[Vec3], &[u32]), Vec<u32>))| {
        for (j, (&point, &key)) in positions.iter().zip(keys).enumerate() {
            if key != OUTSIDE
                && let Some((_, local)) = lattice.locate(point)
            {
                let place = next[key as usize];
                next[key as usize] += 1;
                let point = (i * piece + j) as u32;
                // SAFETY: `place` runs through the part of this piece and this brick, which the prefix sum above gave
                // to no other piece and no other brick.
                unsafe { target.write(place as usize, Placed { local, point }) };
            }
        }
    })?;
    Ok((first_point, placed))
}

/// Sorts the points of each brick by cube, stable; answers for each brick which cubes are occupied, and for each cube
/// where its points end.
fn sort_bricks(first_point: &[u32], placed: &mut [Placed], stage: &Stage) -> Result<(Vec<u64>, Vec<u32>), Error> {
    let blocks = blocks(first_point);
    let pieces = split(placed, blocks.iter().map(|bricks| first_point[bricks.end] as usize));
    let tasks = blocks.into_iter().zip(pieces).collect();
    let sorted = stage.run(tasks, |(bricks, mut placed): (Range<usize>, &mut [Placed])| {
        let mut scratch: Vec<Placed> = Vec::new();
        let (mut masks, mut ends) = (Vec::with_capacity(bricks.len()), Vec::with_capacity(16 * bricks.len()));
        for brick in bricks {
            let (points, rest) = placed.split_at_mut((first_point[brick + 1] - first_point[brick]) as usize);
            placed = rest;
            scratch.clear();
            if scratch.capacity() < points.len() {
                reserve(&mut scratch, points.len(), "the sorted points")?;
            }
            scratch.extend_from_slice(points);
            let counts = sort_brick(&scratch, points);
            let mut end = first_point[brick];
            let mut mask = 0;
            for (bit, count) in counts.into_iter().enumerate().filter(|(_, count)| *count > 0) {
                mask |= 1 << bit;
                end += count;
                ends.push(end);
            }
            masks.push(mask);
        }
        Ok((masks, ends))
    })?;
    let sorted = sorted.into_iter().collect::<Result<Vec<_>, Error>>()?;
    let (mut masks, mut ends) = (Vec::new(), Vec::new());
    reserve(&mut masks, first_point.len() - 1, "the grid")?;
    reserve(&mut ends, sorted.iter().map(|(_, ends)| ends.len()).sum(), "the cubes")?;
    for (block_masks, block_ends) in sorted {
        masks.extend(block_masks);
        ends.extend(block_ends);
    }
    Ok((masks, ends))
}

/// A counting sort over the 64 cubes of a brick; answers the number of points in each.
fn sort_brick(points: &[Placed], sorted: &mut [Placed]) -> [u32; 64] {
    let mut counts = [0; 64];
    for point in points {
        counts[cube_in_brick(point.local) as usize] += 1;
    }
    let mut next = counts;
    let mut total = 0;
    for next in &mut next {
        total += std::mem::replace(next, total);
    }
    for point in points {
        let next = &mut next[cube_in_brick(point.local) as usize];
        sorted[*next as usize] = *point;
        *next += 1;
    }
    counts
}

fn blocks(first_point: &[u32]) -> Vec<Range<usize>> {
    const POINTS: u32 = 1 << 14;
    const BRICKS: usize = 1 << 10;
    let count = first_point.len() - 1;
    let mut blocks = Vec::new();
    let mut start = 0;
    for end in 1..=count {
        if end == count || end - start == BRICKS || first_point[end] - first_point[start] >= POINTS {
            blocks.push(start..end);
            start = end;
        }
    }
    blocks
}

/// Cuts a slice at the given ends, the last of which is its length.
pub(crate) fn split<T>(mut slice: &mut [T], ends: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    let mut start = 0;
    ends.map(|end| {
        let (piece, rest) = std::mem::take(&mut slice).split_at_mut(end - start);
        (slice, start) = (rest, end);
        piece
    })
    .collect()
}

/// The cubes in and one deep around a brick: 6x6x6 of them.
pub(crate) struct Surroundings {
    cubes: [u32; 6 * 6 * 6],
}

impl Surroundings {
    const EMPTY: u32 = u32::MAX;

    pub fn new() -> Self {
        Self { cubes: [Self::EMPTY; 216] }
    }

    /// Looks up the 27 bricks around and in place of brick `brick`.
    pub fn look(&mut self, grid: &Grid, brick: usize) {
        self.cubes.fill(Self::EMPTY);
        for step in steps() {
            let number = if step == IVec3::ZERO {
                Some(brick as u32)
            } else {
                grid.bricks.number(grid.bricks.places[brick] + step)
            };
            let Some(number) = number else { continue };
            let (mask, first) = (grid.masks[number as usize], grid.first_cube[number as usize]);
            let shift = 4 * step + 1;
            for bit in set_bits(mask & facing(step)) {
                let cube = IVec3::new(bit as i32 & 3, bit as i32 >> 2 & 3, bit as i32 >> 4);
                let before = (mask & ((1 << bit) - 1)).count_ones();
                self.cubes[Self::slot(cube + shift)] = first + before;
            }
        }
    }

    /// The number of the cube `step` away from the cube with bit `bit` of the brick, if it is occupied.
    #[inline]
    pub fn cube(&self, bit: u32, step: IVec3) -> Option<usize> {
        let centre = 1 + 6 + 36 + (bit & 3) + 6 * (bit >> 2 & 3) + 36 * (bit >> 4);
        let cube = self.cubes[(centre as i32 + step.x + 6 * step.y + 36 * step.z) as usize];
        (cube != Self::EMPTY).then_some(cube as usize)
    }

    fn slot(cube: IVec3) -> usize {
        (cube.x + 6 * cube.y + 36 * cube.z) as usize
    }
}

/// The 27 steps from a cube to itself and its neighbours, x fastest.
pub(crate) fn steps() -> impl Iterator<Item = IVec3> {
    (0..27).map(|i| IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1))
}

/// The cubes of the brick `step` away that touch this brick.
fn facing(step: IVec3) -> u64 {
    const X: [u64; 3] = [0x8888_8888_8888_8888, u64::MAX, 0x1111_1111_1111_1111];
    const Y: [u64; 3] = [0xF000_F000_F000_F000, u64::MAX, 0x000F_000F_000F_000F];
    const Z: [u64; 3] = [0xFFFF_0000_0000_0000, u64::MAX, 0x0000_0000_0000_FFFF];
    let [x, y, z] = (step + 1).to_array().map(|i| i as usize);
    X[x] & Y[y] & Z[z]
}
