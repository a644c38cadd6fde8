//! Which side of a patch is open to the air.

use super::ball::Ball;
use super::patches::{Patch, Patches, signed};
use crate::bricks::set_bits;
use crate::error::Error;
use crate::grid::Grid;
use crate::lattice::{BRICK, cube_place};
use crate::lists::{filled, reserve};
use crate::median::ranked;
use crate::parallel::{Filling, Gathering};
use crate::progress::Stage;
use crate::surroundings::STEPS;
use glam::{IVec3, Vec3, Vec4};
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Directions in which to look for the open air: to the faces, edges and corners of a cube, all steps but that to itself.
pub(super) const DIRECTIONS: usize = STEPS.len() - 1;

/// A surface that is open to one half of space sees it with some 9 of the directions.
const HALF: f32 = 9.0;

/// What it counts to see that, against links that count up to 1. With 1.7 walls thinner than two spacings get one sign for both
/// sides, with 2.5 the ends of tubes as thin are torn, with 4 the corners of rooms, which are seen from behind.
const AIR: f32 = 2.0;

/// A patch that sees so much more of the open on one side than on the other, of all that it sees, has that side in the open:
/// objects have, ground and walls do not.
const IN_THE_OPEN: f32 = 0.5;

/// A side sees less of the open than the other if the difference is so much of all: ground sees it from both.
const MORE: f32 = 0.2;

/// Less of the open is a gap, and what sees so much of it has next to nothing else before it: all on one side is 0.67 to 0.74.
const LEAST_OPEN: f32 = 0.05;
const MOST_OPEN: f32 = 0.66;

/// What errors call the memory of all this.
const WHAT: &str = "the open sides";

/// How much of the open air the patches look into, from 0 to about 1 for each of its sides.
pub(super) struct Sights {
    /// For each patch what it sees along its normal, less what it sees against it: positive if that points outwards.
    pub exposure: Vec<f32>,
    /// For each patch the sum of both.
    pub all: Vec<f32>,
}

impl Sights {
    /// For each patch what speaks for its normal to point outwards: its exposure, less where it sees the open from both sides,
    /// as ground does, and where it is of few points.
    pub fn evidence(&self, patches: &Patches) -> impl Iterator<Item = f32> {
        // What is left of directions along the surface is rounding, in both sums.
        let share =
            |exposure: f32, all: f32| exposure * (exposure.abs() / all.max(exposure.abs()).max(f32::MIN_POSITIVE));
        let sights = self.exposure.iter().zip(&self.all);
        sights.zip(&patches.all).map(move |((&exposure, &all), patch)| AIR * patch.certainty() * share(exposure, all))
    }

    /// Of a patch that has one side in the open, and something before that, whether its normal points to the other.
    pub fn open_side(&self, patch: usize) -> Option<bool> {
        let (exposure, all) = (self.exposure[patch], self.all[patch]);
        let is_open = all > LEAST_OPEN && exposure.abs() > IN_THE_OPEN * all && exposure.abs() < MOST_OPEN;
        is_open.then_some(exposure < 0.0)
    }

    /// Whether the side of a patch that its normal points to, or the other one, sees less of the open than that behind it.
    pub fn is_back(&self, patch: usize, is_against: bool) -> bool {
        signed(is_against, self.exposure[patch]) < -MORE * self.all[patch]
    }
}

