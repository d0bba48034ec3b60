//! Beyond the paper: the effect of each improvement, and the remaining distance from theoretical limits.

use standoff_score::{MetricSelection, Metrics};

use super::claim::shown;
use super::metric_table::{Column, Differences, data_columns, select, select_columns};
use super::monte_carlo_plan::{DEFAULT_VALUES, PAPER_LAW, PAPER_VALUES, Plan, ScenarioVariant, file_name, measured};
use super::statistics::Estimate;
use super::study::{Data, Study, Table};
use crate::error::Failure;

/// An improvement: the settings that enable it, and those that undo it in `improved/table-2-pair` (empty if not used
/// there).
struct Improvement {
    name: &'static str,
    set: &'static [&'static str],
    undo: &'static [&'static str],
}

const IMPROVEMENTS: [Improvement; 7] = [
    Improvement {
        name: "margin of 1.645 standard deviations, in metres",
        set: &["orbit.margin=standard-deviations", "orbit.margin_sds=1.645"],
        undo: &[],
    },
    Improvement {
        name: "no margin except eps_m",
        set: &["orbit.margin=standard-deviations", "orbit.margin_sds=0"],
        undo: &["orbit.margin=mahalanobis"],
    },
    Improvement {
        name: "centre state shifted by the known jump at a change of members",
        set: &["orbit.centre_jump=shift-state"],
        undo: &["orbit.centre_jump=innovation"],
    },
    Improvement {
        name: "centre of the minimum enclosing circle of the estimates",
        set: &["orbit.centre=enclosing-circle"],
        undo: &["orbit.centre=filtered", "orbit.time_constant_s=0"],
    },
    Improvement {
        name: "sensors pointed at the angular midpoint of the members",
        set: &["orbit.pointing=angular-midpoint"],
        undo: &["orbit.pointing=group-centre"],
    },
    Improvement {
        name: "orbit around that circle, with motion limited to what UAVs can follow",
        set: &["orbit.centre=enclosing-circle", "orbit.time_constant_s=1.5"],
        undo: &["orbit.time_constant_s=0"],
    },
    Improvement {
        name: "heading gain halved",
        set: &["guidance.heading_gain_1_s=1"],
        undo: &["guidance.heading_gain_1_s=2"],
    },
];

/// Name of the improvement that the guidance of the default law is: lead, speed and feedforward.
const GUIDANCE: &str = "guidance: predicted lead, speed relative to the centre, feedforward along the motion";

/// All improvements: the default law.
const ALL: [&str; 1] = ["guidance.law=standoff"];

/// Metrics in the tables.
const SHOWN: [Column; 5] = [
    ("standoff_error_m_settled", "standoff error, true (m)", 1.0),
    ("standoff_error_own_estimate_m_settled", "own estimate (m)", 1.0),
    ("phase_error_deg", "phase (deg)", 1.0),
    ("off_boresight_max_deg", "off-boresight angle, maximum (deg)", 1.0),
    ("standoff_distance_m", "mean r_d (m)", 1.0),
];

/// Goals of `improved/table-2-pair`: metric, description, minimum, maximum.
const GOALS: [(&str, &str, f64, f64); 3] = [
    ("standoff_error_m_settled", "standoff error after the transient, true geometry (m)", 0.0, 3.0),
    ("standoff_error_own_estimate_m_settled", "the same by the agents' own estimates (m)", 0.0, 1.5),
    ("phase_error_deg", "phase error (deg)", 0.0, 0.8),
];

/// Ratio of the number of runs of the search for out-of-view targets to that of other studies.
const VIEW_RUNS_FACTOR: u32 = 50;

const PAIR: &str = "paper/table-2-pair";
const IMPROVED: &str = "improved/table-2-pair";

/// Flies every mission with each improvement, and compares the best settings with their goals.
pub(crate) fn improvements(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "improvements",
        "Beyond the paper: improvements, one at a time",
        "Each improvement is a setting of the scenario, and the guidance of the default law as a whole. The tables show \
         differences from the paper's law with the same seeds, with 95 % intervals. True errors use the true \
         geometry, own estimate errors the agents' own unfiltered (15), both after the transient. Traffic missions \
         start from the paper's law, too, with the exact (25) and the margin (16) as published.",
    );
    let mut missions = vec![
        (PAIR.to_owned(), ScenarioVariant::of(PAIR, &[])),
        ("paper/figure-9".to_owned(), ScenarioVariant::of("paper/figure-9", &[])),
        ("traffic/convoy".to_owned(), ScenarioVariant::of("traffic/convoy", &PAPER_LAW)),
        ("traffic/city".to_owned(), ScenarioVariant::of("traffic/city", &PAPER_LAW)),
    ];
    missions.extend(plan.traffic.iter().map(|file| (file_name(file), ScenarioVariant::over(file, &PAPER_LAW))));
    let choice = select_columns(&SHOWN)?;
    let mut data = Vec::new();
    for (index, (name, mission)) in missions.iter().enumerate() {
        let runs = |set: &[&str]| plan.fly(&mission.and(set), choice);
        let base = runs(&[])?;
        let mut table = gains(&format!("`{name}`: effect of each improvement on the paper's law"), &base);
        let guidance = [&ALL[..], &PAPER_VALUES].concat();
        let rows = IMPROVEMENTS.iter().map(|improvement| (improvement.name, improvement.set));
        let rows = [(GUIDANCE, &guidance[..])].into_iter().chain(rows).chain([("all improvements", &ALL[..])]);
        for (number, (row, set)) in rows.enumerate() {
            let numbers = table.add(row, &runs(set)?);
            data.push([index as f64, number as f64].into_iter().chain(numbers).collect());
        }
        found.tables.push(table.table);
    }
    let all = select(&["standard", "limits"])?;
    let best = plan.fly(&ScenarioVariant::of(IMPROVED, &[]), all)?;
    found.tables.push(without_each(plan, choice, &best)?);
    found.tables.push(goals(plan, &best, &plan.fly(&ScenarioVariant::of(PAIR, &[]), all)?)?);
    let columns = "mission,improvement".to_owned() + &data_columns(&SHOWN, "before");
    found.data.push(Data::new("improvements", columns, data));
    Ok(found)
}

