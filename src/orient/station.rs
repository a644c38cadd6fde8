//! Clouds that one scanner took, and not from far: all their surfaces face the place where it stood.

use super::ball::Ball;
use super::components::{Decision, Side};
use super::cubes::Cubes;
use super::patches::{Patch, Patches, signed};
use super::place::{FACING, Place, explained, explained_by_normals, growth, thinning};
use super::signs::Signs;
use super::spots::{Spot, some_bricks};
use super::thinning::Thinning;
use crate::error::Error;
use crate::grid::Grid;
use crate::lattice::{BRICK, cube_bit};
use crate::lists::{filled, grow};
use glam::DVec3;

/// What errors call the memory of all this.
const WHAT: &str = "the station";

/// Fewer spots tell no law: a place, a level and two powers are fitted to them, and eight harmonics. A room has so many with some
/// 4000 points.
const LEAST_SPOTS: usize = 32;

/// Densities that neither nearness to the middle nor a direction explains by this share, are no scan's.
const LEAST_EXPLAINED: f64 = 0.1;

/// The power of the inverse square of the distance that densities go with: 1 but where the place is a guess, as between stations
/// that were joined, or where points are too few to be counted.
const LEAST_NEAR: f64 = 0.5;
const MOST_NEAR: f64 = 1.5;

/// The share of the variance of densities that is explained, times the power of the cosine that they go with, or one over that if
/// it is more than 1. Single scans have 0.16 and more, most of them 0.25, what was scanned from several places also less, and what
/// was covered evenly, from all sides, or more thinly along an axis, next to nothing.
const LEAST_CERTAINTY: f64 = 0.15;

/// How much nearness, twice the logarithm of the distance to base 2, deviates: where all is as far, nothing is told.
const LEAST_DEPTH: f64 = 0.42;

/// Of open ground distance and slant go together, so that their powers say nothing: if so much is explained by the law itself it
/// holds, too.
const ENOUGH: f64 = 0.85;

/// How badly densities may fit: single scans have 0.04 to 0.4, stations that were joined 0.16 to 0.4, and what was covered more
/// densely at one end often more.
const MOST_MISFIT: f64 = 0.42;

/// What is closed is a room only if the law holds where densities fit nearly best, of what may be places.
const NEARLY: f64 = 1.15;

/// The share that may face away, by wrong signs: from the middle, which is only near the scanner, and from where one may have
/// stood.
const MOST_AWAY: f64 = 0.15;
const MOST_AWAY_THERE: f64 = 0.08;

/// A component of which more than this share faces away, however it is turned, faces both ways. Of all it is no more than this
/// share.
const MIXED: f64 = 0.35;
const MOST_MIXED: f64 = 0.2;

/// Patches of which it is asked whether others hide them, those of fewer points neither may be nor hide others.
const RAYS: usize = 500;
const LEAST_POINTS: u32 = 4;

/// So near, in edges, a ray still comes out of its own surface; farther than the second it is not followed, as to strays.
const OWN: f64 = 4.0;
const REACH: f64 = 1000.0;

/// The share of them that may be hidden.
const MOST_HIDDEN: f64 = 0.3;

/// By that much less doubt, of misfit and of what faces away or is hidden, the better one of two places on either side of it is
/// told.
const CLEAR: f64 = 0.03;

/// Where a scanner stood.
///
/// If there is a place by which densities are explained, from which little hides another thing, and which nearly all faces once
/// some surfaces are turned, the cloud is taken for a single scan: also if its surfaces enclose the place, as those of a room
/// do and those of an object that was seen from outside, so that nothing else tells the two apart.
pub(super) struct Station {
    /// In edges.
    place: DVec3,
    /// How certain it is, up to 1.
    certainty: f64,
}

