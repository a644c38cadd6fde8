//! PLY files made here, one test for each thing a file may do.

mod reference;

use bilinormal::ply::{self, Additions, Format, Next, PointCloud, ReadOptions, Rewrite, Stream};
use bilinormal::{Error, Place, Progress};
use reference::Ply;
use std::cell::RefCell;
use std::ops::ControlFlow;

/// Reads a file as a whole, and makes sure that in pieces it is the same.
fn read(file: impl AsRef<[u8]>) -> Result<PointCloud, Error> {
    let file = file.as_ref();
    let whole = ply::read(file, &ReadOptions::default(), &Progress::silent());
    let header = file.windows(10).position(|bytes| bytes == b"end_header").filter(|_| file.starts_with(b"ply\n"));
    // All of the header and a little more, if it has an end; enough to tell what the file is; much.
    for beginning in [header.map_or(512, |at| at + 13), 512, 512.max(file.len() / 2)].map(|bytes| bytes.min(file.len()))
    {
        let pieces = in_pieces(file.len() as u64, beginning, 1, |from, to| file[from as usize..to as usize].to_vec());
        // As text, in which a number that is none equals itself.
        assert_eq!(format!("{pieces:?}"), format!("{whole:?}"), "from {beginning} bytes");
    }
    whole
}

/// Reads what `bytes(from, to)` gives, some bytes first and then in pieces, `parts` times as many as are asked for.
fn in_pieces(
    length: u64,
    beginning: usize,
    parts: u64,
    bytes: impl Fn(u64, u64) -> Vec<u8>,
) -> Result<PointCloud, Error> {
    let mut stream = Stream::new(length, ReadOptions::default());
    let mut next = stream.take(&bytes(0, beginning as u64), &Progress::silent())?;
    while let Next::Pieces { from, to, step } = next {
        next = Next::Piece;
        for at in (from..to).step_by((step / parts) as usize) {
            assert_eq!(next, Next::Piece);
            next = stream.take(&bytes(at, to.min(at + step / parts)), &Progress::silent())?;
        }
    }
    let Next::Cloud(cloud) = next else { panic!("{next:?}") };
    Ok(cloud)
}

fn write(file: impl AsRef<[u8]>, normals: &[f32], ascii: bool) -> Result<Vec<u8>, Error> {
    write_both(file, &Additions { normals: Some(normals), curvature: None }, ascii)
}

/// Writes a file as a whole, and makes sure that in pieces it is the same.
fn write_both(file: impl AsRef<[u8]>, add: &Additions, ascii: bool) -> Result<Vec<u8>, Error> {
    let file = file.as_ref();
    let whole = ply::write(file, add, ascii, &Progress::silent());
    // In the middle of rows, and of elements.
    for piece in [512, 512.max(file.len() / 2 + 1), 70_001] {
        let mut rewrite = Rewrite::new(file.len() as u64, ascii);
        let pieces = file.chunks(piece).chain(file.is_empty().then_some(file));
        let pieces = pieces.map(|piece| rewrite.take(piece, add, &Progress::silent()));
        assert_eq!(pieces.collect::<Result<Vec<_>, _>>().map(|pieces| pieces.concat()), whole, "{piece} bytes each");
    }
    whole
}

/// The place and text of the error that reading must end in.
fn refusal(file: impl AsRef<[u8]>) -> (Option<Place>, String) {
    match read(file) {
        Err(Error::Format { message, place }) => (place, message),
        other => panic!("wanted a format error, got {other:?}"),
    }
}

#[track_caller]
fn assert_refused(file: impl AsRef<[u8]>, place: impl Into<Option<Place>>, part: &str) {
    let (found, message) = refusal(file);
    assert!(message.contains(part), "{message}");
    assert_eq!(found, place.into(), "{message}");
}

/// A file of vertices, with lines for the properties and a body.
fn file(format: &str, count: usize, properties: &[&str], body: &[u8]) -> Vec<u8> {
    let mut text = format!("ply\nformat {format} 1.0\nelement vertex {count}\n");
    for property in properties {
        text += &format!("property {property}\n");
    }
    [text.as_bytes(), b"end_header\n", body].concat()
}

const XYZ: [&str; 3] = ["float x", "float y", "float z"];
const TEXT: &str = "ascii";
const LITTLE: &str = "binary_little_endian";
const BIG: &str = "binary_big_endian";

/// A value of a body that is written in each of the three formats.
#[derive(Clone, Copy)]
enum V {
    I8(i8),
    U8(u8),
    I16(i16),
    U16(u16),
    I32(i32),
    U32(u32),
    I64(i64),
    U64(u64),
    F32(f32),
    F64(f64),
}

/// Rows of values as the body of a file.
fn body(format: &str, rows: &[Vec<V>]) -> Vec<u8> {
    let mut out = Vec::new();
    for row in rows {
        for value in row {
            macro_rules! put {
                ($($kind:ident)*) => {
                    match value {
                        $(V::$kind(v) => match format {
                            TEXT => out.extend(format!("{v:?} ").bytes()),
                            LITTLE => out.extend(v.to_le_bytes()),
                            _ => out.extend(v.to_be_bytes()),
                        },)*
                    }
                };
            }
            put!(I8 U8 I16 U16 I32 U32 I64 U64 F32 F64);
        }
        if format == TEXT {
            out.push(b'\n');
        }
    }
    out
}

/// The same rows in all three formats.
fn in_all_formats(properties: &[&str], rows: &[Vec<V>]) -> [Vec<u8>; 3] {
    [TEXT, LITTLE, BIG].map(|format| file(format, rows.len(), properties, &body(format, rows)))
}

/// A small cloud with colours, normals, intensity, a list, and elements before and after.
fn rich(format: &str) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\ncomment made for a test\nobj_info num_cols 5\n\
         element camera 2\nproperty list uchar double pose\nproperty int id\nelement nothing 4000000000\n\
         element vertex 3\nproperty uchar red\nproperty double x\nproperty float nx\nproperty list uchar short marks\n\
         property float z\ncomment between\nproperty double y\nproperty uchar green\nproperty uchar blue\n\
         property double ny\nproperty float nz\nproperty ushort intensity\nproperty int64 time\n\
         element face 2\nproperty list uchar int vertex_indices\nproperty ushort flags\nend_header\n"
    );
    use V::*;
    let vertex = |i: u8, marks: &[i16]| {
        let f = f64::from(i);
        let mut row = vec![U8(10 * i), F64(f + 0.1), F32(0.5), U8(marks.len() as u8)];
        row.extend(marks.iter().map(|mark| I16(*mark)));
        row.extend([F32(i.into()), F64(-f), U8(20 * i), U8(30 * i), F64(0.25), F32(-0.125)]);
        row.extend([U16(1000 * u16::from(i)), I64(i64::MAX - i64::from(i))]);
        row
    };
    let rows = [
        vec![U8(2), F64(1e300), F64(-0.0), I32(-7)],
        vec![U8(0), I32(i32::MIN)],
        vertex(1, &[]),
        vertex(2, &[-1, 2, -3]),
        vertex(3, &[i16::MIN]),
        vec![U8(3), I32(0), I32(1), I32(2), U16(65535)],
        vec![U8(0), U16(0)],
    ];
    [header.into_bytes(), body(format, &rows)].concat()
}

const RICH_NORMALS: [f32; 9] = [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.6, 0.0, 0.8];

// Reading

