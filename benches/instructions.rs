//! What `npm run instructions` counts (scripts/instructions.mjs): one case, so many times, on a small cloud made here.
//!
//! Usage: `cargo bench --bench instructions -- CASE RUNS`. Prints nothing: the processor's instructions are counted from outside.

use bilinormal::{Cell, Options, Orient, Points, Progress, estimate, ply};
use std::error::Error;
use std::f32::consts::TAU;
use std::hint::black_box;

const POINTS: usize = 60_000;

/// A torus, a fifth of it rough: every way through the estimator is taken. In an order without order.
fn cloud() -> Vec<f32> {
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let point = |_| {
        let (around, along, rough) = (TAU * random(), TAU * random(), random());
        let ring = 0.4 + if along < 1.25 { 0.02 * rough } else { 0.0 };
        let radius = 1.0 + ring * around.cos();
        [radius * along.cos(), radius * along.sin(), ring * around.sin()]
    };
    (0..POINTS).flat_map(point).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds an argument of its own at the end.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let [case, runs] = &arguments[..] else {
        return Err("wanted CASE RUNS".into());
    };
    let cloud = cloud();
    let points = Points::from_f32(&cloud)?;
    let plain = Options::default();
    let options = match case.as_str() {
        "auto" => plain,
        "1.0 L" => Options { cell: Cell::Scale(1.0), ..plain },
        "1.0 L, consistent" => Options { cell: Cell::Scale(1.0), orient: Orient::Consistent, ..plain },
        "PLY, binary" | "PLY, ascii" => return read(&cloud, case.ends_with("ascii"), runs.parse()?),
        _ => return Err(format!("no case {case}").into()),
    };
    for _ in 0..runs.parse()? {
        black_box(estimate(&points, &options, &Progress::silent())?);
    }
    Ok(())
}

/// Reads a file of the cloud, in which normals are doubles and the points have colours.
fn read(cloud: &[f32], ascii: bool, runs: usize) -> Result<(), Box<dyn Error>> {
    let properties = [
        "float x",
        "float y",
        "float z",
        "double nx",
        "double ny",
        "double nz",
        "uchar red",
        "uchar green",
        "uchar blue",
    ];
    let properties: String = properties.map(|property| format!("property {property}\n")).concat();
    let header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {POINTS}\n{properties}end_header\n");
    let mut binary = header.into_bytes();
    for point in cloud.chunks(3) {
        binary.extend(point.iter().flat_map(|c| c.to_le_bytes()));
        binary.extend(point.iter().flat_map(|c| f64::from(*c).to_le_bytes()));
        binary.extend(point.iter().map(|c| (100.0 + 80.0 * c) as u8));
    }
    let file = ply::write(&binary, &ply::Additions::default(), ascii, &Progress::silent())?;
    for _ in 0..runs {
        black_box(ply::read(&file, &ply::ReadOptions::default(), &Progress::silent())?);
    }
    Ok(())
}
