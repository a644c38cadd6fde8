//! A grid of cubes, and the surface of every cube.

use super::around::Around;
use super::samples::{Sample, Samples, Window, Writing};
use super::surface::Surface;
use crate::error::Error;
use crate::grid::{Grid, Placed};
use crate::lattice::{BRICK, Lattice, cube_centre, octant_in_brick};
use crate::parallel::Filling;
use crate::points::{Points, reserve};
use crate::progress::Stage;
use glam::{DVec3, IVec3, Vec3};
use std::borrow::Cow;
use std::ops::Range;

/// One grid.
pub(super) struct Level {
    /// For positions in edges of the base, from the middle of the cloud: single precision is enough for these, and they
    /// do not depend on where the cloud lies.
    pub lattice: Lattice,
    /// The same cubes, for the points' own coordinates.
    sorting: Lattice,
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
    pub fn new(
        points: &Points,
        sorting: &Lattice,
        lattice: Lattice,
        wholes: Option<&[Sample]>,
        stage: &Stage,
    ) -> Result<Self, Error> {
        let count = |placed: &[Placed], centre: Vec3| octants(placed, centre).count() as u32;
        let (grid, mut sample_end) = Grid::sort(points, sorting, &stage.part(0.0..0.9), count)?;
        let mut total = 0;
        for end in &mut sample_end {
            total += *end;
            *end = total;
        }
        let samples = Writing::new(total as usize)?;
        grid.each_cube(&stage.part(0.9..1.0), &|_, cube, bit| {
            let start = range(&sample_end, cube).start;
            let centre = cube_centre(bit);
            for (i, octant) in octants(&grid.placed[range(&grid.cube_end, cube)], centre).enumerate() {
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
        Ok(Self { lattice, sorting: *sorting, grid, samples, sample_end, surfaces, names, wanted })
    }

    /// Cubes of twice the edge, in which each cube of this level is a sample.
    #[optimize(size)]
    #[inline(never)]
    pub fn coarser(&self, stage: &Stage) -> Result<Self, Error> {
        let lattice = self.lattice.coarser();
        let what = "the samples";
        let (positions, wholes) = (Filling::new(self.cubes(), what)?, Filling::new(self.cubes(), what)?);
        self.grid.each_cube(&stage.part(0.0..0.3), &|brick, cube, bit| {
            let whole = self.whole(cube);
            // SAFETY: once for each cube.
            unsafe {
                positions.write(cube, self.position(brick, cube_centre(bit) + whole.place));
                wholes.write(cube, whole);
            }
        })?;
        // SAFETY: these were all cubes.
        let (positions, wholes) = unsafe { (positions.complete(), wholes.complete()) };
        let points = Points { positions: Cow::Owned(positions), origin: DVec3::ZERO, unit: 1.0 };
        Self::new(&points, &lattice, lattice, Some(&wholes), &stage.part(0.3..1.0))
    }

    /// Cubes of half the edge, with their surfaces, for the points in and round those that are `rough`.
    #[optimize(size)]
    #[inline(never)]
    pub fn divided(&self, rough: &[bool], points: &Points, stage: &Stage) -> Result<Self, Error> {
        let grid = &self.grid;
        let is_near = Filling::new(self.cubes(), "the cubes")?;
        stage.part(0.0..0.1).run(grid.blocks.len(), &|block| {
            let (mut around, mut near) = (Around::new(), Vec::new());
            for (brick, cube, bit) in grid.cubes_in(block) {
                around.near(grid, brick, bit, 1, &mut near);
                // SAFETY: once for each cube.
                unsafe { is_near.write(cube, near.iter().any(|&(_, cube)| rough[cube])) };
            }
        })?;
        // SAFETY: these were all cubes.
        let is_near = unsafe { is_near.complete() };
        let near = || (0..self.cubes()).filter(|&cube| is_near[cube]).map(|cube| range(&grid.cube_end, cube));
        let count = near().map(|range| range.len()).sum();
        let (mut names, mut positions) = (Vec::new(), Vec::new());
        reserve(&mut names, count, "the detail")?;
        reserve(&mut positions, count, "the detail")?;
        for placed in near().flat_map(|range| &grid.placed[range]) {
            let name = self.name(placed);
            names.push(name);
            positions.push(points.positions[name as usize]);
        }

        let points = Points { positions: Cow::Owned(positions), origin: DVec3::ZERO, unit: 1.0 };
        let (sorting, lattice) = (self.sorting.finer(), self.lattice.finer());
        let mut level = Self::new(&points, &sorting, lattice, None, &stage.part(0.1..0.5))?;
        level.fit(&stage.part(0.5..0.9))?;
        let wanted = Filling::new(level.cubes(), "the cubes")?;
        level.grid.each_cube(&stage.part(0.9..1.0), &|brick, cube, bit| {
            let holder = self.holder(level.grid.bricks.places[brick], bit);
            // SAFETY: once for each cube.
            unsafe { wanted.write(cube, holder.is_some_and(|cube| rough[cube])) };
        })?;
        // SAFETY: these were all cubes.
        level.wanted = unsafe { wanted.complete() };
        level.names = Some(names);
        Ok(level)
    }

    /// Gives up what only the smallest cubes need.
    pub fn release(&mut self) {
        (self.grid.placed, self.samples, self.names) = (Vec::new(), Samples::default(), None);
    }

    /// How many cubes there are.
    pub fn cubes(&self) -> usize {
        self.sample_end.len()
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
    fn whole(&self, cube: usize) -> Sample {
        Sample::of(range(&self.sample_end, cube).map(|sample| self.samples.get(sample)))
    }

    /// The centroid of a cube's points, against its centre.
    pub fn centroid(&self, cube: usize) -> Vec3 {
        self.whole(cube).place
    }

    /// A place in a brick, in edges of the base.
    pub fn position(&self, brick: usize, local: Vec3) -> Vec3 {
        self.lattice.position(self.grid.bricks.places[brick], local)
    }

    /// The cube of a position, and what lies between its centre and the position.
    pub fn find(&self, position: Vec3) -> Option<(usize, Vec3)> {
        let (brick, local) = self.lattice.locate(position)?;
        let bit = octant_in_brick(local.extend(0.0)) / 8;
        Some((self.cube_at(brick, bit)?, local - cube_centre(bit)))
    }

    /// The cube in which one of half the edge lies. In whole numbers: a point must get its normal once.
    fn holder(&self, brick: IVec3, bit: u32) -> Option<usize> {
        let place: IVec3 = (BRICK * brick + cube_centre(bit).as_ivec3()) >> 1;
        let (brick, inside): (IVec3, IVec3) = (place >> 2, place & 3);
        self.cube_at(brick, (inside.x + 4 * inside.y + 16 * inside.z) as u32)
    }

    /// The cube at a place, if it is occupied.
    fn cube_at(&self, brick: IVec3, bit: u32) -> Option<usize> {
        let brick = self.grid.bricks.number(brick)? as usize;
        let mask = self.grid.masks[brick];
        let before = (mask & ((1 << bit) - 1)).count_ones();
        (mask >> bit & 1 == 1).then(|| (self.grid.first_cube[brick] + before) as usize)
    }

    /// Finds the surface of every cube, through the samples in it and the 26 round it.
    #[inline(never)]
    pub fn fit(&mut self, stage: &Stage) -> Result<(), Error> {
        let grid = &self.grid;
        let surfaces = Filling::new(self.cubes(), "the surfaces")?;
        stage.run(grid.blocks.len(), &|block| {
            let (mut around, mut near, mut window) = (Around::new(), Vec::new(), Window::new());
            for (brick, cube, bit) in grid.cubes_in(block) {
                around.near(grid, brick, bit, 1, &mut near);
                window.clear();
                for &(step, near) in &near {
                    const SHARES: [f32; 4] = [1.0, NEXT, NEXT * NEXT, NEXT * NEXT * NEXT];
                    let share = SHARES[step.abs().element_sum() as usize];
                    window.add(&self.samples, range(&self.sample_end, near), step, share);
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

/// The points of a cube, octant by octant.
fn octants(placed: &[Placed], centre: Vec3) -> impl Iterator<Item = &[Placed]> {
    let centre = centre.extend(0.0);
    let octant = move |p: &Placed| p.lanes().cmpge(centre).bitmask() & 7;
    placed.chunk_by(move |a, b| octant(a) == octant(b))
}
