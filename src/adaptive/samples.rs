//! What surfaces are fitted to: points, or the centroids of several with their covariance.

use super::WHAT;
use super::matrix::Matrix;
use crate::error::Error;
use crate::lanes::{load, transposed};
use crate::parallel::Filling;
use glam::{DVec3, Vec3, Vec4};
use std::ops::Range;

/// One sample.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    /// The centroid of its points, against the centre of its cube, in edges.
    pub place: Vec3,
    pub points: f32,
    /// The covariance of its points.
    pub spread: Matrix,
}

impl Sample {
    pub fn point(place: Vec3) -> Self {
        Self { place, points: 1.0, spread: Matrix::default() }
    }

    /// The same in edges twice as long, at another place.
    pub fn halved(&self, place: Vec3) -> Self {
        Self { place, points: self.points, spread: self.spread.scaled(0.25) }
    }

    /// The sample that stands for others. Adds in double precision: there may be any number of them.
    #[inline(always)]
    pub fn of(others: impl Iterator<Item = Self> + Clone) -> Self {
        let (mut points, mut sum) = (0.0, DVec3::ZERO);
        for other in others.clone() {
            points += f64::from(other.points);
            sum += (other.points * other.place).as_dvec3();
        }
        let place = (sum / points).as_vec3();
        let (mut diagonal, mut off) = (DVec3::ZERO, DVec3::ZERO);
        for other in others {
            let d = other.place - place;
            let spread = Matrix::product(d, d).plus(other.spread).scaled(other.points);
            diagonal += spread.diagonal.as_dvec3();
            off += spread.off.as_dvec3();
        }
        let share = 1.0 / points;
        let spread = Matrix { diagonal: (diagonal * share).as_vec3(), off: (off * share).as_vec3() };
        Self { place, points: points as f32, spread }
    }
}

/// A sample's numbers: x, y, z, points, and the spread's xx, yy, zz, yz, xz, xy.
const NUMBERS: usize = 10;

/// Which of them are the points.
const POINTS: usize = 3;

/// Many samples, number by number, so that four are read at once.
#[derive(Default)]
pub(super) struct Samples {
    numbers: Vec<f32>,
    /// What lies between two numbers of a sample.
    stride: usize,
}

/// Four are read from the last one too.
const BEYOND: usize = 3;

impl Samples {
    /// One of them.
    pub fn get(&self, sample: usize) -> Sample {
        let number = |i: usize| self.numbers[i * self.stride + sample];
        let vector = |i: usize| Vec3::new(number(i), number(i + 1), number(i + 2));
        Sample { place: vector(0), points: number(POINTS), spread: Matrix { diagonal: vector(4), off: vector(7) } }
    }
}

/// [`Samples`] while they are written, in any order.
pub(super) struct Writing {
    numbers: Filling<f32>,
    count: usize,
}

impl Writing {
    pub fn new(count: usize) -> Result<Self, Error> {
        Ok(Self { numbers: Filling::new(NUMBERS * (count + BEYOND), WHAT)?, count })
    }

    /// # Safety
    /// No other call, on any thread, may write the same sample.
    #[inline]
    pub unsafe fn write(&self, number: usize, sample: Sample) {
        let Sample { place: p, points, spread: Matrix { diagonal: d, off: o } } = sample;
        for (i, value) in [p.x, p.y, p.z, points, d.x, d.y, d.z, o.x, o.y, o.z].into_iter().enumerate() {
            // SAFETY: by the caller's promise.
            unsafe { self.numbers.write(i * (self.count + BEYOND) + number, value) };
        }
    }

    /// # Safety
    /// All samples must have been written.
    pub unsafe fn complete(self) -> Samples {
        let nothing = Sample { points: 0.0, ..Sample::point(Vec3::ZERO) };
        // SAFETY: the last are written here, the others by the caller's promise.
        unsafe {
            (self.count..self.count + BEYOND).for_each(|number| self.write(number, nothing));
            Samples { numbers: self.numbers.complete(), stride: self.count + BEYOND }
        }
    }
}

/// The samples of a neighbourhood, against the centre of its cube, each with its weight in the sums.
///
/// Aligned, so that no four lie across two cache lines: it made a surface 20 % slower whenever the compiler placed it so.
#[repr(C, align(16))]
pub(super) struct Window {
    /// As in [`Samples`], and the weights as an eleventh number.
    numbers: [[f32; ROOM]; NUMBERS + 1],
    count: usize,
}

/// Eight octants in each of 27 cubes, and what is written beyond.
const ROOM: usize = 8 * 27 + BEYOND + 1;

/// Which of a window's numbers is the weight.
const WEIGHT: usize = NUMBERS;

/// Four samples: x, y, z and the weight.
pub(super) type Lanes = [Vec4; 4];

impl Window {
    pub fn new() -> Self {
        Self { numbers: [[0.0; ROOM]; NUMBERS + 1], count: 0 }
    }

