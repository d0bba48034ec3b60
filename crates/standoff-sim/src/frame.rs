//! One instant of a run, as the record keeps it: rows of plain numbers, SI units, world frame.
//!
//! Positions are metres east (`x`) and north (`y`); angles are radians, anticlockwise from east, in
//! (-pi, pi]. A value that does not exist (no group, no boresight yet) is `None`, never a NaN.

use serde::{Deserialize, Serialize};

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
        self.tracks.retain(|row| row.state.iter().chain(&row.covariance).all(|number| number.is_finite()));
        self.tracks.sort_by_key(|row| row.target);
        self.tracks.dedup_by_key(|row| row.target);
        self.groups.retain(GroupRow::is_finite);
        self.groups.sort_by_key(|row| row.group);
        self.groups.dedup_by_key(|row| row.group);
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
}
