//! Parameters that all UAVs of a team share: limits, filters, groups and guidance law.

mod grouping_params;

use crate::guidance::avoidance::SeparationParams;
use crate::guidance::heading::{Feedforward, GuidanceParams, Lead, SpeedReference};
use crate::guidance::orbit_motion::MotionParams;
use crate::guidance::standoff_distance::StandoffParams;
use crate::guidance::vector_field::OrbitDirection;
use crate::sensor::SensorParams;
use crate::target::TargetParams;
use crate::time::Duration;
use crate::tracking::track::TrackParams;
use crate::uav::{Command, Integrator, UavId, UavParams};
use crate::validation::{Allowed, ParamError, errors_of};

pub use grouping_params::{
    AltitudePolicy, CentreEstimate, CentreJump, GroupCount, GroupingParams, Margin, Objective, Pointing, RemovalRule,
};

/// Parameters of a team; every agent of the team is built from the same ones.
///
/// ```
/// use standoff::TeamParams;
///
/// let mut params = TeamParams::table_1();
/// assert!(params.errors().is_empty());
/// params.guidance.radial_gain = 5.0;
/// assert_eq!(params.errors()[0].path, "guidance.radial_gain");
/// assert!(params.errors()[0].to_string().contains("must be at least 0.001 and at most 1"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TeamParams {
    /// Teammate timeout, s; above 0, at most 60. A UAV that is silent for longer counts as gone; until then it keeps
    /// its assignment.
    pub teammate_timeout_s: f64,
    /// Link model: how reliable the team expects its radio to be.
    pub link: LinkModel,
    /// Message log and retransmission.
    pub log: LogParams,
    /// Speeds, lags and limits of the UAVs.
    pub uav: UavParams,
    /// Sensor, target model and track management.
    pub track: TrackParams,
    /// Orbit bounds and margins.
    pub group: GroupingParams,
    /// Gains of the guidance law.
    pub guidance: GuidanceParams,
    /// Collision avoidance; `None`, as in the paper, means that only the phases of UAVs on one orbit separate them.
    pub separation: Option<SeparationParams>,
}

/// Link model: what a team expects of its radio.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum LinkModel {
    /// Every message arrives. A briefly silent UAV is extrapolated straight ahead, each group has its own altitude, and
    /// the UAVs of one group keep their phase difference.
    #[default]
    Ideal,
    /// Messages get lost, so that safety does not depend on equal team states. A silent UAV is extrapolated along its
    /// last turn. Each UAV has its own altitude, given by its id, and keeps its phase difference from every UAV that it
    /// receives near its orbit.
    Lossy,
}

/// Parameters of the message log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogParams {
    /// Time between two time steps of the team's grid, s; 0.001 to 10. The grid begins at
    /// [`Time::EPOCH`](crate::Time::EPOCH).
    pub period_s: f64,
    /// Retention time: messages that arrive later no longer count, s; above 0, at most 600; and at most 1,200 periods
    /// are used.
    pub message_retention_s: f64,
    /// Decision lag, s; 0 to 10. While messages are missing, the groups and assignments in use are this old, so that
    /// the UAVs act together: most missing messages have arrived by then. Otherwise the current ones are used.
    pub decision_lag_s: f64,
    /// Maximum rate of retransmissions of one UAV, snapshots included, in bytes
    /// ([`Message::size_bytes`](crate::Message::size_bytes)) per second; 0 to 1,000,000.
    pub retransmit_bytes_per_s: f64,
}

impl LogParams {
    /// Returns every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = Vec::new();
        Allowed::at_least(1e-3).at_most(10.0).check("period_s", self.period_s, &mut errors);
        Allowed::above(0.0).at_most(600.0).check("message_retention_s", self.message_retention_s, &mut errors);
        Allowed::at_least(0.0).at_most(10.0).check("decision_lag_s", self.decision_lag_s, &mut errors);
        Allowed::at_least(0.0).at_most(1e6).check("retransmit_bytes_per_s", self.retransmit_bytes_per_s, &mut errors);
        errors
    }
}

