//! Parameters that all UAVs of a team share: limits, filters, groups and guidance law.
//!
//! This file declares each of them once, with name, unit, range, values of the presets, meaning and scenario key.
//! [`TeamParams::table`] lists them for programs: the scenario loader and its JSON schema read that list.

#[macro_use]
mod declare;
mod value;
mod words;

use crate::math::{PI, TAU};
use crate::time::Duration;
use crate::validation::{Allowed, ParamError, errors_of};
use value::{Scalar, one_line};

pub use value::Word;
pub use value::{ParamKind, ParamValue};
pub use words::{
    AltitudePolicy, CentreEstimate, CentreJump, Feedforward, GroupCount, Integrator, Law, LinkModel, Margin, Objective,
    OrbitDirection, Pointing, RemovalRule, WindBelief,
};

/// Strongest wind that orbits or geofences allow for, m/s.
pub(crate) const WIND_MAX_M_S: f64 = 100.0;

/// Minimum range of a usable measurement, m. At shorter ranges the Jacobian's 1/r diverges and the bearing is useless.
pub(crate) const RANGE_MIN_M: f64 = 1.0;

params! {
    /// Parameters of a team; every agent of the team is built from the same ones.
    ///
    /// The fields describe UAVs, sensor, targets, radio, orbits and separation. The method has more parameters, such as
    /// gains, which are tuned in simulation and rarely changed; [`Self::table`] reads and sets all by name.
    ///
    /// ```
    /// use standoff::TeamParams;
    ///
    /// let mut params = TeamParams::recommended();
    /// assert!(params.errors().is_empty());
    /// params.uav.turn_rate_max_rad_s = 12.0;
    /// assert_eq!(params.errors()[0].path, "uav.turn_rate_max_rad_s");
    /// assert!(params.errors()[0].to_string().contains("must be at least 0.001 and at most 10"));
    /// ```
    struct TeamParams at [] {
        parts {
            /// Message log and retransmission.
            log: LogParams;
            /// Speeds, lags and limits of the UAVs.
            uav: UavParams;
            /// Sensor, target model and track management.
            track: TrackParams;
            /// Orbit bounds and margins.
            group: GroupingParams;
            /// Gains of the guidance law.
            guidance: GuidanceParams;
        }
        optional {
            /// Collision avoidance. [`Self::recommended`] enables it. `None`, as in the paper: only the phases of UAVs on
            /// one orbit separate them.
            separation: SeparationParams;
            /// Flight in wind. `None`: the air is calm, and heading and airspeed are course and ground speed.
            wind: WindParams;
        }
        numbers {
            /// Teammate timeout: a UAV that is silent for longer counts as gone; until then it keeps its assignment.
            teammate_timeout_s = 3.0, "s", "team.teammate_timeout_s", Allowed::above(0.0).at_most(60.0);
        }
        others {
            /// Link model: how reliable the team expects its radio to be.
            link: LinkModel = LinkModel::Ideal;
        }
        relations |team, errors| {
            Allowed::above(team.group.standoff.radius_min_m)
                .with_reason("the centre must be in view from the smallest orbit, radius_min_m")
                .check("track.sensor.sensing_range_m", team.track.sensor.sensing_range_m, errors);
            let sensor_rad = team.track.sensor.field_of_view_rad;
            let margin_rad = team.group.standoff.field_of_view_margin_rad;
            if sensor_rad.is_finite() && margin_rad >= 0.0 {
                Allowed::at_least(0.0)
                    .below(sensor_rad)
                    .with_reason("the margin must leave some of the field of view")
                    .check("group.standoff.field_of_view_margin_rad", margin_rad, errors);
            }
        }
    }

    /// Parameters of the message log.
    struct LogParams at [log] {
        numbers {
            /// Time between two time steps of the team's grid. The grid begins at
            /// [`Time::EPOCH`](crate::Time::EPOCH).
            period_s = 0.5, "s", "period_s", Allowed::at_least(1e-3).at_most(10.0);
            /// Maximum age of a message that is still used; at most 1,200 periods are used. Applies if each UAV has its
            /// own agent.
            message_retention_s = 60.0, "s", "team.message_retention_s", Allowed::above(0.0).at_most(600.0);
            /// Decision lag: while messages are missing, the groups and assignments in use are this old, so that the
            /// UAVs act together, because most missing messages have arrived by then. Otherwise the current ones are
            /// used. Applies if each UAV has its own agent.
            decision_lag_s = 2.0, "s", "team.decision_lag_s", Allowed::at_least(0.0).at_most(10.0);
        }
        others {
            /// Bandwidth of this UAV's transmitter, bytes/s, above 0. It bounds retransmissions and snapshots, which
            /// otherwise follow the load; the report is always sent. `None`: not known.
            bandwidth_bytes_per_s: Option<f64> = None;
        }
        relations |log, errors| {
            if let Some(bytes_per_s) = log.bandwidth_bytes_per_s {
                Allowed::above(0.0).at_most(1e9).check("bandwidth_bytes_per_s", bytes_per_s, errors);
            }
        }
    }

    /// Limits and lags of a UAV.
    ///
    /// ```
    /// use standoff::{Angle, Command, Duration, Position, TeamParams, UavState};
    ///
    /// let params = TeamParams::paper().uav;
    /// let state =
    ///     UavState { position: Position::from_m(0.0, 0.0), heading: Angle::from_deg(90.0), speed_m_s: 40.0, turn_rate_rad_s: 0.0, vertical: None };
    /// let command = Command { speed_m_s: 55.0, turn_rate_rad_s: 0.3 };
    /// let next = params.response(Duration::from_s(0.5)).step(&state, command);
    /// assert!(next.speed_m_s > 40.0 && next.heading.deg() > 90.0 && next.position.y_m() > 20.0);
    /// ```
    struct UavParams at [uav] {
        optional {
            /// Climb model; `None`: the UAV reaches a commanded altitude immediately, as in the planar model of the
            /// paper.
            climb: ClimbParams;
            /// Banking aircraft; `None`, as in the paper: turn rate and speed follow their commands with lags (1).
            bank: BankParams;
        }
        numbers {
            /// Nominal speed v_0, which is also the desired speed v_d.
            speed_m_s ["v_0", "v_d"] = 40.0, "m/s", "uavs.speed_m_s", Allowed::at_least(1.0).at_most(1000.0);
            /// Maximum deviation of the commanded speed from `speed_m_s`, dv_max (2).
            speed_change_max_m_s ["dv_max"] = 15.0, "m/s", "uavs.speed_change_max_m_s",
                Allowed::at_least(0.0).with_reason("the UAV must keep flying: below speed_m_s"),
                |uav, allowed| allowed.below(uav.speed_m_s);
            /// Maximum commanded turn rate, omega_max (3).
            turn_rate_max_rad_s ["omega_max"] = 0.3, "rad/s", "uavs.turn_rate_max_rad_s",
                Allowed::at_least(1e-3).at_most(10.0);
            /// Time constant tau_v of the speed (1). With the Euler step, it is at least the period.
            speed_lag_s ["tau_v"] = 1.0 / 3.0, "s", "uavs.speed_lag_s", Allowed::at_least(1e-3).at_most(60.0);
            /// Time constant tau_omega of the turn rate (1). With the Euler step, it is at least the period.
            turn_rate_lag_s ["tau_omega"] = 1.0 / 3.0, "s", "uavs.turn_rate_lag_s",
                Allowed::at_least(1e-3).at_most(60.0);
        }
        words {
            /// Integration of the UAV's motion over a time step (4).
            integrator: Integrator = Exact, "uavs.integrator";
        }
    }

    /// Climb model and altitude limits of a UAV: a first-order lag on the climb rate, like that on the turn rate in (1).
    struct ClimbParams at [uav.climb] {
        numbers {
            /// Maximum rate of climb and of descent.
            rate_max_m_s = 3.0, "m/s", "uavs.climb.rate_max_m_s", Allowed::at_least(0.01).at_most(100.0);
            /// Time constant of the rate of climb.
            lag_s = 1.0, "s", "uavs.climb.lag_s", Allowed::at_least(1e-3).at_most(60.0);
            /// Lowest altitude that may be commanded, above the plane.
            altitude_min_m = 50.0, "m", "uavs.climb.altitude_min_m", Allowed::at_least(1.0).at_most(2e4);
            /// Highest altitude that may be commanded, above the plane.
            altitude_max_m = 3000.0, "m", "uavs.climb.altitude_max_m",
                Allowed::FINITE.at_most(2e4).with_reason("not below altitude_min_m"),
                |climb, allowed| allowed.and_at_least(climb.altitude_min_m);
        }
    }

    /// Limits of a banking aircraft, set by key. Collision avoidance and geofences predict its turns and speeds within
    /// them.
    struct BankParams at [uav.bank] {
        numbers {
            /// Maximum bank angle phi_max to either side.
            bank_max_rad = 60f64.to_radians(), "rad", "uavs.bank.bank_max_deg",
                Allowed::at_least(5f64.to_radians()).at_most(80f64.to_radians());
            /// Maximum roll rate p_max.
            roll_rate_max_rad_s = 60f64.to_radians(), "rad/s", "uavs.bank.roll_rate_max_deg_s",
                Allowed::at_least(1f64.to_radians()).at_most(720f64.to_radians());
            /// Time constant tau_phi with which the bank angle follows its command.
            roll_lag_s = 0.4, "s", "uavs.bank.roll_lag_s", Allowed::at_least(1e-3).at_most(10.0);
            /// Turn rate as a share f of that of a coordinated turn at the same bank angle.
            turn_factor = 1.0, "1", "uavs.bank.turn_factor", Allowed::at_least(0.1).at_most(1.5);
            /// Rate of climb c at full power and constant airspeed.
            climb_full_power_m_s = 5.0, "m/s", "uavs.bank.climb_full_power_m_s",
                Allowed::at_least(0.1).at_most(100.0);
            /// Rate of descent s with the engine idle at constant airspeed.
            sink_idle_m_s = 2.0, "m/s", "uavs.bank.sink_idle_m_s", Allowed::at_least(0.1).at_most(100.0);
        }
    }

    /// Parameters of the tracks.
    struct TrackParams at [track] {
        parts {
            /// Target model assumed by the filter.
            target: TargetParams;
            /// Sensor model assumed by the filter.
            sensor: SensorParams;
        }
        numbers {
            /// A track is lost if the standard deviation of its position, in the worst direction, exceeds this. Larger
            /// covariances would exceed the number precision in combination with a good sensor.
            deletion_position_sd_m = 300.0, "m", "filter.deletion_position_sd_m",
                Allowed::above(0.0).at_most(1e4);
            /// A track is lost if its target is not detected for this long although it should clearly be in view.
            deletion_unseen_in_view_s = 5.0 => 2.0, "s", "filter.deletion_unseen_in_view_s",
                Allowed::above(0.0).at_most(1e6);
            /// Standard deviation of the velocity, per axis, of a track that starts from a measurement.
            initial_velocity_sd_m_s = 10.0, "m/s", "filter.initial_velocity_sd_m_s",
                Allowed::at_least(1e-3).at_most(1e3);
            /// Rate at which targets begin to manoeuvre: to brake, start or turn harder than the target model assumes. Used
            /// for detections without label.
            manoeuvre_rate_1_s = 0.0 => 0.03, "1/s", "filter.manoeuvre_rate_1_s",
                Allowed::at_least(0.0).at_most(10.0);
            /// Rate at which slow targets stop. Used for detections without label, if the sensor has a minimum
            /// detectable velocity.
            stop_rate_1_s = 0.0 => 0.05, "1/s", "filter.stop_rate_1_s",
                Allowed::at_least(0.0).at_most(10.0);
            /// Time after which a lost track is forgotten.
            lost_track_retention_s = 600.0, "s", "filter.lost_track_retention_s",
                Allowed::above(0.0).at_most(1e6);
        }
    }

    /// Parameters of the target model.
    struct TargetParams at [track.target] {
        numbers {
            /// Correlation rate alpha of the targets' acceleration; 0: constant acceleration.
            correlation_rate_1_s ["alpha"] = 0.1, "1/s", "filter.correlation_rate_1_s",
                Allowed::at_least(0.0).at_most(100.0);
            /// Standard deviation sigma_a of the targets' acceleration, per axis.
            acceleration_sd_m_s2 ["sigma_a"] = 0.2, "m/s2", "filter.acceleration_sd_m_s2",
                Allowed::at_least(0.0).at_most(100.0);
        }
    }

    /// Parameters of the sensor.
    ///
    /// ```
    /// use standoff::{Angle, Position, TeamParams};
    ///
    /// let sensor = TeamParams::paper().track.sensor;
    /// let (uav, target) = (Position::from_m(0.0, 400.0), Position::from_m(0.0, 0.0));
    /// let south = Angle::from_deg(-90.0);
    /// let z = sensor.measure(uav, south, target).expect("the target is in view");
    /// assert_eq!((z.range_m, z.bearing), (400.0, south));
    /// // A target behind the sensor is not in view.
    /// assert!(sensor.measure(uav, Angle::from_deg(90.0), target).is_none());
    /// ```
    struct SensorParams at [track.sensor] {
        numbers {
            /// Standard deviation sigma_r of the range.
            range_sd_m ["sigma_r"] = 10.0, "m", "filter.range_sd_m", Allowed::at_least(1e-3).at_most(1e5);
            /// Standard deviation sigma_theta of the bearing.
            bearing_sd_rad ["sigma_theta"] = 3f64.to_radians(), "rad", "filter.bearing_sd_deg",
                Allowed::at_least(1e-6).at_most(PI);
            /// Field of view alpha_f of the sensor.
            field_of_view_rad ["alpha_f"] = 70f64.to_radians(), "rad", "sensor.field_of_view_deg",
                Allowed::at_least(1e-3).at_most(TAU);
            /// Maximum range at which a target is detected; above `radius_min_m` of the orbits.
            sensing_range_m = 1200.0, "m", "sensor.sensing_range_m", Allowed::above(RANGE_MIN_M).at_most(1e6);
            /// Probability p_d that a target in view is detected if it moves well above `mdv_m_s`. Used for detections
            /// without label, like all numbers below.
            detection_probability ["p_d"] = 1.0, "1", "filter.detection_probability",
                Allowed::above(0.0).at_most(1.0);
            /// Minimum detectable velocity: the radial speed over ground at which half of p_d is left; 0: no limit.
            mdv_m_s = 0.0, "m/s", "filter.mdv_m_s", Allowed::at_least(0.0).at_most(1e3);
            /// Standard deviation of the range rate, if it is measured.
            range_rate_sd_m_s = 0.5, "m/s", "filter.range_rate_sd_m_s", Allowed::at_least(1e-3).at_most(1e3);
            /// Mean number of false alarms of a scan.
            false_alarms_per_scan = 0.0, "1", "filter.false_alarms_per_scan",
                Allowed::at_least(0.0).at_most(1e3);
            /// Mean number of targets of a scan that have no track yet.
            new_targets_per_scan = 0.02, "1", "filter.new_targets_per_scan",
                Allowed::at_least(1e-9).at_most(1e3);
            /// Range below which a measurement updates a track without being linearised, if the predicted position is
            /// uncertain; 0, as in the paper: never.
            near_range_m = 0.0 => 300.0, "m", "filter.near_range_m", Allowed::at_least(0.0).at_most(1e6);
            /// Largest standard deviation of a predicted position per axis, as a fraction of its range, at which a
            /// measurement beyond `near_range_m` is linearised; 0, or if `near_range_m` is 0: any.
            linear_sd_fraction_max = 0.1, "1", "filter.linear_sd_fraction_max",
                Allowed::at_least(0.0).at_most(100.0);
            /// Standard deviation of the error of a UAV's own position, per axis.
            own_position_sd_m = 0.0, "m", "filter.own_position_sd_m", Allowed::at_least(0.0).at_most(1e4);
            /// Correlation time of that error.
            own_position_correlation_s = 30.0, "s", "filter.own_position_correlation_s",
                Allowed::at_least(0.0).at_most(1e6);
            /// Standard deviation of a constant error of a UAV's own heading, to which its bearings are relative.
            own_heading_sd_rad = 0.0, "rad", "filter.own_heading_sd_deg",
                Allowed::at_least(0.0).at_most(PI);
        }
    }

    /// Bounds and margins of the standoff distance.
    struct StandoffParams at [group.standoff] {
        numbers {
            /// Margin eps_m by which the field of view is reduced (15).
            field_of_view_margin_rad ["eps_m"] = 10f64.to_radians(), "rad", "orbit.field_of_view_margin_deg",
                Allowed::at_least(0.0).with_reason("the margin must leave some of the field of view");
            /// Minimum radius r_d,min.
            radius_min_m ["r_d,min"] = 250.0, "m", "orbit.radius_min_m", Allowed::at_least(1.0).at_most(1e5);
            /// Maximum radius r_d,max.
            radius_max_m ["r_d,max"] = 700.0, "m", "orbit.radius_max_m",
                Allowed::FINITE.at_most(1e5).with_reason("not smaller than radius_min_m"),
                |orbit, allowed| allowed.and_at_least(orbit.radius_min_m);
        }
    }

    /// Limits of the motion of an orbit's centre and radius.
    struct MotionParams at [group.motion] {
        numbers {
            /// Time constant T with which the orbit's centre and radius follow their desired values; 0: immediately.
            /// Values below the period are treated as the period.
            time_constant_s = 0.0 => 1.5, "s", "orbit.time_constant_s", Allowed::at_least(0.0).at_most(60.0);
            /// Maximum acceleration a_max of the orbit's centre and radius.
            acceleration_max_m_s2 = 1.0 => 2.5, "m/s2", "orbit.acceleration_max_m_s2",
                Allowed::above(0.0).at_most(100.0);
            /// Maximum speed c_max at which the orbit's centre and radius approach their desired values. It also limits
            /// the rate of the radius.
            closing_speed_max_m_s = 10.0 => 25.0, "m/s", "orbit.closing_speed_max_m_s",
                Allowed::above(0.0).at_most(1000.0);
        }
    }

    /// Parameters of groups.
    struct GroupingParams at [group] {
        parts {
            /// Bounds of the orbit radius and of the field of view.
            standoff: StandoffParams;
            /// Limits on the motion of centre and radius.
            motion: MotionParams;
        }
        numbers {
            /// Number of standard deviations for the margin `standard-deviations`; 1.645 is the one-sided 95 % quantile.
            margin_sds = 1.645 => 0.0, "1", "orbit.margin_sds", Allowed::at_least(0.0).at_most(100.0),
                |group, allowed| if group.margin == Margin::StandardDeviations { allowed } else { Allowed::FINITE };
            /// A target outside is admitted to a group if the orbit that includes it needs at most this fraction of the
            /// maximum radius.
            readmission_radius_fraction = 0.9 => 0.97, "1", "orbit.readmission_radius_fraction",
                Allowed::above(0.0).at_most(1.0);
            /// A target is handed off if another group's centroid is nearer by more than this. The paper has no such
            /// margin.
            handoff_margin_m = 0.0 => 50.0, "m", "groups.handoff_margin_m", Allowed::at_least(0.0).at_most(1e5);
            /// Minimum dwell time T_hd of a handoff (34).
            dwell_min_s = 3.0, "s", "groups.dwell_min_s", Allowed::at_least(0.0).at_most(3600.0);
            /// Maximum dwell time; 0 disables the dwell.
            dwell_max_s = 30.0, "s", "groups.dwell_max_s",
                Allowed::FINITE.at_most(3600.0).with_reason("not shorter than dwell_min_s"),
                |group, allowed| allowed.and_at_least(group.dwell_min_s);
            /// Limit xi_d of the removal by convergence. If xi_th (Lemma 3.1) of all UAVs of a group stays below -xi_d,
            /// the group removes its furthest target.
            divergence_limit_m2_s ["xi_d"] = 6000.0, "m2/s", "groups.divergence_limit_m2_s",
                Allowed::above(0.0).at_most(1e9);
            /// Time for which xi_th must stay below -xi_d before a removal.
            divergence_time_s = 3.0, "s", "groups.divergence_time_s", Allowed::at_least(0.0).at_most(3600.0);
            /// Period of the check whether the UAVs of a group could cover more targets by forming another group; 0, as
            /// in the paper: no check.
            regrouping_period_s = 0.0 => 30.0, "s", "groups.regrouping_period_s",
                Allowed::at_least(0.0).at_most(3600.0);
            /// UAVs are not sent to targets that they cannot bring within sensing range in this time.
            assignment_reach_s = 30.0, "s", "groups.assignment_reach_s",
                Allowed::at_least(0.0).at_most(3600.0);
            /// Switching cost of a UAV in the assignment with the objective `log-det`, in ln det per target of its
            /// current group. UAVs in flight are reassigned only for a larger gain. For comparison, a UAV twice as far
            /// away contributes 1.4 less.
            assignment_switching_cost = 0.5 => 10.0, "1", "groups.assignment_switching_cost",
                Allowed::at_least(0.0).at_most(100.0);
            /// Altitude of the lowest orbit, above the plane.
            altitude_lowest_m = 300.0, "m", "groups.altitude_lowest_m", Allowed::at_least(1.0).at_most(2e4);
            /// Step between altitudes.
            altitude_step_m = 50.0, "m", "groups.altitude_step_m", Allowed::at_least(1.0).at_most(2e4);
            /// Distance below which two UAVs of a group cause a proximity alert.
            proximity_alert_m = 50.0, "m", "groups.proximity_alert_m", Allowed::at_least(0.0).at_most(1e4);
        }
        words {
            /// Margin d_m of the standoff distance (16).
            margin: Margin = Mahalanobis => StandardDeviations, "orbit.margin";
            /// Centre of the orbit.
            centre: CentreEstimate = Filtered => EnclosingCircle, "orbit.centre";
            /// Where the UAVs of a group point their sensors.
            pointing: Pointing = GroupCentre => AngularMidpoint, "orbit.pointing";
            /// How the centre reacts to a change of members.
            centre_jump: CentreJump = Innovation => ShiftState, "orbit.centre_jump";
            /// Number of groups.
            count: GroupCount = HalfOfUavs => AsNeeded, "groups.count";
            /// Objective of the assignment of UAVs to groups (32).
            objective: Objective = LogDet, "groups.objective";
            /// Member that a group removes if its orbit cannot cover all.
            removal: RemovalRule = FurthestFromCentre => LargestRadiusReduction, "groups.removal";
            /// UAVs that share an altitude.
            altitude_policy: AltitudePolicy = PerGroup, "groups.altitude_policy";
        }
        flags {
            /// Orbits are not smaller than the turn limit about their moving centre, up to the maximum radius.
            radius_above_turn_limit = false => true, "orbit.radius_above_turn_limit";
            /// UAVs that no group needs search for lost targets.
            search_lost_targets = false => true, "groups.search_lost_targets";
        }
        relations |group, errors| {
            // The filter would continue from the centre that the motion model has moved, so that neither would behave as
            // documented.
            if group.centre == CentreEstimate::Filtered && group.motion.time_constant_s > 0.0 {
                Allowed::exactly(0.0)
                    .with_reason(
                        "a filtered centre has its own motion model; to use this one, choose the enclosing circle",
                    )
                    .check("motion.time_constant_s", group.motion.time_constant_s, errors);
            }
        }
    }

    /// Gains and options of the guidance law.
    struct GuidanceParams at [guidance] {
        numbers {
            /// Gain k_l of active measure 1 (20); 1 disables the measure.
            radial_gain ["k_l"] = 0.2, "1", "guidance.radial_gain", Allowed::at_least(1e-3).at_most(1.0);
            /// Lead time k_rd of active measure 2 (22) with the law `oh-2015`; 0 disables the measure. The law `standoff`
            /// computes its lead.
            lead_s ["k_rd"] = 3.0, "s", "guidance.lead_s", Allowed::at_least(0.0).at_most(100.0);
            /// Heading gain k_omega (24).
            heading_gain_1_s ["k_omega"] = 2.0 => 1.0, "1/s", "guidance.heading_gain_1_s",
                Allowed::above(0.0).at_most(100.0);
            /// Phase gain k_v (35).
            phase_gain_1_s ["k_v"] = 0.5, "1/s", "guidance.phase_gain_1_s",
                Allowed::at_least(0.0).at_most(100.0);
            /// Desired phase theta_d between two UAVs (35).
            desired_phase_rad ["theta_d"] = 90f64.to_radians(), "rad", "guidance.desired_phase_deg",
                Allowed::at_least(0.0).at_most(PI);
        }
        words {
            /// Named law.
            law: Law = Oh2015 => Standoff, "guidance.law";
            /// Feedforward turn rate (25) with the law `oh-2015`. That of the law `standoff` is the derivative along the
            /// motion of the UAV.
            feedforward: Feedforward = StaticCentre, "guidance.feedforward";
            /// Direction of the orbits, seen from above.
            orbit_direction: OrbitDirection = Anticlockwise, "guidance.orbit_direction";
        }
    }

    /// Minimum separation of aircraft. Two aircraft conflict only if both distances are below their minimum.
    struct SeparationParams at [separation] {
        numbers {
            /// Minimum horizontal distance.
            horizontal_min_m = 50.0, "m", "separation.horizontal_min_m", Allowed::at_least(1.0).at_most(1e4);
            /// Minimum difference of altitude.
            vertical_min_m = 30.0, "m", "separation.vertical_min_m", Allowed::at_least(1.0).at_most(1e4);
        }
    }

    /// What a team assumes about the wind.
    struct WindParams at [wind] {
        numbers {
            /// Wind speed for which orbits have room: r_d,min is the turn limit at the highest ground speed, in a wind of
            /// this speed against the motion of the centre. The same for all UAVs, unlike their estimates.
            orbit_wind_m_s = 0.0, "m/s", "wind.orbit_wind_m_s", Allowed::at_least(0.0).at_most(WIND_MAX_M_S);
            /// Time constant with which the estimate follows the difference between the ground velocity and the air
            /// velocity of the UAV.
            estimate_time_constant_s = 10.0, "s", "wind.estimate_time_constant_s",
                Allowed::at_least(1e-3).at_most(3600.0);
            /// Speed of a given wind.
            believed_speed_m_s = 0.0, "m/s", "wind.believed_speed_m_s", Allowed::at_least(0.0).at_most(100.0);
            /// Direction that a given wind blows from, clockwise from north.
            believed_from_rad = 0.0, "rad", "wind.believed_from_deg", Allowed::at_least(0.0).at_most(TAU);
        }
        words {
            /// Source of the wind that a UAV assumes.
            belief: WindBelief = Estimated, "wind.belief";
        }
    }
}

