//! Reading PLY files over the border.

use super::{Buffer, call};
use crate::error::Error;
use crate::ply::{self, PointCloud, ReadOptions};
use js_sys::Function;
use wasm_bindgen::prelude::*;

/// A point cloud as it was read. Its arrays are given away one by one.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Cloud {
    count: usize,
    positions: Option<Vec<f32>>,
    /// The rest of the cloud; its positions are above.
    rest: PointCloud,
}

/// Reads a PLY file of at most `maxPoints` points. Consumes the buffer.
#[wasm_bindgen(js_name = readPly)]
pub fn read_ply(
    file: Buffer,
    #[wasm_bindgen(js_name = maxPoints)] max_points: Option<f64>,
    #[wasm_bindgen(unchecked_param_type = "(phase: string, fraction: number) => void")] tell: &Function,
) -> Result<Cloud, JsValue> {
    call(tell, |progress| {
        let max_points = max_points.map(whole).transpose()?;
        let mut cloud = ply::read(file.bytes(), &ReadOptions { max_points }, progress)?;
        let positions = std::mem::take(&mut cloud.positions);
        Ok(Cloud { count: positions.len() / 3, positions: Some(positions), rest: cloud })
    })
}

fn whole(max_points: f64) -> Result<u64, Error> {
    if max_points >= 0.0 && (max_points.fract() == 0.0 || max_points.is_infinite()) {
        return Ok(max_points as u64);
    }
    Err(Error::Input(format!("maxPoints is {}; wanted a whole number of at least 0", crate::number::text(max_points))))
}

#[wasm_bindgen]
impl Cloud {
    /// The number of points.
    #[wasm_bindgen(getter)]
    pub fn count(&self) -> usize {
        self.count
    }

    /// What to add to the positions to get the file's coordinates.
    #[wasm_bindgen(getter)]
    pub fn origin(&self) -> Box<[f64]> {
        self.rest.origin.into()
    }

    /// The file's format, as its header names it.
    #[wasm_bindgen(getter)]
    pub fn format(&self) -> String {
        self.rest.format.name().into()
    }

    /// The names of the properties of a point, in the file's order.
    #[wasm_bindgen(getter)]
    pub fn properties(&self) -> Vec<String> {
        self.rest.properties.clone()
    }

    /// The comments of the header.
    #[wasm_bindgen(getter)]
    pub fn comments(&self) -> Vec<String> {
        self.rest.comments.clone()
    }

    /// Gives the positions away, 32-bit numbers, three for each point; once.
    #[wasm_bindgen(js_name = takePositions)]
    pub fn take_positions(&mut self) -> Result<Buffer, JsValue> {
        self.positions
            .take()
            .map(Buffer::from)
            .ok_or_else(|| Error::Input("the positions were taken before".into()).into())
    }

    /// Gives the file's normals away, 32-bit numbers, three for each point; `undefined` if there are none.
    #[wasm_bindgen(js_name = takeNormals)]
    pub fn take_normals(&mut self) -> Option<Buffer> {
        self.rest.normals.take().map(Buffer::from)
    }

    /// Gives the colours away, red, green, blue and alpha bytes for each point; `undefined` if there are none.
    #[wasm_bindgen(js_name = takeColors)]
    pub fn take_colors(&mut self) -> Option<Buffer> {
        self.rest.colors.take().map(Buffer::from)
    }

    /// Gives the intensities away, a 32-bit number for each point; `undefined` if there are none.
    #[wasm_bindgen(js_name = takeIntensity)]
    pub fn take_intensity(&mut self) -> Option<Buffer> {
        self.rest.intensity.take().map(Buffer::from)
    }
}
