//! The normals of the points, from the surfaces of the cubes round them.

use super::around::{Around, Near};
use super::choose::Chosen;
use super::faces::{CLEAN, Faces};
use super::facets::{Facets, TORN};
use super::level::{Level, Role};
use super::matrix::times_lanes;
use super::sheets::Sheets;
use super::surface::{HIDING, Surface};
use super::tally::Tally;
use super::{DIVISIONS, WHAT};
use crate::error::Error;
use crate::grid::located;
use crate::lanes::{after, dot, inverse_root, power, root, transposed};
use crate::lattice::cube_centre;
use crate::normals::{Normals, SHORT, Writer};
use crate::parallel::Filling;
use crate::progress::Stage;
use glam::{Vec3, Vec4};
use std::cell::LazyCell;
use std::f32::consts::FRAC_1_SQRT_2;

/// How far a surface speaks, in edges: the deviation of a normal distribution.
const SPEAK: f32 = 1.4;

/// What the square of a distance from a surface counts, against its noise: less than the half of a normal distribution,
/// because the surface is not known exactly.
const FALL: f32 = 0.35;

/// How suddenly a surface ends where it meets another: what the distance to there counts, against the noise, for each root of
/// `FALL`.
const END: f32 = 2.0;

/// The least argument for `fade`, whose pole is at -16: farther beyond its end a surface counts no less.
const BEYOND: f32 = -8.0;

/// No surface is trusted more than to a thousandth of a radian, squared.
const ANGLE_FLOOR: f32 = 1e-6;

/// Nor lies nearer to a point than 0.0003 edges, squared.
const DISTANCE_FLOOR: f32 = 9e-8;

/// Noise is a misfit only beyond this many times the noise of the place: the lower quartile of that of the flat surfaces
/// around.
const NOISIER: f32 = 1.25;

/// The square angle that a misfit of one square edge is taken for, however wide the surface is: a thin plate or a row of waves
/// is a thick plane to large neighbourhoods, and the more certainly so the larger they are, but that is not its normal.
const MISFIT: f32 = 2.0;

/// Where all normals round a cube agree within so many radians, and the sum of their deviations, nothing needs a vote.
const SMOOTH: f32 = 0.05;

/// So many where noise decides: then the normals differ because of it, but no more than on one surface.
const SMOOTH_IN_NOISE: f32 = 0.12;

/// Cubes whose surface rests on fewer points are not divided: the surfaces of the halves would rest on a quarter of them. Nor
/// are faces looked for round them.
const MANY_POINTS: f32 = 60.0;

/// Where the normal is not known any better, square radians, the cube is divided as long as it can be: whatever is so uncertain
/// agrees with everything.
const UNSURE: f32 = 0.07;

/// A cube is in noise where one in so many cubes near it is a plane in noise.
const IN_NOISE: usize = 10;

/// Where more than one in so many cubes near one is folded it is not in noise.
const FOLDED: usize = 20;

/// Where a sheet goes on, so many cubes within two are occupied; small objects have fewer.
const SHEET: usize = 25;

/// In an exact cloud a surface with more noise than this, in edges and squared, may lie between two sheets.
const BETWEEN: f32 = 3e-4;

/// A neighbourhood of fewer points may have too few of each sheet.
const FEW_POINTS: f32 = 40.0;

/// The cubes of a level, and the surfaces they rest on.
pub(super) struct Vote<'a> {
    pub level: &'a Level,
    pub chosen: &'a [Chosen],
    /// How often the cubes were divided.
    pub division: usize,
    /// Whether narrow faces are told by points.
    pub facets: bool,
    /// Whether the cloud is exact ([`facets::are_exact`]).
    pub exact: bool,
    pub normals: &'a Normals,
    pub tally: &'a Tally,
}

impl Vote<'_> {
    /// Finds the normals of the points in the wanted cubes of the level, but not in those that are to be divided: answers
    /// what the parts of each cube would be for.
    #[inline(never)]
    pub fn run(&self, stage: &Stage) -> Result<Vec<Role>, Error> {
        let level = self.level;
        let parts = Filling::new(level.grid.cubes(), WHAT)?;
        stage.run(level.grid.blocks.len(), &|block| {
            let mut task = Task::new(self);
            for (brick, cube, bit) in level.grid.cubes_in(block) {
                let role = match level.role(cube) {
                    Role::Wanted => task.settle(brick, cube, bit),
                    role => role,
                };
                // SAFETY: once for each cube.
                unsafe { parts.write(cube, role) };
            }
            self.normals.add_resolved(task.resolved);
        })?;
        // SAFETY: these were all cubes.
        Ok(unsafe { parts.complete() })
    }
}

