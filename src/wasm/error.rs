//! Errors as JavaScript sees them.

use super::{memory, set};
use crate::error::{Error, Place};
use js_sys::Object;
use wasm_bindgen::prelude::*;

/// An object of `message` and `code`, and of what else is known: `line` or `byte`, `needed` and `available`. Not an `Error`:
/// those of WebKit have a `line` of their own.
impl From<Error> for JsValue {
    #[optimize(size)]
    fn from(error: Error) -> Self {
        let error = match error {
            Error::Limit { message, needed, available: None } => {
                Error::Limit { message, needed, available: Some(memory::available(needed)) }
            }
            error => error,
        };
        let thrown = Object::new();
        set(&thrown, "message", error.text().as_str());
        let code = match error {
            Error::Format { place, .. } => {
                match place {
                    Some(Place::Line(line)) => set(&thrown, "line", line as f64),
                    Some(Place::Byte(byte)) => set(&thrown, "byte", byte as f64),
                    None => {}
                }
                "format"
            }
            Error::Limit { needed, available, .. } => {
                set(&thrown, "needed", needed as f64);
                if let Some(available) = available {
                    set(&thrown, "available", available as f64);
                }
                "limit"
            }
            Error::Input(_) => "input",
            // Nothing is cancelled here: the border's progress always goes on.
            Error::Unsupported(_) | Error::Cancelled => "unsupported",
        };
        set(&thrown, "code", code);
        thrown.into()
    }
}
