//! A quadratic surface through the samples of a neighbourhood, and how much its normals are to be trusted.

use super::matrix::{Matrix, times_lanes};
use super::samples::Window;
use crate::lanes::dot;
use crate::pca::Symmetric;
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3, Vec4};

/// The zeros of `height + slope . d + d . bend d / 2`, where `d` is what lies between `centre` and a point: near them its
/// value is the distance from the surface, and its gradient the normal.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Quadric {
    pub centre: Vec3,
    pub height: f32,
    pub slope: Vec3,
    pub bend: Matrix,
}

impl Quadric {
    pub const NONE: Self = Self {
        centre: Vec3::ZERO,
        height: 0.0,
        slope: Vec3::ZERO,
        bend: Matrix { diagonal: Vec3::ZERO, off: Vec3::ZERO },
    };

    /// The gradient and the value at a point.
    #[inline(always)]
    pub fn at(&self, point: Vec3) -> (Vec3, f32) {
        let d = point - self.centre;
        let turn = self.bend.times(d);
        (self.slope + turn, self.height + d.dot(self.slope + 0.5 * turn))
    }
}

/// A surface, in the edges of its cube and against that cube's centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    pub quadric: Quadric,
    /// Variance of the points' distances from it.
    pub noise: f32,
    /// Variance of the angle of its normal, in the centre; infinite where there is no surface.
    pub error: f32,
    /// What that gains with the square of the distance from the centre.
    pub error_growth: f32,
    /// Variance of the points along the surface, in the direction in which it is less.
    pub width: f32,
    /// Surface variation: the least eigenvalue of the points' covariance, as a share of all three.
    pub variation: f32,
    /// Variance across it of the points of a sample; zero where each sample is one point.
    pub within: f32,
    /// How many points it rests on.
    pub points: f32,
    /// Whether more than a plane could be told.
    pub is_curved: bool,
    /// Whether the samples lie off it by more than their points' own spread accounts for, and than noise.
    pub lacks_detail: bool,
    /// Whether it is a plane in noise so wide that the parts of its cube, with a quarter of the points on half the width, would
    /// know less.
    pub is_plane_in_noise: bool,
    /// Whether what passes for noise may be folds: points next to each other lie on a plane that stands across it.
    pub is_folded: bool,
}

impl Surface {
    pub const NONE: Self = Self {
        quadric: Quadric::NONE,
        noise: 0.0,
        error: f32::INFINITY,
        error_growth: 0.0,
        width: 0.0,
        variation: 0.0,
        within: 0.0,
        points: 0.0,
        is_curved: false,
        lacks_detail: false,
        is_plane_in_noise: false,
        is_folded: false,
    };

    /// The same where coordinates that were rounded have this variance: it is noise, however exactly points lie on steps, and none
    /// of that is detail.
    pub fn rounded(mut self, rounding: f32) -> Self {
        if rounding > 0.0 {
            if self.noise < rounding {
                self.noise = rounding;
            }
            self.error += 2.0 * rounding / (self.points * self.width);
            self.lacks_detail &= self.noise > 2.0 * rounding;
        }
        self
    }

    /// Variance of the angle of its normal at a place.
    pub fn variance_at(&self, place: Vec3) -> f32 {
        self.error + self.error_growth * place.distance_squared(self.quadric.centre)
    }

    /// Whether so much is left inside of its samples as there would be of noise of this variance.
    pub fn shows(&self, noise: f32) -> bool {
        self.within >= WITHIN * noise / (1.0 + SAMPLE as f32 * noise)
    }

    /// Whether there may be so much noise that it decides whether the cube is divided.
    pub fn may_hide_parts(&self) -> bool {
        self.is_plane_in_noise || self.is_curved && self.noise >= HIDING
    }

    /// Whether there is one.
    pub fn is_some(&self) -> bool {
        self.error < f32::INFINITY
    }
}

/// One over the variance of points anywhere in a sample, which is half an edge wide: noise of a variance v leaves 1/(1/v + this)
/// inside of samples.
const SAMPLE: f64 = 48.0;

