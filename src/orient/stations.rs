//! Clouds that several scanners took from amid them: all their surfaces face where one of these stood.

use super::air::Sights;
use super::components::{Decision, Side};
use super::patches::{Patch, Patches, signed};
use super::place::{FACING, LONGEST, Place, explained_by_normals, share};
use super::signs::{CLOSED, Signs};
use super::spots::{Spot, variance};
use crate::error::Error;
use crate::grid::Grid;
use crate::lists::{filled, grow};
use crate::power::log2;
use glam::DVec3;

/// What errors call the memory of all this.
const WHAT: &str = "the stations";

/// Places are told by so many spots at the most, and no less: each takes four numbers.
const MOST_SPOTS: usize = 400;
const LEAST_SPOTS: usize = 100;

/// More scanners are not told apart; what they saw is explained by the nearest of them.
const MOST: usize = 4;

/// One more is sought in the middle, and before and behind so many spots of the eighth that is denser than the others explain: so far
/// off, in mean distances of the spots from their middle, and within the box round them.
const SOUGHT: usize = 8;
const AMONG: usize = 8;
const OFF: [f64; 4] = [0.15, -0.15, 0.5, -0.5];

/// From so many of these places, the best of them.
const BEST: usize = 6;

/// How often all places are moved after one more was found, and what one more leaves of the misfit at the most, or it is the last.
const SWEEPS: usize = 3;
const GAIN: f64 = 0.93;

/// How far off densities are from their mean, as a place's misfit, where they tell scanners: bodies that were covered evenly have
/// up to 0.2, rooms from inside 0.25 to 0.5.
const VARIED: f64 = 0.22;

/// What places leave of that at the most, as many as there are so far, and in the end: the first may stand anywhere between scanners.
const LEFT_BY: [f64; MOST] = [1.5, 1.0, 0.75, LEFT];
const LEFT: f64 = 0.45;

/// The share of the variance of densities that they explain at the least.
const EXPLAINED: f64 = 0.6;

/// And that the normals alone explain at the most: what was scanned from round it has 0.23 and more, rooms from inside up to 0.24.
const BY_NORMALS: f64 = 0.2;

/// A scanner has seen a surface if so much of the density there comes from it.
const SEEN: f64 = 0.1;

/// So much may face away from all that have seen it, of some patches, and so much has to have a side that they see.
const MOST_AWAY: f64 = 0.12;
const LEAST_TOLD: f64 = 0.5;
const PATCHES: usize = 1 << 12;

/// Where scanners stood.
pub(super) struct Stations {
    places: Vec<Place>,
    /// How certain they are, up to 1.
    certainty: f64,
}

impl Stations {
    /// Those of a cloud, if it was taken from amid it. Where densities vary some hundred passes over a few hundred spots for each of
    /// them, and if these explain it two over some patches and one over all.
    pub fn of(
        all: &[Spot],
        grid: &Grid,
        patches: &Patches,
        sights: &Sights,
        signs: &Signs,
    ) -> Result<Option<Self>, Error> {
        if all.len() < LEAST_SPOTS {
            return Ok(None);
        }
        let mut spots: Vec<Spot> = Vec::new();
        grow(&mut spots, MOST_SPOTS, WHAT)?;
        spots.extend(all.iter().step_by(all.len().div_ceil(MOST_SPOTS)));
        let middle = spots.iter().map(|spot| spot.place).sum::<DVec3>() / spots.len() as f64;
        // NaN, where nothing faces the middle, tells no scanners.
        let may_be_amid = explained_by_normals(&spots, middle) <= BY_NORMALS;
        let Some(places) = (if may_be_amid { places(&spots, middle)? } else { None }) else { return Ok(None) };
        let certainty = explained(&spots, &places);
        let stations = Self { places, certainty };
        let is_told = certainty >= EXPLAINED
            && stations.away(grid, patches, signs)? <= MOST_AWAY
            && !stations.are_outside(grid, patches, sights, signs)?;
        Ok(is_told.then_some(stations))
    }

    /// By how much more of the density a patch faces those from which that comes, from 1 down to -1 where it faces away; and whether
    /// those that have seen it are all on one side.
    fn side(&self, patch: &Patch, place: DVec3) -> (f64, bool) {
        let spot = Spot { place, normal: patch.normal.as_dvec3(), density: 0.0, weight: 0.0 };
        let seen =
            || self.places.iter().map(|one| (one.ray(&spot), one)).map(|(ray, one)| (one.density(&ray), ray.cosine));
        let all: f64 = seen().map(|(density, _)| density).sum();
        let (mut balance, mut before, mut behind) = (0.0, false, false);
        for (density, cosine) in seen() {
            balance += density * cosine.signum();
            before |= density >= SEEN * all && cosine > -FACING;
            behind |= density >= SEEN * all && cosine < FACING;
        }
        (balance / all, before != behind)
    }

