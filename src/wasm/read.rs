//! Reading PLY files over the border.

use super::{Buffer, call, set};
use crate::error::Error;
use crate::message::message;
use crate::number;
use crate::ply::{self, PointCloud, ReadOptions};
#[cfg(feature = "full")]
use crate::ply::{Next, Stream};
use js_sys::{Array, Function, Object};
#[cfg(feature = "full")]
use std::sync::{Mutex, PoisonError};
use wasm_bindgen::prelude::*;

/// Reads a PLY file of at most `maxPoints` points, which may be infinite. Consumes the buffer. `file` is all there is, or
/// where `size` is not 0 a piece of a file of so many bytes: the beginning, as much of it as the caller likes, and then what is
/// asked for.
///
/// Answers with a point cloud as the package hands it out, but with buffers in place of its arrays; after a piece also with
/// an object of the numbers `from`, `to` and `step` to ask for the bytes from one to another in pieces, or with nothing if the
/// next of these is to follow.
#[optimize(size)]
#[wasm_bindgen(js_name = readPly, unchecked_return_type = "object | undefined")]
pub fn read_ply(
    file: Buffer,
    #[wasm_bindgen(js_name = maxPoints)] max_points: f64,
    size: f64,
    #[wasm_bindgen(unchecked_param_type = "(phase: string, fraction: number) => void")] tell: &Function,
) -> Result<Option<Object>, JsValue> {
    let options = ReadOptions { max_points: Some(whole(max_points)?) };
    #[cfg(feature = "full")]
    if size > 0.0 {
        return read_piece(&file, options, size as u64, tell);
    }
    // The core reads all there is.
    let _ = size;
    let cloud = call(tell, |progress| ply::read(file.bytes(), &options, progress))?;
    Ok(Some(describe(cloud)))
}

/// The file that is read in pieces: one after the other, as all calls of a worker.
#[cfg(feature = "full")]
static STREAM: Mutex<Option<Stream>> = Mutex::new(None);

#[cfg(feature = "full")]
fn read_piece(piece: &Buffer, options: ReadOptions, size: u64, tell: &Function) -> Result<Option<Object>, JsValue> {
    let mut held = STREAM.lock().unwrap_or_else(PoisonError::into_inner);
    let mut stream = held.take().unwrap_or_else(|| Stream::new(size, options));
    let next = call(tell, |progress| stream.take(piece.bytes(), progress))?;
    if let Next::Cloud(cloud) = next {
        return Ok(Some(describe(cloud)));
    }
    *held = Some(stream);
    let Next::Pieces { from, to, step } = next else {
        return Ok(None);
    };
    let object = Object::new();
    for (name, value) in [("from", from), ("to", to), ("step", step)] {
        set(&object, name, value as f64);
    }
    Ok(Some(object))
}

fn describe(cloud: PointCloud) -> Object {
    let object = Object::new();
    set(&object, "count", cloud.len() as f64);
    set(&object, "origin", cloud.origin.into_iter().map(JsValue::from).collect::<Array>());
    let source = Object::new();
    set(&source, "format", cloud.format.name());
    set(&source, "properties", array(&cloud.properties));
    set(&source, "comments", array(&cloud.comments));
    if let Some(viewpoint) = cloud.viewpoint {
        set(&source, "viewpoint", viewpoint.into_iter().map(JsValue::from).collect::<Array>());
    }
    set(&object, "source", source);
    set(&object, "positions", Buffer::from(cloud.positions));
    for (name, values) in [("normals", cloud.normals), ("intensity", cloud.intensity)] {
        if let Some(values) = values {
            set(&object, name, Buffer::from(values));
        }
    }
    if let Some(colors) = cloud.colors {
        set(&object, "colors", Buffer::from(colors));
    }
    object
}

fn array(texts: &[String]) -> Array {
    texts.iter().map(JsValue::from).collect()
}

fn whole(max_points: f64) -> Result<u64, Error> {
    // Infinity stays the largest number there is.
    if max_points >= 0.0 && max_points.trunc() == max_points {
        return Ok(max_points as u64);
    }
    Err(Error::Input(message!["maxPoints is ", number::text(max_points), "; wanted a whole number of at least 0"]))
}
