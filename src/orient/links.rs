//! What neighbouring patches say about each other's sign.

use super::fours::{Four, first_four};
use super::parted::Thirds;
use super::patches::{MOST, Patch, Patches};
use super::walls::across;
use crate::bricks::set_bits;
use crate::error::Error;
use crate::grid::Grid;
use crate::lanes::{dot, power, root};
use crate::lists::{concatenated, filled, fitted, grow, reserve, starts};
use crate::parallel::Filling;
use crate::progress::Stage;
use crate::surroundings::{NEAR, Places, STEPS, Surroundings};
use glam::{Vec3, Vec4, Vec4Swizzles};
use std::ops::Range;

/// What errors call the memory of the links.
pub(super) const GRAPH: &str = "the graph of patches";

/// What speaks for two normals to agree in sign, from 1 (they do) to -1 (one must be flipped).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Link {
    pub to: u32,
    pub evidence: f32,
}

/// A link, told from one of its ends: that, and the link to the other one.
pub(super) type Pair = (u32, Link);

/// For each patch, or each group of them, its links; a link stands in both of its ends.
///
/// In many lists, because they are most of the memory: one for all would be there twice while it grows.
#[derive(Default)]
pub(super) struct Links {
    runs: Vec<Run>,
    lists: Vec<Vec<Link>>,
}

/// The links of one: a part of a list.
#[derive(Clone, Copy)]
struct Run {
    list: usize,
    start: usize,
    end: usize,
}

/// Likeness is raised to about this over the variance of the noise: noise alone makes patches of one surface a little
/// unlike; what it does not explain means two surfaces.
const SHARPNESS: f32 = 0.2;

/// How often it is squared at least and at most: noise is not all that makes patches of one surface unlike.
const LEAST_SQUARINGS: usize = 2;
const MOST_SQUARINGS: usize = 5;

/// How much the least of these powers counts beside the one that noise allows: across some edges there is nothing more. The more
/// alike two normals are, the less it counts: a smooth surface needs none of it, and between the two sides of a thin wall it would
/// be most of the evidence.
const BLUNT: f32 = 0.2;

/// With less noise, in edges, patches of one cube are of different sheets: else noise may have parted one into layers.
const CLEAN: f32 = 0.05;

/// Added to the square of how far patches lie off each other's planes, in edges: less is no difference.
const EVEN: f32 = 1e-3;

/// Less is no evidence, and costs memory.
const LEAST: f32 = 0.01;

/// Links that a list has room for, unless one group has more.
const LIST: usize = 1 << 14;

