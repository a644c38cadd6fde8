//! What holds for every file, and for every cloud that is written.

#[path = "../../tests/reference/mod.rs"]
mod reference;

use crate::{Random, call, peak_of};
use bilinormal::ply::{self, Additions, Format, Next, PointCloud, ReadOptions, Rewrite, Stream};
use bilinormal::{Error, Progress};
use reference::{Element, Ply};

/// Of a file: the largest text of a number by the least bytes of one, and vectors that grow. And what a sample of the points
/// takes.
fn assert_fits(peak: usize, file: usize) {
    assert!(peak <= 100 * file + (1 << 20), "{peak} bytes for {file}");
}

/// The same number, or none either.
fn is_same_float(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

fn are_same_floats(a: &[f32], b: &[f32]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same_float(*a, *b))
}

fn are_same(a: &Option<Vec<f32>>, b: &Option<Vec<f32>>) -> bool {
    a.is_some() == b.is_some() && are_same_floats(a.as_deref().unwrap_or(&[]), b.as_deref().unwrap_or(&[]))
}

/// All but normals and how they are stored.
fn is_same_cloud(a: &PointCloud, b: &PointCloud) -> bool {
    are_same_floats(&a.positions, &b.positions)
        && are_same(&a.intensity, &b.intensity)
        && (a.origin, &a.colors, a.viewpoint) == (b.origin, &b.colors, b.viewpoint)
        && blank(&a.comments) == blank(&b.comments)
}

/// Texts as a writer keeps them: on one line.
fn blank(texts: &[String]) -> Vec<String> {
    texts.iter().map(|text| text.replace(['\n', '\r'], " ")).collect()
}

/// Reads a file in every way: with the same result.
pub fn read(file: &[u8]) -> Result<PointCloud, Error> {
    let mut random = Random::of(file);
    let all = |progress: &Progress| ply::read(file, &ReadOptions::default(), progress);
    let is_same = |a: &PointCloud, b: &PointCloud| {
        is_same_cloud(a, b)
            && are_same(&a.normals, &b.normals)
            && (a.format, &a.properties) == (b.format, &b.properties)
    };
    let (cloud, peak) = peak_of(|| call(&all, random.bits(), is_same));
    assert_fits(peak, file.len());
    match (&cloud, in_pieces(file, 512 + random.bits() as usize % 4096)) {
        (Ok(cloud), Ok(pieces)) => assert!(is_same(cloud, &pieces)),
        (whole, pieces) => assert_eq!(whole.as_ref().err(), pieces.err().as_ref()),
    }
    let cloud = match cloud {
        Err(error @ Error::Format { .. }) => {
            assert!(error.to_string().len() < 4000, "{error}");
            return Err(error);
        }
        other => other.unwrap(),
    };
    let count = cloud.len();
    assert_eq!(cloud.positions.len(), 3 * count);
    assert!(cloud.normals.as_ref().is_none_or(|normals| normals.len() == 3 * count));
    assert!(cloud.colors.as_ref().is_none_or(|colors| colors.len() == 4 * count));
    assert!(cloud.intensity.as_ref().is_none_or(|intensity| intensity.len() == count));
    assert!(cloud.origin.iter().chain(cloud.viewpoint.iter().flatten()).all(|c| c.is_finite()));
    let most = |most| ply::read(file, &ReadOptions { max_points: Some(most) }, &Progress::silent());
    assert!(is_same(&most(count as u64).unwrap(), &cloud));
    assert!(count == 0 || matches!(most(count as u64 - 1), Err(Error::Input(_))));
    Ok(cloud)
}

/// Reads a file in the pieces that are asked for, after its beginning.
fn in_pieces(file: &[u8], beginning: usize) -> Result<PointCloud, Error> {
    let mut stream = Stream::new(file.len() as u64, ReadOptions::default());
    let mut next = stream.take(&file[..beginning.min(file.len())], &Progress::silent())?;
    while let Next::Pieces { from, to, step } = next {
        for piece in file[from as usize..to as usize].chunks(step as usize) {
            next = stream.take(piece, &Progress::silent())?;
        }
    }
    let Next::Cloud(cloud) = next else { panic!("{next:?}") };
    Ok(cloud)
}

