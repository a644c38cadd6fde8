//! A grid of cubes, and the surface of every cube.

use super::around::Around;
use super::samples::{Sample, Samples, Window, Writing};
use super::surface::Surface;
use crate::error::Error;
use crate::grid::{Grid, Placed, octants};
use crate::lattice::{BRICK, Lattice, cube_centre};
use crate::parallel::Filling;
use crate::points::{Points, reserve};
use crate::progress::Stage;
use glam::{DVec3, IVec3, Vec3};
use std::borrow::Cow;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// One grid.
pub(super) struct Level {
    pub lattice: Lattice,
    pub grid: Grid,
    /// Cube by cube.
    samples: Samples,
    /// For each cube its last sample, plus one.
    sample_end: Vec<u32>,
    pub surfaces: Vec<Surface>,
    /// The points' numbers in the input, if they are not the same.
    names: Option<Vec<u32>>,
    /// The cubes whose points are to get their normals here; if empty, all.
    wanted: Vec<bool>,
}

/// The sums of a cube's own samples count whole in its surface, those of a cube beyond its side this much, beyond an edge
/// the square of it, beyond a corner the cube.
const NEXT: f32 = 0.7;

impl Level {
    /// Sorts the points; those of each octant of a cube are a sample. `wholes` says what each point stands for, if not
    /// for itself: in edges half as long.
    #[optimize(size)]
    #[inline(never)]
    pub fn new(points: &Points, lattice: Lattice, wholes: Option<&[Sample]>, stage: &Stage) -> Result<Self, Error> {
        let count = |placed: &[Placed], centre: Vec3| octants(placed, centre).count() as u32;
        let (grid, mut sample_end) = Grid::sort(points, &lattice, &stage.part(0.0..0.9), count)?;
        let mut total = 0;
        for end in &mut sample_end {
            total += *end;
            *end = total;
        }
        let samples = Writing::new(total as usize)?;
        grid.each_cube(&stage.part(0.9..1.0), &|_, cube, bit| {
            let start = range(&sample_end, cube).start;
            let centre = cube_centre(bit);
            for (i, (_, octant)) in octants(&grid.placed[range(&grid.cube_end, cube)], centre).enumerate() {
                let sample = |p: &Placed| match wholes {
                    None => Sample::point(p.local - centre),
                    Some(wholes) => wholes[p.point as usize].halved(p.local - centre),
                };
                // SAFETY: a sample belongs to one cube.
                unsafe { samples.write(start + i, Sample::of(octant.iter().map(sample))) };
            }
        })?;
        // SAFETY: as many as were counted.
        let samples = unsafe { samples.complete() };
        let (surfaces, names, wanted) = (Vec::new(), None, Vec::new());
        Ok(Self { lattice, grid, samples, sample_end, surfaces, names, wanted })
    }

    /// Cubes of twice the edge, in which each cube of this level is a sample. Their positions are counted from brick
    /// `origin`: where single precision is enough, and wherever the cloud lies the same.
    #[optimize(size)]
    #[inline(never)]
    pub fn coarser(&self, origin: IVec3, stage: &Stage) -> Result<Self, Error> {
        let lattice = self.lattice.in_edges(origin);
        let what = "the samples";
        let (positions, wholes) = (Filling::new(self.grid.cubes(), what)?, Filling::new(self.grid.cubes(), what)?);
        self.grid.each_cube(&stage.part(0.0..0.3), &|brick, cube, bit| {
            let whole = self.whole(cube);
            let position = lattice.position(self.grid.bricks.places[brick], cube_centre(bit) + whole.place);
            // SAFETY: once for each cube.
            unsafe {
                positions.write(cube, position);
                wholes.write(cube, whole);
            }
        })?;
        // SAFETY: these were all cubes.
        let (positions, wholes) = unsafe { (positions.complete(), wholes.complete()) };
        let points = Points { positions: Cow::Owned(positions), origin: DVec3::ZERO, unit: 1.0 };
        Self::new(&points, lattice.coarser(), Some(&wholes), &stage.part(0.3..1.0))
    }

