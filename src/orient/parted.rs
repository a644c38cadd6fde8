//! Whether a third patch parts two.
//!
//! Round an edge of a thin wall a patch lies to the far side of it much as it does to the near one, which has the opposite sign,
//! and so it does at the ends of fins and teeth to the next of these. But the surface between two patches does not go through a
//! third one. Nor does it leave a sheet for another one that lies before or behind that: where a thin shell bends, the two sides of
//! it, seen askew, are in line almost as parts of one side are.

use super::patches::{MOST, Patch};
use crate::error::Error;
use crate::lanes::{dot, transposed};
use crate::lists::grow;
use crate::surroundings::STEPS;
use glam::{BVec4A, Vec3, Vec4};

/// Two patches are on either side of a third one if both are so far off its plane, in edges, and so many deviations of the noise:
/// less may be noise, or how it bends.
const OFF: f32 = 0.2;
const DEVIATIONS: f32 = 2.0;

/// One lies before or behind a third one if it is as far off its plane, in edges, and so many deviations: noise tears a sheet into
/// layers.
const LAYERS: f32 = 3.0;

/// What the squares of how far two are off each other's planes add up to, against that limit squared, where a third one may part
/// them. With less they are in line, as on two plates that cross.
const IN_LINE: f32 = 2.5;

/// It lies between them if the line from one to the other goes through its plane no farther from its centre than this, in edges,
/// squared: its points fill about a cube.
const WITHIN: f32 = 0.36;

/// It lies before or behind one of them if that is no farther beside it than this, in edges, squared.
const BEHIND: f32 = 1.0;

/// And the other one goes on in it if what the squares of how far these two are off each other's planes add up to is less than
/// this share of that of the two.
const SHARE: f32 = 0.5;

/// The squares of the cosines between its normal and those of the two are no less: what lies behind it is the other side of a wall,
/// and what goes on in it no other face. Leaves lie anyhow.
const PARALLEL: f32 = 0.8;
const ALIKE: f32 = 0.2;

/// It has so many points, and is so flat: what has fewer, or some of a face beyond an edge, may have any normal.
const LEAST: u32 = 4;
const FLAT: f32 = 0.8;

/// The patches near one that may part it from others.
pub(super) struct Thirds {
    /// How far two are at least off the plane of one that lies between them.
    off: f32,
    /// How far one is at least off the plane of one before or behind it.
    apart: f32,
    /// From the cube of that patch to theirs, in edges, and they.
    thirds: Vec<(Vec3, Patch)>,
    fours: Vec<Four>,
}

/// Four of them, lane by lane; where there are fewer, the last one again.
struct Four {
    step: [Vec4; 3],
    centre: [Vec4; 3],
    normal: [Vec4; 3],
    /// From their centres to that patch, and how it lies to them.
    line: [Vec4; 3],
    lies: Lies,
}

/// How a patch lies to four others.
struct Lies {
    /// Off their planes.
    height: Vec4,
    /// The squares of that and of how far they are off its own, added up; not off what the patches bend to, as `Told::off` is, which
    /// few do.
    off: Vec4,
    /// Beside them, squared.
    beside: Vec4,
    /// The squares of the cosines between their normals and its own.
    alike: Vec4,
}

impl Thirds {
    /// With room for all that are near a patch; `noise` is that of the points, in edges.
    pub fn new(noise: f32, what: &str) -> Result<Self, Error> {
        let (mut thirds, mut fours) = (Vec::new(), Vec::new());
        grow(&mut thirds, STEPS.len() * MOST, what)?;
        grow(&mut fours, STEPS.len() * MOST / 4, what)?;
        Ok(Self { off: OFF.max(DEVIATIONS * noise), apart: OFF.max(LAYERS * noise), thirds, fours })
    }

    /// A bit for each of four pairs that something may part; `off` are the sums of the squares of how far the two are off each
    /// other's planes.
    pub fn may_part(&self, off: Vec4) -> u32 {
        off.cmpgt(Vec4::splat(IN_LINE * self.off * self.off)).bitmask()
    }