/// After an element with lists, so that it is not at a place that is known beforehand.
#[test]
fn a_camera_is_where_the_scanner_stood() {
    use V::*;
    let with = |format: &str, properties: &[&str], rows: &[Vec<V>]| {
        let mut header = format!(
            "ply\nformat {format} 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        );
        header += "element face 1\nproperty list uchar int vertex_indices\n";
        header += &format!("element camera {}\n", rows.len());
        for property in properties {
            header += &format!("property {property}\n");
        }
        let before = [vec![F32(7.0), F32(8.0), F32(9.0)], vec![U8(2), I32(0), I32(0)]];
        read([header.as_bytes(), b"end_header\n", &body(format, &[&before[..], rows].concat())].concat()).unwrap()
    };
    const CAMERA: [&str; 5] = ["list uchar int marks", "double view_py", "float view_px", "int k", "float view_pz"];
    let row = |x: f32| vec![U8(1), I32(5), F64(-2.5), F32(x), I32(4), F32(1e3)];
    for format in [TEXT, LITTLE, BIG] {
        assert_eq!(with(format, &CAMERA, &[row(1.5)]).viewpoint, Some([1.5, -2.5, 1000.0]));
        assert_eq!(with(format, &CAMERA, &[row(1.5), row(3.5)]).viewpoint, Some([1.5, -2.5, 1000.0]));
        assert_eq!(with(format, &CAMERA, &[row(f32::NAN)]).viewpoint, None);
        assert_eq!(with(format, &CAMERA, &[]).viewpoint, None);
        assert_eq!(with(format, &["float view_px", "int view_py"], &[vec![F32(1.0), I32(2)]]).viewpoint, None);
    }
    assert_eq!(read(rich(TEXT)).unwrap().viewpoint, None);
}

#[test]
fn all_formats_give_the_same_cloud() {
    for format in [TEXT, LITTLE, BIG] {
        let cloud = read(rich(format)).unwrap();
        assert_eq!(cloud.format.name(), format);
        assert_eq!(cloud.positions, [1.1, -1.0, 1.0, 2.1, -2.0, 2.0, 3.1, -3.0, 3.0]);
        assert_eq!(cloud.origin, [0.0; 3]);
        assert_eq!(cloud.normals.unwrap(), [0.5, 0.25, -0.125].repeat(3));
        assert_eq!(cloud.colors.unwrap(), [10, 20, 30, 255, 20, 40, 60, 255, 30, 60, 90, 255]);
        assert_eq!(cloud.intensity.unwrap(), [1000.0, 2000.0, 3000.0]);
        assert_eq!(cloud.comments, ["made for a test", "num_cols 5", "between"]);
        let names = "red x nx marks z y green blue ny nz intensity time";
        assert_eq!(cloud.properties, names.split(' ').collect::<Vec<_>>());
    }
}

/// Properties are copied together where they stand side by side as the cloud has them.
#[test]
fn properties_may_stand_in_any_order() {
    use V::{F32, U8};
    let properties = |order: &[usize]| -> Vec<&str> {
        let all = [
            "float x",
            "float y",
            "float z",
            "float nx",
            "float ny",
            "float nz",
            "uchar red",
            "uchar green",
            "uchar blue",
            "uchar alpha",
            "float intensity",
            "uchar flags",
        ];
        order.iter().map(|i| all[*i]).collect()
    };
    // Opaque where there is no alpha.
    let value = |order: &[usize], point: usize, property: usize| {
        if order.contains(&property) { (1 + 16 * point + property) as u8 } else { 255 }
    };
    let orders: [&[usize]; 7] = [
        &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11],
        &[2, 1, 0, 5, 4, 3, 9, 8, 7, 6, 10],
        &[0, 1, 11, 2, 3, 4, 10, 5, 7, 8, 6, 9],
        &[1, 2, 0, 4, 5, 3, 6, 7, 9, 8, 10],
        &[3, 4, 5, 0, 1, 2, 8, 9, 6, 7, 10],
        &[6, 7, 8, 9, 11, 10, 3, 4, 5, 0, 1, 2],
        &[0, 1, 2, 6, 7, 8, 3, 4, 5, 10],
    ];
    for order in orders {
        let rows: Vec<Vec<V>> = (0..3)
            .map(|point| {
                let of = |&i: &usize| match value(order, point, i) {
                    v if matches!(i, 6..=9 | 11) => U8(v),
                    v => F32(v.into()),
                };
                order.iter().map(of).collect()
            })
            .collect();
        for file in in_all_formats(&properties(order), &rows) {
            let cloud = read(file).unwrap();
            let floats = |of: std::ops::Range<usize>| -> Vec<f32> {
                (0..3).flat_map(|point| of.clone().map(move |i| value(order, point, i).into())).collect()
            };
            assert_eq!(cloud.positions, floats(0..3), "{order:?}");
            assert_eq!(cloud.normals.unwrap(), floats(3..6), "{order:?}");
            assert_eq!(cloud.intensity.unwrap(), floats(10..11), "{order:?}");
            let colors: Vec<u8> = (0..3).flat_map(|point| (6..10).map(move |i| value(order, point, i))).collect();
            assert_eq!(cloud.colors.unwrap(), colors, "{order:?}");
        }
    }
}

#[test]
fn every_type_has_two_names() {
    use V::*;
    let types: [(&str, &str, V, f32); 8] = [
        ("char", "int8", I8(-5), -5.0),
        ("uchar", "uint8", U8(250), 250.0),
        ("short", "int16", I16(-500), -500.0),
        ("ushort", "uint16", U16(65000), 65000.0),
        ("int", "int32", I32(-70000), -70000.0),
        ("uint", "uint32", U32(4_000_000_000), 4e9),
        ("float", "float32", F32(0.1), 0.1),
        ("double", "float64", F64(0.1), 0.1),
    ];
    for (old, new, value, wanted) in types {
        for name in [old, new] {
            let z = format!("{name} nz");
            let properties = ["float x", "float y", "float z", "float nx", "float ny", &z];
            let row = vec![F32(1.0), F32(2.0), F32(3.0), F32(0.0), F32(0.0), value];
            for file in in_all_formats(&properties, &[row]) {
                assert_eq!(read(file).unwrap().normals.unwrap()[2], wanted, "{name}");
            }
        }
    }
    for (name, value) in [("int64", I64(-1 << 40)), ("uint64", U64(1 << 40))] {
        let intensity = format!("{name} intensity");
        let row = vec![F32(1.0), F32(2.0), F32(3.0), value];
        for file in in_all_formats(&["float x", "float y", "float z", &intensity], &[row]) {
            assert_eq!(read(file).unwrap().intensity.unwrap()[0].abs(), (1_u64 << 40) as f32, "{name}");
        }
    }
}

#[test]
fn other_line_ends_blanks_and_letter_cases_are_read() {
    let plain = "ply\nformat ascii 1.0\ncomment c\nelement vertex 2\nproperty float x\nproperty float y\n\
                 property float z\nend_header\n0 1 2\n3 4 5\n";
    let variants = [
        plain.to_owned(),
        plain.replace('\n', "\r\n"),
        plain.replace('\n', "\r"),
        plain.replace('\n', "\n\n"),
        plain.replace('\n', " \t\n"),
        plain.replace(' ', "\t  "),
        plain.trim_end().to_owned(),
        format!("\u{feff}{plain}"),
        plain.replacen("ply", "PLY", 1),
        plain.replace("property float x", "comment end_header\nproperty float x"),
        format!("{plain}left over 1 2 3 4\n"),
    ];
    for variant in variants {
        let cloud = read(&variant).unwrap_or_else(|error| panic!("{variant:?}: {error}"));
        assert_eq!(cloud.positions, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0], "{variant:?}");
        assert_eq!(cloud.comments[0], "c");
    }
}

