//! Tables of a scenario file, and the keys that do not belong to a parameter of the library, with their meaning, range
//! and default.
//!
//! The parameters of the library have their keys from `TeamParams::table`. In a file, every number may be a distribution
//! (see [`Number`]), which is drawn before the tables are read. Units stand at the end of the keys. Imperfections default
//! to none. Any other key is an error.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::slice;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};
use standoff::priority::PRIORITY;
use standoff::safety::geofence::ZONE_ALTITUDE_MAX_M;
use standoff::validation::Allowed;
use standoff::{Agent, ParamValue, UavId};
use standoff_score::BUILDING_HEIGHT_MAX_M;

use super::number::{Number, as_typed, lists_as_typed};
use crate::traffic::{Coordinates, Persons};

/// Range of the numbers at a key.
pub(super) struct KeyRange {
    pub(super) key: &'static str,
    pub(super) allowed: Allowed,
    /// True for numbers that the mission draws many times: their most extreme values must be in range.
    pub(super) is_of_many: bool,
}

/// Defines the tables of a scenario file, and [`RANGES`].
macro_rules! tables {
    ($(
        $(#[$doc:meta])*
        table $name:ident
        $(texts { $($(#[$text_doc:meta])* $text:ident: $text_type:ty;)* })?
        // Numbers with their defaults and, unless they are checked elsewhere, their ranges.
        $(numbers { $($(#[$number_doc:meta])* $number:ident = $default:expr $(, $allowed:expr)?;)* })?
        $(words { $($(#[$word_doc:meta])* $word:ident: $word_type:ty;)* })?
        // Optional numbers.
        $(optional { $($(#[$optional_doc:meta])* $optional:ident: $optional_allowed:expr;)* })?
        // Other keys and tables; those with a range are numbers that the mission draws many times.
        $(others { $($(#[$other_doc:meta])* $other:ident: $other_type:ty $(, $other_allowed:expr)?;)* })?
    )*) => {
        $(
            $(#[$doc])*
            #[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
            #[serde(default, deny_unknown_fields)]
            pub struct $name {
                $($($(#[$text_doc])* pub $text: $text_type,)*)?
                $($(
                    $(#[$number_doc])*
                    #[serde(serialize_with = "as_typed")]
                    #[schemars(with = "Number")]
                    pub $number: f64,
                )*)?
                $($($(#[$word_doc])* pub $word: $word_type,)*)?
                $($($(#[$optional_doc])* #[schemars(with = "Option<Number>")] pub $optional: Option<f64>,)*)?
                $($($(#[$other_doc])* pub $other: $other_type,)*)?
            }

            impl Default for $name {
                fn default() -> Self {
                    Self {
                        $($($text: Default::default(),)*)?
                        $($($number: $default,)*)?
                        $($($word: Default::default(),)*)?
                        $($($optional: None,)*)?
                        $($($other: Default::default(),)*)?
                    }
                }
            }
        )*

        /// Ranges of numbers, by the name of their table.
        pub(super) const RANGES: &[(&str, &[KeyRange])] = &[$((stringify!($name), &[
            $($($(KeyRange { key: stringify!($number), allowed: $allowed, is_of_many: false },)?)*)?
            $($(KeyRange { key: stringify!($optional), allowed: $optional_allowed, is_of_many: false },)*)?
            $($($(KeyRange { key: stringify!($other), allowed: $other_allowed, is_of_many: true },)?)*)?
        ]),)*];
    };
}

/// Default of a number that depends on other parts of the scenario, and is filled in later.
const ABSENT: f64 = f64::NAN;

fn is_absent(number: &f64) -> bool {
    number.is_nan()
}

/// Values of the library's parameters by key, in the units of the keys. Those of absent parts have no effect.
pub(super) type Parameters = BTreeMap<&'static str, ParamValue>;

/// Floor or ceiling of a zone, m.
pub(super) const ZONE_ALTITUDE_M: Allowed = Allowed::at_least(0.0).at_most(ZONE_ALTITUDE_MAX_M);
/// Maximum distance east or north, m.
pub(super) const PLACE_MAX_M: f64 = 1e7;
/// East or north, m.
const PLACE_M: Allowed = Allowed::at_least(-PLACE_MAX_M).at_most(PLACE_MAX_M);
const VELOCITY_M_S: Allowed = Allowed::at_least(-1e3).at_most(1e3);
const ACCELERATION_M_S2: Allowed = Allowed::at_least(-100.0).at_most(100.0);
const ANGLE_DEG: Allowed = Allowed::at_least(-1e6).at_most(1e6);
const TIME_S: Allowed = Allowed::at_least(0.0).at_most(1e9);
const PROBABILITY: Allowed = Allowed::at_least(0.0).at_most(1.0);
/// Latency, s; limited because messages in transit are kept in memory.
const DELAY_S: Allowed = Allowed::at_least(0.0).at_most(120.0);
/// Parameters of the target model; the same range as in the library.
const TARGET_MODEL: Allowed = Allowed::at_least(0.0).at_most(100.0);

tables! {
    /// A scenario file.
    table ScenarioFile texts {
        /// Description of the scenario, one line of at most 1,000 characters.
        about: String;
        /// Background maps: files with a SUMO net or GeoJSON, plain or gzip, relative to the scenario file; at most 16.
        /// They are only displayed and do not affect the mission.
        #[serde(serialize_with = "names_alone", skip_serializing_if = "Vec::is_empty")]
        basemap: Vec<String>;
    } numbers {
        /// Cut-off distance of GOSPA, m; 0.1 to 1e6.
        gospa_cutoff_m = 20.0, Allowed::at_least(0.1).at_most(1e6);
        /// Length of the mission, s; from one `period_s` to ten million of them. If absent: 100 s, or the length of the
        /// traffic file.
        #[serde(skip_serializing_if = "is_absent")]
        duration_s = ABSENT;
        /// Time between two scans, T_s, which is also the guidance period, s; 0.01 to 10.
        period_s = 0.5, Allowed::at_least(0.01).at_most(Agent::TIME_JUMP_MAX.s());
        /// Start of the interval that the `..._settled` metrics evaluate, s; 0 to 1e9.
        transient_s = 30.0, TIME_S;
    } others {
        /// UAVs: number, flight dynamics and starts.
        uavs: Uavs;
        /// How the team shares its state.
        team: Team;
        /// Radio faults. If absent: the radio is ideal, and every message is received in the time step in which it was
        /// sent.
        radio: Option<Radio>;
        /// True properties of the sensors.
        sensor: Sensor;
        /// Errors of the UAVs' own positions and headings.
        navigation: Navigation;
        /// Assumptions of the UAVs' filters, and the rules for lost tracks.
        filter: Filter;
        /// Accuracy of the cues that report new targets to the team.
        cue: Cue;
        /// Orbit of a group: radius, centre and sensor pointing.
        orbit: Orbit;
        /// Groups, and the assignment of UAVs to them.
        groups: Groups;
        /// Guidance law.
        guidance: Guidance;
        /// Collision avoidance: minimum distances between aircraft. `false`: only their phases on an orbit
        /// separate UAVs.
        separation: Switchable;
        /// Geofence: keep-out and keep-in zones. If absent: UAVs may fly everywhere.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        geofence: Vec<Zone>;
        /// Wind. If absent: the air is calm.
        wind: Option<Wind>;
        /// Surroundings: buildings that hide targets from the sensors. If absent: none.
        world: Option<World>;
        /// Aircraft outside the team; at most 100.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        intruders: Vec<Intruder>;
        /// Random targets, drawn from the target model (5, 6).
        targets: Option<Targets>;
        /// Targets from a traffic file, instead of `[targets]`.
        traffic: Option<Traffic>;
        /// Targets and areas that matter more or less than others. If absent: all targets have the priority 1, or that
        /// of the traffic file.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        priorities: Vec<Priority>;
        /// Parameters of the library, whose keys are in several tables.
        #[serde(skip)]
        parameters: Parameters;
    }

    /// `[uavs]`: number, flight dynamics and starts of the UAVs.
    table Uavs numbers {
        /// Number of UAVs, 1 to 4,096; with one agent each, 1 to 100. If absent: the number of `[[uavs.start]]` tables,
        /// or 1. A drawn value is rounded.
        #[serde(skip_serializing_if = "is_absent")]
        count = ABSENT;
    } words {
        /// Flight dynamics of the true aircraft: `kinematic` or `bank`.
        dynamics: Dynamics;
    } others {
        /// Delay after which a UAV's computer starts, s; 0 to 1e9. Drawn for each UAV. If absent: 0.
        boot_delay_s: Option<Number>, TIME_S;
        /// Start on a ring about the targets. If absent, and without `[[uavs.start]]`: on orbits about the groups of
        /// targets.
        start_ring: Option<Ring>;
        /// Start of each UAV, one table per UAV, instead of a ring.
        start: Vec<UavAt>;
        /// Outages of sensor and transmitter.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        outage: Vec<Outage>;
        /// Restarts of computers.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        restart: Vec<Restart>;
        /// Errors of clocks, at most one table per UAV.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        clock: Vec<Clock>;
        /// Climb and descent. If absent: the defaults of this table, or immediate changes of altitude if `separation`
        /// is `false`.
        climb: Option<Climb>;
        /// Banking aircraft; only with the dynamics `bank`. If absent: the defaults of this table.
        bank: Option<Bank>;
    }

    /// `[uavs.climb]`: how UAVs climb and descend, and between which altitudes.
    table Climb

    /// `[uavs.bank]`: limits of a banking aircraft, which its agent knows, and how it interprets a commanded speed.
    table Bank words {
        /// How the aircraft interprets a commanded speed: `true-airspeed` or `equivalent-airspeed`.
        speed_command: SpeedCommand;
    }

    /// `[team]`: how the team shares its state.
    table Team words {
        /// One agent for all UAVs (`shared`), or one for each UAV (`per-uav`). If absent: `shared`, or `per-uav` if
        /// the scenario has a radio, restarts, late starts or clocks.
        agents: AgentSetup;
    }

    /// `[radio]`: how messages are transmitted between UAVs. With the defaults, no message is lost, late or duplicated.
    /// Cues come from outside the team: they are lost, late and duplicated like messages, but their range is unlimited.
    table Radio numbers {
        /// Probability that a received message is received twice, 0 to 1.
        duplication = 0.0, PROBABILITY;
    } optional {
        /// Range beyond which no message is received, m; above 0, at most 1e7. If absent: unlimited.
        range_m: Allowed::above(0.0).at_most(1e7);
        /// Bandwidth of a UAV's transmitter, bytes/s; above 0, at most 1e9. Messages of up to one second wait; further
        /// messages are dropped. Agents limit their retransmissions to it. If absent: unlimited.
        bandwidth_bytes_per_s: Allowed::above(0.0).at_most(1e9);
        /// Time at which all faults except partitions end, s; 0 to 1e9. If absent: never.
        fault_until_s: TIME_S;
    } others {
        /// Probability that a message is lost, 0 to 1, for each receiver. A distribution is drawn for each message and
        /// receiver. If absent: 0.
        packet_loss: Option<Number>, PROBABILITY;
        /// Latency of a message, s; 0 to 120. A distribution is drawn for each message and receiver. If absent: 0.
        latency_s: Option<Number>, DELAY_S;
        /// Links that differ from the others.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        link: Vec<Link>;
        /// Times in which the team is split into parts that cannot communicate.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        partition: Vec<Partition>;
    }

    /// `[[radio.link]]`: the link from one UAV to another, in one direction.
    table Link numbers {
        /// Sender, counted from 0.
        from = 0.0;
        /// Receiver, counted from 0.
        to = 1.0;
    } others {
        /// Probability that a message is lost, 0 to 1. If absent: that of `[radio]`.
        packet_loss: Option<Number>, PROBABILITY;
        /// Latency of a message, s; 0 to 120. If absent: that of `[radio]`.
        latency_s: Option<Number>, DELAY_S;
    }

    /// `[[radio.partition]]`: for some time, only UAVs on the same side receive each other's messages.
    table Partition numbers {
        /// Start, s; 0 to 1e9.
        from_s = 0.0, TIME_S;
        /// End, s; `from_s` to 1e9.
        until_s = 1e9;
    } others {
        /// UAVs of each side, as lists. A UAV on no side neither sends to nor receives from any other UAV.
        #[serde(serialize_with = "lists_as_typed")]
        #[schemars(with = "Vec<Vec<Number>>")]
        sides: Vec<Vec<f64>>;
    }

    /// `[[uavs.restart]]`: the computer of a UAV is off for some time and then starts with an empty team state.
    /// Meanwhile the UAV circles, and neither measures, sends nor receives.
    table Restart numbers {
        /// UAV, counted from 0.
        uav = 0.0;
        /// Time at which the computer goes off, s; 0 to 1e9.
        at_s = 0.0, TIME_S;
        /// Time for which it stays off, s; 0 to 1e9.
        down_s = 0.0, TIME_S;
    }

    /// `[[uavs.clock]]`: the clock of a UAV is ahead of the true time t by `offset_s + drift_ppm t / 1e6`.
    table Clock numbers {
        /// UAV, counted from 0.
        uav = 0.0;
        /// Offset at the start, s; -1e6 to 1e6.
        offset_s = 0.0, Allowed::at_least(-1e6).at_most(1e6);
        /// Drift, parts per million; positive if the clock is fast; -1e5 to 1e5.
        drift_ppm = 0.0, Allowed::at_least(-1e5).at_most(1e5);
    }

    /// `[[uavs.outage]]`: for some time, a UAV neither measures nor sends; it circles at its position.
    table Outage numbers {
        /// UAV, counted from 0.
        uav = 0.0;
        /// Start, s; 0 to 1e9.
        from_s = 0.0, TIME_S;
        /// End, s; `from_s` to 1e9.
        until_s = 1e9;
    }

    /// `[uavs.start_ring]`: UAVs start on a ring about the centre of the first targets, with headings along the ring.
    table Ring optional {
        /// Radius, m; above 0, at most 1e6. If absent: the standoff distance for the starts of the targets.
        radius_m: Allowed::above(0.0).at_most(1e6);
        /// Direction from the centre to UAV 0, degrees anticlockwise from east. If absent: 0.
        phase_deg: ANGLE_DEG;
        /// Angle from one UAV to the next, degrees. If absent: `guidance.desired_phase_deg` for two UAVs, otherwise
        /// even spacing.
        spacing_deg: ANGLE_DEG;
    }

    /// `[[uavs.start]]`: start of one UAV.
    table UavAt numbers {
        /// East, m; -1e7 to 1e7.
        x_m = 0.0, PLACE_M;
        /// North, m; -1e7 to 1e7.
        y_m = 0.0, PLACE_M;
        /// Heading, degrees anticlockwise from east.
        heading_deg = 0.0, ANGLE_DEG;
        /// Speed, in wind the airspeed, m/s; above 0, at most 1,000.
        speed_m_s = 40.0, Allowed::above(0.0).at_most(1e3);
    } optional {
        /// Altitude, m; 1 to 20,000. Applies if altitudes are simulated. If absent: the lowest altitude, or that of the
        /// UAV if each UAV has its own.
        altitude_m: Allowed::at_least(1.0).at_most(2e4);
    }

    /// `[sensor]`: true properties of the sensors.
    table Sensor numbers {
        /// Standard deviation of the range noise, m; 0 to 1e5.
        range_sd_m = 0.0, Allowed::at_least(0.0).at_most(1e5);
        /// Standard deviation of the bearing noise, degrees; 0 to 180.
        bearing_sd_deg = 0.0, Allowed::at_least(0.0).at_most(180.0);
        /// Probability p_d that a target in view is detected in a scan if it moves well above `mdv_m_s`; above 0, at
        /// most 1.
        detection_probability = 1.0, Allowed::above(0.0).at_most(1.0);
        /// Minimum detectable velocity (MDV), m/s; 0 to 100. A target with the radial speed v over ground is detected
        /// with the probability p_d (1 - exp(-ln 2 (v / mdv)^2)); 0: with p_d.
        mdv_m_s = 0.0, Allowed::at_least(0.0).at_most(100.0);
        /// Mean number of false alarms of a scan, uniform over the area in view; 0 to 1,000. Above 0 only with the
        /// labels `none`.
        false_alarms_per_scan = 0.0, Allowed::at_least(0.0).at_most(1e3);
    } words {
        /// Whether detections and cues have the identity of their target: `all` or `none`.
        labels: Labels;
    } optional {
        /// Standard deviation of the range rate, m/s; 0 to 1,000. If absent: the sensors do not measure it.
        range_rate_sd_m_s: Allowed::at_least(0.0).at_most(1e3);
    }

    /// `[navigation]`: errors of the position and heading that each UAV assumes to have.
    table Navigation numbers {
        /// Standard deviation of the position error, per axis, m; 0 to 1,000.
        position_sd_m = 0.0, Allowed::at_least(0.0).at_most(1e3);
        /// Correlation time of the position error, s; 0 to 1e6. The error of each axis is a first-order Gauss-Markov
        /// process.
        correlation_s = 30.0, Allowed::at_least(0.0).at_most(1e6);
        /// Standard deviation of the heading error, degrees; 0 to 180. The error is drawn once for each UAV and constant.
        /// It rotates the heading, the boresight and all bearings of the UAV.
        heading_bias_deg = 0.0, Allowed::at_least(0.0).at_most(180.0);
    }

    /// `[filter]`: assumptions of the filters, and the rules for lost tracks.
    table Filter

    /// `[cue]`: errors of the cue that reports each target once, when it appears.
    table Cue numbers {
        /// Standard deviation of the position, per axis, m; at least 0.001, below `filter.deletion_position_sd_m`.
        position_sd_m = 20.0;
        /// Standard deviation of the velocity, per axis, m/s; 0.001 to 1,000.
        velocity_sd_m_s = 2.0, Allowed::at_least(1e-3).at_most(1e3);
    }

    /// `[orbit]`: standoff distance (15, 16), centre of the orbit, and sensor pointing.
    table Orbit

    /// `[groups]`: groups, and the assignment of UAVs to them.
    table Groups

    /// `[separation]`: minimum distances of collision avoidance. Two aircraft may violate one of the two, but not both
    /// at the same time.
    table Separation

    /// `[[geofence]]`: a zone of the geofence, a polygon or a circle. A UAV must be inside every keep-in zone and
    /// outside every keep-out zone.
    table Zone texts {
        /// Name of the zone, for display; at most 100 characters.
        #[serde(skip_serializing_if = "String::is_empty")]
        name: String;
        /// File with the zones, relative to the scenario file, instead of `vertices` or a circle: GeoJSON, a plan of
        /// QGroundControl (`.plan`) or KML. A record contains the zones.
        #[serde(serialize_with = "name_alone", skip_serializing_if = "String::is_empty")]
        file: String;
    } words {
        /// Kind of the zone: `keep-out` or `keep-in`.
        kind: ZoneKind;
        /// Unit of the zone's coordinates: `auto`, `metres` or `degrees` (those of a `file` or of `lat_deg`, `lon_deg`).
        /// With `auto`, a GeoJSON file that can be in degrees is, and a zone smaller than 1 m is rejected.
        #[serde(skip_serializing_if = "is_auto")]
        coordinates: Coordinates;
    } optional {
        /// Centre of a circle, east, m; -1e7 to 1e7; with `radius_m`.
        x_m: PLACE_M;
        /// Centre of a circle, north, m; -1e7 to 1e7.
        y_m: PLACE_M;
        /// Centre of a circle, degrees north; -90 to 90; instead of `x_m` and `y_m` if the traffic is in degrees
        /// or the basemap has its net.
        lat_deg: Allowed::at_least(-90.0).at_most(90.0);
        /// Centre of a circle, degrees east; -180 to 180.
        lon_deg: Allowed::at_least(-180.0).at_most(180.0);
        /// Radius of a circle, m; 1 to 1e6; instead of `vertices`.
        radius_m: Allowed::at_least(1.0).at_most(1e6);
        /// Floor, m above the plane; 0 to 100,000. If absent: no lower limit.
        altitude_min_m: ZONE_ALTITUDE_M;
        /// Ceiling, m above the plane; `altitude_min_m` to 100,000. If absent: no upper limit.
        altitude_max_m: ZONE_ALTITUDE_M;
        /// Index, from 0, of an earlier zone of the same kind, floor and ceiling, of which this is a further part: both are
        /// one zone, their union. If absent: a separate zone.
        part_of: Allowed::at_least(0.0).at_most(99.0);
    } others {
        /// Vertices in order, each [east, north], m.
        #[serde(serialize_with = "lists_as_typed")]
        #[schemars(with = "Vec<Vec<Number>>")]
        vertices: Vec<Vec<f64>>;
    }

    /// `[wind]`: the true wind, and what the UAVs assume about it. In wind, `uavs.speed_m_s` and the speed limits are
    /// airspeeds, and the starts of UAVs are heading and airspeed.
    table Wind numbers {
        /// Speed at the reference height, m/s; 0 to 100.
        speed_m_s = 5.0, Allowed::at_least(0.0).at_most(100.0);
        /// Direction that the wind blows from, degrees clockwise from north; 0 to 360.
        from_deg = 270.0, Allowed::at_least(0.0).at_most(360.0);
        /// Exponent of the power law by which the speed grows with the height; 0 to 0.5. 0: the same wind at all heights.
        shear_exponent = 0.0, Allowed::at_least(0.0).at_most(0.5);
        /// Reference height above the plane, m; 1 to 20,000.
        reference_height_m = 10.0, Allowed::at_least(1.0).at_most(2e4);
        /// Wind speed at 20 feet that determines the intensity of Dryden gusts, m/s; 0 to 50. Light turbulence: 7.7,
        /// moderate: 15.4, severe: 23.2; 0: none.
        gust_w20_m_s = 0.0, Allowed::at_least(0.0).at_most(50.0);
    }

    /// `[world]`: buildings. A target is not in view if the straight line from the UAV to it, on the ground, passes
    /// through a building below its height. Altitudes are then simulated.
    table World texts {
        /// File with the buildings, relative to the scenario file: GeoJSON or SUMO polygons (`.poly.xml`), plain or
        /// gzip. A record contains the buildings.
        #[serde(serialize_with = "name_alone", skip_serializing_if = "String::is_empty")]
        buildings: String;
        /// Buildings, each `HEIGHT: X,Y X,Y X,Y` in whole centimetres: height, then the vertices of the outline and,
        /// after `;`, of each courtyard. Without `HEIGHT:`, `building_height_m` applies. At most 20,000 buildings with
        /// 100,000 vertices. Those of the file are added.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        building_outlines_cm: Vec<String>;
    } numbers {
        /// Height of the buildings without one in the file, m; above 0, at most 1,000.
        building_height_m = 10.0, Allowed::above(0.0).at_most(BUILDING_HEIGHT_MAX_M);
    }

    /// `[[intruders]]`: an aircraft outside the team that avoids no other aircraft. It pursues a UAV, or flies with a
    /// constant turn rate.
    table Intruder numbers {
        /// Speed, in wind the airspeed, m/s; above 0, at most 1,000.
        speed_m_s = 40.0, Allowed::above(0.0).at_most(1e3);
    } optional {
        /// UAV that it pursues, counted from 0. If absent: none.
        pursued_uav: Allowed::FINITE;
        /// Turn rate if it pursues no UAV, degrees per second, positive anticlockwise; -60 to 60. If absent: 0.
        turn_rate_deg_s: Allowed::at_least(-60.0).at_most(60.0);
        /// Start, east, m; -1e7 to 1e7.
        x_m: PLACE_M;
        /// Start, north, m; -1e7 to 1e7.
        y_m: PLACE_M;
        /// Distance from the start of the pursued UAV, m; 0 to 1e6; instead of `x_m` and `y_m`. If absent: 1,000.
        distance_m: Allowed::at_least(0.0).at_most(1e6);
        /// Direction from the start of the pursued UAV, degrees anticlockwise from east. If absent: 0.
        bearing_deg: ANGLE_DEG;
        /// Initial heading, degrees anticlockwise from east. If absent: towards the pursued UAV, or 0.
        heading_deg: ANGLE_DEG;
        /// Altitude, m; 1 to 20,000. Applies if altitudes are simulated. If absent: always that of the pursued UAV, or
        /// the lowest altitude.
        altitude_m: Allowed::at_least(1.0).at_most(2e4);
    } others {
        /// Times in which it does not broadcast its position.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        transponder_off: Vec<Silence>;
    }

    /// `[[intruders.transponder_off]]`: a time in which the intruder does not broadcast its position.
    table Silence numbers {
        /// Start, s; 0 to 1e9.
        from_s = 0.0, TIME_S;
        /// End, s; `from_s` to 1e9.
        until_s = 1e9;
    }

    /// `[guidance]`: gains and options of the guidance law.
    table Guidance

    /// `[targets]`: random targets.
    table Targets numbers {
        /// Correlation rate alpha of the targets' acceleration, 1/s; 0 to 100.
        correlation_rate_1_s = 0.1, TARGET_MODEL;
        /// Standard deviation sigma_a of the targets' acceleration, per axis, m/s2; 0 to 100.
        acceleration_sd_m_s2 = 0.0, TARGET_MODEL;
    } others {
        /// Targets with random starts.
        random: Option<Scatter>;
        /// Targets with given starts, one table per target; at most 16,384 targets in total.
        start: Vec<TargetAt>;
        /// Manoeuvres of single targets.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        manoeuvre: Vec<Manoeuvre>;
    }

    /// `[[targets.manoeuvre]]`: for some time, an acceleration in addition to the random one.
    table Manoeuvre numbers {
        /// Target: 0 is the first of `[[targets.start]]`; those of `[targets.random]` follow.
        target = 0.0;
        /// Start, s; 0 to 1e9.
        from_s = 0.0, TIME_S;
        /// End, s; `from_s` to 1e9.
        until_s = 0.0;
        /// Acceleration east, m/s2; -100 to 100.
        ax_m_s2 = 0.0, ACCELERATION_M_S2;
        /// Acceleration north, m/s2; -100 to 100.
        ay_m_s2 = 0.0, ACCELERATION_M_S2;
    }

    /// `[targets.random]`: targets with random starts, each drawn independently.
    table Scatter numbers {
        /// Number of these targets; at least 1, at most 16,384 targets in total. A drawn value is rounded.
        count = 1.0;
    } others {
        /// East, m; -1e7 to 1e7.
        x_m: Number, PLACE_M;
        /// North, m; -1e7 to 1e7.
        y_m: Number, PLACE_M;
        /// Velocity east, m/s; -1,000 to 1,000.
        vx_m_s: Number, VELOCITY_M_S;
        /// Velocity north, m/s; -1,000 to 1,000.
        vy_m_s: Number, VELOCITY_M_S;
    }

    /// `[[targets.start]]`: start of one target.
    table TargetAt numbers {
        /// East, m; -1e7 to 1e7.
        x_m = 0.0, PLACE_M;
        /// North, m; -1e7 to 1e7.
        y_m = 0.0, PLACE_M;
        /// Velocity east, m/s; -1,000 to 1,000.
        vx_m_s = 0.0, VELOCITY_M_S;
        /// Velocity north, m/s; -1,000 to 1,000.
        vy_m_s = 0.0, VELOCITY_M_S;
        /// Acceleration east, m/s2; -100 to 100.
        ax_m_s2 = 0.0, ACCELERATION_M_S2;
        /// Acceleration north, m/s2; -100 to 100.
        ay_m_s2 = 0.0, ACCELERATION_M_S2;
    }

    /// `[[priorities]]`: a priority, and the targets that have it, by name or by an area around them. A target of
    /// priority 5 counts as much as five targets of priority 1. Of several areas, the highest priority counts.
    table Priority optional {
        /// Priority, required; 0.01 to 100.
        priority: PRIORITY;
        /// Centre of a circle, east, m; -1e7 to 1e7; with `radius_m`.
        x_m: PLACE_M;
        /// Centre of a circle, north, m; -1e7 to 1e7.
        y_m: PLACE_M;
        /// Centre of a circle, degrees north; -90 to 90; instead of `x_m` and `y_m` if the traffic is in degrees
        /// or the basemap has its net.
        lat_deg: Allowed::at_least(-90.0).at_most(90.0);
        /// Centre of a circle, degrees east; -180 to 180.
        lon_deg: Allowed::at_least(-180.0).at_most(180.0);
        /// Radius of a circle, m; 1 to 1e6.
        radius_m: Allowed::at_least(1.0).at_most(1e6);
    } others {
        /// Names of targets: those of the traffic file, or `target-0`, `target-1`, ...
        #[serde(skip_serializing_if = "Vec::is_empty")]
        targets: Vec<String>;
        /// Corners of an area in order, `[east, north]`, m.
        #[serde(serialize_with = "lists_as_typed", skip_serializing_if = "Vec::is_empty")]
        #[schemars(with = "Vec<Vec<Number>>")]
        vertices: Vec<Vec<f64>>;
    }

    /// `[traffic]`: targets from a traffic file.
    table Traffic texts {
        /// Traffic file, or a list of at most 100: SUMO floating-car data (XML, CSV or Parquet), CSV tracks or GPX;
        /// relative to the scenario file. `-` is standard input.
        file: Files;
    } words {
        /// Unit of the file's coordinates: `auto`, `metres` or `degrees`.
        coordinates: Coordinates;
        /// Whether persons and containers of SUMO are targets: `ignored` or `included`.
        persons: Persons;
    } optional {
        /// Gap limit, s; above 0: a vehicle without samples for longer is absent during the gap, unless it is parked. If
        /// absent: 1 s, or 2.5 typical sampling intervals of the file or of the vehicle, whichever is longest.
        gap_s: Allowed::above(0.0);
        /// Frames per second, 1 to 1,000, of a data set whose times are numbers of frames. If absent: 25.
        frame_rate_hz: Allowed::at_least(1.0).at_most(1_000.0);
    }
}

/// Returns the UAV with a checked number.
pub(crate) fn uav_of(number: f64) -> UavId {
    UavId(number as u32)
}

impl ScenarioFile {
    /// Returns whether the team states of the UAVs can differ, so that each UAV needs its own agent.
    pub(super) fn needs_an_agent_per_uav(&self) -> bool {
        let Uavs { restart, clock, boot_delay_s, .. } = &self.uavs;
        self.radio.is_some() || !restart.is_empty() || !clock.is_empty() || boot_delay_s.is_some()
    }
}

/// Names of one or several files.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Files {
    /// A file.
    One(#[serde(serialize_with = "name_alone")] String),
    /// A list of files.
    Several(#[serde(serialize_with = "one_or_more")] Vec<String>),
}

impl Files {
    /// Returns the names.
    pub fn names(&self) -> &[String] {
        match self {
            Self::One(name) => slice::from_ref(name),
            Self::Several(names) => names,
        }
    }
}

impl Default for Files {
    fn default() -> Self {
        Self::One(String::new())
    }
}

/// A table that applies unless it is switched off with `false`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum Switchable {
    /// The table.
    Table(Separation),
    /// `false`: off; `true`: the table with its defaults.
    Switch(bool),
}

impl Switchable {
    /// Returns whether the table applies.
    pub fn is_on(&self) -> bool {
        *self != Self::Switch(false)
    }
}

impl Default for Switchable {
    fn default() -> Self {
        Self::Table(Separation::default())
    }
}

/// Paths are omitted: a record contains what was flown, not where its files were.
fn name_alone<S: Serializer>(path: &str, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&name(path))
}

fn names_alone<S: Serializer>(paths: &[String], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(paths.iter().map(|path| name(path)))
}

fn one_or_more<S: Serializer>(paths: &[String], serializer: S) -> Result<S::Ok, S::Error> {
    match paths {
        [one] => name_alone(one, serializer),
        several => names_alone(several, serializer),
    }
}

fn name(path: &str) -> Cow<'_, str> {
    Path::new(path).file_name().unwrap_or_default().to_string_lossy()
}

/// Where the team state is kept. With an ideal radio both variants are equal to the bit, because every UAV receives
/// every message.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AgentSetup {
    /// One agent keeps the team state for all UAVs.
    #[default]
    Shared,
    /// Each UAV has its own agent.
    PerUav,
}

/// Flight dynamics of the true aircraft.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Dynamics {
    /// First-order lags of speed and turn rate (1).
    #[default]
    Kinematic,
    /// Turns by a bank angle, and airspeed within the power that a climb leaves.
    Bank,
}

/// How an aircraft interprets a commanded speed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SpeedCommand {
    /// As true airspeed: the command is converted to an equivalent airspeed for the autopilot.
    #[default]
    TrueAirspeed,
    /// As equivalent airspeed, without conversion: the aircraft is faster, the more the higher it flies.
    EquivalentAirspeed,
}

/// Which detections and cues have the identity of their target.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Labels {
    /// All of them: sensors and cue sources identify targets.
    #[default]
    All,
    /// None: the team associates detections with tracks.
    None,
}

/// Returns whether the unit of coordinates is not given.
fn is_auto(coordinates: &Coordinates) -> bool {
    *coordinates == Coordinates::Auto
}

/// Kind of a zone.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ZoneKind {
    /// UAVs must stay outside.
    #[default]
    KeepOut,
    /// UAVs must stay inside.
    KeepIn,
}

impl From<ZoneKind> for standoff::ZoneKind {
    fn from(kind: ZoneKind) -> Self {
        match kind {
            ZoneKind::KeepOut => Self::KeepOut,
            ZoneKind::KeepIn => Self::KeepIn,
        }
    }
}
