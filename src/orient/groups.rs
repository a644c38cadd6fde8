//! The signs that agree best with all evidence: of groups, merged from the strongest evidence to the weakest, then of what
//! they consist of.

use super::air::Sights;
use super::links::{GRAPH, Link, Links, Pair};
use super::looks::{Look, Looks};
use super::patches::{Patches, turned};
use crate::error::Error;
use crate::lists::{filled, reserve, starts};
use crate::parallel::{self, Filling};
use crate::power::exp2;
use crate::progress::Stage;
use std::iter;
use std::ops::Range;

/// Groups of patches that agree, groups of such groups, and so on, up to the components, which at most touch each other.
pub(super) struct Groups {
    levels: Vec<Level>,
    /// For each component, what speaks for its sign by itself.
    own: Vec<f32>,
    /// For each patch the number of its component.
    pub component: Vec<u32>,
}

/// The groups of one step, and to which group of the next each belongs.
struct Level {
    links: Links,
    /// For each group, what speaks for its sign by itself.
    own: Vec<f32>,
    /// For each group, how many patches it has.
    sizes: Vec<u32>,
    /// The group of the next level.
    group: Vec<u32>,
    /// Whether it is flipped in it.
    flipped: Vec<bool>,
}

impl Groups {
    /// Rounds of Boruvka's: every group merges with the one that it has the strongest evidence for or against, and the
    /// evidence between the merged ones is added up, so that many weak links outvote a strong wrong one. `sights` tell
    /// what speaks for a patch not to be flipped. A round at least halves the groups that gain by merging; few do so later,
    /// or wait until none does: linear in the links but for odd clouds, and never more than [`ROUNDS`] times as long.
    pub fn of(mut links: Links, sights: &Sights, patches: &Patches, stage: &Stage) -> Result<Self, Error> {
        let count = links.len();
        let mut levels = Vec::new();
        let (mut own, mut component) = (filled(0.0, count, GRAPH)?, filled(0u32, count, GRAPH)?);
        let mut sizes = filled(1, count, GRAPH)?;
        own.iter_mut().zip(sights.evidence(patches)).for_each(|(own, evidence)| *own = evidence);
        component.iter_mut().zip(0..).for_each(|(component, one)| *component = one);
        for round in 0..ROUNDS {
            let stage = stage.part(rest(round));
            let merging = merge(&links, &own, &sizes, &stage.part(0.0..0.5))?;
            let Some(Merging { group, flipped, groups }) = merging else { break };
            let merged = gather(&links, &group, &flipped, groups, &stage.part(0.5..1.0))?;
            let mut sums = filled(0.0, groups, GRAPH)?;
            for (one, &group) in group.iter().enumerate() {
                sums[group as usize] += turned(flipped[one], own[one]);
            }
            let mut counts = filled(0, groups, GRAPH)?;
            group.iter().zip(&sizes).for_each(|(&group, &size)| counts[group as usize] += size);
            component.iter_mut().for_each(|component| *component = group[*component as usize]);
            levels.push(Level {
                links: std::mem::replace(&mut links, merged),
                own: std::mem::replace(&mut own, sums),
                sizes: std::mem::replace(&mut sizes, counts),
                group,
                flipped,
            });
        }
        Ok(Self { levels, own, component })
    }

    /// Those with more links, told from one of their ends each.
    pub fn with(self, told: Vec<Pair>, sights: &Sights, patches: &Patches, stage: &Stage) -> Result<Self, Error> {
        let count = self.component.len();
        let links = match self.into_links() {
            Some(mut links) => {
                links.add(&told)?;
                links
            }
            None => Links::both_ways(count, told.iter().copied())?,
        };
        drop(told);
        Self::of(links, sights, patches, stage)
    }

    /// The links between patches, if there are any.
    pub fn into_links(self) -> Option<Links> {
        self.levels.into_iter().next().map(|level| level.links)
    }

    /// How many components there are.
    pub fn components(&self) -> usize {
        self.own.len()
    }

