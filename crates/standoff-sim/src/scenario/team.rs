//! From a scenario's tables to the library's parameters: one line per value.

use standoff::{
    ClimbParams, GroupParams, GuidanceParams, Lead, LogParams, Margin, MotionParams, Radio, SensorParams,
    SeparationParams, StandoffParams, TargetParams, TeamParams, TrackParams, UavParams,
};

use super::file::{self, resolved::ScenarioFile};

/// A number that was passed on to the library.
#[derive(Debug)]
pub(super) struct Passed {
    /// Where it stands in [`TeamParams`].
    pub(super) path: &'static str,
    /// The key at which it is typed.
    pub(super) key: &'static str,
    /// The value there.
    pub(super) typed: f64,
    /// It is typed in degrees and passed on in radians.
    pub(super) is_angle: bool,
}

/// The team that a scenario describes, and where each of its numbers was typed; ranges are the library's to check.
pub(super) fn team(file: &ScenarioFile) -> (TeamParams, Vec<Passed>) {
    let mut passed = Vec::new();
    let mut pass = |path, key, typed, is_angle| {
        passed.push(Passed { path, key, typed, is_angle });
        typed
    };
    // The number of a key, for the parameter at a path.
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
        minimum_m: pass("separation.minimum_m", "separation.minimum_m", separation.minimum_m, false),
        vertical_m: pass("separation.vertical_m", "separation.vertical_m", separation.vertical_m, false),
    });
    let team = TeamParams {
        teammate_timeout_s: number!("teammate_timeout_s", team.teammate_timeout_s),
        // Whatever makes UAVs know different things is told where the file is checked.
        radio: Radio::Perfect,
        log: LogParams {
            period_s: pass("log.period_s", "period_s", file.period_s, false),
            horizon_s: number!("log.horizon_s", team.horizon_s),
            decision_lag_s: number!("log.decision_lag_s", team.decision_lag_s),
            repair_bytes_per_s: number!("log.repair_bytes_per_s", team.repair_bytes_per_s),
        },
        uav: UavParams {
            speed_m_s: number!("uav.speed_m_s", uavs.speed_m_s),
            speed_change_max_m_s: number!("uav.speed_change_max_m_s", uavs.speed_change_max_m_s),
            turn_rate_max_rad_s: number!("uav.turn_rate_max_rad_s", uavs.turn_rate_max_rad_s),
            speed_lag_s: number!("uav.speed_lag_s", uavs.speed_lag_s),
            turn_rate_lag_s: number!("uav.turn_rate_lag_s", uavs.turn_rate_lag_s),
            integrator: file.uavs.integrator.into(),
            // Who is kept apart by altitude has to fly there.
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
            lost_position_sd_m: number!("track.lost_position_sd_m", filter.lost_position_sd_m),
            lost_in_view_s: number!("track.lost_in_view_s", filter.lost_in_view_s),
            start_velocity_sd_m_s: number!("track.start_velocity_sd_m_s", filter.start_velocity_sd_m_s),
            forget_lost_s: number!("track.forget_lost_s", filter.forget_lost_s),
        },
        group: GroupParams {
            standoff: StandoffParams {
                field_of_view_rad: angle!("group.standoff.field_of_view_rad", sensor.field_of_view_deg),
                field_of_view_margin_rad: angle!(
                    "group.standoff.field_of_view_margin_rad",
                    orbit.field_of_view_margin_deg
                ),
                radius_min_m: number!("group.standoff.radius_min_m", orbit.radius_min_m),
                radius_max_m: number!("group.standoff.radius_max_m", orbit.radius_max_m),
            },
            count: file.groups.count.into(),
            search: file.groups.search.into(),
            margin: match file.orbit.margin {
                file::Margin::Mahalanobis => Margin::Mahalanobis,
                file::Margin::StandardDeviations => {
                    Margin::StandardDeviations(number!("group.margin_sds", orbit.margin_sds))
                }
            },
            centre: file.orbit.centre.into(),
            aim: file.orbit.aim.into(),
            discard: file.groups.discard.into(),
            smoothing_s: number!("group.smoothing_s", orbit.smoothing_s),
            motion: MotionParams {
                response_s: number!("group.motion.response_s", orbit.response_s),
                acceleration_max_m_s2: number!("group.motion.acceleration_max_m_s2", orbit.acceleration_max_m_s2),
                approach_max_m_s: number!("group.motion.approach_max_m_s", orbit.approach_max_m_s),
            },
            on_membership_change: file.orbit.on_membership_change.into(),
            take_back_fraction: number!("group.take_back_fraction", orbit.take_back_fraction),
            convergence_limit_m2_s: number!("group.convergence_limit_m2_s", groups.convergence_limit_m2_s),
            convergence_patience_s: number!("group.convergence_patience_s", groups.convergence_patience_s),
            handoff_margin_m: number!("group.handoff_margin_m", groups.handoff_margin_m),
            dwell_min_s: number!("group.dwell_min_s", groups.dwell_min_s),
            dwell_max_s: number!("group.dwell_max_s", groups.dwell_max_s),
            review_period_s: number!("group.review_period_s", groups.review_period_s),
            reach_ahead_s: number!("group.reach_ahead_s", groups.reach_ahead_s),
            objective: file.groups.objective.into(),
            assignment_inertia: number!("group.assignment_inertia", groups.assignment_inertia),
            altitude_lowest_m: number!("group.altitude_lowest_m", groups.altitude_lowest_m),
            altitude_step_m: number!("group.altitude_step_m", groups.altitude_step_m),
            altitudes: file.groups.altitudes.into(),
            separation_alarm_m: number!("group.separation_alarm_m", groups.separation_alarm_m),
        },
        guidance: GuidanceParams {
            sense: file.guidance.sense.into(),
            radial_gain: number!("guidance.radial_gain", guidance.radial_gain),
            lead: match file.guidance.lead {
                file::Lead::Constant => Lead::Constant(number!("guidance.lead_s", guidance.lead_s)),
                file::Lead::Predicted => Lead::Predicted,
                file::Lead::Scheduled => Lead::Scheduled,
            },
            speed_reference: file.guidance.speed_reference.into(),
            heading_gain_1_s: number!("guidance.heading_gain_1_s", guidance.heading_gain_1_s),
            turn_rate_gain: number!("guidance.turn_rate_gain", guidance.turn_rate_gain),
            feedforward: file.guidance.feedforward.into(),
            spacing_gain_1_s: number!("guidance.spacing_gain_1_s", guidance.spacing_gain_1_s),
            separation_rad: angle!("guidance.separation_rad", guidance.separation_deg),
        },
        separation,
    };
    (team, passed)
}