/// So much of the noise must be left inside of samples: less does not tell how much there was.
const CUT: f64 = 0.3;

/// The share of what noise leaves inside of samples that tells it.
const WITHIN: f32 = 0.85;

/// Parts of a cube know less than it where noise has so much variance, in square edges: a deviation of 0.11.
const DEEP: f64 = 0.012;

/// Parts of cubes that were divided before know less than these where noise has so much variance, in square edges.
pub(super) const HIDING: f32 = 0.1;

/// A surface that bends less in an edge, in radians and squared, may be a plane.
const PLANE: f64 = 0.004;

/// And it is one where it is so many times as wide as thick, squared.
const CLEAR: f64 = 3.5;

/// There may be so much more noise than what is left inside of samples tells.
const MORE: f64 = 1.15;

/// Noise is so many times as wide as thick, squared: what is not may be a small body.
const WIDE: f64 = 10.0;

/// The share of what is inside of samples that is left of noise when each may slope: all, but for chance.
const LEFT: f64 = 0.9;

/// What lies no farther from a sample than so many edges, squared, is next to it; the second where samples are of several points,
/// which have more of them there.
const BESIDE: f32 = 1.0;
const BESIDE_OF_MANY: f32 = 0.5;

/// Of a fold the points next to one are so many at the least, and lie on a plane: no thicker than this share of its height, squared.
const FOLD_POINTS: f64 = 12.0;
const FOLD: f64 = 0.25;

/// With fewer samples a surface is taken for a plane.
const QUADRIC_SAMPLES: f64 = 10.0;

/// Added to the variance of a plane's normal, square radians: nothing tells how bent the surface is.
const PLANE_ERROR: f64 = 0.1;

/// Added to the variance of a normal in a strip of points that is narrower than this share of its length, squared: its
/// own bend across, or its noise, may be all that makes it look like a surface.
const STRIP: f64 = 0.03;
const STRIP_ERROR: f64 = 0.3;

/// No surface is known to less than so many edges.
const FIT: f64 = 0.003;

/// Nor is detail missed where it is smaller than so many: to look for it would cost more than it is worth.
const DETAIL: f64 = 0.001;

impl Window {
    /// The surface that fits the samples best: the plane of the principal components, then by least squares the height
    /// over it as a quadratic function.
    pub fn fit(&mut self) -> Surface {
        let moments = self.moments();
        let points = moments[10];
        if points < 3.0 {
            return Surface::NONE;
        }
        // Along a line: how many they are, because the halves may tell more.
        self.through(&moments).unwrap_or(Surface { points: points as f32, ..Surface::NONE })
    }

