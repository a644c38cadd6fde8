//! Numbers as decimal text, both ways, to the last bit.
//!
//! The standard library does the same, with some 20 KB of tables and code for every type, format and precision. Here
//! almost every number takes a short way in double precision that knows when it is sure, and the rest goes through
//! whole numbers of any length, which need no tables.

mod big;
mod parse;
mod print;

pub(crate) use parse::{parse, parse_whole};
pub(crate) use print::{print, print_whole};

/// The powers of ten that double precision holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// `(high + low) * 10^exponent` as a double and what it lacks, which together are right to some 100 bits; none for a
/// power that is not in the table. `low` is at most what rounding `high` has lost.
fn scale(high: f64, low: f64, exponent: i64) -> Option<(f64, f64)> {
    let power = *POWERS.get(usize::try_from(exponent.unsigned_abs()).ok()?)?;
    if exponent >= 0 {
        let (product, lost) = multiply(high, power);
        return Some((product, lost + low * power));
    }
    let quotient = high / power;
    let (product, lost) = multiply(quotient, power);
    // The remainder of a rounded quotient is a double itself, so only the last two steps round.
    Some((quotient, (high - product - lost + low) / power))
}

/// A product, rounded, and what rounding it has lost, exactly (Dekker).
fn multiply(a: f64, b: f64) -> (f64, f64) {
    let split = |x: f64| {
        let wide = x * 134_217_729.0;
        let upper = wide - (wide - x);
        (upper, x - upper)
    };
    let product = a * b;
    let ((a, a_rest), (b, b_rest)) = (split(a), split(b));
    (product, a * b - product + a * b_rest + a_rest * b + a_rest * b_rest)
}

/// A float as mantissa and exponent.
#[derive(Clone, Copy)]
struct Precision {
    /// Bits of the mantissa.
    bits: i64,
    /// The exponent of the least number above zero.
    least: i64,
}

impl Precision {
    fn of(single: bool) -> Self {
        if single { Self { bits: 24, least: -149 } } else { Self { bits: 53, least: -1074 } }
    }
}

#[cfg(target_arch = "wasm32")]
pub(crate) use crate::wasm::text;

/// A number for a message; `{}` would bring in what this module replaces. WebAssembly asks JavaScript instead: a
/// module that writes no files is smaller by a kilobyte.
#[cfg(not(target_arch = "wasm32"))]
pub(crate) fn text(value: f64) -> String {
    let mut text = Vec::new();
    print(&mut text, value, false);
    // Digits are ASCII.
    String::from_utf8(text).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    /// xorshift64*
    pub struct Random(pub u64);

    impl Random {
        pub fn next(&mut self) -> u64 {
            self.0 ^= self.0 >> 12;
            self.0 ^= self.0 << 25;
            self.0 ^= self.0 >> 27;
            self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
        }

        pub fn below(&mut self, limit: usize) -> usize {
            (self.next() >> 11) as usize % limit
        }
    }
}