/// Measures `improved/table-2-pair` without each of its improvements.
fn without_each(plan: &Plan, choice: MetricSelection, best: &[Metrics]) -> Result<Table, Failure> {
    let mut table = gains(&format!("`{IMPROVED}` without each improvement"), best);
    let guidance = [&PAPER_LAW[..], &DEFAULT_VALUES].concat();
    let rows = IMPROVEMENTS.iter().map(|improvement| (improvement.name, improvement.undo));
    let rows = [(GUIDANCE, &guidance[..])].into_iter().chain(rows).filter(|(_, undo)| !undo.is_empty());
    for (row, undo) in rows {
        table.add(row, &plan.fly(&ScenarioVariant::of(IMPROVED, undo), choice)?);
    }
    Ok(table.table)
}

/// Creates a table of differences from the paper's law or from the improved one.
fn gains<'a>(title: &str, reference: &'a [Metrics]) -> Differences<'a> {
    Differences::new(format!("{title} (differences from the first row):"), "reference", &SHOWN, reference)
}

/// Creates the table of goals and of theoretical limits.
fn goals(plan: &Plan, best: &[Metrics], paper: &[Metrics]) -> Result<Table, Failure> {
    let mut table =
        Table::new(format!("Goals of `{IMPROVED}`, and theoretical limits:"), ["", "goal", "reached", "value"]);
    let mut row = |what: &str, at_least: f64, at_most: f64, value: Estimate| {
        let within = |value: f64| (at_least..=at_most).contains(&value);
        let reached = match (within(value.value), within(value.low) && within(value.high)) {
            (true, true) => "yes",
            (true, false) => "mean only",
            (false, _) => "no",
        };
        let goal = if at_least == 0.0 { format!("at most {at_most}") } else { format!("{at_least} to {at_most}") };
        table.add(what, [goal, reached.to_owned(), value.formatted(shown)]);
    };
    for (metric, what, at_least, at_most) in GOALS {
        row(what, at_least, at_most, Estimate::of(best, metric));
    }
    // Orbits around the minimum enclosing circle are smaller by definition, so the reference uses this centre,
    // too.
    let same_centre =
        plan.fly(&ScenarioVariant::of(PAIR, &["orbit.centre=enclosing-circle"]), MetricSelection::standard())?;
    let [own, papers] = [best, &same_centre].map(|runs| measured(runs, "standoff_distance_m"));
    let percent = Estimate::percent(&papers, &own);
    row("mean r_d relative to the paper's law with the minimum enclosing circle (% more)", -2.0, 2.0, percent);
    let more = Plan { runs: plan.runs.saturating_mul(VIEW_RUNS_FACTOR), ..plan.clone() };
    let views = select(&["member_longest_out_of_view_s", "infeasible_fraction"])?;
    let unseen = more.fly(&ScenarioVariant::of(IMPROVED, &[]), views)?;
    // Runs with a group that no feasible orbit covers are excluded, because members may then be lost.
    let feasible: Vec<&Metrics> = unseen.iter().filter(|run| run["infeasible_fraction"] == Some(0.0)).collect();
    let longest_s =
        feasible.iter().map(|run| run["member_longest_out_of_view_s"].unwrap_or(f64::INFINITY)).fold(0.0, f64::max);
    let what =
        format!("longest time out of view, in {} of {} runs (always feasible) (s)", feasible.len(), unseen.len());
    row(&what, 0.0, 0.0, Estimate::exact(longest_s));
    for (name, runs) in [(IMPROVED, best), (PAIR, paper)] {
        for (ratio, numerator, denominator) in Metrics::POOLED {
            let value = Estimate::pooled(runs, numerator, denominator);
            row(&format!("`{ratio}` of `{name}`"), 0.97, 1.02, value);
        }
        for metric in ["anees", "nis"] {
            row(&format!("`{metric}` of `{name}`"), 0.95, 1.05, Estimate::of(runs, metric));
        }
    }
    for (metric, what) in [
        ("orbit_prediction_error_m_settled", "lower bound of the true standoff error with this information (m)"),
        ("own_orbit_prediction_error_m_settled", "lower bound of the error by own estimates (m)"),
    ] {
        let limit = Estimate::of(best, metric).formatted(shown);
        table.add(what, [String::new(), String::new(), limit]);
    }
    Ok(table)
}
