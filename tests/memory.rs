//! Memory grows with the points, never with the bounding box.
#![cfg(not(target_arch = "wasm32"))]

mod common;

use bilinormal::{Cell, Options, Orient, Points, Progress, estimate_owned};
use common::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

static CURRENT: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: passes every call on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = CURRENT.fetch_add(layout.size(), Relaxed) + layout.size();
        PEAK.fetch_max(now, Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        CURRENT.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// One test, because the counter is one for the process.
#[test]
fn peak_bytes_a_point() {
    let sphere = sphere(1_000_000, 1).points;
    let stray = |far: f32| [sphere.clone(), vec![far, far, far]].concat();
    // In a solid no surface fits: every cube is divided as far as it goes.
    let mut random = Random(2);
    let noisy: Vec<f32> = (0..3_000_000).map(|_| random.signed() as f32).collect();
    let needle: Vec<f32> = (0..3_000_000)
        .map(|i| if i % 3 == 0 { 1e6 * random.signed() as f32 } else { random.signed() as f32 })
        .collect();
    // Input and normals are 12 bytes each; the input is given up before, unless signs need it.
    let (none, consistent, viewpoint) = (Orient::None, Orient::Consistent, Orient::Viewpoint([9.0; 3]));
    for (name, points, cell, orient, bound) in [
        ("sphere, 1.5 L", &sphere, Cell::Scale(1.5), none, 34),
        ("sphere, 1.0 L", &sphere, Cell::Scale(1.0), none, 34),
        ("sphere, auto", &sphere, Cell::Auto, none, 40),
        ("a stray point", &stray(3e6), Cell::Auto, none, 40),
        ("a stray point beyond all cubes", &stray(-1e30), Cell::Auto, none, 40),
        ("rough everywhere", &noisy, Cell::Auto, none, 60),
        ("a needle", &needle, Cell::Scale(1.0), none, 74),
        ("as many cubes as points", &sphere, Cell::Scale(0.1), none, 92),
        ("far more cubes than points", &sphere, Cell::Size(1e-6), none, 130),
        ("auto with signs on a sphere", &sphere, Cell::Auto, consistent, 54),
        ("auto with signs, rough everywhere", &noisy, Cell::Auto, viewpoint, 72),
        ("signs on a sphere", &sphere, Cell::Scale(1.5), consistent, 54),
        ("signs with a stray point", &stray(3e6), Cell::Auto, consistent, 54),
        ("signs in a solid, where patches are many", &noisy, Cell::Scale(1.5), consistent, 215),
    ] {
        let before = CURRENT.load(Relaxed);
        PEAK.store(before, Relaxed);
        let options = Options { cell, orient, ..Options::default() };
        let result = estimate_owned(Points::from_vec(points.clone()).unwrap(), &options, &Progress::silent()).unwrap();
        let peak = PEAK.load(Relaxed) - before;
        let each = peak / (points.len() / 3);
        println!("{name}: {each} bytes a point, {} cubes", result.report.cells);
        assert!(each <= bound, "{name}: {each} bytes a point");
    }
}
