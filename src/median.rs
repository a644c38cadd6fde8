//! The middle of some values, without sorting them.

/// The median of some values, none of them negative; 0 if there are none.
pub(crate) fn median(values: &[f32]) -> f32 {
    // Bit by bit: the bits of numbers that are not negative are in the order of the numbers.
    let mut bits = 0u32;
    for bit in (0..31).rev() {
        let more = bits | 1 << bit;
        if values.iter().filter(|value| value.to_bits() < more).count() <= values.len() / 2 {
            bits = more;
        }
    }
    if values.is_empty() { 0.0 } else { f32::from_bits(bits) }
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn medians_are_those_of_the_sorted_values() {
        let values: Vec<f32> = (0..101).map(|i| ((i * 37) % 101) as f32 * 1e-9).collect();
        assert_eq!(median(&values), 50.0 * 1e-9);
        assert_eq!((median(&[3.5]), median(&[])), (3.5, 0.0));
    }
}
