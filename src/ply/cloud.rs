//! A PLY file from a cloud alone.

use super::columns::NAMES;
use super::sink::Sink;
use super::{Additions, PointCloud, write};
use crate::error::Error;
use crate::message::message;
use crate::number::print_whole;
use crate::progress::Progress;

/// Writes a cloud as a PLY file: positions, then normals, `red green blue alpha`, `intensity` and `curvature` where
/// they are there, then the comments in the header.
///
/// Positions are `float` with a zero origin, else `double` with the origin added. Normals of `add` take the place of
/// the cloud's. Little-endian, or text with `ascii`. Takes memory for the output, checked first; for text also for the
/// file that is not text.
///
/// # Errors
/// [`Error::Input`] for arrays of different lengths, [`Error::Limit`] for too little memory.
pub fn write_cloud(cloud: &PointCloud, add: &Additions, ascii: bool) -> Result<Vec<u8>, Error> {
    let count = cloud.len();
    let normals = add.normals.or(cloud.normals.as_deref());
    let (colors, intensity) = (cloud.colors.as_deref(), cloud.intensity.as_deref());
    check(cloud.positions.len(), 3, count, "positions")?;
    check(colors.map_or(4 * count, <[u8]>::len), 4, count, "colors")?;
    check(intensity.map_or(count, <[f32]>::len), 1, count, "intensity")?;
    Additions { normals, curvature: add.curvature }.check(count as u64)?;

    let mut sink = Sink::new(true);
    sink.append(b"ply\nformat binary_little_endian 1.0\n")?;
    for comment in &cloud.comments {
        sink.append(b"comment ")?;
        sink.line(comment.as_bytes())?;
    }
    sink.append(b"element vertex ")?;
    print_whole(&mut sink.bytes, count as u64);
    sink.append(b"\n")?;
    let shifted = cloud.origin != [0.0; 3];
    let groups: [(bool, &[u8], usize, &[&str]); 5] = [
        (true, if shifted { b"double" } else { b"float" }, if shifted { 8 } else { 4 }, NAMES[0].1),
        (normals.is_some(), b"float", 4, NAMES[1].1),
        (colors.is_some(), b"uchar", 1, NAMES[3].1),
        (intensity.is_some(), b"float", 4, NAMES[6].1),
        (add.curvature.is_some(), b"float", 4, &["curvature"]),
    ];
    let mut row = 0;
    for (_, kind, size, names) in groups.iter().filter(|(there, ..)| *there) {
        for name in *names {
            sink.words(&[b"property", kind, name.as_bytes()])?;
            row += size;
        }
    }
    sink.append(b"end_header\n")?;
    sink.make_room(row.saturating_mul(count))?;

    for point in 0..count {
        for axis in 0..3 {
            let value = cloud.positions[3 * point + axis];
            if shifted {
                sink.append(&(cloud.origin[axis] + f64::from(value)).to_le_bytes())?;
            } else {
                sink.append(&value.to_le_bytes())?;
            }
        }
        floats(&mut sink, normals, 3, point)?;
        if let Some(colors) = colors {
            sink.append(&colors[4 * point..4 * point + 4])?;
        }
        floats(&mut sink, intensity, 1, point)?;
        floats(&mut sink, add.curvature, 1, point)?;
    }
    if ascii { write(&sink.bytes, &Additions::default(), true, &Progress::silent()) } else { Ok(sink.bytes) }
}

/// The numbers of a point, if there are any.
fn floats(sink: &mut Sink, values: Option<&[f32]>, width: usize, point: usize) -> Result<(), Error> {
    let Some(values) = values else {
        return Ok(());
    };
    values[width * point..width * (point + 1)].iter().try_for_each(|value| sink.append(&value.to_le_bytes()))
}

fn check(length: usize, each: usize, count: usize, name: &str) -> Result<(), Error> {
    if length == each * count {
        return Ok(());
    }
    Err(Error::Input(message![name, " has ", length, " values; wanted ", each, " for each of the ", count, " points"]))
}
