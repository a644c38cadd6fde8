//! Blocks of memory that JavaScript fills and reads through views.

use crate::error::Error;
use crate::lists::fitted;
use crate::message::message;
use crate::number;
use bytemuck::AnyBitPattern;
use wasm_bindgen::prelude::*;

/// Bytes owned by the module, beginning at a multiple of 8.
///
/// JavaScript reaches them by `new Uint8Array(memory.buffer, pointer, byteLength)`, a view to be made anew after every
/// call into the module. A buffer handed to a function is consumed by it; any other is to be freed.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Buffer {
    storage: Storage,
    byte_length: usize,
}

/// A block goes back to the allocator as the type it came as, so numbers are not copied to become bytes.
#[derive(Debug)]
enum Storage {
    Floats(Vec<f32>),
    Bytes(Vec<u8>),
}

#[wasm_bindgen]
impl Buffer {
    /// Takes `byteLength` bytes, or throws a `limit` error and takes nothing. JavaScript writes all of them before it hands
    /// the buffer over: they are not zeroed, which would cost as much as to write them.
    #[wasm_bindgen(constructor)]
    pub fn new(byte_length: f64) -> Result<Buffer, JsValue> {
        if !(byte_length >= 0.0 && byte_length.fract() == 0.0 && byte_length <= u64::MAX as f64) {
            let message =
                message!["byteLength is ", number::text(byte_length), "; wanted a whole number of at least 0"];
            return Err(Error::Input(message).into());
        }
        let bytes = byte_length as u64;
        // What is too large for an address is too large for memory.
        let words = usize::try_from(bytes.div_ceil(4)).unwrap_or(usize::MAX);
        let mut floats = Vec::new();
        floats.try_reserve_exact(words).map_err(|_| Error::memory("the data", bytes))?;
        // SAFETY: within the capacity. All bits are floats, and JavaScript, to which the pointer goes, writes them before Rust
        // reads any.
        unsafe { floats.set_len(words) };
        Ok(Self { storage: Storage::Floats(floats), byte_length: bytes as usize })
    }

    /// Where the bytes begin in the module's memory.
    #[wasm_bindgen(getter)]
    pub fn pointer(&self) -> usize {
        self.bytes().as_ptr() as usize
    }

    /// The number of bytes.
    #[wasm_bindgen(getter, js_name = byteLength)]
    pub fn byte_length(&self) -> usize {
        self.byte_length
    }
}

impl Buffer {
    pub(super) fn bytes(&self) -> &[u8] {
        match &self.storage {
            Storage::Floats(floats) => &bytemuck::cast_slice(floats)[..self.byte_length],
            Storage::Bytes(bytes) => bytes,
        }
    }

    /// The bytes as numbers, `per_point` for each point.
    #[inline(never)]
    pub(super) fn numbers<T: AnyBitPattern>(&self, name: &str, per_point: usize) -> Result<&[T], Error> {
        let bytes = self.bytes();
        if bytes.is_empty() {
            return Ok(&[]);
        }
        let wanted = per_point * size_of::<T>();
        // Never misaligned: the allocator aligns every block to 8 bytes.
        match bytemuck::try_cast_slice(bytes) {
            Ok(numbers) if bytes.len().is_multiple_of(wanted) => Ok(numbers),
            _ => Err(Error::Input(message![name, " has ", bytes.len(), " bytes; wanted a multiple of ", wanted])),
        }
    }

    /// Gives the numbers away, without a copy unless they were made as bytes.
    pub(super) fn into_floats(self, name: &str, per_point: usize) -> Result<Vec<f32>, Error> {
        let numbers = self.numbers(name, per_point)?;
        match self.storage {
            Storage::Bytes(_) => fitted(numbers, name),
            Storage::Floats(floats) => Ok(floats),
        }
    }

    /// Gives the bytes away, with a copy if JavaScript made the buffer.
    #[cfg(feature = "full")]
    pub(super) fn into_bytes(self, name: &str) -> Result<Vec<u8>, Error> {
        match self.storage {
            Storage::Bytes(bytes) => Ok(bytes),
            Storage::Floats(_) => fitted(self.bytes(), name),
        }
    }
}

impl From<Vec<f32>> for Buffer {
    fn from(floats: Vec<f32>) -> Self {
        Self { byte_length: size_of_val(&*floats), storage: Storage::Floats(floats) }
    }
}

impl From<Vec<u8>> for Buffer {
    fn from(bytes: Vec<u8>) -> Self {
        Self { byte_length: bytes.len(), storage: Storage::Bytes(bytes) }
    }
}
