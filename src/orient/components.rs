//! Which side of each surface is its outside.

use super::air::Sights;
use super::links::Links;
use super::patches::{Patches, signed, turned};
use super::signs::{CLOSED, Signs};
use crate::error::Error;
use crate::grid::Grid;
use crate::lattice::BRICK;
use crate::lists::{filled, grow, reserve};
use glam::DVec3;
use std::cmp::Reverse;

/// The surfaces of a cloud that got one sign each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Components {
    /// How many there are.
    pub count: u64,
    /// At most the thousand largest, the largest first.
    pub largest: Vec<Component>,
}

impl Components {
    /// Of what was decided for all, the largest first.
    pub(super) fn of(decisions: &[Decision]) -> Result<Self, Error> {
        let mut largest = Vec::new();
        reserve(&mut largest, decisions.len().min(TOLD), WHAT)?;
        largest.extend(decisions.iter().take(TOLD).map(|decision| decision.component));
        Ok(Self { count: decisions.len() as u64, largest })
    }
}

/// One surface in itself: what is not linked to any other, but for a few points here and there, which go with the nearest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Component {
    /// Points of it.
    pub points: u64,
    /// What told its outside.
    pub side: Side,
    /// How much more speaks for that side than for the other: 0 is a guess, 1 is sure. By the air of all that is seen of the open
    /// how much more is seen from one side; for what sees nothing of it how much volume there is, of that of a sphere, or of its
    /// pieces; by touch, half of how much more evidence speaks for that side, of all and of what is needed; by sight, half of how
    /// much more looks at one side, of all that does; by view, up to a half, or from amid the surfaces how well their densities
    /// tell where the scanner was.
    pub confidence: f64,
}

/// What told the outside of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The open air: the surface is closed, so that one side sees much more of it.
    Air,
    /// The volume: the surface is open, or hidden, and most of its normals point away from its middle, or if it is long and thin
    /// from the middles of its parts.
    Volume,
    /// Another surface, which the air told, or which was told in this way: it touches that, as the inside of a hollow body does the
    /// outside at a small opening.
    Touch,
    /// What stands before it: it is looked at from one side.
    Sight,
    /// The scanner: all of the cloud was seen from one side, or by one or a few from amid it.
    View,
    /// Nothing: the surface is open and flat. By convention `x + 2y + 4z >= 0` for its mean normal; where all was seen from one
    /// side for that of all.
    Convention,
}

impl Side {
    /// In one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Air => "air",
            Self::Volume => "volume",
            Self::Touch => "touch",
            Self::Sight => "sight",
            Self::View => "view",
            Self::Convention => "convention",
        }
    }
}

/// What was decided for a component.
#[derive(Clone, Copy)]
pub(super) struct Decision {
    pub component: Component,
    pub patches: u64,
    /// How much volume it holds behind it, of that of a sphere, or of its pieces, less than 0 if before it; 0 if it is flat.
    pub volume: f64,
}

/// What errors call the memory of all this.
const WHAT: &str = "the components";

/// Components that are told about.
const TOLD: usize = 1000;

/// Where hardly any patch sees the open the air says nothing: that is a gap in what hides it.
const LEAST_SIGHT: f64 = 0.01;

/// With less volume a surface is flat, and its bulges are chance. A shallow dome has this if its height is a seventieth of its
/// radius.
const LEAST_VOLUME: f64 = 0.02;

/// With less in its bricks, one by one, a surface is not thin either: a tube has this if it is no thicker than two bricks and a
/// half. Noise that is wider than a cube makes half of it of a flat surface.
const LEAST_BULGE: f64 = 0.12;

/// The mean of normals that look all round is shorter.
const ALL_ROUND: f64 = 0.5;

/// Links with less evidence than this touch nothing: stray points between two noisy surfaces make many of a fiftieth.
const LEAST_LINK: f32 = 0.05;

/// Less evidence than this between a surface and those that it touches may be chance, or than so much for each patch along its side,
/// and so may be where more than a quarter of it speaks for the other side.
const LEAST_TOUCH: f64 = 1.0;
const LEAST_ALONG: f64 = 0.03;
const THREE_TO_ONE: f64 = 0.5;

/// How far from what the air told surfaces are told one by the other.
const ROUNDS: usize = 8;

/// The convention, where nothing tells the side of a mean normal: whether it is to be turned.
pub(super) fn is_below(normal: DVec3) -> bool {
    normal.dot(DVec3::new(1.0, 2.0, 4.0)) < 0.0
}

/// Sums over a component, with its normals as they were signed.
#[derive(Clone, Copy, Default)]
struct Sums {
    patches: u64,
    points: u64,
    place: DVec3,
    normal: DVec3,
    /// The sum of place . normal.
    flux: f64,
    exposure: f64,
    sight: f64,
    /// The sum of distances from the middle.
    reach: f64,
    /// The sums over all bricks of flux against the middle there, and of distances from that.
    bulge: f64,
    extent: f64,
}

