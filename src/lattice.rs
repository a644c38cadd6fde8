//! From a position to its cube, and back.

use crate::points::Bounds;
use glam::{DVec3, IVec3, Vec3, Vec4, Vec4Swizzles};

/// Cubes along the edge of a brick.
pub(crate) const BRICK: i32 = 4;

/// Cubes along an axis at the most: places must fit 32-bit numbers.
pub(crate) const CUBES: f64 = (1 << 30) as f64;

/// A grid of cubes, grouped in bricks of 4x4x4.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    /// Where the first cube begins.
    base: DVec3,
    /// 1 / edge.
    scale: f64,
    /// The lowest corner of the grid, and the highest, in edges from there.
    low: DVec3,
    high: DVec3,
}

impl Lattice {
    /// A grid within some bounds. Where that is more than `most` cubes along an axis, half of `most` on either side of
    /// `centre()`: points beyond are out of reach.
    // Its centre is then no call through a pointer, which is smaller by 0.2 KiB.
    #[inline(always)]
    pub fn new(bounds: &Bounds, centre: &dyn Fn() -> DVec3, edge: f64, most: f64) -> Self {
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let scale = 1.0 / edge;
        let is_long = ((max - min) * scale).cmpge(DVec3::splat(most)).any();
        let base = if is_long { min.max(centre() - most / 2.0 * edge) } else { min };
        // The same product as in `place`, so that the point on the maximum falls into the last cube.
        let high = (((max - base) * scale).floor() + 1.0).clamp(DVec3::ONE, DVec3::splat(most));
        Self { base, scale, low: DVec3::ZERO, high }
    }

    /// The same cubes, for positions that are places in a brick of a grid whose cubes have `edge` edges of these.
    pub fn for_places_in(&self, brick: IVec3, edge: f64) -> Self {
        Self { base: f64::from(-BRICK) * brick.as_dvec3(), scale: edge, ..*self }
    }

    /// Cubes of twice the edge, eight of these in each.
    pub fn coarser(&self) -> Self {
        let (low, high) = ((0.5 * self.low).floor(), (0.5 * self.high).ceil());
        Self { base: self.base, scale: 0.5 * self.scale, low, high }
    }

    /// Cubes of half the edge; there must be places for twice as many.
    pub fn finer(&self) -> Self {
        Self { base: self.base, scale: 2.0 * self.scale, low: 2.0 * self.low, high: 2.0 * self.high }
    }

    /// The part of the grid from brick `first` to brick `last`.
    pub fn part(&self, first: IVec3, last: IVec3) -> Self {
        let corner = |brick: IVec3| f64::from(BRICK) * brick.as_dvec3();
        Self { low: self.low.max(corner(first)), high: self.high.min(corner(last + 1)), ..*self }
    }

    /// Cubes along each axis.
    pub fn size(&self) -> DVec3 {
        self.high - self.low
    }

    /// The edge of a cube.
    pub fn edge(&self) -> f64 {
        1.0 / self.scale
    }

    /// The lowest brick, and how many there are along each axis.
    pub fn bricks(&self) -> (IVec3, IVec3) {
        let first = (self.low / f64::from(BRICK)).floor().as_ivec3();
        (first, (self.high / f64::from(BRICK)).ceil().as_ivec3() - first)
    }

    /// The brick of a point, as whole numbers (paper, Eq. 3). `None` for a point that is not finite or out of reach.
    ///
    /// In double precision, so that a long thin cloud or a stray point far away costs no accuracy.
    #[inline]
    pub fn brick(&self, point: Vec3) -> Option<DVec3> {
        let place = self.place(point);
        // Number by number: as masks of three doubles it takes noticeably longer.
        let is_inside = (place.x >= self.low.x)
            & (place.y >= self.low.y)
            & (place.z >= self.low.z)
            & (place.x < self.high.x)
            & (place.y < self.high.y)
            & (place.z < self.high.z);
        is_inside.then(|| brick(place))
    }

    /// The same as integers, where there is time.
    #[inline(never)]
    pub fn brick_place(&self, point: Vec3) -> Option<IVec3> {
        self.brick(point).map(|brick| brick.as_ivec3())
    }

    /// The place of a point in its brick, in edges, from 0 up to but not including 4; it must have one. Whatever cube the
    /// place says is the cube of the point: nothing computes it a second way.
    #[inline]
    pub fn local(&self, point: Vec3) -> Vec3 {
        let place = self.place(point);
        // Cut off to what single precision holds, not rounded: so a place never reaches the next cube, and its cube of half
        // the edge, where places are twice as large, is always a part of its cube.
        let local = (place - brick(place) * f64::from(BRICK)) * STEPS;
        floor(local).as_vec3() * (1.0 / STEPS) as f32
    }

