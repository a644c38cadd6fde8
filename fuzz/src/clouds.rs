//! Bytes to clouds of every kind, and to options. A few bytes say what a cloud is made of, so that to change one changes
//! something that matters.

use crate::Random;
use arbitrary::{Result, Unstructured};
use bilinormal::{Cell, Method, Options, Orient, Points};

/// Coordinates of either precision.
#[derive(Debug)]
pub enum Cloud {
    Single(Vec<f32>),
    Double(Vec<f64>),
}

impl Cloud {
    /// A cloud of at most `most` points.
    pub fn of(u: &mut Unstructured, most: usize) -> Result<Self> {
        let mut points: Vec<[f64; 3]> = Vec::new();
        for _ in 0..u.int_in_range(1..=5)? {
            // Small ones often.
            let part = u.int_in_range(0..=7)?;
            let count = u.int_in_range(0..=(most - points.len()) >> part)?;
            add_piece(u, count, &mut points)?;
        }
        if u.ratio(1, 3)? {
            shuffle(&mut points, &mut Random(u.arbitrary()?));
        }
        let is_double = u.ratio(1, 4)?;
        // Doubles also beyond single precision.
        let scale = if is_double && u.ratio(1, 4)? { *u.choose(&[1e-300, 1e-40, 1e40, 1e250])? } else { 1.0 };
        let coordinates = points.into_iter().flatten().map(|c| c * scale);
        Ok(if is_double {
            Self::Double(coordinates.collect())
        } else {
            Self::Single(coordinates.map(|c| c as f32).collect())
        })
    }

    pub fn points(&self) -> Points<'_> {
        match self {
            Self::Single(coordinates) => Points::from_f32(coordinates),
            Self::Double(coordinates) => Points::from_f64(coordinates),
        }
        .unwrap()
    }

    /// The same in memory of their own.
    pub fn owned(&self) -> Points<'static> {
        match self {
            Self::Single(coordinates) => Points::from_vec(coordinates.clone()),
            Self::Double(coordinates) => Points::from_f64(coordinates),
        }
        .unwrap()
    }

    pub fn coordinates(&self) -> Vec<[f64; 3]> {
        match self {
            Self::Single(coordinates) => coordinates.as_chunks().0.iter().map(|p| p.map(f64::from)).collect(),
            Self::Double(coordinates) => coordinates.as_chunks().0.to_vec(),
        }
    }
}

fn shuffle(points: &mut [[f64; 3]], random: &mut Random) {
    for i in (1..points.len()).rev() {
        points.swap(i, random.below(i + 1));
    }
}

/// A size: mostly ordinary, else anything that single precision holds.
fn size(u: &mut Unstructured) -> Result<f64> {
    Ok(if u.ratio(3, 4)? { *u.choose(&[1.0, 0.3, 7.0, 100.0, 1e-3])? } else { 10f64.powi(u.int_in_range(-45..=38)?) })
}

fn add_piece(u: &mut Unstructured, count: usize, points: &mut Vec<[f64; 3]>) -> Result<()> {
    let start = points.len();
    let kind = u.int_in_range(0..=15)?;
    let random = &mut Random(u.arbitrary::<u16>()?.into());
    let [a, b] = [random.direction(), random.direction()];
    let along = |s: f64, t: f64| [0, 1, 2].map(|i| s * a[i] + t * b[i]);
    let steps = u.int_in_range(1..=40)?;
    let stepped = |x: f64| (x * f64::from(steps)).round() / f64::from(steps);
    for i in 0..count {
        let (n, third) = (i as f64, i % 3);
        points.push(match kind {
            0 => [(); 3].map(|()| u.arbitrary().map_or(0.0, |bits| f32::from_bits(bits).into())),
            1 => [(); 3].map(|()| random.single().into()),
            2 => [(); 3].map(|()| stepped(random.signed())),
            3 => along(n, 0.0),
            4 => [0, 1, 2].map(|axis| if axis == steps as usize % 3 { random.signed() } else { 1.0 }),
            5 => along(random.signed(), random.signed()),
            6 => [0, 1, 2].map(|axis| if axis == steps as usize % 3 { 0.5 } else { stepped(random.signed()) }),
            7 => a,
            8 => random.direction(),
            9 => {
                let face = [random.signed(), random.signed(), random.signed()];
                [0, 1, 2].map(|axis| if axis == third { face[axis].signum() } else { face[axis] })
            }
            10 => [(); 3].map(|()| random.signed()),
            // Rows of a scan.
            11 => {
                let [x, y] = [(i % steps as usize) as f64, (i / steps as usize) as f64];
                [x, y, 0.3 * (0.4 * x).sin() * (0.2 * y).cos()]
            }
            // Ever smaller, round one place.
            12 => {
                let size = 0.5f64.powf(n * f64::from(steps) / 10.0 % 140.0);
                random.direction().map(|c| c * size)
            }
            // A screw: nowhere flat.
            13 => [(n * 0.1).cos(), (n * 0.1).sin(), n * 0.01 * f64::from(steps)],
            // Two sheets.
            14 => [random.signed(), random.signed(), if i % 2 == 0 { 0.0 } else { f64::from(steps) * 1e-3 }],
            _ => points.get(random.below(points.len() + 1)).copied().unwrap_or([0.0; 3]),
        });
    }
    if kind < 2 {
        return Ok(());
    }
    let (noise, scale, flat) =
        (*u.choose(&[0.0, 0.0, 1e-7, 1e-3, 0.05])?, size(u)?, *u.choose(&[1.0, 1.0, 1e-6, 1e-3, 0.0])?);
    let far = if u.ratio(1, 3)? { size(u)? * 1e3 } else { 0.0 };
    let spoilt = if u.ratio(1, 8)? { u.int_in_range(1..=20)? } else { 0 };
    for (i, point) in points[start..].iter_mut().enumerate() {
        *point = [0, 1, 2].map(|axis| {
            let scale = if axis == 2 { scale * flat } else { scale };
            scale * (point[axis] + noise * random.signed()) + far * b[axis]
        });
        if spoilt > 0 && i % spoilt == 0 {
            point[i % 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0][random.below(4)];
        }
    }
    Ok(())
}

/// Any options, also those that are refused. With few neighbours where there are many points: time grows with their number.
pub fn options(u: &mut Unstructured, points: usize) -> Result<Options> {
    let number = |u: &mut Unstructured| -> Result<f64> { Ok(if u.ratio(7, 8)? { size(u)? } else { u.arbitrary()? }) };
    let vector = |u: &mut Unstructured| -> Result<[f64; 3]> { Ok([number(u)?, -number(u)?, number(u)?]) };
    let most = if points < 300 { u32::MAX } else { 40 };
    Ok(Options {
        method: *u.choose(&[Method::Bilinear, Method::Bilinear, Method::Bilinear, Method::Knn, Method::Egg])?,
        cell: match u.int_in_range(0..=5)? {
            0..=2 => Cell::Auto,
            3 | 4 => Cell::Scale(*u.choose(&[0.1, 0.5, 1.0, 1.5, 3.0, 20.0, 100.0])?),
            _ => Cell::Size(number(u)?),
        },
        k: u.choose(&[None, None, Some(3), Some(4), Some(9), Some(30), Some(2), Some(most)])?.map(|k| k.min(most)),
        orient: match u.int_in_range(0..=6)? {
            0 | 1 => Orient::None,
            2 | 3 => Orient::Consistent,
            4 => Orient::Outward,
            5 => Orient::Viewpoint(vector(u)?),
            _ => Orient::Up(vector(u)?),
        },
        curvature: u.arbitrary()?,
        components: u.arbitrary()?,
    })
}
