//! The elliptic Gabriel graph, and a quadratic surface through the neighbours in it: the paper's EGG.
//!
//! Park, Shin and Choi, "Elliptic Gabriel graph for finding neighbors in a point set and its application to normal
//! vector estimation", Computer-Aided Design 38 (2006) 619-626. Two points are neighbours in the graph when no other
//! point lies inside the ellipsoid of revolution round their midpoint whose semi-axes are half their distance along the
//! line between them, and [`ALPHA`] times that across.
//!
//! What the paper leaves open is decided so: candidates are the k nearest other points, in one direction only; the frame
//! of the surface is the plane of all candidates and the point; the surface passes through the point and all neighbours
//! weigh the same; where they do not determine a surface, the plane stands in.

use super::tree::{Neighbour, Place};
use crate::order::insert_each;
use crate::pca::{Moments, Plane};
use glam::{DVec3, Vec3};

/// How wide the ellipsoid is against its length, above 0 and up to 1. At 1 the graph is the Gabriel graph; slimmer
/// ellipsoids leave more neighbours.
///
/// Software that takes 20 to 40 candidates uses 0.75. Of the 8 candidates of the paper that leaves fewer than
/// [`COEFFICIENTS`] at 58 % of the points of a sphere, 0.5 at 26 %, and the mean error is smaller by a quarter.
const ALPHA: f64 = 0.5;

/// A quadratic height function through the point has as many coefficients; fewer neighbours do not determine one.
const COEFFICIENTS: usize = 5;

/// How much of a column of the linear system must be left when what the columns before it tell is taken away.
const LEAST_PIVOT: f64 = 1e-3;

/// The plane of a point's nearest neighbours, among which it may be itself, but with the normal of the surface through
/// those in the graph; `None` if they lie on a line.
pub(super) fn tangent_plane(
    places: &[Place],
    point: usize,
    nearest: &mut [Neighbour],
    edges: &mut Vec<DVec3>,
) -> Option<Plane> {
    // By distance. The graph takes as many steps.
    insert_each(nearest);
    let others = nearest.iter().map(|neighbour| neighbour.place as usize).filter(|place| *place != point);
    let relative = |place: usize| places[place].position - places[point].position;
    // Not that of the last one: in single precision the squares that order them may all be zero.
    let radius = others.clone().map(|other| relative(other).as_dvec3().length()).fold(0.0, f64::max);
    // Units of about the radius are what moments are made for: the power of two below it, so that points that lie on an
    // ellipsoid stay on it when their coordinates are whole numbers.
    let scale = 1.0 / f64::from_bits(radius.to_bits() >> 52 << 52);
    if !scale.is_finite() {
        return None;
    }
    edges.clear();
    edges.extend(others.map(|other| relative(other).as_dvec3() * scale));
    let candidates = edges.iter().map(|edge| edge.as_vec3());
    let mut plane = Moments::of(candidates.chain([Vec3::ZERO])).plane()?;
    keep_edges(edges, ALPHA);
    if let Some(normal) = quadratic(plane.normal.as_dvec3(), edges) {
        plane.normal = normal.as_vec3();
    }
    Some(plane)
}

/// Of some points relative to the origin, in the order of their distances, keeps the origin's neighbours in the graph.
///
/// An ellipsoid no wider than long lies in the ball round its longest axis, which holds no point that is farther from
/// the origin than the axis' end: only nearer candidates can lie inside.
fn keep_edges(candidates: &mut Vec<DVec3>, alpha: f64) {
    for far in (1..candidates.len()).rev() {
        let (nearer, rest) = candidates.split_at(far);
        if nearer.iter().any(|point| is_inside(*point, rest[0], alpha)) {
            candidates.remove(far);
        }
    }
}

/// Whether a point lies inside the ellipsoid between the origin and another point, and not on it.
fn is_inside(point: DVec3, end: DVec3, alpha: f64) -> bool {
    let (centre, square) = (end / 2.0, end.length_squared());
    let from_centre = point - centre;
    // Both sides times the square of the length, so that nothing is divided.
    let along = from_centre.dot(end);
    let across = from_centre.length_squared() * square - along * along;
    alpha * alpha * along * along + across < alpha * alpha * square * square / 4.0
}

