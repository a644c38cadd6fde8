//! Rows, value by value, of text and of bytes alike.

use super::Format;
use super::header::{Element, Kind, shorten};
use super::scalar::{Scalar, bits};
use crate::error::{Error, Place};
use crate::message::message;
use crate::number;

/// Where the next value is. A row of text is one line; blank lines are passed over.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    /// Of text, a piece that ends with a line; else all up to the end of the file, so that `at` is a place in the file.
    pub bytes: &'a [u8],
    pub at: usize,
    pub format: Format,
    pub line_end: u8,
    /// The line of text.
    pub line: u64,
    /// Where the row began.
    row: usize,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8], at: usize, format: Format) -> Self {
        Self { bytes, at, format, line_end: b'\n', line: 0, row: at }
    }

    pub fn is_text(&self) -> bool {
        self.format == Format::Ascii
    }

    fn is_big_endian(&self) -> bool {
        self.format == Format::BinaryBigEndian
    }

    /// Begins the next row; call it at the end of a row. False if there is no line of text with anything on it.
    pub fn next_row(&mut self) -> bool {
        while self.is_text() {
            let Some(byte) = self.bytes.get(self.at) else {
                return false;
            };
            if *byte == self.line_end {
                self.line += 1;
            } else if *byte > b' ' {
                break;
            }
            self.at += 1;
        }
        self.row = self.at;
        true
    }

    /// Moves to the end of the line of text.
    pub fn skip_line(&mut self) {
        let rest = &self.bytes[self.at..];
        // Eight bytes at once: one that is zero in `other` is an end (Anderson, "Bit Twiddling Hacks", a zero byte in a word).
        let ends = u64::from_ne_bytes([self.line_end; 8]);
        let is_within = |eight: &&[u8; 8]| {
            let other = u64::from_ne_bytes(**eight) ^ ends;
            other.wrapping_sub(0x0101_0101_0101_0101) & !other & 0x8080_8080_8080_8080 == 0
        };
        let passed = 8 * rest.as_chunks().0.iter().take_while(is_within).count();
        let more = rest[passed..].iter().position(|byte| *byte == self.line_end);
        self.at += more.map_or(rest.len(), |more| passed + more);
    }

    /// The whole line of text, without blanks round it; moves to its end.
    pub fn whole_line(&mut self) -> &'a [u8] {
        self.skip_line();
        self.bytes[self.row..self.at].trim_ascii_end()
    }

    /// Moves to the end of the row, whatever it holds.
    pub fn skip_row(&mut self, element: &Element) -> Result<(), Error> {
        if self.is_text() {
            self.skip_line();
            return Ok(());
        }
        element.properties.iter().try_for_each(|property| self.skip(property.kind, element))
    }

    /// Fails if a row of text holds more values.
    pub fn end_row(&mut self, element: &Element) -> Result<(), Error> {
        if self.is_text() {
            self.skip_blanks();
            if self.bytes.get(self.at).is_some_and(|byte| *byte != self.line_end) {
                return Err(self.miscounted(element));
            }
        }
        Ok(())
    }

    /// The next value as it stands: its bytes, or its text.
    pub fn take(&mut self, scalar: Scalar, element: &Element) -> Result<&'a [u8], Error> {
        if self.is_text() {
            return self.token().ok_or_else(|| self.complain(element));
        }
        let start = self.at;
        self.at += scalar.size();
        self.bytes.get(start..self.at).ok_or_else(|| self.ends(element))
    }

    /// The next value as a number, correctly rounded to single precision if that is its type and to double precision if
    /// not.
    #[inline]
    pub fn number(&mut self, scalar: Scalar, element: &Element) -> Result<f64, Error> {
        if !self.is_text() {
            return Ok(scalar.to_f64(bits(self.take(scalar, element)?, self.is_big_endian())));
        }
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        if let Some((value, length)) = number::parse(rest, scalar == Scalar::F32)
            && rest.get(length).is_none_or(|byte| *byte <= b' ')
        {
            self.at += length;
            return Ok(value);
        }
        let start = self.at;
        self.token().and_then(non_finite).ok_or_else(|| {
            self.at = start;
            self.complain(element)
        })
    }

    /// The next value as the length of a list of `item`s.
    #[optimize(size)]
    pub fn length(&mut self, count: Scalar, item: Scalar, element: &Element) -> Result<u64, Error> {
        let start = self.at;
        if self.is_text() {
            let value = self.number(count, element)?;
            if value >= 0.0 && value < u64::MAX as f64 && value.trunc() == value {
                return Ok(value as u64);
            }
            let text = shorten(self.bytes[start..self.at].trim_ascii());
            return Err(self.error(message!["'", text, "' as the length of a list; wanted a whole number from 0"]));
        }
        let word = bits(self.take(count, element)?, self.is_big_endian());
        let length = count.to_i64(word);
        let (sign, size) =
            if count.is_signed() && length < 0 { ("-", length.unsigned_abs()) } else { ("", length as u64) };
        if !sign.is_empty() || size > ((self.bytes.len() - self.at) / item.size()) as u64 {
            return Err(self.error(message![
                "a row of element ",
                element.label(),
                " has a list of ",
                sign,
                size,
                " values; wanted 0 or more, none past the end of the file"
            ]));
        }
        Ok(size)
    }

    /// Passes over a property.
    pub fn skip(&mut self, kind: Kind, element: &Element) -> Result<(), Error> {
        let (count, item) = match kind {
            Kind::Scalar(scalar) => (1, scalar),
            Kind::List { count, item } => (self.length(count, item, element)?, item),
        };
        if !self.is_text() {
            self.at += count as usize * item.size();
            return if self.at > self.bytes.len() { Err(self.ends(element)) } else { Ok(()) };
        }
        for _ in 0..count {
            self.take(item, element)?;
        }
        Ok(())
    }

    /// The bits of a value that was taken, in its type; fails if the type cannot hold the text.
    pub fn bits(&self, value: &[u8], scalar: Scalar) -> Result<u64, Error> {
        if !self.is_text() {
            return Ok(bits(value, self.is_big_endian()));
        }
        text_bits(value, scalar)
            .ok_or_else(|| self.error(message!["'", shorten(value), "' is no value of type ", scalar.name()]))
    }

    /// The next value of the line as it is written, or none at the end of the line.
    fn token(&mut self) -> Option<&'a [u8]> {
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|byte| *byte <= b' ').unwrap_or(rest.len());
        self.at += length;
        (length > 0).then(|| &rest[..length])
    }

    #[inline]
    fn skip_blanks(&mut self) {
        while let Some(byte) = self.bytes.get(self.at)
            && *byte <= b' '
            && *byte != self.line_end
        {
            self.at += 1;
        }
    }

    /// An error in this row.
    #[cold]
    #[inline(never)]
    fn error(&self, message: String) -> Error {
        Error::format(Some(if self.is_text() { Place::Line(self.line) } else { Place::Byte(self.row as u64) }), message)
    }

    #[cold]
    #[inline(never)]
    fn ends(&self, element: &Element) -> Error {
        self.error(message!["the file ends within element ", element.label()])
    }

    /// Why the text that was wanted here is not to be had: the line ended, or something else is in its place.
    #[cold]
    #[optimize(size)]
    #[inline(never)]
    fn complain(&self, element: &Element) -> Error {
        let mut ahead = self.clone();
        let Some(token) = ahead.token() else {
            return self.miscounted(element);
        };
        // The library's own search would be in the module for this alone.
        #[allow(clippy::manual_contains)]
        let hint = if token.iter().any(|byte| *byte == b',') {
            "; wanted a decimal point, and blanks between values"
        } else {
            ""
        };
        self.error(message!["'", shorten(token), "' is not a number", hint])
    }

    #[cold]
    #[optimize(size)]
    #[inline(never)]
    fn miscounted(&self, element: &Element) -> Error {
        let mut row = Cursor { at: self.row, ..self.clone() };
        let mut values = 0_u64;
        while row.token().is_some() {
            values += 1;
        }
        let plural = if values == 1 { "" } else { "s" };
        // Only the last piece of a body may end without the end of a line.
        row.skip_line();
        let cut = if row.at == row.bytes.len() { ", and the file ends here" } else { "" };
        let lists = if element.stride().is_some() { "" } else { " and the values of its lists" };
        self.error(message![
            values,
            " value",
            plural,
            ", the header declares ",
            element.properties.len(),
            " for element ",
            element.label(),
            lists,
            cut
        ])
    }
}

