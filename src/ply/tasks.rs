//! Parallel work that may fail.

use crate::error::Error;
use crate::parallel;
use crate::progress::Stage;
use std::sync::{Mutex, PoisonError};

/// Tasks whose results are in memory at once.
pub(super) fn wave() -> usize {
    8 * parallel::threads()
}

/// Runs `work` for each number below `count`, in parallel, with progress. The error is that of the first task that
/// fails, in the order of the numbers.
#[optimize(size)]
pub(super) fn run(
    stage: &Stage,
    count: usize,
    work: &(dyn Fn(usize) -> Result<(), Error> + Sync),
) -> Result<(), Error> {
    let first: Mutex<Option<(usize, Error)>> = Mutex::new(None);
    stage.run(count, &|i| {
        let failed = || first.lock().unwrap_or_else(PoisonError::into_inner);
        // Only an earlier error would still matter.
        if failed().as_ref().is_some_and(|(before, _)| *before < i) {
            return;
        }
        if let Err(error) = work(i) {
            let mut failed = failed();
            if failed.as_ref().is_none_or(|(before, _)| i < *before) {
                *failed = Some((i, error));
            }
        }
    })?;
    first.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), |(_, error)| Err(error))
}
