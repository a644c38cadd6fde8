//! Reading and writing PLY files.
//!
//! [`read`] gives a cloud; [`write()`] gives the file it came from, with normals; [`Stream`] and [`Rewrite`] do the same with a
//! file that comes in pieces; [`write_cloud`] makes a file from a cloud alone.
//!
//! ```text
//!                             ┌─ table ─┐
//!   header ── body ── cursor ─┼─ reader ┴─ columns ── PointCloud
//! stream ┤                    └─ writer ── sink ───── bytes
//! rewrite┘
//! ```
//!
//! Nothing in a file is trusted: counts are compared with the bytes that are there before memory is taken, and every
//! broken file ends in an [`Error::Format`](crate::Error::Format) that says where.

mod body;
mod cloud;
mod columns;
mod cursor;
mod header;
mod reader;
#[cfg(feature = "full")]
mod rewrite;
mod scalar;
mod sink;
#[cfg(feature = "full")]
mod stream;
mod table;
mod tasks;
mod writer;

use crate::points::Points;
use bytemuck::cast_slice;
use glam::DVec3;
use std::borrow::Cow;

pub use cloud::write_cloud;
pub use reader::read;
#[cfg(feature = "full")]
pub use rewrite::Rewrite;
#[cfg(feature = "full")]
pub use stream::{Next, Stream};
pub use writer::write;

/// What may be asked of [`read`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The most points to accept; a file with more is refused. Default: none, memory decides.
    pub max_points: Option<u64>,
}

/// The points of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct PointCloud {
    /// `x0 y0 z0 x1 ...`, relative to `origin`.
    pub positions: Vec<f32>,
    /// Added to a position it gives the file's coordinates; zero unless they need more than single precision gives.
    pub origin: [f64; 3],
    /// The file's own normals, three a point, as they stand.
    pub normals: Option<Vec<f32>>,
    /// Red, green, blue and alpha from 0 to 255; alpha is 255 where the file has none.
    pub colors: Option<Vec<u8>>,
    /// One a point, in the file's unit.
    pub intensity: Option<Vec<f32>>,
    /// How the file was stored.
    pub format: Format,
    /// The names of all vertex properties, in the order of the file.
    pub properties: Vec<String>,
    /// The texts of comments and `obj_info` lines.
    pub comments: Vec<String>,
    /// Where the scanner stood, in the file's coordinates: `view_px view_py view_pz` of its element `camera`, as VCGlib (MeshLab)
    /// and PCL write it.
    pub viewpoint: Option<[f64; 3]>,
}

impl PointCloud {
    /// The number of points.
    pub fn len(&self) -> usize {
        self.positions.len() / 3
    }

    /// Whether there are no points at all.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The positions as the estimator takes them, origin included; nothing is copied.
    pub fn points(&self) -> Points<'_> {
        let whole = &self.positions[..3 * self.len()];
        Points { positions: Cow::Borrowed(cast_slice(whole)), origin: DVec3::from_array(self.origin), unit: 1.0 }
    }
}

/// How the body of a PLY file is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Text.
    Ascii,
    /// Bytes, the lowest of a number first.
    BinaryLittleEndian,
    /// Bytes, the highest of a number first.
    BinaryBigEndian,
}

impl Format {
    /// The name in the header of a file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ascii => "ascii",
            Self::BinaryLittleEndian => "binary_little_endian",
            Self::BinaryBigEndian => "binary_big_endian",
        }
    }
}

/// What a writer adds to the points of a file or cloud.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Additions<'a> {
    /// `nx ny nz`, three a point.
    pub normals: Option<&'a [f32]>,
    /// `curvature`, one a point.
    pub curvature: Option<&'a [f32]>,
}