impl TeamParams {
    /// Returns the parameters of Table I of the paper, with both active measures.
    ///
    /// The table does not specify the target's acceleration (here 0.2 m/s2), the sensing range (1,200 m) and the
    /// conditions under which a track is lost. The feedforward and the margin are this project's own forms.
    pub fn table_1() -> Self {
        let sensor = SensorParams {
            range_sd_m: 10.0,
            bearing_sd_rad: 3f64.to_radians(),
            field_of_view_rad: 70f64.to_radians(),
            sensing_range_m: 1200.0,
        };
        Self {
            teammate_timeout_s: 3.0,
            link: LinkModel::Ideal,
            log: LogParams {
                period_s: 0.5,
                message_retention_s: 60.0,
                decision_lag_s: 2.0,
                retransmit_bytes_per_s: 1500.0,
            },
            uav: UavParams {
                speed_m_s: 40.0,
                speed_change_max_m_s: 15.0,
                turn_rate_max_rad_s: 0.3,
                speed_lag_s: 1.0 / 3.0,
                turn_rate_lag_s: 1.0 / 3.0,
                integrator: Integrator::Exact,
                climb: None,
            },
            track: TrackParams {
                target: TargetParams { correlation_rate_1_s: 0.1, acceleration_sd_m_s2: 0.2 },
                sensor,
                deletion_position_sd_m: 300.0,
                deletion_unseen_in_view_s: 5.0,
                initial_velocity_sd_m_s: 10.0,
                lost_track_retention_s: 600.0,
            },
            group: GroupingParams {
                standoff: StandoffParams {
                    field_of_view_margin_rad: 10f64.to_radians(),
                    radius_min_m: 250.0,
                    radius_max_m: 700.0,
                },
                count: GroupCount::HalfOfUavs,
                search_lost_targets: false,
                margin: Margin::StandardDeviations(1.645),
                centre: CentreEstimate::Filtered,
                pointing: Pointing::GroupCentre,
                removal: RemovalRule::FurthestFromCentre,
                radius_time_constant_s: 0.0,
                motion: MotionParams { time_constant_s: 0.0, acceleration_max_m_s2: 1.0, closing_speed_max_m_s: 10.0 },
                centre_jump: CentreJump::ShiftState,
                readmission_radius_fraction: 0.9,
                divergence_limit_m2_s: 6000.0,
                divergence_time_s: 3.0,
                handoff_margin_m: 50.0,
                dwell_min_s: 3.0,
                dwell_max_s: 30.0,
                regrouping_period_s: 30.0,
                assignment_reach_s: 30.0,
                objective: Objective::LogDet,
                assignment_switching_cost: 0.5,
                altitude_lowest_m: 300.0,
                altitude_step_m: 50.0,
                altitude_policy: AltitudePolicy::PerGroup,
                proximity_alert_m: 50.0,
            },
            guidance: GuidanceParams {
                orbit_direction: OrbitDirection::Anticlockwise,
                radial_gain: 0.2,
                lead: Lead::Constant(3.0),
                speed_reference: SpeedReference::Ground,
                heading_gain_1_s: 2.0,
                turn_rate_gain: 0.0,
                feedforward: Feedforward::Field,
                phase_gain_1_s: 0.5,
                desired_phase_rad: 90f64.to_radians(),
            },
            separation: None,
        }
    }

    /// Returns the recommended parameters: those of [`Self::table_1`] with this project's modified grouping and
    /// guidance, as used by scenarios that set no parameters. `docs/validation.md` lists the measured gain of each
    /// modification.
    ///
    /// ```
    /// # use standoff::{Agent, TeamParams, UavId};
    /// let mut params = TeamParams::recommended();
    /// params.uav.speed_m_s = 25.0;
    /// params.uav.speed_change_max_m_s = 8.0;
    /// let agent = Agent::new(UavId(0), params)?;
    /// # Ok::<(), Vec<standoff::ParamError>>(())
    /// ```
    pub fn recommended() -> Self {
        let table_1 = Self::table_1();
        Self {
            track: TrackParams { deletion_unseen_in_view_s: 2.0, ..table_1.track },
            group: GroupingParams {
                count: GroupCount::AsNeeded,
                search_lost_targets: true,
                margin: Margin::StandardDeviations(0.0),
                centre: CentreEstimate::EnclosingCircle,
                pointing: Pointing::AngularMidpoint,
                removal: RemovalRule::LargestRadiusReduction,
                motion: MotionParams { time_constant_s: 1.5, acceleration_max_m_s2: 2.5, closing_speed_max_m_s: 25.0 },
                readmission_radius_fraction: 0.97,
                assignment_switching_cost: 10.0,
                ..table_1.group
            },
            guidance: GuidanceParams { heading_gain_1_s: 1.0, ..table_1.guidance },
            ..table_1
        }
    }