impl Station {
    /// That of a cloud, if it is a single scan. One pass over the cubes, and some over a few of them.
    ///
    /// What is closed has no scanner beside it, and its middle is on no surface: there the law must hold, too, and where densities
    /// fit best.
    pub fn of(
        spots: &[Spot],
        ball: &Ball,
        Cubes { grid, distinct, .. }: &Cubes,
        patches: &Patches,
        signs: &Signs,
        is_closed: bool,
    ) -> Result<Option<Self>, Error> {
        if spots.len() < LEAST_SPOTS {
            return Ok(None);
        }
        let middle = middle(ball, grid, distinct);
        let about = thinning(spots, middle, 0.0);
        // NaN, where nothing tells them, is not.
        let may_be_amid = about.near >= LEAST_NEAR && about.explained >= LEAST_EXPLAINED;
        let (towards, by_growth) = growth(spots);
        let may_be_beside = by_growth >= LEAST_EXPLAINED;
        if !may_be_amid && !may_be_beside {
            return Ok(None);
        }
        if is_closed && law(spots, middle).is_none() {
            return Ok(None);
        }
        let samples = samples(ball, grid, patches, signs)?;
        let mut least_misfit = f64::INFINITY;
        let mut candidates = Vec::new();
        for Place { place, misfit, .. } in Place::all(spots, middle, towards) {
            least_misfit = least_misfit.min(misfit);
            let Sides { away, mixed } = Sides::of(&samples, signs.components, place)?;
            let most_away = if place == middle { MOST_AWAY } else { MOST_AWAY_THERE };
            if misfit > MOST_MISFIT || away > most_away || mixed > MOST_MIXED {
                continue;
            }
            let hidden = hidden(grid, patches, &samples, place);
            if hidden <= MOST_HIDDEN {
                grow(&mut candidates, 1, WHAT)?;
                candidates.push(Candidate { place, misfit, doubt: misfit + away.max(hidden), law: law(spots, place) });
            }
        }
        let best = |by_law: bool| {
            let candidates = candidates.iter().filter(|one| one.law.is_some() == by_law);
            candidates.min_by(|one, other| one.doubt.total_cmp(&other.doubt))
        };
        let found = if let Some(best) = best(true) {
            let is_room = candidates.iter().any(|one| one.law.is_some() && one.misfit <= NEARLY * least_misfit);
            best.law.filter(|_| !is_closed || is_room).map(|certainty| (best, certainty))
        } else if let Some(best) = best(false) {
            let is_told = |other: &Candidate| other.doubt >= best.doubt + CLEAR || !best.is_opposite(other, &samples);
            let certainty = explained(spots, best.place);
            let is_scan = !is_closed && certainty >= ENOUGH && candidates.iter().all(is_told);
            is_scan.then_some((best, certainty))
        } else {
            None
        };
        Ok(found.map(|(best, certainty)| Self { place: best.place, certainty }))
    }

    /// Turns everything to the scanner, patch by patch.
    pub fn turn_to_it(
        &self,
        grid: &Grid,
        patches: &Patches,
        signs: &mut Signs,
        decisions: &mut [Decision],
    ) -> Result<(), Error> {
        let cosine =
            |patch: &Patch, place: DVec3| patch.normal.as_dvec3().dot((self.place - place).normalize_or_zero());
        // For each component by how many points more it faces away.
        let mut away = filled(0.0, signs.components, WHAT)?;
        for (i, (patch, place)) in patches.places(grid).enumerate() {
            let is_away = signed(signs.flipped[i], cosine(patch, place)) < 0.0;
            away[signs.component[i] as usize] += signed(!is_away, f64::from(patch.points));
        }
        for (i, (patch, place)) in patches.places(grid).enumerate() {
            let along = cosine(patch, place);
            let with_surface = signs.flipped[i] ^ (away[signs.component[i] as usize] > 0.0);
            signs.flipped[i] = if along.abs() > FACING { along < 0.0 } else { with_surface };
        }
        for decision in decisions {
            (decision.component.side, decision.component.confidence) = (Side::View, self.certainty);
        }
        Ok(())
    }
}

/// A place that nearly all faces, and from which little is hidden.
struct Candidate {
    place: DVec3,
    misfit: f64,
    /// That, and the share that faces away or is hidden.
    doubt: f64,
    /// How certain it is by the law.
    law: Option<f64>,
}

impl Candidate {
    /// Whether most of what faces it faces away from another place.
    fn is_opposite(&self, other: &Self, samples: &[Sample]) -> bool {
        let side = |one: &Self, sample: &Sample| sample.normal.dot(one.place - sample.place) < 0.0;
        let opposite = samples.iter().filter(|sample| side(self, sample) != side(other, sample));
        2 * opposite.count() > samples.len()
    }
}

/// Near the scanner, if it is a scan: of points at the same angles from each other the mean, where the near ones count more.
fn middle(ball: &Ball, grid: &Grid, distinct: &[u32]) -> DVec3 {
    let (mut sum, mut all) = (DVec3::ZERO, 0.0);
    for (place, cube, _) in ball.bricks(grid).flat_map(|brick| grid.centres_of(brick)) {
        let points = f64::from(distinct[cube]);
        let weight = points * points.sqrt();
        sum += weight * place;
        all += weight;
    }
    sum / all
}

/// Whether densities go with the inverse square of the distance from a place and with the cosine, and not rather with the normals
/// alone, as those of an object do that was seen from round it; and how certain that is, up to 1.
fn law(spots: &[Spot], place: DVec3) -> Option<f64> {
    let Thinning { near, slant, depth, explained, .. } = thinning(spots, place, FACING);
    let certainty = explained * slant.min(1.0 / slant);
    // NaN, where nothing tells them, is none.
    let is_scan = (LEAST_NEAR..=MOST_NEAR).contains(&near) && depth >= LEAST_DEPTH && certainty >= LEAST_CERTAINTY;
    (is_scan && explained > explained_by_normals(spots, place)).then_some(certainty)
}

