//! The paper's baselines: the normal of each point from its own nearest neighbours.

mod egg;
mod knn;
mod select;
mod tree;

use crate::error::Error;
use crate::frame::Frame;
use crate::lists::reserve;
use crate::normals::{Found, Normals};
use crate::parallel;
use crate::progress::Stage;
use glam::Vec3;
use tree::Search;

pub(crate) use tree::Tree;

/// A task finds about this many neighbours in all: a millisecond.
const NEIGHBOURS: usize = 1 << 14;

/// Which baseline.
#[derive(Clone, Copy)]
pub(crate) enum Baseline {
    /// The plane of the `k` nearest points, the point itself among them: the paper's ENN.
    Knn {
        /// At least 3.
        k: usize,
    },
    /// A quadratic surface through the neighbours in the elliptic Gabriel graph: the paper's EGG.
    Egg {
        /// How many points are considered, besides the point itself. At least 3.
        k: usize,
    },
}

/// The normals of `count` points, and with `curvature` the surface variation of what they come from; those that are not in
/// the tree get zero.
pub(crate) fn normals(
    tree: &Tree,
    baseline: Baseline,
    curvature: bool,
    count: usize,
    stage: &Stage,
) -> Result<Found, Error> {
    let k = match baseline {
        Baseline::Knn { k } => k,
        // The point itself is always found too.
        Baseline::Egg { k } => k.saturating_add(1),
    };
    let k = k.min(tree.places.len());
    // What the tasks are going to take is refused here, because they cannot.
    reserve(&mut Vec::<u8>::new(), parallel::threads().saturating_mul(Search::bytes(k)), "the neighbours")?;

    let normals = Normals::new(count, tree.places.len(), curvature, &Frame::GIVEN)?;
    let size = (NEIGHBOURS / k.max(1)).clamp(16, 1024);
    stage.run(tree.places.len().div_ceil(size), &|task| {
        let (mut search, mut writer) = (Search::new(tree, k), normals.writer());
        let mut edges = Vec::new();
        let mut resolved = 0;
        for place in parallel::piece(tree.places.len(), size, task) {
            let (neighbours, farthest) = search.nearest(tree.places[place].position);
            let plane = match baseline {
                Baseline::Knn { .. } => knn::plane(&tree.places, place, neighbours, farthest.sqrt()),
                Baseline::Egg { .. } => egg::tangent_plane(&tree.places, place, neighbours, &mut edges),
            };
            resolved += u64::from(plane.is_some());
            let (normal, variation) = plane.map_or((Vec3::ZERO, 0.0), |plane| (plane.normal, plane.variation));
            let point = tree.places[place].point;
            // SAFETY: a point stands in the tree once.
            unsafe {
                writer.write(point, normal);
                writer.write_curvature(point, variation);
            }
        }
        normals.add_resolved(resolved);
    })?;
    // SAFETY: the tasks hold every point of the tree.
    Ok(unsafe { normals.complete() })
}
