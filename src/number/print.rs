//! Numbers to text.

use super::big::Big;
use super::parse::{is_between_singles, short_way};
use super::{POWERS, Precision, scale};

/// Appends the shortest text that reads back as the same double, or with `single` as the same single.
pub(crate) fn print(out: &mut Vec<u8>, value: f64, single: bool) {
    if value.is_nan() {
        // Without the sign, which says nothing.
        return out.extend_from_slice(b"nan");
    }
    if value.is_sign_negative() {
        out.push(b'-');
    }
    let value = value.abs();
    if value.is_infinite() {
        return out.extend_from_slice(b"inf");
    }
    if value == 0.0 {
        return out.push(b'0');
    }
    let (digits, point) = short_digits(value, single).unwrap_or_else(|| long_digits(value, Precision::of(single)));
    let start = out.len();
    print_whole(out, digits);
    while out.last() == Some(&b'0') {
        out.pop();
    }
    let count = (out.len() - start) as i64;
    let plain = (1e-5..1e16).contains(&value);
    // Digits before the point.
    let whole = if plain { point } else { 1 };
    for _ in whole..1 {
        out.insert(start, b'0');
    }
    for _ in count..whole {
        out.push(b'0');
    }
    if count > whole {
        out.insert(start + whole.max(1) as usize, b'.');
    }
    if !plain {
        out.push(b'e');
        if point < 1 {
            out.push(b'-');
        }
        print_whole(out, (point - 1).unsigned_abs());
    }
}

/// Appends a whole number.
pub(crate) fn print_whole(out: &mut Vec<u8>, mut value: u64) {
    let mut text = [0; 20];
    let mut at = text.len();
    loop {
        at -= 1;
        text[at] = b'0' + (value % 10) as u8;
        value /= 10;
        if value == 0 {
            return out.extend_from_slice(&text[at..]);
        }
    }
}

/// The digits of a number above zero, and where its point is: before them, or so many after. None if the way through
/// double precision does not reach that far.
fn short_digits(value: f64, single: bool) -> Option<(u64, i64)> {
    if value >= 1e22 {
        return None;
    }
    // The last power of ten that is not above the number; being wrong by one costs nothing but a digit.
    let power = if value >= 1.0 {
        POWERS.iter().take_while(|power| **power <= value).count() as i64 - 1
    } else {
        -(POWERS.iter().take_while(|power| **power * value < 1.0).count() as i64)
    };
    // Fewer digits are found among the first count as zeros at the end, for these counts tell all numbers apart.
    let counts = if single { 6..=9 } else { 15..=17 };
    for count in counts {
        let shift = count - 1 - power;
        let (high, lost) = scale(value, 0.0, shift)?;
        let whole = high.floor();
        let digits = (whole as u64).wrapping_add_signed((high - whole + lost + 0.5).floor() as i64);
        let back = short_way(digits, -shift)?;
        let same = if single { f64::from(back as f32) == value && !is_between_singles(back) } else { back == value };
        if same {
            return Some((digits, decimal_length(digits) - shift));
        }
    }
    None
}

fn decimal_length(digits: u64) -> i64 {
    let mut rest = digits;
    let mut length = 0;
    while rest > 0 {
        rest /= 10;
        length += 1;
    }
    length
}

