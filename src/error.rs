//! What can go wrong, classed by who can act on it.

use crate::message::message;
use std::fmt;

/// Every error of this crate.
#[derive(Clone, Debug, PartialEq)]
pub enum Error {
    /// The file is not what it says it is; whoever made the file can act.
    Format {
        /// What came and what was wanted.
        message: String,
        /// Where in the file, when known.
        place: Option<Place>,
    },
    /// An argument is out of its range; the caller can act. The text says what came and what was wanted.
    Input(String),
    /// The work does not fit into memory.
    Limit {
        /// What did not fit, and what to do about it.
        message: String,
        /// Bytes that were asked for.
        needed: u64,
        /// Bytes that were to be had, when known.
        available: Option<u64>,
    },
    /// A choice that this version does not offer. The text names what it offers instead.
    Unsupported(String),
    /// The caller's [`Progress`](crate::Progress) asked to stop.
    Cancelled,
}

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of text, counted from 1.
    Line(u64),
    /// A byte offset, counted from 0.
    Byte(u64),
}

impl Error {
    /// A [`Error::Format`] that belongs to one place of the file, or to the file as a whole.
    #[cold]
    #[inline(never)]
    pub(crate) fn format(place: Option<Place>, message: String) -> Self {
        Self::Format { message, place }
    }

    /// A [`Error::Limit`] for an allocation that the system refused.
    #[cold]
    #[inline(never)]
    pub(crate) fn memory(what: &str, needed: u64) -> Self {
        Self::Limit {
            message: message!["no memory for ", what, "; use fewer points, or allow more memory"],
            needed,
            available: None,
        }
    }

    /// All there is to say.
    #[optimize(size)]
    pub(crate) fn text(&self) -> String {
        match self {
            Self::Format { message, place: Some(Place::Line(line)) } => message!["line ", line, ": ", message],
            Self::Format { message, place: Some(Place::Byte(byte)) } => message!["byte ", byte, ": ", message],
            Self::Limit { message, needed, available: None } => message![message, " (", needed, " bytes needed)"],
            Self::Limit { message, needed, available: Some(available) } => {
                message![message, " (", needed, " bytes needed, ", available, " available)"]
            }
            Self::Format { message, place: None } | Self::Input(message) | Self::Unsupported(message) => {
                message.clone()
            }
            Self::Cancelled => "cancelled".into(),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text())
    }
}

impl std::error::Error for Error {}
