//! Writing PLY files over the border.

use super::{Buffer, call};
use crate::error::Error;
use crate::message::message;
use crate::ply::{self, Additions, Format, PointCloud};
use js_sys::Function;
use wasm_bindgen::prelude::*;

/// The file with normals and curvature put in, everything else kept. Consumes the buffers.
#[wasm_bindgen(js_name = writePly)]
pub fn write_ply(
    file: Buffer,
    normals: Option<Buffer>,
    curvature: Option<Buffer>,
    ascii: bool,
    #[wasm_bindgen(unchecked_param_type = "(phase: string, fraction: number) => void")] tell: &Function,
) -> Result<Buffer, JsValue> {
    call(tell, |progress| {
        let add = additions(normals.as_ref(), curvature.as_ref())?;
        Ok(ply::write(file.bytes(), &add, ascii, progress)?.into())
    })
}

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
