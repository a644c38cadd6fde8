//! Which sheet a point lies on, of those that the points next to it are of, and the normal of that sheet there.
//!
//! On one sheet, if it bends evenly, what lies between two points is across the mean of their normals ([`super::sheets`]). So a
//! normal fits that comes near to this with each of the points next to it on one sheet: by least squares, and not far from
//! theirs.

use super::patches::aligned;
use crate::bricks::set_bits;
use crate::error::Error;
use crate::lists::grow;
use crate::order::sort_few;
use glam::{Mat3, Vec3};
use std::cmp::Ordering;

/// Points are of one sheet, whichever way that faces, where the cosine of their normals is more.
pub(super) const ALIKE: f32 = 0.7;

/// The same, first strictly, because faces that meet at a small angle are two sheets, then loosely, because where a sheet ends
/// or bends sharply few of its points are alike.
const ALIKE_ENOUGH: [f32; 2] = [0.98, ALIKE];

/// Up to how far away others tell of the sheet of a point, in edges and squared.
pub(super) const REACH: f32 = 2.25;

/// Added to the square of that distance: between two that nearly coincide lies nothing but rounding.
pub(super) const SOFT: f32 = 0.001;

/// What errors call the memory of all this.
const WHAT: &str = "the points next to one";

/// So many points next to one tell, of up to so many sheets, and of each the nearest.
const NEXT: usize = 48;
const SHEETS: usize = 4;
const OF_ONE: usize = 8;

/// Fewer tell nothing of a sheet.
const FEW: u32 = 4;

/// By how much twice what lies between two points is off a sheet: this share of how unlike its normals are, because none bends
/// quite evenly, and as much as normals are off; both squared.
const UNEVEN: f32 = 0.001;
const ROUNDING: f32 = 1e-7;

/// Added to what may be nothing at all, and is divided by.
const LITTLE: f32 = ROUNDING * ROUNDING;

/// The normal of no sheet is further off the mean of its normals than so many times as these are, squared: where coordinates
/// were rounded points lie on steps, and whatever is across these is as far off the other way.
const OFF: f32 = 16.0;

/// An oriented point, or the mean of some: where it is, in edges, and its normal.
pub(super) struct Oriented {
    pub place: Vec3,
    pub facing: Vec3,
}

impl Oriented {
    /// Twice how far another one lies off a sheet that goes through both, in edges; that may face the other way there.
    pub fn off(&self, other: &Self) -> f32 {
        (other.place - self.place).dot(self.facing + aligned(other.facing, self.facing))
    }
}

/// One next to the point that is asked about.
struct Near {
    /// How far away, in edges and squared.
    square: f32,
    offset: Vec3,
    facing: Vec3,
    /// What lies between the two, about as long as 1, however far away it is.
    direction: Vec3,
    weight: f32,
}

/// The points next to one.
#[derive(Default)]
pub(super) struct Fits {
    /// How far away they are, squared, as bits, which have the same order, and their numbers.
    order: Vec<u64>,
    near: Vec<Near>,
}

impl Fits {
    /// The normal of the sheet that a point lies on best, of those of the points `near` it, among which it may be itself: if
    /// that lies off them by less than `limit`, in the mean of the squares of [`Oriented::off`], each as a share of how far
    /// away they are, and a little more the further the normal is off theirs. None that faces away from its own normal. Of a
    /// point that lies on several, as on an edge itself, the mean of their normals: so it faces as each of them does.
    pub fn normal(&mut self, point: &Oriented, near: &[Oriented], limit: f32) -> Result<Option<Vec3>, Error> {
        self.look(point, near)?;
        let (mut least, mut sum) = (f32::INFINITY, Vec3::ZERO);
        let mut found = [(0, None); SHEETS];
        for alike in ALIKE_ENOUGH {
            let mut left = (1 << self.near.len()) - 1;
            for number in 0..SHEETS {
                let sheet = self.next_sheet(&mut left, alike);
                if sheet.count_ones() < FEW {
                    continue;
                }
                // Most are the same, however alike.
                if !found.iter().any(|&(same, _)| same == sheet) {
                    found[number] = (sheet, self.fit(sheet));
                }
                let fitted = found.iter().find_map(|&(same, fitted)| fitted.filter(|_| same == sheet));
                let Some((off, normal)) = fitted else { continue };
                if normal.dot(point.facing) > -ALIKE {
                    least = least.min(off);
                    sum += (ROUNDING / (off + LITTLE)).powi(2) * normal;
                }
            }
        }
        Ok(sum.try_normalize().filter(|_| least < limit))
    }

    /// The nearest of the points that are left, one bit for each, and the next whose normals are like its own, up to so many. Of
    /// all that are alike none is left.
    fn next_sheet(&self, left: &mut u64, alike: f32) -> u64 {
        let Some(first) = self.near.get(left.trailing_zeros() as usize) else { return 0 };
        let is_alike = |near: &Near| u64::from(near.facing.dot(first.facing) >= alike);
        let all = (0..).zip(&self.near).fold(0, |all, (bit, near)| all | is_alike(near) << bit) & *left;
        *left &= !all;
        let rest = (0..OF_ONE).fold(all, |rest, _| rest & rest.wrapping_sub(1));
        all & !rest
    }

