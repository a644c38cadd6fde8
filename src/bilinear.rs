//! The normals of the points, interpolated between the nodes round them.

use crate::error::Error;
use crate::grid::{Grid, Placed, Places, STEPS, Surroundings};
use crate::lattice::{cube_centre, octant_in_brick};
use crate::nodes::Node;
use crate::normals::Normals;
use crate::progress::Stage;
use glam::{Vec3, Vec4, Vec4Swizzles};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Interpolates all points; those outside the grid get the zero vector. One pass over the sorted points.
///
/// Answers the normals, how many points are resolved, and how many were interpolated from 0 to 4 nodes.
pub(crate) fn interpolate(
    grid: &Grid,
    nodes: &[Node],
    count: usize,
    stage: &Stage,
) -> Result<(Vec<f32>, u64, [u64; 5]), Error> {
    let normals = Normals::new(count, grid.placed.len())?;
    let all_used = [const { AtomicU64::new(0) }; 5];
    stage.run(grid.blocks.len(), &|block| {
        let mut surroundings = Surroundings::new();
        let mut good = GoodNodes::NONE;
        let (mut used, mut resolved) = ([0; 5], 0);
        for brick in grid.blocks[block].clone() {
            surroundings.look(grid, brick);
            good.fill(&surroundings, nodes);
            for (cube, (points, bit)) in (grid.first_cube[brick] as usize..).zip(grid.cubes_of(brick)) {
                Cube::new(&good, nodes[cube], bit).interpolate(points, |normal, count, point| {
                    used[count] += 1;
                    resolved += u64::from(normal != Vec3::ZERO);
                    // SAFETY: every point of the input stands in the grid once at the most.
                    unsafe { normals.write(point, normal) };
                });
            }
        }
        all_used.iter().zip(used).for_each(|(all, used)| _ = all.fetch_add(used, Relaxed));
        normals.add_resolved(resolved);
    })?;
    // SAFETY: the blocks hold every point of the grid.
    let (normals, resolved) = unsafe { normals.complete() };
    let mut nodes_used = all_used.map(AtomicU64::into_inner);
    // Points outside the grid were interpolated from no node either.
    nodes_used[0] += (count - grid.placed.len()) as u64;
    Ok((normals, resolved, nodes_used))
}

/// A node that takes part in the interpolation.
#[derive(Clone, Copy)]
struct GoodNode {
    /// In the brick, in edges.
    position: Vec3,
    /// Zero where there is no such node.
    normal: Vec3,
}

/// The good nodes of the 6x6x6 cubes in and round a brick, in the order of [`Surroundings`].
struct GoodNodes([GoodNode; Places::COUNT]);

impl GoodNodes {
    const NONE: Self = Self([GoodNode { position: Vec3::ZERO, normal: Vec3::ZERO }; Places::COUNT]);

    fn fill(&mut self, surroundings: &Surroundings, nodes: &[Node]) {
        for good in &mut self.0 {
            good.normal = Vec3::ZERO;
        }
        for place in surroundings.occupied.iter() {
            let node = nodes[surroundings.cube(place)];
            if node.is_good() {
                self.0[place] = GoodNode { position: Places::centre(place) + node.position(), normal: node.normal };
            }
        }
    }
}

/// All that the points of one cube share. "u" and "v" are the two axes after the axis of projection, cyclically.
struct Cube<'a> {
    nodes: &'a GoodNodes,
    /// The place of the cube among the 6x6x6.
    place: usize,
    /// The plane of the cube, whether or not the cube holds its node; zero if it has none.
    own: Vec3,
    /// Where the own normal is largest, then u and v.
    axes: [usize; 3],
    /// What lies between two places next to each other along these axes.
    strides: [usize; 3],
    /// For the points below and above the centre along the axis, the place of the node of each of the 9 columns, if it
    /// has one.
    columns: [[u8; 9]; 2],
}

impl<'a> Cube<'a> {
    #[inline(always)]
    fn new(nodes: &'a GoodNodes, own: Node, bit: u32) -> Self {
        let place = Places::of_cube(bit);
        let centre = cube_centre(bit);
        let (axes, strides) = match own.normal.abs().max_position() {
            0 => ([0, 1, 2], [1, 6, 36]),
            1 => ([1, 2, 0], [6, 36, 1]),
            _ => ([2, 0, 1], [36, 1, 6]),
        };
        let mut cube = Self { nodes, place, own: own.normal, axes, strides, columns: [[0; 9]; 2] };
        cube.fill_columns(own.normal.dot(centre) + own.offset);
        cube
    }

