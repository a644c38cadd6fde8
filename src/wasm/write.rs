//! Writing PLY files over the border.

use super::{Buffer, call};
use crate::error::Error;
use crate::message::message;
use crate::ply::{self, Additions, Format, PointCloud, Rewrite};
use js_sys::Function;
use std::sync::{Mutex, PoisonError};
use wasm_bindgen::prelude::*;

/// The file with normals and curvature put in, everything else kept, from pieces of a file of `size` bytes, in their order:
/// answers to each with what follows in the output. The first is half a KiB at least, if there is so much, and comes with
/// what is added; the others without. Consumes the buffers.
#[wasm_bindgen(js_name = writePly)]
pub fn write_ply(
    piece: Buffer,
    ascii: bool,
    size: f64,
    #[wasm_bindgen(unchecked_param_type = "(phase: string, fraction: number) => void")] tell: &Function,
    normals: Option<Buffer>,
    curvature: Option<Buffer>,
) -> Result<Buffer, JsValue> {
    let mut held = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    let begin = || Writing { file: Rewrite::new(size as u64, ascii), normals, curvature };
    let mut writing = held.take().unwrap_or_else(begin);
    let output = call(tell, |progress| {
        let add = additions(writing.normals.as_ref(), writing.curvature.as_ref())?;
        writing.file.take(piece.bytes(), &add, progress)
    })?;
    if !writing.file.is_complete() {
        *held = Some(writing);
    }
    Ok(output.into())
}

/// A file that is written in pieces, and what is added to it.
struct Writing {
    file: Rewrite,
    normals: Option<Buffer>,
    curvature: Option<Buffer>,
}

/// One after the other, as all calls of a worker.
static WRITING: Mutex<Option<Writing>> = Mutex::new(None);

/// A PLY file of a cloud alone. Consumes the buffers.
#[wasm_bindgen(js_name = writeCloud)]
// JavaScript hands over each array by itself; an object of buffers could not be consumed.
#[allow(clippy::too_many_arguments)]
pub fn write_cloud(
    positions: Buffer,
    origin: &[f64],
    normals: Option<Buffer>,
    colors: Option<Buffer>,
    intensity: Option<Buffer>,
    curvature: Option<Buffer>,
    comments: Vec<String>,
    ascii: bool,
    #[wasm_bindgen(unchecked_param_type = "(phase: string, fraction: number) => void")] tell: &Function,
) -> Result<Buffer, JsValue> {
    call(tell, |progress| {
        let &[x, y, z] = origin else {
            return Err(Error::Input(message!["origin has ", origin.len(), " numbers; wanted 3"]));
        };
        let add = additions(normals.as_ref(), curvature.as_ref())?;
        let cloud = PointCloud {
            positions: positions.into_floats("positions", 3)?,
            origin: [x, y, z],
            colors: colors.map(|colors| colors.into_bytes("colors")).transpose()?,
            intensity: intensity.map(|intensity| intensity.into_floats("intensity", 1)).transpose()?,
            comments,
            viewpoint: None,
            normals: None,
            format: Format::BinaryLittleEndian,
            properties: Vec::new(),
        };
        progress.update("write", 0.0)?;
        let file = ply::write_cloud(&cloud, &add, ascii)?;
        progress.update("write", 1.0)?;
        Ok(file.into())
    })
}

fn additions<'a>(normals: Option<&'a Buffer>, curvature: Option<&'a Buffer>) -> Result<Additions<'a>, Error> {
    Ok(Additions {
        normals: normals.map(|normals| normals.numbers("normals", 3)).transpose()?,
        curvature: curvature.map(|curvature| curvature.numbers("curvature", 1)).transpose()?,
    })
}
