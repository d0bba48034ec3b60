//! One time step of a run as the record stores it: rows of plain numbers, SI units, world frame.
//!
//! Positions are metres east (`x`) and north (`y`); angles are radians, anticlockwise from east, in
//! (-pi, pi]. A value that does not exist (no group, no boresight yet) is `None`, never a NaN; a column stores null.

use serde::{Deserialize, Serialize};
use standoff::TeammateStatus;

use crate::column::{Field, Row, rows};

/// Number of the first track without identity, and key of the first track of no target. Ids of targets are smaller.
pub const NO_TARGET: u32 = 1 << 30;

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
    pub fn has(self, needed: Self) -> bool {
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
    /// Measurements of this time step, by UAV, then in the order in which the sensor reports them.
    pub detections: Vec<DetectionRow>,
    /// Tentative tracks, by ascending id; empty if sensors report identities.
    pub tentative: Vec<TentativeRow>,
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
    pub fn clear(&mut self) {
        let Self { all, tracks, groups, events, teammates: team } = self;
        all.clear();
        tracks.clear();
        groups.clear();
        events.clear();
        team.clear();
    }

    /// Sorts the rows that a controller wrote, and removes those that are duplicate or not finite: scores and records
    /// rely on this.
    pub fn tidy(&mut self) {
        let Self { all, tracks, groups, events, teammates: team } = self;
        tracks.retain(|of| of.row.is_finite());
        groups.retain(|of| of.row.is_finite());
        put_in_order(all);
        put_in_order(tracks);
        put_in_order(groups);
        put_in_order(team);
        events.sort_by_key(|row| row.agent);
    }
}

/// Returns the rows with a key, in a table sorted by that key.
fn of<R, K: Ord>(rows: &[R], key: K, by: impl Fn(&R) -> K) -> &[R] {
    let start = rows.partition_point(|row| by(row) < key);
    let length = rows[start..].partition_point(|row| by(row) == key);
    &rows[start..start + length]
}

/// Row type of a table that frames are read from.
pub(crate) trait FrameRow: Row {
    /// Rows of a frame.
    fn of(frame: &Frame) -> &Vec<Self>;
    fn of_mut(frame: &mut Frame) -> &mut Vec<Self>;
    /// Id by which the rows of a time step are unique and ascending; `None` if the table has any order.
    fn id(&self) -> Option<(u32, u32)>;
}

macro_rules! frame_rows {
    ($($row:ty: $($place:ident).+, $id:expr;)+) => {
        $(impl FrameRow for $row {
            fn of(frame: &Frame) -> &Vec<Self> {
                &frame.$($place).+
            }

            fn of_mut(frame: &mut Frame) -> &mut Vec<Self> {
                &mut frame.$($place).+
            }

            fn id(&self) -> Option<(u32, u32)> {
                let id: fn(&Self) -> Option<(u32, u32)> = $id;
                id(self)
            }
        })+
    };
}

frame_rows! {
    UavRow: uavs, |row| Some((row.uav, 0));
    TruthRow: truth, |row| Some((row.target, 0));
    TrackRow: tracks, |row| Some((row.target, 0));
    GroupRow: groups, |row| Some((row.group, 0));
    DetectionRow: detections, |_| None;
    TentativeRow: tentative, |row| Some(((row.track_uid >> 32) as u32, row.track_uid as u32));
    EventRow: events, |_| None;
    IntruderRow: intruders, |row| Some((row.intruder, 0));
    AgentRow: agents.all, |row| Some((row.agent, 0));
    ByAgent<TrackRow>: agents.tracks, |of| Some((of.agent, of.row.target));
    ByAgent<GroupRow>: agents.groups, |of| Some((of.agent, of.row.group));
    AgentEventRow: agents.events, |_| None;
    TeammateRow: agents.teammates, |row| Some((row.agent, row.uav));
}

/// Sorts rows by id and keeps the first row of each id. Most tables are sorted already and need no copy.
fn put_in_order<R: FrameRow>(rows: &mut Vec<R>) {
    if !rows.is_sorted_by(|row, next| row.id() < next.id()) {
        rows.sort_by_key(R::id);
        rows.dedup_by_key(|row| row.id());
    }
}

/// A row of the state of one agent.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ByAgent<R> {
    /// UAV of the agent.
    pub agent: u32,
    /// The row.
    pub row: R,
}

