//! Averages the metrics of tracks and groups over the agents if each agent has its own team state.

use std::collections::BTreeMap;

use standoff_record::Frame;

use crate::config::ScoreConfig;
use crate::families::association;
use crate::mean::Mean;
use crate::metrics::{MetricSelection, Metrics};
use crate::team_scorer::TeamScorer;

/// Scores of several agents, one scorer each. Empty if one agent acts for the whole team.
#[derive(Debug)]
pub(crate) struct PerAgentScores {
    /// Selected metrics that are computed for each agent separately.
    choice: MetricSelection,
    running: BTreeMap<u32, RunningPeriod>,
    /// Scores of ended running periods, and the number of time steps of each.
    over: Vec<(Metrics, u64)>,
    steps: u64,
    /// Existing targets at the time steps without a running agent, after one has run.
    missed_by_all: Mean,
    /// Frame of a single agent; reused buffer.
    frame: Frame,
}

/// Uninterrupted running period of an agent. A restart begins a new one.
#[derive(Debug)]
struct RunningPeriod {
    scorer: TeamScorer,
    steps: u64,
    /// Last time step, counted from 1.
    last: u64,
}

impl PerAgentScores {
    /// Makes scores without data of those of the selected metrics that each agent has.
    pub(crate) fn new(choice: MetricSelection) -> Self {
        Self {
            choice: choice.of_team_states(),
            running: BTreeMap::new(),
            over: Vec::new(),
            steps: 0,
            missed_by_all: Mean::default(),
            frame: Frame::default(),
        }
    }

    /// Adds the next frame.
    pub(crate) fn frame(&mut self, config: &ScoreConfig, frame: &Frame) {
        if self.choice.is_empty() {
            return;
        }
        self.steps += 1;
        if frame.agents.all.is_empty() && !self.running.is_empty() {
            self.missed_by_all.add(frame.truth.len() as f64);
        }
        for row in &frame.agents.all {
            let scorer = || TeamScorer::new(config.clone(), self.choice);
            let new = || RunningPeriod { scorer: scorer(), steps: 0, last: self.steps };
            let period = self.running.entry(row.agent).or_insert_with(new);
            if period.last + 1 < self.steps {
                let old = std::mem::replace(period, new());
                self.over.push((old.scorer.metrics(), old.steps));
            }
            (period.steps, period.last) = (period.steps + 1, self.steps);
            own_frame(frame, row.agent, &mut self.frame);
            period.scorer.frame(&self.frame);
        }
    }

    /// Replaces the metrics of a shared team state by the means over all agents, weighted by their running time. While no
    /// agent runs, all of them miss all targets.
    pub(crate) fn average(&self, metrics: Metrics, config: &ScoreConfig) -> Metrics {
        let running = self.running.values().map(|period| (period.scorer.metrics(), period.steps));
        let mut all: Vec<(Metrics, u64)> = self.over.iter().cloned().chain(running).collect();
        if all.is_empty() {
            return metrics;
        }
        let missed = self.missed_by_all.value().unwrap_or_default();
        let without = Metrics::of(association::without_tracks(missed, config.gospa_cutoff_m));
        all.push((without, self.missed_by_all.n * self.running.len() as u64));
        metrics.averaged(&all)
    }
}