/// Sums over a component in one brick, from whose corner places are counted.
#[derive(Default)]
struct Part {
    component: u32,
    points: f64,
    place: DVec3,
    normal: DVec3,
    flux: f64,
    /// The sum of square places.
    square: f64,
}

impl Part {
    /// Adds a patch; its normal is as long as it has points.
    fn add(&mut self, points: f64, place: DVec3, normal: DVec3) {
        self.points += points;
        self.place += points * place;
        self.normal += normal;
        self.flux += place.dot(normal);
        self.square += points * place.length_squared();
    }

    /// Flux against the middle, and points times their root mean square distance from it.
    fn bulge_and_extent(&self) -> [f64; 2] {
        let share = 1.0 / self.points;
        let square = self.square - share * self.place.length_squared();
        [self.flux - share * self.place.dot(self.normal), (self.points * square).max(0.0).sqrt()]
    }
}

impl Sums {
    /// What told the outside, and whether the normals point inwards.
    fn decide(&self) -> (Decision, bool) {
        let share = |part: f64, all: f64| if all > 0.0 { part / all } else { 0.0 };
        let air = share(self.exposure, self.sight);
        let mut volume = share(self.flux - self.place.dot(self.normal) / self.points as f64, self.reach);
        if volume.abs() < LEAST_VOLUME {
            // What is long and thin has none of the sphere that it spans. A ditch is so too, but says by its mean normal where
            // most of it looks.
            let bulge = share(self.bulge, self.extent);
            let is_all_round = self.normal.length() < ALL_ROUND * self.points as f64;
            volume = if is_all_round && bulge.abs() >= LEAST_BULGE { bulge } else { 0.0 };
        }
        let is_seen = self.sight >= LEAST_SIGHT * self.patches as f64;
        let (side, confidence, is_inwards) = if is_seen && air.abs() > CLOSED {
            (Side::Air, air, air < 0.0)
        } else if volume.abs() >= LEAST_VOLUME {
            // What is open to both sides has no outside to be sure of; terrain even sees more of the open from below.
            (Side::Volume, if is_seen { air } else { volume }, volume < 0.0)
        } else {
            (Side::Convention, 0.0, is_below(self.normal))
        };
        let component = Component { points: self.points, side, confidence: confidence.abs().min(1.0) };
        (Decision { component, patches: self.patches, volume: signed(is_inwards, volume) }, is_inwards)
    }
}

/// Adds what a brick holds to the components that it holds it of.
fn add_up(parts: &mut Vec<Part>, corner: DVec3, all: &mut [Sums]) {
    for part in parts.drain(..) {
        let [bulge, extent] = part.bulge_and_extent();
        let sums = &mut all[part.component as usize];
        sums.place += part.place + part.points * corner;
        sums.normal += part.normal;
        sums.flux += part.flux + corner.dot(part.normal);
        sums.bulge += bulge;
        sums.extent += extent;
    }
}

/// Tells the surfaces that the air does not tell by those that they touch and that it does, then by these, and so on.
fn follow_touches(decided: &mut [(Decision, bool)], links: &Links, signs: &Signs) -> Result<(), Error> {
    let is_told = |decision: &Decision| matches!(decision.component.side, Side::Air | Side::Touch);
    for _ in 0..ROUNDS {
        let told = decided.iter().filter(|(decision, _)| is_told(decision)).count();
        if told == 0 || told == decided.len() {
            break;
        }
        // The evidence for the signs that each has, less that against them, and all of it.
        let mut touches = filled((0.0, 0.0), decided.len(), WHAT)?;
        let is_told = |component: u32| is_told(&decided[component as usize].0);
        for (one, &own) in signs.component.iter().enumerate().filter(|&(_, &own)| !is_told(own)) {
            for link in links.from(one).iter().filter(|link| link.evidence.abs() >= LEAST_LINK) {
                let (to, other) = (link.to as usize, signs.component[link.to as usize]);
                if other != own && is_told(other) {
                    let is_against = signs.flipped[one] ^ signs.flipped[to] ^ decided[other as usize].1;
                    let (balance, all) = &mut touches[own as usize];
                    *balance += f64::from(turned(is_against, link.evidence));
                    *all += f64::from(link.evidence.abs());
                }
            }
        }
        let mut is_any_told = false;
        for ((decision, is_inwards), (balance, all)) in decided.iter_mut().zip(touches) {
            let least = LEAST_TOUCH.max(LEAST_ALONG * (decision.patches as f64).sqrt());
            if balance.abs() > least && balance.abs() > THREE_TO_ONE * all {
                let is_against = balance < 0.0;
                decision.volume = signed(is_against ^ *is_inwards, decision.volume);
                decision.component.side = Side::Touch;
                decision.component.confidence = balance.abs() / (2.0 * (all + least));
                *is_inwards = is_against;
                is_any_told = true;
            }
        }
        if !is_any_told {
            break;
        }
    }
    Ok(())
}

