//! Text to numbers.

use super::big::Big;
use super::{Precision, scale};

/// Digits that may decide how a number is rounded; whether there is anything after them is all that still counts.
const DIGITS_MAX: i64 = 800;

/// The decimal number at the beginning of `text`, rounded to the nearest double, or with `single` to the nearest single,
/// and its length; none if there is no number.
pub(crate) fn parse(text: &[u8], single: bool) -> Option<(f64, usize)> {
    let negative = text.first() == Some(&b'-');
    let start = usize::from(negative || text.first() == Some(&b'+'));
    let (mut at, mut mantissa) = (start, 0);
    digits(text, &mut at, &mut mantissa);
    let mut count = at - start;
    let mut exponent = 0;
    if text.get(at) == Some(&b'.') {
        at += 1;
        let point = at;
        digits(text, &mut at, &mut mantissa);
        count += at - point;
        exponent = -((at - point) as i64);
    }
    if count == 0 {
        return None;
    }
    let end = at;
    if let Some(b'e' | b'E') = text.get(at) {
        let negative = text.get(at + 1) == Some(&b'-');
        let first = at + 1 + usize::from(negative || text.get(at + 1) == Some(&b'+'));
        let (mut after, mut power) = (first, 0);
        digits(text, &mut after, &mut power);
        if after > first {
            at = after;
            let zeros = text[first..after].iter().take_while(|byte| **byte == b'0').count();
            // Beyond every float in any case; a power of more digits may have wrapped round.
            let power = if after - first - zeros > 18 { i64::MAX / 4 } else { power as i64 };
            exponent += if negative { -power } else { power };
        }
    }
    let short = if count > 19 { cut_way(&text[start..end], exponent) } else { short_way(mantissa, exponent) };
    // Rounding twice is rounding once, unless the first time leads just between two singles.
    let sure = short.filter(|value| !single || *value == 0.0 || !is_between_singles(*value));
    let value = sure.unwrap_or_else(|| long_way(&text[start..end], exponent, Precision::of(single)));
    let value = if single { f64::from(value as f32) } else { value };
    Some((if negative { -value } else { value }, at))
}

/// Whether a whole number is negative, and its size; none if the text is no such number, or its size is above `2^64 - 1`.
pub(crate) fn parse_whole(text: &[u8]) -> Option<(bool, u64)> {
    let (negative, digits) = match text {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] | digits => (false, digits),
    };
    let mut value = 0_u64;
    for byte in digits {
        let digit = byte.wrapping_sub(b'0');
        if digit > 9 {
            return None;
        }
        value = value.checked_mul(10)?.checked_add(digit.into())?;
    }
    (!digits.is_empty()).then_some((negative, value))
}

/// Moves past digits and puts them behind those of `value`, which wraps round after nineteen.
#[inline]
fn digits(text: &[u8], at: &mut usize, value: &mut u64) {
    while let Some(byte) = text.get(*at)
        && byte.wrapping_sub(b'0') < 10
    {
        *value = value.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
        *at += 1;
    }
}

/// `mantissa * 10^exponent`, correctly rounded; none if that is not sure. Most numbers there are take the first branch, which
/// belongs into the loop of the caller.
#[inline(always)]
pub(super) fn short_way(mantissa: u64, exponent: i64) -> Option<f64> {
    if mantissa <= 1 << 53 && (-22..=22).contains(&exponent) {
        // One exact number by another: the one rounding is the right one.
        let (number, power) = (mantissa as f64, super::POWERS[exponent.unsigned_abs() as usize]);
        Some(if exponent < 0 { number / power } else { number * power })
    } else {
        scaled_way(mantissa, exponent)
    }
}

/// The same for numbers of more digits or larger powers.
#[inline(never)]
fn scaled_way(mantissa: u64, exponent: i64) -> Option<f64> {
    if mantissa == 0 {
        return Some(0.0);
    }
    let high = mantissa as f64;
    let (value, lost) = scale(high, mantissa.wrapping_sub(high as u64) as i64 as f64, exponent)?;
    // Far more than `scale` may be wrong by.
    let doubt = value * 2e-30;
    let (least, most) = (value + (lost - doubt), value + (lost + doubt));
    (least == most).then_some(least)
}

