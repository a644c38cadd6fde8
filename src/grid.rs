//! Points sorted into cubes, and the moments of each cube.

use crate::bricks::{Bricks, OUTSIDE, set_bits};
use crate::error::Error;
use crate::lanes::transposed;
use crate::lattice::{BRICK, cube_centre, octant_in_brick};
use crate::lists::reserve;
use crate::parallel::{self, Filling, Scatter};
use crate::points::CHUNK;
use crate::progress::Stage;
use crate::source::Source;
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3, Vec4};
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// A point in its brick.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct Placed {
    /// The place in the brick, in edges, 0 to 4.
    pub local: Vec3,
    /// Its number, as the source has it.
    pub point: u32,
}

impl Placed {
    /// Put together as four lanes of floats, which are stored as one; four numbers would be stored one by one.
    #[inline(always)]
    pub fn new(local: Vec3, point: u32) -> Self {
        bytemuck::cast(local.extend(f32::from_bits(point)))
    }

    /// The place, as the first three of four lanes.
    #[inline(always)]
    pub fn lanes(self) -> Vec4 {
        bytemuck::cast(self)
    }
}

/// Where up to four points of a brick lie, against a place in it, and the bits of their numbers. The last one fills up.
#[inline(always)]
pub(crate) fn located(points: &[Placed], place: Vec3) -> ([Vec4; 3], Vec4) {
    let [x, y, z, numbers] = transposed(std::array::from_fn(|i| points[i.min(points.len() - 1)].lanes()));
    ([x - place.x, y - place.y, z - place.z], numbers)
}

/// The cubes that hold points, brick by brick, and their points, cube by cube.
///
/// Bricks lie in the order of [`Bricks`], the cubes of a brick in the order of their bits, the points of a cube by
/// octant, those of an octant in the order of the input: the same for any number of threads.
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
    /// Runs of bricks: the tasks of the later stages.
    pub blocks: Vec<Range<usize>>,
}

impl Grid {
    /// Sorts the points into cubes, and asks `of_cube` for something about every cube, from its points and its centre in
    /// the brick. Four passes over the points, each parallel.
    pub fn sort<T: Copy + Send>(
        source: &Source,
        stage: &Stage,
        of_cube: impl Fn(&[Placed], Vec3) -> T + Sync,
    ) -> Result<(Self, Vec<T>), Error> {
        let mut grid = Self::sort_points(source, &stage.part(0.0..0.9))?;
        let answers = grid.find_cubes(&stage.part(0.9..1.0), of_cube)?;
        Ok((grid, answers))
    }

    /// All but the ends of the cubes.
    #[optimize(size)]
    fn sort_points(source: &Source, stage: &Stage) -> Result<Self, Error> {
        let (bricks, keys) = Bricks::find(source, &stage.part(0.0..0.4))?;
        let (first_point, mut placed) = sort_by_brick(source, &bricks, keys, &stage.part(0.4..0.8))?;
        let masks = sort_by_cube(&mut placed, &first_point, &stage.part(0.8..1.0))?;

        let mut first_cube = Vec::new();
        reserve(&mut first_cube, masks.len() + 1, "the grid")?;
        let mut total = 0;
        first_cube.push(0);
        for mask in &masks {
            total += mask.count_ones();
            first_cube.push(total);
        }
        let blocks = blocks(&first_point);
        Ok(Self { bricks, masks, first_cube, first_point, cube_end: Vec::new(), placed, blocks })
    }

    /// The number of the cube with bit `bit` of a brick; it must be occupied.
    #[inline(always)]
    pub fn cube(&self, brick: usize, bit: u32) -> u32 {
        self.first_cube[brick] + (self.masks[brick] & ((1 << bit) - 1)).count_ones()
    }

    /// How many cubes hold points.
    pub fn cubes(&self) -> usize {
        self.cube_end.len()
    }

    /// Where the points of a cube stand among all points of the grid.
    pub fn points_of(&self, cube: usize) -> Range<usize> {
        let start = if cube == 0 { 0 } else { self.cube_end[cube - 1] };
        start as usize..self.cube_end[cube] as usize
    }

