//! Clouds that were seen from one side: all their surfaces face the scanner.

use super::components::{Decision, Side, is_below};
use super::looks::{Looks, Votes};
use super::patches::{Patch, Patches, signed};
use super::signs::{LEAST_PATCHES, Signs};
use crate::error::Error;
use crate::grid::Grid;
use crate::lattice::BRICK;
use crate::lists::{filled, reserve};
use glam::{DVec3, Vec3};

/// What errors call the memory of all this.
const WHAT: &str = "the view";

/// The share of a view that faces away from its middle, because it is wide, or by wrong signs: single views have up to 0.06,
/// rooms from inside 0.1, an aerial scan with trees 0.14. With more than the last no better direction is looked for, with less
/// than the first it need not be.
const ENOUGH: f64 = 0.005;
const MOST_AWAY: f64 = 0.08;
const HOPELESS: f64 = 0.3;

/// So few that face away are wrong signs, if they do so clearly: the cosine of 107 degrees.
const MISTAKES: f64 = 0.02;
const CLEARLY_AWAY: f32 = -0.3;

/// Directions that are tried.
const ROUNDS: usize = 20;

/// The share of a view that lies behind other parts of it. Its middle is no scanner, so there are some: 0.13 in an aerial scan;
/// of the two sides of a plate, or floor and ceiling, it is half.
const MOST_HIDDEN: f64 = 0.15;

/// How far behind that is, in edges, besides what slopes and noise explain.
const BEHIND: f32 = 0.25;
const DEVIATIONS: f32 = 2.0;

/// Slopes beyond, by the cosine of the angle between normal and view, are no steeper.
const STEEPEST: f32 = 0.05;

/// What decides between the two sides, each divided by what makes it a clear sign: how far the volume lies behind the surfaces,
/// how much what stands before others looks at them, for each patch, and how much denser what is nearer is, in standard
/// errors, less where it may be chance, and no more than some of these: densities have other reasons, too.
const BULGE: f64 = 0.15;
const LOOKING: f64 = 0.005;
const DENSER: f64 = 8.0;
const CHANCE: f64 = 4.0;
const MOST_BY_DENSITY: f64 = 3.0;

/// What holds less volume is flat: only that looks at itself from its front, and if so many of its looks agree.
const FLAT: f64 = 0.05;
const AGREED: f64 = 0.6;

/// Less of all these is chance.
const UNCLEAR: f64 = 0.2;

/// Patches tell densities that face the scanner so well, by the cosine, are so many, and deviate so much in depth, in edges.
const FACING: f32 = 0.5;
const LEAST_DENSITIES: f64 = 100.0;
const LEAST_DEPTH: f64 = 1.0;

/// The confidence where everything speaks for one side: no more, as it is told by what is likely.
const MOST_CONFIDENCE: f64 = 0.5;

/// A direction in which all was seen, or from which.
///
/// What a scanner saw faces it. So if there is a direction that nearly all patches face, once some surfaces are turned, and in
/// which nearly none hides another, the surfaces are turned to it together, also those whose own volume, or what they see of
/// the others, says the opposite, as of what is seen past the edge of something else. From behind it would look the same.
pub(super) struct View {
    towards: Vec3,
}

impl View {
    /// That of a cloud, if it is one. Some passes over the patches, and a sort.
    pub fn of(grid: &Grid, patches: &Patches, noise: f32, signs: &Signs) -> Result<Option<Self>, Error> {
        if patches.all.len() < LEAST_PATCHES as usize {
            return Ok(None);
        }
        let mut sums = filled(DVec3::ZERO, signs.components, WHAT)?;
        for (patch, (&flipped, &component)) in each(patches, signs) {
            sums[component as usize] += weighed(patch, flipped);
        }
        let longest = sums.iter().copied().reduce(|a, b| if b.length_squared() > a.length_squared() { b } else { a });
        let along = |normal: &DVec3| signed(longest.is_some_and(|longest| longest.dot(*normal) < 0.0), *normal);
        let mut towards: DVec3 = sums.iter().map(along).sum();
        // As a perceptron learns (Rosenblatt, 1958): towards what still faces away.
        for _ in 0..ROUNDS {
            let view = Self { towards: towards.normalize_or_zero().as_vec3() };
            let turned = view.turned(patches, signs)?;
            if turned.away > HOPELESS {
                return Ok(None);
            }
            if turned.away <= ENOUGH {
                break;
            }
            towards = view.towards.as_dvec3() + 2.0 * turned.missed;
        }
        let view = Self { towards: towards.normalize_or_zero().as_vec3() };
        let is_one =
            view.turned(patches, signs)?.away <= MOST_AWAY && view.hidden(grid, patches, noise)? <= MOST_HIDDEN;
        Ok(is_one.then_some(view))
    }

