//! `Cell::Auto`: right for clean and noisy, smooth and sharp, without a parameter.
#![cfg(not(target_arch = "wasm32"))]

mod common;

use bilinormal::{Cell, Estimate};
use common::*;
use std::f64::consts::TAU;

fn errors(cloud: &Cloud) -> (Vec<f64>, Estimate) {
    let result = run(&cloud.points, Cell::Auto);
    (angles(&result.normals, &cloud.normals), result)
}

fn share_over(limit: f64, angles: &[f64]) -> f64 {
    angles.iter().filter(|angle| **angle > limit).count() as f64 / angles.len() as f64
}

/// Root mean squares in degrees, 200,000 points.
#[test]
fn smooth_and_sharp_clean_and_noisy() {
    for (name, cloud, bound) in [
        ("sphere", sphere(200_000, 2), 0.03),
        ("torus of uneven density", torus(200_000, 3), 0.06),
        ("terrain", terrain(200_000, 4), 0.2),
        ("cube", cube(200_000, 5), 0.85),
        ("sphere, noise 0.12 %", sphere(200_000, 2).noisy(0.0012, 6), 0.5),
        ("sphere, noise 0.6 %", sphere(200_000, 2).noisy(0.006, 7), 2.0),
        ("torus, noise 0.6 %", torus(200_000, 3).noisy(0.006, 7), 4.6),
        ("cube, noise 0.12 %", cube(200_000, 5).noisy(0.0012, 8), 6.8),
        ("cube, noise 0.6 %", cube(200_000, 5).noisy(0.006, 9), 14.9),
    ] {
        let (angles, result) = errors(&cloud);
        let error = root_mean_square(&angles);
        println!("{name}: {error} degrees, {} over 5", share_over(5.0, &angles));
        assert!(error < bound, "{name}: {error} degrees");
        assert_eq!(result.report.unresolved, 0, "{name}");
    }
}

#[test]
fn edges_are_sharp() {
    let (angles, _) = errors(&cube(200_000, 5));
    let share = share_over(5.0, &angles);
    assert!(share < 0.0005, "{share} of the points are off by more than 5 degrees");
}

/// Few cubes of a smooth surface with little noise are divided, and few of one with more noise more than once, because that would
/// cost several times as much and find no better normals; those of two shells are, though both look as thick.
#[test]
fn noise_is_not_divided_and_two_shells_are() {
    let points_in_a_cube = |cloud: &Cloud| {
        let report = run(&cloud.points, Cell::Auto).report;
        report.points as f64 / report.cells as f64
    };
    for (share, least) in [(0.0012, 20.0), (0.006, 5.0)] {
        let many = points_in_a_cube(&sphere(100_000, 8).noisy(share, 9));
        println!("{share}: {many} points in a cube");
        assert!(many > least, "{share}: {many}");
    }
    let mut shells = sphere(100_000, 8);
    shells.points.chunks_exact_mut(3).step_by(2).for_each(|point| point.iter_mut().for_each(|c| *c *= 1.035));
    let few = points_in_a_cube(&shells);
    assert!(few < 4.0, "{few}");
}

/// Two flat sheets, a hundredth of their width apart: twice what lies between the points.
#[test]
fn thin_walls_do_not_mix() {
    let mut cloud = plane(100_000, 10, [0.0, 0.0, 1.0]);
    cloud.points.chunks_exact_mut(3).step_by(2).for_each(|point| point[2] += 0.02);
    let (angles, _) = errors(&cloud);
    let (error, share) = (root_mean_square(&angles), share_over(1.0, &angles));
    assert!(error < 0.4 && share < 0.008, "{error} degrees, {share} of the points are off by more than a degree");
}

#[test]
fn crossing_sheets_mix_only_where_they_cross() {
    let mut cloud = plane(100_000, 10, [0.0, 0.0, 1.0]);
    for (i, point) in cloud.points.chunks_exact_mut(3).enumerate() {
        point[2] = if i % 2 == 0 { 0.0 } else { 0.02 + 0.3 * point[0] };
    }
    cloud.normals.iter_mut().skip(1).step_by(2).for_each(|normal| *normal = unit([-0.3, 0.0, 1.0]));
    let (angles, _) = errors(&cloud);
    let share = share_over(1.0, &angles);
    assert!(share < 0.06, "{share} of the points are off by more than a degree");
}