#[test]
fn a_binary_body_begins_right_after_the_header_whatever_its_bytes() {
    for first in *b"\n\r " {
        for line_end in ["\n", "\r", "\r\n"] {
            let header =
                "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar tag\nproperty char x\n\
                          property char y\nproperty char z\nend_header\n"
                    .replace('\n', line_end);
            let file = [header.as_bytes(), &[first, 1, 2, 3], b"\n\ntrailing"].concat();
            assert_eq!(read(file).unwrap().positions, [1.0, 2.0, 3.0], "{first} {line_end:?}");
        }
    }
}

#[test]
fn far_doubles_come_relative_to_an_origin() {
    let coordinates = |i: usize| [431_000.125 + i as f64, 4_580_000.5 + i as f64 * 0.25, 12.0];
    let rows: Vec<Vec<V>> = (0..10_000).map(|i| coordinates(i).map(V::F64).to_vec()).collect();
    let mut files = in_all_formats(&["double x", "double y", "double z"], &rows).to_vec();
    let listed: Vec<Vec<V>> = rows.iter().map(|row| [&row[..], &[V::U8(1), V::U8(7)]].concat()).collect();
    files.extend(in_all_formats(&["double x", "double y", "double z", "list uchar uchar l"], &listed));
    let clouds: Vec<PointCloud> = files.iter().map(|file| read(file).unwrap()).collect();
    for cloud in &clouds {
        assert!(cloud.origin[0] > 431_000.0 && cloud.origin[1] > 4_580_000.0, "{:?}", cloud.origin);
        for point in 0..10_000 {
            let found = [0, 1, 2].map(|axis| cloud.origin[axis] + f64::from(cloud.positions[3 * point + axis]));
            assert_eq!(found, coordinates(point));
        }
        assert_eq!(cloud.origin, clouds[0].origin);
        assert_eq!(cloud.positions, clouds[0].positions);
    }
}

/// Survey files often have doubles for east and north, and a single for the height.
/// A row of doubles, padded: many bytes, few points.
fn padded(count: usize) -> (Vec<u8>, usize) {
    let mut properties = vec!["double x", "double y", "double z"];
    properties.resize(1024, "double other");
    let stride = 8 * properties.len();
    let mut body = vec![0; count * stride];
    for (i, row) in body.chunks_exact_mut(stride).enumerate() {
        for (c, place) in [431_000.0, 5_412_000.0, 120.0].into_iter().enumerate() {
            row[8 * c..8 * c + 8].copy_from_slice(&f64::to_le_bytes(place + (i * (c + 3)) as f64 % 17.25));
        }
    }
    (file(LITTLE, count, &properties, &body), stride)
}

#[test]
fn large_files_of_far_doubles_come_twice() {
    // More than are gathered.
    let (file, stride) = padded(20_000);
    assert!(file.len() > 128 << 20);
    let whole = ply::read(&file, &ReadOptions::default(), &Progress::silent()).unwrap();
    assert_ne!(whole.origin, [0.0; 3]);
    let most = RefCell::new(0);
    // One row at a time, and as many as are asked for.
    for parts in [1, (8 << 20) / stride as u64] {
        let pieces = in_pieces(file.len() as u64, 1 << 16, parts, |from, to| {
            let bytes = file[from as usize..to as usize].to_vec();
            most.replace_with(|most| bytes.len().max(*most));
            bytes
        });
        assert_eq!(pieces.unwrap(), whole);
    }
    assert!(*most.borrow() <= 8 << 20);
}

#[test]
fn a_file_larger_than_memory_is_read_or_refused() {
    let beginning = file(LITTLE, 700_000, &[&XYZ[..], &["double other"; 1024]].concat(), &[0; 12]);
    let header = beginning.len() as u64 - 12;
    let stride = 12 + 8 * 1024;
    let length = header + 700_000 * stride;
    assert!(length > 5 << 30);
    // Each point says where in the file it stands.
    let bytes = |from: u64, to: u64| {
        let Some(first) = from.checked_sub(header) else { return beginning.clone() };
        let mut rows = vec![0; (to - from) as usize];
        for (i, row) in rows.chunks_exact_mut(stride as usize).enumerate() {
            row[..4].copy_from_slice(&((first / stride + i as u64) as f32).to_le_bytes());
        }
        rows
    };
    let cloud = in_pieces(length, beginning.len(), 1, bytes).unwrap();
    assert!(cloud.positions.chunks_exact(3).enumerate().all(|(i, p)| p == [i as f32, 0.0, 0.0]));
    assert_eq!(cloud.properties.len(), 1027);

    // Cut short, too, and before any of it is read.
    let mut stream = Stream::new(length - 1, ReadOptions::default());
    match stream.take(&beginning, &Progress::silent()) {
        Err(Error::Format { message, place }) => {
            assert_eq!(message, "the file ends after 699999 of 700000 rows of element vertex");
            assert_eq!(place, Some(Place::Byte(length - stride)));
        }
        other => panic!("{other:?}"),
    }
    // What comes beyond the end is none of it.
    let mut stream = Stream::new(10, ReadOptions::default());
    assert!(matches!(stream.take(&beginning, &Progress::silent()), Err(Error::Format { .. })));
    // Other files are told by their beginning, not by what they would take.
    let mut stream = Stream::new(1 << 60, ReadOptions::default());
    assert!(matches!(stream.take(b"LASF", &Progress::silent()), Err(Error::Format { .. })));
    // What has to be there as a whole, and does not fit.
    let text = file(TEXT, 3, &XYZ, b"");
    let mut stream = Stream::new(1 << 60, ReadOptions::default());
    match stream.take(&text, &Progress::silent()) {
        Err(Error::Limit { needed, .. }) => assert_eq!(needed, 1 << 60),
        other => panic!("{other:?}"),
    }
}

#[test]
fn rows_that_were_given_up_do_not_count_as_read() {
    let file = file(LITTLE, 3, &XYZ, &[1; 36]);
    let rows = file.len() - 36;
    let mut stream = Stream::new(file.len() as u64, ReadOptions::default());
    assert!(matches!(stream.take(&file[..rows + 1], &Progress::silent()), Ok(Next::Pieces { .. })));
    let stop = Progress::new(&|_, _| ControlFlow::Break(()), &|| 0.0);
    assert_eq!(stream.take(&file[rows..rows + 24], &stop), Err(Error::Cancelled));
    // Memory that nobody wrote to would come out.
    assert!(stream.take(&file[rows + 24..], &Progress::silent()).is_err());
}

#[test]
fn far_coordinates_of_mixed_types_come_relative_to_one_origin() {
    let coordinates = |i: usize| [431_000.125 + i as f64, 4_580_000.0 + i as f64, 512.5 + i as f64 * 0.25];
    let rows: Vec<Vec<V>> =
        (0..100).map(coordinates).map(|[x, y, z]| vec![V::F64(x), V::I32(y as i32), V::F32(z as f32)]).collect();
    for file in in_all_formats(&["double x", "int y", "float z"], &rows) {
        let cloud = read(file).unwrap();
        for point in 0..100 {
            let found = [0, 1, 2].map(|axis| cloud.origin[axis] + f64::from(cloud.positions[3 * point + axis]));
            assert_eq!(found, coordinates(point));
        }
    }
}

#[test]
fn near_doubles_and_all_floats_keep_a_zero_origin() {
    let near = [[0.1, 0.2, 0.3], [1.0, 2.0, 3.0], [-1.0, -2.0, -3.0]];
    let rows = near.map(|p| p.map(V::F64).to_vec());
    for file in in_all_formats(&["double x", "double y", "double z"], &rows) {
        assert_eq!(read(file).unwrap().origin, [0.0; 3]);
    }
    let rows = [[1e9_f32, 1e9, 1e9], [1e9, 1e9, 1e9]].map(|p| p.map(V::F32).to_vec());
    for file in in_all_formats(&XYZ, &rows) {
        let cloud = read(file).unwrap();
        assert_eq!((cloud.origin, cloud.positions), ([0.0; 3], vec![1e9; 6]));
    }
}