    /// Turns all surfaces to the scanner.
    ///
    /// At which end of the direction that was is told by three things: what was scanned has its volume behind what is seen of
    /// it; what looks at another surface stands before it; and of what is twice as far a scanner with rays in all directions,
    /// or a camera, sees a quarter as many points.
    pub fn turn_to_the_scanner(
        &self,
        grid: &Grid,
        patches: &Patches,
        looks: Option<&Looks>,
        signs: &mut Signs,
        decisions: &mut [Decision],
    ) -> Result<(), Error> {
        let turned = self.turned(patches, signs)?;
        let denser = self.density(grid, patches);
        let density = denser / DENSER * (denser.abs() / CHANCE).min(1.0);
        let told = bulge(decisions, &turned) / BULGE
            + looking(looks, signs, decisions, &turned) / LOOKING
            + density.clamp(-MOST_BY_DENSITY, MOST_BY_DENSITY);
        let is_clear = told.abs() >= UNCLEAR;
        let is_from_behind = if is_clear { told < 0.0 } else { is_below(turned.normal) };
        let confidence = MOST_CONFIDENCE * told.abs() / (1.0 + told.abs());
        for (patch, (flipped, &component)) in patches.all.iter().zip(signs.flipped.iter_mut().zip(&signs.component)) {
            *flipped ^= turned.flipped[component as usize];
            *flipped ^= turned.away <= MISTAKES && self.cosine(patch, *flipped) < CLEARLY_AWAY;
            *flipped ^= is_from_behind;
        }
        for decision in decisions {
            let component = &mut decision.component;
            (component.side, component.confidence) =
                if is_clear { (Side::View, confidence) } else { (Side::Convention, 0.0) };
        }
        Ok(())
    }

    /// Which components to turn so that as much as can be faces along the view.
    fn turned(&self, patches: &Patches, signs: &Signs) -> Result<Turned, Error> {
        let mut balances = filled(0.0, signs.components, WHAT)?;
        for (patch, (&flipped, &component)) in each(patches, signs) {
            let side = if self.cosine(patch, flipped) < 0.0 { -1.0 } else { 1.0 };
            balances[component as usize] += side * f64::from(patch.points);
        }
        let mut flipped = filled(false, signs.components, WHAT)?;
        flipped.iter_mut().zip(&balances).for_each(|(flipped, &balance)| *flipped = balance < 0.0);
        let mut turned = Turned { flipped, away: 0.0, missed: DVec3::ZERO, normal: DVec3::ZERO };
        let mut all = 0.0;
        for (patch, (&flipped, &component)) in each(patches, signs) {
            let flipped = flipped ^ turned.flipped[component as usize];
            turned.normal += weighed(patch, flipped);
            all += f64::from(patch.points);
            if self.cosine(patch, flipped) < 0.0 {
                turned.away += f64::from(patch.points);
                turned.missed += weighed(patch, flipped);
            }
        }
        turned.away /= all;
        turned.missed /= all;
        Ok(turned)
    }

    fn cosine(&self, patch: &Patch, is_flipped: bool) -> f32 {
        signed(is_flipped, patch.normal).dot(self.towards)
    }

