//! The points of a cube, parted into those that lie on one piece of surface.

use super::sheets::{self, Doubt};
use crate::bricks::set_bits;
use crate::error::Error;
use crate::grid::{Grid, Placed, located};
use crate::lanes::{dot, root, transposed};
use crate::lattice::{BRICK, cube_centre};
use crate::lists::{concatenated, grow, reserve, starts};
use crate::order::sort_few;
use crate::parallel::Filling;
use crate::progress::Stage;
use glam::{DVec3, Vec3, Vec4};
use std::array::from_fn;
use std::mem::MaybeUninit;
use std::ops::{Neg, Range};

/// A few points of one cube with nearly the same normal and plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    /// Their mean, against the cube's centre, in edges.
    pub centre: Vec3,
    /// Their mean normal, a unit vector; its sign is that of the first of them.
    pub normal: Vec3,
    pub points: u32,
    /// How well they lie on its plane, from 1 down to 0: beside a sharp edge some have the normal of the face beyond.
    pub flatness: f32,
    /// Whether another one of its cube is alike but for its place, as that of the other side of a wall.
    pub has_rival: bool,
    /// How far it bends towards its normal within an edge, as a slope, where it was told from another sheet by that; else zero.
    pub bend: f32,
}

impl Patch {
    /// How alike another one is, from 1 down to 0, wherever the two lie.
    pub fn likeness(&self, other: &Self) -> f32 {
        self.normal.dot(other.normal).powi(16)
    }

    /// Whether its normal is that of a surface: few points, or some of a face beyond an edge, may have any.
    pub fn is_plain(&self) -> bool {
        self.points >= PLAIN_POINTS && self.flatness >= PLAIN_FLATNESS
    }

    /// How much there is of it, up to 1: few points may be anything.
    pub fn certainty(&self) -> f32 {
        if self.points < CERTAIN { self.points as f32 / CERTAIN as f32 } else { 1.0 }
    }

    /// The variance of its points about its plane; `noise` is theirs, in edges.
    pub fn variance(&self, noise: f32) -> f32 {
        uneven(noise) * (1.0 / self.flatness - 1.0)
    }
}

/// The patches of all cubes.
pub(super) struct Patches {
    /// In the order of the cubes.
    pub all: Vec<Patch>,
    /// For each cube its first patch; one more at the end.
    pub first: Vec<usize>,
}

/// The points of the patches, as the grid sorts them: 5 bytes each.
pub(super) struct Members {
    /// Which point of the input it is.
    points: Vec<u32>,
    of_point: Vec<Membership>,
}

impl Members {
    /// The points of a cube.
    pub fn of_cube(&self, grid: &Grid, cube: usize) -> impl Iterator<Item = (usize, Membership)> + Clone {
        let range = grid.points_of(cube);
        let points = self.points[range.clone()].iter().map(|&point| point as usize);
        points.zip(self.of_point[range].iter().copied())
    }
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
pub(super) const MOST: usize = 16;

/// The normals of a patch lie within 16 degrees of their mean: its cosine, squared. So the sides of a blade are two. With noise of
/// so many edges and more it is 32 degrees, because noise must not tear a surface apart.
const COSINE_SQUARED: f32 = 0.92;
const COSINE_SQUARED_IN_NOISE: f32 = 0.72;
const NOISE: f32 = 0.1;

/// How far from the plane of a patch a point may lie to join it, in edges: little, because thin walls have both sides in one
/// cube; but noise must not tear a surface into layers, so no less than so many times the noise.
const THICKNESS: f32 = 0.07;
const DEVIATIONS: f32 = 2.2;

/// Points that lie so far from their plane, in edges, make half of a patch's flatness, or so many times the noise if that is
/// more.
const UNEVEN: f32 = 0.04;
const UNEVEN_DEVIATIONS: f32 = 4.0;

/// Patches less alike than so, as those of the two faces of an edge, are no rivals.
const UNLIKE: f32 = 0.1;

/// Patches of so many points, and so flat, are plain.
const PLAIN_POINTS: u32 = 4;
const PLAIN_FLATNESS: f32 = 0.8;

/// Patches of so many points are certain.
const CERTAIN: u32 = 8;

/// How far the points of a patch may lie off its plane, in edges, and their normals off its own.
#[derive(Clone, Copy)]
struct Limits {
    /// To be one of them.
    thickness: f32,
    /// And its normal off theirs: the square of a cosine.
    cosine_squared: f32,
    /// The variance at which the patch is half as flat.
    uneven: f32,
    /// Where there is no noise, so that places and normals may tell sheets that nearly touch: how far points lie off their own.
    slack: Option<f32>,
}

impl Limits {
    /// Where points lie so far off their surface, and, if there is no noise, off a sheet through one next to them.
    fn of(noise: f32, slack: Option<f32>) -> Self {
        let cosine_squared = COSINE_SQUARED + (noise / NOISE).min(1.0) * (COSINE_SQUARED_IN_NOISE - COSINE_SQUARED);
        Self { thickness: THICKNESS.max(DEVIATIONS * noise), cosine_squared, uneven: uneven(noise), slack }
    }

