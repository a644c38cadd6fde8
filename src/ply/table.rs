//! Points in binary rows of one length, which come some rows after others and are read column by column.

use super::columns::{self, Arrays, Column, Rows, Target};
use super::scalar::bits;
use crate::error::Error;
use crate::parallel::piece;
use crate::points::{SAMPLE, choose_origin, spread_in};
use crate::progress::Stage;
use glam::DVec3;

/// Rows of a task.
const TASK: usize = 1 << 16;
/// Rows whose columns are read one after another while their bytes are in the nearest cache.
const BLOCK: usize = 1 << 10;

/// What is read of them, and how far that is.
pub(super) struct Table {
    columns: Vec<Column>,
    /// The bytes of a row.
    pub stride: usize,
    big_endian: bool,
    /// How many rows there are, and how many came.
    pub count: usize,
    pub done: usize,
    /// Whether they come for the origin, which must be known before anything is rounded.
    is_first: bool,
    /// Where some points are, for that.
    sample: Vec<DVec3>,
    arrays: Arrays,
}

impl Table {
    /// Takes memory for `count` points in rows of `stride` bytes.
    pub fn new(columns: Vec<Column>, stride: usize, count: usize, big_endian: bool) -> Result<Self, Error> {
        let is_first = columns::is_wide(&columns);
        let arrays = Arrays::new(&columns, count, DVec3::ZERO)?;
        Ok(Self { columns, stride, big_endian, count, done: 0, is_first, sample: Vec::new(), arrays })
    }

    /// Takes the next rows, and answers whether all were read. After the last ones all are to come again if there was no
    /// origin.
    #[optimize(size)]
    pub fn take(&mut self, rows: &[u8], stage: &Stage) -> Result<bool, Error> {
        let (first, stride) = (self.done, self.stride);
        let count = rows.len() / stride;
        self.done += count;
        if self.is_first {
            self.look(rows, first);
            return Ok(false);
        }
        stage.run(count.div_ceil(TASK), &|task| {
            let mine = piece(count, TASK, task);
            for start in mine.clone().step_by(BLOCK) {
                let end = mine.end.min(start + BLOCK);
                let rows = Rows { bytes: &rows[start * stride..end * stride], stride };
                for columns in self.columns.chunk_by(Column::is_before) {
                    // SAFETY: tasks share no point.
                    unsafe { self.arrays.store_columns(first + start, rows, columns, self.big_endian) };
                }
            }
        })?;
        Ok(self.done == self.count)
    }

    /// Looks where some of the points are, and after the last of them chooses the origin.
    #[optimize(size)]
    fn look(&mut self, rows: &[u8], first: usize) {
        let step = self.count.div_ceil(SAMPLE).max(1);
        for stride in self.sample.len()..self.count.div_ceil(step) {
            let point = spread_in(stride, step, self.count);
            if point >= self.done {
                return;
            }
            let row = &rows[(point - first) * self.stride..];
            let mut position = DVec3::NAN;
            for column in self.columns.iter().filter(|column| column.target == Target::Positions) {
                let value = &row[column.offset..column.offset + column.scalar.size()];
                position[column.component] = column.scalar.to_f64(bits(value, self.big_endian));
            }
            self.sample.push(position);
        }
        if self.done == self.count {
            self.arrays.origin = choose_origin(self.sample.len(), &|place| self.sample[place]);
            self.done = 0;
            self.is_first = false;
        }
    }

    /// How much of the reading is behind, from 0 to 1.
    #[cfg(feature = "full")]
    pub fn share(&self) -> f64 {
        let done = self.done as f64 / self.count as f64;
        match (self.is_first, self.sample.is_empty()) {
            (true, _) => done / 2.0,
            (false, true) => done,
            (false, false) => 0.5 + done / 2.0,
        }
    }

    /// What was read, after all was.
    pub fn complete(self) -> (Vec<Column>, Arrays) {
        (self.columns, self.arrays)
    }
}