    /// Command of a UAV that knows no targets or whose computer is off: the smallest orbit at its position.
    pub fn fallback_command(&self) -> Command {
        let (speed_m_s, radius_m) = (self.uav.speed_m_s, self.group.standoff.radius_min_m);
        Command { speed_m_s, turn_rate_rad_s: self.guidance.orbit_direction.sign() * speed_m_s / radius_m }
    }

    /// Altitude of a UAV that is not assigned to a group yet, m: the lowest one, or its own; within the limits.
    pub fn initial_altitude_m(&self, uav: UavId) -> f64 {
        self.limit_altitude_m(self.own_altitude_m(uav).unwrap_or(self.group.altitude_lowest_m))
    }

    /// Altitude of a UAV that does not depend on its assignment, m; `None` if its group determines it.
    pub(crate) fn own_altitude_m(&self, uav: UavId) -> Option<f64> {
        let GroupingParams { altitude_lowest_m, altitude_step_m, altitude_policy: altitudes, .. } = self.group;
        match (altitudes, self.link) {
            (AltitudePolicy::PerGroup, LinkModel::Ideal) => None,
            (AltitudePolicy::PerGroup, LinkModel::Lossy) | (AltitudePolicy::PerUav, _) => {
                Some(altitude_lowest_m + f64::from(uav.0) * altitude_step_m)
            }
            (AltitudePolicy::Common, _) => Some(altitude_lowest_m),
        }
    }

    /// Limits an altitude to the allowed range, m.
    pub(crate) fn limit_altitude_m(&self, altitude_m: f64) -> f64 {
        self.uav.climb.map_or(altitude_m, |climb| climb.limit_m(altitude_m))
    }

    /// Duration that a silent UAV still counts as part of the team.
    pub fn teammate_timeout(&self) -> Duration {
        Duration::from_s(self.teammate_timeout_s)
    }

    /// Returns the UAV parameters that cannot be integrated over a period: [`UavParams::errors_for_period`].
    pub fn errors_for_period(&self, period: Duration) -> Vec<ParamError> {
        errors_of([("uav", self.uav.errors_for_period(period))])
    }

    /// Returns every parameter that is out of range, alone or in combination with others: the smallest orbit must lie
    /// within the sensing range, and the margin of the orbits must leave some of the sensor's field of view.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = errors_of([
            ("log", self.log.errors()),
            ("uav", self.uav.errors()),
            ("track", self.track.errors()),
            ("group", self.group.errors()),
            ("guidance", self.guidance.errors()),
            ("separation", self.separation.map(|separation| separation.errors()).unwrap_or_default()),
        ]);
        Allowed::above(0.0).at_most(60.0).check("teammate_timeout_s", self.teammate_timeout_s, &mut errors);
        Allowed::above(self.group.standoff.radius_min_m)
            .with_reason("the centre must be in view from the smallest orbit, radius_min_m")
            .check("track.sensor.sensing_range_m", self.track.sensor.sensing_range_m, &mut errors);
        let sensor_rad = self.track.sensor.field_of_view_rad;
        if sensor_rad.is_finite() {
            let margin_rad = self.group.standoff.field_of_view_margin_rad;
            Allowed::at_least(0.0)
                .below(sensor_rad)
                .with_reason("the margin must leave some of the field of view")
                .check("group.standoff.field_of_view_margin_rad", margin_rad, &mut errors);
        }
        errors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_margin_of_at_least_the_field_of_view_is_rejected() {
        let mut params = TeamParams::table_1();
        params.group.standoff.field_of_view_margin_rad = 1.25;
        let messages: Vec<String> = params.errors().iter().map(ToString::to_string).collect();
        assert_eq!(
            messages,
            ["group.standoff.field_of_view_margin_rad = 1.25: must be at least 0 and below 1.221730476 \
                 (the margin must leave some of the field of view)"]
        );
        params.track.sensor.field_of_view_rad = 1.26;
        assert!(params.errors().is_empty());
        // A field of view that is NaN is reported once.
        params.track.sensor.field_of_view_rad = f64::NAN;
        assert_eq!(params.errors().iter().filter(|error| error.path.contains("field_of_view")).count(), 1);
    }
}
