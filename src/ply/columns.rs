//! Which properties of a vertex mean what, and the arrays they go to.

use super::header::{Element, Kind, shorten};
use super::scalar::{Scalar, bits};
use crate::error::Error;
use crate::parallel::Scatter;
use crate::points::reserve;
use glam::DVec3;

/// One property that is read.
#[derive(Clone, Copy)]
pub(super) struct Column {
    /// Its place among the properties.
    pub property: usize,
    /// Its byte in a row; without meaning when rows differ in length.
    pub offset: usize,
    pub scalar: Scalar,
    pub target: Target,
    /// The component there.
    pub component: usize,
}

/// The array a property goes to.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Target {
    Positions,
    Normals,
    Colors,
    Intensity,
}
use Target::*;

/// What properties are called, the usual names first. The writer replaces normals of all these names.
pub(super) const NAMES: [(Target, &[&str]); 10] = [
    (Positions, &["x", "y", "z"]),
    (Normals, &["nx", "ny", "nz"]),
    (Normals, &["normal_x", "normal_y", "normal_z"]),
    (Colors, &["red", "green", "blue", "alpha"]),
    (Colors, &["diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"]),
    (Colors, &["r", "g", "b", "a"]),
    (Intensity, &["intensity"]),
    (Intensity, &["scalar_intensity"]),
    (Intensity, &["reflectance"]),
    (Intensity, &["scalar_reflectance"]),
];

/// The properties of `vertex` that are read, positions first; none without all of x y z as plain numbers.
#[optimize(size)]
pub(super) fn find(vertex: &Element) -> Result<Option<Vec<Column>>, Error> {
    let mut columns: Vec<Column> = Vec::new();
    for (target, names) in NAMES {
        if has(&columns, target) {
            continue;
        }
        let before = columns.len();
        for (component, name) in names.iter().enumerate() {
            if let Some(column) = column(vertex, name.as_bytes()) {
                columns.push(Column { target, component, ..column });
            } else if component < 3 {
                // All or nothing, but for alpha.
                columns.truncate(before);
                break;
            }
        }
        if columns.is_empty() {
            return Ok(None);
        }
    }
    for column in &columns[..3] {
        let name = vertex.properties[column.property].name;
        if vertex.properties.iter().filter(|property| property.name == name).count() > 1 {
            return Err(Error::format(
                None,
                format_args!("property {} of element vertex is declared twice; wanted one", shorten(name)),
            ));
        }
    }
    Ok(Some(columns))
}

/// The plain number called `name`, or called so in other letter case.
#[inline(never)]
pub(super) fn column(vertex: &Element, name: &[u8]) -> Option<Column> {
    let mut found = None;
    let mut offset = 0;
    for (property, declared) in vertex.properties.iter().enumerate() {
        let Kind::Scalar(scalar) = declared.kind else {
            continue;
        };
        let exact = declared.name == name;
        if exact || found.is_none() && declared.name.eq_ignore_ascii_case(name) {
            found = Some(Column { property, offset, scalar, target: Positions, component: 0 });
        }
        if exact {
            break;
        }
        offset += scalar.size();
    }
    found
}

/// Whether any column goes to that array.
pub(super) fn has(columns: &[Column], target: Target) -> bool {
    columns.iter().any(|column| column.target == target)
}

/// Whether single precision may lose what the coordinates say.
pub(super) fn is_wide(columns: &[Column]) -> bool {
    columns.iter().any(|column| column.target == Positions && column.scalar.is_wide())
}

/// The arrays of a cloud; those without a column stay empty.
pub(super) struct Arrays {
    pub positions: Vec<f32>,
    pub normals: Vec<f32>,
    pub colors: Vec<u8>,
    pub intensity: Vec<f32>,
}

impl Arrays {
    /// Takes memory for `count` points.
    #[optimize(size)]
    pub fn new(columns: &[Column], count: usize) -> Result<Self, Error> {
        let floats = |target, width: usize| {
            let mut items = Vec::new();
            if has(columns, target) {
                reserve(&mut items, width * count, "the cloud")?;
                items.resize(width * count, 0.0);
            }
            Ok::<Vec<f32>, Error>(items)
        };
        let mut colors = Vec::new();
        if has(columns, Colors) {
            reserve(&mut colors, 4 * count, "the cloud")?;
            // Opaque where the file has no alpha.
            colors.resize(4 * count, 255);
        }
        Ok(Self {
            positions: floats(Positions, 3)?,
            normals: floats(Normals, 3)?,
            colors,
            intensity: floats(Intensity, 1)?,
        })
    }

