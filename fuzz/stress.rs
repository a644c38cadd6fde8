//! Estimates of larger clouds than the fuzz target has, without end and without instruments.
//!
//! Usage: `cargo run --release --manifest-path fuzz/Cargo.toml --example stress -- [SEED]`. Tells the seed of what fails, and of
//! what takes far longer than other clouds do.

use arbitrary::{Result, Unstructured};
use laws::Random;
use laws::clouds::{Cloud, options};
use std::panic::catch_unwind;
use std::time::Instant;

/// Milliseconds a point, on one thread and two, with all checks: far more than any estimate should take.
const LONG: f64 = 1.0;

fn main() {
    let first = std::env::args().nth(1).map_or(0, |seed| seed.parse().expect("SEED is a number"));
    for seed in first.. {
        let mut random = Random(seed);
        let bytes: Vec<u8> = (0..1 << 10).map(|_| random.bits() as u8).collect();
        if seed % 1000 == 0 {
            println!("seed {seed}");
        }
        // What fails has told of itself.
        if catch_unwind(|| run(&mut Unstructured::new(&bytes)).expect("enough bytes")).is_err() {
            println!("seed {seed} failed");
        }
    }
}

fn run(u: &mut Unstructured) -> Result<()> {
    let most = *u.choose(&[1000, 1000, 10_000, 10_000, 100_000])?;
    let options = options(u, most)?;
    let stop = u.arbitrary::<u16>()?;
    let cloud = Cloud::of(u, most)?;
    let count = cloud.coordinates().len();
    let begin = Instant::now();
    laws::estimates::check(&cloud, &options, stop.into());
    let each = begin.elapsed().as_secs_f64() * 1e3 / count as f64;
    if count > 200 && each > LONG {
        println!("{count} points took {each} ms each: {options:?}");
    }
    Ok(())
}
