//! Any cloud, written as a PLY file and read again.
#![no_main]

use arbitrary::{Result, Unstructured};
use bilinormal::ply::{Format, PointCloud};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    // An error means that the bytes do not tell a whole cloud.
    let _ = run(&mut Unstructured::new(bytes));
});

fn run(u: &mut Unstructured) -> Result<()> {
    let comments: Vec<String> = u.arbitrary()?;
    let flags: u8 = u.arbitrary()?;
    let origin: [f64; 3] = if flags & 1 > 0 { u.arbitrary()? } else { [0.0; 3] };
    let [normals, colors, intensity, curvature] = [1, 2, 3, 4].map(|bit| flags >> bit & 1 > 0);
    let count = u.int_in_range(0..=u.len() / 16)?;
    let mut floats =
        |width: usize| -> Result<Vec<f32>> { (0..width * count).map(|_| Ok(f32::from_bits(u.arbitrary()?))).collect() };
    let positions = floats(3)?;
    let normals = normals.then(|| floats(3)).transpose()?;
    let intensity = intensity.then(|| floats(1)).transpose()?;
    let curvature = curvature.then(|| floats(1)).transpose()?;
    let colors = colors.then(|| (0..4 * count).map(|_| u.arbitrary()).collect()).transpose()?;
    // What is not finite the package refuses.
    let origin = origin.map(|c| if c.is_finite() { c } else { 0.0 });
    let (format, properties) = (Format::Ascii, Vec::new());
    let cloud =
        PointCloud { positions, origin, normals, colors, intensity, format, properties, comments, viewpoint: None };
    laws::ply::roundtrip(&cloud, curvature.as_deref());
    Ok(())
}
