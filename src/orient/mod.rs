//! The signs of normals, whichever method found them.
//!
//! `docs/orientation.md` explains the rule, its sources and its limits. In short: the points of each small cube are parted into
//! patches ([`patches`]), a patch and those round it say whether their signs agree ([`links`]), and so do the two sides of a
//! wall ([`walls`]), which sides of a patch are open to the air says which way is out ([`air`]), and the signs are chosen that
//! these agree with best ([`groups`]), of open surfaces and of hidden parts also what they see of each other ([`looks`]). These then face
//! what stands before them ([`facing`]), or the scanner, if one saw all: where it stood, if densities tell that ([`station`]),
//! or the direction from which it did ([`view`]), or several that stood amid them ([`stations`]). Of a few points that are no
//! surface, what is round them tells the side ([`specks`]). In noise normals then become means of those about them ([`means`]),
//! and without noise points are turned that stand in the patch of another surface, and those next to edges get the normal of the
//! sheet that they lie on ([`misfits`], [`fits`]).

mod air;
mod ball;
mod components;
mod cubes;
mod ends;
mod eye;
mod facing;
mod fits;
mod fours;
mod groups;
mod links;
mod looks;
mod means;
mod misfits;
mod parted;
mod patches;
mod place;
mod sheets;
mod signs;
mod specks;
mod spots;
mod station;
mod stations;
mod support;
mod thinning;
mod view;
mod walls;

pub use components::{Component, Components, Side};

use crate::cell::Density;
use crate::error::Error;
use crate::grid::Grid;
use crate::lists::filled;
use crate::options::{Cell, Method, Options, Orient};
use crate::parallel::{self, Scatter};
use crate::points::{Bounds, CHUNK, Points};
use crate::progress::Stage;
use air::Sights;
use ball::Ball;
use components::decide;
use cubes::Cubes;
use glam::{DVec3, Vec3};
use groups::Groups;
use links::{Links, Pair};
use looks::Looks;
use patches::{Members, Patches};
use signs::{Choice, Signs};
use spots::spots;
use station::Station;
use stations::Stations;
use view::View;

/// What was found out about the surfaces of a cloud.
pub(crate) struct Surfaces {
    pub components: Components,
    /// If asked for, for each point the number of its component by size, or [`NONE`].
    pub of_point: Option<Vec<u32>>,
}

/// What errors call the memory of the search for scanners.
const WHAT: &str = "the scanners";

/// The component of a point without a normal.
const NONE: u32 = u32::MAX;

/// Turns the normals of all points as `options.orient` asks; answers for surfaces what was decided for each. `points` may
/// be missing if the signs do not need them ([`Orient::needs_positions`]).
///
/// Towards a position or a direction: one pass over the points. Otherwise linear in the points; besides these and the normals
/// some 27 bytes for each on smooth surfaces, up to 190 where there is no surface at all.
pub(crate) fn orient(
    points: Option<&Points>,
    normals: &mut [Vec3],
    bounds: &Bounds,
    options: &Options,
    stage: &Stage,
) -> Result<Option<Surfaces>, Error> {
    debug_assert!(points.is_some() || !options.orient.needs_positions());
    match (options.orient, points) {
        (Orient::Up(up), _) => {
            // Of length about 1, so that no product vanishes.
            let up = DVec3::from(up) / DVec3::from(up).abs().max_element();
            face(normals, &|_| up, stage).map(|()| None)
        }
        (Orient::None, _) | (_, None) => Ok(None),
        (Orient::Viewpoint(viewpoint), Some(points)) => {
            // Half of each: so their difference is a number, whatever they are.
            let viewpoint = 0.5 * DVec3::from(viewpoint) - 0.5 * points.origin;
            // From farther away it would be the same direction.
            let nearer = (1e300 * points.unit / viewpoint.abs().max_element()).min(1.0);
            let viewpoint = viewpoint * nearer / (0.5 * points.unit);
            face(normals, &|point| viewpoint - points.positions[point].as_dvec3(), stage).map(|()| None)
        }
        (Orient::Consistent | Orient::Outward, Some(points)) => {
            let density = Density::of(points, bounds)?;
            surfaces(points, normals, bounds, &density, options, stage).map(Some)
        }
    }
}

