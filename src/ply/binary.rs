//! The body of a binary file: where each element lies, and its rows property by property.

use super::header::{Element, Header, Kind, Property};
use super::scalar::bits;
use crate::error::{Error, Place};
use std::ops::Range;

/// Why a row cannot be read.
pub(super) enum Fault {
    /// The file ends within it.
    Ends,
    /// A list in it claims this many values.
    List(i128),
}

/// The bytes of each element of the body, each checked against the bytes that are there. Costs one step for an element
/// of fixed rows and one for every list in the others; takes no memory for rows.
pub(super) fn extents(header: &Header, file: &[u8]) -> Result<Vec<Range<usize>>, Error> {
    let mut start = header.body;
    let mut extents = Vec::with_capacity(header.elements.len());
    for element in &header.elements {
        let end = match element.stride() {
            Some(stride) => fixed_end(element, stride, file, start)?,
            None => variable_end(element, file, start, header.is_big_endian())?,
        };
        extents.push(start..end);
        start = end;
    }
    Ok(extents)
}

fn fixed_end(element: &Element, stride: usize, file: &[u8], start: usize) -> Result<usize, Error> {
    let there = file.len() - start;
    let needed = u128::from(element.count) * stride as u128;
    if needed <= there as u128 {
        return Ok(start + needed as usize);
    }
    let rows = there / stride;
    Err(Error::format_at(
        Place::Byte((start + rows * stride) as u64),
        format!(
            "the file ends after {rows} of {} rows of element {}: {there} bytes are there, {needed} wanted",
            element.count, element.name
        ),
    ))
}

fn variable_end(element: &Element, file: &[u8], start: usize, big_endian: bool) -> Result<usize, Error> {
    let mut at = start;
    // Rows with a list have at least the byte of its length, so the file bounds this loop, whatever the count.
    for row in 0..element.count {
        at = visit_row(&element.properties, file, at, big_endian, |_, _| ())
            .map_err(|fault| fault.error(element, row, at))?;
    }
    Ok(at)
}

/// Calls `visit` with the index and the bytes of each property of the row at `at`, the length of a list included, and
/// returns where the next row begins.
pub(super) fn visit_row<'a>(
    properties: &[Property],
    file: &'a [u8],
    mut at: usize,
    big_endian: bool,
    mut visit: impl FnMut(usize, &'a [u8]),
) -> Result<usize, Fault> {
    for (index, property) in properties.iter().enumerate() {
        let rest = file.get(at..).ok_or(Fault::Ends)?;
        let size = match property.kind {
            Kind::Scalar(scalar) => scalar.size(),
            Kind::List { count, item } => {
                let word = bits(rest.get(..count.size()).ok_or(Fault::Ends)?, big_endian);
                let (least, _) = count.range();
                let length = if least < 0 { i128::from(count.to_i64(word)) } else { i128::from(word) };
                let size = count.size() as i128 + length * item.size() as i128;
                if length < 0 || size > rest.len() as i128 {
                    return Err(Fault::List(length));
                }
                size as usize
            }
        };
        visit(index, rest.get(..size).ok_or(Fault::Ends)?);
        at += size;
    }
    Ok(at)
}

impl Fault {
    /// The error for a row of `element` that begins at byte `at`.
    pub fn error(self, element: &Element, row: u64, at: usize) -> Error {
        let Element { name, count, .. } = element;
        Error::format_at(
            Place::Byte(at as u64),
            match self {
                Self::Ends => {
                    format!("the file ends after {row} of {count} rows of element {name}")
                }
                Self::List(length) if length < 0 => {
                    format!("row {row} of element {name} has a list of {length} values; wanted 0 or more")
                }
                Self::List(length) => {
                    format!(
                        "row {row} of {count} of element {name} has a list of {length} values, which runs past the end of the file"
                    )
                }
            },
        )
    }
}
