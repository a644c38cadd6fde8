//! Where a writer puts values: little-endian bytes or text.

use super::scalar::Scalar;
use crate::error::Error;
use std::fmt::{self, Write};

/// Bytes written so far. Memory is asked for, never taken for granted.
pub(super) struct Sink {
    pub bytes: Vec<u8>,
    text: bool,
}

impl Sink {
    pub fn new(bytes: Vec<u8>, text: bool) -> Self {
        Self { bytes, text }
    }

    pub fn is_text(&self) -> bool {
        self.text
    }

    /// Takes memory for so many bytes more; with room to grow further, as a vector does.
    pub fn make_room(&mut self, bytes: usize) -> Result<(), Error> {
        let needed = self.bytes.len() as u64 + bytes as u64;
        self.bytes.try_reserve(bytes).map_err(|_| Error::memory("the PLY file", needed))
    }

    pub fn append(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.make_room(bytes.len())?;
        self.bytes.extend_from_slice(bytes);
        Ok(())
    }

    /// A line of the source and its end. In a file whose lines end with `\r` alone, a line may hold a `\n`, which would
    /// end it here: it becomes a blank.
    pub fn line(&mut self, text: &[u8]) -> Result<(), Error> {
        for (part, text) in text.split(|byte| matches!(byte, b'\n' | b'\r')).enumerate() {
            self.append(if part > 0 { b" " } else { b"" })?;
            self.append(text)?;
        }
        self.append(b"\n")
    }

    /// A value by its bits. Floats become the shortest text that reads back as the same value.
    pub fn value(&mut self, scalar: Scalar, bits: u64) -> Result<(), Error> {
        if !self.text {
            return self.append(&bits.to_le_bytes()[..scalar.size()]);
        }
        let mut digits = Digits::default();
        // Cannot fail: no number is longer than the digits' place.
        let _ = match scalar {
            Scalar::F32 => digits.float(f32::from_bits(bits as u32)),
            Scalar::F64 => digits.float(f64::from_bits(bits)),
            Scalar::U64 => write!(digits, "{bits}"),
            _ => write!(digits, "{}", scalar.to_i64(bits)),
        };
        self.token(&digits.text[..digits.length])
    }

    pub fn float(&mut self, value: f32) -> Result<(), Error> {
        self.value(Scalar::F32, value.to_bits().into())
    }

    /// A value of a text file as it stands.
    pub fn token(&mut self, token: &[u8]) -> Result<(), Error> {
        self.append(token)?;
        self.append(b" ")
    }

    pub fn end_row(&mut self) {
        if self.text
            && let Some(last) = self.bytes.last_mut()
        {
            *last = b'\n';
        }
    }
}

/// The text of one number, without an allocation.
#[derive(Default)]
struct Digits {
    text: [u8; 32],
    length: usize,
}

impl Digits {
    fn float<F: Into<f64> + Copy + fmt::Display + fmt::LowerExp>(&mut self, value: F) -> fmt::Result {
        let wide: f64 = value.into();
        if wide.is_nan() {
            // Without the sign, which says nothing.
            return self.write_str("nan");
        }
        let plain = wide == 0.0 || wide.is_infinite() || (1e-5..1e16).contains(&wide.abs());
        if plain { write!(self, "{value}") } else { write!(self, "{value:e}") }
    }
}

impl Write for Digits {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let place = self.text.get_mut(self.length..self.length + text.len()).ok_or(fmt::Error)?;
        place.copy_from_slice(text.as_bytes());
        self.length += text.len();
        Ok(())
    }
}
