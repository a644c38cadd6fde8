//! One neighbourhood: its moments, their shift by whole cubes, and the plane that fits it best.

use bytemuck::Zeroable;
use glam::{DMat3, DVec3, Vec3, Vec4, Vec4Swizzles};

/// A neighbourhood whose second eigenvalue is below this (in square edges, and against the first) lies on one line
/// or in one point: 1e-6 is three times the rounding of single-precision moments, a thousandth of an edge in length.
const LINE: f64 = 1e-6;

/// The plane that fits a neighbourhood best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    /// The mean of the points (paper, Eq. 5).
    pub centroid: Vec3,
    /// The unit normal (Eq. 6). Its sign is arbitrary but the same for the same sums.
    pub normal: Vec3,
    /// The surface variation `lambda3 / (lambda1 + lambda2 + lambda3)` of Pauly, Gross and Kobbelt, "Efficient
    /// simplification of point-sampled surfaces", 2002: from 0 for points on a plane to 1/3 where no direction stands out.
    pub variation: f32,
}

/// Ten sums over the points of a cube, relative to its centre and in units of its edge.
///
/// Single precision is enough: the coordinates stay within 1.5 even after a shift, so the covariance is off by some
/// 1e-7 square edges, and the normal by some 1e-6 radians.
#[derive(Clone, Copy, Debug, PartialEq, Zeroable)]
pub(crate) struct Moments {
    /// Sums of x, y and z, and the count.
    pub sums: Vec4,
    /// Sums of xx, yy and zz, and a zero: four lanes add as fast as three.
    pub squares: Vec4,
    /// Sums of yz, xz and xy, and a zero.
    pub products: Vec4,
}

impl Moments {
    /// The sums of some points. Adds in double precision, so that a cube may hold any number of points.
    pub fn of(points: impl Iterator<Item = Vec3>) -> Self {
        let (mut count, mut sum) = (0u32, DVec3::ZERO);
        let (mut squares, mut products) = (DVec3::ZERO, DVec3::ZERO);
        for point in points {
            let p = point.as_dvec3();
            count += 1;
            sum += p;
            squares += p * p;
            products += DVec3::new(p.y * p.z, p.x * p.z, p.x * p.y);
        }
        Self {
            sums: sum.as_vec3().extend(count as f32),
            squares: squares.as_vec3().extend(0.0),
            products: products.as_vec3().extend(0.0),
        }
    }

    /// Adds the sums of the cube that lies `step` cubes away, shifted into this cube's coordinates. The last of the four
    /// lanes of `step` is zero.
    #[inline(always)]
    pub fn add_shifted(&mut self, other: &Self, step: Vec4) {
        let Self { sums, squares, products } = *other;
        let shifted = sums + step * sums.wwww();
        self.sums += shifted;
        self.squares += squares + step * (sums + shifted);
        self.products += products + step.yxxw() * shifted.zzyw() + step.zzyw() * sums.yxxw();
    }

    /// The plane of the points; `None` for fewer than three, and for points on one line.
    #[inline(always)]
    pub fn plane(&self) -> Option<Plane> {
        let count = self.sums.w;
        if count < 3.0 {
            return None;
        }
        // Times the square of the count: in double precision these products are exact, and so is a plane along the axes.
        let (n, s) = (f64::from(count), self.sums.xyz().as_dvec3());
        let diagonal = n * self.squares.xyz().as_dvec3() - s * s;
        let off = n * self.products.xyz().as_dvec3() - DVec3::new(s.y * s.z, s.x * s.z, s.x * s.y);
        let covariance = Symmetric { diagonal, off };
        let smallest = covariance.smallest_eigenvalue();
        let normal = covariance.normal(smallest, n * n)?.as_vec3();
        // Of points nearly on a line rounding may leave less than nothing.
        let variation = (smallest / diagonal.element_sum()).max(0.0) as f32;
        Some(Plane { centroid: (s / n).as_vec3(), normal, variation })
    }
}

/// A symmetric 3x3 matrix, positive semidefinite up to rounding.
pub(crate) struct Symmetric {
    /// xx, yy, zz.
    pub diagonal: DVec3,
    /// yz, xz, xy.
    pub off: DVec3,
}

impl Symmetric {
    /// The unit eigenvector of the `smallest` eigenvalue, unless the second eigenvalue vanishes too, also against
    /// `unit`, a square edge.
    ///
    /// The adjugate of `A - lambda3` has the wanted vector in each of its columns, times what its own component there
    /// says: the column with the largest diagonal is never short while the second eigenvalue stands apart.
    #[inline(always)]
    pub fn normal(&self, smallest: f64, unit: f64) -> Option<DVec3> {
        let trace = self.diagonal.element_sum();
        // lambda1 + lambda2 and lambda1 * lambda2, and from them a lower bound of lambda2 = product / lambda1.
        let sum = trace - smallest;
        let product = (self.minors() - smallest * sum).max(0.0);
        // Of points in one place both are rounding, of either sign.
        if product <= LINE * sum.abs() * sum.max(unit) {
            return None;
        }
        let (d, o) = (self.diagonal - smallest, self.off);
        let x = d.y * d.z - o.x * o.x;
        let y = d.x * d.z - o.y * o.y;
        let z = d.x * d.y - o.z * o.z;
        let (yz, xz, xy) = (o.y * o.z - d.x * o.x, o.x * o.z - d.y * o.y, o.x * o.y - d.z * o.z);
        // By index, because nothing foretells a branch.
        let columns = [DVec3::new(x, xy, xz), DVec3::new(xy, y, yz), DVec3::new(xz, yz, z)];
        let longest = if (z > x) & (z > y) { 2 } else { usize::from(y > x) };
        // Isotropic: every direction is an eigenvector, and A - lambda3 has no rows left.
        Some(columns[longest].try_normalize().unwrap_or(DVec3::Z))
    }

