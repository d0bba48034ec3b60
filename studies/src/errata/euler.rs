//! Euler's step (4) at 0.5 s: the heading loop is marginally stable, and the orbit about a stationary target is too
//! wide.

use standoff::params::Integrator;
use standoff::{Duration, TeamParams, UavParams};
use standoff_view::figures::study::Plot;

use super::flight::{Flight, Form, PERIOD_S};
use crate::claim::Claim;
use crate::error::Failure;
use crate::monte_carlo_plan::Plan;
use crate::study::{Data, Study, Table, line_of, plot};

/// Maximum mean error of a UAV that has converged to its orbit, m.
const CONVERGED_M: f64 = 0.5;

pub(super) fn study_euler(_: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "errata",
        "Erratum of (4): Euler's step",
        "Time step, gain and lag of Table I: 0.5 s, k_omega = 2 1/s, tau_omega = 1/3 s. The modulus is the spectral \
         radius of the discrete-time heading loop (heading and turn rate under (24)): if it is below 1, errors decay.",
    );
    analyse_heading_loop(&mut found)?;
    fly_about_stationary_target(&mut found);
    Ok(found)
}

/// Computes the spectral radius of the heading loop by the time step.
fn analyse_heading_loop(found: &mut Study) -> Result<(), Failure> {
    let team = TeamParams::paper();
    let modulus = |integrator, period_s: f64| {
        UavParams { integrator, ..team.uav }
            .heading_loop_spectral_radius(team.guidance.heading_gain_1_s, Duration::from_s(period_s))
    };
    let rows: Vec<Vec<f64>> = (1..=40)
        .map(|n| 0.02 * f64::from(n))
        .map(|period_s| vec![period_s, modulus(Integrator::Euler, period_s), modulus(Integrator::Exact, period_s)])
        .collect();
    let lines = [line_of("Euler (4)", 0, &rows, 1), line_of("exact step", 1, &rows, 2)];
    let levels = vec![(1.0, "below: stable".to_owned())];
    let plot = Plot { levels, ..plot("Time step (s)", "Spectral radius", lines) };
    let heading = "Stability of the heading loop by the time step";
    found.draw("errata-euler", heading, "k_omega = 2 1/s, tau_omega = 1/3 s", &[plot])?;
    found.data.push(Data::new("errata-euler", "period_s,modulus_euler,modulus_exact", rows));
    found.claims.push(Claim::computed(
        "(4) at 0.5 s represents (1), whose heading loop is damped: modulus of the exact step",
        "",
        [modulus(Integrator::Exact, PERIOD_S), 0.1],
        modulus(Integrator::Euler, PERIOD_S),
        "at 0.5 s, errors neither decay nor grow with Euler's step; it needs k_omega T_s < 1",
    ));
    Ok(())
}

/// Flies around a stationary target with both integration steps.
fn fly_about_stationary_target(found: &mut Study) {
    let flight = |radius_m, gain| Flight { radius_m, ..Flight::new(Form::Exact, gain) };
    let mut table = Table::new(
        "Mean |r - r_d| about a stationary target (m), the last third of 600 s, exact feedforward:",
        ["orbit (m)", "k_l 1: Euler", "exact step", "k_l 0.2: Euler", "exact step"],
    );
    for radius_m in [250.0, 400.0, 600.0] {
        let errors = [1.0, 0.2]
            .into_iter()
            .flat_map(|gain| [flight(radius_m, gain).euler().mean_error_m(), flight(radius_m, gain).mean_error_m()]);
        table.row(radius_m.to_string(), errors);
    }
    found.tables.push(table);
    let claim = |what: &str, flight: Flight, reason| {
        Claim::computed(what, "m", [0.0, CONVERGED_M], flight.mean_error_m(), reason)
    };
    let reason = "every step along the tangent ends outside the circle on which it starts";
    found.claims.extend([
        claim(
            "the UAV converges to the orbit (Lemma 3.1): mean error about a stationary target, 400 m, k_l = 1, Euler",
            flight(400.0, 1.0).euler(),
            reason,
        ),
        claim("the same with k_l = 0.2", flight(400.0, 0.2).euler(), reason),
        claim("the same with the exact step, k_l = 1", flight(400.0, 1.0), ""),
    ]);
}
