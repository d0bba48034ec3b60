//! Agreement of several agents, and its communication cost.

use std::collections::BTreeMap;

use standoff_record::{AgentRow, PerAgentTables};

use crate::mean::Mean;
use crate::metric::{Family, LARGE, Metric, MetricSet, NOTHING, metric};
use crate::step::Step;

/// Agreement statistics so far. Empty if one agent acts for the whole team.
#[derive(Debug, Default)]
pub(crate) struct Agreement {
    /// Time steps at which assignments differ, of those with two or more agents.
    differ: Mean,
    last_differing_us: Option<i64>,
    last_us: i64,
    /// Ids of the running agents, ascending, and the last time at which an agent started that was not running before.
    there: Vec<u32>,
    joined_us: Option<i64>,
    /// Delay between the time step and the last commit, s.
    lag_s: Mean,
    lag_max_s: Option<f64>,
    /// Time steps of agents in which retransmissions wait for their budget.
    retransmission_limited: Mean,
    /// Bytes sent by each UAV, over all time steps.
    sent_bytes: BTreeMap<u32, u64>,
    steps: u64,
    uavs: usize,
}

impl Family for Agreement {
    const SECTION: &'static str = "Communication";
    const SET: MetricSet = MetricSet::Agents;
    const METRICS: &'static [Metric<Self>] = &[
        metric(
            "assignment_disagreement_fraction",
            "time with disagreement about assignments",
            LARGE,
            0.01,
            NOTHING,
            |of, _| of.differ.value(),
        ),
        metric("reconvergence_time_s", "time to agree after the last fault", LARGE, 1.0, NOTHING, |of, run| {
            of.delay_s(run.config.faults_end_s)
        }),
        metric("commit_lag_s", "commit lag, mean", LARGE, 1.0, NOTHING, |of, _| of.lag_s.value()),
        metric("commit_lag_max_s", "commit lag, maximum", LARGE, 1.0, NOTHING, |of, _| of.lag_max_s),
        metric("sent_bytes_per_s", "data rate sent per UAV, mean", LARGE, 50.0, NOTHING, |of, run| {
            of.bytes_per_s(run.config.period_s)[0]
        }),
        metric("sent_bytes_per_s_max", "data rate sent per UAV, maximum", LARGE, 50.0, NOTHING, |of, run| {
            of.bytes_per_s(run.config.period_s)[1]
        }),
        metric(
            "retransmission_limited_fraction",
            "agent time with limited retransmission",
            LARGE,
            0.01,
            NOTHING,
            |of, _| of.retransmission_limited.value(),
        ),
    ];

    fn add(&mut self, step: &Step<'_>) {
        let (time_us, agents) = (step.frame.time_us, &step.frame.agents);
        self.steps += 1;
        self.uavs = self.uavs.max(step.frame.uavs.len());
        self.last_us = time_us;
        let is_new = |row: &AgentRow| self.there.binary_search(&row.agent).is_err();
        if self.steps > 1 && agents.all.iter().any(is_new) {
            self.joined_us = Some(time_us);
        }
        self.there.clear();
        self.there.extend(agents.all.iter().map(|row| row.agent));
        if agents.all.len() > 1 {
            let differ = assignments_differ(agents);
            self.differ.add(f64::from(differ));
            self.last_differing_us = if differ { Some(time_us) } else { self.last_differing_us };
        }
        for AgentRow { agent, committed_us, sent_bytes, retransmission_limited, .. } in &agents.all {
            if let Some(is_limited) = retransmission_limited {
                self.retransmission_limited.add(f64::from(*is_limited));
            }
            *self.sent_bytes.entry(*agent).or_default() += sent_bytes;
            if let Some(committed_us) = committed_us {
                let lag_s = time_us.saturating_sub(*committed_us) as f64 / 1e6;
                self.lag_s.add(lag_s);
                self.lag_max_s = Some(self.lag_max_s.map_or(lag_s, |most_s| most_s.max(lag_s)));
            }
        }
    }
}

impl Agreement {
    /// Time from the end of the last fault to the last time step after it with different assignments, s; 0 if there is
    /// no such time step. `None` if no fault has ended, neither a radio fault or restart (`faults_end_s`) nor a late
    /// start of a computer.
    fn delay_s(&self, faults_end_s: Option<f64>) -> Option<f64> {
        let seconds = |time_us: i64| time_us as f64 / 1e6;
        let ended_s = faults_end_s.filter(|end_s| *end_s <= seconds(self.last_us));
        let end_s =
            ended_s.into_iter().chain(self.joined_us.map(seconds)).reduce(f64::max).filter(|_| self.differ.n > 0)?;
        Some(self.last_differing_us.map_or(0.0, |last_us| (seconds(last_us) - end_s).max(0.0)))
    }

    /// Mean data rate of the UAVs and the largest one, bytes/s.
    fn bytes_per_s(&self, period_s: f64) -> [Option<f64>; 2] {
        let flown_s = self.steps as f64 * period_s;
        let most = self.sent_bytes.values().max().map(|bytes| *bytes as f64 / flown_s);
        let all: u64 = self.sent_bytes.values().sum();
        [most.map(|_| all as f64 / (self.uavs as f64 * flown_s)), most]
    }
}