    /// Takes from the two cubes of each column the node that lies nearer to the own plane, `own . x = offset`.
    #[inline(always)]
    fn fill_columns(&mut self, offset: f32) {
        let [along, along_u, along_v] = self.strides;
        // The first of the 27 places.
        let corner = self.place - along - along_u - along_v;
        for number in 0..9 {
            let below = corner + number % 3 * along_u + number / 3 * along_v;
            let (middle, above) = (below + along, below + 2 * along);
            let distance = self.distance(middle, offset);
            self.columns[0][number] = if self.distance(below, offset) < distance { below } else { middle } as u8;
            self.columns[1][number] = if self.distance(above, offset) < distance { above } else { middle } as u8;
        }
    }

    /// How far the node at a place lies from the own plane; infinitely far if there is none.
    #[inline(always)]
    fn distance(&self, place: usize, offset: f32) -> f32 {
        let node = &self.nodes.0[place];
        if node.normal == Vec3::ZERO { f32::INFINITY } else { (self.own.dot(node.position) - offset).abs() }
    }

    /// Calls `resolve(normal, nodes used, number of the point)` for each point of the cube. The points of an octant, which
    /// lie one after the other, share its nodes; four at a time are computed at once.
    #[inline(always)]
    fn interpolate(&self, points: &[Placed], mut resolve: impl FnMut(Vec3, usize, u32)) {
        let mut rest = points;
        while let Some(first) = rest.first() {
            let number = octant_in_brick(first.local);
            let length = rest.iter().take_while(|placed| octant_in_brick(placed.local) == number).count();
            let (points, others) = rest.split_at(length);
            rest = others;
            let octant = self.octant(number);
            if octant.used == 0 {
                points.iter().for_each(|placed| resolve(self.nearest(placed.local), 0, placed.point));
                continue;
            }
            let [_, u, v] = self.axes;
            for four in points.chunks(4) {
                let [x, y, z] = octant.normals(along(four, u), along(four, v), self.own).map(|lanes| lanes.to_array());
                for (i, placed) in four.iter().enumerate() {
                    resolve(Vec3::new(x[i], y[i], z[i]), octant.used, placed.point);
                }
            }
        }
    }

    /// The octant with a number as [`octant_in_brick`] gives it.
    #[inline(always)]
    fn octant(&self, number: u32) -> Octant {
        if self.own == Vec3::ZERO {
            // Without an own plane there is no axis and no common side: the points take the nearest node.
            return Octant::new(None, None, None, None);
        }
        let is_above = self.axes.map(|axis| (number >> axis & 1) as usize);
        let columns = &self.columns[is_above[0]];
        let (far, row) = (3 + 2 * is_above[1], 1 + 6 * is_above[2]);
        let seen = |column: usize| self.see(columns[column]);
        Octant::new(seen(4), seen(far), seen(row), seen(row + far - 4))
    }

    /// The node at a place, if there is one.
    #[inline(always)]
    fn see(&self, place: u8) -> Option<Seen> {
        let GoodNode { position, normal } = self.nodes.0[usize::from(place)];
        let side = normal.dot(self.own);
        let normal = if side < 0.0 { -normal } else { normal };
        let position = position.to_array();
        let [_, u, v] = self.axes;
        (normal != Vec3::ZERO).then(|| Seen { u: position[u], normal_and_v: normal.extend(position[v]) })
    }

    /// The normal of the nearest node in the 27 cubes; without any, that of the own plane, which may be zero.
    fn nearest(&self, point: Vec3) -> Vec3 {
        let mut nearest = (f32::INFINITY, self.own);
        for step in STEPS {
            let node = &self.nodes.0[self.place.wrapping_add_signed(Places::stride(step))];
            let distance = node.position.distance_squared(point);
            if node.normal != Vec3::ZERO && distance < nearest.0 {
                nearest = (distance, node.normal);
            }
        }
        nearest.1
    }
}