impl Links {
    /// Links every patch to those in its cube and the 26 round it; `noise` is that of the points, in edges. Apart from these what
    /// the two sides of walls and gaps say, from one of its ends. One pass over the patches.
    pub fn of(grid: &Grid, patches: &Patches, noise: f32, stage: &Stage) -> Result<(Self, Vec<Pair>), Error> {
        let (squarings, is_clean) = (squarings(noise), noise < CLEAN);
        let runs = Filling::new(patches.all.len(), GRAPH)?;
        let found = stage.collect(grid.blocks.len(), GRAPH, &|block| {
            let mut surroundings = Surroundings::new();
            let (mut near, mut fours, mut links) = (Vec::new(), Vec::new(), Vec::new());
            let (mut told, mut shares, mut walls) = (Vec::new(), Vec::new(), Vec::new());
            let mut thirds = Thirds::new(noise, GRAPH)?;
            grow(&mut near, STEPS.len() * MOST, GRAPH)?;
            grow(&mut fours, STEPS.len() * MOST / 4, GRAPH)?;
            let mut looked_at = None;
            for (brick, cube, bit) in grid.cubes_in(block) {
                if looked_at.replace(brick) != Some(brick) {
                    surroundings.look(grid, brick);
                }
                let of_place = |place: u32| patches.of_cube(surroundings.cube(Places::of_near(bit, place)));
                near.clear();
                for place in set_bits(surroundings.occupied.near(bit)) {
                    near.extend(of_place(place).map(|patch| (patch, place)));
                }
                fours.clear();
                let placed = |(patch, place): (usize, u32)| (step(place), &patches.all[patch]);
                fours.extend(near.chunks(4).map(|near| Four::of(first_four(near).map(placed))));
                let all = patches.of_cube(cube);
                // For each patch of the cube those near it, four by four.
                let pairs = all.len() * fours.len();
                told.clear();
                shares.clear();
                grow(&mut told, pairs, GRAPH)?;
                grow(&mut shares, pairs, GRAPH)?;
                told.extend(
                    all.clone()
                        .flat_map(|own| fours.iter().map(move |four| Told::of(four, &patches.all[own], squarings))),
                );
                shares.resize(pairs, [Vec4::ONE; 2]);
                if is_clean && near.iter().any(|&(patch, _)| patches.all[patch].has_rival) {
                    share(&patches.all, &near, &told, &mut shares);
                }
                // On a smooth surface none are.
                let may_be_parted = told.iter().any(|told| thirds.may_part(told.off) != 0);
                if may_be_parted {
                    thirds.gather(near.iter().copied().map(placed));
                }
                grow(&mut links, all.len() * near.len(), GRAPH)?;
                for (i, own) in all.enumerate() {
                    let start = links.len();
                    let row = i * fours.len()..(i + 1) * fours.len();
                    if may_be_parted {
                        thirds.look(&patches.all[own]);
                    }
                    for ((near, told), share) in near.chunks(4).zip(&told[row.clone()]).zip(&shares[row]) {
                        let says = told.evidence.abs().cmpgt(Vec4::splat(LEAST)).bitmask();
                        // One product, so that it is the same to the bit from both ends.
                        let evidence = (told.evidence * (share[0] * share[1])).to_array();
                        let (may_part, off) = (thirds.may_part(told.off), told.off.to_array());
                        for (lane, &(to, place)) in near.iter().enumerate() {
                            let (says, may_be_parted) = (says >> lane & 1 == 1, may_part >> lane & 1 == 1);
                            if to == own || !says && !may_be_parted {
                                continue;
                            }
                            let (other, step) = (&patches.all[to], step(place));
                            if says && !(may_be_parted && thirds.part(other, step, off[lane])) {
                                links.push(Link { to: to as u32, evidence: evidence[lane] });
                            }
                            if may_be_parted
                                && own < to
                                && let Some(evidence) = across(&patches.all[own], other, step, &thirds)
                            {
                                grow(&mut walls, 1, GRAPH)?;
                                walls.push((own as u32, Link { to: to as u32, evidence }));
                            }
                        }
                    }
                    // SAFETY: a patch belongs to one cube, and a cube to one block.
                    unsafe { runs.write(own, Run { list: block, start, end: links.len() }) };
                }
            }
            Ok((fitted(&links, GRAPH)?, walls))
        })?;
        let (lists, walls) = found.into_iter().unzip();
        // SAFETY: the blocks hold all cubes, and these all patches.
        Ok((Self { runs: unsafe { runs.complete() }, lists }, concatenated(walls, GRAPH)?))
    }

    /// Takes in more, told from one of their ends each; between two there may be several. The links of a list must be those of
    /// patches one after the other, so that no more than one list is there twice.
    pub fn add(&mut self, told: &[Pair]) -> Result<(), Error> {
        let more = Self::both_ways(self.len(), told.iter().copied())?;
        let mut first = 0;
        for (number, list) in self.lists.iter_mut().enumerate() {
            let count = self.runs[first..].iter().take_while(|run| run.list == number).count();
            let (runs, ones) = (&mut self.runs[first..first + count], first..first + count);
            first += count;
            let added: usize = ones.clone().map(|one| more.from(one).len()).sum();
            if added == 0 {
                continue;
            }
            let mut longer = Vec::new();
            reserve(&mut longer, list.len() + added, GRAPH)?;
            for (run, one) in runs.iter_mut().zip(ones) {
                let start = longer.len();
                longer.extend_from_slice(&list[run.start..run.end]);
                longer.extend_from_slice(more.from(one));
                (run.start, run.end) = (start, longer.len());
            }
            *list = longer;
        }
        Ok(())
    }

