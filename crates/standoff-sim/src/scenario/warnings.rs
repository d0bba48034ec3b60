//! Warnings about settings that cannot have the effect that their keys promise.

use standoff::math;
use standoff::params::AltitudePolicy;
use standoff::params::Integrator;
use standoff::{Law, TargetParams, TeamParams};

use super::resolved::{Settings, Targets};
use crate::traffic::Vehicle;

/// Returns the warnings, one line for each setting.
pub(super) fn warnings(settings: &Settings, targets: &Targets) -> Vec<String> {
    let team = &settings.team;
    let all = [
        heading_loop(settings),
        orbit_loop(settings),
        options_of_the_papers_law(team),
        turning_circle(settings, targets),
        bank_limit(settings),
        wind_reserve(settings),
        pair_on_orbit(settings),
        process_noise(settings, targets),
    ];
    all.into_iter().flatten().collect()
}

/// Ground speed against the wind, as a share of the nominal airspeed, below which UAVs do not hold their orbits well.
const WIND_RESERVE: f64 = 0.12;

/// The loop of kinematic UAVs (24).
fn heading_loop(settings: &Settings) -> Option<String> {
    let uav = &settings.team.uav;
    if uav.bank.is_some() {
        return None;
    }
    let modulus = uav.heading_loop_spectral_radius(settings.team.guidance.heading_gain_1_s, settings.period);
    let euler = match uav.integrator {
        Integrator::Euler => " (Euler needs guidance.heading_gain_1_s * period_s below 1)",
        Integrator::Exact => "",
    };
    (modulus > 1.0 - 1e-6).then(|| {
        format!(
            "the heading loop is not stable at this period: its largest eigenvalue has modulus {modulus:.3}, must be \
             below 1{euler}"
        )
    })
}

/// UAVs at nominal speed do not settle on the smallest orbit if the guidance loop is not stable there.
fn orbit_loop(settings: &Settings) -> Option<String> {
    let team = &settings.team;
    let radius_m = smallest_orbit_m(team);
    if team.uav.bank.is_some() || radius_m.is_infinite() {
        return None;
    }
    let modulus = team.orbit_loop_spectral_radius(radius_m, settings.period);
    let remedy = match team.guidance.law {
        Law::Standoff => "a shorter period_s or a larger guidance.radial_gain",
        Law::Oh2015 => "guidance.law = \"standoff\"",
    };
    (modulus > 1.0 - 1e-6 && heading_loop(settings).is_none()).then(|| {
        format!(
            "UAVs do not settle on the smallest orbits, of {radius_m:.0} m: the largest eigenvalue of the guidance loop \
             has modulus {modulus:.3}, must be below 1; choose {remedy}, or a larger orbit.radius_min_m"
        )
    })
}

/// This project's law computes its lead and its feedforward.
fn options_of_the_papers_law(team: &TeamParams) -> Option<String> {
    let (guidance, default) = (&team.guidance, TeamParams::of_law(Law::Standoff).guidance);
    let keys = [
        ("guidance.lead_s", guidance.lead_s != default.lead_s),
        ("guidance.feedforward", guidance.feedforward != default.feedforward),
    ];
    let (key, _) = keys.into_iter().find(|(_, is_set)| *is_set && guidance.law == Law::Standoff)?;
    Some(format!(
        "{key} has no effect with guidance.law = \"standoff\", which computes the lead and the feedforward; the law \
         \"oh-2015\" uses it"
    ))
}

/// Radius of the smallest orbit that UAVs can fly about a centre at rest, m.
fn smallest_orbit_m(team: &TeamParams) -> f64 {
    team.stationary_orbit_bounds().radius_min_m.max(team.turn_limit_about_m(0.0))
}

