//! Warnings about settings that cannot have the effect that their keys promise.

use standoff::research::{AltitudePolicy, Integrator, math};
use standoff::{Law, TeamParams};

use super::resolved::{Settings, Targets};
use crate::traffic::Vehicle;

/// Returns the warnings, one line for each setting.
pub(super) fn warnings(settings: &Settings, targets: &Targets) -> Vec<String> {
    let team = &settings.team;
    let all = [
        heading_loop(settings),
        orbit_loop(settings),
        options_of_the_papers_law(team),
        turning_circle(team, targets),
        bank_limit(settings),
        wind_reserve(team),
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

/// UAVs cannot fly tighter orbits than their turn rate allows. The faster the targets, the larger is the smallest orbit.
fn turning_circle(team: &TeamParams, targets: &Targets) -> Option<String> {
    let (speed_m_s, rate_rad_s) = (team.uav.speed_m_s, team.uav.turn_rate_max_rad_s);
    let (slowest_m_s, fastest_m_s) = target_speeds_m_s(targets);
    let orbit = &team.group.standoff;
    let needs = |target_m_s: f64| {
        let circle_m = team.turn_limit_about_m(target_m_s);
        let (wind_m_s, highest_m_s) = (team.wind.map_or(0.0, |wind| wind.orbit_wind_m_s), team.uav.speed_max_m_s());
        let circle = match (circle_m.is_finite(), wind_m_s >= highest_m_s) {
            (true, _) => format!("{circle_m:.0} m"),
            (false, false) => "more speed".to_owned(),
            (false, true) => format!(
                "more speed in a wind of {wind_m_s:.1} m/s, which is not slower than the highest airspeed, {highest_m_s:.1} m/s"
            ),
        };
        let about = if target_m_s > 0.05 { format!(" about a target at {target_m_s:.1} m/s") } else { String::new() };
        format!("uavs.speed_m_s = {speed_m_s} at uavs.turn_rate_max_rad_s = {rate_rad_s} needs {circle}{about}")
    };
    let exceeds_all = |target_m_s: f64| team.turn_limit_about_m(target_m_s) > orbit.radius_max_m;
    let (maximum_m, minimum_m) = (orbit.radius_max_m, orbit.radius_min_m);
    if exceeds_all(slowest_m_s) {
        Some(format!("no orbit can be flown: {}, and orbit.radius_max_m is {maximum_m}", needs(slowest_m_s)))
    } else if exceeds_all(fastest_m_s) {
        let needs = needs(fastest_m_s);
        Some(format!("no orbit about the fastest targets can be flown: {needs}, and orbit.radius_max_m is {maximum_m}"))
    } else if team.turn_limit_about_m(0.0) > minimum_m {
        let not = if team.group.radius_above_turn_limit { "are not" } else { "cannot be" };
        Some(format!("the smallest orbits {not} flown: {}, and orbit.radius_min_m is {minimum_m}", needs(0.0)))
    } else {
        None
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
fn wind_reserve(team: &TeamParams) -> Option<String> {
    let (wind_m_s, highest_m_s) = (team.wind?.orbit_wind_m_s, team.uav.speed_max_m_s());
    let against_m_s = highest_m_s - wind_m_s;
    (0.0..WIND_RESERVE * team.uav.speed_m_s).contains(&against_m_s).then(|| {
        format!(
            "UAVs may not hold their orbits: a wind of {wind_m_s:.1} m/s leaves {against_m_s:.1} m/s over ground against \
             it, at the highest airspeed of {highest_m_s:.1} m/s; choose a larger uavs.speed_change_max_m_s, or a weaker \
             wind.orbit_wind_m_s"
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

/// A filter without process noise ends up ignoring its measurements.
fn process_noise(settings: &Settings, targets: &Targets) -> Option<String> {
    // Without correlation rate, an acceleration stays as it is.
    let (accelerate, change) = match targets {
        Targets::Traffic(_) => (true, true),
        Targets::Random { model, manoeuvres, .. } => {
            let accelerate = model.acceleration_sd_m_s2 > 0.0;
            let manoeuvre = !manoeuvres.is_empty();
            (accelerate || manoeuvre, accelerate && model.correlation_rate_1_s > 0.0 || manoeuvre)
        }
    };
    let filter = &settings.team.track.target;
    let (key, what) = if accelerate && filter.acceleration_sd_m_s2 <= 0.0 {
        ("filter.acceleration_sd_m_s2", "targets accelerate")
    } else if change && filter.correlation_rate_1_s <= 0.0 {
        // The process noise is proportional to both.
        ("filter.correlation_rate_1_s", "the accelerations of targets change")
    } else {
        return None;
    };
    Some(format!("{key} = 0, but {what}: the estimates become too certain and lose them"))
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
            (
                &["targets.random.vx_m_s=60"],
                "no orbit can be flown: uavs.speed_m_s = 40 at uavs.turn_rate_max_rad_s = 0.3 needs more speed about a target at 60.",
            ),
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
        let expected = "more speed in a wind of 23.0 m/s, which is not slower than the highest airspeed, 23.0 m/s";
        assert!(too_strong.contains(expected) && !too_strong.contains("inf"), "{too_strong}");
    }
}
