//! How much the open air counts against the edges of a surface, and the signs that come of it.

use super::air::Sights;
use super::ball::STRAYS;
use super::groups::Groups;
use super::links::{Links, Pair};
use super::looks::Looks;
use super::patches::{Patches, signed};
use crate::error::Error;
use crate::grid::Grid;
use crate::lists::{filled, fitted};
use crate::progress::Stage;
use glam::Vec3;

/// What errors call the memory of all this.
const WHAT: &str = "the signs";

/// A sign for each patch.
pub(super) struct Signs {
    /// For each patch whether its normal must be flipped.
    pub flipped: Vec<bool>,
    /// For each patch the number of its component.
    pub component: Vec<u32>,
    pub components: usize,
}

impl Signs {
    /// The normal of a patch, to the side that it faces.
    pub fn facing(&self, patches: &Patches, patch: usize) -> Vec3 {
        signed(self.flipped[patch], patches.all[patch].normal)
    }
}

/// A surface that sees so much more of the open on one side than on the other is closed. Rooms from inside have 0.3; an aerial
/// scan with trees, its patches turned to what they see, 0.54.
pub(super) const CLOSED: f64 = 0.6;

/// What bounds a body sees so much more of the open on one side, also while some signs are wrong; of trees and shrubs even some
/// pieces are closed.
const WALLED: f64 = 0.8;

/// With less of the open for each patch a surface hardly sees it: the sides of fins as far apart as thick have 0.02.
const BLIND: f64 = 0.1;

/// In so much noise, in edges, what looks through a surface and what stands before it are not told apart.
const NOISY: f32 = 0.12;

/// Open surfaces of fewer patches are not worth the time that they take beyond that of closed ones, and such a share of all
/// patches.
pub(super) const LEAST_PATCHES: u64 = 32;
const SMALL: f64 = 0.01;

/// How much of the open is counted.
pub(super) struct Choice {
    groups: Groups,
    signs: Signs,
    /// For each component whether it is closed, or small.
    is_closed: Vec<bool>,
    /// Whether all are that but what may stray.
    is_all_closed: bool,
}

impl Choice {
    /// Counts all that lies in the open, and what the two sides of `walls` say where that is not open: of a closed body one leads
    /// in and the other one out, but of leaves and the ground both may be seen from above. If noise, in edges, allows it, parts of
    /// closed surfaces that hardly see the open are also told by what they see of the others.
    pub fn of(
        (mut groups, mut walls): (Groups, Vec<Pair>),
        (grid, noise): (&Grid, f32),
        patches: &Patches,
        sights: &Sights,
        stage: &Stage,
    ) -> Result<Self, Error> {
        let mut flipped = groups.signs(&stage.part(0.0..0.3))?;
        if !walls.is_empty() {
            let openness = openness(&groups, sights, &flipped)?;
            let whole = openness.iter().fold(Openness::default(), Openness::with);
            let is_walled = |patch: u32| openness[groups.component[patch as usize] as usize].is_walled(&whole);
            walls.retain(|&(from, link)| is_walled(from) && is_walled(link.to));
        }
        if !walls.is_empty() {
            drop(flipped);
            groups = groups.with(walls, sights, patches, &stage.part(0.3..0.6))?;
            flipped = groups.signs(&stage.part(0.6..0.8))?;
        }
        let is_closed = closed(&groups, sights, &flipped)?;
        let is_hidden = |patch: usize| is_closed[groups.component[patch] as usize] && sights.all[patch] < BLIND as f32;
        if noise < NOISY && (0..patches.all.len()).filter(|&patch| is_hidden(patch)).count() as u64 >= LEAST_PATCHES {
            let looks = Looks::from_both_sides(grid, patches, &is_hidden)?;
            groups.mend_with(&looks, &mut flipped, &stage.part(0.8..1.0))?;
        }
        let (mut open, mut all) = (0.0, 0.0);
        for (patch, &component) in patches.all.iter().zip(&groups.component) {
            let points = f64::from(patch.points);
            all += points;
            open += if is_closed[component as usize] { 0.0 } else { points };
        }
        let signs = Signs { flipped, components: groups.components(), component: fitted(&groups.component, WHAT)? };
        Ok(Self { groups, signs, is_closed, is_all_closed: open <= STRAYS * all })
    }