/// Looks out from every patch.
///
/// A patch looks into the open in a direction in which no voxel (a cube, or more in a large empty box) between its own and
/// the end of the box is occupied. Each direction is one sweep over the bits of all voxels, 64 at a time. After the votes on
/// facets of Takayama, Jacobson, Kavan and Sorkine-Hornung, "A simple method for correcting facet orientations in polygon
/// meshes based on ray casting", 2014.
pub(super) fn sights(
    ball: &Ball,
    grid: &Grid,
    patches: &Patches,
    points: usize,
    stage: &Stage,
) -> Result<Sights, Error> {
    let voxels = Voxels::of(ball, grid, points)?;
    let mut seen: Vec<AtomicU32> = Vec::new();
    reserve(&mut seen, grid.cubes(), WHAT)?;
    seen.resize_with(grid.cubes(), AtomicU32::default);
    let failures = Gathering::new(WHAT);
    stage.part(0.0..0.7).run_in(1, DIRECTIONS, &|number| {
        let see = |cube: usize| {
            seen[cube].fetch_or(1 << number, Relaxed);
        };
        if let Err(error) = voxels.sweep(grid, direction(number), &see) {
            failures.append(vec![error]);
        }
    })?;
    if let Some(error) = failures.all()?.pop() {
        return Err(error);
    }
    let units: [Vec3; DIRECTIONS] = std::array::from_fn(|number| direction(number).as_vec3().normalize());
    let (exposures, sums) = (Filling::new(patches.all.len(), WHAT)?, Filling::new(patches.all.len(), WHAT)?);
    stage.part(0.7..1.0).run(grid.blocks.len(), &|block| {
        for (_, cube, _) in grid.cubes_in(block) {
            let seen = seen[cube].load(Relaxed);
            // In one direction only: through a gap between cubes that touch at an edge.
            let seen = if seen.count_ones() < 2 { 0 } else { seen };
            let range = patches.of_cube(cube);
            let own = &patches.all[range.clone()];
            for (number, patch) in range.zip(own) {
                let seen = seen & !hidden(patch, own);
                let along = |number: u32| (units[number as usize].dot(patch.normal) / HALF).abs();
                // SAFETY: a patch belongs to one cube, and a cube to one block.
                unsafe {
                    exposures.write(number, openness(seen).dot(patch.normal));
                    sums.write(number, set_bits(seen.into()).map(along).sum());
                }
            }
        }
    })?;
    // SAFETY: the blocks hold all cubes, and these all patches.
    Ok(unsafe { Sights { exposure: exposures.complete(), all: sums.complete() } })
}

/// A bit for each direction in which another patch of the cube hides from one what lies beyond: its plane lies there, and the
/// direction stays on the side of the patch on which the other one lies, so that round a convex edge neither hides anything before
/// the faces. Else the two sides of a thin wall would both see what is before each, and the deep side of a blade's edge what is
/// before the other.
pub(super) fn hidden(patch: &Patch, own: &[Patch]) -> u32 {
    let mut hidden = 0;
    for other in own {
        let line = other.centre - patch.centre;
        // None for the patch itself, which mostly is alone.
        let sides = [other, patch].map(|one| (one.normal, one.normal.dot(line)));
        if sides.iter().any(|&(_, side)| side == 0.0) {
            continue;
        }
        for (four, directions) in FOURS.iter().enumerate() {
            let [x, y, z] = directions.map(Vec4::from_array);
            let is_there =
                |(normal, side): (Vec3, f32)| (side * (normal.x * x + normal.y * y + normal.z * z)).cmpgt(Vec4::ZERO);
            hidden |= (is_there(sides[0]) & is_there(sides[1])).bitmask() << (4 * four);
        }
    }
    hidden
}

/// The directions four by four; none for the last two.
const FOURS: [[[f32; 4]; 3]; 7] = {
    let mut fours = [[[0.0; 4]; 3]; 7];
    let mut number = 0;
    while number < DIRECTIONS {
        let IVec3 { x, y, z } = direction(number);
        let four = &mut fours[number / 4];
        (four[0][number % 4], four[1][number % 4], four[2][number % 4]) = (x as f32, y as f32, z as f32);
        number += 1;
    }
    fours
};

/// That of a number; the opposite one has the number that stands as far from the end.
pub(super) const fn direction(number: usize) -> IVec3 {
    STEPS[if number < DIRECTIONS / 2 { number } else { number + 1 }]
}

/// The sum of the directions that are set. What is open to opposite directions alike sums up to nothing, to the bit: rounding
/// must not speak for a side.
fn openness(seen: u32) -> Vec3 {
    // Those to faces, edges and corners, of lengths 1, 2 and 3 squared.
    let mut sums = [IVec3::ZERO; 4];
    for number in set_bits(seen.into()) {
        let direction = direction(number as usize);
        sums[direction.length_squared() as usize] += direction;
    }
    let along = |squared: u8| sums[usize::from(squared)].as_vec3() / f32::from(squared).sqrt();
    (along(1) + along(2) + along(3)) / HALF
}

