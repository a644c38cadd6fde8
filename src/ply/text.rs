//! The body of an ASCII file: one row a line, blank lines passed over.
//!
//! The body is cut into pieces at line ends. A first pass counts the rows and line ends of every piece, so that the
//! pieces can then be read in parallel with every row knowing its number and every error its line.

use super::header::{Element, Header, Kind, shorten};
use super::scalar::Scalar;
use crate::error::{Error, Place};
use crate::parallel;
use std::ops::Range;

/// Bytes of a piece: small enough to share among threads, large enough that the table of pieces is nothing.
const PIECE: usize = 256 << 10;

/// Where the rows of an ASCII body are.
pub(super) struct Rows<'a> {
    pieces: Vec<Piece<'a>>,
    line_end: u8,
    /// The rows of each element, counted through the whole body.
    pub elements: Vec<Range<u64>>,
}

struct Piece<'a> {
    bytes: &'a [u8],
    first_row: u64,
    first_line: u64,
}

/// Some rows of one element, in one piece.
pub(super) struct Part<'a> {
    piece: Cursor<'a>,
    skip: u64,
    /// The number of the first row within its element.
    pub first: u64,
    pub count: usize,
}

impl<'a> Rows<'a> {
    /// Counts the rows and checks that all the header declares are there. Takes memory for the table of pieces only.
    pub fn index(header: &Header, file: &'a [u8]) -> Result<Self, Error> {
        let mut cuts = Vec::new();
        let mut rest = file.get(header.body..).unwrap_or_default();
        while !rest.is_empty() {
            let sure = rest.len().min(PIECE);
            let more = rest[sure..].iter().position(|byte| *byte == header.line_end);
            let (piece, after) = rest.split_at(more.map_or(rest.len(), |more| sure + more + 1));
            cuts.push(piece);
            rest = after;
        }
        let counts = parallel::map(cuts.clone(), |piece| count_rows(piece, header.line_end));
        let (mut row, mut line) = (0, header.body_line);
        let mut pieces = Vec::with_capacity(cuts.len());
        for (bytes, (rows, lines)) in cuts.into_iter().zip(counts) {
            pieces.push(Piece { bytes, first_row: row, first_line: line });
            row += rows;
            line += lines;
        }
        let mut elements = Vec::with_capacity(header.elements.len());
        let mut first = 0;
        for element in &header.elements {
            // Rows without values leave no line.
            let count = if element.properties.is_empty() { 0 } else { element.count };
            let there = row - first;
            if there < count {
                return Err(Error::format_at(
                    Place::Line(line),
                    format!("the file ends after {there} of {count} rows of element {}", element.name),
                ));
            }
            elements.push(first..first + count);
            first += count;
        }
        // Rows of too few values are found later, with their line; this only keeps them from costing much memory.
        const FEW: u128 = 1 << 20;
        let values: u128 = header.elements.iter().map(|e| u128::from(e.count) * e.properties.len() as u128).sum();
        let bytes = file.len() - header.body;
        if values > FEW && values * 2 > bytes as u128 + 1 {
            return Err(Error::format_at(
                Place::Line(header.body_line),
                format!("{bytes} bytes of text cannot hold the {values} values that the header declares"),
            ));
        }
        Ok(Self { pieces, line_end: header.line_end, elements })
    }

    /// The rows of one element, cut at the ends of pieces.
    pub fn parts(&self, rows: &Range<u64>) -> Vec<Part<'a>> {
        let ends = self.pieces.iter().skip(1).map(|piece| piece.first_row).chain([u64::MAX]);
        let overlap = |(piece, end): (&Piece<'a>, u64)| {
            let start = piece.first_row.max(rows.start);
            let count = end.min(rows.end).saturating_sub(start);
            (count > 0).then(|| Part {
                piece: Cursor::new(piece.bytes, self.line_end, piece.first_line),
                skip: start - piece.first_row,
                first: start - rows.start,
                count: count as usize,
            })
        };
        self.pieces.iter().zip(ends).filter_map(overlap).collect()
    }
}

impl<'a> Part<'a> {
    /// A cursor before the part's first row.
    pub fn cursor(&self) -> Cursor<'a> {
        let mut cursor = self.piece.clone();
        for _ in 0..self.skip {
            cursor.next_row();
            cursor.skip_row();
        }
        cursor
    }
}

/// Rows and line ends in a piece.
fn count_rows(piece: &[u8], line_end: u8) -> (u64, u64) {
    let mut cursor = Cursor::new(piece, line_end, 0);
    let mut rows = 0;
    while cursor.next_row() {
        rows += 1;
        cursor.skip_row();
    }
    (rows, cursor.line)
}

/// Reads rows value by value.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    row: usize,
    line_end: u8,
    line: u64,
}

impl<'a> Cursor<'a> {
    fn new(bytes: &'a [u8], line_end: u8, line: u64) -> Self {
        Self { bytes, at: 0, row: 0, line_end, line }
    }

    /// Moves to the next line with anything on it; call it at the end of a row.
    pub fn next_row(&mut self) -> bool {
        while let Some(byte) = self.bytes.get(self.at) {
            if *byte == self.line_end {
                self.line += 1;
            } else if *byte > b' ' {
                self.row = self.at;
                return true;
            }
            self.at += 1;
        }
        false
    }

