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

impl Column {
    /// Whether another one of the same type comes next, in binary rows as in the array.
    pub fn is_before(&self, other: &Self) -> bool {
        (other.target, other.component) == (self.target, self.component + 1)
            && (other.scalar, other.offset) == (self.scalar, self.offset + self.scalar.size())
    }
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
    fn floats(&self, column: &Column) -> (&Scatter<'_, f32>, usize, DVec3) {
        match column.target {
            Positions => (&self.floats[0], 3, self.origin),
            Normals => (&self.floats[1], 3, DVec3::ZERO),
            Intensity | Colors => (&self.floats[2], 1, DVec3::ZERO),
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
        place[0] = relative(value, origin[column.component]);
    }

    /// Reads columns of one type that lie side by side in binary rows, to the points from `first` on.
    ///
    /// # Safety
    /// As for `store`, for all these points.
    pub unsafe fn store_columns(&self, first: usize, rows: Rows, columns: &[Column], big_endian: bool) {
        let (floats, width, origin) = self.floats(&columns[0]);
        let Column { scalar, target, component, offset, .. } = columns[0];
        let of = |width: usize| width * first..width * (first + rows.bytes.len() / rows.stride);
        let is_foreign = big_endian != cfg!(target_endian = "big");
        // What stands in the file as the array has it is copied.
        let places = match (target, scalar) {
            // SAFETY: the caller's promise.
            (Colors, Scalar::U8) => Some(unsafe { self.colors.slice(of(4)) }),
            (Positions | Normals | Intensity, Scalar::F32) if !is_foreign && origin == DVec3::ZERO => {
                // SAFETY: the caller's promise.
                Some(bytemuck::cast_slice_mut(unsafe { floats.slice(of(width)) }))
            }
            _ => None,
        };
        if let Some(places) = places {
            let size = scalar.size();
            return rows.copy(offset, size * columns.len(), places, 4 * width, size * component);
        }
        for column in columns {
            if target == Colors || !matches!(scalar, Scalar::F32 | Scalar::F64) {
                for (row, point) in rows.bytes.chunks_exact(rows.stride).zip(first..) {
                    let value = &row[column.offset..column.offset + scalar.size()];
                    // SAFETY: the caller's promise.
                    unsafe { self.store(point, column, scalar.to_f64(bits(value, big_endian))) };
                }
                continue;
            }
            // SAFETY: the caller's promise.
            let places = unsafe { floats.slice(of(width)) }.chunks_exact_mut(width);
            let places = places.map(|place| &mut place[column.component]);
            let origin = origin[column.component];
            if scalar == Scalar::F64 {
                rows.convert(column, big_endian, places, |b| relative(f64::from_le_bytes(b), origin));
            } else {
                // Exact where the origin is zero.
                rows.convert(column, big_endian, places, |b| relative(f64::from(f32::from_le_bytes(b)), origin));
            }
        }
    }
}

/// Binary rows of `stride` bytes each.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub bytes: &'a [u8],
    pub stride: usize,
}

impl Rows<'_> {
    /// Copies some bytes of each row, from `offset` on, into the places of `width` bytes each, from `at` on.
    #[inline(never)]
    fn copy(self, offset: usize, length: usize, places: &mut [u8], width: usize, at: usize) {
        for (row, place) in self.bytes.chunks_exact(self.stride).zip(places.chunks_exact_mut(width)) {
            let (from, to) = (&row[offset..], &mut place[at..]);
            // With a length that the compiler knows a copy is one or two instructions.
            match length {
                12 => to[..12].copy_from_slice(&from[..12]),
                4 => to[..4].copy_from_slice(&from[..4]),
                3 => to[..3].copy_from_slice(&from[..3]),
                _ => to.iter_mut().zip(from).take(length).for_each(|(to, from)| *to = *from),
            }
        }
    }

    /// Converts a column of values of `N` bytes, which are handed over in little-endian order.
    #[inline]
    fn convert<'b, const N: usize>(
        self,
        column: &Column,
        big_endian: bool,
        places: impl Iterator<Item = &'b mut f32>,
        convert: impl Fn([u8; N]) -> f32,
    ) {
        for (row, place) in self.bytes.chunks_exact(self.stride).zip(places) {
            if let Some(bytes) = row[column.offset..].first_chunk::<N>() {
                let mut bytes = *bytes;
                if big_endian {
                    bytes.reverse();
                }
                *place = convert(bytes);
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
