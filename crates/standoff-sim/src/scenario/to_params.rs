//! Converts the tables of a scenario to the parameters of the library: one line per value.

use standoff::{
    ClimbParams, GroupingParams, GuidanceParams, Lead, LinkModel, LogParams, Margin, MotionParams, SensorParams,
    SeparationParams, StandoffParams, TargetParams, TeamParams, TrackParams, UavParams,
};

use super::schema_types::{self, resolved::ScenarioFile};

/// A number that was passed to the library.
#[derive(Debug)]
pub(super) struct Passed {
    /// Path in [`TeamParams`].
    pub(super) path: &'static str,
    /// Key at which it was typed.
    pub(super) key: &'static str,
    /// Value at that key.
    pub(super) typed: f64,
    /// True if it is typed in degrees and passed in radians.
    pub(super) is_angle: bool,
}

/// Returns the team parameters of a scenario, and the key of each of its numbers. The library checks their ranges.
pub(super) fn team(file: &ScenarioFile) -> (TeamParams, Vec<Passed>) {
    let mut passed = Vec::new();
    let mut pass = |path, key, typed, is_angle| {
        passed.push(Passed { path, key, typed, is_angle });
        typed
    };
    // Passes the number of a key as the parameter at a path.
    macro_rules! number {
        ($path:literal, $table:ident.$key:ident) => {
            pass($path, concat!(stringify!($table), ".", stringify!($key)), file.$table.$key, false)
        };
    }
    macro_rules! angle {
        ($path:literal, $table:ident.$key:ident) => {
            pass($path, concat!(stringify!($table), ".", stringify!($key)), file.$table.$key, true).to_radians()
        };
    }
    let climb = file.uavs.climb.as_ref().map(|climb| ClimbParams {
        rate_max_m_s: pass("uav.climb.rate_max_m_s", "uavs.climb.rate_max_m_s", climb.rate_max_m_s, false),
        lag_s: pass("uav.climb.lag_s", "uavs.climb.lag_s", climb.lag_s, false),
        altitude_min_m: pass("uav.climb.altitude_min_m", "uavs.climb.altitude_min_m", climb.altitude_min_m, false),
        altitude_max_m: pass("uav.climb.altitude_max_m", "uavs.climb.altitude_max_m", climb.altitude_max_m, false),
    });
    let separation = file.separation.as_ref().map(|separation| SeparationParams {
        horizontal_min_m: pass(
            "separation.horizontal_min_m",
            "separation.horizontal_min_m",
            separation.horizontal_min_m,
            false,
        ),
        vertical_min_m: pass(
            "separation.vertical_min_m",
            "separation.vertical_min_m",
            separation.vertical_min_m,
            false,
        ),
    });
    let team = TeamParams {
        teammate_timeout_s: number!("teammate_timeout_s", team.teammate_timeout_s),
        // The check of the file sets this, because it knows all faults.
        link: LinkModel::Ideal,
        log: LogParams {
            period_s: pass("log.period_s", "period_s", file.period_s, false),
            message_retention_s: number!("log.message_retention_s", team.message_retention_s),
            decision_lag_s: number!("log.decision_lag_s", team.decision_lag_s),
            retransmit_bytes_per_s: number!("log.retransmit_bytes_per_s", team.retransmit_bytes_per_s),
        },
        uav: UavParams {
            speed_m_s: number!("uav.speed_m_s", uavs.speed_m_s),
            speed_change_max_m_s: number!("uav.speed_change_max_m_s", uavs.speed_change_max_m_s),
            turn_rate_max_rad_s: number!("uav.turn_rate_max_rad_s", uavs.turn_rate_max_rad_s),
            speed_lag_s: number!("uav.speed_lag_s", uavs.speed_lag_s),
            turn_rate_lag_s: number!("uav.turn_rate_lag_s", uavs.turn_rate_lag_s),
            integrator: file.uavs.integrator.into(),
            // Vertical separation needs simulated altitudes.
            climb: climb.or(separation.map(|_| ClimbParams::default())),
        },
        track: TrackParams {
            target: TargetParams {
                correlation_rate_1_s: number!("track.target.correlation_rate_1_s", filter.correlation_rate_1_s),
                acceleration_sd_m_s2: number!("track.target.acceleration_sd_m_s2", filter.acceleration_sd_m_s2),
            },
            sensor: SensorParams {
                range_sd_m: number!("track.sensor.range_sd_m", filter.range_sd_m),
                bearing_sd_rad: angle!("track.sensor.bearing_sd_rad", filter.bearing_sd_deg),
                field_of_view_rad: angle!("track.sensor.field_of_view_rad", sensor.field_of_view_deg),
                sensing_range_m: number!("track.sensor.sensing_range_m", sensor.sensing_range_m),
            },
            deletion_position_sd_m: number!("track.deletion_position_sd_m", filter.deletion_position_sd_m),
            deletion_unseen_in_view_s: number!("track.deletion_unseen_in_view_s", filter.deletion_unseen_in_view_s),
            initial_velocity_sd_m_s: number!("track.initial_velocity_sd_m_s", filter.initial_velocity_sd_m_s),
            lost_track_retention_s: number!("track.lost_track_retention_s", filter.lost_track_retention_s),
        },
        group: GroupingParams {
            standoff: StandoffParams {
                field_of_view_margin_rad: angle!(
                    "group.standoff.field_of_view_margin_rad",
                    orbit.field_of_view_margin_deg
                ),
                radius_min_m: number!("group.standoff.radius_min_m", orbit.radius_min_m),
                radius_max_m: number!("group.standoff.radius_max_m", orbit.radius_max_m),
            },
            count: file.groups.count.into(),
            search_lost_targets: file.groups.search_lost_targets,
            margin: match file.orbit.margin {
                schema_types::Margin::Mahalanobis => Margin::Mahalanobis,
                schema_types::Margin::StandardDeviations => {
                    Margin::StandardDeviations(number!("group.margin_sds", orbit.margin_sds))
                }
            },
            centre: file.orbit.centre.into(),
            pointing: file.orbit.pointing.into(),
            removal: file.groups.removal.into(),
            radius_time_constant_s: number!("group.radius_time_constant_s", orbit.radius_time_constant_s),
            motion: MotionParams {
                time_constant_s: number!("group.motion.time_constant_s", orbit.time_constant_s),
                acceleration_max_m_s2: number!("group.motion.acceleration_max_m_s2", orbit.acceleration_max_m_s2),
                closing_speed_max_m_s: number!("group.motion.closing_speed_max_m_s", orbit.closing_speed_max_m_s),
            },
            centre_jump: file.orbit.centre_jump.into(),
            readmission_radius_fraction: number!(
                "group.readmission_radius_fraction",
                orbit.readmission_radius_fraction
            ),
            divergence_limit_m2_s: number!("group.divergence_limit_m2_s", groups.divergence_limit_m2_s),
            divergence_time_s: number!("group.divergence_time_s", groups.divergence_time_s),
            handoff_margin_m: number!("group.handoff_margin_m", groups.handoff_margin_m),
            dwell_min_s: number!("group.dwell_min_s", groups.dwell_min_s),
            dwell_max_s: number!("group.dwell_max_s", groups.dwell_max_s),
            regrouping_period_s: number!("group.regrouping_period_s", groups.regrouping_period_s),
            assignment_reach_s: number!("group.assignment_reach_s", groups.assignment_reach_s),
            objective: file.groups.objective.into(),
            assignment_switching_cost: number!("group.assignment_switching_cost", groups.assignment_switching_cost),
            altitude_lowest_m: number!("group.altitude_lowest_m", groups.altitude_lowest_m),
            altitude_step_m: number!("group.altitude_step_m", groups.altitude_step_m),
            altitude_policy: file.groups.altitude_policy.into(),
            proximity_alert_m: number!("group.proximity_alert_m", groups.proximity_alert_m),
        },
        guidance: GuidanceParams {
            orbit_direction: file.guidance.orbit_direction.into(),
            radial_gain: number!("guidance.radial_gain", guidance.radial_gain),
            lead: match file.guidance.lead {
                schema_types::Lead::Constant => Lead::Constant(number!("guidance.lead_s", guidance.lead_s)),
                schema_types::Lead::Predicted => Lead::Predicted,
                schema_types::Lead::Scheduled => Lead::Scheduled,
            },
            speed_reference: file.guidance.speed_reference.into(),
            heading_gain_1_s: number!("guidance.heading_gain_1_s", guidance.heading_gain_1_s),
            turn_rate_gain: number!("guidance.turn_rate_gain", guidance.turn_rate_gain),
            feedforward: file.guidance.feedforward.into(),
            phase_gain_1_s: number!("guidance.phase_gain_1_s", guidance.phase_gain_1_s),
            desired_phase_rad: angle!("guidance.desired_phase_rad", guidance.desired_phase_deg),
        },
        separation,
    };
    (team, passed)
}
