//! The edge of the cubes.

use crate::error::Error;
use crate::lattice::mixed;
use crate::message::message;
use crate::number;
use crate::order::sort;
use crate::parallel::{self, Gathering};
use crate::points::{Bounds, Bulk, Points};
use crate::power::{exp2, log2};
use glam::{DVec3, UVec3};

/// Points in an occupied cube that 'auto' begins with: so many that a smooth surface needs few cubes, and so few that
/// what is not smooth needs only two or three divisions.
pub(crate) const POINTS_PER_CELL: f64 = 32.0;

/// Small clouds are given so many occupied cubes all the same, if these then hold as many points.
const LEAST_CELLS: f64 = 50.0;
const LEAST_POINTS_PER_CELL: f64 = 2.0;

/// How many places 'auto' looks at.
const PROBES: usize = 256;

/// At these places 'auto' counts about this many points, or the 64th part of the cloud if that is more.
const PROBED_POINTS: f64 = 32768.0;

/// More points than these in the smallest cubes counted, in the mean, are not told apart yet.
const CROWDED: f64 = 2.0;

/// In single precision nothing is smaller than this share of the cloud, but next to zero.
const RESOLUTION: f64 = 1.0 / (1 << 24) as f64;

/// Halvings of a probe's edge that 'auto' counts.
const LEVELS: u32 = 10;
/// A number for a probe's edge, and for that halved 1 to [`LEVELS`] times.
type Levels = [f64; LEVELS as usize + 1];
/// The same, and a number for what is never parted.
type Parted = [f64; LEVELS as usize + 2];

/// Strays are told where cubes hold so many points, as on surfaces hardly one is alone then.
const MANY: f64 = 8.0;

/// They are no surface if more than this share of those that are alone still are so in cubes of twice the edge. Single scans
/// have up to 0.6 there, most 0.1 to 0.5.
const STAYING: f64 = 0.6;

/// Besides, so many of all points: a few change nothing. And no more than a quarter are: that is a scene round what is dense.
const STRAYS: f64 = 0.003;
const MOST_STRAYS: f64 = 0.25;

/// The paper's L (Eq. 1) for `count` points in a box with sides `extent`: the edge of as many cubes as points.
///
/// A side thinner than the cubes leaves a flat cloud, where the same formula in the plane holds, or on the line. Each
/// of the three passes into the next where the side equals the edge, so the largest is the one that applies. All
/// points equal: 1.
pub(crate) fn paper_edge(extent: DVec3, count: usize) -> f64 {
    let n = count.max(1) as f64;
    let (thin, long) = (extent.min_element(), extent.max_element());
    let middle = extent.x.max(extent.y).min(extent.x.min(extent.y).max(extent.z));
    // Shares of the longest side, so that nothing over- or underflows.
    let (thin, middle) = (thin / long, middle / long);
    // By logarithms, which are needed below anyway: a cube root of its own is 2 KB of WebAssembly.
    let cube_root = exp2(log2(thin * middle / n) / 3.0);
    let edge = long * cube_root.max((middle / n).sqrt()).max(1.0 / n);
    if edge > 0.0 && edge.is_finite() { edge } else { 1.0 }
}

/// The edge of `size`, in units of the positions; one of these is `unit` of the input, and the paper's L `paper` of them.
pub(crate) fn edge_of_size(size: f64, unit: f64, paper: f64) -> Result<f64, Error> {
    let edge = size / unit;
    if [edge, edge.recip(), edge / paper].iter().all(|number| number.is_normal()) {
        return Ok(edge);
    }
    let size = number::text(size);
    Err(Error::Input(message!["cell.size is ", size, ", out of all proportion to the cloud; wanted another"]))
}

/// How densely the bulk of a cloud is covered.
pub(crate) struct Density {
    /// The middle of the bulk.
    pub middle: DVec3,
    /// The step that coordinates were rounded to, if they were, along the axes that they have here ([`Bulk::step`]).
    pub step: f64,
    /// Points of the cloud.
    count: usize,
    /// Edges, from large to small, and the points in an occupied cube of each; 0 for one point, or hardly any that is finite.
    occupancy: Vec<(f64, f64)>,
}

