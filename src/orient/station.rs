//! Clouds that one scanner took of what lay round it: all their surfaces face the place where it stood.

use super::components::{Decision, Side};
use super::patches::{Patch, Patches, signed};
use super::signs::Signs;
use super::thinning::Thinning;
use crate::bricks::set_bits;
use crate::error::Error;
use crate::grid::Grid;
use crate::lattice::{BRICK, cube_centre};
use crate::lists::{filled, grow, reserve};
use crate::power::log2;
use glam::{DVec3, DVec4};

/// What errors call the memory of all this.
const WHAT: &str = "the station";

/// Bricks of 4 x 4 x 4 cubes that are looked at, and how many groups of cubes these have at least: fewer tell no law.
const BRICKS: usize = 512;
const LEAST_SPOTS: usize = 100;

/// What is seen at a flatter angle, by its cosine, tells no density.
const FACING: f64 = 0.3;

/// The power of the inverse square of the distance that densities go with: 1 but for rows of points far apart, and because the
/// place is a guess; single scans, made and real, have 0.58 to 1.05.
const LEAST_NEAR: f64 = 0.5;
const MOST_NEAR: f64 = 1.5;

/// The share of the variance of densities that is explained, times the power of the cosine that they go with, or one over that if
/// it is more than 1. Single scans have 0.2 and more, what was scanned from several places also less, and what was covered evenly,
/// from all sides, or more thinly along an axis, next to nothing.
const LEAST_CERTAINTY: f64 = 0.15;

/// Cubes of fewer points hold strays: these lie thinly round what they stray from, as if it were near the scanner.
const LEAST_POINTS: f64 = 2.0;

/// How much nearness, twice the logarithm of the distance to base 2, deviates: where all is as far, nothing is told.
const LEAST_DEPTH: f64 = 0.4;

/// Places that are tried. The search begins near the scanner: to be a mean distance off counts so many times as much as what
/// may face away at the most.
const ROUNDS: usize = 12;
const FAR: f64 = 1.0;

/// The share that may face away, by wrong signs: with less than the first no better place is looked for.
const ENOUGH: f64 = 0.02;
const MOST_AWAY: f64 = 0.15;

/// A component of which more than this share faces away, however it is turned, faces both ways. Of all it is no more than this
/// share.
const MIXED: f64 = 0.25;
const MOST_MIXED: f64 = 0.2;

/// What faces the scanner or away from it by no more than this cosine is turned with its surface.
const GRAZING: f64 = 0.15;

/// Where a scanner stood.
///
/// It sends its rays in all directions alike, so of a surface that is twice as far it takes a quarter as many points, and fewer of
/// what is slanted. Where densities follow this law about the middle of the points, most of which are near, the cloud is taken for
/// a single scan: also if its surfaces enclose the place, as those of a room do and those of an object that was seen from
/// outside, so that nothing else tells the two apart.
pub(super) struct Station {
    /// In edges.
    place: DVec3,
    /// How certain it is, up to 1.
    certainty: f64,
}

impl Station {
    /// That of a cloud, if it is a single scan. Looks at some of the cubes only, often where it is one.
    pub fn of(grid: &Grid, patches: &Patches, signs: &Signs) -> Result<Option<Self>, Error> {
        let step = grid.bricks.len().div_ceil(BRICKS).max(1);
        let spots = spots(grid, patches, step)?;
        if spots.len() < LEAST_SPOTS {
            return Ok(None);
        }
        let middle = middle(grid);
        let Some(certainty) = law(&spots, middle) else { return Ok(None) };
        let mut samples = samples(grid, patches, signs, step)?;
        Ok(faced(&mut samples, middle)?.map(|place| Self { place, certainty }))
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
            signs.flipped[i] = if along.abs() > GRAZING { along < 0.0 } else { with_surface };
        }
        for decision in decisions {
            (decision.component.side, decision.component.confidence) = (Side::View, self.certainty);
        }
        Ok(())
    }
}

/// What is known of 2 x 2 x 2 cubes: one alone may just be touched by the surface.
struct Spot {
    /// The middle of the points, in edges.
    place: DVec3,
    /// That of the largest patch.
    normal: DVec3,
    /// Points of an occupied cube.
    density: f64,
}

/// Sums over 2 x 2 x 2 cubes.
#[derive(Clone, Copy, Default)]
struct Group {
    cubes: f64,
    points: f64,
    /// Of the places of all points.
    sum: DVec3,
    /// Points of the largest patch, and its normal.
    largest: u32,
    normal: DVec3,
}

/// The occupied cubes of a brick: the middle of each, in edges, its number, and its bit.
fn cubes_of(grid: &Grid, brick: usize) -> impl Iterator<Item = (DVec3, usize, u32)> {
    let corner = (BRICK * grid.bricks.places[brick]).as_dvec3();
    let cubes = set_bits(grid.masks[brick]).zip(grid.first_cube[brick] as usize..);
    cubes.map(move |(bit, cube)| (corner + cube_centre(bit).as_dvec3(), cube, bit))
}

