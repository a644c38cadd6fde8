//! Real and odd files, where they are there: in the folder that `BILINORMAL_DATA` names, or in `../shared/data` beside the
//! project, with manifests. (None of them is part of the project.)

mod reference;

use bilinormal::ply::{self, Additions, ReadOptions};
use bilinormal::{Error, Progress};
use reference::Ply;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

/// What reading a file must give.
#[derive(Clone, Copy, Debug)]
enum Wanted {
    Points(usize),
    /// An error whose text holds this.
    Error(&'static str),
}
use Wanted::{Error as Fails, Points};

/// What a good reader does with each odd file, where the manifest's number of points does not say it.
const ODD: [(&str, Wanted); 43] = [
    ("PDAL__no_vertex.ply", Fails("no elements")),
    ("PDAL__unsized_dims.ply", Fails("no x y z")),
    ("assimp__ant-half.ply", Fails("of 912 rows of element face")),
    ("assimp__crash-30d6d0f7c529b3b66b4131700b7a4580cd7082df.ply", Fails("line ")),
    ("ply-rs__all_atomic_types_ok_ascii.ply", Fails("no element vertex; it has point 1: char a, int8 b")),
    ("ply-rs__exponent_values_ok_ascii.ply", Fails("no element vertex")),
    ("ply-rs__header_min_ok_ascii.ply", Fails("no elements")),
    ("ply-rs__single_elements_err_ascii.ply", Fails("no element vertex")),
    ("made_all_nan_le.ply", Points(3)),
    ("made_blank_lines_ascii.ply", Points(5)),
    ("made_bom_utf8.ply", Points(5)),
    ("made_comment_end_header.ply", Points(5)),
    ("made_comments_odd_bytes.ply", Points(5)),
    ("made_count_not_number.ply", Fails("line 3: 'element vertex five'")),
    ("made_count_overflow_stride.ply", Fails("after 5 of 1537228672809129302 rows")),
    ("made_count_overflow_u64.ply", Fails("after 5 of 18446744073709551615 rows")),
    ("made_cr_only_ascii.ply", Points(5)),
    ("made_cr_only_header_le.ply", Points(5)),
    ("made_crheader_body_starts_0a.ply", Points(1)),
    ("made_crlf_ascii.ply", Points(5)),
    ("made_decimal_comma.ply", Fails("'0,5' is not a number; wanted a decimal point")),
    ("made_duplicate_vertex_element.ply", Fails("line 7: a second element named vertex")),
    ("made_duplicate_x.ply", Fails("x of element vertex is declared twice")),
    ("made_extra_columns_ascii.ply", Fails("line 8: 5 values, the header declares 3")),
    ("made_format_unknown.ply", Fails("line 2: 'format binary_middle_endian 1.0'")),
    ("made_gzip_named_ply.ply", Fails("gzip file; unpack it first")),
    ("made_huge_count_ascii.ply", Fails("after 5 of 4000000000 rows")),
    ("made_huge_count_le.ply", Fails("after 5 of 4294967295 rows")),
    ("made_huge_list_count.ply", Fails("none past the end of the file")),
    ("made_int64_type.ply", Points(1)),
    ("made_magic_PLY_upper.ply", Points(5)),
    ("made_magic_missing.ply", Fails("wanted 'ply' as the first line")),
    ("made_negative_count.ply", Fails("line 3: 'element vertex -5'")),
    ("made_no_vertex_element.ply", Fails("no element vertex; it has point 2: float x, float y, float z")),
    ("made_property_before_element.ply", Fails("line 3: a property before the first element")),
    ("made_stl_named_ply.ply", Fails("an STL file")),
    ("made_truncated_ascii.ply", Fails("line 12: 1 value, the header declares 3")),
    ("made_truncated_header.ply", Fails("no end_header")),
    ("made_truncated_in_list.ply", Fails("element face")),
    ("made_truncated_le.ply", Fails("after 4 of 5 rows")),
    ("made_unknown_type.ply", Fails("float128")),
    ("made_utf16.ply", Fails("UTF-16")),
    ("made_zero_vertices.ply", Points(0)),
];

/// Files whose rows hold more than their header declares, so that only text can keep them.
const TEXT_ONLY: [&str; 2] = ["trimesh__fuze_ascii.ply", "made_int_ascii_float_values.ply"];

fn data(folder: &str) -> Option<PathBuf> {
    let all = env::var("BILINORMAL_DATA").unwrap_or("../shared/data".into());
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(all).join(folder);
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: no folder {}", path.display());
    None
}

/// Name and number of points of each PLY file of a manifest.
fn manifest(folder: &Path) -> Vec<(String, Option<usize>)> {
    let text = fs::read_to_string(folder.join("MANIFEST.tsv")).unwrap();
    let mut rows = text.lines().map(|line| line.split('\t').collect::<Vec<_>>());
    assert_eq!(rows.next().unwrap()[..3], ["file", "format", "points"]);
    let rows = rows.filter(|row| row[0].contains(".ply"));
    rows.map(|row| (row[0].to_owned(), row[2].parse().ok())).collect()
}

fn read(file: &[u8]) -> Result<ply::PointCloud, Error> {
    ply::read(file, &ReadOptions::default(), &Progress::silent())
}

/// Writes the file again with normals, in both formats, and checks that nothing else has changed.
fn check_writing(name: &str, file: &[u8], points: usize) {
    let normals: Vec<f32> = (0..3 * points).map(|i| (i as f32 * 0.37).sin()).collect();
    let add = Additions { normals: Some(&normals), curvature: None };
    for ascii in [false, true] {
        if ascii && points > 120_000 {
            // Text of that size takes long in a build without optimisation, and says nothing new.
            continue;
        }
        let written = match ply::write(file, &add, ascii, &Progress::silent()) {
            Ok(written) => written,
            Err(error) => {
                assert!(TEXT_ONLY.contains(&name) && !ascii, "{name}: {error}");
                assert!(error.to_string().ends_with("; the output can keep it only as ASCII"), "{name}: {error}");
                continue;
            }
        };
        let cloud = read(&written).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(cloud.normals.as_deref(), Some(&normals[..]), "{name}");
        if TEXT_ONLY.contains(&name) {
            continue;
        }
        let after = Ply::parse(&written);
        for (axis, component) in ["nx", "ny", "nz"].into_iter().enumerate() {
            let wanted: Vec<f32> = normals.iter().skip(axis).step_by(3).copied().collect();
            assert!(after.floats(component) == wanted, "{name}: {component}");
        }
        Ply::parse(file).assert_kept(&after, &["nx", "ny", "nz"]);
    }
}

#[test]
fn every_odd_file_ends_in_a_result_or_a_clear_error() {
    let Some(folder) = data("odd") else { return };
    for (name, points) in manifest(&folder) {
        let file = fs::read(folder.join(&name)).unwrap();
        let listed = ODD.iter().find(|(other, _)| *other == name).map(|(_, wanted)| *wanted);
        let wanted = listed.or(points.map(Points)).unwrap_or_else(|| panic!("{name}: what is wanted?"));
        match (read(&file), wanted) {
            (Ok(cloud), Points(points)) => {
                assert_eq!(cloud.len(), points, "{name}");
                check_writing(&name, &file, points);
            }
            (Err(error), Fails(part)) => {
                assert!(matches!(error, Error::Format { .. }), "{name}: {error}");
                assert!(error.to_string().contains(part), "{name}: {error}");
                let write = ply::write(&file, &Additions::default(), false, &Progress::silent());
                assert!(write.is_err(), "{name}");
            }
            (outcome, wanted) => panic!("{name}: wanted {wanted:?}, got {:?}", outcome.map(|cloud| cloud.len())),
        }
    }
}

#[test]
fn every_scan_is_read_and_written_again() {
    let Some(folder) = data("scans") else { return };
    for (name, points) in manifest(&folder) {
        let path = folder.join(&name);
        let file = if name.ends_with(".gz") {
            let Ok(output) = Command::new("gzip").arg("-dc").arg(&path).output() else {
                println!("skipped: {name} needs gzip");
                continue;
            };
            output.stdout
        } else {
            fs::read(&path).unwrap()
        };
        let points = points.unwrap();
        if name == "gs_biker.compressed.ply" {
            let error = read(&file).unwrap_err().to_string();
            assert!(error.contains("Gaussian splat file with packed positions"), "{error}");
            continue;
        }
        let cloud = read(&file).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(cloud.len(), points, "{name}");
        check_writing(&name, &file, points);
    }
}

#[test]
fn survey_coordinates_keep_their_millimetres() {
    let Some(folder) = data("scans") else { return };
    let file = fs::read(folder.join("las_autzen_trim.ply")).unwrap();
    let cloud = read(&file).unwrap();
    assert!(cloud.origin.iter().any(|origin| *origin != 0.0));
    let source = Ply::parse(&file);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let column = source.element("vertex").properties.iter().find(|property| property.name == name).unwrap();
        for (point, bits) in column.values.iter().enumerate() {
            let wanted = f64::from_bits(*bits);
            let got = cloud.origin[axis] + f64::from(cloud.positions[3 * point + axis]);
            assert!((got - wanted).abs() < 1e-3, "{got} {wanted}");
        }
    }
}
