//! Plane faces too narrow for any surface, told by the points themselves where these lie on them without noise.
//!
//! A surface takes some twenty points, and on the rib of a machine part or in a groove these never lie on one face. Where the
//! cloud has no noise, as points sampled on a model do, hardly any plane through a point and two others meets a fourth one by
//! chance: the plane that most points lie on is the point's face (Fischler and Bolles, "Random sample consensus: a paradigm for
//! model fitting with applications to image analysis and automated cartography", Communications of the ACM 24 (1981) 381-395,
//! with the points next to it in place of random ones).

use super::around::{Around, Near};
use super::choose::Chosen;
use super::level::Level;
use crate::grid::Placed;
use crate::lanes::{dot, load, transposed};
use crate::lattice::cube_centre;
use crate::median;
use crate::points::spread;
use glam::{Vec3, Vec3Swizzles, Vec4};
use std::ops::Range;

/// A surface with more noise than this, in edges and squared, may lie across an edge.
pub(super) const TORN: f32 = 0.0064;

/// A point lies on a plane that is no further away than this, in edges, squared: some thirteen times the rounding of single
/// precision in a cloud of a million points, and far less than any scanner's noise.
const ON: f32 = 1e-7;

/// And nearly on one ten times as far away: a plane through points of two sheets, or of one that bends, has more of these.
const NEARLY: f32 = 100.0 * ON;

/// Neighbourhoods of more points are left to the surfaces, and of what these leave in doubt so many next to it are looked at, in
/// neighbourhoods that are not larger still.
const ROOM: usize = 64;
const ROOM_IN_DOUBT: usize = 4096;

/// Planes go through the point that is asked about, one of so many points next to it, and one of so many; at least one more of
/// the nearer half of these lies on them.
const FIRSTS: usize = 8;
const NEXT: usize = 24;
const OTHERS: f32 = 3.0;

/// It is not worth while to look for a plane with more of them.
const ENOUGH: f32 = 5.0;

/// The two lie in directions that differ by more than this, the square of a sine.
const APART: f32 = 0.09;

/// So many points lie on a face besides the one that is asked about, and such a share of all near the cube, because rows of a
/// scanner are no chance.
const LEAST: f32 = 6.0;
const SHARE: f32 = 0.2;

/// So many do in an exact cloud, whatever their share: with six there are some where balls touch, too.
const LEAST_EXACT: f32 = 7.0;

/// They lie in a strip no narrower than a sixth of its length: the sum of the principal minors of the second moments about their
/// mean, as a share of their trace squared.
const WIDE: f32 = 0.03;

/// Nor in rows: no other one lies in the row of the point and the one next to it, or in an exact cloud, where some do by chance
/// only, no more than such a share, in a row so wide, in edges and squared.
const ROWS: f32 = 1.0 / 12.0;
const IN_ROW: f32 = ON / 16.0;

/// A normal is doubtful where fewer than so many of the first points next to it are across it to 0.003: on one of the two
/// faces of an edge half of them are.
const ACROSS: usize = 3;
const FLAT: f32 = 0.003;

/// What is left in doubt lies on a plane with so many more points than lie nearly on it.
const CLEAR: f32 = 4.0;

/// A cloud is exact where one in eight of some points is in a cube whose points lie off their surface by less than this, in
/// edges: far less than any noise, and more than what is left of a smooth surface.
const EXACT: f32 = 0.001;

/// Cubes of fewer points tell nothing of that.
const TELLING: usize = 8;

