//! Normals of large scattered point clouds, in time linear in the number of points.
//!
//! With [`Cell::Auto`], the default, a normal comes from curved surfaces through neighbourhoods of the size that noise and
//! detail allow (docs/adaptive.md). With cubes of one size the method is bilinear interpolation between nodes on their
//! grid, after "An Investigation of the High Efficiency Estimation Approach of the Large-Scale Scattered Point Cloud
//! Normal Vector" ("the paper").
//!
//! ```text
//! file bytes -> points -> grid -> nodes or surfaces -> normals -> signs
//!     ply       points    grid    nodes, adaptive      normals   orient
//! ```
//!
//! ```
//! use bilinormal::{Options, Points, Progress, estimate};
//!
//! // A square, as x0 y0 z0 x1 ...
//! let positions: Vec<f32> = (0..100).flat_map(|i| [(i % 10) as f32, (i / 10) as f32, 0.0]).collect();
//! let estimate = estimate(&Points::from_f32(&positions)?, &Options::default(), &Progress::silent())?;
//! assert!((estimate.normals[2] - 1.0).abs() < 1e-6);
//! # Ok::<(), bilinormal::Error>(())
//! ```
//!
//! Features, both on by default: `parallel`, loops over rayon; `full`, all options but the default ones. Needs a nightly
//! compiler, for the two features of the language below: that of `rust-toolchain.toml` in the repository.
#![warn(missing_docs, clippy::missing_errors_doc)]
// What runs once in a call is compiled for size: the modules that browsers download must stay small.
#![feature(optimize_attribute)]
// The square roots of four lanes at once.
#![feature(portable_simd)]

mod adaptive;
mod baseline;
mod bilinear;
mod bricks;
mod cell;
mod error;
mod estimate;
mod frame;
mod grid;
mod lanes;
mod lattice;
mod lists;
mod median;
mod message;
mod nodes;
mod normals;
mod number;
mod options;
mod order;
mod orient;
mod parallel;
mod pca;
pub mod ply;
mod points;
mod power;
mod progress;
mod rounding;
mod source;
mod surroundings;
#[cfg(target_arch = "wasm32")]
pub mod wasm;

pub use error::{Error, Place};
pub use estimate::{Estimate, Report, Scale, estimate, estimate_owned};
pub use options::{Cell, Method, Options, Orient};
pub use orient::{Component, Components, Side};
pub use points::Points;
pub use progress::Progress;
