//! Method 'knn' against the same job with kiddo: 750,000 points of a sphere, in random and in Morton order.
//!
//! Usage: `cargo run --release --manifest-path benches/peers/Cargo.toml`. Prints a table: medians of runs that take
//! turns, in seconds, and how many normals agree.

use bilinormal::{Method, Options, Points, Progress, estimate};
use glam::{DVec3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::num::NonZero;
use std::time::Instant;

const COUNT: usize = 750_000;
const RUNS: usize = 5;

fn main() {
    let random = sphere();
    let mut sorted = random.clone();
    sorted.sort_by_cached_key(|point| morton(*point));
    let pools = [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap());

    println!(
        "| order | k | kiddo | ours | ratio | kiddo, 2 threads | ours | ratio | speed-up of ours | same normals |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for (order, points) in [("random", &random), ("Morton", &sorted)] {
        for k in [10, 16] {
            let mut seconds = [const { Vec::new() }; 4];
            let mut same = 0.0;
            for _ in 0..RUNS {
                for (threads, pool) in pools.iter().enumerate() {
                    let theirs = timed(&mut seconds[2 * threads], || pool.install(|| by_kiddo(points, k)));
                    let ours = timed(&mut seconds[2 * threads + 1], || pool.install(|| by_us(points, k)));
                    same = share(&theirs, &ours);
                }
            }
            let [kiddo, ours, kiddo2, ours2] = seconds.map(|mut runs| {
                runs.sort_by(f64::total_cmp);
                runs[RUNS / 2]
            });
            println!(
                "| {order} | {k} | {kiddo:.2} | {ours:.2} | {:.2} | {kiddo2:.2} | {ours2:.2} | {:.2} | {:.2} | {:.3} % |",
                kiddo / ours,
                kiddo2 / ours2,
                ours / ours2,
                100.0 * same
            );
        }
    }
}

fn timed<T>(seconds: &mut Vec<f64>, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    seconds.push(start.elapsed().as_secs_f64());
    result
}

fn by_us(points: &[Vec3], k: usize) -> Vec<Vec3> {
    let coordinates: Vec<f32> = points.iter().flat_map(|p| p.to_array()).collect();
    let options = Options { method: Method::Knn, k: Some(k as u32), ..Options::default() };
    let points = Points::from_f32(&coordinates).unwrap();
    let normals = estimate(&points, &options, &Progress::silent()).unwrap().normals;
    normals.chunks_exact(3).map(Vec3::from_slice).collect()
}

/// As its documentation advises: an immutable tree, and queries in the order of the input. (Answers with positions instead
/// of numbers would save a look-up, but kiddo 6.3 then sorts all points for each query.)
fn by_kiddo(points: &[Vec3], k: usize) -> Vec<Vec3> {
    let places: Vec<[f32; 3]> = points.iter().map(|p| p.to_array()).collect();
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&places).unwrap();
    let k = NonZero::new(k).unwrap();
    let normal = |place: &[f32; 3]| {
        let found = tree.query(place).nearest_n::<SquaredEuclidean<f32>>(k).execute();
        plane(Vec3::from_array(*place), found.iter().map(|neighbour| points[neighbour.item as usize]))
    };
    places.par_iter().map(normal).collect()
}

/// The normal of the plane that fits some points best: the smallest root of the characteristic polynomial, then a cross
/// product.
fn plane(origin: Vec3, points: impl Iterator<Item = Vec3>) -> Vec3 {
    let (mut count, mut sum, mut squares, mut products) = (0.0, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    for point in points {
        let p = (point - origin).as_dvec3();
        count += 1.0;
        sum += p;
        squares += p * p;
        products += DVec3::new(p.y * p.z, p.x * p.z, p.x * p.y);
    }
    let mean = sum / count;
    let d = squares / count - mean * mean;
    let o = products / count - DVec3::new(mean.y * mean.z, mean.x * mean.z, mean.x * mean.y);
    let third = d.element_sum() / 3.0;
    let e = d - third;
    let spread = ((e.length_squared() + 2.0 * o.length_squared()) / 6.0).sqrt();
    let determinant = e.x * (e.y * e.z - o.x * o.x) - o.z * (o.z * e.z - o.x * o.y) + o.y * (o.z * o.x - e.y * o.y);
    let angle = (determinant / (2.0 * spread.powi(3))).clamp(-1.0, 1.0).acos() / 3.0;
    let d = d - (third + 2.0 * spread * (angle + TAU / 3.0).cos());
    let rows = [DVec3::new(d.x, o.z, o.y), DVec3::new(o.z, d.y, o.x), DVec3::new(o.y, o.x, d.z)];
    let crosses = [rows[0].cross(rows[1]), rows[1].cross(rows[2]), rows[2].cross(rows[0])];
    let longest = crosses.into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    longest.unwrap().normalize_or_zero().as_vec3()
}

/// Of two sets of normals, how many are equal but for the sign and rounding.
fn share(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).filter(|(a, b)| a.cross(**b).length() < 1e-3).count() as f64 / a.len() as f64
}

/// SplitMix64.
fn sphere() -> Vec<Vec3> {
    let mut state = 1u64;
    let mut unit = || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut point = || {
        let (z, (sine, cosine)) = (2.0 * unit() - 1.0, (TAU * unit()).sin_cos());
        let ring = (1.0 - z * z).sqrt();
        DVec3::new(ring * cosine, ring * sine, z).as_vec3()
    };
    (0..COUNT).map(|_| point()).collect()
}

/// 10 bits an axis, interleaved.
fn morton(point: Vec3) -> u32 {
    let cell = ((point + 1.0) * 512.0).as_uvec3().min(glam::UVec3::splat(1023)).to_array();
    (0..30).fold(0, |code, bit| code | (cell[bit % 3] >> (bit / 3) & 1) << bit)
}
