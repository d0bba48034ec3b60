//! How well several minds agree, and what that costs them.

use std::collections::BTreeMap;

use super::mean::Mean;
use crate::frame::{AgentRow, Agents, Frame, of};

/// Over the instants so far; of one mind for all there is nothing.
#[derive(Debug, Clone, Default)]
pub(super) struct Agreement {
    /// Instants at which crews differ, of those at which two minds or more are there.
    pub(super) differ: Mean,
    last_differing_us: Option<i64>,
    last_us: i64,
    /// Who is there, ascending, and when somebody last came who was not there before.
    there: Vec<u32>,
    joined_us: Option<i64>,
    /// From what is committed to now, s.
    pub(super) lag_s: Mean,
    pub(super) lag_max_s: Option<f64>,
    /// By UAV, of all instants.
    sent_bytes: BTreeMap<u32, u64>,
    instants: u64,
    uavs: usize,
    /// Targets that are under two crewed groups at once, of those that exist.
    pub(super) double_served: Mean,
    /// Instants of minds that counted something twice; `None`: nobody has looked.
    pub(super) double_count: Option<u64>,
    /// Targets, and the group by whose UAV each is served: room that lives on.
    served: Vec<(u32, u64)>,
}

impl Agreement {
    /// Takes in the next frame.
    pub(super) fn frame(&mut self, frame: &Frame) {
        let Frame { time_us, agents, .. } = frame;
        self.instants += 1;
        self.uavs = self.uavs.max(frame.uavs.len());
        self.last_us = *time_us;
        let is_new = |row: &AgentRow| self.there.binary_search(&row.agent).is_err();
        if self.instants > 1 && agents.all.iter().any(is_new) {
            self.joined_us = Some(*time_us);
        }
        self.there.clear();
        self.there.extend(agents.all.iter().map(|row| row.agent));
        if agents.all.is_empty() {
            return;
        }
        if agents.all.len() > 1 {
            let differ = crews_differ(agents);
            self.differ.add(f64::from(differ));
            self.last_differing_us = if differ { Some(*time_us) } else { self.last_differing_us };
        }
        for AgentRow { agent, committed_us, sent_bytes, double_counted, .. } in &agents.all {
            *self.sent_bytes.entry(*agent).or_default() += sent_bytes;
            if let Some(double_counted) = double_counted {
                *self.double_count.get_or_insert(0) += u64::from(*double_counted);
            }
            if let Some(committed_us) = committed_us {
                let lag_s = time_us.saturating_sub(*committed_us) as f64 / 1e6;
                self.lag_s.add(lag_s);
                self.lag_max_s = Some(self.lag_max_s.map_or(lag_s, |most_s| most_s.max(lag_s)));
            }
        }
        self.double_service(frame);
    }

    /// A target counts as served by a group if a UAV believes that it is in its own group, which is what it flies.
    fn double_service(&mut self, frame: &Frame) {
        let agents = &frame.agents;
        self.served.clear();
        for AgentRow { agent, .. } in &agents.all {
            let duty = agents.mate(*agent, *agent).and_then(|own| own.group.zip(own.group_id));
            let Some((group, id)) = duty else { continue };
            let members = agents.tracks_of(*agent).iter().filter(|of| of.row.group == Some(group));
            self.served.extend(members.map(|of| (of.row.target, id)));
        }
        self.served.sort_unstable();
        self.served.dedup();
        for truth in &frame.truth {
            self.double_served.add(f64::from(of(&self.served, truth.target, |(target, _)| *target).len() > 1));
        }
    }

    /// From the end of the last fault to the last instant after it at which crews differ, s; 0 if there is none. `None` if no
    /// fault has ended: those of the rules, or of a computer that was off.
    pub(super) fn delay_s(&self, faults_end_s: Option<f64>) -> Option<f64> {
        let seconds = |time_us: i64| time_us as f64 / 1e6;
        let ended_s = faults_end_s.filter(|end_s| *end_s <= seconds(self.last_us));
        let end_s =
            ended_s.into_iter().chain(self.joined_us.map(seconds)).reduce(f64::max).filter(|_| self.differ.n > 0)?;
        Some(self.last_differing_us.map_or(0.0, |last_us| (seconds(last_us) - end_s).max(0.0)))
    }

