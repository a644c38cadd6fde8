//! Numbers that follow from a seed.

use std::f64::consts::TAU;

/// SplitMix64: the same numbers everywhere.
pub struct Random(pub u64);

impl Random {
    /// One that follows from all bytes (FNV-1a), so that a file needs no others beside it.
    pub fn of(bytes: &[u8]) -> Self {
        Self(
            bytes
                .iter()
                .fold(0xCBF2_9CE4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3)),
        )
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, limit: usize) -> usize {
        (self.bits() >> 11) as usize % limit
    }

    /// Any float there is, those that are none among them.
    pub fn single(&mut self) -> f32 {
        f32::from_bits(self.bits() as u32)
    }

    /// Uniform in -1 to 1.
    pub fn signed(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn direction(&mut self) -> [f64; 3] {
        let (z, angle) = (self.signed(), TAU * self.signed());
        let r = (1.0 - z * z).sqrt();
        [r * angle.cos(), r * angle.sin(), z]
    }
}