    /// For each component whether most of it faces away, of every `step`th patch.
    fn turned(&self, grid: &Grid, patches: &Patches, signs: &Signs, step: usize) -> Result<Vec<bool>, Error> {
        let mut balance = filled(0.0, signs.components, WHAT)?;
        for (i, (patch, place)) in patches.places(grid).enumerate().step_by(step) {
            let along = f64::from(patch.points) * self.side(patch, place).0;
            balance[signs.component[i] as usize] += signed(signs.flipped[i], along);
        }
        let mut turned = filled(false, signs.components, WHAT)?;
        turned.iter_mut().zip(balance).for_each(|(turned, balance)| *turned = balance < 0.0);
        Ok(turned)
    }

    /// The share of some patches that faces away from all that have seen it, once components are turned; all where little has a
    /// side, as of flat ground that they stood in.
    fn away(&self, grid: &Grid, patches: &Patches, signs: &Signs) -> Result<f64, Error> {
        let step = patches.all.len().div_ceil(PATCHES);
        let turned = self.turned(grid, patches, signs, step)?;
        let (mut away, mut told, mut all) = (0.0, 0.0, 0.0);
        for (i, (patch, place)) in patches.places(grid).enumerate().step_by(step) {
            let (balance, is_told) = self.side(patch, place);
            let is_turned = signs.flipped[i] ^ turned[signs.component[i] as usize];
            let points = f64::from(patch.points);
            all += points;
            told += if is_told { points } else { 0.0 };
            away += if is_told && signed(is_turned, balance) < 0.0 { points } else { 0.0 };
        }
        Ok(if told < LEAST_TOLD * all { 1.0 } else { away / all })
    }

    /// Whether they saw from the open what the largest component bounds, if that is closed: such a body faces outwards in any case.
    fn are_outside(&self, grid: &Grid, patches: &Patches, sights: &Sights, signs: &Signs) -> Result<bool, Error> {
        let mut points = filled(0u64, signs.components, WHAT)?;
        for (patch, &component) in patches.all.iter().zip(&signs.component) {
            points[component as usize] += u64::from(patch.points);
        }
        let largest = (0..points.len()).max_by_key(|&component| points[component]);
        let (mut balance, mut exposure, mut sight) = (0.0, 0.0, 0.0);
        for (i, (patch, place)) in patches.places(grid).enumerate() {
            if Some(signs.component[i] as usize) == largest {
                balance += signed(signs.flipped[i], f64::from(patch.points) * self.side(patch, place).0);
                exposure += f64::from(signed(signs.flipped[i], sights.exposure[i]));
                sight += f64::from(sights.all[i]);
            }
        }
        Ok(exposure.abs() > CLOSED * sight && exposure * balance > 0.0)
    }

    /// Turns surfaces to them, as a whole: of what hides behind other things the nearest one may have seen nothing.
    pub fn turn_to_them(
        &self,
        grid: &Grid,
        patches: &Patches,
        signs: &mut Signs,
        decisions: &mut [Decision],
    ) -> Result<(), Error> {
        let turned = self.turned(grid, patches, signs, 1)?;
        for (flipped, &component) in signs.flipped.iter_mut().zip(&signs.component) {
            *flipped ^= turned[component as usize];
        }
        for decision in decisions {
            (decision.component.side, decision.component.confidence) = (Side::View, self.certainty);
        }
        Ok(())
    }
}

/// Places that explain densities together, one after the other, if they do and these vary.
fn places(spots: &[Spot], middle: DVec3) -> Result<Option<Vec<Place>>, Error> {
    let all: f64 = spots.iter().map(|spot| spot.weight).sum();
    let mean = |of: &dyn Fn(&Spot) -> f64| spots.iter().map(|spot| spot.weight * of(spot)).sum::<f64>() / all;
    let level = mean(&|spot| spot.density);
    let even = mean(&|spot| {
        let off = spot.density - level;
        share(off) * off * off
    });
    if even < VARIED {
        return Ok(None);
    }
    let unit = spots.iter().map(|spot| spot.place.distance(middle)).sum::<f64>() / spots.len() as f64;
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for spot in spots {
        (low, high) = (low.min(spot.place), high.max(spot.place));
    }
    let mut places: Vec<Place> = Vec::new();
    let mut left = even;
    for number in 0..MOST {
        let known = densities(spots, &places, None)?;
        // Where it is denser than is explained, by how much that counts.
        let excess = |i: usize| spots[i].weight * (spots[i].density - known.get(i).map_or(level, |&known| log2(known)));
        let mut denser: Vec<usize> = (0..spots.len()).collect();
        denser.sort_by(|&one, &other| excess(other).total_cmp(&excess(one)));
        let few = &denser[..spots.len() / AMONG];
        let sought = few.iter().step_by(few.len().div_ceil(SOUGHT));
        let sought = sought.flat_map(|&i| OFF.map(|off| spots[i].place + off * unit * spots[i].normal));
        let is_amid = |place: &DVec3| place.cmpge(low).all() && place.cmple(high).all();
        let mut sought: Vec<Place> = sought
            .filter(is_amid)
            .chain([middle])
            .map(|place| Place::at(spots, place, &known).levelled(spots, &known))
            .collect();
        sought.sort_by(|one, other| one.misfit.total_cmp(&other.misfit));
        let found = sought.into_iter().take(BEST).map(|place| place.moved(spots, LONGEST * unit, &known));
        let Some(next) = found.min_by(|one, other| one.misfit.total_cmp(&other.misfit)) else { break };
        grow(&mut places, 1, WHAT)?;
        places.push(next);
        // Those before stood where they explain what this one does not.
        for _ in 0..SWEEPS {
            for i in 0..places.len() {
                let others = densities(spots, &places, Some(i))?;
                places[i] = places[i].moved(spots, LONGEST * unit, &others);
            }
        }
        let misfit = places[number].misfit;
        if misfit > LEFT_BY[number] * even {
            return Ok(None);
        }
        if number > 0 && misfit > GAIN * left {
            break;
        }
        left = misfit;
    }
    Ok((places[places.len() - 1].misfit <= LEFT * even).then_some(places))
}

