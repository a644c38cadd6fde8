//! Loops over threads: the same ones run over rayon, or where there is none on the calling thread.
//!
//! A stage cuts its arrays into tasks, each with its own disjoint pieces, and hands the tasks over. Results come back
//! in the order of the tasks, so nothing depends on the number of threads.

use crate::error::Error;
use std::alloc::Layout;
use std::marker::PhantomData;
use std::mem::{ManuallyDrop, MaybeUninit};
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// How many threads share the work.
pub(crate) fn threads() -> usize {
    #[cfg(feature = "parallel")]
    return rayon::current_num_threads();
    #[cfg(not(feature = "parallel"))]
    return 1;
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

/// A slice that tasks take apart in pieces that no two of them share.
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
}

/// A list that tasks append to, in whatever order they come; or the memory that it lacked.
pub(crate) struct Gathering<T> {
    what: &'static str,
    items: Mutex<Result<Vec<T>, Error>>,
}

impl<T> Gathering<T> {
    /// An empty list of what the error would call `what`.
    pub fn new(what: &'static str) -> Self {
        Self { what, items: Mutex::new(Ok(Vec::new())) }
    }

    /// Appends a task's items.
    pub fn append(&self, mut more: Vec<T>) {
        let mut items = self.items.lock().unwrap_or_else(PoisonError::into_inner);
        if let Ok(list) = &mut *items {
            if list.try_reserve(more.len()).is_ok() {
                list.append(&mut more);
            } else {
                // Twice the room there was.
                let needed = (list.len() + more.len()).max(2 * list.capacity()) as u64 * size_of::<T>() as u64;
                *items = Err(Error::memory(self.what, needed));
            }
        }
    }

    /// All items, in an order that depends on the threads: to be sorted.
    pub fn all(self) -> Result<Vec<T>, Error> {
        self.items.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A list that tasks fill, each item once and in any order. Not zeroed before: that would be a pass over the memory by
/// one thread, a tenth of the time of an estimate.
pub(crate) struct Filling<T> {
    /// Memory for `length` items, as a `Vec` would take it.
    start: *mut T,
    length: usize,
}

// SAFETY: as for `Scatter`.
unsafe impl<T: Send> Sync for Filling<T> {}
// SAFETY: it owns its memory, as a `Vec` does.
unsafe impl<T: Send> Send for Filling<T> {}

impl<T: Copy> Filling<T> {
    /// Takes the memory, or says how much was needed.
    #[inline]
    pub fn new(length: usize, what: &str) -> Result<Self, Error> {
        Ok(Self { start: room(Layout::new::<T>(), length, what)?.cast(), length })
    }

    /// Some items in a row, to be written; panics beyond the end.
    ///
    /// # Safety
    /// No other call, on any thread, may touch one of these items while the result lives.
    #[inline]
    #[allow(clippy::mut_from_ref)] // As in `Scatter`.
    pub unsafe fn slice(&self, range: Range<usize>) -> &mut [MaybeUninit<T>] {
        assert!(range.start <= range.end && range.end <= self.length);
        // SAFETY: within the capacity by the line above, not shared by the caller's promise.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(range.start).cast(), range.len()) }
    }

    /// Writes one item; panics beyond the end.
    ///
    /// # Safety
    /// No other call, on any thread, may touch the same item.
    #[inline]
    pub unsafe fn write(&self, place: usize, item: T) {
        assert!(place < self.length);
        // SAFETY: within the capacity by the line above, not shared by the caller's promise.
        unsafe { self.start.add(place).write(item) }
    }

    /// The list.
    ///
    /// # Safety
    /// Every item must have been written.
    pub unsafe fn complete(self) -> Vec<T> {
        let Self { start, length } = *ManuallyDrop::new(self);
        // SAFETY: taken for so many items; all are written by the caller's promise.
        unsafe { Vec::from_raw_parts(start, length, length) }
    }
}

impl<T> Drop for Filling<T> {
    fn drop(&mut self) {
        // SAFETY: taken for so many items, of which none has to be dropped.
        drop(unsafe { Vec::from_raw_parts(self.start, 0, self.length) });
    }
}

/// Memory for `count` items, as a `Vec` would take it. Not generic: the size of the module is what a page waits for.
#[inline(never)]
fn room(item: Layout, count: usize, what: &str) -> Result<*mut u8, Error> {
    let size = (item.size() as u64).saturating_mul(count as u64);
    let start = match isize::try_from(size) {
        Ok(0) => std::ptr::without_provenance_mut(item.align()),
        // SAFETY: not empty, and the alignment is that of a type.
        Ok(size) => unsafe { std::alloc::alloc(Layout::from_size_align_unchecked(size as usize, item.align())) },
        Err(_) => std::ptr::null_mut(),
    };
    if start.is_null() { Err(Error::memory(what, size)) } else { Ok(start) }
}
