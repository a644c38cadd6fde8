//! Interpolation nodes: one for each cube, where the plane of its surroundings passes under its centre.

use crate::error::Error;
use crate::grid::{Grid, Surroundings, split, steps};
use crate::pca::Moments;
use crate::points::reserve;
use crate::progress::Stage;
use glam::Vec3;
use std::ops::Range;

/// The plane through the points of a cube and the 26 round it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Node {
    /// The unit normal (paper, Eq. 6); zero when the points determine no plane.
    pub normal: Vec3,
    /// How far the plane lies from the cube's centre along the normal, in edges (r of Eq. 13).
    pub offset: f32,
}

impl Node {
    fn of(surroundings: &Moments) -> Self {
        match surroundings.plane() {
            Some((centroid, normal)) => Self { normal, offset: normal.dot(centroid) },
            None => Self::default(),
        }
    }

    /// Whether there is a plane at all.
    pub fn has_plane(&self) -> bool {
        self.normal != Vec3::ZERO
    }

    /// The node's position against the cube's centre, in edges: the centre projected onto the plane (Eq. 14).
    pub fn position(&self) -> Vec3 {
        self.normal * self.offset
    }

    /// Whether the cube holds the node, so that it takes part in the interpolation.
    pub fn is_good(&self) -> bool {
        self.has_plane() && self.position().abs().max_element() <= 0.5
    }
}

/// The node of every cube, in the order of the grid.
pub(crate) fn nodes(grid: &Grid, moments: &[Moments], stage: &Stage) -> Result<Vec<Node>, Error> {
    let mut nodes = Vec::new();
    reserve(&mut nodes, grid.cubes(), "the nodes")?;
    nodes.resize(grid.cubes(), Node::default());
    let blocks = grid.blocks();
    let pieces = split(&mut nodes, blocks.iter().map(|bricks| grid.first_cube[bricks.end] as usize));
    stage.run(blocks.into_iter().zip(pieces).collect(), |(bricks, nodes): (Range<usize>, &mut [Node])| {
        let mut surroundings = Surroundings::new();
        let mut nodes = nodes.iter_mut();
        for brick in bricks {
            surroundings.look(grid, brick);
            for bit in crate::bricks::set_bits(grid.masks[brick]) {
                let mut sum = Moments::default();
                for step in steps() {
                    if let Some(cube) = surroundings.cube(bit, step) {
                        sum.add_shifted(&moments[cube], step);
                    }
                }
                if let Some(node) = nodes.next() {
                    *node = Node::of(&sum);
                }
            }
        }
    })?;
    Ok(nodes)
}
