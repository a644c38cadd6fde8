//! Plane faces too narrow for any surface, told by the points themselves where these lie on them without noise.
//!
//! A surface takes some twenty points, and on the rib of a machine part or in a groove these never lie on one face. Where the
//! cloud has no noise, as points sampled on a model do, hardly any plane through a point and two others meets a fourth one by
//! chance: the plane that most points lie on is the point's face (Fischler and Bolles, "Random sample consensus: a paradigm for
//! model fitting with applications to image analysis and automated cartography", Communications of the ACM 24 (1981) 381-395,
//! with the points next to it in place of random ones).

use super::around::Near;
use super::level::Level;
use super::matrix::dot_lanes;
use crate::lanes::load;
use glam::{Vec3, Vec3Swizzles, Vec4};

/// A point lies on a plane that is no further away than this, in edges, squared: some twenty times the rounding of single
/// precision in a cloud of a million points, and far less than any scanner's noise.
const ON: f32 = 2.5e-7;

/// Neighbourhoods of more points are left to the surfaces.
const ROOM: usize = 64;

/// Planes go through the point that is asked about, one of so many points next to it, and one of so many, and at least one more
/// of these lies on them.
const FIRSTS: usize = 4;
const NEXT: usize = 12;
const OTHERS: f32 = 3.0;

/// It is not worth while to look for a plane with more of them.
const ENOUGH: f32 = 5.0;

/// The two lie in directions that differ by more than this, the square of a sine.
const APART: f32 = 0.09;

/// So many points lie on a face besides the one that is asked about, and such a share of all near the cube.
const LEAST: f32 = 6.0;
const SHARE: f32 = 0.25;

/// They lie in a strip no narrower than a third of its length: the sum of the principal minors of the second moments about the
/// point that is asked about, as a share of their trace squared.
const WIDE: f32 = 0.08;

/// The normal of the face that a point of a cube lies on, if the points of the cubes near that, the one with bit `bit` of a brick,
/// tell one.
#[inline(never)]
pub(super) fn normal(level: &Level, bit: u32, near: &[Near], point: Vec3) -> Option<Vec3> {
    // What lies between it and the others.
    let mut offsets = [Vec3::ZERO; ROOM];
    let mut count = 0;
    // The nearest first, each with the square of its distance.
    let mut next = [Vec4::INFINITY; NEXT];
    for (shift, points) in level.points_near(bit, near) {
        for p in points {
            // In this order, so that it is zero for the point itself.
            let offset = p.local + shift - point;
            let square = offset.length_squared();
            if square == 0.0 {
                continue;
            }
            *offsets.get_mut(count)? = offset;
            count += 1;
            let mut i = NEXT;
            while i > 0 && square < next[i - 1].w {
                i -= 1;
                if i + 1 < NEXT {
                    next[i + 1] = next[i];
                }
                next[i] = offset.extend(square);
            }
        }
    }
    let mut lanes = [[0.0; NEXT]; 3];
    for (i, place) in next.iter().enumerate() {
        (0..3).for_each(|axis| lanes[axis][i] = place[axis]);
    }
    let (mut most, mut best) = (OTHERS, None);
    for (i, a) in next[..FIRSTS].iter().enumerate() {
        for b in &next[i + 1..] {
            let normal = a.truncate().cross(b.truncate());
            let square = normal.length_squared();
            // Nor where there is none.
            if square > APART * a.w * b.w {
                let count = on(&lanes, normal, ON * square);
                if count >= most {
                    (most, best) = (count + 1.0, Some(normal / square.sqrt()));
                }
            }
        }
        if most > ENOUGH {
            break;
        }
    }
    best.filter(|normal| is_face(&offsets[..count], *normal))
}

/// Whether the points on a plane are a face, and neither a narrow strip nor rows: any two rows of a scanner, or of coordinates
/// that were rounded, lie in a plane.
#[optimize(size)]
#[inline(never)]
fn is_face(offsets: &[Vec3], normal: Vec3) -> bool {
    let (mut points, mut diagonal, mut off, mut next) = (0.0, Vec3::ZERO, Vec3::ZERO, Vec3::INFINITY);
    for &d in offsets {
        let height = d.dot(normal);
        if height * height <= ON {
            points += 1.0;
            diagonal += d * d;
            off += d.yzx() * d.zxy();
            next = if d.length_squared() < next.length_squared() { d } else { next };
        }
    }
    let trace = diagonal.element_sum();
    let minors = diagonal.dot(diagonal.yzx()) - off.length_squared();
    // The next one is in its own row.
    let in_row = offsets.iter().filter(|d| next.cross(**d).length_squared() <= ON * next.length_squared()).count();
    points >= LEAST.max(SHARE * offsets.len() as f32) && minors >= WIDE * trace * trace && in_row == 1
}

/// How many points, their x, y and z, have a product with `normal` of at most `limit`, squared.
#[inline(always)]
fn on(points: &[[f32; NEXT]; 3], normal: Vec3, limit: f32) -> f32 {
    let normal = normal.to_array().map(Vec4::splat);
    let mut count = Vec4::ZERO;
    for i in (0..NEXT).step_by(4) {
        let height = dot_lanes(points.each_ref().map(|numbers| load(&numbers[i..])), normal);
        count += Vec4::select((height * height).cmple(Vec4::splat(limit)), Vec4::ONE, Vec4::ZERO);
    }
    count.element_sum()
}

#[cfg(test)]
mod tests {
    use super::super::surface::tests::uniform;
    use super::*;

    /// Of 24 points in a square round the origin, so high over it: whether they are a face.
    fn is_face_of(mut place: impl FnMut(usize, &mut dyn FnMut() -> f32) -> Vec3) -> bool {
        let mut uniform = uniform();
        let offsets: Vec<Vec3> = (0..24).map(|i| place(i, &mut uniform)).collect();
        is_face(&offsets, Vec3::Z)
    }

    #[test]
    fn a_face_is_wide_and_without_noise_or_rows() {
        assert!(is_face_of(|_, uniform| Vec3::new(uniform(), uniform(), 0.0)));
        // Half of the points on another face.
        assert!(is_face_of(|i, uniform| Vec3::new(uniform(), uniform(), (i % 2) as f32 * uniform())));
        let share =
            |share: usize| is_face_of(|i, u| Vec3::new(u(), u(), if i % share == 0 { 0.0 } else { 0.1 + u().abs() }));
        assert!(share(3) && !share(6));
        assert!(!is_face_of(|_, uniform| Vec3::new(uniform(), uniform(), 0.01 * uniform())));
        assert!(!is_face_of(|_, uniform| Vec3::new(uniform(), 0.1 * uniform(), 0.0)));
        assert!(!is_face_of(|i, uniform| Vec3::new(uniform(), (i % 2) as f32, 0.0)), "rows");
        let lattice = |i: usize| Vec3::new((i % 5) as f32 - 2.0, (i / 5 + 1) as f32 - 2.0, 0.0);
        assert!(!is_face_of(|i, _| lattice(i)), "a lattice");
    }
}
