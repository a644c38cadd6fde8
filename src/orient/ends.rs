//! At which end of a view the scanner was: from the other one all would look the same, but inside out.

use super::ball::Ball;
use super::components::Decision;
use super::eye::{Eye, Missed, Turned, some};
use super::looks::{Looks, Votes};
use super::patches::{Patches, signed};
use super::signs::Signs;
use super::spots::{Spot, spots};
use super::thinning::Thinning;
use crate::error::Error;
use crate::grid::Grid;
use crate::power::log2;
use glam::DVec3;

/// What errors call the memory of all this.
const WHAT: &str = "the view";

/// What tells at which end the scanner was, each as large as makes it clear: how far the volume lies behind the surfaces; how
/// much what stands before others looks at them, for each patch; how much denser what is nearer is, but no more than some of
/// these, because densities have other reasons, too; and how much less is seen at next to no angle, no more than some either,
/// because a deep hollow looks like a thing that was scanned from all round, and these are more: there the volume has the say.
const CLEAR_BULGE: f64 = 0.15;
const CLEAR_LOOKING: f64 = 0.005;
const CLEAR_DENSITY: f64 = 0.1;
const MOST_BY_DENSITY: f64 = 3.0;
const CLEAR_GRAZED: f64 = 0.002;
const MOST_BY_GRAZED: f64 = 2.0;

/// What holds less volume is flat: only that looks at itself from its front, and if so many of its looks agree.
const FLAT: f64 = 0.05;
const AGREED: f64 = 0.6;

/// Densities are told by patches that face the scanner so well, by the cosine; at least so many, which deviate so much in depth,
/// in edges, besides being slanted; and by no less than so many standard errors.
const FACING: f32 = 0.5;
const LEAST_DENSITIES: f64 = 100.0;
const LEAST_DEPTH: f64 = 1.0;
const CHANCE: f64 = 4.0;

/// Hardly a point is seen at a flatter angle, by the cosine: from the right end no more than this share of what would be so from
/// the other one.
const GRAZED: f32 = 0.05;
const RIGHT_SHARE: f64 = 0.4;

/// How often a better place is looked for at either end, by how many patches at the most.
const ROUNDS: usize = 20;
const SOME: usize = 4096;

/// What is steeper than the first, by the cosine, has fewer points than what faces the scanner better than the second, by their
/// ratio and less; if it deviates so much in depth, in edges: what is lower fills no cube, so that nothing tells its density.
const STEEP: f64 = 0.3;
const OPEN: f64 = 0.7;
const LEAST_HEIGHT: f64 = 1.0;

/// How clearly the scanner was where the eye is, less than zero if at the other end. Four things tell: what was scanned has its
/// volume behind what is seen of it; what looks at another surface stands before it; of what is twice as far a scanner with rays
/// in all directions, or a camera, sees a quarter as many points; and walls along the view are seen from between them.
pub(super) fn told(
    eye: &Eye,
    turned: &Turned,
    (ball, grid, patches): (&Ball, &Grid, &Patches),
    looks: Option<&Looks>,
    signs: &Signs,
    decisions: &[Decision],
) -> Result<f64, Error> {
    let by_density = density(eye, ball, grid, patches) / CLEAR_DENSITY;
    let by_grazed = grazed(eye, turned, (ball, grid, patches), signs)? / CLEAR_GRAZED;
    Ok(bulge(decisions, turned) / CLEAR_BULGE
        + looking(looks, signs, decisions, turned) / CLEAR_LOOKING
        + by_density.clamp(-MOST_BY_DENSITY, MOST_BY_DENSITY)
        + by_grazed.clamp(-MOST_BY_GRAZED, MOST_BY_GRAZED))
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

/// How much denser what is nearer by a standard deviation is, as a logarithm, or 0 if that may be chance: of the points of a
/// patch by how near it is, and by the logarithm of its cosine, because a scanner sees fewer points of what is slanted.
fn density(eye: &Eye, ball: &Ball, grid: &Grid, patches: &Patches) -> f64 {
    let mean = patches.all.iter().map(|patch| f64::from(patch.points)).sum::<f64>() / patches.all.len() as f64;
    let samples = || {
        let near = patches.places(grid).filter(|&(patch, place)| !patch.has_rival && ball.holds(place));
        near.filter_map(|(patch, place)| {
            let cosine = eye.cosine(patch.normal, (place - ball.middle).as_vec3()).abs();
            let nearness = eye.towards.dot(place);
            (cosine >= FACING).then(|| {
                (f64::from(patch.points) / mean, DVec3::new(log2(patch.points.into()), nearness, log2(cosine.into())))
            })
        })
    };
    let Thinning { count, near, error, depth, .. } = Thinning::of(samples);
    let is_told = count >= LEAST_DENSITIES && depth >= LEAST_DEPTH && near.abs() >= CHANCE * error;
    if is_told && near.is_finite() { std::f64::consts::LN_2 * near * depth } else { 0.0 }
}

/// How much more of the points would be seen at next to no angle, or from behind, from the other end than from this one, each time
/// from where that is least: a scanner sees hardly any so. Zero if there are some from either end, as where several scans
/// were joined, or if what is steep is as dense as the rest, as where a thing was scanned all round.
fn grazed(
    eye: &Eye,
    turned: &Turned,
    (ball, grid, patches): (&Ball, &Grid, &Patches),
    signs: &Signs,
) -> Result<f64, Error> {
    let mut some = some(SOME, (ball, grid, patches), signs)?;
    some.retain(|patch| turned.components[patch.component as usize].is_some());
    some.iter_mut().for_each(|patch| *patch = patch.turned(turned.is_flipped(patch.component as usize)));
    let least = |range: [f64; 2]| {
        let (mut least, mut next) = (f64::INFINITY, Some(eye.within(range)));
        for _ in 0..ROUNDS {
            let Some(eye) = next else { break };
            let mut missed = Missed::default();
            for patch in &some {
                missed.all += f64::from(patch.points);
                if eye.cosine(patch.normal, patch.place) < GRAZED {
                    missed.add(patch);
                }
            }
            least = least.min(missed.share());
            next = eye.taught(&missed, range);
        }
        least
    };
    let (here, there) = (least([0.0, 1.0]), least([-1.0, 0.0]));
    if here.min(there) > RIGHT_SHARE * here.max(there) {
        return Ok(0.0);
    }
    let is_seen_steeply = is_seen_steeply(&spots(ball, grid, patches, WHAT)?, eye);
    Ok(if is_seen_steeply { there - here } else { 0.0 })
}

/// Whether what is steep is covered as thinly as a scanner that sees it so covers it.
fn is_seen_steeply(spots: &[Spot], eye: &Eye) -> bool {
    let mean = |least: f64, most: f64, of: &dyn Fn(&Spot) -> f64| {
        let is_told = |spot: &&Spot| (least..most).contains(&spot.normal.dot(eye.towards).abs());
        let told = spots.iter().filter(is_told);
        let (sum, all) = told.fold((0.0, 0.0), |(sum, all), spot| (sum + spot.weight * of(spot), all + spot.weight));
        sum / all
    };
    let depth = |spot: &Spot| eye.towards.dot(spot.place);
    let middle = mean(0.0, STEEP, &depth);
    let height = mean(0.0, STEEP, &|spot| (depth(spot) - middle).powi(2)).sqrt();
    let thinner = mean(0.0, STEEP, &|spot| spot.density) - mean(OPEN, f64::INFINITY, &|spot| spot.density);
    // NaN, where there is nothing steep or nothing else, tells nothing.
    height >= LEAST_HEIGHT && thinner <= log2(STEEP / OPEN)
}
