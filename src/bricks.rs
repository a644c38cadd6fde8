//! Which blocks of 4x4x4 cubes ("bricks") hold points, in memory that grows with the points and not with the box.

use crate::error::Error;
use crate::lattice::{Lattice, mixed};
use crate::lists::reserve;
use crate::order::sort_unique;
use crate::parallel::{self, Filling, Gathering};
use crate::points::CHUNK;
use crate::progress::Stage;
use crate::source::Source;
use glam::{DVec3, IVec3};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The occupied bricks, numbered from 0; those in a box in layers across its longest axis: so what is near in space is near
/// in memory, and bricks in a row are a slice of the cloud with little surface.
pub(crate) struct Bricks {
    /// The place of each brick.
    pub places: Vec<IVec3>,
    index: Index,
}

/// From a place to the number of its brick.
enum Index {
    /// One bit for each brick of the box, and the number of bricks before each word of 64: 1.5 bits a brick.
    Box { layout: Layout, bits: Vec<u64>, before: Vec<u32> },
    /// For boxes that are nearly empty: an open-addressed table, its length a power of two.
    Table { slots: Vec<u32> },
}

const FREE: u32 = u32::MAX;

/// The order of the bricks of a box.
#[derive(Clone, Copy)]
struct Layout {
    first: IVec3,
    /// Bricks along each axis.
    size: IVec3,
    /// What lies between two bricks next to each other along each axis.
    strides: IVec3,
}

impl Layout {
    fn of(lattice: &Lattice) -> Self {
        let (first, size) = lattice.bricks();
        let IVec3 { x, y, z } = size;
        // Wraps in a box that is too large for any slot to be asked for.
        let strides = match size.max_element() {
            longest if longest == z => IVec3::new(1, x, x.wrapping_mul(y)),
            longest if longest == y => IVec3::new(z, z.wrapping_mul(x), 1),
            _ => IVec3::new(y.wrapping_mul(z), 1, y),
        };
        Self { first, size, strides }
    }

    fn volume(&self) -> f64 {
        self.size.as_dvec3().element_product()
    }

    /// Whether a brick is in the box.
    #[inline(always)]
    fn holds(&self, brick: IVec3) -> bool {
        let place = (brick - self.first).as_uvec3();
        // Below the first are large numbers.
        place.cmplt(self.size.as_uvec3()).all()
    }

    /// The paper's key (Eq. 4), of a brick instead of a cube.
    #[inline(always)]
    fn slot(&self, brick: IVec3) -> usize {
        (brick - self.first).dot(self.strides) as usize
    }

    /// The same for bricks in whole doubles, which takes less time. The box must have at most 2^32 slots.
    fn slots(&self) -> impl Fn(DVec3) -> u32 + Sync + use<> {
        /// With this they stand in the last bits: WebAssembly's own conversion looks at what else a number might be.
        const BIT: f64 = (1u64 << 52) as f64;
        let (first, strides) = (self.first.as_dvec3(), self.strides.as_dvec3());
        move |brick| ((brick - first).dot(strides) + BIT).to_bits() as u32
    }

    fn brick(&self, slot: usize) -> IVec3 {
        self.first + IVec3::splat(slot as i32) / self.strides % self.size
    }
}

/// The key of a point that lies in no brick.
pub(crate) const OUTSIDE: u32 = u32::MAX;

impl Bricks {
    /// Finds the bricks of all points, and for each point the key of its brick, [`OUTSIDE`] if it has none. One pass,
    /// parallel, two where the box is nearly empty.
    pub fn find(source: &Source, stage: &Stage) -> Result<(Self, Vec<u32>), Error> {
        let layout = Layout::of(&source.lattice);
        // At most 3 bytes a point. A surface with a few points in a cube needs a tenth of that.
        let limit = (16.0 * source.len() as f64).clamp(1e6, 2e9);
        if layout.volume() <= limit { Self::in_box(source, layout, stage) } else { Self::in_table(source, stage) }
    }

