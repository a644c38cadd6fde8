//! What patches see of each other across the air, or through the body behind them.

use super::air::{DIRECTIONS, Sights, direction, hidden};
use super::patches::{Patches, signed};
use crate::error::Error;
use crate::grid::Grid;
use crate::lattice::{BRICK, cube_bit, cube_place};
use crate::lists::grow;
use glam::IVec3;

/// What errors call the memory of all this.
const WHAT: &str = "the looks across the air";

/// Patches that look out at once at the most: enough to tell every larger surface, and the rays do not grow with the points.
pub(super) const LOOKERS: usize = 4096;

/// The same of hidden ones, from both sides: they tell large parts only.
const HIDDEN: usize = 1024;

/// How far they look, in steps from cube to cube.
const REACH: i32 = 1024;

/// They look in directions that are at most 72 degrees from their normal, by its cosine.
const AHEAD: f32 = 0.3;

/// A patch that looks at another.
pub(super) struct Look {
    pub from: u32,
    /// Whether it looks out against its normal.
    pub is_against: bool,
    pub to: u32,
    /// 1 if it looks straight at the side that the other's normal points to, -1 if at the opposite one.
    pub along: f32,
}

impl Look {
    /// What speaks for the signs of the two to agree: both sides are outside, or both inside.
    pub fn evidence(&self) -> f32 {
        signed(self.is_against, self.along)
    }
}

/// What was seen, by every patch that looks out or a share of them.
pub(super) struct Looks {
    pub all: Vec<Look>,
    /// How many patches look out for each that was asked.
    pub step: usize,
}

impl Looks {
    /// Of patches in the open, from the side that is.
    pub fn from_the_open(grid: &Grid, patches: &Patches, sights: &Sights) -> Result<Self, Error> {
        Self::of(grid, patches, LOOKERS, &|patch| sights.open_side(patch))
    }

    /// Of some patches, from both sides.
    pub fn from_both_sides(grid: &Grid, patches: &Patches, is_one: &dyn Fn(usize) -> bool) -> Result<Self, Error> {
        let from = |is_against: bool| Self::of(grid, patches, HIDDEN, &|patch| is_one(patch).then_some(is_against));
        let (mut looks, mut others) = (from(false)?, from(true)?);
        grow(&mut looks.all, others.all.len(), WHAT)?;
        looks.all.append(&mut others.all);
        Ok(looks)
    }

    /// Of the patches for which `side` answers whether they look out against their normal: in 26 directions, past air, at the
    /// patches of the first occupied cube. At the `most` so many of them look.
    pub fn of(
        grid: &Grid,
        patches: &Patches,
        most: usize,
        side: &dyn Fn(usize) -> Option<bool>,
    ) -> Result<Self, Error> {
        let rays = Rays::through(grid);
        let step = (0..patches.all.len()).filter(|&patch| side(patch).is_some()).count().div_ceil(most);
        let (mut all, mut lookers) = (Vec::new(), 0);
        for (brick, cube, bit) in (0..grid.blocks.len()).flat_map(|block| grid.cubes_in(block)) {
            let place = BRICK * grid.bricks.places[brick] + cube_place(bit);
            for patch in patches.of_cube(cube) {
                let Some(is_against) = side(patch) else { continue };
                lookers += 1;
                if lookers % step != 0 {
                    continue;
                }
                let (looker, beside) = (&patches.all[patch], &patches.all[patches.of_cube(cube)]);
                let hidden_to_it = hidden(looker, beside);
                for number in 0..DIRECTIONS {
                    let direction = direction(number);
                    let ray = direction.as_vec3().normalize();
                    if ray.dot(signed(is_against, looker.normal)) < AHEAD || hidden_to_it >> number & 1 == 1 {
                        continue;
                    }
                    let Some(hit) = rays.first(place, direction) else { continue };
                    let others = patches.of_cube(hit);
                    grow(&mut all, others.len(), WHAT)?;
                    for other in others.clone() {
                        let seen = &patches.all[other];
                        let opposite = DIRECTIONS - 1 - number;
                        if hidden(seen, &patches.all[others.clone()]) >> opposite & 1 == 0 {
                            let along = -seen.normal.dot(ray) * seen.certainty();
                            all.push(Look { from: patch as u32, is_against, to: other as u32, along });
                        }
                    }
                }
            }
        }
        Ok(Self { all, step })
    }
}

/// What looks at a surface.
#[derive(Clone, Copy, Default)]
pub(super) struct Votes {
    /// At the side that its normals point to, less at the other.
    pub balance: f64,
    pub all: f64,
}

impl Votes {
    pub fn add(&mut self, vote: f32) {
        self.balance += f64::from(vote);
        self.all += f64::from(vote.abs());
    }

    /// How much of them are at one side, from 0 to 1.
    pub fn agreement(&self) -> f64 {
        if self.all > 0.0 { self.balance.abs() / self.all } else { 0.0 }
    }
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
            for direction in (0..DIRECTIONS).map(direction) {
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