#[test]
fn the_report_tells_noise_and_scales() {
    for share in [0.0, 0.0012, 0.006] {
        let cloud = if share == 0.0 { sphere(100_000, 11) } else { sphere(100_000, 11).noisy(share, 12) };
        let report = run(&cloud.points, Cell::Auto).report;
        let expected = share * 2.0 * 3f64.sqrt();
        let noise = report.noise.unwrap();
        println!("noise {noise}, {expected} expected");
        assert!((noise - expected).abs() <= 2e-4 + 0.06 * expected, "{noise} instead of {expected}");
        assert_eq!(report.scales.iter().map(|scale| scale.points).sum::<u64>(), report.points);
        assert!(report.scales.is_sorted_by(|a, b| 1.99 * a.cell_size < b.cell_size), "{:?}", report.scales);
    }
    // What lies between two walls is none, though the cubes that are divided for them take it for that.
    let mut walls = plane(100_000, 10, [0.0, 0.0, 1.0]);
    walls.points.chunks_exact_mut(3).step_by(2).for_each(|point| point[2] += 0.04);
    let noise = run(&walls.points, Cell::Auto).report.noise.unwrap();
    assert!(noise < 2e-4, "{noise}");
    // More noise asks for larger neighbourhoods.
    let typical = |share| {
        let report = run(&sphere(100_000, 11).noisy(share, 12).points, Cell::Auto).report;
        report.scales.iter().max_by_key(|scale| scale.points).unwrap().cell_size
    };
    assert!(typical(0.012) > 1.3 * typical(0.0003));
    assert_eq!(run(&sphere(1000, 13).points, Cell::Scale(1.0)).report.noise, None);
}

/// A few points off the surface change little.
#[test]
fn outliers_are_ignored() {
    let mut cloud = sphere(100_000, 14);
    let mut random = Random(15);
    for point in cloud.points.chunks_exact_mut(3).step_by(50) {
        point.fill_with(|| random.signed() as f32);
    }
    let (angles, result) = errors(&cloud);
    let lengths = result.normals.chunks(3).map(|n| n.iter().map(|c| c * c).sum::<f32>());
    assert!(lengths.into_iter().all(|length| length == 0.0 || (length - 1.0).abs() < 1e-5));
    let error = |angles: Vec<f64>| {
        let on_surface = angles.into_iter().enumerate().filter(|(i, _)| i % 50 != 0).map(|(_, angle)| angle);
        root_mean_square(&on_surface.collect::<Vec<f64>>())
    };
    let nearest = error(common::angles(&run_knn(&cloud.points, 30).normals, &cloud.normals));
    let error = error(angles);
    assert!(error < 0.5 && error < 0.5 * nearest, "{error} degrees, of 30 nearest neighbours {nearest}");
}

/// Where single precision no longer tells the parts of cubes apart, still every point gets one normal.
#[test]
fn rough_clusters_far_apart() {
    let mut random = Random(16);
    let points: Vec<f32> = (0..60_000)
        .flat_map(|i| {
            let far = if i % 2 == 0 { 20_000.0 } else { -20_000.0 };
            // Ever denser towards the middle of each cluster, so that cubes are divided often.
            let size = (-9.0 * random.unit()).exp();
            [far + size * random.signed(), size * random.signed(), size * random.signed()].map(|c| c as f32)
        })
        .collect();
    let result = run(&points, Cell::Auto);
    let resolved =
        result.normals.chunks(3).filter(|n| (n.iter().map(|c| c * c).sum::<f32>() - 1.0).abs() < 1e-3).count();
    assert_eq!(resolved as u64 + result.report.unresolved, 60_000);
    assert_eq!(result.normals.chunks(3).filter(|n| n == &[0.0; 3]).count() as u64, result.report.unresolved);
}

