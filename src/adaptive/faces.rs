//! Plane faces that meet in an edge or a corner: which those round a cube are, and what they say about its points.
//!
//! A surface fitted across an edge is none of its faces. Where two or three planes explain the points near a cube as well as the
//! noise allows, they are fitted to these anew, each point counted for each plane as likely as it belongs to it: by
//! expectation and maximization (Dempster, Laird and Rubin, "Maximum likelihood from incomplete data via the EM algorithm",
//! Journal of the Royal Statistical Society B 39 (1977) 1-38).

use super::around::Near;
use super::choose::Chosen;
use super::level::Level;
use super::matrix::Matrix;
use super::surface::plane_of;
use crate::grid::located;
use crate::lanes::{dot, power, transposed};
use crate::lattice::cube_centre;
use crate::normals::SHORT;
use crate::pca::Symmetric;
use glam::{Vec3, Vec4};

/// Faces at the most: hardly any corner has more.
const MOST: usize = 3;

/// A point lies at most so many deviations of the noise off its face, squared: of normal noise one in two thousand lies farther.
const GATE: f32 = 12.0;

/// So many of the cubes' centroids may be left that no face explains: where an edge goes through a cube it lies off both sides.
const LEFT_CENTROIDS: f32 = 0.3;

/// So many of the points. And no face is looked for that would explain no more of the centroids.
const LEFT: f32 = 0.03;

/// A face explains at least so many of either.
const LEAST: f32 = 0.05;

/// A surface with less noise than this, in edges and squared, has none.
pub(super) const CLEAN: f32 = 1e-5;

/// No noise has a deviation of less than 0.0003 edges.
const FLOOR: f32 = 1e-7;

/// Faces have hardly more noise than planes on one side of the edge.
const FIT: f32 = 1.1;

/// The cosine of the least angle between faces: at less one surface may be bent.
const BLUNT: f32 = 0.8;

/// A face ends at another if its centre lies so many deviations of its points off that, squared: it would be 1.7 of them, and 0
/// if it went on beyond.
const SIDE: f32 = 0.4;

/// Faces are fitted to about so many points at the most, and at first to fewer.
const MANY: usize = 4096;
const SOME: usize = 256;

/// `1 / (1 + exp(-1.702 x))` is nearly the share of the standard normal distribution below x.
const LOGISTIC: f32 = 1.702;

/// What is less likely than this counts for no face.
const NEVER: f32 = 1e-3;

/// Where a point of the cube itself is less likely, these are not all faces: it may be on a small body before them.
const FOREIGN: f32 = 1e-6;

/// An end that is nowhere.
const NO_END: Vec4 = Vec4::new(0.0, 0.0, 0.0, 8.0);

/// A plane, and where it ends.
#[derive(Clone, Copy)]
struct Face {
    /// The unit normal, and the height of the origin: a point's height is their product with it and 1.
    plane: Vec4,
    /// The mean of its points, and their covariance.
    centre: Vec3,
    covariance: Matrix,
    /// For each other face, in the same way, how far inside of that one the foot of a point on this one lies.
    ends: [Vec4; MOST - 1],
}

impl Face {
    fn new(plane: Vec4, centre: Vec3, covariance: Matrix) -> Self {
        Self { plane, centre, covariance, ends: [NO_END; MOST - 1] }
    }

    fn normal(&self) -> Vec3 {
        self.plane.truncate()
    }

    /// The variance of its points in a direction.
    fn spread(&self, along: Vec3) -> f32 {
        self.covariance.times(along).dot(along)
    }
}

/// The faces near a cube, against its centre, in edges.
#[derive(Default)]
pub(super) struct Faces {
    all: Vec<Face>,
    /// Variance of the points' distances from them.
    pub noise: f32,
    /// What they are to explain, four at a time: x, y and z.
    places: Vec<Vec4>,
}