impl Density {
    /// One pass over the points; more where the cloud is far smaller than its box, or many points coincide.
    ///
    /// The mean of 1 / (points in the cube of a point), taken over all points, is the share of occupied cubes in points.
    /// So a few points chosen at random ("probes") tell it without bias, whatever the extent of the cloud: the cubes round
    /// them are halved until they hold too few points. Stray points weigh as little as they are few.
    #[optimize(size)]
    pub fn of(points: &Points, bounds: &Bounds) -> Result<Self, Error> {
        let bulk = Bulk::of_points(points);
        let extent = if bulk.extent > 0.0 { bulk.extent } else { bounds.extent().max_element() };
        let count = bounds.finite;
        if extent <= 0.0 || bulk.sample.is_empty() {
            let edge = paper_edge(bounds.extent(), count);
            return Ok(Self { middle: bulk.median, step: bulk.step, count, occupancy: vec![(edge, 0.0)] });
        }
        let (mut occupancy, mut extent): (Vec<(f64, f64)>, f64) = (Vec::new(), extent);
        let smallest = RESOLUTION * extent;
        loop {
            let probes = Probes::place(&bulk, extent, count);
            let counts = probes.count(points)?;
            let least = counts[LEVELS as usize];
            if extent < smallest && occupancy.last().is_some_and(|&(_, last)| least > 0.5 * last) {
                // What the halves before could not part are copies of each other, and no objects far apart.
                break;
            }
            let edge_of = |halvings: u32| probes.edge * exp2(-f64::from(halvings));
            occupancy.extend((0..).zip(counts).map(|(halvings, count)| (edge_of(halvings), count)));
            // Where most of the box is empty even the last halves hold many points: on from there.
            if least <= CROWDED || least.is_nan() {
                break;
            }
            extent = edge_of(LEVELS);
        }
        Ok(Self { middle: bulk.median, step: bulk.step, count, occupancy })
    }

    /// The edge of cubes that hold about `wanted` points each.
    #[optimize(size)]
    pub fn edge(&self, wanted: f64) -> f64 {
        let (mut edge, mut count) = self.occupancy[0];
        // Points that coincide can't be told apart by any edge, so they count as one.
        let wanted = wanted.min(self.count as f64 / LEAST_CELLS).max(LEAST_POINTS_PER_CELL);
        let target = wanted * self.occupancy[self.occupancy.len() - 1].1;
        if count < target {
            // A probe is too small already. On a surface the points of a cube grow with its edge squared.
            return edge * (target / count).sqrt();
        }
        for &(smaller, fewer) in &self.occupancy {
            if fewer < target {
                let share = log2(count / target) / log2(count / fewer);
                return edge * exp2(share * log2(smaller / edge));
            }
            (edge, count) = (smaller, fewer);
        }
        edge
    }
}

/// Where a cube lies: whole numbers, as the bits of doubles. They are only compared and hashed, and integers would take longer.
type Cube = [i64; 3];

/// Cubes of one grid that hold a chosen point each, with the number of chosen points in them.
struct Probes {
    origin: DVec3,
    edge: f64,
    /// 1 / edge.
    scale: f64,
    /// In the order of their first points.
    chosen: Vec<(Cube, u32)>,
    /// By hash of their cubes, open-addressed: the number of each in `chosen`, plus one; 0 where there is none. Mostly empty, as
    /// most points are in no probe.
    table: Vec<u16>,
}

impl Probes {
    /// Halves the edge until the probes hold no more of the cloud than wanted.
    #[optimize(size)]
    fn place(bulk: &Bulk, extent: f64, count: usize) -> Self {
        let sample = &bulk.distinct;
        let wanted = (PROBED_POINTS / count as f64).max(1.0 / 64.0);
        let step = sample.len().div_ceil(PROBES).max(1);
        let mut probes = Self { origin: bulk.median, edge: extent, scale: 0.0, chosen: Vec::new(), table: Vec::new() };
        for halvings in 0..64 {
            probes.edge = extent * exp2(-f64::from(halvings));
            probes.scale = 1.0 / probes.edge;
            probes.chosen.clear();
            probes.table = vec![0; SLOTS];
            for &point in sample.iter().step_by(step) {
                probes.choose(probes.cube(point).0);
            }
            let is_inside = |point: &DVec3| probes.find(probes.cube(*point).0).is_some();
            let others = sample.iter().enumerate().filter(|(i, point)| i % step != 0 && is_inside(point)).count();
            if others as f64 <= wanted * sample.len() as f64 {
                break;
            }
        }
        probes
    }