/// Where most of the box is empty, cubes fit the objects and not the box.
#[test]
fn small_objects_far_apart() {
    for (count, apart) in [(2, 300.0), (2, 1000.0), (2, 10_000.0), (10, 100.0), (10, 1000.0)] {
        for points in [500, 2000] {
            let error = root_mean_square(&errors(&balls(count, points, |i| [apart * i as f64, 0.0, 0.0])).0);
            println!("{count} balls of {points} points, {apart} apart: {error} degrees");
            assert!(error < 2.0, "{count} balls of {points} points, {apart} apart: {error} degrees");
        }
    }
}

/// Further than cubes reach, and than single precision tells points of one from each other: the larger one, at the origin, is
/// whole.
#[test]
fn bodies_a_million_radii_apart() {
    for (near, far, place) in [(1400, 600, [3e6, 0.0, 0.0]), (1400, 600, [1e8; 3]), (6000, 5000, [1e6; 3])] {
        let (body, other) = (sphere(near, 23), sphere(far, 24));
        let points: Vec<f32> =
            body.points.iter().copied().chain(other.points.iter().enumerate().map(|(i, c)| c + place[i % 3])).collect();
        let result = run(&points, Cell::Auto);
        let error = root_mean_square(&angles(&result.normals[..3 * near], &body.normals));
        assert!(error < 3.0, "{near} and {far}: {error} degrees, {} unresolved", result.report.unresolved);
    }
}

/// Whatever cubes they share.
#[test]
fn a_few_points_of_a_plane_tell_it() {
    for count in 3..12 {
        for seed in 0..20 {
            let (angles, result) = errors(&plane(count, seed, [1.0, -2.0, 3.0]));
            assert!(
                worst(&angles) < 0.1,
                "{count} points, {seed}: {angles:?}, {} unresolved",
                result.report.unresolved
            );
        }
    }
}

/// What looks like one thick surface to large neighbourhoods is divided until it is seen what it is.
#[test]
fn thin_objects_are_no_noise() {
    let mut random = Random(17);
    let mut places: Vec<[f64; 3]> = Vec::new();
    while places.len() < 200 {
        places.push([(); 3].map(|()| 100.0 * random.unit()));
    }
    let mut astray = sphere(10_000, 18);
    for _ in 0..500 {
        astray.points.extend([(); 3].map(|()| (100.0 * random.gauss()) as f32));
    }
    for (name, cloud, bound) in [
        ("pipe", pipe(f64::INFINITY, 12_000), 3.0),
        ("ring", pipe(20.0, 7500), 2.5),
        ("larger ring", pipe(100.0, 63_000), 2.5),
        ("200 balls", balls(200, 150, |i| places[i]), 6.0),
        ("ball among stray points", astray, 1.0),
    ] {
        let normals = run(&cloud.points, Cell::Auto).normals;
        let error = root_mean_square(&angles(&normals[..3 * cloud.normals.len()], &cloud.normals));
        println!("{name}: {error} degrees");
        assert!(error < bound, "{name}: {error} degrees");
    }
}

/// Parts of a cube with a quarter of its points know less where noise is as wide as they are, so there are none.
#[test]
fn noise_is_not_divided() {
    let cloud = terrain(100_000, 15).noisy(0.006, 5);
    let (angles, result) = errors(&cloud);
    let error = root_mean_square(&angles);
    println!("{error} degrees, {} cubes", result.report.cells);
    assert!(error < 6.36 && result.report.cells < 10_000, "{error} degrees, {} cubes", result.report.cells);
}

