//! The one place that knows whether there are threads: the same loops run over rayon, or on the calling thread.
//!
//! A stage cuts its arrays into tasks, each with its own disjoint pieces, and hands the tasks over. Results come back
//! in the order of the tasks, so nothing depends on the number of threads.

/// How many threads share the work.
pub(crate) fn threads() -> usize {
    #[cfg(feature = "parallel")]
    return rayon::current_num_threads();
    #[cfg(not(feature = "parallel"))]
    return 1;
}

/// Calls `work` once for each task.
pub(crate) fn for_each<T: Send>(tasks: Vec<T>, work: impl Fn(T) + Send + Sync) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        tasks.into_par_iter().with_max_len(1).for_each(work);
    }
    #[cfg(not(feature = "parallel"))]
    tasks.into_iter().for_each(work);
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