/// UAVs cannot fly tighter orbits than their turn rate allows. The faster the targets, the larger is the smallest orbit;
/// UAVs cannot orbit targets that are not slower than they are, in the air.
fn turning_circle(settings: &Settings, targets: &Targets) -> Option<String> {
    let team = &settings.team;
    let (speed_m_s, rate_rad_s) = (team.uav.speed_m_s, team.uav.turn_rate_max_rad_s);
    let (slowest_m_s, fastest_m_s) = target_speeds_m_s(targets);
    let (maximum_m, minimum_m) = (team.group.standoff.radius_max_m, team.group.standoff.radius_min_m);
    let needs = |target_m_s: f64| {
        let circle_m = team.turn_limit_about_m(target_m_s);
        let about = if target_m_s > 0.05 { format!(" about a target at {target_m_s:.1} m/s") } else { String::new() };
        format!("uavs.speed_m_s = {speed_m_s} at uavs.turn_rate_max_rad_s = {rate_rad_s} needs {circle_m:.0} m{about}")
    };
    let obstacle = |target_m_s: f64| {
        let exceeds_all = team.turn_limit_about_m(target_m_s) > maximum_m;
        let orbit = || format!("{}, and orbit.radius_max_m is {maximum_m}", needs(target_m_s));
        too_slow(settings, target_m_s).or_else(|| exceeds_all.then(orbit))
    };
    if let Some(why) = obstacle(slowest_m_s) {
        Some(format!("no orbit can be flown: {why}"))
    } else if let Some(why) = obstacle(fastest_m_s) {
        Some(format!("no orbit about the fastest targets can be flown: {why}"))
    } else if team.turn_limit_about_m(0.0) > minimum_m {
        let not = if team.group.radius_above_turn_limit { "are not" } else { "cannot be" };
        Some(format!("the smallest orbits {not} flown: {}, and orbit.radius_min_m is {minimum_m}", needs(0.0)))
    } else {
        None
    }
}

/// Returns why UAVs cannot orbit a target in the wind at any airspeed, if they cannot.
fn too_slow(settings: &Settings, target_m_s: f64) -> Option<String> {
    let (key, wind_m_s) = strongest_wind(settings);
    let highest_m_s = settings.team.uav.speed_max_m_s();
    let in_air_m_s = target_m_s + wind_m_s;
    let is_windy = wind_m_s > 0.0;
    let what = if is_windy && wind_m_s >= highest_m_s {
        format!("a wind of {wind_m_s:.1} m/s is")
    } else if is_windy {
        format!(
            "a target at {target_m_s:.1} m/s in a wind of {wind_m_s:.1} m/s can move at {in_air_m_s:.1} m/s in the air,"
        )
    } else {
        format!("a target at {target_m_s:.1} m/s is")
    };
    let weaker = if is_windy { format!(", or a smaller {key}") } else { String::new() };
    (in_air_m_s >= highest_m_s).then(|| {
        format!(
            "{what} not slower than the highest airspeed, {highest_m_s:.1} m/s; choose a larger uavs.speed_m_s or \
             uavs.speed_change_max_m_s{weaker}"
        )
    })
}

/// Returns the stronger of the wind at the lowest altitude and the wind that orbits allow for, m/s, with its key.
fn strongest_wind(settings: &Settings) -> (&'static str, f64) {
    let allowed_for_m_s = settings.team.wind.map_or(0.0, |wind| wind.orbit_wind_m_s);
    let wind = settings.wind.map(|wind| wind.at(settings.team.group.altitude_lowest_m));
    let wind_m_s = wind.map_or(0.0, |wind| wind.velocity.speed_m_s());
    // If it is not typed, the allowance is the wind, except for rounding.
    if allowed_for_m_s > wind_m_s + 1e-6 {
        ("wind.orbit_wind_m_s", allowed_for_m_s)
    } else if wind_m_s > allowed_for_m_s + 1e-6 {
        ("wind.speed_m_s", wind_m_s)
    } else {
        ("wind.speed_m_s", allowed_for_m_s)
    }
}

/// The guidance assumes that UAVs reach the limit of the turn rate, whatever they are.
fn bank_limit(settings: &Settings) -> Option<String> {
    let (uav, bank) = (&settings.team.uav, settings.team.uav.bank.as_ref()?);
    let (speed_m_s, limit_rad_s) = (uav.speed_m_s, uav.turn_rate_max_rad_s);
    let reached_rad_s = bank.turn_rate_max_rad_s(speed_m_s);
    (reached_rad_s < limit_rad_s).then(|| {
        format!(
            "uavs.turn_rate_max_rad_s = {limit_rad_s} is not reached: at uavs.speed_m_s = {speed_m_s}, a bank of {:.0} \
             degrees with uavs.bank.turn_factor = {} turns at {reached_rad_s:.3} rad/s; lower the limit of the turn rate, \
             or raise uavs.bank.bank_max_deg",
            bank.bank_max_rad.to_degrees(),
            bank.turn_factor,
        )
    })
}