/// Fills `own` with the frame of this agent alone: the assignments are those that the agent believes.
fn own_frame(frame: &Frame, agent: u32, own: &mut Frame) {
    let agents = &frame.agents;
    own.time_us = frame.time_us;
    own.truth.clone_from(&frame.truth);
    own.detections.clone_from(&frame.detections);
    own.uavs.clone_from(&frame.uavs);
    for uav in &mut own.uavs {
        let has_agent = agents.all.binary_search_by_key(&uav.uav, |row| row.agent).is_ok();
        uav.group = agents.teammate(agent, uav.uav).filter(|_| has_agent).and_then(|mate| mate.group);
    }
    own.tracks.clear();
    own.tracks.extend(agents.tracks_of(agent).iter().map(|of| of.row));
    own.groups.clear();
    own.groups.extend(agents.groups_of(agent).iter().map(|of| of.row));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{score, score_config};
    use crate::row_fixtures::{group_row, track_row, truth_row, uav_row};
    use standoff_record::{AgentRow, ByAgent, PerAgentTables, TeammateRow, TrackRow};

    fn scored(frames: impl IntoIterator<Item = Frame>) -> Metrics {
        score(&score_config(), &frames.into_iter().collect::<Vec<_>>())
    }

    /// Frame with two UAVs and a target in view of both, without a shared team state. `agents` lists for each agent its
    /// id, whether the target is in its group 5, its position error and the UAV that it believes to be assigned to the
    /// group.
    fn frame(step: i64, agents: &[(u32, bool, f64, u32)]) -> Frame {
        let mut frame = Frame { time_us: step * 500_000, ..Frame::default() };
        frame.uavs.extend((0..2).map(uav_row));
        frame.truth.push(truth_row(0, 100.0, 0.0));
        for &(agent, has, off_m, served_by) in agents {
            let PerAgentTables { all, tracks, groups, teammates: team, .. } = &mut frame.agents;
            all.push(AgentRow { agent, ..AgentRow::default() });
            let state = [100.0 + off_m, 0.0, 0.0, 0.0, 0.0, 0.0];
            tracks.push(ByAgent { agent, row: TrackRow { state, ..track_row(0, has.then_some(5)) } });
            groups.push(ByAgent { agent, row: group_row(5) });
            let group = |uav| (uav == served_by).then_some(5);
            let of_uav = |uav| TeammateRow { agent, uav, group: group(uav), ..TeammateRow::default() };
            team.extend((0..2).map(of_uav));
        }
        frame
    }

    /// The first agent runs for four time steps with an error of 3 m, the second for one with 13 m.
    #[test]
    fn agents_are_weighted_by_their_running_time() {
        let both = [(0, true, 3.0, 0), (1, true, 13.0, 0)];
        let metrics = scored((0..4).map(|step| frame(step, if step == 2 { &both } else { &both[..1] })));
        assert_eq!(metrics["position_error_m"], Some(5.0));
        assert_eq!(metrics["ungrouped_fraction"], Some(0.0));
        assert_eq!(metrics["handoffs"], Some(0.0));
        // Without agents there are no tracks and groups.
        let without = scored((0..4).map(|step| frame(step, &[])));
        assert_eq!((without["position_error_m"], without["ungrouped_fraction"]), (None, Some(1.0)));
        assert_eq!(metrics["in_view_fraction"], without["in_view_fraction"]);
    }

    /// After a restart, the first time step of an agent counts as the time step of the cue; the gap is not scored.
    #[test]
    fn restarted_agent_is_scored_from_scratch() {
        let at = |step| match step {
            2 => frame(2, &[]),
            _ => frame(step, &[(1, step < 2, 0.0, 1)]),
        };
        // In custody at one of the four time steps after the first.
        assert_eq!(scored((0..5).map(at))["custody_fraction"], Some(0.25));
        // Out of view before and after the gap: two times, not one long time.
        let unseen = |step| {
            let mut frame = frame(step, if step == 2 { &[] } else { &[(1, true, 0.0, 1)] });
            frame.uavs.iter_mut().filter(|_| step > 0).for_each(|uav| uav.boresight_rad = None);
            frame
        };
        assert_eq!(scored((0..5).map(unseen))["member_longest_out_of_view_s"], Some(0.5));
    }

    /// Whichever of two agents run at each of three time steps: custody is never above the time in view, and without a
    /// running agent no target is in custody or in a group.
    #[test]
    fn targets_in_custody_are_in_view_and_in_a_group() {
        for running in 0..64u32 {
            let at = |step: i64| {
                let of_agent = |agent: u32| {
                    let is_on = running >> (step as u32 + 3 * agent) & 1 == 1;
                    is_on.then_some((agent, step != 2 || agent == 0, 1.0, 0))
                };
                let mut frame = frame(step, &(0..2).filter_map(of_agent).collect::<Vec<_>>());
                frame.uavs.iter_mut().filter(|_| step == 1).for_each(|uav| uav.boresight_rad = None);
                frame
            };
            let metrics = scored((0..3).map(at));
            // In view at the last of the two time steps that count, and then in a group of the first agent only.
            let [first, second] = [2, 5].map(|bit| f64::from(running >> bit & 1));
            let custody = if first > 0.0 { 0.5 / (first + second) } else { 0.0 };
            assert_eq!(
                (metrics["in_view_fraction"], metrics["custody_fraction"]),
                (Some(0.5), Some(custody)),
                "{running:b}"
            );
            assert_eq!(metrics["ungrouped_fraction"] == Some(1.0), running & 0b01_1111 == 0, "{running:b}");
        }
    }

    /// Each agent believes that the other UAV is assigned to the group. A UAV whose computer is off has no assignment.
    /// The UAVs are 300 m inside the orbit.
    #[test]
    fn assignments_are_those_that_each_agent_believes() {
        let both = [(0, true, 0.0, 1), (1, true, 0.0, 0)];
        assert_eq!(scored([frame(0, &both)])["standoff_error_own_estimate_m"], Some(300.0));
        assert_eq!(scored([frame(0, &both[..1])])["standoff_error_own_estimate_m"], None);
    }
}
