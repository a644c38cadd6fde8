//! The normals of the points, interpolated between the nodes round them.

use crate::bricks::set_bits;
use crate::error::Error;
use crate::frame::Frame;
use crate::grid::{Grid, Placed, located, octants};
use crate::lanes::transposed;
use crate::lattice::cube_centre;
use crate::nodes::Node;
use crate::normals::{Found, Normals, SHORT, Writer};
use crate::progress::Stage;
use crate::surroundings::{MIDDLE, Places, Surroundings};
use glam::{Vec3, Vec4, Vec4Swizzles};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Interpolates all points; those outside the grid get the zero vector. One pass over the sorted points.
///
/// If the nodes come with their surface variations, so do the points. Answers also how many points were interpolated from 0
/// to 4 nodes.
pub(crate) fn interpolate(
    grid: &Grid,
    nodes: &[Node],
    variations: Option<&[f32]>,
    count: usize,
    stage: &Stage,
) -> Result<(Found, [u64; 5]), Error> {
    let normals = Normals::new(count, grid.placed.len(), variations.is_some(), &Frame::GIVEN)?;
    let all_used = [const { AtomicU64::new(0) }; 5];
    stage.run(grid.blocks.len(), &|block| {
        let mut surroundings = Surroundings::new();
        let mut good = GoodNodes::NONE;
        let (mut writer, mut tally) = (normals.writer(), Tally::default());
        for brick in grid.blocks[block].clone() {
            surroundings.look(grid, brick);
            good.fill(&surroundings, nodes);
            if let Some(variations) = variations {
                good.add_variations(&surroundings, variations);
            }
            for (cube, (points, bit)) in (grid.first_cube[brick] as usize..).zip(grid.cubes_of(brick)) {
                Cube::new(&good, &nodes[cube], bit).interpolate(points, &mut writer, &mut tally);
            }
        }
        all_used.iter().zip(tally.used).for_each(|(all, used)| _ = all.fetch_add(used, Relaxed));
        normals.add_resolved(tally.resolved);
    })?;
    // SAFETY: the blocks hold every point of the grid.
    let found = unsafe { normals.complete() };
    let mut nodes_used = all_used.map(AtomicU64::into_inner);
    // Points outside the grid were interpolated from no node either.
    nodes_used[0] += (count - grid.placed.len()) as u64;
    Ok((found, nodes_used))
}

/// Counts of points.
#[derive(Default)]
struct Tally {
    /// Interpolated from 0 to 4 nodes.
    used: [u64; 5],
    resolved: u64,
}

/// A node that takes part in the interpolation.
#[derive(Clone, Copy)]
struct GoodNode {
    /// In the brick, in edges. The fourth lane means nothing.
    position: Vec4,
    /// In the fourth lane the surface variation, if it was asked for.
    normal: Vec4,
}

/// The good nodes of the 6x6x6 cubes in and round a brick.
struct GoodNodes {
    there: Places,
    /// By place, also those of occupied cubes that are not good; what stands where there is none is of another brick.
    nodes: [GoodNode; Places::COUNT],
}

impl GoodNodes {
    const NONE: Self =
        Self { there: Places::NONE, nodes: [GoodNode { position: Vec4::ZERO, normal: Vec4::ZERO }; Places::COUNT] };

    fn fill(&mut self, surroundings: &Surroundings, nodes: &[Node]) {
        self.there = surroundings.occupied.filter(|place| {
            let node = &nodes[surroundings.cube(place)];
            let position = Places::centre(place).extend(0.0) + node.position();
            self.nodes[place] = GoodNode { position, normal: node.lanes() };
            node.is_good()
        });
    }

    /// Puts the surface variation of each cube beside its normal; where there is no cube, that of another brick's.
    #[inline(never)]
    fn add_variations(&mut self, surroundings: &Surroundings, variations: &[f32]) {
        for (place, node) in self.nodes.iter_mut().enumerate() {
            node.normal.w = variations[surroundings.cube(place)];
        }
    }
}

/// One of the three ways in which the axes of a cube can be turned.
struct Turn {
    /// The axis of projection, then the two after it, cyclically: "u" and "v".
    axes: [usize; 3],
    /// What lies between two places next to each other along the axis of projection.
    along: usize,
    /// The same for the bits of [`Places::near`].
    along_near: u32,
    /// The bits of the 9 cubes in the middle along the axis of projection.
    middle: u64,
    /// By octant: the columns of its four cubes in that layer, the near and the far one along u, in the near row and in the
    /// far row.
    corners: [[Corner; 4]; 8],
}

