//! The cubes in and two deep round a brick.

use crate::bricks::set_bits;
use crate::grid::Grid;
use crate::surroundings::{Side, each_beside, sides};
use bytemuck::{Pod, Zeroable};
use glam::{UVec3, Vec3, Vec4};

const SIDES: [Side; 27] = sides(2);

/// 8x8x8 places: `x + 8 y + 64 z`, the brick's first cube at (2, 2, 2).
pub(super) struct Around {
    /// A bit for each place that is occupied, a word for each z.
    occupied: [u64; 8],
    cubes: [u32; 512],
    brick: usize,
    list: [Near; 125],
}

/// A cube near another one. Put together as four lanes of floats, which are stored as one.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(16))]
pub(super) struct Near {
    /// What lies between the two, in edges.
    pub step: Vec3,
    /// Its number.
    pub cube: u32,
}

/// The bits of a word that are three rows of three places, and five of five; the first place is bit 0.
const CLOSE_ROWS: u64 = 0x0007_0707;
const LAYER_ROWS: u64 = 0x001F_1F1F_1F1F;

/// Three layers of three rows lie in one word, so many bits apart.
const CLOSE_BITS: u32 = 20;

/// For each bit of the 27 places round one, and of the lowest layer of the 125, the step from that one to the place, in three of
/// four lanes; in the last, as bits, how many places it stands after the first.
const CLOSE: [Vec4; 64] = steps(1.0, CLOSE_BITS);
const LAYER: [Vec4; 64] = steps(2.0, 64);

const fn steps(reach: f32, bits: u32) -> [Vec4; 64] {
    let mut steps = [Vec4::ZERO; 64];
    let mut bit = 0;
    while bit < 64 {
        let (x, y, z) = (bit % bits % 8, bit % bits / 8, bit / bits);
        let place = f32::from_bits(x + 8 * y + 64 * z);
        steps[bit as usize] = Vec4::new(x as f32 - reach, y as f32 - reach, z as f32 - reach, place);
        bit += 1;
    }
    steps
}

impl Around {
    pub fn new() -> Self {
        let list = [Near { step: Vec3::ZERO, cube: 0 }; 125];
        Self { occupied: [0; 8], cubes: [0; 512], brick: usize::MAX, list }
    }

    /// Looks up the 27 bricks around and in place of brick `brick`.
    #[inline(never)]
    fn look(&mut self, grid: &Grid, brick: usize) {
        self.brick = brick;
        self.occupied = [0; 8];
        each_beside(grid, brick, &SIDES, |bit, shift, cube| {
            let place = Self::place(bit).wrapping_add_signed(shift);
            self.occupied[place / 64] |= 1 << (place % 64);
            self.cubes[place] = cube;
        });
    }

    /// The occupied cubes at most `reach` (1 or 2) away from the cube with bit `bit` of a brick, in the order of their
    /// places.
    pub fn near(&mut self, grid: &Grid, brick: usize, bit: u32, reach: u32) -> &[Near] {
        if self.brick != brick {
            self.look(grid, brick);
        }
        let corner = UVec3::new(bit & 3, bit >> 2 & 3, bit >> 4) + 2 - reach;
        let shift = corner.x + 8 * corner.y;
        let word = |z: u32| self.occupied[(corner.z + z) as usize] >> shift;
        let mut list = Filled { cubes: &self.cubes, list: &mut self.list, count: 0 };
        if reach == 1 {
            // At once: nothing foretells where the bits of a word end.
            let layer = |z: u32| (word(z) & CLOSE_ROWS) << (CLOSE_BITS * z);
            list.add(layer(0) | layer(1) | layer(2), &CLOSE, shift + 64 * corner.z, Vec4::ZERO);
        } else {
            for z in 0..5 {
                let up = Vec4::new(0.0, 0.0, z as f32, 0.0);
                list.add(word(z) & LAYER_ROWS, &LAYER, shift + 64 * (corner.z + z), up);
            }
        }
        let count = list.count;
        &self.list[..count]
    }

    /// The least value of the occupied cubes in and at most two deep round brick `brick`.
    pub fn least(&mut self, grid: &Grid, brick: usize, value: impl Fn(u32) -> f32) -> f32 {
        if self.brick != brick {
            self.look(grid, brick);
        }
        let mut least = f32::INFINITY;
        for (word, cubes) in self.occupied.iter().zip(self.cubes.chunks(64)) {
            set_bits(*word).for_each(|bit| least = least.min(value(cubes[bit as usize])));
        }
        least
    }

    fn place(bit: u32) -> usize {
        (146 + (bit & 3) + 8 * (bit >> 2 & 3) + 64 * (bit >> 4)) as usize
    }
}

/// The first part of a list.
struct Filled<'a> {
    cubes: &'a [u32; 512],
    list: &'a mut [Near; 125],
    count: usize,
}

impl Filled<'_> {
    /// Appends the cubes of some bits, `up` higher than `steps` say; the first place is that of bit 0.
    #[inline(always)]
    fn add(&mut self, bits: u64, steps: &[Vec4; 64], first: u32, up: Vec4) {
        for bit in set_bits(bits) {
            let step = steps[bit as usize];
            // It never is more, but so the compiler knows.
            let cube = self.cubes[(first + step.w.to_bits()) as usize % 512];
            self.list[self.count] = bytemuck::cast((step + up).with_w(f32::from_bits(cube)));
            self.count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::{CUBES, Lattice, cube_centre};
    use crate::points::{Bounds, Points};
    use crate::progress::Progress;
    use crate::source::Source;
    use glam::{DVec3, IVec3};

    #[test]
    fn near_cubes_are_those_of_a_search() {
        // Points on a bent sheet, so that some bricks are empty.
        let positions: Vec<f32> = (0..3000)
            .flat_map(|i| [(i * 7919 % 3000) as f32, (i * 6101 % 3000) as f32, (i * i % 700) as f32])
            .collect();
        let points = Points::from_f32(&positions).unwrap();
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(3000.0, 3000.0, 700.0), finite: 3000 };
        let lattice = Lattice::new(&bounds, &|| DVec3::ZERO, 120.0, CUBES);
        let progress = Progress::silent();
        let (grid, _) =
            Grid::sort(&Source::new(&points, lattice), &progress.stage("test", 0.0..1.0), |_, _| ()).unwrap();
        let all: Vec<(usize, usize, u32, IVec3)> = (0..grid.blocks.len())
            .flat_map(|block| grid.cubes_in(block))
            .map(|(brick, cube, bit)| (brick, cube, bit, 4 * grid.bricks.places[brick] + cube_centre(bit).as_ivec3()))
            .collect();
        let mut around = Around::new();
        for &(brick, _, bit, place) in &all {
            for reach in [1, 2] {
                let near = around.near(&grid, brick, bit, reach);
                let mut expected: Vec<(IVec3, usize)> = all
                    .iter()
                    .map(|&(_, cube, _, other)| (other - place, cube))
                    .filter(|(step, _)| step.abs().max_element() <= reach as i32)
                    .collect();
                expected.sort_by_key(|(step, _)| (step.z, step.y, step.x));
                let found: Vec<(IVec3, usize)> =
                    near.iter().map(|near| (near.step.as_ivec3(), near.cube as usize)).collect();
                assert_eq!(found, expected);
            }
        }
    }
}
