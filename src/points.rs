//! Positions relative to a double-precision origin.

use crate::error::Error;
use crate::lanes::load;
use crate::lists::{fitted, reserve};
use crate::message::message;
use crate::order::{from_ordinal, ordinal, sort, sort_unique};
use crate::parallel;
use crate::power::{exp2, log2};
use bytemuck::cast_slice;
use glam::{DVec3, Vec3, Vec4, Vec4Swizzles};
use std::borrow::Cow;
use std::sync::{Mutex, PoisonError};

/// How many points a robust look at a cloud samples.
pub(crate) const SAMPLE: usize = 4096;

/// How many points a task takes: enough to be worth a task, few enough to stay in a cache.
pub(crate) const CHUNK: usize = 1 << 13;

/// A cloud as the estimator takes it: single-precision positions relative to a double-precision origin.
///
/// The coordinates of point `i` are `origin + unit * positions[i]`.
#[derive(Clone, Debug)]
pub struct Points<'a> {
    pub(crate) positions: Cow<'a, [Vec3]>,
    pub(crate) origin: DVec3,
    pub(crate) unit: f64,
}

impl<'a> Points<'a> {
    /// Borrows `x0 y0 z0 x1 ...`; nothing is copied. Costs nothing.
    ///
    /// # Errors
    /// [`Error::Input`] if the length is no multiple of 3.
    pub fn from_f32(coordinates: &'a [f32]) -> Result<Self, Error> {
        check_length(coordinates.len())?;
        Ok(Self { positions: Cow::Borrowed(cast_slice(coordinates)), origin: DVec3::ZERO, unit: 1.0 })
    }

    /// Takes over `x0 y0 z0 x1 ...`, and gives back what room there is for more. Costs nothing without that.
    ///
    /// # Errors
    /// [`Error::Input`] if the length is no multiple of 3.
    pub fn from_vec(coordinates: Vec<f32>) -> Result<Points<'static>, Error> {
        check_length(coordinates.len())?;
        let positions = bytemuck::cast_slice_box(coordinates.into_boxed_slice()).into_vec();
        Ok(Points { positions: Cow::Owned(positions), origin: DVec3::ZERO, unit: 1.0 })
    }

    /// Subtracts an origin near the bulk of the points, then rounds: 12 bytes a point of memory, one pass.
    ///
    /// # Errors
    /// [`Error::Input`] if the length is no multiple of 3, [`Error::Limit`] for too little memory.
    pub fn from_f64(coordinates: &[f64]) -> Result<Points<'static>, Error> {
        check_length(coordinates.len())?;
        let points: &[DVec3] = cast_slice(coordinates);
        let Bulk { median, extent, .. } = Bulk::of(points.len(), &|i| points[i]);
        // A power of two, so that scaling loses nothing.
        let unit = if extent > 1e30 || (extent > 0.0 && extent < 1e-30) { exp2(log2(extent).round()) } else { 1.0 };
        let mut positions = Vec::new();
        reserve(&mut positions, points.len(), "the cloud")?;
        positions.extend(points.iter().map(|p| ((*p - median) / unit).as_vec3()));
        Ok(Points { positions: Cow::Owned(positions), origin: median, unit })
    }

    /// What the positions are relative to, in the coordinates of the input.
    pub fn origin(&self) -> [f64; 3] {
        self.origin.to_array()
    }

    /// The same points, borrowed from these.
    pub(crate) fn borrowed(&self) -> Points<'_> {
        Points { positions: Cow::Borrowed(&self.positions), ..*self }
    }

    /// The same points in memory of their own: those that are borrowed are copied.
    pub(crate) fn owned(self) -> Result<Points<'static>, Error> {
        let positions = match self.positions {
            Cow::Owned(positions) => positions,
            Cow::Borrowed(positions) => fitted(positions, "the cloud")?,
        };
        Ok(Points { positions: Cow::Owned(positions), ..self })
    }

    /// The positions, to be changed. They should be owned: for a copy that does not fit this has no error.
    pub(crate) fn positions_mut(&mut self) -> &mut [Vec3] {
        self.positions.to_mut()
    }

    /// The number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// How many chunks of [`CHUNK`] points there are: the tasks of passes over the input.
    pub(crate) fn chunks(&self) -> usize {
        self.len().div_ceil(CHUNK)
    }

    /// The points of one chunk.
    pub(crate) fn chunk(&self, number: usize) -> &[Vec3] {
        &self.positions[parallel::piece(self.len(), CHUNK, number)]
    }

    /// Whether there are no points at all.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }
}