/// A column of cubes as an octant sees it.
#[derive(Clone, Copy)]
struct Corner {
    /// The bit of [`Places::near`] of the cube in the middle of the column.
    column: u32,
    /// From the place of the own cube to that one's.
    stride: isize,
}

const TURNS: [Turn; 3] = {
    const fn turn(axes: [usize; 3]) -> Turn {
        let [a, u, v] = axes;
        let (strides, near) = (Places::STRIDES, Places::NEAR_STRIDES);
        let mut corners = [[Corner { column: 0, stride: 0 }; 4]; 8];
        let mut i = 0;
        while i < 32 {
            let (octant, corner) = (i / 4, i % 4);
            // One cube to the side of the octant, for the far ones.
            let step_u = (corner & 1) as isize * if octant >> u & 1 == 1 { 1 } else { -1 };
            let step_v = (corner >> 1) as isize * if octant >> v & 1 == 1 { 1 } else { -1 };
            corners[octant][corner] = Corner {
                column: Places::NEAR_CENTRE.wrapping_add_signed((step_u * near[u] + step_v * near[v]) as i32),
                stride: step_u * strides[u] + step_v * strides[v],
            };
            i += 1;
        }
        let (along, along_near) = (strides[a] as usize, near[a] as u32);
        Turn { axes, along, along_near, middle: MIDDLE[a], corners }
    }
    [turn([0, 1, 2]), turn([1, 2, 0]), turn([2, 0, 1])]
};

/// For the points below or above the centre of a cube along the axis of projection, the nodes of the 9 columns of cubes
/// that lie along it, one bit each, that of the cube in the column's middle.
#[derive(Clone, Copy)]
struct Columns {
    /// Those that have a node.
    there: u64,
    /// Those whose node is in the cube below or above, not in the middle.
    outside: u64,
}

/// All that the points of one cube share.
struct Cube<'a> {
    nodes: &'a GoodNodes,
    bit: u32,
    centre: Vec3,
    /// The normal of the cube's plane, whether or not the cube holds its node; zero if it has none.
    own: Vec4,
    /// So that the own normal is largest along the first axis.
    turn: &'static Turn,
    /// For the points below and above the centre along the axis.
    columns: [Columns; 2],
}

impl<'a> Cube<'a> {
    #[inline(always)]
    fn new(nodes: &'a GoodNodes, own: &Node, bit: u32) -> Self {
        let centre = cube_centre(bit);
        let size = own.normal.abs();
        // By index, because nothing foretells a branch.
        let turn = if (size.z > size.x) & (size.z > size.y) { 2 } else { usize::from(size.y > size.x) };
        let mut cube = Self {
            nodes,
            bit,
            centre,
            own: own.normal.extend(0.0),
            turn: &TURNS[turn],
            columns: [Columns { there: 0, outside: 0 }; 2],
        };
        // Without an own plane there is no axis and no common side: the points take the nearest node.
        if own.has_plane() {
            cube.fill_columns(own.normal.dot(centre) + own.offset);
        }
        cube
    }

    /// Takes from the two cubes of each column the node that lies nearer to the own plane, `own . x = offset`.
    #[inline(always)]
    fn fill_columns(&mut self, offset: f32) {
        let near = self.nodes.there.near(self.bit);
        let Turn { along, along_near, middle, .. } = *self.turn;
        let inside = near & middle;
        let sides = [(near << along_near, along.wrapping_neg()), (near >> along_near, along)];
        for (columns, (outside, along)) in self.columns.iter_mut().zip(sides) {
            let outside = outside & middle;
            *columns = Columns { there: inside | outside, outside: outside & !inside };
            for column in set_bits(inside & outside) {
                let place = Places::of_near(self.bit, column);
                let distance = |place: usize| (self.own.dot(self.nodes.nodes[place].position) - offset).abs();
                // Of planes through the same points, which are the same, rounding must not choose: that on the side of
                // the points does.
                let is_nearer = distance(place.wrapping_add(along)) < distance(place) + 1e-5;
                columns.outside |= u64::from(is_nearer) << column;
            }
        }
    }

