//! Whether a third patch lies between two.
//!
//! Round an edge of a thin wall a patch lies to the far side of it much as it does to the near one, which has the opposite sign,
//! and so it does at the ends of fins and teeth to the next of these. But the surface between two patches does not go through a
//! third one.

use super::patches::{MOST, Patch};
use crate::error::Error;
use crate::lanes::transposed;
use crate::lists::grow;
use crate::surroundings::STEPS;
use glam::{Vec3, Vec4};

/// Two patches are on either side of a third one if both are so far off its plane, in edges, and so many deviations of the noise:
/// less may be noise, or how it bends.
const OFF: f32 = 0.2;
const DEVIATIONS: f32 = 2.0;

/// What the squares of how far two are off each other's planes add up to, against that limit squared, where a third one may lie
/// between them. With less they are in line, as on two plates that cross.
const IN_LINE: f32 = 2.5;

/// It lies between them if the line from one to the other goes through its plane no farther from its centre than this, in edges,
/// squared: its points fill about a cube.
const WITHIN: f32 = 0.36;

/// It has so many points, and is so flat: what has fewer, or some of a face beyond an edge, may have any normal.
const LEAST: u32 = 4;
const FLAT: f32 = 0.8;

/// The patches near one that may lie between it and others.
pub(super) struct Between {
    /// How far two are off a third one.
    off: f32,
    thirds: Vec<Third>,
    fours: Vec<Four>,
}

/// One of them.
struct Third {
    /// From the cube of that patch to its own, in edges.
    step: Vec3,
    centre: Vec3,
    normal: Vec3,
    /// From its centre to that patch, and how far that is off its plane.
    line: Vec3,
    height: f32,
}

/// Four of them, lane by lane; where there are fewer, the last one again.
struct Four {
    step: [Vec4; 3],
    centre: [Vec4; 3],
    normal: [Vec4; 3],
    line: [Vec4; 3],
    height: Vec4,
}

impl Between {
    /// With room for all that are near a patch; `noise` is that of the points, in edges.
    pub fn new(noise: f32, what: &str) -> Result<Self, Error> {
        let (mut thirds, mut fours) = (Vec::new(), Vec::new());
        grow(&mut thirds, STEPS.len() * MOST, what)?;
        grow(&mut fours, STEPS.len() * MOST / 4, what)?;
        Ok(Self { off: OFF.max(DEVIATIONS * noise), thirds, fours })
    }

    /// A bit for each of four pairs that something may lie between; `off` are the sums of the squares of how far the two are off
    /// each other's planes.
    pub fn may_lie_between(&self, off: Vec4) -> u32 {
        off.cmpgt(Vec4::splat(IN_LINE * self.off * self.off)).bitmask()
    }

    /// Looks for those that may lie between a patch and others: of patches near by, each with what lies between the cube of that
    /// one and its own, and how far that one is off its plane.
    pub fn look<'a>(&mut self, own: &Patch, others: impl Iterator<Item = (&'a Patch, Vec3, f32)>) {
        self.thirds.clear();
        self.thirds.extend(others.filter_map(|(&Patch { centre, normal, points, flatness, .. }, step, height)| {
            let line = (own.centre - centre) - step;
            let may_lie_between = height.abs() > self.off && points >= LEAST && flatness >= FLAT;
            may_lie_between.then_some(Third { step, centre, normal, line, height })
        }));
        self.fours.clear();
        self.fours.extend(self.thirds.chunks(4).map(Four::of));
    }

    /// Whether one of them lies between the patch and another one, `step` cubes away. The same from both ends, to the bit: only
    /// what is near both counts.
    pub fn lies_before(&self, other: &Patch, step: Vec3) -> bool {
        let [step, place] = [step, other.centre].map(|vector| vector.to_array().map(Vec4::splat));
        self.fours.iter().any(|four| four.lies_before(place, step, self.off))
    }
}

impl Four {
    fn of(thirds: &[Third]) -> Self {
        let row =
            |of: &dyn Fn(&Third) -> Vec4| transposed([0, 1, 2, 3].map(|lane| of(&thirds[lane.min(thirds.len() - 1)])));
        let [step_x, step_y, step_z, height] = row(&|third| third.step.extend(third.height));
        let [x, y, z, _] = row(&|third| third.centre.extend(0.0));
        let [normal_x, normal_y, normal_z, _] = row(&|third| third.normal.extend(0.0));
        let [line_x, line_y, line_z, _] = row(&|third| third.line.extend(0.0));
        Self {
            step: [step_x, step_y, step_z],
            centre: [x, y, z],
            normal: [normal_x, normal_y, normal_z],
            line: [line_x, line_y, line_z],
            height,
        }
    }

