//! Whether coordinates were rounded so coarsely that steps decide how points lie.
//!
//! Points of voxels, of centimetres where they are as dense as that, and of strongly compressed clouds lie on planes without noise
//! that are no surfaces, and in rows. Where they lie tells nothing exactly.

use crate::cell::Density;
use crate::order::{from_ordinal, ordinal, sort};
use crate::points::{Points, SAMPLE, spread};
use glam::Vec3;

/// Steps are coarse that are as wide as this share of the spacing of the points: with half of it planes of steps pass for faces.
const COARSE: f64 = 1.0 / 3.0;

/// The step that coordinates were rounded to, in units of the positions: no two of some points differ by less along any axis, but
/// for those that do not differ at all. Takes a quarter of a millisecond.
#[inline(never)]
pub(crate) fn step(points: &Points) -> f64 {
    let some = || spread(points.len(), SAMPLE).map(|point| points.positions[point]).filter(|place| place.is_finite());
    (0..3).map(|axis| least_difference(some().map(|place: Vec3| place[axis]))).fold(f64::INFINITY, f64::min)
}

/// Whether steps are coarse for points so dense.
pub(crate) fn is_coarse(step: f64, density: &Density) -> bool {
    step >= COARSE * density.spacing()
}

fn least_difference(numbers: impl Iterator<Item = f32>) -> f64 {
    let mut sorted: Vec<i64> = numbers.map(|number| ordinal(number.into())).collect();
    sort(&mut sorted);
    let differences = sorted.windows(2).map(|two| from_ordinal(two[1]) - from_ordinal(two[0]));
    differences.filter(|&difference| difference > 0.0).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::Bounds;

    /// Of points with a spacing of about 1, each moved.
    fn is_coarse_of(points: u32, moved: impl Fn(u32, Vec3) -> Vec3) -> bool {
        let mut state = 1u32;
        let mut coordinate = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(points).sqrt() as f32 * (state >> 8) as f32 / 16_777_216.0
        };
        let coordinates: Vec<f32> = (0..points)
            .flat_map(|i| {
                let [x, y] = [coordinate(), coordinate()];
                moved(i, Vec3::new(x, y, 0.3 * x + 0.2 * y)).to_array()
            })
            .collect();
        let points = Points::from_f32(&coordinates).unwrap();
        is_coarse(step(&points), &Density::of(&points, &Bounds::of(&points)).unwrap())
    }

    #[test]
    fn coarse_are_steps_that_are_hardly_narrower_than_the_spacing() {
        let rounded = |step: f32| move |_, place: Vec3| (place / step).round() * step;
        for points in [1000, 100_000] {
            for (size, coarse) in [
                (0.0, false),
                (0.02, false),
                (0.1, false),
                (0.25, false),
                (0.5, true),
                (1.0, true),
                (2.0, true),
                (5.0, true),
            ] {
                let rounded = |_, place: Vec3| if size > 0.0 { (place / size).round() * size } else { place };
                assert_eq!(is_coarse_of(points, rounded), coarse, "{points} points, steps of {size}");
            }
        }
    }

    #[test]
    fn neither_gaps_nor_the_pixels_of_an_image_are_steps() {
        assert!(!is_coarse_of(30_000, |i, place| Vec3::new((i % 100) as f32, (i / 100) as f32, place.z)));
        assert!(!is_coarse_of(30_000, |_, place| place.round() + 0.01 * place));
        assert!(is_coarse_of(30_000, |i, place| if i % 100 == 0 { Vec3::NAN } else { place.round() }));
    }
}