    /// All patches, and where they are, in edges.
    fn places<'a>(&self, grid: &'a Grid, patches: &'a Patches) -> impl Iterator<Item = (&'a Patch, Vec3)> {
        let corner = |brick: usize| (BRICK * grid.bricks.places[brick]).as_vec3();
        patches.placed(grid).map(move |(patch, brick, local)| (&patches.all[patch], corner(brick) + local))
    }

    /// The share of the points that lie behind others.
    fn hidden(&self, grid: &Grid, patches: &Patches, noise: f32) -> Result<f64, Error> {
        // Sheared along the axis next to it, so that mirrored points fall into mirrored squares.
        let along = self.towards.abs().max_position();
        let (across, up) = ((along + 1) % 3, (along + 2) % 3);
        let forward = self.towards[along];
        let mut spots = Vec::new();
        reserve(&mut spots, patches.all.len(), WHAT)?;
        spots.extend(self.places(grid, patches).map(|(patch, place)| {
            let square = |axis: usize| (place[axis] - place[along] / forward * self.towards[axis]).floor() as i32;
            let cosine = self.cosine(patch, false);
            let rise = self.towards - patch.normal / cosine.abs().max(STEEPEST).copysign(cosine);
            Spot {
                square: (square(across), square(up)),
                depth: self.towards.dot(place),
                slope: rise[across].hypot(rise[up]),
                points: patch.points,
            }
        }));
        let order = |one: &Spot, other: &Spot| {
            one.square
                .cmp(&other.square)
                .then(other.depth.total_cmp(&one.depth))
                .then(other.slope.total_cmp(&one.slope))
        };
        spots.sort_unstable_by(order);
        let (mut hidden, mut all) = (0.0, 0.0);
        for spots in spots.chunk_by(|one, next| one.square == next.square) {
            let front = &spots[0];
            for spot in spots {
                let least = BEHIND + DEVIATIONS * noise + std::f32::consts::SQRT_2 * front.slope.max(spot.slope);
                all += f64::from(spot.points);
                if front.depth - spot.depth > least {
                    hidden += f64::from(spot.points);
                }
            }
        }
        Ok(hidden / all)
    }

    /// How much denser what is nearer is, in standard errors: the logarithm of the points of a patch by how near it is, and by
    /// the logarithm of its cosine, because a scanner sees fewer points of what is slanted.
    fn density(&self, grid: &Grid, patches: &Patches) -> f64 {
        let told = || {
            self.places(grid, patches).filter(|(patch, _)| !patch.has_rival).filter_map(|(patch, place)| {
                let cosine = self.cosine(patch, false).abs();
                (cosine >= FACING).then(|| {
                    let nearness = f64::from(self.towards.dot(place));
                    DVec3::new(f64::from(patch.points).ln(), nearness, f64::from(cosine).ln())
                })
            })
        };
        let (count, sum) = told().fold((0.0, DVec3::ZERO), |(count, sum), one| (count + 1.0, sum + one));
        let mean = sum / count;
        let [mut by_points, mut by_nearness, mut by_cosine] = [DVec3::ZERO; 3];
        for one in told() {
            let off = one - mean;
            by_points += off.x * off;
            by_nearness += off.y * off;
            by_cosine += off.z * off;
        }
        // Where all is slanted alike, that explains nothing.
        by_cosine.z += 1e-6 * count;
        let determinant = by_nearness.y * by_cosine.z - by_nearness.z * by_nearness.z;
        let slope = (by_points.y * by_cosine.z - by_points.z * by_nearness.z) / determinant;
        let by_slant = (by_points.z * by_nearness.y - by_points.y * by_nearness.z) / determinant;
        let rest = (by_points.x - slope * by_points.y - by_slant * by_points.z) / count;
        let error = (rest * by_cosine.z / determinant).sqrt();
        // Nothing is told where all are equally near, or all equally many.
        let told = slope / error;
        let is_deep = by_nearness.y >= LEAST_DEPTH * LEAST_DEPTH * count;
        if count >= LEAST_DENSITIES && is_deep && told.is_finite() { told } else { 0.0 }
    }
}

/// Surfaces turned to one side.
struct Turned {
    /// For each component whether it was.
    flipped: Vec<bool>,
    /// The share that still faces away.
    away: f64,
    /// The mean of the normals of that.
    missed: DVec3,
    /// The sum of all normals.
    normal: DVec3,
}

/// The mean volume behind the components, less where it lies before them.
fn bulge(decisions: &[Decision], turned: &Turned) -> f64 {
    let (mut sum, mut all) = (0.0, 0.0);
    for (decision, &flipped) in decisions.iter().zip(&turned.flipped) {
        let points = decision.component.points as f64;
        sum += points * signed(flipped, decision.volume);
        all += points;
    }
    sum / all
}

/// How much, for each patch, surfaces look from their front at the front of others, less what they do so from their back at
/// backs; all the less where most looks do neither. Also how much the largest looks at itself if it is flat, as ground does from
/// what stands on it, which is one surface with it.
fn looking(looks: Option<&Looks>, signs: &Signs, decisions: &[Decision], turned: &Turned) -> f64 {
    let Some(looks) = looks else { return 0.0 };
    let [mut at_others, mut at_itself] = [Votes::default(); 2];
    for look in &looks.all {
        let [from, to] = [look.from, look.to].map(|patch| patch as usize);
        let component = |patch: usize| signs.component[patch] as usize;
        let flipped = |patch: usize| signs.flipped[patch] ^ turned.flipped[component(patch)];
        let vote = signed(flipped(to), look.along);
        if component(from) == component(to) {
            if component(to) == 0 {
                at_itself.add(vote);
            }
        } else if (look.is_against != flipped(from)) == (vote < 0.0) {
            at_others.add(vote);
        } else {
            at_others.all += f64::from(vote.abs());
        }
    }
    let mut sum = at_others.balance * at_others.agreement();
    if decisions[0].volume.abs() < FLAT && at_itself.agreement() > AGREED {
        sum += at_itself.balance;
    }
    sum * looks.step as f64 / signs.component.len() as f64
}

/// A patch as the scanner sees it.
struct Spot {
    /// Where it is across the view, in edges.
    square: (i32, i32),
    /// How near it is, in edges.
    depth: f32,
    /// How much nearer or farther its plane is an edge away.
    slope: f32,
    points: u32,
}

/// The patches, whether each is flipped, and its component.
fn each<'a>(patches: &'a Patches, signs: &'a Signs) -> impl Iterator<Item = (&'a Patch, (&'a bool, &'a u32))> {
    patches.all.iter().zip(signs.flipped.iter().zip(&signs.component))
}

/// The normal of a patch, as long as it has points.
fn weighed(patch: &Patch, is_flipped: bool) -> DVec3 {
    f64::from(patch.points) * signed(is_flipped, patch.normal).as_dvec3()
}