    /// Writes the normals of the points of the cube, and their curvature if it was asked for. Those of an octant, which lie
    /// one after the other, share its nodes; four at a time are computed at once.
    #[inline(always)]
    fn interpolate(&self, points: &[Placed], writer: &mut Writer, tally: &mut Tally) {
        for (number, points) in octants(points, self.centre) {
            let Some(octant) = self.octant(number) else {
                tally.used[0] += points.len() as u64;
                for placed in points {
                    let node = self.nearest(placed.local);
                    let normal = node.xyz();
                    tally.resolved += u64::from(normal != Vec3::ZERO);
                    // SAFETY: every point of the input stands in the grid once at the most.
                    unsafe {
                        writer.write(placed.point, normal);
                        writer.write_curvature(placed.point, node.w);
                    }
                }
                continue;
            };
            tally.used[octant.used] += points.len() as u64;
            tally.resolved += points.len() as u64;
            let [_, u, v] = self.turn.axes;
            if writer.has_curvature() {
                // SAFETY: as above.
                unsafe { octant.write_variations(points, u, v, writer) };
            }
            for four in points.chunks(4) {
                let (places, numbers) = located(four, Vec3::ZERO);
                // SAFETY: as above.
                unsafe { writer.write_lanes(numbers, four.len(), octant.normals(places[u], places[v], self.own)) };
            }
        }
    }

    /// The octant with a number whose bits 0, 1 and 2 tell whether it is not below the cube's centre along x, y and z;
    /// `None` if there is no node in its 2x2x2 cubes.
    #[inline(always)]
    fn octant(&self, number: u32) -> Option<Octant> {
        let Turn { axes: [axis, ..], along, .. } = *self.turn;
        let is_above = (number >> axis & 1) as usize;
        let columns = &self.columns[is_above];
        let along = if is_above == 1 { along } else { along.wrapping_neg() };
        let place = Places::of_cube(self.bit);
        let mut there = 0;
        let corners = &self.turn.corners[number as usize];
        let places: [usize; 4] = std::array::from_fn(|i| {
            let Corner { column, stride } = corners[i];
            there |= (columns.there >> column & 1) << i;
            let outside = (columns.outside >> column & 1) as usize;
            place.wrapping_add_signed(stride).wrapping_add(along * outside)
        });
        if there == 0 {
            return None;
        }
        let nodes = STANDINS[there as usize].map(|i| &self.nodes.nodes[places[usize::from(i)]]);
        let [_, u, v] = self.turn.axes;
        let along = |axis: usize| Vec4::from_array(nodes.map(|node| AsRef::<[f32; 4]>::as_ref(&node.position)[axis]));
        let [x, y, z, variations] = transposed(nodes.map(|node| node.normal));
        let side = x * self.own.xxxx() + y * self.own.yyyy() + z * self.own.zzzz();
        let [x, y, z] = [x, y, z].map(|lanes| lanes * Vec4::ONE.copysign(side));
        Some(Octant::new(along(u), [x, y, z, along(v)], variations, there.count_ones() as usize))
    }

    /// The normal of the nearest node in the 27 cubes; without any, that of the own plane, which may be zero. The fourth
    /// lane is that of the node.
    fn nearest(&self, point: Vec3) -> Vec4 {
        let mut nearest = (f32::INFINITY, self.nodes.nodes[Places::of_cube(self.bit)].normal);
        for near in set_bits(self.nodes.there.near(self.bit)) {
            let node = &self.nodes.nodes[Places::of_near(self.bit, near)];
            let distance = node.position.xyz().distance_squared(point);
            if distance < nearest.0 {
                nearest = (distance, node.normal);
            }
        }
        nearest.1
    }
}

/// Which of four nodes (near and far along u, in the near row and in the far row) stands in for each of them, for each set
/// of those that are there: itself, the other of its row, or one of the other row.
const STANDINS: [[u8; 4]; 16] = {
    let mut standins = [[0; 4]; 16];
    let mut place = 4;
    while place < 64 {
        let (there, node) = (place / 4, place % 4);
        let mut other = 0;
        while there >> (node ^ other) & 1 == 0 {
            other += 1;
        }
        standins[there][node] = (node ^ other) as u8;
        place += 1;
    }
    standins
};

/// What the points of one octant of a cube share: the four nodes of their 2x2x2 cubes, by lane: the near and the far one
/// along u, in the near row and in the far row. What holds for a row stands in its first lane.
#[derive(Clone, Copy)]
struct Octant {
    /// The weight of the far node is `scale * u + start`.
    scale: Vec4,
    start: Vec4,
    /// x, y and z of the normals, on the own normal's side, and v.
    values: [Vec4; 4],
    /// What these gain up to the far node.
    gains: [Vec4; 4],
    /// The surface variations, if they were asked for.
    variations: Vec4,
    /// How many of the four there are.
    used: usize,
}

impl Octant {
    /// Of two nodes that coincide along u, as those do that stand in for one another, the mean counts.
    #[inline(always)]
    fn new(u: Vec4, values: [Vec4; 4], variations: Vec4, used: usize) -> Self {
        let length = gains(u);
        let coincide = length.cmpeq(Vec4::ZERO);
        let scale = Vec4::select(coincide, Vec4::ZERO, Vec4::ONE / length);
        let start = Vec4::select(coincide, Vec4::splat(0.5), -u * scale);
        Self { scale, start, values, gains: values.map(gains), variations, used }
    }