    /// The normal that fits the points of one sheet, one bit for each, best, and how far these lie off it and that is off theirs: by
    /// least squares, with the mean of their normals as a guess, which is as good as these are alike.
    fn fit(&self, sheet: u64) -> Option<(f32, Vec3)> {
        let sheet = || set_bits(sheet).map(|bit| &self.near[bit as usize]);
        let total: f32 = sheet().map(|near| near.weight).sum();
        let mean = sheet().map(|near| near.weight * near.facing).sum::<Vec3>().normalize_or_zero();
        let unlike = sheet().map(|near| near.weight * near.facing.distance_squared(mean)).sum::<f32>() / total;
        // How far what lies between two points may be off, as a share of how far the normal may be off the mean.
        let ridge = UNEVEN + ROUNDING / (unlike + LITTLE);
        // Two of the points, so to speak, it fits anyway.
        let share = 1.0 / (sheet().count() - 2) as f32;
        let (mut matrix, mut vector) = (Mat3::from_diagonal(Vec3::splat(ridge)), Vec3::ZERO);
        for &Near { direction, facing, .. } in sheet() {
            let across = direction - direction.dot(mean) * mean;
            matrix += share * Mat3::from_cols(across.x * across, across.y * across, across.z * across);
            vector -= share * direction.dot(mean + facing) * across;
        }
        let tilt = matrix.inverse() * vector;
        let normal = (mean + tilt).normalize_or(mean);
        let off = share * sheet().map(|near| near.direction.dot(normal + near.facing).powi(2)).sum::<f32>();
        let is_theirs = tilt.length_squared() <= OFF * (unlike + ROUNDING);
        is_theirs.then_some((off + ridge * tilt.length_squared(), normal))
    }

    /// Finds the points next to one, in an order that does not depend on theirs.
    fn look(&mut self, point: &Oriented, all: &[Oriented]) -> Result<(), Error> {
        let Self { order, near } = self;
        order.clear();
        grow(order, all.len(), WHAT)?;
        order.extend((0u32..).zip(all).filter_map(|(number, other)| {
            let square = other.place.distance_squared(point.place);
            let tells = square > 0.0 && square <= REACH && other.facing != Vec3::ZERO;
            tells.then_some(u64::from(square.to_bits()) << 32 | u64::from(number))
        }));
        keep_nearest(order);
        sort_few(order, square_of);
        near.clear();
        grow(near, order.len(), WHAT)?;
        near.extend(order.iter().map(|&one| {
            let (other, square) = (&all[one as u32 as usize], square_of(one));
            let offset = other.place - point.place;
            let (direction, weight) = (offset / (square + SOFT).sqrt(), 1.0 / (square + SOFT));
            Near { square, offset, facing: other.facing, direction, weight }
        }));
        let key = |near: &Near| [near.offset, near.facing].map(|vector| vector.to_array());
        for alike in near.chunk_by_mut(|a, b| a.square == b.square).filter(|alike| alike.len() > 1) {
            alike.sort_unstable_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal));
        }
        near.truncate(NEXT);
        // Copies say no more than one.
        near.dedup_by(|a, b| a.offset == b.offset);
        Ok(())
    }
}

/// How far away one of [`Fits::order`] is, squared.
fn square_of(one: u64) -> f32 {
    f32::from_bits((one >> 32) as u32)
}