/// One cube after the other.
struct Task<'a> {
    vote: &'a Vote<'a>,
    writer: Writer<'a>,
    around: Around,
    ballot: Ballot,
    faces: Faces,
    /// Only where they are asked for.
    facets: Option<Facets>,
    sheets: Option<Sheets>,
    /// A brick, and the least noise of a surface in and two cubes round it.
    cleanest: (usize, f32),
    resolved: u64,
}

impl<'a> Task<'a> {
    fn new(vote: &'a Vote<'a>) -> Self {
        let writer = vote.normals.writer();
        Self {
            vote,
            writer,
            around: Around::new(),
            ballot: Ballot::default(),
            faces: Faces::default(),
            facets: (cfg!(feature = "full") && vote.facets).then(|| Facets::new(vote.exact)),
            sheets: (cfg!(feature = "full") && vote.exact).then(Sheets::new),
            cleanest: (usize::MAX, 0.0),
            resolved: 0,
        }
    }

    /// Whether a surface that was fitted to a cube lies between two sheets.
    fn is_between(&mut self, brick: usize, bit: u32, surface: &Surface) -> bool {
        let Self { vote: Vote { level, .. }, around, sheets, .. } = self;
        sheets.as_mut().is_some_and(|sheets| {
            let mut find = |reach| sheets.find(level, bit, around.near(&level.grid, brick, bit, reach));
            // The 27 cubes may have too few points to tell.
            find(1) || surface.points < FEW_POINTS && find(2)
        })
    }

    /// Whether the surface of a cube may lie across an edge of faces that points tell better.
    #[optimize(size)]
    #[inline(never)]
    fn is_torn(&mut self, brick: usize, cube: usize) -> bool {
        let Vote { level, chosen, .. } = *self.vote;
        if chosen[cube].noise <= TORN {
            return false;
        }
        if self.vote.exact {
            // Even where nothing near by lies on one face.
            return true;
        }
        if self.cleanest.0 != brick {
            let noise = |cube: u32| chosen[cube as usize].flat_noise;
            self.cleanest = (brick, self.around.least(&level.grid, brick, noise));
        }
        // Elsewhere points tell faces only if the cloud has no noise.
        self.cleanest.1 < CLEAN
    }