/// The same for any number of digits, by the first nineteen or so: sure where one more in the last of these makes no difference.
/// `exponent` belongs to the last digit.
#[optimize(size)]
#[inline(never)]
fn cut_way(digits: &[u8], mut exponent: i64) -> Option<f64> {
    let mut mantissa = 0;
    for digit in digits.iter().map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10) {
        if mantissa >> 60 == 0 {
            mantissa = 10 * mantissa + u64::from(digit);
        } else {
            exponent += 1;
        }
    }
    let least = scaled_way(mantissa, exponent);
    least.filter(|_| least == scaled_way(mantissa + 1, exponent))
}

/// Whether a double lies halfway between two singles, or where singles are further apart.
pub(super) fn is_between_singles(value: f64) -> bool {
    const LOST: u64 = (1 << 29) - 1;
    value.to_bits() & LOST == 1 << 28 || value < f64::from(f32::MIN_POSITIVE)
}

/// The same by the quotient of two whole numbers, whatever their length. `exponent` belongs to the last digit.
#[cold]
#[optimize(size)]
#[inline(never)]
fn long_way(digits: &[u8], mut exponent: i64, precision: Precision) -> f64 {
    let (mut top, mut count, mut more) = (Big::new(0), 0, false);
    for digit in digits.iter().map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10) {
        if count == DIGITS_MAX {
            more |= digit > 0;
            exponent += 1;
        } else {
            top.times(10, digit.into());
            count += i64::from(!top.is_zero());
        }
    }
    if top.is_zero() || exponent + count < -400 {
        return 0.0;
    }
    if exponent + count > 400 {
        return f64::INFINITY;
    }
    let mut bottom = Big::new(1);
    if exponent > 0 { &mut top } else { &mut bottom }.times_power(10, exponent.abs());
    // Until 1 <= top / bottom < 2; the number is that quotient times 2^power.
    let mut power = top.bits() - bottom.bits();
    if power > 0 { &mut bottom } else { &mut top }.times_power(2, power.abs());
    if top.compare(&bottom).is_lt() {
        top.times(2, 0);
        power -= 1;
    }
    let bits = precision.bits.min(power - precision.least + 1);
    if bits < 0 {
        return 0.0;
    }
    if power > 1023 {
        return f64::INFINITY;
    }
    let mut mantissa = 0_u64;
    for _ in 0..bits {
        mantissa *= 2;
        if top.compare(&bottom).is_ge() {
            top.subtract(&bottom);
            mantissa += 1;
        }
        top.times(2, 0);
    }
    // What is left is twice the fraction that rounding decides about; halves go to the even neighbour.
    let order = top.compare(&bottom);
    let up = order.is_gt() || order.is_eq() && (more || mantissa % 2 == 1);
    (mantissa + u64::from(up)) as f64 * power_of_two(power - bits + 1)
}

fn power_of_two(exponent: i64) -> f64 {
    f64::from_bits(if exponent < -1022 { 1 << (exponent + 1074) } else { ((exponent + 1023) as u64) << 52 })
}

#[cfg(test)]
mod tests {
    use super::super::tests::Random;
    use super::*;

    #[track_caller]
    fn check(text: &str) {
        let wanted: f64 = text.parse().unwrap();
        let single: f32 = text.parse().unwrap();
        let (found, length) = parse(text.as_bytes(), false).unwrap();
        assert_eq!((found.to_bits(), length), (wanted.to_bits(), text.len()), "{text}: {found:e} {wanted:e}");
        let (found, _) = parse(text.as_bytes(), true).unwrap();
        assert_eq!((found as f32).to_bits(), single.to_bits(), "{text}: {found:e} {single:e}");
        assert!(found.is_infinite() || found == f64::from(found as f32), "{text}: {found:e} is no single");
    }