/// Whether points lie exactly on surfaces in a part of the cloud at least: from how far apart they are across the surface of
/// their cube, one next to the other, so that both sides of a thin wall in one cube are no noise. Where that surface is none of
/// these sides a face of one of the points tells, if half of them are in such cubes: where coordinates were rounded a fifth are.
#[inline(never)]
pub(super) fn are_exact(level: &Level, chosen: &[Chosen]) -> bool {
    /// Bricks to look at.
    const BRICKS: usize = 16;
    const POINTS: f32 = 32.0;
    let grid = &level.grid;
    let (mut gaps, mut facets) = (Vec::new(), Facets::new(true));
    // How many points there are, in cubes that are exact, and in those where a point has a face.
    let (mut all, mut exact, mut on_faces) = (0.0, 0.0, 0.0);
    for brick in spread(grid.bricks.len(), BRICKS) {
        for (cube, (points, bit)) in (grid.first_cube[brick] as usize..).zip(grid.cubes_of(brick)) {
            if points.len() < TELLING || !chosen[cube].is_some() {
                continue;
            }
            let centre = cube_centre(bit);
            gaps.clear();
            gaps.extend(points.iter().map(|p| chosen[cube].quadric.at(p.local - centre).1));
            // In edges of a cube that has as many points as those of the base have.
            let count = points.len() as f32;
            all += count;
            if median::deviation(&mut gaps) * (count / POINTS).sqrt() < EXACT {
                exact += count;
            } else if chosen[cube].noise > TORN && facets.has_face(points, centre) {
                on_faces += count;
            }
        }
    }
    all > 0.0 && (8.0 * exact >= all || 2.0 * (exact + on_faces) >= all)
}

/// What lies round the point that is asked about.
pub(super) struct Facets {
    /// Whether the cloud is exact ([`are_exact`]).
    exact: bool,
    /// What lies between it and each of the others in some cubes.
    offsets: Vec<Vec3>,
    /// The nearest first, each with the square of its distance.
    next: [Vec4; NEXT],
    /// All of them, lane by lane.
    lanes: Vec<[Vec4; 3]>,
    /// What lies between it and those about the farthest one of its plane.
    afar: Vec<Vec3>,
}

impl Facets {
    pub fn new(exact: bool) -> Self {
        Self { exact, offsets: Vec::new(), next: [Vec4::INFINITY; NEXT], lanes: Vec::new(), afar: Vec::new() }
    }

    /// The normal of the face that a point of a cube, the one with bit `bit` of a brick, lies on, if the points round that tell
    /// one.
    #[inline(never)]
    pub fn normal(&mut self, level: &Level, brick: usize, bit: u32, around: &mut Around, point: Vec3) -> Option<Vec3> {
        let room = if self.exact { ROOM_IN_DOUBT } else { ROOM };
        let all = gather(level, bit, around.near(&level.grid, brick, bit, 1), point, room, |_| true, &mut self.offsets);
        self.sort();
        if all.is_none_or(|all| all > ROOM) {
            return None;
        }
        let mut lanes = [[0.0; NEXT]; 3];
        for (i, place) in self.next.iter().enumerate() {
            (0..3).for_each(|axis| lanes[axis][i] = place[axis]);
        }
        let least = self.least(self.offsets.len());
        let (mut most, mut best, mut tried) = (OTHERS, None, 0.0);
        for (i, a) in self.next[..FIRSTS].iter().enumerate() {
            for (j, b) in (i + 1..).zip(&self.next[i + 1..]) {
                let normal = a.truncate().cross(b.truncate());
                let square = normal.length_squared();
                // Nor where there is none.
                if square > APART * a.w * b.w {
                    let closer = on(&lanes, 0..NEXT / 2, normal, ON * square);
                    if closer < if j < NEXT / 2 { 3.0 } else { 2.0 } {
                        continue;
                    }
                    let count = closer + on(&lanes, NEXT / 2..NEXT, normal, ON * square);
                    if count >= most {
                        (most, best) = (count + 1.0, Some(normal / square.sqrt()));
                    }
                }
            }
            if most > ENOUGH.max(tried) {
                if best.is_some_and(|normal| is_face(&self.offsets, normal, least, self.exact)) {
                    return best;
                }
                if !self.exact {
                    break;
                }
                // Next to an edge it may go through points of the face beyond; its own has more.
                tried = most;
            }
        }
        let normal = best?;
        if most <= ENOUGH && is_face(&self.offsets, normal, least, self.exact) {
            return best;
        }
        // Where it ends it may have too few points in the 27 cubes.
        let near = around.near(&level.grid, brick, bit, 2);
        let all =
            gather(level, bit, near, point, usize::MAX, |offset| is_nearly_on(offset, normal), &mut self.offsets)?;
        is_face(&self.offsets, normal, self.least(all), self.exact).then_some(normal)
    }

