//! How densely the surfaces all over a cloud are covered.

use super::ball::Ball;
use super::patches::{Patch, Patches};
use crate::error::Error;
use crate::grid::Grid;
use crate::lists::grow;
use crate::points::spread;
use crate::power::log2;
use glam::DVec3;

/// Bricks of 4 x 4 x 4 cubes that are looked at.
const BRICKS: usize = 512;

/// Patches as parallel as this cosine are one surface.
const PARALLEL: f32 = 0.9;

/// A surface tells a density by so many points on so many square edges, if they are such a share of all points there. Fewer are
/// strays: these lie thinly round what they stray from, as if it were near the scanner.
const LEAST_POINTS: f64 = 3.0;
const LEAST_AREA: f64 = 0.5;
const LEAST_SHARE: f64 = 0.7;

/// More points do not tell it better.
const CERTAIN: f64 = 30.0;

/// A piece of surface, in 2 x 2 x 2 cubes.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    /// The middle of its points, in edges.
    pub place: DVec3,
    pub normal: DVec3,
    /// The logarithm, to base 2, of how many points there are on a square edge.
    pub density: f64,
    /// How much that counts.
    pub weight: f64,
}

/// The numbers of some bricks that are not far off, all over the cloud.
pub(super) fn some_bricks<'a>(ball: &'a Ball, grid: &'a Grid) -> impl Iterator<Item = usize> + 'a {
    let mut some = spread(ball.bricks(grid).count(), BRICKS).peekable();
    let all = ball.bricks(grid).enumerate();
    all.filter_map(move |(i, brick)| some.next_if_eq(&i).map(|_| brick))
}

/// Those of some bricks.
pub(super) fn spots(ball: &Ball, grid: &Grid, patches: &Patches, what: &'static str) -> Result<Vec<Spot>, Error> {
    let mut spots = Vec::new();
    for brick in some_bricks(ball, grid) {
        grow(&mut spots, 8, what)?;
        spots.extend((0..8).filter_map(|octant| {
            let is_in_it = |&(_, _, bit): &(DVec3, usize, u32)| bit >> 1 & 1 | bit >> 2 & 2 | bit >> 3 & 4 == octant;
            spot(|| {
                let cubes = grid.centres_of(brick).filter(is_in_it);
                cubes.flat_map(|(centre, cube, _)| {
                    patches.all[patches.of_cube(cube)].iter().map(move |one| (one, centre))
                })
            })
        }));
    }
    Ok(spots)
}

/// The variance of a value over some of them, by their weights.
pub(super) fn variance<'a>(spots: impl Iterator<Item = &'a Spot>, value: impl Fn(&Spot) -> f64) -> f64 {
    let (mut sum, mut squares, mut all) = (0.0, 0.0, 0.0);
    for spot in spots {
        let value = value(spot);
        sum += spot.weight * value;
        squares += spot.weight * value * value;
        all += spot.weight;
    }
    (squares - sum * sum / all) / all
}

/// That of the largest of the patches of 2 x 2 x 2 cubes, and of those like it; each comes with the centre of its cube.
fn spot<'a, I: Iterator<Item = (&'a Patch, DVec3)>>(patches: impl Fn() -> I) -> Option<Spot> {
    let (largest, centre) = patches().max_by_key(|(patch, _)| patch.points)?;
    // Cubes are counted from an even one.
    let middle = 2.0 * (0.5 * centre).floor() + 1.0;
    let (mut points, mut all, mut places) = (0.0, 0.0, DVec3::ZERO);
    for (patch, centre) in patches() {
        let own = f64::from(patch.points);
        all += own;
        if patch.normal.dot(largest.normal).abs() > PARALLEL {
            points += own;
            places += own * (centre + patch.centre.as_dvec3());
        }
    }
    let (place, normal) = (places / points, largest.normal.as_dvec3());
    let area = 4.0 * slice(normal, 0.5 * (place - middle));
    let is_told = points >= LEAST_POINTS && area >= LEAST_AREA && points >= LEAST_SHARE * all;
    is_told.then(|| Spot { place, normal, density: log2(points / area), weight: points.min(CERTAIN) })
}

/// The area that a cube cuts out of a plane through a place in it, in square edges; the place is counted from the cube's centre.
///
/// What a plane cuts off a corner is a triangle, whose area grows with the square of the corner's height above it. Those of the
/// eight corners, in turn added and taken away, leave what lies in the cube.
fn slice(normal: DVec3, place: DVec3) -> f64 {
    // No triangle is infinite, and planes along a face of the cube lie within.
    let normal = normal.abs().max(DVec3::splat(2e-3)).normalize().copysign(normal);
    let place = place.clamp(DVec3::splat(-0.49), DVec3::splat(0.49));
    let mut sum = 0.0;
    for corner in 0..8 {
        let side = DVec3::from_array([0, 1, 2].map(|axis| f64::from(corner >> axis & 1) - 0.5));
        let height = normal.dot(side - place).max(0.0);
        sum += 8.0 * side.element_product() * height * height;
    }
    (sum / (2.0 * normal.element_product())).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slice_is_what_lies_of_a_plane_in_a_cube() {
        const STEPS: i32 = 400;
        let places = [DVec3::ZERO, DVec3::new(0.3, -0.2, 0.1), DVec3::new(-0.45, 0.4, 0.47)];
        let normals = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-0.2, 1.0, 0.3), DVec3::new(0.9, -0.8, 0.1)];
        for (place, normal) in places.into_iter().flat_map(|place| normals.map(|normal| (place, normal.normalize()))) {
            let (across, up) = normal.any_orthonormal_pair();
            let step = |i: i32| 2.0 * f64::from(i) / f64::from(STEPS);
            let squares = (-STEPS..STEPS).flat_map(|i| (-STEPS..STEPS).map(move |j| (step(i), step(j))));
            let inside = squares.filter(|&(i, j)| (place + i * across + j * up).abs().max_element() < 0.5).count();
            let area = inside as f64 * step(1) * step(1);
            assert!((slice(normal, place) - area).abs() < 0.02, "{} is not {area}", slice(normal, place));
        }
        for axis in DVec3::AXES {
            for off in [-0.5, 0.0, 0.2, 0.5] {
                assert!((slice(axis, off * axis) - 1.0).abs() < 0.01);
            }
        }
    }
}
