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
use crate::lists::{grow, reserve};
use crate::parallel::Scatter;
use crate::points::Points;
use crate::progress::Stage;
use crate::surroundings::{Places, Surroundings};
use glam::{Vec3, Vec4};
use std::ops::Range;

/// What errors call the memory of all this.
const WHAT: &str = "the means of normals";

/// How far a mean reaches, in deviations of the points round about from their patches: with 3.3 signs are right less often,
/// with 5 edges are rounder.
const REACH: f32 = 4.0;

/// With less noise, in edges, hardly another point is in reach.
const LEAST_NOISE: f32 = 0.1;

/// Patches that face apart by more than so much, by the cosine, are of different surfaces: elsewhere means change nothing.
const APART: f32 = 0.5;

/// Where lanes without a point are: beyond any reach.
const NOWHERE: Vec3 = Vec3::splat(f32::MAX);

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
        let (mut near, mut torn, mut means) = (Near::new(), Vec::new(), Vec::new());
        let mut looked_at = None;
        for (brick, cube, bit) in grid.cubes_in(block) {
            if looked_at.replace(brick) != Some(brick) {
                surroundings.look(grid, brick);
                near.clear();
            }
            let (own, places) = (patches.of_cube(cube), surroundings.occupied.near(bit));
            let at = |place: u32| Places::of_near(bit, place);
            // For each patch, whether others face apart from it.
            torn.clear();
            grow(&mut torn, own.len(), WHAT)?;
            torn.extend(own.map(|patch| {
                let is_apart = |other: usize| facing(patch).dot(facing(other)) < APART;
                set_bits(places).any(|place| patches.of_cube(surroundings.cube(at(place))).any(is_apart))
            }));
            if !torn.contains(&true) {
                continue;
            }
            // A clean edge stays sharp, whatever noise there is elsewhere.
            let (mut squares, mut count) = (0.0, 0);
            for patch in set_bits(places).flat_map(|place| patches.of_cube(surroundings.cube(at(place)))) {
                let Patch { points, .. } = patches.all[patch];
                squares += points as f32 * patches.all[patch].variance(*noise);
                count += points;
            }
            let deviation = (squares / count as f32).sqrt();
            if deviation <= LEAST_NOISE {
                continue;
            }
            let reach = (f64::from((REACH * deviation).min(1.0)) * edge) as f32;
            for place in set_bits(places).map(at) {
                if !near.holds(place) {
                    let others = members.of_cube(grid, surroundings.cube(place)).map(|(point, _)| point);
                    near.add(place, others.map(|point| (points.positions[point], known[point])))?;
                }
            }
            grow(&mut means, grid.points_of(cube).len(), WHAT)?;
            for (point, membership) in members.of_cube(grid, cube) {
                if membership.patch().is_some_and(|(patch, _)| torn[patch]) {
                    let mean = near.mean(set_bits(places).map(at), points.positions[point], reach);
                    means.push((point as u32, mean.try_normalize().unwrap_or(known[point])));
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

/// The points of cubes in and round a brick, with their normals, four at a time.
struct Near {
    /// x, y and z of the positions, then of the normals.
    rows: Vec<[Vec4; 6]>,
    cubes: [Option<Cube>; Places::COUNT],
}

/// Where the points of a cube stand, and the box round them.
#[derive(Clone)]
struct Cube {
    rows: Range<usize>,
    low: Vec3,
    high: Vec3,
}

impl Near {
    fn new() -> Self {
        Self { rows: Vec::new(), cubes: [const { None }; Places::COUNT] }
    }

    fn clear(&mut self) {
        self.rows.clear();
        self.cubes.fill(None);
    }

    fn holds(&self, place: usize) -> bool {
        self.cubes[place].is_some()
    }

    /// Takes the points at a place, and their normals.
    fn add(&mut self, place: usize, mut points: impl Iterator<Item = (Vec3, Vec3)>) -> Result<(), Error> {
        let (start, mut low, mut high) = (self.rows.len(), Vec3::MAX, Vec3::MIN);
        while let Some(first) = points.next() {
            let mut four = [first, (NOWHERE, Vec3::ZERO), (NOWHERE, Vec3::ZERO), (NOWHERE, Vec3::ZERO)];
            four[1..].iter_mut().zip(&mut points).for_each(|(to, point)| *to = point);
            for (position, _) in four.iter().filter(|(position, _)| *position != NOWHERE) {
                (low, high) = (low.min(*position), high.max(*position));
            }
            let [x, y, z, _] = transposed(four.map(|(position, _)| position.extend(0.0)));
            let [along_x, along_y, along_z, _] = transposed(four.map(|(_, normal)| normal.extend(0.0)));
            reserve(&mut self.rows, 1, WHAT)?;
            self.rows.push([x, y, z, along_x, along_y, along_z]);
        }
        self.cubes[place] = Some(Cube { rows: start..self.rows.len(), low, high });
        Ok(())
    }

    /// The sum of the normals within a distance of a position, of points in some places, the nearer the more.
    fn mean(&self, places: impl Iterator<Item = usize>, position: Vec3, distance: f32) -> Vec3 {
        let square = distance * distance;
        let (scale, [x, y, z]) = (1.0 / square, position.to_array().map(Vec4::splat));
        let mut sums = [Vec4::ZERO; 3];
        for cube in places.filter_map(|place| self.cubes[place].as_ref()) {
            if position.clamp(cube.low, cube.high).distance_squared(position) >= square {
                continue;
            }
            for [other_x, other_y, other_z, along @ ..] in &self.rows[cube.rows.clone()] {
                let (dx, dy, dz) = (*other_x - x, *other_y - y, *other_z - z);
                let weights = (Vec4::ONE - scale * (dx * dx + dy * dy + dz * dz)).max(Vec4::ZERO);
                for (sum, along) in sums.iter_mut().zip(along) {
                    *sum += weights * *along;
                }
            }
        }
        Vec3::from_array(sums.map(Vec4::element_sum))
    }
}
