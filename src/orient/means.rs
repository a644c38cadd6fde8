//! Normals in noise, once they have signs: where surfaces face apart, each becomes the mean of those about it, or what lies
//! between that and its own.
//!
//! A point lies off its surface by the noise, so within that it may as well be of any other surface, as of the other side of a
//! wall or of a face beyond an edge. Which way these face is known here, and the mean of what they say, as vectors, points to
//! the right side most often: it says little where they contradict each other. While signs are not known (`adaptive`) opposite
//! sides look the same.
//!
//! What a normal says of another place is turned as the field of a dipole is: beside it the same, before and behind it the
//! opposite. So both sides of a wall agree on its rim, though none of them faces as that does. Smoothed and added up, normals
//! of a closed surface are the gradient of what is inside, and these fields its nearest gradient where they are not quite
//! right: in the large, the idea of winding number normal consistency (Lin, Shi and Liu, ACM Transactions on Graphics 43
//! (2024)).

use super::cubes::Cubes;
use super::patches::{Members, Patch, Patches};
use super::signs::Signs;
use super::support::Support;
use crate::bricks::set_bits;
use crate::error::Error;
use crate::lanes::{dot, load, positive, root, transposed};
use crate::lists::grow;
use crate::parallel::Scatter;
use crate::points::Points;
use crate::progress::Stage;
use crate::surroundings::{Places, STEPS, Surroundings};
use glam::{Vec3, Vec4, Vec4Swizzles};

/// What errors call the memory of all this.
const WHAT: &str = "the means of normals";

/// Up to how far from a place, in deviations of the points round about from their patches, it hardly matters on which side of it a
/// normal is: with 3, noise decides, because points lie anywhere before and behind it; with 7, fewer rims are found in much noise.
const SOFT: f32 = 6.0;

/// With less noise, in edges, lines are hardly ever wrong because of it.
const LEAST_NOISE: f32 = 0.05;

/// With more, points are of any surface near by, and normals become means. With less their lines are known well, and change only
/// as far as the points about them speak for the mean.
const MUCH_NOISE: f32 = 0.14;

/// Patches that face apart by more than so much, by the cosine, are of different surfaces: elsewhere means change nothing.
const APART: f32 = 0.5;

/// Where mean and normal are as alike, by the cosine, or opposite, the line stays, but for a touch of the mean: a point beside a rim
/// with the normal of the wall faces as the rim does, too.
const ALIKE: f32 = 0.9;
const TOUCH: f32 = 0.1;

/// Shorter means say nothing of a line: both sides of a thin plate contradict each other.
const CLEAR: f32 = 0.25;

/// Within so many deviations points lie on a plane.
const THICKNESS: f32 = 2.2;

/// What lies on the plane of the normal itself counts so many times as much: means are rounder than edges.
const OWN: f32 = 1.5;

/// Where more points are about a place, its line stays, too: all of them are looked at otherwise, for each.
const MOST: usize = 2048;

/// Where there is no octant, in edges: beyond any reach, and its square is a number.
const FAR: f32 = 1e6;

