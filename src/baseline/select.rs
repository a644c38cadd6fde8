//! Partial sorting: the smallest so many of some items. The library's is 8 KB of WebAssembly for two kinds of items.

use std::cmp::Ordering;

/// Moves the item that would be `nth` (from 0) in the order of the keys to that place, smaller ones before it and larger
/// ones behind it. No two keys are equal.
///
/// In linear time: Hoare, "Algorithm 65: find", 1961, with Lomuto's partition, which needs no branch that cannot be
/// foreseen, and pivots from places that no input has reason to be prepared for.
pub(super) fn select<T: Copy>(items: &mut [T], nth: usize, key: impl Fn(&T) -> u64) {
    let mut items = items;
    let mut nth = nth;
    let mut seed = 1u32;
    while items.len() > 1 {
        let last = items.len() - 1;
        let mut random = || {
            seed = seed.wrapping_mul(0x9E37_79B9).wrapping_add(0x7F4A_7C15);
            ((u64::from(seed) * items.len() as u64) >> 32) as usize
        };
        let (a, b, c) = (random(), random(), random());
        let (low, high) = if key(&items[a]) < key(&items[b]) { (a, b) } else { (b, a) };
        let median = if key(&items[c]) < key(&items[low]) {
            low
        } else if key(&items[c]) < key(&items[high]) {
            c
        } else {
            high
        };
        items.swap(median, last);
        let pivot = key(&items[last]);
        let mut smaller = 0;
        for i in 0..last {
            let is_smaller = key(&items[i]) < pivot;
            items.swap(i, smaller);
            smaller += usize::from(is_smaller);
        }
        items.swap(smaller, last);
        match nth.cmp(&smaller) {
            Ordering::Less => items = &mut items[..smaller],
            Ordering::Equal => return,
            Ordering::Greater => {
                nth -= smaller + 1;
                items = &mut items[smaller + 1..];
            }
        }
    }
}
