//! Normals of large scattered point clouds, in time linear in the number of points.
#![warn(missing_docs)]

mod error;
mod options;
mod parallel;
pub mod ply;
mod points;
mod progress;
#[cfg(target_arch = "wasm32")]
pub mod wasm;

pub use error::{Error, Place};
pub use options::{Cell, Method, Options, Orient};
pub use points::Points;
pub use progress::Progress;
