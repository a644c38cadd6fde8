//! The border to JavaScript: typed arrays in, typed arrays out, and the only place that knows `wasm_bindgen`.
//!
//! Nothing is decided here. Each function reads its arguments, calls the crate, and hands the result over; whatever
//! goes wrong is thrown as an object with a `code`. Stopping a call is not the border's business either: the caller
//! ends the worker that runs it.
// What all functions throw stands above, once.
#![allow(clippy::missing_errors_doc)]

mod buffer;
mod error;
mod estimate;
mod memory;
mod options;
mod read;
#[cfg(feature = "full")]
mod write;

pub use buffer::Buffer;
pub use estimate::estimate;
pub use memory::set_maximum;
pub use read::read_ply;
#[cfg(feature = "threads")]
pub use wasm_bindgen_rayon::init_thread_pool;
#[cfg(feature = "full")]
pub use write::{write_cloud, write_ply};

use crate::error::Error;
use crate::progress::Progress;
use js_sys::{Function, Object, Reflect};
use std::ops::ControlFlow;
#[cfg(feature = "threads")]
use std::sync::{Condvar, Mutex, PoisonError};
use wasm_bindgen::prelude::*;
use web_sys::Performance;

#[cfg(all(feature = "threads", not(target_feature = "atomics")))]
compile_error!("feature `threads` needs atomics, in the standard library too: scripts/build.mjs has the flags");

/// Runs `work` with a progress that goes to `tell(phase, fraction)`, and measures its memory.
fn call<T: Send>(tell: &Function, work: impl FnOnce(&Progress) -> Result<T, Error> + Send) -> Result<T, JsValue> {
    memory::begin();
    let hear = |phase: &'static str, fraction: f64| {
        // What the listener throws is its own affair.
        let _ = tell.call2(&JsValue::UNDEFINED, &phase.into(), &fraction.into());
    };
    #[cfg(feature = "threads")]
    let result = in_pool(work, &hear);
    #[cfg(not(feature = "threads"))]
    let result = run(work, &hear);
    Ok(result?)
}

/// Runs `work` on a thread of the pool, and tells of its progress on this one, which has the listener. A loop that begins
/// outside of the pool has to wake a thread, which then wakes the next; within it one is awake.
#[cfg(feature = "threads")]
fn in_pool<T: Send>(
    work: impl FnOnce(&Progress) -> Result<T, Error> + Send,
    hear: &dyn Fn(&'static str, f64),
) -> Result<T, Error> {
    // What was not told yet, and whether that is all. Not a channel of the standard library: receiving hangs in WebAssembly.
    let (state, changed) = (Mutex::new((Vec::new(), false)), Condvar::new());
    let lock = || state.lock().unwrap_or_else(PoisonError::into_inner);
    let mut result = Err(Error::Cancelled);
    rayon::in_place_scope(|scope| {
        scope.spawn(|_| {
            let send = |phase, fraction| {
                lock().0.push((phase, fraction));
                changed.notify_one();
            };
            result = run(work, &send);
            lock().1 = true;
            changed.notify_one();
        });
        let mut ended = false;
        while !ended {
            let is_silent = |state: &mut (Vec<_>, bool)| state.0.is_empty() && !state.1;
            let mut state = changed.wait_while(lock(), is_silent).unwrap_or_else(PoisonError::into_inner);
            ended = state.1;
            let told = std::mem::take(&mut state.0);
            drop(state);
            told.into_iter().for_each(|(phase, fraction)| hear(phase, fraction));
        }
    });
    result
}

fn run<T>(work: impl FnOnce(&Progress) -> Result<T, Error>, hear: &dyn Fn(&'static str, f64)) -> Result<T, Error> {
    let observer = |phase: &'static str, fraction: f64| {
        hear(phase, fraction);
        ControlFlow::Continue(())
    };
    work(&Progress::new(&observer, &milliseconds))
}

#[wasm_bindgen]
extern "C" {
    /// A global of windows and workers, in browsers and in Node.
    #[wasm_bindgen(thread_local_v2, js_name = performance)]
    static PERFORMANCE: Performance;
}

fn milliseconds() -> f64 {
    PERFORMANCE.with(Performance::now)
}

/// A number for a message.
pub(crate) fn text(value: f64) -> String {
    // Radix 10 is never refused.
    js_sys::Number::from(value).to_string_with_radix(10).map(String::from).unwrap_or_default()
}

/// Sets a property of an object that this module has just made, which cannot fail.
fn set(object: &Object, name: &str, value: impl Into<JsValue>) {
    let _ = Reflect::set(object, &name.into(), &value.into());
}
