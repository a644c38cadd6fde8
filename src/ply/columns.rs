//! Which properties of a vertex mean what, and the arrays they go to.

use super::header::{Element, Kind, shorten};
use super::scalar::{Scalar, bits};
use crate::error::Error;
use crate::message::message;
use crate::parallel::Filling;
use glam::DVec3;
use std::mem::MaybeUninit;

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
    /// Whether `other` has the same type and comes right after it, in binary rows as in the array.
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
                message!["property ", shorten(name), " of element vertex is declared twice; wanted one"],
            ));
        }
    }
    Ok(Some(columns))
}

/// The plain number called `name`, or called so in other letter case.
#[optimize(size)]
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

/// The arrays of a cloud, filled by tasks, each of which has its own points; those without a column stay empty.
pub(super) struct Arrays {
    positions: Filling<f32>,
    normals: Filling<f32>,
    colors: Filling<u8>,
    intensity: Filling<f32>,
    /// What the positions are seen from.
    pub origin: DVec3,
}

impl Arrays {
    /// Takes memory for `count` points. The columns are those of [`find`]: of an array all components or none, but alpha.
    #[optimize(size)]
    pub fn new(columns: &[Column], count: usize, origin: DVec3) -> Result<Self, Error> {
        let length = |target, width: usize| if has(columns, target) { width * count } else { 0 };
        let floats = |target, width| Filling::new(length(target, width), "the cloud");
        let (positions, normals, intensity) = (floats(Positions, 3)?, floats(Normals, 3)?, floats(Intensity, 1)?);
        let colors = Filling::new(length(Colors, 4), "the cloud")?;
        // SAFETY: nothing else writes yet.
        let all = unsafe { colors.slice(0..length(Colors, 4)) };
        // Opaque where the file has no alpha.
        all.fill(MaybeUninit::new(255));
        Ok(Self { positions, normals, colors, intensity, origin })
    }

    /// Positions, normals, colours and intensity.
    ///
    /// # Safety
    /// Each of the columns that [`Arrays::new`] was told must have been stored for every point.
    pub unsafe fn complete(self) -> (Vec<f32>, Vec<f32>, Vec<u8>, Vec<f32>) {
        let Self { positions, normals, colors, intensity, .. } = self;
        // SAFETY: by the caller's promise, and because an array has all its columns or is empty; alpha had a value before.
        unsafe { (positions.complete(), normals.complete(), colors.complete(), intensity.complete()) }
    }

    fn floats(&self, column: &Column) -> (&Filling<f32>, usize, DVec3) {
        match column.target {
            Positions => (&self.positions, 3, self.origin),
            Normals => (&self.normals, 3, DVec3::ZERO),
            Intensity | Colors => (&self.intensity, 1, DVec3::ZERO),
        }
    }

    /// Puts one value where it belongs.
    ///
    /// # Safety
    /// No other thread may write to the same point.
    #[inline]
    pub unsafe fn store(&self, point: usize, column: &Column, value: f64) {
        if column.target == Colors {
            // SAFETY: the caller's promise.
            unsafe { self.colors.write(4 * point + column.component, color(value, column.scalar)) };
            return;
        }
        let (floats, width, origin) = self.floats(column);
        // SAFETY: the caller's promise.
        unsafe { floats.write(width * point + column.component, relative(value, origin[column.component])) };
    }

    /// Reads columns, at least one and each [before](Column::is_before) the next, to the points from `first` on.
    ///
    /// # Safety
    /// As for `store`, for all these points.
    pub unsafe fn store_columns(&self, first: usize, rows: Rows, columns: &[Column], big_endian: bool) {
        let (floats, width, origin) = self.floats(&columns[0]);
        let Column { scalar, target, component, offset, .. } = columns[0];
        let range = |width: usize| width * first..width * (first + rows.bytes.len() / rows.stride);
        let is_foreign = big_endian != cfg!(target_endian = "big");
        // What stands in the file as the array has it is copied.
        let places = match (target, scalar) {
            // SAFETY: the caller's promise.
            (Colors, Scalar::U8) => Some((unsafe { self.colors.slice(range(4)) }, 4)),
            (Positions | Normals | Intensity, Scalar::F32) if !is_foreign && origin == DVec3::ZERO => {
                // SAFETY: the caller's promise.
                Some((bytes_of(unsafe { floats.slice(range(width)) }), 4 * width))
            }
            _ => None,
        };
        if let Some((places, width)) = places {
            let size = scalar.size();
            return rows.copy(offset, size * columns.len(), places, width, size * component);
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
            let places = unsafe { floats.slice(range(width)) }.chunks_exact_mut(width);
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
    fn copy(self, offset: usize, length: usize, places: &mut [MaybeUninit<u8>], width: usize, at: usize) {
        for (row, place) in self.bytes.chunks_exact(self.stride).zip(places.chunks_exact_mut(width)) {
            let (from, to) = (&row[offset..], &mut place[at..]);
            // With a length that the compiler knows a copy is one or two instructions.
            match length {
                12 => _ = to[..12].write_copy_of_slice(&from[..12]),
                4 => _ = to[..4].write_copy_of_slice(&from[..4]),
                3 => _ = to[..3].write_copy_of_slice(&from[..3]),
                _ => to[..length].iter_mut().zip(&from[..length]).for_each(|(to, from)| _ = to.write(*from)),
            }
        }
    }

    /// Converts a column of values of `N` bytes, which are handed over in little-endian order.
    #[inline]
    fn convert<'b, const N: usize>(
        self,
        column: &Column,
        big_endian: bool,
        places: impl Iterator<Item = &'b mut MaybeUninit<f32>>,
        convert: impl Fn([u8; N]) -> f32,
    ) {
        for (row, place) in self.bytes.chunks_exact(self.stride).zip(places) {
            // Always so, for a column lies within its row; to panic if not makes the module half a KiB larger.
            if let Some(bytes) = row[column.offset..].first_chunk::<N>() {
                let mut bytes = *bytes;
                if big_endian {
                    bytes.reverse();
                }
                place.write(convert(bytes));
            }
        }
    }
}

/// The bytes of numbers that are not there yet.
fn bytes_of(places: &mut [MaybeUninit<f32>]) -> &mut [MaybeUninit<u8>] {
    // SAFETY: the same memory, and nothing is said about what it holds.
    unsafe { std::slice::from_raw_parts_mut(places.as_mut_ptr().cast(), size_of_val(places)) }
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