    /// The flatness of so many points, with the sum of their square distances from the plane.
    fn flatness(&self, squares: f32, points: u32) -> f32 {
        1.0 / (1.0 + squares / (points as f32 * self.uneven))
    }
}

/// The variance at which a patch is half as flat, where points lie so far off their surface.
fn uneven(noise: f32) -> f32 {
    UNEVEN.max(UNEVEN_DEVIATIONS * noise).powi(2)
}

impl Patches {
    /// One pass over the points; `noise` is theirs, in edges, and `slack` as [`Cubes`](super::cubes::Cubes) has it.
    pub fn of(
        grid: &Grid,
        normals: &[Vec3],
        (noise, slack): (f32, Option<f32>),
        stage: &Stage,
    ) -> Result<(Self, Members), Error> {
        const WHAT: &str = "the patches";
        let limits = Limits::of(noise, slack);
        let (numbers, of_point) = (Filling::new(grid.placed.len(), WHAT)?, Filling::new(grid.placed.len(), WHAT)?);
        let counts = Filling::<u32>::new(grid.cubes(), WHAT)?;
        let found = stage.collect(grid.blocks.len(), WHAT, &|block| {
            let (mut patches, mut order) = (Vec::new(), Vec::new());
            let bricks = grid.blocks[block].clone();
            let points = grid.first_point[bricks.start] as usize..grid.first_point[bricks.end] as usize;
            // SAFETY: a point belongs to one brick, and a brick to one block.
            let (numbers, mut of_point) = unsafe { (numbers.slice(points.clone()), of_point.slice(points.clone())) };
            for (number, placed) in numbers.iter_mut().zip(&grid.placed[points.clone()]) {
                number.write(placed.point);
            }
            // All at once, so that the processor waits for many places of memory at a time and not for one after the other.
            let mut gathered = Vec::new();
            reserve(&mut gathered, points.len(), WHAT)?;
            gathered.extend(grid.placed[points].iter().map(|placed| normals[placed.point as usize]));
            let mut normals = &gathered[..];
            for brick in bricks {
                for (cube, (points, bit)) in (grid.first_cube[brick] as usize..).zip(grid.cubes_of(brick)) {
                    let before = patches.len();
                    let own = normals.split_off(..points.len()).unwrap_or_default();
                    let memberships = of_point.split_off_mut(..points.len()).unwrap_or_default();
                    grow(&mut order, points.len(), WHAT)?;
                    grow(&mut patches, MOST, WHAT)?;
                    split(points, own, cube_centre(bit), limits, &mut order, &mut patches, memberships);
                    // SAFETY: a cube belongs to one brick.
                    unsafe { counts.write(cube, (patches.len() - before) as u32) };
                }
            }
            Ok(patches)
        })?;
        // SAFETY: the blocks hold all bricks, these all cubes, and these all points.
        let (counts, points, of_point) = unsafe { (counts.complete(), numbers.complete(), of_point.complete()) };
        let patches = Self { all: concatenated(found, WHAT)?, first: starts(&counts, WHAT)? };
        Ok((patches, Members { points, of_point }))
    }

    /// The numbers of the patches of a cube.
    #[inline(always)]
    pub fn of_cube(&self, cube: usize) -> Range<usize> {
        self.first[cube]..self.first[cube + 1]
    }

