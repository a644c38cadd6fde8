//! Normals in noise, once they have signs: where surfaces face apart, each becomes the mean of those about it.
//!
//! A point lies off its surface by the noise, so within that it may as well be of any other surface, as of the other side of a
//! wall or of a face beyond an edge. Which way these face is known here, and the mean of what they say, as vectors, points to
//! the right side most often: it says little where they contradict each other. While signs are not known (`adaptive`) opposite
//! sides look the same.

use super::cubes::Cubes;
use super::patches::{Members, Patch, Patches, signed};
use super::signs::Signs;
use crate::bricks::set_bits;
use crate::error::Error;
use crate::lanes::transposed;
use crate::lists::grow;
use crate::parallel::Scatter;
use crate::points::Points;
use crate::progress::Stage;
use crate::surroundings::{Places, Surroundings};
use glam::{Vec3, Vec4};

/// What errors call the memory of all this.
const WHAT: &str = "the means of normals";

/// How far a mean reaches, in deviations of the points round about from their patches: with 3.3 signs are right less often,
/// with 5 edges are rounder.
const REACH: f32 = 4.0;

/// With less noise, in edges, hardly another point is in reach.
const LEAST_NOISE: f32 = 0.1;

/// Patches that face apart by more than so much, by the cosine, are of different surfaces: elsewhere means change nothing.
const APART: f32 = 0.5;

/// Replaces the normals, which have their signs, of all points of patches next to which surfaces face apart, where there is
/// noise; `noise` is that of the points, in edges of length `edge`. One pass over the patches; each point of such a one looks at
/// those within its reach, no farther than an edge.
pub(super) fn average(
    points: &Points,
    Cubes { grid, edge, noise }: &Cubes,
    (patches, members): (&Patches, &Members),
    signs: &Signs,
    normals: &mut [Vec3],
    stage: &Stage,
) -> Result<(), Error> {
    if *noise <= LEAST_NOISE {
        return Ok(());
    }
    let facing = |patch: usize| signed(signs.flipped[patch], patches.all[patch].normal);
    let known: &[Vec3] = normals;
    let found = stage.part(0.0..0.9).collect(grid.blocks.len(), WHAT, &|block| {
        let mut surroundings = Surroundings::new();
        let (mut near, mut around) = (Near::new(), Vec::new());
        let (mut torn, mut means) = (Vec::new(), Vec::new());
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
            let reach = (REACH * deviation).min(1.0);
            around.clear();
            grow(&mut around, 27, WHAT)?;
            for place in places() {
                let others = members.of_cube(grid, surroundings.cube(place));
                around.push(near.cube(place, others.map(|(point, _)| (position(point), known[point])))?);
            }
            grow(&mut means, grid.points_of(cube).len(), WHAT)?;
            for (point, membership) in members.of_cube(grid, cube) {
                if membership.patch().is_some_and(|(patch, _)| torn[patch]) {
                    // No negative zeros.
                    let mean = Vec3::ZERO + mean(&around, position(point), reach).normalize_or(known[point]);
                    means.push((point as u32, mean));
                }
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
    /// For each place the number of its cube, if that was asked for.
    numbers: [Option<usize>; Places::COUNT],
}

impl Near {
    fn new() -> Self {
        Self { cubes: Vec::new(), numbers: [None; Places::COUNT] }
    }

    fn clear(&mut self) {
        self.cubes.clear();
        self.numbers.fill(None);
    }

    /// The cube at a place, which holds these points: where they are, in edges, and their normals.
    fn cube(&mut self, place: usize, points: impl Iterator<Item = (Vec3, Vec3)> + Clone) -> Result<Cube, Error> {
        if let Some(number) = self.numbers[place] {
            return Ok(self.cubes[number]);
        }
        grow(&mut self.cubes, 1, WHAT)?;
        self.numbers[place] = Some(self.cubes.len());
        let cube = Cube::of(points);
        self.cubes.push(cube);
        Ok(cube)
    }
}

/// The points of a cube with their normals, those of one octant of the box round them together.
#[derive(Clone, Copy)]
struct Cube {
    /// The middle of the box, and half of its sides.
    middle: Vec4,
    half: Vec4,
    /// Of four octants each: x, y and z of the mean positions, then of the sums of the normals.
    octants: [[Vec4; 6]; 2],
}

impl Cube {
    fn of(points: impl Iterator<Item = (Vec3, Vec3)> + Clone) -> Self {
        let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
        for (position, _) in points.clone() {
            (low, high) = (low.min(position), high.max(position));
        }
        let [middle, half] = [low + high, high - low].map(|sum| 0.5 * sum);
        let mut sums = [(Vec3::ZERO, Vec3::ZERO, 0.0); 8];
        for (position, normal) in points {
            let (place, along, count) = &mut sums[position.cmpge(middle).bitmask() as usize];
            *place += position - middle;
            *along += normal;
            *count += 1.0;
        }
        let octants = [0, 4].map(|first| {
            let four: [_; 4] = std::array::from_fn(|i| sums[first + i]);
            // Where there is none, beyond any reach.
            let mean = |place: Vec3, count: f32| if count > 0.0 { middle + place / count } else { Vec3::MAX };
            let [x, y, z, _] = transposed(four.map(|(place, _, count)| mean(place, count).extend(0.0)));
            let [along_x, along_y, along_z, _] = transposed(four.map(|(_, along, _)| along.extend(0.0)));
            [x, y, z, along_x, along_y, along_z]
        });
        Self { middle: middle.extend(0.0), half: half.extend(0.0), octants }
    }
}

/// The sum of the normals within a distance of a position, the nearer the more.
fn mean(cubes: &[Cube], position: Vec3, distance: f32) -> Vec3 {
    // In WebAssembly maxima take several times as long.
    let positive = |lanes: Vec4| Vec4::select(lanes.cmpgt(Vec4::ZERO), lanes, Vec4::ZERO);
    let square = distance * distance;
    let (scale, here) = (1.0 / square, position.extend(0.0));
    let [x, y, z] = position.to_array().map(Vec4::splat);
    let mut sums = [Vec4::ZERO; 3];
    for Cube { middle, half, octants } in cubes {
        if positive((here - *middle).abs() - *half).length_squared() >= square {
            continue;
        }
        for [other_x, other_y, other_z, along @ ..] in octants {
            let (dx, dy, dz) = (*other_x - x, *other_y - y, *other_z - z);
            let weights = positive(Vec4::ONE - scale * (dx * dx + dy * dy + dz * dz));
            for (sum, along) in sums.iter_mut().zip(along) {
                *sum += weights * *along;
            }
        }
    }
    Vec3::from_array(sums.map(Vec4::element_sum))
}
