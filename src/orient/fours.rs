//! Patches near one, four at a time.

use super::patches::Patch;
use crate::lanes::transposed;
use glam::{Vec3, Vec4};

/// Four patches near one, number for number in lanes.
pub(super) struct Four {
    /// From the cube of that one to theirs, in edges.
    pub step: [Vec4; 3],
    pub centre: [Vec4; 3],
    pub normal: [Vec4; 3],
    pub bend: Vec4,
    pub flatness: Vec4,
    pub certainty: Vec4,
}

impl Four {
    /// Each with the step to its cube.
    #[inline(always)]
    pub fn of(near: [(Vec3, &Patch); 4]) -> Self {
        let rows = |row: &dyn Fn(Vec3, &Patch) -> Vec4| transposed(near.map(|(step, patch)| row(step, patch)));
        let [x, y, z, flatness] = rows(&|_, patch| patch.centre.extend(patch.flatness));
        let [along_x, along_y, along_z, certainty] = rows(&|_, patch| patch.normal.extend(patch.certainty()));
        let [step_x, step_y, step_z, bend] = rows(&|step, patch| step.extend(patch.bend));
        Self {
            step: [step_x, step_y, step_z],
            centre: [x, y, z],
            normal: [along_x, along_y, along_z],
            bend,
            flatness,
            certainty,
        }
    }
}

/// The first four of some, at least one; where there are fewer, the last one again.
#[inline(always)]
pub(super) fn first_four<T: Copy>(some: &[T]) -> [T; 4] {
    [0, 1, 2, 3].map(|lane| some[lane.min(some.len() - 1)])
}
