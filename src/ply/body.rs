//! Where the rows of each element are, in parts that can be read in parallel.
//!
//! All the header declares is checked here against the bytes that are there, before memory is taken for it.
//!
//! Text is cut into pieces at line ends. A first pass counts the rows and lines of every piece, so that every row knows
//! its number and every error its line.

use super::Format;
use super::cursor::Cursor;
use super::header::{Element, Header};
use crate::error::{Error, Place};
use crate::message::message;
use crate::parallel::{self, Scatter};
use std::ops::Range;

/// Rows of a part, where rows can be told apart without reading them.
const TASK: u64 = 1 << 16;
/// Bytes of a piece of text: small enough to share among threads, large enough that the table of pieces is nothing.
const PIECE: usize = 256 << 10;

/// The rows of a file.
pub(super) struct Body<'a> {
    header: &'a Header<'a>,
    file: &'a [u8],
    /// The length of the whole file.
    length: u64,
    /// Where each element begins, and the last one ends: its row among all rows of text, or its byte in the file.
    starts: Vec<u64>,
    /// Of text.
    pieces: Vec<Piece<'a>>,
}

struct Piece<'a> {
    cursor: Cursor<'a>,
    /// The number of the first row in the whole body.
    first: u64,
    rows: u64,
}

/// Some rows of one element.
pub(super) struct Part<'a> {
    start: Cursor<'a>,
    /// The rows to pass over first.
    skip: u64,
    /// The number of the first row within its element.
    pub first: usize,
    pub count: usize,
}

impl<'a> Part<'a> {
    /// These rows of a binary element, the first of which is at `start`.
    // The core has one caller, and no byte to spare for a call.
    #[inline(always)]
    pub fn of_rows(start: &Cursor<'a>, element: &Element, rows: Range<u64>) -> Vec<Self> {
        let (task, stride) = element.stride().map_or((element.count, 0), |stride| (TASK, stride));
        let mut parts = Vec::new();
        let (mut start, mut first) = (start.clone(), rows.start);
        while first < rows.end {
            let count = task.min(rows.end - first) as usize;
            parts.push(Part { start: start.clone(), skip: 0, first: first as usize, count });
            start.at += count * stride;
            first += task;
        }
        parts
    }

    /// A cursor before the part's first row.
    pub fn cursor(&self) -> Cursor<'a> {
        let mut cursor = self.start.clone();
        for _ in 0..self.skip {
            cursor.next_row();
            cursor.skip_line();
        }
        cursor
    }

    /// The rows of a binary element without lists, of so many bytes each.
    pub fn rows(&self, stride: usize) -> &'a [u8] {
        &self.start.bytes[self.start.at..self.start.at + self.count * stride]
    }
}

impl<'a> Body<'a> {
    /// Finds the elements. Costs one step for an element of fixed rows, one for every list in the others, and a pass over
    /// text; takes no memory for rows. Of a file of `length` bytes `file` may be the beginning alone, header included, if it is
    /// binary and without lists.
    #[optimize(size)]
    pub fn locate(header: &'a Header<'a>, file: &'a [u8], length: u64) -> Result<Self, Error> {
        let mut body = Self { header, file, length, starts: Vec::new(), pieces: Vec::new() };
        if Cursor::new(file, 0, header.format).is_text() {
            body.index_text()?;
            return Ok(body);
        }
        let mut at = header.body as u64;
        for element in &header.elements {
            body.starts.push(at);
            at = body.end(element, at)?;
        }
        body.starts.push(at);
        Ok(body)
    }

    /// The end of a binary element.
    fn end(&self, element: &Element, start: u64) -> Result<u64, Error> {
        let ends = |rows: u64, at: u64| {
            Error::format(
                Some(Place::Byte(at)),
                message!["the file ends after ", rows, " of ", element.count, " rows of element ", element.label()],
            )
        };
        match element.stride() {
            _ if element.count == 0 => Ok(start),
            Some(0) => Ok(start),
            Some(stride) => {
                let (rows, stride) = ((self.length - start) / stride as u64, stride as u64);
                let end = start + stride * rows.min(element.count);
                if rows < element.count { Err(ends(rows, end)) } else { Ok(end) }
            }
            // Rows with a list have at least the byte of its length, so the file bounds this loop, whatever the count.
            None => {
                let mut cursor = Cursor::new(self.file, start as usize, self.header.format);
                for row in 0..element.count {
                    cursor.next_row();
                    let begin = cursor.at as u64;
                    if let Err(error) = cursor.skip_row(element) {
                        return Err(if cursor.at > self.file.len() { ends(row, begin) } else { error });
                    }
                }
                Ok(cursor.at as u64)
            }
        }
    }

