//! A grid of cubes, and the surface of every cube.

use super::WHAT;
use super::around::{Around, Near};
use super::samples::{Sample, Window};
use super::surface::Surface;
use crate::error::Error;
use crate::grid::{Grid, Placed, octants};
use crate::lattice::{BRICK, Lattice, cube_centre};
use crate::lists::reserve;
use crate::parallel::Filling;
use crate::progress::Stage;
use crate::source::{OtherGrid, Source};
use glam::{DVec3, IVec3, Vec3};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// One grid.
pub(super) struct Level {
    pub lattice: Lattice,
    pub grid: Grid,
    /// Cube by cube.
    samples: Vec<Sample>,
    /// For each cube its last sample, plus one.
    sample_end: Vec<u32>,
    pub surfaces: Vec<Surface>,
    /// The variance of coordinates that were rounded, in edges and squared.
    rounding: f32,
    /// What each cube is here for; if empty, all are wanted.
    roles: Vec<Role>,
}

/// What a cube is here for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    /// Its points are to get their normals here.
    Wanted,
    /// Cubes near it ask for its surface.
    Near,
    /// The same, but it is part of a cube that got its normals from more than its smallest neighbourhood, because all round it
    /// agree: so this one may only choose among larger ones too.
    Settled,
}

/// The weight of a neighbouring cube's samples in a surface: this across a face, its square across an edge, its cube across
/// a corner; own samples weigh 1.
const NEXT: f32 = 0.6;

