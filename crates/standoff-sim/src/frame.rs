//! One instant of a run, as the record keeps it: rows of plain numbers, SI units, world frame.
//!
//! Positions are metres east (`x`) and north (`y`); angles are radians, anticlockwise from east, in
//! (-pi, pi]. A value that does not exist (no group, no boresight yet) is `None`, never a NaN.

use serde::{Deserialize, Serialize};
use standoff::Presence;

/// What a brain tells of what it believes and intends; what it does not tell is not scored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reported {
    /// What it believes of targets.
    pub tracks: bool,
    /// Groups and their orbits, and which UAV serves which.
    pub groups: bool,
    /// What happens: handoffs, discards.
    pub events: bool,
}

impl Reported {
    /// Nothing: only where UAVs fly and where sensors point is known.
    pub const NOTHING: Self = Self { tracks: false, groups: false, events: false };

    /// All that is needed is told.
    pub(crate) fn has(self, needed: Self) -> bool {
        (self.tracks || !needed.tracks) && (self.groups || !needed.groups) && (self.events || !needed.events)
    }
}

impl Default for Reported {
    /// Everything.
    fn default() -> Self {
        Self { tracks: true, groups: true, events: true }
    }
}

/// Everything that the record holds of one instant.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Frame {
    /// Time since the start of the mission, microseconds.
    pub time_us: i64,
    /// One row per UAV, by ascending id.
    pub uavs: Vec<UavRow>,
    /// Truth: one row per target that exists at this instant, by ascending id. Only scores read it.
    pub truth: Vec<TruthRow>,
    /// What the UAVs believe: one row per live track, by ascending target id.
    pub tracks: Vec<TrackRow>,
    /// Groups and their orbits, by ascending id.
    pub groups: Vec<GroupRow>,
    /// What the sensors said at this instant, by UAV then target.
    pub detections: Vec<DetectionRow>,
    /// What happened at this instant.
    pub events: Vec<EventRow>,
    /// Aircraft that are not of the team, by ascending number.
    pub intruders: Vec<IntruderRow>,
    /// What each of several minds believes; nothing where one believes for all.
    pub agents: Agents,
}

/// What each of several minds believes by itself, as rows of the record; a UAV whose computer is off has none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Agents {
    /// One row per mind, by ascending UAV.
    pub all: Vec<AgentRow>,
    /// Its tracks, by mind, then target.
    pub tracks: Vec<OfAgent<TrackRow>>,
    /// Its groups and their orbits, by mind, then group.
    pub groups: Vec<OfAgent<GroupRow>>,
    /// What it tells of now: by mind, in order.
    pub events: Vec<AgentEventRow>,
    /// Its team, by mind, then UAV.
    pub team: Vec<TeamRow>,
}

impl Agents {
    /// Who serves which group, by its id, as a mind believes: by ascending UAV.
    pub fn crew(&self, agent: u32) -> impl Iterator<Item = (u32, u64)> + Clone {
        self.team_of(agent).iter().filter_map(|row| row.group_id.map(|id| (row.uav, id)))
    }

    /// The tracks of a mind, by ascending target.
    pub fn tracks_of(&self, agent: u32) -> &[OfAgent<TrackRow>] {
        of(&self.tracks, agent, |of| of.agent)
    }

    /// The groups of a mind, ascending.
    pub fn groups_of(&self, agent: u32) -> &[OfAgent<GroupRow>] {
        of(&self.groups, agent, |of| of.agent)
    }

    /// The team of a mind, by ascending UAV.
    pub fn team_of(&self, agent: u32) -> &[TeamRow] {
        of(&self.team, agent, |row| row.agent)
    }

    /// What a mind believes of a UAV; `None` of one that it has never heard, nor heard of.
    pub fn mate(&self, agent: u32, uav: u32) -> Option<&TeamRow> {
        let place = self.team.binary_search_by_key(&(agent, uav), |row| (row.agent, row.uav)).ok()?;
        Some(&self.team[place])
    }

    /// Nothing, in room that lives on.
    pub(crate) fn clear(&mut self) {
        let Self { all, tracks, groups, events, team } = self;
        all.clear();
        tracks.clear();
        groups.clear();
        events.clear();
        team.clear();
    }

