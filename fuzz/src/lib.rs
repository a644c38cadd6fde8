//! What must hold for every input: one file for each part of the crate, used by the targets and by `stress.rs`.

pub mod clouds;
pub mod estimates;
#[path = "../../tests/common/memory.rs"]
mod memory;
pub mod ply;
mod random;

pub use memory::peak_of;
pub use random::Random;

use bilinormal::{Error, Progress};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::cell::Cell;
use std::ops::ControlFlow;
use std::sync::OnceLock;

/// Runs `work` on one thread, that of the caller, or on two others.
pub fn on<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    static POOLS: OnceLock<[ThreadPool; 2]> = OnceLock::new();
    let [one, two] = POOLS.get_or_init(|| {
        let one = ThreadPoolBuilder::new().num_threads(1).use_current_thread();
        [one, ThreadPoolBuilder::new().num_threads(2)].map(|pool| pool.build().unwrap())
    });
    if threads == 1 { one } else { two }.install(work)
}

/// A call that may be made again and again.
pub type Call<'a, T> = &'a (dyn Fn(&Progress) -> Result<T, Error> + Sync);

/// Makes a call on one thread, now and then on two, and stops one somewhere, as `chance` says: the same comes of it, progress
/// rises from 0 to 1, nothing is told after the stop. `is_same` compares two results.
pub fn call<T: Send>(call: Call<T>, chance: u64, is_same: impl Fn(&T, &T) -> bool) -> Result<T, Error> {
    let (one, told) = listen(1, u64::MAX, call);
    // To wake threads takes longer than most calls.
    if chance.is_multiple_of(4) {
        match (&one, &listen(2, u64::MAX, call).0) {
            (Ok(one), Ok(two)) => assert!(is_same(one, two), "one thread and two differ"),
            (one, two) => assert_eq!(one.as_ref().err(), two.as_ref().err(), "one thread and two"),
        }
    }
    if one.is_ok() {
        let stop = chance / 4 % told;
        assert_eq!(listen(1, stop, call).0.err(), Some(Error::Cancelled), "stopped at {stop} of {told}");
    }
    one
}

/// Makes a call that is stopped after it has told of itself `stop` times; answers how often it did.
fn listen<T: Send>(threads: usize, stop: u64, call: Call<T>) -> (Result<T, Error>, u64) {
    on(threads, || {
        let (told, last) = (Cell::new(0), Cell::new(0.0));
        let observer = |phase: &'static str, fraction: f64| {
            assert!(told.get() <= stop, "{phase} was told after the stop");
            assert!(told.get() > 0 || fraction == 0.0, "{phase} begins with {fraction}");
            assert!((last.get()..=1.0).contains(&fraction), "{phase}: {fraction} after {}", last.get());
            last.set(fraction);
            told.set(told.get() + 1);
            if told.get() > stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let result = call(&Progress::new(&observer, &|| 0.0));
        assert!(result.is_err() || last.get() == 1.0, "ends with {}", last.get());
        (result, told.get())
    })
}
