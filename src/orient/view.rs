//! Clouds that were seen from one side: all their surfaces face the scanner.

use super::ball::Ball;
use super::components::{Decision, Side, is_below};
use super::ends::told;
use super::eye::{Eye, Seen, Signed, Turned, each, some};
use super::looks::Looks;
use super::patches::{Patches, signed};
use super::signs::{LEAST_PATCHES, Signs};
use crate::error::Error;
use crate::grid::Grid;
use crate::lattice::mixed;
use crate::lists::{filled, reserve};
use crate::progress::Stage;
use glam::DVec3;
use std::f32::consts::SQRT_2;

/// What errors call the memory of all this.
const WHAT: &str = "the view";

/// The share of a view that faces away, by wrong signs, or from a direction because it is wide: single views have up to 0.06,
/// rooms from inside 0.1, an aerial scan with trees 0.14. With more than the last no better direction is looked for, with less
/// than the first it need not be. With less than [`ALMOST`] a place may do better.
const ENOUGH: f64 = 0.005;
const MOST_AWAY: f64 = 0.08;
const ALMOST: f64 = 0.12;
const HOPELESS: f64 = 0.3;

/// A view by signs that are less likely has to fit so much better: of what was seen from two or three sides some faces away in any
/// case, and a little less where a piece of it has the wrong sign.
const CLEARLY_BETTER: f64 = 0.5;

/// So much may be of components that were scanned all round.
const MOST_MIXED: f64 = 0.2;

/// So few that face away, of all and of a component, are wrong signs, if they do so clearly: the cosine of 107 degrees.
const MISTAKES: f64 = 0.02;
const CLEARLY_AWAY: f32 = -0.3;

/// Directions that are tried, and places, and of how many patches at the most.
const ROUNDS: usize = 20;
const SOME: usize = 1 << 14;

/// The share of a view that lies behind other parts of it. Its middle is no scanner, so there are some: 0.13 in an aerial scan;
/// of the two sides of a plate, or floor and ceiling, it is half.
const MOST_HIDDEN: f64 = 0.15;

/// How far behind that is, in edges, besides what slopes and noise explain.
const BEHIND: f32 = 0.25;
const DEVIATIONS: f32 = 2.0;

/// Slopes beyond, by the cosine of the angle between normal and view, are no steeper.
const STEEPEST: f32 = 0.05;

/// Less that tells at which end the scanner was is a guess.
const GUESS: f64 = 0.2;

/// The confidence where everything speaks for one side: no more, as it is told by what is likely.
const MOST_CONFIDENCE: f64 = 0.5;

/// From where all was seen, or from where it all faces away.
///
/// What a scanner saw faces it. So if there is a direction, or a place, that nearly all patches face, once some surfaces are
/// turned, and from which nearly none hides another, the surfaces are turned to it together, also those whose own volume, or what
/// they see of the others, says the opposite, as of what is seen past the edge of something else. From behind it would look the
/// same.
pub(super) struct View {
    eye: Eye,
    /// The share that does not fit.
    unfit: f64,
}

impl View {
    /// That of a cloud, if it is one. Two passes over some patches for each round, of which there is one where the cloud is
    /// closed, and two over all.
    pub fn of(
        (ball, grid, patches): (&Ball, &Grid, &Patches),
        noise: f32,
        signs: &Signs,
        stage: &Stage,
    ) -> Result<Option<Self>, Error> {
        if patches.all.len() < LEAST_PATCHES as usize {
            return Ok(None);
        }
        let some = some(SOME, (ball, grid, patches), signs)?;
        let mut sums = filled(DVec3::ZERO, signs.components, WHAT)?;
        for patch in &some {
            sums[patch.component as usize] += f64::from(patch.points) * patch.normal.as_dvec3();
        }
        let longest =
            sums.iter().fold(DVec3::ZERO, |a, &b| if b.length_squared() > a.length_squared() { b } else { a });
        let towards = sums.iter().map(|&normal| signed(longest.dot(normal) < 0.0, normal)).sum();
        let Some(far) = Eye::far(ball, towards) else { return Ok(None) };
        let (mut eye, mut turned) = best(far, &some, signs.components, [0.0, 0.0], &stage.part(0.0..0.5))?;
        if (ENOUGH..ALMOST).contains(&turned.unfit()) {
            let (near, faced) = best(eye, &some, signs.components, [-1.0, 1.0], &stage.part(0.5..1.0))?;
            if faced.unfit() < turned.unfit() && !near.is_too_near() {
                (eye, turned) = (near, faced);
            }
        }
        let view = Self { eye, unfit: turned.unfit() };
        let is_one = turned.missed.share() <= MOST_AWAY
            && turned.mixed <= MOST_MIXED
            && view.hidden(each(ball, grid, patches, signs), patches.all.len(), noise)? <= MOST_HIDDEN;
        Ok(is_one.then_some(view))
    }

    /// Whether it fits as well as any.
    pub fn is_sure(&self) -> bool {
        self.unfit <= ENOUGH
    }

    /// Whether another one does not fit clearly better.
    pub fn is_as_good(&self, other: &Self) -> bool {
        CLEARLY_BETTER * self.unfit <= other.unfit
    }