/// State and intentions of a team as rows of the record. Of several rows of one target or one group, the first counts;
/// rows with a number that is not finite are left out.
#[derive(Debug)]
pub struct ReportedState<'a> {
    /// Tracks, by ascending target, which is the label that sensors report. If they report none, the simulator replaces
    /// the target of each track by that to which it assigns the track; rows with equal `track_uid`, or without it equal
    /// `track`, are of the same track.
    pub tracks: &'a mut Vec<TrackRow>,
    /// Groups, by ascending group. A UAV is assigned to the group that its step's diagnostics name.
    pub groups: &'a mut Vec<GroupRow>,
    /// Tentative tracks, by ascending id.
    pub tentative: &'a mut Vec<TentativeRow>,
    /// Events, in order.
    pub events: &'a mut Vec<EventRow>,
}

impl ReportedState<'_> {
    /// Sorts the rows of a third-party controller, and removes those that are duplicate or not finite: scores and
    /// records rely on this.
    pub fn tidy(&mut self) {
        self.tracks.retain(TrackRow::is_finite);
        put_in_order(self.tracks);
        self.groups.retain(GroupRow::is_finite);
        put_in_order(self.groups);
        self.tentative.retain(TentativeRow::is_finite);
        put_in_order(self.tentative);
    }
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

