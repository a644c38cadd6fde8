//! Which way open surfaces face: towards what stands before them.

use super::air::Sights;
use super::components::{Decision, Side};
use super::looks::{LOOKERS, Look, Looks, Votes};
use super::patches::{Patches, signed};
use super::signs::{LEAST_PATCHES, Signs};
use crate::error::Error;
use crate::grid::Grid;
use crate::lists::{filled, grow};
use crate::progress::Stage;

/// What errors call the memory of all this.
const WHAT: &str = "the facing of surfaces";

/// A side is decided when the square of the balance is more than this times the total, both in looks head-on: by more than
/// 16 all on one side, or by 100 against 50. With 12, roofs that look at each other under the edge that their missing walls
/// leave turn some of them. The largest surface is what the others stand on or before, so fewer decide.
const SURE: f64 = 16.0;
const SURE_OF_LARGEST: f64 = 5.0;

/// What stands before a surface looks at it with much of itself, what lies behind it with what shows past its edge only: the
/// looks of one surface at another are worth so much for each of its patches, or count nothing. Furniture in a corner has 0.4
/// and more, parts of a body that was seen from one side up to 0.1. A few patches may look at anything.
const LEAST_LOOKING: f64 = 0.3;

/// Where the balance is less than this share of all, nothing is told however many look: shadows let looks through to the wrong
/// side. After the first round there are more of these: a wall looks at the back of what was scanned from one side before it.
const ONE_SIDED: f64 = 0.2;
const ONE_SIDED_LATER: f64 = 0.8;

/// What holds less volume is told by its own parts, too, as ground is by what stands on it. Other open surfaces look at their own
/// hollow side: with 0.1 a sixth of a pipe does, with 0.5 what one range image shows of a body.
const HOLLOW: f64 = 0.05;

/// What holds more is told only by looks that are worth this share of its patches: else a few at the back of a statue, through what
/// was not scanned of it, turn it inside out.
const LEAST_LOOKS: f64 = 0.04;

/// The largest surface is ground to which all is joined that stands on it if it holds less than this, its own parts all but
/// agree on its side, and their looks are worth that share of its patches: range images of hills look at themselves from
/// both sides, and two thirds of a half pipe from behind, but little. Steps between walls hold 0.40.
const BULGE: f64 = 0.42;
const AGREED: f64 = 0.85;

/// What holds less is flat: only that is told by what was told before. Boxes of which two walls are missing have 0.3, and are
/// looked at from behind through the gap.
const FLAT: f64 = 0.1;

/// The confidence where every look is at one side: no more, as also the parts of a surface with one side look at each other.
const MOST_CONFIDENCE: f64 = 0.5;

/// Rounds at the most: in each, what was told in the one before looks out.
const ROUNDS: usize = 8;

/// How much a surface is looked at, by others and by its own parts.
#[derive(Clone, Copy, Default)]
struct Looked {
    others: Votes,
    own: Votes,
}

impl Looked {
    /// What counts of the looks at a surface; each stands for `step`.
    fn count(&self, decision: &Decision, is_largest: bool, step: usize) -> Votes {
        let Self { others, own } = *self;
        let is_ground = is_largest && decision.volume.abs() < BULGE && own.agreement() > AGREED;
        let is_clear = |votes: &Votes| votes.balance.abs() * step as f64 > LEAST_LOOKS * decision.patches as f64;
        if decision.volume.abs() < HOLLOW || is_ground && is_clear(&own) {
            Votes { balance: others.balance + own.balance, all: others.all + own.all }
        } else if is_clear(&others) {
            others
        } else {
            Votes::default()
        }
    }
}

/// Turns the surfaces that are not closed to face what looks at them.
///
/// Where the open side of an object looks at a wall, nothing stands between the two: there the scanner was, not behind the
/// wall, which so faces the object. First look the patches that are in the open, of surfaces that agree with them; then, at
/// flat surfaces, all those that were told just before. Along a line of sight what faces it and what does not alternates
/// (Takayama and others, 2014); here in 26 directions, and for surfaces, not for facets. Each round is some passes over the
/// patches and at most some fifty thousand rays.
pub(super) fn turn_to_what_looks(
    grid: &Grid,
    patches: &Patches,
    sights: &Sights,
    looks: Option<Looks>,
    signs: &mut Signs,
    decisions: &mut [Decision],
    stage: &Stage,
) -> Result<(), Error> {
    // Nothing else looks at what is alone.
    let is_alone = decisions.len() == 1;
    // Told, or not to be.
    let mut is_settled = filled(false, decisions.len(), WHAT)?;
    for (is_settled, decision) in is_settled.iter_mut().zip(&*decisions) {
        let is_closed = decision.component.side == Side::Air;
        *is_settled = is_closed || decision.patches < LEAST_PATCHES || is_alone && decision.volume.abs() >= BULGE;
    }
    if !is_settled.contains(&false) {
        return Ok(());
    }
    let component = |signs: &Signs, patch: usize| signs.component[patch] as usize;

    let looks = match looks {
        Some(looks) => looks,
        None => Looks::from_the_open(grid, patches, sights)?,
    };
    let agrees = |look: &Look| look.is_against == signs.flipped[look.from as usize];
    let looked = looked_at(&looks, signs, decisions, &is_settled, &agrees)?;
    let mut fresh = tell(looked, looks.step, ONE_SIDED, signs, decisions, &mut is_settled)?;

    for (is_settled, decision) in is_settled.iter_mut().zip(&*decisions) {
        *is_settled |= decision.volume.abs() >= FLAT;
    }
    for round in 1..ROUNDS {
        if !fresh.contains(&true) || !is_settled.contains(&false) {
            break;
        }
        stage.tell(round as f64 / ROUNDS as f64)?;
        let front_side = |patch: usize| fresh[component(signs, patch)].then_some(signs.flipped[patch]);
        let looks = Looks::of(grid, patches, LOOKERS, &front_side)?;
        let looked = looked_at(&looks, signs, decisions, &is_settled, &|_| true)?;
        fresh = tell(looked, looks.step, ONE_SIDED_LATER, signs, decisions, &mut is_settled)?;
    }
    Ok(())
}

