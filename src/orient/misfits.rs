//! Points in the patch of a surface that they are not on, in clouds without noise, once surfaces have signs.
//!
//! Of two surfaces that nearly touch, or meet at a sharp edge, a cube may hold too few points of one for a patch of their own: they
//! join that of the other one, or are so few that nothing tells which side they face. Where the two face apart, each point is asked
//! here on which it lies. On one sheet, if it bends evenly, what lies between two points is across the mean of their normals
//! ([`super::sheets`]).

use super::cubes::Cubes;
use super::patches::{Members, Membership, Patches, aligned};
use super::signs::Signs;
use crate::bricks::set_bits;
use crate::error::Error;
use crate::grid::Grid;
use crate::lists::grow;
use crate::points::Points;
use crate::progress::Stage;
use crate::surroundings::{Places, Surroundings};
use glam::Vec3;

/// What errors call the memory of all this.
const WHAT: &str = "the misfits";

/// Patches face apart if the cosine is less, 120 degrees and more; so do none if all are within half of that of one.
const APART: f32 = -0.5;
const HALF_APART: f32 = 0.5;

/// Points are in doubt whose [`Oriented::off`] from the mean of their patch is so much more or less than that of the others, and
/// those of patches of fewer.
const DOUBT: f32 = 0.006;
const FEW: usize = 4;

/// Points are of one sheet, whichever way that faces, where the cosine of their normals is more.
const ALIKE: f32 = 0.7;

/// How many points on either side tell on which sheet one is: the nearest, up to so far away, in edges and squared.
const NEAREST: usize = 4;
const REACH: f32 = 2.25;

/// Added to the square of that distance: between two that nearly coincide lies nothing but rounding.
const SOFT: f32 = 0.001;

/// They tell if on average it lies off the one sheet by less than this share of what it lies off the other one, both squared, and
/// by no more than a sixth of how far away they are.
const CLEAR: f32 = 0.25;
const ON: f32 = 0.1;

/// How often points may turn: what others say of one may be wrong itself, and right in the next round.
const ROUNDS: usize = 4;

/// Where more points are near, none is asked: each looks at all of them.
const MOST: usize = 2048;

/// Turns the normals, which have their signs, of points that lie on the sheet of points that face the other way, and not on that of
/// those which face as they do; only where there is no noise. Up to [`ROUNDS`] passes over the patches; where those about a cube
/// face apart, each doubtful point of it looks at the points of the 27 cubes.
pub(super) fn turn(
    points: &Points,
    cubes: &Cubes,
    (patches, members): (&Patches, &Members),
    signs: &Signs,
    normals: &mut [Vec3],
    stage: &Stage,
) -> Result<(), Error> {
    if cubes.slack.is_none() {
        return Ok(());
    }
    for round in 0..ROUNDS {
        let share = |rounds: usize| rounds as f64 / ROUNDS as f64;
        let cloud =
            Cloud { points, normals, per_edge: (1.0 / cubes.edge) as f32, grid: &cubes.grid, patches, members, signs };
        let misfits = cloud.misfits(&stage.part(share(round)..share(round + 1)))?;
        if misfits.iter().all(Vec::is_empty) {
            break;
        }
        for point in misfits.into_iter().flatten() {
            // No negative zeros.
            normals[point as usize] = Vec3::ZERO - normals[point as usize];
        }
    }
    Ok(())
}

/// A cloud whose normals and patches have their signs.
struct Cloud<'a> {
    points: &'a Points<'a>,
    normals: &'a [Vec3],
    /// 1 / edge of a cube.
    per_edge: f32,
    grid: &'a Grid,
    patches: &'a Patches,
    members: &'a Members,
    signs: &'a Signs,
}