impl Level {
    /// Sorts the points, and counts the samples of each cube: the points of an octant are one.
    #[optimize(size)]
    #[inline(never)]
    pub fn new(source: &Source, rounding: f32, stage: &Stage) -> Result<Self, Error> {
        let count = |placed: &[Placed], centre: Vec3| octants(placed, centre).count() as u32;
        let (grid, mut sample_end) = Grid::sort(source, stage, count)?;
        let mut total = 0;
        for end in &mut sample_end {
            total += *end;
            *end = total;
        }
        let (samples, surfaces, roles) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { lattice: source.lattice, grid, samples, sample_end, surfaces, rounding, roles })
    }

    /// Makes the samples. `wholes` says what each point stands for, if not for itself: in edges half as long.
    #[optimize(size)]
    #[inline(never)]
    pub fn sample(&mut self, wholes: Option<&[Sample]>, stage: &Stage) -> Result<(), Error> {
        let (grid, sample_end) = (&self.grid, &self.sample_end);
        let samples = Filling::new(sample_end.last().map_or(0, |&end| end as usize), WHAT)?;
        grid.each_cube(stage, &|_, cube, bit| {
            let start = range(sample_end, cube).start;
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
        self.samples = unsafe { samples.complete() };
        Ok(())
    }

    /// Cubes of twice the edge, in which each cube of this level is a sample. Gives up the samples of this level.
    #[optimize(size)]
    #[inline(never)]
    pub fn coarser(&mut self, stage: &Stage) -> Result<Self, Error> {
        let cubes = self.grid.cubes();
        let (positions, wholes) = (Filling::new(cubes, WHAT)?, Filling::new(cubes, WHAT)?);
        self.grid.each_cube(&stage.part(0.0..0.3), &|_, cube, bit| {
            let whole = Sample::of(self.samples[range(&self.sample_end, cube)].iter().copied());
            // SAFETY: once for each cube.
            unsafe {
                positions.write(cube, cube_centre(bit) + whole.place);
                wholes.write(cube, whole);
            }
        })?;
        self.release_samples();
        // SAFETY: these were all cubes.
        let (positions, wholes) = unsafe { (positions.complete(), wholes.complete()) };
        let other = OtherGrid { bricks: &self.grid.bricks.places, ends: &self.grid.first_cube[1..], edge: 0.5 };
        let lattice = self.lattice.coarser();
        let source = Source { lattice, positions: &positions, numbers: None, other: Some(other) };
        let mut level = Self::new(&source, 0.25 * self.rounding, &stage.part(0.3..0.9))?;
        drop(positions);
        level.sample(Some(&wholes), &stage.part(0.9..1.0))?;
        Ok(level)
    }

    /// Cubes of half the edge, with their surfaces, for the points in and round those of a batch whose parts are wanted.
    /// `parts` has the role of the parts of each cube.
    #[optimize(size)]
    #[inline(never)]
    pub fn divided(&self, parts: &[Role], batch: Range<usize>, stage: &Stage) -> Result<Self, Error> {
        let grid = &self.grid;
        let is_divided = |cube: usize| parts[cube] == Role::Wanted && batch.contains(&cube);
        let mut is_near: Vec<AtomicBool> = Vec::new();
        reserve(&mut is_near, grid.cubes(), WHAT)?;
        is_near.resize_with(grid.cubes(), AtomicBool::default);
        stage.part(0.0..0.1).run(grid.blocks.len(), &|block| {
            let mut around = Around::new();
            for (brick, _, bit) in grid.cubes_in(block).filter(|&(_, cube, _)| is_divided(cube)) {
                let near = around.near(grid, brick, bit, 1);
                near.iter().for_each(|near| is_near[near.cube as usize].store(true, Relaxed));
            }
        })?;
        let near_of = |brick: usize| {
            let cubes = grid.first_cube[brick] as usize..grid.first_cube[brick + 1] as usize;
            cubes.filter(|&cube| is_near[cube].load(Relaxed)).map(|cube| self.points(cube))
        };
        let (mut first, mut last) = (IVec3::MAX, IVec3::MIN);
        let mut ends = Vec::new();
        reserve(&mut ends, grid.bricks.len() + 1, WHAT)?;
        let mut end = 0;
        ends.push(end);
        for (brick, &place) in grid.bricks.places.iter().enumerate() {
            let start = end;
            near_of(brick).for_each(|points| end += points.len() as u32);
            if end > start {
                (first, last) = (first.min(place), last.max(place));
            }
            ends.push(end);
        }
        let (positions, numbers) = (Filling::new(end as usize, WHAT)?, Filling::new(end as usize, WHAT)?);
        stage.part(0.1..0.2).run(grid.blocks.len(), &|block| {
            for brick in grid.blocks[block].clone() {
                let mut i = ends[brick] as usize;
                near_of(brick).for_each(|points| {
                    for point in points {
                        // SAFETY: a brick belongs to one block, and these points to one brick.
                        unsafe {
                            positions.write(i, point.local);
                            numbers.write(i, point.point);
                        }
                        i += 1;
                    }
                });
            }
        })?;
        drop(is_near);

        // SAFETY: the blocks hold all bricks, and these all points that were counted.
        let (positions, numbers) = unsafe { (positions.complete(), numbers.complete()) };
        let other = OtherGrid { bricks: &grid.bricks.places, ends: &ends[1..], edge: 2.0 };
        let lattice = self.lattice.finer().part(2 * first, 2 * last + 1);
        let source = Source { lattice, positions: &positions, numbers: Some(&numbers), other: Some(other) };
        let mut level = Self::new(&source, 4.0 * self.rounding, &stage.part(0.2..0.45))?;
        drop((positions, numbers, ends));
        level.sample(None, &stage.part(0.45..0.5))?;
        let roles = Filling::new(level.grid.cubes(), WHAT)?;
        level.grid.each_cube(&stage.part(0.5..0.55), &|brick, cube, bit| {
            // In whole numbers: a point must get its normal once.
            let whole = self.number(level.place(brick, bit) >> 1);
            let role = whole.map_or(Role::Near, |whole| match parts[whole] {
                Role::Wanted if !is_divided(whole) => Role::Near,
                role => role,
            });
            // SAFETY: once for each cube.
            unsafe { roles.write(cube, role) };
        })?;
        // SAFETY: these were all cubes.
        level.roles = unsafe { roles.complete() };
        level.fit(&stage.part(0.55..1.0))?;
        level.release_samples();
        Ok(level)
    }

    /// Gives up what only the smallest cubes need.
    pub fn release_points(&mut self) {
        self.grid.placed = Vec::new();
    }

    /// Gives up what surfaces were fitted to.
    fn release_samples(&mut self) {
        (self.samples, self.sample_end) = (Vec::new(), Vec::new());
    }

    /// What a cube is here for.
    pub fn role(&self, cube: usize) -> Role {
        self.roles.get(cube).copied().unwrap_or(Role::Wanted)
    }

    /// The points of a cube.
    pub fn points(&self, cube: usize) -> &[Placed] {
        &self.grid.placed[range(&self.grid.cube_end, cube)]
    }

    /// The points of some cubes near the one with bit `bit` of a brick, cube by cube, each with what makes their places those
    /// against its centre.
    pub fn points_near<'a>(&'a self, bit: u32, near: &'a [Near]) -> impl Iterator<Item = (Vec3, &'a [Placed])> {
        let (centre, side) = (cube_centre(bit), BRICK as f32);
        near.iter().map(move |near| {
            // From the corner of that cube's brick to the centre of the own cube.
            let shift = ((centre + near.step) / side).floor() * side - centre;
            (shift, self.points(near.cube as usize))
        })
    }

    /// The centroid of the points of a cube, against its centre.
    #[optimize(size)]
    pub fn centroid(&self, cube: usize, bit: u32) -> Vec3 {
        let (centre, points) = (cube_centre(bit), self.points(cube));
        let sum: DVec3 = points.iter().map(|p| (p.local - centre).as_dvec3()).sum();
        (sum / points.len() as f64).as_vec3()
    }

    /// Where a cube lies, in cubes from the first there can be.
    pub fn place(&self, brick: usize, bit: u32) -> IVec3 {
        BRICK * self.grid.bricks.places[brick] + cube_centre(bit).as_ivec3()
    }

    /// The cube at a place, if it is occupied.
    pub fn number(&self, place: IVec3) -> Option<usize> {
        self.find(place).map(|(brick, bit)| self.grid.cube(brick, bit) as usize)
    }

    /// The brick, and the bit in that, of the cube at a place, if it is occupied.
    pub fn find(&self, place: IVec3) -> Option<(usize, u32)> {
        let (brick, inside): (IVec3, IVec3) = (place >> 2, place & 3);
        let brick = self.grid.bricks.number(brick)? as usize;
        let bit = (inside.x + 4 * inside.y + 16 * inside.z) as u32;
        (self.grid.masks[brick] >> bit & 1 == 1).then_some((brick, bit))
    }

    /// Finds the surface of every cube, through the samples in it and the 26 round it; settled ones get none.
    #[inline(never)]
    pub fn fit(&mut self, stage: &Stage) -> Result<(), Error> {
        let grid = &self.grid;
        let surfaces = Filling::new(self.grid.cubes(), WHAT)?;
        stage.run(grid.blocks.len(), &|block| {
            let (mut around, mut window) = (Around::new(), Window::new());
            let samples = |cube: usize| &self.samples[range(&self.sample_end, cube)];
            for (brick, cube, bit) in grid.cubes_in(block) {
                window.clear();
                if self.role(cube) != Role::Settled {
                    for &Near { step, cube } in around.near(grid, brick, bit, 1) {
                        let shares = 1.0 - (1.0 - NEXT) * step.abs();
                        window.add(samples(cube as usize), step, shares.element_product());
                    }
                }
                let mut surface = window.fit().rounded(self.rounding);
                if surface.may_hide_parts() {
                    // Whichever sample: the cubes beside have theirs.
                    surface.is_folded = window.stand_across(&surface, samples(cube)[0].place);
                }
                // SAFETY: once for each cube.
                unsafe { surfaces.write(cube, surface) };
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
