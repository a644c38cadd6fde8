//! Where a scanner may have stood, by how densely it covered the surfaces round it.
//!
//! It sends its rays in all directions alike: of a surface that is twice as far it takes a quarter as many points, and fewer of
//! what is slanted, by the cosine.

use super::spots::{Spot, variance};
use super::thinning::Thinning;
use crate::power::{exp2, log2};
use glam::{DMat3, DMat4, DVec3, DVec4};

/// What is seen at a flatter angle, by its cosine, tells no density: for the law it does not count, and where a place is sought,
/// because it may come to face it, it counts as if seen at this one.
pub(super) const FACING: f64 = 0.15;

/// What lies nearer to the scanner, in edges, lies in it.
const NEAREST: f64 = 0.5;

/// Where a scanner is sought first, counted from the middle of the points, which is next to it if it stood amid them, in mean
/// distances of the spots: so far off on either side of the surface there, because of open ground the middle lies in it, and from
/// below it looks nearly alike; and on the side to which densities grow.
const OFF: [f64; 4] = [0.08, -0.08, 0.25, -0.25];
const BESIDE: f64 = 1.5;

/// Steps of the search, unless one changes the misfit by less than such a share; and how long they may be, in the same distances.
const ROUNDS: usize = 15;
const ENOUGH: f64 = 1e-3;
pub(super) const LONGEST: f64 = 0.3;

/// Steps to the level that fits most of the spots, by the same weights.
const LEVELLINGS: usize = 3;

/// A place for a scanner.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// In edges.
    pub place: DVec3,
    /// The logarithm, to base 2, of the density that faces it at a distance of one edge.
    level: f64,
    /// How much densities differ from what it tells, up to 1: a mean of what spots are off, of which none counts more than 1.
    pub misfit: f64,
}

impl Place {
    /// Those that fit best near where they are sought; the first is the middle itself. Densities grow `towards` a side.
    pub fn all(spots: &[Spot], middle: DVec3, towards: DVec3) -> impl Iterator<Item = Self> {
        let unit = spots.iter().map(|spot| spot.place.distance(middle)).sum::<f64>() / spots.len() as f64;
        let across = across(spots, middle, unit);
        let sought = OFF.map(|off| off * across).into_iter().chain([BESIDE * towards]);
        let found = sought.map(move |off| Self::at(spots, middle + unit * off, &[]).moved(spots, LONGEST * unit, &[]));
        [Self::at(spots, middle, &[])].into_iter().chain(found)
    }

    /// One where densities come to what they are on average. `others`: for each spot the density that other places tell, if any.
    pub fn at(spots: &[Spot], place: DVec3, others: &[f64]) -> Self {
        let (mut level, mut all) = (0.0, 0.0);
        for spot in spots {
            level += spot.weight * (spot.density - Ray::between(spot, place).log_density());
            all += spot.weight;
        }
        let mut at = Self { place, level: level / all, misfit: 0.0 };
        at.misfit = at.slope(spots, others).misfit;
        at
    }

    /// The same place, with the level that fits most of the spots.
    pub fn levelled(mut self, spots: &[Spot], others: &[f64]) -> Self {
        for _ in 0..LEVELLINGS {
            let Slope { squares, products, .. } = self.slope(spots, others);
            self.level += products.w / (squares.w_axis.w + 1e-9);
        }
        self.misfit = self.slope(spots, others).misfit;
        self
    }

    /// The density that it tells of a spot, from the ray between the two.
    pub fn density(&self, ray: &Ray) -> f64 {
        exp2(self.level) * ray.density()
    }

    /// The ray to it from a spot.
    pub fn ray(&self, spot: &Spot) -> Ray {
        Ray::between(spot, self.place)
    }

    /// The one that fits best near it, by the method of Levenberg (1944) and Marquardt (1963), with the weights of Geman and
    /// McClure (1985), so that what is far off, as behind something else, does not count.
    pub fn moved(mut self, spots: &[Spot], longest: f64, others: &[f64]) -> Self {
        let mut slope = self.slope(spots, others);
        // The others may be new.
        self.misfit = slope.misfit;
        let mut damping = 0.01;
        for _ in 0..ROUNDS {
            let Slope { squares, products, .. } = slope;
            let diagonal = DVec4::new(squares.x_axis.x, squares.y_axis.y, squares.z_axis.z, squares.w_axis.w);
            let step = (squares + DMat4::from_diagonal(damping * diagonal + 1e-9)).inverse() * products;
            let step = step * (longest / step.truncate().length()).min(1.0);
            let mut next = Self { place: self.place + step.truncate(), level: self.level + step.w, misfit: 0.0 };
            let there = next.slope(spots, others);
            next.misfit = there.misfit;
            let gain = self.misfit - next.misfit;
            if gain > 0.0 {
                (self, slope) = (next, there);
                damping /= 5.0;
            } else {
                damping *= 8.0;
            }
            if gain.abs() < ENOUGH * self.misfit {
                break;
            }
        }
        self
    }

