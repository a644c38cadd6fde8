//! Accuracy on shapes whose normals are known.
#![cfg(not(target_arch = "wasm32"))]

mod common;

use bilinormal::{Cell, Estimate, Method, Options, Points, Progress, estimate};
use common::*;
use std::f64::consts::TAU;

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

/// As of millimetres taken for metres: however large, it is one cube, and one plane.
#[test]
fn a_cube_larger_than_the_cloud_is_the_plane_of_it_all() {
    let cloud = plane(1_000, 6, unit([1.0, -2.0, 3.0]));
    for size in [10.0, 500.0, 1e6, 1e30] {
        let result = run(&cloud.points, Cell::Size(size));
        assert_eq!((result.report.unresolved, result.report.cells), (0, 1), "{size}");
        let worst = worst(&angles(&result.normals, &cloud.normals));
        assert!(worst < 0.01, "{size}: {worst} degrees");
    }
}

/// The surface variation of a small disc of radius a: a^2 / 24 on the unit sphere, a^2 / 32 on a cylinder of radius 1.
#[test]
fn curvature_of_the_nearest_points_is_that_of_discs() {
    const COUNT: usize = 200_000;
    let (k, height) = (200, 4.0);
    let mut random = Random(31);
    let cylinder = Cloud::of((0..COUNT).map(|_| {
        let (sin, cos) = (TAU * random.unit()).sin_cos();
        ([cos, sin, height * (random.unit() - 0.5)], [cos, sin, 0.0])
    }));
    let share = f64::from(k) / COUNT as f64;
    for (name, cloud, expected) in [
        ("sphere", sphere(COUNT, 30), share * 4.0 / 24.0),
        ("cylinder", cylinder, share * 2.0 * height / 32.0),
        ("plane", plane(COUNT, 32, unit([1.0, -2.0, 3.0])), 0.0),
    ] {
        let options = Options { method: Method::Knn, k: Some(k), curvature: true, ..Options::default() };
        let curvature = run_with(&Points::from_f32(&cloud.points).unwrap(), &options).curvature.unwrap();
        let mean = curvature.iter().map(|c| f64::from(*c)).sum::<f64>() / COUNT as f64;
        println!("{name}: mean {mean:.3e}, {expected:.3e} expected");
        assert!((mean - expected).abs() < 0.03 * expected + 1e-7, "{name}: {mean}, {expected} expected");
    }
}

/// That of the 27 cubes: on the unit sphere about that of a square of three edges, s^2 / 60, or more where it is slanted;
/// nothing on faces, much at edges.
#[test]
fn curvature_of_cubes() {
    let curvature = |cloud: &Cloud| {
        let options = Options { cell: Cell::Scale(1.0), curvature: true, ..Options::default() };
        let result = run_with(&Points::from_f32(&cloud.points).unwrap(), &options);
        (result.curvature.unwrap(), result.report.cell_size)
    };
    let mean = |values: &mut dyn Iterator<Item = f32>| {
        let (count, sum) = values.fold((0, 0.0), |(count, sum), value| (count + 1, sum + f64::from(value)));
        sum / f64::from(count)
    };
    let (round, edge) = curvature(&sphere(200_000, 33));
    let square = (3.0 * edge).powi(2) / 60.0;
    let ratio = mean(&mut round.into_iter()) / square;
    println!("sphere: {ratio:.2} of that of a square");
    assert!((1.0..2.0).contains(&ratio), "{ratio}");

    let (flat, _) = curvature(&plane(200_000, 34, unit([1.0, -2.0, 3.0])));
    assert!(flat.iter().all(|value| *value < 1e-6), "{}", flat.into_iter().fold(0.0, f32::max));

    // Before it is turned: how far the second largest coordinate lies from an edge.
    let mut random = Random(35);
    let (points, distances): (Vec<_>, Vec<_>) = (0..200_000)
        .map(|_| {
            let (s, t) = (random.signed(), random.signed());
            let face = (random.unit() * 6.0) as usize;
            let mut point = [s, t, if face < 3 { 1.0 } else { -1.0 }];
            point.rotate_left(face % 3);
            ((turn(point), [0.0; 3]), 1.0 - s.abs().max(t.abs()))
        })
        .unzip();
    let (values, edge) = curvature(&Cloud::of(points.into_iter()));
    let all = values.iter().copied().zip(distances);
    let at_edges = mean(&mut all.clone().filter(|(_, d)| *d < 0.5 * edge).map(|(value, _)| value));
    let inside = mean(&mut all.filter(|(_, d)| *d > 4.0 * edge).map(|(value, _)| value));
    println!("cube: {at_edges:.4} at edges, {inside:.1e} inside");
    assert!(at_edges > 0.03 && inside < 1e-6, "{at_edges} at edges, {inside} inside");
}

#[test]
fn a_regular_grid_on_a_plane() {
    let points: Vec<f32> = (0..10_000).flat_map(|i| [(i % 100) as f32, (i / 100) as f32, 5.0]).collect();
    for cell in [Cell::Scale(2.0), Cell::Size(1.0), Cell::Size(2.5)] {
        let result = run(&points, cell);
        for normal in result.normals.chunks(3) {
            assert_eq!(normal, [0.0, 0.0, 1.0], "{cell:?}");
        }
    }
    for normal in run(&points, Cell::Auto).normals.chunks(3) {
        assert!(normal[0].abs().max(normal[1].abs()) < 1e-6 && (normal[2] - 1.0).abs() < 1e-6, "{normal:?}");
    }
}

/// About 32 points in an occupied cube, whatever the shape of the cloud.
#[test]
fn auto_begins_with_evenly_filled_cubes() {
    // Askew: cubes along a plane hold whole slices of it.
    let flat = plane(50_000, 7, turn([0.0, 0.0, 1.0]));
    let mut strays = sphere(50_000, 8).points;
    strays.extend((0..200).map(|i| if i % 2 == 0 { 1e6 } else { -3e5 * i as f32 }).take(198));
    let mut random = Random(9);
    let volume: Vec<f32> = (0..150_000).map(|_| random.signed() as f32).collect();
    let distant: Vec<f32> =
        [0.0, 5000.0].iter().flat_map(|shift| sphere(20_000, 10).points.into_iter().map(move |c| c + shift)).collect();
    for (name, points) in [
        ("sphere", sphere(100_000, 11).points),
        ("few points", sphere(2000, 12).points),
        ("plane", flat.points),
        ("torus", torus(100_000, 13).points),
        ("sphere with strays", strays),
        ("volume", volume),
        ("two distant spheres", distant),
    ] {
        // Fixed cubes of the same edge tell how many are occupied.
        let report = run(&points, Cell::Size(run(&points, Cell::Auto).report.cell_size)).report;
        let filling = report.points as f64 / report.cells as f64;
        assert!((22.0..46.0).contains(&filling), "{name}: {filling} points a cube");
    }
}

/// Small clouds begin with fewer points a cube.
#[test]
fn auto_follows_what_has_few_points() {
    for (count, bound) in [(50, 9.0), (200, 3.0), (1000, 0.6)] {
        let cloud = sphere(count, 12);
        let error = |estimate: Estimate| root_mean_square(&angles(&estimate.normals, &cloud.normals));
        let nearest = error(run_knn(&cloud.points, 10));
        let error = error(run(&cloud.points, Cell::Auto));
        println!("{count} points: {error} degrees, of 10 nearest neighbours {nearest}");
        assert!(error < bound && error < 0.75 * nearest, "{count} points: {error} degrees against {nearest}");
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
