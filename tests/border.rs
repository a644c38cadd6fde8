//! The border, called as JavaScript calls it, in headless Node.
#![cfg(target_arch = "wasm32")]

use bilinormal::Progress;
use bilinormal::ply::{Additions, Rewrite};
use bilinormal::wasm::{Buffer, estimate, read_ply, write_cloud, write_ply};
use js_sys::{Array, Function, JSON, Object, Reflect, Uint8Array, WebAssembly};
use wasm_bindgen::convert::TryFromJsValue;
use wasm_bindgen::prelude::*;
use wasm_bindgen_test::wasm_bindgen_test;

const POINTS: usize = 4000;

/// A view of a buffer's bytes, as JavaScript makes it.
fn view(buffer: &Buffer) -> Uint8Array {
    let memory: WebAssembly::Memory = wasm_bindgen::memory().unchecked_into();
    Uint8Array::new_with_byte_offset_and_length(&memory.buffer(), buffer.pointer() as u32, buffer.byte_length() as u32)
}

fn filled(bytes: &[u8]) -> Buffer {
    let buffer = Buffer::new(bytes.len() as f64).unwrap();
    view(&buffer).copy_from(bytes);
    buffer
}

fn floats(numbers: &[f32]) -> Buffer {
    filled(bytemuck::cast_slice(numbers))
}

fn doubles(numbers: &[f64]) -> Buffer {
    filled(bytemuck::cast_slice(numbers))
}

