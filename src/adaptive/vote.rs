//! The normals of the points, from the surfaces of the cubes round them.

use super::SIZES;
use super::around::Around;
use super::choose::Chosen;
use super::level::Level;
use super::surface::{Matrix, Quadric};
use crate::error::Error;
use crate::grid::Placed;
use crate::lattice::cube_centre;
use crate::normals::Normals;
use crate::parallel::Filling;
use crate::progress::Stage;
use glam::{Vec3, Vec4};
use std::f32::consts::FRAC_1_SQRT_2;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// How far a surface speaks, in edges: the deviation of a normal distribution.
const SPEAK: f32 = 1.4;

/// No surface is trusted more than to so many radians.
const ANGLE_FLOOR: f32 = 0.001;

/// Nor lies nearer to a point than so many edges.
const DISTANCE_FLOOR: f32 = 0.0003;

/// Where all normals round a cube agree within so many radians, and the sum of their deviations, nothing needs a vote.
const SMOOTH: f32 = 0.05;

/// Cubes whose surface rests on fewer points are not divided: the surfaces of the halves would rest on a quarter of them.
const DIVIDED_POINTS: f32 = 60.0;

/// The share of the surfaces that are taken for undisturbed: the noise of the worst of them is that of the place.
const UNDISTURBED: f32 = 0.25;

/// The square angle that a misfit of the size of the neighbourhood is taken for.
const MISFIT: f32 = 2.0;

/// The cubes of a level, and the surfaces they rest on.
pub(super) struct Vote<'a> {
    pub level: &'a Level,
    pub chosen: &'a [Chosen],
    /// Whether no cube is divided any more.
    pub is_last: bool,
    pub normals: &'a Normals,
}

/// How many points took their normal from cubes whose edge was doubled once, twice and so on.
pub(super) type Counts = [u64; SIZES];

impl Vote<'_> {
    /// Finds the normals of the points in the wanted cubes of the level, but not in those that are to be divided: answers
    /// which are.
    #[inline(never)]
    pub fn run(&self, stage: &Stage) -> Result<(Vec<bool>, Counts), Error> {
        let Self { level, chosen, is_last, normals } = *self;
        let grid = &level.grid;
        let rough = Filling::new(level.cubes(), "the cubes")?;
        let counts = [const { AtomicU64::new(0) }; SIZES];
        stage.run(grid.blocks.len(), &|block| {
            let (mut around, mut near, mut voters) = (Around::new(), Vec::new(), Voters::default());
            let mut resolved = 0;
            for (brick, cube, bit) in grid.cubes_in(block) {
                let mut is_rough = false;
                if level.is_wanted(cube) {
                    let (own, surface, placed) = (&chosen[cube], &level.surfaces[cube], level.points(cube));
                    let centre = cube_centre(bit);
                    let can_divide = !is_last && surface.points >= DIVIDED_POINTS;
                    around.near(grid, brick, bit, 1, &mut near);
                    let lacks_detail = can_divide && surface.lacks_detail;
                    let smooth = if lacks_detail { None } else { Smooth::new(own, &near, chosen) };
                    is_rough = can_divide && smooth.is_none();
                    if !is_rough {
                        if smooth.is_none() {
                            around.near(grid, brick, bit, 2, &mut near);
                            voters.invite(&near, chosen);
                        }
                        for four in placed.chunks(4) {
                            let found = match &smooth {
                                Some(smooth) => smooth.normals(four, centre),
                                None => voters.normals(four, centre),
                            };
                            // SAFETY: every point of the input stands in one cube that is wanted and not divided.
                            unsafe { normals.write_lanes(four.iter().map(|p| level.name(p)), found) };
                        }
                        if normals.has_curvature() {
                            for p in placed {
                                // SAFETY: as above.
                                unsafe { normals.write_curvature(level.name(p), own.variation) };
                            }
                        }
                        let count = placed.len() as u64;
                        if smooth.is_some() || !voters.voters.is_empty() {
                            resolved += count;
                        }
                        if own.is_some() {
                            counts[own.doublings as usize].fetch_add(count, Relaxed);
                        }
                    }
                }
                // SAFETY: once for each cube.
                unsafe { rough.write(cube, is_rough) };
            }
            normals.add_resolved(resolved);
        })?;
        // SAFETY: these were all cubes.
        Ok((unsafe { rough.complete() }, counts.map(AtomicU64::into_inner)))
    }
}

