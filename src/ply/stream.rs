//! A file that comes in pieces.

use super::body::Body;
use super::columns;
use super::header::{Element, Header};
use super::reader::{CAMERA, cloud, read, wanted};
use super::table::Table;
use super::{PointCloud, ReadOptions};
use crate::error::Error;
use crate::progress::Progress;

/// Bytes of a piece: enough to be worth asking for, few enough that some of them are no matter.
const PIECE: u64 = 8 << 20;

/// A file whose coordinates need an origin comes whole up to here, and twice beyond: once for the origin.
const TWICE: u64 = 128 << 20;

/// Reads a PLY file in the pieces it asks for, and gives the same cloud as [`read`], or the same error.
///
/// Of binary rows of one length no more than a piece is in memory besides the cloud, so the file may be larger than
/// memory is. Text, lists and a scanner's place need all of it, which is gathered then.
pub struct Stream {
    length: u64,
    options: ReadOptions,
    /// What came of the file: its header, or all there is.
    kept: Vec<u8>,
    state: State,
}

/// What a [`Stream`] answers to a piece.
#[derive(Clone, Debug, PartialEq)]
pub enum Next {
    /// The next of the pieces that were asked for.
    Piece,
    /// The bytes of the file from `from` to `to`, in pieces of `step` bytes, but for the last one, which may be shorter.
    Pieces {
        /// Where the first piece begins.
        from: u64,
        /// Where the last one ends.
        to: u64,
        /// Bytes of a piece.
        step: u64,
    },
    /// Nothing more: this is what the file holds.
    Cloud(PointCloud),
}

/// Memory for all of a file, of which there may be more than there are addresses.
pub(super) fn room(length: u64) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let room = usize::try_from(length).map(|length| bytes.try_reserve_exact(length));
    if matches!(room, Ok(Ok(()))) { Ok(bytes) } else { Err(Error::memory("the file", length)) }
}

enum State {
    /// Waits for the beginning.
    Beginning,
    /// Gathers all there is.
    Whole,
    /// Reads the rows of the points, the first of which begins at this byte.
    Rows(u64, Table),
}

impl Stream {
    /// Of a file of so many bytes.
    pub fn new(length: u64, options: ReadOptions) -> Self {
        Self { length, options, kept: Vec::new(), state: State::Beginning }
    }

    /// Takes the next piece, and says what comes next. The first is the beginning of the file, half a KiB at least to tell
    /// what it is; a file whose header it does not hold is gathered. Every other is as it was asked for.
    ///
    /// # Errors
    /// Those of [`read`]. Nothing can be taken after an error, nor after the cloud.
    #[optimize(size)]
    pub fn take(&mut self, piece: &[u8], progress: &Progress) -> Result<Next, Error> {
        let piece = &piece[..piece.len().min(usize::try_from(self.length).unwrap_or(usize::MAX))];
        // Put back when all went well: rows that were given up half-way must not count as read.
        let all = match std::mem::replace(&mut self.state, State::Beginning) {
            State::Beginning if piece.len() as u64 == self.length => read(piece, &self.options, progress)?,
            State::Beginning => {
                self.state = self.begin(piece)?;
                return Ok(self.pieces());
            }
            State::Whole => {
                let rest = self.length - self.kept.len() as u64;
                self.kept.extend_from_slice(&piece[..piece.len().min(rest as usize)]);
                let there = self.kept.len() as u64;
                progress.update("load", there as f64 / self.length as f64 / 2.0)?;
                if there < self.length {
                    self.state = State::Whole;
                    return Ok(Next::Piece);
                }
                read(&self.kept, &self.options, &progress.part(0.5..1.0))?
            }
            State::Rows(start, mut table) => {
                let share = table.share();
                // Of a large file more than there are addresses.
                let rest = (table.count - table.done).saturating_mul(table.stride);
                if !table.take(&piece[..piece.len().min(rest)], &progress.stage("read", share..share))? {
                    let is_again = table.done == 0;
                    self.state = State::Rows(start, table);
                    return Ok(if is_again { self.pieces() } else { Next::Piece });
                }
                let header = Header::parse(&self.kept)?;
                let (columns, arrays) = table.complete();
                // SAFETY: all rows were read.
                unsafe { cloud(&header, header.vertex()?, &columns, arrays, None) }
            }
        };
        Ok(Next::Cloud(all))
    }

    /// Looks how the file is to be read.
    fn begin(&mut self, beginning: &[u8]) -> Result<State, Error> {
        let Some(header) = Header::parse_beginning(beginning)? else { return self.gather() };
        let needs_all = |element: &Element| element.count > 0 && (element.stride().is_none() || element.name == CAMERA);
        if header.elements.iter().any(needs_all) {
            return self.gather();
        }
        let (index, columns) = wanted(&header, &self.options)?;
        let count = header.elements[index].count;
        let is_wide = columns::is_wide(&columns);
        let Some(stride) = header.stride(index).filter(|_| count > 0 && !(is_wide && self.length < TWICE)) else {
            return self.gather();
        };
        let start = Body::locate(&header, beginning, self.length)?.start(index);
        // Then no array has more bytes than can be told.
        let bytes = count.saturating_mul(12);
        usize::try_from(bytes).map_err(|_| Error::memory("the cloud", bytes))?;
        let table = Table::new(columns, stride, count as usize, header.is_big_endian())?;
        self.kept.extend_from_slice(&beginning[..header.body]);
        Ok(State::Rows(start, table))
    }

    fn gather(&mut self) -> Result<State, Error> {
        self.kept = room(self.length)?;
        Ok(State::Whole)
    }

    /// All that the state waits for.
    fn pieces(&self) -> Next {
        let (from, length, row) = match &self.state {
            State::Rows(start, table) => (*start, table.stride as u64 * table.count as u64, table.stride as u64),
            _ => (0, self.length, 1),
        };
        Next::Pieces { from, to: from + length, step: row * (PIECE / row).max(1) }
    }
}