    fn in_box(source: &Source, layout: Layout, stage: &Stage) -> Result<(Self, Vec<u32>), Error> {
        let count = (layout.volume() as usize).div_ceil(64);
        let mut bits: Vec<AtomicU64> = Vec::new();
        reserve(&mut bits, count, "the grid")?;
        bits.resize_with(count, AtomicU64::default);
        let keys = Filling::<u32>::new(source.len(), "the sorting keys")?;
        let slot_of = layout.slots();
        stage.run(source.chunks(), &|i| {
            for (lattice, points) in source.parts(parallel::piece(source.len(), CHUNK, i)) {
                for point in points {
                    let mut key = OUTSIDE;
                    if let Some(brick) = lattice.brick(source.positions[point]) {
                        key = slot_of(brick);
                        let slot = key as usize;
                        let (word, bit) = (&bits[slot / 64], 1 << (slot % 64));
                        // Reading first: most points find their bit set, and then no thread waits for another.
                        if word.load(Relaxed) & bit == 0 {
                            word.fetch_or(bit, Relaxed);
                        }
                    }
                    // SAFETY: each point belongs to one chunk.
                    unsafe { keys.write(point, key) };
                }
            }
        })?;
        // SAFETY: the chunks hold all points.
        let keys = unsafe { keys.complete() };

        let bits: Vec<u64> = bits.into_iter().map(AtomicU64::into_inner).collect();
        let mut before = Vec::new();
        reserve(&mut before, count, "the grid")?;
        let mut total = 0;
        for word in &bits {
            before.push(total);
            total += word.count_ones();
        }
        let mut places = Vec::new();
        reserve(&mut places, total as usize, "the grid")?;
        for (i, &word) in bits.iter().enumerate() {
            places.extend(set_bits(word).map(|bit| layout.brick(64 * i + bit as usize)));
        }

        Ok((Self { places, index: Index::Box { layout, bits, before } }, keys))
    }

    fn in_table(source: &Source, stage: &Stage) -> Result<(Self, Vec<u32>), Error> {
        // Sorted below, so the order in which the chunks come does not matter.
        let found = Gathering::new("the grid");
        stage.part(0.0..0.5).run(source.chunks(), &|i| {
            let mut places = Vec::new();
            for (lattice, points) in source.parts(parallel::piece(source.len(), CHUNK, i)) {
                for brick in source.positions[points].iter().filter_map(|&position| lattice.brick_place(position)) {
                    let place = [brick.z, brick.y, brick.x].map(i64::from);
                    if places.last() != Some(&place) {
                        places.push(place);
                    }
                }
            }
            sort_unique(&mut places);
            found.append(places);
        })?;
        let mut found = found.all()?;
        sort_unique(&mut found);
        let mut places = Vec::new();
        reserve(&mut places, found.len(), "the grid")?;
        places.extend(found.into_iter().map(|[z, y, x]| IVec3::new(x as i32, y as i32, z as i32)));

        let mut slots = Vec::new();
        let length = (2 * places.len()).next_power_of_two();
        reserve(&mut slots, length, "the grid")?;
        slots.resize(length, FREE);
        for (number, place) in places.iter().enumerate() {
            let mut slot = hash(*place) & (length - 1);
            while slots[slot] != FREE {
                slot = (slot + 1) & (length - 1);
            }
            slots[slot] = number as u32;
        }

        let bricks = Self { places, index: Index::Table { slots } };
        let keys = Filling::new(source.len(), "the sorting keys")?;
        stage.part(0.5..1.0).run(source.chunks(), &|i| {
            for (lattice, points) in source.parts(parallel::piece(source.len(), CHUNK, i)) {
                for point in points {
                    let number = lattice.brick_place(source.positions[point]).and_then(|brick| bricks.number(brick));
                    // SAFETY: each point belongs to one chunk.
                    unsafe { keys.write(point, number.unwrap_or(OUTSIDE)) };
                }
            }
        })?;
        // SAFETY: the chunks hold all points.
        let keys = unsafe { keys.complete() };
        Ok((bricks, keys))
    }

    /// The number of the brick with a key that [`Bricks::find`] answered with.
    #[inline(always)]
    pub fn number_of_key(&self, key: u32) -> u32 {
        match &self.index {
            Index::Box { bits, before, .. } => rank(bits, before, key as usize),
            // It is the number.
            Index::Table { .. } => key,
        }
    }

    /// How many bricks there are.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// The number of the brick at a place, if it is occupied.
    #[inline(always)]
    pub fn number(&self, brick: IVec3) -> Option<u32> {
        match &self.index {
            Index::Box { layout, bits, before } => {
                if !layout.holds(brick) {
                    return None;
                }
                let slot = layout.slot(brick);
                (bits[slot / 64] >> (slot % 64) & 1 == 1).then(|| rank(bits, before, slot))
            }
            Index::Table { slots } => {
                let mut slot = hash(brick) & (slots.len() - 1);
                loop {
                    match slots[slot] {
                        FREE => return None,
                        number if self.places[number as usize] == brick => return Some(number),
                        _ => slot = (slot + 1) & (slots.len() - 1),
                    }
                }
            }
        }
    }
}

/// The positions of the bits that are set, lowest first.
pub(crate) fn set_bits(mut bits: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = bits.trailing_zeros();
        bits &= bits.wrapping_sub(1);
        (bit < 64).then_some(bit)
    })
}

/// How many bricks come before a slot.
fn rank(bits: &[u64], before: &[u32], slot: usize) -> u32 {
    before[slot / 64] + (bits[slot / 64] & ((1 << (slot % 64)) - 1)).count_ones()
}

fn hash(brick: IVec3) -> usize {
    (mixed(brick.x as u64, brick.y as u64, brick.z as u64) >> 32) as usize
}