    /// What a UAV sends, mean and largest of all, bytes/s.
    pub(super) fn bytes_per_s(&self, period_s: f64) -> [Option<f64>; 2] {
        let flown_s = self.instants as f64 * period_s;
        let most = self.sent_bytes.values().max().map(|bytes| *bytes as f64 / flown_s);
        let all: u64 = self.sent_bytes.values().sum();
        [most.map(|_| all as f64 / (self.uavs as f64 * flown_s)), most]
    }
}

/// Any two minds differ in who serves which group.
fn crews_differ(agents: &Agents) -> bool {
    agents.all.windows(2).any(|two| !agents.crew(two[0].agent).eq(agents.crew(two[1].agent)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{OfAgent, TeamRow};
    use crate::score::fixtures::{track_row, truth_row, uav_row};

    /// A mind: whose, which group each of two UAVs serves, and in which group each of two targets is.
    type Mind = (u32, [Option<u64>; 2], [Option<u64>; 2]);
    type Minds = [Mind; 2];

    /// So many seconds after the start. A group's number in a picture is one less than its id.
    fn frame(time_s: i64, minds: &[Mind]) -> Frame {
        let mut frame = Frame { time_us: time_s * 1_000_000, ..Frame::default() };
        frame.uavs.extend((0..2).map(uav_row));
        frame.truth.extend((0..2).map(|target| truth_row(target, 0.0, 0.0)));
        let number = |id: Option<u64>| id.map(|id| id as u32 - 1);
        for (agent, crew, members) in minds {
            let (agent, committed_us) = (*agent, (time_s > 1).then_some((time_s - 2) * 1_000_000));
            let sent_bytes = 100 + 200 * u64::from(agent);
            let double_counted = (agent == 0).then_some(time_s == 3);
            frame.agents.all.push(AgentRow {
                agent,
                committed_us,
                disturbed: false,
                sent_messages: 1,
                sent_bytes,
                double_counted,
            });
            frame.agents.team.extend((0..).zip(crew).map(|(uav, group_id)| {
                let group = number(*group_id);
                TeamRow { agent, uav, presence: None, heard_us: None, group, group_id: *group_id }
            }));
            let tracks = (0..).zip(members).map(|(target, id)| track_row(target, number(*id)));
            frame.agents.tracks.extend(tracks.map(|row| OfAgent { agent, row }));
        }
        frame
    }

    fn after(frames: impl IntoIterator<Item = Frame>) -> Agreement {
        let mut agreement = Agreement::default();
        frames.into_iter().for_each(|frame| agreement.frame(&frame));
        agreement
    }

    const ALIKE: Minds = [(0, [Some(1), Some(2)], [Some(1), Some(2)]), (1, [Some(1), Some(2)], [Some(1), Some(2)])];
    /// Each believes that the other serves nothing.
    const APART: Minds = [(0, [Some(1), None], [Some(1), None]), (1, [None, Some(2)], [None, Some(2)])];

    /// Four instants with two minds, of which they differ at two, and one with one mind, which counts for neither.
    #[test]
    fn crews_differ_where_any_two_minds_say_so() {
        let alone = &ALIKE[..1];
        let flown = [&ALIKE[..], &APART, alone, &APART, &ALIKE];
        let agreement = after((0..).zip(flown).map(|(time_s, minds)| frame(time_s, minds)));
        assert_eq!(agreement.differ.value(), Some(0.5));
        // Another id is another group, whatever its number; who serves none is as good as one not told of.
        let renamed = |group, group_id| {
            let mut frame = frame(0, &ALIKE);
            let row = frame.agents.team.last_mut().unwrap();
            (row.group, row.group_id) = (Some(group), Some(group_id));
            after([frame]).differ.value()
        };
        assert_eq!((renamed(1, 3), renamed(5, 2)), (Some(1.0), Some(0.0)));
        let mut told = frame(0, &[(0, [Some(1), None], [None; 2]), (1, [Some(1), None], [None; 2])]);
        told.agents.team.pop();
        assert_eq!(after([told]).differ.value(), Some(0.0));
        assert_eq!(after([frame(0, &[]), frame(1, alone)]).differ.value(), None);
    }

    /// They differ up to 5 s.
    #[test]
    fn agreement_comes_so_long_after_the_last_fault() {
        let agreement = after((0..10).map(|time_s| frame(time_s, if time_s <= 5 { &APART } else { &ALIKE })));
        let delays = [None, Some(2.0), Some(5.5), Some(9.0), Some(9.5)].map(|end_s| agreement.delay_s(end_s));
        assert_eq!(delays, [None, Some(3.0), Some(0.0), Some(0.0), None]);
        assert_eq!(after([frame(0, &[])]).delay_s(Some(0.0)), None);
        // A mind that comes at 3 s, for the first time or again, ends a fault, too.
        for first in [&ALIKE[..1], &ALIKE] {
            let minds = |time_s| match time_s {
                0 => first,
                1 | 2 => &ALIKE[..1],
                3..=5 => &APART,
                _ => &ALIKE,
            };
            let agreement = after((0..10).map(|time_s| frame(time_s, minds(time_s))));
            let delays = [None, Some(2.0), Some(4.0)].map(|end_s| agreement.delay_s(end_s));
            assert_eq!(delays, [Some(2.0), Some(2.0), Some(1.0)]);
        }
    }

    /// The second target is in the groups of both UAVs, by what each believes of itself; the first in one, which both tell.
    #[test]
    fn a_target_is_doubly_served_where_two_uavs_fly_different_groups_with_it() {
        let share = |minds: Minds| after([frame(0, &minds)]).double_served.value();
        let twice = [(0, [Some(1), Some(2)], [Some(1), Some(1)]), (1, [Some(1), Some(2)], [Some(1), Some(2)])];
        assert_eq!(share(twice), Some(0.5));
        assert_eq!((share(ALIKE), share(APART)), (Some(0.0), Some(0.0)));
        // Who serves one group with the other, or none, does not serve it twice.
        let together = [(0, [Some(1), Some(1)], [Some(1), Some(1)]), (1, [Some(1), Some(1)], [Some(1), Some(1)])];
        let idle = [(0, [Some(1), Some(2)], [Some(1), Some(1)]), (1, [Some(1), None], [Some(1), Some(2)])];
        assert_eq!((share(together), share(idle)), (Some(0.0), Some(0.0)));
        assert_eq!(after([frame(0, &[])]).double_served.value(), None);
    }

    #[test]
    fn what_was_counted_twice_is_counted_where_somebody_looked() {
        let count = |until_s| after((0..until_s).map(|time_s| frame(time_s, &ALIKE))).double_count;
        assert_eq!([0, 3, 5].map(count), [None, Some(0), Some(1)]);
        assert_eq!(after([frame(3, &ALIKE[1..])]).double_count, None);
    }

    /// Two instants without anything committed, then two seconds of lag, and five once. Of two UAVs the second has a mind for
    /// four of five seconds, and sends 300 bytes in each: 240 bytes/s, the first 100.
    #[test]
    fn lag_and_bytes_are_told_as_mean_and_at_worst() {
        let mut flown: Vec<Frame> =
            (0..5).map(|time_s| frame(time_s, if time_s == 0 { &ALIKE[..1] } else { &ALIKE })).collect();
        flown[4].agents.all[1].committed_us = Some(-1_000_000);
        let agreement = after(flown);
        assert_eq!((agreement.lag_s.value(), agreement.lag_max_s), (Some(2.5), Some(5.0)));
        assert_eq!(agreement.bytes_per_s(1.0), [Some(170.0), Some(240.0)]);
        assert_eq!(after([frame(0, &[])]).bytes_per_s(1.0), [None; 2]);
    }
}
