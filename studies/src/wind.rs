//! Beyond the paper: two UAVs in wind, and on aircraft that bank.

use super::claim::shown;
use super::metric_table::{Column, select_columns, table};
use super::monte_carlo_plan::{Plan, ScenarioVariant};
use super::statistics::Estimate;
use super::study::{Data, Study, Table};
use crate::error::Failure;

const MISSION: &str = "improved/table-2-pair";

/// An airspeed of 23 m/s, from 16 to 30 m/s, on an orbit of 400 m, so that the radius does not depend on the wind.
const SLOW: [&str; 3] = ["uavs.speed_m_s=23", "uavs.speed_change_max_m_s=7", "orbit.radius_min_m=400"];
/// Targets at rest, and at 3 m/s to the east.
const AT_REST: [&str; 2] = ["targets.random.vx_m_s=0", "targets.random.vy_m_s=0"];
const EASTWARD: [&str; 2] = ["targets.random.vx_m_s=3", "targets.random.vy_m_s=0"];

const FROM_WEST: &str = "wind.from_deg=270";

/// Conditions: description, settings, and whether the targets are at rest.
const WINDS: [(&str, &[&str], bool); 10] = [
    ("calm", &[], true),
    ("5 m/s", &["wind.speed_m_s=5", FROM_WEST], true),
    ("8 m/s", &["wind.speed_m_s=8", FROM_WEST], true),
    ("10 m/s; 7 m/s relative to the targets", &["wind.speed_m_s=10", FROM_WEST], false),
    ("10 m/s", &["wind.speed_m_s=10", FROM_WEST], true),
    ("15 m/s; 12 m/s relative to the targets", &["wind.speed_m_s=15", FROM_WEST], false),
    ("15 m/s", &["wind.speed_m_s=15", FROM_WEST], true),
    ("5 m/s, gusts of W20 = 5 m/s", &["wind.speed_m_s=5", FROM_WEST, "wind.gust_w20_m_s=5"], true),
    ("10 m/s, gusts of W20 = 10 m/s", &["wind.speed_m_s=10", FROM_WEST, "wind.gust_w20_m_s=10"], true),
    ("10 m/s, assumed calm", &["wind.speed_m_s=10", FROM_WEST, "wind.belief=given", "wind.believed_speed_m_s=0"], true),
];

const BANK: &str = "uavs.dynamics=bank";
const UNCOORDINATED: &str = "uavs.bank.turn_factor=0.72";
const CLIMB: &str = "uavs.bank.climb_full_power_m_s=100";
const SINK: &str = "uavs.bank.sink_idle_m_s=100";

/// Aircraft: description, settings, and whether slow UAVs fly them, too.
const AIRCRAFT: [(&str, &[&str], bool); 5] = [
    ("kinematic", &[], true),
    ("banking, much power", &[BANK, CLIMB, SINK], false),
    ("banking, uncoordinated, much power", &[BANK, UNCOORDINATED, CLIMB, SINK], false),
    ("banking", &[BANK], true),
    ("banking, uncoordinated", &[BANK, UNCOORDINATED], true),
];

/// Metrics in the tables.
const SHOWN: [Column; 6] = [
    ("standoff_error_m_settled", "standoff error, true (m)", 1.0),
    ("standoff_error_own_estimate_m_settled", "own estimate (m)", 1.0),
    ("phase_error_deg", "phase (deg)", 1.0),
    ("turn_rate_saturated_fraction", "turn rate at its limit (%)", 100.0),
    ("turn_rate_saturated_fraction_settled", "the same, settled (%)", 100.0),
    ("custody_fraction", "custody (%)", 100.0),
];

/// Flies the pair in winds, and on aircraft that bank.
pub(crate) fn wind(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "wind",
        "Beyond the paper: wind and banking aircraft",
        format!(
            "{MISSION} in wind (docs/user/wind.md), and with banking aircraft (docs/user/dynamics.md). The wind blows \
             from the west, and each UAV estimates it. Fast UAVs are those of the mission: 40 m/s, targets at \
             10 m/s. Slow UAVs have an airspeed of 23 m/s (16 to 30 m/s) and an orbit of 400 m. Their targets are at \
             rest in the first table, unless it gives a relative wind, and otherwise move at 3 m/s to the east. \
             Uncoordinated turns have 0.72 of the turn rate of coordinated ones. With much power, power never \
             limits the speed."
        ),
    );
    let choice = select_columns(&SHOWN)?;
    let mut data = Vec::new();
    let mut measure = |table: &mut Table, name: &str, settings: &[&[&str]]| {
        let runs = plan.fly(&ScenarioVariant::of(MISSION, &settings.concat()), choice)?;
        let estimates = SHOWN.map(|(metric, _, factor)| Estimate::of(&runs, metric).times(factor));
        table.add(name, estimates.map(|estimate| estimate.formatted(shown)));
        let numbers = estimates.into_iter().flat_map(|estimate| [estimate.value, estimate.low, estimate.high]);
        data.push([data.len() as f64].into_iter().chain(numbers).collect());
        Ok::<(), Failure>(())
    };
    let mut winds = table("Slow UAVs in wind:", &SHOWN);
    for (name, settings, at_rest) in WINDS {
        let targets = if at_rest { AT_REST } else { EASTWARD };
        measure(&mut winds, name, &[&SLOW, &targets, settings])?;
    }
    let mut aircraft = table("Kinematic and banking aircraft:", &SHOWN);
    let slow = [&SLOW[..], &EASTWARD].concat();
    for (speed, speed_settings) in [("fast", &[][..]), ("slow", &slow)] {
        for (air, wind_settings, _) in &WINDS[..2] {
            for (name, settings, _) in AIRCRAFT.iter().filter(|(.., is_slow)| *is_slow || speed == "fast") {
                measure(&mut aircraft, &format!("{speed}, {air}: {name}"), &[speed_settings, wind_settings, settings])?;
            }
        }
    }
    found.tables = vec![winds, aircraft];
    let columns = SHOWN.map(|(metric, ..)| format!(",{metric},{metric}_low,{metric}_high"));
    found.data.push(Data::new("wind", format!("row{}", columns.concat()), data));
    Ok(found)
}
