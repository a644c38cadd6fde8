//! The border to JavaScript: typed arrays in, typed arrays out, and the only place that knows `wasm_bindgen`.
//!
//! Nothing is decided here. Each function reads its arguments, calls the crate, and hands the result over; whatever
//! goes wrong is thrown as an `Error` with a `code`. Stopping a call is not the border's business either: the caller
//! ends the worker that runs it.

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
use wasm_bindgen::prelude::*;
use web_sys::Performance;

#[cfg(all(feature = "threads", not(target_feature = "atomics")))]
compile_error!("feature `threads` needs atomics, in the standard library too: scripts/build.mjs has the flags");

/// Runs `work` with a progress that goes to `tell(phase, fraction)`, and measures its memory.
fn call<T>(tell: &Function, work: impl FnOnce(&Progress) -> Result<T, Error>) -> Result<T, JsValue> {
    memory::begin();
    let observer = |phase: &'static str, fraction: f64| {
        // What the listener throws is its own affair.
        let _ = tell.call2(&JsValue::UNDEFINED, &phase.into(), &fraction.into());
        ControlFlow::Continue(())
    };
    Ok(work(&Progress::new(&observer, &milliseconds))?)
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
