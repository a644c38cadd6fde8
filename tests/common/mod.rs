//! Seeded clouds with known normals.
#![allow(dead_code)] // Each test file uses its own part.

mod random;

use bilinormal::{Cell, Estimate, Method, Options, Points, Progress, estimate};
pub use random::Random;
use std::f64::consts::TAU;

/// Points and their true unit normals.
pub struct Cloud {
    pub points: Vec<f32>,
    pub normals: Vec<[f64; 3]>,
}

impl Cloud {
    pub fn of(samples: impl Iterator<Item = ([f64; 3], [f64; 3])>) -> Self {
        let (points, normals): (Vec<_>, Vec<_>) = samples.unzip();
        Self { points: points.concat().into_iter().map(|c| c as f32).collect(), normals }
    }

    /// Moves the points by normally distributed noise; the standard deviation is a share of the bounding box' diagonal,
    /// as in the PCPNet benchmark.
    pub fn noisy(mut self, share: f64, seed: u64) -> Self {
        let extent = [0, 1, 2].map(|axis| {
            let along = self.points[axis..].iter().step_by(3).copied();
            f64::from(along.clone().fold(f32::MIN, f32::max) - along.fold(f32::MAX, f32::min))
        });
        let deviation = share * extent.iter().map(|e| e * e).sum::<f64>().sqrt();
        let mut random = Random(seed);
        self.points.iter_mut().for_each(|c| *c += (deviation * random.gauss()) as f32);
        self
    }
}

/// The unit sphere.
pub fn sphere(count: usize, seed: u64) -> Cloud {
    let mut random = Random(seed);
    Cloud::of((0..count).map(|_| {
        let n = random.direction();
        (n, n)
    }))
}

/// A torus of radii 1 and 0.35, with ten times as many points on one side as on the other.
pub fn torus(count: usize, seed: u64) -> Cloud {
    let mut random = Random(seed);
    Cloud::of((0..count).map(|_| {
        loop {
            let (a, b) = (TAU * random.unit(), TAU * random.unit());
            let density = (1.0 + 0.35 * b.cos()) / 1.35 * (0.55 + 0.45 * a.cos());
            if random.unit() < density {
                let n = [b.cos() * a.cos(), b.cos() * a.sin(), b.sin()];
                let r = 1.0 + 0.35 * b.cos();
                return ([r * a.cos(), r * a.sin(), 0.35 * b.sin()], n);
            }
        }
    }))
}

/// The sides of a cube with edge 2, turned by a fixed rotation.
pub fn cube(count: usize, seed: u64) -> Cloud {
    let mut random = Random(seed);
    Cloud::of((0..count).map(|_| {
        let (axis, side) = ((random.unit() * 3.0) as usize, if random.unit() < 0.5 { 1.0 } else { -1.0 });
        let (mut point, mut normal) = ([random.signed(), random.signed(), random.signed()], [0.0; 3]);
        point[axis] = side;
        normal[axis] = side;
        (turn(point), turn(normal))
    }))
}

/// A plane through the origin with the given normal.
pub fn plane(count: usize, seed: u64, normal: [f64; 3]) -> Cloud {
    let mut random = Random(seed);
    let axis = (0..3).min_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap();
    let mut helper = [0.0; 3];
    helper[axis] = 1.0;
    let u = unit(cross(normal, helper));
    let v = cross(normal, u);
    Cloud::of((0..count).map(|_| {
        let (s, t) = (random.signed(), random.signed());
        ([0, 1, 2].map(|i| s * u[i] + t * v[i]), normal)
    }))
}

/// A height field of two wavelengths.
pub fn terrain(count: usize, seed: u64) -> Cloud {
    let mut random = Random(seed);
    Cloud::of((0..count).map(|_| {
        let (x, y) = (random.signed(), random.signed());
        let z = 0.2 * (3.0 * x).sin() * (3.0 * y).cos() + 0.02 * (19.3 * x).sin();
        let dx = 0.6 * (3.0 * x).cos() * (3.0 * y).cos() + 0.386 * (19.3 * x).cos();
        let dy = -0.6 * (3.0 * x).sin() * (3.0 * y).sin();
        ([x, y, z], unit([-dx, -dy, 1.0]))
    }))
}

/// A rotation about no special axis.
pub fn turn(p: [f64; 3]) -> [f64; 3] {
    let (s, c) = 0.7f64.sin_cos();
    let [x, y, z] = [c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]];
    let (s, c) = 0.6f64.sin_cos();
    [x, c * y - s * z, s * y + c * z]
}

pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = a.iter().map(|c| c * c).sum::<f64>().sqrt();
    a.map(|c| c / length)
}

/// Runs the estimator without an audience.
pub fn run(points: &[f32], cell: Cell) -> Estimate {
    run_with(&Points::from_f32(points).unwrap(), &Options { cell, ..Options::default() })
}

/// The planes of the k nearest points.
pub fn run_knn(points: &[f32], k: u32) -> Estimate {
    let options = Options { method: Method::Knn, k: Some(k), ..Options::default() };
    run_with(&Points::from_f32(points).unwrap(), &options)
}

pub fn run_with(points: &Points, options: &Options) -> Estimate {
    estimate(points, options, &Progress::silent()).unwrap()
}

/// The unsigned angles between estimated and true normals in degrees; 90 for a zero vector.
pub fn angles(normals: &[f32], truth: &[[f64; 3]]) -> Vec<f64> {
    assert_eq!(normals.len(), 3 * truth.len());
    normals
        .chunks_exact(3)
        .zip(truth)
        .map(|(n, t)| {
            let n = [0, 1, 2].map(|i| f64::from(n[i]));
            let dot = (0..3).map(|i| n[i] * t[i]).sum::<f64>().abs();
            let sine = cross(n, *t).iter().map(|c| c * c).sum::<f64>().sqrt();
            if n == [0.0; 3] { 90.0 } else { sine.atan2(dot).to_degrees() }
        })
        .collect()
}

pub fn root_mean_square(angles: &[f64]) -> f64 {
    (angles.iter().map(|a| a * a).sum::<f64>() / angles.len() as f64).sqrt()
}

pub fn worst(angles: &[f64]) -> f64 {
    angles.iter().copied().fold(0.0, f64::max)
}
