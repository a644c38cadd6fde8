//! The signs of normals, whichever method found them.
//!
//! `docs/orientation.md` explains the rule, its sources and its limits. In short: the points of each small cube are parted
//! into patches ([`patches`]), a patch and those round it say whether their signs agree ([`links`]), which sides of a patch
//! are open to the air says which way is out ([`air`]), and the signs are chosen that these agree with best ([`groups`]).

mod air;
mod groups;
mod links;
mod patches;

use crate::bricks::set_bits;
use crate::cell;
use crate::error::Error;
use crate::grid::Grid;
use crate::lattice::{CUBES, Lattice, cube_centre};
use crate::options::Orient;
use crate::parallel::{self, Scatter};
use crate::points::{Bounds, Bulk, CHUNK, Points, filled, reserve};
use crate::progress::Stage;
use glam::{DVec3, Vec3};
use groups::Signs;
use links::Links;
use patches::Patches;

/// One surface in itself: what is not linked to any other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Component {
    /// Points of it.
    pub points: u64,
    /// What told its outside.
    pub side: Side,
    /// From 0, a guess, to 1: how much more of the evidence speaks for that side than for the other.
    pub confidence: f64,
}

/// What told the outside of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The open air: it lies on one side of the surface only.
    Air,
    /// The larger volume: the surface is open, and its normals point away from its middle.
    Volume,
}

impl Side {
    /// In one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Air => "air",
            Self::Volume => "volume",
        }
    }
}

/// Points in a cube: as many as tell noise from a wall.
const POINTS_PER_CELL: f64 = 16.0;

/// Where points lie further off their planes, in edges, the cubes are too small: uniform points in a cube lie 0.29 off its
/// middle.
const LARGEST_NOISE: f32 = 0.28;
const ENLARGEMENT: f64 = 1.25;
const ENLARGEMENTS: u32 = 3;

/// How many patches of a group count fully for what lies in the open. Few: an open box, or the corner of a room, is seen from
/// its wrong side too, and its edges must outweigh that; at most as many as a spike has.
const SPAN: f32 = 4.0;

/// Where less of the surface than this looks into the open on one side only, the air says nothing.
const LEAST_CONFIDENCE: f64 = 0.2;

/// Turns the normals of all points as `orient` asks; answers for surfaces what was decided for each, the largest first.
///
/// Towards a position or a direction: one pass over the points. Otherwise linear in the points; besides these and the normals
/// some 35 bytes for each on smooth surfaces, up to 130 in vegetation.
pub(crate) fn orient(
    points: &Points,
    normals: &mut [Vec3],
    bounds: &Bounds,
    orient: Orient,
    stage: &Stage,
) -> Result<Option<Vec<Component>>, Error> {
    match orient {
        Orient::None => Ok(None),
        Orient::Viewpoint(viewpoint) => {
            let viewpoint = (DVec3::from(viewpoint) - points.origin) / points.unit;
            face(points, normals, &|point| viewpoint - point.as_dvec3(), stage).map(|()| None)
        }
        Orient::Up(up) => face(points, normals, &|_| DVec3::from(up), stage).map(|()| None),
        Orient::Consistent => surfaces(points, normals, bounds, SPAN, stage).map(Some),
        Orient::Outward => surfaces(points, normals, bounds, f32::INFINITY, stage).map(Some),
    }
}

/// Turns every normal to the side that `towards` names; one across it keeps its sign.
fn face(
    points: &Points,
    normals: &mut [Vec3],
    towards: &(dyn Fn(Vec3) -> DVec3 + Sync),
    stage: &Stage,
) -> Result<(), Error> {
    let count = normals.len();
    let normals = Scatter::new(normals);
    stage.run(points.chunks(), &|i| {
        // SAFETY: each point belongs to one chunk.
        let normals = unsafe { normals.slice(parallel::piece(count, CHUNK, i)) };
        for (normal, &point) in normals.iter_mut().zip(points.chunk(i)) {
            if towards(point).dot(normal.as_dvec3()) < 0.0 {
                *normal = flip(*normal);
            }
        }
    })
}

/// One sign for each surface, outwards. Up to `span` patches what lies in the open counts by area.
fn surfaces(
    points: &Points,
    normals: &mut [Vec3],
    bounds: &Bounds,
    span: f32,
    stage: &Stage,
) -> Result<Vec<Component>, Error> {
    let (grid, noise) = sort(points, normals, bounds, &stage.part(0.0..0.35))?;
    let patches = Patches::of(&grid, normals, noise, &stage.part(0.35..0.5))?;
    let exposure = air::exposure(&grid, &patches, points.len(), &stage.part(0.5..0.55))?;
    let links = Links::of(&grid, &patches, noise, &stage.part(0.55..0.7))?;
    let mut signs = groups::signs(links, exposure.clone(), span, &stage.part(0.7..0.95))?;
    let components = decide(&grid, &patches, &exposure, &mut signs)?;
    turn(&grid, &patches, &signs.flipped, normals, &stage.part(0.95..1.0))?;
    Ok(components)
}

