//! Which way open surfaces face: towards what stands before them.

use super::air::{Sights, is_hidden};
use super::components::{Decision, Side};
use super::patches::{Patches, signed};
use super::signs::Signs;
use crate::error::Error;
use crate::grid::Grid;
use crate::lattice::{BRICK, cube_bit, cube_place};
use crate::lists::filled;
use crate::progress::Stage;
use crate::surroundings::STEPS;
use glam::IVec3;

/// What errors call the memory of all this.
const WHAT: &str = "the facing of surfaces";

/// A patch that sees so much more of the open on one side than on the other, of all that it sees, has that side in the open:
/// objects have, ground and walls do not.
const IN_THE_OPEN: f32 = 0.5;

/// Less of the open is a gap, and what sees so much of it has next to nothing else before it: all on one side is 0.67 to 0.74.
const LEAST_OPEN: f32 = 0.05;
const MOST_OPEN: f32 = 0.66;

/// Patches that look out in a round at the most: enough to tell every larger surface, and the rays do not grow with the points.
const LOOKERS: usize = 4096;

/// How far they look, in steps from cube to cube.
const REACH: i32 = 1024;

/// They look in directions that are at most 72 degrees from their normal, by its cosine.
const AHEAD: f32 = 0.3;

/// Surfaces of fewer patches are not worth the time.
const LEAST_PATCHES: u64 = 32;

/// A surface is told by looks, each as much as a ray that hits it head-on, if the square of their balance is so many times
/// their sum: by more than sixteen at one side, by a hundred at one and fifty at the other. With twelve, roofs that look at each
/// other under the edge that their missing walls leave turn some of them. The largest surface is what the others stand on or
/// before, so fewer tell.
const SURE: f64 = 16.0;
const SURE_OF_LARGEST: f64 = 5.0;

/// Where the balance is less than this share of all, nothing is told however many look: shadows let looks through to the wrong
/// side. After the first round there are more of these: a wall looks at the back of what was scanned from one side before it.
const ONE_SIDED: f64 = 0.2;
const ONE_SIDED_LATER: f64 = 0.8;

/// What holds less volume is told by its own parts, too, as ground is by what stands on it. Other open surfaces look at their own
/// hollow side: with 0.1 a sixth of a pipe does, with 0.5 what one range image shows of a body.
const HOLLOW: f64 = 0.05;

/// The largest surface is ground to which all is joined that stands on it if it holds less than this, its own parts all but
/// agree on its side, and their looks are worth no small share of its patches: range images of hills look at themselves from
/// both sides. Two thirds of a half pipe hold 0.37, and so much do steps between walls.
const BULGE: f64 = 0.35;
const AGREED: f64 = 0.85;
const LEAST_OWN: f64 = 0.04;

/// What holds less is flat: only that is told by what was told before. Boxes of which two walls are missing have 0.3, and are
/// looked at from behind through the gap.
const FLAT: f64 = 0.1;

/// The confidence where every look is at one side: no more, as also the parts of a surface with one side look at each other.
const MOST_CONFIDENCE: f64 = 0.5;

/// Rounds at the most: in each, what was told in the one before looks out.
const ROUNDS: usize = 8;

/// Looks at a surface.
#[derive(Clone, Copy, Default)]
struct Looks {
    /// At the side that its normals point to, less at the other.
    balance: f64,
    all: f64,
}

impl Looks {
    /// Whether they are at one side, but for so much.
    fn agree(&self, share: f64) -> bool {
        self.balance.abs() > share * self.all
    }
}

/// How much a surface is looked at, by others and by its own parts.
#[derive(Clone, Copy, Default)]
struct Looked {
    others: Looks,
    own: Looks,
}