/// Writes a file again from pieces of it.
fn write_in_pieces(file: &[u8], piece: usize, add: &Additions, ascii: bool) -> Result<Vec<u8>, Error> {
    let mut rewrite = Rewrite::new(file.len() as u64, ascii);
    let pieces = file.chunks(piece).chain(file.is_empty().then_some(file));
    pieces
        .map(|piece| rewrite.take(piece, add, &Progress::silent()))
        .collect::<Result<Vec<_>, _>>()
        .map(|all| all.concat())
}

/// Reads what was written.
fn reread(file: &[u8]) -> PointCloud {
    ply::read(file, &ReadOptions::default(), &Progress::silent()).unwrap()
}

/// What properties may be called that a writer replaces.
const REPLACED: [&str; 7] = ["nx", "ny", "nz", "normal_x", "normal_y", "normal_z", "curvature"];

fn is_replaced(name: &str) -> bool {
    REPLACED.iter().any(|other| other.eq_ignore_ascii_case(name))
}

/// Writes a file again with normals and curvature, in every way: these come back, and all else is kept.
pub fn rewrite(file: &[u8]) {
    let mut random = Random::of(file);
    let cloud = read(file);
    let count = cloud.as_ref().map_or(0, PointCloud::len);
    // Few of any size: these take long to print.
    let mut number = || if random.below(16) == 0 { random.single() } else { random.signed() as f32 };
    let normals: Vec<f32> = (0..3 * count).map(|_| number()).collect();
    let curvature: Vec<f32> = (0..count).map(|_| number()).collect();
    let add = Additions { normals: Some(&normals), curvature: Some(&curvature) };
    let mut write = |file: &[u8], ascii| {
        let write = |progress: &Progress| ply::write(file, &add, ascii, progress);
        let (written, peak) = peak_of(|| call(&write, random.bits(), |a, b| a == b));
        assert_fits(peak, file.len() + 16 * count);
        assert_eq!(written, write_in_pieces(file, 512 + random.below(file.len() + 1), &add, ascii), "in pieces");
        written
    };
    let [binary, text] = [false, true].map(|ascii| write(file, ascii));
    let Ok(cloud) = cloud else { return };
    for (written, format) in [(&binary, Format::BinaryLittleEndian), (&text, Format::Ascii)] {
        let Ok(written) = written else { continue };
        let back = reread(written);
        assert_eq!(back.format, format);
        assert!(is_same_cloud(&cloud, &back), "{cloud:?} became {back:?}");
        assert!(are_same_floats(back.normals.as_ref().unwrap(), &normals));
        let kept = |cloud: &PointCloud| blank(&cloud.properties).into_iter().filter(|name| !is_replaced(name));
        assert!(kept(&cloud).eq(kept(&back)), "{:?} became {:?}", cloud.properties, back.properties);
    }
    // Only values that their type does not hold, and rows of elements that are not read, which text keeps.
    let text = text.unwrap();
    let Ok(binary) = binary else {
        assert!(cloud.format == Format::Ascii && matches!(binary, Err(Error::Format { .. })), "{binary:?}");
        return;
    };
    assert!(write(&binary, false).unwrap() == binary, "twice is once");
    // What a number is that is none, text does not tell.
    if cloud.format == Format::Ascii || !text.windows(3).any(|three| three == b"nan") {
        assert!(write(&text, false).unwrap() == binary, "through text");
    }
    compare(file, &cloud, &binary, &normals, &curvature);
}