    /// Of so many patches, from links that are told from one of their ends each.
    pub fn both_ways(count: usize, told: impl Iterator<Item = Pair> + Clone) -> Result<Self, Error> {
        let mut counts = filled(0u32, count, GRAPH)?;
        for (from, link) in told.clone() {
            counts[from as usize] += 1;
            counts[link.to as usize] += 1;
        }
        let first = starts(&counts, GRAPH)?;
        let mut list = filled(Link { to: 0, evidence: 0.0 }, first[count], GRAPH)?;
        let mut put = |one: u32, link: Link| {
            counts[one as usize] -= 1;
            list[first[one as usize] + counts[one as usize] as usize] = link;
        };
        for (from, link) in told {
            put(from, link);
            put(link.to, Link { to: from, evidence: link.evidence });
        }
        let mut links = Self::with_capacity(count)?;
        links.runs.extend(first.windows(2).map(|run| Run { list: 0, start: run[0], end: run[1] }));
        links.lists.push(list);
        Ok(links)
    }

    /// Memory for those of so many patches or groups.
    pub fn with_capacity(count: usize) -> Result<Self, Error> {
        let mut links = Self::default();
        reserve(&mut links.runs, count, GRAPH)?;
        Ok(links)
    }

    /// Appends one with the links that `add` appends to a list, at most `most`.
    pub fn push(&mut self, most: usize, add: impl FnOnce(&mut Vec<Link>)) -> Result<(), Error> {
        if self.lists.last().is_none_or(|list| list.capacity() - list.len() < most) {
            let mut list = Vec::new();
            reserve(&mut list, most.max(LIST), GRAPH)?;
            self.lists.push(list);
        }
        let number = self.lists.len() - 1;
        let list = &mut self.lists[number];
        let start = list.len();
        add(list);
        self.runs.push(Run { list: number, start, end: list.len() });
        Ok(())
    }

    /// Those of some groups, those of the next, and so on.
    pub fn joined(parts: Vec<Self>) -> Result<Self, Error> {
        let mut all = Self::with_capacity(parts.iter().map(Self::len).sum())?;
        for Self { runs, lists } in parts {
            let before = all.lists.len();
            all.runs.extend(runs.into_iter().map(|run| Run { list: before + run.list, ..run }));
            all.lists.extend(lists);
        }
        Ok(all)
    }

    /// How many patches or groups there are.
    pub fn len(&self) -> usize {
        self.runs.len()
    }

    /// The links of one.
    #[inline]
    pub fn from(&self, one: usize) -> &[Link] {
        let Run { list, start, end } = self.runs[one];
        &self.lists[list][start..end]
    }
}

/// From a cube to that behind a bit of [`Places::near`], in edges.
fn step(place: u32) -> Vec3 {
    NEAR[place as usize % 64].xyz()
}

/// How often the likeness of patches is squared; `noise` is that of the points, in edges.
fn squarings(noise: f32) -> usize {
    let root_2 = std::f32::consts::SQRT_2;
    (LEAST_SQUARINGS..MOST_SQUARINGS)
        .find(|&squarings| noise * noise * root_2 * (1u32 << squarings) as f32 > SHARPNESS)
        .unwrap_or(MOST_SQUARINGS)
}

/// What four patches and another one say to each other.
struct Told {
    /// Whether they agree.
    evidence: Vec4,
    /// The squares of how far two lie off each other's planes, or off what these bend to, and a little more.
    off: Vec4,
    /// The same, or zero where it is no difference.
    apart: Vec4,
}

