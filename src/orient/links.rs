//! What neighbouring patches say about each other's sign.

use super::patches::{Patch, Patches};
use crate::bricks::set_bits;
use crate::error::Error;
use crate::grid::Grid;
use crate::parallel::Gathering;
use crate::points::reserve;
use crate::progress::Stage;
use crate::surroundings::{NEAR, Places, Surroundings};
use glam::{Vec3, Vec4Swizzles};

/// What speaks for two normals to agree in sign, from 1 (they do) to -1 (one must be flipped).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Link {
    pub to: u32,
    pub evidence: f32,
}

/// For each patch, or each group of them, its links; a link stands in both of its ends.
#[derive(Debug, Default)]
pub(super) struct Links {
    /// The first link of each; one more at the end.
    pub first: Vec<u32>,
    pub all: Vec<Link>,
}

/// With less noise the patches of a surface lie on arcs nearly exactly; what does not is another sheet nearby.
const CLEAN: f32 = 0.05;

/// Less is no evidence, and costs memory.
const LEAST: f32 = 0.01;

impl Links {
    /// Links every patch to those in its cube and the 26 round it; `noise` is that of the points, in edges. One pass over the
    /// patches.
    pub fn of(grid: &Grid, patches: &Patches, noise: f32, stage: &Stage) -> Result<Self, Error> {
        let sharpness = if noise < CLEAN { 9 } else { 5 };
        let found = Gathering::new("the graph of patches");
        stage.run(grid.blocks.len(), &|block| {
            let mut surroundings = Surroundings::new();
            let (mut lengths, mut links) = (Vec::new(), Vec::new());
            for brick in grid.blocks[block].clone() {
                surroundings.look(grid, brick);
                for (cube, bit) in (grid.first_cube[brick] as usize..).zip(set_bits(grid.masks[brick])) {
                    for own in patches.first[cube]..patches.first[cube + 1] {
                        let (before, patch) = (links.len(), &patches.all[own as usize]);
                        for near in set_bits(surroundings.occupied.near(bit)) {
                            let cube = surroundings.cube(Places::of_near(bit, near));
                            let step = NEAR[near as usize % 64].xyz();
                            for to in patches.first[cube]..patches.first[cube + 1] {
                                let evidence = evidence(patch, &patches.all[to as usize], step, sharpness);
                                if to != own && evidence.abs() > LEAST {
                                    links.push(Link { to, evidence });
                                }
                            }
                        }
                        lengths.push((links.len() - before) as u32);
                    }
                }
            }
            found.append(vec![(block, lengths, links)]);
        })?;
        let mut found = found.all()?;
        found.sort_unstable_by_key(|&(block, ..)| block);
        let mut all = Self::default();
        reserve(&mut all.first, patches.all.len() + 1, "the graph of patches")?;
        reserve(&mut all.all, found.iter().map(|(.., links)| links.len()).sum(), "the graph of patches")?;
        all.first.push(0);
        let mut total = 0;
        for (_, lengths, mut links) in found {
            for length in lengths {
                total += length;
                all.first.push(total);
            }
            all.all.append(&mut links);
        }
        Ok(all)
    }

    /// How many patches or groups there are.
    pub fn len(&self) -> usize {
        self.first.len() - 1
    }

    /// The links of one.
    #[inline]
    pub fn from(&self, one: usize) -> &[Link] {
        &self.all[self.first[one] as usize..self.first[one + 1] as usize]
    }
}

/// Whether two patches agree: the second one's cube lies `step` cubes from the first one's.
///
/// The first normal is reflected at the plane across the line between their centres: so the normals at both ends of an arc
/// of a circle are each other's picture, also at a right-angled crease and on the two sides of a thin plate, where the
/// normals alone say nothing, or the opposite (after Xie, McDonnell and Qin, "Surface reconstruction of noisy and defective
/// data sets", 2004). The less alike the picture, the more likely these are two sheets: hence the power. A line along the
/// normals is no evidence, as noise of one surface and both sides of a wall look the same.
#[inline(always)]
fn evidence(a: &Patch, b: &Patch, step: Vec3, sharpness: i32) -> f32 {
    let line = step + b.centre - a.centre;
    let square = line.length_squared();
    let dot = a.normal.dot(b.normal);
    if square < 4e-4 {
        return dot * dot * dot;
    }
    let length = square.sqrt();
    let (x, y) = (line.dot(a.normal) / length, line.dot(b.normal) / length);
    let reflected = dot - 2.0 * (x * y);
    let (x, y) = (x.abs(), y.abs());
    reflected.powi(sharpness) * (1.0 - x * y)
}