/// The same by a second reader, which knows binary files with plain headers.
fn compare(file: &[u8], cloud: &PointCloud, binary: &[u8], normals: &[f32], curvature: &[f32]) {
    let header = file.windows(10).position(|ten| ten == b"end_header").map_or(0, |end| end + 10);
    let is_plain = |&byte: &u8| matches!(byte, b'\n' | b' '..=b'~');
    let has_blank = |name: &String| name.contains(' ');
    if cloud.format == Format::Ascii || !file[..header].iter().all(is_plain) || cloud.properties.iter().any(has_blank) {
        return;
    }
    let (before, after) = (Ply::parse(file), Ply::parse(binary));
    let except: Vec<&str> = cloud.properties.iter().map(String::as_str).filter(|name| is_replaced(name)).collect();
    before.assert_kept(&after, &[&except[..], &REPLACED].concat());
    let bits = |floats: &mut dyn Iterator<Item = f32>| floats.map(f32::to_bits).collect::<Vec<_>>();
    for (name, at) in [("nx", 0), ("ny", 1), ("nz", 2)] {
        let wanted = &mut normals.iter().skip(at).step_by(3).copied();
        assert_eq!(bits(&mut after.floats(name).into_iter()), bits(wanted), "{name}");
    }
    assert_eq!(bits(&mut after.floats("curvature").into_iter()), bits(&mut curvature.iter().copied()));
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        for (point, value) in coordinates(before.element("vertex"), name).into_iter().enumerate() {
            assert_position(cloud, point, axis, value);
        }
    }
}

fn coordinates(vertex: &Element, name: &str) -> Vec<f64> {
    let exact = vertex.properties.iter().find(|property| property.name == name && property.kind.len() == 1);
    let any = || vertex.properties.iter().find(|p| p.name.eq_ignore_ascii_case(name) && p.kind.len() == 1);
    let property = exact.or_else(any).unwrap();
    let number = |&bits: &u64| match &*property.kind[0] {
        "char" | "int8" => f64::from(bits as i8),
        "short" | "int16" => f64::from(bits as i16),
        "int" | "int32" => f64::from(bits as i32),
        "int64" => bits as i64 as f64,
        "float" | "float32" => f64::from(f32::from_bits(bits as u32)),
        "double" | "float64" => f64::from_bits(bits),
        _ => bits as f64,
    };
    property.values.iter().map(number).collect()
}

/// A coordinate is that of the file, rounded once when it is relative to the origin; finite ones stay so.
fn assert_position(cloud: &PointCloud, point: usize, axis: usize, value: f64) {
    let found = cloud.positions[3 * point + axis];
    let wanted = (value - cloud.origin[axis]) as f32;
    let wanted = if value.is_finite() { wanted.clamp(f32::MIN, f32::MAX) } else { wanted };
    assert!(found == wanted || found.is_nan() && wanted.is_nan(), "{value} less {} is {found}", cloud.origin[axis]);
}

/// Writes a cloud and reads it again.
pub fn roundtrip(cloud: &PointCloud, curvature: Option<&[f32]>) {
    let add = Additions { normals: None, curvature };
    for ascii in [false, true] {
        let back = reread(&ply::write_cloud(cloud, &add, ascii).unwrap());
        assert_eq!(back.format, if ascii { Format::Ascii } else { Format::BinaryLittleEndian });
        assert_eq!(back.len(), cloud.len());
        for (at, &position) in cloud.positions.iter().enumerate() {
            let axis = at % 3;
            assert_position(&back, at / 3, axis, f64::from(position) + cloud.origin[axis]);
        }
        assert!(are_same(&back.normals, &cloud.normals) && are_same(&back.intensity, &cloud.intensity));
        assert_eq!(back.colors, cloud.colors);
        let comments: Vec<String> = blank(&cloud.comments);
        assert!(back.comments.iter().eq(comments.iter().map(|text| text.trim_ascii())), "{comments:?}");
        assert_eq!(back.properties.contains(&"curvature".to_owned()), curvature.is_some());
    }
}