/// Replaces the normals, which have their signs, of all points of patches next to which surfaces face apart, where there is
/// noise; `noise` is that of the points, in edges of length `edge`. One pass over the patches; each point of such a one looks at
/// the octants of cubes within an edge, and where these contradict it at the points there.
pub(super) fn average(
    points: &Points,
    Cubes { grid, edge, noise, .. }: &Cubes,
    (patches, members): (&Patches, &Members),
    signs: &Signs,
    normals: &mut [Vec3],
    stage: &Stage,
) -> Result<(), Error> {
    if *noise <= LEAST_NOISE {
        return Ok(());
    }
    let facing = |patch: usize| signs.facing(patches, patch);
    let known: &[Vec3] = normals;
    let found = stage.part(0.0..0.9).collect(grid.blocks.len(), WHAT, &|block| {
        let mut surroundings = Surroundings::new();
        let (mut near, mut around) = (Near::new(), Around::new());
        let (mut torn, mut means, mut support) = (Vec::new(), Vec::new(), Support::new());
        let (mut looked_at, mut corner, per_edge) = (None, Vec3::ZERO, (1.0 / edge) as f32);
        for (brick, cube, bit) in grid.cubes_in(block) {
            if looked_at.replace(brick) != Some(brick) {
                surroundings.look(grid, brick);
                near.clear();
                // Near enough that differences are exact, and in edges squares are numbers, whatever the unit.
                corner = members.of_cube(grid, cube).next().map_or(Vec3::ZERO, |(point, _)| points.positions[point]);
            }
            let position = |point: usize| per_edge * (points.positions[point] - corner);
            let (own, near_bits) = (patches.of_cube(cube), surroundings.occupied.near(bit));
            let places = || set_bits(near_bits).map(|near| Places::of_near(bit, near));
            let others = || places().flat_map(|place| patches.of_cube(surroundings.cube(place)));
            // For each patch, whether others face apart from it.
            torn.clear();
            grow(&mut torn, own.len(), WHAT)?;
            torn.extend(own.map(|patch| others().any(|other| facing(patch).dot(facing(other)) < APART)));
            if !torn.contains(&true) {
                continue;
            }
            // A clean edge stays sharp, whatever noise there is elsewhere.
            let deviation = deviation(others().map(|other| &patches.all[other]), *noise);
            if deviation <= LEAST_NOISE {
                continue;
            }
            support.clear();
            let is_much = deviation > MUCH_NOISE;
            let count: usize = places().map(|place| grid.points_of(surroundings.cube(place)).len()).sum();
            around.clear();
            for place in places() {
                let cube = surroundings.cube(place);
                let (count, others) = (grid.points_of(cube).len(), members.of_cube(grid, cube));
                let number = near.cube(place, count, others.map(|(point, _)| (position(point), known[point])))?;
                around.add(number, &near.cubes[number]);
            }
            grow(&mut means, grid.points_of(cube).len(), WHAT)?;
            for (point, membership) in members.of_cube(grid, cube) {
                if !membership.patch().is_some_and(|(patch, _)| torn[patch]) {
                    continue;
                }
                let (place, own) = (position(point), known[point]);
                let sum = mean(around.reached_from(place).map(|number| &near.cubes[number]), place, SOFT * deviation);
                let mean = sum.normalize_or(own);
                let normal = if is_much {
                    mean
                } else if own.dot(mean).abs() >= ALIKE || sum.length() < CLEAR || count > MOST {
                    own.lerp(mean, TOUCH)
                } else {
                    let near = places().flat_map(|place| members.of_cube(grid, surroundings.cube(place)));
                    support.fill(count, near.map(|(point, _)| position(point)), WHAT)?;
                    let [of_own, of_mean] = support.of_planes(place, [own, mean], THICKNESS * deviation);
                    own.lerp(mean, 1.0 / (1.0 + (OWN * of_own / of_mean).powi(4)))
                };
                // No negative zeros.
                means.push((point as u32, Vec3::ZERO + normal.normalize_or(own)));
            }
        }
        Ok(means)
    })?;
    let normals = Scatter::new(normals);
    stage.part(0.9..1.0).run(found.len(), &|i| {
        for &(point, mean) in &found[i] {
            // SAFETY: every point of the input stands in the grid once at the most.
            let normal = unsafe { normals.slice(point as usize..point as usize + 1) };
            normal[0] = mean;
        }
    })
}

/// How far the points of some patches lie off these, in edges: the root mean square.
fn deviation<'a>(patches: impl Iterator<Item = &'a Patch>, noise: f32) -> f32 {
    let (mut squares, mut count) = (0.0, 0);
    for patch in patches {
        squares += patch.points as f32 * patch.variance(noise);
        count += patch.points;
    }
    (squares / count as f32).sqrt()
}

/// What is known of the cubes in and round a brick.
struct Near {
    cubes: Vec<Cube>,
    /// The points of one, as [`Cube::of`] takes them.
    points: Vec<[Vec4; 2]>,
    /// For each place the number of its cube, if that was asked for.
    numbers: [Option<usize>; Places::COUNT],
}

impl Near {
    fn new() -> Self {
        Self { cubes: Vec::new(), points: Vec::new(), numbers: [None; Places::COUNT] }
    }

    fn clear(&mut self) {
        self.cubes.clear();
        self.numbers.fill(None);
    }

    /// The number of the cube at a place, which holds `count` points: where they are, in edges, and their normals.
    fn cube(&mut self, place: usize, count: usize, points: impl Iterator<Item = (Vec3, Vec3)>) -> Result<usize, Error> {
        if let Some(number) = self.numbers[place] {
            return Ok(number);
        }
        grow(&mut self.cubes, 1, WHAT)?;
        self.points.clear();
        grow(&mut self.points, count, WHAT)?;
        self.points.extend(points.map(|(place, normal)| [place.extend(1.0), normal.extend(0.0)]));
        let number = self.cubes.len();
        self.numbers[place] = Some(number);
        self.cubes.push(Cube::of(&self.points));
        Ok(number)
    }
}

/// The boxes round the points of a cube and of those round it, coordinate by coordinate.
struct Around {
    /// The numbers of the cubes in [`Near`].
    numbers: [usize; Self::ROOM],
    middle: [[f32; Self::ROOM]; 3],
    half: [[f32; Self::ROOM]; 3],
    count: usize,
    /// The numbers of those that were reached last.
    reached: [usize; Self::ROOM],
}

impl Around {
    /// For 27, four by four.
    const ROOM: usize = STEPS.len() + 1;

    fn new() -> Self {
        let room = [0.0; Self::ROOM];
        Self { numbers: [0; Self::ROOM], middle: [room; 3], half: [room; 3], count: 0, reached: [0; Self::ROOM] }
    }

    fn clear(&mut self) {
        self.count = 0;
    }

