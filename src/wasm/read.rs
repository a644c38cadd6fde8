//! Reading PLY files over the border.

use super::{Buffer, call, set};
use crate::error::Error;
use crate::message::message;
use crate::number;
use crate::ply::{self, PointCloud, ReadOptions};
use js_sys::{Array, Function, Object};
use wasm_bindgen::prelude::*;

/// Reads a PLY file of at most `maxPoints` points. Consumes the buffer.
///
/// Answers with a point cloud as the package hands it out, but with buffers in place of its arrays.
#[optimize(size)]
#[wasm_bindgen(js_name = readPly, unchecked_return_type = "object")]
pub fn read_ply(
    file: Buffer,
    #[wasm_bindgen(js_name = maxPoints)] max_points: Option<f64>,
    #[wasm_bindgen(unchecked_param_type = "(phase: string, fraction: number) => void")] tell: &Function,
) -> Result<Object, JsValue> {
    let max_points = max_points.map(whole).transpose()?;
    let cloud = call(tell, |progress| ply::read(file.bytes(), &ReadOptions { max_points }, progress))?;
    Ok(describe(cloud))
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
    if max_points >= 0.0 && (max_points.fract() == 0.0 || max_points.is_infinite()) {
        return Ok(max_points as u64);
    }
    Err(Error::Input(message!["maxPoints is ", number::text(max_points), "; wanted a whole number of at least 0"]))
}
