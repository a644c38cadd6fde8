//! Whether another sheet lies between two patches.
//!
//! Round an edge of a thin wall a patch lies to the far side of it much as it does to the near one, which has the opposite sign,
//! and so it does at the ends of fins and teeth to the next of these. But no surface goes on from one patch to another through a
//! third.

use super::patches::{MOST, Patch};
use crate::error::Error;
use crate::lanes::transposed;
use crate::lists::grow;
use crate::surroundings::{NEAR, STEPS};
use glam::{Vec3, Vec4, Vec4Swizzles};

/// Two patches are on either side of a third one if both are so far off its plane, in edges: less is noise, or how it bends.
const OFF: f32 = 0.2;

/// It lies between them if the line from one to the other passes its centre no farther away than this, in edges, squared.
const WITHIN: f32 = 0.36;

/// It has so many points, and is so flat: beside an edge a few of another face may be of any.
const LEAST: u32 = 4;
const FLAT: f32 = 0.8;

/// The patches near one that may lie between it and others.
pub(super) struct Between {
    all: Vec<Sheet>,
    fours: Vec<Four>,
}

/// One of them.
struct Sheet {
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
    /// With room for all that are near a patch.
    pub fn new(what: &str) -> Result<Self, Error> {
        let (mut all, mut fours) = (Vec::new(), Vec::new());
        grow(&mut all, STEPS.len() * MOST, what)?;
        grow(&mut fours, STEPS.len() * MOST / 4, what)?;
        Ok(Self { all, fours })
    }

    /// Looks for them among all patches that are near the cube of one, by number and bit of
    /// [`Places::near`](crate::surroundings::Places::near).
    pub fn look(&mut self, patches: &[Patch], near: &[(usize, u32)], own: &Patch) {
        let Self { all, fours } = self;
        all.clear();
        all.extend(near.iter().filter_map(|&(number, place)| {
            let Patch { centre, normal, points, flatness, .. } = patches[number];
            let step = NEAR[place as usize % 64].xyz();
            let line = (own.centre - centre) - step;
            let height = line.dot(normal);
            let is_off = points >= LEAST && flatness >= FLAT && height.abs() > OFF;
            is_off.then_some(Sheet { step, centre, normal, line, height })
        }));
        fours.clear();
        fours.extend(all.chunks(4).map(Four::of));
    }

    /// Whether one of them lies between the patch and another one, `step` cubes away. The same from both ends, to the bit: only
    /// what is near both counts.
    pub fn parts(&self, other: &Patch, step: Vec3) -> bool {
        let [step, other] = [step, other.centre].map(|vector| vector.to_array().map(Vec4::splat));
        self.fours.iter().any(|four| four.parts(other, step))
    }
}

impl Four {
    fn of(sheets: &[Sheet]) -> Self {
        let rows = |row: &dyn Fn(&Sheet) -> Vec4| {
            transposed([0, 1, 2, 3].map(|lane| row(&sheets[lane.min(sheets.len() - 1)])))
        };
        let vectors = |vector: &dyn Fn(&Sheet) -> Vec3| {
            let [x, y, z, _] = rows(&|sheet| vector(sheet).extend(0.0));
            [x, y, z]
        };
        Self {
            step: vectors(&|sheet| sheet.step),
            centre: vectors(&|sheet| sheet.centre),
            normal: vectors(&|sheet| sheet.normal),
            line: vectors(&|sheet| sheet.line),
            height: rows(&|sheet| Vec4::splat(sheet.height))[0],
        }
    }

    /// Whether one of the four lies before a place, `step` cubes away.
    #[inline(always)]
    fn parts(&self, place: [Vec4; 3], step: [Vec4; 3]) -> bool {
        let dot =
            |[x, y, z]: [Vec4; 3], [other_x, other_y, other_z]: [Vec4; 3]| x * other_x + y * other_y + z * other_z;
        let away = [0, 1, 2].map(|axis| step[axis] - self.step[axis]);
        let line = [0, 1, 2].map(|axis| (place[axis] - self.centre[axis]) + away[axis]);
        let height = dot(line, self.normal);
        let through = [0, 1, 2].map(|axis| height * self.line[axis] - self.height * line[axis]);
        let rise = height - self.height;
        let is_near = away.into_iter().map(|away| away.abs().cmple(Vec4::ONE)).reduce(|one, other| one & other);
        let is_beyond = (height * self.height).cmplt(Vec4::ZERO) & height.abs().cmpgt(Vec4::splat(OFF));
        let is_within = dot(through, through).cmplt(WITHIN * (rise * rise));
        is_near.is_some_and(|is_near| (is_near & is_beyond & is_within).any())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surroundings::Places;

    fn patch(centre: Vec3, normal: Vec3) -> Patch {
        Patch { centre, normal, points: 16, flatness: 1.0, has_rival: false, bend: 0.0 }
    }

    /// Whether the third of some patches, each of them at a bit of [`Places::near`], lies between the first two; from both ends.
    fn are_parted(patches: [Patch; 3], places: [u32; 3]) -> bool {
        let step = |of: usize| NEAR[places[of] as usize].xyz();
        let mut between = Between::new("the test").unwrap();
        let [there, back] = [(0, 1), (1, 0)].map(|(from, to)| {
            // Against the cube of the one that looks.
            let place = |of: usize| {
                let away = step(of) - step(from);
                NEAR.iter().position(|near| near.xyz() == away && away != Vec3::ZERO).unwrap_or(23) as u32
            };
            between.look(&patches, &[0, 1, 2].map(|of| (of, place(of))), &patches[from]);
            between.parts(&patches[to], step(to) - step(from))
        });
        assert_eq!(there, back);
        there
    }

    const HERE: u32 = Places::NEAR_CENTRE;

    /// The end of a wall, its far side, and its near side between them.
    #[test]
    fn the_far_side_of_a_wall_is_parted_from_what_is_round_its_edge() {
        let end = patch(Vec3::new(0.4, 0.0, 0.0), Vec3::X);
        let far = patch(Vec3::new(-0.2, 0.0, 0.3), Vec3::Z);
        let near = patch(Vec3::new(-0.2, 0.0, -0.4), Vec3::Z);
        // Seen from outside, a cube further down.
        let below = patch(Vec3::new(0.2, 0.0, 0.1), Vec3::X);
        assert!(are_parted([below, far, near], [HERE - 16, HERE, HERE]));
        assert!(!are_parted([end, far, near], [HERE; 3]), "both sides end there");
        assert!(!are_parted([below, near, far], [HERE - 16, HERE, HERE]));
    }

    #[test]
    fn nothing_lies_between_parts_of_one_surface() {
        let on_arc = |angle: f32| {
            let normal = Vec3::new(angle.sin(), 0.0, angle.cos());
            patch(2.0 * normal - 2.0 * Vec3::Z, normal)
        };
        assert!(!are_parted([on_arc(-0.3), on_arc(0.3), on_arc(0.0)], [HERE; 3]));
    }

    #[test]
    fn a_few_points_and_those_of_more_faces_part_nothing() {
        let [below, above] = [-0.4, 0.4].map(|z| patch(Vec3::new(0.0, 0.0, z), Vec3::X));
        let middle = patch(Vec3::ZERO, Vec3::Z);
        assert!(are_parted([below, above, middle], [HERE; 3]));
        assert!(!are_parted([below, above, Patch { points: LEAST - 1, ..middle }], [HERE; 3]));
        assert!(!are_parted([below, above, Patch { flatness: 0.7, ..middle }], [HERE; 3]));
    }
}