/// Declaration of a scalar parameter.
///
/// ```
/// use standoff::{ParamValue, TeamParams};
///
/// let gain = TeamParams::table().iter().find(|param| param.key == "guidance.heading_gain_1_s").expect("a parameter");
/// assert_eq!(gain.value(&TeamParams::paper()), Some(ParamValue::Number(2.0)));
/// assert_eq!(gain.value(&TeamParams::recommended()), Some(ParamValue::Number(1.0)));
///
/// let mut team = TeamParams::recommended();
/// assert!(gain.set(&mut team, ParamValue::Number(0.5)));
/// assert_eq!(gain.value(&team), Some(ParamValue::Number(0.5)));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ParamInfo {
    /// Path in [`TeamParams`]: field names joined by dots, as in [`ParamError::path`].
    pub path: &'static str,
    /// Key in scenario files, dotted. Angles are in degrees there. Two parameters may share a key.
    pub key: &'static str,
    /// Doc comment, as lines that begin with a space.
    doc: &'static str,
    /// Kind of its values.
    pub kind: ParamKind,
    get: fn(&TeamParams) -> Option<ParamValue>,
    set: fn(&mut TeamParams, ParamValue) -> bool,
}

impl ParamInfo {
    /// Returns the meaning, as one line; without unit and range.
    pub fn doc(&self) -> String {
        one_line(self.doc)
    }