    /// To be filled by tasks, seen from an origin.
    pub fn places(&mut self, origin: DVec3) -> Places<'_> {
        Places {
            floats: [
                Scatter::new(&mut self.positions),
                Scatter::new(&mut self.normals),
                Scatter::new(&mut self.intensity),
            ],
            colors: Scatter::new(&mut self.colors),
            origin,
        }
    }
}

/// The arrays, each point of which one task writes.
pub(super) struct Places<'a> {
    floats: [Scatter<'a, f32>; 3],
    colors: Scatter<'a, u8>,
    origin: DVec3,
}

impl Places<'_> {
    fn floats(&self, column: &Column) -> (&Scatter<'_, f32>, usize, f64) {
        match column.target {
            Positions => (&self.floats[0], 3, self.origin[column.component]),
            Normals => (&self.floats[1], 3, 0.0),
            Intensity | Colors => (&self.floats[2], 1, 0.0),
        }
    }

    /// Puts one value where it belongs.
    ///
    /// # Safety
    /// No other thread may write to the same point.
    #[inline]
    pub unsafe fn store(&self, point: usize, column: &Column, value: f64) {
        if column.target == Colors {
            let place = 4 * point + column.component;
            // SAFETY: the caller's promise.
            let place = unsafe { self.colors.slice(place..place + 1) };
            place[0] = color(value, column.scalar);
            return;
        }
        let (floats, width, origin) = self.floats(column);
        let place = width * point + column.component;
        // SAFETY: the caller's promise.
        let place = unsafe { floats.slice(place..place + 1) };
        place[0] = relative(value, origin);
    }

    /// Reads one column of binary rows of `stride` bytes each to the points from `first` on.
    ///
    /// # Safety
    /// As for `store`, for all these points.
    pub unsafe fn store_column(&self, first: usize, rows: &[u8], stride: usize, column: &Column, big_endian: bool) {
        let source = Source { rows, stride, offset: column.offset, big_endian };
        let end = first + rows.len() / stride;
        if column.target == Colors && column.scalar == Scalar::U8 {
            // SAFETY: the caller's promise.
            let places = unsafe { self.colors.slice(4 * first..4 * end) };
            return source.each(places, 4, column.component, |[value]| value);
        }
        let (floats, width, origin) = self.floats(column);
        if column.target == Colors || !matches!(column.scalar, Scalar::F32 | Scalar::F64) {
            for (row, point) in rows.chunks_exact(stride).zip(first..) {
                let value = &row[column.offset..column.offset + column.scalar.size()];
                // SAFETY: the caller's promise.
                unsafe { self.store(point, column, column.scalar.to_f64(bits(value, big_endian))) };
            }
            return;
        }
        // SAFETY: the caller's promise.
        let places = unsafe { floats.slice(width * first..width * end) };
        if column.scalar == Scalar::F64 {
            source.each(places, width, column.component, |b| relative(f64::from_le_bytes(b), origin));
        } else {
            // Exact where the origin is zero.
            source.each(places, width, column.component, |b| relative(f64::from(f32::from_le_bytes(b)), origin));
        }
    }
}

/// One column of binary rows.
struct Source<'a> {
    rows: &'a [u8],
    stride: usize,
    offset: usize,
    big_endian: bool,
}

impl Source<'_> {
    /// Converts the `N` bytes of each row, in little-endian order, into one component of `places`.
    #[inline]
    fn each<const N: usize, T>(
        &self,
        places: &mut [T],
        width: usize,
        component: usize,
        convert: impl Fn([u8; N]) -> T,
    ) {
        for (row, places) in self.rows.chunks_exact(self.stride).zip(places.chunks_exact_mut(width)) {
            if let Some(bytes) = row[self.offset..].first_chunk::<N>() {
                let mut bytes = *bytes;
                if self.big_endian {
                    bytes.reverse();
                }
                places[component] = convert(bytes);
            }
        }
    }
}

/// The coordinate seen from the origin. What is finite stays finite: beyond the range of single precision it becomes
/// the largest number there is.
fn relative(value: f64, origin: f64) -> f32 {
    let near = (value - origin) as f32;
    if near.is_infinite() && value.is_finite() { f32::MAX.copysign(near) } else { near }
}

/// Floats run from 0 to 1; of 16 bits the upper 8 count; other whole numbers are taken as 0 to 255.
fn color(value: f64, scalar: Scalar) -> u8 {
    match scalar {
        Scalar::F32 | Scalar::F64 => (value * 255.0 + 0.5) as u8,
        Scalar::U16 => (value / 256.0) as u8,
        // Written by those who have no unsigned type: the same byte.
        Scalar::I8 => value.clamp(-128.0, 255.0) as i64 as u8,
        _ => value as u8,
    }
}
