//! From a position to its cube, and back.

use glam::{DVec3, IVec3, UVec3, Vec3, Vec4, Vec4Swizzles};

/// Cubes along the edge of a brick.
pub(crate) const BRICK: i32 = 4;

/// Cubes along an axis at the most: places must fit 32-bit numbers.
pub(crate) const CUBES: f64 = (1 << 30) as f64;

/// An endless grid of cubes, grouped in bricks of 4x4x4.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    /// The lowest corner.
    base: DVec3,
    /// 1 / edge.
    scale: f64,
    /// Cubes along each axis.
    pub size: DVec3,
}

impl Lattice {
    /// A grid from `min` to `max`. Where that is more than `most` cubes along an axis, half of `most` on either side of
    /// `centre()`: points beyond are out of reach.
    pub fn new(min: DVec3, max: DVec3, centre: impl FnOnce() -> DVec3, edge: f64, most: f64) -> Self {
        let scale = 1.0 / edge;
        let is_long = ((max - min) * scale).cmpge(DVec3::splat(most)).any();
        let base = if is_long { min.max(centre() - most / 2.0 * edge) } else { min };
        // The same product as in `locate`, so that the point on the maximum falls into the last cube.
        let size = (((max - base) * scale).floor() + 1.0).clamp(DVec3::ONE, DVec3::splat(most));
        Self { base, scale, size }
    }

    /// The same cubes, for positions in edges from the lowest corner of brick `origin`.
    pub fn in_edges(&self, origin: IVec3) -> Self {
        Self { base: f64::from(-BRICK) * origin.as_dvec3(), scale: 1.0, size: self.size }
    }

    /// Cubes of twice the edge, eight of these in each.
    pub fn coarser(&self) -> Self {
        Self { base: self.base, scale: 0.5 * self.scale, size: (0.5 * self.size).ceil() }
    }

    /// Cubes of half the edge; there must be places for twice as many.
    pub fn finer(&self) -> Self {
        Self { base: self.base, scale: 2.0 * self.scale, size: 2.0 * self.size }
    }

    /// The point at a place in a brick.
    pub fn position(&self, brick: IVec3, local: Vec3) -> Vec3 {
        (self.base + (f64::from(BRICK) * brick.as_dvec3() + local.as_dvec3()) / self.scale).as_vec3()
    }

    /// The edge of a cube.
    pub fn edge(&self) -> f64 {
        1.0 / self.scale
    }

    /// Bricks along each axis.
    pub fn bricks(&self) -> IVec3 {
        (self.size / f64::from(BRICK)).ceil().as_ivec3()
    }

    /// The brick of a point, and the point's place in it, in edges, from 0 up to but not including 4 (paper, Eq. 3).
    /// `None` for a point that is not finite or out of reach.
    ///
    /// In double precision, so that a long thin cloud or a stray point far away costs no accuracy. Whatever cube the
    /// place says is the cube of the point: nothing computes it a second way.
    #[inline]
    pub fn locate(&self, point: Vec3) -> Option<(IVec3, Vec3)> {
        let place = (point.as_dvec3() - self.base) * self.scale;
        // Number by number: as masks of three doubles it takes noticeably longer.
        let is_inside = (place.x >= 0.0)
            & (place.y >= 0.0)
            & (place.z >= 0.0)
            & (place.x < self.size.x)
            & (place.y < self.size.y)
            & (place.z < self.size.z);
        is_inside.then(|| Self::split(place))
    }

    /// The same for a point that is known to have a place.
    #[inline]
    pub fn place(&self, point: Vec3) -> (IVec3, Vec3) {
        Self::split((point.as_dvec3() - self.base) * self.scale)
    }

    #[inline(always)]
    fn split(place: DVec3) -> (IVec3, Vec3) {
        let brick = (place * (1.0 / f64::from(BRICK))).as_ivec3();
        // Cut off to what single precision holds, not rounded: so a place never reaches the next cube, and its cube of half
        // the edge, where places are twice as large, is always a part of its cube.
        let local = (place - brick.as_dvec3() * f64::from(BRICK)) * STEPS;
        (brick, local.floor().as_vec3() * (1.0 / STEPS) as f32)
    }
}

/// Steps of a place within an edge: those below 4 are single-precision numbers.
const STEPS: f64 = (1 << 22) as f64;

/// The octant of a place in a brick (the first three of four lanes): eight times its cube `x + 4 y + 16 z`, and bits 0, 1
/// and 2 tell whether it is not below the cube's centre along x, y and z.
#[inline(always)]
pub(crate) fn octant_in_brick(place: Vec4) -> u32 {
    let (cube, half) = (place.floor(), (2.0 * place).floor());
    // In whole numbers up to 511; a half without twice its cube is 0 or 1.
    let octant = half * Vec4::new(1.0, 2.0, 4.0, 0.0) + cube * Vec4::new(6.0, 28.0, 120.0, 0.0);
    octant.xyz().element_sum() as u32
}

/// The centre of the cube with bit `bit`, in the brick.
#[inline]
pub(crate) fn cube_centre(bit: u32) -> Vec3 {
    UVec3::new(bit & 3, bit >> 2 & 3, bit >> 4).as_vec3() + 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cube of a place, counted from the corner of the grid.
    fn cube(lattice: &Lattice, point: Vec3) -> IVec3 {
        let (brick, local) = lattice.locate(point).unwrap();
        assert!(local.cmpge(Vec3::ZERO).all() && local.cmplt(Vec3::splat(BRICK as f32)).all(), "{local}");
        let bit = octant_in_brick(local.extend(0.0)) / 8;
        BRICK * brick + cube_centre(bit).as_ivec3()
    }

    /// Also next to their sides, where single precision does not tell a place from the side.
    #[test]
    fn cubes_of_half_the_edge_are_parts_of_the_whole_ones() {
        for edge in [1.0, 0.7, 0.001] {
            let lattice = Lattice::new(DVec3::ZERO, DVec3::splat(64.0 * edge), || DVec3::ZERO, edge, CUBES);
            let finer = lattice.finer();
            for side in 1..128 {
                let side = (f64::from(side) * 0.5 * edge) as f32;
                let mut point = Vec3::splat(side);
                for _ in 0..8 {
                    point = point.map(f32::next_down);
                }
                for _ in 0..16 {
                    assert_eq!(cube(&finer, point) / 2, cube(&lattice, point), "{point}, edge {edge}");
                    point = point.map(f32::next_up);
                }
            }
        }
    }
}
