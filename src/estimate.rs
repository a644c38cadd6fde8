//! The pipeline: the only file that knows all stages.

use crate::adaptive;
use crate::baseline::{self, Baseline, Tree};
use crate::bilinear;
use crate::cell::{self, Density};
use crate::error::Error;
use crate::frame::Frame;
use crate::grid::Grid;
use crate::lattice::{CUBES, Lattice};
use crate::message::message;
use crate::nodes::{self, Node};
use crate::normals::Found;
use crate::options::{Cell, Method, Options, Orient};
use crate::orient::{Components, orient};
use crate::points::{Bounds, Bulk, Points};
use crate::progress::Progress;
use crate::rounding::Rounding;
use crate::source::Source;

/// The normals of a cloud, and how they were found.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// `nx0 ny0 nz0 nx1 ...`, one unit vector a point in the order of the input, or zero for an unresolved point.
    pub normals: Vec<f32>,
    /// If asked for, the surface variation `lambda3 / (lambda1 + lambda2 + lambda3)` of each point's neighbourhood, from 0
    /// (flat) to 1/3 (Pauly, Gross and Kobbelt 2002); 0 for an unresolved point. With [`Cell::Auto`] it is that of the 27
    /// cubes of the size chosen for the point's cube, nearer ones counted more. With cubes of one size a node has that
    /// of its 27 cubes, and a point the mean of its nodes, by the weights of its normal. For the baselines the
    /// neighbourhood is the k nearest points, for [`Method::Egg`] together with the point itself.
    pub curvature: Option<Vec<f32>>,
    /// If asked for, for each point the number of its surface among those of [`Report::components`], 0 for the largest;
    /// `u32::MAX` for an unresolved point, and for strays too far from the others to count.
    pub components: Option<Vec<u32>>,
    /// What was done.
    pub report: Report,
}

/// What an estimate did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Points of the input.
    pub points: u64,
    /// Points that got the zero vector: not finite, or without neighbours that determine a plane.
    pub unresolved: u64,
    /// Cubes that hold points. This and all about cubes and nodes is 0 for the baselines, which have none.
    pub cells: u64,
    /// Cubes that hold their node.
    pub nodes: u64,
    /// Cubes along each axis of the bounding box, at most 2^30; with [`Cell::Auto`] along axes of the cloud's own, at most 2^22.
    pub grid: [u64; 3],
    /// Edge of a cube, in units of the input: no more than twice the longest side of the cloud, because larger cubes hold the same.
    pub cell_size: f64,
    /// Edge of a cube, in multiples of the paper's L (Eq. 1).
    pub scale: f64,
    /// How far the points lie off the surfaces that were chosen for them, in units of the input: the deviation that half of
    /// them do not exceed, to 2 %; 0 if there is no surface. No less than coordinates are off by that were rounded to
    /// more than a sixth of the spacing. Only [`Cell::Auto`] measures it.
    pub noise: Option<f64>,
    /// The sizes of the neighbourhoods that [`Cell::Auto`] chose, the smallest first.
    pub scales: Vec<Scale>,
    /// The surfaces that [`Orient::Consistent`] and [`Orient::Outward`] gave one sign each; only they do.
    pub components: Option<Components>,
    /// Points interpolated from 0, 1, 2, 3 and 4 nodes. Those from 0 took the nearest node or their own plane, or were
    /// found without nodes.
    pub nodes_used: [u64; 5],
    /// Phases in their order, and what each took by the clock of the [`Progress`].
    pub milliseconds: Vec<(&'static str, f64)>,
}

/// Neighbourhoods of one size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Edge of the cubes, in units of the input. A neighbourhood is 27 of them.
    pub cell_size: f64,
    /// Points whose cube rests on such a neighbourhood.
    pub points: u64,
}

/// Estimates the normals of a cloud.
///
/// Output length equals input length; a point that is not finite, or that has no neighbours to tell a plane from, gets
/// the zero vector and influences no other. The result is the same to the bit for any number of threads.
///
/// [`Method::Bilinear`] is linear in the number of points. Beyond the input it takes about 30 bytes a point with cubes that
/// hold 4 points or more, up to some 130 when every point has a cube for itself; with [`Cell::Auto`] about 40, up to 70
/// where no surface is smooth, and 12 for a copy of positions that are borrowed, or that signs need. The baselines take
/// n log n time and 30 bytes a point. Signs by [`Orient::Consistent`] and [`Orient::Outward`] take 27 bytes a point after all
/// that is given back, up to 190 where there is no surface.
///
/// # Errors
/// [`Error::Input`] and [`Error::Unsupported`] for the options, [`Error::Limit`] when memory does not suffice,
/// [`Error::Cancelled`] when `progress` asked for it.
pub fn estimate(points: &Points, options: &Options, progress: &Progress) -> Result<Estimate, Error> {
    let points = points.borrowed();
    // With only the default options there is nothing that could do without a copy.
    run(if cfg!(feature = "full") { points } else { points.owned()? }, options, progress)
}

