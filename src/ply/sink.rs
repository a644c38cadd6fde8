//! Where a writer puts values: little-endian bytes or text.

use super::scalar::Scalar;
use crate::error::Error;
use crate::lists::grow;
use crate::number::{print, print_whole};

/// Bytes written so far. Memory is asked for, never taken for granted.
pub(super) struct Sink {
    pub bytes: Vec<u8>,
    pub text: bool,
}

impl Sink {
    pub fn new(text: bool) -> Self {
        Self { bytes: Vec::new(), text }
    }

    /// Takes memory for so many bytes more; with room to grow further, as a vector does.
    pub fn make_room(&mut self, bytes: usize) -> Result<(), Error> {
        grow(&mut self.bytes, bytes, "the PLY file")
    }

    /// Takes memory for about so many bytes in all, a guess; without it memory is taken as bytes come.
    pub fn expect(&mut self, bytes: f64) {
        if self.bytes.capacity() < bytes as usize {
            let _ = self.bytes.try_reserve_exact((1.03 * bytes) as usize - self.bytes.len());
        }
    }

    #[inline(never)]
    pub fn append(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.make_room(bytes.len())?;
        self.bytes.extend_from_slice(bytes);
        Ok(())
    }

    /// Words of a header line; the last one ends it.
    pub fn words(&mut self, words: &[&[u8]]) -> Result<(), Error> {
        for word in words {
            self.append(word)?;
            self.append(b" ")?;
        }
        self.end_row();
        Ok(())
    }

    /// A line of the source and its end. In a file whose lines end with `\r` alone, a line may hold a `\n`, which would
    /// end it here: it becomes a blank.
    pub fn line(&mut self, text: &[u8]) -> Result<(), Error> {
        let start = self.bytes.len();
        self.append(text)?;
        self.append(b"\n")?;
        for byte in &mut self.bytes[start..start + text.len()] {
            if matches!(byte, b'\n' | b'\r') {
                *byte = b' ';
            }
        }
        Ok(())
    }

    /// A value by its bits. Floats become the shortest text that reads back as the same value.
    pub fn value(&mut self, scalar: Scalar, bits: u64) -> Result<(), Error> {
        if !self.text {
            return self.append(&bits.to_le_bytes()[..scalar.size()]);
        }
        // No number is longer.
        self.make_room(32)?;
        if scalar.is_integer() {
            let negative = scalar.is_signed() && scalar.to_i64(bits) < 0;
            if negative {
                self.bytes.push(b'-');
            }
            print_whole(&mut self.bytes, if negative { scalar.to_i64(bits).unsigned_abs() } else { bits });
        } else {
            print(&mut self.bytes, scalar.to_f64(bits), scalar == Scalar::F32);
        }
        self.bytes.push(b' ');
        Ok(())
    }

    pub fn float(&mut self, value: f32) -> Result<(), Error> {
        self.value(Scalar::F32, value.to_bits().into())
    }

    pub fn end_row(&mut self) {
        if self.text
            && let Some(last) = self.bytes.last_mut()
        {
            *last = b'\n';
        }
    }
}
