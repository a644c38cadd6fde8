//! Positions relative to a double-precision origin.

use crate::error::Error;
use bytemuck::cast_slice;
use glam::{DVec3, Vec3};
use std::borrow::Cow;

/// How many points a robust look at a cloud samples.
const SAMPLE: usize = 4096;

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
    pub fn from_f32(coordinates: &'a [f32]) -> Result<Self, Error> {
        check_length(coordinates.len())?;
        Ok(Self { positions: Cow::Borrowed(cast_slice(coordinates)), origin: DVec3::ZERO, unit: 1.0 })
    }

    /// Subtracts an origin near the bulk of the points, then rounds: 12 bytes a point of memory, one pass.
    pub fn from_f64(coordinates: &[f64]) -> Result<Points<'static>, Error> {
        check_length(coordinates.len())?;
        let points: &[DVec3] = cast_slice(coordinates);
        let Bulk { median, extent } = Bulk::of(points.len(), &|i| points[i]);
        // A power of two, so that scaling loses nothing.
        let unit = if extent > 1e30 || (extent > 0.0 && extent < 1e-30) { extent.log2().round().exp2() } else { 1.0 };
        let mut positions = Vec::new();
        reserve(&mut positions, points.len(), "the cloud")?;
        positions.extend(points.iter().map(|p| ((*p - median) / unit).as_vec3()));
        Ok(Points { positions: Cow::Owned(positions), origin: median, unit })
    }

    /// The number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are no points at all.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }
}

fn check_length(length: usize) -> Result<(), Error> {
    if length.is_multiple_of(3) {
        return Ok(());
    }
    Err(Error::Input(format!("positions has {length} numbers; wanted a multiple of 3 (x y z of each point)")))
}

/// Takes memory for `count` more items, or says how much was needed.
pub(crate) fn reserve<T>(items: &mut Vec<T>, count: usize, what: &str) -> Result<(), Error> {
    let needed = count as u64 * size_of::<T>() as u64;
    items.try_reserve_exact(count).map_err(|_| Error::memory(what, needed))
}

/// Where most of a cloud lies, from a sample; a few stray points do not move it.
pub(crate) struct Bulk {
    /// The median of each axis.
    pub median: DVec3,
    /// The longest side of the box that holds the middle 90 % of each axis.
    pub extent: f64,
}

impl Bulk {
    /// Looks at `at(0) .. at(count - 1)`, at most a few thousand of them; non-finite points are passed over.
    pub fn of(count: usize, at: &dyn Fn(usize) -> DVec3) -> Self {
        let step = count.div_ceil(SAMPLE).max(1);
        let sample: Vec<DVec3> = (0..count).step_by(step).map(at).filter(|p| p.is_finite()).collect();
        let mut bulk = Self { median: DVec3::ZERO, extent: 0.0 };
        if sample.is_empty() {
            return bulk;
        }
        for axis in 0..3 {
            let mut values: Vec<f64> = sample.iter().map(|p| p[axis]).collect();
            values.sort_unstable_by(f64::total_cmp);
            let quantile = |q: f64| values[((values.len() - 1) as f64 * q).round() as usize];
            bulk.median[axis] = quantile(0.5);
            bulk.extent = bulk.extent.max(quantile(0.95) - quantile(0.05));
        }
        bulk
    }
}

/// The origin to subtract from double coordinates before they are rounded to single precision: zero where single
/// precision tells points apart as well as they need, else whole numbers near the bulk of the points.
pub(crate) fn choose_origin(count: usize, at: &dyn Fn(usize) -> DVec3) -> DVec3 {
    let Bulk { median, extent } = Bulk::of(count, at);
    // Single precision has 24 bits: beyond four extents fewer than 22 are left for the extent itself.
    if median.abs().max_element() <= 4.0 * extent { DVec3::ZERO } else { median.round() }
}