/// As [`estimate`], with the same result, of points that own their memory ([`Points::from_vec`], [`Points::from_f64`]): it is
/// given up when they are sorted, unless signs need it, so that they take 12 bytes a point less at the most.
///
/// # Errors
/// Those of [`estimate`].
pub fn estimate_owned(points: Points, options: &Options, progress: &Progress) -> Result<Estimate, Error> {
    run(points, options, progress)
}

#[optimize(size)]
fn run(points: Points, options: &Options, progress: &Progress) -> Result<Estimate, Error> {
    options.validate()?;
    // Places and counts are 32-bit numbers.
    if points.len() >= u32::MAX as usize {
        return Err(Error::Input(message!["the cloud has ", points.len(), " points; at most ", u32::MAX - 1, " fit"]));
    }
    let share = match options.orient {
        _ if !cfg!(feature = "full") => 1.0,
        Orient::None => 1.0,
        Orient::Viewpoint(_) | Orient::Up(_) => 0.97,
        Orient::Consistent | Orient::Outward => 0.8,
    };
    let first = progress.part(0.0..share);
    let mut laps = Laps::start(&first);

    first.update("bounds", 0.0)?;
    let cloud = Cloud { count: points.len(), unit: points.unit, bounds: Bounds::of(&points) };
    laps.end("bounds");

    if !cfg!(feature = "full") {
        return adaptive(points, &cloud, options, laps);
    }
    // Those that signs need are borrowed, others given away.
    let kept;
    let (points, needed) = if options.orient.needs_positions() {
        kept = points;
        (kept.borrowed(), Some(&kept))
    } else {
        (points, None)
    };
    let mut estimate = match (options.method, options.cell) {
        (Method::Bilinear, Cell::Auto) => adaptive(points.owned()?, &cloud, options, laps),
        (Method::Bilinear, Cell::Scale(scale)) => bilinear(points, &cloud, options, scale * cloud.paper_edge(), laps),
        (Method::Bilinear, Cell::Size(size)) => {
            bilinear(points, &cloud, options, cell::edge_of_size(size, cloud.unit, cloud.paper_edge())?, laps)
        }
        (Method::Knn, _) => {
            baseline(points, &cloud, options, Baseline::Knn { k: options.k.unwrap_or(16) as usize }, laps)
        }
        (Method::Egg, _) => {
            baseline(points, &cloud, options, Baseline::Egg { k: options.k.unwrap_or(8) as usize }, laps)
        }
    }?;
    if !matches!(options.orient, Orient::None) {
        let mut laps = Laps::start(progress);
        let normals = bytemuck::cast_slice_mut(&mut estimate.normals);
        let stage = progress.stage("orientation", share..1.0);
        let surfaces = orient(needed, normals, &cloud.bounds, options, &stage)?;
        if let Some(surfaces) = surfaces {
            estimate.components = surfaces.of_point;
            estimate.report.components = Some(surfaces.components);
        }
        laps.end("orientation");
        estimate.report.milliseconds.append(&mut laps.ended);
    }
    Ok(estimate)
}

/// What is known of a cloud without its positions.
struct Cloud {
    count: usize,
    /// A unit of the positions, in units of the input.
    unit: f64,
    bounds: Bounds,
}

impl Cloud {
    /// The paper's L.
    fn paper_edge(&self) -> f64 {
        cell::paper_edge(self.bounds.extent(), self.bounds.finite)
    }
}

/// What both kinds of cells have to tell; the rest is left at its default.
fn describe(cloud: &Cloud, lattice: &Lattice, found: &Found, laps: Laps) -> Report {
    let edge = lattice.edge();
    Report {
        points: cloud.count as u64,
        unresolved: cloud.count as u64 - found.resolved,
        grid: lattice.size().as_u64vec3().to_array(),
        cell_size: edge * cloud.unit,
        scale: edge / cloud.paper_edge(),
        milliseconds: laps.ended,
        ..Report::default()
    }
}

