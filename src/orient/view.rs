//! Clouds that were seen from one side: all their surfaces face the scanner.

use super::ball::Ball;
use super::components::{Decision, Side, is_below};
use super::looks::{Looks, Votes};
use super::patches::{Patch, Patches, signed};
use super::signs::{LEAST_PATCHES, Signs};
use super::thinning::Thinning;
use crate::error::Error;
use crate::grid::Grid;
use crate::lists::{filled, reserve};
use crate::power::log2;
use crate::progress::Stage;
use glam::{DVec3, Vec3};

/// What errors call the memory of all this.
const WHAT: &str = "the view";

/// The share of a view that faces away from its middle, because it is wide, or by wrong signs: single views have up to 0.06,
/// rooms from inside 0.1, an aerial scan with trees 0.14. With more than the last no better direction is looked for, with less
/// than the first it need not be.
const ENOUGH: f64 = 0.005;
const MOST_AWAY: f64 = 0.08;
const HOPELESS: f64 = 0.3;

/// A component of which more than this share faces away, either way, was scanned all round, and is left alone. Of all it is no
/// more than this share.
const MIXED: f64 = 0.25;
const MOST_MIXED: f64 = 0.2;

/// So few that face away, of all and of a component, are wrong signs, if they do so clearly: the cosine of 107 degrees.
const MISTAKES: f64 = 0.02;
const CLEARLY_AWAY: f32 = -0.3;

/// Directions that are tried.
const ROUNDS: usize = 20;

/// The share of a view that lies behind other parts of it. Its middle is no scanner, so there are some: 0.13 in an aerial scan;
/// of the two sides of a plate, or floor and ceiling, it is half.
const MOST_HIDDEN: f64 = 0.15;

/// How far behind that is, in edges, besides what slopes and noise explain.
const BEHIND: f64 = 0.25;
const DEVIATIONS: f64 = 2.0;

/// Slopes beyond, by the cosine of the angle between normal and view, are no steeper.
const STEEPEST: f32 = 0.05;

/// What tells at which end of the view the scanner was, each as large as makes it clear: how far the volume lies behind the
/// surfaces, how much what stands before others looks at them, for each patch, and how much denser what is nearer is, but no
/// more than some of these: densities have other reasons, too.
const CLEAR_BULGE: f64 = 0.15;
const CLEAR_LOOKING: f64 = 0.005;
const CLEAR_DENSITY: f64 = 0.1;
const MOST_BY_DENSITY: f64 = 3.0;

/// Less of all these is a guess.
const GUESS: f64 = 0.2;

/// What holds less volume is flat: only that looks at itself from its front, and if so many of its looks agree.
const FLAT: f64 = 0.05;
const AGREED: f64 = 0.6;

