//! How a long call tells where it is, and how its caller stops it.

use crate::error::Error;
use crate::parallel::{self, Gathering};
use std::ops::{ControlFlow, Range};

type Observer<'a> = dyn Fn(&'static str, f64) -> ControlFlow<()> + 'a;

/// The caller's side of a long call: it hears of progress, may stop the call, and lends it a clock.
///
/// Both functions are called from the calling thread only, the observer at the beginning and end of each phase and some
/// twenty times a second.
pub struct Progress<'a> {
    observer: &'a Observer<'a>,
    clock: &'a dyn Fn() -> f64,
    /// The share of the whole call that is told of, and where it begins.
    share: f64,
    begin: f64,
}

impl<'a> Progress<'a> {
    /// `observer(phase, fraction)` hears a fraction that rises from 0 to 1 over the whole call, and answers
    /// `Break` to stop it with [`Error::Cancelled`]; `clock()` is in milliseconds from any beginning.
    pub fn new(observer: &'a Observer<'a>, clock: &'a dyn Fn() -> f64) -> Self {
        Self { observer, clock, share: 1.0, begin: 0.0 }
    }

    /// A `Progress` that nobody listens to. All times in the report are 0.
    pub fn silent() -> Progress<'static> {
        Progress { observer: &|_, _| ControlFlow::Continue(()), clock: &|| 0.0, share: 1.0, begin: 0.0 }
    }

    /// The same for a call of which all that comes is the part from `share.start` to `share.end`.
    pub(crate) fn part(&self, share: Range<f64>) -> Self {
        let begin = self.begin + self.share * share.start;
        Self { share: self.share * (share.end - share.start), begin, ..*self }
    }

    /// The part of the call that goes from `share.start` to `share.end` of the whole.
    pub(crate) fn stage(&self, phase: &'static str, share: Range<f64>) -> Stage<'_> {
        Stage { progress: self, phase, share }
    }

    /// Tells the observer that `phase` stands at `fraction` of the whole call.
    pub(crate) fn update(&self, phase: &'static str, fraction: f64) -> Result<(), Error> {
        match (self.observer)(phase, self.begin + self.share * fraction) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Cancelled),
        }
    }

    pub(crate) fn milliseconds(&self) -> f64 {
        (self.clock)()
    }
}

/// Milliseconds of a batch of tasks that may be twice as long: then the observer hears some twenty times a second.
const BRIEF: f64 = 20.0;

/// A part of a call, which tells of itself as a part of the whole.
pub(crate) struct Stage<'a> {
    progress: &'a Progress<'a>,
    phase: &'static str,
    share: Range<f64>,
}

impl Stage<'_> {
    /// Runs `work` for each number below `count`, in parallel. Between batches it tells the observer and lets it stop
    /// the call. Threads wait for each other at the end of a batch, and then sleep and have to be woken, so batches grow
    /// as long as they are brief.
    pub fn run(&self, count: usize, work: &(dyn Fn(usize) + Sync)) -> Result<(), Error> {
        self.run_in(64, count, work)
    }

    /// The same for long tasks: `each` of them a thread between two looks at the observer.
    #[optimize(size)]
    pub fn run_in(&self, each: usize, count: usize, work: &(dyn Fn(usize) + Sync)) -> Result<(), Error> {
        let mut batch = each * parallel::threads();
        let mut done = 0;
        while done < count {
            self.tell(done as f64 / count as f64)?;
            let (length, begun) = (batch.min(count - done), self.progress.milliseconds());
            parallel::each(length, &|i| work(done + i));
            done += length;
            if self.progress.milliseconds() - begun < BRIEF {
                batch *= 2;
            }
        }
        self.tell(1.0)
    }

    /// The same, with what `work` finds for each number, in their order, or its first error.
    pub fn collect<T: Send>(
        &self,
        count: usize,
        what: &'static str,
        work: &(dyn Fn(usize) -> Result<T, Error> + Sync),
    ) -> Result<Vec<T>, Error> {
        let found = Gathering::new(what);
        self.run(count, &|i| found.append(vec![(i, work(i))]))?;
        let mut found = found.all()?;
        found.sort_unstable_by_key(|&(i, _)| i);
        found.into_iter().map(|(_, found)| found).collect()
    }

    /// Tells the observer that `fraction` of this part is done, and lets it stop the call.
    pub fn tell(&self, fraction: f64) -> Result<(), Error> {
        self.progress.update(self.phase, self.share.start + (self.share.end - self.share.start) * fraction)
    }

    /// The part of this part that goes from `share.start` to `share.end` of it.
    pub fn part(&self, share: Range<f64>) -> Stage<'_> {
        let at = |x: f64| self.share.start + (self.share.end - self.share.start) * x;
        Stage { progress: self.progress, phase: self.phase, share: at(share.start)..at(share.end) }
    }
}