    /// True for an angle or its rate in radians, which scenario files have in degrees.
    pub fn is_angle(&self) -> bool {
        match self.kind {
            ParamKind::Number { unit: "rad", .. } => true,
            ParamKind::Number { unit: "rad/s", .. } => self.key.ends_with("_deg_s"),
            _ => false,
        }
    }

    /// Returns the value in `team`; `None` if it belongs to an optional part that is absent.
    pub fn value(&self, team: &TeamParams) -> Option<ParamValue> {
        (self.get)(team)
    }

    /// Sets the value in `team`. Returns false if it belongs to an optional part that is absent, or if the value is of
    /// another kind or an unknown word.
    pub fn set(&self, team: &mut TeamParams, value: ParamValue) -> bool {
        (self.set)(team, value)
    }
}

impl Default for ClimbParams {
    /// A small fixed-wing UAV.
    fn default() -> Self {
        Self::preset(true)
    }
}

impl Default for BankParams {
    /// A small fixed-wing UAV with the rates of climb that are ArduPlane's defaults (`TECS_CLMB_MAX`, `TECS_SINK_MIN`).
    fn default() -> Self {
        Self::preset(true)
    }
}

impl Default for SeparationParams {
    fn default() -> Self {
        Self::preset(true)
    }
}

impl Default for WindParams {
    fn default() -> Self {
        Self::preset(true)
    }
}

