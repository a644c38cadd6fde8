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
    /// For each point, as the grid sorts them, its place in one.
    pub of_point: Vec<Membership>,
}

/// The patch of a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Membership(u8);

impl Membership {
    /// That of a point without a normal.
    const NONE: Self = Self(u8::MAX);
    const OPPOSITE: u8 = 0x80;

    fn new(patch: usize, is_opposite: bool) -> Self {
        Self(patch as u8 | if is_opposite { Self::OPPOSITE } else { 0 })
    }

    /// The number of the patch among those of the cube, and whether the point's normal is opposite to that of the patch.
    #[inline(always)]
    pub fn patch(self) -> Option<(usize, bool)> {
        (self.0 != Self::NONE.0).then_some((usize::from(self.0 & !Self::OPPOSITE), self.0 & Self::OPPOSITE != 0))
    }
}

/// Patches of a cube at the most: more are a tangle, and its points join whichever is nearest.
const MOST: usize = 16;

/// The normals of a patch lie within 32 degrees of their mean: its cosine, squared.
const COSINE_SQUARED: f32 = 0.72;

/// How far from the plane of a patch a point may lie to join it, in edges: little, because thin walls have both sides in one
/// cube; but noise must not tear a surface into layers, so no less than so many times the noise.
const THICKNESS: f32 = 0.1;
const DEVIATIONS: f32 = 2.2;

