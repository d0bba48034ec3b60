//! Figure 10: time histories of the mission of figure 9, and the correlation of d_m with the error of the centre.

use std::collections::BTreeMap;

use standoff_score::FrameScorer;
use standoff_sim::scenario::{Scenario, Settings};
use standoff_view::figures::study::Plot;

use super::{MISSION, Orbits, histories, phase_claim, phase_plot};
use crate::claim::{Claim, Finding};
use crate::error::Failure;
use crate::monte_carlo_plan::{IN_METRES, Plan, time_s, watch};
use crate::percentile_bands::{History, bands, data};
use crate::statistics::{Estimate, mean, rank_correlation};
use crate::study::{Study, Table};

/// Minimum lifetime of a group to compare its histories, in time steps.
const LONG_ENOUGH: usize = 20;
/// Standoff distance error in the last column of Table II, m; the paper states none for this mission.
const TABLE_2_M: f64 = 9.1261;
/// Upper limit of the plotted margins, m.
const CUT_M: f64 = 400.0;

/// Observations of a run.
#[derive(Default)]
struct RunObservations {
    orbits: Orbits,
    margins_m: History,
    centre_errors_m: History,
    /// Rank correlation of d_m with the error of the centre, mean over groups.
    correlation: Option<f64>,
}

/// Flies figure 10.
pub(crate) fn figure_10(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "figure-10",
        "Figure 10: time histories of that mission",
        format!(
            "`{MISSION}`. The band contains 90 % of the values of all UAVs (or groups) of all runs at a time step. For \
             each group, d_m is compared with the distance from the estimated centre to the true centroid of the \
             members by Spearman's rank correlation. The margin in metres, which the paper does not have, is \
             `--set {}`.",
            IN_METRES.join(" --set ")
        ),
    );
    let runs = plan.each(MISSION, &[], observe)?;
    let metres = plan.each(MISSION, &IN_METRES, observe)?;
    let settings = plan.first(MISSION, &[])?.settings;
    found.claims = claims(&runs, &settings);
    found.tables.push(margins(&runs, &metres));
    histories_of(&mut found, &runs, &settings)?;
    Ok(found)
}

/// Standoff errors after the transient, m: means of the runs.
fn errors_m(runs: &[RunObservations]) -> Vec<f64> {
    means(runs, |run| &run.orbits.settled_errors_m)
}

/// Phase errors after the transient, degrees: means of the runs.
fn phase_errors_deg(runs: &[RunObservations]) -> Vec<f64> {
    means(runs, |run| &run.orbits.settled_deg)
}

/// Returns the means of the runs that have values.
fn means(runs: &[RunObservations], which: fn(&RunObservations) -> &[f64]) -> Vec<f64> {
    runs.iter().map(which).filter(|values| !values.is_empty()).map(mean).collect()
}

fn correlations(runs: &[RunObservations]) -> Vec<f64> {
    runs.iter().filter_map(|run| run.correlation).collect()
}

fn claims(runs: &[RunObservations], settings: &Settings) -> Vec<Claim> {
    let (tendency, errors_m) = (correlations(runs), errors_m(runs));
    vec![
        Claim {
            what: "d_m shows the same tendency as the error of the centre: rank correlation".into(),
            unit: "",
            finding: Finding::Tendency { ours: Estimate::mean(&tendency) },
            runs: tendency.len(),
            reason: "d_m is the innovation of a single scan, independent at every time step; the error of the centre \
                     results from many scans. They rise together only at changes of members, which are a small part of \
                     the time",
        },
        Claim {
            what: "successful in terms of standoff distance error: mean after the transient, compared with the last \
                   column of Table II"
                .into(),
            unit: "m",
            finding: Finding::Number { paper: TABLE_2_M, tolerance: TABLE_2_M, ours: Estimate::mean(&errors_m) },
            runs: errors_m.len(),
            reason: "at a change of members the margin (16) grows to kilometres and r_d to its bound (see its \
                     erratum); with a margin in metres part of the error remains, because the centre itself jumps",
        },
        phase_claim("pairs", settings, &phase_errors_deg(runs)),
    ]
}

/// Creates the table of the mission with the margin as published, and with one in metres.
fn margins(runs: &[RunObservations], metres: &[RunObservations]) -> Table {
    let mut table = Table::new(
        "After the transient, mean over UAVs, groups and runs with 95 % intervals:",
        "margin|standoff error (m)|low|high|phase error (deg)|low|high|correlation of d_m and centre error|low|high"
            .split('|'),
    );
    for (name, runs) in [("(16) as published", runs), ("in metres", metres)] {
        let columns = [errors_m(runs), phase_errors_deg(runs), correlations(runs)];
        table.estimates(name, columns.map(|values| Estimate::mean(&values)));
    }
    table
}

/// Adds the figure and the data of the time histories.
fn histories_of(found: &mut Study, runs: &[RunObservations], settings: &Settings) -> Result<(), Failure> {
    let errors = histories(runs, |run| &run.orbits.errors_m);
    let angles = histories(runs, |run| &run.orbits.phase_differences_deg);
    let (margins, centres) = (histories(runs, |run| &run.margins_m), histories(runs, |run| &run.centre_errors_m));
    let plots = [
        bands("Standoff error (m)", &errors),
        phase_plot("Phase difference of pairs (°)", &angles, settings),
        Plot { cut: Some(CUT_M), ..bands(&format!("d_m (m), up to {CUT_M:.0} m"), &margins) },
        bands("Error of the centre (m)", &centres),
    ];
    let heading = "Time histories of four UAVs around two groups, over many runs (figure 10)";
    found.draw("figure-10", heading, &format!("{MISSION}, {} runs", runs.len()), &plots)?;
    let columns: [(&str, &[History]); 4] = [
        ("standoff_error_m", &errors),
        ("phase_difference_deg", &angles),
        ("margin_m", &margins),
        ("centre_error_m", &centres),
    ];
    found.data.push(data("figure-10", &columns));
    Ok(())
}

fn observe(scenario: &Scenario) -> Result<RunObservations, Failure> {
    let mut seen = RunObservations::default();
    let mut pairs: BTreeMap<u32, Vec<(f64, f64)>> = BTreeMap::new();
    let mut scorer = FrameScorer::new(scenario.settings.score_config());
    watch(scenario, |frame| {
        let scores = scorer.frame(frame);
        seen.orbits.observe(frame, &scenario.settings);
        let (mut margins, mut centres) = (Vec::new(), Vec::new());
        for group in &frame.groups {
            let Some(error_m) = scores.centre_error_m(group) else { continue };
            pairs.entry(group.group).or_default().push((group.margin_m, error_m));
            margins.push(group.margin_m);
            centres.push(error_m);
        }
        seen.margins_m.push((time_s(frame), margins));
        seen.centre_errors_m.push((time_s(frame), centres));
    })?;
    let groups = pairs.values().filter(|pairs| pairs.len() >= LONG_ENOUGH);
    let correlations: Vec<f64> = groups.filter_map(|pairs| rank_correlation(pairs)).collect();
    seen.correlation = (!correlations.is_empty()).then(|| mean(&correlations));
    Ok(seen)
}