    /// Moves to the end of the row.
    pub fn skip_row(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|byte| *byte == self.line_end).unwrap_or(rest.len());
    }

    /// The whole row, without blanks round it; moves to its end.
    pub fn whole_row(&mut self) -> &'a [u8] {
        self.skip_row();
        self.bytes[self.row..self.at].trim_ascii_end()
    }

    /// The next value of the row as it is written, or none at the end of the row.
    pub fn token(&mut self) -> Option<&'a [u8]> {
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|byte| *byte <= b' ').unwrap_or(rest.len());
        self.at += length;
        (length > 0).then(|| &rest[..length])
    }

    /// The next value of the row as a number, correctly rounded to single precision if that is its type and to double
    /// precision if not; none, and no move past blanks, if there is no value or it is no number.
    pub fn number(&mut self, scalar: Scalar) -> Option<f64> {
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        let parsed = if scalar == Scalar::F32 {
            fast_float2::parse_partial::<f32, _>(rest).map(|(value, length)| (f64::from(value), length))
        } else {
            fast_float2::parse_partial::<f64, _>(rest)
        };
        if let Ok((value, length)) = parsed
            && rest.get(length).is_none_or(|byte| *byte <= b' ')
        {
            self.at += length;
            return Some(value);
        }
        let length = rest.iter().position(|byte| *byte <= b' ').unwrap_or(rest.len());
        let value = non_finite(&rest[..length])?;
        self.at += length;
        Some(value)
    }

    /// The next value of the row as the length of a list.
    pub fn list_length(&mut self, scalar: Scalar, element: &Element) -> Result<u64, Error> {
        let before = self.at;
        let value = self.number(scalar).ok_or_else(|| self.complain(element))?;
        if value >= 0.0 && value < u64::MAX as f64 && value.fract() == 0.0 {
            return Ok(value as u64);
        }
        let text = shorten(self.bytes[before..self.at].trim_ascii());
        Err(self.error(format!("'{text}' as the length of a list; wanted a whole number from 0")))
    }

    /// Passes over a property; fails if the row does not hold it.
    pub fn skip_property(&mut self, kind: Kind, element: &Element) -> Result<(), Error> {
        let count = match kind {
            Kind::Scalar(_) => 1,
            Kind::List { count, .. } => self.list_length(count, element)?,
        };
        for _ in 0..count {
            self.token().ok_or_else(|| self.complain(element))?;
        }
        Ok(())
    }

    /// Fails if the row holds more values.
    pub fn end_row(&mut self, element: &Element) -> Result<(), Error> {
        self.skip_blanks();
        if self.is_at_row_end() { Ok(()) } else { Err(self.miscounted(element)) }
    }

    /// Why the value that was wanted here is not to be had: the row ended, or something else is in its place.
    pub fn complain(&self, element: &Element) -> Error {
        let mut ahead = self.clone();
        let Some(token) = ahead.token() else {
            return self.miscounted(element);
        };
        let text = shorten(token);
        let hint = if token.contains(&b',') { "; wanted a decimal point, and blanks between values" } else { "" };
        self.error(format!("'{text}' is not a number{hint}"))
    }

    pub fn error(&self, message: String) -> Error {
        Error::format_at(Place::Line(self.line), message)
    }

    fn miscounted(&self, element: &Element) -> Error {
        let mut row = Cursor { at: self.row, ..self.clone() };
        let mut values = 0_u64;
        while row.token().is_some() {
            values += 1;
        }
        // Only the last piece of a body may end without the end of a line.
        row.skip_row();
        let cut = if row.at == row.bytes.len() { ", and the file ends here" } else { "" };
        let values = if values == 1 { "1 value".into() } else { format!("{values} values") };
        let name = &element.name;
        self.error(match element.stride() {
            Some(_) => format!("{values}, the header declares {} for element {name}{cut}", element.properties.len()),
            None => format!(
                "{values}, which is not what the properties of element {name} and the lengths of its lists ask for{cut}"
            ),
        })
    }

    fn skip_blanks(&mut self) {
        while let Some(byte) = self.bytes.get(self.at)
            && *byte <= b' '
            && *byte != self.line_end
        {
            self.at += 1;
        }
    }

    fn is_at_row_end(&self) -> bool {
        self.bytes.get(self.at).is_none_or(|byte| *byte == self.line_end)
    }
}

/// Numbers that are none, in the spellings of C libraries old and new: `-nan(ind)`, `1.#QNAN`, `-1.#INF`.
fn non_finite(token: &[u8]) -> Option<f64> {
    let (negative, word) = match token {
        [b'-', word @ ..] => (true, word),
        [b'+', word @ ..] => (false, word),
        word => (false, word),
    };
    let begins = |prefix: &[u8]| word.get(..prefix.len()).is_some_and(|start| start.eq_ignore_ascii_case(prefix));
    let value = if begins(b"1.#inf") || word.eq_ignore_ascii_case(b"inf") || word.eq_ignore_ascii_case(b"infinity") {
        f64::INFINITY
    } else if word.eq_ignore_ascii_case(b"nan") || begins(b"nan(") || begins(b"1.#") {
        f64::NAN
    } else {
        return None;
    };
    Some(if negative { -value } else { value })
}

/// The bits of a value of text in its declared type: the nearest float, or the whole number itself; none if the text
/// is no number, or one that the type does not hold.
pub(super) fn token_bits(token: &[u8], scalar: Scalar) -> Option<u64> {
    let mut cursor = Cursor::new(token, b'\n', 0);
    if scalar.is_integer() {
        let (least, greatest) = scalar.range();
        let whole = str::from_utf8(token).ok().and_then(|text| text.parse::<i128>().ok()).or_else(|| {
            let value = cursor.number(Scalar::F64)?;
            // Beyond this a double no longer names one whole number.
            (value.fract() == 0.0 && value.abs() <= 9_007_199_254_740_992.0).then_some(value as i128)
        })?;
        return (least..=greatest).contains(&whole).then_some(whole as u64);
    }
    let value = cursor.number(scalar)?;
    Some(if scalar == Scalar::F32 { u64::from((value as f32).to_bits()) } else { value.to_bits() })
}
