//! The cubes whose points are parted into patches: so large that a noisy surface is no thicker than one.

use super::patches::aligned;
use crate::cell::{self, Density};
use crate::error::Error;
use crate::grid::{Grid, Placed};
use crate::lattice::{BRICK, CUBES, Lattice};
use crate::lists::grow;
use crate::median::{self, median};
use crate::points::{Bounds, Points, spread};
use crate::progress::Stage;
use crate::rounding::Rounding;
use crate::source::Source;
use glam::Vec3;

/// Where points lie off common sheets by less than this, in edges, there is no noise.
const EXACT: f32 = 0.001;

/// What errors call the memory of all this.
const WHAT: &str = "the cubes";

/// Points in a cube: as many as tell noise from a wall.
const POINTS_PER_CELL: f64 = 16.0;

/// With more noise, in edges, the cubes are too small: points anywhere in a cube have 0.31.
const LARGEST_NOISE: f32 = 0.28;
const ENLARGEMENT: f32 = 1.25;
const LARGEST: f32 = ENLARGEMENT * ENLARGEMENT * ENLARGEMENT;

/// The points in their cubes.
pub(super) struct Cubes {
    pub grid: Grid,
    /// For each cube its points, but those that coincide with the one before them: marks for missing echoes, all in one place,
    /// tell nothing of where the cloud lies.
    pub distinct: Vec<u32>,
    /// The edge of a cube, in units of the positions.
    pub edge: f64,
    /// How far points lie off their surface, in edges.
    pub noise: f32,
    /// Where there is no noise, so that places and normals tell sheets that nearly touch: how far points next to each other lie
    /// off a sheet that goes through both as their normals say, in edges; nothing but rounding, however the surface bends.
    pub slack: Option<f32>,
}

/// Sorts the points once, noisy ones twice.
pub(super) fn sort(
    points: &Points,
    normals: &[Vec3],
    bounds: &Bounds,
    density: &Density,
    stage: &Stage,
) -> Result<Cubes, Error> {
    let sort = |edge: f64, stage: &Stage| {
        let lattice = Lattice::new(bounds, &|| density.middle, edge, CUBES);
        Grid::sort(&Source::new(points, lattice), stage, |points, _| distinct(points))
    };
    let slack = |grid: &Grid| {
        slack(grid, normals, &|| Rounding::of(density.step, density.edge(cell::POINTS_PER_CELL)).is_coarse)
    };
    let edge = density.edge(POINTS_PER_CELL);
    let (grid, distinct) = sort(edge, &stage.part(0.0..0.5))?;
    let found = noise(&grid, normals, 1.0)?;
    if found <= LARGEST_NOISE {
        let slack = slack(&grid)?;
        return Ok(Cubes { grid, distinct, edge, noise: found, slack });
    }
    let mut scale = ENLARGEMENT;
    // The largest are taken whatever their noise.
    while scale < LARGEST && noise(&grid, normals, scale)? > LARGEST_NOISE {
        scale *= ENLARGEMENT;
    }
    drop((grid, distinct));
    let edge = f64::from(scale) * edge;
    let (grid, distinct) = sort(edge, &stage.part(0.5..1.0))?;
    let (noise, slack) = (noise(&grid, normals, 1.0)?, slack(&grid)?);
    Ok(Cubes { grid, distinct, edge, noise, slack })
}

/// How many points of a cube do not coincide with the one before them.
fn distinct(points: &[Placed]) -> u32 {
    1 + points.windows(2).filter(|two| two[0].local != two[1].local).count() as u32
}

/// Bricks to look at: their cubes are enough for a median.
const BRICKS: usize = 64;

/// How far points lie off their surface, in edges: the deviation that half of some cubes do not exceed. The cubes are those of
/// some bricks, or `scale` times as large, as many as fit into a brick.
fn noise(grid: &Grid, normals: &[Vec3], scale: f32) -> Result<f32, Error> {
    let along = (BRICK as f32 / scale) as usize;
    let (mut cubes, mut gaps, mut deviations) = (vec![Vec::new(); along.pow(3)], Vec::new(), Vec::new());
    for brick in spread(grid.bricks.len(), BRICKS) {
        cubes.iter_mut().for_each(Vec::clear);
        for point in &grid.placed[grid.first_point[brick] as usize..grid.first_point[brick + 1] as usize] {
            let [x, y, z] = (point.local / scale).to_array().map(|c| c as usize);
            if x.max(y).max(z) < along {
                let points = &mut cubes[x + along * (y + along * z)];
                grow(points, 1, WHAT)?;
                points.push(*point);
            }
        }
        for points in &cubes {
            gaps.clear();
            grow(&mut gaps, points.len(), WHAT)?;
            deviations.extend(deviation(points, normals, &mut gaps));
        }
    }
    // In edges of the cubes looked at.
    Ok(median(&deviations) / scale)
}