    /// Looks at what is near a patch: patches, each with what lies between the cube of that one and its own.
    pub fn look<'a>(&mut self, own: &Patch, near: impl Iterator<Item = (Vec3, &'a Patch)>) {
        self.thirds.clear();
        let may_part = |patch: &Patch| patch.points >= LEAST && patch.flatness >= FLAT;
        self.thirds.extend(near.filter(|(_, patch)| may_part(patch)).map(|(step, &patch)| (step, patch)));
        self.fours.clear();
        self.fours.extend(self.thirds.chunks(4).map(|thirds| Four::of(own, thirds)));
    }

    /// Whether one of them parts the patch from another one, `step` cubes away; `off` as for [`Thirds::may_part`]. The same from
    /// both ends, to the bit: only what is near both counts.
    pub fn part(&self, other: &Patch, step: Vec3, off: f32) -> bool {
        self.fours.iter().any(|four| four.part(other, step, off, self))
    }
}

impl Four {
    fn of(own: &Patch, thirds: &[(Vec3, Patch)]) -> Self {
        let row = |of: &dyn Fn(&(Vec3, Patch)) -> Vec4| {
            transposed([0, 1, 2, 3].map(|lane| of(&thirds[lane.min(thirds.len() - 1)])))
        };
        let [step_x, step_y, step_z, _] = row(&|(step, _)| step.extend(0.0));
        let [x, y, z, _] = row(&|(_, patch)| patch.centre.extend(0.0));
        let [normal_x, normal_y, normal_z, _] = row(&|(_, patch)| patch.normal.extend(0.0));
        let (step, centre, normal) = ([step_x, step_y, step_z], [x, y, z], [normal_x, normal_y, normal_z]);
        let place = own.centre.to_array().map(Vec4::splat);
        let line = [0, 1, 2].map(|axis| (place[axis] - centre[axis]) - step[axis]);
        Self { step, centre, normal, line, lies: Lies::of(own, line, normal) }
    }

    /// Whether one of the four parts the patch from another one, `step` cubes away.
    #[inline(always)]
    fn part(&self, other: &Patch, step: Vec3, off: f32, limits: &Thirds) -> bool {
        let [step, place] = [step, other.centre].map(|vector| vector.to_array().map(Vec4::splat));
        let away = [0, 1, 2].map(|axis| step[axis] - self.step[axis]);
        let [near_x, near_y, near_z] = away.map(|away| away.abs().cmple(Vec4::ONE));
        let is_near = near_x & near_y & near_z;
        if !is_near.any() {
            return false;
        }
        let line = [0, 1, 2].map(|axis| (place[axis] - self.centre[axis]) + away[axis]);
        let lies = Lies::of(other, line, self.normal);
        (is_near & (self.lie_between(line, &lies, limits.off) | self.lies.are_apart(&lies, off, limits.apart))).any()
    }

    /// Which of the four lie between the patch and another one.
    #[inline(always)]
    fn lie_between(&self, line: [Vec4; 3], other: &Lies, off: f32) -> BVec4A {
        let is_off = |lies: &Lies| lies.height.abs().cmpgt(Vec4::splat(off));
        let is_beyond = (self.lies.height * other.height).cmplt(Vec4::ZERO) & is_off(&self.lies) & is_off(other);
        let through = [0, 1, 2].map(|axis| other.height * self.line[axis] - self.lies.height * line[axis]);
        let rise = other.height - self.lies.height;
        is_beyond & dot(through, through).cmplt(WITHIN * (rise * rise))
    }
}

impl Lies {
    /// `line` are those from the centres of the four to that of the patch.
    #[inline(always)]
    fn of(patch: &Patch, line: [Vec4; 3], normals: [Vec4; 3]) -> Self {
        let own = patch.normal.to_array().map(Vec4::splat);
        let (height, depth, alike) = (dot(line, normals), dot(line, own), dot(normals, own));
        let square = height * height;
        Self { height, off: square + depth * depth, beside: dot(line, line) - square, alike: alike * alike }
    }