    /// Whether hardly a point next to the one that was asked about lies where it should, if that has a normal of this direction:
    /// only in exact clouds, because elsewhere no plane would tell more.
    pub fn is_doubtful(&self, direction: Vec3) -> bool {
        let limit = FLAT * FLAT * direction.length_squared();
        let is_across = |place: &&Vec4| place.truncate().dot(direction).powi(2) <= limit * place.w;
        self.exact && self.next[..FIRSTS].iter().filter(is_across).count() < ACROSS
    }

    /// The same for a point that is left in doubt, as at the tip of a face or on a narrow one: of all planes through it and two
    /// of those next to it in the 125 cubes.
    #[inline(never)]
    pub fn hidden(&mut self, level: &Level, brick: usize, bit: u32, around: &mut Around, point: Vec3) -> Option<Vec3> {
        let near = around.near(&level.grid, brick, bit, 2);
        gather(level, bit, near, point, ROOM_IN_DOUBT, |_| true, &mut self.offsets)?;
        if self.offsets.len() > ROOM {
            let farther = |a: &Vec3, b: &Vec3| a.length_squared().total_cmp(&b.length_squared());
            self.offsets.select_nth_unstable_by(ROOM, farther);
            self.offsets.truncate(ROOM);
        }
        self.sort();
        self.lanes.clear();
        self.lanes.extend(self.offsets.chunks(4).map(|four| {
            let place = |lane: usize| four.get(lane).map_or(Vec4::INFINITY, |offset| offset.extend(0.0));
            let [x, y, z, _] = transposed([0, 1, 2, 3].map(place));
            [x, y, z]
        }));
        let (mut most, mut best) = (CLEAR, None);
        let next = self.next;
        for (i, a) in next.iter().enumerate() {
            for b in &next[i + 1..] {
                let normal = a.truncate().cross(b.truncate());
                let square = normal.length_squared();
                // Nor where there is none.
                if square > APART * a.w * b.w {
                    let clear = clear(&self.lanes, normal, square);
                    let normal = normal / square.sqrt();
                    if clear >= most {
                        most = clear + 1.0;
                        if is_face(&self.offsets, normal, LEAST_EXACT, self.exact)
                            || self.is_face_from_afar(level, brick, bit, around, point, normal)
                        {
                            best = Some(normal);
                        }
                    }
                }
            }
        }
        best
    }

    /// Whether the point of a cube next to its centre lies on a face of others of these, through two next to it.
    fn has_face(&mut self, points: &[Placed], centre: Vec3) -> bool {
        let square = |p: &&Placed| p.local.distance_squared(centre);
        let Some(point) = points.iter().min_by(|a, b| square(a).total_cmp(&square(b))) else { return false };
        let offsets = points.iter().map(|p| p.local - point.local);
        self.offsets.clear();
        self.offsets.extend(offsets.filter(|offset| *offset != Vec3::ZERO));
        self.sort();
        let next = &self.next[..FIRSTS];
        let pairs = next.iter().enumerate().flat_map(|(i, a)| next[i + 1..].iter().map(move |b| (a, b)));
        // As if the cloud were not exact: it is asked to tell whether it is.
        pairs.into_iter().any(|(a, b)| {
            let normal = a.truncate().cross(b.truncate());
            let square = normal.length_squared();
            square > APART * a.w * b.w && is_face(&self.offsets, normal / square.sqrt(), LEAST_EXACT, false)
        })
    }

