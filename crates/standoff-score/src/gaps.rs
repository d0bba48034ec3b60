//! Times in which existing targets are in no UAV's view.

use std::collections::BTreeMap;

use serde::Serialize;
use standoff_record::{Frame, MembershipState, TrackRow};

use crate::FrameScores;

/// State of a target when it leaves the view of all UAVs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum GapCause {
    /// It has no track.
    NoTrack,
    /// It was removed from its group.
    Removed,
    /// It is in no group.
    NoGroup,
    /// It is a member of a group, but in no UAV's view.
    Member,
}

impl GapCause {
    /// Returns the cause as text.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::NoTrack => "no track",
            Self::Removed => "removed from its group",
            Self::NoGroup => "in no group",
            Self::Member => "member of a group",
        }
    }

    fn of(track: Option<&TrackRow>) -> Self {
        match track.map(|track| track.membership) {
            None => Self::NoTrack,
            Some(MembershipState::Removed) => Self::Removed,
            Some(MembershipState::Ungrouped) => Self::NoGroup,
            Some(MembershipState::Member | MembershipState::InHandoff) => Self::Member,
        }
    }
}

/// A time in which an existing target is in no UAV's view. Time steps count as for the metric `longest_out_of_view_s`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gap {
    /// Target id.
    pub target: u32,
    /// First time step out of view, microseconds.
    pub begin_us: i64,
    /// First time step in view again, or the end of the last one, microseconds.
    pub end_us: i64,
    /// Number of time steps out of view. Time steps without the target do not count.
    pub steps: u32,
    /// True position of the target at the begin, east, m.
    pub x_m: f64,
    /// True position of the target at the begin, north, m.
    pub y_m: f64,
    /// State of the target at the begin.
    pub cause: GapCause,
}

/// View of a target at the last time step at which it existed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct View {
    /// `None` at the first cue, as for [`FrameScores::in_view`].
    pub is_in_view: Option<bool>,
    gap: Option<Gap>,
}

impl View {
    /// Number of time steps since a UAV had the target in view.
    #[must_use]
    pub fn out_of_view_steps(self) -> u32 {
        self.gap.map_or(0, |gap| gap.steps)
    }
}

/// The views of all targets that have existed, and their gaps.
#[derive(Debug, Clone)]
pub struct Gaps {
    period_us: i64,
    views: BTreeMap<u32, View>,
    ended: Vec<Gap>,
}

impl Gaps {
    /// Makes an accumulator for a run with time steps of `period_s`.
    #[must_use]
    pub fn new(period_s: f64) -> Self {
        Self { period_us: (period_s * 1e6).round() as i64, views: BTreeMap::new(), ended: Vec::new() }
    }

    /// Adds the next time step.
    pub fn add(&mut self, frame: &Frame, scores: &FrameScores<'_>) {
        for (truth, track) in scores.geometry.matching().targets() {
            let is_in_view = scores.in_view(truth.target);
            let is_new = !self.views.contains_key(&truth.target);
            let view = self.views.entry(truth.target).or_default();
            view.is_in_view = is_in_view;
            if is_new || is_in_view == Some(true) {
                self.ended.extend(view.gap.take());
                continue;
            }
            let begun = Gap {
                target: truth.target,
                begin_us: frame.time_us,
                end_us: frame.time_us,
                steps: 0,
                x_m: truth.x_m,
                y_m: truth.y_m,
                cause: GapCause::of(track),
            };
            let gap = view.gap.get_or_insert(begun);
            (gap.end_us, gap.steps) = (frame.time_us + self.period_us, gap.steps.saturating_add(1));
        }
    }

    /// Returns the view of a target.
    #[must_use]
    pub fn view(&self, target: u32) -> Option<View> {
        self.views.get(&target).copied()
    }

    /// Returns all gaps in the order in which they begin, those of equal begin by target.
    #[must_use]
    pub fn all(&self) -> Vec<Gap> {
        let mut all = self.ended.clone();
        all.extend(self.views.values().filter_map(|view| view.gap));
        all.sort_by_key(|gap| (gap.begin_us, gap.target));
        all
    }
}
