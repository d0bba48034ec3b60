//! What all UAVs of a team agree on: limits, filters, groups, guidance law.

mod group_params;

use crate::estimation::track::TrackParams;
use crate::guidance::heading::{Feedforward, GuidanceParams, Lead, SpeedReference};
use crate::guidance::orbit_motion::MotionParams;
use crate::guidance::separation::SeparationParams;
use crate::guidance::standoff_distance::StandoffParams;
use crate::guidance::vector_field::Sense;
use crate::param::{Allowed, ParamError, errors_of};
use crate::sensor::SensorParams;
use crate::target::TargetParams;
use crate::time::Duration;
use crate::uav::{Command, Integrator, UavId, UavParams};

pub use group_params::{
    Aim, Altitudes, CentreEstimate, Discard, GroupCount, GroupParams, Margin, Objective, OnMembershipChange, Search,
};

/// Parameters of a team; every agent of it is built from the same.
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
    /// The lease: a UAV not heard for longer than this counts as gone, s; above 0, at most 60. Until then it keeps its duty.
    pub teammate_timeout_s: f64,
    /// What the team counts on.
    pub radio: Radio,
    /// How the team keeps and repairs its log.
    pub log: LogParams,
    /// Speeds, lags and limits of the UAVs.
    pub uav: UavParams,
    /// Sensor, target model and life of the tracks.
    pub track: TrackParams,
    /// Orbit bounds and margins.
    pub group: GroupParams,
    /// Gains of the guidance law.
    pub guidance: GuidanceParams,
    /// How far apart UAVs are kept; `None`, as in the paper: only by the phases of those on one orbit.
    pub separation: Option<SeparationParams>,
}

/// What a team counts on of its radio.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Radio {
    /// Every word is heard. Who is silent for a moment flies straight on, each group has an altitude of its own, and UAVs
    /// of one group keep their angles from one another.
    #[default]
    Perfect,
    /// Words are lost, so nothing that safety needs hangs on all knowing the same. Who is silent is carried on along its last
    /// turn, each UAV has an altitude of its own by its id, and keeps its angle from whomever it hears near its orbit.
    Fallible,
}

/// How a team keeps its log of what was said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogParams {
    /// The time between two instants of the team's grid, s; 0.001 to 10. The grid begins at [`Time::START`](crate::Time::START).
    pub period_s: f64,
    /// What is heard later than this counts no more, s; above 0, at most 600, and of that at most 1,200 periods.
    pub horizon_s: f64,
    /// While words go missing, groups and duties are those of so long ago, by when most of what was missing has been heard:
    /// so that UAVs act together, s; 0 to 10. Where nothing is missing, they are those of now.
    pub decision_lag_s: f64,
    /// What a UAV says again for others, snapshots included, in bytes ([`Message::size_bytes`](crate::Message::size_bytes)) a
    /// second at most; 0 to 1,000,000.
    pub repair_bytes_per_s: f64,
}

impl LogParams {
    /// Every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = Vec::new();
        Allowed::at_least(1e-3).at_most(10.0).check("period_s", self.period_s, &mut errors);
        Allowed::above(0.0).at_most(600.0).check("horizon_s", self.horizon_s, &mut errors);
        Allowed::at_least(0.0).at_most(10.0).check("decision_lag_s", self.decision_lag_s, &mut errors);
        Allowed::at_least(0.0).at_most(1e6).check("repair_bytes_per_s", self.repair_bytes_per_s, &mut errors);
        errors
    }
}

