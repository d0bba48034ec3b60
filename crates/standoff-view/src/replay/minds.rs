//! What each of several minds believes, as far as it differs from what is told anyway.
//!
//! The run's own tables hold the picture of the UAV of lowest id whose computer is on. Of the other minds only differences
//! are told: what a table does not hold of an object is as in the run's own picture, at that instant.

use std::collections::BTreeMap;

use standoff::Presence;
use standoff_sim::record::{Frame, GroupRow, OfAgent, TeamRow, TrackRow};

use super::table::{Table, place_code, single, status_code};

#[cfg(test)]
mod tests;

/// Rows of other pictures after which a part is full.
const ROWS: usize = 200_000;

/// A mind, by UAV; not there while its computer is off. Seconds from what is certain to now; the group that it serves, and
/// when that was founded; and `crew`, the lowest UAV by whose mind the same UAVs serve the same groups.
const MIND: [&str; 5] = ["lag_s", "disturbed", "group", "founded_s", "crew"];
/// What a mind believes of a UAV: who it takes it for ([`Presence`], or `NEVER_HEARD`), how old its newest report is, and
/// the group that it serves. Not there: live, heard of this instant, and serving what it says itself.
const TEAM: [&str; 4] = ["presence", "age_s", "group", "founded_s"];
/// A track or a group of a mind: `own` is 1 where it has one of its own, and 0 where it has none.
const TRACK: [&str; 12] =
    ["own", "x_m", "y_m", "vx_m_s", "vy_m_s", "cov_x_x", "cov_x_y", "cov_y_y", "status", "place", "group", "to_group"];
const GROUP: [&str; 9] =
    ["own", "x_m", "y_m", "members", "spread_m", "margin_m", "standoff_distance_m", "feasible", "separation_m"];
const NEVER_HEARD: f64 = 4.0;

/// Who is there and who serves what, of all minds: a part of the overview.
#[derive(Debug)]
pub(super) struct Crews {
    instants: usize,
    minds: Table,
    /// By mind.
    teams: BTreeMap<u32, Table>,
}

/// The tracks and groups of all minds but the first: a half of a part that is asked for if somebody wants to see them.
#[derive(Debug, Default)]
pub(super) struct Pictures {
    pub(super) times_us: Vec<i64>,
    /// By mind: tracks, and groups.
    of: BTreeMap<u32, (Table, Table)>,
}

impl Crews {
    pub(super) fn new() -> Self {
        Self { instants: 0, minds: Table::new("minds", &MIND), teams: BTreeMap::new() }
    }

    /// Takes in the next instant.
    pub(super) fn next_instant(&mut self, frame: &Frame) {
        self.minds.next_instant();
        self.teams.values_mut().for_each(Table::next_instant);
        self.instants += 1;
        let agents = &frame.agents;
        let mut known: Vec<u32> = Vec::new();
        for mind in &agents.all {
            let crew = known
                .iter()
                .copied()
                .find(|other| agents.crew(*other).eq(agents.crew(mind.agent)))
                .unwrap_or(mind.agent);
            if crew == mind.agent {
                known.push(crew);
            }
            let lag_s = mind.committed_us.map(|committed_us| seconds(frame.time_us.saturating_sub(committed_us)));
            let [group, founded_s] = duty(agents.mate(mind.agent, mind.agent));
            self.minds
                .put(mind.agent, &[lag_s, Some(f64::from(mind.disturbed)), group, founded_s, Some(f64::from(crew))]);
            self.team(frame, mind.agent);
        }
    }

    fn team(&mut self, frame: &Frame, agent: u32) {
        let (agents, instants) = (&frame.agents, self.instants);
        let table = self.teams.entry(agent).or_insert_with(|| Table::at(format!("team-{agent}"), &TEAM, instants));
        // By its own clock.
        let now_us = agents.mate(agent, agent).and_then(|row| row.heard_us).unwrap_or(frame.time_us);
        for uav in &frame.uavs {
            let row = agents.mate(agent, uav.uav);
            let [group, founded_s] = duty(row);
            let age_s = row.and_then(|row| row.heard_us).map(|heard_us| seconds(now_us.saturating_sub(heard_us)));
            let presence = match row.and_then(|row| row.presence) {
                Some(Presence::Live) => 0.0,
                Some(Presence::Silent) => 1.0,
                Some(Presence::Gone) => 2.0,
                Some(Presence::Left) => 3.0,
                None => NEVER_HEARD,
            };
            let is_on = agents.all.binary_search_by_key(&uav.uav, |mind| mind.agent).is_ok();
            let own = duty(agents.mate(uav.uav, uav.uav));
            if !is_on || (presence, age_s, [group, founded_s]) != (0.0, Some(0.0), own) {
                table.put(uav.uav, &[Some(presence), age_s, group, founded_s]);
            }
        }
    }