impl Told {
    /// What each of four says about a patch of the cube that they are near.
    ///
    /// The first normal is reflected at the plane across the line between their centres: so the normals at both ends of an arc
    /// of a circle are each other's picture, also at a right-angled crease and on the two sides of a thin plate, where the
    /// normals alone say nothing, or the opposite (after Xie, McDonnell and Qin, "Surface reconstruction of noisy and defective
    /// data sets", 2004). The less alike the picture, the more likely these are two sheets: hence the power. A line along the
    /// normals is no evidence, as noise of one surface and both sides of a wall look the same.
    #[inline(always)]
    fn of(four: &Four, patch: &Patch, squarings: usize) -> Self {
        let splat = |vector: Vec3| vector.to_array().map(Vec4::splat);
        let (centre, normal) = (splat(patch.centre), splat(patch.normal));
        // So that the other way round it is the opposite to the bit.
        let line = [0, 1, 2].map(|axis| four.step[axis] + (four.centre[axis] - centre[axis]));
        let (square, alike) = (dot(line, line), dot(normal, four.normal));
        let (along, other_along) = (dot(line, normal), dot(line, four.normal));
        let across = along * other_along / square;
        let reflected = alike - 2.0 * across;
        let fourth = power(reflected, LEAST_SQUARINGS);
        let sharp = power(fourth, squarings - LEAST_SQUARINGS);
        let certainty = Vec4::splat(patch.certainty());
        let certainty = Vec4::select(certainty.cmplt(four.certainty), certainty, four.certainty);
        let trust = patch.flatness * four.flatness * root(certainty);
        // As `Patch::likeness`.
        let likeness = power(alike, 4);
        let blunt = BLUNT * (1.0 - likeness);
        let evidence = reflected * ((sharp + blunt * fourth) / (1.0 + blunt)) * (1.0 - across.abs()) * trust;
        let rise = 0.5 * square;
        let (own, other) = (along - rise * patch.bend, other_along + rise * four.bend);
        let off = own * own + other * other + EVEN;
        Self {
            // In one place: between centres less than a fiftieth of an edge apart there is no line, only two normals that cross.
            evidence: Vec4::select(square.cmplt(Vec4::splat(4e-4)), alike * alike * alike, evidence),
            off,
            apart: Vec4::select(off.cmpgt(Vec4::splat(2.0 * EVEN)), off, Vec4::ZERO),
        }
    }
}

/// A sheet goes on in one sheet: what is left of the evidence between each patch of a cube and those near it in others, from 1
/// down to 0, where a rival of that near it lies better in line, and where one of its own does. Both `told` and `shares` have for
/// each patch of the cube a row with those near it, four by four.
#[inline(never)]
fn share(patches: &[Patch], near: &[(usize, u32)], told: &[Told], shares: &mut [[Vec4; 2]]) {
    let width = near.len().div_ceil(4);
    let rows = told.len() / width;
    let (mut own, mut next) = (0..0, 0);
    for cube in near.chunk_by(|one, other| one.1 == other.1) {
        let numbers = next..next + cube.len();
        next = numbers.end;
        if cube[0].1 == Places::NEAR_CENTRE {
            own = numbers;
            continue;
        }
        each_rival(patches, near, numbers, |one, rival, [likeness, certainty]| {
            for row in (0..rows).map(|row| row * width) {
                let (off, apart) =
                    (told[row + rival / 4].off.as_ref()[rival % 4], told[row + one / 4].apart.as_ref()[one % 4]);
                let left = off / (apart * likeness * certainty);
                let share = &mut shares[row + one / 4][0].as_mut()[one % 4];
                *share = if left < *share { left } else { *share };
            }
        });
    }
    let row = |number: usize| (number - own.start) * width;
    each_rival(patches, near, own.clone(), |one, rival, [likeness, certainty]| {
        for four in 0..width {
            let left = told[row(rival) + four].off / (told[row(one) + four].apart * likeness * certainty);
            let share = &mut shares[row(one) + four][1];
            *share = Vec4::select(left.cmplt(*share), left, *share);
        }
    });
    for (one, number) in own.clone().flat_map(|one| own.clone().map(move |other| (one, other))) {
        shares[row(one) + number / 4][1].as_mut()[number % 4] = 1.0;
    }
}

