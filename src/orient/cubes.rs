//! The cubes whose points are parted into patches: so large that a noisy surface is no thicker than one.

use crate::cell::Density;
use crate::error::Error;
use crate::grid::{Grid, Placed};
use crate::lattice::{CUBES, Lattice};
use crate::median::median;
use crate::points::{Bounds, Points, spread};
use crate::progress::Stage;
use glam::Vec3;

/// Points in a cube: as many as tell noise from a wall.
const POINTS_PER_CELL: f64 = 16.0;

/// With more noise, in edges, the cubes are too small: points anywhere in a cube have 0.31.
const LARGEST_NOISE: f32 = 0.28;
const ENLARGEMENT: f64 = 1.25;
const ENLARGEMENTS: u32 = 3;

/// The cubes, and the noise in their edges. Sorts the points once, noisy ones up to four times.
pub(super) fn sort(
    points: &Points,
    normals: &[Vec3],
    bounds: &Bounds,
    density: &Density,
    stage: &Stage,
) -> Result<(Grid, f32), Error> {
    let mut edge = density.edge(POINTS_PER_CELL);
    let mut enlargements = 0;
    loop {
        let start = f64::from(enlargements) / f64::from(ENLARGEMENTS + 1);
        let own = stage.part(start..start + 1.0 / f64::from(ENLARGEMENTS + 1));
        let lattice = Lattice::new(bounds, &|| density.middle, edge, CUBES);
        let (grid, _) = Grid::sort(points, &lattice, &own, |_, _| ())?;
        let noise = noise(&grid, normals);
        if noise <= LARGEST_NOISE || enlargements == ENLARGEMENTS {
            return Ok((grid, noise));
        }
        edge *= ENLARGEMENT;
        enlargements += 1;
    }
}

/// How far points lie off their surface, in edges: the deviation that half of some cubes do not exceed.
fn noise(grid: &Grid, normals: &[Vec3]) -> f32 {
    /// Bricks to look at: their cubes are enough for a median.
    const BRICKS: usize = 256;
    let mut gaps = Vec::new();
    let bricks = spread(grid.bricks.len(), BRICKS);
    let cubes = bricks.flat_map(|brick| grid.cubes_of(brick));
    let deviations: Vec<f32> = cubes.filter_map(|(points, _)| deviation(points, normals, &mut gaps)).collect();
    median(&deviations)
}

/// That of the points of one cube, if they are enough to tell.
///
/// From how far apart points are along the normal, one next to the other: both sides of a thin wall in one cube are no noise.
fn deviation(points: &[Placed], normals: &[Vec3], gaps: &mut Vec<f32>) -> Option<f32> {
    /// Fewer points lie on a plane in any case.
    const LEAST: usize = 4;
    /// Of normally distributed points, the median of the gaps between neighbours times the number of points, in deviations.
    const GAPS: f32 = 2.2;
    if points.len() < LEAST {
        return None;
    }
    let mut normal = Vec3::ZERO;
    for point in points {
        let own = normals[point.point as usize];
        normal += if normal.dot(own) < 0.0 { -own } else { own };
    }
    let normal = normal.try_normalize()?;
    gaps.clear();
    gaps.extend(points.iter().map(|point| point.local.dot(normal)));
    gaps.sort_unstable_by(f32::total_cmp);
    for i in 1..gaps.len() {
        gaps[i - 1] = gaps[i] - gaps[i - 1];
    }
    gaps.pop();
    Some(median(gaps) * points.len() as f32 / GAPS)
}
