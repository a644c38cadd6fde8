//! The cubes in and two deep round a brick.

use crate::bricks::set_bits;
use crate::grid::Grid;
use crate::surroundings::{Side, sides};
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

/// What lies between the first of 8x8 places and each of them, in three of four lanes.
const STEPS: [Vec4; 64] = {
    let mut steps = [Vec4::ZERO; 64];
    let mut i = 0;
    while i < 64 {
        steps[i] = Vec4::new((i % 8) as f32, (i / 8) as f32, 0.0, 0.0);
        i += 1;
    }
    steps
};

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
        let own = grid.masks[brick];
        for (Side { step, facing, shift }, opposite) in SIDES.iter().zip(SIDES.iter().rev()) {
            // Only what lies near cubes of the brick is asked for. The last steps are the opposites of the first.
            if own & opposite.facing == 0 {
                continue;
            }
            let Some(number) = grid.bricks.number(grid.bricks.places[brick] + step) else { continue };
            for bit in set_bits(grid.masks[number as usize] & facing) {
                let place = Self::place(bit).wrapping_add_signed(*shift);
                self.occupied[place / 64] |= 1 << (place % 64);
                self.cubes[place] = grid.cube(number as usize, bit);
            }
        }
    }

    /// The occupied cubes at most `reach` (1 or 2) away from the cube with bit `bit` of a brick, in the order of their
    /// places.
    pub fn near(&mut self, grid: &Grid, brick: usize, bit: u32, reach: u32) -> &[Near] {
        if self.brick != brick {
            self.look(grid, brick);
        }
        let corner = UVec3::new(bit & 3, bit >> 2 & 3, bit >> 4) + 2 - reach;
        let shift = corner.x + 8 * corner.y;
        let rows: u64 = if reach == 1 { 0x0007_0707 } else { 0x001F_1F1F_1F1F };
        let mut count = 0;
        for z in 0..=2 * reach {
            let first = 64 * (corner.z + z);
            let row = Vec4::new(0.0, 0.0, z as f32, 0.0) - reach as f32;
            for near in set_bits(self.occupied[first as usize / 64] >> shift & rows) {
                // It never is more, but so the compiler knows.
                let cube = self.cubes[(first + shift + near) as usize % 512];
                self.list[count] = bytemuck::cast((STEPS[near as usize] + row).with_w(f32::from_bits(cube)));
                count += 1;
            }
        }
        &self.list[..count]
    }

    fn place(bit: u32) -> usize {
        (146 + (bit & 3) + 8 * (bit >> 2 & 3) + 64 * (bit >> 4)) as usize
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
