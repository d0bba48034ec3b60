//! Scenario parameters that the scoring needs.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use standoff::guidance::orbit_motion::OrbitMotion;
use standoff::guidance::standoff_distance::Spread;
use standoff::guidance::standoff_distance::StandoffDistance;
use standoff::params::CentreEstimate;
use standoff::params::MotionParams;
use standoff::priority::priority_at;
use standoff::{
    AreaOfInterest, Geofence, Position, SensorParams, SeparationParams, TargetParams, TargetState, TeamParams, Velocity,
};
use standoff_record::{Frame, ReportedTables};

use crate::buildings::Buildings;
use crate::geometry::{InView, true_centre};

/// Real noise of the sensors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation of the range, m.
    pub range_sd_m: f64,
    /// Standard deviation of the bearing, rad.
    pub bearing_sd_rad: f64,
}

/// Errors of cues.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CueError {
    /// Standard deviation of the position per axis, m.
    pub position_sd_m: f64,
    /// Standard deviation of the velocity per axis, m/s.
    pub velocity_sd_m_s: f64,
}

/// Priorities of targets; 1 for all others.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Priorities {
    /// By target id.
    pub of_target: BTreeMap<u32, f64>,
    /// Areas of interest.
    pub areas: Vec<AreaOfInterest>,
}

impl Priorities {
    /// True if no target differs from the others.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.of_target.is_empty() && self.areas.is_empty()
    }

    /// Returns the priority of a target at a position.
    #[must_use]
    pub fn at(&self, target: u32, at: Position) -> f64 {
        priority_at(self.of_target.get(&target).copied().unwrap_or(1.0), at, &self.areas)
    }
}

/// Scenario parameters that the scoring needs.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreConfig {
    /// Tables that the controller reports.
    pub reported: ReportedTables,
    /// Definition of the orbit centre: centroid of the targets or centre of their minimum enclosing circle.
    pub centre: CentreEstimate,
    /// Motion limits of the orbit's centre and radius.
    pub orbit_motion: MotionParams,
    /// Field of view, sensing range, and the noise that the filters assume.
    pub sensor: SensorParams,
    /// Target model that the filters assume.
    pub target: TargetParams,
    /// Model that the targets really follow, if any.
    pub motion: Option<TargetParams>,
    /// Ids of the targets of that model that also manoeuvre.
    pub manoeuvring: Arc<BTreeSet<u32>>,
    /// Real noise of the sensors.
    pub noise: Noise,
    /// Accuracy of the cues.
    pub cue: CueError,
    /// Minimum separation of the UAVs, whether collision avoidance is on or off.
    pub separation: SeparationParams,
    /// True if the team's own controller does collision avoidance.
    pub has_separation: bool,
    /// True if the UAVs fly in wind.
    pub has_wind: bool,
    /// Desired phase of a pair, rad.
    pub desired_phase_rad: f64,
    /// Time between two frames, s.
    pub period_s: f64,
    /// Start time of the `*_settled` metrics, s.
    pub transient_s: f64,
    /// Geofence.
    pub geofence: Geofence,
    /// Buildings that hide targets from the sensors.
    pub buildings: Buildings,
    /// Priorities of targets, and areas of interest.
    pub priorities: Arc<Priorities>,
    /// Parameters of the team, which determine the limits of the orbit radius and the altitudes of UAVs without a
    /// recorded one.
    pub team: TeamParams,
    /// End of the last radio fault or restart that ends within the mission, s.
    pub faults_end_s: Option<f64>,
    /// Cut-off distance c of GOSPA, m.
    pub gospa_cutoff_m: f64,
}

