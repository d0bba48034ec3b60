//! Targets in groups.

use std::collections::BTreeMap;

use standoff_record::{Frame, TrackRow, TruthRow};

use crate::matching::key;

/// Targets in groups. If each agent has its own team state, a target can be in a group for some agents only.
#[derive(Debug)]
pub(crate) struct Grouped {
    /// Number of running agents, and of those that have each target in a group. 0 if one agent acts for the whole team,
    /// or if none is running.
    agents: usize,
    counts: BTreeMap<u32, usize>,
}

impl Grouped {
    pub(crate) fn of(frame: &Frame) -> Self {
        let mut counts = BTreeMap::new();
        for of in frame.agents.tracks.iter().filter(|of| of.row.group.is_some()) {
            *counts.entry(key(&of.row)).or_default() += 1;
        }
        Self { agents: frame.agents.all.len(), counts }
    }

    /// Fraction of the running agents that have a target in a group. `track` is its track in the shared team state.
    pub(crate) fn fraction(&self, target: &TruthRow, track: Option<&TrackRow>) -> f64 {
        if self.agents == 0 {
            return f64::from(track.is_some_and(|track| track.group.is_some()));
        }
        self.counts.get(&target.target).map_or(0.0, |count| *count as f64 / self.agents as f64)
    }
}