    pub(super) fn rows(&self) -> usize {
        self.minds.rows() + self.teams.values().map(Table::rows).sum::<usize>()
    }

    /// The tables that hold something.
    pub(super) fn tables(&self) -> impl Iterator<Item = &Table> {
        [&self.minds].into_iter().chain(self.teams.values()).filter(|table| table.rows() > 0)
    }
}

impl Pictures {
    /// Takes in the next instant.
    pub(super) fn next_instant(&mut self, frame: &Frame) {
        self.times_us.push(frame.time_us);
        let instants = self.times_us.len();
        for (tracks, groups) in self.of.values_mut() {
            tracks.next_instant();
            groups.next_instant();
        }
        let agents = &frame.agents;
        for mind in agents.all.iter().skip(1) {
            let agent = mind.agent;
            let (tracks, groups) = self.of.entry(agent).or_insert_with(|| {
                let table = |of, columns| Table::at(format!("{of}-{agent}"), columns, instants);
                (table("tracks", &TRACK), table("groups", &GROUP))
            });
            differences(tracks, &frame.tracks, agents.tracks_of(agent), |row| row.target, track);
            differences(groups, &frame.groups, agents.groups_of(agent), |row| row.group, group);
        }
    }

    pub(super) fn is_full(&self) -> bool {
        self.of.values().map(|(tracks, groups)| tracks.rows() + groups.rows()).sum::<usize>() >= ROWS
    }

    pub(super) fn tables(&self) -> impl Iterator<Item = &Table> {
        self.of.values().flat_map(|(tracks, groups)| [tracks, groups]).filter(|table| table.rows() > 0)
    }
}

/// Puts what a mind has otherwise than the run's own picture, both by ascending id: what it lacks, too.
fn differences<R: Copy, const N: usize>(
    table: &mut Table,
    shown: &[R],
    own: &[OfAgent<R>],
    id: impl Fn(&R) -> u32,
    row: impl Fn(&R) -> [Option<f64>; N],
) {
    let bits = |row: [Option<f64>; N]| row.map(|value| single(value).to_bits());
    for of in own {
        let same = shown.binary_search_by_key(&id(&of.row), &id).ok().map(|place| row(&shown[place]));
        let own = row(&of.row);
        if same.is_none_or(|same| bits(same) != bits(own)) {
            table.put(id(&of.row), &own);
        }
    }
    for lacking in shown.iter().filter(|one| own.binary_search_by_key(&id(one), |of| id(&of.row)).is_err()) {
        let mut none = [None; N];
        none[0] = Some(0.0);
        table.put(id(lacking), &none);
    }
}

fn track(row: &TrackRow) -> [Option<f64>; TRACK.len()] {
    let ([x, vx, _, y, vy, _], covariance) = (row.state, &row.covariance);
    let numbers = [1.0, x, y, vx, vy, covariance[0], covariance[3], covariance[15]];
    let [own, x, y, vx, vy, x_x, x_y, y_y] = numbers.map(Some);
    let [group, to_group] = [row.group, row.to_group].map(|group| group.map(f64::from));
    let [status, place] = [status_code(row.status), place_code(row.place)].map(Some);
    [own, x, y, vx, vy, x_x, x_y, y_y, status, place, group, to_group]
}

fn group(row: &GroupRow) -> [Option<f64>; GROUP.len()] {
    let numbers = [row.x_m, row.y_m, f64::from(row.members), row.spread_m, row.margin_m, row.standoff_distance_m];
    let [x, y, members, spread, margin, distance] = numbers.map(Some);
    [Some(1.0), x, y, members, spread, margin, distance, Some(f64::from(row.feasible)), row.separation_m]
}

/// The group that is served, and when it was founded, which tells two of one number apart: an id begins with it.
fn duty(row: Option<&TeamRow>) -> [Option<f64>; 2] {
    let group = row.and_then(|row| Some((row.group?, row.group_id?)));
    [group.map(|(number, _)| f64::from(number)), group.map(|(_, id)| seconds((id >> 16) as i64))]
}

fn seconds(time_us: i64) -> f64 {
    time_us as f64 / 1e6
}