/// The value that a share of the values, none of them negative, do not exceed; infinite if there are none.
pub(super) fn quantile(values: &[f32], share: f32) -> f32 {
    let rank = (values.len() as f32 * share) as usize;
    // Bit by bit: the bits of numbers that are not negative are in the order of the numbers.
    let mut bits = 0u32;
    for bit in (0..31).rev() {
        let more = bits | 1 << bit;
        if values.iter().filter(|value| value.to_bits() < more).count() <= rank {
            bits = more;
        }
    }
    if values.is_empty() { f32::INFINITY } else { f32::from_bits(bits) }
}

/// `exp(-x)`, nearly: the same bits everywhere.
#[inline(always)]
fn fade(x: f32) -> f32 {
    let mut power = 1.0 / (1.0 + x * (1.0 / 16.0));
    for _ in 0..4 {
        power *= power;
    }
    power
}

/// The normal of a cube where all surfaces agree, as a linear function.
struct Smooth {
    centre: Vec3,
    normal: Vec3,
    turn: Matrix,
}

impl Smooth {
    #[optimize(size)]
    #[inline(never)]
    fn new(own: &Chosen, near: &[(Vec3, usize)], chosen: &[Chosen]) -> Option<Self> {
        if !own.is_some() {
            return None;
        }
        let centre = own.quadric.centre;
        let mut voices = [(0.0, Vec3::ZERO, 0.0, &own.quadric.bend, 1.0); 27];
        let (mut count, mut best) = (0, 0);
        for &(step, cube) in near {
            let other = &chosen[cube];
            if !other.is_some() {
                continue;
            }
            let place = centre - step;
            let (slope, height) = other.quadric.at(place);
            let scale = slope.length_recip();
            let distance = height * scale;
            let far = (place - other.quadric.centre).length_squared() / (2.0 * SPEAK * SPEAK)
                + distance * distance / (2.0 * (other.noise + DISTANCE_FLOOR * DISTANCE_FLOOR));
            let weight = fade(far) / (other.error + ANGLE_FLOOR * ANGLE_FLOOR);
            voices[count] = (weight, slope * scale, other.error.sqrt(), &other.quadric.bend, scale);
            if weight > voices[best].0 {
                best = count;
            }
            count += 1;
        }
        let (_, normal, deviation, ..) = voices[best];
        let mut smooth = Self { centre, normal: Vec3::ZERO, turn: Matrix::default() };
        for (weight, other, other_deviation, bend, scale) in &voices[..count] {
            let cosine = normal.dot(*other);
            let limit = SMOOTH + deviation + other_deviation;
            if 1.0 - cosine * cosine > limit * limit {
                return None;
            }
            let weight = if cosine < 0.0 { -weight } else { *weight };
            smooth.normal += weight * *other;
            smooth.turn = smooth.turn.plus(bend.scaled(weight * scale));
        }
        let scale = smooth.normal.length_recip();
        Some(Self { centre, normal: smooth.normal * scale, turn: smooth.turn.scaled(scale) })
    }

    /// The normals of up to four points.
    #[inline(never)]
    fn normals(&self, points: &[Placed], cube: Vec3) -> [Vec4; 3] {
        let local = |i: usize| points[i.min(points.len() - 1)].local;
        let (a, b, c, d) = (local(0), local(1), local(2), local(3));
        let from = self.centre + cube;
        let x = Vec4::new(a.x, b.x, c.x, d.x) - from.x;
        let y = Vec4::new(a.y, b.y, c.y, d.y) - from.y;
        let z = Vec4::new(a.z, b.z, c.z, d.z) - from.z;
        let (n, d, o) = (self.normal, self.turn.diagonal, self.turn.off);
        let nx = n.x + d.x * x + o.z * y + o.y * z;
        let ny = n.y + o.z * x + d.y * y + o.x * z;
        let nz = n.z + o.y * x + o.x * y + d.z * z;
        let scale = Vec4::ONE / (nx * nx + ny * ny + nz * nz).sqrt();
        [nx * scale, ny * scale, nz * scale]
    }
}

/// A surface that speaks for points of a cube.
struct Voter {
    quadric: Quadric,
    /// How much it is worth.
    weight: f32,
    /// Of a square distance from it.
    fall: f32,
}

