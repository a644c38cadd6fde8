//! How large a neighbourhood each cube is to rest on.

use super::level::Level;
use super::surface::Quadric;
use super::{SIZES, WHAT};
use crate::error::Error;
use crate::lanes::load;
use crate::parallel::Filling;
use crate::progress::Stage;
use bytemuck::{Pod, Zeroable};
use glam::{IVec3, Vec3, Vec4};

/// The surface that was chosen for a cube of the smallest level, in its edges and against its centre.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Chosen {
    /// About the centroid of the cube's points; its slope there is a unit vector, or zero if there is no surface.
    pub quadric: Quadric,
    /// Variance of the points' distances from it.
    pub noise: f32,
    /// Relative standard deviation of `noise`: the root of 2 / points.
    pub chance: f32,
    /// Variance of the angle of the normal, with what the surface does not fit; infinite if there is no surface.
    pub error: f32,
    /// The surface variation there.
    pub variation: f32,
    /// The noise again, if the surface is thin against its width, so that its noise can be compared; infinite if not.
    pub flat_noise: f32,
    /// The noise again, if the surface is a plane for two and a half edges; infinite if not.
    pub plane_noise: f32,
    /// How often the edge was doubled.
    pub doublings: u32,
}

impl Chosen {
    /// None at all.
    pub const NONE: Self = Self {
        quadric: Quadric::NONE,
        noise: 0.0,
        chance: 1.0,
        error: f32::INFINITY,
        variation: 0.0,
        flat_noise: f32::INFINITY,
        plane_noise: f32::INFINITY,
        doublings: 0,
    };

    /// Whether there is a surface.
    pub fn is_some(&self) -> bool {
        self.error < f32::INFINITY
    }

    /// All that votes, in its order.
    #[inline(always)]
    pub fn numbers(&self) -> [Vec4; 4] {
        let numbers: &[f32; 20] = bytemuck::cast_ref(self);
        std::array::from_fn(|i| load(&numbers[4 * i..]))
    }
}

/// A residual counts as more than the noise of smaller neighbourhoods only beyond this many standard deviations.
const EXCESS: f32 = 6.0;

/// The square angle that a misfit of the size of the neighbourhood is taken for.
const MISFIT: f32 = 2.0;

/// A neighbourhood is flat when it is so many times as wide as thick, squared.
const FLAT: f32 = 2.0;

/// A surface is a plane if what it bends away from one, two and a half edges away, is less than this share of its noise and so
/// much more, all squared.
const SAG: f32 = 0.5;
const FLAT_SAG: f32 = 5e-7;

/// Square angles less than this are no difference.
const SAME: f32 = 1e-5;

/// Chooses for every cube of the last of the levels, which come from large cubes to small ones.
#[inline(never)]
pub(super) fn choose(levels: &[Level], stage: &Stage) -> Result<Vec<Chosen>, Error> {
    let smallest = &levels[levels.len() - 1];
    let chosen = Filling::new(smallest.grid.cubes(), WHAT)?;
    smallest.grid.each_cube(stage, &|brick, cube, bit| {
        let place = smallest.place(brick, bit);
        // SAFETY: once for each cube.
        unsafe { chosen.write(cube, of_cube(levels, place, smallest.centroid(cube, bit))) };
    })?;
    // SAFETY: these were all cubes.
    Ok(unsafe { chosen.complete() })
}

/// The surface of least error: the variance of its normal, and the bias, which is told by how much more the normal
/// differs from those of smaller neighbourhoods than their variances account for (Goldenshluger and Lepski, "Bandwidth
/// selection in kernel density estimation", Annals of Statistics 39 (2011) 1608-1632), and by the misfit.
#[optimize(size)]
#[inline(never)]
fn of_cube(levels: &[Level], mut cube: IVec3, centroid: Vec3) -> Chosen {
    let mut best = Chosen { quadric: Quadric { centre: centroid, ..Quadric::NONE }, ..Chosen::NONE };
    let mut smaller = [(Vec3::ZERO, 0.0); SIZES];
    let mut count = 0;
    let mut reference = f32::INFINITY;
    let (mut edge, mut place) = (1.0f32, centroid);
    for (doublings, level) in (0..).zip(levels.iter().rev()) {
        if doublings > 0 {
            // Against the centre of the cube of twice the edge.
            place = 0.5 * (place + (cube & 1).as_vec3() - 0.5);
            (cube, edge) = (cube >> 1, 2.0 * edge);
        }
        let Some(number) = level.number(cube) else { continue };
        let surface = &level.surfaces[number];
        if !surface.is_some() {
            continue;
        }
        let (slope, height) = surface.quadric.at(place);
        let scale = slope.length_recip();
        let normal = slope * scale;
        let variance = surface.variance_at(place);
        let bias = smaller[..count].iter().fold(0.0f32, |bias, &(other, other_variance)| {
            let cosine = normal.dot(other);
            bias.max(1.0 - cosine * cosine - variance - other_variance - SAME)
        });
        if bias >= best.error {
            break;
        }
        smaller[count] = (normal, variance);
        count += 1;

        let square = edge * edge;
        let (noise, width) = (surface.noise * square, surface.width * square);
        let chance = (2.0 / surface.points).sqrt();
        let misfit = (noise - reference * (1.0 + EXCESS * chance)).max(0.0);
        let error = bias + variance + MISFIT * misfit / width;
        let is_flat = surface.is_curved && noise * FLAT < width;
        if error <= best.error {
            let bend = surface.quadric.bend.scaled(scale / edge);
            let quadric = Quadric { centre: centroid, height: height * scale * edge, slope: normal, bend };
            let flat_noise = if is_flat { noise } else { f32::INFINITY };
            let variation = surface.variation;
            let sag = bend.square() * (3.125 * 3.125);
            let is_plane = is_flat && !surface.lacks_detail && sag <= SAG * noise + FLAT_SAG;
            let plane_noise = if is_plane { noise } else { f32::INFINITY };
            best = Chosen { quadric, noise, chance, error, variation, flat_noise, plane_noise, doublings };
        }
        if is_flat {
            reference = reference.min(noise * (1.0 + EXCESS * (2.0 / (surface.points - 6.0)).sqrt()));
        }
    }
    best
}
