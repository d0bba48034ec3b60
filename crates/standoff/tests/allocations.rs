//! An agent's step allocates nothing once it has warmed up.

#![expect(unsafe_code, reason = "counting allocations takes a global allocator")]

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use common::{Team, scan_of, step};

struct Counting;

thread_local! {
    /// Of this thread alone: the harness of the tests allocates on its own when it likes.
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn a_warm_step_allocates_nothing() {
    let mut team = Team::new(3, 12);
    for tick in 0..20 {
        team.tick(tick);
    }
    for tick in 20..40 {
        let (now, scans, inbox) = team.speak(tick);
        let (own, scan) = (team.states[0], scan_of(&scans[0]));
        let agent = &mut team.agents[0];
        let before = ALLOCATIONS.get();
        let step = step(agent, now, &own, scan, &inbox);
        let turn_rate = step.command.turn_rate_rad_s;
        let allocated = ALLOCATIONS.get() - before;
        assert!(turn_rate.is_finite());
        assert_eq!(allocated, 0, "tick {tick}");
        team.tick(tick);
    }
}
