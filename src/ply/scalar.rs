//! The number types of PLY.

/// The type of one value, with both families of names in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    /// `int64` and `uint64` are no part of the format, but some writers use them.
    I64,
    U64,
    F32,
    F64,
}
use Scalar::*;

/// What a header may say, for an error text.
pub(super) const WANTED: &str = "a type: char, uchar, short, ushort, int, uint, float, double, int8 ... float64";

/// The old name, the new one, and the type.
const NAMES: [(&str, &str, Scalar); 10] = [
    ("char", "int8", I8),
    ("uchar", "uint8", U8),
    ("short", "int16", I16),
    ("ushort", "uint16", U16),
    ("int", "int32", I32),
    ("uint", "uint32", U32),
    ("int64", "", I64),
    ("uint64", "", U64),
    ("float", "float32", F32),
    ("double", "float64", F64),
];

impl Scalar {
    pub fn from_name(name: &[u8]) -> Option<Self> {
        let is = |other: &str| other.as_bytes() == name;
        NAMES.iter().find(|(old, new, _)| is(old) || is(new)).map(|(.., scalar)| *scalar)
    }

    pub fn name(self) -> &'static str {
        NAMES[self as usize].0
    }

    /// Bytes of one value in a binary file.
    pub fn size(self) -> usize {
        match self {
            I8 | U8 => 1,
            I16 | U16 => 2,
            I32 | U32 | F32 => 4,
            I64 | U64 | F64 => 8,
        }
    }

    pub fn is_integer(self) -> bool {
        !matches!(self, F32 | F64)
    }

    pub fn is_signed(self) -> bool {
        matches!(self, I8 | I16 | I32 | I64)
    }

    /// Whether single precision cannot hold every value.
    pub fn is_wide(self) -> bool {
        self.size() == 8 || matches!(self, I32 | U32)
    }

    /// The number that `bits` stand for, rounded to double precision where the type is wider.
    pub fn to_f64(self, bits: u64) -> f64 {
        match self {
            F32 => f64::from(f32::from_bits(bits as u32)),
            F64 => f64::from_bits(bits),
            _ if self.is_signed() => self.to_i64(bits) as f64,
            _ => bits as f64,
        }
    }

    /// The number that the `bits` of an integer stand for. `uint64` wraps.
    pub fn to_i64(self, bits: u64) -> i64 {
        if !self.is_signed() {
            return bits as i64;
        }
        let unused = 64 - 8 * self.size();
        (bits << unused) as i64 >> unused
    }

    /// The bits of a whole number of that sign and size in an integer type; none if the type does not hold it.
    pub fn hold(self, negative: bool, size: u64) -> Option<u64> {
        let most = u64::MAX >> (64 - 8 * self.size());
        let most = match (self.is_signed(), negative) {
            (true, true) => most / 2 + 1,
            (true, false) => most / 2,
            (false, true) => 0,
            (false, false) => most,
        };
        (size <= most).then_some(if negative { size.wrapping_neg() } else { size })
    }
}

/// The bits of one value of at most 8 bytes, moved to the low end of a word.
pub(super) fn bits(bytes: &[u8], big_endian: bool) -> u64 {
    let mut word = [0; 8];
    for (place, byte) in bytes.iter().enumerate() {
        word[if big_endian { bytes.len() - 1 - place } else { place }] = *byte;
    }
    u64::from_le_bytes(word)
}