/// Keeps the [`NEXT`] nearest, and few more: on a surface points are spread evenly over the squares of their distances.
fn keep_nearest(order: &mut Vec<u64>) {
    const PARTS: usize = 64;
    let part = |one: u64| ((PARTS as f32 / REACH * square_of(one)) as usize).min(PARTS - 1);
    let mut counts = [0; PARTS];
    order.iter().for_each(|&one| counts[part(one)] += 1);
    let (mut count, mut last) = (0, 0);
    while count < NEXT && last < PARTS {
        count += counts[last];
        last += 1;
    }
    order.retain(|&one| part(one) < last);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points spread evenly over a square of this width, with the surface that puts them in their places.
    fn sheet(width: f32, surface: impl Fn(f32, f32) -> Oriented) -> Vec<Oriented> {
        (0..60).map(|i| surface(width * (i * 7 % 60) as f32 / 60.0, width * (i * 11 % 61) as f32 / 61.0)).collect()
    }

    /// The two faces of an edge along y, at a right angle.
    fn edge() -> Vec<Oriented> {
        let mut both = sheet(1.5, |x, y| Oriented { place: Vec3::new(-x, y, 0.0), facing: Vec3::Z });
        both.extend(sheet(1.5, |z, y| Oriented { place: Vec3::new(0.0, y, -z - 0.01), facing: Vec3::X }));
        both
    }

    #[test]
    fn a_point_next_to_an_edge_fits_its_own_face() {
        for facing in [Vec3::X, Vec3::new(1.0, 0.0, 1.0).normalize(), Vec3::Y] {
            let one = Oriented { place: Vec3::new(-0.02, 0.7, 0.0), facing };
            let normal = Fits::default().normal(&one, &edge(), 0.1).unwrap();
            assert!(normal.is_some_and(|normal| normal.distance(Vec3::Z) < 1e-3), "{facing}: {normal:?}");
        }
    }

    #[test]
    fn a_point_on_two_faces_faces_as_both_do() {
        let one = Oriented { place: Vec3::new(0.0, 0.7, 0.0), facing: Vec3::Y };
        let normal = Fits::default().normal(&one, &edge(), 0.1).unwrap().unwrap();
        assert!(normal.x > 0.3 && normal.z > 0.3, "{normal}");
    }

    /// On neither, no normal fits to a hundredth; nor is it asked for one that faces away from its own.
    #[test]
    fn a_point_off_all_sheets_fits_none() {
        let mut fits = Fits::default();
        let off = Oriented { place: Vec3::new(-0.5, 0.7, 0.5), facing: Vec3::X };
        assert_eq!(fits.normal(&off, &edge(), 1e-4), Ok(None));
        let away = Oriented { place: Vec3::new(-0.5, 0.7, 0.0), facing: -Vec3::Z };
        assert_eq!(fits.normal(&away, &edge(), 0.1), Ok(None));
    }

    /// On the rim of a piece of a ball, whose radius is two edges, all others lie to one side: the mean of their normals is
    /// off.
    #[test]
    fn the_normal_bends_as_its_sheet_does() {
        let on_ball = |x: f32, y: f32| {
            let facing = Vec3::new(x, y - 0.6, 2.0).normalize();
            Oriented { place: 2.0 * facing, facing }
        };
        let cap = sheet(1.2, |x, y| on_ball(x + 0.05, y));
        let one = Oriented { facing: Vec3::new(0.5, 0.0, 1.0).normalize(), ..on_ball(0.0, 0.6) };
        let normal = Fits::default().normal(&one, &cap, 0.1).unwrap().unwrap();
        assert!(normal.dot(Vec3::Z) > 0.1f32.to_radians().cos(), "{normal}");
        let mean: Vec3 = cap.iter().filter(|p| p.place.distance(one.place) < 0.5).map(|p| p.facing).sum();
        assert!(mean.normalize().dot(Vec3::Z) < 3f32.to_radians().cos());
    }

    /// Three places tell nothing of a sheet, however many points are there, and points without a normal are none.
    #[test]
    fn copies_and_points_without_a_normal_say_nothing() {
        let at = |x: f32, y: f32, facing| Oriented { place: Vec3::new(x, y, 0.0), facing };
        let places = [(0.3, 0.0), (0.0, 0.3), (-0.2, 0.1), (0.1, -0.2)];
        let of = |count: usize, copies: usize| {
            (0..count * copies).map(move |i| at(places[i % count].0, places[i % count].1, Vec3::Z))
        };
        let normal = |near: Vec<Oriented>| Fits::default().normal(&at(0.0, 0.0, Vec3::X), &near, 0.1);
        assert_eq!(normal(of(3, 5).collect()), Ok(None));
        let without = (1..9).map(|i| at(0.01 * i as f32, 0.0, Vec3::ZERO));
        assert_eq!(normal(of(3, 1).chain(without).collect()), Ok(None));
        assert_eq!(normal(of(4, 5).collect()), Ok(Some(Vec3::Z)));
    }

    /// Where coordinates were rounded the points next to one lie on a step, and their normals slope evenly.
    #[test]
    fn no_normal_is_further_off_a_sheet_than_the_sheet_is_uneven() {
        let slope = |x: f32, y: f32| Vec3::new(0.3 + 0.02 * x, 0.02 * y, 1.0).normalize();
        let step = sheet(1.0, |x, y| Oriented { place: Vec3::new(x - 0.5, y - 0.5, 0.0), facing: slope(x, y) });
        let one = Oriented { place: Vec3::ZERO, facing: Vec3::X };
        assert_eq!(Fits::default().normal(&one, &step, 0.1), Ok(None));
    }

    /// Nor that of some of a lattice, all in pairs of unlike normals in one place.
    #[test]
    fn the_order_of_the_points_does_not_matter() {
        let lattice = (0..162).map(|i| {
            let place = Vec3::new((i / 2 % 9) as f32 - 4.0, (i / 18) as f32 - 4.0, 0.0) / 4.0;
            Oriented { place, facing: if i % 2 == 0 { Vec3::Z } else { Vec3::new(0.6, 0.0, 0.8) } }
        });
        for points in [edge(), lattice.collect()] {
            let one = Oriented { place: Vec3::new(-0.02, 0.7, 0.0), facing: Vec3::X };
            let reversed: Vec<Oriented> = points.iter().rev().map(|p| Oriented { ..*p }).collect();
            let [normal, other] = [&points, &reversed].map(|points| Fits::default().normal(&one, points, 0.1).unwrap());
            assert!(normal.is_some() && normal == other, "{normal:?}, {other:?}");
        }
    }
}
