//! Flights of the program behind the identified aircraft, with the documented parameters of docs/user/fly.md.

use crate::common::flight::{Flight, config};
use crate::common::offline_flight::{Flown, Target, TargetMotion, manoeuvring, straight};
use standoff_fly::authority::State;
use standoff_fly::config::Config;

/// Configuration of the `team.toml` of docs/user/fly.md.
fn documented() -> Config {
    let mut config = config();
    let params = &mut config.params;
    params.uav.turn_rate_lag_s = 0.8;
    (params.track.sensor.range_sd_m, params.track.sensor.bearing_sd_rad) = (3.0, 1f64.to_radians());
    (params.track.target.correlation_rate_1_s, params.track.target.acceleration_sd_m_s2) = (1.0, 4.0);
    params.group.motion.time_constant_s = 0.5;
    params.guidance.radial_gain = 0.3;
    params.wind.get_or_insert_default().orbit_wind_m_s = 10.0;
    config
}

/// Flies around a target with the documented parameters in a wind, m/s, with turbulence, and measures from 60 to 300 s.
/// `noise` is that of the sensor, m and rad.
fn fly(target: TargetMotion, wind_m_s: f64, noise: [f64; 2]) -> Flown {
    let mut flight = Flight::new(documented(), None);
    flight.target = Target::new(target);
    flight.noise = noise;
    if wind_m_s > 0.0 {
        flight.vehicle.aircraft = flight.vehicle.aircraft.in_wind([0.8 * wind_m_s, 0.6 * wind_m_s], Some(1));
    }
    flight.fly(60.0);
    assert_eq!(flight.companion.authority(), State::Engaged);
    let samples: Vec<[f64; 3]> = (0..2400)
        .map(|_| {
            flight.step();
            let aircraft = &flight.vehicle.aircraft;
            [flight.range_m() - 250.0, aircraft.roll_rad, aircraft.roll_rate_rad_s]
        })
        .collect();
    assert_eq!(flight.vehicle.violations, Vec::<String>::new());
    Flown::of(&samples)
}

/// Airspeed commands hold the ground speed, so that the roll changes more in wind.
#[test]
fn the_orbit_behind_the_autopilot_is_exact_and_quiet() {
    let sensor = [3.0, 1f64.to_radians()];
    let flights =
        [(0.0, [0.0; 2], 1.5, 1.5), (5.0, [0.0; 2], 2.5, 7.0), (8.0, [0.0; 2], 2.5, 7.0), (5.0, sensor, 5.0, 8.0)];
    let mut failed = Vec::new();
    for (wind_m_s, noise, rms_m, roll_rate_deg_s) in flights {
        let flown = fly(straight, wind_m_s, noise);
        println!("wind {wind_m_s} m/s, noise {noise:.2?}: {flown:.2?}");
        let wrong_bank_max = if noise == sensor { 0.02 } else { 0.0 };
        let is_quiet = flown.roll_rate_deg_s <= roll_rate_deg_s && flown.wrong_bank <= wrong_bank_max;
        if !is_quiet || flown.error_m[1] > rms_m {
            failed.push((wind_m_s, noise, flown));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn a_manoeuvring_target_is_orbited_within_5_m_rms_and_18_m_at_most_behind_the_autopilot() {
    for wind_m_s in [0.0, 5.0] {
        let [mean_m, rms_m, max_m] = fly(manoeuvring, wind_m_s, [0.0; 2]).error_m;
        println!("manoeuvring target, wind {wind_m_s} m/s: mean {mean_m:+.1}, rms {rms_m:.1}, max {max_m:.1} m");
        assert!(rms_m <= 5.0 && max_m <= 18.0, "wind {wind_m_s}: {mean_m} {rms_m} {max_m}");
    }
}