    /// Finds the normals of the points of a cube, unless it is to be divided: answers what its parts would be for, and only
    /// those of a divided one are wanted.
    #[optimize(size)]
    #[inline(never)]
    fn settle(&mut self, brick: usize, cube: usize, bit: u32) -> Role {
        let Vote { level, chosen, division, .. } = *self.vote;
        let (own, surface) = (&chosen[cube], &level.surfaces[cube]);
        let has_many = surface.points >= MANY_POINTS;
        let can_divide = division < DIVISIONS && has_many;
        let mut smooth = None;
        if own.is_some() {
            let near = self.around.near(&level.grid, brick, bit, 1);
            // Whether noise decides: the cube rests on a larger neighbourhood than the smallest, and its points lie off the
            // surface within the samples too. The sides of a thin wall are samples of their own. Waves shorter than a cube of
            // the base look the same, so that is divided once all the same; and where the smallest neighbourhood does not
            // know its normal it may be the tube of a ring, which from afar is a plane.
            let is_noisy = division > 0 && own.doublings > 0 && surface.error <= UNSURE && surface.shows(own.noise);
            let is_unsure = own.error > UNSURE;
            if !(can_divide && (is_unsure || !is_noisy && surface.lacks_detail)) {
                self.ballot.invite(near, chosen, f32::INFINITY);
                let tolerance = if is_noisy { SMOOTH_IN_NOISE } else { SMOOTH };
                smooth = self.ballot.smooth(own.quadric.centre, tolerance);
            }
        }
        let mut is_edge = false;
        if smooth.is_none() {
            let near = self.around.near(&level.grid, brick, bit, 2);
            // In an exact cloud a plane in noise is both sides of a wall, and its rim none of the faces.
            is_edge =
                has_many && self.faces.find(level, bit, near, chosen) && !(self.vote.exact && self.faces.noise > TORN);
            if !is_edge {
                let noise = LazyCell::new(|| quartile(near.iter().map(|near| chosen[near.cube as usize].flat_noise)));
                if can_divide {
                    let (mut planes, mut showing, mut folded) = (0, 0, 0);
                    for near in near {
                        let surface = &level.surfaces[near.cube as usize];
                        planes += usize::from(surface.is_plane_in_noise);
                        showing += usize::from(surface.is_some() && surface.shows(surface.noise));
                        folded += usize::from(surface.is_folded);
                    }
                    // Noise hides what the parts could tell, also of an edge in this very cube: there is a plane in noise, or it
                    // is as wide as the parts, and most surfaces show it within their samples; unless it is folds.
                    let is_wide = || {
                        division > 0
                            && near.len() >= SHEET
                            && 2 * showing >= near.len()
                            && (HIDING..f32::INFINITY).contains(&*noise)
                    };
                    if FOLDED * folded > near.len() || IN_NOISE * planes < near.len() && !is_wide() {
                        return Role::Wanted;
                    }
                }
                self.ballot.invite(near, chosen, *noise);
            }
        }
        let placed = level.points(cube);
        let centre = cube_centre(bit);
        // Without signs they are never asked for, and left out of the module then.
        let is_torn = cfg!(feature = "full") && self.vote.facets && !is_edge && self.is_torn(brick, cube);
        // Before cubes were divided they have too many points, and what bends is no sheet yet.
        let may_be_between =
            cfg!(feature = "full") && self.vote.exact && division > 0 && !is_edge && own.noise > BETWEEN;
        let mut is_between = (!may_be_between).then_some(false);
        if smooth.is_some() && !is_torn {
            is_between = is_between.or_else(|| Some(self.is_between(brick, bit, surface)));
        }
        if is_edge || smooth.is_some() && !is_torn && is_between == Some(false) {
            for four in placed.chunks(4) {
                let (places, points) = located(four, centre);
                let directions = match &smooth {
                    Some(smooth) => smooth.directions(places),
                    None => self.faces.directions(places),
                };
                // SAFETY: every point of the input stands in one cube that is wanted and not divided.
                unsafe { self.writer.write_lanes(points, four.len(), directions) };
            }
        } else {
            for p in placed {
                let place = p.local - centre;
                let mut facet = None;
                if is_torn && let Some(facets) = &mut self.facets {
                    facet = facets.normal(level, brick, bit, &mut self.around, place);
                }
                if facet.is_none() && *is_between.get_or_insert_with(|| self.is_between(brick, bit, surface)) {
                    facet = self.sheets.as_ref().map(|sheets| sheets.direction(place));
                }
                let mut direction = facet.unwrap_or_else(|| match &smooth {
                    Some(smooth) => smooth.direction(place),
                    None => self.ballot.vote(place),
                });
                if is_torn
                    && facet.is_none()
                    && let Some(facets) = &mut self.facets
                    && facets.is_doubtful(direction)
                {
                    direction = facets.hidden(level, brick, bit, &mut self.around, place).unwrap_or(direction);
                }
                // SAFETY: as above.
                unsafe { self.writer.write(p.point, direction) };
            }
        }
        if self.writer.has_curvature() {
            for p in placed {
                // SAFETY: as above.
                unsafe { self.writer.write_curvature(p.point, own.variation) };
            }
        }
        let count = placed.len() as u64;
        if is_edge || !self.ballot.voters.is_empty() {
            self.resolved += count;
        }
        if own.is_some() {
            self.vote.tally.add(division, own, count);
        }
        if smooth.is_some() && own.doublings > 0 { Role::Settled } else { Role::Near }
    }
}

/// The value that a quarter of at most 125 values do not exceed; infinite if fewer than four are finite, and only these
/// count.
fn quartile(values: impl Iterator<Item = f32> + Clone) -> f32 {
    let rank = values.clone().filter(|value| *value < f32::INFINITY).count() / 4;
    if rank == 0 {
        return f32::INFINITY;
    }
    // The least so far, in their order.
    let mut least = [Vec4::INFINITY; 8];
    for value in values.filter(|value| *value < f32::INFINITY) {
        // Each gives way to the one before it, if that is more than the value, or else to the value. Four at once, because
        // nothing foretells how far a value goes.
        let mut before = Vec4::NEG_INFINITY;
        for four in &mut least[..=rank / 4] {
            let here = std::mem::replace(four, four.min(Vec4::splat(value)).max(after(before, *four)));
            before = here;
        }
    }
    least[rank / 4][rank % 4]
}