    /// Brings what a brain wrote into the order and the soundness that scores and records count on.
    pub(crate) fn tidy(&mut self) {
        let Self { all, tracks, groups, events, team } = self;
        tracks.retain(|of| of.row.is_finite());
        groups.retain(|of| of.row.is_finite());
        put_in_order(all, |row| row.agent);
        put_in_order(tracks, |of| (of.agent, of.row.target));
        put_in_order(groups, |of| (of.agent, of.row.group));
        put_in_order(team, |row| (row.agent, row.uav));
        events.sort_by_key(|row| row.agent);
    }
}

/// The rows of one, in a table that is sorted by it.
pub(crate) fn of<R, K: Ord>(rows: &[R], key: K, by: impl Fn(&R) -> K) -> &[R] {
    let start = rows.partition_point(|row| by(row) < key);
    let length = rows[start..].partition_point(|row| by(row) == key);
    &rows[start..start + length]
}

/// Sorts rows, of which the first of each key stays. Those that are in order, as most are, need no room for that.
fn put_in_order<R, K: Ord>(rows: &mut Vec<R>, key: impl Fn(&R) -> K) {
    if !rows.is_sorted_by(|one, next| key(one) < key(next)) {
        rows.sort_by_key(&key);
        rows.dedup_by_key(|row| key(row));
    }
}

/// A row of what one of several minds believes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OfAgent<R> {
    /// The UAV whose mind it is.
    pub agent: u32,
    /// What it believes.
    pub row: R,
}

/// One of several minds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AgentRow {
    /// The UAV whose mind it is.
    pub agent: u32,
    /// The instant up to which nothing that it believes can change any more, by its clock, microseconds; `None`: nothing yet.
    pub committed_us: Option<i64>,
    /// Words have gone missing of late: its groups and duties are those of a moment ago.
    pub disturbed: bool,
    /// Messages that its UAV has sent at this instant.
    pub sent_messages: u64,
    /// Bytes that these take.
    pub sent_bytes: u64,
    /// The newest of its pictures that cannot change any more knows more than follows from what was said, each report once;
    /// `None`: nobody has looked.
    pub double_counted: Option<bool>,
}

/// What one of several minds believes of a UAV of the team.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TeamRow {
    /// The UAV whose mind it is.
    pub agent: u32,
    /// The UAV of the team.
    pub uav: u32,
    /// Whether that is there; `None`: it was never heard, but serves a group.
    pub presence: Option<Presence>,
    /// The instant of the newest report of it that was heard, or told of, by the mind's clock, microseconds.
    pub heard_us: Option<i64>,
    /// The group that it serves.
    pub group: Option<u32>,
    /// That group's id, which all minds know it by.
    pub group_id: Option<u64>,
}

/// Something that happened, by one of several minds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AgentEventRow {
    /// The UAV whose mind it is.
    pub agent: u32,
    /// The instant at which it happened, by the mind's clock, microseconds.
    pub happened_us: i64,
    /// It may still turn out otherwise.
    pub provisional: bool,
    /// What happened.
    pub event: EventRow,
}

/// What a team believes and intends, as rows of the record. Of two rows of one target, or of one group, the first counts;
/// those that hold a number that is none are left out.
#[derive(Debug)]
pub struct Beliefs<'a> {
    /// Tracks, by ascending target: the label that sensors give it.
    pub tracks: &'a mut Vec<TrackRow>,
    /// Groups, by ascending group. A UAV serves the one that its step's diagnostics name.
    pub groups: &'a mut Vec<GroupRow>,
    /// What happened, in order.
    pub events: &'a mut Vec<EventRow>,
}

impl Beliefs<'_> {
    /// Brings what a foreign brain wrote into the order and the soundness that scores and records count on.
    pub(crate) fn tidy(&mut self) {
        self.tracks.retain(TrackRow::is_finite);
        put_in_order(self.tracks, |row| row.target);
        self.groups.retain(GroupRow::is_finite);
        put_in_order(self.groups, |row| row.group);
    }
}

