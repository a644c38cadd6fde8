//! One normal for each point, interpolated between the nodes round it.

use crate::error::Error;
use crate::grid::{Grid, Placed, Surroundings, steps};
use crate::lattice::cube_centre;
use crate::nodes::Node;
use crate::parallel::Scatter;
use crate::points::zeroed;
use crate::progress::Stage;
use bytemuck::Zeroable;
use glam::{IVec3, Vec3, Vec4};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// What came out for the points of the input, in its order.
pub(crate) struct Normals {
    /// Unit, or zero where nothing determines a normal.
    pub normals: Vec<f32>,
    /// How many points were interpolated from 0 to 4 nodes.
    pub nodes_used: [u64; 5],
    /// How many points got the zero vector.
    pub unresolved: u64,
}

/// Interpolates all points; those outside the grid get the zero vector. One pass over the sorted points.
pub(crate) fn interpolate(grid: &Grid, nodes: &[Node], count: usize, stage: &Stage) -> Result<Normals, Error> {
    let mut normals = zeroed(3 * count, "the normals")?;
    let target = Scatter::new(bytemuck::cast_slice_mut::<f32, Vec3>(&mut normals));
    let (all_used, all_resolved) = ([const { AtomicU64::new(0) }; 5], AtomicU64::new(0));
    stage.run(grid.blocks.len(), &|block| {
        let mut surroundings = Surroundings::new();
        let (mut used, mut resolved) = ([0; 5], 0);
        for brick in grid.blocks[block].clone() {
            surroundings.look(grid, brick);
            for (points, bit) in grid.cubes_of(brick) {
                Cube::new(&surroundings, nodes, bit).interpolate(points, |normal, count, point| {
                    used[count] += 1;
                    resolved += u64::from(normal != Vec3::ZERO);
                    // SAFETY: every point of the input stands in the grid once at the most.
                    unsafe { target.write(point as usize, face(normal)) };
                });
            }
        }
        all_used.iter().zip(used).for_each(|(all, used)| _ = all.fetch_add(used, Relaxed));
        all_resolved.fetch_add(resolved, Relaxed);
    })?;
    let mut nodes_used = all_used.map(AtomicU64::into_inner);
    // Points outside the grid were interpolated from no node either.
    nodes_used[0] += (count - grid.placed.len()) as u64;
    Ok(Normals { normals, nodes_used, unresolved: count as u64 - all_resolved.into_inner() })
}

/// All that the points of one cube share: its node and the 26 round it, sorted into columns along one axis.
///
/// Positions are against the centre of the cube, in edges. "u" and "v" are the two axes after `axis`, cyclically.
struct Cube<'a> {
    surroundings: &'a Surroundings,
    nodes: &'a [Node],
    bit: u32,
    /// The plane of the cube, whether or not the cube holds its node.
    own: Node,
    /// The axis of projection: where the own normal is largest.
    axis: usize,
    /// For the points below and above the centre along the axis, the node of each of the 9 columns.
    columns: [[Option<Seen>; 9]; 2],
}

/// A node as the points of a cube see it.
#[derive(Clone, Copy)]
struct Seen {
    u: f32,
    /// The normal, on the own normal's side, and v.
    normal_and_v: Vec4,
}

impl<'a> Cube<'a> {
    fn new(surroundings: &'a Surroundings, nodes: &'a [Node], bit: u32) -> Self {
        let own = surroundings.cube(bit, IVec3::ZERO).map_or(Node::zeroed(), |cube| nodes[cube]);
        let axis = own.normal.abs().max_position();
        let mut cube = Self { surroundings, nodes, bit, own, axis, columns: [[None; 9]; 2] };
        if own.has_plane() {
            cube.fill_columns();
        }
        cube
    }

    /// The good nodes in the 27 cubes: the step to the cube, position, and normal on the own normal's side.
    fn good_nodes(&self) -> impl Iterator<Item = (IVec3, Vec3, Vec3)> {
        let (surroundings, nodes, bit, own) = (self.surroundings, self.nodes, self.bit, self.own.normal);
        steps()
            .filter_map(move |step| surroundings.cube(bit, step).map(|cube| (step, nodes[cube])))
            .filter(|(_, node)| node.is_good())
            .map(move |(step, node)| {
                let normal = if node.normal.dot(own) < 0.0 { -node.normal } else { node.normal };
                (step, node.position() + step.as_vec3(), normal)
            })
    }

    /// Takes from the two cubes of each column the node that lies nearer to the own plane.
    fn fill_columns(&mut self) {
        let (axis, u, v) = (self.axis, (self.axis + 1) % 3, (self.axis + 2) % 3);
        let mut nearest = [[f32::INFINITY; 9]; 2];
        let mut columns = [[None; 9]; 2];
        for (step, position, normal) in self.good_nodes() {
            let seen = Seen { u: position[u], normal_and_v: normal.extend(position[v]) };
            let distance = (self.own.normal.dot(position) - self.own.offset).abs();
            let column = (step[u] + 1 + 3 * (step[v] + 1)) as usize;
            for (side, outward) in [(0, -1), (1, 1)] {
                let within = step[axis] == 0 || step[axis] == outward;
                if within && distance < nearest[side][column] {
                    nearest[side][column] = distance;
                    columns[side][column] = Some(seen);
                }
            }
        }
        self.columns = columns;
    }