/// Floors that are nearly level, and whatever else, of coordinates in steps of a third of the spacing and more.
#[test]
fn steps_of_rounded_coordinates_are_noise() {
    let slope = |degrees: f64| {
        plane(
            100_000,
            36,
            [0.8 * degrees.to_radians().sin(), 0.6 * degrees.to_radians().sin(), degrees.to_radians().cos()],
        )
    };
    for (name, cloud, steps) in [
        ("3 degrees", slope(3.0), [(0.0022, 0.05), (0.0044, 0.3), (0.0063, 1.0)]),
        ("10 degrees", slope(10.0), [(0.0022, 0.05), (0.0044, 0.05), (0.0088, 0.3)]),
        ("terrain", terrain(100_000, 37), [(0.0022, 0.9), (0.0044, 1.3), (0.0088, 2.5)]),
        ("sphere", sphere(100_000, 38), [(0.004, 0.2), (0.008, 0.4), (0.016, 1.3)]),
    ] {
        for (step, bound) in steps {
            let points = cloud.points.iter().map(|c| (c / step).round() * step).collect();
            let error = root_mean_square(&errors(&Cloud { points, normals: cloud.normals.clone() }).0);
            println!("{name}, {step}: {error} degrees");
            assert!(error < bound, "{name}, {step}: {error} degrees");
        }
    }
}

/// Waves shorter than the cubes that 'auto' begins with, ten point spacings.
#[test]
fn corrugations_are_no_noise() {
    let mut random = Random(22);
    let wave = TAU / 10.0;
    let cloud = Cloud::of((0..90_000).map(|i| {
        let [x, y] = [i % 300, i / 300].map(|place| f64::from(place) + random.unit());
        ([x, y, 2.0 * (wave * x).sin()], unit([-2.0 * wave * (wave * x).cos(), 0.0, 1.0]))
    }));
    let error = root_mean_square(&errors(&cloud).0);
    println!("corrugations {error} degrees");
    assert!(error < 10.5, "{error} degrees");
}

/// Each point several times, nearly in one place.
#[test]
fn copies_are_no_objects() {
    let mut cloud = sphere(10_000, 23);
    let mut random = Random(24);
    for i in 0..20_000 {
        let copy = [0, 1, 2].map(|axis| cloud.points[3 * i + axis] + 2e-6 * random.signed() as f32);
        cloud.points.extend(copy);
        cloud.normals.push(cloud.normals[i]);
    }
    let (angles, result) = errors(&cloud);
    assert_eq!(result.report.unresolved, 0);
    assert!(root_mean_square(&angles) < 0.5 && result.report.cell_size > 0.05, "{}", result.report.cell_size);
}

/// Its points lie along a line for all cubes but the smallest.
#[test]
fn a_strip_has_normals() {
    let mut random = Random(19);
    let points: Vec<f32> =
        (0..20_000).flat_map(|_| [30_000.0 * random.unit(), random.unit(), 0.0].map(|c| c as f32)).collect();
    assert_eq!(run(&points, Cell::Auto).report.unresolved, 0);
}

/// Thirty cables side by side, three point spacings in radius and two apart: from afar a thick noisy sheet.
#[test]
fn cables_are_no_noise() {
    let mut random = Random(22);
    let cables = Cloud::of((0..100_000).map(|i| {
        let (along, around) = (random.unit(), TAU * random.unit());
        let (out, up) = (around.cos(), around.sin());
        (turn([300.0 * along, 14.0 * f64::from(i % 30) + 5.0 * out, 5.0 * up]), turn([0.0, out, up]))
    }));
    let error = root_mean_square(&errors(&cables).0);
    assert!(error < 4.1, "{error} degrees");
}

/// Forty bars side by side, four point spacings wide, six high and four apart, clean and with noise of a third of a spacing.
#[test]
fn bars_are_no_noise() {
    for (noise, bound) in [(0.0, 23.0), (0.33, 33.0)] {
        let mut random = Random(28);
        let bars = Cloud::of((0..100_000).map(|i| {
            let [along, u, v] = [random.unit(), random.signed(), random.signed()];
            let end = if random.bits() & 1 == 0 { 1.0 } else { -1.0 };
            // Of 20 spacings round a bar 8 are above and below.
            let (out, up, normal) =
                if random.unit() < 0.4 { (u, end, [0.0, 0.0, end]) } else { (end, v, [0.0, end, 0.0]) };
            let place = [125.0 * along, 8.0 * f64::from(i % 40) + 2.0 * out, 3.0 * up];
            (turn(place.map(|c| c + noise * random.gauss())), turn(normal))
        }));
        let error = root_mean_square(&errors(&bars).0);
        println!("bars with noise of {noise}: {error} degrees");
        assert!(error < bound, "bars with noise of {noise}: {error} degrees");
    }
}

