//! Accuracy on shapes whose normals are known.
#![cfg(not(target_arch = "wasm32"))]

mod common;

use bilinormal::{Cell, Options, Points, Progress, estimate};
use common::*;

/// The paper's own experiment: spheres at 1.0 L. It reports a mean deviation |n - n_true| below 0.0065.
#[test]
fn spheres_of_the_paper() {
    let mut previous = 0.0033;
    for count in [187_500, 375_000, 750_000, 1_500_000, 3_000_000] {
        let cloud = sphere(count, 1);
        let result = run(&cloud.points, Cell::Scale(1.0));
        let angles = angles(&result.normals, &cloud.normals);
        let deviations = angles.iter().map(|a| 2.0 * (a.to_radians() / 2.0).sin());
        let mean = deviations.sum::<f64>() / count as f64;
        assert!(mean < previous, "{count} points: mean deviation {mean}, before {previous}");
        assert!(worst(&angles) < 2.0, "{count} points: worst angle {}", worst(&angles));
        previous = mean;
        let report = result.report;
        println!(
            "{count} points: mean deviation {mean:.5}, worst {:.2} degrees, nodes {:?}",
            worst(&angles),
            report.nodes_used
        );
        assert_eq!(report.nodes_used.iter().sum::<u64>(), count as u64);
        assert!(report.nodes_used[4] > 75 * count as u64 / 100, "{:?}", report.nodes_used);
        assert_eq!(report.unresolved, 0);
    }
}

#[test]
fn auto_on_smooth_shapes() {
    for (name, cloud, bound) in [
        ("sphere", sphere(200_000, 2), 0.16),
        ("torus of uneven density", torus(200_000, 3), 0.8),
        ("terrain", terrain(200_000, 4), 0.5),
        ("cube with sharp edges", cube(200_000, 5), 8.2),
    ] {
        let result = run(&cloud.points, Cell::Auto);
        let error = root_mean_square(&angles(&result.normals, &cloud.normals));
        assert!(error < bound, "{name}: {error} degrees");
        assert!(result.report.unresolved < 100, "{name}: {} unresolved", result.report.unresolved);
    }
}

/// A fast eigenvector must not stumble over exact planes (a known failure elsewhere).
#[test]
fn planes_are_exact() {
    for normal in [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], unit([1.0, 1.0, 0.0]), unit([1.0, -2.0, 3.0])] {
        let cloud = plane(20_000, 6, normal);
        for cell in [Cell::Auto, Cell::Scale(2.0), Cell::Scale(3.0), Cell::Size(0.1)] {
            let result = run(&cloud.points, cell);
            assert_eq!(result.report.unresolved, 0, "{normal:?} {cell:?}");
            let worst = worst(&angles(&result.normals, &cloud.normals));
            assert!(worst < 0.01, "{normal:?} {cell:?}: {worst} degrees");
        }
    }
}

#[test]
fn a_regular_grid_on_a_plane() {
    let points: Vec<f32> = (0..10_000).flat_map(|i| [(i % 100) as f32, (i / 100) as f32, 5.0]).collect();
    for cell in [Cell::Auto, Cell::Scale(2.0), Cell::Size(1.0), Cell::Size(2.5)] {
        let result = run(&points, cell);
        for normal in result.normals.chunks(3) {
            assert_eq!(normal, [0.0, 0.0, 1.0], "{cell:?}");
        }
    }
}

/// About 4 points in an occupied cube, whatever the shape of the cloud.
#[test]
fn auto_fills_cubes_evenly() {
    let flat = plane(50_000, 7, [0.0, 0.0, 1.0]);
    let mut strays = sphere(50_000, 8).points;
    strays.extend((0..200).map(|i| if i % 2 == 0 { 1e6 } else { -3e5 * i as f32 }).take(198));
    let mut random = Random(9);
    let volume: Vec<f32> = (0..150_000).map(|_| random.signed() as f32).collect();
    let distant: Vec<f32> =
        [0.0, 5000.0].iter().flat_map(|shift| sphere(20_000, 10).points.into_iter().map(move |c| c + shift)).collect();
    for (name, points) in [
        ("sphere", sphere(100_000, 11).points),
        ("few points", sphere(200, 12).points),
        ("plane", flat.points),
        ("torus", torus(100_000, 13).points),
        ("sphere with strays", strays),
        ("volume", volume),
        ("two distant spheres", distant),
    ] {
        let report = run(&points, Cell::Auto).report;
        let filling = report.points as f64 / report.cells as f64;
        assert!((2.8..5.7).contains(&filling), "{name}: {filling} points a cube");
    }
}

#[test]
fn auto_counts_coinciding_points_once() {
    let cloud = sphere(50_000, 14);
    let once = run(&cloud.points, Cell::Auto).report.cell_size;
    let thrice = run(&cloud.points.repeat(3), Cell::Auto).report.cell_size;
    assert!((thrice / once - 1.0).abs() < 0.1, "{thrice} against {once}");
}

/// Survey coordinates: half a million metres east, five million north.
#[test]
fn double_precision_far_from_the_origin() {
    let cloud = sphere(50_000, 15);
    let shift = [500_000.0, 5_000_000.0, 100.0];
    let far: Vec<f64> = cloud.points.iter().zip(shift.iter().cycle()).map(|(c, s)| f64::from(*c) + s).collect();
    let far = Points::from_f64(&far).unwrap();
    assert!(far.origin().iter().zip(shift).all(|(origin, shift)| (origin - shift).abs() < 1.0));
    let far = estimate(&far, &Options::default(), &Progress::silent()).unwrap();
    let near = run(&cloud.points, Cell::Auto);
    assert!((far.report.cell_size / near.report.cell_size - 1.0).abs() < 0.01);
    let (far, near) = (angles(&far.normals, &cloud.normals), angles(&near.normals, &cloud.normals));
    assert!(root_mean_square(&far) < 1.01 * root_mean_square(&near));
}