    /// Turns all surfaces to the scanner, at that end of the view where it was. Where nothing tells that, the mean of all normals
    /// is turned by convention.
    pub fn turn_to_it(
        &self,
        (ball, grid, patches): (&Ball, &Grid, &Patches),
        looks: Option<&Looks>,
        signs: &mut Signs,
        decisions: &mut [Decision],
    ) -> Result<(), Error> {
        let turned = Turned::to(&self.eye, || each(ball, grid, patches, signs), signs.components)?;
        let told = told(&self.eye, &turned, (ball, grid, patches), looks, signs, decisions)?;
        let is_guess = told.abs() < GUESS;
        let is_from_behind = if is_guess { is_below(turned.normal) } else { told < 0.0 };
        let told = match is_guess {
            true => (Side::Convention, 0.0),
            false => (Side::View, MOST_CONFIDENCE * told.abs() / (1.0 + told.abs())),
        };
        let mistakes = turned.missed.share() <= MISTAKES;
        for (i, (patch, place)) in patches.places(grid).enumerate() {
            let Some(Seen { is_flipped, away }) = turned.components[signs.component[i] as usize] else { continue };
            let is_flipped = signs.flipped[i] ^ is_flipped;
            let cosine = self.eye.cosine(signed(is_flipped, patch.normal), (place - ball.middle).as_vec3());
            let is_mistake = mistakes && away <= MISTAKES && cosine < CLEARLY_AWAY;
            signs.flipped[i] = is_flipped ^ is_mistake ^ is_from_behind;
        }
        for (decision, _) in decisions.iter_mut().zip(&turned.components).filter(|(_, seen)| seen.is_some()) {
            (decision.component.side, decision.component.confidence) = told;
        }
        Ok(())
    }

    /// The share of the points that lie behind others.
    fn hidden(&self, all: impl Iterator<Item = Signed>, count: usize, noise: f32) -> Result<f64, Error> {
        // Where they are seen before a plane through the middle, across the axis next to the view, so that mirrored points fall
        // into mirrored squares.
        let towards = self.eye.towards.as_vec3();
        let along = towards.abs().max_position();
        let (across, up) = ((along + 1) % 3, (along + 2) % 3);
        let mut projected = Vec::new();
        reserve(&mut projected, count, WHAT)?;
        projected.extend(all.map(|Signed { place, normal, points, .. }| {
            let direction = self.eye.direction(place);
            let square =
                |axis: usize| (place[axis] - place[along] * (direction[axis] / direction[along])).floor() as i32;
            let cosine = self.eye.cosine(normal, place);
            let rise = direction.normalize() - normal / cosine.abs().max(STEEPEST).copysign(cosine);
            Projected {
                square: (square(across), square(up)),
                depth: towards.dot(place),
                slope: (rise[across] * rise[across] + rise[up] * rise[up]).sqrt(),
                points,
            }
        }));
        let (squares, fronts) = squares(&projected)?;
        let (mut hidden, mut all) = (0.0, 0.0);
        for (patch, square) in projected.iter().zip(squares) {
            let front = &projected[fronts[square] as usize];
            let steeper = SQRT_2 * front.slope.max(patch.slope);
            let least = BEHIND + DEVIATIONS * noise + steeper;
            all += f64::from(patch.points);
            if front.depth - patch.depth > least {
                hidden += f64::from(patch.points);
            }
        }
        Ok(hidden / all)
    }
}

/// The best eye that one learns to be, with a nearness in `range`, and what is turned to it.
fn best(eye: Eye, some: &[Signed], components: usize, range: [f64; 2], stage: &Stage) -> Result<(Eye, Turned), Error> {
    let turned = |eye: &Eye| Turned::to(eye, || some.iter().copied(), components);
    let mut best = (eye, turned(&eye)?);
    let mut next = eye.taught(&best.1.missed, range);
    for round in 1..ROUNDS {
        stage.tell(round as f64 / ROUNDS as f64)?;
        let Some(eye) = next.filter(|_| (ENOUGH..=HOPELESS).contains(&best.1.unfit())) else { break };
        let turned = turned(&eye)?;
        next = eye.taught(&turned.missed, range);
        if turned.unfit() < best.1.unfit() {
            best = (eye, turned);
        }
    }
    Ok(best)
}

/// A patch as the scanner sees it.
struct Projected {
    /// Where it is across the view, in edges.
    square: (i32, i32),
    /// How near it is, in edges.
    depth: f32,
    /// How much nearer or farther its plane is an edge away.
    slope: f32,
    points: u32,
}

impl Projected {
    /// Whether it stands before another one; of two at one depth the steeper does.
    fn is_before(&self, other: &Self) -> bool {
        self.depth.total_cmp(&other.depth).then(self.slope.total_cmp(&other.slope)).is_gt()
    }
}

/// For each patch the number of its square, in a table by hash, and for each square the patch that stands before all others
/// there.
fn squares(all: &[Projected]) -> Result<(Vec<usize>, Vec<u32>), Error> {
    const FREE: u32 = u32::MAX;
    let bits = (2 * all.len()).next_power_of_two().ilog2();
    let (mut squares, mut fronts) = (Vec::new(), filled(FREE, 1 << bits, WHAT)?);
    reserve(&mut squares, all.len(), WHAT)?;
    for (patch, number) in all.iter().zip(0..) {
        let (across, up) = patch.square;
        let mut square = (mixed(across as u64, up as u64, 0) >> (u64::BITS - bits)) as usize;
        while fronts[square] != FREE && all[fronts[square] as usize].square != patch.square {
            square = (square + 1) % fronts.len();
        }
        if fronts[square] == FREE || patch.is_before(&all[fronts[square] as usize]) {
            fronts[square] = number;
        }
        squares.push(square);
    }
    Ok((squares, fronts))
}
