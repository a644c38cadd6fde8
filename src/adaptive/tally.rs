//! What was decided for how many points.

use super::choose::Chosen;
use super::{DIVISIONS, SIZES};
use crate::power::exp2;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Points, counted. Whole numbers: in whatever order threads add them, the sums are the same.
pub(super) struct Tally {
    /// By the size of the cubes they rest on, from the smallest there can be.
    sizes: [AtomicU64; SIZES],
    /// By the noise there, in steps of [`STEP`].
    noises: [AtomicU64; STEPS],
}

/// A step of variance is a sixteenth of the way to its double: so many of the bits of a number tell it.
const STEP: u32 = 23 - 4;

/// The bits of the least variance that is told from none, in edges of the base: (10^-6)^2.
const LEAST: u32 = 87 << 23;

/// Up to 2^40 times the edge, squared.
const STEPS: usize = 16 * (40 + 80);

impl Tally {
    pub fn new() -> Self {
        Self { sizes: [const { AtomicU64::new(0) }; SIZES], noises: [const { AtomicU64::new(0) }; STEPS] }
    }

    /// Counts the points of a cube whose edge is half that of the base, or a quarter and so on.
    pub fn add(&self, division: usize, chosen: &Chosen, points: u64) {
        self.sizes[DIVISIONS - division + chosen.doublings as usize].fetch_add(points, Relaxed);
        let noise = chosen.noise / (1u64 << (2 * division)) as f32;
        let step = noise.to_bits().saturating_sub(LEAST) >> STEP;
        self.noises[(step as usize).min(STEPS - 1)].fetch_add(points, Relaxed);
    }

    /// The deviation that half of the points do not exceed, in edges of the base, to 2 %; 0 without points.
    pub fn noise(&self) -> f64 {
        let counts = || self.noises.iter().map(|count| count.load(Relaxed));
        let half = counts().sum::<u64>().div_ceil(2);
        let mut sum = 0;
        let middle = counts().position(|count| {
            sum += count;
            sum >= half
        });
        match middle.unwrap_or(0) as u32 {
            0 => 0.0,
            step => f64::from(f32::from_bits(LEAST + (step << STEP) + (1 << (STEP - 1)))).sqrt(),
        }
    }

    /// Edges of the chosen cubes in edges of the base, and how many points took each. The smallest first.
    pub fn scales(&self) -> Vec<(f64, u64)> {
        let edges = (0i32..).map(|i| exp2(f64::from(i - DIVISIONS as i32)));
        edges
            .zip(&self.sizes)
            .map(|(edge, count)| (edge, count.load(Relaxed)))
            .filter(|&(_, points)| points > 0)
            .collect()
    }
}