    /// The numbers of all patches, their bricks, and where they are in those, in edges.
    pub fn placed<'a>(&'a self, grid: &'a Grid) -> impl Iterator<Item = (usize, usize, Vec3)> + 'a {
        (0..grid.blocks.len()).flat_map(|block| grid.cubes_in(block)).flat_map(move |(brick, cube, bit)| {
            let centre = cube_centre(bit);
            self.of_cube(cube).map(move |patch| (patch, brick, centre + self.all[patch].centre))
        })
    }

    /// All patches, and where they are, in edges.
    pub fn places<'a>(&'a self, grid: &'a Grid) -> impl Iterator<Item = (&'a Patch, DVec3)> + 'a {
        let corner = |brick: usize| (BRICK * grid.bricks.places[brick]).as_dvec3();
        self.placed(grid).map(move |(patch, brick, local)| (&self.all[patch], corner(brick) + local.as_dvec3()))
    }
}

/// Parts the points of one cube; `normals` are theirs. There is room in `order` for all of them, and for the patches.
fn split(
    points: &[Placed],
    normals: &[Vec3],
    centre: Vec3,
    limits: Limits,
    order: &mut Vec<(u64, u32)>,
    patches: &mut Vec<Patch>,
    of_point: &mut [MaybeUninit<Membership>],
) {
    let first = patches.len();
    if let Some((patch, doubt)) = whole(points, normals, centre, limits) {
        if limits.slack.is_some_and(|slack| doubt.is_some(slack))
            && part(points, normals, centre, limits, patches, of_point)
        {
            return;
        }
        patches.push(patch);
        for (membership, &normal) in of_point.iter_mut().zip(normals) {
            membership.write(Membership::new(0, patch.normal.dot(normal) < 0.0));
        }
        return;
    }
    if part(points, normals, centre, limits, patches, of_point) {
        return;
    }
    // By place, so that the order of the input does not matter.
    order.clear();
    for (i, (point, &normal)) in points.iter().zip(normals).enumerate() {
        if normal == Vec3::ZERO {
            of_point[i].write(Membership::NONE);
        } else {
            order.push((key(point.local), i as u32));
        }
    }
    // The first bits of the key are those of x.
    sort_few(order, |(key, _)| (key >> 42) as f32);
    // From here on the number of each one's patch in place of its key.
    let mut sums = Sums::NONE;
    for (number_or_key, i) in &mut *order {
        let i = *i as usize;
        let (number, is_opposite) = sums.add(points[i].local - centre, normals[i], limits);
        of_point[i].write(Membership::new(number, is_opposite));
        *number_or_key = number as u64;
    }
    patches.extend((0..sums.count).map(|number| sums.patch(number)));
    let own = &mut patches[first..];
    for &(number, i) in &*order {
        let patch = &mut own[number as usize];
        let off = (points[i as usize].local - centre - patch.centre).dot(patch.normal);
        patch.flatness += off * off;
    }
    for i in 0..own.len() {
        own[i].flatness = limits.flatness(own[i].flatness, own[i].points);
        own[i].has_rival = (0..own.len()).any(|other| other != i && own[i].likeness(&own[other]) > UNLIKE);
    }
}

/// All points of a cube as one patch, if they lie on one: so most do, and need not be sorted.
fn whole(points: &[Placed], normals: &[Vec3], centre: Vec3, limits: Limits) -> Option<(Patch, Doubt)> {
    let (mut place, mut normal) = (Vec3::ZERO, Vec3::ZERO);
    for (point, &own) in points.iter().zip(normals) {
        place += point.local;
        normal += aligned(own, normal);
    }
    let (place, normal) = (place / points.len() as f32, normal.try_normalize()?);
    let (mut squares, mut doubt) = (0.0, Doubt::NONE);
    for (points, normals) in points.chunks(4).zip(normals.chunks(4)) {
        let ([x, y, z], _) = located(points, place);
        let [own_x, own_y, own_z, _] = transposed(from_fn(|lane| normals[lane.min(normals.len() - 1)].extend(0.0)));
        let along = normal.x * own_x + normal.y * own_y + normal.z * own_z;
        let off = x * normal.x + y * normal.y + z * normal.z;
        let is_apart = (along * along).cmplt(Vec4::splat(limits.cosine_squared));
        if (is_apart | off.abs().cmpge(Vec4::splat(limits.thickness))).any() {
            return None;
        }
        let square = (off * off).to_array();
        square[..points.len()].iter().for_each(|square| squares += square);
        if limits.slack.is_some() {
            let own = x * own_x + y * own_y + z * own_z;
            let own = Vec4::select(along.cmplt(Vec4::ZERO), -own, own);
            let heights = off.to_array().into_iter().zip(own.to_array());
            heights.take(points.len()).for_each(|(off, own)| doubt.add(off, own));
        }
    }
    let count = points.len() as u32;
    let flatness = limits.flatness(squares, count);
    Some((Patch { centre: place - centre, normal, points: count, flatness, has_rival: false, bend: 0.0 }, doubt))
}

