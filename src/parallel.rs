//! The one place that knows whether there are threads: the same loops run over rayon, or on the calling thread.
//!
//! A stage cuts its arrays into tasks, each with its own disjoint pieces, and hands the tasks over. Results come back
//! in the order of the tasks, so nothing depends on the number of threads.

use std::marker::PhantomData;

/// How many threads share the work.
pub(crate) fn threads() -> usize {
    #[cfg(feature = "parallel")]
    return rayon::current_num_threads();
    #[cfg(not(feature = "parallel"))]
    return 1;
}

/// Calls `work` once for each task and collects the answers in the order of the tasks.
pub(crate) fn map<T: Send, R: Send>(tasks: Vec<T>, work: impl Fn(T) -> R + Send + Sync) -> Vec<R> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        tasks.into_par_iter().with_max_len(1).map(work).collect()
    }
    #[cfg(not(feature = "parallel"))]
    tasks.into_iter().map(work).collect()
}

/// A slice into which tasks write at places that no two of them share, in any order.
pub(crate) struct Scatter<'a, T> {
    start: *mut T,
    length: usize,
    slice: PhantomData<&'a mut [T]>,
}

// SAFETY: the only access is `write`, whose callers promise that no two writes meet; values move to the writing side,
// so `T: Send` is all it takes.
unsafe impl<T: Send> Sync for Scatter<'_, T> {}
// SAFETY: as above; the slice is borrowed for as long as this lives.
unsafe impl<T: Send> Send for Scatter<'_, T> {}

impl<'a, T: Copy> Scatter<'a, T> {
    /// Borrows the slice until the last write.
    pub fn new(slice: &'a mut [T]) -> Self {
        Self { start: slice.as_mut_ptr(), length: slice.len(), slice: PhantomData }
    }

    /// Writes one item; panics beyond the end.
    ///
    /// # Safety
    /// No other call, on any thread, may write to the same `place`.
    #[inline]
    pub unsafe fn write(&self, place: usize, item: T) {
        assert!(place < self.length);
        // SAFETY: in bounds by the line above, not shared by the caller's promise.
        unsafe { self.start.add(place).write(item) }
    }
}
