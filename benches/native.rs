//! The native rows of `npm run bench` (benches/speed/engines.mjs): estimates the normals of a file of raw 32-bit coordinates.
//!
//! Usage: `cargo bench --bench native -- FILE CELL RUNS THREADS`, with CELL `auto` or a multiple of L. Prints one JSON
//! object a run on standard output, after one run that is not counted.

#[path = "../tests/common/memory.rs"]
#[allow(dead_code)] // It is for tests, too.
mod memory;

use bilinormal::{Cell, Options, Points, Progress, estimate};
use memory::{CURRENT, PEAK};
use std::ops::ControlFlow;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Instant;

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
        PEAK.store(CURRENT.load(Relaxed), Relaxed);
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