/// Cubes of a few points, and the noise in their edges: cubes so large that a noisy surface is no thicker than one.
fn sort(points: &Points, normals: &[Vec3], bounds: &Bounds, stage: &Stage) -> Result<(Grid, f32), Error> {
    let bulk = Bulk::of_points(points);
    let mut edge = cell::populated_edge(points, bounds, &bulk, POINTS_PER_CELL)?;
    let mut enlargements = 0;
    loop {
        let start = f64::from(enlargements) / f64::from(ENLARGEMENTS + 1);
        let own = stage.part(start..start + 1.0 / f64::from(ENLARGEMENTS + 1));
        let lattice = Lattice::new(bounds, &|| bulk.median, edge, CUBES);
        let (grid, _) = Grid::sort(points, &lattice, &own, |_, _| ())?;
        let noise = patches::noise(&grid, normals);
        if noise <= LARGEST_NOISE || enlargements == ENLARGEMENTS {
            return Ok((grid, noise));
        }
        edge *= ENLARGEMENT;
        enlargements += 1;
    }
}

/// Sums over a component, with its normals as they were signed.
#[derive(Clone, Copy, Default)]
struct Sums {
    points: u64,
    place: DVec3,
    normal: DVec3,
    /// The sum of place . normal.
    flux: f64,
    exposure: f64,
    all_exposure: f64,
    /// The sum of distances from the middle.
    reach: f64,
    /// Whether the component faces inwards.
    is_turned: bool,
}

/// Turns the components that face inwards, and tells how sure that is; those without an inside away from their middle.
fn decide(grid: &Grid, patches: &Patches, exposure: &[f32], signs: &mut Signs) -> Result<Vec<Component>, Error> {
    let mut all = filled(Sums::default(), signs.components, "the components")?;
    let places = || {
        (0..grid.bricks.len()).flat_map(|brick| {
            let corner = 4.0 * grid.bricks.places[brick].as_dvec3();
            let cubes = grid.first_cube[brick] as usize..grid.first_cube[brick + 1] as usize;
            cubes.zip(set_bits(grid.masks[brick])).flat_map(move |(cube, bit)| {
                let centre = corner + cube_centre(bit).as_dvec3();
                (patches.first[cube] as usize..patches.first[cube + 1] as usize)
                    .map(move |i| (i, centre + patches.all[i].centre.as_dvec3()))
            })
        })
    };
    for (i, place) in places() {
        let (patch, sums) = (&patches.all[i], &mut all[signs.component[i] as usize]);
        let sign = if signs.flipped[i] { -1.0 } else { 1.0 };
        let normal = sign * f64::from(patch.points) * patch.normal.as_dvec3();
        sums.points += u64::from(patch.points);
        sums.place += f64::from(patch.points) * place;
        sums.normal += normal;
        sums.flux += place.dot(normal);
        sums.exposure += sign * f64::from(exposure[i]);
        sums.all_exposure += f64::from(exposure[i].abs());
    }
    for (i, place) in places() {
        let sums = &mut all[signs.component[i] as usize];
        sums.reach += f64::from(patches.all[i].points) * place.distance(sums.place / sums.points as f64);
    }
    let share = |part: f64, all: f64| if all > 0.0 { part / all } else { 0.0 };
    let mut components = Vec::new();
    reserve(&mut components, all.len(), "the components")?;
    for sums in &mut all {
        let points = sums.points;
        let air = share(sums.exposure, sums.all_exposure);
        let volume = share(sums.flux - sums.place.dot(sums.normal) / points as f64, sums.reach);
        let (side, evidence) = if air.abs() >= LEAST_CONFIDENCE { (Side::Air, air) } else { (Side::Volume, volume) };
        components.push(Component { points, side, confidence: evidence.abs().min(1.0) });
        sums.is_turned = evidence < 0.0;
    }
    for (flipped, &component) in signs.flipped.iter_mut().zip(&signs.component) {
        *flipped ^= all[component as usize].is_turned;
    }
    components.sort_by_key(|component| std::cmp::Reverse(component.points));
    Ok(components)
}

/// Gives every point the sign of its patch.
fn turn(grid: &Grid, patches: &Patches, flipped: &[bool], normals: &mut [Vec3], stage: &Stage) -> Result<(), Error> {
    let normals = Scatter::new(normals);
    stage.run(grid.blocks.len(), &|block| {
        for brick in grid.blocks[block].clone() {
            let first = grid.first_cube[brick] as usize;
            let mut start = grid.first_point[brick] as usize;
            for (cube, (points, _)) in (first..).zip(grid.cubes_of(brick)) {
                let patches_of_cube = patches.first[cube] as usize;
                for (placed, membership) in points.iter().zip(&patches.of_point[start..]) {
                    if let Some((number, is_opposite)) = membership.patch()
                        && is_opposite != flipped[patches_of_cube + number]
                    {
                        let point = placed.point as usize;
                        // SAFETY: every point of the input stands in the grid once at the most.
                        let normal = &mut unsafe { normals.slice(point..point + 1) }[0];
                        *normal = flip(*normal);
                    }
                }
                start += points.len();
            }
        }
    })
}

/// The other sign, and no negative zeros.
fn flip(normal: Vec3) -> Vec3 {
    Vec3::ZERO - normal
}
