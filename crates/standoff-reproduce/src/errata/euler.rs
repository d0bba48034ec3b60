//! The Euler step (4) at 0.5 s: the heading loop is on the edge of stability, and a target at rest is orbited too wide.

use standoff::{Duration, Feedforward, Integrator, TeamParams, UavParams};
use standoff_view::figures::study::{Line, Plot, study};

use super::flight::{Flight, PERIOD_S};
use crate::claim::{Claim, Finding};
use crate::failure::Failure;
use crate::statistics::Estimate;
use crate::study::{Data, Study, Table};

pub(super) fn study_euler() -> Result<Study, Failure> {
    let mut found = Study::new(
        "errata",
        "Erratum of (4): Euler's step",
        "Table I's step, gain and lag: 0.5 s, k_omega = 2 1/s, tau_omega = 1/3 s. The modulus is that of the largest \
         eigenvalue of heading and turn rate under (24), step by step: below 1 an error dies out.",
    );
    let team = TeamParams::table_1();
    let modulus = |integrator, period_s: f64| {
        UavParams { integrator, ..team.uav }
            .heading_loop_modulus(team.guidance.heading_gain_1_s, Duration::from_s(period_s))
    };
    let rows: Vec<Vec<f64>> = (1..=40)
        .map(|n| 0.02 * f64::from(n))
        .map(|period_s| vec![period_s, modulus(Integrator::Euler, period_s), modulus(Integrator::Exact, period_s)])
        .collect();
    let line = |(colour, label): (usize, &str)| Line {
        label: label.to_owned(),
        colour,
        dashed: false,
        points: rows.iter().map(|row| (row[0], row[colour + 1])).collect(),
    };
    let plot = Plot {
        axes: ["Time step (s)".to_owned(), "Largest modulus".to_owned()],
        lines: [(0, "Euler (4)"), (1, "exact step")].map(line).to_vec(),
        levels: vec![(1.0, "below: stable".to_owned())],
        ..Plot::default()
    };
    let heading = "Stability of the heading loop by the time step";
    found
        .figures
        .push(study("errata-euler", heading, "k_omega = 2 1/s, tau_omega = 1/3 s", &[plot]).map_err(Failure::running)?);
    found.data.push(Data::new("errata-euler", &["period_s", "modulus_euler", "modulus_exact"], rows));

    let mut table = Table::new(
        "Mean |r - r_d| about a target at rest (m), the last third of 600 s, exact feedforward:",
        &["orbit (m)", "k_l 1: Euler", "exact step", "k_l 0.2: Euler", "exact step"],
    );
    let flight = |radius_m, gain| Flight { radius_m, ..Flight::new(Feedforward::Exact, gain) };
    for radius_m in [250.0, 400.0, 600.0] {
        let errors = [1.0, 0.2]
            .into_iter()
            .flat_map(|gain| [flight(radius_m, gain).euler().mean_error_m(), flight(radius_m, gain).mean_error_m()]);
        table.row(radius_m.to_string(), errors);
    }
    found.tables.push(table);

    let claim = |what: &str, unit, paper, tolerance, ours, reason| Claim {
        what: what.to_owned(),
        unit,
        finding: Finding::Number { paper, tolerance, ours: Estimate::exact(ours) },
        runs: 0,
        reason,
    };
    let standing = "a tangent step ends outside the circle that it starts on, at every step";
    found.claims = vec![
        claim(
            "(4) at 0.5 s carries (1), whose heading loop damps: modulus that of the exact step",
            "",
            modulus(Integrator::Exact, PERIOD_S),
            0.1,
            modulus(Integrator::Euler, PERIOD_S),
            "at 0.5 s Euler's step neither damps nor lets grow: it needs k_omega T_s < 1",
        ),
        claim(
            "the UAV converges to the orbit (Lemma 3.1): mean error about a target at rest, 400 m, k_l = 1, Euler",
            "m",
            0.0,
            0.5,
            flight(400.0, 1.0).euler().mean_error_m(),
            standing,
        ),
        claim("the same with k_l = 0.2", "m", 0.0, 0.5, flight(400.0, 0.2).euler().mean_error_m(), standing),
        claim("the same with the exact step, k_l = 1", "m", 0.0, 0.5, flight(400.0, 1.0).mean_error_m(), ""),
    ];
    Ok(found)
}
