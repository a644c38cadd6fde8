//! Normals over the border.

use super::{Buffer, call, memory, options, set};
use crate::estimate::{Estimate, Report};
use crate::points::Points;
use js_sys::{Array, Function, Object};
use wasm_bindgen::prelude::*;

/// Estimates the normals of `x0 y0 z0 x1 ...`, 32-bit numbers or, if `double`, 64-bit ones. Consumes the buffer.
///
/// Answers with an object of `normals`, a buffer of three 32-bit numbers for each point, of `curvature`, if asked for,
/// with one, of `components`, if asked for, with one whole number, and of the `report`.
#[optimize(size)]
#[wasm_bindgen(unchecked_return_type = "{ normals: Buffer, curvature?: Buffer, components?: Buffer, report: object }")]
pub fn estimate(
    positions: Buffer,
    double: bool,
    #[wasm_bindgen(unchecked_param_type = "object")] options: &JsValue,
    #[wasm_bindgen(unchecked_param_type = "(phase: string, fraction: number) => void")] tell: &Function,
) -> Result<Object, JsValue> {
    let options = options::parse(options)?;
    let Estimate { normals, curvature, components, report } = call(tell, move |progress| {
        let points = if double {
            let points = Points::from_f64(positions.numbers("positions", 3)?)?;
            // The points are a copy: what they were copied from is not needed any more.
            drop(positions);
            points
        } else {
            Points::from_vec(positions.into_floats("positions", 3)?)?
        };
        crate::estimate::estimate_owned(points, &options, progress)
    })?;
    let estimation = Object::new();
    set(&estimation, "normals", Buffer::from(normals));
    // Only the full module has these; the `cfg!` keeps their code out of the core, here and below.
    if cfg!(feature = "full")
        && let Some(curvature) = curvature
    {
        set(&estimation, "curvature", Buffer::from(curvature));
    }
    if cfg!(feature = "full")
        && let Some(components) = components
    {
        // Four bytes are four bytes.
        set(&estimation, "components", Buffer::from(bytemuck::cast_vec::<u32, f32>(components)));
    }
    set(&estimation, "report", describe(&report));
    Ok(estimation)
}

#[optimize(size)]
#[inline(never)]
fn describe(report: &Report) -> Object {
    let object = Object::new();
    set(&object, "points", report.points as f64);
    set(&object, "unresolved", report.unresolved as f64);
    set(&object, "cells", report.cells as f64);
    set(&object, "nodes", report.nodes as f64);
    set(&object, "grid", array(&report.grid));
    set(&object, "cellSize", report.cell_size);
    set(&object, "scale", report.scale);
    if let Some(noise) = report.noise {
        set(&object, "noise", noise);
        let scales = Array::new();
        for scale in &report.scales {
            let object = Object::new();
            set(&object, "cellSize", scale.cell_size);
            set(&object, "points", scale.points as f64);
            scales.push(&object);
        }
        set(&object, "scales", scales);
    }
    set(&object, "nodesUsed", array(&report.nodes_used));
    if cfg!(feature = "full")
        && let Some(components) = &report.components
    {
        let list = Array::new();
        for component in &components.largest {
            let object = Object::new();
            set(&object, "points", component.points as f64);
            set(&object, "side", component.side.name());
            set(&object, "confidence", component.confidence);
            list.push(&object);
        }
        let components_of = Object::new();
        set(&components_of, "count", components.count as f64);
        set(&components_of, "largest", list);
        set(&object, "components", components_of);
    }
    let milliseconds = Object::new();
    for &(phase, time) in &report.milliseconds {
        set(&milliseconds, phase, time);
    }
    set(&object, "milliseconds", milliseconds);
    set(&object, "peakBytes", memory::peak() as f64);
    object
}

fn array(counts: &[u64]) -> Array {
    counts.iter().map(|&count| JsValue::from(count as f64)).collect()
}