impl Cloud<'_> {
    /// The misfits of each block.
    fn misfits(&self, stage: &Stage) -> Result<Vec<Vec<u32>>, Error> {
        let grid = self.grid;
        stage.collect(grid.blocks.len(), WHAT, &|block| {
            let (mut surroundings, mut found) = (Surroundings::new(), Found::default());
            for brick in grid.blocks[block].clone() {
                surroundings.look(grid, brick);
                let all = surroundings.occupied.all().flat_map(|place| self.patches.of_cube(surroundings.cube(place)));
                let mut facing = all.map(|patch| self.signs.facing(self.patches, patch));
                let Some(one) = facing.next() else { continue };
                if facing.all(|other| one.dot(other) >= HALF_APART) {
                    continue;
                }
                for (cube, bit) in (grid.first_cube[brick] as usize..).zip(set_bits(grid.masks[brick])) {
                    self.ask((cube, bit), &surroundings, &mut found)?;
                }
            }
            Ok(found.misfits)
        })
    }

    /// Finds the misfits of a cube, which has a bit in its brick.
    fn ask(&self, (cube, bit): (usize, u32), surroundings: &Surroundings, found: &mut Found) -> Result<(), Error> {
        let Self { grid, patches, members, .. } = *self;
        let Found { own, near, misfits } = found;
        let near_bits = surroundings.occupied.near(bit);
        let cubes = || set_bits(near_bits).map(|near| surroundings.cube(Places::of_near(bit, near)));
        let others = || cubes().flat_map(|cube| patches.of_cube(cube)).map(|other| self.signs.facing(patches, other));
        let is_torn = |facing: Vec3| others().any(|other| facing.dot(other) < APART);
        near.clear();
        for (number, patch) in patches.of_cube(cube).enumerate() {
            let facing = self.signs.facing(patches, patch);
            if !is_torn(facing) {
                continue;
            }
            let count = cubes().map(|cube| grid.points_of(cube).len()).sum();
            if count > MOST {
                return Ok(());
            }
            let Some((first, _)) = members.of_cube(grid, cube).next() else { continue };
            let is_own = |membership: Membership| membership.patch().is_some_and(|(own, _)| own == number);
            own.clear();
            grow(own, grid.points_of(cube).len(), WHAT)?;
            let all = members.of_cube(grid, cube).filter(|&(_, membership)| is_own(membership));
            own.extend(all.map(|(point, _)| (point as u32, self.oriented(point, first))));
            keep_doubtful(own, facing);
            if near.is_empty() && !own.is_empty() {
                grow(near, count, WHAT)?;
                let all = cubes().flat_map(|cube| members.of_cube(grid, cube));
                near.extend(all.map(|(point, _)| self.oriented(point, first)));
            }
            grow(misfits, own.len(), WHAT)?;
            misfits.extend(own.iter().filter(|(_, one)| one.is_misfit(near)).map(|&(point, _)| point));
        }
        Ok(())
    }

    /// A point, as it lies to one near by: so differences are exact, and in edges squares are numbers, whatever the unit.
    fn oriented(&self, point: usize, origin: usize) -> Oriented {
        let positions = &self.points.positions;
        Oriented { place: self.per_edge * (positions[point] - positions[origin]), facing: self.normals[point] }
    }
}

/// What was found in some cubes, and room for the points of one.
#[derive(Default)]
struct Found {
    /// Those of a patch that are in doubt, with their numbers.
    own: Vec<(u32, Oriented)>,
    /// All of the 27 cubes, if they were asked for.
    near: Vec<Oriented>,
    /// The numbers of those that are to turn.
    misfits: Vec<u32>,
}

/// Keeps those of the points of a patch that lie off it, or all if they are few.
fn keep_doubtful(points: &mut Vec<(u32, Oriented)>, facing: Vec3) {
    if points.len() < FEW {
        return;
    }
    let share = 1.0 / points.len() as f32;
    let mean = Oriented { place: share * points.iter().map(|(_, one)| one.place).sum::<Vec3>(), facing };
    // Where it bends, all lie off a sheet through the mean.
    let bend = share * points.iter().map(|(_, one)| one.off(&mean)).sum::<f32>();
    points.retain(|(_, one)| (one.off(&mean) - bend).abs() >= DOUBT);
}

/// An oriented point, or the mean of some: where it is, in edges, and its normal.
struct Oriented {
    place: Vec3,
    facing: Vec3,
}

impl Oriented {
    /// Twice how far another one lies off a sheet that goes through both, in edges; that may face the other way there.
    fn off(&self, other: &Self) -> f32 {
        (other.place - self.place).dot(self.facing + aligned(other.facing, self.facing))
    }

    /// Whether it is not on the sheet of the points near by that face as it does, but on that of those which face the other way.
    fn is_misfit(&self, near: &[Self]) -> bool {
        let (mut same, mut opposite) = (Nearest::NONE, Nearest::NONE);
        for other in near {
            let square = other.place.distance_squared(self.place);
            let along = self.facing.dot(other.facing);
            // Nothing lies between two that coincide, as it does with itself.
            if along.abs() >= ALIKE && square <= REACH && square > 0.0 {
                let side = if along < 0.0 { &mut opposite } else { &mut same };
                side.add(square, self.off(other).powi(2) / (square + SOFT));
            }
        }
        opposite.mean() < ON.min(CLEAR * same.mean())
    }
}

