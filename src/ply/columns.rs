//! Which properties of a vertex mean what, and the arrays they go to.

use super::header::{Element, Kind};
use super::scalar::{Scalar, bits};
use crate::error::Error;
use crate::points::reserve;
use glam::DVec3;
use std::mem::take;

/// One property that is read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    /// Its place among the properties.
    pub property: usize,
    /// Its byte in a row; without meaning when rows differ in length.
    pub offset: usize,
    pub scalar: Scalar,
    pub target: Target,
}

/// The array a property goes to, and the component there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Position(usize),
    Normal(usize),
    Color(usize),
    Intensity,
}

const POSITION: [[&str; 3]; 1] = [["x", "y", "z"]];
/// The names of existing normals; a writer replaces them.
pub(super) const NORMAL: [[&str; 3]; 2] = [["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"]];
const COLOR: [[&str; 4]; 3] = [
    ["red", "green", "blue", "alpha"],
    ["diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"],
    ["r", "g", "b", "a"],
];
const INTENSITY: [[&str; 1]; 4] = [["intensity"], ["scalar_intensity"], ["reflectance"], ["scalar_reflectance"]];

/// The properties of `vertex` that are read, positions first; none without all of x y z as plain numbers.
pub(super) fn find(vertex: &Element) -> Result<Option<Vec<Column>>, Error> {
    let mut columns = Vec::new();
    if !group(vertex, &POSITION, 3, &mut columns, Target::Position) {
        return Ok(None);
    }
    for column in &columns {
        let name = &vertex.properties[column.property].name;
        if vertex.properties.iter().filter(|property| property.name == *name).count() > 1 {
            return Err(Error::format(format!("property {name} of element vertex is declared twice; wanted one")));
        }
    }
    group(vertex, &NORMAL, 3, &mut columns, Target::Normal);
    group(vertex, &COLOR, 3, &mut columns, Target::Color);
    group(vertex, &INTENSITY, 1, &mut columns, |_| Target::Intensity);
    Ok(Some(columns))
}

/// Adds the first of the `sets` of names of which the first `needed` are all there.
fn group<const N: usize>(
    vertex: &Element,
    sets: &[[&str; N]],
    needed: usize,
    columns: &mut Vec<Column>,
    target: impl Fn(usize) -> Target,
) -> bool {
    for names in sets {
        let found = names.map(|name| column(vertex, name));
        if found[..needed].iter().all(Option::is_some) {
            let known = found.into_iter().enumerate();
            columns.extend(known.filter_map(|(component, column)| {
                column.map(|(property, offset, scalar)| Column { property, offset, scalar, target: target(component) })
            }));
            return true;
        }
    }
    false
}

/// Index, byte offset and type of the plain number called `name`, or called so in other letter case.
fn column(vertex: &Element, name: &str) -> Option<(usize, usize, Scalar)> {
    let plain = || {
        let mut offset = 0;
        vertex.properties.iter().enumerate().filter_map(move |(index, property)| {
            let Kind::Scalar(scalar) = property.kind else {
                return None;
            };
            offset += scalar.size();
            Some((&property.name, (index, offset - scalar.size(), scalar)))
        })
    };
    let exact = plain().find(|(other, _)| *other == name);
    exact.or_else(|| plain().find(|(other, _)| other.eq_ignore_ascii_case(name))).map(|(_, found)| found)
}

/// Whether single precision may lose what the coordinates say.
pub(super) fn is_wide(columns: &[Column]) -> bool {
    columns.iter().any(|column| matches!(column.target, Target::Position(_)) && column.scalar.is_wide())
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
    pub fn new(columns: &[Column], count: usize) -> Result<Self, Error> {
        fn filled<T: Copy>(wanted: bool, count: usize, value: T) -> Result<Vec<T>, Error> {
            let mut items = Vec::new();
            if wanted {
                reserve(&mut items, count, "the cloud")?;
                items.resize(count, value);
            }
            Ok(items)
        }
        let has = |target| columns.iter().any(|column| column.target == target);
        Ok(Self {
            positions: filled(true, 3 * count, 0.0)?,
            normals: filled(has(Target::Normal(0)), 3 * count, 0.0)?,
            // Opaque where the file has no alpha.
            colors: filled(has(Target::Color(0)), 4 * count, 255)?,
            intensity: filled(has(Target::Intensity), count, 0.0)?,
        })
    }

    /// Cuts the arrays into slices for so many points each.
    pub fn slices(&mut self, counts: impl Iterator<Item = usize>) -> Vec<Slices<'_>> {
        let (mut positions, mut normals) = (&mut self.positions[..], &mut self.normals[..]);
        let (mut colors, mut intensity) = (&mut self.colors[..], &mut self.intensity[..]);
        counts
            .map(|count| Slices {
                positions: split(&mut positions, 3 * count),
                normals: split(&mut normals, 3 * count),
                colors: split(&mut colors, 4 * count),
                intensity: split(&mut intensity, count),
            })
            .collect()
    }
}

