//! Numbers stay finite: scenarios with arbitrary allowed values, including the extremes, are flown and checked.

use std::collections::BTreeMap;
use std::fmt;

use nalgebra::Matrix6;
use proptest::prelude::*;
use standoff::Covariance;
use standoff::math;
use standoff_record::{Frame, NO_TARGET, TrackRow};
use standoff_score::{MetricSelection, Scorer};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Scenario, ScenarioTemplate};

/// Smallest number above 0.
const TINY: f64 = f64::from_bits(1);

/// Position of a value in the range of its key.
#[derive(Debug, Clone, Copy)]
enum Level {
    Default,
    Lowest,
    Highest,
    AboveLowest,
    BelowHighest,
    /// Linear interpolation from lowest to highest.
    Linear(f64),
    /// Interpolation by order of magnitude.
    Magnitude(f64),
}

impl Level {
    /// Returns the value in [lowest, highest].
    fn of(self, default: f64, lowest: f64, highest: f64) -> f64 {
        let value = match self {
            Self::Default => default,
            Self::Lowest => lowest,
            Self::Highest => highest,
            Self::AboveLowest => lowest.next_up(),
            Self::BelowHighest => highest.next_down(),
            Self::Linear(share) => lowest + share * (highest - lowest),
            Self::Magnitude(share) => {
                let (smallest, largest) = (lowest.max(1e-9 * highest.abs()), highest.abs().max(TINY));
                math::exp(math::ln(smallest) + share * math::ln(largest / smallest))
            }
        };
        if value.is_nan() { default } else { value.clamp(lowest, highest) }
    }
}

fn any_level() -> impl Strategy<Value = Level> {
    prop_oneof![
        14 => Just(Level::Default),
        2 => Just(Level::Lowest),
        2 => Just(Level::Highest),
        1 => Just(Level::AboveLowest),
        1 => Just(Level::BelowHighest),
        2 => (0.0..1.0f64).prop_map(Level::Linear),
        2 => (0.0..1.0f64).prop_map(Level::Magnitude),
    ]
}