rows! {
    /// A UAV: its true state at the time of the scan, and the command that followed.
    #[derive(Copy)]
    pub struct UavRow in "uavs" {
        /// UAV id.
        pub uav: u32,
        /// Assigned group.
        #[on(page)] pub group: Option<u32>,
        /// East, m.
        #[on(page)] pub x_m: f64,
        /// North, m.
        #[on(page)] pub y_m: f64,
        /// Heading, rad; in wind: course.
        #[on(page)] pub heading_rad: f64,
        /// Speed, m/s; in wind: ground speed.
        #[on(page)] pub speed_m_s: f64,
        /// Turn rate, rad/s; in wind: course rate from the turn and the mean acceleration of the last time step, without
        /// gusts.
        #[on(page)] pub turn_rate_rad_s: f64,
        /// Direction of the sensor during the scan, rad.
        #[on(page)] pub boresight_rad: Option<f64>,
        /// Commanded speed, within limits, m/s; in wind: airspeed.
        pub speed_command_m_s: f64,
        /// Commanded turn rate, within limits, rad/s; in wind: heading rate.
        pub turn_rate_command_rad_s: f64,
        /// True if the speed change was limited.
        #[on(page)] pub speed_limited: bool,
        /// True if the turn rate was limited.
        #[on(page)] pub turn_rate_limited: bool,
        /// Distance r from the UAV to the estimated group centre, m.
        #[on(page)] pub centre_distance_m: Option<f64>,
        /// Phase on the orbit: direction from the estimated group centre to the UAV, rad.
        #[on(page)] pub phase_rad: Option<f64>,
        /// Radius steered for after active measure 2 (22), m.
        #[on(page)] pub steered_radius_m: Option<f64>,
        /// Desired heading (23), rad.
        #[on(page)] pub desired_heading_rad: Option<f64>,
        /// Feedforward turn rate (25), rad/s.
        #[on(page)] pub feedforward_rad_s: Option<f64>,
        /// Threshold of Lemma 3.1, m2/s; negative: convergence is not guaranteed.
        pub convergence_threshold_m2_s: Option<f64>,
        /// True if the group's centre is too fast for the desired field (29).
        pub centre_too_fast: bool,
        /// Commanded altitude above the plane, m.
        #[on(page)] pub commanded_altitude_m: Option<f64>,
        /// Altitude, m; null if altitudes are not simulated.
        #[on(page)] pub altitude_m: Option<f64>,
        /// Rate of climb, m/s, positive upward; null like `altitude_m`.
        #[on(page)] pub climb_rate_m_s: Option<f64>,
        /// UAV that it avoids by deviating from its orbit command.
        #[on(page)] pub avoided_uav: Option<u32>,
        /// Predicted distance to the avoided aircraft without the deviation, m.
        #[on(page)] pub predicted_distance_m: Option<f64>,
        /// Zone that changes its command: index in `[[geofence]]`, from 0.
        #[on(page)] pub limiting_zone: Option<u32>,
        /// Intruder that it avoids; `avoided_uav` is then null.
        #[on(page)] pub avoided_intruder: Option<u32>,
        /// East that the UAV assumes, m; null if its navigation is exact.
        pub believed_x_m: Option<f64>,
        /// North that it assumes, m; null like `believed_x_m`.
        pub believed_y_m: Option<f64>,
        /// Heading that it assumes, rad; null like `believed_x_m`.
        pub believed_heading_rad: Option<f64>,
        /// True if it gives up the minimum separation from the avoided aircraft, because no command keeps it within the
        /// limits and the geofence. It never gives up the geofence.
        pub separation_given_up: bool,
        /// True airspeed, m/s; null without wind, like the next three columns.
        #[on(page)] pub airspeed_m_s: Option<f64>,
        /// Heading in the air, rad; `heading_rad` is then the course.
        #[on(page)] pub air_heading_rad: Option<f64>,
        /// Velocity of the wind, east, m/s.
        #[on(page)] pub wind_x_m_s: Option<f64>,
        /// Velocity of the wind, north, m/s.
        #[on(page)] pub wind_y_m_s: Option<f64>,
        /// Velocity of the wind that the UAV assumes, east, m/s; null if it assumes calm air.
        pub believed_wind_x_m_s: Option<f64>,
        /// The same, north, m/s.
        pub believed_wind_y_m_s: Option<f64>,
        /// Bank angle, rad, positive to the right (right wing down), so that a positive bank turns clockwise; null unless
        /// the scenario has the dynamics `bank`.
        pub bank_rad: Option<f64>,
        /// Last commanded bank angle before the scan, rad, positive to the right; null like `bank_rad`.
        pub bank_command_rad: Option<f64>,
    }

    /// True state of an aircraft outside the team.
    #[derive(Copy)]
    pub struct IntruderRow in "intruders" {
        /// Index in `[[intruders]]`, from 0.
        pub intruder: u32,
        /// East, m.
        #[on(page)] pub x_m: f64,
        /// North, m.
        #[on(page)] pub y_m: f64,
        /// Heading, rad.
        #[on(page)] pub heading_rad: f64,
        /// Speed, m/s.
        #[on(page)] pub speed_m_s: f64,
        /// Altitude above the plane, m; null if altitudes are not simulated.
        #[on(page)] pub altitude_m: Option<f64>,
        /// True if it broadcast its position in this time step.
        #[on(page)] pub transponder_on: bool,
    }

    /// True state of a target.
    #[derive(Copy)]
    pub struct TruthRow in "truth" {
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
        /// Acceleration east, m/s2; null if unknown.
        pub ax_m_s2: Option<f64>,
        /// Acceleration north, m/s2; null if unknown.
        pub ay_m_s2: Option<f64>,
    }

    /// A track: the fused estimate of one target.
    #[derive(Copy)]
    pub struct TrackRow in "tracks" and "agent_tracks" {
        /// Id of the true target, as in `truth`. If sensors report no identities, it follows from the assignment of
        /// tracks to targets (docs/user/metrics.md); a track of no target has the number in `track`.
        pub target: u32,
        /// `cued` (reported by a cue source, not measured yet), `updated` (measured in this time step) or `coasting`
        /// (predicted).
        #[on(page)] pub status: TrackStatus,
        /// `member` of a group, `in-handoff` to one, `removed`, or `ungrouped`.
        #[on(page)] pub membership: MembershipState,
        /// Group of the target; in handoff, the passing group, which still has to keep it in view, or null.
        #[on(page)] pub group: Option<u32>,
        /// In handoff, the receiving group.
        #[on(page)] pub receiving_group: Option<u32>,
        /// Estimated position, velocity and acceleration east and north, m, m/s and m/s2.
        #[on(page)] pub state: [f64; 6],
        /// Upper triangle of their covariance, row by row.
        #[on(page)] pub covariance: [f64; 21],
        /// Number of the track: the identity that sensors report, or 2^30 plus the index of the track in the order of
        /// first appearance, if they report none.
        pub track: u32,
        /// Low 53 bits of the team's id of a track without identity, which a double holds exactly; null for tracks with
        /// an identity.
        pub track_uid: Option<u64>,
    }

    /// A tentative track: an estimate of a target that may exist. It is in no group.
    #[derive(Copy)]
    pub struct TentativeRow in "tentative" {
        /// Low 53 bits of the id of the track. If the track is confirmed, it has this `track_uid` in `tracks`, unless it
        /// takes the place of a lost track.
        pub track_uid: u64,
        /// Probability that the target exists.
        #[on(page)] pub existence: f64,
        /// Estimated position east, m.
        #[on(page)] pub x_m: f64,
        /// Estimated position north, m.
        #[on(page)] pub y_m: f64,
        /// Estimated velocity east, m/s.
        #[on(page)] pub vx_m_s: f64,
        /// Estimated velocity north, m/s.
        #[on(page)] pub vy_m_s: f64,
        /// Variance of the position east, m2.
        pub var_x_m2: f64,
        /// Covariance of the position east and north, m2.
        pub cov_x_y_m2: f64,
        /// Variance of the position north, m2.
        pub var_y_m2: f64,
    }

    /// A group and its orbit.
    #[derive(Copy)]
    pub struct GroupRow in "groups" and "agent_groups" {
        /// Group number within one team state.
        pub group: u32,
        /// Number of members, including those in handoff to or from it.
        #[on(page)] pub members: u32,
        /// Estimated centre east, m.
        #[on(page)] pub x_m: f64,
        /// Estimated centre north, m.
        #[on(page)] pub y_m: f64,
        /// Velocity of the estimated centre east, m/s.
        pub vx_m_s: f64,
        /// Velocity of the estimated centre north, m/s.
        pub vy_m_s: f64,
        /// Spread d_max: distance from the centre to the furthest member, m.
        #[on(page)] pub spread_m: f64,
        /// Margin d_m added to the spread, m.
        #[on(page)] pub margin_m: f64,
        /// Standoff distance (15) before the clamp, m.
        pub standoff_unclamped_m: f64,
        /// Standoff distance r_d: (15) clamped to its bounds, m.
        #[on(page)] pub standoff_distance_m: f64,
        /// Rate of r_d, m/s.
        #[on(page)] pub standoff_rate_m_s: f64,
        /// Minimum radius that UAVs can fly around this centre (27 and the limit for moving centres), m; null: the
        /// centre is as fast as the UAVs. With `orbit.radius_above_turn_limit`, the limit at the members' mean velocity,
        /// low-passed if the orbit's motion is limited.
        #[on(page)] pub turn_limit_m: Option<f64>,
        /// True if some orbit satisfies every constraint.
        #[on(page)] pub feasible: bool,
        /// Threshold of Lemma 3.1 at nominal speed for the UAV of the group that follows best, m2/s; the removal cause
        /// `diverging` uses it. Null: no UAV, or a centre too fast.
        pub convergence_threshold_m2_s: Option<f64>,
        /// Altitude of the orbit above the plane, m.
        #[on(page)] pub altitude_m: f64,
        /// Minimum distance between two of its UAVs, m.
        #[on(page)] pub nearest_groupmate_m: Option<f64>,
        /// Low 53 bits of the id of the group that all agents use, from creation time and members; a double holds them
        /// exactly. Two team states may number groups differently.
        pub group_uid: Option<u64>,
    }

    /// A measurement (7), or a false alarm.
    #[derive(Copy)]
    pub struct DetectionRow in "detections" {
        /// UAV that measured.
        pub uav: u32,
        /// Measured target, whether or not the sensor reports its identity; null for a false alarm. In the record of a
        /// flight, where targets are unknown: the track with the reported identity, as in `tracks`, or null.
        pub target: Option<u32>,
        /// Range, m.
        pub range_m: f64,
        /// Bearing from the UAV to the target, rad.
        pub bearing_rad: f64,
        /// Rate of change of the range, due to the motion of both UAV and target, m/s; null if it is not measured.
        pub range_rate_m_s: Option<f64>,
    }

    /// A true target in view of a UAV: within half the field of view of the boresight, within sensing range, and not
    /// hidden by a building.
    #[derive(Copy)]
    pub struct ViewRow in "in_view" {
        /// UAV whose sensor has the target in view.
        pub uav: u32,
        /// Target in view.
        pub target: u32,
        /// True range, m.
        pub range_m: f64,
        /// Angle from the boresight to the target, rad, anticlockwise positive, in (-pi, pi].
        pub off_boresight_rad: f64,
    }

    /// An event. Columns that its kind does not use are `None`.
    pub struct EventRow in "events" {
        /// Kind of event, in kebab-case.
        pub kind: String,
        /// Target concerned, as in `tracks`.
        pub target: Option<u32>,
        /// Group concerned; for handoffs the passing group, for reassignments the previous one.
        pub group: Option<u32>,
        /// For handoffs the receiving group, for reassignments the new one.
        pub to_group: Option<u32>,
        /// UAVs concerned: ids separated by spaces.
        pub uavs: Vec<u32>,
        /// The cause and the columns below as a sentence.
        pub reason: String,
        /// Number of the target's track, as in `tracks`.
        pub track: Option<u32>,
        /// Cause, in kebab-case; null if the kind has only one.
        pub cause: Option<String>,
        /// Group that can cover the targets of a retired one.
        pub into_group: Option<u32>,
        /// Number of targets of a new group.
        pub members: Option<u32>,
        /// Number of targets that the UAVs of a retired group can cover instead.
        pub coverable_targets: Option<u32>,
        /// Time in both groups, T_hd, s.
        pub dwell_s: Option<f64>,
        /// Required standoff distance, m.
        pub required_radius_m: Option<f64>,
        /// Largest allowed standoff distance, m.
        pub allowed_radius_m: Option<f64>,
        /// Threshold of Lemma 3.1 for the UAV that follows best, m2/s.
        pub threshold_m2_s: Option<f64>,
        /// Lower limit of this threshold, m2/s.
        pub limit_m2_s: Option<f64>,
        /// Speed of the target, m/s.
        pub speed_m_s: Option<f64>,
        /// Maximum speed of the UAVs, m/s.
        pub limit_m_s: Option<f64>,
        /// Distance of the two aircraft, m.
        pub distance_m: Option<f64>,
        /// `group_uid` of `group`.
        pub group_id: Option<u64>,
        /// `group_uid` of `to_group`.
        pub to_group_id: Option<u64>,
        /// Fraction of the group's orbit outside all zones that block it, 0 to 1.
        pub clear_fraction: Option<f64>,
        /// Zone concerned: index in `[[geofence]]`, from 0.
        pub zone: Option<u32>,
        /// Intruder concerned.
        pub intruder: Option<u32>,
        /// `track_uid` of the track.
        pub track_uid: Option<u64>,
    }

    /// An agent, if each UAV has its own.
    #[derive(Copy)]
    pub struct AgentRow in "agents" {
        /// UAV of the agent.
        pub agent: u32,
        /// Time of its newest committed (final) team state, by its clock, microseconds; null before the first commit.
        pub committed_us: Option<i64>,
        /// True if messages have been missing recently: groups and assignments are then those of an earlier time step.
        pub link_degraded: bool,
        /// Messages sent in this time step.
        pub sent_messages: u64,
        /// Their total size, bytes.
        pub sent_bytes: u64,
        /// True if retransmissions wait, because their budget of this time step is spent.
        pub retransmission_limited: Option<bool>,
    }

    /// An event that one agent publishes.
    pub struct AgentEventRow in "agent_events" {
        /// UAV of the agent.
        pub agent: u32,
        /// Time of the event by the agent's clock, microseconds. If messages are missing, events are published when
        /// they are certain, or likely.
        pub event_time_us: i64,
        /// True if a later message can still change it.
        pub provisional: bool,
        /// The event.
        pub event: EventRow,
    }

    /// State of a UAV of the team as one agent knows it.
    #[derive(Copy)]
    pub struct TeammateRow in "agent_teammates" {
        /// UAV of the agent.
        pub agent: u32,
        /// UAV of the team.
        pub uav: u32,
        /// `live` (reported in this time step or the last one), `silent` (keeps its assignment), `timed-out` (the team
        /// continues without it), `left` (announced); null: never received, but assigned in a received snapshot.
        pub status: Option<TeammateStatus>,
        /// Time of its newest known report, by the agent's clock, microseconds.
        pub last_report_us: Option<i64>,
        /// Assigned group.
        pub group: Option<u32>,
        /// `group_uid` of that group.
        pub group_id: Option<u64>,
    }
}
