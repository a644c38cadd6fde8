//! Normals of large scattered point clouds, in time linear in the number of points.
//!
//! The method is bilinear interpolation between nodes on a grid of cubes, after "An Investigation of the High
//! Efficiency Estimation Approach of the Large-Scale Scattered Point Cloud Normal Vector" ("the paper").
//!
//! ```text
//! file bytes -> points -> grid -> nodes -> normals
//!     ply       points    grid    nodes    normals
//! ```
#![warn(missing_docs)]

mod baseline;
mod bilinear;
mod bricks;
mod cell;
mod error;
mod estimate;
mod grid;
mod lattice;
mod nodes;
mod normals;
mod number;
mod options;
mod parallel;
mod pca;
pub mod ply;
mod points;
mod power;
mod progress;
mod surroundings;
#[cfg(target_arch = "wasm32")]
pub mod wasm;

pub use error::{Error, Place};
pub use estimate::{Estimate, Report, estimate};
pub use options::{Cell, Method, Options, Orient};
pub use points::Points;
pub use progress::Progress;
