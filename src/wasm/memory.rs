//! How much of its memory the module uses: a counter round the standard allocator.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// What a 32-bit module can address at most.
const ADDRESSABLE: u64 = 1 << 32;
/// No single block may be larger, whatever is free.
const LARGEST_BLOCK: u64 = isize::MAX as u64;
const PAGE: u64 = 65536;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

static USED: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

struct Counting;

/// Every block begins at a multiple of 8, whatever its type asks for: bytes and floats can be viewed as doubles. The
/// standard allocator aligns to 8 anyway, so this costs nothing.
fn aligned(layout: Layout) -> Layout {
    layout.align_to(8).unwrap_or(layout)
}

fn add(bytes: usize) {
    PEAK.fetch_max(USED.fetch_add(bytes, Relaxed) + bytes, Relaxed);
}

// SAFETY: every call goes to the standard allocator, each block always with the same, possibly stricter, alignment.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let block = unsafe { System.alloc(aligned(layout)) };
        if !block.is_null() {
            add(layout.size());
        }
        block
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        USED.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(block, aligned(layout)) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        let block = unsafe { System.alloc_zeroed(aligned(layout)) };
        if !block.is_null() {
            add(layout.size());
        }
        block
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let moved = unsafe { System.realloc(block, aligned(layout), size) };
        if !moved.is_null() {
            USED.fetch_sub(layout.size(), Relaxed);
            add(size);
        }
        moved
    }
}

/// Starts a new measurement of [`peak`].
pub(super) fn begin() {
    PEAK.store(USED.load(Relaxed), Relaxed);
}

/// The most bytes that were in use at once since [`begin`], in the whole module.
pub(super) fn peak() -> u64 {
    PEAK.load(Relaxed) as u64
}

/// What could be had instead of a block of `needed` bytes that was refused.
pub(super) fn available(needed: u64) -> u64 {
    let used = USED.load(Relaxed) as u64;
    let addressable = (ADDRESSABLE - used).min(LARGEST_BLOCK);
    if needed > addressable {
        return addressable;
    }
    // The host does not let the memory grow, so what it has now is all there is.
    let grown = core::arch::wasm32::memory_size(0) as u64 * PAGE;
    grown.saturating_sub(used).min(needed)
}
