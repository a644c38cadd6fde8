//! The cubes in and round a brick: which are occupied, and which lie round a cube.

use crate::bricks::set_bits;
use crate::grid::Grid;
use glam::{IVec3, UVec3, Vec3, Vec4};

/// The cubes in and one deep round a brick: 6x6x6 places, x fastest, the brick's first cube at (1, 1, 1).
pub(crate) struct Surroundings {
    /// Those that are occupied, of other bricks only where cubes of the own lie beside.
    pub occupied: Places,
    /// Their numbers.
    cubes: [u32; Places::COUNT],
}

impl Surroundings {
    pub fn new() -> Self {
        Self { occupied: Places::NONE, cubes: [0; Places::COUNT] }
    }

    /// Looks up the cubes of brick `brick` and those beside them, in the 27 bricks around and in place of it.
    pub fn look(&mut self, grid: &Grid, brick: usize) {
        self.occupied = Places::NONE;
        each_beside(grid, brick, &SIDES, |bit, shift, cube| {
            let place = Places::of_cube(bit).wrapping_add_signed(shift);
            self.occupied.insert(place);
            self.cubes[place] = cube;
        });
    }

    /// The number of the cube at an occupied place.
    #[inline]
    pub fn cube(&self, place: usize) -> usize {
        self.cubes[place] as usize
    }
}

/// A set of the 6x6x6 places in and round a brick. A place is `x + 6 y + 36 z`, a word holds those of one z.
#[derive(Clone, Copy)]
pub(crate) struct Places([u64; 6]);

impl Places {
    pub const COUNT: usize = 6 * 6 * 6;
    pub const NONE: Self = Self([0; 6]);
    /// What lies between two places next to each other along each axis, and between two bits of [`Places::near`].
    pub const STRIDES: [isize; 3] = [1, 6, 36];
    pub const NEAR_STRIDES: [isize; 3] = [1, 6, 16];
    /// The place of the brick's first cube, and the bit of the cube itself in [`Places::near`]: 1 along each axis.
    const FIRST: usize = 1 + 6 + 36;
    pub const NEAR_CENTRE: u32 = 1 + 6 + 16;

    #[inline]
    pub fn insert(&mut self, place: usize) {
        self.0[place / 36] |= 1 << (place % 36);
    }

    /// All of them.
    pub fn all(&self) -> impl Iterator<Item = usize> {
        (0..).zip(self.0).flat_map(|(z, word)| set_bits(word).map(move |bit| 36 * z + bit as usize))
    }

    /// Those that pass a test.
    #[inline(always)]
    pub fn filter(&self, mut test: impl FnMut(usize) -> bool) -> Self {
        let mut passed = Self::NONE;
        for (z, (word, passed)) in self.0.iter().zip(&mut passed.0).enumerate() {
            for bit in set_bits(*word) {
                *passed |= u64::from(test(36 * z + bit as usize)) << bit;
            }
        }
        passed
    }

    /// Those among the 27 round the cube with bit `bit` of the brick, as bits `x + 6 y + 16 z`, each 0 to 2.
    #[inline(always)]
    pub fn near(&self, bit: u32) -> u64 {
        const ROWS: u64 = 0b111_000_111_000_111;
        let (corner, z) = ((bit & 3) + 6 * (bit >> 2 & 3), bit as usize >> 4);
        let near = |dz: usize| (self.0[z + dz] >> corner & ROWS) << (16 * dz);
        near(0) | near(1) | near(2)
    }

    /// The place behind a bit of [`Places::near`].
    #[inline(always)]
    pub fn of_near(bit: u32, near: u32) -> usize {
        Self::of_cube(bit) + (near + 20 * (near / 16)) as usize - Self::FIRST
    }

    /// The place of the cube with bit `bit` of the brick.
    #[inline]
    pub fn of_cube(bit: u32) -> usize {
        Self::FIRST + ((bit & 3) + 6 * (bit >> 2 & 3) + 36 * (bit >> 4)) as usize
    }

    /// The centre of the cube at a place, in the brick, in edges.
    #[inline]
    pub fn centre(place: usize) -> Vec3 {
        let place = place as u32;
        UVec3::new(place % 6, place / 6 % 6, place / 36).as_vec3() - 0.5
    }
}