impl Faces {
    /// Finds the faces near the cube with bit `bit` of a brick, if there are two or three and nothing else.
    #[optimize(size)]
    #[inline(never)]
    pub fn find(&mut self, level: &Level, bit: u32, near: &[Near], chosen: &[Chosen]) -> bool {
        let noises = near.iter().map(|near| chosen[near.cube as usize].plane_noise);
        // The harmonic mean over those that are planes, because a surface across an edge makes more.
        let (mut planes, mut sum) = (0.0, 0.0);
        for noise in noises.filter(|noise| *noise < f32::INFINITY) {
            planes += 1.0;
            sum += 1.0 / (noise + FLOOR);
        }
        let expected = planes / sum;
        self.noise = expected;
        if sum == 0.0 || !self.choose(near, chosen) {
            return false;
        }
        let count: usize = near.iter().map(|near| level.points(near.cube as usize).len()).sum();
        let stride = 1 + count / MANY;
        self.places.clear();
        for (shift, points) in level.points_near(bit, near) {
            self.places.extend(points.iter().step_by(stride).map(|p| p.lanes() + shift.extend(0.0)));
        }
        self.turn();
        let own =
            near.iter().find(|near| near.step == Vec3::ZERO).map_or(&[][..], |own| level.points(own.cube as usize));
        let stride = 1 + self.places.len() / SOME;
        // Without noise a few tell a plane as well as all.
        let last = if expected < CLEAN { stride } else { 1 };
        [stride, stride, last].into_iter().all(|stride| self.fit(stride) && self.end())
            && self.noise <= FIT * expected
            && own.chunks(4).all(|four| {
                let likelihoods = self.likelihoods(located(four, cube_centre(bit)).0);
                likelihoods.into_iter().sum::<Vec4>().cmpgt(Vec4::splat(FOREIGN)).all()
            })
    }

    /// Chooses among the surfaces of the cubes near by those that explain most of the cubes' centroids: the first face is a
    /// plane where it was fitted, not so what is seen only near an edge.
    #[optimize(size)]
    #[inline(never)]
    fn choose(&mut self, near: &[Near], chosen: &[Chosen]) -> bool {
        let centroid = |near: &Near| near.step + chosen[near.cube as usize].quadric.centre;
        self.places.clear();
        self.places.extend(near.iter().map(|near| centroid(near).extend(0.0)));
        // What fills up the last four is beyond any plane.
        self.places.extend([Vec4::INFINITY; 3]);
        self.turn();
        let (count, mut left) = (near.len() as f32, near.len() as u32);
        let gate = Vec4::splat(GATE * self.noise);
        let explains = |plane: Vec4, &[x, y, z, _]: &[Vec4; 4]| {
            let height = value(plane, [x, y, z]);
            (height * height).cmple(gate)
        };
        self.all.clear();
        while self.all.len() < MOST && left as f32 > LEFT * count {
            let (mut best, mut most) = (None, (LEAST * count) as u32);
            for near in near {
                let surface = &chosen[near.cube as usize];
                let quadric = &surface.quadric;
                let may_be_face =
                    if self.all.is_empty() { surface.plane_noise < f32::INFINITY } else { surface.is_some() };
                if !may_be_face || self.all.iter().any(|other| is_blunt(other.normal(), quadric.slope)) {
                    continue;
                }
                let foot = centroid(near) - quadric.height * quadric.slope;
                let plane = plane(quadric.slope, foot);
                let explained = self.fours().map(|four| explains(plane, four).bitmask().count_ones()).sum();
                if explained > most {
                    (best, most) = (Some((plane, foot)), explained);
                }
            }
            let Some((plane, centre)) = best else { break };
            for four in self.places.as_chunks_mut().0 {
                four[0] = Vec4::select(explains(plane, four), Vec4::INFINITY, four[0]);
            }
            left -= most;
            self.all.push(Face::new(plane, centre, Matrix::default()));
        }
        self.all.len() > 1 && left as f32 <= LEFT_CENTROIDS * count
    }