    /// Calls `resolve(normal, nodes used, number of the point)` for each point of the cube.
    fn interpolate(&self, points: &[Placed], mut resolve: impl FnMut(Vec3, usize, u32)) {
        let (axis_u, axis_v) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        // What the points of each octant share, from when the first of them asks.
        let mut octants = [const { None }; 8];
        let centre = cube_centre(self.bit);
        for placed in points {
            let point = placed.local - centre;
            let along = point.to_array();
            let (u, v, w) = (along[axis_u], along[axis_v], along[self.axis]);
            let number = usize::from(u >= 0.0) + 2 * usize::from(v >= 0.0) + 4 * usize::from(w >= 0.0);
            let octant = octants[number].get_or_insert_with(|| Octant::new(&self.columns[number / 4], number));
            let normal = match octant.used {
                0 => self.nearest(point),
                _ => octant.normal(u, v).unwrap_or(self.own.normal),
            };
            resolve(normal, octant.used, placed.point);
        }
    }

    /// The normal of the nearest node in the 27 cubes; without any, that of the own plane, which may be zero.
    fn nearest(&self, point: Vec3) -> Vec3 {
        let mut nearest = (f32::INFINITY, self.own.normal);
        for (_, position, normal) in self.good_nodes() {
            let distance = position.distance_squared(point);
            if distance < nearest.0 {
                nearest = (distance, normal);
            }
        }
        nearest.1
    }
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
    fn new(a: Option<Seen>, b: Option<Seen>) -> Option<Self> {
        let (a, b) = (a.or(b)?, b.or(a)?);
        let (length, gain) = (b.u - a.u, b.normal_and_v - a.normal_and_v);
        Some(if length == 0.0 {
            Self { u: a.u, scale: 0.0, first: a.normal_and_v + 0.5 * gain, gain: Vec4::ZERO }
        } else {
            Self { u: a.u, scale: 1.0 / length, first: a.normal_and_v, gain }
        })
    }

    /// Normal and v between the two nodes (paper, Eq. 15 and 16).
    #[inline]
    fn at(&self, u: f32) -> Vec4 {
        self.first + self.gain * clamp((u - self.u) * self.scale)
    }
}

/// What the points of one octant of a cube share: the four nodes of their 2x2x2 cubes.
struct Octant {
    pairs: [Pair; 2],
    used: usize,
}

impl Octant {
    const EMPTY: Pair = Pair { u: 0.0, scale: 0.0, first: Vec4::ZERO, gain: Vec4::ZERO };

    fn new(columns: &[Option<Seen>; 9], number: usize) -> Self {
        let far = if number & 1 == 1 { 5 } else { 3 };
        let row = if number & 2 == 2 { 6 } else { 0 };
        let block = [columns[4], columns[far], columns[row + 1], columns[row + far - 3]];
        let (near, next) = (Pair::new(block[0], block[1]), Pair::new(block[2], block[3]));
        let pairs = [near.or(next).unwrap_or(Self::EMPTY), next.or(near).unwrap_or(Self::EMPTY)];
        Self { pairs, used: block.iter().flatten().count() }
    }

    /// The interpolated unit normal (paper, Eq. 15 to 17); `None` where the nodes cancel each other.
    #[inline]
    fn normal(&self, u: f32, v: f32) -> Option<Vec3> {
        let (a, b) = (self.pairs[0].at(u), self.pairs[1].at(u));
        let length = b.w - a.w;
        let weight = if length == 0.0 { 0.5 } else { clamp((v - a.w) / length) };
        let normal = (a + (b - a) * weight).truncate();
        let square = normal.length_squared();
        (square > 1e-12).then(|| normal * (1.0 / square.sqrt()))
    }
}

/// Between 0 and 1. Comparisons, because `f32::clamp` is slow in WebAssembly.
#[inline]
fn clamp(weight: f32) -> f32 {
    if weight < 0.0 {
        0.0
    } else if weight > 1.0 {
        1.0
    } else {
        weight
    }
}

/// Chooses the sign: `x + 2y + 4z >= 0`, a plane that few man-made walls are parallel to.
fn face(normal: Vec3) -> Vec3 {
    let side = normal.dot(Vec3::new(1.0, 2.0, 4.0));
    // On the plane itself the first component that is not zero decides.
    let side = if side != 0.0 {
        side
    } else if normal.x != 0.0 {
        normal.x
    } else {
        normal.y
    };
    // Adding zero turns -0 into 0.
    if side < 0.0 { Vec3::ZERO - normal } else { normal + Vec3::ZERO }
}
