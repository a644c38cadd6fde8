//! Points with the normal of a surface that they are not on, in clouds without noise, once surfaces have signs.
//!
//! Of two surfaces that nearly touch, or meet at an edge, a cube may hold too few points of one for a patch of their own: they
//! join that of the other one, or are so few that nothing tells which side they face. And next to an edge a point may have the
//! line of the face beyond, or one between the two. Where surfaces face apart, each point is asked here on which it lies, by
//! the points next to it ([`super::fits`]).

use super::cubes::Cubes;
use super::fits::{ALIKE, Fits, Oriented, REACH, SOFT};
use super::patches::{Members, Membership, Patches};
use super::signs::Signs;
use crate::bricks::set_bits;
use crate::error::Error;
use crate::grid::Grid;
use crate::lists::{filled, grow};
use crate::points::Points;
use crate::progress::Stage;
use crate::surroundings::{Places, Surroundings};
use glam::Vec3;
use std::ops::Range;

/// What errors call the memory of all this.
const WHAT: &str = "the misfits";

/// Patches face apart if the cosine is less, 37 degrees and more; so do none if all are within half of that of one.
const APART: f32 = 0.8;
const HALF_APART: f32 = 0.95;

/// Points are in doubt whose [`Oriented::off`] from the mean of their patch is so much more or less than that of the others,
/// those that lie no further off the plane of a patch that faces apart, within an edge, and those of patches of fewer.
const DOUBT: f32 = 0.006;
const FEW: usize = 4;

/// But their lines are right where those next to one lie off its sheet by less than half this share of how far away they are,
/// squared, and what differs by less, squared, is no other line.
const RIGHT: f32 = 1e-9;
const UNCHANGED: f32 = 1e-7;

/// How many points on either side tell on which sheet one is: the nearest.
const NEAREST: usize = 4;

/// They tell if on average it lies off the one sheet by less than this share of what it lies off the other one, both squared,
/// and by no more than a sixth of how far away they are.
const CLEAR: f32 = 0.25;
const ON: f32 = 0.1;

/// How often points are asked: what others say of one may be wrong itself, and right in the next round.
const ROUNDS: usize = 4;

/// Where more than one in so many points got another line edges are everywhere, and another round would find as many.
const TANGLE: usize = 50;

/// Where more points are near, none is asked: each looks at all of them.
const MOST: usize = 2048;