/// A bit for each voxel of the box round all occupied bricks, in rows along x.
struct Voxels {
    /// The first cube.
    first: IVec3,
    /// How often the edge of a cube is doubled.
    doublings: u32,
    size: IVec3,
    /// Words of a row.
    width: usize,
    words: Vec<u64>,
    /// The bricks by z, with that.
    bricks: Vec<(i32, u32)>,
}

impl Voxels {
    fn of(ball: &Ball, grid: &Grid, points: usize) -> Result<Self, Error> {
        // Two bytes a point, and no less than is done at once.
        let most = (16.0 * points as f64).max(4e6);
        let volume = |size: IVec3| f64::from((size.x + 63) & !63) * f64::from(size.y) * f64::from(size.z);
        let (mut first, mut size) = box_round(grid.bricks.places.iter().copied(), 0.0);
        if volume(size) > most {
            // Without what strays; that is not asked, and hides nothing.
            (first, size) = box_round(ball.bricks(grid).map(|brick| grid.bricks.places[brick]), STRAY);
        }
        let (cubes, mut doublings) = (size, 0);
        while volume(size) > most {
            doublings += 1;
            size = (cubes + ((1 << doublings) - 1)) >> doublings;
        }
        let width = (size.x as usize).div_ceil(64);
        let words = filled(0, width * size.y as usize * size.z as usize, WHAT)?;
        let mut bricks = Vec::new();
        reserve(&mut bricks, grid.bricks.len(), WHAT)?;
        bricks.extend(grid.bricks.places.iter().map(|place| place.z).zip(0..));
        bricks.sort_unstable();
        let mut voxels = Self { first, doublings, size, width, words, bricks };
        for (&place, &mask) in grid.bricks.places.iter().zip(&grid.masks) {
            for bit in set_bits(mask) {
                if let Some(voxel) = voxels.of_cube(place, bit) {
                    let (word, bit) = voxels.bit(voxel);
                    let start = voxel.z as usize * voxels.plane();
                    voxels.words[start + word] |= bit;
                }
            }
        }
        Ok(voxels)
    }

    /// Calls `see` with every cube in whose voxel nothing hides the air in a direction.
    ///
    /// Goes through the planes of voxels from the end that the direction points to, so that whatever is open lies behind what
    /// was found open and free: no more than three planes are in memory.
    fn sweep(&self, grid: &Grid, direction: IVec3, see: &dyn Fn(usize)) -> Result<(), Error> {
        let IVec3 { x: dx, y: dy, z: dz } = direction;
        let from_the_end = |count: i32, step: i32| (0..count).map(move |i| if step > 0 { count - 1 - i } else { i });
        // What is open in this plane, what of it is not occupied, and the latter in the plane beyond.
        let plane = || filled(u64::MAX, self.plane(), WHAT);
        let (mut open, mut free, mut beyond) = (plane()?, plane()?, plane()?);
        for z in from_the_end(self.size.z, dz) {
            let occupied = &self.words[z as usize * self.plane()..][..self.plane()];
            for y in from_the_end(self.size.y, dy) {
                let (row, behind) = (self.row(y), y + dy);
                let free_behind = if dz == 0 { &free } else { &beyond };
                if dy == 0 && dz == 0 {
                    open_along(&occupied[row.clone()], dx > 0, &mut open[row.clone()]);
                } else if behind < 0 || behind >= self.size.y {
                    open[row.clone()].fill(u64::MAX);
                } else {
                    shifted(&free_behind[self.row(behind)], dx, &mut open[row.clone()]);
                }
                for place in row {
                    free[place] = open[place] & !occupied[place];
                }
            }
            self.each_open(grid, z, &open, see);
            std::mem::swap(&mut free, &mut beyond);
        }
        Ok(())
    }

