//! A k-d tree over the points, and the search for the k points nearest to one of them.
//!
//! The tree is balanced, so its shape follows from the number of points alone, and it follows any density. Queries are
//! to be made in the order of the tree: each begins with the bound that the one before it gives by the triangle
//! inequality, and finds its leaves in the cache. Bentley, "Multidimensional binary search trees used for associative
//! searching", 1975; distances to regions grow step by step as in Arya and Mount, "Algorithms for fast vector
//! quantization", 1993.

use super::select::select;
use crate::error::Error;
use crate::lists::reserve;
use crate::parallel::Scatter;
use crate::points::{Bounds, Bulk, Points};
use crate::power::{exp2, log2};
use crate::progress::Stage;
use bytemuck::Zeroable;
use glam::{DVec3, Vec3};
use std::ops::Range;

/// A leaf holds from half of this to as many points.
const LEAF: usize = 16;
/// Levels that are split one after the other, each in parallel; what is below is split subtree by subtree.
const TOP: u32 = 6;
/// The side along which to split is found from a sample of this size.
const SAMPLE: usize = 64;
/// No coordinate is larger, in units of the extent: squares of distances stay finite.
const FARTHEST: f64 = 1e18;

/// A point in the tree.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// Relative to the origin of the points, in units of about their extent.
    pub position: Vec3,
    /// Which point of the input it is.
    pub point: u32,
}

impl Place {
    #[inline(always)]
    fn along(&self, axis: u32) -> f32 {
        AsRef::<[f32; 3]>::as_ref(&self.position)[axis as usize]
    }

    /// In the order of a coordinate; of two at one, in that of the input.
    #[inline(always)]
    fn order(&self, axis: u32) -> u64 {
        let bits = self.along(axis).to_bits();
        // The bits of numbers above zero have their order, those below it the opposite one.
        let order = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
        u64::from(order) << 32 | u64::from(self.point)
    }
}

#[derive(Clone, Copy, Zeroable)]
struct Split {
    axis: u32,
    /// No point of the first half lies above it, none of the second below.
    value: f32,
}

/// The finite points of a cloud. 16 bytes a point, and one for the splits.
pub(crate) struct Tree {
    /// Leaf by leaf.
    pub(super) places: Vec<Place>,
    /// The root is number 1, the halves of node `i` are `2 i` and `2 i + 1`; the leaves follow after the last.
    splits: Vec<Split>,
    levels: u32,
}

impl Tree {
    /// In n log n time.
    pub fn build(points: &Points, bounds: &Bounds, stage: &Stage) -> Result<Self, Error> {
        let bulk = Bulk::of_points(points);
        let extent = if bulk.extent > 0.0 { bulk.extent } else { bounds.extent().max_element() };
        // A power of two, so that scaling loses nothing.
        let unit = if extent > 0.0 { exp2(log2(extent).round()) } else { 1.0 };
        let farthest = DVec3::splat(FARTHEST);
        let mut places = Vec::new();
        reserve(&mut places, bounds.finite, "the tree")?;
        places.extend(points.positions.iter().zip(0..).filter(|(position, _)| position.is_finite()).map(
            |(position, point)| Place {
                position: (position.as_dvec3() / unit).clamp(-farthest, farthest).as_vec3(),
                point,
            },
        ));
        let levels = places.len().div_ceil(LEAF).next_power_of_two().ilog2();
        let mut splits = Vec::new();
        reserve(&mut splits, 1 << levels, "the tree")?;
        splits.resize(1 << levels, Split::zeroed());
        let mut tree = Self { places, splits, levels };
        tree.split(stage)?;
        Ok(tree)
    }

    fn split(&mut self, stage: &Stage) -> Result<(), Error> {
        let (count, levels) = (self.places.len(), self.levels);
        let shared = Shared { places: Scatter::new(&mut self.places), splits: Scatter::new(&mut self.splits), count };
        let top = TOP.min(levels);
        let done = |level: u32| f64::from(level) / f64::from(levels.max(1));
        for level in 0..top {
            // SAFETY: the nodes of a level share no point.
            stage
                .part(done(level)..done(level + 1))
                .run(1 << level, &|number| unsafe { shared.split(level, number) })?;
        }
        // SAFETY: nor do the subtrees below them.
        stage.part(done(top)..1.0).run(1 << top, &|number| unsafe { shared.split_below(top, number, levels) })
    }
}