/// Parts the points of a cube into two sheets that nearly touch, if there is no noise and they lie on such.
fn part(
    points: &[Placed],
    normals: &[Vec3],
    centre: Vec3,
    limits: Limits,
    patches: &mut Vec<Patch>,
    of_point: &mut [MaybeUninit<Membership>],
) -> bool {
    let (Some(slack), Some(normal)) = (limits.slack, alike(normals, limits)) else { return false };
    let second = sheets::second(points, normals, normal, slack);
    if second == 0 {
        return false;
    }
    let side = |i: usize| (second >> i & 1) as usize;
    let both = [0, 1].map(|number| {
        let all = points.iter().zip(normals).enumerate();
        sheet(all.filter(|&(i, _)| side(i) == number).map(|(_, one)| one), normal, centre, limits)
    });
    patches.extend(both);
    for (i, (membership, &normal)) in of_point.iter_mut().zip(normals).enumerate() {
        membership.write(Membership::new(side(i), both[side(i)].normal.dot(normal) < 0.0));
    }
    true
}

/// The mean normal of all points, if theirs are as alike as those of a patch.
fn alike(normals: &[Vec3], limits: Limits) -> Option<Vec3> {
    let normal = normals.iter().fold(Vec3::ZERO, |sum, &own| sum + aligned(own, sum)).try_normalize()?;
    let is_alike = |own: &Vec3| normal.dot(*own).powi(2) >= limits.cosine_squared;
    normals.iter().all(is_alike).then_some(normal)
}

/// The patch of one of two sheets whose normals are about `normal`.
#[inline(never)]
fn sheet<'a>(
    points: impl Iterator<Item = (&'a Placed, &'a Vec3)> + Clone,
    normal: Vec3,
    centre: Vec3,
    limits: Limits,
) -> Patch {
    let count = points.clone().count() as u32;
    let place = points.clone().map(|(point, _)| point.local).sum::<Vec3>() / count as f32;
    let normal = points.clone().map(|(_, &own)| aligned(own, normal)).sum::<Vec3>().normalize_or(Vec3::Z);
    let (mut squares, mut rise, mut width) = (0.0, 0.0, 0.0);
    for (point, &own) in points {
        let d = point.local - place;
        let height = d.dot(normal);
        squares += height * height;
        rise += height - d.dot(aligned(own, normal));
        width += d.length_squared();
    }
    let bend = if width > 0.0 { rise / width } else { 0.0 };
    let flatness = limits.flatness(squares, count);
    Patch { centre: place - centre, normal, points: count, flatness, has_rival: true, bend }
}

/// A normal, or its opposite if that is more like `other`.
#[inline(always)]
pub(super) fn aligned(normal: Vec3, other: Vec3) -> Vec3 {
    signed(other.dot(normal) < 0.0, normal)
}

/// The same, or its opposite.
#[inline(always)]
pub(super) fn signed<T: Neg<Output = T>>(is_flipped: bool, one: T) -> T {
    if is_flipped { -one } else { one }
}

/// The same for a number, without a jump: nothing foretells who is flipped.
#[inline(always)]
pub(super) fn turned(is_flipped: bool, one: f32) -> f32 {
    f32::from_bits(one.to_bits() ^ u32::from(is_flipped) << 31)
}

