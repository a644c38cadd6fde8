//! Plane faces too narrow for any surface, told by the points themselves where these lie on them without noise.
//!
//! A surface takes some twenty points, and on the rib of a machine part or in a groove these never lie on one face. Where the
//! cloud has no noise, as points sampled on a model do, hardly any plane through a point and two others meets a fourth one by
//! chance: the plane that most points lie on is the point's face (Fischler and Bolles, "Random sample consensus: a paradigm for
//! model fitting with applications to image analysis and automated cartography", Communications of the ACM 24 (1981) 381-395,
//! with the points next to it in place of random ones).

use super::around::Around;
use super::choose::Chosen;
use super::level::Level;
use super::matrix::dot_lanes;
use crate::lanes::load;
use crate::lattice::cube_centre;
use crate::median;
use crate::order::sort_few;
use crate::points::spread;
use glam::{Vec3, Vec3Swizzles, Vec4};
use std::ops::Range;

/// A point lies on a plane that is no further away than this, in edges, squared: some thirteen times the rounding of single
/// precision in a cloud of a million points, and far less than any scanner's noise.
const ON: f32 = 1e-7;

/// Neighbourhoods of more points are left to the surfaces.
const ROOM: usize = 64;

/// Planes go through the point that is asked about, one of so many points next to it, and one of so many; at least one more of
/// the nearer half of these lies on them.
const FIRSTS: usize = 8;
const NEXT: usize = 24;
const OTHERS: f32 = 3.0;

/// It is not worth while to look for a plane with more of them.
const ENOUGH: f32 = 5.0;

/// The two lie in directions that differ by more than this, the square of a sine.
const APART: f32 = 0.09;

/// So many points lie on a face besides the one that is asked about, and such a share of all near the cube.
const LEAST: f32 = 6.0;
const SHARE: f32 = 0.2;

/// They lie in a strip no narrower than a sixth of its length: the sum of the principal minors of the second moments about the
/// point that is asked about, as a share of their trace squared.
const WIDE: f32 = 0.03;

/// A cloud is exact where one in eight of some points is in a cube whose points lie off their surface by no more than this, in
/// edges: far less than any noise, and more than what is left of a smooth surface.
const EXACT: f32 = 0.001;

/// Cubes of fewer points tell nothing of that.
const TELLING: usize = 8;

/// Whether points lie exactly on surfaces in a part of the cloud at least: from how far apart they are across the surface of
/// their cube, one next to the other, so that both sides of a thin wall in one cube are no noise.
#[optimize(size)]
#[inline(never)]
pub(super) fn are_exact(level: &Level, chosen: &[Chosen]) -> bool {
    /// Bricks to look at.
    const BRICKS: usize = 16;
    const POINTS: f32 = 32.0;
    let grid = &level.grid;
    let (mut gaps, mut noises) = (Vec::new(), Vec::new());
    for brick in spread(grid.bricks.len(), BRICKS) {
        for (cube, (points, bit)) in (grid.first_cube[brick] as usize..).zip(grid.cubes_of(brick)) {
            if points.len() < TELLING || !chosen[cube].is_some() {
                continue;
            }
            let centre = cube_centre(bit);
            gaps.clear();
            gaps.extend(points.iter().map(|p| chosen[cube].quadric.at(p.local - centre).1));
            // In edges of a cube that has as many points as those of the base have.
            let count = points.len() as f32;
            noises.push((median::deviation(&mut gaps) * (count / POINTS).sqrt(), count));
        }
    }
    sort_few(&mut noises);
    let mut left = noises.iter().map(|(_, count)| count).sum::<f32>() / 8.0;
    let rank = noises.iter().position(|(_, count)| {
        left -= count;
        left <= 0.0
    });
    rank.is_some_and(|rank| noises[rank].0 < EXACT)
}

/// The normal of the face that a point of a cube, the one with bit `bit` of a brick, lies on, if the points round that tell one.
#[inline(never)]
pub(super) fn normal(level: &Level, brick: usize, bit: u32, around: &mut Around, point: Vec3) -> Option<Vec3> {
    let near = around.near(&level.grid, brick, bit, 1);
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
        for (j, b) in (i + 1..).zip(&next[i + 1..]) {
            let normal = a.truncate().cross(b.truncate());
            let square = normal.length_squared();
            // Nor where there is none.
            if square > APART * a.w * b.w {
                let closer = on(&lanes, 0..NEXT / 2, normal, ON * square);
                if closer < if j < NEXT / 2 { 3.0 } else { 2.0 } {
                    continue;
                }
                let count = closer + on(&lanes, NEXT / 2..NEXT, normal, ON * square);
                if count >= most {
                    (most, best) = (count + 1.0, Some(normal / square.sqrt()));
                }
            }
        }
        if most > ENOUGH {
            break;
        }
    }
    let normal = best?;
    if is_face(&offsets[..count], count, normal) {
        return best;
    }
    // Where it ends it may have too few points in the 27 cubes.
    let (mut on, mut count) = (0, 0);
    for (shift, points) in level.points_near(bit, around.near(&level.grid, brick, bit, 2)) {
        count += points.len();
        for p in points {
            let offset = p.local + shift - point;
            let height = offset.dot(normal);
            if height * height <= ON
                && offset != Vec3::ZERO
                && let Some(free) = offsets.get_mut(on)
            {
                *free = offset;
                on += 1;
            }
        }
    }
    is_face(&offsets[..on], count, normal).then_some(normal)
}

/// Whether those of so many points that lie on a plane are a face, and neither a narrow strip nor rows: any two rows of a
/// scanner, or of coordinates that were rounded, lie in a plane.
#[optimize(size)]
#[inline(never)]
fn is_face(offsets: &[Vec3], all: usize, normal: Vec3) -> bool {
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
    points >= LEAST.max(SHARE * all as f32) && minors >= WIDE * trace * trace && in_row == 1
}

/// How many points of a range, their x, y and z, have a product with `normal` of at most `limit`, squared.
#[inline(always)]
fn on(points: &[[f32; NEXT]; 3], range: Range<usize>, normal: Vec3, limit: f32) -> f32 {
    let normal = normal.to_array().map(Vec4::splat);
    let mut count = Vec4::ZERO;
    for i in range.step_by(4) {
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
        is_face(&offsets, offsets.len(), Vec3::Z)
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