/// A key, its default, its lowest and its highest value.
type Key = (&'static str, f64, f64, f64);

/// All numeric scenario keys whose range does not depend on another key; described in `docs/user/scenarios.md`.
const KEYS: &[Key] = &[
    ("period_s", 0.5, 0.01, 10.0),
    ("transient_s", 30.0, 0.0, 1e9),
    ("uavs.speed_m_s", 40.0, 1.0, 1000.0),
    ("uavs.turn_rate_max_rad_s", 0.3, 1e-3, 10.0),
    ("uavs.speed_lag_s", 0.33, 1e-3, 60.0),
    ("uavs.turn_rate_lag_s", 0.33, 1e-3, 60.0),
    ("team.teammate_timeout_s", 3.0, TINY, 60.0),
    ("sensor.range_sd_m", 10.0, 0.0, 1e5),
    ("sensor.bearing_sd_deg", 3.0, 0.0, 180.0),
    ("sensor.field_of_view_deg", 70.0, 0.058, 360.0),
    ("sensor.detection_probability", 1.0, TINY, 1.0),
    ("sensor.mdv_m_s", 0.0, 0.0, 100.0),
    ("filter.detection_probability", 1.0, TINY, 1.0),
    ("filter.mdv_m_s", 0.0, 0.0, 1e3),
    ("filter.range_rate_sd_m_s", 0.5, 1e-3, 1e3),
    ("filter.false_alarms_per_scan", 0.0, 0.0, 1e3),
    ("filter.new_targets_per_scan", 0.02, 1e-9, 1e3),
    ("navigation.position_sd_m", 0.0, 0.0, 1e3),
    ("navigation.correlation_s", 30.0, 0.0, 1e6),
    ("navigation.heading_bias_deg", 0.0, 0.0, 180.0),
    ("filter.near_range_m", 300.0, 0.0, 1e6),
    ("filter.linear_sd_fraction_max", 0.1, 0.0, 100.0),
    ("filter.own_position_sd_m", 0.0, 0.0, 1e4),
    ("filter.own_position_correlation_s", 30.0, 0.0, 1e6),
    ("filter.own_heading_sd_deg", 0.0, 0.0, 180.0),
    ("filter.deletion_position_sd_m", 300.0, TINY, 1e4),
    ("filter.deletion_unseen_in_view_s", 5.0, TINY, 1e6),
    ("filter.initial_velocity_sd_m_s", 10.0, 1e-3, 1e3),
    ("filter.lost_track_retention_s", 600.0, TINY, 1e6),
    ("filter.correlation_rate_1_s", 0.1, 0.0, 100.0),
    ("filter.acceleration_sd_m_s2", 0.2, 0.0, 100.0),
    ("filter.range_sd_m", 10.0, 1e-3, 1e5),
    ("filter.bearing_sd_deg", 3.0, 6e-5, 180.0),
    ("cue.velocity_sd_m_s", 2.0, 1e-3, 1e3),
    ("orbit.radius_min_m", 250.0, 1.0, 1e5),
    ("orbit.margin_sds", 1.645, 0.0, 100.0),
    ("orbit.readmission_radius_fraction", 0.9, TINY, 1.0),
    ("groups.handoff_margin_m", 50.0, 0.0, 1e5),
    ("groups.dwell_min_s", 3.0, 0.0, 3600.0),
    ("groups.divergence_limit_m2_s", 6000.0, TINY, 1e9),
    ("groups.divergence_time_s", 3.0, 0.0, 3600.0),
    ("groups.regrouping_period_s", 30.0, 0.0, 3600.0),
    ("groups.assignment_reach_s", 30.0, 0.0, 3600.0),
    ("groups.assignment_switching_cost", 0.5, 0.0, 100.0),
    ("groups.altitude_lowest_m", 300.0, 1.0, 2e4),
    ("groups.altitude_step_m", 50.0, 1.0, 2e4),
    ("groups.proximity_alert_m", 50.0, 0.0, 1e4),
    ("world.building_height_m", 10.0, TINY, 1e3),
    ("guidance.radial_gain", 0.2, 1e-3, 1.0),
    ("guidance.lead_s", 3.0, 0.0, 100.0),
    ("guidance.heading_gain_1_s", 2.0, TINY, 100.0),
    ("guidance.phase_gain_1_s", 0.5, 0.0, 100.0),
    ("guidance.desired_phase_deg", 90.0, 0.0, 180.0),
    ("targets.correlation_rate_1_s", 0.1, 0.0, 100.0),
    ("targets.acceleration_sd_m_s2", 0.0, 0.0, 100.0),
];

/// The same for keys of `[wind]`, which are drawn in half of the scenarios.
const WIND: &[Key] = &[
    ("wind.speed_m_s", 8.0, 0.0, 100.0),
    ("wind.from_deg", 270.0, 0.0, 360.0),
    ("wind.shear_exponent", 0.0, 0.0, 0.5),
    ("wind.reference_height_m", 10.0, 1.0, 2e4),
    ("wind.gust_w20_m_s", 0.0, 0.0, 50.0),
    ("wind.orbit_wind_m_s", 8.0, 0.0, 100.0),
    ("wind.believed_speed_m_s", 8.0, 0.0, 100.0),
    ("wind.believed_from_deg", 270.0, 0.0, 360.0),
    ("wind.estimate_time_constant_s", 10.0, 1e-3, 3600.0),
];

/// The same for keys of `[uavs.bank]`, which are drawn in half of the scenarios.
const BANK: &[Key] = &[
    ("uavs.bank.bank_max_deg", 60.0, 5.0, 80.0),
    ("uavs.bank.roll_rate_max_deg_s", 60.0, 1.0, 720.0),
    ("uavs.bank.roll_lag_s", 0.4, 1e-3, 10.0),
    ("uavs.bank.turn_factor", 1.0, 0.1, 1.5),
    ("uavs.bank.climb_full_power_m_s", 5.0, 0.1, 100.0),
    ("uavs.bank.sink_idle_m_s", 2.0, 0.1, 100.0),
];

/// Keys whose range depends on another key: key, other key, default, and range as a function of the other key's value.
type Bounded = (&'static str, &'static str, f64, fn(f64) -> (f64, f64));

const BOUNDED: &[Bounded] = &[
    ("uavs.speed_change_max_m_s", "uavs.speed_m_s", 15.0, |speed| (0.0, speed.next_down())),
    ("orbit.field_of_view_margin_deg", "sensor.field_of_view_deg", 10.0, |view| (0.0, view * (1.0 - 1e-15))),
    ("orbit.radius_max_m", "orbit.radius_min_m", 700.0, |least| (least, 1e5)),
    ("sensor.sensing_range_m", "orbit.radius_min_m", 1200.0, |least| (least.max(1.0).next_up(), 1e6)),
    ("cue.position_sd_m", "filter.deletion_position_sd_m", 20.0, |lost| (1e-3, lost.next_down().max(1e-3))),
    ("groups.dwell_max_s", "groups.dwell_min_s", 30.0, |least| (least, 3600.0)),
];

/// Keys with enumerated values.
const WORDS: &[(&str, &[&str])] = &[
    ("uavs.integrator", &["exact", "euler"]),
    ("team.agents", &["shared", "per-uav"]),
    ("sensor.labels", &["all", "none"]),
    ("orbit.margin", &["standard-deviations", "mahalanobis"]),
    ("orbit.centre", &["filtered", "enclosing-circle"]),
    ("orbit.pointing", &["group-centre", "angular-midpoint"]),
    ("orbit.centre_jump", &["shift-state", "innovation"]),
    ("groups.removal", &["furthest-from-centre", "largest-radius-reduction"]),
    ("groups.objective", &["log-det", "paper"]),
    ("guidance.law", &["standoff", "oh-2015"]),
    ("guidance.feedforward", &["static-centre", "paper"]),
    ("guidance.orbit_direction", &["anticlockwise", "clockwise"]),
];

/// Start and motion of a target.
const TARGET: &[Key] = &[
    ("x_m", 50.0, -1e7, 1e7),
    ("y_m", -40.0, -1e7, 1e7),
    ("vx_m_s", 5.0, -1e3, 1e3),
    ("vy_m_s", 0.0, -1e3, 1e3),
    ("ax_m_s2", 0.0, -100.0, 100.0),
    ("ay_m_s2", 0.0, -100.0, 100.0),
];

const UAV: &[Key] = &[
    ("x_m", 400.0, -1e7, 1e7),
    ("y_m", 0.0, -1e7, 1e7),
    ("heading_deg", 90.0, -1e6, 1e6),
    ("speed_m_s", 40.0, TINY, 1e3),
];

/// Random scenario.
#[derive(Clone)]
struct Draft {
    keys: Vec<Level>,
    /// Keys of `[wind]`, if there is wind, and whether it is estimated.
    wind: Option<(Vec<Level>, bool)>,
    /// Keys of `[uavs.bank]`, if UAVs bank, and whether commands are true airspeeds.
    bank: Option<(Vec<Level>, bool)>,
    bounded: Vec<Level>,
    words: Vec<usize>,
    /// One row per target.
    targets: Vec<Vec<Level>>,
    /// One row per listed UAV, or the number of UAVs that start on orbits.
    uavs: Result<Vec<Vec<Level>>, usize>,
    ticks: u32,
}

fn rows(most: usize, keys: usize) -> impl Strategy<Value = Vec<Vec<Level>>> {
    proptest::collection::vec(proptest::collection::vec(any_level(), keys), 1..=most)
}

prop_compose! {
    fn any_draft()(
        keys in proptest::collection::vec(any_level(), KEYS.len()),
        wind in proptest::option::of((proptest::collection::vec(any_level(), WIND.len()), any::<bool>())),
        bank in proptest::option::of((proptest::collection::vec(any_level(), BANK.len()), any::<bool>())),
        bounded in proptest::collection::vec(any_level(), BOUNDED.len()),
        words in proptest::collection::vec(0..12usize, WORDS.len()),
        targets in rows(20, TARGET.len()),
        uavs in prop_oneof![rows(8, UAV.len()).prop_map(Ok), (1..=8usize).prop_map(Err)],
        ticks in 10..60u32,
    ) -> Draft {
        Draft { keys, wind, bank, bounded, words, targets, uavs, ticks }
    }
}

/// A failure shows the text of the scenario.
impl fmt::Debug for Draft {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text())
    }
}