    /// Of a point, in edges.
    #[inline(always)]
    fn place(&self, point: Vec3) -> DVec3 {
        (point.as_dvec3() - self.base) * self.scale
    }
}

/// The brick of a place.
#[inline(always)]
fn brick(place: DVec3) -> DVec3 {
    floor(place * (1.0 / f64::from(BRICK)))
}

/// Rounds down what is not negative and below 2^31. WebAssembly has an instruction for it, and its conversion to an integer
/// looks at what else the number might be; x86-64 without SSE4.1 has none, and would call a function. The number is the same.
#[inline(always)]
fn floor(numbers: DVec3) -> DVec3 {
    if cfg!(target_arch = "wasm32") { numbers.floor() } else { numbers.as_ivec3().as_dvec3() }
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
    // After this addition they stand in the last bits: WebAssembly's own conversion looks at what else they might be.
    const BIT: f32 = (1 << 23) as f32;
    (octant.xyz().element_sum() + BIT).to_bits() & 511
}

/// Mixes a place into 64 bits, the highest best: for tables of cubes or bricks.
#[inline(always)]
pub(crate) fn mixed(x: u64, y: u64, z: u64) -> u64 {
    x.wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ y.wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
        ^ z.wrapping_mul(0x1656_67B1_9E37_79F9)
}

/// The place of the cube with bit `bit`, in the brick.
#[inline(always)]
pub(crate) fn cube_place(bit: u32) -> IVec3 {
    IVec3::new((bit & 3) as i32, (bit >> 2 & 3) as i32, (bit >> 4) as i32)
}

/// The bit of the cube at a place in its brick.
#[inline(always)]
pub(crate) fn cube_bit(place: IVec3) -> u32 {
    (place.x | place.y << 2 | place.z << 4) as u32
}

/// The centre of the cube with bit `bit`, in the brick.
#[inline]
pub(crate) fn cube_centre(bit: u32) -> Vec3 {
    cube_place(bit).as_vec3() + 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cube of a place, counted from the corner of the grid.
    fn cube(lattice: &Lattice, point: Vec3) -> IVec3 {
        let (brick, local) = (lattice.brick_place(point).unwrap(), lattice.local(point));
        assert!(local.cmpge(Vec3::ZERO).all() && local.cmplt(Vec3::splat(BRICK as f32)).all(), "{local}");
        let bit = octant_in_brick(local.extend(0.0)) / 8;
        BRICK * brick + cube_centre(bit).as_ivec3()
    }

    /// Through all divisions there can be and back, next to the sides of cubes and far from the origin: places in other
    /// grids stand for one cube in each.
    #[test]
    fn places_in_other_grids_are_in_parts_of_the_same_cubes() {
        for start in [0.0, f64::from(1 << 19)] {
            let bounds = Bounds { min: Vec3::ZERO, max: Vec3::splat((1 << 22) as f32), finite: 2 };
            let base = Lattice::new(&bounds, &|| DVec3::ZERO, 1.0, CUBES);
            for side in 0..64 {
                for step in [0.0f64, 1e-7, 3e-7, 0.1, 0.3, 0.49999997, 0.5, 0.99999994] {
                    let point = Vec3::splat((start + f64::from(side) + step) as f32);
                    let (mut coarse, mut lattice) = (base, base);
                    let (mut brick, mut local) = (base.brick(point).unwrap().as_ivec3(), base.local(point));
                    for _ in 0..8 {
                        let place = |brick: IVec3, local: Vec3| BRICK * brick + local.as_ivec3();
                        lattice = lattice.finer();
                        let (from, finer) = (brick, lattice.for_places_in(brick, 2.0));
                        let whole = place(brick, local);
                        (brick, local) = (finer.brick(local).unwrap().as_ivec3(), finer.local(local));
                        assert_eq!(place(brick, local) / 2, whole, "{point}");
                        let back = coarse.for_places_in(brick, 0.5);
                        assert_eq!(back.brick(local).unwrap().as_ivec3(), from, "{point}");
                        assert_eq!(place(from, back.local(local)), whole, "{point}");
                        coarse = lattice;
                    }
                }
            }
        }
    }

    /// Also next to their sides, where single precision does not tell a place from the side.
    #[test]
    fn cubes_of_half_the_edge_are_parts_of_the_whole_ones() {
        for edge in [1.0, 0.7, 0.001] {
            let bounds = Bounds { min: Vec3::ZERO, max: Vec3::splat(64.0 * edge as f32), finite: 2 };
            let lattice = Lattice::new(&bounds, &|| DVec3::ZERO, edge, CUBES);
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
