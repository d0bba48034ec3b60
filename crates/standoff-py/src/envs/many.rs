//! Worlds side by side, each its own: what one does is the same beside however many, on however many threads.

use std::sync::Mutex;
use std::thread;

use super::world::{Kind, NoMission, Seeds, World};

/// What happens to a world whose mission is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Autoreset {
    /// The next step begins its next mission, whatever the action.
    NextStep,
    /// The step that ends it begins its next mission.
    SameStep,
    /// Nothing, until it is reset.
    Disabled,
}

/// A place for a world: empty before its first mission, and where the next one could not begin.
#[derive(Default)]
pub(super) struct Place {
    pub(super) world: Option<World>,
    /// Those of its last mission, also where that could not begin.
    pub(super) seeds: Option<Seeds>,
    /// With [`Autoreset::SameStep`]: the last mission, if it ended in the last step.
    pub(super) ended: Option<Box<World>>,
    failed: Option<NoMission>,
}

/// Steps every world; the first place whose next mission cannot begin is told, and is empty then.
pub(super) fn step(
    places: &mut [Place],
    actions: &[f64],
    kind: &Kind,
    autoreset: Autoreset,
    threads: usize,
) -> Result<(), NoMission> {
    let per_world = actions.len() / places.len().max(1);
    let fly = |(places, actions): (&mut [Place], &[f64])| {
        for (place, actions) in places.iter_mut().zip(actions.chunks_exact(per_world)) {
            place.step(actions, kind, autoreset);
        }
    };
    let per_thread = places.len().div_ceil(threads).max(1);
    let others = places.len().div_ceil(per_thread).saturating_sub(1);
    let parts = Mutex::new(places.chunks_mut(per_thread).zip(actions.chunks(per_thread * per_world)));
    let fly_what_is_left = || {
        while let Some(part) = parts.lock().ok().and_then(|mut parts| parts.next()) {
            fly(part);
        }
    };
    thread::scope(|scope| {
        for _ in 0..others {
            // Where the system has no thread to give, those that there are do the work.
            let _ = thread::Builder::new().spawn_scoped(scope, fly_what_is_left);
        }
        fly_what_is_left();
    });
    places.iter_mut().find_map(|place| place.failed.take()).map_or(Ok(()), Err)
}

/// Begins a mission in every place that is told a seed; in none if one cannot begin.
pub(super) fn reset(places: &mut [Place], seeds: &[Option<Seeds>], kind: &Kind) -> Result<(), NoMission> {
    let begin = |seeds: &Option<Seeds>| seeds.map(|seeds| World::begin(kind, seeds)).transpose();
    let worlds = seeds.iter().map(begin).collect::<Result<Vec<_>, _>>()?;
    for (place, world) in places.iter_mut().zip(worlds) {
        place.ended = None;
        if let Some(world) = world {
            *place = Place { seeds: Some(world.seeds), world: Some(world), ..Place::default() };
        }
    }
    Ok(())
}

impl Place {
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

    /// Begins the next mission; gives the last one.
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
