//! Several independent worlds. The results of a world do not depend on the number of worlds or threads.

use std::sync::Mutex;
use std::thread;

use super::world::{Kind, NoMission, Seeds, World};

/// When the next mission of a world starts after its mission has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Autoreset {
    /// At the next step, which ignores the action.
    NextStep,
    /// In the same step that ends the mission.
    SameStep,
    /// Not before the world is reset.
    Disabled,
}

/// Slot for one world: empty before its first mission, or if its next mission could not start.
#[derive(Default)]
pub(super) struct Slot {
    pub(super) world: Option<World>,
    /// Seeds of the last mission, also if that mission could not start.
    pub(super) seeds: Option<Seeds>,
    /// With [`Autoreset::SameStep`]: the previous mission, if it ended in the last step.
    pub(super) ended: Option<Box<World>>,
    failed: Option<NoMission>,
}

/// Steps every world. If next missions cannot start, returns the first error and leaves those slots empty.
pub(super) fn step(
    slots: &mut [Slot],
    actions: &[f64],
    kind: &Kind,
    autoreset: Autoreset,
    threads: usize,
) -> Result<(), NoMission> {
    let per_world = actions.len() / slots.len().max(1);
    let fly = |(slots, actions): (&mut [Slot], &[f64])| {
        for (slot, actions) in slots.iter_mut().zip(actions.chunks_exact(per_world)) {
            slot.step(actions, kind, autoreset);
        }
    };
    let per_thread = slots.len().div_ceil(threads).max(1);
    let others = slots.len().div_ceil(per_thread).saturating_sub(1);
    let parts = Mutex::new(slots.chunks_mut(per_thread).zip(actions.chunks(per_thread * per_world)));
    let fly_remaining_parts = || {
        while let Some(part) = parts.lock().ok().and_then(|mut parts| parts.next()) {
            fly(part);
        }
    };
    thread::scope(|scope| {
        for _ in 0..others {
            // If a thread cannot be started, the others do its work.
            let _ = thread::Builder::new().spawn_scoped(scope, fly_remaining_parts);
        }
        fly_remaining_parts();
    });
    slots.iter_mut().find_map(|slot| slot.failed.take()).map_or(Ok(()), Err)
}

/// Starts a mission in every slot with `Some` seeds. If one cannot start, all slots stay unchanged.
pub(super) fn reset(slots: &mut [Slot], seeds: &[Option<Seeds>], kind: &Kind) -> Result<(), NoMission> {
    let begin = |seeds: &Option<Seeds>| seeds.map(|seeds| World::begin(kind, seeds)).transpose();
    let worlds = seeds.iter().map(begin).collect::<Result<Vec<_>, _>>()?;
    for (slot, world) in slots.iter_mut().zip(worlds) {
        slot.ended = None;
        if let Some(world) = world {
            *slot = Slot { seeds: Some(world.seeds), world: Some(world), ..Slot::default() };
        }
    }
    Ok(())
}

impl Slot {
    fn step(&mut self, actions: &[f64], kind: &Kind, autoreset: Autoreset) {
        self.ended = None;
        let Some(world) = &mut self.world else { return };
        if !world.is_over() {
            world.step(actions);
            if world.is_over() && autoreset == Autoreset::SameStep {
                self.ended = self.begin_next(kind).map(Box::new);
            }
        } else if autoreset == Autoreset::NextStep {
            self.begin_next(kind);
        }
    }

    /// Starts the next mission and returns the previous one.
    fn begin_next(&mut self, kind: &Kind) -> Option<World> {
        let last = self.world.take()?;
        let seeds = last.seeds.next();
        self.seeds = Some(seeds);
        match World::begin(kind, seeds) {
            Ok(world) => self.world = Some(world),
            Err(reason) => self.failed = Some(reason),
        }
        Some(last)
    }
}