    /// The cube of a point, and where in the cube the point lies, in 0 to 1.
    fn cube(&self, point: DVec3) -> (Cube, DVec3) {
        let place = (point - self.origin) * self.scale;
        let floor = place.floor();
        // Adding zero turns -0 into 0.
        (floor.to_array().map(|number| (number + 0.0).to_bits() as i64), place - floor)
    }

    /// Counts a chosen point in a cube.
    fn choose(&mut self, cube: Cube) {
        let mut slot = hash(cube);
        while self.table[slot] != 0 && self.chosen[self.table[slot] as usize - 1].0 != cube {
            slot = (slot + 1) % SLOTS;
        }
        if self.table[slot] == 0 {
            self.chosen.push((cube, 0));
            self.table[slot] = self.chosen.len() as u16;
        }
        self.chosen[self.table[slot] as usize - 1].1 += 1;
    }

    /// The number of the probe at a cube.
    #[inline(always)]
    fn find(&self, cube: Cube) -> Option<u32> {
        let slot = hash(cube);
        if self.table[slot] == 0 { None } else { self.search(cube, slot) }
    }

    #[inline(never)]
    fn search(&self, cube: Cube, mut slot: usize) -> Option<u32> {
        loop {
            let probe = u32::from(self.table[slot]).checked_sub(1)?;
            if self.chosen[probe as usize].0 == cube {
                return Some(probe);
            }
            slot = (slot + 1) % SLOTS;
        }
    }

    /// Points in an occupied cube for the probes' edge halved 0 to [`LEVELS`] times.
    #[optimize(size)]
    fn count(&self, points: &Points) -> Result<Levels, Error> {
        // The probe of each point, then a Morton code: points in one cube of any level share the first bits. Sorted below,
        // so the order in which the chunks come does not matter.
        let found = Gathering::new("the sampled points");
        parallel::each(points.chunks(), &|i| {
            let mut codes: Vec<i64> = Vec::new();
            for point in points.chunk(i) {
                let (cube, place) = self.cube(point.as_dvec3());
                if let Some(probe) = self.find(cube)
                    && point.is_finite()
                {
                    let place = morton((place * f64::from(1 << LEVELS)).as_uvec3());
                    codes.push(i64::from(probe) << (3 * LEVELS) | i64::from(place));
                }
            }
            found.append(codes);
        });
        let mut found = found.all()?;
        sort(&mut found);

        // How many points part at each level from the next one in their order, and how many are left alone there, by both beside
        // them; the last number is for what coincides.
        let (mut parted, mut left) = (Parted::default(), Parted::default());
        for probe in found.chunk_by(|a, b| a >> (3 * LEVELS) == b >> (3 * LEVELS)) {
            let weight = f64::from(self.chosen[(probe[0] >> (3 * LEVELS)) as usize].1) / probe.len() as f64;
            let mut before = 0;
            for (i, point) in probe.iter().enumerate() {
                // By the first three bits that differ, of 64; nothing follows the last one, as if it parted at level 0.
                let apart = probe.get(i + 1).map_or(1 << (3 * LEVELS), |next| point ^ next);
                let after = ((apart.leading_zeros() + 3 * LEVELS - 61) / 3) as usize;
                parted[after] += weight;
                left[after.max(before)] += weight;
                before = after;
            }
        }
        Ok(occupancy(parted, left))
    }
}

