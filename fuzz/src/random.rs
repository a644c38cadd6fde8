//! Numbers that follow from a seed, or from the bytes of an input.

#[path = "../../tests/common/random.rs"]
mod numbers;

pub use numbers::Random;

impl Random {
    /// One that follows from all bytes (FNV-1a), so that a file needs no others beside it.
    pub fn of(bytes: &[u8]) -> Self {
        Self(
            bytes
                .iter()
                .fold(0xCBF2_9CE4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3)),
        )
    }

    pub fn below(&mut self, limit: usize) -> usize {
        (self.bits() >> 11) as usize % limit
    }

    /// Any float there is, those that are none among them.
    pub fn single(&mut self) -> f32 {
        f32::from_bits(self.bits() as u32)
    }
}