    /// Whether one of the four lies between the patch and a place, `step` cubes away.
    #[inline(always)]
    fn lies_before(&self, place: [Vec4; 3], step: [Vec4; 3], off: f32) -> bool {
        let dot = |a: [Vec4; 3], b: [Vec4; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let away = [0, 1, 2].map(|axis| step[axis] - self.step[axis]);
        let line = [0, 1, 2].map(|axis| (place[axis] - self.centre[axis]) + away[axis]);
        let height = dot(line, self.normal);
        let through = [0, 1, 2].map(|axis| height * self.line[axis] - self.height * line[axis]);
        let rise = height - self.height;
        let [near_x, near_y, near_z] = away.map(|away| away.abs().cmple(Vec4::ONE));
        let is_beyond = (height * self.height).cmplt(Vec4::ZERO) & height.abs().cmpgt(Vec4::splat(off));
        let is_within = dot(through, through).cmplt(WITHIN * (rise * rise));
        (near_x & near_y & near_z & is_beyond & is_within).any()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch(centre: Vec3, normal: Vec3) -> Patch {
        Patch { centre, normal, points: 16, flatness: 1.0, has_rival: false, bend: 0.0 }
    }

    /// Whether the third of some patches, each so many cubes away, lies between the first two; from both ends.
    fn are_parted(patches: [(Patch, Vec3); 3]) -> bool {
        let mut between = Between::new(0.0, "the test").unwrap();
        let [there, back] = [(0, 1), (1, 0)].map(|(from, to)| {
            let ((own, place), (other, _)) = (patches[from], patches[to]);
            // Against the cube of the one that looks, and none that is not near it.
            let all = patches.iter().map(|(patch, step)| (patch, step - place));
            let near = all.filter(|(_, step)| step.abs().max_element() <= 1.0);
            let height = |patch: &Patch, step: Vec3| (own.centre - patch.centre - step).dot(patch.normal);
            between.look(&own, near.map(|(patch, step)| (patch, step, height(patch, step))));
            between.lies_before(&other, patches[to].1 - place)
        });
        assert_eq!(there, back);
        there
    }

    /// The end of a wall, a cube below, and its two sides, which end there.
    #[test]
    fn the_far_side_of_a_wall_is_parted_from_what_is_round_its_edge() {
        let end = (patch(Vec3::new(0.2, 0.0, 0.1), Vec3::X), -Vec3::Z);
        let [near, far] = [-0.4, 0.3].map(|z| (patch(Vec3::new(-0.2, 0.0, z), Vec3::Z), Vec3::ZERO));
        assert!(are_parted([end, far, near]));
        assert!(!are_parted([end, near, far]));
        // Where the line between the two goes past it.
        assert!(!are_parted([end, far, (near.0, -Vec3::X)]));
        // And where it is not near one of them, which does not know of it.
        assert!(!are_parted([end, (far.0, Vec3::Z), (near.0, Vec3::Z)]));
    }

    #[test]
    fn nothing_lies_between_parts_of_one_surface() {
        for bend in [-0.5, 0.5] {
            let on_arc = |angle: f32| {
                let normal = Vec3::new(angle.sin(), 0.0, angle.cos());
                (patch((normal - Vec3::Z) / bend, normal), Vec3::ZERO)
            };
            assert!(!are_parted([on_arc(-0.3), on_arc(0.3), on_arc(0.0)]));
        }
    }

    #[test]
    fn a_few_points_and_those_of_more_faces_part_nothing() {
        let [below, above, middle] = [-0.4, 0.4, 0.0].map(|z| patch(Vec3::new(0.1 * z, 0.0, z), Vec3::Z));
        let are_parted = |middle| are_parted([below, above, middle].map(|patch| (patch, Vec3::ZERO)));
        assert!(are_parted(middle));
        assert!(!are_parted(Patch { points: LEAST - 1, ..middle }));
        assert!(!are_parted(Patch { flatness: 0.7, ..middle }));
    }
}