#[test]
fn coordinates_that_are_not_finite_are_kept_and_finite_ones_stay_finite() {
    let rows = [[f64::NAN, f64::INFINITY, f64::NEG_INFINITY], [1e300, -1e300, 1.0], [0.5, 0.0, 0.0], [1.0; 3]];
    let text = body(TEXT, &rows.map(|p| p.map(V::F64).to_vec()));
    let mut files = in_all_formats(&["double x", "double y", "double z"], &rows.map(|p| p.map(V::F64).to_vec()));
    files[0] = file(TEXT, 4, &["double x", "double y", "double z"], &text);
    for file in files {
        let cloud = read(file).unwrap();
        assert!(cloud.positions[0].is_nan());
        assert_eq!(cloud.positions[1..5], [f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN]);
    }
}

#[test]
fn every_spelling_of_no_number_is_read() {
    let text = "nan NaN -nan\n-nan(ind) nan(snan) 1.#QNAN\n-1.#IND 1.#SNAN +nan\ninf +inf Infinity\n1.#INF 1e39 +1\n\
                -inf -1.#INF -Infinity\n";
    let cloud = read(file(TEXT, 6, &XYZ, text.as_bytes())).unwrap();
    assert!(cloud.positions[..9].iter().all(|value| value.is_nan()), "{:?}", cloud.positions);
    assert_eq!(cloud.positions[9..14], [f32::INFINITY; 5]);
    assert_eq!(cloud.positions[14], 1.0);
    assert_eq!(cloud.positions[15..], [f32::NEG_INFINITY; 3]);
}

#[test]
fn text_becomes_the_nearest_single() {
    // Each lies so close to the middle of two singles that rounding to double first gives the other one.
    let tokens = ["1.00000017881393432617187499", "1.00000017881393432617187501", "16777217.0000000001"];
    let cloud = read(file(TEXT, 1, &XYZ, tokens.join(" ").as_bytes())).unwrap();
    assert_eq!(cloud.positions, tokens.map(|token| token.parse::<f32>().unwrap()));
    let wide = read(file(TEXT, 1, &["float x", "float y", "double z"], tokens.join(" ").as_bytes())).unwrap();
    assert_eq!(wide.origin, [1.0, 1.0, 16777217.0]);
}

#[test]
fn whole_number_coordinates_may_be_written_as_decimals() {
    let cloud = read(file(TEXT, 1, &["int x", "short y", "char z"], b"1.0 2.5 3")).unwrap();
    let found: Vec<f64> = cloud.positions.iter().zip(cloud.origin).map(|(p, o)| o + f64::from(*p)).collect();
    assert_eq!(found, [1.0, 2.5, 3.0]);
}

#[test]
fn colours_of_any_type_become_bytes() {
    use V::*;
    let cases: [(&str, [V; 4], [u8; 4]); 6] = [
        ("uchar", [U8(0), U8(128), U8(255), U8(7)], [0, 128, 255, 7]),
        ("ushort", [U16(0), U16(0x80ff), U16(65535), U16(256)], [0, 128, 255, 1]),
        ("float", [F32(0.0), F32(0.5), F32(1.0), F32(7.0)], [0, 128, 255, 255]),
        ("double", [F64(-1.0), F64(0.5), F64(f64::NAN), F64(1.0)], [0, 128, 0, 255]),
        ("int", [I32(-1), I32(128), I32(1000), I32(255)], [0, 128, 255, 255]),
        ("char", [I8(0), I8(-128), I8(-1), I8(127)], [0, 128, 255, 127]),
    ];
    for (kind, values, wanted) in cases {
        for names in [["red", "green", "blue", "alpha"], ["r", "g", "b", "a"], ["Red", "Green", "Blue", "Alpha"]] {
            let colors = names.map(|name| format!("{kind} {name}"));
            let properties = ["float x", "float y", "float z", &colors[0], &colors[1], &colors[2], &colors[3]];
            let row = [&[F32(0.0); 3][..], &values].concat();
            for file in in_all_formats(&properties, &[row]) {
                assert_eq!(read(file).unwrap().colors.unwrap(), wanted, "{kind} {names:?}");
            }
        }
    }
    let diffuse = ["float x", "float y", "float z", "uchar diffuse_red", "uchar diffuse_green", "uchar diffuse_blue"];
    assert_eq!(read(file(TEXT, 1, &diffuse, b"0 0 0 1 2 3")).unwrap().colors.unwrap(), [1, 2, 3, 255]);
    let some = ["float x", "float y", "float z", "uchar red", "uchar green"];
    assert_eq!(read(file(TEXT, 1, &some, b"0 0 0 1 2")).unwrap().colors, None);
}

#[test]
fn normals_and_intensity_have_several_names() {
    for names in [["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"], ["NX", "NY", "NZ"]] {
        for intensity in ["intensity", "Intensity", "scalar_intensity", "scalar_Intensity", "reflectance"] {
            let [a, b, c] = names.map(|name| format!("float {name}"));
            let d = format!("float {intensity}");
            let cloud =
                read(file(TEXT, 1, &[&a, &b, &c, &d, "float x", "float y", "float z"], b"1 2 3 4 5 6 7")).unwrap();
            assert_eq!(cloud.normals.unwrap(), [1.0, 2.0, 3.0]);
            assert_eq!(cloud.intensity.unwrap(), [4.0]);
            assert_eq!(cloud.positions, [5.0, 6.0, 7.0]);
        }
    }
}

#[test]
fn a_property_in_its_own_letters_comes_first() {
    let properties = ["float X", "float x", "float y", "float z", "float Y"];
    assert_eq!(read(file(TEXT, 1, &properties, b"9 1 2 3 9")).unwrap().positions, [1.0, 2.0, 3.0]);
    let upper = ["float X", "float Y", "float Z"];
    assert_eq!(read(file(TEXT, 1, &upper, b"1 2 3")).unwrap().positions, [1.0, 2.0, 3.0]);
}

#[test]
fn no_points_give_an_empty_cloud() {
    for format in [TEXT, LITTLE, BIG] {
        let cloud = read(file(format, 0, &XYZ, b"")).unwrap();
        assert!(cloud.is_empty());
        let written = write(file(format, 0, &XYZ, b""), &[], false).unwrap();
        assert_eq!(read(written).unwrap().normals, Some(Vec::new()));
    }
}

#[test]
fn large_text_is_read_in_pieces_with_exact_lines() {
    let count = 60_000;
    let rows: Vec<Vec<V>> = (0..count).map(|i| [1.0, 0.5, -2.0].map(|f| V::F32(f * i as f32 / 7.0)).to_vec()).collect();
    let [text, little, big] = in_all_formats(&XYZ, &rows);
    assert!(text.len() > 1_500_000, "several pieces");
    let cloud = read(&text).unwrap();
    for other in [little, big] {
        assert_eq!(cloud.positions, read(other).unwrap().positions);
    }
    let text = String::from_utf8(text).unwrap();
    for line in [8, 9, 20_000, 43_210, 60_007] {
        for (wrong, part) in
            [("1 2", "2 values, the header declares 3"), ("1 2 3 4", "4 values"), ("1 2 x", "'x' is not")]
        {
            let mut lines: Vec<&str> = text.lines().collect();
            lines[line - 1] = wrong;
            assert_refused(lines.join("\n"), Place::Line(line as u64), part);
            // The blank lines count.
            lines.insert(10, "");
            let later = if line > 10 { line + 1 } else { line };
            assert_refused(lines.join("\r\n"), Place::Line(later as u64), part);
        }
    }
}