/// Near the scanner, if it is a scan: of points at the same angles from each other the mean, where the near ones count more.
fn middle(grid: &Grid) -> DVec3 {
    let (mut sum, mut all) = (DVec3::ZERO, 0.0);
    for (place, cube, _) in (0..grid.bricks.len()).flat_map(|brick| cubes_of(grid, brick)) {
        let points = grid.points_of(cube).len() as f64;
        let weight = points * points.sqrt();
        sum += weight * place;
        all += weight;
    }
    sum / all
}

/// Those of every `step`th brick.
fn spots(grid: &Grid, patches: &Patches, step: usize) -> Result<Vec<Spot>, Error> {
    let mut spots = Vec::new();
    for brick in (0..grid.bricks.len()).step_by(step) {
        let mut groups = [Group::default(); 8];
        for (centre, cube, bit) in cubes_of(grid, brick) {
            let group = &mut groups[(bit >> 1 & 1 | bit >> 2 & 2 | bit >> 3 & 4) as usize];
            group.cubes += 1.0;
            for patch in &patches.all[patches.of_cube(cube)] {
                let points = f64::from(patch.points);
                group.points += points;
                group.sum += points * (centre + patch.centre.as_dvec3());
                if patch.points > group.largest {
                    (group.largest, group.normal) = (patch.points, patch.normal.as_dvec3());
                }
            }
        }
        grow(&mut spots, groups.len(), WHAT)?;
        spots.extend(groups.iter().filter(|group| group.points > 0.0).map(|group| Spot {
            place: group.sum / group.points,
            normal: group.normal,
            density: group.points / group.cubes,
        }));
    }
    Ok(spots)
}

/// The patches of every `step`th brick.
fn samples(grid: &Grid, patches: &Patches, signs: &Signs, step: usize) -> Result<Vec<Sample>, Error> {
    let mut samples = Vec::new();
    for (centre, cube, _) in (0..grid.bricks.len()).step_by(step).flat_map(|brick| cubes_of(grid, brick)) {
        let own = patches.of_cube(cube);
        grow(&mut samples, own.len(), WHAT)?;
        samples.extend(own.map(|number| {
            let patch = &patches.all[number];
            let normal = signed(signs.flipped[number], patch.normal).as_dvec3();
            let place = centre + patch.centre.as_dvec3();
            Sample { place, normal, points: patch.points.into(), component: signs.component[number] }
        }));
    }
    Ok(samples)
}

/// A patch that is looked at.
struct Sample {
    /// In edges.
    place: DVec3,
    /// As it was signed.
    normal: DVec3,
    points: f64,
    component: u32,
}

/// Whether densities go with the inverse square of the distance from a place and with the cosine, and how certain that is, up
/// to 1.
fn law(spots: &[Spot], place: DVec3) -> Option<f64> {
    let Thinning { near, slant, depth, explained, .. } = Thinning::of(|| {
        spots.iter().filter_map(|spot| {
            let ray = place - spot.place;
            let distance = ray.length();
            let cosine = spot.normal.dot(ray).abs() / distance;
            // Nor in the very place.
            (cosine >= FACING && spot.density >= LEAST_POINTS)
                .then(|| DVec3::new(log2(spot.density), -2.0 * log2(distance), log2(cosine)))
        })
    });
    let certainty = explained * slant.min(1.0 / slant);
    // Not so where nothing tells them, and they are no numbers.
    let is_scan = (LEAST_NEAR..=MOST_NEAR).contains(&near) && depth >= LEAST_DEPTH && certainty >= LEAST_CERTAINTY;
    is_scan.then_some(certainty)
}

