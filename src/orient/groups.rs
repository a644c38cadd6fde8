//! One sign for each patch: groups of them that agree, merged from the strongest evidence to the weakest, then mended.

use super::links::{Link, Links};
use crate::error::Error;
use crate::points::{filled, reserve};
use crate::progress::Stage;

/// What errors call the memory of all this.
const WHAT: &str = "the graph of patches";

/// The signs of all patches, and which of them hang together.
pub(super) struct Signs {
    /// For each patch whether its normal must be flipped.
    pub flipped: Vec<bool>,
    /// For each patch the number of its component.
    pub component: Vec<u32>,
    pub components: usize,
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

/// Chooses the signs that make the sum of all evidence large: of the links between two patches, and `own`, what speaks
/// for a patch not to be flipped.
///
/// Rounds of Boruvka's: every group merges with the one that it has the strongest evidence for or against, and the evidence
/// between the merged ones is added up, so that many weak links outvote a strong wrong one. A round at least halves the
/// groups that have links: linear in the links. Then back from the last to the first: whatever gains by being flipped is.
///
/// What speaks for the patches of a group adds up like its area, the evidence of its neighbours only like its rim. Beyond
/// `span` patches the former is made to grow like the rim too.
pub(super) fn signs(links: Links, own: Vec<f32>, span: f32, stage: &Stage) -> Result<Signs, Error> {
    let patches = links.len();
    let mut levels = Vec::new();
    let (mut links, mut own, mut sizes) = (links, own, filled(1, patches, WHAT)?);
    let mut component = filled(0u32, patches, WHAT)?;
    component.iter_mut().zip(0..).for_each(|(component, one)| *component = one);
    let mut count = patches;
    stage.tell(0.0)?;
    while let Some(Merging { group, flipped, groups }) = merge(&links, &sizes)? {
        let (merged, sums) = gather(&links, &own, &group, &flipped, groups)?;
        let mut counts = filled(0, groups, WHAT)?;
        group.iter().zip(&sizes).for_each(|(&group, &size)| counts[group as usize] += size);
        component.iter_mut().for_each(|component| *component = group[*component as usize]);
        levels.push(Level {
            links: std::mem::replace(&mut links, merged),
            own: std::mem::replace(&mut own, sums),
            sizes: std::mem::replace(&mut sizes, counts),
            group,
            flipped,
        });
        count = groups;
        stage.tell(0.7 * (1.0 - count as f64 / patches as f64))?;
    }
    // From the last level to the first; `trust` is the weight of what speaks for a sign by itself.
    let descend = |trust: f32| -> Result<Vec<bool>, Error> {
        let mut flipped = filled(false, own.len(), WHAT)?;
        flipped.iter_mut().zip(&own).for_each(|(flipped, own)| *flipped = *own < 0.0);
        for Level { links, own, sizes, group, flipped: within } in levels.iter().rev() {
            let mut finer = filled(false, group.len(), WHAT)?;
            for ((finer, &group), within) in finer.iter_mut().zip(group).zip(within) {
                *finer = within ^ flipped[group as usize];
            }
            flipped = finer;
            let share = |one: usize| trust * own[one] * (span / sizes[one] as f32).sqrt().min(1.0);
            mend(links, &share, &mut flipped)?;
        }
        Ok(flipped)
    };
    let mut flipped = descend(1.0)?;
    if let Some(Level { links, own, .. }) = levels.first() {
        // Flipping one small group after the other does not reach a far better choice behind worse ones, as where both
        // sides of a thin noisy wall were taken for one.
        stage.tell(0.8)?;
        let bold = descend(BOLDNESS)?;
        let mut gains = filled(0.0, count, WHAT)?;
        for (one, &component) in component.iter().enumerate() {
            gains[component as usize] += score(links, own, &bold, one) - score(links, own, &flipped, one);
        }
        for ((flipped, bold), &component) in flipped.iter_mut().zip(bold).zip(&component) {
            if gains[component as usize] > 0.0 {
                *flipped = bold;
            }
        }
        mend(links, &|one| own[one], &mut flipped)?;
    }
    stage.tell(1.0)?;
    Ok(Signs { flipped, component, components: count })
}

/// Groups that agree no better than this, for each patch along the side of a square of as many as the smaller has, only touch:
/// they are surfaces of their own.
const TOUCH: f32 = 0.1;

/// How much more than by rights the second choice trusts what speaks for a sign by itself.
const BOLDNESS: f32 = 3.0;

fn signed(is_flipped: bool, evidence: f32) -> f32 {
    if is_flipped { -evidence } else { evidence }
}

/// What the evidence says to the sign of one, given those of the others.
fn support(links: &Links, flipped: &[bool], one: usize) -> f32 {
    let sum: f32 = links.from(one).iter().map(|link| signed(flipped[link.to as usize], link.evidence)).sum();
    signed(flipped[one], sum)
}

/// The share of one in the sum of all evidence: half of each of its links.
fn score(links: &Links, own: &[f32], flipped: &[bool], one: usize) -> f64 {
    f64::from(support(links, flipped, one)) / 2.0 + f64::from(signed(flipped[one], own[one]))
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

/// Merges each with the one that it has the strongest evidence for or against. `None` when no two are linked any more.
#[inline(never)]
fn merge(links: &Links, sizes: &[u32]) -> Result<Option<Merging>, Error> {
    let count = links.len();
    // Towards the root of the group, and whether flipped against it.
    let mut parents = filled((0u32, false), count, WHAT)?;
    parents.iter_mut().zip(0..).for_each(|(parent, one)| parent.0 = one);
    let mut is_merged = false;
    for one in 0..count {
        let mut best = Link { to: 0, evidence: 0.0 };
        for &link in links.from(one) {
            let (more, most) = (link.evidence.abs(), best.evidence.abs());
            if more > most || (more == most && link.to < best.to) {
                best = link;
            }
        }
        let size = sizes[one].min(sizes[best.to as usize]);
        if best.evidence.abs() <= TOUCH * (size as f32).sqrt() {
            continue;
        }
        let ((a, a_flipped), (b, b_flipped)) = (root(&mut parents, one as u32), root(&mut parents, best.to));
        if a != b {
            parents[a.max(b) as usize] = (a.min(b), a_flipped ^ b_flipped ^ (best.evidence < 0.0));
            is_merged = true;
        }
    }
    if !is_merged {
        return Ok(None);
    }
    let (mut group, mut flipped) = (filled(0, count, WHAT)?, filled(false, count, WHAT)?);
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

/// The links between groups, and what speaks for the sign of each by itself.
#[inline(never)]
fn gather(
    links: &Links,
    own: &[f32],
    group: &[u32],
    flipped: &[bool],
    groups: usize,
) -> Result<(Links, Vec<f32>), Error> {
    let mut sums = filled(0.0, groups, WHAT)?;
    // The members of each group, one after the other.
    let mut ends = filled(0u32, groups + 1, WHAT)?;
    for (one, &group) in group.iter().enumerate() {
        sums[group as usize] += if flipped[one] { -own[one] } else { own[one] };
        ends[group as usize + 1] += 1;
    }
    for i in 0..groups {
        ends[i + 1] += ends[i];
    }
    let mut next = ends.clone();
    let mut members = filled(0u32, group.len(), WHAT)?;
    for (one, &group) in group.iter().enumerate() {
        members[next[group as usize] as usize] = one as u32;
        next[group as usize] += 1;
    }
    let mut merged = Links::default();
    // No more than there were, and seldom much fewer than half.
    reserve(&mut merged.all, links.all.len() / 2, WHAT)?;
    reserve(&mut merged.first, groups + 1, WHAT)?;
    merged.first.push(0);
    // Where the link to a group stands; none before the own start.
    let mut places = filled(u32::MAX, groups, WHAT)?;
    for one in 0..groups {
        let start = merged.all.len();
        for &member in &members[ends[one] as usize..ends[one + 1] as usize] {
            for link in links.from(member as usize) {
                let to = group[link.to as usize];
                if to as usize == one {
                    continue;
                }
                let is_flipped = flipped[member as usize] ^ flipped[link.to as usize];
                let evidence = if is_flipped { -link.evidence } else { link.evidence };
                let place = places[to as usize] as usize;
                if place >= start && place < merged.all.len() && merged.all[place].to == to {
                    merged.all[place].evidence += evidence;
                } else {
                    places[to as usize] = merged.all.len() as u32;
                    merged.all.push(Link { to, evidence });
                }
            }
        }
        merged.first.push(merged.all.len() as u32);
    }
    Ok((merged, sums))
}

/// Flips what gains by it, until nothing does; each flip raises the sum of all evidence.
#[inline(never)]
fn mend(links: &Links, own: &dyn Fn(usize) -> f32, flipped: &mut [bool]) -> Result<(), Error> {
    const ROUNDS: usize = 16;
    /// Less is rounding.
    const LEAST: f32 = 1e-6;
    // Whose neighbours changed since it was asked.
    let mut is_stirred = filled(true, flipped.len(), WHAT)?;
    for _ in 0..ROUNDS {
        let mut any = false;
        for one in 0..flipped.len() {
            if !std::mem::take(&mut is_stirred[one]) {
                continue;
            }
            if support(links, flipped, one) + signed(flipped[one], own(one)) < -LEAST {
                flipped[one] = !flipped[one];
                any = true;
                links.from(one).iter().for_each(|link| is_stirred[link.to as usize] = true);
            }
        }
        if !any {
            break;
        }
    }
    Ok(())
}