    pub fn is_all_closed(&self) -> bool {
        self.is_all_closed
    }

    /// Whether there is anything that is not closed, nor small.
    pub fn is_any_open(&self) -> bool {
        self.is_closed.contains(&false)
    }

    /// Counts a share, for components that are not closed, nor small, beside the looks of their patches at each other, if any.
    /// Answers the signs that there were.
    pub fn be_cautious(&mut self, looks: Option<&Looks>, sights: &Sights, stage: &Stage) -> Result<Vec<bool>, Error> {
        let cautious = self.groups.cautious_signs(looks, sights, stage)?;
        Ok(self.exchange(cautious))
    }

    /// Counts nothing of it, for these.
    pub fn trust_links(&mut self, stage: &Stage) -> Result<(), Error> {
        let by_links = self.groups.signs_by_links(stage)?;
        self.exchange(by_links);
        Ok(())
    }

    /// Takes other signs for components that are not closed, nor small. Answers those that there were.
    pub fn exchange(&mut self, mut other: Vec<bool>) -> Vec<bool> {
        let Signs { flipped, component, .. } = &mut self.signs;
        for ((flipped, other), &component) in flipped.iter_mut().zip(&mut other).zip(&*component) {
            if !self.is_closed[component as usize] {
                std::mem::swap(flipped, other);
            }
        }
        other
    }

    pub fn signs(&self) -> &Signs {
        &self.signs
    }

    /// The signs, and the links between patches, if there are any.
    pub fn into_signs(self) -> (Signs, Option<Links>) {
        (self.signs, self.groups.into_links())
    }
}

/// What a component sees of the open.
#[derive(Clone, Copy, Default)]
struct Openness {
    /// More with its front than with its back.
    exposure: f64,
    all: f64,
    patches: u64,
}

impl Openness {
    /// With another one, that faces where it sees more.
    fn with(self, other: &Self) -> Self {
        Self {
            exposure: self.exposure + other.exposure.abs(),
            all: self.all + other.all,
            patches: self.patches + other.patches,
        }
    }

    /// Whether it bounds a body: it sees the open from one side, or as the sides of narrow gaps do hardly sees it, where the
    /// `whole` cloud sees it from one side.
    fn is_walled(&self, whole: &Self) -> bool {
        let is_of_body = |one: &Self| one.exposure.abs() > WALLED * one.all;
        is_of_body(self) || is_of_body(whole) && self.all < BLIND * self.patches as f64
    }
}

/// What each component sees of the open.
fn openness(groups: &Groups, sights: &Sights, flipped: &[bool]) -> Result<Vec<Openness>, Error> {
    let mut all = filled(Openness::default(), groups.components(), WHAT)?;
    for (i, &component) in groups.component.iter().enumerate() {
        let one = &mut all[component as usize];
        one.exposure += f64::from(signed(flipped[i], sights.exposure[i]));
        one.all += f64::from(sights.all[i]);
        one.patches += 1;
    }
    Ok(all)
}

/// For each component whether it is closed, or small.
fn closed(groups: &Groups, sights: &Sights, flipped: &[bool]) -> Result<Vec<bool>, Error> {
    let few = (SMALL * groups.component.len() as f64) as u64;
    let openness = openness(groups, sights, flipped)?;
    let mut is_closed = filled(false, openness.len(), WHAT)?;
    for (is_closed, Openness { exposure, all, patches }) in is_closed.iter_mut().zip(openness) {
        *is_closed = exposure.abs() > CLOSED * all || patches < LEAST_PATCHES && patches < few;
    }
    Ok(is_closed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_bounds_a_body_has_walls() {
        let openness = |exposure, all| Openness { exposure, all, patches: 100 };
        let (body, ground) = (openness(90.0, 100.0), openness(20.0, 100.0));
        assert!(body.is_walled(&ground) && !ground.is_walled(&ground) && !ground.is_walled(&body));
        // It hardly sees the open, among what sees it from one side, and among what sees it from both.
        let gap = openness(1.0, 5.0);
        assert!(gap.is_walled(&body) && !gap.is_walled(&ground));
        assert_eq!(openness(-3.0, 4.0).with(&openness(-1.0, 2.0)).exposure, -2.0);
    }
}