#[inline(never)]
fn check_length(length: usize) -> Result<(), Error> {
    if length.is_multiple_of(3) {
        return Ok(());
    }
    Err(Error::Input(message!["positions has ", length, " numbers; wanted a multiple of 3 (x y z of each point)"]))
}

/// Numbers below `count`, one from each of at most `most` strides of one length.
pub(crate) fn spread(count: usize, most: usize) -> impl Iterator<Item = usize> {
    let step = count.div_ceil(most).max(1);
    (0..count.div_ceil(step)).map(move |stride| spread_in(stride, step, count))
}

/// That of one stride of `step` numbers. A different place in each, so that the rows of a scan do not fall in step with them.
pub(crate) fn spread_in(stride: usize, step: usize, count: usize) -> usize {
    (stride * step + (stride as u32).wrapping_mul(0x9E37_79B9) as usize % step).min(count - 1)
}

/// The box round all finite points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
    /// How many points are finite in all three coordinates.
    pub finite: usize,
}

impl Bounds {
    const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY, finite: 0 };

    /// One pass over the points.
    pub fn of(points: &Points) -> Self {
        Self::of_chunks(points.len(), &|i| points.chunk(i))
    }

    /// Of `count` points, in chunks of [`CHUNK`].
    pub fn of_chunks<'a>(count: usize, chunk: &(dyn Fn(usize) -> &'a [Vec3] + Sync)) -> Self {
        // Neither minima nor counts depend on the order in which the chunks come.
        let bounds = Mutex::new(Self::EMPTY);
        parallel::each(count.div_ceil(CHUNK), &|i| {
            let chunk = Self::of_chunk(chunk(i));
            let mut bounds = bounds.lock().unwrap_or_else(PoisonError::into_inner);
            *bounds = bounds.join(chunk);
        });
        bounds.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// The sides of the box; zero when no point is finite.
    pub fn extent(&self) -> DVec3 {
        if self.finite == 0 { DVec3::ZERO } else { self.max.as_dvec3() - self.min.as_dvec3() }
    }

    fn join(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max), finite: self.finite + other.finite }
    }

    #[inline(never)]
    fn of_chunk(chunk: &[Vec3]) -> Self {
        let (mut min, mut max, mut spoilt) = (Vec4::INFINITY, Vec4::NEG_INFINITY, Vec4::ZERO);
        // With the first number of the next point, which is looked at and not used: four lanes are compared at once.
        for point in bytemuck::cast_slice(chunk).windows(4).step_by(3).map(load) {
            min = min.min(point);
            max = max.max(point);
            // Not a number as soon as one is infinite or not a number.
            spoilt += point * 0.0;
        }
        if spoilt.is_nan() {
            return Self::of_points(chunk);
        }
        let last = chunk.len().saturating_sub(1);
        Self { min: min.xyz(), max: max.xyz(), finite: last }.join(Self::of_points(&chunk[last..]))
    }

    fn of_points(points: &[Vec3]) -> Self {
        points
            .iter()
            .filter(|p| p.is_finite())
            .fold(Self::EMPTY, |bounds, &point| bounds.join(Self { min: point, max: point, finite: 1 }))
    }
}

