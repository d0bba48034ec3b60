//! Warnings about settings that cannot have the effect that their keys promise.

use standoff::TeamParams;
use standoff::research::{AltitudePolicy, Integrator, math, turn_limit_m};

use super::resolved::{Settings, Targets};

/// Returns the warnings, one line for each setting.
pub(super) fn warnings(settings: &Settings, targets: &Targets) -> Vec<String> {
    let team = &settings.team;
    let all = [heading_loop(settings), turning_circle(team), pair_on_orbit(settings), process_noise(settings, targets)];
    all.into_iter().flatten().collect()
}

fn heading_loop(settings: &Settings) -> Option<String> {
    let uav = &settings.team.uav;
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

/// UAVs at nominal speed cannot fly tighter orbits than their turn rate allows, even about a centre at rest.
fn turning_circle(team: &TeamParams) -> Option<String> {
    let (speed_m_s, rate_rad_s) = (team.uav.speed_m_s, team.uav.turn_rate_max_rad_s);
    let circle_m = turn_limit_m(speed_m_s, 0.0, rate_rad_s);
    let turn = format!("uavs.speed_m_s = {speed_m_s} at uavs.turn_rate_max_rad_s = {rate_rad_s} needs {circle_m:.0} m");
    let orbit = &team.group.standoff;
    if circle_m > orbit.radius_max_m {
        Some(format!("no orbit can be flown: {turn}, and orbit.radius_max_m is {}", orbit.radius_max_m))
    } else if circle_m > orbit.radius_min_m {
        Some(format!("the smallest orbits cannot be flown: {turn}, and orbit.radius_min_m is {}", orbit.radius_min_m))
    } else {
        None
    }
}

/// Two UAVs on the smallest orbit, at one altitude, are apart by the chord of the desired phase.
fn pair_on_orbit(settings: &Settings) -> Option<String> {
    let team = &settings.team;
    let minimum_m = team.separation.as_ref()?.horizontal_min_m;
    let radius_m = team.group.standoff.radius_min_m;
    let chord_m = 2.0 * radius_m * math::sin(0.5 * team.guidance.desired_phase_rad);
    let is_one_altitude = team.group.altitude_policy != AltitudePolicy::PerUav;
    (is_one_altitude && chord_m < minimum_m).then(|| {
        format!(
            "separation.horizontal_min_m = {minimum_m} is more than the {chord_m:.0} m between two UAVs at \
             guidance.desired_phase_deg on an orbit of orbit.radius_min_m = {radius_m}: they cannot keep both"
        )
    })
}

/// A filter without process noise ends up ignoring its measurements.
fn process_noise(settings: &Settings, targets: &Targets) -> Option<String> {
    let accelerate = match targets {
        Targets::Traffic(_) => true,
        Targets::Random { model, manoeuvres, .. } => model.acceleration_sd_m_s2 > 0.0 || !manoeuvres.is_empty(),
    };
    (accelerate && settings.team.track.target.acceleration_sd_m_s2 <= 0.0).then(|| {
        "filter.acceleration_sd_m_s2 = 0, but targets accelerate: the estimates become too certain and lose them".into()
    })
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
            (&["uavs.speed_m_s=76"][..], "the smallest orbits cannot be flown: uavs.speed_m_s = 76 at "),
            (&["uavs.speed_m_s=211"], "no orbit can be flown: uavs.speed_m_s = 211 at "),
            (
                &[separation, "guidance.desired_phase_deg=73"],
                "separation.horizontal_min_m = 300 is more than the 297 m",
            ),
            (&["filter.acceleration_sd_m_s2=0"], "filter.acceleration_sd_m_s2 = 0, but targets accelerate"),
        ] {
            let warnings = warnings(changes);
            assert!(warnings.len() == 1 && warnings[0].starts_with(expected), "{warnings:?}");
        }
        for changes in [
            &["uavs.speed_m_s=75"][..],
            &[separation, "guidance.desired_phase_deg=74"],
            &[separation, "guidance.desired_phase_deg=73", "groups.altitude_policy=per-uav"],
            &["filter.acceleration_sd_m_s2=0", "targets.acceleration_sd_m_s2=0"],
        ] {
            assert_eq!(warnings(changes), [""; 0]);
        }
    }
}
