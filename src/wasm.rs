//! The border to JavaScript: typed arrays in, typed arrays out, and the only place that knows `wasm_bindgen`.
//!
//! Nothing is decided here. Each function reads its arguments, calls the crate, and hands the result over; whatever
//! goes wrong is thrown as an `Error` with a `code`.

mod buffer;
mod error;
mod memory;
mod options;

pub use buffer::Buffer;
#[cfg(feature = "threads")]
pub use wasm_bindgen_rayon::init_thread_pool;

use js_sys::{Function, Object, Reflect};
use wasm_bindgen::prelude::*;

#[cfg(all(feature = "threads", not(target_feature = "atomics")))]
compile_error!("feature `threads` needs atomics, in the standard library too: scripts/build.mjs has the flags");

/// Sets a property of an object that this module has just made, which cannot fail.
fn set(object: &Object, name: &str, value: impl Into<JsValue>) {
    let _ = Reflect::set(object, &name.into(), &value.into());
}

/// Trivial.
#[wasm_bindgen]
pub fn threads() -> usize {
    crate::parallel::threads()
}
