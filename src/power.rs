//! Powers and logarithms of two, by series: the same bits on every platform, and without the tables of a library.

use std::f64::consts::{LN_2, SQRT_2};

/// The logarithm to base 2 of a number above zero, right to some 50 bits, exact for powers of two. That of zero and of
/// numbers that are nearly so is about -1023.
// Small where few are asked for, and fast where a scanner is sought.
#[cfg_attr(not(feature = "full"), optimize(size))]
pub(crate) fn log2(value: f64) -> f64 {
    if value.is_infinite() {
        return value;
    }
    const FRACTION: u64 = (1 << 52) - 1;
    let bits = value.to_bits();
    let mut exponent = (bits >> 52) as f64 - 1023.0;
    let mut mantissa = f64::from_bits(bits & FRACTION | 1023 << 52);
    if mantissa > SQRT_2 {
        mantissa /= 2.0;
        exponent += 1.0;
    }
    // ln m = 2 (t + t^3 / 3 + t^5 / 5 + ...), and t^2 is below 0.03.
    let t = (mantissa - 1.0) / (mantissa + 1.0);
    let mut sum = 0.0;
    for term in (0..12).rev() {
        sum = sum * t * t + 1.0 / f64::from(2 * term + 1);
    }
    exponent + 2.0 * t * sum / LN_2
}

/// Two to the power `exponent`, which is cut to -1022 ..= 1023; right to some 50 bits, exact for whole numbers.
pub(crate) fn exp2(exponent: f64) -> f64 {
    let exponent = exponent.clamp(-1022.0, 1023.0);
    let whole = exponent.round_ties_even();
    let x = (exponent - whole) * LN_2;
    let mut sum = 1.0;
    for term in (1..16).rev() {
        sum = 1.0 + sum * x / f64::from(term);
    }
    sum * f64::from_bits(((whole + 1023.0) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_agree_with_the_library() {
        for step in -100_000..100_000 {
            let x = f64::from(step) * 0.01;
            assert!((exp2(x) / x.exp2() - 1.0).abs() < 4e-16, "{x}");
            assert!((log2(x.exp2()) - x).abs() <= 4e-16 * x.abs().max(1.0), "{x}");
        }
        for whole in -1022..=1023 {
            let (x, power) = (f64::from(whole), 2_f64.powi(whole));
            assert_eq!((exp2(x), log2(power)), (power, x));
        }
    }
}
