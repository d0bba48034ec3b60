//! States of the agents, in runs with one agent per UAV, encoded as differences from the main tables.
//!
//! The main tables contain the team state of the UAV of lowest id whose computer is on. For the other agents, only
//! differences are stored: an object that is missing in a table equals the object in the main table at that time step.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::iter;

use standoff_record::{ByAgent, Frame, PageColumns, TeammateRow};

use super::recorded::Recorded;
use super::table::{Table, single};

#[cfg(test)]
mod tests;

/// Number of rows of other agents' states after which a part is full.
const ROWS: usize = 200_000;

/// Columns of an agent, by UAV; missing while its computer is off. `lag_s`: age of the last committed time step.
/// `link_degraded`: 1 if its link is degraded. `limited`: 1 if retransmissions wait for their budget. `group`, `created_s`: assigned group and its creation time.
/// `assignments`: lowest UAV whose agent has the same assignments.
const AGENT: [&str; 6] = ["lag_s", "link_degraded", "limited", "group", "created_s", "assignments"];
/// Columns of a UAV in the state of an agent: index of its [`TeammateStatus`](standoff::TeammateStatus) or `NEVER_RECEIVED`, age of its newest
/// report, and assigned group with its creation time. A missing row means: live, with a report of this time step, and
/// assigned to the group that the UAV itself reports.
const TEAM: [&str; 4] = ["status", "age_s", "group", "created_s"];
/// First column of a track or group in the state of an agent, before those of the record: 1 if the agent has an object
/// that differs from the main table, 0 if it has no such object.
const PRESENT: &str = "present";
/// Status code of a UAV from which the agent has received no report.
const NEVER_RECEIVED: f64 = 4.0;

/// Teammates and assignments of all agents; they belong to the overview.
#[derive(Debug)]
pub(super) struct AssignmentTables {
    steps: usize,
    agents: Table,
    /// Teammates by agent.
    teams: BTreeMap<u32, Table>,
}

/// Tracks and groups of all agents except the first one, which a page requests separately when it shows them.
#[derive(Debug, Default)]
pub(super) struct TeamStates {
    pub(super) times_us: Vec<i64>,
    /// Tracks and groups by agent.
    of: BTreeMap<u32, (Table, Table)>,
}

impl AssignmentTables {
    pub(super) fn new() -> Self {
        Self { steps: 0, agents: Table::new("agents", AGENT.map(Cow::from)), teams: BTreeMap::new() }
    }

    /// Adds the next time step.
    pub(super) fn next_step(&mut self, frame: &Frame) {
        self.agents.next_step();
        self.teams.values_mut().for_each(Table::next_step);
        self.steps += 1;
        let agents = &frame.agents;
        let mut known: Vec<u32> = Vec::new();
        for row in &agents.all {
            let same = known
                .iter()
                .copied()
                .find(|other| agents.assignments(*other).eq(agents.assignments(row.agent)))
                .unwrap_or(row.agent);
            if same == row.agent {
                known.push(same);
            }
            let lag_s = row.committed_us.map(|committed_us| seconds(frame.time_us.saturating_sub(committed_us)));
            let [group, created_s] = assignment(agents.teammate(row.agent, row.agent));
            let (degraded, limited) = (f64::from(row.link_degraded), row.retransmission_limited.map(f64::from));
            self.agents.put(row.agent, [lag_s, Some(degraded), limited, group, created_s, Some(f64::from(same))]);
            self.team(frame, row.agent);
        }
    }

