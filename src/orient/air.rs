//! Which side of a patch is open to the air.

use super::patches::Patches;
use crate::bricks::set_bits;
use crate::error::Error;
use crate::grid::Grid;
use crate::points::reserve;
use crate::progress::Stage;
use glam::{IVec3, Vec3};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Directions in which to look for the open air: to the faces, edges and corners of a cube.
const DIRECTIONS: usize = 26;

/// A surface that is open to one half of space sees it with some 9 of the directions.
const HALF: f32 = 9.0;

/// For each patch, what speaks for its normal to point outwards: near 1 where it looks into the open and its back does
/// not, -1 where it is the other way round, 0 where neither does, or both.
///
/// A patch looks into the open in a direction in which no voxel (a cube, or more in a large empty box) between its own and
/// the end of the box is occupied. Each direction is one sweep over the bits of all voxels, 64 at a time. After the votes on
/// facets of Takayama, Jacobson, Kavan and Sorkine-Hornung, "A simple method for correcting facet orientations in polygon
/// meshes based on ray casting", 2014.
pub(super) fn exposure(grid: &Grid, patches: &Patches, points: usize, stage: &Stage) -> Result<Vec<f32>, Error> {
    let voxels = Voxels::of(grid, points)?;
    let mut seen: Vec<AtomicU32> = Vec::new();
    reserve(&mut seen, grid.cubes(), "the open sides")?;
    seen.resize_with(grid.cubes(), AtomicU32::default);
    stage.run(DIRECTIONS, &|number| {
        let open = voxels.open(direction(number));
        let mut seen = seen.iter();
        for (&place, &mask) in grid.bricks.places.iter().zip(&grid.masks) {
            for (bit, seen) in set_bits(mask).zip(&mut seen) {
                if voxels.of_cube(place, bit).is_some_and(|voxel| open.holds(voxel)) {
                    seen.fetch_or(1 << number, Relaxed);
                }
            }
        }
    })?;
    let along: [Vec3; DIRECTIONS] = std::array::from_fn(|number| direction(number).as_vec3().normalize() / HALF);
    let mut exposure = Vec::new();
    reserve(&mut exposure, patches.all.len(), "the open sides")?;
    for (seen, ends) in seen.into_iter().zip(patches.first.windows(2)) {
        let open: Vec3 = set_bits(seen.into_inner().into()).map(|number| along[number as usize]).sum();
        let own = &patches.all[ends[0] as usize..ends[1] as usize];
        exposure.extend(own.iter().map(|patch| open.dot(patch.normal)));
    }
    Ok(exposure)
}

fn direction(number: usize) -> IVec3 {
    // Not the cube in the middle.
    let i = (number + usize::from(number >= DIRECTIONS / 2)) as i32;
    IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)
}

/// A bit for each voxel of the box round all occupied bricks, in rows along x.
struct Voxels {
    first: IVec3,
    /// How often the edge of a cube is doubled.
    doublings: u32,
    bits: Bits,
}

#[derive(Clone)]
struct Bits {
    size: IVec3,
    /// Words of a row.
    width: usize,
    words: Vec<u64>,
}

impl Voxels {
    fn of(grid: &Grid, points: usize) -> Result<Self, Error> {
        // Two bits a point, and no less than is done at once.
        let most = (16.0 * points as f64).max(4e6);
        let volume = |size: IVec3| f64::from((size.x + 63) & !63) * f64::from(size.y) * f64::from(size.z);
        let (mut first, mut size) = box_round(&grid.bricks.places, 0.0);
        if volume(size) > most {
            // Without what strays; that is not asked, and hides nothing.
            (first, size) = box_round(&grid.bricks.places, STRAY);
        }
        let (cubes, mut doublings) = (size, 0);
        while volume(size) > most {
            doublings += 1;
            size = (cubes + ((1 << doublings) - 1)) >> doublings;
        }
        let width = (size.x as usize).div_ceil(64);
        let mut words = Vec::new();
        let length = width * size.y as usize * size.z as usize;
        reserve(&mut words, length, "the voxels")?;
        words.resize(length, 0);
        let mut voxels = Self { first, doublings, bits: Bits { size, width, words } };
        for (&place, &mask) in grid.bricks.places.iter().zip(&grid.masks) {
            for bit in set_bits(mask) {
                if let Some(voxel) = voxels.of_cube(place, bit) {
                    let (word, bit) = voxels.bits.place(voxel);
                    voxels.bits.words[word] |= bit;
                }
            }
        }
        Ok(voxels)
    }

