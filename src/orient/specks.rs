//! Components of a few points, which are no surfaces: slivers seen past an edge, points on a sharp one.

use super::components::Decision;
use super::patches::Patches;
use super::signs::Signs;
use crate::error::Error;
use crate::grid::Grid;
use crate::lattice::BRICK;
use crate::lists::{filled, grow, reserve};
use crate::progress::Stage;
use glam::{DVec3, IVec3, Vec3};
use std::cmp::Reverse;
use std::mem::replace;

/// What errors call the memory of all this.
const WHAT: &str = "the specks";

/// Components of fewer points are specks.
const LEAST_POINTS: u64 = 16;

/// How far what is round a patch is from it, in edges.
const REACH: f32 = 5.0;

/// Added to the square of that distance: nearer is no nearer.
const SOFT: f32 = 0.01;

/// What is said of a patch by what is round it.
struct Told {
    patch: usize,
    is_flipped: bool,
    /// The nearest component that is no speck.
    component: u32,
}

/// Turns each patch of a speck to the side that what is round it faces, and makes it a part of the nearest component that is no
/// speck. One with nothing round it stays as it is. Components are numbered by size, before and after.
///
/// One pass over the patches, and for each of a speck one over those within [`REACH`].
pub(super) fn settle(
    grid: &Grid,
    patches: &Patches,
    signs: &mut Signs,
    decisions: &mut Vec<Decision>,
    stage: &Stage,
) -> Result<(), Error> {
    let surfaces = decisions.partition_point(|decision| decision.component.points >= LEAST_POINTS);
    if surfaces == 0 || surfaces == decisions.len() {
        return Ok(());
    }
    let is_speck = |patch: usize| signs.component[patch] as usize >= surfaces;
    let told = stage.collect(grid.blocks.len(), WHAT, &|block| {
        let mut told = Vec::new();
        for (centre, cube, _) in grid.blocks[block].clone().flat_map(|brick| grid.centres_of(brick)) {
            for patch in patches.of_cube(cube).filter(|&patch| is_speck(patch)) {
                let here = centre + patches.all[patch].centre.as_dvec3();
                grow(&mut told, 1, WHAT)?;
                told.extend(ask_around(grid, patches, signs, patch, here, &is_speck));
            }
        }
        Ok(told)
    })?;
    for Told { patch, is_flipped, component } in told.into_iter().flatten() {
        let before = replace(&mut signs.component[patch], component);
        signs.flipped[patch] = is_flipped;
        let points = u64::from(patches.all[patch].points);
        let from = &mut decisions[before as usize];
        from.component.points -= points;
        from.patches -= 1;
        let to = &mut decisions[component as usize];
        to.component.points += points;
        to.patches += 1;
    }
    number(signs, decisions)
}

/// What the patches round one say of it.
///
/// It agrees with another one as their normals do, one of them reflected, as by [`super::links`]: so in a corner and past an edge,
/// too. That counts with the points of the other one, over the square of its distance.
fn ask_around(
    grid: &Grid,
    patches: &Patches,
    signs: &Signs,
    patch: usize,
    here: DVec3,
    is_speck: &dyn Fn(usize) -> bool,
) -> Option<Told> {
    let normal = patches.all[patch].normal;
    let (mut agreement, mut nearest) = (0.0, None);
    each_around(grid, patches, here, |other, line| {
        let square = line.length_squared() + SOFT;
        if square > REACH * REACH || is_speck(other) {
            return;
        }
        let facing = signs.facing(patches, other);
        let reflected = normal.dot(facing) - 2.0 * line.dot(normal) * line.dot(facing) / square;
        agreement += reflected * patches.all[other].points as f32 / square;
        if nearest.is_none_or(|(least, _)| square < least) {
            nearest = Some((square, signs.component[other]));
        }
    });
    nearest.map(|(_, component)| Told { patch, is_flipped: agreement < 0.0, component })
}

/// Calls `each` with the patches of all bricks within [`REACH`] of a place, and how far they are from it, in edges.
fn each_around(grid: &Grid, patches: &Patches, here: DVec3, mut each: impl FnMut(usize, Vec3)) {
    let brick = |reach: f32| ((here + f64::from(reach)) / f64::from(BRICK)).floor().as_ivec3();
    let (first, last) = (brick(-REACH), brick(REACH));
    let along = |axis: usize| first[axis]..=last[axis];
    let places = along(2).flat_map(|z| along(1).flat_map(move |y| along(0).map(move |x| IVec3::new(x, y, z))));
    let bricks = places.filter_map(|place| grid.bricks.number(place));
    for (centre, cube, _) in bricks.flat_map(|brick| grid.centres_of(brick as usize)) {
        let line = (centre - here).as_vec3();
        patches.of_cube(cube).for_each(|patch| each(patch, line + patches.all[patch].centre));
    }
}

/// Numbers components by size again, and forgets those that are gone.
fn number(signs: &mut Signs, decisions: &mut Vec<Decision>) -> Result<(), Error> {
    let (mut order, mut numbers) = (Vec::new(), filled(0u32, decisions.len(), WHAT)?);
    reserve(&mut order, decisions.len(), WHAT)?;
    order.extend((0u32..).zip(decisions.drain(..)).filter(|(_, decision)| decision.patches > 0));
    order.sort_unstable_by_key(|&(old, decision)| (Reverse(decision.component.points), old));
    for (new, &(old, decision)) in (0..).zip(&order) {
        numbers[old as usize] = new;
        decisions.push(decision);
    }
    signs.component.iter_mut().for_each(|component| *component = numbers[*component as usize]);
    signs.components = decisions.len();
    Ok(())
}