    /// Whether to flip each patch, so that the sum of all evidence becomes large. Linear in the links.
    pub fn signs(&self, stage: &Stage) -> Result<Vec<bool>, Error> {
        let mut flipped = self.descend(Trust::Times(1.0), &[], &stage.part(0.0..0.4))?;
        let Some(Level { links, own, .. }) = self.levels.first() else { return Ok(flipped) };
        // Flipping one small group after the other does not reach a far better choice behind worse ones, as where both
        // sides of a thin noisy wall were taken for one.
        let bold = self.descend(Trust::Times(BOLDNESS), &[], &stage.part(0.4..0.8))?;
        // Both were mended last of all.
        if bold == flipped {
            return Ok(flipped);
        }
        self.take_better(&mut flipped, &bold, &|flipped, one| score(links, own, flipped, one))?;
        mend(links, None, &|one| own[one], &mut flipped, &stage.part(0.8..1.0))?;
        Ok(flipped)
    }

    /// Signs by what patches say about each other alone.
    pub fn signs_by_links(&self, stage: &Stage) -> Result<Vec<bool>, Error> {
        self.descend(Trust::Times(0.0), &[], stage)
    }

    /// Signs for components whose evidence from the air may mislead. It adds up with a group's area, that of links only with
    /// its rim; so here it is divided by the root of the group's size. Looks between its patches are added, if any.
    pub fn cautious_signs(&self, looks: Option<&Looks>, sights: &Sights, stage: &Stage) -> Result<Vec<bool>, Error> {
        let mut levels = Vec::new();
        if let Some(looks) = looks {
            // But for those at the back of what itself sees the open from its front, as roofs do whose walls are missing.
            let tells = |look: &Look| !sights.is_back(look.to as usize, look.along < 0.0);
            levels = self.across(looks, &tells, &stage.part(0.0..0.5))?;
        }
        self.descend(Trust::ByRim, &levels, &stage.part(0.5..1.0))
    }

    /// Takes signs with these looks, too, of the components that so have a better sum of all evidence. Only groups of some size are
    /// flipped for looks, because some go astray, and of larger ones where one look stands for those of several patches.
    pub fn mend_with(&self, looks: &Looks, flipped: &mut [bool], stage: &Stage) -> Result<(), Error> {
        let Some(Level { links, own, .. }) = self.levels.first() else { return Ok(()) };
        let mut levels = self.across(looks, &|_| true, &stage.part(0.0..0.5))?;
        let small = SMALL_GROUPS + looks.step.next_power_of_two().ilog2() as usize / 2;
        let first = levels.drain(..small.min(levels.len())).next();
        let Some(told) = first else { return Ok(()) };
        let other = self.descend(Trust::Times(1.0), &levels, &stage.part(0.5..1.0))?;
        // The share of a patch in all evidence, half of that of each look.
        let share = |flipped: &[bool], one: usize| {
            score(links, own, flipped, one) + f64::from(support(&told, flipped, one)) / 2.0
        };
        self.take_better(flipped, &other, &share)
    }

    /// Takes other signs for the components that so have a better sum of evidence, of which `share` tells that of one patch.
    fn take_better(
        &self,
        flipped: &mut [bool],
        other: &[bool],
        share: &dyn Fn(&[bool], usize) -> f64,
    ) -> Result<(), Error> {
        let mut gains = filled(0.0, self.components(), GRAPH)?;
        for (one, &component) in self.component.iter().enumerate() {
            gains[component as usize] += share(other, one) - share(flipped, one);
        }
        for ((flipped, &other), &component) in flipped.iter_mut().zip(other).zip(&self.component) {
            if gains[component as usize] > 0.0 {
                *flipped = other;
            }
        }
        Ok(())
    }