    fn slope(&self, spots: &[Spot], others: &[f64]) -> Slope {
        let mut slope = Slope { misfit: 0.0, squares: DMat4::ZERO, products: DVec4::ZERO };
        let mut all = 0.0;
        for (i, spot) in spots.iter().enumerate() {
            let ray = Ray::between(spot, self.place);
            // Densities add up, and the logarithm of their sum grows with each by its part of it.
            let (off, part) = match others.get(i) {
                None => (spot.density - self.level - ray.log_density(), 1.0),
                Some(&other) => {
                    let own = self.density(&ray);
                    (spot.density - log2(own + other), own / (own + other))
                }
            };
            let share = share(off);
            let growth = part * ray.growth(spot).extend(1.0);
            let weighed = spot.weight * share * share * growth;
            slope.misfit += spot.weight * share * off * off;
            slope.products += off * weighed;
            slope.squares +=
                DMat4::from_cols(growth.x * weighed, growth.y * weighed, growth.z * weighed, growth.w * weighed);
            all += spot.weight;
        }
        slope.misfit /= all;
        slope
    }
}

/// The share of its square that a difference counts (Geman and McClure): so none counts more than 1.
pub(super) fn share(off: f64) -> f64 {
    1.0 / (1.0 + off * off)
}

/// What densities differ from what a place tells, and how that changes with the place and the level: sums for the normal
/// equations.
struct Slope {
    misfit: f64,
    squares: DMat4,
    products: DVec4,
}

/// From a spot to a place.
pub(super) struct Ray {
    along: DVec3,
    /// The square of its length.
    squared: f64,
    /// Of the angle to the normal, and how much of it counts.
    pub cosine: f64,
}

impl Ray {
    fn between(spot: &Spot, place: DVec3) -> Self {
        let along = place - spot.place;
        let squared = along.length_squared().max(NEAREST * NEAREST);
        Self { along, squared, cosine: spot.normal.dot(along) / squared.sqrt() }
    }

    /// The density there, but for the level.
    pub fn density(&self) -> f64 {
        self.cosine.abs().max(FACING) / self.squared
    }

    /// The logarithm of that.
    fn log_density(&self) -> f64 {
        log2(self.density())
    }

    /// How that changes with the place.
    fn growth(&self, spot: &Spot) -> DVec3 {
        let is_told = self.cosine.abs() > FACING;
        let slant = if is_told {
            spot.normal / (self.cosine * self.squared.sqrt()) - self.along / self.squared
        } else {
            DVec3::ZERO
        };
        (slant - 2.0 * self.along / self.squared) / std::f64::consts::LN_2
    }
}

/// How densities go with nearness to a place, twice the logarithm of the distance to base 2, and with the cosine, of what faces it
/// so well.
pub(super) fn thinning(spots: &[Spot], place: DVec3, least_cosine: f64) -> Thinning {
    Thinning::of(|| {
        spots.iter().filter_map(move |spot| {
            let Ray { squared, cosine, .. } = Ray::between(spot, place);
            let sample = DVec3::new(spot.density, -log2(squared), log2(cosine.abs().max(FACING)));
            (cosine.abs() >= least_cosine).then_some((spot.weight, sample))
        })
    })
}

/// The share of the variance of densities that a place explains, by the inverse square and the cosine themselves: nothing where
/// hardly any varies, as that of one spot.
pub(super) fn explained(spots: &[Spot], place: DVec3) -> f64 {
    /// Of logarithms to base 2: less is rounding.
    const LEAST_VARIANCE: f64 = 1e-6;
    let facing = || spots.iter().filter(|spot| Ray::between(spot, place).cosine.abs() >= FACING);
    let known = variance(facing(), |spot| spot.density);
    if known > LEAST_VARIANCE {
        1.0 - variance(facing(), |spot| spot.density - Ray::between(spot, place).log_density()) / known
    } else {
        0.0
    }
}