#[test]
fn a_row_of_text_with_the_wrong_number_of_values_says_so() {
    assert_refused(file(TEXT, 2, &XYZ, b"1 2 3\n4 5\n6 7 8\n"), Place::Line(9), "2 values, the header declares 3");
    assert_refused(file(TEXT, 2, &XYZ, b"1 2 3\n4\n"), Place::Line(9), "1 value, the header declares 3");
    assert_refused(file(TEXT, 2, &XYZ, b"1 2 3\n4 5"), Place::Line(9), "and the file ends here");
    assert_refused(file(TEXT, 1, &XYZ, b"1 2 3 4\n"), Place::Line(8), "4 values, the header declares 3");
    let listed = [&XYZ[..], &["list uchar int l"]].concat();
    assert_refused(file(TEXT, 1, &listed, b"1 2 3 2 1\n"), Place::Line(9), "5 values");
    assert_refused(file(TEXT, 1, &listed, b"1 2 3 2 1 2 3\n"), Place::Line(9), "7 values");
    assert_refused(file(TEXT, 1, &listed, b"1 2 3 -1\n"), Place::Line(9), "'-1' as the length of a list");
    assert_refused(file(TEXT, 1, &listed, b"1 2 3 4000000000\n"), Place::Line(9), "4 values");
}

#[test]
fn text_that_is_no_number_is_quoted() {
    assert_refused(file(TEXT, 1, &XYZ, b"1 2,5 3"), Place::Line(8), "'2,5' is not a number; wanted a decimal point");
    assert_refused(file(TEXT, 1, &XYZ, b"1 0x10 3"), Place::Line(8), "'0x10' is not a number");
    assert_refused(file(TEXT, 1, &XYZ, b"1 1.5e 3"), Place::Line(8), "'1.5e' is not a number");
    assert_refused(file(TEXT, 1, &XYZ, b"1 \xff\x01- 3"), Place::Line(8), "is not a number");
}

#[test]
fn a_file_that_ends_too_early_says_where() {
    let [text, little, big] = in_all_formats(&XYZ, &[[1.0, 2.0, 3.0].map(V::F32).to_vec(), vec![V::F32(4.0); 3]]);
    for binary in [little, big] {
        let header = binary.len() - 24;
        let place = Place::Byte(header as u64 + 12);
        assert_refused(&binary[..header + 23], place, "after 1 of 2 rows of element vertex");
    }
    assert_refused(&text[..text.len() - 13], Place::Line(9), "after 1 of 2 rows of element vertex");
    for format in [TEXT, LITTLE, BIG] {
        let whole = rich(format);
        assert!(read(&whole).is_ok());
        let body = whole.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
        // The rows of faces in text are counted, and not read.
        let end = whole.len() - if format == TEXT { "0 0 \n".len() } else { 0 };
        for length in 0..end {
            assert!(read(&whole[..length]).is_err(), "{format} cut at {length}");
            if length > body && format != TEXT {
                let Some(Place::Byte(byte)) = refusal(&whole[..length]).0 else { panic!("a byte") };
                assert!(byte as usize >= body && byte as usize <= length);
            }
        }
    }
}

#[test]
fn counts_that_lie_are_found_before_memory_is_taken() {
    for count in ["5", "4294967295", "1537228672809129302", "18446744073709551615"] {
        for format in [TEXT, LITTLE, BIG] {
            let text = format!(
                "ply\nformat {format} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
                 end_header\n0 0 0\n1 1 1\n"
            );
            let (_, message) = refusal(&text);
            assert!(message.contains(&format!("of {count} rows of element vertex")), "{message}");
        }
    }
    // Enough lines, but not the bytes for so many values.
    let many: Vec<String> = (0..20_000).map(|i| format!("float p{i}")).collect();
    let properties: Vec<&str> = XYZ.into_iter().chain(many.iter().map(String::as_str)).collect();
    let rows = b"1\n".repeat(100);
    let (_, message) = refusal(file(TEXT, 100, &properties, &rows));
    assert!(message.contains("200 bytes of text cannot hold the 2000300 values"), "{message}");
}

#[test]
fn lists_that_lie_are_found() {
    let header = |format: &str, count: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement face 1\nproperty list {count} double l\nelement vertex 0\nproperty float x\n\
             property float y\nproperty float z\nend_header\n"
        )
    };
    let cases = [("uint", "\u{7f}\u{7f}\u{7f}\u{7f}", "none past the end"), ("uchar", "\x02", "a list of 2 values")];
    for (count, bytes, part) in cases {
        let (place, message) = refusal(format!("{}{bytes}", header(LITTLE, count)));
        assert!(message.contains(part) && matches!(place, Some(Place::Byte(_))), "{message}");
    }
    let negative = [header(LITTLE, "int").as_bytes(), &(-1_i32).to_le_bytes()].concat();
    assert!(refusal(negative).1.contains("a list of -1 values; wanted 0 or more"));
    let largest = [header(BIG, "uint64").as_bytes(), &u64::MAX.to_be_bytes()].concat();
    assert!(refusal(largest).1.contains("a list of 18446744073709551615 values"));
    let short = header(BIG, "uint64") + "\0\0\0";
    assert!(refusal(short).1.contains("after 0 of 1 rows of element face"));
}

#[test]
fn rows_without_properties_cost_nothing() {
    for format in [TEXT, LITTLE, BIG] {
        let row = body(format, &[[1.0, 2.0, 3.0].map(V::F32).to_vec()]);
        let header = format!(
            "ply\nformat {format} 1.0\nelement a 18446744073709551615\nelement vertex 1\nproperty float x\nproperty float y\n\
             property float z\nelement b 18446744073709551615\nend_header\n"
        );
        let file = [header.as_bytes(), &row].concat();
        assert_eq!(read(&file).unwrap().positions, [1.0, 2.0, 3.0]);
        for ascii in [false, true] {
            assert_eq!(read(write(&file, &[0.0; 3], ascii).unwrap()).unwrap().len(), 1);
        }
    }
}

#[test]
fn files_without_positions_say_what_they_have() {
    let no_z = file(TEXT, 1, &["float x", "float y", "uchar red"], b"1 2 3");
    assert_refused(no_z, None, "no x y z as plain numbers; the file has vertex 1: float x, float y, uchar red");
    let listed = file(TEXT, 1, &["float x", "float y", "list uchar float z"], b"1 2 0");
    assert_refused(listed, None, "list uchar float z");
    assert_refused("ply\nformat ascii 1.0\nelement face 0\nend_header\n", None, "no element vertex; it has face 0");
    let twice = file(TEXT, 1, &["float x", "float y", "float z", "float y"], b"1 2 3 4");
    assert_refused(twice, None, "y of element vertex is declared twice");
    let packed = file(LITTLE, 1, &["uint packed_position", "uint packed_color"], &[0; 8]);
    assert_refused(packed, None, "with packed positions; save it uncompressed");
}