/// Turns the components that face inwards, tells what decided and how sure that is, and numbers them by size. `links` are those of
/// the patches, if there are any.
pub(super) fn decide(
    grid: &Grid,
    patches: &Patches,
    sights: &Sights,
    links: Option<&Links>,
    signs: &mut Signs,
) -> Result<Vec<Decision>, Error> {
    let mut all = filled(Sums::default(), signs.components, WHAT)?;
    let corner = |brick: usize| f64::from(BRICK) * grid.bricks.places[brick].as_dvec3();
    let mut parts: Vec<Part> = Vec::new();
    let mut in_brick = 0;
    for (i, brick, local) in patches.placed(grid) {
        let local = local.as_dvec3();
        if brick != in_brick {
            add_up(&mut parts, corner(in_brick), &mut all);
            in_brick = brick;
        }
        let component = signs.component[i];
        let (patch, sums) = (&patches.all[i], &mut all[component as usize]);
        sums.patches += 1;
        sums.points += u64::from(patch.points);
        sums.exposure += f64::from(signed(signs.flipped[i], sights.exposure[i]));
        sums.sight += f64::from(sights.all[i]);
        let part = match parts.iter().position(|part| part.component == component) {
            Some(known) => known,
            None => {
                grow(&mut parts, 1, WHAT)?;
                parts.push(Part { component, ..Part::default() });
                parts.len() - 1
            }
        };
        let points = f64::from(patch.points);
        parts[part].add(points, local, points * signed(signs.flipped[i], patch.normal).as_dvec3());
    }
    if !parts.is_empty() {
        add_up(&mut parts, corner(in_brick), &mut all);
    }
    for (i, brick, local) in patches.placed(grid) {
        let (sums, place) = (&mut all[signs.component[i] as usize], corner(brick) + local.as_dvec3());
        sums.reach += f64::from(patches.all[i].points) * place.distance(sums.place / sums.points as f64);
    }
    // Here they still have their numbers.
    let mut decided = Vec::new();
    reserve(&mut decided, all.len(), WHAT)?;
    decided.extend(all.iter().map(Sums::decide));
    if let Some(links) = links {
        follow_touches(&mut decided, links, signs)?;
    }
    let mut order = Vec::new();
    reserve(&mut order, all.len(), WHAT)?;
    order.extend(0..all.len());
    order.sort_unstable_by_key(|&component| (Reverse(all[component].points), component));
    // For each its number by size.
    let mut numbers = filled(0u32, all.len(), WHAT)?;
    for (number, &component) in (0..).zip(&order) {
        numbers[component] = number;
    }
    for (flipped, component) in signs.flipped.iter_mut().zip(&mut signs.component) {
        *flipped ^= decided[*component as usize].1;
        *component = numbers[*component as usize];
    }
    let mut decisions = Vec::new();
    reserve(&mut decisions, all.len(), WHAT)?;
    decisions.extend(order.iter().map(|&component| decided[component].0));
    Ok(decisions)
}

#[cfg(test)]
mod tests {
    use super::super::links::Link;
    use super::*;

    /// Surfaces of one patch each, the first told by the air, with its normal inwards; of the others `volume` has their signs so far.
    #[test]
    fn a_surface_goes_by_what_it_touches() {
        let touches = [(0, 1, 2.0), (1, 2, -2.0), (0, 3, 3.0), (0, 3, -1.5), (0, 4, 0.9), (2, 5, -2.0)];
        let strays = [(0, 6, -0.02); 100];
        let told = touches.iter().chain(&strays).map(|&(from, to, evidence)| (from, Link { to, evidence }));
        let links = Links::both_ways(7, told).unwrap();
        let signs = Signs {
            flipped: vec![false, true, false, false, false, false, false],
            component: (0..7).collect(),
            components: 7,
        };
        let decided = |side| {
            let component = Component { points: 16, side, confidence: 0.0 };
            (Decision { component, patches: 1, volume: 0.2 }, side == Side::Air)
        };
        let sides = [Side::Air, Side::Volume, Side::Volume, Side::Volume, Side::Volume, Side::Volume, Side::Volume];
        let mut all = sides.map(decided);
        follow_touches(&mut all, &links, &signs).unwrap();
        // The fourth is contradicted, the fifth hardly touches, and the last has strays near by.
        let sides = all.map(|(decision, _)| decision.component.side);
        let [volume, touch] = [Side::Volume, Side::Touch];
        assert_eq!(sides, [Side::Air, touch, touch, volume, volume, touch, volume]);
        // Who agrees with the first is turned as it is, unless flipped already; the sixth is at odds with the third.
        assert_eq!(all.map(|(_, is_inwards)| is_inwards), [true, false, false, false, false, true, false]);
        assert_eq!(all.map(|(decision, _)| decision.volume), [0.2, 0.2, 0.2, 0.2, 0.2, -0.2, 0.2]);
    }
}