impl TeamParams {
    /// Table I of the paper, with both active measures.
    ///
    /// The table leaves open the target's acceleration (here 0.2 m/s2), the sensing range (1,200 m) and when a track is
    /// lost; the feedforward and the margin are this project's own forms.
    pub fn table_1() -> Self {
        let sensor = SensorParams {
            range_sd_m: 10.0,
            bearing_sd_rad: 3f64.to_radians(),
            field_of_view_rad: 70f64.to_radians(),
            sensing_range_m: 1200.0,
        };
        Self {
            teammate_timeout_s: 3.0,
            radio: Radio::Perfect,
            log: LogParams { period_s: 0.5, horizon_s: 60.0, decision_lag_s: 2.0, repair_bytes_per_s: 1500.0 },
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
                lost_position_sd_m: 300.0,
                lost_in_view_s: 5.0,
                start_velocity_sd_m_s: 10.0,
                forget_lost_s: 600.0,
            },
            group: GroupParams {
                standoff: StandoffParams {
                    field_of_view_rad: sensor.field_of_view_rad,
                    field_of_view_margin_rad: 10f64.to_radians(),
                    radius_min_m: 250.0,
                    radius_max_m: 700.0,
                },
                count: GroupCount::Half,
                search: Search::None,
                margin: Margin::StandardDeviations(1.645),
                centre: CentreEstimate::Filtered,
                aim: Aim::Centre,
                discard: Discard::Furthest,
                smoothing_s: 0.0,
                motion: MotionParams { response_s: 0.0, acceleration_max_m_s2: 1.0, approach_max_m_s: 10.0 },
                on_membership_change: OnMembershipChange::Shift,
                take_back_fraction: 0.9,
                convergence_limit_m2_s: 6000.0,
                convergence_patience_s: 3.0,
                handoff_margin_m: 50.0,
                dwell_min_s: 3.0,
                dwell_max_s: 30.0,
                review_period_s: 30.0,
                reach_ahead_s: 30.0,
                objective: Objective::LogDet,
                assignment_inertia: 0.5,
                altitude_lowest_m: 300.0,
                altitude_step_m: 50.0,
                altitudes: Altitudes::ByGroup,
                separation_alarm_m: 50.0,
            },
            guidance: GuidanceParams {
                sense: Sense::Anticlockwise,
                radial_gain: 0.2,
                lead: Lead::Constant(3.0),
                speed_reference: SpeedReference::Ground,
                heading_gain_1_s: 2.0,
                turn_rate_gain: 0.0,
                feedforward: Feedforward::Flown,
                spacing_gain_1_s: 0.5,
                separation_rad: 90f64.to_radians(),
            },
            separation: None,
        }
    }

    /// What a UAV flies that knows nothing, or whose computer is off: the smallest orbit, where it is.
    pub fn smallest_circle(&self) -> Command {
        let (speed_m_s, radius_m) = (self.uav.speed_m_s, self.group.standoff.radius_min_m);
        Command { speed_m_s, turn_rate_rad_s: self.guidance.sense.sign() * speed_m_s / radius_m }
    }

    /// The altitude at which a UAV is that serves no group yet, m: the lowest, or its own; inside the limits.
    pub fn first_altitude_m(&self, uav: UavId) -> f64 {
        self.limit_altitude_m(self.own_altitude_m(uav).unwrap_or(self.group.altitude_lowest_m))
    }

    /// The altitude that a UAV has whatever it serves, m; `None`: that of its group.
    pub(crate) fn own_altitude_m(&self, uav: UavId) -> Option<f64> {
        let GroupParams { altitude_lowest_m, altitude_step_m, altitudes, .. } = self.group;
        match (altitudes, self.radio) {
            (Altitudes::ByGroup, Radio::Perfect) => None,
            (Altitudes::ByGroup, Radio::Fallible) | (Altitudes::ByUav, _) => {
                Some(altitude_lowest_m + f64::from(uav.0) * altitude_step_m)
            }
            (Altitudes::One, _) => Some(altitude_lowest_m),
        }
    }

    /// An altitude that may be asked for, m.
    pub(crate) fn limit_altitude_m(&self, altitude_m: f64) -> f64 {
        self.uav.climb.map_or(altitude_m, |climb| climb.limit_m(altitude_m))
    }

    /// For how long a UAV that is silent counts as being there.
    pub fn lease(&self) -> Duration {
        Duration::from_s(self.teammate_timeout_s)
    }

    /// What the UAVs cannot be carried on with over a period: [`UavParams::errors_over`].
    pub fn errors_over(&self, period: Duration) -> Vec<ParamError> {
        errors_of([("uav", self.uav.errors_over(period))])
    }

    /// Every parameter that is out of range, alone or beside another: the smallest orbit lies within the sensing range,
    /// and orbits are planned with the sensor's own field of view.
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
            .because("from the smallest orbit, radius_min_m, the centre must be seen")
            .check("track.sensor.sensing_range_m", self.track.sensor.sensing_range_m, &mut errors);
        let seen_rad = self.track.sensor.field_of_view_rad;
        if seen_rad.is_finite() {
            Allowed::exactly(seen_rad)
                .because(
                    "the sensor's own, for which orbits are made; field_of_view_margin_rad keeps targets off its edge",
                )
                .check("group.standoff.field_of_view_rad", self.group.standoff.field_of_view_rad, &mut errors);
        }
        errors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orbits_for_another_field_of_view_than_the_sensors_are_refused() {
        let mut params = TeamParams::table_1();
        params.group.standoff.field_of_view_rad = 1.25;
        let told: Vec<String> = params.errors().iter().map(ToString::to_string).collect();
        assert_eq!(
            told,
            [
                "group.standoff.field_of_view_rad = 1.25: must be exactly 1.221730476 (the sensor's own, for which orbits \
                 are made; field_of_view_margin_rad keeps targets off its edge)"
            ]
        );
        params.track.sensor.field_of_view_rad = 1.25;
        assert!(params.errors().is_empty());
        // A field of view that is none is told once.
        (params.track.sensor.field_of_view_rad, params.group.standoff.field_of_view_rad) = (f64::NAN, f64::NAN);
        assert_eq!(params.errors().iter().filter(|error| error.path.contains("field_of_view_rad")).count(), 1);
    }
}