/// The normal at the origin of the surface `w = a u + b v + c u^2 + d u v + e v^2` that fits some points best (least
/// squares), with w along a normal and u and v across; `None` if too few points, or their places, leave it open.
fn quadratic(normal: DVec3, points: &[DVec3]) -> Option<DVec3> {
    if points.len() < COEFFICIENTS {
        return None;
    }
    let (across_u, across_v) = normal.any_orthonormal_pair();
    // The lower half of the normal equations; the last row is their right side.
    let mut rows = [[0.0; COEFFICIENTS]; COEFFICIENTS + 1];
    for point in points {
        let (u, v) = (point.dot(across_u), point.dot(across_v));
        let values = [u, v, u * u, u * v, v * v, point.dot(normal)];
        for (i, row) in rows.iter_mut().enumerate() {
            for j in 0..=i.min(COEFFICIENTS - 1) {
                row[j] += values[i] * values[j];
            }
        }
    }
    // Cholesky's decomposition, where the last row comes out as the solution of the first triangular system.
    for j in 0..COEFFICIENTS {
        let whole = rows[j][j];
        for i in j..=COEFFICIENTS {
            let known: f64 = (0..j).map(|l| rows[i][l] * rows[j][l]).sum();
            rows[i][j] -= known;
            if i == j {
                if rows[j][j] <= LEAST_PIVOT * whole {
                    return None;
                }
                rows[j][j] = rows[j][j].sqrt();
            } else {
                rows[i][j] /= rows[j][j];
            }
        }
    }
    // The other one backwards; only the first two coefficients count, but they come last.
    let mut solution = rows[COEFFICIENTS];
    for j in (0..COEFFICIENTS).rev() {
        let known: f64 = (j + 1..COEFFICIENTS).map(|i| rows[i][j] * solution[i]).sum();
        solution[j] = (solution[j] - known) / rows[j][j];
    }
    (normal - across_u * solution[0] - across_v * solution[1]).try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadratic_surface_is_found_exactly() {
        let places = [[1.0, 0.2], [-0.3, 0.9], [-0.8, -0.5], [0.4, -0.7], [0.1, 0.5], [0.6, 0.6]];
        let height = |u: f64, v: f64| 0.1 * u - 0.2 * v + 0.3 * u * u - 0.4 * u * v + 0.5 * v * v;
        let points = places.map(|[u, v]| DVec3::new(u, v, height(u, v)));
        let normal = quadratic(DVec3::Z, &points).unwrap();
        assert!(normal.distance(DVec3::new(-0.1, 0.2, 1.0).normalize()) < 1e-12, "{normal}");
    }

    /// Two lines through the point are a conic with it: many surfaces contain them.
    #[test]
    fn places_that_leave_the_surface_open() {
        let points = [1.0, -1.0, 2.0].map(|x| [DVec3::new(x, 0.0, 0.1), DVec3::new(0.0, x, 0.2)]).concat();
        assert_eq!(quadratic(DVec3::Z, &points), None);
        assert_eq!(quadratic(DVec3::Z, &points[..4]), None);
    }

    #[test]
    fn an_ellipsoid_does_not_hold_its_surface() {
        let end = DVec3::new(2.0, 0.0, 0.0);
        for alpha in [0.25, 0.5, 1.0] {
            for (point, expected) in [
                (DVec3::new(1.0, 0.99 * alpha, 0.0), true),
                (DVec3::new(1.0, 0.0, alpha), false),
                (DVec3::new(0.01, 0.0, 0.0), true),
                (DVec3::ZERO, false),
                (end, false),
            ] {
                assert_eq!(is_inside(point, end, alpha), expected, "{point} {alpha}");
            }
        }
    }

    /// By definition: an edge for every pair with nothing inside its ellipsoid, whichever points are nearer.
    #[test]
    fn edges_are_those_of_the_definition() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / f64::from(1 << 23) - 1.0
        };
        for alpha in [0.3, 0.5, 0.75, 1.0] {
            let mut points: Vec<DVec3> = (0..60).map(|_| DVec3::new(random(), random(), 0.1 * random())).collect();
            points.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
            let is_edge = |end: &DVec3| {
                !points.iter().any(|point| {
                    let (half, axis) = (end.length() / 2.0, end.normalize());
                    let from_centre = *point - *end / 2.0;
                    let along = from_centre.dot(axis);
                    let across = (from_centre - along * axis).length();
                    (along / half).powi(2) + (across / (alpha * half)).powi(2) < 1.0 - 1e-12
                })
            };
            let expected: Vec<DVec3> = points.iter().copied().filter(is_edge).collect();
            let mut edges = points.clone();
            keep_edges(&mut edges, alpha);
            assert_eq!(edges, expected, "{alpha}");
        }
    }
}