/// UAVs are slow over ground against a wind that is nearly as strong as their highest airspeed.
fn wind_reserve(settings: &Settings) -> Option<String> {
    let ((key, wind_m_s), uav) = (strongest_wind(settings), &settings.team.uav);
    let highest_m_s = uav.speed_max_m_s();
    let against_m_s = highest_m_s - wind_m_s;
    (f64::MIN_POSITIVE..WIND_RESERVE * uav.speed_m_s).contains(&against_m_s).then(|| {
        format!(
            "UAVs may not hold their orbits: a wind of {wind_m_s:.1} m/s leaves {against_m_s:.1} m/s over ground against \
             it, at the highest airspeed of {highest_m_s:.1} m/s; choose a larger uavs.speed_change_max_m_s, or a smaller \
             {key}"
        )
    })
}

/// Speeds of the slowest and of the fastest target, m/s: at the start, or the mean over the samples of its vehicle.
fn target_speeds_m_s(targets: &Targets) -> (f64, f64) {
    let speeds_m_s: Vec<f64> = match targets {
        Targets::Random { start, .. } => start.iter().map(|state| state.velocity().speed_m_s()).collect(),
        Targets::Traffic(traffic) => traffic.vehicles.iter().filter_map(mean_speed_m_s).collect(),
    };
    let slowest_m_s = speeds_m_s.iter().copied().reduce(f64::min).unwrap_or(0.0);
    (slowest_m_s, speeds_m_s.into_iter().fold(0.0, f64::max))
}

fn mean_speed_m_s(vehicle: &Vehicle) -> Option<f64> {
    let steps = vehicle.places().zip(vehicle.places().skip(1));
    let path_m: f64 = steps.map(|([x, y], [x_next, y_next])| math::hypot(x_next - x, y_next - y)).sum();
    let duration_s = (vehicle.last_us() - vehicle.first_us()) as f64 / 1e6;
    (duration_s > 0.0).then_some(path_m / duration_s)
}

/// Two UAVs on the smallest orbit, at one altitude, are apart by the chord of the desired phase.
fn pair_on_orbit(settings: &Settings) -> Option<String> {
    let team = &settings.team;
    let minimum_m = team.separation.as_ref()?.horizontal_min_m;
    let radius_m = team.stationary_orbit_bounds().radius_min_m;
    let chord_m = 2.0 * radius_m * math::sin(0.5 * team.guidance.desired_phase_rad);
    let is_one_altitude = team.group.altitude_policy != AltitudePolicy::PerUav;
    (is_one_altitude && chord_m < minimum_m).then(|| {
        format!(
            "separation.horizontal_min_m = {minimum_m} is more than the {chord_m:.0} m between two UAVs at \
             guidance.desired_phase_deg on the smallest orbit, of {radius_m:.0} m: they cannot keep both"
        )
    })
}

/// Share of the acceleration of targets below which a filter assumes too little: at a tenth, the ANEES is above 10.
const ASSUMED_SHARE: f64 = 0.2;
/// Time after which an acceleration has changed, at most, s. Filters of any rate follow faster changes as noise.
const CHANGE_S: f64 = 10.0;
/// Acceleration of a manoeuvre as a multiple of that which the filter must assume: it has a model of manoeuvres.
const MANOEUVRE_FACTOR: f64 = 4.0;
/// Maximum number of places at which the acceleration of a vehicle is computed.
const PLACES_MAX: i64 = 100;

/// A filter with almost no process noise ends up ignoring its measurements.
fn process_noise(settings: &Settings, targets: &Targets) -> Option<String> {
    let motions: Vec<TargetParams> = match targets {
        Targets::Traffic(traffic) => vec![motion_of_traffic(&traffic.vehicles)],
        Targets::Random { model, manoeuvres, .. } => {
            let manoeuvres = manoeuvres.iter().map(|manoeuvre| TargetParams {
                correlation_rate_1_s: 1.0 / (manoeuvre.until_s - manoeuvre.from_s),
                acceleration_sd_m_s2: math::hypot(manoeuvre.ax_m_s2, manoeuvre.ay_m_s2) / MANOEUVRE_FACTOR,
            });
            manoeuvres.chain([*model]).collect()
        }
    };
    let largest = |of: &dyn Fn(&TargetParams) -> f64| motions.iter().map(of).fold(0.0, f64::max);
    let filter = &settings.team.track.target;
    let (rate_1_s, sd_m_s2) = (filter.correlation_rate_1_s, filter.acceleration_sd_m_s2);
    let least_m_s2 = ASSUMED_SHARE * largest(&|motion| motion.acceleration_sd_m_s2);
    // The density of the process noise is proportional to the rate and to the square of the acceleration. Without
    // correlation rate, an acceleration stays as it is.
    let density = |motion: &TargetParams| {
        motion.correlation_rate_1_s.min(1.0 / CHANGE_S) * motion.acceleration_sd_m_s2 * motion.acceleration_sd_m_s2
    };
    let least_1_s = ASSUMED_SHARE * ASSUMED_SHARE * largest(&density) / (sd_m_s2 * sd_m_s2).max(f64::MIN_POSITIVE);
    let is_less = |value: f64, least: f64| value < (1.0 - 1e-9) * least;
    let (key, value, what, least) = if is_less(sd_m_s2, least_m_s2) {
        ("filter.acceleration_sd_m_s2", sd_m_s2, "targets accelerate", least_m_s2)
    } else if is_less(rate_1_s, least_1_s) {
        ("filter.correlation_rate_1_s", rate_1_s, "the accelerations of targets change", least_1_s)
    } else {
        return None;
    };
    // One decimal digit other than zero, rounded up.
    let (mut digits, mut per_unit) = (0, 1.0);
    while least * per_unit < 1.0 - 1e-9 {
        (digits, per_unit) = (digits + 1, 10.0 * per_unit);
    }
    let least = format!("{:.*}", digits, (least * per_unit - 1e-9).ceil() / per_unit);
    Some(format!(
        "{key} = {value}, but {what}: the estimates become too certain and lose them; choose at least {least}"
    ))
}

