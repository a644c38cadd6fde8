//! A PLY file from a cloud alone.

use super::scalar::Scalar;
use super::sink::Sink;
use super::waves::{TASK, in_waves};
use super::{Additions, Format, PointCloud};
use crate::error::Error;

/// Writes a cloud as a PLY file: positions, then normals, `red green blue alpha`, `intensity` and `curvature` where
/// they are there, then the comments in the header.
///
/// Positions are `float` with a zero origin, else `double` with the origin added. Normals of `add` take the place of
/// the cloud's. Little-endian, or text with `ascii`. Takes memory for the output, checked first.
///
/// Errors: [`Error::Input`] for arrays of different lengths, [`Error::Limit`] for too little memory.
pub fn write_cloud(cloud: &PointCloud, add: &Additions, ascii: bool) -> Result<Vec<u8>, Error> {
    let count = cloud.len();
    let rows = Rows {
        cloud,
        normals: add.normals.or(cloud.normals.as_deref()),
        curvature: add.curvature,
        shifted: cloud.origin != [0.0; 3],
    };
    check(cloud.positions.len(), 3, count, "positions")?;
    check(cloud.colors.as_ref().map_or(4 * count, Vec::len), 4, count, "colors")?;
    check(cloud.intensity.as_ref().map_or(count, Vec::len), 1, count, "intensity")?;
    Additions { normals: rows.normals, curvature: rows.curvature }.check(count as u64)?;

    let mut header = Sink::new(Vec::new(), false);
    let format = if ascii { Format::Ascii } else { Format::BinaryLittleEndian };
    header.append(format!("ply\nformat {} 1.0\n", format.name()).as_bytes())?;
    for comment in &cloud.comments {
        header.append(b"comment ")?;
        header.append(comment.replace(['\n', '\r'], " ").as_bytes())?;
        header.append(b"\n")?;
    }
    header.append(format!("element vertex {count}\n").as_bytes())?;
    let mut row_bytes = 0_usize;
    for (scalar, name) in rows.properties() {
        header.append(format!("property {} {name}\n", scalar.name()).as_bytes())?;
        row_bytes += scalar.size();
    }
    header.append(b"end_header\n")?;
    let mut sink = Sink::new(header.bytes, ascii);
    if !ascii {
        sink.make_room(row_bytes.saturating_mul(count))?;
    }
    let tasks = (0..count).step_by(TASK).collect();
    let work = |first: usize| {
        let mut sink = Sink::new(Vec::new(), ascii);
        let last = (first + TASK).min(count);
        sink.make_room((last - first) * row_bytes)?;
        (first..last).try_for_each(|point| rows.put(point, &mut sink))?;
        Ok(sink.bytes)
    };
    in_waves(tasks, work, |bytes| sink.append(&bytes))?;
    Ok(sink.bytes)
}

fn check(length: usize, each: usize, count: usize, name: &str) -> Result<(), Error> {
    if length == each * count {
        return Ok(());
    }
    Err(Error::Input(format!("{name} has {length} values; wanted {each} for each of the {count} points")))
}

struct Rows<'a> {
    cloud: &'a PointCloud,
    normals: Option<&'a [f32]>,
    curvature: Option<&'a [f32]>,
    shifted: bool,
}

impl Rows<'_> {
    fn properties(&self) -> Vec<(Scalar, &'static str)> {
        let position = if self.shifted { Scalar::F64 } else { Scalar::F32 };
        let groups: [(bool, Scalar, &[&str]); 5] = [
            (true, position, &["x", "y", "z"]),
            (self.normals.is_some(), Scalar::F32, &["nx", "ny", "nz"]),
            (self.cloud.colors.is_some(), Scalar::U8, &["red", "green", "blue", "alpha"]),
            (self.cloud.intensity.is_some(), Scalar::F32, &["intensity"]),
            (self.curvature.is_some(), Scalar::F32, &["curvature"]),
        ];
        let there = groups.into_iter().filter(|(there, ..)| *there);
        there.flat_map(|(_, scalar, names)| names.iter().map(move |name| (scalar, *name))).collect()
    }

    /// One row, in the order of `properties`. The lengths were checked.
    fn put(&self, point: usize, sink: &mut Sink) -> Result<(), Error> {
        let three = |values: &[f32]| [0, 1, 2].map(|axis| values[3 * point + axis]);
        for (value, origin) in three(&self.cloud.positions).into_iter().zip(self.cloud.origin) {
            if self.shifted {
                sink.value(Scalar::F64, (origin + f64::from(value)).to_bits())?;
            } else {
                sink.float(value)?;
            }
        }
        if let Some(normals) = self.normals {
            three(normals).into_iter().try_for_each(|value| sink.float(value))?;
        }
        if let Some(colors) = &self.cloud.colors {
            let channels = &colors[4 * point..4 * point + 4];
            channels.iter().try_for_each(|value| sink.value(Scalar::U8, u64::from(*value)))?;
        }
        if let Some(intensity) = &self.cloud.intensity {
            sink.float(intensity[point])?;
        }
        if let Some(curvature) = self.curvature {
            sink.float(curvature[point])?;
        }
        sink.end_row();
        Ok(())
    }
}
