//! Two sheets in one cube that nearly touch, as where round bodies do, or that meet at a small angle, as at the tip of a blade,
//! told apart by how exactly lines and places of points go together.
//!
//! On one sheet, if it bends evenly, what lies between two points is across the mean of their normals. So where there is no
//! noise points of two sheets are told apart however thin the gap is.

use crate::bricks::set_bits;
use crate::grid::{Placed, located};
use crate::lanes::transposed;
use glam::{Vec3, Vec4};

/// Cubes of more points are left to the limits of patches.
const ROOM: usize = u64::BITS as usize;

/// Points lie on two sheets that are so many times as far off a common one as others are, and at least this far, in edges:
/// rounding leaves as much.
const TIMES: f32 = 10.0;
const APART: f32 = 0.0015;

/// A sheet has so many points at least: two are always of one, and next to a rim few are of none.
const LEAST: u32 = 3;

/// Off their own sheet points lie by less than this share of what they lie off the other one, both squared.
const CLEAR: f32 = 0.25;

/// How often points may change sides.
const ROUNDS: usize = 8;

/// Whether points lie off one sheet.
pub(super) struct Doubt {
    count: f32,
    /// The sum over all points, and that of the squares, of twice what they lie off a sheet that goes through their mean.
    off: [f32; 2],
}

impl Doubt {
    pub const NONE: Self = Self { count: 0.0, off: [0.0; 2] };

    /// Counts a point that lies so high along the mean normal, and along its own.
    #[inline(always)]
    pub fn add(&mut self, height: f32, own: f32) {
        let off = height + own;
        self.count += 1.0;
        self.off = [self.off[0] + off, self.off[1] + off * off];
    }

    /// Whether there may be two sheets, where points lie so far off their own, in edges.
    pub fn is_some(&self, slack: f32) -> bool {
        let Self { count, off } = *self;
        count * off[1] - off[0] * off[0] > 0.5 * apart(slack) * count * count
    }
}

/// Twice how far two points on two sheets lie off a common one, in edges and squared.
fn apart(slack: f32) -> f32 {
    (2.0 * APART.max(TIMES * slack)).powi(2)
}

/// Four points, and their normals, all to one side.
#[derive(Clone, Copy)]
struct Four {
    place: [Vec4; 3],
    upward: [Vec4; 3],
}

impl Four {
    const NONE: Self = Self { place: [Vec4::ZERO; 3], upward: [Vec4::ZERO; 3] };

    /// The squares of twice how far each lies off a sheet that goes through it and another point.
    #[inline(always)]
    fn off(&self, place: Vec3, upward: Vec3) -> Vec4 {
        let across = |axis: usize| (self.place[axis] - place[axis]) * (self.upward[axis] + upward[axis]);
        let off = across(0) + across(1) + across(2);
        off * off
    }
}

