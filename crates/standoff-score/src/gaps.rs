//! Times in which existing targets are in no UAV's view. Without truth, as in the record of a flight: times in which targets
//! with a track are not measured.

use std::collections::BTreeMap;

use serde::Serialize;
use standoff_record::{Frame, MembershipState, TrackRow, TrackStatus};

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
    /// True position of the target at the begin, east, m; without truth, the estimate.
    pub x_m: f64,
    /// True position of the target at the begin, north, m; without truth, the estimate.
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
    /// True if an earlier time step contained a true target.
    has_truth: bool,
    views: BTreeMap<u32, View>,
    ended: Vec<Gap>,
}

impl Gaps {
    /// Makes an accumulator for a run with time steps of `period_s`.
    #[must_use]
    pub fn new(period_s: f64) -> Self {
        Self { period_us: (period_s * 1e6).round() as i64, has_truth: false, views: BTreeMap::new(), ended: Vec::new() }
    }

    /// Adds the next time step.
    pub fn add(&mut self, frame: &Frame, scores: &FrameScores<'_>) {
        if !self.has_truth && !frame.truth.is_empty() {
            // What was found before concerns false tracks.
            (self.has_truth, self.views, self.ended) = (true, BTreeMap::new(), Vec::new());
        }
        if !self.has_truth {
            for row in &frame.tracks {
                let is_in_view = Some(row.status == TrackStatus::Updated);
                self.add_target(frame.time_us, row.target, [row.state[0], row.state[3]], Some(row), is_in_view);
            }
            return;
        }
        for (truth, track) in scores.geometry.matching().targets() {
            let is_in_view = scores.in_view(truth.target);
            self.add_target(frame.time_us, truth.target, [truth.x_m, truth.y_m], track, is_in_view);
        }
    }

    fn add_target(
        &mut self,
        time_us: i64,
        target: u32,
        [x_m, y_m]: [f64; 2],
        track: Option<&TrackRow>,
        is_in_view: Option<bool>,
    ) {
        let is_new = !self.views.contains_key(&target);
        let view = self.views.entry(target).or_default();
        view.is_in_view = is_in_view;
        if is_new || is_in_view == Some(true) {
            self.ended.extend(view.gap.take());
            return;
        }
        let cause = GapCause::of(track);
        let begun = Gap { target, begin_us: time_us, end_us: time_us, steps: 0, x_m, y_m, cause };
        let gap = view.gap.get_or_insert(begun);
        (gap.end_us, gap.steps) = (time_us + self.period_us, gap.steps.saturating_add(1));
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