/// A patch that is looked at.
struct Sample {
    /// In edges.
    place: DVec3,
    /// As it was signed.
    normal: DVec3,
    points: u32,
    component: u32,
}

/// The patches of some bricks.
fn samples(ball: &Ball, grid: &Grid, patches: &Patches, signs: &Signs) -> Result<Vec<Sample>, Error> {
    let mut samples = Vec::new();
    for (centre, cube, _) in some_bricks(ball, grid).flat_map(|brick| grid.centres_of(brick)) {
        let own = patches.of_cube(cube);
        grow(&mut samples, own.len(), WHAT)?;
        samples.extend(own.map(|number| {
            let patch = &patches.all[number];
            let normal = signed(signs.flipped[number], patch.normal).as_dvec3();
            let place = centre + patch.centre.as_dvec3();
            Sample { place, normal, points: patch.points, component: signs.component[number] }
        }));
    }
    Ok(samples)
}

/// How surfaces face a place, once some are turned.
struct Sides {
    /// The share of the points that faces away.
    away: f64,
    /// And that belongs to what faces both ways.
    mixed: f64,
}

impl Sides {
    fn of(samples: &[Sample], components: usize, place: DVec3) -> Result<Self, Error> {
        // Points of each component that face the place, and that do not.
        let mut sides = filled([0.0, 0.0], components, WHAT)?;
        for sample in samples {
            let is_away = sample.normal.dot(place - sample.place) < 0.0;
            sides[sample.component as usize][usize::from(is_away)] += f64::from(sample.points);
        }
        let (mut away, mut mixed, mut all) = (0.0, 0.0, 0.0);
        for [one, other] in sides {
            let (own, less) = (one + other, f64::min(one, other));
            all += own;
            if less > MIXED * own {
                mixed += own;
            } else {
                away += less;
            }
        }
        Ok(Self { away: away / (all - mixed).max(1.0), mixed: mixed / all })
    }
}

/// The share of some patches that others hide from a place.
fn hidden(grid: &Grid, patches: &Patches, samples: &[Sample], place: DVec3) -> f64 {
    let (mut hidden, mut all) = (0.0, 0.0);
    for sample in samples.iter().step_by(samples.len().div_ceil(RAYS)) {
        let (from, distance) = (sample.place, sample.place.distance(place));
        let step = (place - from) / distance;
        if sample.points < LEAST_POINTS || sample.normal.dot(step).abs() < FACING {
            continue;
        }
        // Not as far as the scanner itself.
        let steps = (distance - OWN - 1.0).min(REACH) as u32;
        all += 1.0;
        hidden += f64::from((0..steps).any(|i| is_crossed(grid, patches, from + (OWN + f64::from(i)) * step, step)));
    }
    // None of them is seen from a place in a plane.
    if all > 0.0 { hidden / all } else { 1.0 }
}

/// Whether a ray crosses a patch of the cube of a place on it, no more than a step of an edge before or behind that.
fn is_crossed(grid: &Grid, patches: &Patches, place: DVec3, step: DVec3) -> bool {
    let cube = place.floor().as_ivec3();
    let brick = cube >> BRICK.trailing_zeros();
    let Some(number) = grid.bricks.number(brick).map(|number| number as usize) else { return false };
    let bit = cube_bit(cube - BRICK * brick);
    let is_occupied = grid.masks[number] >> bit & 1 == 1;
    let within = place - cube.as_dvec3() - 0.5;
    is_occupied
        && patches.all[patches.of_cube(grid.cube(number, bit) as usize)].iter().any(|patch: &Patch| {
            let normal = patch.normal.as_dvec3();
            let steps = normal.dot(patch.centre.as_dvec3() - within) / normal.dot(step);
            // And a little, for what lies on a face of it.
            let is_there = (within + steps * step).abs().max_element() <= 0.51;
            patch.points >= LEAST_POINTS && steps.abs() <= 1.0 && is_there
        })
}

#[cfg(test)]
mod tests {
    use super::super::place::tests::{STOOD, seen_from, walls};
    use super::*;
    use crate::lattice::{CUBES, Lattice};
    use crate::points::{Bounds, Points};
    use crate::progress::Progress;
    use crate::source::Source;
    use glam::{DVec2, Vec3};