impl Draft {
    /// Returns the scenario as text.
    fn text(&self) -> String {
        let mut values: BTreeMap<&str, f64> = BTreeMap::new();
        for ((key, default, lowest, highest), level) in KEYS.iter().zip(&self.keys) {
            values.insert(key, level.of(*default, *lowest, *highest));
        }
        for ((key, default, lowest, highest), level) in WIND.iter().zip(self.wind.iter().flat_map(|(wind, _)| wind)) {
            values.insert(key, level.of(*default, *lowest, *highest));
        }
        for ((key, default, lowest, highest), level) in BANK.iter().zip(self.bank.iter().flat_map(|(bank, _)| bank)) {
            values.insert(key, level.of(*default, *lowest, *highest));
        }
        for ((key, by, default, range), level) in BOUNDED.iter().zip(&self.bounded) {
            let (lowest, highest) = range(values[by]);
            values.insert(key, level.of(*default, lowest, highest));
        }
        values.insert("duration_s", values["period_s"] * f64::from(self.ticks));
        let mut text: String = values.iter().map(|(key, value)| format!("{key} = {value:?}\n")).collect();
        for ((key, words), word) in WORDS.iter().zip(&self.words) {
            text += &format!("{key} = {:?}\n", words[word % words.len()]);
        }
        if let Some((_, is_estimated)) = self.wind {
            text += &format!("wind.belief = {:?}\n", if is_estimated { "estimated" } else { "given" });
        }
        if let Some((_, is_true)) = self.bank {
            let taken_as = if is_true { "true-airspeed" } else { "equivalent-airspeed" };
            text += &format!("uavs.dynamics = \"bank\"\nuavs.bank.speed_command = {taken_as:?}\n");
        }
        if text.contains("sensor.labels = \"none\"") {
            text += "sensor.false_alarms_per_scan = 3.0\nsensor.range_rate_sd_m_s = 0.5\n";
        }
        // With default values, UAVs and targets are placed next to each other.
        let listed = |table: &str, keys: &[Key], levels: &[Level], offset_m: f64| {
            let mut row = format!("[[{table}]]\n");
            for ((key, default, lowest, highest), level) in keys.iter().zip(levels) {
                let default = default + if *key == "y_m" { offset_m } else { 0.0 };
                row += &format!("{key} = {:?}\n", level.of(default, *lowest, *highest));
            }
            row
        };
        match &self.uavs {
            Ok(uavs) => {
                text += &format!("uavs.count = {}\n", uavs.len());
                text += &uavs
                    .iter()
                    .zip(0..)
                    .map(|(uav, n)| listed("uavs.start", UAV, uav, 150.0 * f64::from(n)))
                    .collect::<String>();
            }
            Err(count) => text += &format!("uavs.count = {count}\n"),
        }
        text += &self
            .targets
            .iter()
            .zip(0..)
            .map(|(target, n)| listed("targets.start", TARGET, target, 30.0 * f64::from(n)))
            .collect::<String>();
        text
    }
}