impl Looked {
    /// What counts of the looks at a surface.
    fn count(&self, decision: &Decision, is_largest: bool) -> Looks {
        let Self { others, own } = *self;
        let is_ground = is_largest && decision.volume < BULGE && own.agree(AGREED);
        if decision.volume < HOLLOW || is_ground && own.balance.abs() > LEAST_OWN * decision.patches as f64 {
            Looks { balance: others.balance + own.balance, all: others.all + own.all }
        } else {
            others
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
        *is_settled = is_closed || decision.patches < LEAST_PATCHES || is_alone && decision.volume >= BULGE;
    }
    if !is_settled.contains(&false) {
        return Ok(());
    }
    let component = |signs: &Signs, patch: usize| signs.component[patch] as usize;

    let open_side = |patch: usize| {
        let (exposure, all) = (sights.exposure[patch], sights.all[patch]);
        let is_looker = all > LEAST_OPEN && exposure.abs() > IN_THE_OPEN * all && exposure.abs() < MOST_OPEN;
        is_looker.then_some(exposure < 0.0)
    };
    let agrees = |patch: usize, is_flipped: bool| is_flipped == signs.flipped[patch];
    let looked = look(grid, patches, signs, &is_settled, &open_side, &agrees)?;
    let mut fresh = tell(looked, ONE_SIDED, signs, decisions, &mut is_settled)?;

    for (is_settled, decision) in is_settled.iter_mut().zip(&*decisions) {
        *is_settled |= decision.volume >= FLAT;
    }
    for round in 1..ROUNDS {
        if !fresh.contains(&true) || !is_settled.contains(&false) {
            break;
        }
        stage.tell(round as f64 / ROUNDS as f64)?;
        let front_side = |patch: usize| fresh[component(signs, patch)].then_some(signs.flipped[patch]);
        let looked = look(grid, patches, signs, &is_settled, &front_side, &|_, _| true)?;
        fresh = tell(looked, ONE_SIDED_LATER, signs, decisions, &mut is_settled)?;
    }
    Ok(())
}

/// Turns the surfaces that are looked at from behind, and answers which were told, those included.
fn tell(
    looked: Vec<Looked>,
    one_sided: f64,
    signs: &mut Signs,
    decisions: &mut [Decision],
    is_settled: &mut [bool],
) -> Result<Vec<bool>, Error> {
    let (mut fresh, mut is_turned) = (filled(false, looked.len(), WHAT)?, filled(false, looked.len(), WHAT)?);
    for (i, looked) in looked.into_iter().enumerate() {
        let looks = looked.count(&decisions[i], i == 0);
        let (Looks { balance, all }, sure) = (looks, if i == 0 { SURE_OF_LARGEST } else { SURE });
        if balance * balance > sure * all && looks.agree(one_sided) {
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

/// How much each surface that is not settled is looked at. `side` answers for patches that look out whether they do so against
/// their normal; `counts(patch, against its normal)` whether what it sees of others tells anything.
fn look(
    grid: &Grid,
    patches: &Patches,
    signs: &Signs,
    is_settled: &[bool],
    side: &dyn Fn(usize) -> Option<bool>,
    counts: &dyn Fn(usize, bool) -> bool,
) -> Result<Vec<Looked>, Error> {
    let mut looked = filled(Looked::default(), is_settled.len(), WHAT)?;
    let rays = Rays::through(grid);
    let step = (0..patches.all.len()).filter(|&patch| side(patch).is_some()).count().div_ceil(LOOKERS);
    let mut lookers = 0;
    for (brick, cube, bit) in (0..grid.blocks.len()).flat_map(|block| grid.cubes_in(block)) {
        let place = BRICK * grid.bricks.places[brick] + cube_place(bit);
        for patch in patches.of_cube(cube) {
            let Some(is_flipped) = side(patch) else { continue };
            lookers += 1;
            if lookers % step != 0 {
                continue;
            }
            let (looker, beside) = (&patches.all[patch], &patches.all[patches.of_cube(cube)]);
            for direction in STEPS {
                let ray = direction.as_vec3().normalize_or_zero();
                if ray.dot(signed(is_flipped, looker.normal)) < AHEAD || is_hidden(looker, beside, direction) {
                    continue;
                }
                let Some(hit) = rays.first(place, direction) else { continue };
                for other in patches.of_cube(hit) {
                    let (seen, component) = (&patches.all[other], signs.component[other]);
                    let is_own = component == signs.component[patch];
                    if is_settled[component as usize]
                        || !(is_own || counts(patch, is_flipped))
                        || is_hidden(seen, &patches.all[patches.of_cube(hit)], -direction)
                    {
                        continue;
                    }
                    let along = -signed(signs.flipped[other], seen.normal).dot(ray) * seen.certainty();
                    let Looked { others, own } = &mut looked[component as usize];
                    let looks = if is_own { own } else { others };
                    looks.balance += f64::from(along);
                    looks.all += f64::from(along.abs());
                }
            }
        }
    }
    Ok(looked)
}

/// The occupied cubes, and the box round them.
struct Rays<'a> {
    grid: &'a Grid,
    low: IVec3,
    high: IVec3,
}

impl<'a> Rays<'a> {
    fn through(grid: &'a Grid) -> Self {
        let places = &grid.bricks.places;
        let low = places.iter().fold(IVec3::MAX, |low, &place| low.min(place));
        let high = places.iter().fold(IVec3::MIN, |high, &place| high.max(place));
        Self { grid, low, high }
    }

    /// The first occupied cube in a direction, if there is air before it.
    fn first(&self, place: IVec3, direction: IVec3) -> Option<usize> {
        let grid = self.grid;
        let mut distance = 1;
        while distance <= REACH {
            let place = place + distance * direction;
            let brick = place >> BRICK.trailing_zeros();
            if (brick.cmplt(self.low) | brick.cmpgt(self.high)).any() {
                break;
            }
            let within = place - BRICK * brick;
            let Some(number) = grid.bricks.number(brick) else {
                // To the next brick.
                let ahead = IVec3::select(direction.cmpgt(IVec3::ZERO), BRICK - within, within + 1);
                distance += IVec3::select(direction.cmpeq(IVec3::ZERO), IVec3::splat(BRICK), ahead).min_element();
                continue;
            };
            let (number, bit) = (number as usize, cube_bit(within));
            if grid.masks[number] >> bit & 1 == 1 {
                return (distance > 1).then(|| grid.cube(number, bit) as usize);
            }
            distance += 1;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::{CUBES, Lattice};
    use crate::points::{Bounds, Points};
    use crate::progress::Progress;
    use crate::source::Source;
    use glam::DVec3;

    /// In a box of 60 cubes with one in a hundred occupied, so that every other brick is empty.
    #[test]
    fn what_is_seen_first_is_what_steps_one_by_one_meet() {
        const SIDE: u32 = 60;
        let mut bits = 1u32;
        let mut random = || {
            bits = bits.wrapping_mul(0x9E37_79B9).wrapping_add(0x85EB_CA6B);
            (bits ^ bits >> 15) >> 8
        };
        let cubes: Vec<IVec3> =
            (0..2000).map(|_| IVec3::from_array([(); 3].map(|()| (random() % SIDE) as i32))).collect();
        let corners = [IVec3::ZERO, IVec3::splat(SIDE as i32 - 1)];
        let coordinates: Vec<f32> =
            cubes.iter().chain(&corners).flat_map(|cube| cube.to_array().map(|c| c as f32 + 0.5)).collect();
        let points = Points::from_f32(&coordinates).unwrap();
        let lattice = Lattice::new(&Bounds::of(&points), &|| DVec3::ZERO, 1.0, CUBES);
        let stage = Progress::silent();
        let stage = stage.stage("test", 0.0..1.0);
        let (grid, _) = Grid::sort(&Source::new(&points, lattice), &stage, |_, _| ()).unwrap();
        let rays = Rays::through(&grid);
        let cube_at = |place: IVec3| {
            let brick = place.div_euclid(IVec3::splat(BRICK));
            let number = grid.bricks.number(brick)? as usize;
            let bit = (0..64).find(|&bit| BRICK * brick + cube_place(bit) == place)?;
            (grid.masks[number] >> bit & 1 == 1).then(|| grid.cube(number, bit) as usize)
        };
        let mut seen = 0;
        for &from in &cubes {
            for direction in STEPS.into_iter().filter(|&direction| direction != IVec3::ZERO) {
                let mut along = (1..SIDE as i32).map(|distance| from + distance * direction);
                let beside = cube_at(from + direction).is_some();
                let expected = along.find_map(cube_at).filter(|_| !beside);
                assert_eq!(rays.first(from, direction), expected, "{from} {direction}");
                seen += usize::from(expected.is_some());
            }
        }
        assert!(seen > 1000, "{seen}");
    }
}