    fn team(&mut self, frame: &Frame, agent: u32) {
        let (agents, steps) = (&frame.agents, self.steps);
        let new = || Table::at(format!("team-{agent}"), TEAM.map(Cow::from), steps);
        let table = self.teams.entry(agent).or_insert_with(new);
        // Time of the agent's own clock.
        let now_us = agents.teammate(agent, agent).and_then(|row| row.last_report_us).unwrap_or(frame.time_us);
        for uav in &frame.uavs {
            let row = agents.teammate(agent, uav.uav);
            let [group, created_s] = assignment(row);
            let age_s =
                row.and_then(|row| row.last_report_us).map(|report_us| seconds(now_us.saturating_sub(report_us)));
            let status = row.and_then(|row| row.status).map_or(NEVER_RECEIVED, |status| f64::from(status as u8));
            let is_on = agents.all.binary_search_by_key(&uav.uav, |row| row.agent).is_ok();
            let own = assignment(agents.teammate(uav.uav, uav.uav));
            if !is_on || (status, age_s, [group, created_s]) != (0.0, Some(0.0), own) {
                table.put(uav.uav, [Some(status), age_s, group, created_s]);
            }
        }
    }

    pub(super) fn rows(&self) -> usize {
        self.agents.rows() + self.teams.values().map(Table::rows).sum::<usize>()
    }

    /// The tables that are not empty.
    pub(super) fn tables(&self) -> impl Iterator<Item = &Table> {
        [&self.agents].into_iter().chain(self.teams.values()).filter(|table| table.rows() > 0)
    }
}

impl TeamStates {
    /// Adds the next time step.
    pub(super) fn next_step(&mut self, frame: &Frame, recorded: &Recorded) {
        self.times_us.push(frame.time_us);
        let steps = self.times_us.len();
        for (tracks, groups) in self.of.values_mut() {
            tracks.next_step();
            groups.next_step();
        }
        let agents = &frame.agents;
        for row in agents.all.iter().skip(1) {
            let agent = row.agent;
            let (tracks, groups) = self.of.entry(agent).or_insert_with(|| {
                (empty("tracks", agent, &recorded.tracks, steps), empty("groups", agent, &recorded.groups, steps))
            });
            differences(tracks, &recorded.tracks, &frame.tracks, agents.tracks_of(agent), |row| row.target);
            differences(groups, &recorded.groups, &frame.groups, agents.groups_of(agent), |row| row.group);
        }
    }

    pub(super) fn is_full(&self) -> bool {
        self.of.values().map(|(tracks, groups)| tracks.rows() + groups.rows()).sum::<usize>() >= ROWS
    }

    pub(super) fn tables(&self) -> impl Iterator<Item = &Table> {
        self.of.values().flat_map(|(tracks, groups)| [tracks, groups]).filter(|table| table.rows() > 0)
    }
}

fn empty<R: Clone>(of: &str, agent: u32, columns: &PageColumns<R>, steps: usize) -> Table {
    Table::at(format!("{of}-{agent}"), iter::once(PRESENT.into()).chain(columns.names()), steps)
}

/// Stores the differences between the rows of an agent (`own`) and those of the main table (`shown`), including rows
/// that the agent lacks. Both lists are sorted by id.
fn differences<R: Clone>(
    table: &mut Table,
    columns: &PageColumns<R>,
    shown: &[R],
    own: &[ByAgent<R>],
    id: impl Fn(&R) -> u32,
) {
    let bits = |row| columns.values(Some(row)).map(|value| single(value).to_bits());
    for ByAgent { row, .. } in own {
        let same = shown.binary_search_by_key(&id(row), &id).ok().map(|place| &shown[place]);
        if same.is_none_or(|same| bits(same).ne(bits(row))) {
            table.put(id(row), iter::once(Some(1.0)).chain(columns.values(Some(row))));
        }
    }
    for lacking in shown.iter().filter(|one| own.binary_search_by_key(&id(one), |of| id(&of.row)).is_err()) {
        table.put(id(lacking), iter::once(Some(0.0)).chain(columns.values(None)));
    }
}

/// Assigned group and its creation time, s, which distinguishes groups with the same number. A group id starts with the
/// creation time.
fn assignment(row: Option<&TeammateRow>) -> [Option<f64>; 2] {
    let group = row.and_then(|row| Some((row.group?, row.group_id?)));
    [group.map(|(number, _)| f64::from(number)), group.map(|(_, id)| seconds((id >> 16) as i64))]
}

fn seconds(time_us: i64) -> f64 {
    time_us as f64 / 1e6
}