/// One coordinate of up to four points; where there are fewer, the last stands in for the others.
#[inline(always)]
fn along(points: &[Placed], axis: usize) -> Vec4 {
    let at = |i: usize| AsRef::<[f32; 3]>::as_ref(&points[i.min(points.len() - 1)].local)[axis];
    Vec4::new(at(0), at(1), at(2), at(3))
}

/// A node as the points of a cube see it.
#[derive(Clone, Copy)]
struct Seen {
    u: f32,
    /// The normal, on the own normal's side, and v.
    normal_and_v: Vec4,
}

/// Two nodes next to each other along u; also what lies between them.
#[derive(Clone, Copy)]
struct Pair {
    u: f32,
    /// 1 / (difference of u).
    scale: f32,
    /// Normal and v at the first node, and what they gain up to the second.
    first: Vec4,
    gain: Vec4,
}

impl Pair {
    /// A missing node is replaced by the other; of two that coincide along u, the mean counts.
    #[inline(always)]
    fn new(a: Option<Seen>, b: Option<Seen>) -> Option<Self> {
        let (a, b) = (a.or(b)?, b.or(a)?);
        let (length, gain) = (b.u - a.u, b.normal_and_v - a.normal_and_v);
        Some(if length == 0.0 {
            Self { u: a.u, scale: 0.0, first: a.normal_and_v + 0.5 * gain, gain: Vec4::ZERO }
        } else {
            Self { u: a.u, scale: 1.0 / length, first: a.normal_and_v, gain }
        })
    }

    /// x, y and z of the normal, and v, between the two nodes, at four places (paper, Eq. 15 and 16).
    #[inline(always)]
    fn at(&self, u: Vec4) -> [Vec4; 4] {
        let weight = clamp((u - Vec4::splat(self.u)) * Vec4::splat(self.scale));
        let (first, gain) = (self.first, self.gain);
        // One by one: by index it would take four times as long in WebAssembly.
        [
            first.xxxx() + gain.xxxx() * weight,
            first.yyyy() + gain.yyyy() * weight,
            first.zzzz() + gain.zzzz() * weight,
            first.wwww() + gain.wwww() * weight,
        ]
    }
}

/// What the points of one octant of a cube share: the four nodes of their 2x2x2 cubes.
struct Octant {
    pairs: [Pair; 2],
    used: usize,
}

impl Octant {
    /// From the nodes at the near and far column along u, in the near row and in the far row.
    #[inline(always)]
    fn new(a: Option<Seen>, b: Option<Seen>, c: Option<Seen>, d: Option<Seen>) -> Self {
        const NONE: Pair = Pair { u: 0.0, scale: 0.0, first: Vec4::ZERO, gain: Vec4::ZERO };
        let used = [a.is_some(), b.is_some(), c.is_some(), d.is_some()].iter().filter(|is_there| **is_there).count();
        let (near, far) = (Pair::new(a, b), Pair::new(c, d));
        let pairs = [near.or(far).unwrap_or(NONE), far.or(near).unwrap_or(NONE)];
        Self { pairs, used }
    }

    /// x, y and z of the interpolated unit normals at four places (paper, Eq. 15 to 17); the own normal where the nodes
    /// cancel each other.
    #[inline(always)]
    fn normals(&self, u: Vec4, v: Vec4, own: Vec3) -> [Vec4; 3] {
        let ([ax, ay, az, av], [bx, by, bz, bv]) = (self.pairs[0].at(u), self.pairs[1].at(u));
        let length = bv - av;
        let weight = clamp((v - av) / length);
        let weight = Vec4::select(length.cmpeq(Vec4::ZERO), Vec4::splat(0.5), weight);
        let (x, y, z) = (ax + (bx - ax) * weight, ay + (by - ay) * weight, az + (bz - az) * weight);
        let square = x * x + y * y + z * z;
        let is_long = square.cmpgt(Vec4::splat(1e-12));
        let scale = Vec4::ONE / square.sqrt();
        [
            Vec4::select(is_long, x * scale, Vec4::splat(own.x)),
            Vec4::select(is_long, y * scale, Vec4::splat(own.y)),
            Vec4::select(is_long, z * scale, Vec4::splat(own.z)),
        ]
    }
}

/// Between 0 and 1.
#[inline(always)]
fn clamp(weight: Vec4) -> Vec4 {
    weight.max(Vec4::ZERO).min(Vec4::ONE)
}