/// Turns the normal of every point to the side that `towards` names; one across it keeps its sign.
fn face(normals: &mut [Vec3], towards: &(dyn Fn(usize) -> DVec3 + Sync), stage: &Stage) -> Result<(), Error> {
    let count = normals.len();
    let normals = Scatter::new(normals);
    stage.run(count.div_ceil(CHUNK), &|i| {
        let chunk = parallel::piece(count, CHUNK, i);
        // SAFETY: each point belongs to one chunk.
        let normals = unsafe { normals.slice(chunk.clone()) };
        for (normal, point) in normals.iter_mut().zip(chunk) {
            if towards(point).dot(normal.as_dvec3()) < 0.0 {
                *normal = flip(*normal);
            }
        }
    })
}

/// One sign for each surface, outwards, or towards what stands before it.
fn surfaces(
    points: &Points,
    normals: &mut [Vec3],
    bounds: &Bounds,
    density: &Density,
    options: &Options,
    stage: &Stage,
) -> Result<Surfaces, Error> {
    let mut cubes = cubes::sort(points, normals, bounds, density, &stage.part(0.0..0.35))?;
    let (patches, members) = Patches::of(&cubes.grid, normals, (cubes.noise, cubes.slack), &stage.part(0.35..0.5))?;
    // Half of all the memory, and only its order is needed from here on.
    cubes.grid.placed = Vec::new();
    let Cubes { grid, distinct, noise, .. } = &cubes;
    let ball = Ball::of(grid, distinct);
    let sights = air::sights(&ball, grid, &patches, points.len(), &stage.part(0.5..0.55))?;
    let (links, walls) = Links::of(grid, &patches, *noise, &stage.part(0.55..0.7))?;
    let groups = Groups::of(links, &sights, &patches, &stage.part(0.7..0.8))?;
    let choosing = stage.part(0.8..0.9);
    let (choice, looks, scanner) = match options.orient {
        Orient::Outward => (outward((groups, walls), (grid, *noise), &patches, &sights, &choosing)?, None, None),
        _ => consistent((groups, walls), &ball, &cubes, &patches, &sights, &choosing)?,
    };
    let (mut signs, links) = choice.into_signs();
    let mut decisions = decide(grid, &patches, &sights, links.as_ref(), &mut signs)?;
    drop(links);
    match scanner {
        Some(Scanner::At(station)) => station.turn_to_it(grid, &patches, &mut signs, &mut decisions)?,
        Some(Scanner::Amid(stations)) => stations.turn_to_them(grid, &patches, &mut signs, &mut decisions)?,
        Some(Scanner::Towards(view)) => {
            view.turn_to_it((&ball, grid, &patches), looks.as_ref(), &mut signs, &mut decisions)?
        }
        None if options.orient == Orient::Consistent => {
            let facing = stage.part(0.9..0.95);
            facing::turn_to_what_looks(grid, &patches, &sights, looks, &mut signs, &mut decisions, &facing)?;
        }
        None => {}
    }
    let last = stage.part(0.95..1.0);
    specks::settle(grid, &patches, &mut signs, &mut decisions, &last.part(0.0..0.1))?;
    let components = Components::of(&decisions)?;
    let of_point = turn(grid, &patches, &members, &signs, normals, options.components, &last.part(0.1..0.4))?;
    let lines_may_change = options.method == Method::Bilinear && options.cell == Cell::Auto;
    if lines_may_change {
        means::average(points, &cubes, (&patches, &members), &signs, normals, &last.part(0.4..0.8))?;
    }
    misfits::mend(points, &cubes, (&patches, &members), &signs, lines_may_change, normals, &last.part(0.8..1.0))?;
    last.tell(1.0)?;
    Ok(Surfaces { components, of_point })
}

/// Where the scanner was that saw all, or several.
enum Scanner {
    /// In this place.
    At(Station),
    /// In these places.
    Amid(Stations),
    /// In this direction.
    Towards(View),
}

/// Signs that count all of the open, but of what is not closed a share: much of that sees the open with its inside.
fn outward(
    groups: (Groups, Vec<Pair>),
    (grid, noise): (&Grid, f32),
    patches: &Patches,
    sights: &Sights,
    stage: &Stage,
) -> Result<Choice, Error> {
    let mut choice = Choice::of(groups, (grid, noise), patches, sights, &stage.part(0.0..0.6))?;
    if choice.is_any_open() {
        choice.be_cautious(None, sights, &stage.part(0.6..1.0))?;
    }
    Ok(choice)
}