/// Describes the first error in the frame, if any.
fn wrong(scenario: &Scenario, frame: &Frame) -> Option<String> {
    let uav = &scenario.settings.team.uav;
    let Frame { time_us: _, uavs, truth, tracks, tentative, groups, detections, events, intruders, agents } = frame;
    // Searches all numbers of all rows; no field name and no value contains one of these words.
    let own = (&agents.all, &agents.tracks, &agents.groups, &agents.teammates, tentative);
    let numbers = format!("{uavs:?} {truth:?} {tracks:?} {groups:?} {detections:?} {intruders:?} {own:?}");
    if let Some(place) = numbers.find("NaN").or_else(|| numbers.find("inf")) {
        return Some(format!("not finite: ...{}", &numbers[place.saturating_sub(200)..place + 3]));
    }
    let slip = 1.0 + 4.0 * f64::EPSILON;
    for row in uavs {
        let off_m_s = (row.speed_command_m_s - uav.speed_m_s).abs();
        if off_m_s > uav.speed_change_max_m_s + slip * uav.speed_m_s * f64::EPSILON
            || row.turn_rate_command_rad_s.abs() > uav.turn_rate_max_rad_s
        {
            return Some(format!("outside the limits: {row:?}"));
        }
        if row.speed_m_s < -1e-9 {
            return Some(format!("backwards: {row:?}"));
        }
    }
    let is_group = |id: &u32| groups.iter().any(|group| group.group == *id);
    let named =
        uavs.iter().map(|uav| uav.group).chain(tracks.iter().flat_map(|track| [track.group, track.receiving_group]));
    if let Some(unknown) = named.flatten().find(|id| !is_group(id)) {
        return Some(format!("no group {unknown}: {groups:?}"));
    }
    let exists = |id: u32| scenario.uavs.len() > id as usize;
    if !uavs.iter().zip(0..).all(|(row, id)| row.uav == id) || !detections.iter().all(|row| exists(row.uav)) {
        return Some("a UAV that does not exist".to_owned());
    }
    let is_target = |id: &u32| truth.binary_search_by_key(id, |row| row.target).is_ok();
    let targets = tracks.iter().map(|row| row.target).chain(detections.iter().filter_map(|row| row.target));
    if let Some(unknown) =
        targets.chain(events.iter().filter_map(|event| event.target)).find(|id| *id < NO_TARGET && !is_target(id))
    {
        return Some(format!("no target {unknown}"));
    }
    if let Some(event) = events
        .iter()
        .find(|event| event.reason.split([' ', ',', ';']).any(|word| word == "NaN" || word.ends_with("inf")))
    {
        return Some(format!("{event:?}"));
    }
    tracks.iter().find(|track| !is_positive_definite(track)).map(|track| format!("not positive definite: {track:?}"))
}

