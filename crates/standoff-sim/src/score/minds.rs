//! Where minds are several, metrics of tracks and groups are of every mind's own picture, and averaged.

use std::collections::BTreeMap;

use super::metrics::Metrics;
use crate::frame::Frame;

/// What scores one picture, frame by frame.
pub(super) trait Scores {
    /// Takes in the next frame.
    fn frame(&mut self, frame: &Frame);
    /// The scores so far.
    fn metrics(&self) -> Metrics;
}

/// The scores of several minds, one `S` each; of one mind for all there is nothing.
#[derive(Debug, Clone)]
pub(super) struct Minds<S> {
    lives: BTreeMap<u32, Life<S>>,
    /// What lives came to that are over, and for how many instants each was.
    over: Vec<(Metrics, u64)>,
    instants: u64,
    /// The frame that a mind would fill by itself: room that lives on.
    frame: Frame,
}

/// A stretch without a break in which a mind was there: after a restart it begins anew.
#[derive(Debug, Clone)]
struct Life<S> {
    scorer: S,
    instants: u64,
    /// The last instant, counted from 1.
    last: u64,
}

impl<S> Default for Minds<S> {
    fn default() -> Self {
        Self { lives: BTreeMap::new(), over: Vec::new(), instants: 0, frame: Frame::default() }
    }
}

impl<S: Scores> Minds<S> {
    /// Takes in the next frame; `scorer` is one that has seen nothing yet.
    pub(super) fn frame(&mut self, frame: &Frame, scorer: impl Fn() -> S) {
        self.instants += 1;
        for row in &frame.agents.all {
            let new = || Life { scorer: scorer(), instants: 0, last: self.instants };
            let life = self.lives.entry(row.agent).or_insert_with(new);
            if life.last + 1 < self.instants {
                let old = std::mem::replace(life, new());
                self.over.push((old.scorer.metrics(), old.instants));
            }
            (life.instants, life.last) = (life.instants + 1, self.instants);
            own_frame(frame, row.agent, &mut self.frame);
            life.scorer.frame(&self.frame);
        }
    }

    /// Puts the means of all minds, by how long each was there, in the place of metrics of one picture.
    pub(super) fn average(&self, metrics: Metrics) -> Metrics {
        let lives = self.lives.values().map(|life| (life.scorer.metrics(), life.instants));
        let all: Vec<(Metrics, u64)> = self.over.iter().copied().chain(lives).collect();
        if all.is_empty() { metrics } else { metrics.averaged(&all) }
    }
}

/// Makes `own` what a frame would be if there were this mind alone: which group a UAV serves is as it believes.
fn own_frame(frame: &Frame, agent: u32, own: &mut Frame) {
    let agents = &frame.agents;
    own.time_us = frame.time_us;
    own.truth.clone_from(&frame.truth);
    own.detections.clone_from(&frame.detections);
    own.uavs.clone_from(&frame.uavs);
    for uav in &mut own.uavs {
        let is_there = agents.all.binary_search_by_key(&uav.uav, |row| row.agent).is_ok();
        uav.group = agents.mate(agent, uav.uav).filter(|_| is_there).and_then(|mate| mate.group);
    }
    own.tracks.clear();
    own.tracks.extend(agents.tracks_of(agent).iter().map(|of| of.row));
    own.groups.clear();
    own.groups.extend(agents.groups_of(agent).iter().map(|of| of.row));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{AgentRow, Agents, OfAgent, TeamRow};
    use crate::scenario::{Edits, Scenario};
    use crate::score::fixtures::{group_row, track_row, truth_row, uav_row};
    use crate::score::{Choice, Rules, Scorer};

    fn scored(frames: impl IntoIterator<Item = Frame>) -> Metrics {
        let scenario = Scenario::load("paper/table-2-pair", &Edits::default(), 1).unwrap();
        let mut scorer = Scorer::new(Rules::of(&scenario.settings), Choice::ALL);
        frames.into_iter().for_each(|frame| scorer.frame(&frame));
        scorer.metrics()
    }

    /// Two UAVs and a target that both see, of which nobody's picture tells that is everybody's; and these minds: by each,
    /// whether it has the target in its group 5, how far off, and which UAV it believes to serve that.
    fn frame(instant: i64, minds: &[(u32, bool, f64, u32)]) -> Frame {
        let mut frame = Frame { time_us: instant * 500_000, ..Frame::default() };
        frame.uavs.extend((0..2).map(uav_row));
        frame.truth.push(truth_row(0, 100.0, 0.0));
        for &(agent, has, off_m, served_by) in minds {
            let Agents { all, tracks, groups, team, .. } = &mut frame.agents;
            all.push(AgentRow {
                agent,
                committed_us: None,
                disturbed: false,
                sent_messages: 0,
                sent_bytes: 0,
                double_counted: None,
            });
            let mut row = track_row(0, has.then_some(5));
            row.state[0] = 100.0 + off_m;
            tracks.push(OfAgent { agent, row });
            groups.push(OfAgent { agent, row: group_row(5) });
            let group = |uav| (uav == served_by).then_some(5);
            let of_uav =
                |uav| TeamRow { agent, uav, presence: None, heard_us: None, group: group(uav), group_id: None };
            team.extend((0..2).map(of_uav));
        }
        frame
    }

    /// The first mind is there for four instants and 3 m off, the second for one, and 13 m off.
    #[test]
    fn each_mind_counts_as_long_as_it_is_there() {
        let both = [(0, true, 3.0, 0), (1, true, 13.0, 0)];
        let metrics = scored((0..4).map(|instant| frame(instant, if instant == 2 { &both } else { &both[..1] })));
        assert_eq!(metrics.position_error_m, Some(5.0));
        assert_eq!(metrics.uncovered_fraction, Some(0.0));
        assert_eq!(metrics.handoffs, Some(0));
        // All that one mind tells is nothing.
        let without = scored((0..4).map(|instant| frame(instant, &[])));
        assert_eq!((without.position_error_m, without.uncovered_fraction), (None, Some(1.0)));
        assert_eq!(metrics.seen_fraction, without.seen_fraction);
    }

    /// After a restart a mind's first instant is that of the cue again, and what it missed is no matter.
    #[test]
    fn a_mind_that_was_gone_begins_anew() {
        let at = |instant| match instant {
            2 => frame(2, &[]),
            _ => frame(instant, &[(1, instant < 2, 0.0, 1)]),
        };
        assert_eq!(scored((0..5).map(at)).watched_fraction, Some(0.5));
    }

    /// Both believe that the other serves the group; one whose computer is off serves none. A UAV is 300 m inside the orbit.
    #[test]
    fn who_serves_which_group_is_as_each_believes() {
        let both = [(0, true, 0.0, 1), (1, true, 0.0, 0)];
        assert_eq!(scored([frame(0, &both)]).standoff_tracking_error_m, Some(300.0));
        assert_eq!(scored([frame(0, &both[..1])]).standoff_tracking_error_m, None);
    }
}