/// The surfaces that vote in a cube.
#[derive(Default)]
struct Voters {
    voters: Vec<Voter>,
    noises: Vec<f32>,
    votes: Vec<(f32, Vec3)>,
}

impl Voters {
    /// Those within two cubes.
    #[optimize(size)]
    #[inline(never)]
    fn invite(&mut self, near: &[(Vec3, usize)], chosen: &[Chosen]) {
        self.noises.clear();
        let flat = near.iter().map(|(_, cube)| &chosen[*cube]).filter(|other| other.is_flat);
        self.noises.extend(flat.map(|other| other.noise));
        let reference = if self.noises.len() < 4 { f32::INFINITY } else { quantile(&self.noises, UNDISTURBED) };
        self.voters.clear();
        let near = near.iter().filter(|(_, cube)| chosen[*cube].is_some());
        self.voters.extend(near.map(|&(step, cube)| {
            let other = &chosen[cube];
            let floor = DISTANCE_FLOOR * DISTANCE_FLOOR;
            let misfit = (other.noise - reference * (1.0 + other.chance) - floor).max(0.0);
            let error = other.error + ANGLE_FLOOR * ANGLE_FLOOR + MISFIT * misfit / other.width;
            Voter {
                quadric: Quadric { centre: other.quadric.centre + step, ..other.quadric },
                weight: 1.0 / error,
                fall: 0.5 / (other.noise + floor),
            }
        }));
    }

    /// The normals of up to four points.
    fn normals(&mut self, points: &[Placed], cube: Vec3) -> [Vec4; 3] {
        let mut normals = [[0.0; 4]; 3];
        for (i, p) in points.iter().enumerate().take(4) {
            let normal = self.vote(p.local - cube);
            [normals[0][i], normals[1][i], normals[2][i]] = normal.to_array();
        }
        normals.map(Vec4::from_array)
    }

    /// The normal at a point.
    #[inline(never)]
    fn vote(&mut self, point: Vec3) -> Vec3 {
        self.votes.clear();
        let mut best = 0;
        for (i, voter) in self.voters.iter().enumerate() {
            let (slope, height) = voter.quadric.at(point);
            let square = slope.length_squared();
            let far = point.distance_squared(voter.quadric.centre) / (2.0 * SPEAK * SPEAK)
                + voter.fall * height * height / square;
            self.votes.push((fade(far) * voter.weight, slope / square.sqrt()));
            if self.votes[i].0 > self.votes[best].0 {
                best = i;
            }
        }
        let Some(&(_, normal)) = self.votes.get(best) else { return Vec3::ZERO };
        let from = self.voters[best].quadric.centre;
        let mut sum = Vec3::ZERO;
        for ((weight, other), voter) in self.votes.iter().zip(&self.voters) {
            let cosine = normal.dot(*other);
            let side = if cosine.abs() > FRAC_1_SQRT_2 {
                cosine
            } else {
                // Round an edge: reflected at the plane between the two, as on an arc.
                let across = (voter.quadric.centre - from).normalize_or_zero();
                (normal - 2.0 * across.dot(normal) * across).dot(*other)
            };
            sum += if side < 0.0 { -*weight * *other } else { *weight * *other };
        }
        sum.try_normalize().unwrap_or(normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_sorted_values() {
        let values: Vec<f32> = (0..101).map(|i| ((i * 37) % 101) as f32 * 1e-9).collect();
        for share in [0.0, 0.25, 0.5, 0.9] {
            assert_eq!(quantile(&values, share), (101.0 * share).floor() * 1e-9);
        }
        assert_eq!(quantile(&[3.5], 0.5), 3.5);
        assert_eq!(quantile(&[], 0.5), f32::INFINITY);
    }

    #[test]
    fn fading_is_that_of_the_exponential_near_zero_and_never_less() {
        for x in [0.0f32, 0.01, 0.1, 0.5, 1.0] {
            assert!((fade(x) / (-x).exp() - 1.0).abs() < 0.04, "{x}");
        }
        for x in [2.0f32, 5.0, 20.0, 1e3, 1e30] {
            assert!(fade(x) >= (-x).exp() && fade(x) < fade(0.99 * x).max(1e-37), "{x}");
        }
    }
}