    /// What the looks of the patches of each component at each other say: for each level links between its groups.
    fn across(&self, looks: &Looks, tells: &dyn Fn(&Look) -> bool, stage: &Stage) -> Result<Vec<Links>, Error> {
        let weight = LOOK * looks.step as f32;
        let is_own = |look: &Look| self.component[look.from as usize] == self.component[look.to as usize];
        let link = |look: &Look| (look.from, Link { to: look.to, evidence: weight * look.evidence() });
        let told = looks.all.iter().filter(|look| is_own(look) && tells(look)).map(link);
        let mut links = Links::both_ways(self.component.len(), told)?;
        let mut levels = Vec::new();
        reserve(&mut levels, self.levels.len(), GRAPH)?;
        for (number, Level { group, flipped, .. }) in self.levels.iter().enumerate() {
            let groups = group.iter().max().map_or(0, |&last| last as usize + 1);
            let merged = gather(&links, group, flipped, groups, &stage.part(rest(number)))?;
            levels.push(std::mem::replace(&mut links, merged));
        }
        Ok(levels)
    }

    /// From the components to the patches: whatever gains by being flipped is. `across`: links by looks for the last of the levels,
    /// those of the largest groups.
    fn descend(&self, trust: Trust, across: &[Links], stage: &Stage) -> Result<Vec<bool>, Error> {
        let mut flipped = filled(false, self.own.len(), GRAPH)?;
        flipped.iter_mut().zip(&self.own).for_each(|(flipped, own)| *flipped = *own < 0.0);
        let first = self.levels.len() - across.len();
        for (number, Level { links, own, sizes, group, flipped: within }) in self.levels.iter().enumerate().rev() {
            let mut finer = filled(false, group.len(), GRAPH)?;
            for ((finer, &group), within) in finer.iter_mut().zip(group).zip(within) {
                *finer = within ^ flipped[group as usize];
            }
            flipped = finer;
            let share = |one: usize| match trust {
                Trust::Times(weight) => weight * own[one],
                Trust::ByRim => own[one] / (sizes[one] as f32).sqrt(),
            };
            let Range { start, end } = rest(number);
            let across = number.checked_sub(first).map(|number| &across[number]);
            mend(links, across, &share, &mut flipped, &stage.part(1.0 - end..1.0 - start))?;
        }
        Ok(flipped)
    }
}

/// What speaks for the sign of a group by itself, against links.
#[derive(Clone, Copy)]
enum Trust {
    /// So many times as much as there is.
    Times(f32),
    /// As if only along its rim.
    ByRim,
}

/// Of a stage that goes through the levels from the first on, the part of one: each has about twice as many groups as the next.
fn rest(number: usize) -> Range<f64> {
    1.0 - exp2(-(number as f64))..1.0 - exp2(-(number as f64 + 1.0))
}

/// Two groups only touch, and stay two surfaces, if the evidence between them is at most this times (root of n, less 1), n
/// the patches of the smaller: about its side in patches. A single patch always joins.
const TOUCH: f32 = 0.1;

/// How often groups merge at the most; five to twelve times is what scans need.
const ROUNDS: usize = 40;

/// How much more than by rights the second choice trusts what speaks for a sign by itself.
const BOLDNESS: f32 = 3.0;

/// What a look that hits head-on counts against links that count up to 1.
const LOOK: f32 = 0.2;

/// The first levels, of which groups may have fewer patches than some eight.
const SMALL_GROUPS: usize = 3;

/// What the evidence says to the sign of one, given those of the others.
fn support(links: &Links, flipped: &[bool], one: usize) -> f32 {
    let sum: f32 = links.from(one).iter().map(|link| turned(flipped[link.to as usize], link.evidence)).sum();
    turned(flipped[one], sum)
}

/// The share of one in the sum of all evidence: half of each of its links.
fn score(links: &Links, own: &[f32], flipped: &[bool], one: usize) -> f64 {
    f64::from(support(links, flipped, one)) / 2.0 + f64::from(turned(flipped[one], own[one]))
}

/// Which groups become one.
struct Merging {
    /// For each its new group.
    group: Vec<u32>,
    /// Whether it is flipped against the first of that.
    flipped: Vec<bool>,
    /// How many new ones there are.
    groups: usize,
}

