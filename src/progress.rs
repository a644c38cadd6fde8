//! How a long call tells where it is, and how its caller stops it.

use crate::error::Error;
use std::ops::ControlFlow;

type Observer<'a> = dyn Fn(&'static str, f64) -> ControlFlow<()> + 'a;

/// The caller's side of a long call: it hears of progress, may stop the call, and lends it a clock.
///
/// Both functions are called from the calling thread only, the observer a few times per phase and
/// about every million points.
pub struct Progress<'a> {
    observer: &'a Observer<'a>,
    clock: &'a dyn Fn() -> f64,
}

impl<'a> Progress<'a> {
    /// `observer(phase, fraction)` hears a fraction that rises from 0 to 1 over the whole call, and answers
    /// `Break` to stop it with [`Error::Cancelled`]; `clock()` is in milliseconds from any beginning.
    pub fn new(observer: &'a Observer<'a>, clock: &'a dyn Fn() -> f64) -> Self {
        Self { observer, clock }
    }

    /// A `Progress` that nobody listens to. All times in the report are 0.
    pub fn silent() -> Progress<'static> {
        Progress { observer: &|_, _| ControlFlow::Continue(()), clock: &|| 0.0 }
    }

    /// Tells the observer that `phase` stands at `fraction` of the whole call.
    pub(crate) fn update(&self, phase: &'static str, fraction: f64) -> Result<(), Error> {
        match (self.observer)(phase, fraction) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Cancelled),
        }
    }

    pub(crate) fn milliseconds(&self) -> f64 {
        (self.clock)()
    }
}