/// Signs that trust no part of the open that may mislead: of what is not closed a share counts, beside what its patches see of
/// each other; but not where all was seen from one place, because that is open all over behind, and the hollow side of it looks
/// at itself. Also these looks, if there is anything that is not closed, and the scanner or several, if these saw all.
fn consistent(
    groups: (Groups, Vec<Pair>),
    ball: &Ball,
    cubes: &Cubes,
    patches: &Patches,
    sights: &Sights,
    stage: &Stage,
) -> Result<(Choice, Option<Looks>, Option<Scanner>), Error> {
    let (grid, noise) = (&cubes.grid, cubes.noise);
    let mut choice = Choice::of(groups, (grid, noise), patches, sights, &stage.part(0.0..0.6))?;
    let mut looks = None;
    if choice.is_any_open() {
        looks = Some(Looks::from_the_open(grid, patches, sights)?);
        choice.trust_links(&stage.part(0.6..0.65))?;
    }
    let spots = spots(ball, grid, patches, WHAT)?;
    let scanner =
        if let Some(station) = Station::of(&spots, ball, cubes, patches, choice.signs(), choice.is_all_closed())? {
            Some(Scanner::At(station))
        } else if let Some(stations) = Stations::of(&spots, grid, patches, sights, choice.signs())? {
            Some(Scanner::Amid(stations))
        } else {
            view(&mut choice, (ball, grid, patches), noise, sights, &stage.part(0.65..0.8))?.map(Scanner::Towards)
        };
    if looks.is_some() && scanner.is_none() {
        choice.be_cautious(looks.as_ref(), sights, &stage.part(0.8..1.0))?;
    }
    Ok((choice, looks, scanner))
}

/// The view that the cloud is, if it is one: by links alone, or where these are not enough by some of the air, too. The signs are
/// by links unless the others fit clearly better.
fn view(
    choice: &mut Choice,
    (ball, grid, patches): (&Ball, &Grid, &Patches),
    noise: f32,
    sights: &Sights,
    stage: &Stage,
) -> Result<Option<View>, Error> {
    let by_links = View::of((ball, grid, patches), noise, choice.signs(), &stage.part(0.0..0.3))?;
    if !choice.is_any_open() || by_links.as_ref().is_some_and(View::is_sure) {
        return Ok(by_links);
    }
    let signs_by_links = choice.be_cautious(None, sights, &stage.part(0.3..0.5))?;
    let by_air = View::of((ball, grid, patches), noise, choice.signs(), &stage.part(0.5..1.0))?;
    if by_links.as_ref().is_some_and(|view| by_air.as_ref().is_none_or(|other| view.is_as_good(other))) {
        choice.exchange(signs_by_links);
        return Ok(by_links);
    }
    Ok(by_air)
}

/// Gives every point the sign of its patch, and tells the component of each if asked to.
fn turn(
    grid: &Grid,
    patches: &Patches,
    members: &Members,
    signs: &Signs,
    normals: &mut [Vec3],
    tell: bool,
    stage: &Stage,
) -> Result<Option<Vec<u32>>, Error> {
    let mut of_point = if tell { Some(filled(NONE, normals.len(), "the components")?) } else { None };
    let mut is_turned = filled(false, normals.len(), "the turned normals")?;
    let (turned, components) = (Scatter::new(&mut is_turned), of_point.as_deref_mut().map(Scatter::new));
    stage.part(0.0..0.7).run(grid.blocks.len(), &|block| {
        for (_, cube, _) in grid.cubes_in(block) {
            let first = patches.of_cube(cube).start;
            for (point, membership) in members.of_cube(grid, cube) {
                let Some((number, is_opposite)) = membership.patch() else { continue };
                let patch = first + number;
                // SAFETY: every point of the input stands in the grid once at the most.
                let is_turned = &mut unsafe { turned.slice(point..point + 1) }[0];
                *is_turned = is_opposite != signs.flipped[patch];
                if let Some(components) = &components {
                    let component = &mut unsafe { components.slice(point..point + 1) }[0];
                    *component = signs.component[patch];
                }
            }
        }
    })?;
    // One after the other: turned as the cubes have them, each would be waited for.
    let count = normals.len();
    let normals = Scatter::new(normals);
    stage.part(0.7..1.0).run(count.div_ceil(CHUNK), &|i| {
        let chunk = parallel::piece(count, CHUNK, i);
        // SAFETY: each point belongs to one chunk.
        let normals = unsafe { normals.slice(chunk.clone()) };
        for (normal, &is_turned) in normals.iter_mut().zip(&is_turned[chunk]) {
            // No jump: nothing foretells who is. As by `flip`, to the bit.
            *normal -= 2.0 * f32::from(is_turned) * *normal;
        }
    })?;
    Ok(of_point)
}

/// The other sign, and no negative zeros.
fn flip(normal: Vec3) -> Vec3 {
    Vec3::ZERO - normal
}
