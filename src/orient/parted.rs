//! Whether a third patch parts two.
//!
//! Round an edge of a thin wall a patch lies to the far side of it much as it does to the near one, which has the opposite sign,
//! and so it does at the ends of fins and teeth to the next of these. But the surface between two patches does not go through a
//! third one. Nor does it leave a sheet for another one that lies before or behind that: where a thin shell bends, the two sides of
//! it, seen askew, are in line almost as parts of one side are.

use super::fours::{Four, first_four};
use super::patches::{MOST, Patch};
use crate::error::Error;
use crate::lanes::dot;
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
pub(super) const PARALLEL: f32 = 0.8;
const ALIKE: f32 = 0.2;

/// What is near a cube, and may part patches of that from others.
pub(super) struct Thirds {
    /// That of the points, in edges.
    pub noise: f32,
    /// How far two are at least off the plane of one that lies between them.
    off: f32,
    /// How far one is at least off the plane of one before or behind it.
    apart: f32,
    /// From the cube to theirs, in edges, and they; and the same four by four.
    near: Vec<(Vec3, Patch)>,
    fours: Vec<Four>,
    /// How the patch that looks lies to them.
    own: Vec<Lies>,
}

/// How a patch lies to four others.
struct Lies {
    /// From their centres to its own.
    line: [Vec4; 3],
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
    /// With room for all that is near a cube; `noise` is that of the points, in edges.
    pub fn new(noise: f32, what: &str) -> Result<Self, Error> {
        let (mut near, mut fours, mut own) = (Vec::new(), Vec::new(), Vec::new());
        grow(&mut near, STEPS.len() * MOST, what)?;
        grow(&mut fours, STEPS.len() * MOST / 4, what)?;
        grow(&mut own, STEPS.len() * MOST / 4, what)?;
        Ok(Self { noise, off: OFF.max(DEVIATIONS * noise), apart: OFF.max(LAYERS * noise), near, fours, own })
    }

    /// A bit for each of four pairs that something may part; `off` are the sums of the squares of how far the two are off each
    /// other's planes.
    pub fn may_part(&self, off: Vec4) -> u32 {
        off.cmpgt(Vec4::splat(IN_LINE * self.off * self.off)).bitmask()
    }

    /// Takes what is near a cube: patches, each with the step to its own. Only plain ones part others.
    pub fn gather<'a>(&mut self, near: impl Iterator<Item = (Vec3, &'a Patch)>) {
        self.near.clear();
        self.near.extend(near.filter(|(_, patch)| patch.is_plain()).map(|(step, &patch)| (step, patch)));
        self.fours.clear();
        let four = |near: &[(Vec3, Patch)]| Four::of(first_four(near).each_ref().map(|(step, patch)| (*step, patch)));
        self.fours.extend(self.near.chunks(4).map(four));
    }

    /// Looks at that from a patch of the cube.
    pub fn look(&mut self, own: &Patch) {
        self.own.clear();
        self.own.extend(self.fours.iter().map(|four| Lies::of(own, Vec3::ZERO, four)));
    }

    /// Whether something of it parts the patch that looked from another one, `step` cubes away; `off` as for [`Thirds::may_part`].
    /// The same from both ends, to the bit: only what is near both counts, and neither parts itself.
    pub fn part(&self, other: &Patch, step: Vec3, off: f32) -> bool {
        self.fours.iter().zip(&self.own).any(|(four, own)| self.one_parts(four, own, other, step, off))
    }

    /// Whether something of it lies between the patch that looked and another one, `step` cubes away; from both ends as above.
    pub fn lie_between(&self, other: &Patch, step: Vec3) -> bool {
        self.fours.iter().zip(&self.own).any(|(four, own)| {
            let is_near = is_near(four, step);
            is_near.any() && (is_near & own.are_between(&Lies::of(other, step, four), self.off)).any()
        })
    }

    /// Whether one of four does.
    #[inline(always)]
    fn one_parts(&self, four: &Four, own: &Lies, other: &Patch, step: Vec3, off: f32) -> bool {
        let is_near = is_near(four, step);
        if !is_near.any() {
            return false;
        }
        let other = Lies::of(other, step, four);
        (is_near & (own.are_between(&other, self.off) | own.are_of_one(&other, off, self.apart))).any()
    }
}

/// Which of four are in the cube so many cubes away, or next to it.
#[inline(always)]
fn is_near(four: &Four, step: Vec3) -> BVec4A {
    let steps = step.to_array();
    let [x, y, z] = [0, 1, 2].map(|axis| (steps[axis] - four.step[axis]).abs().cmple(Vec4::ONE));
    x & y & z
}

impl Lies {
    /// Of a patch `step` cubes away from the one that the four are near.
    #[inline(always)]
    fn of(patch: &Patch, step: Vec3, four: &Four) -> Self {
        let [place, own, step] = [patch.centre, patch.normal, step].map(|one| one.to_array().map(Vec4::splat));
        let line = [0, 1, 2].map(|axis| (place[axis] - four.centre[axis]) + (step[axis] - four.step[axis]));
        let (height, depth, alike) = (dot(line, four.normal), dot(line, own), dot(four.normal, own));
        let square = height * height;
        Self { line, height, off: square + depth * depth, beside: dot(line, line) - square, alike: alike * alike }
    }

    /// Which of the four lie between two patches.
    #[inline(always)]
    fn are_between(&self, other: &Self, off: f32) -> BVec4A {
        let is_off = |one: &Self| one.height.abs().cmpgt(Vec4::splat(off));
        let is_beyond = (self.height * other.height).cmplt(Vec4::ZERO) & is_off(self) & is_off(other);
        let through = [0, 1, 2].map(|axis| other.height * self.line[axis] - self.height * other.line[axis]);
        let rise = other.height - self.height;
        is_beyond & dot(through, through).cmplt(WITHIN * (rise * rise))
    }

    /// Which of the four are of the sheet of one of two patches, while the other one lies before or behind it; `off` is how far these
    /// two are off each other's planes.
    #[inline(always)]
    fn are_of_one(&self, other: &Self, off: f32, apart: f32) -> BVec4A {
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
            thirds.gather(all.filter(|(step, _)| step.abs().max_element() <= 1.0));
            thirds.look(&own);
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

    /// Bent as closely as round a rod of two edges' radius: there only those more than 1.6 edges from each other would be.
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
        assert!(!are_parted(Patch { points: 3, ..middle }));
        assert!(!are_parted(Patch { flatness: 0.7, ..middle }));
    }
}