/// A bit for each point that is on the second of two sheets; none if these are not two. `normal` is about that of all points, which
/// lie so far off their own sheet, in edges.
#[inline(never)]
pub(super) fn second(points: &[Placed], normals: &[Vec3], normal: Vec3, slack: f32) -> u64 {
    let count = points.len();
    if count > ROOM || (count as u32) < 2 * LEAST {
        return 0;
    }
    let mut upward = [Vec3::ZERO; ROOM];
    upward.iter_mut().zip(normals).for_each(|(upward, &own)| *upward = own * normal.dot(own).signum());
    let mut fours = [Four::NONE; ROOM / 4];
    for ((four, points), upward) in fours.iter_mut().zip(points.chunks(4)).zip(upward.chunks(4)) {
        let [x, y, z, _] = transposed(std::array::from_fn(|lane| upward[lane].extend(0.0)));
        *four = Four { place: located(points, Vec3::ZERO).0, upward: [x, y, z] };
    }
    let fours = &fours[..count.div_ceil(4)];
    // For each point the sum of how far it lies off some of them.
    let off = |others: u64| -> [f32; ROOM] {
        let mut sums = [Vec4::ZERO; ROOM / 4];
        for other in set_bits(others) {
            let (place, upward) = (points[other as usize].local, upward[other as usize]);
            sums.iter_mut().zip(fours).for_each(|(sum, four)| *sum += four.off(place, upward));
        }
        bytemuck::cast(sums)
    };
    // The point farthest from the middle, because all sheets go on from where they touch, and the one farthest off its sheet.
    let middle = points.iter().map(|point| point.local).sum::<Vec3>() / count as f32;
    let farthest = |distance: &dyn Fn(usize) -> f32| {
        (0..count).max_by(|&i, &j| distance(i).total_cmp(&distance(j))).unwrap_or_default()
    };
    let a = farthest(&|i| points[i].local.distance_squared(middle));
    let off_a = off(1 << a);
    let b = farthest(&|i| off_a[i]);
    if off_a[b] < apart(slack) {
        return 0;
    }
    let off_b = off(1 << b);
    let (mut second, mut within, mut between) = (0, 0.0, 0.0);
    for (i, (one, other)) in off_a.into_iter().zip(off_b).take(count).enumerate() {
        second |= u64::from(other < one) << i;
        within += one.min(other);
        between += one.max(other);
    }
    if within > CLEAR * between {
        return 0;
    }
    for _ in 0..ROUNDS {
        let sheets = [u64::MAX >> (ROOM - count) & !second, second];
        let counts = sheets.map(u64::count_ones);
        if counts[0].min(counts[1]) < LEAST {
            return 0;
        }
        let sums = sheets.map(off);
        let (mut within, mut between) = (0.0, 0.0);
        let next = (0..count).fold(0, |next, i| {
            let side = (second >> i & 1) as usize;
            // How far it lies off the others of each sheet.
            let means = [0, 1].map(|sheet| sums[sheet][i] / (counts[sheet] - u32::from(side == sheet)) as f32);
            within += means[side];
            between += means[1 - side];
            next | u64::from(means[1] < means[0]) << i
        });
        if next == second {
            return if within < CLEAR * between { second } else { 0 };
        }
        second = next;
    }
    0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of points in a square at the heights that `height` tells, with the slopes there.
    fn second_of(height: impl Fn(usize, f32, f32) -> (f32, f32, f32)) -> u64 {
        let places = (0..30).map(|i| ((i * 7 % 30) as f32 / 30.0 - 0.5, (i * 11 % 31) as f32 / 31.0 - 0.5));
        let all = places.enumerate().map(|(i, (x, y))| {
            let (z, by_x, by_y) = height(i, x, y);
            (Placed { local: Vec3::new(x, y, z), point: i as u32 }, Vec3::new(-by_x, -by_y, 1.0).normalize())
        });
        let (points, normals): (Vec<Placed>, Vec<Vec3>) = all.unzip();
        second(&points, &normals, Vec3::Z, 1e-4)
    }

    #[test]
    fn sheets_that_touch_are_two_and_what_bends_is_one() {
        let odd = (0..30).filter(|i| i % 2 == 1).map(|i| 1u64 << i).sum::<u64>();
        let even = !odd & ((1 << 30) - 1);
        for bend in [0.1, 0.2] {
            let touching = second_of(|i, x, y| {
                let bend = if i % 2 == 0 { bend } else { -bend };
                (0.5 * bend * (x * x + y * y), bend * x, bend * y)
            });
            assert!(touching == odd || touching == even, "{bend}: {touching:b}");
            assert_eq!(second_of(|_, x, y| (0.5 * bend * (x * x + y * y), bend * x, bend * y)), 0);
            assert_eq!(second_of(|_, x, y| (bend * x * y, bend * y, bend * x)), 0, "a saddle");
        }
        let blade = second_of(|i, x, _| {
            let slope = if i % 2 == 0 { 0.25 } else { -0.25 };
            (slope * (x + 0.5), slope, 0.0)
        });
        assert!(blade == odd || blade == even, "{blade:b}");
    }
}