#[test]
fn wrong_headers_say_the_line() {
    let cases: [(&str, u64, &str); 16] = [
        ("ply\n", 1, "no end_header"),
        ("ply\nformat ascii 1.0\nelement vertex 1\n", 3, "no end_header"),
        ("ply\nend_header\n", 2, "no format line"),
        ("ply\nformat ascii\n", 2, "'format ascii'; wanted ascii, binary"),
        (
            "ply\nformat ascii 2.0\n",
            2,
            "'format ascii 2.0'; wanted ascii, binary_little_endian or binary_big_endian, and the version 1.0",
        ),
        ("ply\nformat text 1.0\n", 2, "'format text 1.0'; wanted ascii"),
        ("ply\nformat ascii 1.0\nformat binary_big_endian 1.0\n", 3, "a second, different format line"),
        ("ply\nformat ascii 1.0\n\nhello world\n", 4, "'hello' is no word of a PLY header"),
        ("ply\nformat ascii 1.0\nelement vertex\n", 3, "'element vertex'; wanted a name and a count"),
        ("ply\nformat ascii 1.0\nelement vertex -5\n", 3, "'element vertex -5'; wanted a name and a count from 0"),
        ("ply\nformat ascii 1.0\nelement vertex 18446744073709551616\n", 3, "wanted a name and a count from 0"),
        ("ply\nformat ascii 1.0\nproperty float x\n", 3, "a property before the first element"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty float\n", 4, "wanted a type and a name"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\n", 4, "'property half x'; wanted a type: char"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty list float int x\n", 4, "length of a list"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nelement vertex 1\n", 4, "a second element named vertex"),
    ];
    for (text, line, part) in cases {
        assert_refused(text, Place::Line(line), part);
        assert_refused(text.replace('\n', "\r\n"), Place::Line(line), part);
    }
}

#[test]
fn files_of_other_kinds_are_named() {
    let cases: [(&[u8], &str); 9] = [
        (b"", "the file is empty"),
        (b"\x1f\x8b\x08\0", "a gzip file; unpack it first"),
        (b"PK\x03\x04", "a zip file"),
        (b"solid cube", "an STL file"),
        (b"\xff\xfep\0l\0y\0", "UTF-16"),
        (b"# .PCD v0.7", "a PCD file"),
        (b"<!DOCTYPE html>", "a web page"),
        (b"plywood", "it begins with 'plywood'; wanted 'ply'"),
        (b"1 2 3\n4 5 6\n", "it begins with '1 2 3"),
    ];
    for (bytes, part) in cases {
        assert_refused(bytes, Place::Byte(0), part);
    }
}

#[test]
fn a_header_without_end_is_given_up() {
    let mut long = b"ply\nformat ascii 1.0\n".to_vec();
    long.resize(20 << 20, b' ');
    assert!(refusal(&long).1.contains("end_header"));
    let comments = ["ply\nformat ascii 1.0\n", &"comment nothing to say\n".repeat(1 << 20)].concat();
    assert!(refusal(comments).1.contains("16 MiB"));
    let elements = ["ply\nformat ascii 1.0\n", &"element a 1\nproperty char b\n".repeat(5000)].concat();
    assert!(refusal(elements).1.contains("more than 4096 elements"));
}

#[test]
fn more_points_than_asked_for_are_refused() {
    let file = file(TEXT, 2, &XYZ, b"0 0 0\n1 1 1");
    let with = |most| ply::read(&file, &ReadOptions { max_points: Some(most) }, &Progress::silent());
    assert_eq!(with(2).unwrap().len(), 2);
    let error = with(1).unwrap_err();
    assert!(matches!(&error, Error::Input(text) if text.contains("2 points; at most 1")), "{error}");
}

#[test]
fn progress_rises_and_can_stop_the_call() {
    let big = file(LITTLE, 3_000_000, &["char x", "char y", "char z"], &vec![1; 9_000_000]);
    for file in [rich(TEXT), rich(LITTLE), big] {
        let seen = RefCell::new(Vec::new());
        let observer = |phase: &'static str, fraction: f64| {
            seen.borrow_mut().push((phase, fraction));
            ControlFlow::Continue(())
        };
        let progress = Progress::new(&observer, &|| 0.0);
        let count = ply::read(&file, &ReadOptions::default(), &progress).unwrap().len();
        let normals = vec![0.0; 3 * count];
        let add = Additions { normals: Some(&normals), curvature: None };
        ply::write(&file, &add, false, &progress).unwrap();
        let mut rewrite = Rewrite::new(file.len() as u64, true);
        let in_pieces = RefCell::new(vec![0.0]);
        let observer = |_: &'static str, fraction: f64| {
            in_pieces.borrow_mut().push(fraction);
            ControlFlow::Continue(())
        };
        for piece in file.chunks(512.max(file.len() / 3)) {
            rewrite.take(piece, &add, &Progress::new(&observer, &|| 0.0)).unwrap();
        }
        assert!(in_pieces.borrow().is_sorted() && in_pieces.borrow().last() == Some(&1.0), "{in_pieces:?}");
        for phase in ["read", "write"] {
            let seen: Vec<f64> = seen.borrow().iter().filter(|(name, _)| *name == phase).map(|(_, f)| *f).collect();
            assert!(seen.len() >= 2 && seen.is_sorted(), "{seen:?}");
            assert_eq!((seen[0], seen[seen.len() - 1]), (0.0, 1.0));
        }
        let stop = Progress::new(
            &|_, fraction| if fraction > 0.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) },
            &|| 0.0,
        );
        assert_eq!(ply::read(&file, &ReadOptions::default(), &stop), Err(Error::Cancelled));
        assert_eq!(ply::write(&file, &add, true, &stop), Err(Error::Cancelled));
    }
}

// Writing

fn vertex_properties(ply: &Ply) -> Vec<&str> {
    ply.element("vertex").properties.iter().map(|property| property.name.as_str()).collect()
}

#[test]
fn everything_but_the_normals_is_kept_from_any_format_to_any() {
    for format in [TEXT, LITTLE, BIG] {
        let source = rich(format);
        for ascii in [false, true] {
            let written = write(&source, &RICH_NORMALS, ascii).unwrap();
            let after = Ply::parse(&written);
            assert_eq!(after.text, ascii);
            Ply::parse(&source).assert_kept(&after, &["nx", "ny", "nz"]);
            for (axis, name) in ["nx", "ny", "nz"].into_iter().enumerate() {
                let wanted: Vec<f32> = RICH_NORMALS.iter().skip(axis).step_by(3).copied().collect();
                assert_eq!(after.floats(name), wanted);
            }
            // Where they stood before.
            let names = "red x nx marks z y green blue ny nz intensity time";
            assert_eq!(vertex_properties(&after), names.split(' ').collect::<Vec<_>>());
            let cloud = read(&written).unwrap();
            assert_eq!(cloud.normals.as_deref(), Some(&RICH_NORMALS[..]));
            assert_eq!(cloud.positions, read(&source).unwrap().positions);
        }
    }
}

#[test]
fn the_whole_output_is_as_expected() {
    let source = "ply\r\ncomment first\r\nformat ascii 1.0\r\nelement vertex 2\r\nproperty float x\r\nproperty float y\r\n\
                  property float z\r\ncomment after\r\nelement face 1\r\nproperty list uchar int i\r\nend_header\r\n\
                  0 1.50 1e2\r\n\r\n3  4\t5 \r\n3 0  1 0\r\ngarbage\r\n";
    let header = "ply\ncomment first\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
                  property float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty float curvature\n\
                  comment after\nelement face 1\nproperty list uchar int i\nend_header\n";
    let normals = [0.0, -0.0, 1.0, 0.1, 1e-10, f32::NAN];
    let add = Additions { normals: Some(&normals), curvature: Some(&[0.25, f32::INFINITY]) };
    let written = write_both(source.as_bytes(), &add, true).unwrap();
    let wanted = format!("{header}0 1.50 1e2 0 -0 1 0.25\n3 4 5 0.1 1e-10 nan inf\n3 0  1 0\n");
    assert_eq!(String::from_utf8(written).unwrap(), wanted);

    let written = write_both(source.as_bytes(), &add, false).unwrap();
    let mut wanted = header.replace("ascii", LITTLE).into_bytes();
    for value in [0.0, 1.5, 100.0, 0.0, -0.0, 1.0, 0.25, 3.0, 4.0, 5.0, 0.1, 1e-10, f32::NAN, f32::INFINITY] {
        wanted.extend(value.to_le_bytes());
    }
    wanted.push(3);
    wanted.extend([0_i32, 1, 0].iter().flat_map(|i| i.to_le_bytes()));
    assert_eq!(written, wanted);
}

