//! Which sheet a point lies on, of those that the points next to it are of, and the normal of that sheet there.
//!
//! On one sheet, if it bends evenly, what lies between two points is across the mean of their normals ([`super::sheets`]). So a
//! normal fits that comes near to this with each of the points next to it on one sheet: by least squares, and not far from
//! theirs.

use super::patches::aligned;
use crate::error::Error;
use crate::lists::grow;
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
const FEW: usize = 4;

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
#[derive(Clone, Copy, Default)]
struct Near {
    /// How far away, in edges and squared.
    square: f32,
    offset: Vec3,
    facing: Vec3,
}

impl Near {
    /// What lies between the two, about as long as 1, however far away it is.
    fn direction(&self) -> Vec3 {
        self.offset / (self.square + SOFT).sqrt()
    }

    fn weight(&self) -> f32 {
        1.0 / (self.square + SOFT)
    }
}

/// The points next to one.
#[derive(Default)]
pub(super) struct Fits {
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
        for alike in ALIKE_ENOUGH {
            let mut left = (1 << self.near.len()) - 1;
            for _ in 0..SHEETS {
                let (sheet, count) = self.next_sheet(&mut left, alike);
                if count < FEW {
                    continue;
                }
                let Some((off, normal)) = fit(&sheet[..count]) else { continue };
                if normal.dot(point.facing) > -ALIKE {
                    least = least.min(off);
                    sum += (ROUNDING / (off + LITTLE)).powi(2) * normal;
                }
            }
        }
        Ok(sum.try_normalize().filter(|_| least < limit))
    }

    /// The nearest of the points that are left, one bit for each, and the next whose normals are like its own; in so many of the
    /// places. Of all that are alike none is left.
    fn next_sheet(&self, left: &mut u64, alike: f32) -> ([Near; OF_ONE], usize) {
        let Some(&first) = self.near.get(left.trailing_zeros() as usize) else { return (Default::default(), 0) };
        let (mut sheet, mut count) = ([first; OF_ONE], 0);
        for (i, near) in self.near.iter().enumerate() {
            if *left >> i & 1 == 1 && near.facing.dot(first.facing) >= alike {
                *left &= !(1 << i);
                if let Some(place) = sheet.get_mut(count) {
                    *place = *near;
                    count += 1;
                }
            }
        }
        (sheet, count)
    }

    /// Finds the points next to one, in an order that does not depend on theirs.
    fn look(&mut self, point: &Oriented, all: &[Oriented]) -> Result<(), Error> {
        self.near.clear();
        grow(&mut self.near, all.len(), WHAT)?;
        self.near.extend(all.iter().filter_map(|other| {
            let offset = other.place - point.place;
            let square = offset.length_squared();
            let tells = square > 0.0 && square <= REACH && other.facing != Vec3::ZERO;
            tells.then_some(Near { square, offset, facing: other.facing })
        }));
        let key = |near: &Near| [near.offset, near.facing].map(|vector| vector.to_array());
        let tie = |a: &Near, b: &Near| key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal);
        let order = |a: &Near, b: &Near| a.square.total_cmp(&b.square).then_with(|| tie(a, b));
        if self.near.len() > NEXT {
            self.near.select_nth_unstable_by(NEXT, order);
            self.near.truncate(NEXT);
        }
        self.near.sort_unstable_by(order);
        // Copies say no more than one.
        self.near.dedup_by(|a, b| a.offset == b.offset);
        Ok(())
    }
}

/// The normal that fits some points of one sheet best, and how far these lie off it and that is off theirs: by least squares,
/// with the mean of their normals as a guess, which is as good as these are alike.
fn fit(sheet: &[Near]) -> Option<(f32, Vec3)> {
    let total: f32 = sheet.iter().map(Near::weight).sum();
    let mean = sheet.iter().map(|near| near.weight() * near.facing).sum::<Vec3>().normalize_or_zero();
    let unlike = sheet.iter().map(|near| near.weight() * near.facing.distance_squared(mean)).sum::<f32>() / total;
    // How far what lies between two points may be off, as a share of how far the normal may be off the mean.
    let ridge = UNEVEN + ROUNDING / (unlike + LITTLE);
    // Two of the points, so to speak, it fits anyway.
    let share = 1.0 / (sheet.len() - 2) as f32;
    let (mut matrix, mut vector) = (Mat3::from_diagonal(Vec3::splat(ridge)), Vec3::ZERO);
    for near in sheet {
        let direction = near.direction();
        let across = direction - direction.dot(mean) * mean;
        matrix += share * Mat3::from_cols(across.x * across, across.y * across, across.z * across);
        vector -= share * direction.dot(mean + near.facing) * across;
    }
    let tilt = matrix.inverse() * vector;
    let normal = (mean + tilt).normalize_or(mean);
    let off = share * sheet.iter().map(|near| near.direction().dot(normal + near.facing).powi(2)).sum::<f32>();
    let is_theirs = tilt.length_squared() <= OFF * (unlike + ROUNDING);
    is_theirs.then_some((off + ridge * tilt.length_squared(), normal))
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
