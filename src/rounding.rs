//! What coordinates lost when they were rounded, against how densely points lie.
//!
//! Points of voxels, of centimetres where they are as dense as that, and of strongly compressed clouds lie on steps: planes without
//! noise that are no surfaces. How exactly points lie on these tells nothing.

/// Steps are coarse that are as wide as this share of the edge of a cube with 32 points: of a surface with such a spacing between
/// them that eight are an edge, a third of that. Planes of wider steps pass for faces.
const COARSE: f64 = 1.0 / 24.0;

/// And fine if they are narrower than this, a sixth of the spacing: surfaces are not known any better than such coordinates.
const FINE: f64 = 1.0 / 48.0;

/// How coordinates were rounded.
#[derive(Clone, Copy)]
pub(crate) struct Rounding {
    /// The variance that a coordinate has from that, in edges and squared; 0 if it is next to nothing.
    pub variance: f32,
    /// Whether steps are wider than about a third of the spacing of the points.
    pub is_coarse: bool,
}

impl Rounding {
    /// To steps, of points that are so dense that cubes of [`crate::cell::POINTS_PER_CELL`] have this edge. In clouds of fewer than
    /// 1600 points, the cubes of which hold fewer, narrower steps count.
    #[inline(always)]
    pub fn of(step: f64, edge: f64) -> Self {
        let share = step / edge;
        let variance = if share > FINE { share * share / 12.0 } else { 0.0 };
        Self { variance: variance as f32, is_coarse: share >= COARSE }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Density, POINTS_PER_CELL};
    use crate::points::{Bounds, Points};
    use glam::Vec3;

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
        let density = Density::of(&points, &Bounds::of(&points)).unwrap();
        Rounding::of(density.step, density.edge(POINTS_PER_CELL)).is_coarse
    }

    #[test]
    fn coarse_are_steps_of_a_third_of_the_spacing() {
        let is_coarse_to = |points: u32, step: f32| is_coarse_of(points, |_, place| (place / step).round() * step);
        for points in [1000, 100_000] {
            assert!([0.5, 1.0, 2.0, 5.0].into_iter().all(|step| is_coarse_to(points, step)), "{points}");
            assert!(![0.02, 0.1, 0.25].into_iter().any(|step| is_coarse_to(points, step)), "{points}");
            assert!(!is_coarse_of(points, |_, place| place), "{points}");
        }
    }

    #[test]
    fn neither_gaps_nor_the_pixels_of_an_image_are_steps() {
        assert!(!is_coarse_of(30_000, |i, place| Vec3::new((i % 100) as f32, (i / 100) as f32, place.z)));
        assert!(!is_coarse_of(30_000, |_, place| place.round() + 0.01 * place));
        assert!(is_coarse_of(30_000, |i, place| if i % 100 == 0 { Vec3::NAN } else { place.round() }));
    }

    #[test]
    fn the_variance_of_a_step_is_a_twelfth_of_its_square() {
        assert!((Rounding::of(0.3, 2.0).variance - 0.15 * 0.15 / 12.0).abs() < 1e-8);
        let mut state = 0.0f64;
        let rounded = (0..10_000).map(|_| {
            state = (state + 0.618_033_988_75).fract();
            (state / 0.15).round() * 0.15 - state
        });
        let variance = rounded.map(|off| off * off).sum::<f64>() / 10_000.0;
        assert!((variance / f64::from(Rounding::of(0.15, 1.0).variance) - 1.0).abs() < 0.05, "{variance}");
        assert_eq!(Rounding::of(0.02, 1.0).variance, 0.0);
    }
}