/// A UAV: its state when the sensors spoke, and the command it then gave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UavRow {
    /// UAV id.
    pub uav: u32,
    /// The group it serves.
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
    /// The law asked for more speed change than the limit allows.
    pub speed_limited: bool,
    /// The law asked for more turn rate than the limit allows.
    pub turn_rate_limited: bool,
    /// Distance from the UAV to the estimated group centre, r, m.
    pub centre_distance_m: Option<f64>,
    /// Phase on the orbit: direction from the estimated group centre to the UAV, rad.
    pub phase_rad: Option<f64>,
    /// Radius steered for after active measure 2 (22), m.
    pub steered_distance_m: Option<f64>,
    /// Desired heading (23), rad.
    pub desired_heading_rad: Option<f64>,
    /// Feedforward turn rate (25), rad/s.
    pub feedforward_rad_s: Option<f64>,
    /// Lemma 3.1's threshold, m2/s; negative: convergence is not guaranteed.
    pub convergence_threshold_m2_s: Option<f64>,
    /// The group's centre is too fast for the desired field (29).
    pub centre_too_fast: bool,
    /// Altitude asked for, above the plane, m.
    pub altitude_m: Option<f64>,
    /// Altitude at which it is, where altitudes are flown, m.
    pub flown_altitude_m: Option<f64>,
    /// Rate of climb, m/s, positive upward.
    pub climb_rate_m_s: Option<f64>,
    /// The UAV that it keeps away from, by flying something else than its orbit wants.
    pub avoids: Option<u32>,
    /// The intruder that it keeps away from.
    pub avoids_intruder: Option<u32>,
    /// How near to that it would have come, by what it foretold, m.
    pub foretold_m: Option<f64>,
    /// The zone that it keeps out of, or in, by flying something else than it would without; counted from 0.
    pub border: Option<u32>,
}

/// An aircraft that is not of the team, as it really is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntruderRow {
    /// Its number.
    pub intruder: u32,
    /// East, m.
    pub x_m: f64,
    /// North, m.
    pub y_m: f64,
    /// Heading, rad.
    pub heading_rad: f64,
    /// Speed, m/s.
    pub speed_m_s: f64,
    /// Altitude above the plane, m, where altitudes are flown.
    pub altitude_m: Option<f64>,
    /// It told so at this instant.
    pub told: bool,
}

/// A target as it really is.
#[derive(Debug, Clone, Copy, PartialEq)]
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
    /// Acceleration east, m/s2, where the truth knows it.
    pub ax_m_s2: Option<f64>,
    /// Acceleration north, m/s2, where the truth knows it.
    pub ay_m_s2: Option<f64>,
}

/// Track life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TrackStatus {
    /// Handed over by a search aircraft, not measured yet.
    Cued,
    /// Measured at this instant.
    Held,
    /// Measured before, not at this instant: predicted.
    Coasting,
}

/// A target's place in the team's work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// In no group: new, or nobody can cover it.
    Unassigned,
    /// Member of a group.
    Member,
    /// On its way into a group that makes room for it: from another group, to which it belongs too, or from none.
    Dwell,
    /// Removed from its group, still predicted.
    Discarded,
}

/// A track: the fused estimate of one target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackRow {
    /// The target that it is of, by whoever knows the truth.
    pub target: u32,
    /// The team's own id of it.
    pub track: u32,
    /// Track life.
    pub status: TrackStatus,
    /// Its place in the team's work.
    pub place: Place,
    /// The group it belongs to; in dwell, the passing one, whose duty it still is to keep it in view.
    pub group: Option<u32>,
    /// In dwell, the receiving group.
    pub to_group: Option<u32>,
    /// `[x, vx, ax, y, vy, ay]` in m, m/s, m/s2.
    pub state: [f64; 6],
    /// Upper triangle of the covariance of `state`, row by row (21 numbers).
    pub covariance: [f64; 21],
}

impl TrackRow {
    /// All its numbers are.
    pub(crate) fn is_finite(&self) -> bool {
        self.state.iter().chain(&self.covariance).all(|number| number.is_finite())
    }
}