    /// Cubes of half the edge, with their surfaces, for the points in and round those of a batch that are rough.
    #[optimize(size)]
    #[inline(never)]
    pub fn divided(&self, rough: &[bool], batch: Range<usize>, points: &Points, stage: &Stage) -> Result<Self, Error> {
        let grid = &self.grid;
        let is_divided = |cube: usize| rough[cube] && batch.contains(&cube);
        let mut is_near: Vec<AtomicBool> = Vec::new();
        reserve(&mut is_near, self.grid.cubes(), "the cubes")?;
        is_near.resize_with(self.grid.cubes(), AtomicBool::default);
        stage.part(0.0..0.1).run(grid.blocks.len(), &|block| {
            let (mut around, mut near) = (Around::new(), Vec::new());
            for (brick, _, bit) in grid.cubes_in(block).filter(|&(_, cube, _)| is_divided(cube)) {
                around.near(grid, brick, bit, 1, &mut near);
                near.iter().for_each(|&(_, cube)| is_near[cube].store(true, Relaxed));
            }
        })?;
        let is_near: Vec<bool> = is_near.into_iter().map(AtomicBool::into_inner).collect();
        let (mut first, mut last, mut count) = (IVec3::MAX, IVec3::MIN, 0);
        for (place, cubes) in grid.bricks.places.iter().zip(grid.first_cube.windows(2)) {
            for cube in (cubes[0] as usize..cubes[1] as usize).filter(|&cube| is_near[cube]) {
                (first, last) = (first.min(*place), last.max(*place));
                count += self.points(cube).len();
            }
        }
        let (mut names, mut positions) = (Vec::new(), Vec::new());
        reserve(&mut names, count, "the detail")?;
        reserve(&mut positions, count, "the detail")?;
        for placed in (0..self.grid.cubes()).filter(|&cube| is_near[cube]).flat_map(|cube| self.points(cube)) {
            let name = self.name(placed);
            names.push(name);
            positions.push(points.positions[name as usize]);
        }
        drop(is_near);

        let points = Points { positions: Cow::Owned(positions), origin: DVec3::ZERO, unit: 1.0 };
        let lattice = self.lattice.finer().part(2 * first, 2 * last + 1);
        let mut level = Self::new(&points, lattice, None, &stage.part(0.1..0.5))?;
        level.fit(&stage.part(0.5..0.9))?;
        let wanted = Filling::new(level.grid.cubes(), "the cubes")?;
        level.grid.each_cube(&stage.part(0.9..1.0), &|brick, cube, bit| {
            // In whole numbers: a point must get its normal once.
            let whole = self.number(level.place(brick, bit) >> 1);
            // SAFETY: once for each cube.
            unsafe { wanted.write(cube, whole.is_some_and(is_divided)) };
        })?;
        // SAFETY: these were all cubes.
        level.wanted = unsafe { wanted.complete() };
        level.names = Some(names);
        Ok(level)
    }

    /// Gives up what only the smallest cubes need.
    pub fn release_points(&mut self) {
        self.grid.placed = Vec::new();
        self.release_samples();
    }

    /// Gives up what surfaces were fitted to.
    pub fn release_samples(&mut self) {
        (self.samples, self.sample_end) = (Samples::default(), Vec::new());
    }

    /// Whether the points of a cube are to get their normals here.
    pub fn is_wanted(&self, cube: usize) -> bool {
        self.wanted.get(cube).is_none_or(|&is_wanted| is_wanted)
    }

    /// The points of a cube.
    pub fn points(&self, cube: usize) -> &[Placed] {
        &self.grid.placed[range(&self.grid.cube_end, cube)]
    }

    /// A point's number in the input.
    pub fn name(&self, placed: &Placed) -> u32 {
        self.names.as_ref().map_or(placed.point, |names| names[placed.point as usize])
    }

    /// The sample that stands for a cube.
    #[inline(always)]
    fn whole(&self, cube: usize) -> Sample {
        Sample::of(range(&self.sample_end, cube).map(|sample| self.samples.get(sample)))
    }

    /// The centroid of a cube's points, against its centre.
    pub fn centroid(&self, cube: usize) -> Vec3 {
        self.whole(cube).place
    }

    /// Where a cube lies, in cubes from the first there can be.
    pub fn place(&self, brick: usize, bit: u32) -> IVec3 {
        BRICK * self.grid.bricks.places[brick] + cube_centre(bit).as_ivec3()
    }

    /// The cube at a place, if it is occupied.
    pub fn number(&self, place: IVec3) -> Option<usize> {
        let (brick, inside): (IVec3, IVec3) = (place >> 2, place & 3);
        let brick = self.grid.bricks.number(brick)? as usize;
        let bit = (inside.x + 4 * inside.y + 16 * inside.z) as u32;
        (self.grid.masks[brick] >> bit & 1 == 1).then(|| self.grid.cube(brick, bit) as usize)
    }

    /// Finds the surface of every cube, through the samples in it and the 26 round it.
    #[inline(never)]
    pub fn fit(&mut self, stage: &Stage) -> Result<(), Error> {
        let grid = &self.grid;
        let surfaces = Filling::new(self.grid.cubes(), "the surfaces")?;
        stage.run(grid.blocks.len(), &|block| {
            let (mut around, mut near, mut window) = (Around::new(), Vec::new(), Window::new());
            for (brick, cube, bit) in grid.cubes_in(block) {
                around.near(grid, brick, bit, 1, &mut near);
                window.clear();
                for &(step, near) in &near {
                    let shares = 1.0 - (1.0 - NEXT) * step.abs();
                    window.add(&self.samples, range(&self.sample_end, near), step, shares.element_product());
                }
                // SAFETY: once for each cube.
                unsafe { surfaces.write(cube, window.fit().unwrap_or(Surface::NONE)) };
            }
        })?;
        // SAFETY: these were all cubes.
        self.surfaces = unsafe { surfaces.complete() };
        Ok(())
    }
}

/// What belongs to a cube, where `ends` tells for each cube where that ends.
fn range(ends: &[u32], cube: usize) -> Range<usize> {
    let start = if cube == 0 { 0 } else { ends[cube - 1] };
    start as usize..ends[cube] as usize
}
