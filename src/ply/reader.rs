//! File bytes to a cloud.

use super::body::{Body, Part};
use super::columns::{self, Arrays, Column, Target};
use super::header::{Element, Header, decode};
use super::table::Table;
use super::{PointCloud, ReadOptions, tasks};
use crate::error::Error;
use crate::message::message;
use crate::parallel::{self, Scatter};
use crate::points::{SAMPLE, choose_origin, spread_in};
use crate::progress::{Progress, Stage};
use glam::DVec3;

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
    let (index, columns) = wanted(&header, options)?;
    let vertex = &header.elements[index];
    let body = Body::locate(&header, file, file.len() as u64)?;
    // Fits: there are as many rows in the file.
    let count = vertex.count as usize;
    let stage = progress.stage("read", 0.0..1.0);
    let (columns, arrays) = if let Some(stride) = header.stride(index) {
        let mut table = Table::new(columns, stride, count, header.is_big_endian())?;
        while !table.take(body.bytes(index), &stage)? {}
        table.complete()
    } else {
        let arrays = Reader { vertex, columns: &columns, parts: &body.parts(index), count }.read(&stage)?;
        (columns, arrays)
    };
    progress.update("read", 1.0)?;
    // SAFETY: all rows were read, and one that lacks a value was refused.
    Ok(unsafe { cloud(&header, index, &columns, arrays, viewpoint(&header, &body)) })
}

/// The index of the element with the points, if they are not too many, and what is read of them.
pub(super) fn wanted(header: &Header, options: &ReadOptions) -> Result<(usize, Vec<Column>), Error> {
    let index = header.vertex()?;
    let vertex = &header.elements[index];
    let columns = columns::find(vertex)?.ok_or_else(|| header.without_position(vertex))?;
    if let Some(most) = options.max_points
        && vertex.count > most
    {
        let count = vertex.count;
        return Err(Error::Input(message!["the file declares ", count, " points; at most ", most, " were asked for"]));
    }
    Ok((index, columns))
}

/// The cloud of arrays that are filled.
///
/// # Safety
/// Each of the columns must have been stored for every point.
pub(super) unsafe fn cloud(
    header: &Header,
    vertex: usize,
    columns: &[Column],
    arrays: Arrays,
    viewpoint: Option<[f64; 3]>,
) -> PointCloud {
    let origin = arrays.origin.to_array();
    // SAFETY: by the caller's promise.
    let (positions, normals, colors, intensity) = unsafe { arrays.complete() };
    PointCloud {
        positions,
        origin,
        normals: columns::has(columns, Target::Normals).then_some(normals),
        colors: columns::has(columns, Target::Colors).then_some(colors),
        intensity: columns::has(columns, Target::Intensity).then_some(intensity),
        format: header.format,
        properties: header.elements[vertex].properties.iter().map(|property| decode(property.name)).collect(),
        comments: header.comments(),
        viewpoint,
    }
}

/// The element that may tell where the scanner stood.
pub(super) const CAMERA: &[u8] = b"camera";

/// The place of the first camera.
#[optimize(size)]
fn viewpoint(header: &Header, body: &Body) -> Option<[f64; 3]> {
    let index = header.elements.iter().position(|element| element.name == CAMERA)?;
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

/// Rows of text, and bytes in rows that differ in length: what is read of them, and from where.
struct Reader<'a> {
    vertex: &'a Element<'a>,
    columns: &'a [Column],
    parts: &'a [Part<'a>],
    count: usize,
}

impl Reader<'_> {
    fn read(&self, stage: &Stage) -> Result<Arrays, Error> {
        let origin = if columns::is_wide(self.columns) { self.origin() } else { DVec3::ZERO };
        let arrays = Arrays::new(self.columns, self.count, origin)?;
        tasks::run(stage, self.parts.len(), &|i| {
            self.walk(&self.parts[i], 1, &mut |point, column, value| {
                // SAFETY: parts share no point.
                unsafe { arrays.store(point, column, value) };
            })
        })?;
        Ok(arrays)
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

    fn origin(&self) -> DVec3 {
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
