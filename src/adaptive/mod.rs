//! Normals without a size to choose: every place takes the neighbourhood that its noise and its detail allow.
//!
//! `docs/adaptive.md` explains the rule, its sources and its limits. In short: a quadratic surface through the 27 cubes
//! round each cube, on grids of ever larger cubes ([`level`], [`surface`]); for each cube the size that is least in error
//! ([`choose`]); where the surfaces round a cube then agree they give the normals of its points, where not the cube is
//! divided, and where that is of no use or not possible the points vote ([`vote`]). With signs for surfaces, points of narrow faces
//! without noise lie on planes of their own ([`facets`]), and on either of two sheets that nearly touch ([`sheets`]).

mod around;
mod choose;
mod faces;
mod facets;
mod level;
mod matrix;
mod samples;
mod sheets;
mod surface;
mod tally;
mod vote;

use crate::error::Error;
use crate::frame::Frame;
use crate::lattice::{self, Lattice};
use crate::lists::grow;
use crate::normals::{Found, Normals};
use crate::options::Options;
use crate::points::Points;
use crate::power::exp2;
use crate::progress::{Progress, Stage};
use crate::rounding::Rounding;
use crate::source::Source;
use choose::{Chosen, choose};
use level::{Level, Role};
use std::ops::Range;
use tally::Tally;
use vote::Vote;

/// Normals, and what was decided.
pub(crate) struct Adaptive {
    pub found: Found,
    /// Cubes that hold points and were not divided.
    pub cubes: u64,
    /// Those of them that rest on a surface.
    pub surfaces: u64,
    /// The deviation of the points from the surfaces, in edges of the base: half of the points have less.
    pub noise: f64,
    /// Edges of the chosen cubes in edges of the base, and how many points took each. The smallest first.
    pub scales: Vec<(f64, u64)>,
}

/// What errors call the memory of all this.
const WHAT: &str = "the surfaces";

/// How often a cube may be divided.
const DIVISIONS: usize = 8;

/// Cubes of the base along an axis at the most, so that all their parts have places.
pub(crate) const CUBES: f64 = lattice::CUBES / (1 << DIVISIONS) as f64;

/// How often the edge may be doubled, until two cubes along an axis are left.
const DOUBLINGS: usize = 21;
const _: () = assert!(CUBES == (2 << DOUBLINGS) as f64);

/// Sizes of cubes in all.
const SIZES: usize = DIVISIONS + DOUBLINGS + 1;

/// Finds the normals of all points, which are in `frame`, on cubes of `lattice`; gives the points up when they are sorted. Where
/// coordinates are coarse ([`crate::rounding`]) no planes are taken for faces that only the points on them tell.
/// Calls `lap` at the end of each phase. In time linear in the points; what is divided to the end takes some ten times as long
/// as what is smooth.
#[optimize(size)]
#[inline(never)]
pub(crate) fn normals(
    points: Points,
    lattice: &Lattice,
    frame: &Frame,
    options: &Options,
    rounding: Rounding,
    progress: &Progress,
    lap: &mut dyn FnMut(&'static str),
) -> Result<Adaptive, Error> {
    let mut base = Level::new(&Source::new(&points, *lattice), rounding.variance, &progress.stage("sort", 0.06..0.28))?;
    let count = points.len();
    drop(points);
    // At once: they fit into the memory that the positions had, unless something smaller takes a part of it first.
    let normals = Normals::new(count, base.grid.placed.len(), options.curvature, frame)?;
    base.sample(None, &progress.stage("sort", 0.28..0.3))?;
    lap("sort");
    let mut levels = vec![base];
    let stage = progress.stage("surfaces", 0.3..0.5);
    for i in 1.. {
        // Each level is a quarter of the one before: half of what is left of the stage is more than enough.
        let part = stage.part(halving(i));
        let last = levels.len() - 1;
        levels[last].fit(&part.part(0.0..0.5))?;
        if levels[last].lattice.size().max_element() <= 2.0 {
            break;
        }
        let coarser = levels[last].coarser(&part.part(0.5..1.0))?;
        levels.push(coarser);
        if last > 0 {
            levels[last].release_points();
        }
    }
    // The smallest cubes are the last from here on.
    levels.reverse();
    lap("surfaces");

    let stage = progress.stage("vote", 0.5..0.6);
    let chosen = choose(&levels, &stage.part(0.0..0.4))?;
    let tally = Tally::new();
    // Without signs they are never asked for, and left out of the module then.
    let facets = cfg!(feature = "full") && options.orient.is_of_surfaces() && !rounding.is_coarse;
    let exact = facets && facets::are_exact(&levels[levels.len() - 1], &chosen);
    let mut run =
        Run { batch: BATCH.max(count / 8), facets, exact, normals: &normals, tally: &tally, cubes: 0, surfaces: 0 };
    let parts = run.settle(&levels, &chosen, 0, &stage.part(0.4..1.0))?;
    drop(chosen);
    lap("vote");
    run.divide(&mut levels, &parts, 0, &progress.stage("detail", 0.6..1.0))?;
    progress.update("detail", 1.0)?;
    lap("detail");
    let Run { cubes, surfaces, .. } = run;
    // SAFETY: every point of the base was in a cube that was divided, or in one that was not.
    let found = unsafe { normals.complete() };
    Ok(Adaptive { found, cubes, surfaces, noise: tally.noise(), scales: tally.scales() })
}

/// What goes through all divisions.
struct Run<'a> {
    /// About how many points are divided at a time.
    batch: usize,
    /// Whether narrow faces are told by points: where signs are, lines matter most.
    facets: bool,
    /// Whether they may be told everywhere: points lie exactly on their surfaces.
    exact: bool,
    normals: &'a Normals,
    tally: &'a Tally,
    cubes: u64,
    surfaces: u64,
}