    /// Calls `see` with the number of every cube in a plane of voxels whose own is open.
    fn each_open(&self, grid: &Grid, z: i32, open: &[u64], see: &dyn Fn(usize)) {
        let plane = |brick: i32, cube: i32| (BRICK * brick + cube - self.first.z) >> self.doublings;
        let start = self.bricks.partition_point(|&(brick, _)| plane(brick, BRICK - 1) < z);
        let end = self.bricks.partition_point(|&(brick, _)| plane(brick, 0) <= z);
        for &(layer, brick) in &self.bricks[start..end] {
            let brick = brick as usize;
            let own =
                (0..BRICK).filter(|&cube| plane(layer, cube) == z).fold(0, |own, cube| own | 0xFFFF << (16 * cube));
            for bit in set_bits(self.open_of(grid.bricks.places[brick], grid.masks[brick] & own, open)) {
                see(grid.cube(brick, bit) as usize);
            }
        }
    }

    /// Of some cubes of a brick, as bits, in one plane of voxels, those whose own is open.
    fn open_of(&self, brick: IVec3, cubes: u64, open: &[u64]) -> u64 {
        if self.doublings > 0 {
            let is_open = |voxel: IVec3| {
                let (word, bit) = self.bit(voxel);
                open[word] & bit != 0
            };
            let cubes = set_bits(cubes).filter(|&bit| self.of_cube(brick, bit).is_some_and(is_open));
            return cubes.fold(0, |open, bit| open | 1 << bit);
        }
        // Voxels are cubes then, and their rows begin with a brick: the four of one row of the brick stand in one word.
        let Some(first) = self.of_cube(brick, 0) else { return 0 };
        let rows = (first.y..first.y + BRICK).map(|y| self.row(y).start + first.x as usize / 64);
        let layer = rows.rev().fold(0, |layer, word| layer << BRICK | open[word] >> (first.x % 64) & 0xF);
        cubes & (layer * 0x0001_0001_0001_0001)
    }

    /// The voxel of a cube, unless that strays.
    #[inline(always)]
    fn of_cube(&self, brick: IVec3, bit: u32) -> Option<IVec3> {
        let voxel = (BRICK * brick + cube_place(bit) - self.first) >> self.doublings;
        // Below the first are large numbers.
        voxel.as_uvec3().cmplt(self.size.as_uvec3()).all().then_some(voxel)
    }

    /// Words of a plane.
    fn plane(&self) -> usize {
        self.width * self.size.y as usize
    }

    /// The words of a row, in its plane.
    fn row(&self, y: i32) -> Range<usize> {
        y as usize * self.width..(y as usize + 1) * self.width
    }

    /// The word of a voxel in its plane, and its bit there.
    #[inline(always)]
    fn bit(&self, voxel: IVec3) -> (usize, u64) {
        (self.row(voxel.y).start + voxel.x as usize / 64, 1 << (voxel.x % 64))
    }
}

/// What of a row is open along it.
fn open_along(occupied: &[u64], is_upwards: bool, open: &mut [u64]) {
    let mut is_open = true;
    for i in 0..occupied.len() {
        let word = if is_upwards { occupied.len() - 1 - i } else { i };
        let bits = occupied[word];
        open[word] = match (is_open, bits, is_upwards) {
            (false, ..) => 0,
            (true, 0, _) => u64::MAX,
            (true, _, true) => u64::MAX << (63 - bits.leading_zeros()),
            (true, _, false) => u64::MAX >> (63 - bits.trailing_zeros()),
        };
        is_open &= bits == 0;
    }
}

/// For each voxel of a row the bit `dx` further in another; beyond its ends is air.
fn shifted(row: &[u64], dx: i32, to: &mut [u64]) {
    let word = |i: Option<usize>| i.and_then(|i| row.get(i)).copied().unwrap_or(u64::MAX);
    for (i, to) in to.iter_mut().enumerate() {
        *to = match dx {
            0 => row[i],
            1 => row[i] >> 1 | word(Some(i + 1)) << 63,
            _ => row[i] << 1 | word(i.checked_sub(1)) >> 63,
        };
    }
}

