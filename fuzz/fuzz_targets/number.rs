//! Any bytes as decimal text, and as numbers that are printed, beside what the standard library does.
#![no_main]
#![feature(optimize_attribute)]

// The module alone: the crate does not hand it out.
#[allow(dead_code)]
#[path = "../../src/number/mod.rs"]
mod number;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    parse(bytes);
    if let Some(&bits) = bytes.first_chunk() {
        let bits = u64::from_le_bytes(bits);
        print(f64::from_bits(bits));
        let mut out = Vec::new();
        number::print_whole(&mut out, bits);
        assert_eq!(out, bits.to_string().into_bytes());
    }
    if let Some(&bits) = bytes.first_chunk() {
        print_single(f32::from_bits(u32::from_le_bytes(bits)));
    }
});

/// The longest beginning that is a number.
fn parse(bytes: &[u8]) {
    let text = bytes.iter().take_while(|byte| byte.is_ascii()).map(|&byte| char::from(byte)).collect::<String>();
    let unsigned = text.strip_prefix(['-', '+']).unwrap_or(&text);
    // The library knows words too.
    let length =
        unsigned.bytes().take_while(|byte| matches!(byte, b'0'..=b'9' | b'.' | b'e' | b'E' | b'+' | b'-')).count();
    let most = text.len() - unsigned.len() + length;
    let wanted = (0..=most).rev().find_map(|end| Some((text[..end].parse::<f64>().ok()?, end)));
    let found = number::parse(bytes, false);
    assert_eq!(found.map(|(x, end)| (x.to_bits(), end)), wanted.map(|(x, end)| (x.to_bits(), end)), "{text}");
    let single = number::parse(bytes, true);
    let wanted_single = wanted.map(|(_, end)| (text[..end].parse::<f32>().unwrap(), end));
    assert_eq!(
        single.map(|(x, end)| ((x as f32).to_bits(), end)),
        wanted_single.map(|(x, end)| (x.to_bits(), end)),
        "{text}"
    );
    let whole =
        text.parse::<i128>().ok().filter(|_| bytes.is_ascii()).filter(|whole| whole.unsigned_abs() <= u64::MAX.into());
    let found = number::parse_whole(bytes);
    let value = found.map(|(negative, size)| if negative { -i128::from(size) } else { i128::from(size) });
    assert_eq!(value, whole, "{text}");
}

fn printed(value: f64, single: bool) -> String {
    let mut out = Vec::new();
    number::print(&mut out, value, single);
    assert!(out.len() <= 25);
    String::from_utf8(out).unwrap()
}

fn digits(text: &str) -> usize {
    let mantissa = text.split('e').next().unwrap();
    let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    digits.trim_matches('0').len()
}

fn print(value: f64) {
    let text = printed(value, false);
    let back: f64 = text.parse().unwrap();
    assert!(back.to_bits() == value.to_bits() || back.is_nan() && value.is_nan(), "{value:e} is printed as {text}");
    assert!(value.is_nan() || digits(&text) <= digits(&format!("{value:e}")), "{value:e} is printed as {text}");
}

fn print_single(value: f32) {
    let text = printed(value.into(), true);
    let back: f32 = text.parse().unwrap();
    assert!(back.to_bits() == value.to_bits() || back.is_nan() && value.is_nan(), "{value:e} is printed as {text}");
    // Readers that round twice read it, too.
    let twice = text.parse::<f64>().unwrap() as f32;
    assert!(twice.to_bits() == value.to_bits() || back.is_nan(), "{value:e} is printed as {text}, in double {twice:e}");
    // The library's may lie halfway to the next one.
    let shortest = format!("{value:e}");
    let exact: f64 = shortest.parse().unwrap();
    let is_halfway =
        [value.next_up(), value.next_down()].iter().any(|&x| exact == (f64::from(x) + f64::from(value)) / 2.0);
    assert!(value.is_nan() || is_halfway || digits(&text) <= digits(&shortest), "{value:e} is printed as {text}");
}
