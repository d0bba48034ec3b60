//! Figure 10: histories of the mission of figure 9, and whether d_m follows the error of the centre.

use std::collections::BTreeMap;

use standoff_sim::scenario::Scenario;
use standoff_view::figures::study::study;

use super::{APART_DEG, MISSION};
use crate::claim::{Claim, Finding};
use crate::failure::Failure;
use crate::flights::{IN_METRES, Plan, watch};
use crate::history::{History, bands, data};
use crate::observe::{centre_error_m, separation_deg, standoff_error_m, time_s};
use crate::statistics::{Estimate, mean, rank_correlation};
use crate::study::{Study, Table};

/// Instants that a group must live for its histories to be compared.
const LONG_ENOUGH: usize = 20;
/// The standoff distance error of Table II's last column, m: the paper prints none for this mission.
const TABLE_2_M: f64 = 9.1261;
/// Margins are drawn up to this, m.
const CUT_M: f64 = 400.0;

/// What is seen of a run.
#[derive(Default)]
struct Seen {
    errors_m: History,
    separations_deg: History,
    margins_m: History,
    centre_errors_m: History,
    settled_errors_m: Vec<f64>,
    /// |separation - theta_d|, once settled.
    settled_deg: Vec<f64>,
    /// Rank correlation of d_m and the centre's error, mean over groups.
    correlation: Option<f64>,
}

/// Flies figure 10.
pub(crate) fn figure_10(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "figure-10",
        "Figure 10: histories of that mission",
        format!(
            "`{MISSION}`. The band holds nine of ten values of all UAVs (or groups) of all runs at an instant. d_m is \
             compared with the distance from the estimated centre to the members' true centroid, group by group, by \
             Spearman's rank correlation, which does not mind that one is a square; beside it, the same mission with a \
             margin in metres."
        ),
    );
    let runs = plan.each(MISSION, &[], look)?;
    let metres = plan.each(MISSION, &IN_METRES, look)?;
    let correlations = |runs: &[Seen]| runs.iter().filter_map(|run| run.correlation).collect::<Vec<f64>>();
    let settled = |runs: &[Seen], which: fn(&Seen) -> &[f64]| {
        let means: Vec<f64> = runs.iter().map(which).filter(|values| !values.is_empty()).map(mean).collect();
        (means.len(), Estimate::mean(&means))
    };
    let tendency = correlations(&runs);
    let scenario = plan.first(MISSION, &[])?;
    let wanted_deg = scenario.settings.team.guidance.separation_rad.to_degrees();
    let (n_errors, error) = settled(&runs, |run| &run.settled_errors_m);
    let (n, separation) = settled(&runs, |run| &run.settled_deg);
    found.claims = vec![
        Claim {
            what: "d_m shows the same tendency as the error of the centre: rank correlation".into(),
            unit: "",
            finding: Finding::Tendency { ours: Estimate::mean(&tendency) },
            runs: tendency.len(),
            reason: "d_m is the innovation of one scan, new at every instant; the centre's error is what many scans left. \
                     They rise together at a change of members, and that is a small part of the time",
        },
        Claim {
            what: "successful in terms of standoff distance error: mean once settled, beside that of Table II's last column"
                .into(),
            unit: "m",
            finding: Finding::Number { paper: TABLE_2_M, tolerance: TABLE_2_M, ours: error },
            runs: n_errors,
            reason: "at a change of members the margin (16) runs to kilometres and r_d to its bound (see its erratum); \
                     with a margin in metres a part remains, for the centre itself jumps",
        },
        Claim {
            what: format!("the pairs keep {wanted_deg:.0} deg apart, once settled: mean error"),
            unit: "deg",
            finding: Finding::Number { paper: 0.0, tolerance: APART_DEG, ours: separation },
            runs: n,
            reason: "",
        },
    ];
    let mut table = Table::new(
        "Once settled, mean over UAVs, groups and runs with 95 % intervals:",
        &[
            "margin",
            "standoff error (m)",
            "low",
            "high",
            "error of the separation (deg)",
            "low",
            "high",
            "d_m and centre error: correlation",
            "low",
            "high",
        ],
    );
    for (name, runs) in [("(16) as printed", &runs), ("in metres", &metres)] {
        let error = settled(runs, |run| &run.settled_errors_m).1;
        let separation = settled(runs, |run| &run.settled_deg).1;
        let tendency = Estimate::mean(&correlations(runs));
        table.row(name, [error, separation, tendency].into_iter().flat_map(|e| [e.value, e.low, e.high]));
    }
    found.tables.push(table);
    let histories = |which: fn(&Seen) -> &History| runs.iter().map(|run| which(run).clone()).collect::<Vec<History>>();
    let (errors, angles) = (histories(|run| &run.errors_m), histories(|run| &run.separations_deg));
    let (margins, centres) = (histories(|run| &run.margins_m), histories(|run| &run.centre_errors_m));
    let mut separation = bands("Separation of pairs (°)", &[("", &angles)]);
    separation.shown.clear();
    separation.levels.push((wanted_deg, "wanted".to_owned()));
    let mut margin = bands(&format!("d_m (m), up to {CUT_M:.0} m"), &[("", &margins)]);
    margin.cut = Some(CUT_M);
    let plots = [
        bands("Standoff error (m)", &[("", &errors)]),
        separation,
        margin,
        bands("Error of the centre (m)", &[("", &centres)]),
    ];
    let heading = "Histories of four UAVs about two groups, over many runs (figure 10)";
    let caption = format!("{MISSION}, {} runs", plan.runs);
    found.figures.push(study("figure-10", heading, &caption, &plots).map_err(Failure::running)?);
    found.data.push(data(
        "figure-10",
        &[
            ("standoff_error_m", &errors),
            ("separation_deg", &angles),
            ("margin_m", &margins),
            ("centre_error_m", &centres),
        ],
    ));
    Ok(found)
}

fn look(scenario: &Scenario) -> Result<Seen, Failure> {
    let (mut seen, settle_s) = (Seen::default(), scenario.settings.settle.s());
    let wanted_deg = scenario.settings.team.guidance.separation_rad.to_degrees();
    let mut pairs: BTreeMap<u32, Vec<(f64, f64)>> = BTreeMap::new();
    watch(scenario, |frame| {
        let time_s = time_s(frame);
        let errors: Vec<f64> = frame.uavs.iter().filter_map(|uav| standoff_error_m(frame, uav)).collect();
        let angles: Vec<f64> = frame.groups.iter().filter_map(|group| separation_deg(frame, group)).collect();
        if time_s >= settle_s {
            seen.settled_errors_m.extend(&errors);
            seen.settled_deg.extend(angles.iter().map(|angle| (angle - wanted_deg).abs()));
        }
        seen.errors_m.push((time_s, errors));
        seen.separations_deg.push((time_s, angles));
        let (mut margins, mut centres) = (Vec::new(), Vec::new());
        for group in &frame.groups {
            let Some(error_m) = centre_error_m(frame, group) else { continue };
            pairs.entry(group.group).or_default().push((group.margin_m, error_m));
            margins.push(group.margin_m);
            centres.push(error_m);
        }
        seen.margins_m.push((time_s, margins));
        seen.centre_errors_m.push((time_s, centres));
    })?;
    let groups = pairs.values().filter(|pairs| pairs.len() >= LONG_ENOUGH);
    let correlations: Vec<f64> = groups.filter_map(|pairs| rank_correlation(pairs)).collect();
    seen.correlation = (!correlations.is_empty()).then(|| mean(&correlations));
    Ok(seen)
}
