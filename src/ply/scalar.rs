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

/// What a header may say, for error texts.
pub(super) const NAMES: &str = "char, uchar, short, ushort, int, uint, float, double (or int8 ... float64)";

impl Scalar {
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "int64" => Self::I64,
            "uint64" => Self::U64,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::I8 => "char",
            Self::U8 => "uchar",
            Self::I16 => "short",
            Self::U16 => "ushort",
            Self::I32 => "int",
            Self::U32 => "uint",
            Self::I64 => "int64",
            Self::U64 => "uint64",
            Self::F32 => "float",
            Self::F64 => "double",
        }
    }

    /// Bytes of one value in a binary file.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// Whether single precision cannot hold every value.
    pub fn is_wide(self) -> bool {
        self.size() == 8 || matches!(self, Self::I32 | Self::U32)
    }

    /// Least and greatest value of an integer type.
    pub fn range(self) -> (i128, i128) {
        match self {
            Self::I8 => (i8::MIN.into(), i8::MAX.into()),
            Self::U8 => (0, u8::MAX.into()),
            Self::I16 => (i16::MIN.into(), i16::MAX.into()),
            Self::U16 => (0, u16::MAX.into()),
            Self::I32 => (i32::MIN.into(), i32::MAX.into()),
            Self::U32 => (0, u32::MAX.into()),
            Self::I64 => (i64::MIN.into(), i64::MAX.into()),
            Self::U64 => (0, u64::MAX.into()),
            Self::F32 | Self::F64 => (0, 0),
        }
    }

    /// The number that `bits` stand for, rounded to double precision where the type is wider.
    pub fn to_f64(self, bits: u64) -> f64 {
        match self {
            Self::F32 => f64::from(f32::from_bits(bits as u32)),
            Self::F64 => f64::from_bits(bits),
            Self::U64 => bits as f64,
            _ => self.to_i64(bits) as f64,
        }
    }

    /// The number that the `bits` of an integer stand for; not for the float types. `uint64` wraps.
    pub fn to_i64(self, bits: u64) -> i64 {
        match self {
            Self::I8 => i64::from(bits as i8),
            Self::I16 => i64::from(bits as i16),
            Self::I32 => i64::from(bits as i32),
            _ => bits as i64,
        }
    }
}

/// The bits of one value of at most 8 bytes, moved to the low end of a word.
pub(super) fn bits(bytes: &[u8], big_endian: bool) -> u64 {
    let add = |word: u64, byte: &u8| (word << 8) | u64::from(*byte);
    if big_endian { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) }
}