/// Numbers that are none, in the spellings of C libraries old and new: `-nan(ind)`, `1.#QNAN`, `-1.#INF`.
#[cold]
#[optimize(size)]
fn non_finite(token: &[u8]) -> Option<f64> {
    let (negative, word) = match token {
        [b'-', word @ ..] => (true, word),
        [b'+', word @ ..] | word => (false, word),
    };
    let begins = |prefix: &[u8]| word.get(..prefix.len()).is_some_and(|start| start.eq_ignore_ascii_case(prefix));
    let is = |other: &[u8]| begins(other) && word.len() == other.len();
    let value = if begins(b"1.#inf") || is(b"inf") || is(b"infinity") {
        f64::INFINITY
    } else if is(b"nan") || begins(b"nan(") || begins(b"1.#") {
        f64::NAN
    } else {
        return None;
    };
    Some(if negative { -value } else { value })
}

/// The bits of a value of text in its declared type: the nearest float, or the whole number itself; none if the text
/// is no number, or one that the type does not hold.
fn text_bits(token: &[u8], scalar: Scalar) -> Option<u64> {
    if scalar.is_integer()
        && let Some((negative, size)) = number::parse_whole(token)
    {
        return scalar.hold(negative, size);
    }
    let value = match number::parse(token, scalar == Scalar::F32) {
        Some((value, length)) if length == token.len() => value,
        _ => non_finite(token)?,
    };
    match scalar {
        Scalar::F32 => Some((value as f32).to_bits().into()),
        Scalar::F64 => Some(value.to_bits()),
        // Beyond this a double no longer names one whole number.
        _ if value.trunc() == value && value.abs() <= 9_007_199_254_740_992.0 => {
            scalar.hold(value < 0.0, value.abs() as u64)
        }
        _ => None,
    }
}
