//! File bytes to a cloud.

use super::columns::{self, Arrays, Column, Slices};
use super::header::{Element, Header, Kind};
use super::scalar::bits;
use super::text::{Part, Rows};
use super::waves::{Meter, TASK, in_waves};
use super::{Format, PointCloud, ReadOptions, binary};
use crate::error::Error;
use crate::parallel;
use crate::points::choose_origin;
use crate::progress::Progress;
use glam::DVec3;

/// Points whose columns are read one after another while their bytes are in the nearest cache.
const BLOCK: usize = 1 << 10;
/// Points between two looks at the progress where they are read one by one.
const MILLION: usize = 1 << 20;
/// The points that are looked at to choose an origin; the same number that `choose_origin` looks at.
const SAMPLE: usize = 4096;

/// Reads the points of a PLY file.
///
/// - The origin is zero unless the coordinates are of a type that single precision cannot hold (`double`, `int` and
///   wider) and lie far from zero. Coordinates that are not finite are kept. A finite `double` stays finite.
/// - Colours may be whole numbers of 8 or 16 bits, or floats from 0 to 1.
/// - A file without points gives an empty cloud.
/// - All elements of the file must be complete, faces too, though they are not read; bytes after the last one are
///   ignored. Rows of an ASCII file are one line each.
///
/// Takes 12 bytes a point, and 12, 4 and 4 more for normals, colours and intensity where the file has them; the
/// counts of a header are checked against the file first. Time is linear in the file, shared among threads, and the
/// result is the same for any number of them.
///
/// Errors: [`Error::Format`] with the line or byte for a file that is not right or not PLY, [`Error::Input`] for more
/// points than `max_points`, [`Error::Limit`] for too little memory, [`Error::Cancelled`].
pub fn read(file: &[u8], options: &ReadOptions, progress: &Progress) -> Result<PointCloud, Error> {
    progress.update("read", 0.0)?;
    let header = Header::parse(file)?;
    let index = header.vertex()?;
    let vertex = &header.elements[index];
    let columns = columns::find(vertex)?.ok_or_else(|| header.without_position(vertex))?;
    if let Some(most) = options.max_points
        && vertex.count > most
    {
        return Err(Error::Input(format!("the file declares {} points; at most {most} were asked for", vertex.count)));
    }
    let (arrays, origin) = match header.format {
        Format::Ascii => read_text(&header, file, index, &columns, progress)?,
        _ => {
            let bytes = binary::extents(&header, file)?.swap_remove(index);
            let big_endian = header.is_big_endian();
            match vertex.stride() {
                Some(stride) => read_fixed(&file[bytes], vertex, stride, big_endian, &columns, progress)?,
                None => read_variable(&file[bytes], vertex, big_endian, &columns, progress)?,
            }
        }
    };
    progress.update("read", 1.0)?;
    let Arrays { positions, normals, colors, intensity } = arrays;
    let has = |target| columns.iter().any(|column| column.target == target);
    Ok(PointCloud {
        positions,
        origin: origin.to_array(),
        normals: has(columns::Target::Normal(0)).then_some(normals),
        colors: has(columns::Target::Color(0)).then_some(colors),
        intensity: has(columns::Target::Intensity).then_some(intensity),
        format: header.format,
        properties: vertex.properties.iter().map(|property| property.name.clone()).collect(),
        comments: header.comments(),
    })
}

/// Binary rows of one length: columns, block by block, in parallel.
fn read_fixed(
    rows: &[u8],
    vertex: &Element,
    stride: usize,
    big_endian: bool,
    columns: &[Column],
    progress: &Progress,
) -> Result<(Arrays, DVec3), Error> {
    // Fits: the extent was checked against the file.
    let count = vertex.count as usize;
    let origin = if columns::is_wide(columns) {
        choose_origin(count, &|point| {
            let row = rows.get(point * stride..).unwrap_or_default();
            position(columns, |column| {
                let bytes = row.get(column.offset..column.offset + column.scalar.size())?;
                Some(column.scalar.to_f64(bits(bytes, big_endian)))
            })
        })
    } else {
        DVec3::ZERO
    };
    let mut arrays = Arrays::new(columns, count)?;
    let tasks = rows.chunks(stride.saturating_mul(TASK));
    let slices = arrays.slices(tasks.clone().map(|rows| rows.len() / stride));
    let mut meter = Meter { progress, phase: "read", done: 0, total: vertex.count };
    let work = |(rows, mut slices): (&[u8], Slices)| {
        for (block, block_rows) in rows.chunks(stride.saturating_mul(BLOCK)).enumerate() {
            for column in columns {
                slices.store_column(block * BLOCK, block_rows, stride, column, origin, big_endian);
            }
        }
        Ok(rows.len() / stride)
    };
    in_waves(tasks.zip(slices).collect(), work, |points| meter.add(points))?;
    Ok((arrays, origin))
}