    #[test]
    fn hard_numbers_are_rounded_as_std_does() {
        let hard = [
            "0",
            "-0",
            "+0.0",
            "00",
            ".5",
            "5.",
            "-.5e1",
            "1e23",
            "9007199254740993",
            "9007199254740992.999999999",
            "9007199254740993.0000000000000000000000000000000000000001",
            "1e308",
            "1.7976931348623157e308",
            "1.7976931348623158e308",
            "1.7976931348623159e308",
            "179769313486231580793728971405301e276",
            "1e309",
            "4.9e-324",
            "2.4703282292062327e-324",
            "2.4703282292062328e-324",
            "2.2250738585072011e-308",
            "1e-400",
            "2.2250738585072014e-308",
            "1e99999999999999999999",
            "1e-99999999999999999999",
            "1e0000000000000000001",
            "1e-0000000000000000001",
            "0e99999999999999999999",
            "3.4028234663852886e38",
            "3.4028235677973366e38",
            "3.4028235677973365e38",
            "1.17549435e-38",
            "1.4e-45",
            "7.006492321624085e-46",
            "7.006492321624086e-46",
            "7.0064923216240853546186479164495806564013097093825788587853e-46",
            "16777217",
            "16777217.0000000000000000000001",
            "16777216.99999999999999999999",
            "33554433",
            "33554435",
            "1.00000017881393432617187499",
            "1.00000017881393432617187501",
            "0.000000000000000000000000000001234567890123",
            "18446744073709551615",
            "18446744073709551616",
            "9999999999999999999",
            "99999999999999999999",
            "1e22",
            "1e-22",
            "8.5e22",
            "123456789012345678e-40",
            "123456789012345678e40",
            "6.8e-46",
            "000000000000000000000000000.1",
            "1.5E+10",
            "1.5E-10",
            "0.30000000000000004",
            "2.2250738585072012e-308",
            "5e-324",
            "1e10000",
            "1e-10000",
        ];
        hard.into_iter().for_each(check);
        // The middle of two doubles, and just beside it, with more digits than any float needs.
        let half = "1.00000000000000011102230246251565404236316680908203125";
        for text in
            [half.to_owned(), half.to_owned() + &"0".repeat(2000) + "1", half[..half.len() - 1].to_owned() + "4"]
        {
            check(&text);
        }
        check(&("0.".to_owned() + &"0".repeat(500) + "1e500"));
        check(&("1".to_owned() + &"0".repeat(1500) + "e-1490"));
    }

    #[test]
    fn random_numbers_are_rounded_as_std_does() {
        let mut random = Random(1);
        for round in 0..400_000 {
            let double = f64::from_bits(random.next());
            let single = f32::from_bits(random.next() as u32);
            if double.is_finite() && round % 8 == 0 {
                check(&format!("{double:e}"));
            }
            if single.is_finite() {
                check(&format!("{single:e}"));
            }
            let digits = 1 + random.below(20);
            let mantissa = random.next() >> random.below(64);
            let power = random.below(44) as i64 - 22;
            check(&format!("{mantissa}e{power}"));
            check(&format!("{}.{:0digits$}", random.below(100_000), mantissa % 10_u64.pow(digits.min(19) as u32)));
            check(&format!("-0.{mantissa}"));
        }
    }

    #[test]
    fn middles_of_neighbours_go_to_the_even_one() {
        let mut random = Random(2);
        for _ in 0..20_000 {
            // Between two singles, exactly and not quite.
            let low = f32::from_bits(random.next() as u32 >> 1);
            let middle = (f64::from(low) + f64::from(low.next_up())) / 2.0;
            if middle.is_finite() && low > 1e-20 && low < 1e20 {
                let text = format!("{middle:.60}");
                check(&text);
                check(&(text.clone() + "1"));
                check(&format!("{:.80}", middle.next_down()));
            }
            // Between two doubles of which the middle has at most 19 digits.
            let low = (1_u64 << 53) + (random.next() >> 14);
            check(&format!("{}", 2 * low + 1));
            check(&format!("{}.5", low >> 1));
            // More digits than are looked at before the long way.
            check(&format!("0.000{}", 2 * low + 1));
            check(&format!("{}.5000000000000000000000", low >> 1));
            check(&format!("{}.49999999999999999999999", low >> 1));
            check(&format!("{:.25}", f64::from_bits(random.next() >> 2)));
        }
    }

    #[test]
    fn what_is_no_number_is_left() {
        for text in ["", "-", ".", "e5", "-.", "+e", "x", "nan", "inf"] {
            assert_eq!(parse(text.as_bytes(), false), None, "{text}");
        }
        for (text, length) in [("1e", 1), ("1.5e+", 3), ("1.2.3", 3), ("0x10", 1), ("7,5", 1), ("--1", 0), ("1 2", 1)] {
            assert_eq!(parse(text.as_bytes(), false).map_or(0, |(_, length)| length), length, "{text}");
        }
    }

    #[test]
    fn whole_numbers_are_read_to_the_last() {
        assert_eq!(parse_whole(b"18446744073709551615"), Some((false, u64::MAX)));
        assert_eq!(parse_whole(b"-9223372036854775808"), Some((true, 1 << 63)));
        assert_eq!(parse_whole(b"+007"), Some((false, 7)));
        for text in ["", "-", "18446744073709551616", "99999999999999999999", "1.0", "1e3", "--1", "+-1", "1 "] {
            assert_eq!(parse_whole(text.as_bytes()), None, "{text}");
        }
    }
}