/// The place that nearly all patches face, once some surfaces are turned, if there is one; found from `middle` on. As a
/// perceptron learns (Rosenblatt, 1958), in homogeneous coordinates: `normal . (place - p) > 0`.
fn faced(samples: &mut [Sample], middle: DVec3) -> Result<Option<DVec3>, Error> {
    // Component by component.
    samples.sort_unstable_by_key(|sample| sample.component);
    let mut runs = Vec::new();
    reserve(&mut runs, samples.len(), WHAT)?;
    runs.extend(samples.chunk_by(|one, next| one.component == next.component));
    let all: f64 = samples.iter().map(|sample| sample.points).sum();
    let distances = samples.iter().map(|sample| sample.points * sample.place.distance(middle));
    let unit = distances.sum::<f64>() / all;
    let facing = |sample: &Sample| sample.normal.extend(-sample.normal.dot(sample.place - middle) / unit);
    let mut scanner = DVec4::W;
    let mut best = (f64::INFINITY, scanner);
    for _ in 0..ROUNDS {
        let (mut missed, mut all_away, mut mixed) = (DVec4::ZERO, 0.0, 0.0);
        for run in &runs {
            // Points that face the place, and those that do not; what is missing to these.
            let mut sides = [(0.0, DVec4::ZERO); 2];
            for sample in *run {
                let (facing, points) = (facing(sample), sample.points);
                let (count, sum) = &mut sides[usize::from(facing.dot(scanner) < 0.0)];
                *count += points;
                *sum += points * facing;
            }
            let [(towards, along), (away, against)] = sides;
            let (less, wanted) = if away > towards { (towards, -along) } else { (away, against) };
            missed += wanted;
            if less > MIXED * (towards + away) {
                mixed += towards + away;
            } else {
                all_away += less;
            }
        }
        let worst = (all_away / (MOST_AWAY * (all - mixed).max(1.0))).max(mixed / (MOST_MIXED * all));
        let cost = worst + FAR * scanner.truncate().length() / scanner.w;
        if worst <= 1.0 && cost < best.0 {
            best = (cost, scanner);
        }
        if all_away <= ENOUGH * all && mixed <= ENOUGH * all {
            break;
        }
        scanner = scanner.normalize() + 2.0 / all * missed;
        // Not beyond infinity.
        scanner.w = scanner.w.max(0.0);
    }
    let (cost, found) = best;
    Ok((cost < f64::INFINITY).then(|| middle + unit / found.w * found.truncate()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The middles of square tiles, ten along an edge, of a box round the origin, with normals inwards; so many points on each.
    fn walls(points: impl Fn(DVec3, DVec3) -> f64) -> Vec<Spot> {
        let tile = |i: i32| 0.2 * f64::from(i) - 0.9;
        let sides = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
        let tiles = sides.flat_map(|side| (0..100).map(move |i| (side, tile(i % 10), tile(i / 10))));
        let size = DVec3::new(20.0, 30.0, 12.0);
        let spot = |(side, a, b): (DVec3, f64, f64)| {
            let place = size
                * (side + a * DVec3::new(side.z, side.x, side.y).abs() + b * DVec3::new(side.y, side.z, side.x).abs());
            Spot { place, normal: -side, density: points(place, -side) }
        };
        tiles.map(spot).collect()
    }

    #[test]
    fn densities_tell_where_a_scanner_stood() {
        let stood = DVec3::new(4.0, -7.0, 3.0);
        let seen = |place: DVec3, normal: DVec3| {
            let ray = stood - place;
            1e4 * normal.dot(ray) / ray.length().powi(3)
        };
        let about = |place: DVec3| law(&walls(seen), place);
        assert!(about(stood).unwrap() > 0.99);
        assert!(about(stood + DVec3::new(4.0, 4.0, 2.0)).unwrap() < 0.95);
        assert_eq!(about(stood + DVec3::new(500.0, 0.0, 0.0)), None);
        // Covered evenly, but for chance, and the more thinly the nearer.
        let chance = |place: DVec3| 1.5 + (12.9898 * place.x + 78.233 * place.y + 37.719 * place.z).sin();
        assert_eq!(law(&walls(|place, _| chance(place)), stood), None);
        assert_eq!(law(&walls(|place, normal| 1.0 / seen(place, normal)), stood), None);
    }

    /// Of a box from inside.
    fn samples(of: impl Fn(usize) -> (u32, bool)) -> Vec<Sample> {
        let sample = |(i, spot): (usize, Spot)| {
            let (component, is_flipped) = of(i);
            Sample { place: spot.place, normal: signed(is_flipped, spot.normal), points: 1.0, component }
        };
        walls(|_, _| 1.0).into_iter().enumerate().map(sample).collect()
    }

    #[test]
    fn a_place_is_found_that_all_face() {
        let found = |middle: DVec3, of: &dyn Fn(usize) -> (u32, bool)| faced(&mut samples(of), middle).unwrap();
        // One surface, seen from without, and some wrong signs.
        let is_inside = |place: DVec3| (place.abs() / DVec3::new(20.0, 30.0, 12.0)).max_element() < 1.0;
        for middle in [DVec3::new(3.0, 2.0, 1.0), DVec3::new(21.0, 5.0, 1.0), DVec3::new(0.0, 31.0, -12.5)] {
            for is_flipped in [false, true] {
                let place = found(middle, &|i| (0, is_flipped ^ (i % 50 == 0)));
                assert!(place.is_some_and(is_inside), "{place:?} from {middle}");
            }
        }
        // Each side has its own sign, and mixed ones have none.
        assert_eq!(found(DVec3::ONE, &|i| (i as u32 / 100, i / 100 % 2 == 0)), Some(DVec3::ONE));
        assert_eq!(found(DVec3::ONE, &|i| (i as u32 / 100, i % 2 == 0)), None);
    }
}