/// Binary rows with lists in them: one after another.
fn read_variable(
    rows: &[u8],
    vertex: &Element,
    big_endian: bool,
    columns: &[Column],
    progress: &Progress,
) -> Result<(Arrays, DVec3), Error> {
    let count = vertex.count as usize;
    let columns_of = by_property(vertex, columns);
    // Calls back with each value that is read.
    let walk = |each: &mut dyn FnMut(usize, &Column, f64) -> Result<(), Error>| -> Result<(), Error> {
        let mut at = 0;
        for point in 0..count {
            let mut outcome = Ok(());
            at = binary::visit_row(&vertex.properties, rows, at, big_endian, |property, bytes| {
                if let Some(column) = columns_of[property]
                    && outcome.is_ok()
                {
                    outcome = each(point, column, column.scalar.to_f64(bits(bytes, big_endian)));
                }
            })
            .map_err(|fault| fault.error(vertex, point as u64, at))?;
            outcome?;
        }
        Ok(())
    };
    let mut origin = DVec3::ZERO;
    if columns::is_wide(columns) {
        let step = count.div_ceil(SAMPLE).max(1);
        let mut sample = vec![DVec3::NAN; count.div_ceil(step)];
        walk(&mut |point, column, value| {
            if let columns::Target::Position(axis) = column.target
                && point % step == 0
            {
                sample[point / step][axis] = value;
            }
            Ok(())
        })?;
        origin = choose_origin(sample.len(), &|index| sample[index]);
    }
    let mut arrays = Arrays::new(columns, count)?;
    let mut slices = arrays.slices([count].into_iter());
    walk(&mut |point, column, value| {
        if point % (MILLION) == 0 {
            progress.update("read", point as f64 / count as f64)?;
        }
        slices[0].store(point, column, value, origin);
        Ok(())
    })?;
    Ok((arrays, origin))
}

/// Rows of text: pieces in parallel.
fn read_text(
    header: &Header,
    file: &[u8],
    index: usize,
    columns: &[Column],
    progress: &Progress,
) -> Result<(Arrays, DVec3), Error> {
    let vertex = &header.elements[index];
    let rows = Rows::index(header, file)?;
    let parts = rows.parts(&rows.elements[index]);
    // Fits: there are as many lines in the file.
    let count = vertex.count as usize;
    let columns_of = by_property(vertex, columns);
    let mut origin = DVec3::ZERO;
    if columns::is_wide(columns) {
        let step = count.div_ceil(SAMPLE).max(1) as u64;
        let sample = parallel::map(parts.iter().collect(), |part: &Part| sample_text(part, step, vertex, &columns_of));
        let sample: Vec<DVec3> = sample.into_iter().flatten().collect();
        origin = choose_origin(sample.len(), &|index| sample[index]);
    }
    let mut arrays = Arrays::new(columns, count)?;
    let slices = arrays.slices(parts.iter().map(|part| part.count));
    let mut meter = Meter { progress, phase: "read", done: 0, total: vertex.count };
    let work = |(part, mut slices): (Part, Slices)| {
        let mut cursor = part.cursor();
        for point in 0..part.count {
            cursor.next_row();
            for (property, column) in vertex.properties.iter().zip(&columns_of) {
                match column {
                    Some(column) => {
                        let value = cursor.number(column.scalar).ok_or_else(|| cursor.complain(vertex))?;
                        slices.store(point, column, value, origin);
                    }
                    None => cursor.skip_property(property.kind, vertex)?,
                }
            }
            cursor.end_row(vertex)?;
        }
        Ok(part.count)
    };
    in_waves(parts.into_iter().zip(slices).collect(), work, |points| meter.add(points))?;
    Ok((arrays, origin))
}

/// The positions of every `step`th row of the element. Rows that cannot be read are passed over here; reading them
/// for good gives the error.
fn sample_text(part: &Part, step: u64, vertex: &Element, columns_of: &[Option<&Column>]) -> Vec<DVec3> {
    let mut cursor = part.cursor();
    let mut sample = Vec::new();
    for row in part.first..part.first + part.count as u64 {
        cursor.next_row();
        if row % step == 0 {
            let mut point = DVec3::NAN;
            for (property, column) in vertex.properties.iter().zip(columns_of) {
                if let (Some(column), Kind::Scalar(_)) = (column, property.kind)
                    && let columns::Target::Position(axis) = column.target
                {
                    point[axis] = cursor.number(column.scalar).unwrap_or(f64::NAN);
                } else if cursor.skip_property(property.kind, vertex).is_err() {
                    break;
                }
            }
            sample.push(point);
        }
        cursor.skip_row();
    }
    sample
}

/// The column of each property, for those that are read.
fn by_property<'c>(vertex: &Element, columns: &'c [Column]) -> Vec<Option<&'c Column>> {
    let mut columns_of = vec![None; vertex.properties.len()];
    for column in columns {
        columns_of[column.property] = Some(column);
    }
    columns_of
}

/// A point in double precision, by the values of its columns; NaN where one is missing.
fn position(columns: &[Column], value: impl Fn(&Column) -> Option<f64>) -> DVec3 {
    let mut point = DVec3::NAN;
    for column in columns {
        if let columns::Target::Position(axis) = column.target {
            point[axis] = value(column).unwrap_or(f64::NAN);
        }
    }
    point
}
