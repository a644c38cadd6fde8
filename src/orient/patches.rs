//! The points of a cube, parted into those that lie on one piece of surface.

use crate::error::Error;
use crate::grid::{Grid, Placed};
use crate::lattice::cube_centre;
use crate::parallel::{Filling, Gathering};
use crate::points::reserve;
use crate::progress::Stage;
use glam::Vec3;
use std::mem::MaybeUninit;

/// A few points of one cube with nearly the same normal and plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    /// Their mean, against the cube's centre, in edges.
    pub centre: Vec3,
    /// Their mean normal, a unit vector; its sign is that of the first of them.
    pub normal: Vec3,
    pub points: u32,
}

/// The patches of all cubes.
pub(super) struct Patches {
    /// In the order of the cubes.
    pub all: Vec<Patch>,
    /// For each cube its first patch; one more at the end.
    pub first: Vec<u32>,
    /// For each point, as the grid sorts them, the number of its patch among those of its cube; [`NONE`] without a normal.
    pub of_point: Vec<u8>,
}

/// The patch of a point without a normal.
pub(super) const NONE: u8 = u8::MAX;

/// Patches of a cube at the most: more are a tangle, and its points join whichever is nearest.
const MOST: usize = 16;

/// The normals of a patch lie within 45 degrees of their mean: its cosine, squared.
const COSINE_SQUARED: f32 = 0.5;

/// How far from the plane of a patch a point may lie to join it, in edges. Thin walls have both sides in one cube.
const THICKNESS: f32 = 0.2;

impl Patches {
    /// One pass over the points.
    pub fn of(grid: &Grid, normals: &[Vec3], stage: &Stage) -> Result<Self, Error> {
        let of_point = Filling::new(grid.placed.len(), "the patches")?;
        let counts = Filling::<u32>::new(grid.cubes(), "the patches")?;
        let found = Gathering::new("the patches");
        stage.run(grid.blocks.len(), &|block| {
            let (mut patches, mut cloud) = (Vec::new(), Vec::new());
            for brick in grid.blocks[block].clone() {
                let mut start = grid.first_point[brick] as usize;
                for (cube, (points, bit)) in (grid.first_cube[brick] as usize..).zip(grid.cubes_of(brick)) {
                    let before = patches.len();
                    // SAFETY: a cube belongs to one brick, and a brick to one block.
                    let of_point = unsafe { of_point.slice(start..start + points.len()) };
                    split(points, cube_centre(bit), normals, &mut cloud, &mut patches, of_point);
                    start += points.len();
                    // SAFETY: as above.
                    unsafe { counts.write(cube, (patches.len() - before) as u32) };
                }
            }
            found.append(vec![(block, patches)]);
        })?;
        let mut found = found.all()?;
        found.sort_unstable_by_key(|&(block, _)| block);
        let mut all = Vec::new();
        reserve(&mut all, found.iter().map(|(_, patches)| patches.len()).sum(), "the patches")?;
        for (_, mut patches) in found {
            all.append(&mut patches);
        }
        // SAFETY: the blocks hold all bricks, these all cubes, and these all points.
        let (counts, of_point) = unsafe { (counts.complete(), of_point.complete()) };
        let mut first = Vec::new();
        reserve(&mut first, counts.len() + 1, "the patches")?;
        let mut total = 0;
        first.push(0);
        for count in counts {
            total += count;
            first.push(total);
        }
        Ok(Self { all, first, of_point })
    }
}

/// A point of a cube: its place against the cube's centre, its normal, and its number among the points of the cube.
type Member = (Vec3, Vec3, u32);

/// Parts the points of one cube.
fn split(
    points: &[Placed],
    centre: Vec3,
    normals: &[Vec3],
    members: &mut Vec<Member>,
    patches: &mut Vec<Patch>,
    of_point: &mut [MaybeUninit<u8>],
) {
    members.clear();
    for (i, point) in points.iter().enumerate() {
        let normal = normals[point.point as usize];
        if normal == Vec3::ZERO {
            of_point[i].write(NONE);
        } else {
            members.push((point.local - centre, normal, i as u32));
        }
    }
    // By place, so that the order of the input does not matter.
    members
        .sort_unstable_by(|(a, ..), (b, ..)| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    let first = patches.len();
    for &(place, normal, i) in &*members {
        let own = &patches[first..];
        let fits = own.iter().enumerate().filter_map(|(i, patch)| Some((i, misfit(patch, place, normal)?)));
        let mut best = fits.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(i, _)| i);
        if best.is_none() && own.len() == MOST {
            let distance = |patch: &Patch| (patch.centre / patch.points as f32).distance_squared(place);
            best = (0..MOST).min_by(|&a, &b| distance(&own[a]).total_cmp(&distance(&own[b])));
        }
        let number = best.unwrap_or(own.len());
        if number == own.len() {
            patches.push(Patch { centre: Vec3::ZERO, normal: Vec3::ZERO, points: 0 });
        }
        // Sums until all are in.
        let patch = &mut patches[first + number];
        patch.centre += place;
        patch.normal += if patch.normal.dot(normal) < 0.0 { -normal } else { normal };
        patch.points += 1;
        of_point[i as usize].write(number as u8);
    }
    for patch in &mut patches[first..] {
        patch.centre /= patch.points as f32;
        patch.normal = patch.normal.normalize_or(Vec3::Z);
    }
}

/// How badly a point fits a patch of sums; `None` if it is none of its.
#[inline(always)]
fn misfit(patch: &Patch, place: Vec3, normal: Vec3) -> Option<f32> {
    let (square, along) = (patch.normal.length_squared(), patch.normal.dot(normal).abs());
    if along * along < COSINE_SQUARED * square {
        return None;
    }
    let apart = place - patch.centre / patch.points as f32;
    let length = square.sqrt();
    let off = (apart.dot(patch.normal).abs() / length).min(apart.dot(normal).abs());
    (off < THICKNESS).then(|| 1.0 - along / length + off)
}
