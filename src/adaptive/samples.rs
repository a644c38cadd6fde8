//! What surfaces are fitted to: points, or the centroids of several with their covariance.

use super::matrix::Matrix;
use crate::lanes::{load, transposed};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3, Vec4};

/// One sample.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
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

/// The samples of a neighbourhood, against the centre of its cube, each with its weight in the sums.
///
/// Aligned, so that no four lie across two cache lines: it made a surface 20 % slower whenever the compiler placed it so.
#[repr(C, align(16))]
pub(super) struct Window {
    /// Number by number, so that four samples are read at once, and the weights as an eleventh number.
    numbers: [[f32; ROOM]; NUMBERS + 1],
    count: usize,
}

/// Eight octants in each of 27 cubes, in fours.
const ROOM: usize = 8 * 27;

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
    pub fn add(&mut self, samples: &[Sample], step: Vec3, share: f32) {
        assert!(self.count + samples.len() <= ROOM);
        for (at, sample) in (self.count..).zip(samples) {
            let Sample { place: p, points, spread: Matrix { diagonal: d, off: o } } = *sample;
            let weight = share * points;
            let numbers = [p.x + step.x, p.y + step.y, p.z + step.z, points, d.x, d.y, d.z, o.x, o.y, o.z, weight];
            (0..NUMBERS + 1).for_each(|i| self.numbers[i][at] = numbers[i]);
        }
        self.count += samples.len();
    }

    /// Leaves those no farther from a place than so much, squared.
    #[inline(always)]
    pub fn keep_near(&mut self, place: Vec3, square: f32) {
        let mut count = 0;
        for i in 0..self.count {
            let [x, y, z] = [0, 1, 2].map(|axis| self.numbers[axis][i]);
            if Vec3::new(x, y, z).distance_squared(place) <= square {
                self.numbers.iter_mut().for_each(|numbers| numbers[count] = numbers[i]);
                count += 1;
            }
        }
        self.count = count;
    }

    /// Lets what the lanes beyond the last sample hold weigh nothing.
    fn pad(&mut self) {
        for number in [POINTS, WEIGHT] {
            self.numbers[number][self.count..self.count.next_multiple_of(4)].fill(0.0);
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

    /// The sums over all points, each with its sample's weight, of 1, x, y, z, xx, yy, zz, yz, xz and xy; and how many points
    /// there are. Must come before the other sums, which rely on its padding.
    pub fn moments(&mut self) -> [f64; 11] {
        self.pad();
        self.sum_lanes(|i| {
            let [x, y, z, w] = self.lanes(i);
            let (wx, wy, wz) = (w * x, w * y, w * z);
            let [xx, yy, zz, yz, xz, xy] = [4, 5, 6, 7, 8, 9].map(|number| w * self.four(number, i));
            let squares = [wx * x + xx, wy * y + yy, wz * z + zz, wy * z + yz, wx * z + xz, wx * y + xy];
            let [xx, yy, zz, yz, xz, xy] = squares;
            [w, wx, wy, wz, xx, yy, zz, yz, xz, xy, self.four(POINTS, i)]
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