    /// The same, if the samples do not lie along a line, from their [`Window::moments`].
    #[inline(always)]
    fn through(&self, moments: &[f64; 11]) -> Option<Surface> {
        let (mean, normal, covariance) = plane_of(moments)?;
        let (total, points) = (moments[0], moments[10]);
        let (u, v, [along, across, thick]) = principal(&covariance, normal);
        let (mean, normal) = (mean.as_vec3(), normal.as_vec3());
        let count = self.len() as f64;
        // How badly noise turns a plane as thick as it is wide.
        let thickness = across / (across - thick).max(1e-9 * along);
        let thickness = thickness * thickness;
        let strip = STRIP * along / across.max(1e-9 * along);
        let strip_error = STRIP_ERROR * (strip * strip) * (strip * strip);

        let mut surface = Surface {
            quadric: Quadric { centre: mean, height: 0.0, slope: normal, bend: Matrix::default() },
            noise: (thick * count / (count - 3.0).max(1.0)) as f32,
            width: across as f32,
            variation: (thick / (along + across + thick)).min(1.0 / 3.0) as f32,
            points: points as f32,
            ..Surface::NONE
        };
        if count >= QUADRIC_SAMPLES
            && let Some(fit) = self.quadratic(mean, [u, v, normal], [along, across], total)
        {
            let [a, b] = fit.slopes.map(|slope| slope as f32);
            let [aa, ab, bb] = fit.bends.as_vec3().to_array();
            let slope = normal - a * u - b * v;
            let bend = Matrix::product(u, u).scaled(2.0 * aa);
            let bend = bend.plus(Matrix::product(u, v).scaled(2.0 * ab)).plus(Matrix::product(v, v).scaled(2.0 * bb));
            let scale = slope.length_recip();
            surface.quadric = Quadric {
                centre: mean + normal * fit.height as f32,
                height: 0.0,
                slope: slope * scale,
                bend: bend.scaled(-scale),
            };
            let residual = fit.residual * count / (count - 6.0);
            let mut noise = residual;
            // Else each sample is one point.
            if points > count {
                let [within, scatter, between] = self.spread(&surface.quadric, total);
                noise += within;
                // Lack of fit: the variance of a point, told by the samples' distances and by the spread in each.
                let between = between * points / (count - 6.0);
                let own = within * points / (points - count);
                surface.within = own as f32;
                // Of noise the faces between the samples cut off a part.
                let whole = own / (1.0 - SAMPLE * own).max(CUT);
                let is_scattered = scatter >= LEFT * own;
                let is_noise = is_scattered && noise <= MORE * whole && noise * WIDE <= across;
                let most = own * (1.0 + 3.0 * (2.0 / (count - 6.0)).sqrt()) + DETAIL * DETAIL;
                surface.lacks_detail = between > most && !is_noise;
                let [aa, ab, bb] = fit.bends.to_array();
                let is_plane = 4.0 * (aa * aa + bb * bb) + 2.0 * ab * ab <= PLANE && noise * CLEAR <= across;
                let is_deep = noise >= DEEP && surface.shows(noise as f32);
                surface.is_plane_in_noise = is_plane && is_deep && is_scattered;
            }
            surface.noise = noise as f32;
            surface.is_curved = true;
            // Few samples more than coefficients leave the residual uncertain.
            let few = 1.0 / (count - 6.0);
            let variance = (noise + FIT * FIT) / points * thickness * (1.0 + 8.0 * few + 100.0 * few * few);
            let ([a, b], [aa, ab, bb]) = (fit.slope_variances, fit.bend_variances.to_array());
            surface.error = (variance * (a + b) + strip_error) as f32;
            surface.error_growth = (variance * (4.0 * aa + ab).max(4.0 * bb + ab)) as f32;
        } else {
            let variance = f64::from(surface.noise).max(1e-14 * along) / points * thickness;
            surface.error = (variance * (1.0 / along + 1.0 / across) + PLANE_ERROR + strip_error) as f32;
            surface.lacks_detail = points > count;
        }
        Some(surface)
    }

    /// Whether the samples next to a place lie on a plane across the surface that was fitted to all. The others are given up.
    #[optimize(size)]
    #[inline(never)]
    pub fn stand_across(&mut self, Surface { quadric, points, .. }: &Surface, place: Vec3) -> bool {
        let is_of_many = *points > 2.0 * self.len() as f32;
        self.keep_near(place, if is_of_many { BESIDE_OF_MANY } else { BESIDE });
        let moments = self.moments();
        let plane = plane_of(&moments).filter(|_| moments[10] >= FOLD_POINTS);
        plane.is_some_and(|(_, _, covariance)| {
            let (_, _, [_, across, high]) = principal(&covariance, quadric.slope.as_dvec3());
            across < FOLD * high
        })
    }