/// `exp(-x)`, nearly, and below zero more than that: the same bits everywhere. Zero from some 10,000; not for -16 and less.
#[inline(always)]
fn fade(x: Vec4) -> Vec4 {
    power(Vec4::ONE / (1.0 + x * (1.0 / 16.0)), 4)
}

/// The normal of a cube where all surfaces agree, as a linear function.
struct Smooth {
    centre: Vec3,
    normal: [Vec4; 3],
    turn: [[Vec4; 3]; 2],
}

impl Smooth {
    /// The directions of the normals of four points.
    #[inline(never)]
    fn directions(&self, [x, y, z]: [Vec4; 3]) -> [Vec4; 3] {
        let centre = self.centre;
        let turns = times_lanes(self.turn, [x - centre.x, y - centre.y, z - centre.z]);
        std::array::from_fn(|axis| self.normal[axis] + turns[axis])
    }

    /// That of one point.
    fn direction(&self, point: Vec3) -> Vec3 {
        Vec3::from_array(self.directions(point.to_array().map(Vec4::splat)).map(|lanes| lanes.x))
    }
}

/// Four surfaces that speak for the points of a cube, lane by lane; where there are fewer, the last ones weigh nothing.
struct Voters {
    centre: [Vec4; 3],
    height: Vec4,
    slope: [Vec4; 3],
    bend: [[Vec4; 3]; 2],
    /// Variance of the angle of the normal.
    error: Vec4,
    /// How much each is worth.
    weight: Vec4,
    /// Of a square distance from it.
    fall: Vec4,
}

impl Voters {
    /// Each comes with what lies between its cube and the one where it votes. `reference` is the noise of that place.
    #[inline(always)]
    fn of(four: [(Vec3, &Chosen); 4], reference: f32) -> Self {
        let numbers = four.map(|(_, chosen)| chosen.numbers());
        let lanes = |i: usize| transposed(numbers.map(|numbers| numbers[i]));
        let [cx, cy, cz, height] = lanes(0);
        let [sx, sy, sz, xx] = lanes(1);
        let [yy, zz, yz, xz] = lanes(2);
        let [xy, noise, chance, error] = lanes(3);
        let [a, b, c, d] = four.map(|(step, _)| step);
        let centre = [
            cx + Vec4::new(a.x, b.x, c.x, d.x),
            cy + Vec4::new(a.y, b.y, c.y, d.y),
            cz + Vec4::new(a.z, b.z, c.z, d.z),
        ];
        let misfit = (noise - reference * (NOISIER + chance) - DISTANCE_FLOOR).max(Vec4::ZERO);
        Self {
            centre,
            height,
            slope: [sx, sy, sz],
            bend: [[xx, yy, zz], [yz, xz, xy]],
            error,
            weight: 1.0 / (error + ANGLE_FLOOR + MISFIT * misfit),
            fall: FALL / (noise + DISTANCE_FLOOR),
        }
    }

    /// What they say about a point.
    #[inline(always)]
    fn speak(&self, point: Vec3) -> Votes {
        let place = point.to_array().map(Vec4::splat);
        let d = std::array::from_fn(|axis| place[axis] - self.centre[axis]);
        let bend = times_lanes(self.bend, d);
        let slope: [Vec4; 3] = std::array::from_fn(|axis| self.slope[axis] + bend[axis]);
        let height = self.height + dot(d, self.slope) + 0.5 * dot(d, bend);
        let square = dot(slope, slope).max(Vec4::splat(f32::MIN_POSITIVE));
        let far = dot(d, d) * (0.5 / (SPEAK * SPEAK)) + self.fall * height * height / square;
        let scale = inverse_root(square);
        Votes {
            weight: fade(far) * self.weight,
            normal: slope.map(|lanes| lanes * scale),
            height: height * scale,
            scale,
        }
    }
}

/// Four votes on the normal at a point, lane by lane.
#[derive(Default)]
struct Votes {
    weight: Vec4,
    normal: [Vec4; 3],
    /// Of the point over the surface.
    height: Vec4,
    /// What makes a unit vector of the gradient.
    scale: Vec4,
}

/// The vote that counts most.
struct Best {
    weight: f32,
    normal: Vec3,
    height: f32,
    /// The centre of the surface.
    centre: Vec3,
    /// Variance of the angle of the normal.
    error: f32,
    fall: f32,
}