/// The points of a node.
fn range(count: usize, level: u32, number: usize) -> Range<usize> {
    let bound = |number: usize| ((count as u64 * number as u64) >> level) as usize;
    bound(number)..bound(number + 1)
}

/// The tree while it is split.
struct Shared<'a> {
    places: Scatter<'a, Place>,
    splits: Scatter<'a, Split>,
    count: usize,
}

impl Shared<'_> {
    /// Sorts the points of a node into two halves.
    ///
    /// # Safety
    /// No other call, on any thread, may touch the node meanwhile, nor one above or below it.
    unsafe fn split(&self, level: u32, number: usize) {
        let range = range(self.count, level, number);
        let middle = self::range(self.count, level + 1, 2 * number + 1).start - range.start;
        let node = (1 << level) + number;
        // SAFETY: the caller's promise.
        let (places, split) = unsafe { (self.places.slice(range), &mut self.splits.slice(node..node + 1)[0]) };
        let axis = longest_side(places);
        select(places, middle, |place| place.order(axis));
        *split = Split { axis, value: places[middle].along(axis) };
    }

    /// # Safety
    /// As for [`Shared::split`].
    unsafe fn split_below(&self, level: u32, number: usize, levels: u32) {
        if level < levels {
            // SAFETY: the caller's promise holds for the halves too, one after the other.
            unsafe {
                self.split(level, number);
                self.split_below(level + 1, 2 * number, levels);
                self.split_below(level + 1, 2 * number + 1, levels);
            }
        }
    }
}

/// The axis along which a sample of some points extends most.
fn longest_side(places: &[Place]) -> u32 {
    let sample = places.iter().step_by(places.len().div_ceil(SAMPLE));
    let bounds = sample.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), place| {
        (min.min(place.position), max.max(place.position))
    });
    (bounds.1 - bounds.0).max_position() as u32
}

/// One of the nearest points; ordered by the first field, of which no two are equal.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct Neighbour {
    /// The squared distance in single precision, then the number of the point: in the order of distance, and of two at
    /// one distance the one that comes first in the input. No distance is negative, so its bits have its order.
    pub order: u64,
    /// Among [`Tree::places`].
    pub place: u32,
}

impl Neighbour {
    #[inline(always)]
    fn new(distance: f32, point: u32, place: usize) -> Self {
        Self { order: u64::from(distance.to_bits()) << 32 | u64::from(point), place: place as u32 }
    }

    /// Squared.
    fn distance(&self) -> f32 {
        f32::from_bits((self.order >> 32) as u32)
    }
}

/// How many candidates are kept before the surplus is thrown away: few such passes, and little memory.
fn most(k: usize) -> usize {
    2 * k + LEAF
}

/// Searches one after the other, with memory of its own.
pub(super) struct Search<'a> {
    tree: &'a Tree,
    k: usize,
    /// Candidates, up to `most(k)` of them until the surplus is thrown away.
    found: Vec<Neighbour>,
    /// Nodes still to be looked into, and how far the query lies from them along each axis.
    ahead: Vec<(usize, Vec3)>,
    /// The query before this one, and the distance of the farthest point that it found.
    before: (Vec3, f32),
}

impl<'a> Search<'a> {
    /// `k` is at least 1 and at most the number of points.
    pub fn new(tree: &'a Tree, k: usize) -> Self {
        let (found, ahead) = (Vec::with_capacity(most(k)), Vec::with_capacity(tree.levels as usize + 1));
        Self { tree, k, found, ahead, before: (Vec3::ZERO, f32::INFINITY) }
    }

    /// What it takes of memory.
    pub fn bytes(k: usize) -> usize {
        most(k).saturating_mul(size_of::<Neighbour>())
    }