/// Densities are told by patches that face the scanner so well, by the cosine; at least so many, which deviate so much in depth,
/// in edges, besides being slanted; and by no less than so many standard errors.
const FACING: f32 = 0.5;
const LEAST_DENSITIES: f64 = 100.0;
const LEAST_DEPTH: f64 = 1.0;
const CHANCE: f64 = 4.0;

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
    /// That of a cloud, if it is one. Two passes over the patches for each round, of which there is one where the cloud is closed,
    /// and a sort.
    pub fn of(grid: &Grid, patches: &Patches, noise: f32, signs: &Signs, stage: &Stage) -> Result<Option<Self>, Error> {
        if patches.all.len() < LEAST_PATCHES as usize {
            return Ok(None);
        }
        let mut sums = filled(DVec3::ZERO, signs.components, WHAT)?;
        for (patch, flipped, component) in each(patches, signs) {
            sums[component] += weighed(patch, flipped);
        }
        let longest =
            sums.iter().fold(DVec3::ZERO, |a, &b| if b.length_squared() > a.length_squared() { b } else { a });
        let mut towards: DVec3 = sums.iter().map(|&normal| signed(longest.dot(normal) < 0.0, normal)).sum();
        // As a perceptron learns (Rosenblatt, 1958): towards what still faces away.
        let mut best: Option<(Self, Turned)> = None;
        for round in 0..ROUNDS {
            stage.tell(round as f64 / ROUNDS as f64)?;
            let Some(direction) = towards.try_normalize() else { break };
            let view = Self { towards: direction.as_vec3() };
            let turned = view.turned(patches, signs)?;
            towards = direction + 2.0 * turned.missed;
            let away = turned.away.max(turned.mixed);
            if best.as_ref().is_none_or(|(_, best)| away < best.away.max(best.mixed)) {
                best = Some((view, turned));
            }
            if away > HOPELESS || away <= ENOUGH {
                break;
            }
        }
        let Some((view, turned)) = best else { return Ok(None) };
        let is_one =
            turned.away <= MOST_AWAY && turned.mixed <= MOST_MIXED && view.hidden(grid, patches, noise)? <= MOST_HIDDEN;
        Ok(is_one.then_some(view))
    }

    /// Turns all surfaces to the scanner.
    ///
    /// At which end of the direction that was is told by three things: what was scanned has its volume behind what is seen of
    /// it; what looks at another surface stands before it; and of what is twice as far a scanner with rays in all directions,
    /// or a camera, sees a quarter as many points. Where nothing tells, the mean of all normals is turned by convention.
    pub fn turn_to_it(
        &self,
        ball: &Ball,
        grid: &Grid,
        patches: &Patches,
        looks: Option<&Looks>,
        signs: &mut Signs,
        decisions: &mut [Decision],
    ) -> Result<(), Error> {
        let turned = self.turned(patches, signs)?;
        let told = bulge(decisions, &turned) / CLEAR_BULGE
            + looking(looks, signs, decisions, &turned) / CLEAR_LOOKING
            + (self.density(ball, grid, patches) / CLEAR_DENSITY).clamp(-MOST_BY_DENSITY, MOST_BY_DENSITY);
        let is_guess = told.abs() < GUESS;
        let is_from_behind = if is_guess { is_below(turned.normal) } else { told < 0.0 };
        let told = match is_guess {
            true => (Side::Convention, 0.0),
            false => (Side::View, MOST_CONFIDENCE * told.abs() / (1.0 + told.abs())),
        };
        for (patch, (flipped, &component)) in patches.all.iter().zip(signs.flipped.iter_mut().zip(&signs.component)) {
            let Some(seen) = &turned.components[component as usize] else { continue };
            *flipped ^= seen.is_flipped;
            let may_err = turned.away <= MISTAKES && seen.away <= MISTAKES;
            *flipped ^= may_err && self.cosine(patch, *flipped) < CLEARLY_AWAY;
            *flipped ^= is_from_behind;
        }
        for (decision, _) in decisions.iter_mut().zip(&turned.components).filter(|(_, seen)| seen.is_some()) {
            (decision.component.side, decision.component.confidence) = told;
        }
        Ok(())
    }

    /// How components are to be turned so that as much as can be faces along the view.
    fn turned(&self, patches: &Patches, signs: &Signs) -> Result<Turned, Error> {
        // For each its points, and those of them that face away.
        let mut counts = filled((0.0, 0.0), signs.components, WHAT)?;
        for (patch, flipped, component) in each(patches, signs) {
            let (all, away) = &mut counts[component];
            *all += f64::from(patch.points);
            if self.cosine(patch, flipped) < 0.0 {
                *away += f64::from(patch.points);
            }
        }
        let mut components = Vec::new();
        reserve(&mut components, signs.components, WHAT)?;
        components.extend(counts.into_iter().map(|(all, away)| {
            let (is_flipped, away) = (2.0 * away > all, away.min(all - away) / all);
            (away <= MIXED).then_some(Seen { is_flipped, away })
        }));
        let (mut all, mut seen, mut away, mut missed, mut normal) = (0.0, 0.0, 0.0, DVec3::ZERO, DVec3::ZERO);
        for (patch, flipped, component) in each(patches, signs) {
            let points = f64::from(patch.points);
            all += points;
            let Some(Seen { is_flipped, .. }) = components[component] else { continue };
            let weighed = weighed(patch, flipped ^ is_flipped);
            seen += points;
            normal += weighed;
            if self.cosine(patch, flipped ^ is_flipped) < 0.0 {
                away += points;
                missed += weighed;
            }
        }
        let mixed = 1.0 - seen / all;
        Ok(Turned { components, mixed, away: away / seen.max(1.0), missed: missed / seen.max(1.0), normal })
    }

    fn cosine(&self, patch: &Patch, is_flipped: bool) -> f32 {
        signed(is_flipped, patch.normal).dot(self.towards)
    }

    /// The share of the points that lie behind others.
    fn hidden(&self, grid: &Grid, patches: &Patches, noise: f32) -> Result<f64, Error> {
        // Sheared along the axis next to it, so that mirrored points fall into mirrored squares.
        let along = self.towards.abs().max_position();
        let (across, up) = ((along + 1) % 3, (along + 2) % 3);
        let shear = self.towards.as_dvec3() / f64::from(self.towards[along]);
        let mut spots = Vec::new();
        reserve(&mut spots, patches.all.len(), WHAT)?;
        spots.extend(patches.places(grid).map(|(patch, place)| {
            let square = |axis: usize| (place[axis] - place[along] * shear[axis]).floor() as i64;
            let cosine = self.cosine(patch, false);
            let rise = self.towards - patch.normal / cosine.abs().max(STEEPEST).copysign(cosine);
            Spot {
                square: (square(across), square(up)),
                depth: self.towards.as_dvec3().dot(place),
                slope: f64::from(rise[across] * rise[across] + rise[up] * rise[up]).sqrt(),
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
                let steeper = std::f64::consts::SQRT_2 * front.slope.max(spot.slope);
                let least = BEHIND + DEVIATIONS * f64::from(noise) + steeper;
                all += f64::from(spot.points);
                if front.depth - spot.depth > least {
                    hidden += f64::from(spot.points);
                }
            }
        }
        Ok(hidden / all)
    }

    /// How much denser what is nearer by a standard deviation is, as a logarithm, or 0 if that may be chance: of the points of a
    /// patch by how near it is, and by the logarithm of its cosine, because a scanner sees fewer points of what is slanted.
    fn density(&self, ball: &Ball, grid: &Grid, patches: &Patches) -> f64 {
        let mean = patches.all.iter().map(|patch| f64::from(patch.points)).sum::<f64>() / patches.all.len() as f64;
        let samples = || {
            let near = patches.places(grid).filter(|&(patch, place)| !patch.has_rival && ball.holds(place));
            near.filter_map(|(patch, place)| {
                let cosine = self.cosine(patch, false).abs();
                let nearness = self.towards.as_dvec3().dot(place);
                (cosine >= FACING).then(|| {
                    (
                        f64::from(patch.points) / mean,
                        DVec3::new(log2(patch.points.into()), nearness, log2(cosine.into())),
                    )
                })
            })
        };
        let Thinning { count, near, error, depth, .. } = Thinning::of(samples);
        let is_told = count >= LEAST_DENSITIES && depth >= LEAST_DEPTH && near.abs() >= CHANCE * error;
        if is_told && near.is_finite() { std::f64::consts::LN_2 * near * depth } else { 0.0 }
    }
}

/// Surfaces turned to one side.
struct Turned {
    /// For each component how it faces that side; `None` for what was not seen from one side.
    components: Vec<Option<Seen>>,
    /// The share of those.
    mixed: f64,
    /// The share of the others that still faces away.
    away: f64,
    /// The sum of the normals of that, for each point of them.
    missed: DVec3,
    /// The sum of all their normals.
    normal: DVec3,
}

/// A component that faces a side.
#[derive(Clone, Copy)]
struct Seen {
    /// Once it is flipped.
    is_flipped: bool,
    /// But for this share.
    away: f64,
}

impl Turned {
    /// Whether a component was turned.
    fn is_flipped(&self, component: usize) -> bool {
        self.components[component].is_some_and(|seen| seen.is_flipped)
    }
}

/// The mean volume behind what was seen from one side, less where it lies before that.
fn bulge(decisions: &[Decision], turned: &Turned) -> f64 {
    let (mut sum, mut all) = (0.0, 0.0);
    for (decision, seen) in decisions.iter().zip(&turned.components) {
        let Some(seen) = seen else { continue };
        let points = decision.component.points as f64;
        sum += points * signed(seen.is_flipped, decision.volume);
        all += points;
    }
    if all > 0.0 { sum / all } else { 0.0 }
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
        let flipped = |patch: usize| signs.flipped[patch] ^ turned.is_flipped(component(patch));
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
    square: (i64, i64),
    /// How near it is, in edges.
    depth: f64,
    /// How much nearer or farther its plane is an edge away.
    slope: f64,
    points: u32,
}

/// The patches, whether each is flipped, and its component.
fn each<'a>(patches: &'a Patches, signs: &'a Signs) -> impl Iterator<Item = (&'a Patch, bool, usize)> {
    let signs = signs.flipped.iter().zip(&signs.component);
    patches.all.iter().zip(signs).map(|(patch, (&flipped, &component))| (patch, flipped, component as usize))
}

/// The normal of a patch, as long as it has points.
fn weighed(patch: &Patch, is_flipped: bool) -> DVec3 {
    f64::from(patch.points) * signed(is_flipped, patch.normal).as_dvec3()
}
