//! One time step of a run as the record stores it: rows of plain numbers, SI units, world frame.
//!
//! Positions are metres east (`x`) and north (`y`); angles are radians, anticlockwise from east, in
//! (-pi, pi]. A value that does not exist (no group, no boresight yet) is `None`, never a NaN.

use serde::{Deserialize, Serialize};
use standoff::TeammateStatus;

/// Tables that a controller reports; tables that it does not report are not scored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReportedTables {
    /// True if it reports tracks of targets.
    pub tracks: bool,
    /// True if it reports groups, their orbits and the UAVs assigned to them.
    pub groups: bool,
    /// True if it reports events: handoffs, removals and others.
    pub events: bool,
}

impl ReportedTables {
    /// No table: only the positions of UAVs and the boresights of sensors are known.
    pub const NOTHING: Self = Self { tracks: false, groups: false, events: false };

    /// Returns whether every needed table is reported.
    pub(crate) fn has(self, needed: Self) -> bool {
        (self.tracks || !needed.tracks) && (self.groups || !needed.groups) && (self.events || !needed.events)
    }
}

impl Default for ReportedTables {
    /// All tables.
    fn default() -> Self {
        Self { tracks: true, groups: true, events: true }
    }
}

/// All rows of the record for one time step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Frame {
    /// Time since the start of the mission, microseconds.
    pub time_us: i64,
    /// One row per UAV, by ascending id.
    pub uavs: Vec<UavRow>,
    /// Ground truth: one row per target that exists at this time step, by ascending id. Only scores read it.
    pub truth: Vec<TruthRow>,
    /// Estimates: one row per live track, by ascending target id.
    pub tracks: Vec<TrackRow>,
    /// Groups and their orbits, by ascending id.
    pub groups: Vec<GroupRow>,
    /// Measurements of this time step, by UAV, then target.
    pub detections: Vec<DetectionRow>,
    /// Events of this time step.
    pub events: Vec<EventRow>,
    /// Aircraft outside the team, by ascending number.
    pub intruders: Vec<IntruderRow>,
    /// State of each agent; empty if one agent serves the whole team.
    pub agents: PerAgentTables,
}

/// State of each agent as rows of the record; an agent whose computer is off has no rows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PerAgentTables {
    /// One row per agent, by ascending UAV.
    pub all: Vec<AgentRow>,
    /// Tracks of each agent, by agent, then target.
    pub tracks: Vec<ByAgent<TrackRow>>,
    /// Groups of each agent and their orbits, by agent, then group.
    pub groups: Vec<ByAgent<GroupRow>>,
    /// Events that each agent publishes in this time step, by agent, in order.
    pub events: Vec<AgentEventRow>,
    /// Team of each agent, by agent, then UAV.
    pub teammates: Vec<TeammateRow>,
}

impl PerAgentTables {
    /// Assignments as an agent knows them: pairs of UAV and group id, by ascending UAV.
    pub fn assignments(&self, agent: u32) -> impl Iterator<Item = (u32, u64)> + Clone {
        self.teammates_of(agent).iter().filter_map(|row| row.group_id.map(|id| (row.uav, id)))
    }

    /// Tracks of an agent, by ascending target.
    pub fn tracks_of(&self, agent: u32) -> &[ByAgent<TrackRow>] {
        of(&self.tracks, agent, |of| of.agent)
    }

    /// Groups of an agent, ascending.
    pub fn groups_of(&self, agent: u32) -> &[ByAgent<GroupRow>] {
        of(&self.groups, agent, |of| of.agent)
    }

    /// Team of an agent, by ascending UAV.
    pub fn teammates_of(&self, agent: u32) -> &[TeammateRow] {
        of(&self.teammates, agent, |row| row.agent)
    }

    /// Row of a UAV in the team of an agent; `None` if the agent knows nothing of the UAV.
    pub fn teammate(&self, agent: u32, uav: u32) -> Option<&TeammateRow> {
        let index = self.teammates.binary_search_by_key(&(agent, uav), |row| (row.agent, row.uav)).ok()?;
        Some(&self.teammates[index])
    }

    /// Empties all tables and keeps their buffers.
    pub(crate) fn clear(&mut self) {
        let Self { all, tracks, groups, events, teammates: team } = self;
        all.clear();
        tracks.clear();
        groups.clear();
        events.clear();
        team.clear();
    }

    /// Sorts the rows that a controller wrote, and removes those that are duplicate or not finite: scores and records
    /// rely on this.
    pub(crate) fn tidy(&mut self) {
        let Self { all, tracks, groups, events, teammates: team } = self;
        tracks.retain(|of| of.row.is_finite());
        groups.retain(|of| of.row.is_finite());
        put_in_order(all, |row| row.agent);
        put_in_order(tracks, |of| (of.agent, of.row.target));
        put_in_order(groups, |of| (of.agent, of.row.group));
        put_in_order(team, |row| (row.agent, row.uav));
        events.sort_by_key(|row| row.agent);
    }
}

