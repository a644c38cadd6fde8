//! Numbers as whole numbers of the same order: sorting code is large, and so there need not be any for each type.

/// The place of a number among all numbers: NaN last, and 0 after -0.
pub(crate) fn ordinal(number: f64) -> i64 {
    mirror(number.to_bits() as i64)
}

/// The number at a place.
pub(crate) fn from_ordinal(ordinal: i64) -> f64 {
    f64::from_bits(mirror(ordinal) as u64)
}

/// Turns the order of negative numbers round.
fn mirror(bits: i64) -> i64 {
    bits ^ (bits >> 63 & i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_that_of_the_numbers() {
        let numbers = [-f64::INFINITY, -2.5, -1e-310, -0.0, 0.0, 1e-310, 7.0, f64::MAX, f64::INFINITY];
        assert!(numbers.map(ordinal).is_sorted_by(|a, b| a < b));
        assert!(ordinal(f64::INFINITY) < ordinal(f64::NAN));
        assert_eq!(numbers.map(ordinal).map(from_ordinal).map(f64::to_bits), numbers.map(f64::to_bits));
    }
}
