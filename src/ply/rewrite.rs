//! The file a cloud came from, with normals, from pieces of it.

use super::Additions;
use super::body::{Body, Part};
use super::cursor::Cursor;
use super::header::{Element, Header};
use super::sink::Sink;
use super::stream::room;
use super::writer::{Writer, write};
use crate::error::Error;
use crate::progress::Progress;

/// Writes a PLY file again, with normals and curvature, from pieces of it: the same file as [`write()`] gives, in as many
/// pieces, or the same error.
///
/// Of elements in binary rows of one length no more than a piece is in memory at a time, so the file may be larger than memory
/// is. If there are others, as in text and meshes, all is gathered, and comes out with the last piece.
pub struct Rewrite {
    length: u64,
    ascii: bool,
    /// How many bytes came.
    taken: u64,
    /// The header, if there is a place, or else all there is so far.
    kept: Vec<u8>,
    /// How far the rows were written, if they are as they come.
    place: Option<Place>,
}

/// How far rows were written.
#[derive(Default)]
struct Place {
    element: usize,
    /// The number of its next row.
    row: u64,
    /// The first bytes of that, if it is cut in two.
    begun: Vec<u8>,
}

impl Rewrite {
    /// Of a file of so many bytes; to text if `ascii`.
    pub fn new(length: u64, ascii: bool) -> Self {
        Self { length, ascii, taken: 0, kept: Vec::new(), place: None }
    }

    /// Whether all pieces were taken.
    pub fn is_complete(&self) -> bool {
        self.taken >= self.length
    }

    /// Takes the next piece of the file, from its beginning to its end, and answers with what follows in the output. The first
    /// holds half a KiB at least, or all, to tell what the file is; one whose header it does not hold is gathered. `add` is
    /// the same each time.
    ///
    /// # Errors
    /// Those of [`write()`]. Nothing can be taken after an error.
    pub fn take(&mut self, piece: &[u8], add: &Additions, progress: &Progress) -> Result<Vec<u8>, Error> {
        let is_first = self.taken == 0;
        let left = usize::try_from(self.length - self.taken).unwrap_or(usize::MAX);
        let piece = &piece[..piece.len().min(left)];
        self.taken += piece.len() as u64;
        if is_first && self.is_complete() {
            return write(piece, add, self.ascii, progress);
        }
        let mut rows = piece;
        if is_first {
            match self.begin(piece, add)? {
                None => self.kept = room(self.length)?,
                Some(body) => {
                    self.kept.extend_from_slice(&piece[..body]);
                    self.place = Some(Place::default());
                    rows = &piece[body..];
                }
            }
        }
        if self.place.is_some() {
            return self.write_rows(rows, is_first, add, progress);
        }
        self.kept.extend_from_slice(piece);
        progress.update("load", self.taken as f64 / self.length as f64 / 2.0)?;
        if self.is_complete() { write(&self.kept, add, self.ascii, &progress.part(0.5..1.0)) } else { Ok(Vec::new()) }
    }

    /// Where the rows begin, if they can be written as they come.
    fn begin(&self, beginning: &[u8], add: &Additions) -> Result<Option<usize>, Error> {
        let Some(header) = Header::parse_beginning(beginning)? else { return Ok(None) };
        // Rows have 32-bit numbers, and those of text and lists are found one after the other.
        let needs_all = |(number, element): (usize, &Element)| {
            element.count > 0 && header.stride(number).is_none() || element.count > u32::MAX.into()
        };
        if header.elements.iter().enumerate().any(needs_all) {
            return Ok(None);
        }
        Writer::new(&header, add, self.ascii)?;
        Body::locate(&header, beginning, self.length)?;
        Ok(Some(header.body))
    }

    /// Writes all rows that are there to their end, after the header if they are the first.
    fn write_rows(
        &mut self,
        bytes: &[u8],
        is_first: bool,
        add: &Additions,
        progress: &Progress,
    ) -> Result<Vec<u8>, Error> {
        let header = Header::parse(&self.kept)?;
        let writer = Writer::new(&header, add, self.ascii)?;
        let mut sink = if is_first { writer.begin()? } else { Sink::new(self.ascii) };
        let Some(place) = &mut self.place else { return Ok(Vec::new()) };
        let mut rest = bytes;
        while let Some(element) = header.elements.get(place.element) {
            // Rows without properties take no bytes, and lists are only where there are no rows.
            let stride = element.stride().unwrap_or(0);
            let left = (element.count - place.row).saturating_mul(stride as u64);
            if left == 0 {
                (place.element, place.row) = (place.element + 1, 0);
                continue;
            }
            let first;
            let rows = if place.begun.is_empty() {
                let whole = rest.len() - rest.len() % stride;
                rest.split_off(..left.min(whole as u64) as usize).unwrap_or_default()
            } else {
                let lacking = rest.len().min(stride - place.begun.len());
                place.begun.extend_from_slice(rest.split_off(..lacking).unwrap_or_default());
                if place.begun.len() < stride {
                    break;
                }
                first = std::mem::take(&mut place.begun);
                &first[..]
            };
            let end = place.row + (rows.len() / stride) as u64;
            let at = self.taken - rest.len() as u64;
            let share = |at: u64| at as f64 / self.length as f64;
            let stage = progress.stage("write", share(at.saturating_sub(rows.len() as u64))..share(at));
            if writer.keeps(place.element) {
                sink.append(rows)?;
            } else {
                let parts = Part::of_rows(&Cursor::new(rows, 0, header.format), element, place.row..end);
                writer.rows(place.element, &parts, &mut sink, &stage)?;
            }
            place.row = end;
            if rest.len() < stride && end < element.count {
                place.begun.extend_from_slice(rest);
                break;
            }
        }
        Ok(sink.bytes)
    }
}
