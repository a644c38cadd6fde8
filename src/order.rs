//! Sorting, where the library's is small and slow in WebAssembly: numbers as whole numbers, for which there is one sort, and
//! short lists.

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

/// Sorts by eight bits after eight, in linear time.
#[optimize(size)]
pub(crate) fn sort(numbers: &mut Vec<i64>) {
    let mut sorted = vec![0; numbers.len()];
    for shift in (0..64).step_by(8) {
        // Negative numbers come first.
        let digit = |number: i64| ((number ^ i64::MIN) >> shift) as usize & 255;
        let mut next = [0; 256];
        let mut total = 0;
        numbers.iter().for_each(|&number| next[digit(number)] += 1);
        // All alike, as the last bits of what was in single precision.
        if numbers.first().is_none_or(|&first| next[digit(first)] == numbers.len()) {
            continue;
        }
        next.iter_mut().for_each(|next| total += std::mem::replace(next, total));
        for &number in &*numbers {
            let next = &mut next[digit(number)];
            sorted[*next] = number;
            *next += 1;
        }
        std::mem::swap(numbers, &mut sorted);
    }
}

/// Sorts triples, each of which stays once. In place; whole numbers of this width for all, so that there is one such sort.
#[inline(never)]
pub(crate) fn sort_unique(triples: &mut Vec<[i64; 3]>) {
    triples.sort_unstable();
    triples.dedup();
}

/// Sorts a list without NaN by insertion, and of short ones nothing is faster; if it is longer, after each has a rough place by its
/// `height`, which must be in the same order: among that of all, as if they were evenly spread.
pub(crate) fn sort_few<T: Copy + PartialOrd>(list: &mut [T], height: impl Fn(T) -> f32) {
    const FEW: usize = 32;
    // Without signs hardly a list is longer, and the sort by parts is left out of the module then.
    if list.len() > SOME || list.len() > FEW && !cfg!(feature = "full") {
        list.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        return;
    }
    if list.len() > FEW {
        sort_roughly(list, height);
    }
    insert_each(list);
}

/// More are not sorted by insertion: where they are not evenly spread that takes the square of their number.
const SOME: usize = 512;

/// Sorts up to [`SOME`] items into as many parts of one height.
#[inline(never)]
fn sort_roughly<T: Copy>(list: &mut [T], height: impl Fn(T) -> f32) {
    let bounds = |(low, high): (f32, f32), &one: &T| (height(one).min(low), height(one).max(high));
    let (low, high) = list.iter().fold((f32::INFINITY, f32::NEG_INFINITY), bounds);
    let last = list.len() - 1;
    let scale = last as f32 / (high - low);
    // If all are at one height, or so near to it that the scale is infinite, not a number, which becomes 0, or too large.
    let part = |one: T| (((height(one) - low) * scale) as usize).min(last);
    let (mut next, mut total, mut sorted) = ([0u16; SOME], 0, [list[0]; SOME]);
    list.iter().for_each(|&one| next[part(one)] += 1);
    next[..list.len()].iter_mut().for_each(|next| total += std::mem::replace(next, total));
    for &one in &*list {
        let next = &mut next[part(one)];
        sorted[usize::from(*next) % SOME] = one;
        *next += 1;
    }
    list.copy_from_slice(&sorted[..list.len()]);
}

/// Sorts a list without NaN by insertion: in few steps if it is short, or sorted but for little.
#[inline(always)]
pub(crate) fn insert_each<T: Copy + PartialOrd>(list: &mut [T]) {
    for end in 1..list.len() {
        let one = list[end];
        let mut place = end;
        while place > 0 && one < list[place - 1] {
            list[place] = list[place - 1];
            place -= 1;
        }
        list[place] = one;
    }
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

    #[test]
    fn sorted_are_all_numbers_of_all_sizes() {
        let mut numbers: Vec<i64> = (0..2000).map(|i: i64| i.wrapping_mul(0x9E37_79B9_7F4A_7C15_u64 as i64)).collect();
        numbers.extend([0, -1, 1, i64::MIN, i64::MAX, 255, 256, -256, 7, 7, 7]);
        for shift in [0, 20, 56, 63] {
            let mut found: Vec<i64> = numbers.iter().map(|number| number >> shift).collect();
            let mut expected = found.clone();
            expected.sort_unstable();
            sort(&mut found);
            assert_eq!(found, expected);
        }
        sort(&mut vec![]);
    }

    #[test]
    fn few_are_sorted_as_many() {
        for length in 0..600u32 {
            let mut list: Vec<u32> = (0..length).map(|i| i.wrapping_mul(0x9E37_79B9) % 50).collect();
            let mut expected = list.clone();
            expected.sort_unstable();
            sort_few(&mut list, |one| one as f32);
            assert_eq!(list, expected);
            // So near to each other that nothing tells how far.
            let mut list: Vec<f32> = (0..length).map(|i| f32::from_bits(i.wrapping_mul(0x9E37_79B9) % 3)).collect();
            let mut expected = list.clone();
            expected.sort_unstable_by(f32::total_cmp);
            sort_few(&mut list, |one| one);
            assert_eq!(list, expected);
        }
    }
}