    /// The occupied cubes of a brick: the middle of each, in edges, its number, and its bit in the mask.
    pub fn centres_of(&self, brick: usize) -> impl Iterator<Item = (DVec3, usize, u32)> {
        let corner = (BRICK * self.bricks.places[brick]).as_dvec3();
        let cubes = set_bits(self.masks[brick]).zip(self.first_cube[brick] as usize..);
        cubes.map(move |(bit, cube)| (corner + cube_centre(bit).as_dvec3(), cube, bit))
    }

    /// Calls `work(brick, cube, its bit in the mask)` for every cube, in parallel.
    pub fn each_cube(&self, stage: &Stage, work: &(dyn Fn(usize, usize, u32) + Sync)) -> Result<(), Error> {
        stage
            .run(self.blocks.len(), &|block| self.cubes_in(block).for_each(|(brick, cube, bit)| work(brick, cube, bit)))
    }

    /// The cubes of a block: the brick, the cube, and its bit in the mask.
    pub fn cubes_in(&self, block: usize) -> impl Iterator<Item = (usize, usize, u32)> {
        self.blocks[block].clone().flat_map(|brick| {
            let first = self.first_cube[brick] as usize;
            set_bits(self.masks[brick]).zip(first..).map(move |(bit, cube)| (brick, cube, bit))
        })
    }

