//! Principal component analysis of the nearest neighbours: the paper's ENN.

use super::tree::{Neighbour, Place};
use crate::pca::{Moments, Plane};

/// The plane that fits some points best; `None` if they lie on a line. The radius is the distance of the
/// farthest of them.
pub(super) fn plane(places: &[Place], point: usize, neighbours: &[Neighbour], radius: f32) -> Option<Plane> {
    // Relative to the point and in units of the radius, which is what moments are made for.
    let scale = 1.0 / radius;
    let position = |place: usize| places[place].position;
    let relative = neighbours.iter().map(|neighbour| (position(neighbour.place as usize) - position(point)) * scale);
    if scale.is_finite() { Moments::of(relative).plane() } else { None }
}