    /// Puts places four at a time.
    fn turn(&mut self) {
        self.places.as_chunks_mut().0.iter_mut().for_each(|four| *four = transposed(*four));
    }

    fn fours(&self) -> std::slice::Iter<'_, [Vec4; 4]> {
        self.places.as_chunks().0.iter()
    }

    /// For each face the sums over each `stride`th four places of their weights, of x, y, z, xx, yy, zz, yz, xz and xy, and of
    /// their square heights: a place weighs as much as it is likely to be on that face. The last three may be left out.
    #[inline(never)]
    fn sums(&self, stride: usize) -> [[Vec4; 11]; MOST] {
        let mut sums = [[Vec4::ZERO; 11]; MOST];
        for &[x, y, z, _] in self.fours().step_by(stride) {
            let likelihoods = self.likelihoods([x, y, z]);
            let unit = 1.0 / (likelihoods.into_iter().sum::<Vec4>() + NEVER);
            for ((face, likelihood), sums) in self.all.iter().zip(likelihoods).zip(&mut sums) {
                let w = likelihood * unit;
                let height = value(face.plane, [x, y, z]);
                let (wx, wy, wz) = (w * x, w * y, w * z);
                let terms = [w, wx, wy, wz, wx * x, wy * y, wz * z, wy * z, wx * z, wx * y, w * height * height];
                (0..11).for_each(|i| sums[i] += terms[i]);
            }
        }
        sums
    }

    /// Fits every face to its share of each `stride`th four places. Tells whether they explain them still.
    #[optimize(size)]
    #[inline(never)]
    fn fit(&mut self, stride: usize) -> bool {
        let sums = self.sums(stride);
        let total = 4.0 * (self.places.len() / 4).div_ceil(stride) as f32;
        let (mut squares, mut count) = (0.0, 0.0);
        for number in 0..self.all.len() {
            let sums = sums[number].map(|sum| f64::from(sum.element_sum()));
            let [points, .., square] = sums;
            if (points as f32) < (LEAST * total).max(10.0) {
                return false;
            }
            let Some((mean, normal, covariance)) = plane_of(&sums) else { return false };
            let (mut normal, centre) = (normal.as_vec3(), mean.as_vec3());
            if number > 0 {
                // As on an arc from the first one.
                let first = &self.all[0];
                let across = centre - first.centre;
                let (rise, drop) = (across.dot(first.normal()), across.dot(normal));
                if across.length_squared() * first.normal().dot(normal) < 2.0 * rise * drop {
                    normal = -normal;
                }
            }
            let Symmetric { diagonal, off } = covariance;
            let covariance = Matrix { diagonal: diagonal.as_vec3(), off: off.as_vec3() };
            let face = Face::new(plane(normal, centre), centre, covariance);
            // Over the plane before and over this one: rounding blurs the second where there is hardly any noise.
            squares += (square as f32).min(points as f32 * face.spread(normal)).max(0.0);
            count += points as f32;
            self.all[number] = face;
        }
        self.noise = squares / (count - 3.0 * self.all.len() as f32) + FLOOR;
        count >= (1.0 - LEFT) * total
    }

    /// Ends every face at those others that it lies on one side of. Tells whether no two of them may be one surface.
    #[optimize(size)]
    #[inline(never)]
    fn end(&mut self) -> bool {
        for number in 0..self.all.len() {
            let face = self.all[number];
            for i in 1..self.all.len() {
                let other = self.all[(number + i) % self.all.len()];
                let (own, normal) = (face.normal(), other.normal());
                if is_blunt(own, normal) {
                    return false;
                }
                let drop = (face.centre - other.centre).dot(normal);
                if drop * drop > SIDE * face.spread(normal) {
                    let cosine = own.dot(normal);
                    let unit = LOGISTIC / 16.0 / ((1.0 - cosine * cosine) * self.noise).sqrt();
                    self.all[number].ends[i - 1] = (other.plane - cosine * face.plane) * unit.copysign(drop) + Vec4::W;
                }
            }
        }
        true
    }

    /// How likely points come from each face.
    #[inline(never)]
    fn likelihoods(&self, points: [Vec4; 3]) -> [Vec4; MOST] {
        let mut likelihoods = [Vec4::ZERO; MOST];
        for (likelihood, face) in likelihoods.iter_mut().zip(&self.all) {
            let height = value(face.plane, points);
            // Of 64 the root, and of 16 the odds: see `power`.
            let root = 1.0 / (1.0 + height * height * (0.5 / 64.0 / self.noise));
            let (mut inside, mut all) = (Vec4::ONE, Vec4::ONE);
            for end in &face.ends[..self.all.len() - 1] {
                // From one in 65,536 to 500 million to one: what lies farther off either way is as sure.
                let odds = power(value(*end, points).clamp(Vec4::splat(0.5), Vec4::splat(3.5)), 4);
                inside *= odds;
                all *= 1.0 + odds;
            }
            *likelihood = power(root, 6) * inside / all;
        }
        likelihoods
    }

    /// The directions of the normals of four points: between two faces as much of the way as the second one is likely, nearly,
    /// which has the least mean square of the angle.
    #[inline(never)]
    pub fn directions(&self, points: [Vec4; 3]) -> [Vec4; 3] {
        let likelihoods = self.likelihoods(points);
        let unit = 1.0 / likelihoods.into_iter().sum::<Vec4>();
        let mut sum = [Vec4::ZERO; 3];
        for (face, likelihood) in self.all.iter().zip(likelihoods) {
            let share = likelihood * unit;
            // Nearly the sine of a share of a right angle.
            let sine = share * (1.5 - 0.5 * share * share);
            (0..3).for_each(|axis| sum[axis] += sine * face.plane[axis]);
        }
        // Amid a prism three may add up to nothing.
        let is_long = dot(sum, sum).cmpgt(Vec4::splat(SHORT * SHORT));
        std::array::from_fn(|axis| Vec4::select(is_long, sum[axis], Vec4::splat(self.all[0].plane[axis])))
    }
}