/// Merges each with the one that it has the [`strongest`] evidence for or against. `None` when no two are linked any more.
#[inline(never)]
fn merge(links: &Links, own: &[f32], sizes: &[u32], stage: &Stage) -> Result<Option<Merging>, Error> {
    let count = links.len();
    // Towards the root of the group, and whether flipped against it.
    let mut parents = filled((0u32, false), count, GRAPH)?;
    parents.iter_mut().zip(0..).for_each(|(parent, one)| parent.0 = one);
    let mut is_merged = false;
    for (at_any_price, part) in [(false, 0.0..0.5), (true, 0.5..1.0)] {
        let best = each(count, &stage.part(part), |one| strongest(links, own, sizes, one, at_any_price))?;
        for (one, best) in best.into_iter().enumerate() {
            let Some(best) = best else { continue };
            let ((a, a_flipped), (b, b_flipped)) = (root(&mut parents, one as u32), root(&mut parents, best.to));
            if a != b {
                parents[a.max(b) as usize] = (a.min(b), a_flipped ^ b_flipped ^ (best.evidence < 0.0));
                is_merged = true;
            }
        }
        if is_merged {
            break;
        }
    }
    if !is_merged {
        return Ok(None);
    }
    let (mut group, mut flipped) = (filled(0, count, GRAPH)?, filled(false, count, GRAPH)?);
    let mut groups = 0;
    for one in 0..count {
        let (root, is_flipped) = root(&mut parents, one as u32);
        // The root is the lowest of its group.
        group[one] = if root as usize == one { groups } else { group[root as usize] };
        groups += u32::from(root as usize == one);
        flipped[one] = is_flipped;
    }
    Ok(Some(Merging { group, flipped, groups: groups as usize }))
}

/// The link of one with the strongest evidence, less what speaks for the signs of the two by themselves and would be lost, as
/// where bodies touch: what gains nothing is left until `at_any_price`, so that these are whole before they merge.
fn strongest(links: &Links, own: &[f32], sizes: &[u32], one: usize, at_any_price: bool) -> Option<Link> {
    let (mut best, mut most) = (None, if at_any_price { f32::NEG_INFINITY } else { 0.0 });
    for &link in links.from(one) {
        let (to, evidence) = (link.to as usize, link.evidence.abs());
        let is_contrary = own[one] * own[to] * link.evidence < 0.0;
        let loss = if is_contrary { 2.0 * own[one].abs().min(own[to].abs()) } else { 0.0 };
        let is_first = |best: Link| evidence - loss == most && link.to < best.to;
        if (evidence - loss > most || best.is_some_and(is_first))
            && evidence > TOUCH * ((sizes[one].min(sizes[to]) as f32).sqrt() - 1.0)
        {
            (best, most) = (Some(link), evidence - loss);
        }
    }
    best
}

/// The root of one, and whether it is flipped against that; halves the way there.
fn root(parents: &mut [(u32, bool)], mut one: u32) -> (u32, bool) {
    let mut flipped = false;
    loop {
        let (parent, own) = parents[one as usize];
        if parent == one {
            return (one, flipped);
        }
        let (next, more) = parents[parent as usize];
        if next != parent {
            parents[one as usize] = (next, own ^ more);
        }
        flipped ^= own;
        one = parent;
    }
}

/// What `of_one` says of each, in parallel.
fn each<T: Copy + Send>(count: usize, stage: &Stage, of_one: impl Fn(usize) -> T + Sync) -> Result<Vec<T>, Error> {
    const PIECE: usize = 1 << 10;
    let all = Filling::new(count, GRAPH)?;
    stage.run(count.div_ceil(PIECE), &|i| {
        for one in parallel::piece(count, PIECE, i) {
            // SAFETY: each belongs to one piece.
            unsafe { all.write(one, of_one(one)) };
        }
    })?;
    // SAFETY: the pieces hold all.
    Ok(unsafe { all.complete() })
}