    /// Which of the four one of two patches goes on in while the other one lies before or behind it; `off` is how far these two are
    /// off each other's planes.
    #[inline(always)]
    fn are_apart(&self, other: &Self, off: f32, apart: f32) -> BVec4A {
        let is_behind = |one: &Self| {
            let is_apart = one.height.abs().cmpgt(Vec4::splat(apart));
            is_apart & one.beside.cmplt(Vec4::splat(BEHIND)) & one.alike.cmpgt(Vec4::splat(PARALLEL))
        };
        // In another one, not in itself.
        let goes_on = |one: &Self| {
            let is_in_line = one.off.cmplt(Vec4::splat(SHARE * off));
            is_in_line & one.beside.cmpgt(Vec4::ZERO) & one.alike.cmpgt(Vec4::splat(ALIKE))
        };
        is_behind(self) & goes_on(other) | is_behind(other) & goes_on(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch(centre: Vec3, normal: Vec3) -> Patch {
        Patch { centre, normal, points: 16, flatness: 1.0, has_rival: false, bend: 0.0 }
    }

    /// Whether the third of some patches, each so many cubes away, parts the first two; from both ends.
    fn are_parted(patches: [(Patch, Vec3); 3]) -> bool {
        let mut thirds = Thirds::new(0.0, "the test").unwrap();
        let [there, back] = [(0, 1), (1, 0)].map(|(from, to)| {
            let ((own, place), (other, step)) = (patches[from], patches[to]);
            // Against the cube of the one that looks, and none that is not near it.
            let all = patches.iter().map(|(patch, step)| (step - place, patch));
            thirds.look(&own, all.filter(|(step, _)| step.abs().max_element() <= 1.0));
            let line = (other.centre - own.centre) + (step - place);
            let off = line.dot(own.normal).powi(2) + line.dot(other.normal).powi(2);
            thirds.part(&other, step - place, off)
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

    /// The wall of a pipe, seen askew through it: one side a cube farther on, and both there.
    #[test]
    fn the_two_sides_of_a_shell_are_parted_where_it_bends() {
        let on = |radius: f32, angle: f32| {
            let normal = Vec3::new(angle.sin(), 0.0, angle.cos());
            patch(radius * normal - 3.0 * Vec3::Z, normal)
        };
        let [outer, inner] = [3.4, 2.7].map(|radius| on(radius, 0.1));
        // In the cube beside.
        let next = |radius: f32| {
            let patch = on(radius, 0.6);
            (Patch { centre: patch.centre - Vec3::X, ..patch }, Vec3::X)
        };
        let (outer, inner) = ((outer, Vec3::ZERO), (inner, Vec3::ZERO));
        assert!(are_parted([outer, next(2.7), next(3.4)]));
        assert!(are_parted([inner, next(3.4), next(2.7)]));
        assert!(are_parted([outer, next(2.7), inner]));
        assert!(!are_parted([outer, next(3.4), next(2.7)]));
        assert!(!are_parted([inner, next(2.7), next(3.4)]));
        // What lies there in any direction, as leaves do, is no other side.
        let leaf =
            |(patch, step): (Patch, Vec3)| (Patch { normal: Vec3::new(0.6, 0.6, 0.5).normalize(), ..patch }, step);
        assert!(!are_parted([outer, next(2.7), leaf(next(3.4))]));
    }

    /// Bent as closely as round a rod of two edges' radius: there only those nearly two edges from each other would be.
    #[test]
    fn nothing_parts_a_surface() {
        for bend in [-0.5, -0.2, 0.2, 0.5] {
            let on_arc = |angle: f32| {
                let normal = Vec3::new(angle.sin(), 0.0, angle.cos());
                (patch((normal - Vec3::Z) / bend, normal), Vec3::ZERO)
            };
            for angle in [0.1, 0.2, 0.3, 0.4] {
                assert!(!are_parted([on_arc(-angle), on_arc(angle), on_arc(0.0)]), "{bend} {angle}");
            }
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