/// Uses correlations, so that units do not matter, with a tolerance for rounding. If a target's position is known to a
/// millimetre, but its acceleration is unknown, then after a few seconds the states are correlated to more digits than
/// a double has.
fn is_positive_definite(track: &TrackRow) -> bool {
    let p = Covariance::from_upper_triangle(&track.covariance).matrix();
    let sds = p.diagonal().map(f64::sqrt);
    let correlations = Matrix6::from_fn(|row, column| p[(row, column)] / sds[row] / sds[column]);
    (correlations + Matrix6::identity() * 1e-12).cholesky().is_some()
}

/// Flies the scenario. Returns the number of its frames, or 0 if the scenario was refused.
fn fly(text: &str, seed: u64) -> Result<usize, String> {
    let refused = |why: String| {
        assert!(why.contains("must be"), "{why}");
        Ok(0)
    };
    let scenario = match ScenarioTemplate::of_text("drawn", text, &[]).and_then(|template| template.draw(seed)) {
        Ok(scenario) => scenario,
        Err(error) => return refused(error.to_string()),
    };
    let mut mission = match Mission::new(&scenario) {
        Ok(mission) => mission,
        Err(errors) => return refused(errors.iter().map(ToString::to_string).collect()),
    };
    let mut scorer = Scorer::new(scenario.settings.score_config(), MetricSelection::all());
    let mut frames = 0;
    while let Some(frame) = mission.frame() {
        if let Some(what) = wrong(&scenario, frame) {
            return Err(format!("at {} s: {what}", frame.time_us as f64 / 1e6));
        }
        scorer.frame(frame);
        frames += 1;
    }
    let metrics = scorer.metrics();
    let is_square = |value: Option<f64>| value.is_none_or(|value| value >= 0.0);
    let are_sound = metrics.values().iter().flatten().all(|value| value.is_finite())
        && is_square(metrics["nis"])
        && is_square(metrics["anees"]);
    if are_sound { Ok(frames) } else { Err(format!("{metrics:?}")) }
}