    /// Least squares of the height over the plane of `frame`, as a function 1, u, v, uu, uv, vv.
    fn quadratic(&self, mean: Vec3, frame: [Vec3; 3], [along, across]: [f64; 2], total: f64) -> Option<Fit> {
        let unit = [along.sqrt(), across.sqrt()];
        let (u, v, n) = (frame[0] / unit[0] as f32, frame[1] / unit[1] as f32, frame[2]);
        let at = |axis: Vec3, x: Vec4, y: Vec4, z: Vec4| x * axis.x + y * axis.y + z * axis.z - axis.dot(mean);
        let sums = self.sum(|[x, y, z, w]| {
            let (u, v, h) = (at(u, x, y, z), at(v, x, y, z), at(n, x, y, z));
            let (uu, uv, vv, wh) = (u * u, u * v, v * v, w * h);
            let (wuu, wuv, wvv) = (w * uu, w * uv, w * vv);
            [
                wuu,
                wuv,
                wvv, //
                wuu * u,
                wuu * v,
                wuv * v,
                wvv * v, //
                wuu * uu,
                wuu * uv,
                wuu * vv,
                wuv * vv,
                wvv * vv, //
                wh * u,
                wh * v,
                wh * uu,
                wh * uv,
                wh * vv,
                wh * h,
            ]
        });
        let share = 1.0 / total;
        let [uu, uv, vv, uuu, uuv, uvv, vvv, u4, u3v, uuvv, uv3, v4, hu, hv, huu, huv, hvv, hh] =
            sums.map(|sum| sum * share);
        // The means of u, v and h are zero, so that the part of 1, u and v is easily taken out of the normal equations: by
        // `means`, `in_u` and `in_v`, the fit of these three to uu, uv and vv. What that leaves of them tells the bends.
        let determinant = uu * vv - uv * uv;
        if determinant <= 0.0 {
            return None;
        }
        let means = DVec3::new(uu, uv, vv);
        let (with_u, with_v) = (DVec3::new(uuu, uuv, uvv), DVec3::new(uuv, uvv, vvv));
        let in_u = (with_u * vv - with_v * uv) / determinant;
        let in_v = (with_v * uu - with_u * uv) / determinant;
        let rest = |squares: DVec3, i: usize| squares - means * means[i] - in_u * with_u[i] - in_v * with_v[i];
        let rows = [
            rest(DVec3::new(u4 + RIDGE, u3v, uuvv), 0),
            rest(DVec3::new(u3v, uuvv + RIDGE, uv3), 1),
            rest(DVec3::new(uuvv, uv3, v4 + RIDGE), 2),
        ];
        let heights = DVec3::new(huu, huv, hvv) - in_u * hu - in_v * hv;
        let inverse = inverse(rows)?;
        let product = |a: DVec3| DVec3::new(inverse[0].dot(a), inverse[1].dot(a), inverse[2].dot(a));
        let bends = product(heights);
        let slopes = [(hu * vv - hv * uv) / determinant, (hv * uu - hu * uv) / determinant];
        let explained = slopes[0] * hu + slopes[1] * hv + bends.dot(heights);
        let residual = (hh - explained).max(0.0);
        // Noise alone would bend a plane, and most of all where that is continued: each bend is shrunk, the more the larger its
        // variance is. The other coefficients follow, as if along the principal axes `uu` and `vv` were 1 and `uv` 0: the
        // samples have some of that inside.
        let variances = DVec3::new(inverse[0].x, inverse[1].y, inverse[2].z);
        let squares = bends * bends;
        let variance = residual / (self.len() as f64 - 6.0);
        let bends = bends * squares / (squares + variance * variances).max(DVec3::splat(f64::MIN_POSITIVE));
        let [u, v] = unit.map(|unit| 1.0 / unit);
        let units = DVec3::new(u * u, u * v, v * v);
        Some(Fit {
            height: -bends.dot(means),
            slopes: [(hu - bends.dot(with_u)) * u, (hv - bends.dot(with_v)) * v],
            bends: bends * units,
            slope_variances: [
                (vv / determinant + in_u.dot(product(in_u))) * u * u,
                (uu / determinant + in_v.dot(product(in_v))) * v * v,
            ],
            bend_variances: variances * units * units,
            residual,
        })
    }