/// Cubes of the sizes that the cloud asks for, along axes of its own.
fn adaptive(mut points: Points, cloud: &Cloud, options: &Options, mut laps: Laps) -> Result<Estimate, Error> {
    let progress = laps.progress;
    progress.update("cellSize", 0.03)?;
    let frame = Frame::of(&points);
    let bounds = frame.turn(points.positions_mut());
    let density = Density::of(&points, &bounds)?;
    let lattice = Lattice::new(&bounds, &|| density.middle, density.edge(cell::POINTS_PER_CELL), adaptive::CUBES);
    let rounding = Rounding::of(frame.step, lattice.edge());
    laps.end("cellSize");
    let lap = &mut |phase| laps.end(phase);
    let answer = adaptive::normals(points, &lattice, &frame, options, rounding, progress, lap)?;
    let mut report = describe(cloud, &lattice, &answer.found, laps);
    report.cells = answer.cubes;
    report.nodes = answer.surfaces;
    report.noise = Some(answer.noise * report.cell_size);
    let scale = |&(edges, points): &(f64, u64)| Scale { cell_size: edges * report.cell_size, points };
    report.scales = answer.scales.iter().map(scale).collect();
    report.nodes_used[0] = report.points;
    let Found { normals, curvature, .. } = answer.found;
    Ok(Estimate { normals, curvature, components: None, report })
}

/// Cubes of one size: the paper's method.
fn bilinear(points: Points, cloud: &Cloud, options: &Options, edge: f64, mut laps: Laps) -> Result<Estimate, Error> {
    let progress = laps.progress;
    progress.update("cellSize", 0.03)?;
    // Larger cubes hold the same, all in the first one, and single precision has less of the places there.
    let longest = cloud.bounds.extent().max_element();
    let edge = if longest > 0.0 { edge.min(2.0 * longest) } else { edge };
    let lattice = Lattice::new(&cloud.bounds, &|| Bulk::of_points(&points).median, edge, CUBES);
    laps.end("cellSize");
    let source = Source::new(&points, lattice);
    let (grid, moments) = Grid::sort(&source, &progress.stage("sort", 0.06..0.55), nodes::moments)?;
    drop(points);
    laps.end("sort");
    let stage = progress.stage("nodes", 0.55..0.65);
    let (nodes, variations) = nodes::nodes(&grid, &moments, options.curvature, &stage)?;
    drop(moments);
    laps.end("nodes");
    let stage = progress.stage("interpolation", 0.65..1.0);
    let (found, nodes_used) = bilinear::interpolate(&grid, &nodes, variations.as_deref(), cloud.count, &stage)?;
    laps.end("interpolation");

    let mut report = describe(cloud, &lattice, &found, laps);
    report.cells = grid.cubes() as u64;
    report.nodes = nodes.iter().filter(|node| Node::is_good(node)).count() as u64;
    report.nodes_used = nodes_used;
    Ok(Estimate { normals: found.normals, curvature: found.curvature, components: None, report })
}

/// The methods it is compared with.
fn baseline(
    points: Points,
    cloud: &Cloud,
    options: &Options,
    baseline: Baseline,
    mut laps: Laps,
) -> Result<Estimate, Error> {
    let progress = laps.progress;
    let tree = Tree::build(&points, &cloud.bounds, &progress.stage("tree", 0.03..0.2))?;
    drop(points);
    laps.end("tree");
    let stage = progress.stage("normals", 0.2..1.0);
    let found = baseline::normals(&tree, baseline, options.curvature, cloud.count, &stage)?;
    laps.end("normals");
    let count = cloud.count as u64;
    let report = Report {
        points: count,
        unresolved: count - found.resolved,
        nodes_used: [count, 0, 0, 0, 0],
        milliseconds: laps.ended,
        ..Report::default()
    };
    Ok(Estimate { normals: found.normals, curvature: found.curvature, components: None, report })
}

/// A stop-watch that notes a time for each phase.
struct Laps<'a> {
    progress: &'a Progress<'a>,
    since: f64,
    ended: Vec<(&'static str, f64)>,
}

impl<'a> Laps<'a> {
    fn start(progress: &'a Progress<'a>) -> Self {
        Self { progress, since: progress.milliseconds(), ended: Vec::new() }
    }

    fn end(&mut self, phase: &'static str) {
        let now = self.progress.milliseconds();
        self.ended.push((phase, now - self.since));
        self.since = now;
    }
}
