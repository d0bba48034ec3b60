//! Missions of banking aircraft.

use crate::common::{frames, load};
use standoff::atmosphere::GRAVITY_M_S2;
use standoff::math;
use standoff_record::UavRow;
use standoff_score::{MetricSelection, Metrics};
use standoff_sim::run::fly;
use standoff_sim::scenario::ScenarioTemplate;

const TOUR: &str = "tour/13-banking-aircraft";
const PAIR: &str = "improved/table-2-pair";

fn mean(set: &[&str], of: fn(&Metrics) -> Option<f64>) -> f64 {
    (1..=4).map(|seed| of(&fly(&load(PAIR, set, seed), MetricSelection::all()).unwrap()).unwrap()).sum::<f64>() / 4.0
}

fn error_of(text: &str) -> String {
    let template = ScenarioTemplate::of_text("mine", &format!("{text}\n[[targets.start]]\n"), &[]);
    template.and_then(|template| template.draw(1)).unwrap_err().to_string()
}

/// The table of the bank belongs to the dynamics; without them, the columns are empty.
#[test]
fn the_bank_needs_its_dynamics() {
    assert_eq!(
        error_of("[uavs.bank]\nturn_factor = 0.72"),
        "mine:1:7: uavs.bank: describes a banking aircraft; set uavs.dynamics = \"bank\", or leave out the table"
    );
    assert_eq!(
        error_of("[uavs]\ndynamics = \"bank\"\nbank.bank_max_deg = 90"),
        "mine:3:6: uavs.bank.bank_max_deg = 90: must be at least 5 and at most 80"
    );
    assert_eq!(
        error_of("[uavs]\ndynamics = \"banked\""),
        "mine:2:1: uavs.dynamics = \"banked\": must be \"kinematic\" or \"bank\""
    );
    let is_empty = |row: &UavRow| row.bank_rad.is_none() && row.bank_command_rad.is_none();
    assert!(frames(&load(PAIR, &["duration_s=5"], 1)).iter().flat_map(|frame| &frame.uavs).all(is_empty));
}

/// Bank and turn rate of every row belong together, with and without wind; limits are kept; the command leads the bank.
#[test]
fn the_record_satisfies_the_equation_of_the_turn() {
    for set in [&[][..], &["wind.speed_m_s=5"]] {
        let frames = frames(&load(TOUR, set, 2));
        for pair in frames.windows(2) {
            for (row, next) in pair[0].uavs.iter().zip(&pair[1].uavs) {
                let (bank_rad, airspeed_m_s) = (row.bank_rad.unwrap(), row.airspeed_m_s.unwrap_or(row.speed_m_s));
                let (sin, cos) = math::sin_cos(bank_rad);
                let heading_rate_rad_s = -0.72 * GRAVITY_M_S2 * sin / cos / airspeed_m_s;
                if row.airspeed_m_s.is_none() {
                    assert!((row.turn_rate_rad_s - heading_rate_rad_s).abs() < 1e-12, "{row:?}");
                }
                let roll_rad = next.bank_rad.unwrap() - bank_rad;
                assert!(roll_rad.abs() <= 30f64.to_radians() + 1e-9, "{row:?}");
                assert!(
                    bank_rad.abs().max(row.bank_command_rad.unwrap().abs()) <= 50f64.to_radians() + 1e-9,
                    "{row:?}"
                );
            }
        }
        // On the orbit, anticlockwise, both bank to the left, more than a coordinated turn needs.
        for row in &frames[300].uavs {
            let needed_rad = math::atan2(row.speed_m_s * row.turn_rate_rad_s, GRAVITY_M_S2);
            assert!(row.bank_rad.unwrap() < 0.0 && row.turn_rate_rad_s > 0.0, "{row:?}");
            assert!(set.len() == 1 || -row.bank_rad.unwrap() > 1.2 * needed_rad, "{row:?}");
        }
    }
}

/// With power to spare, the settled error of the orbit at 23 m/s is near that of the kinematic model: for coordinated and
/// uncoordinated turns, and for aircraft that roll immediately. At 40 m/s it is larger: docs/user/dynamics.md.
#[test]
fn the_settled_orbit_error_is_near_that_of_the_kinematic_model() {
    const SPEED: [&str; 2] = ["uavs.speed_m_s=23", "uavs.speed_change_max_m_s=7"];
    const POWER: [&str; 3] =
        ["uavs.dynamics=bank", "uavs.bank.climb_full_power_m_s=100", "uavs.bank.sink_idle_m_s=100"];
    let error_m = |set: &[&str]| mean(set, |run| run["standoff_error_own_estimate_m_settled"]);
    let kinematic_m = error_m(&SPEED);
    let fast = ["uavs.bank.roll_rate_max_deg_s=720", "uavs.bank.roll_lag_s=0.01"];
    for bank in [&[][..], &["uavs.bank.turn_factor=0.72"], &fast] {
        let banking_m = error_m(&[&SPEED[..], &POWER, bank].concat());
        println!("{bank:?}: {banking_m:.2} m, {kinematic_m:.2} m without bank");
        assert!(banking_m <= 1.25 * kinematic_m, "{bank:?}: {banking_m} m, {kinematic_m} m without bank");
    }
}

/// A bank limit that cannot give the limit of the turn rate is reported before the run.
#[test]
fn a_bank_limit_below_the_turn_rate_limit_is_a_warning() {
    let warnings = |set: &[&str]| load(TOUR, set, 1).warnings;
    assert_eq!(warnings(&[]), [""; 0]);
    let low = warnings(&["uavs.bank.bank_max_deg=40"]);
    let expected = "uavs.turn_rate_max_rad_s = 0.3 is not reached: at uavs.speed_m_s = 23, a bank of 40 degrees with \
                    uavs.bank.turn_factor = 0.72 turns at 0.258 rad/s; ";
    assert!(low.len() == 1 && low[0].starts_with(expected), "{low:?}");
    assert_eq!(warnings(&["uavs.bank.bank_max_deg=40", "uavs.turn_rate_max_rad_s=0.25"]), [""; 0]);
}

/// Equal seeds give equal flights, and the agents of separate UAVs fly as one agent for all.
#[test]
fn determinism_of_banking_flights() {
    let uavs = |set: &[&str]| {
        let frames = frames(&load(TOUR, &[set, &["duration_s=60", "wind.speed_m_s=5"]].concat(), 2));
        frames.into_iter().map(|frame| frame.uavs).collect::<Vec<_>>()
    };
    let shared = uavs(&[]);
    assert!(shared == uavs(&[]) && shared == uavs(&["team.agents=per-uav"]));
}

/// A resolved scenario contains the bank with all values, and is the same scenario.
#[test]
fn a_resolved_scenario_spells_out_the_bank() {
    let first = load(PAIR, &["uavs.dynamics=bank"], 1);
    let text = first.resolved().unwrap();
    assert!(text.contains("dynamics = \"bank\"") && text.contains("[uavs.bank]\nbank_max_deg = 60"), "{text}");
    let again = ScenarioTemplate::of_text("again", &text, &[]).unwrap().draw(1).unwrap();
    assert!(again.settings == first.settings && again.settings.team.uav.bank.is_some());
}