    fn add(&mut self, number: usize, cube: &Cube) {
        self.numbers[self.count] = number;
        for axis in 0..3 {
            self.middle[axis][self.count] = cube.middle[axis];
            self.half[axis][self.count] = cube.half[axis];
        }
        self.count += 1;
    }

    /// The numbers of the cubes whose boxes lie within an edge of a position. Without a jump for each: nothing foretells which do.
    fn reached_from(&mut self, position: Vec3) -> impl Iterator<Item = usize> {
        let here = position.to_array().map(Vec4::splat);
        let mut count = 0;
        for first in (0..self.count).step_by(4) {
            let [x, y, z] = [0, 1, 2].map(|axis| {
                let (middle, half) = (load(&self.middle[axis][first..]), load(&self.half[axis][first..]));
                positive((here[axis] - middle).abs() - half)
            });
            let is_near = (x * x + y * y + z * z).cmplt(Vec4::ONE).bitmask();
            for lane in 0..4 {
                self.reached[count] = self.numbers[first + lane];
                count += usize::from(is_near >> lane & 1 == 1 && first + lane < self.count);
            }
        }
        self.reached[..count].iter().copied()
    }
}

/// The points of a cube with their normals, those of one octant of the box round them together.
struct Cube {
    /// The middle of the box, and half of its sides.
    middle: Vec3,
    half: Vec3,
    octants: [Octants; 2],
}

/// Four octants.
struct Octants {
    /// The mean positions.
    places: [Vec4; 3],
    /// The sums of the normals.
    along: [Vec4; 3],
    /// How many points there are.
    counts: Vec4,
}

impl Cube {
    /// Of points: where each is, and 1, and its normal.
    fn of(points: &[[Vec4; 2]]) -> Self {
        let (mut low, mut high) = (Vec4::MAX, Vec4::MIN);
        for &[place, _] in points {
            low = Vec4::select(place.cmplt(low), place, low);
            high = Vec4::select(place.cmpgt(high), place, high);
        }
        let [middle, half] = [low + high, high - low].map(|sum| (0.5 * sum).with_w(0.0));
        let mut sums = [[Vec4::ZERO; 2]; 8];
        for &[place, along] in points {
            let sums = &mut sums[place.cmpge(middle).bitmask() as usize & 7];
            // And how many there are.
            sums[0] += place - middle;
            sums[1] += along;
        }
        let octants = [0, 4].map(|first| {
            let rows = |sum: usize| transposed(std::array::from_fn(|i| sums[first + i][sum]));
            let ([x, y, z, counts], [along_x, along_y, along_z, _]) = (rows(0), rows(1));
            // Where there is none, beyond any reach.
            let mean = |sums: Vec4, middle: f32| {
                Vec4::select(counts.cmpgt(Vec4::ZERO), middle + sums / counts, Vec4::splat(FAR))
            };
            let places = [mean(x, middle.x), mean(y, middle.y), mean(z, middle.z)];
            Octants { places, along: [along_x, along_y, along_z], counts }
        });
        Self { middle: middle.xyz(), half: half.xyz(), octants }
    }
}

/// What the normals within an edge say of a position, the nearer the more: the mean of their fields as dipoles, which are as
/// smooth as if each were `soft` beside the position. The more they contradict each other, the shorter it is.
fn mean<'a>(cubes: impl Iterator<Item = &'a Cube>, position: Vec3, soft: f32) -> Vec3 {
    let [x, y, z] = position.to_array().map(Vec4::splat);
    let soft = Vec4::splat(soft * soft);
    let (mut sums, mut total) = ([Vec4::ZERO; 3], Vec4::ZERO);
    for cube in cubes {
        for Octants { places: [other_x, other_y, other_z], along, counts } in &cube.octants {
            let apart = [*other_x - x, *other_y - y, *other_z - z];
            let square = dot(apart, apart);
            let scale = Vec4::ONE / (square + soft);
            let weight = positive(Vec4::ONE - square) * scale * root(scale);
            let turn = 3.0 * scale * dot(apart, *along);
            for axis in 0..3 {
                sums[axis] += weight * (along[axis] - turn * apart[axis]);
            }
            total += weight * *counts;
        }
    }
    Vec3::from_array(sums.map(Vec4::element_sum)) / total.element_sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall that ends at x = 0: none of the normals of its sides faces as its rim does.
    #[test]
    fn both_sides_of_a_wall_agree_on_its_rim() {
        let sides = [0.1, -0.1].map(|z| {
            let points = (0..100).map(move |i| Vec3::new(-0.05 * (i % 10) as f32, 0.1 * (i / 10) as f32 - 0.45, z));
            let points: Vec<[Vec4; 2]> = points.map(|place| [place.extend(1.0), Vec4::Z * z.signum()]).collect();
            Cube::of(&points)
        });
        let rim = mean(sides.iter(), Vec3::ZERO, 0.4);
        assert!(rim.normalize().x > 0.99, "{rim}");
        let outside = mean(sides[..1].iter(), Vec3::new(-0.2, 0.0, 0.2), 0.4);
        assert!(outside.normalize().z > 0.95, "{outside}");
    }
}
