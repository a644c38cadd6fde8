//! Lists that say how much memory they lacked, instead of aborting.

use crate::error::Error;

/// Takes memory for `count` more items, or says how much all of them need.
pub(crate) fn reserve<T>(items: &mut Vec<T>, count: usize, what: &str) -> Result<(), Error> {
    let needed = (items.len() as u64 + count as u64) * size_of::<T>() as u64;
    items.try_reserve_exact(count).map_err(|_| Error::memory(what, needed))
}

/// Takes memory for `count` more items, and for as many again as there are: for a list that grows bit by bit. Where that is
/// not to be had, for a sixteenth as many: fewer would be copied too often.
#[inline(never)]
pub(crate) fn grow<T>(items: &mut Vec<T>, count: usize, what: &str) -> Result<(), Error> {
    items.try_reserve(count).or_else(|_| reserve(items, count.max(items.len() / 16), what))
}

/// The same list without room to grow, or how much memory that lacked.
pub(crate) fn fitted<T: Copy>(items: &[T], what: &str) -> Result<Vec<T>, Error> {
    let mut fitted = Vec::new();
    reserve(&mut fitted, items.len(), what)?;
    fitted.extend_from_slice(items);
    Ok(fitted)
}

/// A list of `count` times the same, or how much memory was needed.
pub(crate) fn filled<T: Clone>(value: T, count: usize, what: &str) -> Result<Vec<T>, Error> {
    let mut items = Vec::new();
    reserve(&mut items, count, what)?;
    items.resize(count, value);
    Ok(items)
}

/// Where each of some runs starts, from their lengths; one more at the end.
pub(crate) fn starts(lengths: &[u32], what: &str) -> Result<Vec<usize>, Error> {
    let mut starts = Vec::new();
    reserve(&mut starts, lengths.len() + 1, what)?;
    let mut total = 0;
    starts.push(0);
    starts.extend(lengths.iter().map(|&length| {
        total += length as usize;
        total
    }));
    Ok(starts)
}

/// The items of all lists, one list after the other; or the memory that it lacked.
pub(crate) fn concatenated<T>(lists: Vec<Vec<T>>, what: &str) -> Result<Vec<T>, Error> {
    let mut all = Vec::new();
    reserve(&mut all, lists.iter().map(Vec::len).sum(), what)?;
    for mut list in lists {
        all.append(&mut list);
    }
    Ok(all)
}