/// How many cubes away that behind each bit of [`Places::near`] lies, in three of four lanes.
pub(crate) const NEAR: [Vec4; 64] = {
    let mut steps = [Vec4::ZERO; 64];
    let mut i = 0;
    while i < 27 {
        let IVec3 { x, y, z } = STEPS[i];
        steps[near_bit(STEPS[i]) as usize] = Vec4::new(x as f32, y as f32, z as f32, 0.0);
        i += 1;
    }
    steps
};

/// The bits of [`Places::near`] in the middle along each axis.
pub(crate) const MIDDLE: [u64; 3] = {
    let mut middle = [0; 3];
    let mut i = 0;
    while i < 27 {
        let IVec3 { x, y, z } = STEPS[i];
        let bit = 1 << near_bit(STEPS[i]);
        middle[0] |= if x == 0 { bit } else { 0 };
        middle[1] |= if y == 0 { bit } else { 0 };
        middle[2] |= if z == 0 { bit } else { 0 };
        i += 1;
    }
    middle
};

/// The bit of [`Places::near`] for a step from the cube itself.
const fn near_bit(step: IVec3) -> u32 {
    Places::NEAR_CENTRE.wrapping_add_signed(step.x + 6 * step.y + 16 * step.z)
}

/// The 27 steps from a cube to itself and its neighbours, x fastest.
pub(crate) const STEPS: [IVec3; 27] = {
    let mut steps = [IVec3::ZERO; 27];
    let mut i = 0;
    while i < 27 {
        let n = i as i32;
        steps[i] = IVec3::new(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        i += 1;
    }
    steps
};

/// A brick next to another, or that itself.
pub(crate) struct Side {
    /// How many bricks away.
    step: IVec3,
    /// Its cubes that are near the other brick.
    facing: u64,
    /// From the place of a cube of the other brick to that of the same cube of this one.
    shift: isize,
}

const SIDES: [Side; 27] = sides(1);

/// Calls `each` with every cube in a brick and, of those round it, beside cubes of the brick: with its bit in its own brick,
/// what lies between its place and that of the same cube of `brick`, and its number. `sides` are those of some depth.
#[inline(always)]
pub(crate) fn each_beside(grid: &Grid, brick: usize, sides: &[Side; 27], mut each: impl FnMut(u32, isize, u32)) {
    let (place, own) = (grid.bricks.places[brick], grid.masks[brick]);
    for (Side { step, facing, shift }, opposite) in sides.iter().zip(sides.iter().rev()) {
        // Only what lies beside cubes of the brick is asked for. The last steps are the opposites of the first.
        if own & opposite.facing == 0 {
            continue;
        }
        let Some(number) = grid.bricks.number(place + step) else { continue };
        for bit in set_bits(grid.masks[number as usize] & facing) {
            each(bit, *shift, grid.cube(number as usize, bit));
        }
    }
}

/// A brick and those round it, with their cubes at most `depth` away from it; places are numbered along x, y, z in a cube
/// of `4 + 2 depth` of them.
pub(crate) const fn sides(depth: i32) -> [Side; 27] {
    /// The cubes that are, along an axis, in the last `depth` layers for a step of -1, in the first for 1, in any for 0.
    const fn is_facing(place: i32, step: i32, depth: i32) -> bool {
        step == 0 || (step < 0 && place >= 4 - depth) || (step > 0 && place < depth)
    }
    let width = 4 + 2 * depth;
    let mut sides = [const { Side { step: IVec3::ZERO, facing: 0, shift: 0 } }; 27];
    let mut i = 0;
    while i < 27 {
        let step = STEPS[i];
        let (mut facing, mut bit) = (0, 0);
        while bit < 64 {
            let is_facing = is_facing(bit & 3, step.x, depth)
                && is_facing(bit >> 2 & 3, step.y, depth)
                && is_facing(bit >> 4, step.z, depth);
            facing |= (is_facing as u64) << bit;
            bit += 1;
        }
        sides[i] = Side { step, facing, shift: 4 * (step.x + width * (step.y + width * step.z)) as isize };
        i += 1;
    }
    sides
}
