//! Memory grows with the points, never with the bounding box.
#![cfg(not(target_arch = "wasm32"))]

mod common;
#[path = "common/memory.rs"]
mod counter;

use bilinormal::ply::{self, Additions};
use bilinormal::{Cell, Error, Options, Orient, Points, Progress, estimate_owned};
use common::*;
use counter::{CURRENT, FREE, LIMIT, REFUSED, peak_of};
use std::sync::Mutex;
use std::sync::atomic::Ordering::Relaxed;

/// One test at a time, because the counters are those of the process.
static ALONE: Mutex<()> = Mutex::new(());

#[test]
fn peak_bytes_a_point() {
    let _alone = ALONE.lock();
    let sphere = sphere(1_000_000, 1).points;
    let stray = |far: f32| [sphere.clone(), vec![far, far, far]].concat();
    // In a solid no surface fits: every cube is divided as far as it goes.
    let mut random = Random(2);
    let noisy: Vec<f32> = (0..3_000_000).map(|_| random.signed() as f32).collect();
    let needle: Vec<f32> = (0..3_000_000)
        .map(|i| if i % 3 == 0 { 1e6 * random.signed() as f32 } else { random.signed() as f32 })
        .collect();
    // Half of the points on each of two spheres: with a dense object in a wide scene, or round a scanner.
    let wide = |times: f32| -> Vec<f32> {
        let scaled = |(i, x): (usize, &f32)| if i / 3 % 2 == 0 { *x } else { times * x };
        sphere.iter().enumerate().map(scaled).collect()
    };
    // Input and normals are 12 bytes each; the input is given up before, unless signs need it.
    let (none, consistent, viewpoint) = (Orient::None, Orient::Consistent, Orient::Viewpoint([9.0; 3]));
    for (name, points, cell, orient, bound) in [
        ("sphere, 1.5 L", &sphere, Cell::Scale(1.5), none, 34),
        ("sphere, 1.0 L", &sphere, Cell::Scale(1.0), none, 34),
        ("sphere, auto", &sphere, Cell::Auto, none, 40),
        ("a stray point", &stray(3e6), Cell::Auto, none, 40),
        ("a stray point beyond all cubes", &stray(-1e30), Cell::Auto, none, 40),
        ("rough everywhere", &noisy, Cell::Auto, none, 60),
        ("ten thousand times as dense", &wide(1e2), Cell::Auto, none, 150),
        ("a million times as dense", &wide(1e3), Cell::Auto, none, 415),
        ("a needle", &needle, Cell::Scale(1.0), none, 74),
        ("as many cubes as points", &sphere, Cell::Scale(0.1), none, 92),
        ("far more cubes than points", &sphere, Cell::Size(1e-6), none, 130),
        ("auto with signs on a sphere", &sphere, Cell::Auto, consistent, 54),
        ("auto with signs, rough everywhere", &noisy, Cell::Auto, viewpoint, 72),
        ("signs on a sphere", &sphere, Cell::Scale(1.5), consistent, 54),
        ("signs with a stray point", &stray(3e6), Cell::Auto, consistent, 54),
        ("signs in a solid, where patches are many", &noisy, Cell::Scale(1.5), consistent, 215),
    ] {
        let options = Options { cell, orient, ..Options::default() };
        let (result, peak) = peak_of(|| {
            estimate_owned(Points::from_vec(points.clone()).unwrap(), &options, &Progress::silent()).unwrap()
        });
        let each = peak / (points.len() / 3);
        println!("{name}: {each} bytes a point, {} cubes", result.report.cells);
        assert!(each <= bound, "{name}: {each} bytes a point");
    }
}

#[test]
fn a_file_is_written_where_it_fits_and_no_more() {
    let _alone = ALONE.lock();
    const POINTS: usize = 400_000;
    const MEBIBYTE: usize = 1 << 20;
    let mut random = Random(3);
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {POINTS}\n").into_bytes();
    text.extend_from_slice(b"property float x\nproperty float y\nproperty float z\nend_header\n");
    for _ in 0..POINTS {
        let [x, y, z] = [random.signed(), random.signed(), random.signed()];
        text.extend_from_slice(format!("{x:.5} {y:.4} {z:.3}\n").as_bytes());
    }
    let normals = vec![0.25; 3 * POINTS];
    let add = Additions { normals: Some(&normals), curvature: None };
    // With more than one, each may be refused a block.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for ascii in [false, true] {
        let write = || one.install(|| ply::write(&text, &add, ascii, &Progress::silent()));
        let expected = write().unwrap();
        let before = CURRENT.load(Relaxed);
        // Not half as much again: the parts that are being written take some.
        LIMIT.store(before + expected.len() + 6 * MEBIBYTE, Relaxed);
        let written = write();
        LIMIT.store(before + expected.len() - MEBIBYTE, Relaxed);
        let refused = write();
        LIMIT.store(usize::MAX, Relaxed);
        assert!(written.is_ok_and(|file| file == expected), "ascii: {ascii}");
        let Err(Error::Limit { needed, .. }) = refused else {
            panic!("ascii: {ascii}: {:?}", refused.map(|file| file.len()));
        };
        assert_eq!(needed, REFUSED.load(Relaxed) as u64, "what was refused is what is told");
        assert!(needed > FREE.load(Relaxed) as u64);
    }
}