/// The same for any number: the digits that its distance from its neighbours asks for (Steele and White).
#[cold]
#[inline(never)]
#[optimize(size)]
fn long_digits(value: f64, precision: Precision) -> (u64, i64) {
    let bits = value.to_bits();
    // Mantissa and exponent in the number's own precision, which is at most that of a double.
    let mut exponent = (bits >> 52) as i64 - 1075;
    let mut mantissa = bits & ((1 << 52) - 1) | (1 << 52);
    if exponent == -1075 {
        (exponent, mantissa) = (-1074, bits & ((1 << 52) - 1));
    }
    let unused = (53 - precision.bits).max(precision.least - exponent);
    (exponent, mantissa) = (exponent + unused, mantissa >> unused);

    let even = mantissa.is_multiple_of(2);
    // Below a power of two, neighbours are half as far apart.
    let lowest = mantissa == 1 << (precision.bits - 1) && exponent > precision.least;
    // All in quarters of the mantissa's last bit: the number, where it would become its upper neighbour, and how far
    // the like is below.
    let (mut rest, mut upper) = (Big::new(4 * mantissa), Big::new(4 * mantissa + 2));
    let (mut below, mut one) = (Big::new(if lowest { 1 } else { 2 }), Big::new(4));
    for number in [&mut rest, &mut upper, &mut below] {
        number.times_power(2, exponent);
    }
    one.times_power(2, -exponent);
    let reaches = |upper: &Big, one: &Big| {
        let order = upper.compare(one);
        order.is_gt() || even && order.is_eq()
    };
    let mut point = 0;
    while reaches(&upper, &one) {
        one.times(10, 0);
        point += 1;
    }
    let mut digits = 0_u64;
    loop {
        for number in [&mut rest, &mut upper, &mut below] {
            number.times(10, 0);
        }
        if digits == 0 && !reaches(&upper, &one) {
            point -= 1;
            continue;
        }
        let mut digit = 0;
        while rest.compare(&one).is_ge() {
            rest.subtract(&one);
            upper.subtract(&one);
            digit += 1;
        }
        let order = rest.compare(&below);
        let down = order.is_lt() || even && order.is_eq();
        let up = reaches(&upper, &one);
        digits = 10 * digits + digit;
        if down || up {
            rest.times(2, 0);
            return (digits + u64::from(up && (!down || rest.compare(&one).is_ge())), point);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Random;
    use super::*;

    fn printed(value: f64, single: bool) -> String {
        let mut out = b"before ".to_vec();
        print(&mut out, value, single);
        String::from_utf8(out).unwrap()["before ".len()..].to_owned()
    }

    /// As `{}` or `{:e}` prints it.
    fn wanted<F: Into<f64> + Copy + std::fmt::Display + std::fmt::LowerExp>(value: F) -> String {
        let wide: f64 = value.into().abs();
        if wide == 0.0 || (1e-5..1e16).contains(&wide) { format!("{value}") } else { format!("{value:e}") }
    }

    /// The same text as the standard library's, but for numbers whose neighbours below are nearer than those above.
    fn check(value: f64) {
        let text = printed(value, false);
        assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text} {value:e}");
        assert!(text == wanted(value) || value.to_bits() << 12 == 0, "{text} {value:e}");
    }

    fn check_single(value: f32) {
        let text = printed(value.into(), true);
        assert_eq!(text.parse::<f32>().unwrap().to_bits(), value.to_bits(), "{text} {value:e}");
        // A text that means the middle of two singles would be right too, but only to a reader that rounds it well.
        let middle = is_between_singles(wanted(value).parse::<f64>().unwrap().abs());
        assert!(text == wanted(value) || value.to_bits() << 9 == 0 || middle, "{text} {value:e}");
    }

    #[test]
    fn numbers_are_as_short_as_they_can_be() {
        let fixed = [
            0.0,
            -0.0,
            1.0,
            -1.5,
            10.0,
            100.0,
            123.456,
            0.1,
            0.3,
            1e-5,
            9.99e-6,
            1e-7,
            1e15,
            1e16,
            9.9e15,
            1e22,
            1e23,
            5e-324,
            f64::MAX,
            f64::MIN_POSITIVE,
            0.1 + 0.2,
            1.0 / 3.0,
            123_456_789.125,
            4.35,
            2.5e-310,
            9007199254740993.0,
        ];
        for value in fixed {
            check(value);
            check_single(value as f32);
        }
        assert_eq!(printed(f64::NAN, true) + &printed(f64::NEG_INFINITY, true), "nan-inf");
        assert_eq!(printed(-1e-45_f32 as f64, true), "-1e-45");
        assert_eq!(super::super::text(0.25), "0.25");
    }

    #[test]
    fn random_numbers_are_printed_as_std_does() {
        let mut random = Random(3);
        for round in 0..300_000 {
            let word = random.next();
            let (double, single) = (f64::from_bits(word), f32::from_bits(word as u32));
            if double.is_finite() && round % 8 == 0 {
                check(double);
            }
            if single.is_finite() {
                check_single(single);
            }
            check((word as f64 / 1e19 - 0.5) * 10_f64.powi(random.below(10) as i32));
            check_single((word as f32 / 1e19 - 0.5) * 10_f32.powi(random.below(10) as i32));
            check((word >> random.below(60)) as f64 / 1000.0);
        }
        (0..2000).for_each(|power| check(2_f64.powi(power - 1000)));
        (0..250).for_each(|power| check_single(2_f32.powi(power - 125)));
    }

    #[test]
    fn whole_numbers_are_printed_to_the_last() {
        for value in [0, 7, 10, 1_000_000_007, u64::MAX] {
            let mut out = Vec::new();
            print_whole(&mut out, value);
            assert_eq!(out, value.to_string().into_bytes());
        }
    }
}