/// The ranges above match the validation: the extremes are allowed, the next numbers beyond them are not.
#[test]
fn range_limits_match_the_validation() {
    let refusal = |key: &str, value: f64| {
        // With these values, no other key has a limit.
        let wide = "uavs.speed_change_max_m_s = 0.0\norbit.field_of_view_margin_deg = 0.0\norbit.radius_max_m = 100000.0\n\
                    sensor.sensing_range_m = 1000000.0\ngroups.dwell_max_s = 3600.0\n";
        let wide = format!("{wide}{}", if key.starts_with("uavs.bank.") { "uavs.dynamics = \"bank\"\n" } else { "" });
        let typed = format!("{wide}duration_s = 20.0\ncue.position_sd_m = 0.001\n{key} = {value:?}\n");
        let template = ScenarioTemplate::of_text("drawn", &format!("{typed}[[targets.start]]\n"), &[]);
        template.and_then(|template| template.draw(1)).err().map(|error| error.to_string())
    };
    for (key, _, lowest, highest) in KEYS.iter().chain(WIND).chain(BANK) {
        // A track with a larger uncertainty than the cue is lost.
        let lowest = if *key == "filter.deletion_position_sd_m" { 1e-3f64.next_up() } else { *lowest };
        for allowed in [lowest, *highest] {
            assert_eq!(refusal(key, allowed), None, "{key}");
        }
        for beyond in [lowest.next_down(), highest.next_up()] {
            // Angles are converted, so rounding has to be tolerated.
            let beyond = if key.ends_with("_deg") {
                beyond - (lowest + highest) * 1e-3 * if beyond < lowest { 1.0 } else { -1.0 }
            } else {
                beyond
            };
            assert!(refusal(key, beyond).is_some_and(|message| message.contains("must be")), "{key} = {beyond}");
        }
    }
}

/// With a sensor error of 100 km and a filter that assumes a millimetre, sums of squares are still not negative.
#[test]
fn extreme_noise_gives_no_negative_squares() {
    let text = "duration_s = 20\nuavs.count = 2\nsensor.range_sd_m = 1e5\nfilter.range_sd_m = 1e-3\n\
                filter.acceleration_sd_m_s2 = 100.0\n[targets.random]\ncount = 4\n";
    for seed in 1..=5 {
        assert_eq!(fly(text, seed), Ok(41), "seed {seed}");
    }
}

/// Number of cases: `PROPTEST_CASES`, which `scripts/test_for_long` sets, or 64 if it is not set, because they take long.
fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(64)
}

proptest! {
    #![proptest_config(ProptestConfig { max_shrink_iters: 2000, failure_persistence: None, ..ProptestConfig::with_cases(cases()) })]
    /// Whatever the values, all numbers of all frames are finite, all commands are within their limits, all covariances
    /// are positive definite to within rounding, and all ids are valid; otherwise the scenario is refused with a range.
    #[test]
    fn allowed_scenarios_give_finite_numbers(draft in any_draft(), seed in any::<u64>()) {
        let flown = fly(&draft.text(), seed);
        prop_assert!(flown.is_ok(), "{flown:?}");
    }
}