/// Returns the rows with a key, in a table sorted by that key.
pub(crate) fn of<R, K: Ord>(rows: &[R], key: K, by: impl Fn(&R) -> K) -> &[R] {
    let start = rows.partition_point(|row| by(row) < key);
    let length = rows[start..].partition_point(|row| by(row) == key);
    &rows[start..start + length]
}

/// Sorts rows and keeps the first row of each key. Most tables are sorted already and need no copy.
fn put_in_order<R, K: Ord>(rows: &mut Vec<R>, key: impl Fn(&R) -> K) {
    if !rows.is_sorted_by(|one, next| key(one) < key(next)) {
        rows.sort_by_key(&key);
        rows.dedup_by_key(|row| key(row));
    }
}

/// A row of the state of one agent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ByAgent<R> {
    /// UAV of the agent.
    pub agent: u32,
    /// The row.
    pub row: R,
}

/// An agent, if each UAV has its own.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AgentRow {
    /// UAV of the agent.
    pub agent: u32,
    /// Time up to which the agent's state is final, by its clock, microseconds; `None` before the first commit.
    pub committed_us: Option<i64>,
    /// True if messages have been missing recently: groups and assignments are then those of an earlier time step.
    pub link_degraded: bool,
    /// Number of messages that its UAV has sent in this time step.
    pub sent_messages: u64,
    /// Total size of these messages, bytes.
    pub sent_bytes: u64,
    /// True if its last committed state has more information than follows from the messages, each counted once; `None`
    /// if this was not checked.
    pub double_counted: Option<bool>,
}

/// State of a UAV of the team as one agent knows it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TeammateRow {
    /// UAV of the agent.
    pub agent: u32,
    /// UAV id.
    pub uav: u32,
    /// Status of the UAV; `None` if it was never received but is assigned to a group.
    pub status: Option<TeammateStatus>,
    /// Time of the newest report of the UAV that the agent has received or knows to exist, by the agent's clock,
    /// microseconds.
    pub last_report_us: Option<i64>,
    /// Number of the group to which the UAV is assigned.
    pub group: Option<u32>,
    /// Id of that group, the same for all agents.
    pub group_id: Option<u64>,
}

/// An event that one agent publishes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AgentEventRow {
    /// UAV of the agent.
    pub agent: u32,
    /// Time of the event by the agent's clock, microseconds.
    pub event_time_us: i64,
    /// True if a later message can still change it.
    pub provisional: bool,
    /// The event.
    pub event: EventRow,
}

/// State and intentions of a team as rows of the record. Of several rows of one target or one group, the first counts;
/// rows with a number that is not finite are left out.
#[derive(Debug)]
pub struct ReportedState<'a> {
    /// Tracks, by ascending target, which is the label that sensors report.
    pub tracks: &'a mut Vec<TrackRow>,
    /// Groups, by ascending group. A UAV is assigned to the group that its step's diagnostics name.
    pub groups: &'a mut Vec<GroupRow>,
    /// Events, in order.
    pub events: &'a mut Vec<EventRow>,
}

impl ReportedState<'_> {
    /// Sorts the rows of a third-party controller, and removes those that are duplicate or not finite: scores and
    /// records rely on this.
    pub(crate) fn tidy(&mut self) {
        self.tracks.retain(TrackRow::is_finite);
        put_in_order(self.tracks, |row| row.target);
        self.groups.retain(GroupRow::is_finite);
        put_in_order(self.groups, |row| row.group);
    }
}