/// Turns the surfaces that are looked at from behind, and answers which were told, those included.
fn tell(
    looked: Vec<Looked>,
    step: usize,
    one_sided: f64,
    signs: &mut Signs,
    decisions: &mut [Decision],
    is_settled: &mut [bool],
) -> Result<Vec<bool>, Error> {
    let (mut fresh, mut is_turned) = (filled(false, looked.len(), WHAT)?, filled(false, looked.len(), WHAT)?);
    for (i, looked) in looked.into_iter().enumerate() {
        let votes = looked.count(&decisions[i], i == 0, step);
        let (Votes { balance, all }, sure) = (votes, if i == 0 { SURE_OF_LARGEST } else { SURE });
        if balance * balance > sure * all && votes.agreement() > one_sided {
            (is_settled[i], fresh[i], is_turned[i]) = (true, true, balance < 0.0);
            let component = &mut decisions[i].component;
            (component.side, component.confidence) = (Side::Sight, MOST_CONFIDENCE * balance.abs() / all);
        }
    }
    for (flipped, &component) in signs.flipped.iter_mut().zip(&signs.component) {
        *flipped ^= is_turned[component as usize];
    }
    Ok(fresh)
}

/// How much each surface that is not settled is looked at; `counts` answers for a look whether it tells anything of others.
fn looked_at(
    looks: &Looks,
    signs: &Signs,
    decisions: &[Decision],
    is_settled: &[bool],
    counts: &dyn Fn(&Look) -> bool,
) -> Result<Vec<Looked>, Error> {
    let mut looked = filled(Looked::default(), is_settled.len(), WHAT)?;
    // What looks at what, and the vote.
    let mut others = Vec::new();
    for look in &looks.all {
        let (to, from) = (signs.component[look.to as usize], signs.component[look.from as usize]);
        if is_settled[to as usize] {
            continue;
        }
        let vote = signed(signs.flipped[look.to as usize], look.along);
        if to == from {
            looked[to as usize].own.add(vote);
        } else if counts(look) {
            grow(&mut others, 1, WHAT)?;
            others.push((to, from, vote));
        }
    }
    // By the vote, too: sums of the same numbers in another order would be others.
    others.sort_unstable_by_key(|&(to, from, vote)| (to, from, vote.to_bits()));
    for pair in others.chunk_by(|one, next| (one.0, one.1) == (next.0, next.1)) {
        let (to, from, _) = pair[0];
        let mut votes = Votes::default();
        pair.iter().for_each(|&(_, _, vote)| votes.add(vote));
        let lookers = decisions[from as usize].patches;
        if lookers >= LEAST_PATCHES && votes.balance.abs() * looks.step as f64 > LEAST_LOOKING * lookers as f64 {
            let others = &mut looked[to as usize].others;
            others.balance += votes.balance;
            others.all += votes.all;
        }
    }
    Ok(looked)
}

#[cfg(test)]
mod tests {
    use super::super::components::Component;
    use super::*;

    /// One surface of a thousand patches, and one that looks at its front with some of its own.
    #[test]
    fn what_shows_past_an_edge_tells_nothing() {
        let balance = |patches: u64, looks: usize| {
            let component = Component { points: 0, side: Side::Volume, confidence: 0.0 };
            let decisions = [1000, patches].map(|patches| Decision { component, patches, volume: 0.2 });
            let component = (0..1000 + patches).map(|patch| u32::from(patch >= 1000)).collect();
            let signs = Signs { flipped: vec![false; 1000 + patches as usize], component, components: 2 };
            let look =
                |i: usize| Look { from: 1000 + i as u32 % patches as u32, is_against: false, to: i as u32, along: 0.5 };
            let looks = Looks { all: (0..looks).map(look).collect(), step: 2 };
            looked_at(&looks, &signs, &decisions, &[false; 2], &|_| true).unwrap()[0].others.balance
        };
        assert_eq!(balance(100, 20), 0.0);
        assert_eq!(balance(100, 40), 20.0);
        assert_eq!(balance(40, 40), 20.0);
        assert_eq!(balance(20, 40), 0.0, "few patches look at anything");
    }

    /// Ten looks at the back of a surface of 20,000 patches, each of which stands for five.
    #[test]
    fn a_few_looks_turn_nothing_that_bulges() {
        let counted = |volume: f64, patches: u64| {
            let component = Component { points: 0, side: Side::Volume, confidence: 0.0 };
            let others = Votes { balance: -10.0, all: 10.0 };
            let looked = Looked { others, own: Votes::default() };
            looked.count(&Decision { component, patches, volume }, true, 5).balance
        };
        assert_eq!(counted(0.1, 20_000), 0.0);
        assert_eq!(counted(0.1, 1_000), -10.0);
        assert_eq!(counted(0.01, 20_000), -10.0, "a floor on which little stands");
    }
}