/// Points in an occupied cube at each level, without strays if there are many; of the points that part there from the next one
/// in their order, and that are left alone there.
///
/// Of points in a volume one is alone in its cube as often in twice as large ones, until these hold several; on a surface, and
/// be it as sparse as what is far from a scanner, four times as many points share it then.
#[optimize(size)]
fn occupancy(parted: Parted, left: Parted) -> Levels {
    let points: f64 = parted.iter().sum();
    let (mut all, mut without) = (Levels::default(), Levels::default());
    let (mut cubes, mut alone) = (0.0, 0.0);
    // The levels without strays: if those that are alone in the smallest cubes in which all others have neighbours mostly stay so.
    let mut cleared = 0;
    for level in 0..=LEVELS as usize {
        let before = alone;
        cubes += parted[level];
        alone += left[level];
        all[level] = points / cubes;
        without[level] = (points - alone) / (cubes - alone);
        if without[level] >= MANY {
            let is_strewn = MOST_STRAYS * points > alone && before > STAYING * alone + STRAYS * points;
            // Neighbours in the smallest of all coincide.
            cleared = if is_strewn && level < LEVELS as usize { level + 1 } else { 0 };
        }
    }
    std::array::from_fn(|level| if level < cleared { without[level] } else { all[level] })
}

/// Of the table of probes.
const SLOTS: usize = 1 << 14;

fn hash(cube: Cube) -> usize {
    // After this addition whole numbers stand in the last bits.
    const BIT: f64 = (3u64 << 51) as f64;
    let [x, y, z] = cube.map(|c| (f64::from_bits(c as u64) + BIT).to_bits());
    (mixed(x, y, z) >> 50) as usize
}

/// Interleaves the lowest [`LEVELS`] bits of three numbers.
fn morton(place: UVec3) -> u32 {
    // Ever smaller halves move apart, until there are two free bits before each.
    let spread = |value: u32| {
        let halves = (value | value << 16) & 0x0300_00FF;
        let quarters = (halves | halves << 8) & 0x0300_F00F;
        let pairs = (quarters | quarters << 4) & 0x030C_30C3;
        (pairs | pairs << 2) & 0x0924_9249
    };
    let place = place.min(UVec3::splat((1 << LEVELS) - 1));
    spread(place.x) | spread(place.y) << 1 | spread(place.z) << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paper_edge_is_equation_1() {
        assert!((paper_edge(DVec3::new(2.0, 2.0, 2.0), 1000) - 0.2).abs() < 1e-15);
        assert!((paper_edge(DVec3::new(10.0, 1.0, 0.1), 1_000_000) - 0.01).abs() < 1e-12);
    }

    #[test]
    fn paper_edge_of_flat_straight_and_single_clouds() {
        assert!((paper_edge(DVec3::new(4.0, 0.0, 1.0), 100) - 0.2).abs() < 1e-12);
        assert!((paper_edge(DVec3::new(0.0, 5.0, 0.0), 100) - 0.05).abs() < 1e-12);
        assert_eq!(paper_edge(DVec3::ZERO, 100), 1.0);
    }

    #[test]
    fn morton_codes_share_their_first_bits_within_a_cube() {
        assert_eq!(morton(UVec3::new(1, 0, 0)), 1);
        assert_eq!(morton(UVec3::new(0, 3, 0)), 0b010_010);
        assert_eq!(morton(UVec3::splat(1 << LEVELS)), (1 << (3 * LEVELS)) - 1);
    }

    /// A square of 20,000 points, and as many strays in the cube on it as are asked for.
    fn strewn_square(strays: usize) -> Points<'static> {
        // Steps of the plastic number's powers cover all of it evenly, and no rows.
        let place = |i: usize, height: f64| {
            let along = |step: f64| (i as f64 * step).fract() as f32;
            [
                along(0.819_172_513_396_164_4),
                along(0.671_043_606_703_789_2),
                height as f32 * along(0.549_700_477_901_970_3),
            ]
        };
        let points = (0..20_000).map(|i| place(i, 0.0)).chain((0..strays).map(|i| place(i, 1.0)));
        Points::from_vec(points.flatten().collect()).unwrap()
    }

    #[test]
    fn strays_do_not_widen_the_cubes_of_others() {
        let edge = |strays: usize| {
            let points = strewn_square(strays);
            Density::of(&points, &Bounds::of(&points)).unwrap().edge(16.0)
        };
        let clean = edge(0);
        for strays in [20, 200, 600, 2000] {
            let ratio = edge(strays) / clean;
            assert!((0.85..1.15).contains(&ratio), "{strays}: {ratio}");
        }
    }
}
