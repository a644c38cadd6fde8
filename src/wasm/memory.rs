//! How much of its memory the module uses: a counter round the allocator.

#[cfg(not(target_feature = "atomics"))]
use lol_alloc::{AssumeSingleThreaded, FreeListAllocator};
use std::alloc::{GlobalAlloc, Layout};
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering::Relaxed};
use wasm_bindgen::prelude::*;

/// Much smaller than the standard allocator. Knows no threads.
#[cfg(not(target_feature = "atomics"))]
// SAFETY: a module without atomics has one thread.
static HEAP: AssumeSingleThreaded<FreeListAllocator> = unsafe { AssumeSingleThreaded::new(FreeListAllocator::new()) };
#[cfg(target_feature = "atomics")]
static HEAP: std::alloc::System = std::alloc::System;

/// No single block may be larger, whatever is free.
const LARGEST_BLOCK: u64 = isize::MAX as u64;
const PAGE: u64 = 65536;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

static USED: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
/// Pages. At first all that a 32-bit module can address.
static MAXIMUM: AtomicU32 = AtomicU32::new(65536);
/// What could be had instead of the last block that was refused.
static AVAILABLE: AtomicUsize = AtomicUsize::new(0);

struct Counting;

/// Every block begins at a multiple of 8, whatever its type asks for: bytes and floats can be viewed as doubles. The
/// allocators align to 8 anyway, so this costs nothing.
fn aligned(layout: Layout) -> Layout {
    layout.align_to(8).unwrap_or(layout)
}

fn count(block: *mut u8, bytes: usize) {
    if block.is_null() {
        // Now: when it is asked for, the call that failed has already freed its memory. And it may lie in pieces.
        AVAILABLE.store(free().min(bytes as u64 - 1) as usize, Relaxed);
    } else {
        PEAK.fetch_max(USED.fetch_add(bytes, Relaxed) + bytes, Relaxed);
    }
}

/// What is in no block yet.
#[inline(never)]
fn free() -> u64 {
    (u64::from(MAXIMUM.load(Relaxed)) * PAGE).saturating_sub(USED.load(Relaxed) as u64)
}

// SAFETY: every call goes to the same allocator, each block always with the same, possibly stricter, alignment.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let block = unsafe { HEAP.alloc(aligned(layout)) };
        count(block, layout.size());
        block
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        USED.fetch_sub(layout.size(), Relaxed);
        unsafe { HEAP.dealloc(block, aligned(layout)) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        let block = unsafe { HEAP.alloc_zeroed(aligned(layout)) };
        count(block, layout.size());
        block
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

/// Tells how many pages the memory may grow to. JavaScript makes the memory, and only it knows.
#[wasm_bindgen(js_name = setMaximum)]
pub fn set_maximum(pages: u32) {
    MAXIMUM.store(pages, Relaxed);
}

/// What could be had at most instead of the block that was refused last.
pub(super) fn available(needed: u64) -> u64 {
    // No larger one is asked for, so that none was refused. And less than was needed: of two threads either may have been
    // refused last.
    if needed > LARGEST_BLOCK { free().min(LARGEST_BLOCK) } else { (needed - 1).min(AVAILABLE.load(Relaxed) as u64) }
}