/// Whether faces with these normals may be one bent surface.
fn is_blunt(a: Vec3, b: Vec3) -> bool {
    a.dot(b).abs() > BLUNT
}

/// The plane across a unit normal through a place: the height of a point is its product with the point and 1.
fn plane(normal: Vec3, through: Vec3) -> Vec4 {
    normal.extend(-normal.dot(through))
}

/// A linear function at points.
#[inline(always)]
fn value(function: Vec4, [x, y, z]: [Vec4; 3]) -> Vec4 {
    x * function.x + y * function.y + z * function.z + function.w
}

#[cfg(test)]
mod tests {
    use super::super::surface::tests::uniform;
    use super::*;

    /// Points within two and a half edges, each where `place` puts what is drawn from a square of that half width, and off in all
    /// directions by noise of a deviation.
    fn faces(deviation: f32, normals: &[Vec3], place: impl Fn(usize, f32, f32) -> Vec3) -> Faces {
        let mut random = uniform();
        let places = (0..4000)
            .map(|i| {
                let place = place(i, 2.5 * random(), 2.5 * random());
                // The sum of twelve has a variance of four.
                let noise = [(); 3].map(|()| 0.5 * deviation * (0..12).map(|_| random()).sum::<f32>());
                (place + Vec3::from_array(noise)).extend(1.0)
            })
            .collect();
        let all =
            normals.iter().map(|normal| Face::new(plane(*normal, Vec3::ZERO), Vec3::ZERO, Matrix::default())).collect();
        let mut faces = Faces { all, noise: deviation * deviation, places };
        faces.turn();
        faces
    }

    fn direction(faces: &Faces, x: f32, y: f32, z: f32) -> Vec3 {
        Vec3::from_array(faces.directions([x, y, z].map(Vec4::splat)).map(|lanes| lanes.x)).normalize()
    }

