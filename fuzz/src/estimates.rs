//! What holds for every estimate.

use crate::clouds::Cloud;
use crate::{call, peak_of};
use bilinormal::{Cell, Error, Estimate, Method, Options, Orient, Points, Progress, estimate, estimate_owned};

/// Estimates in every way, and checks what comes of it against the documentation. `stop` tells where a call is stopped.
pub fn check(cloud: &Cloud, options: &Options, stop: u64) {
    // What only some signs have is not asked of others.
    let signs = matches!(options.orient, Orient::Consistent | Orient::Outward);
    let options = &Options { components: options.components && signs, ..options.clone() };
    let points = cloud.coordinates();
    let run = |progress: &Progress| estimate(&cloud.points(), options, progress);
    let (result, peak) = peak_of(|| call(&run, stop, |a, b| a == b));
    assert!(peak <= (40 << 20) + 700 * points.len(), "{peak} bytes for {} points", points.len());
    let result = match result {
        Err(Error::Input(message)) if options.validate().is_err() || matches!(options.cell, Cell::Size(_)) => {
            assert!(message.contains("wanted"), "{message}");
            return;
        }
        result => result.unwrap(),
    };
    assert_eq!(estimate_owned(cloud.owned(), options, &Progress::silent()).as_ref(), Ok(&result), "given away");
    normals(&points, &result, options);
    report(&points, &result, options);
    signs_of(&cloud.points(), &points, &result, options);
}