    /// Begins again with an empty window.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// How many samples there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Adds the samples of a cube `step` away, each of them counted `share` times.
    #[inline(never)]
    pub fn add(&mut self, samples: &Samples, range: Range<usize>, step: Vec3, share: f32) {
        let shifts = [step.x, step.y, step.z];
        // Four at a time; what is written too much is overwritten by the next.
        for i in (0..range.len()).step_by(4) {
            let (from, to) = (range.start + i, self.count + i);
            for number in 0..NUMBERS {
                let four = load(&samples.numbers[number * samples.stride + from..]);
                let shift = shifts.get(number).copied().unwrap_or(0.0);
                (four + shift).write_to_slice(&mut self.numbers[number][to..]);
            }
            let points = load(&samples.numbers[POINTS * samples.stride + from..]);
            (points * share).write_to_slice(&mut self.numbers[WEIGHT][to..]);
        }
        self.count += range.len();
        // The lanes beyond the last sample weigh nothing.
        for number in [POINTS, WEIGHT] {
            self.numbers[number][self.count..self.count + BEYOND].fill(0.0);
        }
    }

    /// Four samples' number.
    #[inline(always)]
    fn four(&self, number: usize, sample: usize) -> Vec4 {
        load(&self.numbers[number][sample..])
    }

    #[inline(always)]
    fn lanes(&self, sample: usize) -> Lanes {
        [self.four(0, sample), self.four(1, sample), self.four(2, sample), self.four(WEIGHT, sample)]
    }

    /// Sums up `terms(x, y, z, weight)` over all samples.
    #[inline(always)]
    pub fn sum<const N: usize>(&self, terms: impl Fn(Lanes) -> [Vec4; N]) -> [f64; N] {
        self.sum_lanes(|i| terms(self.lanes(i)))
    }

    /// How many points there are, and the sums over these, each with its sample's weight, of 1, x, y, z, xx, yy, zz, yz,
    /// xz and xy.
    pub fn moments(&self) -> [f64; 11] {
        self.sum_lanes(|i| {
            let [x, y, z, w] = self.lanes(i);
            let (wx, wy, wz) = (w * x, w * y, w * z);
            let [xx, yy, zz, yz, xz, xy] = [4, 5, 6, 7, 8, 9].map(|number| w * self.four(number, i));
            let squares = [wx * x + xx, wy * y + yy, wz * z + zz, wy * z + yz, wx * z + xz, wx * y + xy];
            let [xx, yy, zz, yz, xz, xy] = squares;
            [self.four(POINTS, i), w, wx, wy, wz, xx, yy, zz, yz, xz, xy]
        })
    }

    /// Sums up `terms(x, y, z, weight; points; spread)` over all samples, the spread in the order xx, yy, zz, yz, xz, xy.
    #[inline(always)]
    pub fn sum_with_spread<const N: usize>(&self, terms: impl Fn(Lanes, Vec4, [Vec4; 6]) -> [Vec4; N]) -> [f64; N] {
        self.sum_lanes(|i| {
            terms(self.lanes(i), self.four(POINTS, i), [4, 5, 6, 7, 8, 9].map(|number| self.four(number, i)))
        })
    }

    #[inline(always)]
    fn sum_lanes<const N: usize>(&self, terms: impl Fn(usize) -> [Vec4; N]) -> [f64; N] {
        let mut sums = [Vec4::ZERO; N];
        for i in (0..self.count).step_by(4) {
            let terms = terms(i);
            // In sevens: a longer loop stays a loop, with all terms in memory, and takes a sixth more time for a surface.
            let (sums, last_sums) = sums.as_chunks_mut::<7>();
            let (terms, last_terms) = terms.as_chunks::<7>();
            for (sums, terms) in sums.iter_mut().zip(terms) {
                (0..7).for_each(|i| sums[i] += terms[i]);
            }
            last_sums.iter_mut().zip(last_terms).for_each(|(sum, term)| *sum += *term);
        }
        let mut totals = [0.0; N];
        for (totals, sums) in totals.chunks_mut(4).zip(sums.chunks(4)) {
            let [a, b, c, d] = transposed(std::array::from_fn(|i| sums.get(i).copied().unwrap_or(Vec4::ZERO)));
            let four = (a + b) + (c + d);
            totals.iter_mut().zip(four.to_array()).for_each(|(total, sum)| *total = f64::from(sum));
        }
        totals
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Single precision counts by ones to 2^24 only.
    #[test]
    fn a_sample_may_stand_for_any_number_of_points() {
        let corners = [Vec3::new(0.4, 0.3, 0.1), Vec3::new(0.1, 0.3, 0.2), Vec3::new(0.3, 0.2, 0.4)];
        let sample = |count: usize| Sample::of(corners.into_iter().cycle().take(count).map(Sample::point));
        let (few, many) = (sample(3), sample(18_000_000));
        assert_eq!(many.points, 18e6);
        assert!(few.place.distance(many.place) < 1e-6, "{} {}", few.place, many.place);
        let (a, b) = (few.spread, many.spread);
        assert!(a.diagonal.distance(b.diagonal).max(a.off.distance(b.off)) < 1e-6, "{a:?} {b:?}");
    }
}
