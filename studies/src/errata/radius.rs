//! (27) neglects the motion of the centre: about a moving centre the smallest feasible orbit is larger.

use standoff::TeamParams;
use standoff::guidance::standoff_distance::moving_centre_limit_m;
use standoff::guidance::standoff_distance::turn_limit_m;
use standoff_view::figures::study::Plot;

use super::flight::{Flight, Form};
use crate::claim::Claim;
use crate::error::Failure;
use crate::monte_carlo_plan::Plan;
use crate::study::{Data, Study, Table, line_of, plot};

/// Maximum error of an orbit that counts as kept, relative to its radius.
const KEPT_FRACTION: f64 = 0.05;
/// Radii that are flown, as multiples of the limit.
const MULTIPLES: [f64; 4] = [0.8, 0.9, 1.0, 1.2];

pub(super) fn study_radius(_: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "errata",
        "Erratum of (27): the smallest orbit",
        "(27) requires r_d >= v / omega_max (133 m with Table I). The limit about a moving centre is \
         (v + v_t)^2 / (v omega_max). The flights use the feedforward of the field that is flown, k_l = 1 and no lead.",
    );
    let uav = TeamParams::paper().uav;
    let published_m = turn_limit_m(uav.speed_m_s, 0.0, uav.turn_rate_max_rad_s);
    let limit_m = |centre_m_s: f64| moving_centre_limit_m(uav.speed_m_s, centre_m_s, uav.turn_rate_max_rad_s);
    let error_m = |centre_speed_m_s: f64, radius_m: f64| {
        Flight { centre_speed_m_s, radius_m, ..Flight::new(Form::Field, 1.0) }.largest_error_m()
    };
    let mut rows = Vec::new();
    for centre_m_s in (0..=20).map(f64::from) {
        let flown = MULTIPLES.map(|multiple| error_m(centre_m_s, multiple * limit_m(centre_m_s)));
        let row = [centre_m_s, limit_m(centre_m_s), error_m(centre_m_s, published_m)];
        rows.push(row.into_iter().chain(flown).collect::<Vec<f64>>());
    }
    let labels = MULTIPLES.map(|multiple| format!("at {multiple} of the limit"));
    let labels = [format!("at (27), {published_m:.0} m")].into_iter().chain(labels);
    let lines = (0..).zip(labels).map(|(colour, label)| line_of(label, colour, &rows, colour + 2));
    let plot = Plot { shown: vec![0.0], ..plot("Speed of the centre (m/s)", "Largest |r − r_d| (m)", lines) };
    let heading = "Largest orbit error about a moving centre, by radius";
    let caption = "limit (v + v_t)² / (v ω_max); the last third of 600 s";
    found.draw("errata-radius", heading, caption, &[plot])?;
    let mut table = Table::new(
        "Largest |r - r_d| (m), by the radius flown:",
        ["centre (m/s)", "limit (m)", "at (27)", "at 0.8 of the limit", "at 0.9", "at the limit", "at 1.2 of it"],
    );
    for row in rows.iter().filter(|row| [0.0, 5.0, 10.0, 15.0, 20.0].contains(&row[0])) {
        table.row(row[0].to_string(), row[1..].iter().copied());
    }
    found.tables.push(table);
    let names = "centre_m_s,limit_m,error_at_27_m,error_at_0.8_m,error_at_0.9_m,error_at_1_m,error_at_1.2_m";
    found.data.push(Data::new("errata-radius", names, rows));
    found.claims.push(Claim::computed(
        format!("(27) suffices: largest error of an orbit of {published_m:.0} m about a centre at 15 m/s"),
        "m",
        [0.0, KEPT_FRACTION * published_m],
        error_m(15.0, published_m),
        "the motion of the centre is neglected: where the UAV flies against it, the required turn rate exceeds the \
         limit",
    ));
    Ok(found)
}