    /// The voxel of a cube, unless that strays.
    #[inline(always)]
    fn of_cube(&self, brick: IVec3, bit: u32) -> Option<IVec3> {
        let bit = bit as i32;
        let cube = 4 * brick + IVec3::new(bit & 3, bit >> 2 & 3, bit >> 4) - self.first;
        let voxel = cube >> self.doublings;
        // Below the first are large numbers.
        voxel.as_uvec3().cmplt(self.bits.size.as_uvec3()).all().then_some(voxel)
    }

    /// The voxels beyond which none is occupied along a direction.
    fn open(&self, direction: IVec3) -> Bits {
        let occupied = &self.bits;
        let mut open = Bits { words: vec![u64::MAX; occupied.words.len()], ..*occupied };
        let IVec3 { x: dx, y: dy, z: dz } = direction;
        let IVec3 { y: rows, z: planes, .. } = occupied.size;
        // From the end that the direction points to.
        let at = |i: i32, count: i32, step: i32| if step > 0 { count - 1 - i } else { i };
        let mut free = vec![0; occupied.width];
        for i in 0..planes {
            let z = at(i, planes, dz);
            for j in 0..rows {
                let y = at(j, rows, dy);
                let row = occupied.row(y, z);
                if dy == 0 && dz == 0 {
                    let mut is_open = true;
                    for word in 0..occupied.width {
                        let word = row.start + if dx > 0 { occupied.width - 1 - word } else { word };
                        let bits = occupied.words[word];
                        open.words[word] = match (is_open, bits, dx > 0) {
                            (false, ..) => 0,
                            (true, 0, _) => u64::MAX,
                            (true, _, true) => u64::MAX << (63 - bits.leading_zeros()),
                            (true, _, false) => u64::MAX >> (63 - bits.trailing_zeros()),
                        };
                        is_open &= bits == 0;
                    }
                    continue;
                }
                let (y, z) = (y + dy, z + dz);
                if y < 0 || y >= rows || z < 0 || z >= planes {
                    continue;
                }
                let beyond = occupied.row(y, z);
                for (free, word) in free.iter_mut().zip(beyond) {
                    *free = open.words[word] & !occupied.words[word];
                }
                for word in 0..occupied.width {
                    let near = |free: Option<&u64>| free.copied().unwrap_or(u64::MAX);
                    open.words[row.start + word] = match dx {
                        0 => free[word],
                        1 => free[word] >> 1 | near(free.get(word + 1)) << 63,
                        _ => free[word] << 1 | near(word.checked_sub(1).and_then(|word| free.get(word))) >> 63,
                    };
                }
            }
        }
        open
    }
}

/// The first cube, and the size in cubes, of a box round all bricks but a share at each end of each axis.
fn box_round(bricks: &[IVec3], share: f64) -> (IVec3, IVec3) {
    if bricks.is_empty() {
        return (IVec3::ZERO, IVec3::ZERO);
    }
    let [low, high] = [share, 1.0 - share].map(|quantile| {
        let rank = ((bricks.len() - 1) as f64 * quantile).round() as usize;
        let along = |axis: usize| {
            let mut places: Vec<i32> = bricks.iter().map(|brick| brick[axis]).collect();
            *places.select_nth_unstable(rank).1
        };
        IVec3::new(along(0), along(1), along(2))
    });
    (4 * low, 4 * (high - low + 1))
}

/// The share of bricks at each end of an axis that may stray.
const STRAY: f64 = 0.005;

impl Bits {
    fn row(&self, y: i32, z: i32) -> std::ops::Range<usize> {
        let start = (z as usize * self.size.y as usize + y as usize) * self.width;
        start..start + self.width
    }

    /// The word of a voxel, and its bit there.
    #[inline(always)]
    fn place(&self, voxel: IVec3) -> (usize, u64) {
        let row = self.row(voxel.y, voxel.z);
        (row.start + voxel.x as usize / 64, 1 << (voxel.x % 64))
    }

    #[inline(always)]
    fn holds(&self, voxel: IVec3) -> bool {
        let (word, bit) = self.place(voxel);
        self.words[word] & bit != 0
    }
}