/// Orders places in a brick by x, then y, then z. Numbers that are not negative have their bits in their order.
fn key(place: Vec3) -> u64 {
    let [x, y, z] = place.to_array().map(|coordinate| u64::from(coordinate.to_bits() >> 10));
    x << 42 | y << 21 | z
}

/// Sums over the points of some patches.
struct Sums {
    count: usize,
    /// How many points each has: single precision counts by ones to 2^24 only.
    points: [u32; MOST],
    fours: [FourSums; MOST / 4],
}

/// Those of four patches, number for number in lanes.
#[derive(Clone, Copy)]
struct FourSums {
    centre: [Vec4; 3],
    normal: [Vec4; 3],
    points: Vec4,
}

impl Sums {
    const NONE: Self = {
        let four = FourSums { centre: [Vec4::ZERO; 3], normal: [Vec4::ZERO; 3], points: Vec4::ZERO };
        Self { count: 0, points: [0; MOST], fours: [four; MOST / 4] }
    };

    /// Adds a point to the patch that it fits best, or to a new one if there is none and they are not too many. Answers which that
    /// is, and whether its normal is opposite.
    fn add(&mut self, place: Vec3, normal: Vec3, limits: Limits) -> (usize, bool) {
        let (number, is_opposite) = match self.best(place, normal, limits) {
            Some(best) => best,
            None if self.count == MOST => {
                let nearest = self.nearest(place);
                (nearest, self.normal(nearest).dot(normal) < 0.0)
            }
            None => {
                self.count += 1;
                (self.count - 1, false)
            }
        };
        let four = &mut self.fours[number / 4];
        // All four at once: what was stored one by one would be waited for.
        let lane = Vec4::AXES[number % 4];
        let normal = signed(is_opposite, normal);
        for axis in 0..3 {
            four.centre[axis] += place[axis] * lane;
            four.normal[axis] += normal[axis] * lane;
        }
        four.points += lane;
        self.points[number] += 1;
        (number, is_opposite)
    }

    /// The patch that a point fits best, if any, and whether its normal is opposite.
    fn best(&self, place: Vec3, normal: Vec3, limits: Limits) -> Option<(usize, bool)> {
        let [place, own] = [place, normal].map(|one| one.to_array().map(Vec4::splat));
        let (mut best, mut least) = (None, f32::INFINITY);
        for (four, &FourSums { centre, normal, points }) in self.fours[..self.count.div_ceil(4)].iter().enumerate() {
            let (square, along) = (dot(normal, normal), dot(normal, own));
            let apart = [0, 1, 2].map(|axis| place[axis] - centre[axis] / points);
            let length = root(square);
            let (off, off_own) = (dot(apart, normal).abs() / length, dot(apart, own).abs());
            let off = Vec4::select(off.cmplt(off_own), off, off_own);
            let misfit = (1.0 - along.abs() / length + off).to_array();
            let is_alike = (along * along).cmpge(limits.cosine_squared * square);
            // Where there is none nothing is a number, and none fits.
            let fits = (is_alike & off.cmplt(Vec4::splat(limits.thickness))).bitmask();
            let is_opposite = along.cmplt(Vec4::ZERO).bitmask();
            for lane in set_bits(fits.into()) {
                if misfit[lane as usize] < least {
                    (best, least) =
                        (Some((4 * four + lane as usize, is_opposite >> lane & 1 == 1)), misfit[lane as usize]);
                }
            }
        }
        best
    }

    /// The patch whose centre is nearest to a place.
    fn nearest(&self, place: Vec3) -> usize {
        let distance = |&number: &usize| self.centre(number).distance_squared(place);
        (0..self.count).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }

    fn centre(&self, number: usize) -> Vec3 {
        Vec3::from_array(self.fours[number / 4].centre.map(|lanes| lanes[number % 4])) / self.points[number] as f32
    }

    fn normal(&self, number: usize) -> Vec3 {
        Vec3::from_array(self.fours[number / 4].normal.map(|lanes| lanes[number % 4]))
    }

    /// The patch itself, but for how its points lie.
    fn patch(&self, number: usize) -> Patch {
        Patch {
            centre: self.centre(number),
            normal: self.normal(number).normalize_or(Vec3::Z),
            points: self.points[number],
            flatness: 0.0,
            has_rival: false,
            bend: 0.0,
        }
    }
}