impl Run<'_> {
    /// Finds the normals of all points in the smallest cubes, the last of the levels, but not in those that are to be
    /// divided: answers what the parts of each cube are for, and only those of the divided ones are wanted.
    #[optimize(size)]
    fn settle(
        &mut self,
        levels: &[Level],
        chosen: &[Chosen],
        division: usize,
        stage: &Stage,
    ) -> Result<Vec<Role>, Error> {
        let level = &levels[levels.len() - 1];
        let vote = Vote {
            level,
            chosen,
            division,
            facets: self.facets,
            exact: self.exact,
            normals: self.normals,
            tally: self.tally,
        };
        let parts = vote.run(stage)?;
        let is_done = |cube: usize| level.role(cube) == Role::Wanted && parts[cube] != Role::Wanted;
        for (_, chosen) in chosen.iter().enumerate().filter(|&(cube, _)| is_done(cube)) {
            self.cubes += 1;
            self.surfaces += u64::from(chosen.is_some());
        }
        Ok(parts)
    }

    /// Divides those of the smallest cubes whose parts are wanted, some at a time, so that a cloud that is rough everywhere
    /// takes hardly more memory than another.
    #[optimize(size)]
    fn divide(&mut self, levels: &mut Vec<Level>, parts: &[Role], division: usize, stage: &Stage) -> Result<(), Error> {
        let last = levels.len() - 1;
        let mut batches = Vec::new();
        let (mut start, mut points) = (0, 0);
        for end in 1..=parts.len() {
            points += if parts[end - 1] == Role::Wanted { levels[last].points(end - 1).len() } else { 0 };
            if points >= self.batch || end == parts.len() && points > 0 {
                grow(&mut batches, 1, WHAT)?;
                batches.push((points, start..end));
                (start, points) = (end, 0);
            }
        }
        // The largest one last: then the points are not needed here any more. It may have nearly all, also of its own parts, and
        // so on.
        if let Some(largest) = (0..batches.len()).max_by_key(|&i| batches[i].0) {
            batches[largest..].rotate_left(1);
        }
        let total: usize = batches.iter().map(|(points, _)| points).sum();
        let (mut done, count) = (0, batches.len());
        for (i, (points, batch)) in batches.into_iter().enumerate() {
            let stage = stage.part(done as f64 / total as f64..(done + points) as f64 / total as f64);
            done += points;
            let finer = levels[last].divided(parts, batch, &stage.part(0.0..0.3))?;
            if i + 1 == count {
                levels[last].release_points();
            }
            levels.push(finer);
            let chosen = choose(levels, &stage.part(0.3..0.4))?;
            let parts = self.settle(levels, &chosen, division + 1, &stage.part(0.4..0.5))?;
            drop(chosen);
            self.divide(levels, &parts, division + 1, &stage.part(0.5..1.0))?;
            levels.pop();
        }
        Ok(())
    }
}

/// At least so many points are divided at a time.
const BATCH: usize = 1 << 16;

/// Of a stage in parts that each take half of what is left, the `i`th, from 1.
fn halving(i: i32) -> Range<f64> {
    1.0 - exp2(1.0 - f64::from(i))..1.0 - exp2(-f64::from(i))
}
