//! Interpolation nodes: one for each cube, where the plane of its surroundings passes under its centre.

use crate::bricks::set_bits;
use crate::error::Error;
use crate::grid::{Grid, Placed};
use crate::parallel::Filling;
use crate::pca::{Moments, Plane};
use crate::progress::Stage;
use crate::surroundings::{NEAR, Places, Surroundings};
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

/// The plane through the points of a cube and the 26 round it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct Node {
    /// The unit normal (paper, Eq. 6); zero when the points determine no plane.
    pub normal: Vec3,
    /// How far the plane lies from the cube's centre along the normal, in edges (r of Eq. 13); infinite without a plane.
    pub offset: f32,
}

impl Node {
    fn of(plane: Option<Plane>) -> Self {
        match plane {
            Some(Plane { normal, centroid, .. }) => Self { normal, offset: normal.dot(centroid) },
            None => Self { normal: Vec3::ZERO, offset: f32::INFINITY },
        }
    }

    /// Whether there is a plane at all.
    pub fn has_plane(&self) -> bool {
        self.normal != Vec3::ZERO
    }

    /// The normal, as the first three of four lanes.
    #[inline(always)]
    pub fn lanes(&self) -> Vec4 {
        bytemuck::cast(*self)
    }

    /// The node's position against the cube's centre, in edges: the centre projected onto the plane (Eq. 14). In three of
    /// four lanes; not a number without a plane.
    #[inline(always)]
    pub fn position(&self) -> Vec4 {
        self.lanes() * self.offset
    }

    /// Whether the cube holds the node, so that it takes part in the interpolation.
    #[inline(always)]
    pub fn is_good(&self) -> bool {
        self.position().abs().cmple(Vec4::splat(0.5)).bitmask() & 7 == 7
    }
}

/// The moments of a cube's points, against its centre.
pub(crate) fn moments(points: &[Placed], centre: Vec3) -> Moments {
    Moments::of(points.iter().map(|point| point.local - centre))
}

