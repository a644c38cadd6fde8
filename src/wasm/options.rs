//! The options object of JavaScript, read name by name: whatever is misspelt or out of place is refused.

use crate::error::Error;
use crate::message::message;
use crate::options::{Cell, Method, Options, Orient};
use js_sys::{Array, JSON, Object, Reflect};
use wasm_bindgen::prelude::*;

/// Every option of `estimateNormals`. The last three are for the JavaScript side, which handles them.
const NAMES: &str = "method, cell, k, orient, curvature, components, transfer, onProgress, signal";
const METHODS: &str = "'bilinear', 'knn' or 'egg'";
const CELLS: &str = "'auto', { scale: number } or { size: number }";
const ORIENTS: &str = "'none', 'consistent', 'outward', { viewpoint: [x, y, z] } or { up: [x, y, z] }";

/// Reads the options, of which the core needs no more than the names (`estimator.ts`): what is left out or `undefined` keeps
/// its default. Ranges are the estimator's to check.
#[optimize(size)]
pub(super) fn parse(value: &JsValue) -> Result<Options, Error> {
    let mut options = Options::default();
    if value.is_undefined() {
        return Ok(options);
    }
    if cfg!(feature = "full") && !value.is_object() {
        return Err(refusal("options", value, "an object"));
    }
    for name in Object::keys(value.unchecked_ref::<Object>()).iter().filter_map(|name| name.as_string()) {
        let is_known = NAMES.as_bytes().split(|byte| !byte.is_ascii_alphabetic()).any(|known| known == name.as_bytes());
        if name.is_empty() || !is_known {
            return Err(Error::Input(message!["option '", name, "' is unknown; wanted any of ", NAMES]));
        }
    }
    if !cfg!(feature = "full") {
        return Ok(options);
    }
    if let Some(method) = given(value, "method") {
        options.method = self::method(&method).ok_or_else(|| refusal("method", &method, METHODS))?;
    }
    if let Some(cell) = given(value, "cell") {
        options.cell = self::cell(&cell).ok_or_else(|| refusal("cell", &cell, CELLS))?;
    }
    if let Some(k) = given(value, "k") {
        options.k = Some(self::k(&k).ok_or_else(|| refusal("k", &k, "a whole number from 3 to 4294967295"))?);
    }
    if let Some(orient) = given(value, "orient") {
        options.orient = self::orient(&orient).ok_or_else(|| refusal("orient", &orient, ORIENTS))?;
    }
    options.components = flag(value, "components")?;
    options.curvature = flag(value, "curvature")?;
    Ok(options)
}

fn flag(value: &JsValue, name: &str) -> Result<bool, Error> {
    given(value, name).map_or(Ok(false), |flag| flag.as_bool().ok_or_else(|| refusal(name, &flag, "true or false")))
}

fn method(value: &JsValue) -> Option<Method> {
    match value.as_string()?.as_str() {
        "bilinear" => Some(Method::Bilinear),
        "knn" => Some(Method::Knn),
        "egg" => Some(Method::Egg),
        _ => None,
    }
}

fn cell(value: &JsValue) -> Option<Cell> {
    if let Some(word) = value.as_string() {
        return (word == "auto").then_some(Cell::Auto);
    }
    let (name, number) = only_entry(value)?;
    match name.as_str() {
        "scale" => Some(Cell::Scale(number.as_f64()?)),
        "size" => Some(Cell::Size(number.as_f64()?)),
        _ => None,
    }
}

fn k(value: &JsValue) -> Option<u32> {
    value.as_f64().filter(|k| *k >= 1.0 && f64::from(*k as u32) == *k).map(|k| k as u32)
}

fn orient(value: &JsValue) -> Option<Orient> {
    if let Some(word) = value.as_string() {
        return match word.as_str() {
            "none" => Some(Orient::None),
            "consistent" => Some(Orient::Consistent),
            "outward" => Some(Orient::Outward),
            _ => None,
        };
    }
    let (name, vector) = only_entry(value)?;
    match name.as_str() {
        "viewpoint" => Some(Orient::Viewpoint(three(&vector)?)),
        "up" => Some(Orient::Up(three(&vector)?)),
        _ => None,
    }
}

/// Three finite numbers, in an array.
fn three(value: &JsValue) -> Option<[f64; 3]> {
    let number = |name| property(value, name).as_f64().filter(|number| number.is_finite());
    let numbers = [number("0")?, number("1")?, number("2")?];
    (number("length") == Some(3.0)).then_some(numbers)
}

#[cold]
#[optimize(size)]
fn refusal(name: &str, value: &JsValue, wanted: &str) -> Error {
    Error::Input(message![name, " is ", describe(value), "; wanted ", wanted])
}

/// A value as its author wrote it, as far as JSON can tell, and not more than a line of it.
fn describe(value: &JsValue) -> String {
    const LONGEST: usize = 60;
    let mut text = match value.as_string() {
        Some(text) => message!["'", text, "'"],
        None => match JSON::stringify(value) {
            // Not a number and the infinities are null in JSON.
            Ok(json) if json.is_string() && value.as_f64().is_none_or(f64::is_finite) => json.into(),
            _ => value.js_typeof().as_string().unwrap_or_default(),
        },
    };
    if let Some((end, _)) = text.char_indices().nth(LONGEST) {
        text.truncate(end);
        text.push_str("...");
    }
    text
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

/// A property that cannot be read, because its getter throws, or because it is none of an object, counts as missing.
fn property(object: &JsValue, name: &str) -> JsValue {
    Reflect::get(object, &name.into()).unwrap_or(JsValue::UNDEFINED)
}