/// Calls `each` with every patch of a cube and each of its rivals, by their numbers among those near, and how alike and how certain
/// the rival is.
#[inline(always)]
fn each_rival(
    patches: &[Patch],
    near: &[(usize, u32)],
    cube: Range<usize>,
    mut each: impl FnMut(usize, usize, [f32; 2]),
) {
    for one in cube.clone() {
        let patch = &patches[near[one].0];
        if patch.has_rival {
            for other in cube.clone().filter(|&other| other != one) {
                let rival = &patches[near[other].0];
                each(one, other, [patch.likeness(rival), rival.certainty()]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch(centre: Vec3, normal: Vec3) -> Patch {
        Patch { centre, normal, points: 16, flatness: 1.0, has_rival: false, bend: 0.0 }
    }

    fn evidence(a: &Patch, b: &Patch, place: u32, squarings: usize) -> f32 {
        Told::of(&Four::of([(step(place), b); 4]), a, squarings).evidence.x
    }

    #[test]
    fn patches_on_an_arc_agree_whatever_the_noise() {
        let on_arc = |angle: f32| {
            let normal = Vec3::new(angle.sin(), 0.0, angle.cos());
            patch(normal, normal)
        };
        let (a, b) = (on_arc(0.2), on_arc(0.7));
        for noise in [0.0, 0.1, 0.3] {
            let evidence = evidence(&a, &b, Places::NEAR_CENTRE, squarings(noise));
            // Less what the line between them has of the normals.
            assert!((evidence - (1.0 - 0.25f32.sin().powi(2))).abs() < 1e-4, "{noise}: {evidence}");
        }
    }

    /// The far side of a thin wall, askew, whose normal says the opposite of the truth.
    #[test]
    fn where_there_is_no_noise_another_sheet_is_none_of_the_same_surface() {
        let (a, b) = (patch(Vec3::ZERO, Vec3::Z), patch(Vec3::new(0.0, 0.0, 0.4), Vec3::Z));
        let at = |noise: f32| evidence(&a, &b, Places::NEAR_CENTRE + 1, squarings(noise));
        assert!((0.0..1e-3).contains(&at(0.0)), "{}", at(0.0));
        assert!(at(0.3) > 0.1, "{}", at(0.3));
    }

    /// Sheets close to each other, as where balls touch: each goes on in itself.
    #[test]
    fn a_sheet_goes_on_in_one_sheet() {
        let near = |height: f32| Patch { has_rival: true, ..patch(Vec3::new(0.0, 0.0, height), Vec3::Z) };
        let patches = [near(0.0), near(0.0), near(0.1), patch(Vec3::ZERO, Vec3::X)];
        let (own, next) = (Places::NEAR_CENTRE, Places::NEAR_CENTRE + 1);
        let shares_of = |near: &[(usize, u32)]| {
            let placed = |(patch, place): (usize, u32)| (step(place), &patches[patch]);
            let fours = near.chunks(4).map(|near| Four::of(first_four(near).map(placed)));
            let told: Vec<Told> = fours.map(|four| Told::of(&four, &patches[0], 5)).collect();
            let mut shares = vec![[Vec4::ONE; 2]; told.len()];
            share(&patches, near, &told, &mut shares);
            assert!(shares.iter().all(|share| share[1] == Vec4::ONE));
            shares[0][0].to_array()
        };
        let shares = shares_of(&[(0, own), (1, next), (2, next), (3, next)]);
        assert_eq!([shares[0], shares[1], shares[3]], [1.0; 3]);
        assert!(shares[2] < 0.1, "{shares:?}");
        // Alone it goes on there too.
        assert_eq!(shares_of(&[(0, own), (2, next)]), [1.0; 4]);
    }

    #[test]
    fn a_few_points_off_their_plane_say_little() {
        let (a, b) = (patch(Vec3::ZERO, Vec3::Z), patch(Vec3::X, Vec3::Z));
        let say = |points, flatness| evidence(&a, &Patch { points, flatness, ..b }, Places::NEAR_CENTRE, 5);
        assert_eq!(say(16, 1.0), 1.0);
        assert!(say(2, 1.0) <= 0.5 && say(16, 0.4) <= 0.4);
    }

    #[test]
    fn more_links_stand_beside_those_that_were_there() {
        let link = |to, evidence| Link { to, evidence };
        let mut links = Links::both_ways(4, [(0, link(1, 0.5)), (2, link(1, 0.6))].into_iter()).unwrap();
        links.add(&[(0, link(3, -0.3)), (1, link(3, -0.2))]).unwrap();
        let from = |one| {
            let mut all = links.from(one).to_vec();
            all.sort_by_key(|link| link.to);
            all
        };
        assert_eq!(links.len(), 4);
        assert_eq!(from(0), [link(1, 0.5), link(3, -0.3)]);
        assert_eq!(from(1), [link(0, 0.5), link(2, 0.6), link(3, -0.2)]);
        assert_eq!(from(2), [link(1, 0.6)]);
        assert_eq!(from(3), [link(0, -0.3), link(1, -0.2)]);
    }

    #[test]
    fn the_less_noise_the_sharper() {
        let powers: Vec<usize> = [0.0, 0.08, 0.12, 0.16, 0.3].map(squarings).to_vec();
        assert_eq!(powers, [5, 5, 4, 3, 2]);
    }
}
