//! Where nearly all of a cloud lies: what is far off it may be strays, and tells nothing of the whole.

use crate::grid::Grid;
use crate::lattice::BRICK;
use crate::median::ranked_runs;
use glam::{DVec3, IVec3};

/// The share of the points that may stray: raw scans have echoes of birds, dust and the sun, and what mirrors show, mostly less
/// than one in fifty.
pub(super) const STRAYS: f64 = 0.03;

/// What is no more than so many times as far as nearly all points is not far off: even if it strays, it weighs little
/// more in a fit than the farthest of the rest.
const FAR_OFF: f64 = 2.0;

/// A ball round the middle of a cloud.
pub(super) struct Ball {
    /// In edges, as all of it.
    pub middle: DVec3,
    radius: f64,
}

impl Ball {
    /// That of a cloud, by ranks: whatever a few points do, it holds the others and is no larger than twice what they take. Some
    /// passes over the cubes, whose points are those of `distinct`.
    pub fn of(grid: &Grid, distinct: &[u32]) -> Self {
        let bricks = || grid.bricks.places.iter().zip(grid.first_cube.windows(2));
        let points =
            |range: &[u32]| distinct[range[0] as usize..range[1] as usize].iter().map(|&points| points as usize).sum();
        let all: usize = bricks().map(|(_, range)| points(range)).sum();
        let median = |axis: usize| {
            // No place is negative.
            ranked_runs(bricks().map(|(place, range)| (place[axis] as u32, points(range))), all / 2) as i32
        };
        let middle = IVec3::new(median(0), median(1), median(2));
        // Square distances are whole numbers, too, but may be large ones.
        let square = |place: IVec3| (place - middle).as_vec3().length_squared();
        let squares = bricks().map(|(&place, range)| (square(place).to_bits(), points(range)));
        let square = f32::from_bits(ranked_runs(squares, ((1.0 - STRAYS) * all as f64) as usize));
        // And a brick, because where in it points lie is not asked.
        let radius = FAR_OFF * f64::from(square).sqrt() + 1.0;
        Self { middle: f64::from(BRICK) * (middle.as_dvec3() + 0.5), radius: f64::from(BRICK) * radius }
    }

    /// How far from the middle nearly all of it lies, in edges.
    pub fn reach(&self) -> f64 {
        self.radius / FAR_OFF
    }

    /// Whether a place is not far off.
    pub fn holds(&self, place: DVec3) -> bool {
        place.distance_squared(self.middle) <= self.radius * self.radius
    }

    /// The numbers of the bricks that are not far off.
    pub fn bricks<'a>(&'a self, grid: &'a Grid) -> impl Iterator<Item = usize> + Clone + 'a {
        let middle = |brick: usize| f64::from(BRICK) * (grid.bricks.places[brick].as_dvec3() + 0.5);
        (0..grid.bricks.len()).filter(move |&brick| self.holds(middle(brick)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Placed;
    use crate::lattice::{CUBES, Lattice};
    use crate::points::{Bounds, Points};
    use crate::progress::Progress;
    use crate::source::Source;

    /// A row of 1000 points over 100 cubes, and these beside it, all in edges; the cubes begin at -8.
    fn ball_round(strays: &[f32]) -> (Grid, Ball) {
        let row = (0..1000).map(|i| 0.1 * i as f32);
        let coordinates: Vec<f32> =
            [-8.0].into_iter().chain(row).chain(strays.iter().copied()).flat_map(|x| [x, 0.0, 0.0]).collect();
        let points = Points::from_f32(&coordinates).unwrap();
        let lattice = Lattice::new(&Bounds::of(&points), &|| DVec3::ZERO, 1.0, CUBES);
        let stage = Progress::silent();
        let stage = stage.stage("test", 0.0..1.0);
        let count = |points: &[Placed], _| points.len() as u32;
        let (grid, points) = Grid::sort(&Source::new(&points, lattice), &stage, count).unwrap();
        let ball = Ball::of(&grid, &points);
        (grid, ball)
    }

    #[test]
    fn a_few_points_do_not_move_it() {
        for strays in [&[][..], &[1e4], &[1e6; 25], &[300.0; 25]] {
            let (grid, ball) = ball_round(strays);
            let at = |x: f64| DVec3::new(x + 8.0, 0.0, 0.0);
            assert!([0.0, 50.0, 100.0, -20.0, 120.0].into_iter().all(|x| ball.holds(at(x))), "{strays:?}");
            assert!([-100.0, 200.0, 1e4].into_iter().all(|x| !ball.holds(at(x))), "{strays:?}");
            // Of four cubes along an axis: that of the first point, and 25 of the row.
            assert_eq!(ball.bricks(&grid).count(), 26, "{strays:?}");
        }
    }

    #[test]
    fn what_more_points_share_is_no_stray() {
        let (grid, ball) = ball_round(&[1e3; 100]);
        assert_eq!(ball.bricks(&grid).count(), grid.bricks.len());
    }
}