/// A UAV: its true state at the time of the scan, and the command that followed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct UavRow {
    /// UAV id.
    pub uav: u32,
    /// Group to which it is assigned.
    pub group: Option<u32>,
    /// East, m.
    pub x_m: f64,
    /// North, m.
    pub y_m: f64,
    /// Heading, rad.
    pub heading_rad: f64,
    /// Speed, m/s.
    pub speed_m_s: f64,
    /// Turn rate, rad/s.
    pub turn_rate_rad_s: f64,
    /// Direction in which the sensor pointed during the scan, rad.
    pub boresight_rad: Option<f64>,
    /// Speed commanded, within limits, m/s.
    pub speed_command_m_s: f64,
    /// Turn rate commanded, within limits, rad/s.
    pub turn_rate_command_rad_s: f64,
    /// True if the commanded speed change was limited.
    pub speed_limited: bool,
    /// True if the commanded turn rate was limited.
    pub turn_rate_limited: bool,
    /// Distance from the UAV to the estimated group centre, r, m.
    pub centre_distance_m: Option<f64>,
    /// Phase on the orbit: direction from the estimated group centre to the UAV, rad.
    pub phase_rad: Option<f64>,
    /// Radius steered for after active measure 2 (22), m.
    pub steered_radius_m: Option<f64>,
    /// Desired heading (23), rad.
    pub desired_heading_rad: Option<f64>,
    /// Feedforward turn rate (25), rad/s.
    pub feedforward_rad_s: Option<f64>,
    /// Lemma 3.1's threshold, m2/s; negative: convergence is not guaranteed.
    pub convergence_threshold_m2_s: Option<f64>,
    /// True if the group's centre is too fast for the desired field (29).
    pub centre_too_fast: bool,
    /// Commanded altitude above the plane, m.
    pub commanded_altitude_m: Option<f64>,
    /// Current altitude, m; `None` if altitudes are not simulated.
    pub altitude_m: Option<f64>,
    /// Rate of climb, m/s, positive upward.
    pub climb_rate_m_s: Option<f64>,
    /// UAV that it avoids by leaving its orbit command.
    pub avoided_uav: Option<u32>,
    /// Intruder that it avoids.
    pub avoided_intruder: Option<u32>,
    /// Predicted distance to the avoided aircraft without the evasive command, m.
    pub predicted_distance_m: Option<f64>,
    /// Zone because of which it changes its command, counted from 0.
    pub limiting_zone: Option<u32>,
}

/// True state of an aircraft outside the team.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct IntruderRow {
    /// Number of the intruder.
    pub intruder: u32,
    /// East, m.
    pub x_m: f64,
    /// North, m.
    pub y_m: f64,
    /// Heading, rad.
    pub heading_rad: f64,
    /// Speed, m/s.
    pub speed_m_s: f64,
    /// Altitude above the plane, m; `None` if altitudes are not simulated.
    pub altitude_m: Option<f64>,
    /// True if it broadcast its position in this time step.
    pub transponder_on: bool,
}

/// True state of a target.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TruthRow {
    /// Target id.
    pub target: u32,
    /// East, m.
    pub x_m: f64,
    /// North, m.
    pub y_m: f64,
    /// Velocity east, m/s.
    pub vx_m_s: f64,
    /// Velocity north, m/s.
    pub vy_m_s: f64,
    /// Acceleration east, m/s2; `None` if unknown.
    pub ax_m_s2: Option<f64>,
    /// Acceleration north, m/s2; `None` if unknown.
    pub ay_m_s2: Option<f64>,
}

/// Status of a track.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum TrackStatus {
    /// Reported by a cue source, not measured yet.
    #[default]
    Cued,
    /// Measured in this time step.
    Updated,
    /// Predicted: measured before, but not in this time step.
    Coasting,
}

/// Group membership of a target.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum MembershipState {
    /// In no group: new, or no UAV can cover it.
    #[default]
    Ungrouped,
    /// Member of a group.
    Member,
    /// In transition to a group whose orbit is adapting to it; until then it belongs to its old group, if it has one.
    InHandoff,
    /// Removed from its group, still predicted.
    Removed,
}

/// A track: the fused estimate of one target.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TrackRow {
    /// Id of the true target.
    pub target: u32,
    /// The team's id of the track.
    pub track: u32,
    /// Status of a track.
    pub status: TrackStatus,
    /// Group membership.
    pub membership: MembershipState,
    /// Group of the target; during a handoff, the passing group, whose UAVs still keep it in view.
    pub group: Option<u32>,
    /// In dwell, the receiving group.
    pub receiving_group: Option<u32>,
    /// `[x, vx, ax, y, vy, ay]` in m, m/s, m/s2.
    pub state: [f64; 6],
    /// Upper triangle of the covariance of `state`, row by row (21 numbers).
    pub covariance: [f64; 21],
}

impl TrackRow {
    /// Returns whether all numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.state.iter().chain(&self.covariance).all(|number| number.is_finite())
    }
}

