//! The elliptic Gabriel graph, and a quadratic surface through the neighbours in it: the paper's EGG.
//!
//! Park, Shin and Choi, "Elliptic Gabriel graph for finding neighbors in a point set and its application to normal
//! vector estimation", Computer-Aided Design 38 (2006) 619-626. Two points are neighbours in the graph when no other
//! point lies inside the ellipsoid of revolution round their midpoint whose semi-axes are half their distance along the
//! line between them, and [`ALPHA`] times that across.

use super::tree::{Neighbour, Place};
use crate::pca::Moments;
use glam::{DVec3, Vec3};

/// How wide the ellipsoid is against its length, above 0 and up to 1. At 1 the graph is the Gabriel graph; slimmer
/// ellipsoids leave more neighbours, and spread them better round the point.
const ALPHA: f64 = 0.75;

/// A quadratic height function through the point has as many coefficients; fewer neighbours make a plane.
const COEFFICIENTS: usize = 5;

/// How much of a column of the linear system must be left when what the columns before it tell is taken away.
const LEAST_PIVOT: f64 = 1e-6;

/// The normal at a point from its nearest neighbours, among which it may be itself; `None` if they lie on a line.
pub(super) fn normal(point: &Place, nearest: &mut [Neighbour], edges: &mut Vec<DVec3>) -> Option<Vec3> {
    nearest.sort_unstable_by_key(Neighbour::order);
    edges.clear();
    let candidates = nearest.iter().filter(|neighbour| neighbour.point != point.point);
    edges.extend(candidates.map(|neighbour| (neighbour.position - point.position).as_dvec3()));
    keep_edges(edges, ALPHA);

    let scale = 1.0 / edges.last()?.length();
    if !scale.is_finite() {
        return None;
    }
    for edge in edges.iter_mut() {
        *edge *= scale;
    }
    let points = edges.iter().map(|edge| edge.as_vec3()).chain([Vec3::ZERO]);
    let (_, plane) = Moments::of(points).plane()?;
    Some(quadratic(plane.as_dvec3(), edges).map_or(plane, DVec3::as_vec3))
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
                if !(rows[j][j] > LEAST_PIVOT * whole) {
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
