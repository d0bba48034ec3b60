//! From a scenario's tables to the library's parameters: one line per value.

use standoff::{
    CentreEstimate, Feedforward, GroupParams, GuidanceParams, Integrator, Lead, Margin, Objective, OnMembershipChange,
    Sense, SensorParams, SpeedReference, StandoffParams, TargetParams, TeamParams, TrackParams, UavParams,
};

use super::file::{self, ScenarioFile};
use super::number::{of, value};

/// The team that a scenario describes, angles in radians; ranges are the library's to check.
pub(super) fn team(file: &ScenarioFile) -> TeamParams {
    let ScenarioFile { uavs, sensor, filter, orbit, groups, guidance, .. } = file;
    let field_of_view_rad = value(&sensor.field_of_view_deg).to_radians();
    TeamParams {
        teammate_timeout_s: value(&file.team.teammate_timeout_s),
        uav: UavParams {
            speed_m_s: value(&uavs.speed_m_s),
            speed_change_max_m_s: value(&uavs.speed_change_max_m_s),
            turn_rate_max_rad_s: value(&uavs.turn_rate_max_rad_s),
            speed_lag_s: value(&uavs.speed_lag_s),
            turn_rate_lag_s: value(&uavs.turn_rate_lag_s),
            integrator: match uavs.integrator {
                file::Integrator::Exact => Integrator::Exact,
                file::Integrator::Euler => Integrator::Euler,
            },
        },
        track: TrackParams {
            target: TargetParams {
                correlation_rate_1_s: of(&filter.correlation_rate_1_s),
                acceleration_sd_m_s2: of(&filter.acceleration_sd_m_s2),
            },
            sensor: SensorParams {
                range_sd_m: of(&filter.range_sd_m),
                bearing_sd_rad: of(&filter.bearing_sd_deg).to_radians(),
                field_of_view_rad,
                sensing_range_m: value(&sensor.sensing_range_m),
            },
            lost_position_sd_m: value(&filter.lost_position_sd_m),
            lost_in_view_s: value(&filter.lost_in_view_s),
            start_velocity_sd_m_s: value(&filter.start_velocity_sd_m_s),
            forget_lost_s: value(&filter.forget_lost_s),
        },
        group: GroupParams {
            standoff: StandoffParams {
                field_of_view_rad,
                field_of_view_margin_rad: value(&orbit.field_of_view_margin_deg).to_radians(),
                radius_min_m: value(&orbit.radius_min_m),
                radius_max_m: value(&orbit.radius_max_m),
            },
            margin: match orbit.margin {
                file::Margin::Mahalanobis => Margin::Mahalanobis,
                file::Margin::StandardDeviations => Margin::StandardDeviations(value(&orbit.margin_sds)),
            },
            centre: match orbit.centre {
                file::Centre::Filtered => CentreEstimate::Filtered,
                file::Centre::Centroid => CentreEstimate::Centroid,
            },
            smoothing_s: value(&orbit.smoothing_s),
            on_membership_change: match orbit.on_membership_change {
                file::OnMembershipChange::Shift => OnMembershipChange::Shift,
                file::OnMembershipChange::Filter => OnMembershipChange::Filter,
            },
            take_back_fraction: value(&orbit.take_back_fraction),
            convergence_limit_m2_s: value(&groups.convergence_limit_m2_s),
            convergence_patience_s: value(&groups.convergence_patience_s),
            handoff_margin_m: value(&groups.handoff_margin_m),
            dwell_min_s: value(&groups.dwell_min_s),
            dwell_max_s: value(&groups.dwell_max_s),
            review_period_s: value(&groups.review_period_s),
            reach_ahead_s: value(&groups.reach_ahead_s),
            assignment_inertia: value(&groups.assignment_inertia),
            objective: match groups.objective {
                file::Objective::LogDet => Objective::LogDet,
                file::Objective::Printed => Objective::Printed,
            },
            altitude_lowest_m: value(&groups.altitude_lowest_m),
            altitude_step_m: value(&groups.altitude_step_m),
            separation_alarm_m: value(&groups.separation_alarm_m),
        },
        guidance: GuidanceParams {
            sense: match guidance.sense {
                file::Sense::Anticlockwise => Sense::Anticlockwise,
                file::Sense::Clockwise => Sense::Clockwise,
            },
            radial_gain: value(&guidance.radial_gain),
            lead: match guidance.lead {
                file::Lead::Constant => Lead::Constant(value(&guidance.lead_s)),
                file::Lead::Predicted => Lead::Predicted,
                file::Lead::Scheduled => Lead::Scheduled,
            },
            speed_reference: match guidance.speed_reference {
                file::SpeedReference::Ground => SpeedReference::Ground,
                file::SpeedReference::Centre => SpeedReference::Centre,
            },
            heading_gain_1_s: value(&guidance.heading_gain_1_s),
            turn_rate_gain: value(&guidance.turn_rate_gain),
            feedforward: match guidance.feedforward {
                file::Feedforward::Flown => Feedforward::Flown,
                file::Feedforward::Actual => Feedforward::Actual,
                file::Feedforward::Exact => Feedforward::Exact,
                file::Feedforward::Printed => Feedforward::Printed,
            },
            spacing_gain_1_s: value(&guidance.spacing_gain_1_s),
            separation_rad: value(&guidance.separation_deg).to_radians(),
        },
    }
}