    /// The mean variance, across the surface, of the points behind the samples; the variance of one of them over a plane of its
    /// own sample, which of noise is as large, of detail a little larger than the samples far less, and infinite where the
    /// samples have on average less than one point more than a plane takes, as that tells nothing; and the variance of the
    /// samples' heights over the surface. The first and the last are over the mean of the surface at the points of a sample,
    /// which where it bends is not the surface at their mean.
    fn spread(&self, quadric: &Quadric, total: f64) -> [f64; 3] {
        let Quadric { centre, slope, bend, .. } = *quadric;
        let [within, scatter, freedom, height, between] =
            self.sum_with_spread(|[x, y, z, w], points, [xx, yy, zz, yz, xz, xy]| {
                let spread = [[xx, yy, zz], [yz, xz, xy]];
                let bend = bend.splat();
                let d = [x - centre.x, y - centre.y, z - centre.z];
                let [a, b, c] = times_lanes(bend, d);
                let sag = dot(bend[0], spread[0]) + 2.0 * dot(bend[1], spread[1]);
                let height = dot(d, slope.to_array().map(Vec4::splat)) + 0.5 * (dot(d, [a, b, c]) + sag);
                let normal = [a + slope.x, b + slope.y, c + slope.z];
                let turned = times_lanes(spread, normal);
                let scale = 1.0 / dot(normal, normal);
                let within = scale * dot(normal, turned);
                // As if the points lay alike in all directions of the surface.
                let along = (0.5 * (xx + yy + zz - within)).max(Vec4::splat(f32::MIN_POSITIVE));
                let explained = (scale * dot(turned, turned) - within * within) / along;
                // Rounding may leave anything.
                let explained = explained.max(Vec4::ZERO).min(within);
                // A plane takes three points, and of samples with no more nothing is left.
                let free = (w * (points - 3.0)).max(Vec4::ZERO);
                let left = Vec4::select(free.cmpgt(Vec4::ZERO), w * points * (within - explained), Vec4::ZERO);
                [w * within, left, free, w * height, w * height * height]
            });
        let share = 1.0 / total;
        let height = share * height;
        let scatter = if freedom < total { f64::INFINITY } else { scatter / freedom };
        // Rounding may leave less than nothing.
        [(share * within).max(0.0), scatter, (share * between - height * height).max(0.0)]
    }
}

/// Keeps curvature at zero where the samples do not tell it, as on two scan lines.
const RIDGE: f64 = 1e-3;

/// A quadratic function, and variances of its coefficients for samples of variance 1.
struct Fit {
    height: f64,
    /// By u and v.
    slopes: [f64; 2],
    slope_variances: [f64; 2],
    /// By uu, uv and vv.
    bends: DVec3,
    bend_variances: DVec3,
    /// The mean square of what is left.
    residual: f64,
}

/// The inverse of a symmetric matrix, if that is positive definite.
fn inverse([a, b, c]: [DVec3; 3]) -> Option<[DVec3; 3]> {
    let (x, y, z) = (b.cross(c), c.cross(a), a.cross(b));
    let determinant = a.dot(x);
    // By Sylvester's criterion.
    (a.x > 0.0 && z.z > 0.0 && determinant > 0.0).then(|| [x, y, z].map(|column| column / determinant))
}

/// The mean of some points, their normal and their covariance, from the sums of their weights and over all of x, y, z, xx, yy,
/// zz, yz, xz and xy, and one more, as all have who ask; unless they lie along a line.
#[inline(never)]
pub(super) fn plane_of(&[total, x, y, z, xx, yy, zz, yz, xz, xy, _]: &[f64; 11]) -> Option<(DVec3, DVec3, Symmetric)> {
    let share = 1.0 / total;
    let mean = DVec3::new(x, y, z) * share;
    let diagonal = DVec3::new(xx, yy, zz) * share - mean * mean;
    let off = DVec3::new(yz, xz, xy) * share - DVec3::new(mean.y * mean.z, mean.x * mean.z, mean.x * mean.y);
    let covariance = Symmetric { diagonal, off };
    let normal = covariance.normal(covariance.smallest_eigenvalue(), 1.0)?;
    Some((mean, normal, covariance))
}