/// Returns the mean acceleration of vehicles over [`CHANGE_S`], or over less for short tracks. The mean over such a time
/// is insensitive to the noise of receivers.
fn motion_of_traffic(vehicles: &[Vehicle]) -> TargetParams {
    let (mut sum_m_s2, mut count) = (0.0, 0_u32);
    for vehicle in vehicles {
        let (first_us, last_us) = (vehicle.first_us(), vehicle.last_us());
        let step_us = ((last_us - first_us) / 2).min((CHANGE_S * 1e6) as i64);
        if step_us <= 0 {
            continue;
        }
        let every = step_us.max((last_us - first_us) / PLACES_MAX).unsigned_abs() as usize;
        for time_us in (first_us..=last_us - 2 * step_us).step_by(every) {
            let at = |step: i64| vehicle.at(time_us + step * step_us);
            let (Some(before), Some(middle), Some(after)) = (at(0), at(1), at(2)) else { continue };
            let (x_m, y_m) = (after.x_m - 2.0 * middle.x_m + before.x_m, after.y_m - 2.0 * middle.y_m + before.y_m);
            let step_s = step_us as f64 / 1e6;
            sum_m_s2 += math::hypot(x_m, y_m) / (step_s * step_s);
            count += 1;
        }
    }
    let acceleration_sd_m_s2 = if count > 0 { sum_m_s2 / f64::from(count) } else { 0.0 };
    TargetParams { correlation_rate_1_s: 1.0 / CHANGE_S, acceleration_sd_m_s2 }
}

#[cfg(test)]
mod tests {
    use crate::common::load;

    fn warnings(changes: &[&str]) -> Vec<String> {
        load("tour/02-two-uavs", changes, 1).warnings
    }