/// The share of the variance of densities that the normals of surfaces explain, turned to a place: by their harmonics up to the
/// second order, which are all but all that light from afar makes of them (Basri and Jacobs, "Lambertian reflectance and linear
/// subspaces", IEEE Transactions on Pattern Analysis and Machine Intelligence 25, 2003, 218-233). So it is with the rays of
/// scanners that stood round an object.
pub(super) fn explained_by_normals(spots: &[Spot], place: DVec3) -> f64 {
    /// Harmonics, and the density.
    const COUNT: usize = 9;
    let samples = || {
        spots.iter().filter_map(|spot| {
            let cosine = Ray::between(spot, place).cosine;
            let DVec3 { x, y, z } = spot.normal * 1f64.copysign(cosine);
            let sample = [x, y, z, x * y, y * z, z * x, x * x, y * y, spot.density];
            (cosine.abs() >= FACING).then_some((spot.weight, sample))
        })
    };
    let (mut mean, mut all) = ([0.0; COUNT], 0.0);
    for (weight, sample) in samples() {
        mean.iter_mut().zip(sample).for_each(|(mean, value)| *mean += weight * value);
        all += weight;
    }
    let mut products = [[0.0; COUNT]; COUNT];
    for (weight, mut sample) in samples() {
        sample.iter_mut().zip(mean).for_each(|(value, mean)| *value -= mean / all);
        for (row, one) in products.iter_mut().zip(sample) {
            row.iter_mut().zip(sample).for_each(|(product, other)| *product += weight * one * other);
        }
    }
    let variance = products[COUNT - 1][COUNT - 1];
    // Gauss's elimination of one harmonic after the other leaves the variance that none explains. One that hardly varies, as on
    // flat ground, explains nothing.
    let little = 1e-3 * all;
    for harmonic in 0..COUNT - 1 {
        let row = products[harmonic];
        for other in &mut products[harmonic + 1..] {
            let share = other[harmonic] / (row[harmonic] + little);
            other.iter_mut().zip(row).for_each(|(product, own)| *product -= share * own);
        }
    }
    1.0 - products[COUNT - 1][COUNT - 1] / variance
}

/// Where densities grow to, as a unit vector, and the share of their variance that this explains.
pub(super) fn growth(spots: &[Spot]) -> (DVec3, f64) {
    let (mut place, mut density, mut all) = (DVec3::ZERO, 0.0, 0.0);
    for spot in spots {
        place += spot.weight * spot.place;
        density += spot.weight * spot.density;
        all += spot.weight;
    }
    let (place, density) = (place / all, density / all);
    let (mut squares, mut products, mut variance) = (DMat3::ZERO, DVec3::ZERO, 0.0);
    for spot in spots {
        let (along, off) = (spot.place - place, spot.density - density);
        squares += spot.weight * outer(along);
        products += spot.weight * off * along;
        variance += spot.weight * off * off;
    }
    // Nowhere to, if that is not told because all is flat.
    let little = 1e-2 * (squares.x_axis.x + squares.y_axis.y + squares.z_axis.z);
    let growth = (squares + DMat3::from_diagonal(DVec3::splat(little))).inverse() * products;
    (growth.normalize_or_zero(), growth.dot(products) / variance)
}

/// The normal that spots near the middle have most in common; `unit` is their mean distance from it.
fn across(spots: &[Spot], middle: DVec3, unit: f64) -> DVec3 {
    let mut squares = DMat3::ZERO;
    for spot in spots {
        let far = spot.place.distance_squared(middle) / (unit * unit);
        squares += outer(spot.normal) * (1.0 / ((1.0 + far) * (1.0 + far)));
    }
    // Squared so often, all its columns point along it.
    for _ in 0..4 {
        squares = squares * (1.0 / squares.x_axis.x.max(squares.y_axis.y).max(squares.z_axis.z));
        squares = squares * squares;
    }
    let columns = [squares.x_axis, squares.y_axis, squares.z_axis];
    let longest = columns.into_iter().max_by(|one, other| one.length_squared().total_cmp(&other.length_squared()));
    longest.unwrap_or_default().normalize_or_zero()
}