    /// The k nearest points, in no order, and the squared distance of the farthest. If that is zero, any k of the points
    /// that coincide with the query.
    ///
    /// Exact for distances in single precision: rounding is monotone, so what lies beyond a plane is never computed to
    /// be nearer than the plane.
    #[inline(never)] // Alone it keeps more in registers: 0.93 of the time.
    pub fn nearest(&mut self, query: Vec3) -> (&mut [Neighbour], f32) {
        let (before, radius) = self.before;
        let radius = radius + query.distance(before);
        // A little more than rounding may have taken away, also where squares come close to zero.
        let mut bound = radius * radius * (1.0 + 1e-5) + 1e-36;

        self.found.clear();
        self.ahead.push((1, Vec3::ZERO));
        while let Some((mut node, offset)) = self.ahead.pop() {
            if offset.length_squared() > bound {
                continue;
            }
            while let Some(split) = self.tree.splits.get(node) {
                let axis = split.axis as usize;
                let distance = query[axis] - split.value;
                let is_second = usize::from(distance >= 0.0);
                let mut offset = offset;
                offset[axis] = distance;
                self.ahead.push((2 * node + 1 - is_second, offset));
                node = 2 * node + is_second;
            }
            let places = range(self.tree.places.len(), self.tree.levels, node - self.tree.splits.len());
            for place in places {
                let Place { position, point } = self.tree.places[place];
                let distance = query.distance_squared(position);
                if distance <= bound {
                    if self.found.len() == most(self.k) {
                        bound = self.keep_nearest();
                        if bound == 0.0 {
                            // No others make a difference, and there may be any number of them.
                            self.ahead.clear();
                            break;
                        }
                    }
                    self.found.push(Neighbour::new(distance, point, place));
                }
            }
        }
        let farthest = self.keep_nearest();
        self.before = (query, farthest.sqrt());
        (&mut self.found, farthest)
    }

    /// Throws all but the nearest k away, and answers the squared distance of the farthest of them.
    #[inline(never)] // It is called in two places.
    fn keep_nearest(&mut self) -> f32 {
        if self.found.len() > self.k {
            select(&mut self.found, self.k - 1, |neighbour| neighbour.order);
            self.found.truncate(self.k);
        }
        self.found.iter().max_by_key(|neighbour| neighbour.order).map_or(0.0, Neighbour::distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Progress;

    /// The same points as by sorting all of them, whatever ties there are.
    #[test]
    fn the_nearest_are_those_of_the_definition() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1 << 23) as f32 - 1.0
        };
        let volume: Vec<f32> = (0..3000).map(|_| random()).collect();
        let mut uneven: Vec<f32> = (0..3000).map(|_| random().powi(9)).collect();
        uneven.extend([1e38, f32::NAN, 0.0, -1e38, 0.0, f32::INFINITY, 3e38, 3e38, 3e38]);
        let grid = (0..1000).flat_map(|i| [i % 10, i / 10 % 10, i / 100].map(|c| c as f32)).collect();
        let equal = [1.0, 2.0, 3.0].repeat(100);
        for (name, coordinates) in [("volume", volume), ("uneven", uneven), ("grid", grid), ("equal", equal)] {
            let points = Points::from_f32(&coordinates).unwrap();
            let bounds = Bounds::of(&points);
            let progress = Progress::silent();
            let tree = Tree::build(&points, &bounds, &progress.stage("tree", 0.0..1.0)).unwrap();
            for k in [1, 3, 8, 50, tree.places.len()] {
                let mut search = Search::new(&tree, k);
                for query in tree.places.iter().step_by(7) {
                    let distance = |place: &Place| query.position.distance_squared(place.position);
                    let mut expected: Vec<(f32, u32)> = tree.places.iter().map(|p| (distance(p), p.point)).collect();
                    expected.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                    expected.truncate(k);
                    let (found, farthest) = search.nearest(query.position);
                    found.sort_unstable_by_key(|neighbour| neighbour.order);
                    let found: Vec<(f32, u32)> = found.iter().map(|n| (n.distance(), n.order as u32)).collect();
                    assert_eq!(farthest, expected[k - 1].0, "{name} {k}");
                    if farthest > 0.0 {
                        assert_eq!(found, expected, "{name} {k}");
                    }
                }
            }
        }
    }
}
