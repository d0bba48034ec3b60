//! What a person types: the tables and keys of a scenario file, their meaning and their defaults.
//!
//! Every number may be a distribution (see [`Number`]). Units stand at the end of the keys. Defaults are Table I of
//! the paper where it states a value; imperfections default to none. A key that is not listed here is an error.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::Number;

/// Defines a table of a scenario file: its numbers with their defaults, and its other keys.
macro_rules! table {
    (
        $(#[$table_doc:meta])*
        $name:ident {
            $($(#[$number_doc:meta])* $number:ident = $default:expr;)*
        }
        $({
            $($(#[$other_doc:meta])* $other:ident: $type:ty = $other_default:expr;)*
        })?
    ) => {
        $(#[$table_doc])*
        #[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $($(#[$number_doc])* pub $number: Number,)*
            $($($(#[$other_doc])* pub $other: $type,)*)?
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($number: Number::Constant($default),)* $($($other: $other_default,)*)? }
            }
        }

        impl $name {
            /// Every number with its key.
            pub(super) fn numbers(&mut self) -> Vec<(&'static str, &mut Number)> {
                vec![$((stringify!($number), &mut self.$number),)*]
            }
        }
    };
}

/// A scenario file.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ScenarioFile {
    /// What the scenario shows, in a line.
    pub about: String,
    /// Length of the mission, s; if absent: 100 s, or as long as the traffic file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<Number>,
    /// Time between two scans, T_s, which is also the guidance period, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period_s: Option<Number>,
    /// From when on the `..._settled` metrics count, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settle_s: Option<Number>,
    /// The UAVs.
    pub uavs: Uavs,
    /// How they know of each other.
    pub team: Team,
    /// Their sensors, as they really are.
    pub sensor: Sensor,
    /// What the UAVs' filters assume.
    pub filter: Filter,
    /// How well a search aircraft hands targets over.
    pub cue: Cue,
    /// The orbit.
    pub orbit: Orbit,
    /// Who watches whom.
    pub groups: Groups,
    /// The guidance law.
    pub guidance: Guidance,
    /// Random targets, drawn from the target model (5, 6).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub targets: Option<Targets>,
    /// Real targets, read from a traffic file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traffic: Option<Traffic>,
}

table! {
    /// `[uavs]`: how many, how they fly, where they start.
    Uavs {
        /// Nominal speed v_0 = v_d, m/s.
        speed_m_s = 40.0;
        /// Largest change of the commanded speed, m/s.
        speed_change_max_m_s = 15.0;
        /// Largest commanded turn rate, rad/s.
        turn_rate_max_rad_s = 0.3;
        /// Lag of the speed tau_v, s.
        speed_lag_s = 1.0 / 3.0;
        /// Lag of the turn rate tau_omega, s.
        turn_rate_lag_s = 1.0 / 3.0;
    } {
        /// How many; if absent: as many as `[[uavs.at]]`, or 1. A distribution is rounded.
        count: Option<Number> = None;
        /// `exact` or `euler`.
        integrator: Integrator = Integrator::Exact;
        /// Start on a ring about the targets (the default).
        ring: Option<Ring> = None;
        /// Or start here, one table per UAV.
        at: Vec<UavAt> = Vec::new();
        /// Who drops out, and when.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        outage: Vec<Outage> = Vec::new();
    }
}

table! {
    /// `[team]`: how the UAVs know of each other.
    Team {
        /// A UAV not heard for longer than this counts as lost, s.
        teammate_timeout_s = 3.0;
    } {
        /// Where the team's picture is kept: `one` for all, or `each` UAV its own.
        minds: Minds = Minds::One;
    }
}

table! {
    /// `[[uavs.outage]]`: for some time a UAV sees nothing and is not heard; it circles where it is.
    Outage {
        /// Which UAV: 0 is the first.
        uav = 0.0;
        /// From when, s.
        from_s = 0.0;
        /// Until when, s.
        until_s = 1e9;
    }
}

/// `[uavs.ring]`: a ring about the centre of the first targets; headings along it.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Ring {
    /// Radius, m; if absent: the standoff distance of the targets' start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<Number>,
    /// Direction from the centre to the first UAV, degrees anticlockwise from east; if absent 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_deg: Option<Number>,
    /// From one UAV to the next, degrees; if absent: the separation of a pair, or evenly spaced.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing_deg: Option<Number>,
}

table! {
    /// `[[uavs.at]]`: where one UAV starts.
    UavAt {
        /// East, m.
        x_m = 0.0;
        /// North, m.
        y_m = 0.0;
        /// Heading, degrees anticlockwise from east.
        heading_deg = 0.0;
        /// Speed, m/s.
        speed_m_s = 40.0;
    }
}

table! {
    /// `[sensor]`: the sensors as they are.
    Sensor {
        /// Noise of the range: standard deviation, m.
        range_sd_m = 0.0;
        /// Noise of the bearing: standard deviation, degrees.
        bearing_sd_deg = 0.0;
        /// Field of view alpha_f, degrees.
        field_of_view_deg = 70.0;
        /// Furthest range at which a target is seen, m.
        sensing_range_m = 1200.0;
    }
}

table! {
    /// `[filter]`: what the filters assume, and when a track is given up.
    Filter {
        /// A track less certain than this is lost: standard deviation of its position, m.
        lost_position_sd_m = 300.0;
        /// A track unseen for so long where it should be in plain view is lost, s.
        lost_in_view_s = 5.0;
        /// Velocity of a track that starts from a measurement: standard deviation per axis, m/s.
        start_velocity_sd_m_s = 10.0;
        /// A lost track is forgotten after this time, s.
        forget_lost_s = 600.0;
    } {
        /// Correlation rate alpha of the targets' acceleration, 1/s; if absent: that of `[targets]`, or 0.3 for traffic.
        correlation_rate_1_s: Option<Number> = None;
        /// Standard deviation sigma_a of the targets' acceleration per axis, m/s2; if absent: that of `[targets]`, or
        /// 0.75 for traffic.
        acceleration_sd_m_s2: Option<Number> = None;
        /// Assumed standard deviation sigma_r of the range, m; if absent: the sensor's, or 10 if that has none.
        range_sd_m: Option<Number> = None;
        /// Assumed standard deviation sigma_theta of the bearing, degrees; if absent: the sensor's, or 3 if that has
        /// none.
        bearing_sd_deg: Option<Number> = None;
    }
}

table! {
    /// `[cue]`: a target is handed over once, when it appears, with an error of this size.
    Cue {
        /// Standard deviation of the position per axis, m.
        position_sd_m = 20.0;
        /// Standard deviation of the velocity per axis, m/s.
        velocity_sd_m_s = 2.0;
    }
}

table! {
    /// `[orbit]`: the standoff distance (15, 16) and who is kept inside.
    Orbit {
        /// Margin eps_m taken off the field of view, degrees.
        field_of_view_margin_deg = 10.0;
        /// Smallest radius r_d,min, m.
        radius_min_m = 250.0;
        /// Largest radius r_d,max, m.
        radius_max_m = 700.0;
        /// With `margin = "standard-deviations"`: how many.
        margin_sds = 1.645;
        /// Time constant with which the radius steered for follows r_d, s; 0: at once, as in the paper.
        smoothing_s = 0.0;
        /// A target outside is taken in when the orbit with it needs at most this fraction of the largest radius.
        take_back_fraction = 0.9;
    } {
        /// `standard-deviations` of the furthest target's relative position, in metres, or `mahalanobis` as printed (16).
        margin: Margin = Margin::StandardDeviations;
        /// The centre: `filtered`, or the members' `centroid` itself.
        centre: Centre = Centre::Filtered;
        /// When members change, the centre `shift`s by the known jump, or the filter takes it for an innovation (`filter`).
        on_membership_change: OnMembershipChange = OnMembershipChange::Shift;
    }
}

table! {
    /// `[groups]`: who watches whom.
    Groups {
        /// A target is handed over when another group's centroid is nearer by more than this, m; the paper has none.
        handoff_margin_m = 50.0;
        /// Shortest dwell T_hd of a handoff (34), s.
        dwell_min_s = 3.0;
        /// Longest dwell, s; 0 switches the dwell off.
        dwell_max_s = 30.0;
        /// xi_d: a group whose UAVs' xi_th (Lemma 3.1) all stay below -xi_d loses its furthest target, m2/s.
        convergence_limit_m2_s = 6000.0;
        /// For how long they must stay below it, s.
        convergence_patience_s = 3.0;
        /// So often it is asked whether a group's UAVs could watch more targets by forming another, s; 0: never.
        review_period_s = 30.0;
        /// UAVs are not sent to targets that they cannot have within sensing range after this time, s.
        reach_ahead_s = 30.0;
        /// What staying with its group counts for a UAV in the assignment (`log-det`), in ln det per target.
        assignment_inertia = 0.5;
        /// Altitude of the lowest orbit, m.
        altitude_lowest_m = 300.0;
        /// From one group's altitude to the next, m.
        altitude_step_m = 50.0;
        /// Two UAVs of a group closer than this are reported, m.
        separation_alarm_m = 50.0;
    } {
        /// What the assignment (32) maximises: `log-det`, or `printed` for small teams.
        objective: Objective = Objective::LogDet;
    }
}

table! {
    /// `[guidance]`: the law's gains.
    Guidance {
        /// k_l of active measure 1 (20); 1 switches it off.
        radial_gain = 0.2;
        /// With `lead = "constant"`: k_rd of active measure 2 (22), s; 0 switches it off.
        lead_s = 3.0;
        /// k_omega (24), 1/s.
        heading_gain_1_s = 2.0;
        /// Gain on the turn rate's distance from the feedforward; 0, as in the paper: none.
        turn_rate_gain = 0.0;
        /// k_v (35), 1/s.
        spacing_gain_1_s = 0.5;
        /// Separation theta_d of a pair (35), degrees.
        separation_deg = 90.0;
    } {
        /// `flown` (derivative of what is flown), `exact` ((25) corrected) or `printed` ((25)).
        feedforward: Feedforward = Feedforward::Flown;
        /// `constant`, or `scheduled` to the field's own lag, k_l r_d / v.
        lead: Lead = Lead::Constant;
        /// What the nominal speed is relative to: the `ground` or the `centre`.
        speed_reference: SpeedReference = SpeedReference::Ground;
        /// `anticlockwise` or `clockwise`.
        sense: Sense = Sense::Anticlockwise;
    }
}

table! {
    /// `[targets]`: random targets.
    Targets {
        /// Correlation rate alpha of their acceleration, 1/s.
        correlation_rate_1_s = 0.1;
        /// Standard deviation sigma_a of their acceleration per axis, m/s2.
        acceleration_sd_m_s2 = 0.0;
    } {
        /// So many, each drawn by itself.
        scatter: Option<Scatter> = None;
        /// And these, one table per target.
        at: Vec<TargetAt> = Vec::new();
        /// What some of them do on purpose.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        manoeuvre: Vec<Manoeuvre> = Vec::new();
    }
}

table! {
    /// `[[targets.manoeuvre]]`: an acceleration beside the random one, for some time.
    Manoeuvre {
        /// Which target: 1 is the first of `[[targets.at]]`, those of `[targets.scatter]` follow.
        target = 1.0;
        /// From when, s.
        from_s = 0.0;
        /// Until when, s.
        until_s = 0.0;
        /// Acceleration east, m/s2.
        ax_m_s2 = 0.0;
        /// Acceleration north, m/s2.
        ay_m_s2 = 0.0;
    }
}

table! {
    /// `[targets.scatter]`: targets that are drawn, each by itself.
    Scatter {
        /// East, m.
        x_m = 0.0;
        /// North, m.
        y_m = 0.0;
        /// Velocity east, m/s.
        vx_m_s = 0.0;
        /// Velocity north, m/s.
        vy_m_s = 0.0;
        /// How many; a distribution is rounded.
        count = 1.0;
    }
}

table! {
    /// `[[targets.at]]`: where and how fast one target starts.
    TargetAt {
        /// East, m.
        x_m = 0.0;
        /// North, m.
        y_m = 0.0;
        /// Velocity east, m/s.
        vx_m_s = 0.0;
        /// Velocity north, m/s.
        vy_m_s = 0.0;
        /// Acceleration east, m/s2.
        ax_m_s2 = 0.0;
        /// Acceleration north, m/s2.
        ay_m_s2 = 0.0;
    }
}

/// `[traffic]`: targets from a file.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Traffic {
    /// SUMO floating-car data (XML) or CSV tracks, plain or gzip; relative to the scenario file.
    pub file: String,
    /// `auto`, `metres` or `degrees`.
    pub coordinates: Coordinates,
    /// A vehicle absent from the file for longer than this has dropped out, s; if absent: 1 s or 2.5 time steps of the
    /// file, whichever is longer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_s: Option<Number>,
}

/// Defines a key whose value is one of a few words.
macro_rules! words {
    ($(#[$doc:meta])* $name:ident { $($(#[$word_doc:meta])* $word:ident),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
        #[serde(rename_all = "kebab-case")]
        pub enum $name { $($(#[$word_doc])* $word,)* }
    };
}

words! {
    /// How the UAVs' motion is carried over a time step (1, 4).
    Integrator {
        /// Exactly.
        Exact,
        /// By one Euler step, as printed; both lags must be at least `period_s`.
        Euler,
    }
}
words! {
    /// Who keeps the team's picture: the same to the bit, for all hear everything.
    Minds {
        /// It is kept once, for all.
        One,
        /// Every UAV flies an agent of its own.
        Each,
    }
}
words! {
    /// The margin (16).
    Margin {
        /// Metres, from the fused covariances.
        StandardDeviations,
        /// As printed.
        Mahalanobis,
    }
}
words! {
    /// A group's centre.
    Centre {
        /// A filter of its own follows the centroid.
        Filtered,
        /// The centroid of the members' estimates.
        Centroid,
    }
}
words! {
    /// What a change of members does to a group's centre.
    OnMembershipChange {
        /// It moves by the known jump.
        Shift,
        /// Its filter takes the jump for an innovation.
        Filter,
    }
}
words! {
    /// What the assignment maximises (32).
    Objective {
        /// Sum over targets of the logarithm of the determinant of their information.
        LogDet,
        /// Determinant of the sum of all information, as printed.
        Printed,
    }
}
words! {
    /// The feedforward (25).
    Feedforward {
        /// Derivative of what is flown.
        Flown,
        /// The same along the UAV's actual motion.
        Actual,
        /// (25) made exact.
        Exact,
        /// (25) as printed.
        Printed,
    }
}
words! {
    /// The lead (22).
    Lead {
        /// `lead_s`.
        Constant,
        /// The field's own lag.
        Scheduled,
        /// The spread as it will be then.
        Predicted,
    }
}
words! {
    /// What the nominal speed is relative to.
    SpeedReference {
        /// As in (28), (29).
        Ground,
        /// So that UAVs on an orbit keep their phases.
        Centre,
    }
}
words! {
    /// Which way round the orbits are flown.
    Sense {
        /// Seen from above.
        Anticlockwise,
        /// Seen from above.
        Clockwise,
    }
}
words! {
    /// What x and y of a traffic file are.
    #[derive(Default)]
    Coordinates {
        /// The reader finds out.
        #[default]
        Auto,
        /// Metres east and north.
        Metres,
        /// Degrees of longitude and latitude.
        Degrees,
    }
}