/// Where most of a cloud lies, from a sample; a few stray points do not move it.
pub(crate) struct Bulk {
    /// The median of each axis.
    pub median: DVec3,
    /// The longest side of the box that holds the middle 90 % of each axis.
    pub extent: f64,
    /// The same of the middle half.
    pub core: f64,
    /// No two of these points differ by less along an axis, but those that do not at all: of coordinates that were rounded their
    /// step.
    pub step: f64,
    /// The finite points looked at.
    pub sample: Vec<DVec3>,
    /// Their places, each once, sorted.
    pub distinct: Vec<DVec3>,
}

impl Bulk {
    /// Looks at a cloud.
    pub fn of_points(points: &Points) -> Self {
        Self::of(points.len(), &|i| points.positions[i].as_dvec3())
    }

    /// Looks at `at(0) .. at(count - 1)`, at most a few thousand of them. What is not finite is passed over, and
    /// `0 0 0`, which scanners write for what gave no echo.
    #[optimize(size)]
    pub fn of(count: usize, at: &dyn Fn(usize) -> DVec3) -> Self {
        let sample: Vec<DVec3> = spread(count, SAMPLE).map(at).filter(|p| p.is_finite() && *p != DVec3::ZERO).collect();
        // Relative to an origin such marks lie elsewhere, but all in one place, which counts once.
        let mut places: Vec<[i64; 3]> = sample.iter().map(|p| p.to_array().map(ordinal)).collect();
        sort_unique(&mut places);
        let distinct = places.iter().map(|place| DVec3::from_array(place.map(from_ordinal))).collect();
        let mut bulk = Self { median: DVec3::ZERO, extent: 0.0, core: 0.0, step: f64::INFINITY, sample, distinct };
        if places.is_empty() {
            return bulk;
        }
        for axis in 0..3 {
            let mut values: Vec<i64> = places.iter().map(|place| place[axis]).collect();
            sort(&mut values);
            let middle = |low: f64, high: f64| quantile(&values, high) - quantile(&values, low);
            bulk.median[axis] = quantile(&values, 0.5);
            bulk.extent = bulk.extent.max(middle(0.05, 0.95));
            bulk.core = bulk.core.max(middle(0.25, 0.75));
            for two in values.windows(2) {
                let difference = from_ordinal(two[1]) - from_ordinal(two[0]);
                if difference > 0.0 && difference < bulk.step {
                    bulk.step = difference;
                }
            }
        }
        bulk
    }
}

/// What a share of sorted numbers, as [`ordinal`]s, does not exceed.
#[inline(never)]
fn quantile(sorted: &[i64], share: f64) -> f64 {
    from_ordinal(sorted[((sorted.len() - 1) as f64 * share + 0.5) as usize])
}

/// The origin to subtract from double coordinates before they are rounded to single precision: zero where single
/// precision tells points apart as well as they need, else whole numbers near the bulk of the points.
pub(crate) fn choose_origin(count: usize, at: &dyn Fn(usize) -> DVec3) -> DVec3 {
    let Bulk { median, core, .. } = Bulk::of(count, at);
    // Single precision has 24 bits: beyond four extents, of which the core is about half, fewer than 22 are left for the extent
    // itself. The core, because up to a quarter of the points may be marks for what is missing.
    if median.abs().max_element() <= 8.0 * core { DVec3::ZERO } else { median.round() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A survey of which many points are marks for what gave no echo.
    #[test]
    fn the_origin_is_that_of_what_was_measured() {
        let place = DVec3::new(431_000.0, 5_412_000.0, 120.0);
        for (mark, of_ten) in [(DVec3::ZERO, 8), (DVec3::ZERO, 3), (DVec3::splat(-9999.0), 2)] {
            let at = |i: usize| if i % 10 < of_ten { mark } else { place + (i as f64 * 0.37) % 20.0 };
            let origin = choose_origin(20_000, &at);
            assert!(origin.distance(place) < 40.0, "{origin} with {of_ten} of ten at {mark}");
        }
        // What lies near zero keeps its coordinates.
        assert_eq!(choose_origin(1000, &|i| DVec3::splat(i as f64 * 0.01)), DVec3::ZERO);
        assert_eq!(choose_origin(1000, &|_| DVec3::ZERO), DVec3::ZERO);
    }
}