/// The share of bricks at each end of an axis that may stray.
const STRAY: f64 = 0.005;

/// The first cube, and the size in cubes, of a box round all bricks but a share at each end of each axis.
fn box_round(bricks: impl Iterator<Item = IVec3> + Clone, share: f64) -> (IVec3, IVec3) {
    let Some(last) = bricks.clone().count().checked_sub(1) else { return (IVec3::ZERO, IVec3::ZERO) };
    let [low, high] = [share, 1.0 - share].map(|quantile| {
        let rank = (last as f64 * quantile).round() as usize;
        // No place is negative.
        IVec3::from_array([0, 1, 2].map(|axis| ranked(bricks.clone().map(|brick| brick[axis] as u32), rank) as i32))
    });
    (BRICK * low, BRICK * (high - low + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_sees_the_open_from_both_sides_says_little() {
        let patches = Patches { all: vec![patch(Vec3::ZERO, 100); 3], first: vec![0, 3] };
        let sights = Sights { exposure: vec![0.9, -0.2, 0.0], all: vec![0.9, 2.0, 0.0] };
        let evidence: Vec<f32> = sights.evidence(&patches).collect();
        assert_eq!(evidence[0], AIR * 0.9);
        assert!((-0.03 * AIR..0.0).contains(&evidence[1]), "{evidence:?}");
        assert_eq!(evidence[2], 0.0);
    }

    /// Directions along the surface cancel out but for rounding.
    #[test]
    fn what_is_seen_along_a_surface_says_nothing() {
        let patches = Patches { all: vec![patch(Vec3::ZERO, 100)], first: vec![0, 1] };
        let sights = Sights { exposure: vec![1e-8], all: vec![0.0] };
        assert!(sights.evidence(&patches).all(|evidence| evidence.abs() < 1e-7));
    }

    #[test]
    fn one_side_of_a_wall_does_not_see_what_lies_behind_the_other() {
        let wall = [patch(0.3 * Vec3::Z, 9), patch(0.1 * Vec3::Z, 9)];
        for (number, upwards) in [(0, true), (1, false)] {
            let hidden = hidden(&wall[number], &wall);
            for (i, direction) in (0..DIRECTIONS).map(direction).enumerate() {
                let is_before = if upwards { direction.z >= 0 } else { direction.z <= 0 };
                assert_eq!(hidden >> i & 1 == 0, is_before, "{number} {direction}");
            }
        }
    }

    #[test]
    fn the_faces_of_a_convex_edge_hide_nothing_before_them() {
        let top = patch(Vec3::new(-0.2, 0.0, 0.0), 9);
        let side = Patch { normal: Vec3::X, ..patch(Vec3::new(0.0, 0.0, -0.2), 9) };
        for (i, direction) in (0..DIRECTIONS).map(direction).enumerate() {
            // What the other hides lies beyond it and below the own face.
            for (own, other, depth, ahead) in
                [(&top, &side, direction.z, direction.x), (&side, &top, direction.x, direction.z)]
            {
                let is_hidden = hidden(own, std::slice::from_ref(other)) >> i & 1 == 1;
                assert_eq!(is_hidden, depth < 0 && ahead > 0, "{direction}");
            }
        }
    }

    fn patch(centre: Vec3, points: u32) -> Patch {
        Patch { centre, normal: Vec3::Z, points, flatness: 1.0, has_rival: false, bend: 0.0 }
    }

    #[test]
    fn what_is_open_to_both_sides_is_open_to_none() {
        let opposite = |number: usize| DIRECTIONS - 1 - number;
        for number in 0..DIRECTIONS {
            assert_eq!(direction(number), -direction(opposite(number)));
        }
        let up: u32 = (0..DIRECTIONS).filter(|&number| direction(number).z > 0).map(|number| 1 << number).sum();
        let down: u32 = (0..DIRECTIONS).filter(|&number| direction(number).z < 0).map(|number| 1 << number).sum();
        assert_eq!(openness(up | down), Vec3::ZERO);
        assert!((openness(up) - 0.7 * Vec3::Z).length() < 0.1, "{}", openness(up));
    }
}
