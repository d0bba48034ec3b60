//! What a person types: the tables and keys of a scenario file, their meaning and their defaults; and, from the same
//! lines, the type into which it is resolved.
//!
//! Every number may be typed as a distribution (see [`Number`]). Units stand at the end of the keys. Defaults are Table I of
//! the paper where it states a value; imperfections default to none. A key that is not listed here is an error.

use std::borrow::Cow;
use std::fmt::Display;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};
use standoff::{Agent, Allowed};

use super::draw::{Draw, Drawing};
use super::number::{Number, as_typed, lists_as_typed};
use crate::traffic;

/// Defines the tables of a scenario file twice: as they are typed, and, in [`resolved`], as they are flown. A number comes
/// with its default, and with the range in which it must be if it is not the library's to say.
macro_rules! tables {
    ($(
        $(#[$doc:meta])*
        table $name:ident
        // Texts, at first empty.
        $(texts { $($(#[$text_doc:meta])* $text:ident;)* })?
        // Lists of files, at first empty.
        $(files { $($(#[$files_doc:meta])* $files:ident;)* })?
        // Numbers.
        $(numbers { $($(#[$number_doc:meta])* $number:ident = $default:expr $(, $allowed:expr)?;)* })?
        // Numbers that follow others if they are absent: see `Absent`.
        $(absent { $($(#[$absent_doc:meta])* $absent:ident $(: $absent_allowed:expr)?;)* })?
        // Words.
        $(words { $($(#[$word_doc:meta])* $word:ident: $word_type:ident = $word_default:ident;)* })?
        // Numbers that may stay absent.
        $(optional { $($(#[$optional_doc:meta])* $optional:ident: $optional_allowed:expr;)* })?
        // Numbers that may stay absent, and of which the flight draws many: distributions stay distributions.
        $(many { $($(#[$many_doc:meta])* $many:ident: $many_allowed:expr;)* })?
        // Lists of lists of numbers, at first empty.
        $(lists { $($(#[$lists_doc:meta])* $lists:ident;)* })?
        // Tables that are typed, in the place of which others are flown.
        $(typed { $($(#[$typed_doc:meta])* $typed:ident: $typed_type:ty;)* })?
        // Tables in this one.
        $(tables { $($(#[$inner_doc:meta])* $inner:ident: $inner_type:ty;)* })?
    )*) => {
        $(
            $(#[$doc])*
            #[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
            #[serde(default, deny_unknown_fields)]
            pub struct $name {
                $($($(#[$text_doc])* pub $text: String,)*)?
                $($($(#[$files_doc])* #[serde(serialize_with = "names_alone", skip_serializing_if = "Vec::is_empty")] pub $files: Vec<String>,)*)?
                $($($(#[$number_doc])* pub $number: Number,)*)?
                $($($(#[$absent_doc])* pub $absent: Option<Number>,)*)?
                $($($(#[$word_doc])* pub $word: $word_type,)*)?
                $($($(#[$optional_doc])* pub $optional: Option<Number>,)*)?
                $($($(#[$many_doc])* pub $many: Option<Number>,)*)?
                $($($(#[$lists_doc])* pub $lists: Vec<Vec<Number>>,)*)?
                $($($(#[$typed_doc])* pub $typed: $typed_type,)*)?
                $($($(#[$inner_doc])* pub $inner: $inner_type,)*)?
            }

            impl Default for $name {
                fn default() -> Self {
                    Self {
                        $($($text: String::new(),)*)?
                        $($($files: Vec::new(),)*)?
                        $($($number: Number::Constant($default),)*)?
                        $($($absent: None,)*)?
                        $($($word: $word_type::$word_default,)*)?
                        $($($optional: None,)*)?
                        $($($many: None,)*)?
                        $($($lists: Vec::new(),)*)?
                        $($($typed: Default::default(),)*)?
                        $($($inner: Default::default(),)*)?
                    }
                }
            }

            impl Draw for $name {
                type Drawn = resolved::$name;

                fn drawn(&self, at: &dyn Display, drawing: &mut Drawing) -> resolved::$name {
                    resolved::$name {
                        $($($text: self.$text.clone(),)*)?
                        $($($files: self.$files.clone(),)*)?
                        $($($number: drawing.number(at, stringify!($number), &self.$number, [$($allowed,)? Allowed::FINITE][0]),)*)?
                        $($($absent: {
                            let typed = self.$absent.unwrap_or(drawing.absent.$absent.into());
                            drawing.number(at, stringify!($absent), &typed, [$($absent_allowed,)? Allowed::FINITE][0])
                        },)*)?
                        $($($word: self.$word,)*)?
                        $($($optional: self.$optional.map(|typed| drawing.number(at, stringify!($optional), &typed, $optional_allowed)),)*)?
                        $($($many: self.$many.inspect(|typed| drawing.check_many(at, stringify!($many), typed, $many_allowed)),)*)?
                        $($($lists: drawing.lists(at, stringify!($lists), &self.$lists),)*)?
                        $($($inner: self.$inner.drawn(&format_args!("{at}{}.", stringify!($inner)), drawing),)*)?
                    }
                }
            }
        )*

        /// The same tables with nothing left to draw or to fill in.
        pub(super) mod resolved {
            use super::*;
            $(
                $(#[$doc])*
                #[derive(Debug, Clone, PartialEq, Serialize)]
                pub(crate) struct $name {
                    $($($(#[$text_doc])* pub(crate) $text: String,)*)?
                    $($($(#[$files_doc])* #[serde(serialize_with = "names_alone", skip_serializing_if = "Vec::is_empty")] pub(crate) $files: Vec<String>,)*)?
                    $($($(#[$number_doc])* #[serde(serialize_with = "as_typed")] pub(crate) $number: f64,)*)?
                    $($($(#[$absent_doc])* #[serde(serialize_with = "as_typed")] pub(crate) $absent: f64,)*)?
                    $($($(#[$word_doc])* pub(crate) $word: $word_type,)*)?
                    $($($(#[$optional_doc])* pub(crate) $optional: Option<f64>,)*)?
                    $($($(#[$many_doc])* pub(crate) $many: Option<Number>,)*)?
                    $($($(#[$lists_doc])* #[serde(serialize_with = "lists_as_typed")] pub(crate) $lists: Vec<Vec<f64>>,)*)?
                    $($($(#[$inner_doc])* pub(crate) $inner: $inner_type,)*)?
                }
            )*
        }
    };
}

/// East or north, m.
const PLACE_M: Allowed = Allowed::at_least(-1e7).at_most(1e7);
const VELOCITY_M_S: Allowed = Allowed::at_least(-1e3).at_most(1e3);
const ACCELERATION_M_S2: Allowed = Allowed::at_least(-100.0).at_most(100.0);
const ANGLE_DEG: Allowed = Allowed::at_least(-1e6).at_most(1e6);
const TIME_S: Allowed = Allowed::at_least(0.0).at_most(1e9);
const PROBABILITY: Allowed = Allowed::at_least(0.0).at_most(1.0);
/// What is under way must be held.
const DELAY_S: Allowed = Allowed::at_least(0.0).at_most(120.0);
/// Of the target model: as the library has it.
const TARGET_MODEL: Allowed = Allowed::at_least(0.0).at_most(100.0);

tables! {
    /// A scenario file.
    table ScenarioFile texts {
        /// What the scenario shows, in a line.
        about;
    } files {
        /// Files of what lies under the vehicles: a SUMO net, GeoJSON, plain or gzip; relative to the scenario file. They are
        /// looked at only, nothing that is flown depends on them.
        map;
    } absent {
        /// Length of the mission, s; if absent: 100 s, or as long as the traffic file.
        duration_s;
        /// Time between two scans, T_s, which is also the guidance period, s.
        period_s: Allowed::at_least(0.01).at_most(Agent::GAP_MAX.s());
        /// From when on the `..._settled` metrics count, s.
        settle_s: TIME_S;
    } tables {
        /// The UAVs.
        uavs: Uavs;
        /// How they know of each other.
        team: Team;
        /// How what they say is carried; if absent: all hear everything, at once.
        radio: Option<Radio>;
        /// Their sensors, as they really are.
        sensor: Sensor;
        /// What the UAVs' filters assume.
        filter: Filter;
        /// How well a search aircraft hands targets over.
        cue: Cue;
        /// The orbit.
        orbit: Orbit;
        /// Who watches whom.
        groups: Groups;
        /// The guidance law.
        guidance: Guidance;
        /// How far apart UAVs are kept; if absent: only by their phases on an orbit.
        separation: Option<Separation>;
        /// Where UAVs may not fly, and where alone they may; if absent: everywhere.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        zones: Vec<Zone>;
        /// Aircraft that are not of the team.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        intruders: Vec<Intruder>;
        /// Random targets, drawn from the target model (5, 6).
        targets: Option<Targets>;
        /// Real targets, read from a traffic file.
        traffic: Option<Traffic>;
    }

    /// `[uavs]`: how many, how they fly, where they start.
    table Uavs numbers {
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
    } absent {
        /// How many; if absent: as many as `[[uavs.at]]`, or 1. A distribution is rounded.
        count;
    } words {
        /// `exact` or `euler`.
        integrator: Integrator = Exact;
    } many {
        /// Its computer starts so late, s, drawn for each UAV; if absent: at once.
        start_late_s: TIME_S;
    } typed {
        /// Start on a ring about the targets (the default).
        ring: Option<Ring>;
    } tables {
        /// Or start here, one table per UAV.
        at: Vec<UavAt>;
        /// Who drops out, and when.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        outage: Vec<Outage>;
        /// Whose computer starts anew, and when.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        restart: Vec<Restart>;
        /// Whose clock is off.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        clock: Vec<Clock>;
        /// How they climb; if absent: they are at once at every altitude, or, with `[separation]`, as if it were given.
        climb: Option<Climb>;
    }

    /// `[uavs.climb]`: how they climb and descend, and where they may.
    table Climb numbers {
        /// Largest rate of climb and of descent, m/s.
        rate_max_m_s = 3.0;
        /// Lag of the rate of climb, s.
        lag_s = 1.0;
        /// Lowest altitude that may be asked for, m above the plane.
        altitude_min_m = 50.0;
        /// Highest, m.
        altitude_max_m = 3000.0;
    }

    /// `[team]`: how the UAVs know of each other.
    table Team numbers {
        /// The lease: a UAV not heard for longer than this counts as gone, s.
        teammate_timeout_s = 3.0;
        /// What is heard later than this counts no more, s; of that at most 1,200 periods. With a mind for each UAV.
        horizon_s = 60.0;
        /// While words go missing, groups and duties are those of so long ago, s. With a mind for each UAV.
        decision_lag_s = 2.0;
        /// What a UAV says again for others, bytes per second at most. With a mind for each UAV.
        repair_bytes_per_s = 1500.0;
    } words {
        /// Where the team's picture is kept: `one` for all, or `each` UAV its own; if absent: `one`, or `each` where the
        /// radio, restarts, late starts or clocks are told.
        minds: Minds = One;
    }

    /// `[radio]`: how what the UAVs say is carried from one to another; as given nothing is lost, late or double.
    table Radio numbers {
        /// Probability that a message that is heard is heard twice.
        duplicate = 0.0, PROBABILITY;
    } optional {
        /// Further away nobody is heard, m; if absent: heard everywhere.
        range_m: Allowed::above(0.0).at_most(1e7);
        /// What a UAV can send; one second's worth waits, more is dropped; if absent: everything is sent at once.
        bytes_per_s: Allowed::above(0.0).at_most(1e9);
        /// From when on the radio is perfect but for partitions, s; if absent: never.
        until_s: TIME_S;
    } many {
        /// Probability that a message is lost, for each who should hear it; if absent 0.
        loss: PROBABILITY;
        /// How late a message is, for each who hears it, s; if absent 0.
        delay_s: DELAY_S;
    } tables {
        /// Who hears whom worse, or better, than others do.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        link: Vec<Link>;
        /// When the team falls apart, and into what.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        partition: Vec<Partition>;
    }

    /// `[[radio.link]]`: one way from one UAV to another.
    table Link numbers {
        /// Who speaks: 0 is the first UAV.
        from = 0.0;
        /// Who hears.
        to = 1.0;
    } many {
        /// Probability that a message is lost; if absent: that of `[radio]`.
        loss: PROBABILITY;
        /// How late a message is, s; if absent: that of `[radio]`.
        delay_s: DELAY_S;
    }

    /// `[[radio.partition]]`: for some time only those of one side hear each other.
    table Partition numbers {
        /// From when, s.
        from_s = 0.0, TIME_S;
        /// Until when, s.
        until_s = 1e9;
    } lists {
        /// The UAVs of each side; who is in none hears nobody and is not heard.
        sides;
    }

    /// `[[uavs.restart]]`: a UAV's computer is off for some time, and starts with an empty picture; meanwhile the UAV
    /// circles, unseeing and unheard.
    table Restart numbers {
        /// Which UAV: 0 is the first.
        uav = 0.0;
        /// From when, s.
        at_s = 0.0, TIME_S;
        /// For how long, s.
        down_s = 0.0, TIME_S;
    }

    /// `[[uavs.clock]]`: a UAV takes `offset_s + drift_ppm t / 1e6` more than the true time t for the time.
    table Clock numbers {
        /// Which UAV: 0 is the first.
        uav = 0.0;
        /// How far it is ahead at the start, s.
        offset_s = 0.0, Allowed::at_least(-1e6).at_most(1e6);
        /// How much too fast it is, parts per million.
        drift_ppm = 0.0, Allowed::at_least(-1e5).at_most(1e5);
    }

    /// `[[uavs.outage]]`: for some time a UAV sees nothing and is not heard; it circles where it is.
    table Outage numbers {
        /// Which UAV: 0 is the first.
        uav = 0.0;
        /// From when, s.
        from_s = 0.0, TIME_S;
        /// Until when, s.
        until_s = 1e9;
    }

    /// `[uavs.ring]`: a ring about the centre of the first targets; headings along it.
    table Ring optional {
        /// Radius, m; if absent: the standoff distance of the targets' start.
        radius_m: Allowed::above(0.0).at_most(1e6);
        /// Direction from the centre to the first UAV, degrees anticlockwise from east; if absent 0.
        phase_deg: ANGLE_DEG;
        /// From one UAV to the next, degrees; if absent: the separation of a pair, or evenly spaced.
        spacing_deg: ANGLE_DEG;
    }

    /// `[[uavs.at]]`: where one UAV starts.
    table UavAt numbers {
        /// East, m.
        x_m = 0.0, PLACE_M;
        /// North, m.
        y_m = 0.0, PLACE_M;
        /// Heading, degrees anticlockwise from east.
        heading_deg = 0.0, ANGLE_DEG;
        /// Speed, m/s.
        speed_m_s = 40.0, Allowed::above(0.0).at_most(1e3);
    } optional {
        /// Altitude, m; if absent: the lowest, or its own where each UAV has one. Where altitudes are flown.
        altitude_m: Allowed::at_least(1.0).at_most(2e4);
    }

    /// `[sensor]`: the sensors as they are.
    table Sensor numbers {
        /// Noise of the range: standard deviation, m.
        range_sd_m = 0.0, Allowed::at_least(0.0).at_most(1e5);
        /// Noise of the bearing: standard deviation, degrees.
        bearing_sd_deg = 0.0, Allowed::at_least(0.0).at_most(180.0);
        /// Field of view alpha_f, degrees.
        field_of_view_deg = 70.0;
        /// Furthest range at which a target is seen, m.
        sensing_range_m = 1200.0;
    }

    /// `[filter]`: what the filters assume, and when a track is given up.
    table Filter numbers {
        /// A track less certain than this is lost: standard deviation of its position, m.
        lost_position_sd_m = 300.0;
        /// A track unseen for so long where it should be in plain view is lost, s.
        lost_in_view_s = 2.0;
        /// Velocity of a track that starts from a measurement: standard deviation per axis, m/s.
        start_velocity_sd_m_s = 10.0;
        /// A lost track is forgotten after this time, s.
        forget_lost_s = 600.0;
    } absent {
        /// Correlation rate alpha of the targets' acceleration, 1/s; if absent: that of `[targets]`, or 0.3 for traffic.
        correlation_rate_1_s;
        /// Standard deviation sigma_a of the targets' acceleration per axis, m/s2; if absent: that of `[targets]`, or
        /// 0.75 for traffic.
        acceleration_sd_m_s2;
        /// Assumed standard deviation sigma_r of the range, m; if absent: the sensor's, or 10 if that has none.
        range_sd_m;
        /// Assumed standard deviation sigma_theta of the bearing, degrees; if absent: the sensor's, or 3 if that has
        /// none.
        bearing_sd_deg;
    }

    /// `[cue]`: a target is handed over once, when it appears, with an error of this size.
    table Cue numbers {
        /// Standard deviation of the position per axis, m.
        position_sd_m = 20.0;
        /// Standard deviation of the velocity per axis, m/s.
        velocity_sd_m_s = 2.0, Allowed::at_least(1e-3).at_most(1e3);
    }

    /// `[orbit]`: the standoff distance (15, 16) and who is kept inside.
    table Orbit numbers {
        /// Margin eps_m taken off the field of view, degrees.
        field_of_view_margin_deg = 10.0;
        /// Smallest radius r_d,min, m.
        radius_min_m = 250.0;
        /// Largest radius r_d,max, m.
        radius_max_m = 700.0;
        /// With `margin = "standard-deviations"`: how many.
        margin_sds = 0.0;
        /// Time constant with which the radius steered for follows r_d, s; 0: at once, as in the paper.
        smoothing_s = 0.0;
        /// Time constant with which the orbit's centre and radius follow what they should be, s; 0: at once.
        response_s = 1.5;
        /// Largest acceleration of the orbit's centre and radius, m/s2.
        acceleration_max_m_s2 = 2.5;
        /// Fastest that centre and radius approach what they should be, m/s.
        approach_max_m_s = 25.0;
        /// A target outside is taken in when the orbit with it needs at most this fraction of the largest radius.
        take_back_fraction = 0.97;
    } words {
        /// `standard-deviations` of the furthest target's relative position, in metres, or `mahalanobis` as printed (16).
        margin: Margin = StandardDeviations;
        /// The centre: `filtered`, the members' `centroid` itself, or that of the `smallest-circle` about them.
        centre: Centre = SmallestCircle;
        /// Sensors point at the group's `centre`, or at the `middle` of its members as each UAV sees them.
        aim: Aim = Middle;
        /// When members change, the centre `shift`s by the known jump, or the filter takes it for an innovation (`filter`).
        on_membership_change: OnMembershipChange = Shift;
    }

    /// `[groups]`: who watches whom.
    table Groups numbers {
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
        assignment_inertia = 10.0;
        /// Altitude of the lowest orbit, m.
        altitude_lowest_m = 300.0;
        /// From one group's altitude to the next, m.
        altitude_step_m = 50.0;
        /// Two UAVs of a group closer than this are reported, m.
        separation_alarm_m = 50.0;
    } words {
        /// How many groups: `half` as many as UAVs, or as many as are `needed`.
        count: GroupCount = Needed;
        /// What UAVs do that no group needs: `none`, or search for what is `lost`.
        search: Search = Lost;
        /// What the assignment (32) maximises: `log-det`, or `printed` for small teams.
        objective: Objective = LogDet;
        /// Where an orbit cannot hold all, the `furthest` goes, or who is most `widening` it.
        discard: Discard = Widening;
        /// Who shares an altitude: `by-group`, which is `by-uav` where words may be lost, `by-uav`, or `one` for all.
        altitudes: Altitudes = ByGroup;
    }

    /// `[separation]`: how far apart UAVs are kept: they may be nearer than one of the two, not than both.
    table Separation numbers {
        /// Least horizontal distance, m.
        minimum_m = 50.0;
        /// Least difference of altitudes, m.
        vertical_m = 30.0;
    }

    /// `[[zones]]`: a polygon that UAVs keep out of, or in: each in every keep-in, out of every keep-out.
    table Zone texts {
        /// What people call it.
        #[serde(skip_serializing_if = "String::is_empty")]
        name;
        /// GeoJSON with its polygons, in the place of `points`; relative to the scenario file. A record has the points.
        #[serde(serialize_with = "name_alone", skip_serializing_if = "String::is_empty")]
        file;
    } words {
        /// `keep-out` or `keep-in`.
        kind: ZoneKind = KeepOut;
    } lists {
        /// The corners in order, each [east, north], m.
        points;
    }

    /// `[[intruders]]`: an aircraft that is not of the team and keeps away from nobody: it turns at a UAV, or flies on as it does.
    table Intruder numbers {
        /// Speed, m/s.
        speed_m_s = 40.0, Allowed::above(0.0).at_most(1e3);
    } optional {
        /// The UAV that it pursues: 0 is the first; if absent none.
        pursues: Allowed::FINITE;
        /// Its turn rate where it pursues none, degrees per second, positive anticlockwise; if absent 0.
        turn_rate_deg_s: Allowed::at_least(-60.0).at_most(60.0);
        /// Start, east, m.
        x_m: PLACE_M;
        /// Start, north, m.
        y_m: PLACE_M;
        /// Or so far from the start of the UAV that it pursues, m; if absent 1,000.
        distance_m: Allowed::at_least(0.0).at_most(1e6);
        /// In this direction from there, degrees anticlockwise from east; if absent 0.
        direction_deg: ANGLE_DEG;
        /// Heading at the start, degrees anticlockwise from east; if absent: at the UAV that it pursues, or 0.
        heading_deg: ANGLE_DEG;
        /// Altitude, m; if absent: at any time that of the UAV that it pursues, or the lowest. Where altitudes are flown.
        altitude_m: Allowed::at_least(1.0).at_most(2e4);
    } tables {
        /// When it does not tell where it is.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        silent: Vec<Silence>;
    }

    /// `[[intruders.silent]]`: for some time it does not tell where it is.
    table Silence numbers {
        /// From when, s.
        from_s = 0.0, TIME_S;
        /// Until when, s.
        until_s = 1e9;
    }

    /// `[guidance]`: the law's gains.
    table Guidance numbers {
        /// k_l of active measure 1 (20); 1 switches it off.
        radial_gain = 0.2;
        /// With `lead = "constant"`: k_rd of active measure 2 (22), s; 0 switches it off.
        lead_s = 3.0;
        /// k_omega (24), 1/s.
        heading_gain_1_s = 1.0;
        /// Gain on the turn rate's distance from the feedforward; 0, as in the paper: none.
        turn_rate_gain = 0.0;
        /// k_v (35), 1/s.
        spacing_gain_1_s = 0.5;
        /// Separation theta_d of a pair (35), degrees.
        separation_deg = 90.0;
    } words {
        /// `flown` (derivative of what is flown), `exact` ((25) corrected) or `printed` ((25)).
        feedforward: Feedforward = Flown;
        /// `constant`, or `scheduled` to the field's own lag, k_l r_d / v.
        lead: Lead = Constant;
        /// What the nominal speed is relative to: the `ground` or the `centre`.
        speed_reference: SpeedReference = Ground;
        /// `anticlockwise` or `clockwise`.
        sense: Sense = Anticlockwise;
    }

    /// `[targets]`: random targets.
    table Targets numbers {
        /// Correlation rate alpha of their acceleration, 1/s.
        correlation_rate_1_s = 0.1, TARGET_MODEL;
        /// Standard deviation sigma_a of their acceleration per axis, m/s2.
        acceleration_sd_m_s2 = 0.0, TARGET_MODEL;
    } typed {
        /// So many, each drawn by itself.
        scatter: Option<Scatter>;
    } tables {
        /// And these, one table per target.
        at: Vec<TargetAt>;
        /// What some of them do on purpose.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        manoeuvre: Vec<Manoeuvre>;
    }

    /// `[[targets.manoeuvre]]`: an acceleration beside the random one, for some time.
    table Manoeuvre numbers {
        /// Which target: 1 is the first of `[[targets.at]]`, those of `[targets.scatter]` follow.
        target = 1.0;
        /// From when, s.
        from_s = 0.0, TIME_S;
        /// Until when, s.
        until_s = 0.0;
        /// Acceleration east, m/s2.
        ax_m_s2 = 0.0, ACCELERATION_M_S2;
        /// Acceleration north, m/s2.
        ay_m_s2 = 0.0, ACCELERATION_M_S2;
    }

    /// `[targets.scatter]`: targets that are drawn, each by itself.
    table Scatter numbers {
        /// East, m.
        x_m = 0.0, PLACE_M;
        /// North, m.
        y_m = 0.0, PLACE_M;
        /// Velocity east, m/s.
        vx_m_s = 0.0, VELOCITY_M_S;
        /// Velocity north, m/s.
        vy_m_s = 0.0, VELOCITY_M_S;
        /// How many; a distribution is rounded.
        count = 1.0;
    }

    /// `[[targets.at]]`: where and how fast one target starts.
    table TargetAt numbers {
        /// East, m.
        x_m = 0.0, PLACE_M;
        /// North, m.
        y_m = 0.0, PLACE_M;
        /// Velocity east, m/s.
        vx_m_s = 0.0, VELOCITY_M_S;
        /// Velocity north, m/s.
        vy_m_s = 0.0, VELOCITY_M_S;
        /// Acceleration east, m/s2.
        ax_m_s2 = 0.0, ACCELERATION_M_S2;
        /// Acceleration north, m/s2.
        ay_m_s2 = 0.0, ACCELERATION_M_S2;
    }

    /// `[traffic]`: targets from a file.
    table Traffic texts {
        /// SUMO floating-car data (XML) or CSV tracks, plain or gzip; relative to the scenario file.
        #[serde(serialize_with = "name_alone")]
        file;
    } absent {
        /// A vehicle absent from the file for longer than this has dropped out, s; if absent: 1 s or 2.5 time steps of the
        /// file, whichever is longer.
        gap_s: Allowed::above(0.0);
    } words {
        /// `auto`, `metres` or `degrees`.
        coordinates: Coordinates = Auto;
    }
}

impl ScenarioFile {
    /// Something in it makes UAVs know different things.
    pub(super) fn needs_minds(&self) -> bool {
        let Uavs { restart, clock, start_late_s, .. } = &self.uavs;
        self.radio.is_some() || !restart.is_empty() || !clock.is_empty() || start_late_s.is_some()
    }
}

/// Paths stay behind: a record says what was flown, not where.
fn name_alone<S: Serializer>(path: &str, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&name(path))
}

fn names_alone<S: Serializer>(paths: &[String], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(paths.iter().map(|path| name(path)))
}

fn name(path: &str) -> Cow<'_, str> {
    Path::new(path).file_name().unwrap_or_default().to_string_lossy()
}

/// Defines a key whose value is one of a few words, those of an enum of the library if it has one.
macro_rules! words {
    ($(#[$doc:meta])* $name:ident $(for $library_s:ty)? { $($(#[$word_doc:meta])* $word:ident),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
        #[serde(rename_all = "kebab-case")]
        pub enum $name { $($(#[$word_doc])* $word,)* }

        words!(@from $name, $($library_s,)? $($word)*);
    };
    (@from $name:ident, $library_s:ty, $($word:ident)*) => {
        impl From<$name> for $library_s {
            fn from(word: $name) -> Self {
                match word {
                    $($name::$word => Self::$word,)*
                }
            }
        }
    };
    (@from $name:ident, $($word:ident)*) => {};
}

words! {
    /// How the UAVs' motion is carried over a time step (1, 4).
    Integrator for standoff::Integrator {
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
    Centre for standoff::CentreEstimate {
        /// A filter of its own follows the centroid.
        Filtered,
        /// The centroid of the members' estimates.
        Centroid,
        /// The centre of the smallest circle about the members' estimates.
        SmallestCircle,
    }
}
words! {
    /// What sensors point at.
    Aim for standoff::Aim {
        /// The group's centre.
        Centre,
        /// The middle of the members' angular extent as the UAV sees them.
        Middle,
    }
}
words! {
    /// Whom a group lets go of whose orbit cannot hold all.
    Discard for standoff::Discard {
        /// The member furthest from the centre.
        Furthest,
        /// The one without whom the orbit is smallest.
        Widening,
    }
}
words! {
    /// What a change of members does to a group's centre.
    OnMembershipChange for standoff::OnMembershipChange {
        /// It moves by the known jump.
        Shift,
        /// Its filter takes the jump for an innovation.
        Filter,
    }
}
words! {
    /// How many groups a team forms.
    GroupCount for standoff::GroupCount {
        /// Half as many as UAVs (Algorithm 1).
        Half,
        /// As many as the targets need: one UAV is enough for a group.
        Needed,
    }
}
words! {
    /// Which side of its outline a zone leaves to the UAVs.
    ZoneKind for standoff::ZoneKind {
        /// The outside.
        KeepOut,
        /// The inside.
        KeepIn,
    }
}
words! {
    /// Who shares an altitude.
    Altitudes for standoff::Altitudes {
        /// Each group has its own.
        ByGroup,
        /// Each UAV has its own.
        ByUav,
        /// All fly at the lowest.
        One,
    }
}
words! {
    /// What UAVs do that no group needs.
    Search for standoff::Search {
        /// They watch with the others of their group.
        None,
        /// They search for lost targets, by where these can be by now.
        Lost,
    }
}
words! {
    /// What the assignment maximises (32).
    Objective for standoff::Objective {
        /// Sum over targets of the logarithm of the determinant of their information.
        LogDet,
        /// Determinant of the sum of all information, as printed.
        Printed,
    }
}
words! {
    /// The feedforward (25).
    Feedforward for standoff::Feedforward {
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
    SpeedReference for standoff::SpeedReference {
        /// As in (28), (29).
        Ground,
        /// So that UAVs on an orbit keep their phases.
        Centre,
    }
}
words! {
    /// Which way round the orbits are flown.
    Sense for standoff::Sense {
        /// Seen from above.
        Anticlockwise,
        /// Seen from above.
        Clockwise,
    }
}
words! {
    /// What x and y of a traffic file are.
    Coordinates for traffic::Coordinates {
        /// The reader finds out.
        Auto,
        /// Metres east and north.
        Metres,
        /// Degrees of longitude and latitude.
        Degrees,
    }
}
