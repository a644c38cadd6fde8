//! The native rows of `npm run bench` (benches/speed/engines.mjs): estimates the normals of a file of raw 32-bit coordinates.
//!
//! Usage: `cargo bench --bench native -- FILE CELL RUNS THREADS`, with CELL `auto` or a multiple of L. Prints one JSON
//! object a run on standard output, after one run that is not counted.

use bilinormal::{Cell, Options, Points, Progress, estimate};
use std::alloc::{GlobalAlloc, Layout, System};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Instant;

static USED: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: passes every call on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(USED.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        USED.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Cargo adds an argument of its own at the end.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let [file, cell, runs, threads] = &arguments[..] else {
        return Err("wanted FILE CELL RUNS THREADS".into());
    };
    let cell = if cell == "auto" { Cell::Auto } else { Cell::Scale(cell.parse()?) };
    let options = Options { cell, ..Options::default() };
    let coordinates: Vec<f32> =
        std::fs::read(file)?.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let points = Points::from_f32(&coordinates)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.parse()?).build()?;

    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64() * 1e3;
    let go_on = |_: &'static str, _: f64| ControlFlow::Continue(());
    for run in 0..=runs.parse()? {
        PEAK.store(USED.load(Relaxed), Relaxed);
        let begin = clock();
        let report = pool.install(|| estimate(&points, &options, &Progress::new(&go_on, &clock)))?.report;
        let total = clock() - begin;
        if run > 0 {
            let phases: String =
                report.milliseconds.iter().map(|(phase, time)| format!(",\"{phase}\":{time:.3}")).collect();
            println!(
                "{{\"points\":{},\"peakBytes\":{},\"milliseconds\":{{\"total\":{total:.3}{phases}}}}}",
                report.points,
                PEAK.load(Relaxed)
            );
        }
    }
    Ok(())
}