impl Best {
    /// Where nobody votes.
    const NONE: Self =
        Self { weight: -1.0, normal: Vec3::ZERO, height: 0.0, centre: Vec3::ZERO, error: 0.0, fall: 0.0 };
}

/// The surfaces that vote in a cube.
#[derive(Default)]
struct Ballot {
    voters: Vec<Voters>,
    /// What each of them says about the point that was asked about last.
    votes: Vec<Votes>,
}

impl Ballot {
    /// Asks the surfaces of some cubes, and trusts those less that are noisier than `reference`.
    #[inline(never)]
    fn invite(&mut self, near: &[Near], chosen: &[Chosen], reference: f32) {
        self.voters.clear();
        let mut all =
            near.iter().map(|near| (near.step, &chosen[near.cube as usize])).filter(|(_, other)| other.is_some());
        while let Some(first) = all.next() {
            let mut next = || all.next().unwrap_or((Vec3::ZERO, &Chosen::NONE));
            self.voters.push(Voters::of([first, next(), next(), next()], reference));
        }
        // Here, and not while they speak: what may have to grow keeps nothing in registers.
        self.votes.resize_with(self.voters.len(), Votes::default);
    }

    /// Asks about a point. The vote that counts most, if there are any.
    #[inline(never)]
    fn ask(&mut self, point: Vec3) -> Best {
        // Lane by lane: the weight, and the number of the four.
        let (mut most, mut place) = (Vec4::NEG_ONE, Vec4::ZERO);
        for (i, (voters, votes)) in self.voters.iter().zip(&mut self.votes).enumerate() {
            *votes = voters.speak(point);
            let is_more = votes.weight.cmpgt(most);
            most = Vec4::select(is_more, votes.weight, most);
            place = Vec4::select(is_more, Vec4::splat(i as f32), place);
        }
        let lane = most.max_position();
        let (Some(votes), Some(voters)) = (self.votes.get(place[lane] as usize), self.voters.get(place[lane] as usize))
        else {
            return Best::NONE;
        };
        let vector = |lanes: [Vec4; 3]| Vec3::from_array(lanes.map(|lanes| lanes[lane]));
        Best {
            weight: votes.weight[lane],
            normal: vector(votes.normal),
            height: votes.height[lane],
            centre: vector(voters.centre),
            error: voters.error[lane],
            fall: voters.fall[lane],
        }
    }

    /// One linear function for all points of a cube, if about its centroid all voters agree within so many radians, and the
    /// sum of their deviations.
    #[inline(never)]
    fn smooth(&mut self, centre: Vec3, tolerance: f32) -> Option<Smooth> {
        let best = self.ask(centre);
        if best.weight < f32::MIN_POSITIVE {
            // Far from all of them.
            return None;
        }
        let normal = best.normal.to_array().map(Vec4::splat);
        let deviation = tolerance + best.error.sqrt();
        let mut sums = [Vec4::ZERO; 9];
        for (votes, voters) in self.votes.iter().zip(&self.voters) {
            let cosine = dot(normal, votes.normal);
            let limit = deviation + root(voters.error);
            if (1.0 - cosine * cosine).cmpgt(limit * limit).any() {
                return None;
            }
            let weight = votes.weight / best.weight;
            let weight = Vec4::select(cosine.cmplt(Vec4::ZERO), -weight, weight);
            let (scaled, [diagonal, off]) = (weight * votes.scale, voters.bend);
            for axis in 0..3 {
                sums[axis] += weight * votes.normal[axis];
                sums[3 + axis] += scaled * diagonal[axis];
                sums[6 + axis] += scaled * off[axis];
            }
        }
        let [x, y, z, xx, yy, zz, yz, xz, xy] = sums.map(Vec4::element_sum);
        let length = Vec3::new(x, y, z).length();
        let lanes = |values: [f32; 3]| values.map(|value| Vec4::splat(value / length));
        Some(Smooth { centre, normal: lanes([x, y, z]), turn: [lanes([xx, yy, zz]), lanes([yz, xz, xy])] })
    }