    /// Each setting has one warning; just within its limit, it has none.
    #[test]
    fn settings_without_effect_are_named() {
        let separation = "separation={horizontal_min_m=300}";
        for (changes, expected) in [
            (&["uavs.speed_m_s=76"][..], "the smallest orbits are not flown: uavs.speed_m_s = 76 at "),
            (
                &["uavs.speed_m_s=76", "orbit.radius_above_turn_limit=false"],
                "the smallest orbits cannot be flown: uavs.speed_m_s = 76 at ",
            ),
            (
                &["uavs.speed_m_s=200"],
                "no orbit can be flown: uavs.speed_m_s = 200 at uavs.turn_rate_max_rad_s = 0.3 needs 7",
            ),
            (&["targets.random.vx_m_s=60"], "no orbit can be flown: a target at 60."),
            (
                &["guidance.law=oh-2015", "guidance.radial_gain=1", "guidance.heading_gain_1_s=0.1"],
                "UAVs do not settle on the smallest orbits, of 250 m: the largest eigenvalue of the guidance loop has modulus 1.0",
            ),
            (&["period_s=1.2"], "UAVs do not settle on the smallest orbits, of 250 m: "),
            (
                &[separation, "guidance.desired_phase_deg=73"],
                "separation.horizontal_min_m = 300 is more than the 297 m",
            ),
            (&["guidance.lead_s=0"], "guidance.lead_s has no effect with guidance.law = \"standoff\""),
            (&["guidance.feedforward=paper"], "guidance.feedforward has no effect with guidance.law = \"standoff\""),
            (&["filter.acceleration_sd_m_s2=0"], "filter.acceleration_sd_m_s2 = 0, but targets accelerate"),
            (
                &["filter.correlation_rate_1_s=0"],
                "filter.correlation_rate_1_s = 0, but the accelerations of targets change",
            ),
        ] {
            let warnings = warnings(changes);
            assert!(warnings.len() == 1 && warnings[0].starts_with(expected), "{warnings:?}");
        }
        for changes in [
            &["uavs.speed_m_s=75"][..],
            &["guidance.law=oh-2015", "guidance.radial_gain=1", "guidance.heading_gain_1_s=0.2"],
            &["guidance.radial_gain=1", "guidance.heading_gain_1_s=0.1"],
            &["guidance.lead_s=3", "guidance.feedforward=static-centre"],
            &["guidance.law=oh-2015", "guidance.lead_s=0", "guidance.feedforward=paper"],
            &[separation, "guidance.desired_phase_deg=74"],
            &[separation, "guidance.desired_phase_deg=73", "groups.altitude_policy=per-uav"],
            &["filter.acceleration_sd_m_s2=0", "targets.acceleration_sd_m_s2=0"],
            &["filter.correlation_rate_1_s=0", "targets.acceleration_sd_m_s2=0"],
            &["filter.correlation_rate_1_s=0", "targets.correlation_rate_1_s=0"],
        ] {
            assert_eq!(warnings(changes), [""; 0]);
        }
    }

    /// With airspeeds of up to 23 m/s: a wind of 21 m/s leaves 2 m/s against it, 20.8 m/s enough, and 23 m/s nothing.
    #[test]
    fn a_wind_that_leaves_little_ground_speed_is_named() {
        let in_wind = |wind: &str| {
            let wind = format!("wind={{speed_m_s={wind}}}");
            let speeds = "uavs={count=2,speed_m_s=18,speed_change_max_m_s=5}";
            warnings(&[&wind, speeds, "targets.random={vx_m_s=0,vy_m_s=0}", "orbit.radius_min_m=690"]).join("\n")
        };
        assert!(
            in_wind("21").starts_with("UAVs may not hold their orbits: a wind of 21.0 m/s leaves 2.0 m/s"),
            "{}",
            in_wind("21")
        );
        assert_eq!(in_wind("20.8"), "");
        let too_strong = in_wind("23");
        assert!(too_strong.starts_with("no orbit can be flown: "), "{too_strong}");
        let expected = "no orbit can be flown: a wind of 23.0 m/s is not slower than the highest airspeed, 23.0 m/s; choose a \
                        larger uavs.speed_m_s or uavs.speed_change_max_m_s, or a smaller wind.speed_m_s";
        assert_eq!(too_strong, expected);
        assert!(in_wind("5,orbit_wind_m_s=21").ends_with("or a smaller wind.orbit_wind_m_s"));
        assert_eq!(in_wind("23,orbit_wind_m_s=5"), too_strong);
        let moving =
            warnings(&["wind={speed_m_s=47}", "targets.random.vx_m_s=9", "targets.random.vy_m_s=0"]).join("\n");
        let expected = "no orbit can be flown: a target at 9.0 m/s in a wind of 47.0 m/s can move at 56.0 m/s in the air, not \
                        slower than the highest airspeed, 55.0 m/s; choose";
        assert!(moving.starts_with(expected), "{moving}");
    }

    /// Targets with 0.1 m/s2 and 0.1 1/s: the filter must assume a fifth, or a 25th of the process noise.
    #[test]
    fn a_filter_nearly_without_process_noise_is_named() {
        let of = |key: &str, value: &str| {
            let targets = ["targets.acceleration_sd_m_s2=0.1", "targets.correlation_rate_1_s=0.1"];
            warnings(&[&[&format!("{key}={value}")[..]], &targets[..]].concat()).join("\n")
        };
        for (key, below, least) in [
            ("filter.acceleration_sd_m_s2", ["0.000001", "0.0199"], "0.02"),
            ("filter.correlation_rate_1_s", ["0.000000001", "0.0039"], "0.004"),
        ] {
            for value in below {
                let warning = of(key, value);
                let (start, end) = (format!("{key} = {value}, but "), format!("; choose at least {least}"));
                assert!(warning.starts_with(&start) && warning.ends_with(&end), "{warning}");
            }
            assert_eq!(of(key, least), "");
        }
    }
}