    /// All nine entries.
    pub fn matrix(&self) -> DMat3 {
        let (d, o) = (self.diagonal, self.off);
        DMat3::from_cols(DVec3::new(d.x, o.z, o.y), DVec3::new(o.z, d.y, o.x), DVec3::new(o.y, o.x, d.z))
    }

    /// The sum of the principal 2x2 minors.
    fn minors(&self) -> f64 {
        let (d, o) = (self.diagonal, self.off);
        d.y * d.z - o.x * o.x + d.x * d.z - o.y * o.y + d.x * d.y - o.z * o.z
    }

    fn determinant(&self) -> f64 {
        let (d, o) = (self.diagonal, self.off);
        d.x * (d.y * d.z - o.x * o.x) - o.z * (o.z * d.z - o.x * o.y) + o.y * (o.z * o.x - d.y * o.y)
    }

    /// The smallest root of the characteristic polynomial, by Halley's method from zero.
    ///
    /// Left of the smallest root of a polynomial with real roots only, the steps rise towards the root and never pass it.
    /// Each cubes the error: planar neighbourhoods take one or two. The bound serves nearly isotropic ones, whose normal means
    /// little. No trigonometry: the same bits on every platform.
    #[inline(always)]
    pub fn smallest_eigenvalue(&self) -> f64 {
        let (trace, minors, determinant) = (self.diagonal.element_sum(), self.minors(), self.determinant());
        // Between half of lambda2 and twice it.
        let second = minors / trace;
        let mut root = 0.0;
        for _ in 0..24 {
            let value = ((trace - root) * root - minors) * root + determinant;
            let slope = (2.0 * trace - 3.0 * root) * root - minors;
            let bend = trace - 3.0 * root;
            if value <= 0.0 || slope >= 0.0 {
                break;
            }
            let step = value * slope / (value * bend - slope * slope);
            root += step;
            // Far below lambda2 a step that starts e below the root ends 3 e^3 / lambda2^2 below it: here that is far less than
            // the error of the moments.
            if root <= 1e-3 * second || step <= 1e-5 * second {
                break;
            }
        }
        root
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Single precision counts by ones to 2^24 only.
    #[test]
    fn a_cube_may_hold_any_number_of_points() {
        let corners = [Vec3::new(-0.4, -0.3, 0.1), Vec3::new(0.4, -0.3, 0.1), Vec3::new(0.0, 0.3, 0.1)];
        let few = Moments::of(corners.into_iter());
        let many = Moments::of(corners.into_iter().cycle().take(18_000_000));
        assert_eq!(many.sums.w, 18e6);
        let (few, many) = (few.plane().unwrap(), many.plane().unwrap());
        assert!(few.centroid.distance(many.centroid) < 1e-6, "{few:?} {many:?}");
        assert!(few.normal.distance(many.normal) < 1e-6, "{few:?} {many:?}");
    }

    /// Rounding, which is all that there is across this line, makes its least eigenvalue negative.
    #[test]
    fn no_variation_is_less_than_none() {
        let steps = [
            [0.0, 0.0, 0.0],
            [0.08616829, -0.19345093, 0.32818604],
            [-0.08616829, 0.19346619, -0.32824707],
            [0.17233849, -0.3869171, 0.6564331],
            [-0.17233658, 0.38693237, -0.65649414],
            [0.25850677, -0.5803833, 0.9846802],
            [-0.25850677, 0.5803833, -0.9846802],
            [0.34467506, -0.7738342, 1.3129272],
            [-0.34467506, 0.7738495, -1.3129272],
        ];
        let plane = Moments::of(steps.into_iter().map(Vec3::from_array)).plane().unwrap();
        assert_eq!(plane.variation, 0.0);
    }

    #[test]
    fn points_on_a_line_and_in_one_place_have_no_plane() {
        let line = |step: Vec3| Moments::of((0..100).map(|i| step * (i as f32 / 100.0 - 0.5)));
        for step in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(0.5, -0.7, 0.3), Vec3::ZERO] {
            assert_eq!(line(step).plane(), None, "{step}");
        }
        // Rounding makes the covariance of four of these negative.
        let place = Vec3::new(0.16168785, -0.4859402, -0.3734617);
        for count in 1..100 {
            assert_eq!(Moments::of([place].into_iter().cycle().take(count)).plane(), None, "{count} points");
        }
    }
}
