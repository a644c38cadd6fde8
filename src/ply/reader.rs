//! File bytes to a cloud.

use super::body::{Body, Part};
use super::columns::{self, Arrays, Column, Rows, Target};
use super::header::{Element, Header, decode};
use super::scalar::bits;
use super::{PointCloud, ReadOptions, tasks};
use crate::error::Error;
use crate::message::message;
use crate::parallel::{self, Scatter};
use crate::points::{SAMPLE, choose_origin, spread_in};
use crate::progress::Progress;
use glam::DVec3;

/// Points whose columns are read one after another while their bytes are in the nearest cache.
const BLOCK: usize = 1 << 10;

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
/// # Errors
/// [`Error::Format`] with the line or byte for a file that is not right or not PLY, [`Error::Input`] for more points
/// than `max_points`, [`Error::Limit`] for too little memory, [`Error::Cancelled`].
#[optimize(size)]
pub fn read(file: &[u8], options: &ReadOptions, progress: &Progress) -> Result<PointCloud, Error> {
    progress.update("read", 0.0)?;
    let header = Header::parse(file)?;
    let index = header.vertex()?;
    let vertex = &header.elements[index];
    let columns = columns::find(vertex)?.ok_or_else(|| header.without_position(vertex))?;
    if let Some(most) = options.max_points
        && vertex.count > most
    {
        let count = vertex.count;
        return Err(Error::Input(message!["the file declares ", count, " points; at most ", most, " were asked for"]));
    }
    let body = Body::locate(&header, file)?;
    let parts = body.parts(index);
    // Fits: there are as many rows in the file.
    let reader = Reader { vertex, columns: &columns, parts: &parts, count: vertex.count as usize };
    // Rows without lists and words are read column by column.
    let big_endian = header.is_big_endian();
    let stride = vertex.stride().filter(|_| header.format != super::Format::Ascii);
    let mut origin = DVec3::ZERO;
    if columns::is_wide(&columns) {
        origin = match stride {
            Some(stride) => reader.origin_of_fixed(stride, big_endian),
            None => reader.origin_of_any(),
        };
    }
    let arrays = Arrays::new(&columns, reader.count, origin)?;
    tasks::run(&progress.stage("read", 0.0..1.0), parts.len(), &|i| match stride {
        Some(stride) => {
            reader.read_fixed(&parts[i], stride, big_endian, &arrays);
            Ok(())
        }
        None => reader.walk(&parts[i], 1, &mut |point, column, value| {
            // SAFETY: parts share no point.
            unsafe { arrays.store(point, column, value) };
        }),
    })?;
    progress.update("read", 1.0)?;
    // SAFETY: the parts hold all points, and a row that lacks a value was refused.
    let (positions, normals, colors, intensity) = unsafe { arrays.complete() };
    Ok(PointCloud {
        positions,
        origin: origin.to_array(),
        normals: columns::has(&columns, Target::Normals).then_some(normals),
        colors: columns::has(&columns, Target::Colors).then_some(colors),
        intensity: columns::has(&columns, Target::Intensity).then_some(intensity),
        format: header.format,
        properties: vertex.properties.iter().map(|property| decode(property.name)).collect(),
        comments: header.comments(),
        viewpoint: viewpoint(&header, &body),
    })
}

/// The place of the first camera.
#[optimize(size)]
fn viewpoint(header: &Header, body: &Body) -> Option<[f64; 3]> {
    let index = header.elements.iter().position(|element| element.name == b"camera")?;
    let element = &header.elements[index];
    let [x, y, z] = [b"view_px", b"view_py", b"view_pz"].map(|name| columns::column(element, name));
    let columns = [x?, Column { component: 1, ..y? }, Column { component: 2, ..z? }];
    let parts = body.parts(index);
    let reader = Reader { vertex: element, columns: &columns, parts: &parts, count: 1 };
    let mut place = [f64::NAN; 3];
    let take = &mut |_: usize, column: &Column, value| place[column.component] = value;
    // The step passes over all rows but the first.
    reader.walk(parts.first()?, usize::MAX, take).ok()?;
    place.iter().all(|c| c.is_finite()).then_some(place)
}

/// What is read, and from where.
struct Reader<'a> {
    vertex: &'a Element<'a>,
    columns: &'a [Column],
    parts: &'a [Part<'a>],
    count: usize,
}

impl Reader<'_> {
    /// Binary rows of one length: columns, block by block.
    fn read_fixed(&self, part: &Part, stride: usize, big_endian: bool, arrays: &Arrays) {
        let rows = part.rows(stride);
        let mut first = 0;
        while first < part.count {
            let end = part.count.min(first + BLOCK);
            for columns in self.columns.chunk_by(Column::is_before) {
                let rows = Rows { bytes: &rows[first * stride..end * stride], stride };
                // SAFETY: parts share no point.
                unsafe { arrays.store_columns(part.first + first, rows, columns, big_endian) };
            }
            first = end;
        }
    }

    /// Calls back with each value that is read, in one of `step` rows of the element: those that a file of fixed rows is asked for.
    #[inline(never)]
    fn walk(&self, part: &Part, step: usize, each: &mut dyn FnMut(usize, &Column, f64)) -> Result<(), Error> {
        let vertex = self.vertex;
        let mut columns_of = vec![None; vertex.properties.len()];
        for column in self.columns {
            columns_of[column.property] = Some(column);
        }
        let mut cursor = part.cursor();
        for point in part.first..part.first + part.count {
            cursor.next_row();
            if step > 1 && point != spread_in(point / step, step, self.count) {
                cursor.skip_row(vertex)?;
                continue;
            }
            for (property, column) in vertex.properties.iter().zip(&columns_of) {
                match column {
                    Some(column) => each(point, column, cursor.number(column.scalar, vertex)?),
                    None => cursor.skip(property.kind, vertex)?,
                }
            }
            cursor.end_row(vertex)?;
        }
        Ok(())
    }

    fn origin_of_fixed(&self, stride: usize, big_endian: bool) -> DVec3 {
        choose_origin(self.count, &|point| {
            let mut position = DVec3::NAN;
            // All parts but the last are of one size.
            let part = &self.parts[point / self.parts[0].count];
            let row = &part.rows(stride)[(point - part.first) * stride..];
            for column in self.columns.iter().filter(|column| column.target == Target::Positions) {
                let value = &row[column.offset..column.offset + column.scalar.size()];
                position[column.component] = column.scalar.to_f64(bits(value, big_endian));
            }
            position
        })
    }

    fn origin_of_any(&self) -> DVec3 {
        let step = self.count.div_ceil(SAMPLE).max(1);
        let mut sample = vec![DVec3::NAN; self.count.div_ceil(step)];
        let places = Scatter::new(&mut sample);
        parallel::each(self.parts.len(), &|i| {
            // What cannot be read is passed over here; reading it for good gives the error.
            let _ = self.walk(&self.parts[i], step, &mut |point, column, value| {
                if column.target == Target::Positions {
                    // SAFETY: parts share no point.
                    let place = unsafe { places.slice(point / step..point / step + 1) };
                    place[0][column.component] = value;
                }
            });
        });
        choose_origin(sample.len(), &|index| sample[index])
    }
}