    /// The direction of the normal at a point.
    #[inline(never)]
    fn vote(&mut self, point: Vec3) -> Vec3 {
        let best = self.ask(point);
        if best.weight < f32::MIN_POSITIVE {
            return best.normal;
        }
        let normal = best.normal.to_array().map(Vec4::splat);
        let centre = best.centre.to_array().map(Vec4::splat);
        let height = Vec4::splat(best.height);
        let mut sum = [Vec4::ZERO; 3];
        for (votes, voters) in self.votes.iter().zip(&self.voters) {
            let mut side = dot(normal, votes.normal);
            let mut weight = votes.weight / best.weight;
            let is_turned = side.abs().cmple(Vec4::splat(FRAC_1_SQRT_2));
            if is_turned.any() {
                // Round an edge. Each of the two ends at the other, on the side where its centre lies: the further the point's
                // foot on it lies inside, the more it counts, `1 / (1 + exp(-inside))`.
                let across = std::array::from_fn(|axis| voters.centre[axis] - centre[axis]);
                let (rise, drop) = (dot(across, normal), dot(across, votes.normal));
                let unit = END * root(voters.fall.min(Vec4::splat(best.fall)));
                let doubt = |inside: Vec4| 1.0 + fade((unit * inside).max(Vec4::splat(BEYOND)));
                let of_best = doubt((height * side - votes.height) * drop.signum());
                let of_other = doubt((height - votes.height * side) * rise.signum());
                weight *= Vec4::select(is_turned, of_best / of_other, Vec4::ONE);
                // Reflected at the plane between the two, as on an arc.
                let reflected = dot(across, across) * side - 2.0 * rise * drop;
                side = Vec4::select(is_turned, reflected, side);
            }
            let weight = Vec4::select(side.cmplt(Vec4::ZERO), -weight, weight);
            (0..3).for_each(|axis| sum[axis] += weight * votes.normal[axis]);
        }
        let sum = Vec3::from_array(sum.map(Vec4::element_sum));
        if sum.length_squared() > SHORT * SHORT { sum } else { best.normal }
    }
}

#[cfg(test)]
mod tests {
    use super::super::surface::Quadric;
    use super::*;

    #[test]
    fn quartiles_are_those_of_the_sorted_values() {
        let values: Vec<f32> = (0..101).map(|i| ((i * 37) % 101) as f32 * 1e-9).collect();
        assert_eq!(quartile(values.iter().copied()), 25.0 * 1e-9);
        for (some, expected) in
            [(&[1.0, 2.0, 3.0][..], f32::INFINITY), (&[4.0, 2.0, 3.0, 1.0], 2.0), (&[2.0; 125], 2.0)]
        {
            assert_eq!(quartile(some.iter().copied()), expected);
        }
    }

    /// Round the edge of a block: a point past the end of the top is on the side, though the top's plane is nearer.
    #[test]
    fn faces_end_where_they_meet() {
        let face = |centre: Vec3, normal: Vec3| {
            let quadric = Quadric { centre, height: 0.0, slope: normal, ..Quadric::NONE };
            Chosen { quadric, noise: 4e-4, error: 1e-3, ..Chosen::NONE }
        };
        let faces = [face(-0.5 * Vec3::X, Vec3::Z), face(-0.5 * Vec3::Z, Vec3::X)];
        for order in [[0, 1], [1, 0]] {
            let mut ballot = Ballot::default();
            ballot.invite(&order.map(|cube| Near { step: Vec3::ZERO, cube }), &faces, f32::INFINITY);
            let beyond_the_top = ballot.vote(Vec3::new(0.03, 0.0, -0.02)).normalize();
            assert!(beyond_the_top.x > 0.9, "{beyond_the_top}");
            let beyond_the_side = ballot.vote(Vec3::new(-0.02, 0.0, 0.03)).normalize();
            assert!(beyond_the_side.z > 0.9, "{beyond_the_side}");
            let between = ballot.vote(Vec3::new(-0.02, 0.0, -0.02)).normalize();
            assert!((between.x - between.z).abs() < 1e-3, "{between}");
        }
    }

    #[test]
    fn fading_is_that_of_the_exponential_near_zero_and_never_less() {
        for x in [0.0f32, 0.01, 0.1, 0.5, 1.0] {
            assert!((fade(Vec4::splat(x)).x / (-x).exp() - 1.0).abs() < 0.04, "{x}");
        }
        let fade = |x: f32| fade(Vec4::splat(x)).x;
        for x in [BEYOND, -4.0, -1.0] {
            assert!(fade(x) >= (-x).exp() && fade(x) < 100_000.0, "{x}");
        }
        for x in [2.0f32, 5.0, 20.0, 1e3, 1e30] {
            assert!(fade(x) >= (-x).exp() && fade(x) < fade(0.99 * x).max(1e-37), "{x}");
        }
    }
}