/// The principal axes of a covariance across a normal, and the variances along them, the larger first, and along the normal. If
/// that is an eigenvector they are the others, and these the eigenvalues.
#[optimize(size)]
#[inline(never)]
fn principal(covariance: &Symmetric, normal: DVec3) -> (Vec3, Vec3, [f64; 3]) {
    let matrix = covariance.matrix();
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let (cu, cv) = (matrix * u, matrix * v);
    let (uu, uv, vv) = (u.dot(cu), u.dot(cv), v.dot(cv));
    let (half, middle) = (0.5 * (uu - vv), 0.5 * (uu + vv));
    let root = (half * half + uv * uv).sqrt();
    // The direction of the larger, from whichever of the two forms is not short.
    let direction = if half >= 0.0 { u * (half + root) + v * uv } else { u * uv + v * (root - half) };
    let first = direction.try_normalize().unwrap_or(u);
    let second = normal.cross(first);
    let values = [middle + root, (middle - root).max(0.0), normal.dot(matrix * normal).max(0.0)];
    (first.as_vec3(), second.as_vec3(), values)
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::samples::{Sample, Window};
    use super::*;

    /// A window of points, each a sample.
    fn window(points: impl Iterator<Item = Vec3>) -> Window {
        window_of(&points.map(Sample::point).collect::<Vec<_>>())
    }

    fn window_of(list: &[Sample]) -> Window {
        let mut window = Window::new();
        window.add(list, Vec3::ZERO, 1.0);
        window
    }

    /// Numbers from -1 to 1.
    pub fn uniform() -> impl FnMut() -> f32 {
        let mut state = 1u32;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        }
    }

    fn grid(side: i32) -> impl Iterator<Item = (f32, f32)> {
        (0..side * side).map(move |i| {
            let place = |i: i32| 2.0 * i as f32 / (side - 1) as f32 - 1.0;
            // Not quite a grid, so that no sum is zero by chance.
            (place(i % side) + 0.01 * (i % 3) as f32, place(i / side) - 0.007 * (i % 5) as f32)
        })
    }

    #[test]
    fn quadratic_surfaces_are_exact() {
        let height = |x: f32, y: f32| 0.2 + 0.1 * x - 0.05 * y + 0.04 * x * x + 0.03 * x * y - 0.02 * y * y;
        let surface = window(grid(7).map(|(x, y)| Vec3::new(x, y, height(x, y)))).fit();
        assert!(surface.is_curved && surface.noise < 1e-4, "{surface:?}");
        for (x, y) in grid(5) {
            let (gradient, distance) = surface.quadric.at(Vec3::new(x, y, height(x, y)));
            let truth = Vec3::new(-0.1 - 0.08 * x - 0.03 * y, 0.05 - 0.03 * x + 0.04 * y, 1.0).normalize();
            let sine = gradient.normalize().cross(truth).length();
            assert!(sine < 0.01, "{sine} at {x}, {y}");
            assert!(distance.abs() < 0.003, "{distance} at {x}, {y}");
        }
    }

    /// The mean of the variance that the fit claims is the mean square of the errors that it makes.
    #[test]
    fn the_variance_of_the_normal_is_told() {
        let (mut claimed, mut made) = (0.0, 0.0);
        let mut uniform = uniform();
        for _ in 0..200 {
            // The noise has a deviation of 0.05.
            let mut noisy = window(grid(7).map(|(x, y)| Vec3::new(x, y, 0.05 * (uniform() + uniform() + uniform()))));
            let surface = noisy.fit();
            assert!((surface.noise.sqrt() / 0.05 - 1.0).abs() < 0.4, "{}", surface.noise);
            let (gradient, _) = surface.quadric.at(surface.quadric.centre);
            claimed += surface.error;
            made += gradient.normalize().truncate().length_squared();
        }
        assert!((0.7..1.8).contains(&(claimed / made)), "{} times", claimed / made);
    }

    #[test]
    fn noise_bends_a_plane_less_than_least_squares_would() {
        let mut uniform = uniform();
        let rounds = 200;
        let squares = (0..rounds).map(|_| {
            let mut noisy = window(grid(7).map(|(x, y)| Vec3::new(x, y, 0.05 * (uniform() + uniform() + uniform()))));
            // As far from its edge as that is from the middle.
            noisy.fit().quadric.at(Vec3::new(2.0, 0.0, 0.0)).1.powi(2)
        });
        let deviation = (squares.sum::<f32>() / rounds as f32).sqrt();
        // 0.075 by least squares alone.
        assert!(deviation < 0.065, "{deviation}");
    }

    /// Samples of many points: where the surface bends, their centroids lie off it, each by as much as it spreads.
    #[test]
    fn detail_is_missed_at_a_crease_and_not_in_a_bowl() {
        let lacks_detail = |height: fn(f32, f32) -> f32| {
            let mut samples = Vec::new();
            for (u, v) in grid(6) {
                // From a narrow sample to one as wide as half a cube.
                let width = 0.05 + 0.2 * (u * 7.3 + v * 3.1).sin().abs();
                let points =
                    (0..9).map(|i| (1.4 * u + width * (i % 3 - 1) as f32, 1.4 * v + width * (i / 3 - 1) as f32));
                samples.push(Sample::of(points.map(|(x, y)| Sample::point(Vec3::new(x, y, height(x, y))))));
            }
            window_of(&samples).fit().lacks_detail
        };
        assert!(!lacks_detail(|_, _| 0.1));
        assert!(!lacks_detail(|x, y| 0.1 * x * x + 0.15 * y * y));
        assert!(!lacks_detail(|x, y| 0.1 * x * x - 0.05 * y * y));
        assert!(lacks_detail(|x, _| 0.1 * x.abs()));
    }

    /// Of 4000 points at random in the cubes, so high over a slope.
    fn scattered(slope: f32, mut height: impl FnMut(f32, &mut dyn FnMut() -> f32) -> f32) -> Surface {
        let mut uniform = uniform();
        let mut octants = std::collections::BTreeMap::<[i32; 3], Vec<Sample>>::new();
        for _ in 0..4000 {
            let (x, y) = (1.5 * uniform(), 1.5 * uniform());
            let place = Vec3::new(x, y, 0.1 + slope * x + height(x, &mut uniform));
            if place.abs().max_element() >= 1.5 {
                continue;
            }
            let octant = (2.0 * place).floor().as_ivec3().to_array();
            octants.entry(octant).or_default().push(Sample::point(place));
        }
        // And some in one place.
        let place = Vec3::new(0.0, 0.0, 0.1);
        let one = Sample { points: 5.0, ..Sample::point(place) };
        let samples = octants.values().map(|points| Sample::of(points.iter().copied())).chain([one]);
        window_of(&samples.collect::<Vec<Sample>>()).fit()
    }

    fn gauss(uniform: &mut dyn FnMut() -> f32) -> f32 {
        (0..12).map(|_| uniform()).sum::<f32>() / 2.0
    }

    /// Inside of samples half an edge wide; `vote.rs` rests on it.
    #[test]
    fn noise_is_in_the_samples_and_the_sides_of_a_wall_are_not() {
        for deviation in [0.1, 0.25, 0.4] {
            // Of a slope, so that it does not lie along the samples.
            let along_z = deviation * 2f32.sqrt();
            let found = scattered(1.0, |_, uniform| along_z * gauss(uniform)).within;
            let expected = 1.0 / (1.0 / (deviation * deviation) + SAMPLE as f32);
            assert!((found / expected - 1.0).abs() < 0.15, "{found} instead of {expected}");
        }
        let wall = scattered(0.0, |_, uniform| if uniform() < 0.0 { 0.0 } else { 0.5 }).within;
        assert!(wall < 1e-4, "{wall}");
    }

    /// As thick as each other, and cut by the faces of the samples.
    #[test]
    fn noise_lacks_no_detail_but_waves_do() {
        for deviation in [0.03, 0.1, 0.15] {
            for slope in [0.3, 1.0] {
                let lacks_detail = |height: &dyn Fn(f32, &mut dyn FnMut() -> f32) -> f32| {
                    scattered(slope, |x, uniform| deviation * height(x, uniform)).lacks_detail
                };
                let about = format!("{deviation}, {slope}");
                assert!(!lacks_detail(&|_, uniform| gauss(uniform)), "noise of {about}");
                assert!(lacks_detail(&|x, _| 2f32.sqrt() * (6.0 * x).sin()), "waves of {about}");
            }
        }
    }

    /// Wide noise on a plane, but nothing that is smooth from point to point, bent, or nearly as thick as wide.
    #[test]
    fn planes_in_noise_are_told() {
        let is_told = |height: &dyn Fn(f32, &mut dyn FnMut() -> f32) -> f32| {
            scattered(0.3, |x, uniform| height(x, uniform)).is_plane_in_noise
        };
        for deviation in [0.15, 0.25, 0.35] {
            assert!(is_told(&|_, uniform| deviation * gauss(uniform)), "noise of {deviation}");
            assert!(!is_told(&|x, _| deviation * 2f32.sqrt() * (6.0 * x).sin()), "waves of {deviation}");
            assert!(
                !is_told(&|x, uniform| 0.2 * x * x + deviation * gauss(uniform)),
                "a bowl with noise of {deviation}"
            );
        }
        assert!(!is_told(&|_, uniform| 0.08 * gauss(uniform)), "little noise");
        assert!(!is_told(&|_, uniform| 1.4 * uniform()), "all of the cubes filled");
    }

    /// However narrow the strip is: rounding must not make the least certain of all normals the most certain one.
    #[test]
    fn a_narrow_strip_never_claims_more_than_certainty() {
        let mut uniform = uniform();
        for tenths in 0..80 {
            let width = 10f32.powf(-0.1 * tenths as f32);
            let strip = window((0..40).map(|_| Vec3::new(uniform(), width * uniform(), 0.3 * width * uniform()))).fit();
            assert!(strip.error > 0.0 && strip.error_growth >= 0.0, "{width}: {strip:?}");
            let Quadric { slope, bend, .. } = strip.quadric;
            assert!(slope.is_finite() && bend.diagonal.is_finite() && bend.off.is_finite(), "{width}: {strip:?}");
        }
    }

    #[test]
    fn the_inverse_is_that_of_positive_definite_matrices_only() {
        let rows = [DVec3::new(4.0, 1.0, -0.5), DVec3::new(1.0, 3.0, 0.2), DVec3::new(-0.5, 0.2, 2.0)];
        let found = inverse(rows).unwrap();
        for (i, row) in rows.into_iter().enumerate() {
            for (j, column) in found.into_iter().enumerate() {
                assert!((row.dot(column) - f64::from(u8::from(i == j))).abs() < 1e-15, "{i}, {j}");
            }
        }
        // Two negative eigenvalues leave the determinant positive.
        assert_eq!(inverse([DVec3::X, -DVec3::Y, -DVec3::Z]), None);
        assert_eq!(inverse([-DVec3::X, -DVec3::Y, DVec3::Z]), None);
        assert_eq!(inverse([DVec3::X, DVec3::Y, DVec3::ZERO]), None);
        assert_eq!(inverse([DVec3::NAN; 3]), None);
    }

    #[test]
    fn nothing_that_is_no_surface_is_one() {
        assert!(!window((0..2).map(|i| Vec3::splat(i as f32))).fit().is_some());
        assert!(!window((0..9).map(|_| Vec3::splat(0.3))).fit().is_some());
        assert!(!window((0..9).map(|i| 0.1 * i as f32 * Vec3::ONE)).fit().is_some());
        // A bent line lies in a plane, but in any other as well.
        let mut line = window((0..40).map(|i| Vec3::new(0.05 * i as f32, 1e-3 * (i * i) as f32 / 40.0, 0.0)));
        assert!(line.fit().error > 0.03);
    }
}
