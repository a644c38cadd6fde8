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
        let local = (place - brick.as_dvec3() * f64::from(BRICK)).as_vec3();
        (brick, local.min(Vec3::splat(BELOW_BRICK)))
    }
}

/// The largest number below 4.
const BELOW_BRICK: f32 = (BRICK as f32).next_down();

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