fn numbers(buffer: &Buffer) -> Vec<f32> {
    view(buffer).to_vec().chunks(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect()
}

/// The buffer that an object has under a name.
fn buffer(object: &JsValue, name: &str) -> Buffer {
    Buffer::try_from_js_value(get(object, name)).unwrap_or_else(|_| panic!("{name} is no buffer"))
}

/// The texts in an array of an object.
fn texts(object: &JsValue, name: &str) -> Vec<String> {
    Array::from(&get(object, name)).iter().map(|text| text.as_string().unwrap()).collect()
}

fn nobody() -> Function {
    Function::new_no_args("")
}

fn options(json: &str) -> JsValue {
    JSON::parse(json).unwrap()
}

fn get(object: &JsValue, name: &str) -> JsValue {
    Reflect::get(object, &name.into()).unwrap()
}

fn number(object: &JsValue, name: &str) -> f64 {
    get(object, name).as_f64().unwrap_or_else(|| panic!("{name} is no number"))
}

/// The code and the message of what was thrown.
fn thrown<T>(result: Result<T, JsValue>) -> (String, String) {
    let error = result.err().expect("nothing was thrown");
    (get(&error, "code").as_string().unwrap(), get(&error, "message").as_string().unwrap())
}

/// Points spread evenly over the unit sphere (golden spiral), so each is its own normal.
fn sphere() -> Vec<f64> {
    let turn = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / POINTS as f64;
        let (sin, cos) = (turn * i as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        [radius * cos, radius * sin, z]
    };
    (0..POINTS).flat_map(point).collect()
}

fn single(numbers: &[f64]) -> Vec<f32> {
    numbers.iter().map(|&number| number as f32).collect()
}

/// The largest angle to the sphere's own normals, in degrees, after a look at the lengths.
fn largest_angle(normals: &[f32], sphere: &[f64]) -> f64 {
    assert_eq!(normals.len(), sphere.len());
    let angle = |(normal, truth): (&[f32], &[f64])| {
        let normal: Vec<f64> = normal.iter().map(|&number| f64::from(number)).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        assert!((dot(&normal, &normal).sqrt() - 1.0).abs() < 1e-5, "{normal:?} is no unit vector");
        dot(&normal, truth).abs().min(1.0).acos().to_degrees()
    };
    normals.chunks(3).zip(sphere.chunks(3)).map(angle).fold(0.0, f64::max)
}

fn normals_of(estimation: Object) -> Vec<f32> {
    numbers(&buffer(&estimation, "normals"))
}

#[wasm_bindgen_test]
fn normals_of_a_sphere_are_unit_vectors_close_to_the_truth() {
    let sphere = sphere();
    let estimation = estimate(floats(&single(&sphere)), false, &options("{}"), &nobody()).unwrap();
    let angle = largest_angle(&normals_of(estimation), &sphere);
    assert!(angle < 4.0, "{angle} degrees off");
}

#[wasm_bindgen_test]
fn the_report_has_every_field_of_the_contract() {
    let points = single(&sphere());
    let options =
        options(r#"{ "method": "bilinear", "cell": { "scale": 1.5 }, "orient": "none", "curvature": false }"#);
    let report = get(&estimate(floats(&points), false, &options, &nobody()).unwrap(), "report");
    assert_eq!(number(&report, "points"), POINTS as f64);
    assert_eq!(number(&report, "unresolved"), 0.0);
    assert!(number(&report, "cells") >= number(&report, "nodes"));
    assert!(number(&report, "nodes") > 0.0);
    assert!(number(&report, "cellSize") > 0.0);
    assert_eq!(number(&report, "scale"), 1.5);
    let counts = |name| Array::from(&get(&report, name)).iter().map(|n| n.as_f64().unwrap()).collect::<Vec<_>>();
    assert_eq!(counts("grid").len(), 3);
    assert_eq!(counts("nodesUsed").len(), 5);
    assert_eq!(counts("nodesUsed").iter().sum::<f64>(), POINTS as f64);
    // Input and output together are 24 bytes a point.
    assert!(number(&report, "peakBytes") >= 24.0 * POINTS as f64);
    assert!(number(&report, "peakBytes") < 1000.0 * POINTS as f64);
    let milliseconds = get(&report, "milliseconds");
    let phases = Object::keys(milliseconds.unchecked_ref::<Object>());
    assert!(phases.length() >= 3);
    assert!(phases.iter().all(|phase| number(&milliseconds, &phase.as_string().unwrap()) >= 0.0));
}

#[wasm_bindgen_test]
fn signs_are_as_asked_for() {
    let sphere = sphere();
    let outwards = |text: &str| {
        let normals = normals_of(estimate(floats(&single(&sphere)), false, &options(text), &nobody()).unwrap());
        let dots = normals.iter().zip(&sphere).map(|(n, p)| f64::from(*n) * p).collect::<Vec<_>>();
        dots.chunks(3).filter(|dot| dot.iter().sum::<f64>() > 0.0).count()
    };
    assert_eq!(outwards(r#"{ "orient": "outward" }"#), POINTS);
    assert_eq!(outwards(r#"{ "orient": { "viewpoint": [0, 0, 0] } }"#), 0);
    let up = options(r#"{ "orient": { "up": [0, -1, 0] } }"#);
    let normals = normals_of(estimate(floats(&single(&sphere)), false, &up, &nobody()).unwrap());
    assert!(normals.chunks(3).all(|n| n[1] <= 0.0));
}

#[wasm_bindgen_test]
fn surfaces_are_told_of_and_numbered() {
    let points: Vec<f32> = single(&sphere()).into_iter().chain([f32::NAN; 3]).collect();
    let asked = options(r#"{ "orient": "consistent", "components": true }"#);
    let estimation = estimate(floats(&points), false, &asked, &nobody()).unwrap();
    let numbers: Vec<u32> = numbers(&buffer(&estimation, "components")).iter().map(|n| n.to_bits()).collect();
    assert_eq!(numbers, [vec![0; POINTS], vec![u32::MAX]].concat());
    let components = get(&get(&estimation, "report"), "components");
    assert_eq!(number(&components, "count"), 1.0);
    let largest = Array::from(&get(&components, "largest")).get(0);
    assert_eq!((number(&largest, "points"), get(&largest, "side")), (POINTS as f64, JsValue::from("air")));
    assert!(number(&largest, "confidence") > 0.8);
    for refused in [r#"{ "components": true }"#, r#"{ "components": true, "orient": { "up": [0, 0, 1] } }"#] {
        let (code, message) = thrown(estimate(floats(&points), false, &options(refused), &nobody()));
        assert!(code == "input" && message.contains("'consistent' or 'outward'"), "{code}: {message}");
    }
}

#[wasm_bindgen_test]
fn the_report_of_the_automatic_cell_tells_noise_and_scales() {
    let report = |points: &[f32]| get(&estimate(floats(points), false, &options("{}"), &nobody()).unwrap(), "report");
    let sphere = report(&single(&sphere()));
    assert!(number(&sphere, "noise") > 0.0 && number(&sphere, "noise") < 0.1 * number(&sphere, "cellSize"));
    let scales = Array::from(&get(&sphere, "scales"));
    assert_eq!(scales.iter().map(|scale| number(&scale, "points")).sum::<f64>(), POINTS as f64);
    assert!(scales.iter().all(|scale| number(&scale, "cellSize") > 0.0));
    // Also where there is no surface.
    let point = report(&[1.0, 2.0, 3.0]);
    assert_eq!((number(&point, "noise"), Array::from(&get(&point, "scales")).length()), (0.0, 0));
}

#[wasm_bindgen_test]
fn curvature_comes_only_where_it_is_asked_for() {
    let points = single(&sphere());
    for method in ["bilinear", "knn", "egg"] {
        let options = |asked| options(&format!(r#"{{ "method": "{method}", "curvature": {asked} }}"#));
        let without = estimate(floats(&points), false, &options(false), &nobody()).unwrap();
        assert!(get(&without, "curvature").is_undefined(), "{method}");
        let with = estimate(floats(&points), false, &options(true), &nobody()).unwrap();
        let curvature = numbers(&buffer(&with, "curvature"));
        assert_eq!(curvature.len(), POINTS);
        assert!(curvature.iter().all(|value| (1e-4..0.02).contains(value)), "{method}");
        assert_eq!(normals_of(with), normals_of(without), "{method}");
    }
}

#[wasm_bindgen_test]
fn doubles_near_the_origin_give_what_floats_give() {
    // Exact in both, and with the median at zero: nothing is rounded.
    let points: Vec<f64> = sphere().iter().map(|number| (number * 4096.0).round() / 4096.0).collect();
    let options = options(r#"{ "cell": { "scale": 1.5 } }"#);
    let of_floats = normals_of(estimate(floats(&single(&points)), false, &options, &nobody()).unwrap());
    let of_doubles = normals_of(estimate(doubles(&points), true, &options, &nobody()).unwrap());
    let difference = of_floats.iter().zip(&of_doubles).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(difference < 1e-3, "{difference} apart");
}

#[wasm_bindgen_test]
fn doubles_far_from_the_origin_keep_their_precision() {
    let sphere = sphere();
    let far: Vec<f64> = sphere.chunks(3).flat_map(|p| [p[0] + 4.5e6, p[1] - 5.4e6, p[2] + 1e5]).collect();
    let estimation = estimate(doubles(&far), true, &options("{}"), &nobody()).unwrap();
    let angle = largest_angle(&normals_of(estimation), &sphere);
    assert!(angle < 4.0, "{angle} degrees off");
}

#[wasm_bindgen_test]
fn no_points_give_no_normals() {
    let estimation = estimate(floats(&[]), false, &JsValue::UNDEFINED, &nobody()).unwrap();
    assert!(normals_of(estimation).is_empty());
    let estimation = estimate(doubles(&[]), true, &JsValue::UNDEFINED, &nobody()).unwrap();
    assert!(normals_of(estimation).is_empty());
}

#[wasm_bindgen_test]
fn progress_rises_from_0_to_1() {
    let told = Array::new();
    let listener = Closure::<dyn FnMut(JsValue, JsValue)>::new({
        let told = told.clone();
        move |phase: JsValue, fraction: JsValue| {
            assert!(phase.is_string());
            told.push(&fraction);
        }
    });
    estimate(floats(&single(&sphere())), false, &options("{}"), listener.as_ref().unchecked_ref()).unwrap();
    let told: Vec<f64> = told.iter().map(|fraction| fraction.as_f64().unwrap()).collect();
    assert!(told.is_sorted(), "{told:?}");
    assert_eq!(told.first(), Some(&0.0));
    assert_eq!(told.last(), Some(&1.0));
}

#[wasm_bindgen_test]
fn a_listener_that_throws_stops_nothing() {
    let thrower = Function::new_no_args("throw new Error('not mine')");
    assert!(estimate(floats(&single(&sphere())), false, &options("{}"), &thrower).is_ok());
}

#[wasm_bindgen_test]
fn wrong_options_are_refused_with_what_came_and_what_was_wanted() {
    let cases = [
        ("7", "options is 7; wanted an object"),
        (r#"{ "Method": "knn" }"#, "option 'Method' is unknown; wanted any of method, cell, k"),
        (r#"{ "method": "pca" }"#, "method is 'pca'; wanted 'bilinear', 'knn' or 'egg'"),
        (
            r#"{ "cell": { "radius": 1 } }"#,
            r#"cell is {"radius":1}; wanted 'auto', { scale: number } or { size: number }"#,
        ),
        (r#"{ "cell": { "scale": 1, "size": 2 } }"#, r#"cell is {"scale":1,"size":2}; wanted 'auto'"#),
        (r#"{ "cell": null }"#, "cell is null; wanted 'auto'"),
        (r#"{ "cell": { "scale": "1" } }"#, r#"cell is {"scale":"1"}; wanted 'auto'"#),
        (r#"{ "cell": { "scale": 0.01 } }"#, "cell.scale is 0.01; wanted a number from 0.1 to 100"),
        (r#"{ "cell": { "size": -1 } }"#, "cell.size is -1; wanted a finite number above 0"),
        (r#"{ "k": 1.5 }"#, "k is 1.5; wanted a whole number from 3 to 4294967295"),
        (r#"{ "orient": "in" }"#, "orient is 'in'; wanted 'none', 'consistent', 'outward'"),
        (r#"{ "orient": { "up": [0, 1] } }"#, r#"orient is {"up":[0,1]}; wanted 'none'"#),
        (r#"{ "orient": { "viewpoint": [0, 1, "2"] } }"#, r#"orient is {"viewpoint":[0,1,"2"]}; wanted"#),
        (r#"{ "curvature": 1 }"#, "curvature is 1; wanted true or false"),
        (r#"{ "components": true }"#, "components are those of orient 'consistent' or 'outward'; wanted one of them"),
    ];
    for (json, wanted) in cases {
        let (code, message) = thrown(estimate(floats(&[]), false, &options(json), &nobody()));
        assert_eq!(code, "input", "{json}");
        assert!(message.starts_with(wanted), "{json}: {message}");
    }
}

#[wasm_bindgen_test]
fn bytes_that_are_not_whole_points_are_refused() {
    let (code, message) = thrown(estimate(filled(&[0; 20]), false, &options("{}"), &nobody()));
    assert_eq!((code.as_str(), message.as_str()), ("input", "positions has 20 bytes; wanted a multiple of 12"));
    let (code, message) = thrown(estimate(filled(&[0; 12]), true, &options("{}"), &nobody()));
    assert_eq!((code.as_str(), message.as_str()), ("input", "positions has 12 bytes; wanted a multiple of 24"));
}

#[wasm_bindgen_test]
fn a_buffer_holds_what_is_written_and_begins_at_a_multiple_of_8() {
    for length in [0u32, 1, 7, 8, 1001] {
        let buffer = Buffer::new(f64::from(length)).unwrap();
        assert_eq!(buffer.byte_length(), length as usize);
        assert!(length == 0 || buffer.pointer().is_multiple_of(8));
        view(&buffer).fill(7, 0, length);
        assert!(view(&buffer).to_vec().iter().all(|&byte| byte == 7));
    }
}

#[wasm_bindgen_test]
fn a_buffer_that_does_not_fit_is_a_limit_error_and_no_trap() {
    for length in [5e9, 4294967296.0, 4294967295.0, 3e9] {
        let error = Buffer::new(length).unwrap_err();
        assert_eq!(get(&error, "code"), "limit");
        assert_eq!(number(&error, "needed"), length);
        assert!(number(&error, "available") < length);
        assert!(number(&error, "available") > 1e9);
    }
    Buffer::new(1e6).unwrap();
    for length in [-1.0, 0.5, f64::NAN, f64::INFINITY] {
        assert_eq!(thrown(Buffer::new(length)).0, "input");
    }
}

const TRIANGLE: &str = "ply\nformat ascii 1.0\ncomment three corners\nelement vertex 3\nproperty float x\n\
    property float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
    property float intensity\nend_header\n0 0 0 255 0 0 0.5\n1 0 0 0 255 0 0.25\n0 1 0 0 0 255 1\n";

fn origin_of(cloud: &JsValue) -> Vec<f64> {
    Array::from(&get(cloud, "origin")).iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Reads a file that is there as a whole.
fn read(file: Buffer) -> Result<Object, JsValue> {
    read_ply(file, f64::INFINITY, 0.0, &nobody()).map(Option::unwrap)
}

#[wasm_bindgen_test]
fn a_file_that_comes_in_pieces_says_what_it_wants() {
    let file = write(false, None).unwrap();
    let bytes = view(&file).to_vec();
    let whole = read(file).unwrap();
    let length = bytes.len() as f64;
    let piece = |piece: &[u8]| read_ply(filled(piece), 3.0, length, &nobody());
    let wanted = piece(&bytes[..bytes.len() - 1]).unwrap().unwrap();
    let [from, to, step] = ["from", "to", "step"].map(|name| number(&wanted, name) as usize);
    assert_eq!(to, bytes.len());
    assert!(step >= to - from);
    let stride = (to - from) / 3;
    assert!(piece(&bytes[from..from + stride]).unwrap().is_none());
    let cloud = piece(&bytes[from + stride..]).unwrap().unwrap();
    for name in ["positions", "intensity"] {
        assert_eq!(numbers(&buffer(&cloud, name)), numbers(&buffer(&whole, name)));
    }
    // After an error, as after the last piece, the next is the beginning of another file.
    assert_eq!(thrown(piece(b"solid stl")).0, "format");
    assert_eq!(thrown(read_ply(filled(&bytes[..bytes.len() - 1]), 2.0, length, &nobody())).0, "input");
    assert!(piece(&bytes).unwrap().is_some());
}

#[wasm_bindgen_test]
fn a_ply_file_is_read_into_its_arrays() {
    let cloud = read(filled(TRIANGLE.as_bytes())).unwrap();
    assert_eq!(number(&cloud, "count"), 3.0);
    assert_eq!(origin_of(&cloud), [0.0; 3]);
    let source = get(&cloud, "source");
    assert_eq!(get(&source, "format"), "ascii");
    assert_eq!(texts(&source, "properties"), ["x", "y", "z", "red", "green", "blue", "intensity"]);
    assert_eq!(texts(&source, "comments"), ["three corners"]);
    assert_eq!(numbers(&buffer(&cloud, "positions")), [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    assert!(get(&cloud, "normals").is_undefined());
    assert_eq!(view(&buffer(&cloud, "colors")).to_vec(), [255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255]);
    assert_eq!(numbers(&buffer(&cloud, "intensity")), [0.5, 0.25, 1.0]);
}

#[wasm_bindgen_test]
fn normals_put_into_a_file_are_read_from_it() {
    let normals = [0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0];
    for ascii in [true, false] {
        let file = write(ascii, Some(floats(&normals))).unwrap();
        let whole = view(&file).to_vec();
        let cloud = read(file).unwrap();
        assert_eq!(numbers(&buffer(&cloud, "normals")), normals);
        assert_eq!(numbers(&buffer(&cloud, "intensity")), [0.5, 0.25, 1.0]);
        // In pieces, which need the normals once.
        let mut rest = Some(floats(&normals));
        let mut written = Vec::new();
        for piece in whole.chunks(whole.len() - 5) {
            let output = write_ply(filled(piece), ascii, whole.len() as f64, &nobody(), rest.take(), None).unwrap();
            written.extend(view(&output).to_vec());
        }
        assert_eq!(written, whole);
    }
    // After an error, as after the last piece, the next is the beginning of another file.
    let length = 2.0 * TRIANGLE.len() as f64;
    assert!(write_ply(filled(TRIANGLE.as_bytes()), false, length, &nobody(), Some(floats(&[0.0; 3])), None).is_ok());
    let rest = filled(&vec![b'\n'; TRIANGLE.len()]);
    assert_eq!(thrown(write_ply(rest, false, length, &nobody(), None, None)).0, "input");
    assert!(write(true, Some(floats(&normals))).is_ok());
}

/// Writes the triangle, which is there as a whole.
fn write(ascii: bool, normals: Option<Buffer>) -> Result<Buffer, JsValue> {
    let file = filled(TRIANGLE.as_bytes());
    write_ply(file, ascii, TRIANGLE.len() as f64, &nobody(), normals, None)
}

#[wasm_bindgen_test]
fn a_file_of_more_bytes_than_there_are_addresses_is_written() {
    let small = write(false, None).unwrap();
    let small = view(&small).to_vec();
    for more in [1, 400, 8 << 20] {
        let mut file = Rewrite::new((1 << 32) + more, false);
        // Whatever follows the last row is dropped.
        assert_eq!(file.take(&small, &Additions::default(), &Progress::silent()).unwrap(), small);
        let rest = vec![0; 8 << 20];
        for _ in 0..((1 << 32) + more - small.len() as u64).div_ceil(8 << 20) {
            assert!(!file.is_complete());
            assert!(file.take(&rest, &Additions::default(), &Progress::silent()).unwrap().is_empty());
        }
        assert!(file.is_complete());
    }
}

#[wasm_bindgen_test]
fn a_cloud_alone_becomes_a_file() {
    let positions = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5];
    let normals = [0.0, 0.0, 1.0, 0.0, 1.0, 0.0];
    let origin = [4.5e6, -5.4e6, 0.0];
    let file = write_cloud(
        floats(&positions),
        &origin,
        Some(floats(&normals)),
        Some(filled(&[1, 2, 3, 255, 4, 5, 6, 255])),
        Some(floats(&[0.25, 0.5])),
        None,
        vec!["from memory".into()],
        false,
        &nobody(),
    );
    let cloud = read(file.unwrap()).unwrap();
    assert_eq!(texts(&get(&cloud, "source"), "comments"), ["from memory"]);
    let (read_origin, read) = (origin_of(&cloud), numbers(&buffer(&cloud, "positions")));
    for (i, (read, written)) in read.iter().zip(positions).enumerate() {
        assert_eq!(f64::from(*read) + read_origin[i % 3], f64::from(written) + origin[i % 3]);
    }
    assert_eq!(numbers(&buffer(&cloud, "normals")), normals);
    assert_eq!(view(&buffer(&cloud, "colors")).to_vec(), [1, 2, 3, 255, 4, 5, 6, 255]);
    assert_eq!(numbers(&buffer(&cloud, "intensity")), [0.25, 0.5]);
}

#[wasm_bindgen_test]
fn a_broken_file_says_where() {
    let error = read(filled(&TRIANGLE.as_bytes()[..TRIANGLE.len() - 8])).unwrap_err();
    assert_eq!(get(&error, "code"), "format");
    assert!(get(&error, "line").as_f64().is_some() || get(&error, "byte").as_f64().is_some());
    assert_eq!(thrown(read(filled(b"solid stl"))).0, "format");
}

#[wasm_bindgen_test]
fn arrays_that_do_not_fit_the_file_are_refused() {
    assert_eq!(thrown(write(true, Some(floats(&[0.0, 0.0, 1.0])))).0, "input");
    assert_eq!(thrown(write(true, Some(filled(&[0; 35])))).0, "input");
}