/// A group and the orbit about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupRow {
    /// Group id.
    pub group: u32,
    /// Number of members, those in dwell to or from it included.
    pub members: u32,
    /// Estimated centre east, m.
    pub x_m: f64,
    /// Estimated centre north, m.
    pub y_m: f64,
    /// Estimated centre's velocity east, m/s.
    pub vx_m_s: f64,
    /// Estimated centre's velocity north, m/s.
    pub vy_m_s: f64,
    /// Distance from the centre to the furthest member, d_max, m.
    pub spread_m: f64,
    /// Margin d_m added to it, m.
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
    /// Some orbit satisfies every constraint.
    pub feasible: bool,
    /// Lemma 3.1's threshold for that of its UAVs which follows best, at nominal speed, m2/s: what a discard by
    /// convergence goes by; `None`: no UAV, or a centre too fast.
    pub convergence_threshold_m2_s: Option<f64>,
    /// Altitude of the group's orbit, above the plane, m.
    pub altitude_m: f64,
    /// Smallest distance between two of its UAVs, m.
    pub separation_m: Option<f64>,
    /// The id that all minds know it by, below 2^63; `group` is its number in one picture.
    pub id: Option<u64>,
}

impl GroupRow {
    /// All its numbers are.
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
        let where_known = [self.turn_limit_m, self.convergence_threshold_m2_s, self.separation_m];
        always.into_iter().chain(where_known.into_iter().flatten()).all(f64::is_finite)
    }
}

/// A measurement (7).
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// A true target in the view of a UAV: within half the field of view of the boresight and within sensing range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewRow {
    /// UAV whose sensor is pointed.
    pub uav: u32,
    /// Target in its view.
    pub target: u32,
    /// True range, m.
    pub range_m: f64,
    /// Direction to the target off the boresight, rad, anticlockwise positive, in (-pi, pi].
    pub off_boresight_rad: f64,
}

/// Something that happened. What a kind of event has no use for is `None`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EventRow {
    /// What happened, in kebab-case: `cued`, `lost`, `reacquired`, ...
    pub kind: String,
    /// The target it happened to.
    pub target: Option<u32>,
    /// The group concerned; of a handoff or a re-assignment, the old one.
    pub group: Option<u32>,
    /// Of a handoff or a re-assignment, the new group.
    pub to_group: Option<u32>,
    /// The UAVs concerned.
    pub uavs: Vec<u32>,
    /// Why, in words, as whoever wrote it told it; [`EventRow::why`] tells it from the columns below.
    pub reason: String,
    /// The team's own id of the target's track.
    pub track: Option<u32>,
    /// Why, in kebab-case, where the kind does not tell: `widened`, `not-seen`, ...
    pub cause: Option<String>,
    /// The group into which it was merged.
    pub into_group: Option<u32>,
    /// Targets of a new group.
    pub members: Option<u32>,
    /// Targets that can be watched together instead.
    pub together: Option<u32>,
    /// Time in both groups, T_hd, s.
    pub dwell_s: Option<f64>,
    /// Standoff distance needed, m.
    pub needed_m: Option<f64>,
    /// Largest standoff distance allowed, m.
    pub allowed_m: Option<f64>,
    /// Lemma 3.1's threshold for the UAV that follows best, m2/s.
    pub threshold_m2_s: Option<f64>,
    /// What it may not fall below, m2/s.
    pub limit_m2_s: Option<f64>,
    /// Speed of the target, m/s.
    pub speed_m_s: Option<f64>,
    /// Largest speed of the UAVs, m/s.
    pub limit_m_s: Option<f64>,
    /// Distance of two UAVs, m.
    pub distance_m: Option<f64>,
    /// The id of `group`, which all minds know it by, below 2^63.
    pub group_id: Option<u64>,
    /// That of `to_group`.
    pub to_group_id: Option<u64>,
    /// Share of the group's orbit where UAVs may be, 0 to 1.
    pub clear_fraction: Option<f64>,
    /// The zone that takes the rest, counted from 0.
    pub zone: Option<u32>,
    /// The intruder concerned.
    pub intruder: Option<u32>,
}