    /// Whether those on a plane are a face from where the farthest of them is: where a face ends it has few points.
    fn is_face_from_afar(
        &mut self,
        level: &Level,
        brick: usize,
        bit: u32,
        around: &mut Around,
        point: Vec3,
        normal: Vec3,
    ) -> bool {
        let on = self.offsets.iter().filter(|offset| offset.dot(normal).powi(2) <= ON);
        let Some(farthest) = on.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared())) else { return false };
        let step = (point + *farthest + 0.5).floor();
        let Some((brick, bit)) = level.find(level.place(brick, bit) + step.as_ivec3()) else { return false };
        let (near, point) = (around.near(&level.grid, brick, bit, 2), point - step);
        let keep = |offset| is_nearly_on(offset, normal);
        gather(level, bit, near, point, ROOM_IN_DOUBT, keep, &mut self.afar).is_some()
            && is_face(&self.afar, normal, LEAST_EXACT, self.exact)
    }

    /// How many points a face has, of so many near the cube.
    fn least(&self, all: usize) -> f32 {
        if self.exact { LEAST_EXACT } else { LEAST.max(SHARE * all as f32) }
    }

    /// Finds those next to the point.
    fn sort(&mut self) {
        self.next = [Vec4::INFINITY; NEXT];
        for offset in &self.offsets {
            let square = offset.length_squared();
            let mut i = NEXT;
            while i > 0 && square < self.next[i - 1].w {
                i -= 1;
                if i + 1 < NEXT {
                    self.next[i + 1] = self.next[i];
                }
                self.next[i] = offset.extend(square);
            }
        }
    }
}

/// What lies between a point and those of the others in some cubes near one that are to be kept, unless these have more points
/// than there is room for. Answers how many others there are.
#[inline(always)]
fn gather(
    level: &Level,
    bit: u32,
    near: &[Near],
    point: Vec3,
    room: usize,
    keep: impl Fn(Vec3) -> bool,
    offsets: &mut Vec<Vec3>,
) -> Option<usize> {
    offsets.clear();
    let all = near.iter().map(|near| level.points(near.cube as usize).len()).sum::<usize>();
    if all > room {
        return None;
    }
    for (shift, points) in level.points_near(bit, near) {
        for p in points {
            // In this order, so that it is zero for the point itself.
            let offset = p.local + shift - point;
            if offset != Vec3::ZERO && keep(offset) {
                offsets.push(offset);
            }
        }
    }
    Some(all - 1)
}

/// How many more points lie on a plane than nearly on it; the square of its normal's length is `square`.
fn clear(offsets: &[[Vec4; 3]], normal: Vec3, square: f32) -> f32 {
    let normal = normal.to_array().map(Vec4::splat);
    let (on, nearly) = (Vec4::splat(ON * square), Vec4::splat(NEARLY * square));
    let mut sum = Vec4::ZERO;
    for &four in offsets {
        let height = dot(four, normal);
        let height = height * height;
        let others = Vec4::select(height.cmple(nearly), Vec4::NEG_ONE, Vec4::ZERO);
        sum += Vec4::select(height.cmple(on), Vec4::ONE, others);
    }
    sum.element_sum()
}

/// Whether a point lies on a plane, or nearly so.
#[inline(always)]
fn is_nearly_on(offset: Vec3, normal: Vec3) -> bool {
    offset.dot(normal).powi(2) <= NEARLY
}

/// Whether those that lie on a plane are a face, and neither a cut through something else, a narrow strip nor rows: any two rows
/// of a scanner, or of coordinates that were rounded, lie in a plane.
#[inline(never)]
fn is_face(offsets: &[Vec3], normal: Vec3, least: f32, exact: bool) -> bool {
    let (mut points, mut nearly) = (0.0, 0.0);
    let (mut sum, mut diagonal, mut off, mut next) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, Vec3::INFINITY);
    for &d in offsets {
        let height = d.dot(normal);
        if height * height <= ON {
            points += 1.0;
            sum += d;
            diagonal += d * d;
            off += d.yzx() * d.zxy();
            next = if d.length_squared() < next.length_squared() { d } else { next };
        } else if height * height <= NEARLY {
            nearly += 1.0;
        }
    }
    if points < least || 2.0 * nearly > points {
        return false;
    }
    // With the point itself, wherever on the face it lies.
    let mean = sum / (points + 1.0);
    diagonal -= mean * sum;
    off -= mean.yzx() * sum.zxy();
    let trace = diagonal.element_sum();
    let minors = diagonal.dot(diagonal.yzx()) - off.length_squared();
    // The next one is in its own row.
    let (width, share) = if exact { (IN_ROW, ROWS) } else { (ON, 0.0) };
    let is_in_row = |d: &&Vec3| next.cross(**d).length_squared() <= width * next.length_squared();
    minors >= WIDE * trace * trace && offsets.iter().filter(is_in_row).count() as f32 <= 1.0 + share * points
}