    /// The weights of the far nodes of both rows, and of the far row, at four places (paper, Eq. 15 to 17).
    #[inline(always)]
    fn weights(&self, u: Vec4, v: Vec4) -> [Vec4; 3] {
        let near = clamp(u * self.scale.xxxx() + self.start.xxxx());
        let far = clamp(u * self.scale.zzzz() + self.start.zzzz());
        let [a, b] = rows(self.values[3], self.gains[3], near, far);
        let length = b - a;
        let weight = clamp((v - a) / length);
        [near, far, Vec4::select(length.cmpeq(Vec4::ZERO), Vec4::splat(0.5), weight)]
    }

    /// The surface variation at four places.
    #[inline(always)]
    fn variations(&self, u: Vec4, v: Vec4) -> Vec4 {
        mix(self.variations, gains(self.variations), self.weights(u, v))
    }

    /// Writes the surface variation of each point.
    ///
    /// # Safety
    /// At most once for each point.
    // Apart from the normals: beside their loop it cost those who do not ask for it 10 % of the interpolation (wasm). One by
    // one: four at a time are no faster.
    #[inline(never)]
    unsafe fn write_variations(self, points: &[Placed], u: usize, v: usize, writer: &Writer) {
        for point in points {
            let place: &[f32; 3] = point.local.as_ref();
            let variation = self.variations(Vec4::splat(place[u]), Vec4::splat(place[v])).x;
            // SAFETY: by the caller's promise.
            unsafe { writer.write_curvature(point.point, variation) };
        }
    }

    /// x, y and z of the interpolated normals at four places, not yet of unit length; the own normal where the nodes cancel
    /// each other.
    #[inline(always)]
    fn normals(&self, u: Vec4, v: Vec4, own: Vec4) -> [Vec4; 3] {
        let weights = self.weights(u, v);
        let normals: [Vec4; 3] = std::array::from_fn(|i| mix(self.values[i], self.gains[i], weights));
        let [x, y, z] = normals;
        let is_long = (x * x + y * y + z * z).cmpgt(Vec4::splat(SHORT * SHORT));
        if is_long.all() {
            return normals;
        }
        let own = [own.xxxx(), own.yyyy(), own.zzzz()];
        std::array::from_fn(|i| Vec4::select(is_long, normals[i], own[i]))
    }
}

/// How much a value gains from the near node to the far one, in the first lane of each row.
#[inline(always)]
fn gains(lanes: Vec4) -> Vec4 {
    lanes.yyww() - lanes.xxzz()
}

/// A value in both rows at four places, by the weights of their far nodes. `lanes` has those of the four nodes.
#[inline(always)]
fn rows(lanes: Vec4, gains: Vec4, near: Vec4, far: Vec4) -> [Vec4; 2] {
    [lanes.xxxx() + gains.xxxx() * near, lanes.zzzz() + gains.zzzz() * far]
}

/// A value between the four nodes at four places, by weights as [`Octant::weights`] has them.
#[inline(always)]
fn mix(lanes: Vec4, gains: Vec4, [near, far, weight]: [Vec4; 3]) -> Vec4 {
    let [a, b] = rows(lanes, gains, near, far);
    a + (b - a) * weight
}

/// Between 0 and 1.
#[inline(always)]
fn clamp(weight: Vec4) -> Vec4 {
    weight.max(Vec4::ZERO).min(Vec4::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At a node its own value, in the middle the mean, beyond the nodes that of the nearest of the square's sides.
    #[test]
    fn variations_are_mixed_as_normals_are() {
        let (u, v) = (Vec4::new(0.0, 1.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 2.0, 2.0));
        let (variations, [x, y, z]) =
            (Vec4::new(0.1, 0.2, 0.3, 0.2), [Vec4::X, Vec4::Y, Vec4::new(0.0, 0.0, 1.0, 1.0)]);
        let octant = Octant::new(u, [x, y, z, v], variations, 4);
        assert_eq!(octant.variations(u, v), variations);
        assert_eq!(octant.normals(u, v, Vec4::ZERO), [x, y, z]);
        let (u, v) = (Vec4::new(0.5, 0.5, -7.0, 7.0), Vec4::new(1.0, -7.0, 1.0, 1.0));
        assert!(octant.variations(u, v).abs_diff_eq(Vec4::new(0.2, 0.15, 0.2, 0.2), 1e-6));
    }
}