fn split<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let all = take(rest);
    let (front, back) = all.split_at_mut(count.min(all.len()));
    *rest = back;
    front
}

/// The places of some consecutive points in all arrays.
pub(super) struct Slices<'a> {
    positions: &'a mut [f32],
    normals: &'a mut [f32],
    colors: &'a mut [u8],
    intensity: &'a mut [f32],
}

impl Slices<'_> {
    /// Puts one value where it belongs.
    pub fn store(&mut self, point: usize, column: &Column, value: f64, origin: DVec3) {
        let (numbers, index, value) = match column.target {
            Target::Position(axis) => (&mut *self.positions, 3 * point + axis, relative(value, origin[axis])),
            Target::Normal(axis) => (&mut *self.normals, 3 * point + axis, value as f32),
            Target::Intensity => (&mut *self.intensity, point, value as f32),
            Target::Color(channel) => {
                if let Some(place) = self.colors.get_mut(4 * point + channel) {
                    *place = color(value, column.scalar);
                }
                return;
            }
        };
        if let Some(place) = numbers.get_mut(index) {
            *place = value;
        }
    }

    /// Reads one column of binary rows of `stride` bytes each to the points from `first` on.
    pub fn store_column(
        &mut self,
        first: usize,
        rows: &[u8],
        stride: usize,
        column: &Column,
        origin: DVec3,
        big_endian: bool,
    ) {
        let source = Source { rows, stride, offset: column.offset, first, big_endian };
        let (numbers, width, component) = match column.target {
            Target::Position(axis) => (&mut *self.positions, 3, axis),
            Target::Normal(axis) => (&mut *self.normals, 3, axis),
            Target::Intensity => (&mut *self.intensity, 1, 0),
            Target::Color(channel) if column.scalar == Scalar::U8 => {
                return source.each(self.colors, 4, channel, |[value]| value);
            }
            Target::Color(channel) => {
                let scalar = column.scalar;
                return source.each_value(self.colors, 4, channel, scalar, |value| color(value, scalar));
            }
        };
        let origin = if let Target::Position(axis) = column.target { origin[axis] } else { 0.0 };
        match column.scalar {
            Scalar::F32 if origin == 0.0 => source.each(numbers, width, component, f32::from_le_bytes),
            Scalar::F64 => source.each(numbers, width, component, |b| relative(f64::from_le_bytes(b), origin)),
            scalar => source.each_value(numbers, width, component, scalar, |value| relative(value, origin)),
        }
    }
}

/// One column of binary rows.
struct Source<'a> {
    rows: &'a [u8],
    stride: usize,
    offset: usize,
    first: usize,
    big_endian: bool,
}

impl Source<'_> {
    /// Converts the `N` bytes of each row, in little-endian order, into one component of `places`.
    fn each<const N: usize, T>(
        &self,
        places: &mut [T],
        width: usize,
        component: usize,
        convert: impl Fn([u8; N]) -> T,
    ) {
        let places = places.get_mut(width * self.first..).unwrap_or_default();
        for (row, places) in self.rows.chunks_exact(self.stride).zip(places.chunks_exact_mut(width)) {
            if let Some(bytes) = row.get(self.offset..).and_then(<[u8]>::first_chunk::<N>) {
                let mut bytes = *bytes;
                if self.big_endian {
                    bytes.reverse();
                }
                places[component] = convert(bytes);
            }
        }
    }

    /// The same for any type, slower.
    fn each_value<T>(
        &self,
        places: &mut [T],
        width: usize,
        component: usize,
        scalar: Scalar,
        convert: impl Fn(f64) -> T,
    ) {
        let places = places.get_mut(width * self.first..).unwrap_or_default();
        let bytes = self.offset..self.offset + scalar.size();
        for (row, places) in self.rows.chunks_exact(self.stride).zip(places.chunks_exact_mut(width)) {
            if let Some(bytes) = row.get(bytes.clone()) {
                places[component] = convert(scalar.to_f64(bits(bytes, self.big_endian)));
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
        Scalar::F32 | Scalar::F64 => (value * 255.0).round() as u8,
        Scalar::U16 => (value / 256.0) as u8,
        // Written by those who have no unsigned type: the same byte.
        Scalar::I8 => value.clamp(-128.0, 255.0) as i64 as u8,
        _ => value as u8,
    }
}