/// How far points next to each other lie off a common sheet, in edges, if that is next to nothing: the median that half of some
/// cubes do not exceed. Steps of coarse coordinates are no sheets.
fn slack(grid: &Grid, normals: &[Vec3], is_coarse: &dyn Fn() -> bool) -> Result<Option<f32>, Error> {
    let (mut of_cubes, mut of_points) = (Vec::new(), Vec::new());
    for brick in spread(grid.bricks.len(), BRICKS) {
        for (points, _) in grid.cubes_of(brick) {
            of_points.clear();
            grow(&mut of_points, points.len(), WHAT)?;
            for two in points.windows(2) {
                let [one, other] = [0, 1].map(|i| normals[two[i].point as usize]);
                if are_alike(one, other) {
                    of_points.push(off_sheet(two[1].local - two[0].local, one, other).abs());
                }
            }
            if of_points.len() >= LEAST {
                of_cubes.push(median(&of_points));
            }
        }
    }
    Ok(Some(median(&of_cubes)).filter(|&slack| slack < EXACT && !is_coarse()))
}

/// How far two points, so far from each other, lie off a sheet that goes through both as their normals say: what lies between
/// two points of an evenly bent one is across the mean of their normals.
fn off_sheet(between: Vec3, one: Vec3, other: Vec3) -> f32 {
    0.5 * between.dot(one + aligned(other, one))
}

/// Fewer points lie on a plane in any case.
const LEAST: usize = 4;

/// That of the points of one cube, if they are enough to tell: of those with about the same normal, if these are half of them,
/// because across the faces of an edge all normals together have no direction.
///
/// From how far apart points are along the normal, one next to the other: both sides of a thin wall in one cube are no noise.
/// `gaps` comes empty, with room for all points.
fn deviation(points: &[Placed], normals: &[Vec3], gaps: &mut Vec<f32>) -> Option<f32> {
    if points.len() < LEAST {
        return None;
    }
    let own = |point: &Placed| normals[point.point as usize];
    let most = most_alike(points.iter().map(own));
    let chosen = || points.iter().filter(|point| most.is_none_or(|most| are_alike(most, own(point))));
    let normal = chosen().fold(Vec3::ZERO, |sum, point| sum + aligned(own(point), sum)).try_normalize()?;
    gaps.extend(chosen().map(|point| point.local.dot(normal)));
    Some(median::deviation(gaps))
}

/// The normal that most others are like, if half are. Of as many the one that is so in any order of the points.
fn most_alike(normals: impl ExactSizeIterator<Item = Vec3> + Clone) -> Option<Vec3> {
    /// To compare each of more with each would take too long: there may be any number.
    const MANY: usize = 64;
    let all = normals.len();
    if all > MANY {
        return None;
    }
    let (mut first, mut most) = (Vec3::ZERO, 0);
    for one in normals.clone() {
        let count = normals.clone().filter(|other| are_alike(one, *other)).count();
        if count > most || count == most && one.to_array() > first.to_array() {
            (first, most) = (one, count);
        }
        if most == all {
            break;
        }
    }
    (most >= all.div_ceil(2).max(LEAST)).then_some(first)
}

/// Whether two normals differ by up to 45 degrees, as those of one surface do in noise.
fn are_alike(one: Vec3, other: Vec3) -> bool {
    one.dot(other).powi(2) >= 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The deviation of points on the faces of a corner, each on the one that `face` says.
    fn on_faces(face: impl Fn(u32) -> u32) -> f32 {
        let all = (0..16).map(|i| {
            let [a, b] = [i * 5 % 16, i * 7 % 16].map(|c| c as f32 / 16.0);
            let (local, normal) = match face(i) {
                0 => (Vec3::new(0.0, a, b), Vec3::X),
                1 => (Vec3::new(a, 0.0, b), Vec3::Y),
                _ => (Vec3::new(a, b, 0.0), -Vec3::Z),
            };
            (Placed { local, point: i }, normal)
        });
        let (points, normals): (Vec<Placed>, Vec<Vec3>) = all.unzip();
        deviation(&points, &normals, &mut Vec::new()).unwrap()
    }

    #[test]
    fn the_faces_of_an_edge_are_no_noise() {
        assert_eq!(on_faces(|_| 2), 0.0);
        assert_eq!(on_faces(|i| u32::from(i % 3 == 0)), 0.0);
        // Where half of them have not about the same normal it is that of all.
        assert!(on_faces(|i| i % 3) > 0.1);
    }
}