    /// The byte of the file where an element of a binary one begins.
    #[cfg(feature = "full")]
    pub fn start(&self, index: usize) -> u64 {
        self.starts[index]
    }

    /// Counts the rows of text and checks that there are enough.
    fn index_text(&mut self) -> Result<(), Error> {
        let Header { format, line_end, body, body_line, .. } = *self.header;
        let mut rest = &self.file[body..];
        while !rest.is_empty() {
            let sure = rest.len().min(PIECE);
            let more = rest[sure..].iter().position(|byte| *byte == line_end);
            let (piece, after) = rest.split_at(more.map_or(rest.len(), |more| sure + more + 1));
            let mut cursor = Cursor::new(piece, 0, format);
            cursor.line_end = line_end;
            self.pieces.push(Piece { cursor, first: 0, rows: 0 });
            rest = after;
        }
        let count = self.pieces.len();
        let pieces = Scatter::new(&mut self.pieces);
        parallel::each(count, &|i| {
            // SAFETY: each number comes once, so this piece is this call's alone.
            let piece = &mut unsafe { pieces.slice(i..i + 1) }[0];
            let mut cursor = piece.cursor.clone();
            while cursor.next_row() {
                piece.rows += 1;
                cursor.skip_line();
            }
            piece.cursor.line = cursor.line;
        });
        let (mut rows, mut line) = (0, body_line);
        for piece in &mut self.pieces {
            piece.first = rows;
            rows += piece.rows;
            line += std::mem::replace(&mut piece.cursor.line, line);
        }

        let (mut start, mut values) = (0, 0.0);
        for element in &self.header.elements {
            self.starts.push(start);
            // Rows without values leave no line.
            if element.properties.is_empty() {
                continue;
            }
            let there = rows - start;
            if there < element.count {
                return Err(Error::format(
                    Some(Place::Line(line)),
                    message![
                        "the file ends after ",
                        there,
                        " of ",
                        element.count,
                        " rows of element ",
                        element.label()
                    ],
                ));
            }
            start += element.count;
            values += element.count as f64 * element.properties.len() as f64;
        }
        // Rows of too few values are found later, with their line; this only keeps them from costing much memory.
        const FEW: f64 = 1e6;
        let bytes = self.file.len() - body;
        if values > FEW && values * 2.0 > bytes as f64 + 1.0 {
            let values = values as u64;
            return Err(Error::format(
                Some(Place::Line(body_line)),
                message![bytes, " bytes of text cannot hold the ", values, " values that the header declares"],
            ));
        }
        Ok(())
    }

    /// All rows of a binary element.
    pub fn bytes(&self, index: usize) -> &'a [u8] {
        &self.file[self.starts[index] as usize..self.starts[index + 1] as usize]
    }

    /// The rows of an element, in their order; none if they have no properties.
    #[optimize(size)]
    pub fn parts(&self, index: usize) -> Vec<Part<'a>> {
        let element = &self.header.elements[index];
        let start = self.starts[index];
        let mut parts = Vec::new();
        if element.properties.is_empty() {
            return parts;
        }
        for piece in &self.pieces {
            let first = piece.first.max(start);
            let end = (piece.first + piece.rows).min(start + element.count);
            if first < end {
                parts.push(Part {
                    start: piece.cursor.clone(),
                    skip: first - piece.first,
                    first: (first - start) as usize,
                    count: (end - first) as usize,
                });
            }
        }
        if self.header.format == Format::Ascii {
            return parts;
        }
        Part::of_rows(&Cursor::new(self.file, start as usize, self.header.format), element, 0..element.count)
    }
}