/// For each spot the density that places tell together, but for one of them; empty if there are no others.
fn densities(spots: &[Spot], places: &[Place], but: Option<usize>) -> Result<Vec<f64>, Error> {
    let others = || places.iter().enumerate().filter(|&(i, _)| Some(i) != but);
    let mut sums = filled(0.0, if others().count() > 0 { spots.len() } else { 0 }, WHAT)?;
    for (sum, spot) in sums.iter_mut().zip(spots) {
        *sum = others().map(|(_, place)| place.density(&place.ray(spot))).sum();
    }
    Ok(sums)
}

/// The share of the variance of densities that places explain.
fn explained(spots: &[Spot], places: &[Place]) -> f64 {
    let told = |spot: &Spot| log2(places.iter().map(|place| place.density(&place.ray(spot))).sum());
    1.0 - variance(spots.iter(), |spot| spot.density - told(spot)) / variance(spots.iter(), |spot| spot.density)
}

#[cfg(test)]
mod tests {
    use super::super::place::tests::{seen_from, walls};
    use super::*;
    use glam::Vec3;

    const STOOD: [DVec3; 3] =
        [DVec3::new(14.0, -7.0, 3.0), DVec3::new(-13.0, -20.0, -5.0), DVec3::new(-4.0, 21.0, 6.0)];

    #[test]
    fn three_scanners_are_found_in_a_room() {
        let spots = walls(|place, normal| STOOD.iter().map(|&one| seen_from(one, place, normal)).sum());
        let found = places(&spots, DVec3::ZERO).unwrap().unwrap();
        for stood in STOOD {
            let near = found.iter().map(|one| one.place.distance(stood)).fold(f64::INFINITY, f64::min);
            assert!(near < 1.5, "{near} from {stood}");
        }
        assert!(explained(&spots, &found) > 0.95 && explained_by_normals(&spots, DVec3::ZERO) < BY_NORMALS);
    }

    #[test]
    fn what_was_covered_otherwise_tells_no_scanners() {
        let chance = |place: DVec3| (12.9898 * place.x + 78.233 * place.y + 37.719 * place.z).sin();
        assert!(places(&walls(|place, _| 1.1 + chance(place)), DVec3::ZERO).unwrap().is_none(), "by chance");
        assert!(places(&walls(|_, _| 7.0), DVec3::ZERO).unwrap().is_none(), "evenly");
        // From round it, far off: each side by its own scanner.
        let around = |_: DVec3, normal: DVec3| 1.0 + 8.0 * (normal.x + 0.5 * normal.y).powi(2) + normal.z;
        assert!(explained_by_normals(&walls(around), DVec3::ZERO) > BY_NORMALS);
    }

    #[test]
    fn what_scanners_see_from_both_sides_or_from_neither_has_no_side() {
        let spots = walls(|_, _| 7.0);
        let normal = Vec3::Z;
        let patch = Patch { centre: Vec3::ZERO, normal, points: 16, flatness: 1.0, has_rival: false, bend: 0.0 };
        let side = |stood: &[DVec3]| {
            let places = stood.iter().map(|&place| Place::at(&spots, place, &[])).collect();
            Stations { places, certainty: 1.0 }.side(&patch, DVec3::ZERO)
        };
        let (above, below, in_it) = (DVec3::new(1.0, 0.0, 9.0), DVec3::new(1.0, 0.0, -9.0), DVec3::new(9.0, 0.0, 0.1));
        assert_eq!([side(&[above]), side(&[below])], [(1.0, true), (-1.0, true)]);
        assert!(!side(&[above, below]).1 && !side(&[in_it]).1);
    }
}