#[test]
fn existing_normals_and_curvature_are_replaced_whatever_their_name_and_type() {
    use V::*;
    let properties =
        ["double normal_z", "float x", "uchar Normal_X", "float y", "double curvature", "float z", "float nx"];
    let row = vec![F64(9.0), F32(1.0), U8(9), F32(2.0), F64(9.0), F32(3.0), F32(9.0)];
    for source in in_all_formats(&properties, &[row]) {
        for ascii in [false, true] {
            let add = Additions { normals: Some(&[0.5, 0.25, 0.125]), curvature: Some(&[0.0625]) };
            let after = Ply::parse(&write_both(&source, &add, ascii).unwrap());
            assert_eq!(vertex_properties(&after), ["nz", "x", "nx", "y", "curvature", "z", "ny"]);
            for (name, wanted) in [("nx", 0.5), ("ny", 0.25), ("nz", 0.125), ("curvature", 0.0625), ("y", 2.0)] {
                assert_eq!(after.floats(name), [wanted], "{name}");
            }
            let add = Additions { normals: None, curvature: Some(&[0.0625]) };
            let after = Ply::parse(&write_both(&source, &add, ascii).unwrap());
            assert_eq!(vertex_properties(&after), vertex_properties(&Ply::parse(&source)));
            Ply::parse(&source).assert_kept(&after, &["curvature"]);
            assert_eq!(after.floats("nx"), [9.0]);
        }
    }
}

#[test]
fn text_gives_back_the_same_bits() {
    let mut floats =
        vec![0.0_f32, -0.0, 1.0, f32::MIN_POSITIVE, 1e-45, f32::MAX, f32::MIN, 0.1, 16777216.0, 1e16, 9.9e-6];
    floats.extend([f32::INFINITY, f32::NEG_INFINITY, f32::NAN]);
    let mut random = Random(7);
    floats.extend((0..2000).map(|_| f32::from_bits(random.next() as u32)).filter(|f| !f.is_nan()));
    let properties = ["float x", "float y", "float z", "double d", "int64 i", "uint64 u", "short s"];
    let rows: Vec<Vec<V>> = floats
        .iter()
        .map(|f| {
            let word = random.next();
            let double = f64::from_bits(random.next());
            let double = if double.is_nan() { 1e22 } else { double };
            let mut row = vec![V::F32(*f); 3];
            row.extend([V::F64(double), V::I64(word as i64), V::U64(word), V::I16(word as i16)]);
            row
        })
        .collect();
    let source = file(LITTLE, rows.len(), &properties, &body(LITTLE, &rows));
    let text = write(&source, &vec![0.0; 3 * rows.len()], true).unwrap();
    let back = write(&text, &vec![0.0; 3 * rows.len()], false).unwrap();
    Ply::parse(&source).assert_kept(&Ply::parse(&text), &["nx", "ny", "nz"]);
    Ply::parse(&source).assert_kept(&Ply::parse(&back), &["nx", "ny", "nz"]);
}

#[test]
fn text_that_its_type_cannot_hold_stays_text() {
    let cases =
        [("int", "2.5"), ("uchar", "256"), ("char", "-129"), ("uint", "-1"), ("ushort", "nan"), ("float", "red")];
    for (kind, token) in cases {
        let property = format!("{kind} label");
        let body = format!("1 2 3 {token}\n");
        let source = file(TEXT, 1, &["float x", "float y", "float z", &property], body.as_bytes());
        let error = write(&source, &[0.0; 3], false).unwrap_err().to_string();
        assert!(error.contains(&format!("line 9: '{token}' is no value of type {kind}")), "{error}");
        let kept = String::from_utf8(write(&source, &[0.0; 3], true).unwrap()).unwrap();
        assert!(kept.ends_with(&format!("1 2 3 {token} 0 0 0\n")), "{kept}");
    }
    let source = file(TEXT, 1, &["float x", "float y", "float z", "uchar a", "int b"], b"1 2 3 7.0 -1e3\n");
    let after = Ply::parse(&write(&source, &[0.0; 3], false).unwrap());
    assert_eq!(after.elements[0].properties[3].values, [7]);
    assert_eq!(after.elements[0].properties[4].values, [u64::from(-1000_i32 as u32)]);
}

#[test]
fn additions_of_the_wrong_length_are_refused() {
    let source = file(TEXT, 2, &XYZ, b"0 0 0\n1 1 1");
    let error = write(&source, &[0.0; 3], false).unwrap_err();
    assert!(
        matches!(&error, Error::Input(text) if text.contains("3 numbers; wanted 3 for each of the 2 points")),
        "{error}"
    );
    let add = Additions { normals: None, curvature: Some(&[0.0; 3]) };
    let error = write_both(&source, &add, false).unwrap_err();
    assert!(matches!(&error, Error::Input(text) if text.contains("curvature has 3")), "{error}");
}

#[test]
fn a_comment_cannot_become_a_header_line() {
    let source = "ply\rformat ascii 1.0\rcomment a\nelement vertex 9\relement vertex 1\rproperty float x\rproperty float y\r\
                  property float z\rend_header\r1 2 3\r";
    for ascii in [false, true] {
        let cloud = read(write(source, &[0.0; 3], ascii).unwrap()).unwrap();
        assert_eq!(cloud.len(), 1);
        assert_eq!(cloud.comments, ["a element vertex 9"]);
        let comments = vec!["b\nelement vertex 9\r\nend_header".to_owned()];
        let written = ply::write_cloud(&PointCloud { comments, ..cloud }, &Additions::default(), ascii).unwrap();
        assert_eq!(read(written).unwrap().len(), 1);
    }
}

#[test]
fn a_line_feed_within_a_row_stays_a_blank() {
    let source = "ply\rformat ascii 1.0\relement a 1\rproperty int b\rproperty int c\relement vertex 1\rproperty float x\r\
                  property float y\rproperty float z\rend_header\r7\n8\r1\n2 3\r";
    let written = String::from_utf8(write(source, &[0.0; 3], true).unwrap()).unwrap();
    assert!(written.ends_with("end_header\n7 8\n1 2 3 0 0 0\n"), "{written}");
}

#[test]
fn many_rows_are_written_in_tasks() {
    let count = 150_000_usize;
    let number = |i: usize| i as f32 * 0.5;
    let position = |i: usize| [number(i), -number(i), number(i) + 0.25];
    let row = |i: usize| {
        let [x, y, z] = position(i).map(V::F32);
        vec![x, y, V::U8(i as u8), z]
    };
    let rows: Vec<Vec<V>> = (0..count).map(row).collect();
    let normals: Vec<f32> = (0..3 * count).map(|i| i as f32).collect();
    let files = in_all_formats(&["float x", "float y", "uchar tag", "float z"], &rows);
    let outputs = files.map(|file| write(file, &normals, false).unwrap());
    assert!(outputs[0] == outputs[1] && outputs[1] == outputs[2]);
    let cloud = read(&outputs[0]).unwrap();
    assert!(cloud.normals.as_deref() == Some(&normals[..]));
    assert!(cloud.positions == (0..count).flat_map(position).collect::<Vec<f32>>());
}