    /// Notes where the points of each cube end, and asks `of_cube` while they are at hand.
    fn find_cubes<T: Copy + Send>(
        &mut self,
        stage: &Stage,
        of_cube: impl Fn(&[Placed], Vec3) -> T + Sync,
    ) -> Result<Vec<T>, Error> {
        let cubes = self.first_cube[self.masks.len()] as usize;
        let (answers, ends) = (Filling::new(cubes, "the cubes")?, Filling::new(cubes, "the cubes")?);
        let (placed, first_point, first_cube) = (&self.placed, &self.first_point, &self.first_cube);
        let (masks, blocks) = (&self.masks, &self.blocks);
        stage.run(blocks.len(), &|block| {
            for brick in blocks[block].clone() {
                let mut start = first_point[brick] as usize;
                let last = first_point[brick + 1] as usize;
                for (cube, bit) in (first_cube[brick] as usize..).zip(set_bits(masks[brick])) {
                    let points = &placed[start..last];
                    let centre = cube_centre(bit);
                    let (low, high) = ((centre - 0.5).extend(0.0), (centre + 0.5).extend(0.0));
                    // They are sorted by cube: the first outside ends it.
                    let is_inside = |point: &&Placed| {
                        let place = point.lanes();
                        (place.cmpge(low) & place.cmplt(high)).bitmask() & 7 == 7
                    };
                    let length = points.iter().take_while(is_inside).count();
                    start += length;
                    // SAFETY: a cube belongs to one brick, and a brick to one block.
                    unsafe {
                        answers.write(cube, of_cube(&points[..length], centre));
                        ends.write(cube, start as u32);
                    }
                }
            }
        })?;
        // SAFETY: the blocks hold all bricks, and these all cubes.
        unsafe {
            self.cube_end = ends.complete();
            Ok(answers.complete())
        }
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
}

/// The points of a cube octant by octant, each after its number: bits 0, 1 and 2 tell whether it is not below the cube's
/// centre along x, y and z.
#[inline(always)]
pub(crate) fn octants(points: &[Placed], centre: Vec3) -> impl Iterator<Item = (u32, &[Placed])> {
    // Where octants end among the points up to `seen`.
    let (mut start, mut seen, mut ends) = (0, 0, 0);
    std::iter::from_fn(move || {
        let octant = octant(points.get(start)?, centre);
        if start == seen {
            seen = points.len().min(start + 64);
            ends = octant_ends(&points[start..seen], centre);
        }
        let first = start;
        let length = 1 + ends.trailing_zeros() as usize;
        start += length;
        if start < seen {
            ends >>= length;
        } else {
            start = seen + points[seen..].iter().take_while(|placed| self::octant(placed, centre) == octant).count();
            seen = start;
        }
        Some((octant, &points[first..start]))
    })
}

/// The octant of a point of the cube with some centre.
#[inline(always)]
fn octant(placed: &Placed, centre: Vec3) -> u32 {
    placed.lanes().cmpge(centre.extend(0.0)).bitmask() & 7
}

/// Of at most 64 points of a cube, a bit for each that is the last of its octant but for the last of all. Without branches,
/// because nothing foretells them.
#[inline(always)]
fn octant_ends(points: &[Placed], centre: Vec3) -> u64 {
    let pairs = points.iter().zip(&points[1..]).enumerate();
    pairs.fold(0, |ends, (i, (a, b))| ends | u64::from(octant(a, centre) != octant(b, centre)) << i)
}

/// Sorts the points by brick: a counting sort, stable, so its result does not depend on how the input is cut.
#[optimize(size)]
fn sort_by_brick(
    source: &Source,
    bricks: &Bricks,
    mut keys: Vec<u32>,
    stage: &Stage,
) -> Result<(Vec<u32>, Vec<Placed>), Error> {
    let count = source.len();
    // Each piece of the input counts for itself. Few pieces when there are many bricks: at most 8 bytes a point.
    let pieces = (2 * count / bricks.len().max(1)).clamp(1, (4 * parallel::threads()).max(16));
    let size = count.div_ceil(pieces).max(CHUNK);
    let pieces = count.div_ceil(size);
    let of_piece = |i: usize| i * bricks.len()..(i + 1) * bricks.len();

    let mut counts: Vec<u32> = Vec::new();
    reserve(&mut counts, pieces * bricks.len(), "the grid")?;
    counts.resize(pieces * bricks.len(), 0);
    let (shared, numbers) = (Scatter::new(&mut counts), Scatter::new(&mut keys));
    stage.part(0.0..0.15).run(pieces, &|i| {
        // SAFETY: each piece counts in its own part, and reads its own points.
        let (counts, keys) = unsafe { (shared.slice(of_piece(i)), numbers.slice(parallel::piece(count, size, i))) };
        for key in keys {
            if *key != OUTSIDE {
                *key = bricks.number_of_key(*key);
                counts[*key as usize] += 1;
            }
        }
    })?;

    // Where each piece writes its first point of each brick.
    let mut first_point = Vec::new();
    reserve(&mut first_point, bricks.len() + 1, "the grid")?;
    let mut total = 0;
    for brick in 0..bricks.len() {
        first_point.push(total);
        for piece in 0..pieces {
            total += std::mem::replace(&mut counts[piece * bricks.len() + brick], total);
        }
    }
    first_point.push(total);

    let (shared, placed) = (Scatter::new(&mut counts), Filling::new(total as usize, "the sorted points")?);
    stage.part(0.15..1.0).run(pieces, &|i| {
        // SAFETY: each piece counts on in its own part.
        let next = unsafe { shared.slice(of_piece(i)) };
        for (lattice, points) in source.parts(parallel::piece(count, size, i)) {
            for point in points {
                let key = keys[point] as usize;
                if let Some(next) = next.get_mut(key) {
                    let local = lattice.local(source.positions[point]);
                    let number = source.numbers.map_or(point as u32, |numbers| numbers[point]);
                    // SAFETY: `next` runs through the part of this piece and this brick, which the sums above gave to no
                    // other piece and no other brick.
                    unsafe { placed.write(*next as usize, Placed::new(local, number)) };
                    *next += 1;
                }
            }
        }
    })?;
    // SAFETY: as many places as points were counted, and each point was written to its own.
    Ok((first_point, unsafe { placed.complete() }))
}

/// Sorts the points of each brick by cube and octant, stable and in place; answers for each brick which cubes are occupied.
#[optimize(size)]
fn sort_by_cube(placed: &mut [Placed], first_point: &[u32], stage: &Stage) -> Result<Vec<u64>, Error> {
    let masks = Filling::new(first_point.len() - 1, "the grid")?;
    // Bytes that were not to be had.
    let (placed, lacking) = (Scatter::new(placed), AtomicUsize::new(0));
    let blocks = blocks(first_point);
    stage.run(blocks.len(), &|block| {
        let (mut next, mut unsorted) = ([0; 8 * 64], Vec::new());
        for brick in blocks[block].clone() {
            // SAFETY: a brick belongs to one block, and its points and its mask to no other brick.
            let points = unsafe { placed.slice(first_point[brick] as usize..first_point[brick + 1] as usize) };
            // A copy of one brick, so mostly in the nearest cache.
            unsorted.clear();
            if unsorted.try_reserve_exact(points.len()).is_err() {
                lacking.store(size_of_val(points), Relaxed);
                return;
            }
            unsorted.extend_from_slice(points);
            // SAFETY: as above.
            unsafe { masks.write(brick, sort_brick(&unsorted, points, &mut next)) };
        }
    })?;
    match lacking.into_inner() {
        0 => {}
        bytes => return Err(Error::memory("the sorted points", bytes as u64)),
    }
    // SAFETY: the blocks hold all bricks, and none failed.
    Ok(unsafe { masks.complete() })
}

/// A counting sort over the octants of the 64 cubes of a brick; answers which cubes are occupied. All of `next` is zero
/// before and after: where few cubes are occupied, to clear the whole would take longer than to sort.
fn sort_brick(points: &[Placed], sorted: &mut [Placed], next: &mut [u32; 8 * 64]) -> u64 {
    let mut mask = 0;
    for point in points {
        let octant = octant_in_brick(point.lanes());
        next[octant as usize] += 1;
        mask |= 1 << (octant / 8);
    }
    let octants = |cube: u32| 8 * cube as usize..8 * cube as usize + 8;
    let mut total = 0;
    for octant in set_bits(mask).flat_map(octants) {
        total += std::mem::replace(&mut next[octant], total);
    }
    for point in points {
        let next = &mut next[octant_in_brick(point.lanes()) as usize];
        sorted[*next as usize] = *point;
        *next += 1;
    }
    for cube in set_bits(mask) {
        next[octants(cube)].fill(0);
    }
    mask
}

/// Runs of bricks that hold some four thousand points each: the tasks of the later stages. Of what is divided there are often
/// no more than a hundred thousand at a time, and the threads are to end together.
fn blocks(first_point: &[u32]) -> Vec<Range<usize>> {
    const POINTS: u32 = 1 << 12;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Also of more points than are looked at in one go, ending there and beside it.
    #[test]
    fn octants_are_runs_of_points_on_the_same_sides() {
        let of = |placed: &Placed| placed.local.cmpge(Vec3::splat(0.5)).bitmask();
        for first in [0, 1, 2, 7, 63, 64, 65, 128] {
            for second in [1, 3, 60, 63, 64, 65, 200] {
                let point = |i: u32| if i < first { 0.2 } else { 0.7 + 0.1 * f32::from(i >= first + second) };
                let points: Vec<Placed> = (0..first + second + 5)
                    .map(|i| Placed::new(Vec3::new(point(i), 0.6, if i < first + second { 0.1 } else { 0.9 }), i))
                    .collect();
                let found: Vec<(u32, &[Placed])> = octants(&points, Vec3::splat(0.5)).collect();
                let expected: Vec<&[Placed]> = points.chunk_by(|a, b| of(a) == of(b)).collect();
                assert_eq!(found.len(), expected.len(), "{first} and {second} points");
                for ((octant, points), expected) in found.into_iter().zip(expected) {
                    assert_eq!((octant, points.len()), (of(&expected[0]), expected.len()));
                    assert!(std::ptr::eq(points, expected));
                }
            }
        }
        assert_eq!(octants(&[], Vec3::ZERO).count(), 0);
    }
}