/// The nearest of some points: the square of how far away they are, and of how far they lie off a sheet, as a share of that.
struct Nearest([(f32, f32); NEAREST]);

impl Nearest {
    const NONE: Self = Self([(f32::INFINITY, f32::INFINITY); NEAREST]);

    fn add(&mut self, square: f32, off: f32) {
        let mut one = (square, off);
        for other in &mut self.0 {
            // Of those that lie alike, as copies do, one speaks.
            if one == *other {
                return;
            }
            // Of two as near the same one first, in any order of the points.
            if one < *other {
                std::mem::swap(&mut one, other);
            }
        }
    }

    /// Infinite, if there are fewer.
    fn mean(&self) -> f32 {
        self.0.iter().map(|(_, off)| off).sum::<f32>() / NEAREST as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of two bowls that touch in their middle, one upon the other; the upper one faces down, the lower one up.
    fn bowls() -> Vec<Oriented> {
        let places = (0..60).map(|i| ((i * 7 % 60) as f32 / 30.0 - 1.0, (i * 11 % 61) as f32 / 30.0 - 1.0));
        let point = |(i, (x, y)): (usize, (f32, f32))| {
            let side = if i % 2 == 0 { -1.0 } else { 1.0 };
            let place = Vec3::new(x, y, -0.1 * side * (x * x + y * y));
            Oriented { place, facing: Vec3::new(0.2 * x, 0.2 * y, side).normalize() }
        };
        places.enumerate().map(point).collect()
    }

    #[test]
    fn a_point_that_faces_away_from_its_sheet_is_a_misfit() {
        let mut points = bowls();
        let near_the_touch = |one: &Oriented| (0.1..0.4).contains(&one.place.length());
        let some: Vec<usize> = (0..points.len()).filter(|&i| near_the_touch(&points[i])).collect();
        assert!(some.len() >= 3, "{}", some.len());
        for i in some {
            assert!(!points[i].is_misfit(&points), "{:?}", points[i].place);
            points[i].facing = -points[i].facing;
            assert!(points[i].is_misfit(&points), "{:?}", points[i].place);
            points[i].facing = -points[i].facing;
        }
    }

    #[test]
    fn nothing_is_a_misfit_of_one_sheet() {
        let upper: Vec<Oriented> = bowls().into_iter().step_by(2).collect();
        assert!(upper.iter().all(|one| !one.is_misfit(&upper)));
    }

    /// Nor where nothing faces as it does, if it is before or behind the others.
    #[test]
    fn a_point_off_a_sheet_is_no_misfit_of_it() {
        let upper: Vec<Oriented> = bowls().into_iter().step_by(2).collect();
        for height in [0.5, -0.5] {
            assert!(!Oriented { place: Vec3::new(0.1, 0.0, height), facing: Vec3::Z }.is_misfit(&upper));
        }
        assert!(Oriented { place: Vec3::new(0.1, 0.0, 0.001), facing: Vec3::Z }.is_misfit(&upper));
    }

    #[test]
    fn too_few_points_say_nothing_and_copies_are_one() {
        let mut nearest = Nearest::NONE;
        for i in 1..NEAREST {
            nearest.add(i as f32, 0.5);
            nearest.add(i as f32, 0.5);
        }
        assert_eq!(nearest.mean(), f32::INFINITY);
        nearest.add(0.5, 0.5);
        assert_eq!(nearest.mean(), 0.5);
        nearest.add(100.0, 7.0);
        assert_eq!(nearest.mean(), 0.5);
    }

    #[test]
    fn points_of_an_even_bend_are_in_no_doubt() {
        let upper = || bowls().into_iter().step_by(2).filter(|one| one.place.length() < 0.8);
        let mut points: Vec<(u32, Oriented)> = (0..).zip(upper()).collect();
        let count = points.len();
        assert!(count > 8);
        // One of the other sheet.
        points.push((
            1000,
            Oriented { place: Vec3::new(0.3, 0.0, -0.05), facing: Vec3::new(0.06, 0.0, -1.0).normalize() },
        ));
        keep_doubtful(&mut points, -Vec3::Z);
        assert!(points.iter().any(|&(point, _)| point == 1000) && points.len() < count, "{}", points.len());
        let mut few: Vec<(u32, Oriented)> = (0..).zip(upper().take(FEW - 1)).collect();
        keep_doubtful(&mut few, -Vec3::Z);
        assert_eq!(few.len(), FEW - 1);
    }
}
