//! The options object of JavaScript, read name by name: whatever is misspelt or out of place is refused.

use crate::error::Error;
use crate::options::{Cell, Method, Options, Orient};
use js_sys::{Array, JSON, Object, Reflect};
use wasm_bindgen::prelude::*;

/// Every option of `estimateNormals`. The last three are for the JavaScript side, which handles them.
const NAMES: [&str; 8] = ["method", "cell", "k", "orient", "curvature", "transfer", "onProgress", "signal"];
const METHODS: &str = "'bilinear', 'knn' or 'egg'";
const CELLS: &str = "'auto', { scale: number } or { size: number }";
const ORIENTS: &str = "'none', 'consistent', 'outward', { viewpoint: [x, y, z] } or { up: [x, y, z] }";

/// Reads the options; what is left out or `undefined` keeps its default. Ranges are the estimator's to check.
pub(super) fn parse(value: &JsValue) -> Result<Options, Error> {
    let mut options = Options::default();
    if value.is_undefined() {
        return Ok(options);
    }
    if !value.is_object() {
        return refuse("options", value, "an object");
    }
    for name in Object::keys(value.unchecked_ref::<Object>()).iter().filter_map(|name| name.as_string()) {
        if !NAMES.contains(&name.as_str()) {
            return Err(Error::Input(format!("option '{name}' is unknown; wanted any of {}", NAMES.join(", "))));
        }
    }
    if let Some(method) = given(value, "method") {
        options.method = self::method(&method)?;
    }
    if let Some(cell) = given(value, "cell") {
        options.cell = self::cell(&cell)?;
    }
    if let Some(k) = given(value, "k") {
        options.k = Some(self::k(&k)?);
    }
    if let Some(orient) = given(value, "orient") {
        options.orient = self::orient(&orient)?;
    }
    if let Some(curvature) = given(value, "curvature") {
        options.curvature = curvature.as_bool().map_or_else(|| refuse("curvature", &curvature, "true or false"), Ok)?;
    }
    Ok(options)
}

fn method(value: &JsValue) -> Result<Method, Error> {
    match value.as_string().as_deref() {
        Some("bilinear") => Ok(Method::Bilinear),
        Some("knn") => Ok(Method::Knn),
        Some("egg") => Ok(Method::Egg),
        _ => refuse("method", value, METHODS),
    }
}

fn cell(value: &JsValue) -> Result<Cell, Error> {
    if value.as_string().as_deref() == Some("auto") {
        return Ok(Cell::Auto);
    }
    let number = |name, value: &JsValue| value.as_f64().map_or_else(|| refuse(name, value, "a number"), Ok);
    match only_entry(value) {
        Some((name, scale)) if name == "scale" => Ok(Cell::Scale(number("cell.scale", &scale)?)),
        Some((name, size)) if name == "size" => Ok(Cell::Size(number("cell.size", &size)?)),
        _ => refuse("cell", value, CELLS),
    }
}

fn k(value: &JsValue) -> Result<u32, Error> {
    match value.as_f64() {
        Some(k) if k.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&k) => Ok(k as u32),
        _ => refuse("k", value, "a whole number of at least 1"),
    }
}

fn orient(value: &JsValue) -> Result<Orient, Error> {
    match value.as_string().as_deref() {
        Some("none") => return Ok(Orient::None),
        Some("consistent") => return Ok(Orient::Consistent),
        Some("outward") => return Ok(Orient::Outward),
        _ => {}
    }
    match only_entry(value) {
        Some((name, position)) if name == "viewpoint" => Ok(Orient::Viewpoint(vector("orient.viewpoint", &position)?)),
        Some((name, direction)) if name == "up" => Ok(Orient::Up(vector("orient.up", &direction)?)),
        _ => refuse("orient", value, ORIENTS),
    }
}

/// Three finite numbers, in an array or a typed array.
fn vector(name: &str, value: &JsValue) -> Result<[f64; 3], Error> {
    let wanted = || refuse(name, value, "three finite numbers [x, y, z]");
    if !value.is_object() || property(value, "length").as_f64() != Some(3.0) {
        return wanted();
    }
    let mut vector = [0.0; 3];
    for (item, name) in vector.iter_mut().zip(["0", "1", "2"]) {
        match property(value, name).as_f64() {
            Some(number) if number.is_finite() => *item = number,
            _ => return wanted(),
        }
    }
    Ok(vector)
}

fn refuse<T>(name: &str, value: &JsValue, wanted: &str) -> Result<T, Error> {
    Err(Error::Input(format!("{name} is {}; wanted {wanted}", describe(value))))
}

/// A value as its author wrote it, as far as JSON can tell, and not more than a line of it.
fn describe(value: &JsValue) -> String {
    const LONGEST: usize = 60;
    let text = match (value.as_string(), value.as_f64()) {
        (Some(text), _) => format!("'{text}'"),
        (_, Some(number)) => crate::number::text(number),
        _ => match JSON::stringify(value) {
            Ok(text) if text.is_string() => text.into(),
            _ => value.js_typeof().as_string().unwrap_or_default(),
        },
    };
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

/// The name and value of an object's only property.
fn only_entry(value: &JsValue) -> Option<(String, JsValue)> {
    if !value.is_object() || Array::is_array(value) {
        return None;
    }
    let names = Object::keys(value.unchecked_ref::<Object>());
    let name = names.get(0).as_string()?;
    let entry = property(value, &name);
    (names.length() == 1).then_some((name, entry))
}

fn given(object: &JsValue, name: &str) -> Option<JsValue> {
    Some(property(object, name)).filter(|value| !value.is_undefined())
}

/// A property that cannot be read, because its getter throws, counts as missing.
fn property(object: &JsValue, name: &str) -> JsValue {
    Reflect::get(object, &name.into()).unwrap_or(JsValue::UNDEFINED)
}