/// The node of every cube, in the order of the grid; with `curvature` also the surface variation of its points, 0 without
/// a plane.
pub(crate) fn nodes(
    grid: &Grid,
    moments: &[Moments],
    curvature: bool,
    stage: &Stage,
) -> Result<(Vec<Node>, Option<Vec<f32>>), Error> {
    let nodes = Filling::new(grid.cubes(), "the nodes")?;
    let variations = curvature.then(|| Filling::new(grid.cubes(), "the curvature")).transpose()?;
    stage.run(grid.blocks.len(), &|block| {
        let mut surroundings = Surroundings::new();
        for brick in grid.blocks[block].clone() {
            surroundings.look(grid, brick);
            for (cube, bit) in (grid.first_cube[brick] as usize..).zip(set_bits(grid.masks[brick])) {
                let mut sum = Moments::zeroed();
                for near in set_bits(surroundings.occupied.near(bit)) {
                    let cube = surroundings.cube(Places::of_near(bit, near));
                    sum.add_shifted(&moments[cube], NEAR[near as usize % 64]);
                }
                let plane = sum.plane();
                // SAFETY: a cube belongs to one brick, and a brick to one block.
                unsafe {
                    nodes.write(cube, Node::of(plane));
                    if let Some(variations) = &variations {
                        variations.write(cube, plane.map_or(0.0, |plane| plane.variation));
                    }
                }
            }
        }
    })?;
    // SAFETY: the blocks hold all bricks, and these all cubes.
    Ok(unsafe { (nodes.complete(), variations.map(|variations| variations.complete())) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::{CUBES, Lattice};
    use crate::points::{Bounds, Points};
    use crate::progress::Progress;
    use crate::source::Source;
    use glam::{DMat3, DVec3, IVec3};

    /// Some points on a bumpy surface, some in a volume, in a turned and stretched box.
    fn cloud(count: u32) -> Vec<Vec3> {
        let random = |i: u32| (f64::from(i.wrapping_mul(2_654_435_769) ^ (i << 7)) * 0.618_033_988_749).fract() as f32;
        (0..count)
            .map(|i| {
                let (x, y, z) = (random(3 * i), random(3 * i + 1), random(3 * i + 2));
                Vec3::new(x, 3.0 * y, if i % 4 == 0 { z } else { 0.3 + 0.1 * (9.0 * x).sin() * (5.0 * y).cos() })
            })
            .collect()
    }

    /// Every node against the covariance of the paper's Q, gathered by brute force in double precision.
    #[test]
    fn nodes_are_those_of_the_points_in_27_cubes() {
        let positions = cloud(3000);
        let points = Points::from_f32(bytemuck::cast_slice(&positions)).unwrap();
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(1.0, 3.0, 1.0), finite: 3000 };
        for edge in [0.03, 0.11, 0.25] {
            let lattice = Lattice::new(&bounds, &|| DVec3::ZERO, edge, CUBES);
            let progress = Progress::silent();
            let stage = progress.stage("test", 0.0..1.0);
            let (grid, moments) = Grid::sort(&Source::new(&points, lattice), &stage, moments).unwrap();
            let (nodes, variations) = nodes(&grid, &moments, true, &stage).unwrap();
            let mut variations = variations.unwrap().into_iter();

            let cube = |p: &Vec3| (p.as_dvec3() / edge).floor().as_ivec3();
            let mut nodes = nodes.iter();
            let mut planes = 0;
            for brick in 0..grid.bricks.len() {
                for (points, bit) in grid.cubes_of(brick) {
                    let (node, variation) = (nodes.next().unwrap(), f64::from(variations.next().unwrap()));
                    let place = 4 * grid.bricks.places[brick]
                        + IVec3::new(bit as i32 & 3, bit as i32 >> 2 & 3, bit as i32 >> 4);
                    let mut own: Vec<u32> = (0..3000).filter(|i| cube(&positions[*i as usize]) == place).collect();
                    own.sort_by_key(|i| {
                        let above = (positions[*i as usize].as_dvec3() / edge).fract().cmpge(DVec3::splat(0.5));
                        above.bitmask()
                    });
                    let sorted: Vec<u32> = points.iter().map(|p| p.point).collect();
                    assert_eq!(sorted, own, "by octant, and in the input's order");

                    let centre = (place.as_dvec3() + 0.5) * edge;
                    let near: Vec<DVec3> = positions
                        .iter()
                        .filter(|p| (cube(p) - place).abs().max_element() <= 1)
                        .map(|p| (p.as_dvec3() - centre) / edge)
                        .collect();
                    let mean = near.iter().sum::<DVec3>() / near.len() as f64;
                    let covariance = near.iter().fold(DMat3::ZERO, |sum, p| {
                        let d = *p - mean;
                        sum + DMat3::from_cols(d * d.x, d * d.y, d * d.z)
                    }) * (1.0 / near.len() as f64);
                    if !node.has_plane() {
                        assert!(near.len() < 4, "{} points without a plane", near.len());
                        assert_eq!(variation, 0.0);
                        continue;
                    }
                    // The normal is an eigenvector, and the smallest of the Rayleigh quotients is its own.
                    let normal = node.normal.as_dvec3();
                    let value = normal.dot(covariance * normal);
                    assert!((covariance * normal - normal * value).length() < 2e-6, "not an eigenvector");
                    for other in [normal.any_orthogonal_vector(), normal.cross(normal.any_orthogonal_vector())] {
                        let other = other.normalize();
                        assert!(other.dot(covariance * other) > value - 2e-6, "not the smallest");
                    }
                    let trace: f64 = (0..3).map(|i| covariance.col(i)[i]).sum();
                    assert!((variation * trace - value).abs() < 2e-6, "{variation}, {value} of {trace}");
                    assert!((f64::from(node.offset) - normal.dot(mean)).abs() < 2e-6, "not through the centroid");
                    planes += 1;
                }
            }
            assert!(nodes.next().is_none());
            assert!(planes > 100);
        }
    }
}
