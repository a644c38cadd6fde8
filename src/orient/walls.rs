//! The other side of a wall, or of a gap.
//!
//! What goes into a closed body comes out of it again: along a line its surfaces face to and fro by turns. So what lies right
//! behind or before a patch faces the other way, be it the far side of a wall or that of a gap. A line along the normals is no
//! evidence to links (`links.rs`), because to these noise on one surface looks the same; but what is as far off as noise hardly ever
//! is, is another surface. It is not so where something is open: of leaves and the ground below both may be seen from above.

use super::parted::{PARALLEL, Thirds};
use super::patches::Patch;
use glam::Vec3;

/// The two are off each other's planes by so much at least, in edges, and by so many deviations of the noise; and no farther than
/// what is near a cube reaches.
const NEAR: f32 = 0.25;
const DEVIATIONS: f32 = 4.0;
const FAR: f32 = 1.8;

/// So far beside each other at the most, in edges, squared: steps lie farther.
const BESIDE: f32 = 0.12;

/// What it counts, against links that count up to 1.
const WEIGHT: f32 = 0.3;

/// What speaks for the signs of a patch and of another one, `step` cubes away, to agree, if these are the two sides of a wall or a
/// gap; `thirds` was [looked](Thirds::look) at from the first. The same from both ends, to the bit.
pub(super) fn across(own: &Patch, other: &Patch, step: Vec3, thirds: &Thirds) -> Option<f32> {
    let cosine = own.normal.dot(other.normal);
    if cosine * cosine < PARALLEL || !own.is_plain() || !other.is_plain() {
        return None;
    }
    let line = step + (other.centre - own.centre);
    let (height, depth) = (line.dot(own.normal).abs(), line.dot(other.normal).abs());
    let is_apart = height.min(depth) >= NEAR.max(DEVIATIONS * thirds.noise) && height.max(depth) <= FAR;
    let beside = line.length_squared() - height * depth;
    if !is_apart || beside > BESIDE || thirds.lie_between(other, step) {
        return None;
    }
    Some(-WEIGHT * cosine.signum() * own.certainty().min(other.certainty()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch(x: f32, z: f32, normal: Vec3) -> Patch {
        Patch { centre: Vec3::new(x, 0.0, z), normal, points: 16, flatness: 1.0, has_rival: false, bend: 0.0 }
    }

    /// What the first of some patches and the second say, these two in one cube, or where the second one is seen from the next one
    /// along x or z too; from both ends.
    fn says(noise: f32, patches: &[Patch]) -> Option<f32> {
        let told = [Vec3::ZERO, Vec3::X, -Vec3::Z].map(|step| says_from(step, noise, patches));
        assert!(
            told.iter().all(|one| one.map(f32::is_sign_negative) == told[0].map(f32::is_sign_negative)),
            "{told:?}"
        );
        told[0]
    }

    fn says_from(step: Vec3, noise: f32, patches: &[Patch]) -> Option<f32> {
        // The second stands in the cube so far on, in the same place.
        let mut patches: Vec<(Vec3, Patch)> = patches.iter().map(|&patch| (Vec3::ZERO, patch)).collect();
        patches[1] = (step, Patch { centre: patches[1].1.centre - step, ..patches[1].1 });
        let mut thirds = Thirds::new(noise, "the test").unwrap();
        let [there, back] = [(0, 1), (1, 0)].map(|(from, to)| {
            let ((place, own), (other_place, other)) = (patches[from], patches[to]);
            thirds.gather(patches.iter().map(|(step, patch)| (step - place, patch)));
            thirds.look(&own);
            across(&own, &other, other_place - place, &thirds)
        });
        assert_eq!(there, back);
        there
    }

    #[test]
    fn the_sides_of_a_wall_face_apart() {
        let near = patch(0.1, -0.4, Vec3::Z);
        assert!(says(0.0, &[near, patch(0.0, 0.4, Vec3::Z)]).is_some_and(|evidence| evidence < 0.0));
        assert!(says(0.0, &[near, patch(0.0, 0.4, -Vec3::Z)]).is_some_and(|evidence| evidence > 0.0));
        // As if seen askew.
        let askew = Vec3::new(0.3, 0.0, 1.0).normalize();
        assert!(says(0.0, &[near, patch(0.0, 0.4, askew)]).is_some_and(|evidence| evidence < 0.0));
    }

    #[test]
    fn what_is_no_wall_says_nothing() {
        let near = patch(0.0, -0.4, Vec3::Z);
        // Noise, a step, the side of a groove, what is too far off, few points, and those of more faces.
        assert_eq!(says(0.21, &[near, patch(0.0, 0.4, Vec3::Z)]), None);
        assert_eq!(says(0.0, &[near, patch(0.5, 0.4, Vec3::Z)]), None);
        assert_eq!(says(0.0, &[near, patch(0.0, 0.4, Vec3::X)]), None);
        assert_eq!(says(0.0, &[near, patch(0.0, 1.5, Vec3::Z)]), None);
        assert_eq!(says(0.0, &[near, Patch { flatness: 0.7, ..patch(0.0, 0.4, Vec3::Z) }]), None);
        assert_eq!(says(0.0, &[near, Patch { points: 3, ..patch(0.0, 0.4, Vec3::Z) }]), None);
    }

    /// By turns: the third side of two walls faces as the first one does, and each next one the other way.
    #[test]
    fn walls_behind_each_other_do_not_mix() {
        let [first, second, third] = [-0.5, 0.0, 0.5].map(|z| patch(0.0, z, Vec3::Z));
        assert_eq!(says(0.0, &[first, third, second]), None);
        assert!(says(0.0, &[first, second, third]).is_some());
    }
}