/// Its products with itself.
fn outer(one: DVec3) -> DMat3 {
    DMat3::from_cols(one.x * one, one.y * one, one.z * one)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use glam::DVec2;

    pub const STOOD: DVec3 = DVec3::new(4.0, -7.0, 3.0);

    /// How many points a scanner sees there.
    pub fn seen_from(scanner: DVec3, place: DVec3, normal: DVec3) -> f64 {
        let ray = scanner - place;
        1e4 * normal.dot(ray) / ray.length().powi(3)
    }

    fn spot(place: DVec3, normal: DVec3, points: f64) -> Spot {
        Spot { place, normal, density: log2(points), weight: 1.0 }
    }

    /// The middles of square tiles, ten along an edge, of a box round the origin, with normals inwards; so many points on each.
    pub fn walls(points: impl Fn(DVec3, DVec3) -> f64) -> Vec<Spot> {
        let tile = |i: i32| 0.2 * f64::from(i) - 0.9;
        let sides = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
        let tiles = sides.flat_map(|side| (0..100).map(move |i| (side, tile(i % 10), tile(i / 10))));
        let size = DVec3::new(20.0, 30.0, 12.0);
        let wall = |(side, a, b): (DVec3, f64, f64)| {
            let place = size
                * (side + a * DVec3::new(side.z, side.x, side.y).abs() + b * DVec3::new(side.y, side.z, side.x).abs());
            spot(place, -side, points(place, -side))
        };
        tiles.map(wall).collect()
    }

    /// The one that fits best of those that are found.
    fn best(spots: &[Spot], middle: DVec3) -> Place {
        Place::all(spots, middle, growth(spots).0).min_by(|one, other| one.misfit.total_cmp(&other.misfit)).unwrap()
    }

    #[test]
    fn a_scanner_is_found_in_a_room() {
        for scanner in [STOOD, DVec3::new(-15.0, 20.0, -9.0), DVec3::ZERO] {
            // Every seventh tile has ten times the points, as if something stood before it.
            let points = |place: DVec3, normal: DVec3| {
                let is_off = (place.x + 3.0 * place.y + 7.0 * place.z).floor().rem_euclid(7.0) == 0.0;
                seen_from(scanner, place, normal) * if is_off { 10.0 } else { 1.0 }
            };
            let found = best(&walls(points), DVec3::new(2.0, 3.0, -1.0));
            assert!(found.place.distance(scanner) < 0.5, "{} is not {scanner}", found.place);
        }
    }

    #[test]
    fn a_scanner_is_found_above_open_ground() {
        let height = |x: f64, y: f64| 2.0 * (0.15 * x).sin() * (0.1 * y).cos();
        for (x, y) in [(0.0, 0.0), (10.5, 0.0), (-10.5, 31.0)] {
            let scanner = DVec3::new(x, y, height(x, y) + 5.0);
            let ground = (0..900).map(|i| {
                let (x, y) = (x + 3.0 * f64::from(i % 30) - 43.5, y + 3.0 * f64::from(i / 30) - 43.5);
                let slope =
                    DVec2::new(height(x + 0.01, y) - height(x - 0.01, y), height(x, y + 0.01) - height(x, y - 0.01));
                let normal = (-slope / 0.02).extend(1.0).normalize();
                let place = DVec3::new(x, y, height(x, y));
                (place, normal, seen_from(scanner, place, normal))
            });
            let seen: Vec<Spot> =
                ground.filter(|one| one.2 > 0.0).map(|(place, normal, points)| spot(place, normal, points)).collect();
            let found = best(&seen, DVec3::new(x, y, height(x, y)));
            // Most of it is seen so flat that it tells no density.
            assert!(found.place.distance(scanner) < 2.0, "{} is not {scanner}", found.place);
        }
    }

    #[test]
    fn densities_grow_to_the_side_of_the_scanner() {
        let beside = DVec3::new(-80.0, 10.0, 5.0);
        let (towards, explained) = growth(&walls(|place, _| (place - beside).length_squared().recip()));
        assert!(towards.dot(beside.normalize()) > 0.95 && explained > 0.8, "{towards} {explained}");
        let (_, explained) = growth(&walls(|place, _| 1.0 + (100.0 * place.x + 70.0 * place.y).sin().abs()));
        assert!(explained < 0.1, "{explained}");
    }

    #[test]
    fn one_density_explains_nothing() {
        for count in [1, 3] {
            let spots: Vec<Spot> =
                (0..count).map(|i| spot(DVec3::new(f64::from(i), 0.0, 0.1), DVec3::Z, 7.0)).collect();
            assert_eq!(explained(&spots, DVec3::new(0.0, 0.0, 5.0)), 0.0);
        }
    }
}
