//! The middle of some values, or what stands at another rank, without sorting them; how far values deviate.

use crate::order::sort_few;

/// The median of some values, none of them negative; 0 if there are none.
pub(crate) fn median(values: &[f32]) -> f32 {
    // The bits of numbers that are not negative are in the order of the numbers.
    f32::from_bits(ranked(values.iter().map(|value| value.to_bits()), values.len() / 2))
}

/// The number that would stand at `rank` if they were sorted; 0 if there are none. Bit by bit: in as many passes as the largest
/// has bits, however many are alike. The library's selection takes the square of their number for such, as the modules have
/// its small one.
pub(crate) fn ranked(numbers: impl Iterator<Item = u32> + Clone, rank: usize) -> u32 {
    ranked_runs(numbers.map(|number| (number, 1)), rank)
}

/// The same of numbers of which each comes with how often it is there.
pub(crate) fn ranked_runs(runs: impl Iterator<Item = (u32, usize)> + Clone, rank: usize) -> u32 {
    let bits = u32::BITS - runs.clone().map(|(number, _)| number).max().unwrap_or(0).leading_zeros();
    let mut found = 0;
    for bit in (0..bits).rev() {
        let more = found | 1 << bit;
        if runs.clone().filter(|&(number, _)| number < more).map(|(_, count)| count).sum::<usize>() <= rank {
            found = more;
        }
    }
    found
}

/// How far two values and more deviate if they are normally distributed about a few that lie apart, as heights of points about
/// both sides of a thin wall do, which count twice then: by the median of the gaps between neighbours. Leaves the gaps.
pub(crate) fn deviation(values: &mut Vec<f32>) -> f32 {
    /// Of normally distributed values the median of the gaps times their number, in deviations.
    const GAPS: f32 = 2.2;
    let count = values.len() as f32;
    sort_few(values, |value| value);
    for i in 1..values.len() {
        values[i - 1] = values[i] - values[i - 1];
    }
    values.pop();
    sort_few(values, |value| value);
    values[values.len() / 2] * count / GAPS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_those_of_the_sorted_values() {
        let values: Vec<f32> = (0..101).map(|i| ((i * 37) % 101) as f32 * 1e-9).collect();
        assert_eq!(median(&values), 50.0 * 1e-9);
        assert_eq!((median(&[3.5]), median(&[])), (3.5, 0.0));
    }

    #[test]
    fn deviations_are_told_by_gaps() {
        let mut bits = 1u32;
        let mut uniform = || {
            bits = bits.wrapping_mul(0x9E37_79B9).wrapping_add(0x85EB_CA6B);
            ((bits ^ bits >> 15) >> 8) as f32 / (1 << 24) as f32
        };
        // The sum of twelve is nearly normal, of deviation 1.
        let mut normal = |_| 0.1 * ((0..12).map(|_| uniform()).sum::<f32>() - 6.0);
        let mut one: Vec<f32> = (0..2000).map(&mut normal).collect();
        let mut two: Vec<f32> = (0..2000).map(|i| normal(i) + if i % 2 == 0 { 50.0 } else { 0.0 }).collect();
        for (values, expected) in [(&mut one, 0.1), (&mut two, 0.2)] {
            let found = deviation(values);
            assert!((found / expected - 1.0).abs() < 0.25, "{found} is not {expected}");
        }
    }

    #[test]
    fn ranks_are_those_of_the_sorted_numbers() {
        for spread in [1, 2, 7, 1 << 27, u32::MAX] {
            let numbers = (0..100u32).map(|i| i.wrapping_mul(0x9E37_79B9) % spread);
            let mut sorted: Vec<u32> = numbers.clone().collect();
            sorted.sort_unstable();
            for rank in [0, 1, 50, 98, 99] {
                assert_eq!(ranked(numbers.clone(), rank), sorted[rank], "{spread}, {rank}");
            }
        }
    }
}