/// Turns the normals, which have their signs, of points that lie on the sheet of points that face the other way, and not on
/// that of those which face as they do; only where there is no noise. If lines may change, other points whose normals do not
/// fit those next to them get that of the sheet that they lie on. Up to [`ROUNDS`] passes over the patches; where those about a
/// cube face apart, each doubtful point of it looks at the points of the 27 cubes.
pub(super) fn mend(
    points: &Points,
    cubes: &Cubes,
    (patches, members): (&Patches, &Members),
    signs: &Signs,
    lines_may_change: bool,
    normals: &mut [Vec3],
    stage: &Stage,
) -> Result<(), Error> {
    if cubes.slack.is_none() {
        return Ok(());
    }
    let (grid, per_edge) = (&cubes.grid, (1.0 / cubes.edge) as f32);
    let mut changes = None;
    for round in 0..ROUNDS {
        let share = |rounds: usize| rounds as f64 / ROUNDS as f64;
        let cloud = Cloud {
            points,
            normals,
            per_edge,
            grid,
            patches,
            members,
            signs,
            lines_may_change,
            changes: changes.as_ref(),
        };
        let misfits = cloud.misfits(&stage.part(share(round)..share(round + 1)))?;
        let all = || misfits.iter().flatten();
        for misfit in all() {
            // No negative zeros.
            normals[misfit.point as usize] = Vec3::ZERO + misfit.normal;
        }
        if all().next().is_none() || TANGLE * all().filter(|misfit| misfit.is_line).count() > normals.len() {
            break;
        }
        // Not beside those of the round before.
        drop(changes.take());
        let Changes { in_cube, of_point } = changes.insert(Changes {
            in_cube: filled(false, grid.cubes(), WHAT)?,
            of_point: filled(false, normals.len(), WHAT)?,
        });
        for misfit in all() {
            in_cube[misfit.cube as usize] = true;
            of_point[misfit.point as usize] = true;
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
    lines_may_change: bool,
    /// What changed in the round before, if there was one.
    changes: Option<&'a Changes>,
}

/// Which normals changed, and in which cubes.
struct Changes {
    in_cube: Vec<bool>,
    of_point: Vec<bool>,
}

impl Cloud<'_> {
    /// The misfits of each block.
    fn misfits(&self, stage: &Stage) -> Result<Vec<Vec<Misfit>>, Error> {
        let grid = self.grid;
        stage.collect(grid.blocks.len(), WHAT, &|block| {
            let (mut surroundings, mut found) = (Surroundings::new(), Found::default());
            for brick in grid.blocks[block].clone() {
                surroundings.look(grid, brick);
                if !surroundings.occupied.all().any(|place| self.is_stirred(surroundings.cube(place))) {
                    continue;
                }
                let all = surroundings.occupied.all().flat_map(|place| self.patches.of_cube(surroundings.cube(place)));
                let mut facing = all.map(|patch| self.signs.facing(self.patches, patch));
                let Some(one) = facing.next() else { continue };
                if facing.all(|other| one.dot(other) >= HALF_APART) {
                    continue;
                }
                found.gathered.clear();
                for (cube, bit) in (grid.first_cube[brick] as usize..).zip(set_bits(grid.masks[brick])) {
                    self.ask((cube, bit), &surroundings, &mut found)?;
                }
            }
            Ok(found.misfits)
        })
    }

    /// Whether normals of the points of a cube changed, or were not asked for.
    fn is_stirred(&self, cube: usize) -> bool {
        self.changes.is_none_or(|changes| changes.in_cube[cube])
    }

    /// Finds the misfits of a cube, which has a bit in its brick.
    fn ask(&self, (cube, bit): (usize, u32), surroundings: &Surroundings, found: &mut Found) -> Result<(), Error> {
        let Self { grid, patches, members, .. } = *self;
        let Found { gathered, own, near, changed, planes, fits, misfits } = found;
        let near_bits = surroundings.occupied.near(bit);
        let places = || set_bits(near_bits).map(|near| Places::of_near(bit, near));
        let cubes = || places().map(|place| surroundings.cube(place));
        if !cubes().any(|cube| self.is_stirred(cube)) {
            return Ok(());
        }
        near.clear();
        changed.clear();
        for (number, patch) in patches.of_cube(cube).enumerate() {
            let facing = self.signs.facing(patches, patch);
            planes.clear();
            for (place, cube) in places().zip(cubes()) {
                let centre = |other: usize| Places::centre(place) + patches.all[other].centre;
                let all = patches.of_cube(cube).map(|other| (other, self.signs.facing(patches, other)));
                let apart = all.filter(|(_, other)| facing.dot(*other) < APART);
                grow(planes, patches.of_cube(cube).len(), WHAT)?;
                planes.extend(apart.map(|(other, facing)| Oriented { place: centre(other), facing }));
            }
            if planes.is_empty() {
                continue;
            }
            let count = cubes().map(|cube| grid.points_of(cube).len()).sum();
            if count > MOST {
                return Ok(());
            }
            let gathered_at =
                |place: usize, gathered: &mut Gathered| gathered.at(place, surroundings.cube(place), self);
            let range = gathered_at(Places::of_cube(bit), gathered)?;
            let Some(&(Oriented { place: origin, .. }, _)) = gathered.all.get(range.start) else { continue };
            // As they lie to one of them: so differences are exact, and in edges squares are numbers, whatever the unit.
            let local = |one: &Oriented| Oriented { place: self.per_edge * (one.place - origin), facing: one.facing };
            let is_own = |membership: Membership| membership.patch().is_some_and(|(own, _)| own == number);
            own.clear();
            grow(own, range.len(), WHAT)?;
            let all = members.of_cube(grid, cube).zip(&gathered.all[range]).filter(|((_, member), _)| is_own(*member));
            own.extend(all.map(|((point, _), (one, _))| (point as u32, local(one))));
            keep_doubtful(own, facing, Places::centre(Places::of_cube(bit)) + patches.all[patch].centre, planes);
            if near.is_empty() && !own.is_empty() {
                grow(near, count, WHAT)?;
                grow(changed, count, WHAT)?;
                for place in places() {
                    let range = gathered_at(place, gathered)?;
                    let all = &gathered.all[range];
                    near.extend(all.iter().map(|(one, _)| local(one)));
                    changed.extend(all.iter().filter(|(_, has_changed)| *has_changed).map(|(one, _)| local(one).place));
                }
            }
            if self.changes.is_some() {
                // Of the others what tells is as it was.
                own.retain(|(_, one)| changed.iter().any(|place| place.distance_squared(one.place) <= REACH));
            }
            grow(misfits, own.len(), WHAT)?;
            for (point, one) in &*own {
                let fits = self.lines_may_change.then_some(&mut *fits);
                if let Some((normal, is_line)) = better(one, near, fits)? {
                    misfits.push(Misfit { cube: cube as u32, point: *point, normal, is_line });
                }
            }
        }
        Ok(())
    }
}

/// The points of the cubes in and round a brick, each cube once: they are anywhere in the input, and asked for by all cubes round.
struct Gathered {
    /// As they are in the input, and whether their normals changed in the round before.
    all: Vec<(Oriented, bool)>,
    /// Where those of a place in [`Surroundings`] begin and end; nowhere if they were not asked for.
    of_place: [(u32, u32); Places::COUNT],
}

impl Gathered {
    fn clear(&mut self) {
        self.all.clear();
        self.of_place.fill((0, 0));
    }

    /// Those of a cube, which is at this place.
    fn at(&mut self, place: usize, cube: usize, cloud: &Cloud) -> Result<Range<usize>, Error> {
        let Self { all, of_place } = self;
        if of_place[place].1 == 0 {
            let start = all.len() as u32;
            grow(all, cloud.grid.points_of(cube).len(), WHAT)?;
            all.extend(cloud.members.of_cube(cloud.grid, cube).map(|(point, _)| {
                let one = Oriented { place: cloud.points.positions[point], facing: cloud.normals[point] };
                (one, cloud.changes.is_some_and(|changes| changes.of_point[point]))
            }));
            of_place[place] = (start, all.len() as u32);
        }
        let (start, end) = of_place[place];
        Ok(start as usize..end as usize)
    }
}

impl Default for Gathered {
    fn default() -> Self {
        Self { all: Vec::new(), of_place: [(0, 0); Places::COUNT] }
    }
}

/// What was found in some cubes, and room for the points of one.
#[derive(Default)]
struct Found {
    gathered: Gathered,
    /// Those of a patch that are in doubt, with their numbers.
    own: Vec<(u32, Oriented)>,
    /// All of the 27 cubes, if they were asked for.
    near: Vec<Oriented>,
    /// Where those of them are whose normals changed in the round before.
    changed: Vec<Vec3>,
    /// The patches of these that face apart from that one: their middles, in the brick, in edges, and which way they face.
    planes: Vec<Oriented>,
    fits: Fits,
    misfits: Vec<Misfit>,
}

/// A point that is on another sheet, and its normal there.
struct Misfit {
    cube: u32,
    point: u32,
    normal: Vec3,
    /// Whether its line is another one, too.
    is_line: bool,
}

/// Keeps those of the points of a patch, which has its middle there, that lie off it, or on a plane of others; all if they are
/// few.
fn keep_doubtful(points: &mut Vec<(u32, Oriented)>, facing: Vec3, middle: Vec3, planes: &[Oriented]) {
    if points.len() < FEW {
        return;
    }
    let share = 1.0 / points.len() as f32;
    let mean = Oriented { place: share * points.iter().map(|(_, one)| one.place).sum::<Vec3>(), facing };
    // Where it bends, all lie off a sheet through the mean.
    let bend = share * points.iter().map(|(_, one)| one.off(&mean)).sum::<f32>();
    let is_on = |plane: &Oriented, place: Vec3| {
        let offset = place - plane.place;
        offset.dot(plane.facing).abs() < DOUBT && offset.length_squared() < 1.0
    };
    points.retain(|(_, one)| {
        let place = middle + (one.place - mean.place);
        (one.off(&mean) - bend).abs() >= DOUBT || planes.iter().any(|plane| is_on(plane, place))
    });
}

/// The normal of the sheet that a point lies on, of those of the points near by, if it is not on that of those which face as it
/// does: the opposite of its own, if it is on that of those which face the other way, or by [`Fits`] whatever fits better, and
/// then `true`.
fn better(one: &Oriented, near: &[Oriented], fits: Option<&mut Fits>) -> Result<Option<(Vec3, bool)>, Error> {
    let (mut same, mut opposite) = (Nearest::NONE, Nearest::NONE);
    for other in near {
        let square = other.place.distance_squared(one.place);
        let along = one.facing.dot(other.facing);
        // Nothing lies between two that coincide, as it does with itself.
        if along.abs() >= ALIKE && square <= REACH && square > 0.0 {
            let side = if along < 0.0 { &mut opposite } else { &mut same };
            if side.has_room(square) {
                side.add(square, one.off(other).powi(2) / (square + SOFT));
            }
        }
    }
    let (own, limit) = (same.mean(), ON.min(CLEAR * same.mean()));
    if opposite.mean() < limit {
        return Ok(Some((-one.facing, false)));
    }
    let Some(fits) = fits.filter(|_| own >= RIGHT) else { return Ok(None) };
    let normal = fits.normal(one, near, limit)?;
    Ok(normal.filter(|normal| normal.distance_squared(one.facing) > UNCHANGED).map(|normal| (normal, true)))
}

/// The nearest of some points: the square of how far away they are, and of how far they lie off a sheet, as a share of that.
struct Nearest([(f32, f32); NEAREST]);

impl Nearest {
    const NONE: Self = Self([(f32::INFINITY, f32::INFINITY); NEAREST]);

    /// Whether one so far away is among them.
    fn has_room(&self, square: f32) -> bool {
        square <= self.0[NEAREST - 1].0
    }

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
            assert_eq!(better(&points[i], &points, None), Ok(None), "{:?}", points[i].place);
            points[i].facing = -points[i].facing;
            assert_eq!(
                better(&points[i], &points, None),
                Ok(Some((-points[i].facing, false))),
                "{:?}",
                points[i].place
            );
            points[i].facing = -points[i].facing;
        }
    }

    #[test]
    fn nothing_is_a_misfit_of_one_sheet() {
        let upper: Vec<Oriented> = bowls().into_iter().step_by(2).collect();
        assert!(upper.iter().all(|one| better(one, &upper, None) == Ok(None)));
        // Nor do lines change that are right but for rounding.
        let mut fits = Fits::default();
        assert!(upper.iter().all(|one| {
            better(one, &upper, Some(&mut fits))
                .is_ok_and(|found| found.is_none_or(|(normal, _)| normal.dot(one.facing) > 0.9999))
        }));
    }

    /// Nor where nothing faces as it does, if it is before or behind the others.
    #[test]
    fn a_point_off_a_sheet_is_no_misfit_of_it() {
        let upper: Vec<Oriented> = bowls().into_iter().step_by(2).collect();
        let turned =
            |height: f32| better(&Oriented { place: Vec3::new(0.1, 0.0, height), facing: Vec3::Z }, &upper, None);
        assert_eq!([0.5, -0.5, 0.001].map(turned), [Ok(None), Ok(None), Ok(Some((-Vec3::Z, false)))]);
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

    /// On one bowl, with the normal of something across it.
    #[test]
    fn a_line_of_no_sheet_becomes_that_of_the_sheet() {
        let upper: Vec<Oriented> = bowls().into_iter().step_by(2).collect();
        let (place, truth) = (Vec3::new(0.2, 0.1, 0.005), Vec3::new(0.04, 0.02, -1.0).normalize());
        let mut fits = Fits::default();
        for facing in [Vec3::X, Vec3::new(0.6, 0.0, -0.8)] {
            let found = better(&Oriented { place, facing }, &upper, Some(&mut fits)).unwrap();
            assert!(
                found.is_some_and(|(normal, is_line)| is_line && normal.dot(truth) > 0.9999),
                "{facing}: {found:?}"
            );
            assert_eq!(better(&Oriented { place, facing }, &upper, None), Ok(None));
        }
    }

    #[test]
    fn points_on_the_plane_of_another_patch_are_in_doubt() {
        let on_floor = |x: f32| (0, Oriented { place: Vec3::new(x, 0.0, 0.0), facing: Vec3::Z });
        let wall = |x: f32, z: f32| Oriented { place: Vec3::new(x, 0.3, z), facing: Vec3::X };
        let doubtful = |wall: Oriented| {
            let mut points = [0.0, 0.2, 0.4, 0.6, 0.8].map(on_floor).into();
            keep_doubtful(&mut points, Vec3::Z, Vec3::new(0.4, 0.0, 0.0), &[wall]);
            points.iter().map(|(_, one)| one.place.x).collect::<Vec<f32>>()
        };
        assert_eq!(doubtful(wall(0.805, 0.5)), [0.8]);
        assert_eq!([wall(0.9, 0.5), wall(0.805, 1.1)].map(doubtful), [[], []]);
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
        let mean = points.iter().map(|(_, one)| one.place).sum::<Vec3>() / points.len() as f32;
        keep_doubtful(&mut points, -Vec3::Z, mean, &[]);
        assert!(points.iter().any(|&(point, _)| point == 1000) && points.len() < count, "{}", points.len());
        let mut few: Vec<(u32, Oriented)> = (0..).zip(upper().take(FEW - 1)).collect();
        keep_doubtful(&mut few, -Vec3::Z, Vec3::ZERO, &[]);
        assert_eq!(few.len(), FEW - 1);
    }
}