fn of(result: &Estimate) -> &[[f32; 3]] {
    result.normals.as_chunks().0
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

/// Unit vectors, or zero where there is no plane.
fn normals(points: &[[f64; 3]], result: &Estimate, options: &Options) {
    assert_eq!(result.normals.len(), 3 * points.len());
    let finite: Vec<&[f64; 3]> = points.iter().filter(|p| p.iter().all(|c| c.is_finite())).collect();
    let is_same = |axis: usize| finite.iter().all(|p| p[axis] == finite[0][axis]);
    let is_line = [0, 1, 2].into_iter().filter(|&axis| is_same(axis)).count() > 1;
    for (point, &normal) in points.iter().zip(of(result)) {
        let n = normal.map(f64::from);
        let length = dot(n, n).sqrt();
        assert!(normal == [0.0; 3] || (length - 1.0).abs() < 1e-4, "{normal:?} at {point:?}");
        assert!(normal.iter().all(|c| c.to_bits() != (-0.0f32).to_bits()), "{normal:?} at {point:?}");
        assert!(normal == [0.0; 3] || !is_line && point.iter().all(|c| c.is_finite()), "{normal:?} at {point:?}");
        assert!(options.orient != Orient::None || dot(n, [1.0, 2.0, 4.0]) > -1e-5, "{normal:?} at {point:?}");
    }
    assert_eq!(result.curvature.is_some(), options.curvature);
    for (curvature, &normal) in result.curvature.iter().flatten().zip(of(result)) {
        assert!((0.0..=1.0 / 3.0).contains(curvature), "{curvature}");
        assert!(*curvature == 0.0 || normal != [0.0; 3], "{curvature} without a normal");
    }
    assert!(result.curvature.as_ref().is_none_or(|curvature| curvature.len() == points.len()));
}

/// The numbers add up.
fn report(points: &[[f64; 3]], result: &Estimate, options: &Options) {
    let report = &result.report;
    let count = points.len() as u64;
    assert_eq!(report.points, count);
    assert_eq!(report.unresolved, of(result).iter().filter(|normal| **normal == [0.0; 3]).count() as u64);
    assert_eq!(report.nodes_used.iter().sum::<u64>(), count, "{report:?}");
    let is_adaptive = options.method == Method::Bilinear && options.cell == Cell::Auto;
    assert_eq!(report.noise.is_some(), is_adaptive, "{report:?}");
    if options.method != Method::Bilinear {
        assert_eq!((report.cells, report.nodes, report.grid), (0, 0, [0; 3]), "{report:?}");
        assert_eq!((report.cell_size, report.scale), (0.0, 0.0), "{report:?}");
        assert_eq!(report.nodes_used[0], count, "{report:?}");
        return;
    }
    let most = if is_adaptive { 1 << 22 } else { 1 << 30 };
    assert!(report.nodes <= report.cells && report.cells <= count, "{report:?}");
    assert!(report.grid.iter().all(|cubes| (1..=most).contains(cubes)), "{report:?}");
    let is_size = |size: f64| size > 0.0 && size.is_finite();
    assert!(is_size(report.cell_size) && is_size(report.scale), "{report:?}");
    assert!(report.noise.is_none_or(|noise| (0.0..f64::INFINITY).contains(&noise)), "{report:?}");
    assert!(report.scales.iter().all(|scale| is_size(scale.cell_size) && scale.points > 0), "{report:?}");
    assert!(report.scales.is_sorted_by(|a, b| a.cell_size < b.cell_size), "{report:?}");
    assert!(report.scales.iter().map(|scale| scale.points).sum::<u64>() <= count, "{report:?}");
}

/// Signs change signs only, but where noise makes means of normals, and are those that were asked for.
fn signs_of(points: &Points, coordinates: &[[f64; 3]], result: &Estimate, options: &Options) {
    let plain = Options { orient: Orient::None, components: false, ..options.clone() };
    let plain = estimate(points, &plain, &Progress::silent()).unwrap();
    let surfaces = matches!(options.orient, Orient::Consistent | Orient::Outward);
    let are_means = surfaces && options.method == Method::Bilinear && options.cell == Cell::Auto;
    for (&a, &b) in of(result).iter().zip(of(&plain)) {
        let is_known = [a, b].map(|normal| normal != [0.0; 3]);
        assert!(
            if are_means { is_known[0] == is_known[1] } else { a == b || a.map(|c| 0.0 - c) == b },
            "{a:?} of {b:?}"
        );
    }
    for (point, normal) in coordinates.iter().zip(of(result)) {
        let towards = match options.orient {
            Orient::Up(up) => up,
            Orient::Viewpoint(viewpoint) => [0, 1, 2].map(|i| viewpoint[i] - point[i]),
            _ => break,
        };
        let longest = towards.iter().fold(0.0, |longest: f64, c| longest.max(c.abs()));
        // Doubles are seen from their middle, and may be too near to the viewpoint to tell.
        let is_sure = matches!(options.orient, Orient::Up(_)) || points.origin() == [0.0; 3];
        let side = dot(towards.map(|c| c / longest), normal.map(f64::from));
        assert!(!is_sure || side > -1e-6 || !side.is_finite(), "{normal:?} at {point:?}");
    }
    assert_eq!(result.components.is_some(), options.components);
    assert_eq!(result.report.components.is_some(), surfaces);
    let Some(told) = &result.report.components else { return };
    assert_eq!(told.largest.len() as u64, told.count.min(1000));
    assert!(told.largest.is_sorted_by(|a, b| a.points >= b.points), "{told:?}");
    assert!(told.largest.iter().all(|component| (0.0..=1.0).contains(&component.confidence)), "{told:?}");
    let mut sizes = vec![0u64; told.count as usize];
    for (&component, &normal) in result.components.iter().flatten().zip(of(result)) {
        assert!(component == u32::MAX || normal != [0.0; 3], "a component without a normal");
        if let Some(size) = sizes.get_mut(component as usize) {
            *size += 1;
        } else {
            assert_eq!(component, u32::MAX);
        }
    }
    if options.components {
        assert!(sizes.is_sorted_by(|a, b| a >= b) && sizes.iter().all(|size| *size > 0), "{sizes:?}");
        assert!(
            told.largest.iter().zip(&sizes).all(|(component, size)| component.points == *size),
            "{told:?} {sizes:?}"
        );
    }
}