impl ScoreConfig {
    /// Returns the scoring configuration of a team whose controller reports all tables, with the sensor noise that its
    /// filters assume, exact cues, and no target model, geofence, buildings or faults. All times count as settled.
    #[must_use]
    pub fn new(team: &TeamParams, period_s: f64) -> Self {
        let sensor = team.track.sensor;
        Self {
            reported: ReportedTables::default(),
            centre: team.group.centre,
            orbit_motion: team.group.motion,
            sensor,
            target: team.track.target,
            motion: None,
            manoeuvring: Arc::default(),
            noise: Noise { range_sd_m: sensor.range_sd_m, bearing_sd_rad: sensor.bearing_sd_rad },
            cue: CueError { position_sd_m: 0.0, velocity_sd_m_s: 0.0 },
            separation: team.separation.unwrap_or_default(),
            has_separation: team.separation.is_some(),
            has_wind: team.wind.is_some(),
            desired_phase_rad: team.guidance.desired_phase_rad,
            period_s,
            transient_s: 0.0,
            geofence: Geofence::default(),
            buildings: Buildings::default(),
            priorities: Arc::default(),
            team: *team,
            faults_end_s: None,
            gospa_cutoff_m: 20.0,
        }
    }

    /// Returns what determines whether a target is in view.
    pub(crate) fn in_view(&self) -> InView<'_> {
        (&self.sensor, &self.buildings)
    }

    /// Returns the orbit of the members without motion limits: centre by the configured rule, mean velocity of the
    /// members, and radius r_d (15) without a margin. `None` without members.
    pub(crate) fn orbit(&self, members: &[TargetState]) -> Option<OrbitMotion> {
        let centre = true_centre(self.centre, members.iter().map(TargetState::position))?;
        let mean_m_s = |of: fn(Velocity) -> f64| {
            members.iter().map(|member| of(member.velocity())).sum::<f64>() / members.len() as f64
        };
        let velocity = Velocity::from_m_s(mean_m_s(Velocity::x_m_s), mean_m_s(Velocity::y_m_s));
        let centre = TargetState::new(centre, velocity, [0.0; 2]);
        let turn_limit_m = self.team.turn_limit_about_m(centre.velocity().speed_m_s());
        let standoff = self.standoff_distance(members, &centre, 0.0, turn_limit_m);
        Some(OrbitMotion::start(&centre, &standoff, turn_limit_m))
    }

    /// Returns the orbit one period after `flown`, on its way to `desired`: the centre moves towards that of `desired`,
    /// and the radius towards (15) of the members about the moved centre, with a margin. Returns `desired` itself if
    /// motion limits are off.
    pub(crate) fn orbit_after(
        &self,
        flown: &OrbitMotion,
        desired: &OrbitMotion,
        members: &[TargetState],
        margin_m: f64,
    ) -> OrbitMotion {
        let (motion, period_s) = (&self.orbit_motion, self.period_s);
        if motion.is_instantaneous() {
            return *desired;
        }
        let flown = flown.with_centre(&desired.state(), motion, period_s);
        let flown = flown.with_turn_limit(desired.turn_limit_m, period_s);
        let target = self.standoff_distance(members, &flown.state(), margin_m, flown.turn_limit_m);
        flown.with_radius(target.distance_m, &self.team.orbit_bounds(flown.turn_limit_m), motion, period_s)
    }

    /// Computes (15) of members about a centre, within the bounds of an orbit with this turn limit.
    pub(crate) fn standoff_distance(
        &self,
        members: &[TargetState],
        centre: &TargetState,
        margin_m: f64,
        turn_limit_m: f64,
    ) -> StandoffDistance {
        let at = centre.position();
        let squared_m2 = |member: &TargetState| member.position().squared_distance_m2(at);
        let furthest = members.iter().max_by(|one, other| squared_m2(one).total_cmp(&squared_m2(other)));
        let spread = furthest.map_or(Spread::default(), |furthest| Spread {
            distance_m: squared_m2(furthest).sqrt(),
            ..Spread::of(furthest, centre)
        });
        self.team.orbit_bounds(turn_limit_m).distance(spread, margin_m, &self.sensor)
    }

    /// Returns whether the `*_settled` metrics evaluate a frame.
    pub(crate) fn is_settled(&self, frame: &Frame) -> bool {
        frame.time_us as f64 / 1e6 >= self.transient_s
    }
}
