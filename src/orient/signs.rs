//! How much the open air counts against the edges of a surface, and the signs that come of it.

use super::air::Sights;
use super::groups::Groups;
use super::looks::Looks;
use super::patches::{Patches, signed};
use crate::error::Error;
use crate::grid::Grid;
use crate::lists::filled;
use crate::progress::Stage;

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

/// A surface that sees so much more of the open on one side than on the other is closed. Rooms from inside have 0.3; an aerial
/// scan with trees, its patches turned to what they see, 0.54.
pub(super) const CLOSED: f64 = 0.6;

/// Open surfaces of fewer patches are not worth the time that they take beyond that of closed ones, and such a share of all
/// patches.
pub(super) const LEAST_PATCHES: u64 = 32;
const SMALL: f64 = 0.01;

impl Signs {
    /// Counts all that lies in the open.
    pub fn outward(groups: Groups, stage: &Stage) -> Result<Self, Error> {
        let flipped = groups.signs(stage)?;
        Ok(Self { flipped, components: groups.components(), component: groups.component })
    }

    /// Counts all that lies in the open for components that are closed then, or small, and for others a share, beside the looks
    /// of their patches at each other, which are answered if there are any such.
    pub fn consistent(
        groups: Groups,
        grid: &Grid,
        patches: &Patches,
        sights: &Sights,
        stage: &Stage,
    ) -> Result<(Self, Option<Looks>), Error> {
        let mut flipped = groups.signs(&stage.part(0.0..0.5))?;
        let is_closed = closed(&groups, sights, &flipped)?;
        let mut looks = None;
        if is_closed.contains(&false) {
            let seen = Looks::from_the_open(grid, patches, sights)?;
            let cautious = groups.cautious_signs(&seen, sights, &stage.part(0.5..1.0))?;
            for ((flipped, cautious), &component) in flipped.iter_mut().zip(cautious).zip(&groups.component) {
                if !is_closed[component as usize] {
                    *flipped = cautious;
                }
            }
            looks = Some(seen);
        }
        Ok((Self { flipped, components: groups.components(), component: groups.component }, looks))
    }
}

/// For each component whether it is closed, or small.
fn closed(groups: &Groups, sights: &Sights, flipped: &[bool]) -> Result<Vec<bool>, Error> {
    let mut sums = filled((0.0, 0.0, 0), groups.components(), WHAT)?;
    for (i, &component) in groups.component.iter().enumerate() {
        let (exposure, all, patches) = &mut sums[component as usize];
        *exposure += f64::from(signed(flipped[i], sights.exposure[i]));
        *all += f64::from(sights.all[i]);
        *patches += 1;
    }
    let few = (SMALL * groups.component.len() as f64) as u64;
    let mut is_closed = filled(false, sums.len(), WHAT)?;
    for (is_closed, (exposure, all, patches)) in is_closed.iter_mut().zip(sums) {
        *is_closed = exposure.abs() > CLOSED * all || patches < LEAST_PATCHES && patches < few;
    }
    Ok(is_closed)
}