/// A board four point spacings thick, on its own a plane with noise to all but the smallest neighbourhoods: its rim is none.
#[test]
fn thin_boards_have_rims() {
    let (side, thick) = (150.0, 4.0);
    let mut random = Random(25);
    let board = Cloud::of((0..49_400).map(|i| {
        let end = if random.bits() & 1 == 0 { 1.0 } else { -1.0 };
        let [u, v] = [side * random.signed() / 2.0, random.signed() / 2.0];
        // In each 494 points 44 are on the rim, as many as its share of the area.
        match i % 494 {
            0..22 => (turn([side * end / 2.0, u, thick * v]), turn([end, 0.0, 0.0])),
            22..44 => (turn([u, side * end / 2.0, thick * v]), turn([0.0, end, 0.0])),
            _ => (turn([u, side * v, thick * end / 2.0]), turn([0.0, 0.0, end])),
        }
    }));
    let angles = errors(&board).0;
    let rim: Vec<f64> = (0..).zip(&angles).filter(|(i, _)| i % 494 < 44).map(|(_, &angle)| angle).collect();
    let (all, rim) = (root_mean_square(&angles), root_mean_square(&rim));
    println!("board {all}, its rim {rim} degrees");
    assert!(all < 6.8 && rim < 22.0, "{all}, at its rim {rim} degrees");
}

/// Tiles of 12 points before the edge between a floor and a wall of 20,000, askew of both: too few to spoil what these explain.
#[test]
fn small_bodies_before_an_edge_are_none_of_its_faces() {
    let mut random = Random(27);
    let tiles = 20;
    let cloud = Cloud::of((0..20_000 + 12 * tiles).map(|i| {
        let [u, v] = [100.0 * random.unit(), 100.0 * random.unit()];
        let noise = 0.1 * random.gauss();
        match i {
            0..10_000 => (turn([u, v, noise]), turn([0.0, 0.0, 1.0])),
            10_000..20_000 => (turn([noise, v, u]), turn([1.0, 0.0, 0.0])),
            _ => {
                let along = 0.5f64.sqrt() * (0.05 * u - 2.5);
                let middle = 100.0 * ((i % tiles) as f64 + 0.5) / tiles as f64;
                (turn([4.0 + along, middle + 0.05 * v - 2.5, 4.0 + along]), turn(unit([1.0, 0.0, -1.0])))
            }
        }
    }));
    let angles = errors(&cloud).0;
    let share = share_over(30.0, &angles[20_000..]);
    println!("{share} of the points of the tiles are off by more than 30 degrees");
    assert!(share < 0.2, "{share}");
}

/// Unit spheres of some points each.
fn balls(count: usize, points: usize, place: impl Fn(usize) -> [f64; 3]) -> Cloud {
    let mut random = Random(20);
    Cloud::of((0..count * points).map(|i| {
        let (normal, place) = (random.direction(), place(i % count));
        ([0, 1, 2].map(|axis| place[axis] + normal[axis]), normal)
    }))
}

/// A tube of radius 1 along a circle, or if that has no end along a line of length 200.
fn pipe(radius: f64, points: usize) -> Cloud {
    let mut random = Random(21);
    Cloud::of((0..points).map(|_| {
        let (along, around) = (random.unit(), TAU * random.unit());
        let (out, up) = (around.cos(), around.sin());
        if radius == f64::INFINITY {
            return ([200.0 * along, out, up], [0.0, out, up]);
        }
        let (x, y) = ((TAU * along).cos(), (TAU * along).sin());
        ([(radius + out) * x, (radius + out) * y, up], [out * x, out * y, up])
    }))
}