/// A group and its orbit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GroupRow {
    /// Group id.
    pub group: u32,
    /// Number of members, including those in dwell to or from it.
    pub members: u32,
    /// Estimated centre east, m.
    pub x_m: f64,
    /// Estimated centre north, m.
    pub y_m: f64,
    /// Estimated centre's velocity east, m/s.
    pub vx_m_s: f64,
    /// Estimated centre's velocity north, m/s.
    pub vy_m_s: f64,
    /// Spread d_max: distance from the centre to the furthest member, m.
    pub spread_m: f64,
    /// Margin d_m added to the spread, m.
    pub margin_m: f64,
    /// Standoff distance (15) before the clamp, m.
    pub standoff_unclamped_m: f64,
    /// Standoff distance r_d: (15) clamped to its bounds, m.
    pub standoff_distance_m: f64,
    /// Rate of r_d, m/s.
    pub standoff_rate_m_s: f64,
    /// Smallest radius at which the UAVs can turn about this centre (27 and the moving-centre limit), m;
    /// `None`: the centre is as fast as the UAVs.
    pub turn_limit_m: Option<f64>,
    /// True if some orbit satisfies every constraint.
    pub feasible: bool,
    /// Threshold of Lemma 3.1 at nominal speed, of the group's UAV that follows best, m2/s. The removal by convergence
    /// uses it. `None` if the group has no UAV or its centre is too fast.
    pub convergence_threshold_m2_s: Option<f64>,
    /// Altitude of the group's orbit, above the plane, m.
    pub altitude_m: f64,
    /// Smallest distance between two of its UAVs, m.
    pub nearest_groupmate_m: Option<f64>,
    /// Id of the group, the same for all agents, below 2^63; `group` is its number within one team state.
    pub group_uid: Option<u64>,
}

impl GroupRow {
    /// Returns whether all numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        let always = [
            self.x_m,
            self.y_m,
            self.vx_m_s,
            self.vy_m_s,
            self.spread_m,
            self.margin_m,
            self.standoff_unclamped_m,
            self.standoff_distance_m,
            self.standoff_rate_m_s,
            self.altitude_m,
        ];
        let where_known = [self.turn_limit_m, self.convergence_threshold_m2_s, self.nearest_groupmate_m];
        always.into_iter().chain(where_known.into_iter().flatten()).all(f64::is_finite)
    }
}

/// A measurement (7).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DetectionRow {
    /// UAV that measured.
    pub uav: u32,
    /// Target measured.
    pub target: u32,
    /// Range, m.
    pub range_m: f64,
    /// Bearing from the UAV to the target, rad.
    pub bearing_rad: f64,
}

/// A true target in view of a UAV: within half the field of view of the boresight and within sensing range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewRow {
    /// UAV whose sensor is pointed.
    pub uav: u32,
    /// Target in view.
    pub target: u32,
    /// True range, m.
    pub range_m: f64,
    /// Off-boresight angle of the target, rad, anticlockwise positive, in (-pi, pi].
    pub off_boresight_rad: f64,
}

/// An event. Columns that its kind does not use are `None`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EventRow {
    /// Kind of the event, in kebab-case: `cued`, `lost`, `reacquired`, ...
    pub kind: String,
    /// Target concerned.
    pub target: Option<u32>,
    /// Group concerned; of a handoff or a reassignment, the old group.
    pub group: Option<u32>,
    /// New group of a handoff or a reassignment.
    pub to_group: Option<u32>,
    /// UAVs concerned.
    pub uavs: Vec<u32>,
    /// Reason as text, as written with the event; [`EventRow::reason_text`] derives it from the columns below.
    pub reason: String,
    /// The team's id of the target's track.
    pub track: Option<u32>,
    /// Cause in kebab-case, for kinds with several causes: `too-uncertain`, `not-in-view`, ...
    pub cause: Option<String>,
    /// Group into which it was merged.
    pub into_group: Option<u32>,
    /// Number of targets of a new group.
    pub members: Option<u32>,
    /// Number of targets that can be covered together instead.
    pub coverable_targets: Option<u32>,
    /// Time in both groups, T_hd, s.
    pub dwell_s: Option<f64>,
    /// Standoff distance needed, m.
    pub required_radius_m: Option<f64>,
    /// Largest standoff distance allowed, m.
    pub allowed_radius_m: Option<f64>,
    /// Lemma 3.1's threshold for the UAV that follows best, m2/s.
    pub threshold_m2_s: Option<f64>,
    /// Lower limit of this threshold, m2/s.
    pub limit_m2_s: Option<f64>,
    /// Speed of the target, m/s.
    pub speed_m_s: Option<f64>,
    /// Largest speed of the UAVs, m/s.
    pub limit_m_s: Option<f64>,
    /// Distance between two UAVs, m.
    pub distance_m: Option<f64>,
    /// Id of `group`, the same for all agents, below 2^63.
    pub group_id: Option<u64>,
    /// Id of `to_group`.
    pub to_group_id: Option<u64>,
    /// Share of the group's orbit outside all blocked zones, 0 to 1.
    pub clear_fraction: Option<f64>,
    /// Zone that blocks the rest, counted from 0.
    pub zone: Option<u32>,
    /// Intruder concerned.
    pub intruder: Option<u32>,
}
