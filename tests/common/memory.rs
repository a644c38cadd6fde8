//! How much memory is in use: a counter round the system's allocator. For tests, `benches/native.rs` and `fuzz/`.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Bytes in use, and the most that were.
pub static CURRENT: AtomicUsize = AtomicUsize::new(0);
pub static PEAK: AtomicUsize = AtomicUsize::new(0);
/// What may be in use at once.
pub static LIMIT: AtomicUsize = AtomicUsize::new(usize::MAX);
/// No such block is refused: the library need not expect that.
const SMALL: usize = 1 << 16;
/// The last block that was refused, and what was free then.
pub static REFUSED: AtomicUsize = AtomicUsize::new(0);
pub static FREE: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// A block grows by a copy, for `realloc` is the default one: as it is in WebAssembly.
// SAFETY: passes every call that it does not refuse on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let before = CURRENT.fetch_add(layout.size(), Relaxed);
        let now = before + layout.size();
        if now > LIMIT.load(Relaxed) && layout.size() > SMALL {
            CURRENT.fetch_sub(layout.size(), Relaxed);
            REFUSED.store(layout.size(), Relaxed);
            FREE.store(LIMIT.load(Relaxed).saturating_sub(before), Relaxed);
            return std::ptr::null_mut();
        }
        PEAK.fetch_max(now, Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        CURRENT.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What `work` answers, and the bytes that it takes at the most.
pub fn peak_of<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = CURRENT.load(Relaxed);
    PEAK.store(before, Relaxed);
    let result = work();
    (result, PEAK.load(Relaxed).saturating_sub(before))
}