/// True if any two agents disagree about the assignments.
fn assignments_differ(agents: &PerAgentTables) -> bool {
    agents.all.windows(2).any(|two| !agents.assignments(two[0].agent).eq(agents.assignments(two[1].agent)))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::common::score_config;
    use crate::metric::accumulated;
    use crate::row_fixtures::{track_row, truth_row, uav_row};
    use standoff_record::{ByAgent, Frame, TeammateRow};

    /// An agent: its id, the groups of two UAVs, and the groups of two targets.
    pub(crate) type AgentAssignments = (u32, [Option<u64>; 2], [Option<u64>; 2]);
    pub(crate) type Agents = [AgentAssignments; 2];

    /// Frame at this time. The group numbers of an agent are one less than the group ids.
    pub(crate) fn frame(time_s: i64, agents: &[AgentAssignments]) -> Frame {
        let mut frame = Frame { time_us: time_s * 1_000_000, ..Frame::default() };
        frame.uavs.extend((0..2).map(uav_row));
        frame.truth.extend((0..2).map(|target| truth_row(target, 0.0, 0.0)));
        let number = |id: Option<u64>| id.map(|id| id as u32 - 1);
        for (agent, assigned_uavs, members) in agents {
            let (agent, committed_us) = (*agent, (time_s > 1).then_some((time_s - 2) * 1_000_000));
            let sent_bytes = 100 + 200 * u64::from(agent);
            let retransmission_limited = (time_s > 0).then_some(agent == 1 && time_s == 2);
            let row = AgentRow { agent, committed_us, sent_bytes, retransmission_limited, ..AgentRow::default() };
            frame.agents.all.push(row);
            frame.agents.teammates.extend((0..).zip(assigned_uavs).map(|(uav, group_id)| TeammateRow {
                agent,
                uav,
                group: number(*group_id),
                group_id: *group_id,
                ..TeammateRow::default()
            }));
            let tracks = (0..).zip(members).map(|(target, id)| track_row(target, number(*id)));
            frame.agents.tracks.extend(tracks.map(|row| ByAgent { agent, row }));
        }
        frame
    }

    pub(crate) const ALIKE: Agents =
        [(0, [Some(1), Some(2)], [Some(1), Some(2)]), (1, [Some(1), Some(2)], [Some(1), Some(2)])];
    /// Each agent believes that the other UAV has no assignment.
    pub(crate) const APART: Agents = [(0, [Some(1), None], [Some(1), None]), (1, [None, Some(2)], [None, Some(2)])];

    fn after(frames: impl IntoIterator<Item = Frame>) -> Agreement {
        accumulated(&score_config(), frames)
    }

    /// Four time steps with two agents, which disagree in two of them, and one with a single agent, which does not
    /// count.
    #[test]
    fn assignments_differ_if_any_two_agents_disagree() {
        let alone = &ALIKE[..1];
        let flown = [&ALIKE[..], &APART, alone, &APART, &ALIKE];
        let agreement = after((0..).zip(flown).map(|(time_s, agents)| frame(time_s, agents)));
        assert_eq!(agreement.differ.value(), Some(0.5));
        // Groups are compared by id, not by number. A UAV without an assignment equals a UAV that is not listed.
        let renamed = |group, group_id| {
            let mut frame = frame(0, &ALIKE);
            let row = frame.agents.teammates.last_mut().unwrap();
            (row.group, row.group_id) = (Some(group), Some(group_id));
            after([frame]).differ.value()
        };
        assert_eq!((renamed(1, 3), renamed(5, 2)), (Some(1.0), Some(0.0)));
        let mut unlisted = frame(0, &[(0, [Some(1), None], [None; 2]), (1, [Some(1), None], [None; 2])]);
        unlisted.agents.teammates.pop();
        assert_eq!(after([unlisted]).differ.value(), Some(0.0));
        assert_eq!(after([frame(0, &[]), frame(1, alone)]).differ.value(), None);
    }

    /// The agents disagree until 5 s.
    #[test]
    fn agreement_delay_starts_at_the_end_of_the_last_fault() {
        let agreement = after((0..10).map(|time_s| frame(time_s, if time_s <= 5 { &APART } else { &ALIKE })));
        let delays = [None, Some(2.0), Some(5.5), Some(9.0), Some(9.5)].map(|end_s| agreement.delay_s(end_s));
        assert_eq!(delays, [None, Some(3.0), Some(0.0), Some(0.0), None]);
        assert_eq!(after([frame(0, &[])]).delay_s(Some(0.0)), None);
        // An agent that starts at 3 s, for the first time or again, also ends a fault.
        for first in [&ALIKE[..1], &ALIKE] {
            let agents = |time_s| match time_s {
                0 => first,
                1 | 2 => &ALIKE[..1],
                3..=5 => &APART,
                _ => &ALIKE,
            };
            let agreement = after((0..10).map(|time_s| frame(time_s, agents(time_s))));
            let delays = [None, Some(2.0), Some(4.0)].map(|end_s| agreement.delay_s(end_s));
            assert_eq!(delays, [Some(2.0), Some(2.0), Some(1.0)]);
        }
    }

    /// Two time steps without a commit, then a delay of two seconds, and once of five. The second of two UAVs has an
    /// agent in four of five seconds and sends 300 bytes in each: 240 bytes/s; the first sends 100 bytes/s. Its
    /// retransmissions wait in one of the eight steps that state it.
    #[test]
    fn lag_and_bytes_are_reported_as_mean_and_maximum() {
        let mut flown: Vec<Frame> =
            (0..5).map(|time_s| frame(time_s, if time_s == 0 { &ALIKE[..1] } else { &ALIKE })).collect();
        flown[4].agents.all[1].committed_us = Some(-1_000_000);
        let agreement = after(flown);
        assert_eq!((agreement.lag_s.value(), agreement.lag_max_s), (Some(2.5), Some(5.0)));
        assert_eq!(agreement.bytes_per_s(1.0), [Some(170.0), Some(240.0)]);
        assert_eq!(agreement.retransmission_limited.value(), Some(0.125));
        assert_eq!(after([frame(0, &[])]).bytes_per_s(1.0), [None; 2]);
    }
}