impl Patches {
    /// One pass over the points; `noise` is that of [`noise`].
    pub fn of(grid: &Grid, normals: &[Vec3], noise: f32, stage: &Stage) -> Result<Self, Error> {
        let thickness = THICKNESS.max(DEVIATIONS * noise);
        let of_point = Filling::new(grid.placed.len(), "the patches")?;
        let counts = Filling::<u32>::new(grid.cubes(), "the patches")?;
        let found = Gathering::new("the patches");
        stage.run(grid.blocks.len(), &|block| {
            let (mut patches, mut order) = (Vec::new(), Vec::new());
            let bricks = grid.blocks[block].clone();
            let start = grid.first_point[bricks.start] as usize;
            let end = grid.first_point[bricks.end] as usize;
            // All at once, so that the processor waits for many places of memory at a time and not for one after the other.
            let normals: Vec<Vec3> =
                grid.placed[start..end].iter().map(|placed| normals[placed.point as usize]).collect();
            let mut normals = &normals[..];
            // SAFETY: a cube belongs to one brick, and a brick to one block.
            let mut of_point = unsafe { of_point.slice(start..end) };
            for brick in bricks {
                for (cube, (points, bit)) in (grid.first_cube[brick] as usize..).zip(grid.cubes_of(brick)) {
                    let before = patches.len();
                    let (own, others) = normals.split_at(points.len());
                    normals = others;
                    let (memberships, others) = of_point.split_at_mut(points.len());
                    of_point = others;
                    split(points, own, cube_centre(bit), thickness, &mut order, &mut patches, memberships);
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

/// How far points lie off their surface, in edges: the deviation that half of the cubes do not exceed. Looks at every eighth
/// brick.
///
/// From how far apart points are along the normal, one next to the other: both sides of a thin wall in one cube are no noise.
pub(super) fn noise(grid: &Grid, normals: &[Vec3]) -> f32 {
    const STEP: usize = 8;
    /// Fewer points lie on a plane in any case.
    const LEAST: usize = 4;
    /// Of normally distributed points, the median of the gaps between neighbours times the number of points, in deviations.
    const GAPS: f32 = 2.2;
    let (mut deviations, mut places) = (Vec::new(), Vec::new());
    for brick in (0..grid.bricks.len()).step_by(STEP) {
        for (points, _) in grid.cubes_of(brick).filter(|(points, _)| points.len() >= LEAST) {
            let mut normal = Vec3::ZERO;
            for point in points {
                let own = normals[point.point as usize];
                normal += if normal.dot(own) < 0.0 { -own } else { own };
            }
            let normal = normal.normalize_or_zero();
            places.clear();
            places.extend(points.iter().map(|point| point.local.dot(normal)));
            places.sort_unstable_by(f32::total_cmp);
            let mut gaps: Vec<f32> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
            deviations.push(median(&mut gaps) * points.len() as f32 / GAPS);
        }
    }
    if deviations.is_empty() { 0.0 } else { median(&mut deviations) }
}

fn median(values: &mut [f32]) -> f32 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Parts the points of one cube; `normals` are theirs.
fn split(
    points: &[Placed],
    normals: &[Vec3],
    centre: Vec3,
    thickness: f32,
    order: &mut Vec<(u64, u32)>,
    patches: &mut Vec<Patch>,
    of_point: &mut [MaybeUninit<Membership>],
) {
    let first = patches.len();
    if let Some(patch) = whole(points, normals, centre, thickness) {
        patches.push(patch);
        for (membership, &normal) in of_point.iter_mut().zip(normals) {
            membership.write(Membership::new(0, patch.normal.dot(normal) < 0.0));
        }
        return;
    }
    // By place, so that the order of the input does not matter.
    order.clear();
    order.extend(points.iter().enumerate().map(|(i, point)| (key(point.local), i as u32)));
    sort(order);
    for &(_, i) in &*order {
        let (place, normal) = (points[i as usize].local - centre, normals[i as usize]);
        if normal == Vec3::ZERO {
            of_point[i as usize].write(Membership::NONE);
            continue;
        }
        let own = &patches[first..];
        let fits = own.iter().enumerate().filter_map(|(i, patch)| Some((i, misfit(patch, place, normal, thickness)?)));
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
        let is_opposite = patch.normal.dot(normal) < 0.0;
        patch.centre += place;
        patch.normal += if is_opposite { -normal } else { normal };
        patch.points += 1;
        of_point[i as usize].write(Membership::new(number, is_opposite));
    }
    for patch in &mut patches[first..] {
        patch.centre /= patch.points as f32;
        patch.normal = patch.normal.normalize_or(Vec3::Z);
    }
}

/// All points of a cube as one patch, if they lie on one: so most do, and need not be sorted.
fn whole(points: &[Placed], normals: &[Vec3], centre: Vec3, thickness: f32) -> Option<Patch> {
    let (mut place, mut normal) = (Vec3::ZERO, Vec3::ZERO);
    for (point, &own) in points.iter().zip(normals) {
        place += point.local;
        normal += if normal.dot(own) < 0.0 { -own } else { own };
    }
    let (place, normal) = (place / points.len() as f32, normal.try_normalize()?);
    let fits = |(point, own): (&Placed, &Vec3)| {
        let along = normal.dot(*own);
        along * along >= COSINE_SQUARED && (point.local - place).dot(normal).abs() < thickness
    };
    let patch = Patch { centre: place - centre, normal, points: points.len() as u32 };
    points.iter().zip(normals).all(fits).then_some(patch)
}

/// Orders places in a brick by x, then y, then z. Numbers that are not negative have their bits in their order.
fn key(place: Vec3) -> u64 {
    let [x, y, z] = place.to_array().map(|coordinate| u64::from(coordinate.to_bits() >> 10));
    x << 42 | y << 21 | z
}

/// Sorts by key. Most cubes have few points, and for these nothing is faster.
fn sort(order: &mut [(u64, u32)]) {
    const FEW: usize = 32;
    if order.len() > FEW {
        order.sort_unstable();
        return;
    }
    for end in 1..order.len() {
        let one = order[end];
        let mut place = end;
        while place > 0 && one < order[place - 1] {
            order[place] = order[place - 1];
            place -= 1;
        }
        order[place] = one;
    }
}

/// How badly a point fits a patch of sums; `None` if it is none of its.
#[inline(always)]
fn misfit(patch: &Patch, place: Vec3, normal: Vec3, thickness: f32) -> Option<f32> {
    let (square, along) = (patch.normal.length_squared(), patch.normal.dot(normal).abs());
    if along * along < COSINE_SQUARED * square {
        return None;
    }
    let apart = place - patch.centre / patch.points as f32;
    let length = square.sqrt();
    let off = (apart.dot(patch.normal).abs() / length).min(apart.dot(normal).abs());
    (off < thickness).then(|| 1.0 - along / length + off)
}
