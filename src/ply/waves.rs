//! Parallel work in waves, with a look at the progress between them.

use crate::error::Error;
use crate::parallel;
use crate::progress::Progress;

/// Points of one task, where rows can be told apart without reading them.
pub(super) const TASK: usize = 1 << 16;
/// Tasks of one wave: two million points, or 8 MB of text.
const WAVE: usize = 32;

/// Does the tasks in parallel, some at a time, and hands their results to `each` in the order of the tasks. The error
/// is that of the first task that failed, in that order too.
pub(super) fn in_waves<T: Send, R: Send>(
    tasks: Vec<T>,
    work: impl Fn(T) -> Result<R, Error> + Send + Sync,
    mut each: impl FnMut(R) -> Result<(), Error>,
) -> Result<(), Error> {
    let mut tasks = tasks.into_iter();
    while tasks.len() > 0 {
        let wave: Vec<T> = tasks.by_ref().take(WAVE).collect();
        parallel::map(wave, &work).into_iter().try_for_each(|result| each(result?))?;
    }
    Ok(())
}

/// Turns rows done into progress.
pub(super) struct Meter<'a> {
    pub progress: &'a Progress<'a>,
    pub phase: &'static str,
    pub done: u64,
    pub total: u64,
}

impl Meter<'_> {
    pub fn add(&mut self, rows: usize) -> Result<(), Error> {
        self.done += rows as u64;
        self.progress.update(self.phase, (self.done as f64 / self.total.max(1) as f64).min(1.0))
    }
}
