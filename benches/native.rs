//! Native figures of `npm run bench`: one JSON line a measurement on standard output.
//!
//! Usage: `cargo bench --bench native -- [points ...]`

use bilinormal::{Cell, Options, Points, Progress, estimate};
use std::ops::ControlFlow;
use std::time::Instant;

fn main() {
    let sizes: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64() * 1e3;
    let observer = |_: &'static str, _: f64| ControlFlow::Continue(());
    for n in sizes {
        let cloud = sphere(n);
        for cell in [Cell::Scale(0.5), Cell::Scale(1.0), Cell::Scale(1.5), Cell::Scale(3.0), Cell::Auto] {
            let options = Options { cell, ..Options::default() };
            for _ in 0..3 {
                let t = Instant::now();
                let e =
                    estimate(&Points::from_f32(&cloud).unwrap(), &options, &Progress::new(&observer, &clock)).unwrap();
                let ms = t.elapsed().as_secs_f64() * 1e3;
                let r = &e.report;
                let (mut sum, mut sq, mut worst) = (0.0, 0.0, 0.0f64);
                for (p, n) in cloud.chunks(3).zip(e.normals.chunks(3)) {
                    let dot: f64 = (0..3).map(|i| f64::from(p[i]) * f64::from(n[i])).sum();
                    let dev = (2.0 - 2.0 * dot.abs().min(1.0)).max(0.0).sqrt();
                    sum += dev;
                    sq += dot.abs().min(1.0).acos().to_degrees().powi(2);
                    worst = worst.max(dot.abs().min(1.0).acos().to_degrees());
                }
                println!(
                    "{n} {cell:?} {ms:.1} ms mean {:.5} rms {:.3} worst {worst:.2} cells {} nodes {} used {:?} unres {} scale {:.3} {:?}",
                    sum / n as f64,
                    (sq / n as f64).sqrt(),
                    r.cells,
                    r.nodes,
                    r.nodes_used.map(|u| (1000.0 * u as f64 / n as f64).round() / 10.0),
                    r.unresolved,
                    r.scale,
                    r.milliseconds.iter().map(|(p, t)| format!("{p} {t:.1}")).collect::<Vec<_>>()
                );
            }
        }
    }
}

fn sphere(count: usize) -> Vec<f32> {
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..count)
        .flat_map(|_| {
            let z = 2.0 * random() - 1.0;
            let angle = std::f64::consts::TAU * random();
            let r = (1.0 - z * z).sqrt();
            [(r * angle.cos()) as f32, (r * angle.sin()) as f32, z as f32]
        })
        .collect()
}