/// Where a parameter of the library is typed, and whether it is typed in degrees.
pub(super) const KEYS: &[(&str, &str, bool)] = &[
    ("teammate_timeout_s", "team.teammate_timeout_s", false),
    ("uav.speed_m_s", "uavs.speed_m_s", false),
    ("uav.speed_change_max_m_s", "uavs.speed_change_max_m_s", false),
    ("uav.turn_rate_max_rad_s", "uavs.turn_rate_max_rad_s", false),
    ("uav.speed_lag_s", "uavs.speed_lag_s", false),
    ("uav.turn_rate_lag_s", "uavs.turn_rate_lag_s", false),
    ("track.target.correlation_rate_1_s", "filter.correlation_rate_1_s", false),
    ("track.target.acceleration_sd_m_s2", "filter.acceleration_sd_m_s2", false),
    ("track.sensor.range_sd_m", "filter.range_sd_m", false),
    ("track.sensor.bearing_sd_rad", "filter.bearing_sd_deg", true),
    ("track.sensor.field_of_view_rad", "sensor.field_of_view_deg", true),
    ("group.standoff.field_of_view_rad", "sensor.field_of_view_deg", true),
    ("track.sensor.sensing_range_m", "sensor.sensing_range_m", false),
    ("track.lost_position_sd_m", "filter.lost_position_sd_m", false),
    ("track.lost_in_view_s", "filter.lost_in_view_s", false),
    ("track.start_velocity_sd_m_s", "filter.start_velocity_sd_m_s", false),
    ("track.forget_lost_s", "filter.forget_lost_s", false),
    ("group.standoff.field_of_view_margin_rad", "orbit.field_of_view_margin_deg", true),
    ("group.standoff.radius_min_m", "orbit.radius_min_m", false),
    ("group.standoff.radius_max_m", "orbit.radius_max_m", false),
    ("group.margin_sds", "orbit.margin_sds", false),
    ("group.smoothing_s", "orbit.smoothing_s", false),
    ("group.take_back_fraction", "orbit.take_back_fraction", false),
    ("group.convergence_limit_m2_s", "groups.convergence_limit_m2_s", false),
    ("group.convergence_patience_s", "groups.convergence_patience_s", false),
    ("group.handoff_margin_m", "groups.handoff_margin_m", false),
    ("group.dwell_min_s", "groups.dwell_min_s", false),
    ("group.dwell_max_s", "groups.dwell_max_s", false),
    ("group.review_period_s", "groups.review_period_s", false),
    ("group.reach_ahead_s", "groups.reach_ahead_s", false),
    ("group.assignment_inertia", "groups.assignment_inertia", false),
    ("group.altitude_lowest_m", "groups.altitude_lowest_m", false),
    ("group.altitude_step_m", "groups.altitude_step_m", false),
    ("group.separation_alarm_m", "groups.separation_alarm_m", false),
    ("guidance.radial_gain", "guidance.radial_gain", false),
    ("guidance.lead_s", "guidance.lead_s", false),
    ("guidance.heading_gain_1_s", "guidance.heading_gain_1_s", false),
    ("guidance.turn_rate_gain", "guidance.turn_rate_gain", false),
    ("guidance.spacing_gain_1_s", "guidance.spacing_gain_1_s", false),
    ("guidance.separation_rad", "guidance.separation_deg", true),
];
