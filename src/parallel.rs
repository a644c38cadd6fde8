//! The one place that knows whether there are threads: the same loops run over rayon, or on the calling thread.
//!
//! A stage cuts its arrays into tasks, each with its own disjoint pieces, and hands the tasks over. Results come back
//! in the order of the tasks, so nothing depends on the number of threads.

use std::marker::PhantomData;
use std::ops::Range;

/// How many threads share the work.
pub(crate) fn threads() -> usize {
    #[cfg(feature = "parallel")]
    return rayon::current_num_threads();
    #[cfg(not(feature = "parallel"))]
    return 1;
}

/// Calls `work` once for each task and collects the answers in the order of the tasks.
pub(crate) fn map<T: Send, R: Send>(tasks: Vec<T>, work: impl Fn(T) -> R + Sync) -> Vec<R> {
    let mut slots: Vec<(Option<T>, Option<R>)> = tasks.into_iter().map(|task| (Some(task), None)).collect();
    let count = slots.len();
    let shared = Scatter::new(&mut slots);
    each(count, &|i| {
        // SAFETY: `each` passes every number once, so this slot is this call's alone.
        let (task, answer) = &mut unsafe { shared.slice(i..i + 1) }[0];
        *answer = task.take().map(&work);
    });
    slots.into_iter().filter_map(|(_, answer)| answer).collect()
}

/// Calls `work` once for each number below `count`. Not generic, so that rayon is compiled once: the size of the module
/// is what a page waits for.
pub(crate) fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().with_max_len(1).for_each(work);
    }
    #[cfg(not(feature = "parallel"))]
    (0..count).for_each(work);
}

/// The pieces of a list of `length` items that tasks of `size` items take.
pub(crate) fn piece(length: usize, size: usize, number: usize) -> Range<usize> {
    number * size..((number + 1) * size).min(length)
}

/// A slice into which tasks write at places that no two of them share, in any order.
pub(crate) struct Scatter<'a, T> {
    start: *mut T,
    length: usize,
    slice: PhantomData<&'a mut [T]>,
}

// SAFETY: every access is by an unsafe function whose caller promises that no two of them meet in one item, so each item
// is used by one thread at a time, and `T: Send` is all it takes.
unsafe impl<T: Send> Sync for Scatter<'_, T> {}
// SAFETY: as above; the slice is borrowed for as long as this lives.
unsafe impl<T: Send> Send for Scatter<'_, T> {}

impl<'a, T> Scatter<'a, T> {
    /// Borrows the slice until the last write.
    pub fn new(slice: &'a mut [T]) -> Self {
        Self { start: slice.as_mut_ptr(), length: slice.len(), slice: PhantomData }
    }

    /// Some items in a row; panics beyond the end.
    ///
    /// # Safety
    /// No other call, on any thread, may touch one of these items while the result lives.
    #[inline]
    #[allow(clippy::mut_from_ref)] // What this type is for: the caller's promise stands in for the borrow checker.
    pub unsafe fn slice(&self, range: Range<usize>) -> &mut [T] {
        assert!(range.start <= range.end && range.end <= self.length);
        // SAFETY: in bounds by the line above, not shared by the caller's promise.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(range.start), range.len()) }
    }

    /// Writes one item; panics beyond the end.
    ///
    /// # Safety
    /// No other call, on any thread, may touch the same item.
    #[inline]
    pub unsafe fn write(&self, place: usize, item: T)
    where
        T: Copy,
    {
        assert!(place < self.length);
        // SAFETY: in bounds by the line above, not shared by the caller's promise; `Copy` leaves nothing to drop.
        unsafe { self.start.add(place).write(item) }
    }
}