    #[test]
    fn densities_tell_where_a_scanner_stood() {
        let about = |place: DVec3| law(&walls(|place, normal| seen_from(STOOD, place, normal)), place);
        assert!(about(STOOD).unwrap() > 0.99);
        assert!(about(STOOD + DVec3::new(4.0, 4.0, 2.0)).unwrap() < 0.95);
        assert_eq!(about(STOOD + DVec3::new(500.0, 0.0, 0.0)), None);
        // Covered evenly, but for chance, and the more thinly the nearer.
        let chance = |place: DVec3| 1.5 + (12.9898 * place.x + 78.233 * place.y + 37.719 * place.z).sin();
        assert_eq!(law(&walls(|place, _| chance(place)), STOOD), None);
        assert_eq!(law(&walls(|place, normal| 1.0 / seen_from(STOOD, place, normal)), STOOD), None);
    }

    /// How walls face a place, if each spot has the component and the sign that its number tells.
    fn sides(place: DVec3, of: impl Fn(usize) -> (u32, bool)) -> Sides {
        let sample = |(i, spot): (usize, Spot)| {
            let (component, is_flipped) = of(i);
            Sample { place: spot.place, normal: signed(is_flipped, spot.normal), points: 1, component }
        };
        let samples: Vec<Sample> = walls(|_, _| 1.0).into_iter().enumerate().map(sample).collect();
        Sides::of(&samples, 6, place).unwrap()
    }

    #[test]
    fn walls_face_what_is_between_them() {
        let is_near = |one: f64, other: f64| (one - other).abs() < 1e-9;
        // One surface, seen from without, and some wrong signs.
        for is_flipped in [false, true] {
            let Sides { away, mixed } = sides(STOOD, |i| (0, is_flipped ^ (i % 50 == 0)));
            assert!(is_near(away, 0.02) && mixed == 0.0, "{away} {mixed}");
        }
        // Each wall has its own sign, and mixed ones have none.
        let Sides { away, mixed } = sides(STOOD, |i| (i as u32 / 100, i / 100 % 2 == 0));
        assert!(away == 0.0 && mixed == 0.0, "{away} {mixed}");
        let Sides { mixed, .. } = sides(STOOD, |i| (i as u32 / 100, i < 100 && i % 2 == 0));
        assert!(is_near(mixed, 1.0 / 6.0), "{mixed}");
        // From beside the box the wall next to the place faces away from it.
        let Sides { away, .. } = sides(DVec3::new(50.0, 0.0, 0.0), |_| (0, false));
        assert!(is_near(away, 1.0 / 6.0), "{away}");
    }

    /// A level plane of points with 40 cubes along an edge, and its patches.
    fn plane() -> (Grid, Patches) {
        let at = |i: usize| 0.25 * (i as f32 + 0.5);
        let coordinates: Vec<f32> = (0..160 * 160).flat_map(|i| [at(i % 160), at(i / 160), 0.3]).collect();
        let points = Points::from_f32(&coordinates).unwrap();
        let lattice = Lattice::new(&Bounds::of(&points), &|| DVec3::ZERO, 1.0, CUBES);
        let stage = Progress::silent();
        let stage = stage.stage("test", 0.0..1.0);
        let (grid, _) = Grid::sort(&Source::new(&points, lattice), &stage, |_, _| ()).unwrap();
        let (patches, _) = Patches::of(&grid, &vec![Vec3::Z; 160 * 160], (0.0, Some(0.0)), &stage).unwrap();
        (grid, patches)
    }

    #[test]
    fn a_plane_hides_what_is_behind_it() {
        let (grid, patches) = plane();
        let (_, middle) =
            patches.places(&grid).find(|(_, place)| place.truncate().floor() == DVec2::splat(20.0)).unwrap();
        let samples = |height: f64, points: u32| {
            let place = |i: i32| middle + DVec3::new(f64::from(i % 5), f64::from(i / 5), height);
            let sample = |i| Sample { place: place(i), normal: DVec3::Z, points, component: 0 };
            (0..25).map(sample).collect::<Vec<_>>()
        };
        let above = middle + DVec3::new(3.0, -2.0, 9.0);
        let hidden = |samples: &[Sample], place: DVec3| hidden(&grid, &patches, samples, place);
        // But for a ray through the corners of cubes, which no step comes to.
        assert!(hidden(&samples(-9.0, 8), above) > 0.9);
        // In front of it, on it, seen from its own side, and past its end.
        assert_eq!(hidden(&samples(3.0, 8), above), 0.0);
        assert_eq!(hidden(&samples(0.0, 8), above), 0.0);
        assert_eq!(hidden(&samples(-9.0, 8), middle - DVec3::new(3.0, -2.0, 20.0)), 0.0);
        assert_eq!(hidden(&samples(-9.0, 8), middle + DVec3::new(400.0, 0.0, 99.0)), 0.0);
        // Of too few points, and all of it too flat.
        assert_eq!(hidden(&samples(-9.0, 3), above), 1.0);
        assert_eq!(hidden(&samples(3.0, 8), middle + DVec3::new(400.0, 0.0, 3.0)), 1.0);
    }
}