/// How many points of a range, their x, y and z, have a product with `normal` of at most `limit`, squared.
#[inline(always)]
fn on(points: &[[f32; NEXT]; 3], range: Range<usize>, normal: Vec3, limit: f32) -> f32 {
    let normal = normal.to_array().map(Vec4::splat);
    let mut count = Vec4::ZERO;
    for i in range.step_by(4) {
        let height = dot(points.each_ref().map(|numbers| load(&numbers[i..])), normal);
        count += Vec4::select((height * height).cmple(Vec4::splat(limit)), Vec4::ONE, Vec4::ZERO);
    }
    count.element_sum()
}

#[cfg(test)]
mod tests {
    use super::super::surface::tests::uniform;
    use super::*;

    /// Of 24 points in a square round the origin, so high over it: whether they are a face.
    fn is_face_of(place: impl FnMut(usize, &mut dyn FnMut() -> f32) -> Vec3) -> bool {
        is_face_in(false, place)
    }

    /// The same in a cloud that is exact, or none.
    fn is_face_in(exact: bool, mut place: impl FnMut(usize, &mut dyn FnMut() -> f32) -> Vec3) -> bool {
        let mut uniform = uniform();
        let offsets: Vec<Vec3> = (0..24).map(|i| place(i, &mut uniform)).collect();
        is_face(&offsets, Vec3::Z, Facets::new(exact).least(offsets.len()), exact)
    }

    #[test]
    fn a_face_is_wide_and_without_noise_or_rows() {
        assert!(is_face_of(|_, uniform| Vec3::new(uniform(), uniform(), 0.0)));
        // Half of the points on another face.
        assert!(is_face_of(|i, uniform| Vec3::new(uniform(), uniform(), (i % 2) as f32 * uniform())));
        let share =
            |share: usize| is_face_of(|i, u| Vec3::new(u(), u(), if i % share == 0 { 0.0 } else { 0.1 + u().abs() }));
        assert!(share(3) && !share(6));
        assert!(!is_face_of(|_, uniform| Vec3::new(uniform(), uniform(), 0.01 * uniform())));
        assert!(!is_face_of(|_, uniform| Vec3::new(uniform(), 0.1 * uniform(), 0.0)));
        assert!(!is_face_of(|i, uniform| Vec3::new(uniform(), (i % 2) as f32, 0.0)), "rows");
        let lattice = |i: usize| Vec3::new((i % 5) as f32 - 2.0, (i / 5 + 1) as f32 - 2.0, 0.0);
        assert!(!is_face_of(|i, _| lattice(i)), "a lattice");
    }

    /// In an exact cloud one of some twenty points is in line with the next one now and then, in rows many are.
    #[test]
    fn a_face_is_no_row_for_one_point_in_line() {
        let in_line = |i: usize, u: &mut dyn FnMut() -> f32| match i {
            0 => Vec3::new(0.01, 0.02, 0.0),
            1 => Vec3::new(0.3, 0.6, 0.0),
            _ => Vec3::new(u(), u(), 0.0),
        };
        assert!(is_face_in(true, in_line) && !is_face_in(false, in_line));
        assert!(!is_face_in(true, |i, uniform| Vec3::new(uniform(), (i % 2) as f32, 0.0)));
    }

    /// The tip of a blade, whose faces meet at 28 degrees, seen from there.
    #[test]
    fn a_face_is_as_wide_as_it_is_wherever_it_is_seen_from() {
        let tip = |_: usize, uniform: &mut dyn FnMut() -> f32| {
            let along = (0.5 + 0.5 * uniform()).sqrt();
            Vec3::new(along, 0.25 * along * uniform(), 0.0)
        };
        assert!(is_face_of(tip));
    }

    /// A plane through a point just beside a face, and two of its points, goes through others next to the line between these.
    #[test]
    fn a_plane_that_many_more_points_nearly_lie_on_is_no_face() {
        let tilted = |height: f32| is_face_of(|i, u| Vec3::new(u(), u(), if i % 3 == 0 { 0.0 } else { height }));
        assert!(tilted(0.1) && !tilted(0.002));
    }
}