#[test]
fn elements_round_the_points_come_in_pieces_too() {
    let rows = |count: usize, row: &dyn Fn(usize) -> Vec<V>| (0..count).map(row).collect::<Vec<_>>();
    let tags = rows(1000, &|i| vec![V::U8(i as u8), V::U16(3 * i as u16)]);
    let points = rows(400, &|i| vec![V::F32(i as f32), V::F64(0.1), V::F32(2.0), V::I16(-7)]);
    let tail = rows(700, &|i| vec![V::F64(i as f64 / 3.0)]);
    for format in [LITTLE, BIG] {
        let header = format!(
            "ply\nformat {format} 1.0\nelement tag 1000\nproperty uchar a\nproperty ushort b\nelement nothing 1000000000\n\
             element vertex 400\nproperty float x\nproperty double y\nproperty float nz\nproperty short z\n\
             element lists 0\nproperty list uchar int many\nelement tail 700\nproperty double c\nend_header\n"
        );
        let file =
            [header.as_bytes(), &body(format, &tags), &body(format, &points), &body(format, &tail), b"more"].concat();
        for ascii in [false, true] {
            let written = write(&file, &[0.5; 1200], ascii).unwrap();
            let ply = Ply::parse(&written);
            assert_eq!(vertex_properties(&ply), ["x", "y", "nz", "z", "nx", "ny"]);
            assert_eq!(ply.element("tail").properties[0].values[699], (699.0_f64 / 3.0).to_bits());
        }
        let error = write(&file, &[0.5; 1203], false).unwrap_err();
        assert!(error.to_string().contains("1203"), "{error}");
        assert!(write(&file[..file.len() - 5], &[0.5; 1200], false).is_err());
    }
}

#[test]
fn a_file_larger_than_memory_is_written() {
    let count = 600_000;
    let beginning = file(LITTLE, count, &[&XYZ[..], &["double other"; 1024]].concat(), &[0; 12]);
    let header = beginning.len() - 12;
    let stride = 12 + 8 * 1024;
    let bytes_of = |rows: usize, stride: usize| rows as u64 * stride as u64;
    let length = header as u64 + bytes_of(count, stride);
    assert!(length > 4 << 30);
    let normals: Vec<f32> = (0..3 * count).map(|i| i as f32).collect();
    let add = Additions { normals: Some(&normals), curvature: None };
    let mut rewrite = Rewrite::new(length, false);
    let mut written = rewrite.take(&beginning, &add, &Progress::silent()).unwrap().len() as u64;
    // Nine rows and a part of one.
    let piece = vec![7; 9 * stride + 4321];
    let (mut came, mut point) = (beginning.len() as u64, 0);
    while !rewrite.is_complete() {
        let bytes = &piece[..piece.len().min((length - came) as usize)];
        let rows = rewrite.take(bytes, &add, &Progress::silent()).unwrap();
        for row in rows.chunks_exact(stride + 12) {
            assert!(row[stride..] == bytemuck::cast_slice::<f32, u8>(&normals[point..point + 3])[..]);
            point += 3;
        }
        came += bytes.len() as u64;
        written += rows.len() as u64;
        assert!(rows.len() <= 10 * (stride + 12));
    }
    let longer = (header + "property float nx\n".len() * 3) as u64;
    assert_eq!(written, longer + bytes_of(count, stride + 12));
    assert_eq!(point, normals.len());
}

#[test]
fn a_cloud_alone_becomes_a_file() {
    let mut cloud = read(rich(LITTLE)).unwrap();
    let curvature = [0.1, 0.2, 0.3];
    for origin in [[0.0; 3], [5e5, 4e6, -0.125]] {
        cloud.origin = origin;
        for ascii in [false, true] {
            let add = Additions { normals: Some(&RICH_NORMALS), curvature: Some(&curvature) };
            let written = ply::write_cloud(&cloud, &add, ascii).unwrap();
            let back = read(&written).unwrap();
            assert_eq!(back.normals.as_deref(), Some(&RICH_NORMALS[..]));
            assert_eq!(
                (&back.colors, &back.intensity, &back.comments),
                (&cloud.colors, &cloud.intensity, &cloud.comments)
            );
            assert_eq!(back.format, if ascii { Format::Ascii } else { Format::BinaryLittleEndian });
            assert_eq!(Ply::parse(&written).floats("curvature"), curvature);
            for i in 0..9 {
                let wanted = origin[i % 3] + f64::from(cloud.positions[i]);
                let found = back.origin[i % 3] + f64::from(back.positions[i]);
                assert!((wanted - found).abs() < 1e-6, "{wanted} {found}");
            }
            let own = read(ply::write_cloud(&cloud, &Additions::default(), ascii).unwrap()).unwrap();
            assert_eq!(own.normals, cloud.normals);
        }
    }
    let bare = PointCloud { normals: None, colors: None, intensity: None, comments: Vec::new(), ..cloud.clone() };
    let back = read(ply::write_cloud(&bare, &Additions::default(), false).unwrap()).unwrap();
    assert_eq!(back.properties, ["x", "y", "z"]);
    for wrong in [
        PointCloud { colors: Some(vec![0; 5]), ..cloud.clone() },
        PointCloud { intensity: Some(vec![0.0; 4]), ..cloud.clone() },
        PointCloud { normals: Some(vec![0.0; 8]), ..cloud.clone() },
        PointCloud { positions: vec![0.0; 10], ..cloud.clone() },
    ] {
        assert!(matches!(ply::write_cloud(&wrong, &Additions::default(), false), Err(Error::Input(_))));
    }
}

// Hostile input

/// xorshift64*
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() >> 11) as usize % limit.max(1)
    }
}

#[test]
fn damaged_files_end_in_a_result_or_an_error() {
    let mut seeds: Vec<Vec<u8>> = [TEXT, LITTLE, BIG].map(rich).to_vec();
    let rows: Vec<Vec<V>> =
        (0..20).map(|i| vec![V::F64(1e6 + f64::from(i)), V::F64(2.0), V::F64(3.0), V::U8(9)]).collect();
    seeds.extend(in_all_formats(&["double x", "double y", "double z", "uchar red"], &rows));
    seeds.push(String::from_utf8_lossy(&rich(TEXT)).replace('\n', "\r").into_bytes());
    let words = [
        "0",
        "-1",
        "4294967295",
        "18446744073709551615",
        "1e9",
        "nan",
        "list",
        "float",
        "double",
        "uchar",
        "x",
        "\r",
        "\n",
    ];
    let mut random = Random(20_26);
    let mut accepted = 0;
    for round in 0..6000 {
        let mut file = seeds[round % seeds.len()].clone();
        for _ in 0..1 + random.below(3) {
            let at = random.below(file.len());
            match random.below(6) {
                0 => file.truncate(at),
                1 if !file.is_empty() => file[at] = random.next() as u8,
                2 if !file.is_empty() => file[at] ^= 1 << random.below(8),
                3 => {
                    // A word of the header, or of the text, becomes another one.
                    let word = words[random.below(words.len())];
                    let blank = |b: &u8| b.is_ascii_whitespace();
                    let start = file[..at].iter().rposition(blank).map_or(0, |i| i + 1);
                    let end = file[at..].iter().position(blank).map_or(file.len(), |i| at + i);
                    file.splice(start..end, word.bytes());
                }
                4 => {
                    let from = random.below(file.len());
                    let piece = file[from..file.len().min(from + random.below(40))].to_vec();
                    file.splice(at..at, piece);
                }
                _ => drop(file.drain(at..file.len().min(at + random.below(30)))),
            }
        }
        let Ok(cloud) = read(&file) else {
            continue;
        };
        accepted += 1;
        let normals = vec![0.5; cloud.positions.len()];
        for ascii in [false, true] {
            if let Ok(written) = write(&file, &normals, ascii) {
                let back = read(&written).unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(&file)));
                assert_eq!(back.normals.as_deref(), Some(&normals[..]));
            }
        }
        assert!(ply::write_cloud(&cloud, &Additions::default(), true).is_ok());
    }
    assert!(accepted > 500, "only {accepted} files were still good enough to test writing");
}