    /// The edge of a block, along y, from planes that are six degrees off.
    #[test]
    fn faces_are_found_in_noise_and_end_at_each_other() {
        let block = |i: usize, a: f32, b: f32| {
            if i.is_multiple_of(2) { Vec3::new(-a.abs(), b, 0.0) } else { Vec3::new(0.0, b, -a.abs()) }
        };
        let off = [Vec3::new(0.1, 0.0, 1.0).normalize(), Vec3::new(1.0, -0.1, 0.0).normalize()];
        let mut faces = faces(0.1, &off, block);
        assert!((0..3).all(|_| faces.fit(1) && faces.end()));
        let [top, side] = [0, 1].map(|i| faces.all[i].normal());
        assert!(top.dot(Vec3::Z) > 0.9999 && side.dot(Vec3::X) > 0.9999, "{top}, {side}");
        assert!((faces.noise / 0.01 - 1.0).abs() < 0.1, "{}", faces.noise);
        let tilt = |x: f32, z: f32| direction(&faces, x, 0.3, z).angle_between(Vec3::Z).to_degrees();
        assert!(tilt(-1.0, 0.1) < 3.0 && tilt(0.1, -1.0) > 87.0);
        assert!((tilt(0.0, 0.0) - 45.0).abs() < 3.0);
        // Past the end of the top, though as near to its plane as to the side's.
        assert!(tilt(0.15, -0.15) > 60.0 && tilt(-0.15, 0.15) < 30.0, "{} {}", tilt(0.15, -0.15), tilt(-0.15, 0.15));
    }

    /// A wall on a floor: the floor goes on behind it.
    #[test]
    fn faces_go_on_beyond_others() {
        let floor = |i: usize, a: f32, b: f32| {
            if i.is_multiple_of(3) { Vec3::new(0.0, b, a.abs()) } else { Vec3::new(a, b, 0.0) }
        };
        let mut faces = faces(0.02, &[Vec3::Z, Vec3::X], floor);
        assert!((0..3).all(|_| faces.fit(1) && faces.end()));
        assert_eq!(faces.all[0].ends[0], NO_END);
        assert_ne!(faces.all[1].ends[0], NO_END);
        for x in [-2.0, -0.3, 0.3, 2.0] {
            assert!(direction(&faces, x, 0.0, 0.01).z.abs() > 0.999, "{x}");
        }
        assert!(direction(&faces, 0.01, 0.0, 1.0).x.abs() > 0.999);
    }

    #[test]
    fn what_is_bent_is_no_two_planes() {
        let tube = |_: usize, a: f32, b: f32| Vec3::new(2.0 * a.sin(), b, 2.0 * a.cos() - 1.0);
        let mut faces = faces(0.2, &[Vec3::new(0.7, 0.0, 0.7), Vec3::new(-0.7, 0.0, 0.7)], tube);
        assert!(!(faces.fit(1) && faces.end() && faces.fit(1)) || faces.noise > FIT * 0.04);
        // With less noise they do not even explain the points.
        let explained = |faces: &Faces| faces.sums(1).map(|sums| sums[0].element_sum()).iter().sum::<f32>() / 4000.0;
        faces.noise = 0.0025;
        assert!(explained(&faces) < 1.0 - LEFT, "{}", explained(&faces));
    }

    /// Amid three planes whose normals add up to nothing there still is one.
    #[test]
    fn directions_never_vanish() {
        let normals = [Vec3::X, Vec3::new(-0.5, 0.75f32.sqrt(), 0.0), Vec3::new(-0.5, -0.75f32.sqrt(), 0.0)];
        let faces = faces(0.1, &normals, |_, a, b| Vec3::new(a, b, 0.0));
        assert_eq!(faces.directions([Vec4::ZERO; 3]).map(|lanes| lanes.x), [1.0, 0.0, 0.0]);
    }
}