impl TeamParams {
    /// Returns the parameters of Table I of the paper, with both active measures.
    ///
    /// The law is that of the paper, with the exact form of (25). The table does not specify the target's acceleration
    /// (here 0.2 m/s2), the sensing range (1,200 m) and the conditions under which a track is lost.
    pub fn paper() -> Self {
        Self::preset(false)
    }

    /// Returns the recommended parameters: those of [`Self::paper`] with this project's grouping and guidance
    /// and with collision avoidance, as used by scenarios that name no law. `standoff reproduce improvements` and
    /// `standoff reproduce coverage` print the measured gain of each modification.
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
        Self { separation: Some(SeparationParams::default()), ..Self::preset(true) }
    }

    /// Returns every parameter that is out of range, alone or in combination with others.
    pub fn errors(&self) -> Vec<ParamError> {
        self.out_of_range()
    }

    /// Returns the parameters of a named law: [`Self::recommended`] or [`Self::paper`].
    pub fn of_law(law: Law) -> Self {
        match law {
            Law::Standoff => Self::recommended(),
            Law::Oh2015 => Self::paper(),
        }
    }

    /// Every scalar parameter.
    pub fn table() -> &'static [ParamInfo] {
        TABLE
    }

    /// Duration that a silent UAV still counts as part of the team.
    pub(crate) fn teammate_timeout(&self) -> Duration {
        Duration::from_s(self.teammate_timeout_s)
    }

    /// Returns the UAV parameters that cannot be integrated over a period: [`UavParams::errors_for_period`].
    pub fn errors_for_period(&self, period: Duration) -> Vec<ParamError> {
        errors_of([("uav", self.uav.errors_for_period(period))])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_margin_of_at_least_the_field_of_view_is_rejected() {
        let mut params = TeamParams::paper();
        params.group.standoff.field_of_view_margin_rad = 1.25;
        let messages: Vec<String> = params.errors().iter().map(ToString::to_string).collect();
        assert_eq!(
            messages,
            ["group.standoff.field_of_view_margin_rad = 1.25: must be at least 0 and below 1.221730476 \
                 (the margin must leave some of the field of view)"]
        );
        params.track.sensor.field_of_view_rad = 1.26;
        assert!(params.errors().is_empty());
        // Each wrong number is reported once.
        for (field_of_view_rad, margin_rad) in [(f64::NAN, 0.1), (1.0, f64::NAN), (1.0, -0.1)] {
            params.track.sensor.field_of_view_rad = field_of_view_rad;
            params.group.standoff.field_of_view_margin_rad = margin_rad;
            assert_eq!(params.errors().len(), 1, "{field_of_view_rad} {margin_rad}");
        }
    }

    #[test]
    fn a_filtered_centre_excludes_the_motion_model() {
        let mut params = TeamParams::paper().group;
        params.motion.time_constant_s = 1.5;
        let messages: Vec<String> = params.out_of_range().iter().map(ToString::to_string).collect();
        assert_eq!(
            messages,
            ["motion.time_constant_s = 1.5: must be exactly 0 (a filtered centre has its own motion \
                 model; to use this one, choose the enclosing circle)"]
        );
        params.centre = CentreEstimate::EnclosingCircle;
        assert!(params.out_of_range().is_empty());
        params.motion.time_constant_s = 61.0;
        assert_eq!(params.out_of_range()[0].path, "motion.time_constant_s");
    }
}
