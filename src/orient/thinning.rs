//! How the points of a scan thin out with their distance from the scanner, and where they are slanted.

use glam::DVec3;

/// The function `near * nearness + slant * slantedness` that fits the logarithms of densities best, by weighted least squares.
pub(super) struct Thinning {
    /// Densities it was fitted to, by their weights.
    pub count: f64,
    pub near: f64,
    /// The standard error of that, if all weights are 1.
    pub error: f64,
    pub slant: f64,
    /// The standard deviation of nearness, besides what goes with slantedness.
    pub depth: f64,
    /// The share of the variance of the logarithms that it explains.
    pub explained: f64,
}

impl Thinning {
    /// That of samples, each with its weight, and the logarithm of its density, its nearness and its slantedness.
    pub fn of<I: Iterator<Item = (f64, DVec3)>>(samples: impl Fn() -> I) -> Self {
        let (mut count, mut sum) = (0.0, DVec3::ZERO);
        for (weight, one) in samples() {
            count += weight;
            sum += weight * one;
        }
        let mean = sum / count;
        let [mut by_points, mut by_nearness, mut by_slant] = [DVec3::ZERO; 3];
        for (weight, one) in samples() {
            let off = one - mean;
            by_points += weight * off.x * off;
            by_nearness += weight * off.y * off;
            by_slant += weight * off.z * off;
        }
        // Where all is slanted alike, that explains nothing.
        by_slant.z += 1e-6 * count;
        let determinant = by_nearness.y * by_slant.z - by_nearness.z * by_nearness.z;
        let near = (by_points.y * by_slant.z - by_points.z * by_nearness.z) / determinant;
        let slant = (by_points.z * by_nearness.y - by_points.y * by_nearness.z) / determinant;
        let explained = near * by_points.y + slant * by_points.z;
        let rest = (by_points.x - explained) / count;
        Self {
            count,
            near,
            error: (rest * by_slant.z / determinant).sqrt(),
            slant,
            depth: (determinant / (by_slant.z * count)).sqrt(),
            explained: explained / by_points.x,
        }
    }
}