/// The links between groups.
#[inline(never)]
fn gather(links: &Links, group: &[u32], flipped: &[bool], groups: usize, stage: &Stage) -> Result<Links, Error> {
    let mut counts = filled(0u32, groups, GRAPH)?;
    group.iter().for_each(|&group| counts[group as usize] += 1);
    // The members of each group, one after the other.
    let first = starts(&counts, GRAPH)?;
    let mut members = filled(0u32, group.len(), GRAPH)?;
    for (one, &group) in group.iter().enumerate().rev() {
        counts[group as usize] -= 1;
        members[first[group as usize] + counts[group as usize] as usize] = one as u32;
    }
    // A piece for each thread: those of a group are the same wherever it begins.
    let size = groups.div_ceil(parallel::threads()).max(1);
    let parts = stage.collect(groups.div_ceil(size), GRAPH, &|i| {
        let piece = parallel::piece(groups, size, i);
        let mut merged = Links::with_capacity(piece.len())?;
        // Where the link to a group stands among those of one.
        let mut places = filled(usize::MAX, groups, GRAPH)?;
        for one in piece {
            let own = &members[first[one]..first[one + 1]];
            let from = |member: u32| links.from(member as usize);
            merged.push(own.iter().map(|&member| from(member).len()).sum(), |list| {
                let start = list.len();
                for &member in own {
                    for link in from(member) {
                        let to = group[link.to as usize];
                        if to as usize == one {
                            continue;
                        }
                        let evidence = turned(flipped[member as usize] ^ flipped[link.to as usize], link.evidence);
                        let place = &mut places[to as usize];
                        if !(start..list.len()).contains(place) || list[*place].to != to {
                            *place = list.len();
                            list.push(Link { to, evidence: 0.0 });
                        }
                        list[*place].evidence += evidence;
                    }
                }
            })?;
        }
        Ok(merged)
    })?;
    Links::joined(parts)
}

/// Flips what gains by it by the links, also those `across` the air, round by round; each flip raises the sum of all evidence.
#[inline(never)]
fn mend(
    links: &Links,
    across: Option<&Links>,
    own: &(dyn Fn(usize) -> f32 + Sync),
    flipped: &mut [bool],
    stage: &Stage,
) -> Result<(), Error> {
    /// More flip next to nothing.
    const MENDING_ROUNDS: usize = 16;
    /// Less is rounding.
    const LEAST: f32 = 1e-6;
    let levels = || iter::once(links).chain(across);
    let gains = |flipped: &[bool], one: usize| {
        let evidence: f32 = levels().map(|links| support(links, flipped, one)).sum();
        evidence + turned(flipped[one], own(one)) < -LEAST
    };
    // Who is to be asked: who gains as it is, and then whose neighbours changed since.
    let mut is_stirred = each(flipped.len(), stage, |one| gains(flipped, one))?;
    for _ in 0..MENDING_ROUNDS {
        let mut any = false;
        for one in 0..flipped.len() {
            if !std::mem::take(&mut is_stirred[one]) {
                continue;
            }
            if gains(flipped, one) {
                flipped[one] = !flipped[one];
                any = true;
                levels().flat_map(|links| links.from(one)).for_each(|link| is_stirred[link.to as usize] = true);
            }
        }
        if !any {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orient::patches::Patch;
    use crate::progress::Progress;
    use glam::Vec3;

    /// Two patches that nothing else links.
    #[test]
    fn walls_alone_link_two() {
        let patch =
            Patch { centre: Vec3::ZERO, normal: Vec3::Z, points: 16, flatness: 1.0, has_rival: false, bend: 0.0 };
        let patches = Patches { all: vec![patch; 2], first: vec![0, 1, 2] };
        let sights = Sights { exposure: vec![0.5, 0.0], all: vec![0.5, 0.0] };
        let progress = Progress::silent();
        let stage = progress.stage("the test", 0.0..1.0);
        let groups = Groups::of(Links::both_ways(2, iter::empty()).unwrap(), &sights, &patches, &stage).unwrap();
        assert_eq!(groups.components(), 2);
        let groups = groups.with(vec![(0, Link { to: 1, evidence: -0.3 })], &sights, &patches, &stage).unwrap();
        assert_eq!(groups.components(), 1);
        assert_eq!(groups.signs(&stage).unwrap(), [false, true]);
    }
}
