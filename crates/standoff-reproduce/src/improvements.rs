//! Beyond the paper: what each improvement gains, one at a time, and how close the best is to what is possible.

use standoff_sim::score::{Choice, Metrics};

use super::claim::{shown, signed};
use super::flights::{Flown, PAPERS_LAW, Plan, file_name, measured};
use super::statistics::Estimate;
use super::study::{Data, Study, Table};
use crate::failure::Failure;

/// An improvement: the scenario's switch, and what undoes it in `best/table-2-pair`, where it is one of those flown there.
struct Improvement {
    name: &'static str,
    set: &'static [&'static str],
    undo: &'static [&'static str],
}

const IMPROVEMENTS: [Improvement; 14] = [
    Improvement { name: "feedforward along the field really flown", set: &["guidance.feedforward=flown"], undo: &[] },
    Improvement {
        name: "feedforward along the actual motion, turn rate damped",
        set: &["guidance.feedforward=actual", "guidance.turn_rate_gain=0.3"],
        undo: &["guidance.feedforward=exact", "guidance.turn_rate_gain=0"],
    },
    Improvement { name: "lead scheduled to k_l r_d / v", set: &["guidance.lead=scheduled"], undo: &[] },
    Improvement {
        name: "lead predicted: scheduled, to the spread as it will be then",
        set: &["guidance.lead=predicted"],
        undo: &["guidance.lead=constant"],
    },
    Improvement { name: "standoff distance and rate smoothed over 2 s", set: &["orbit.smoothing_s=2"], undo: &[] },
    Improvement {
        name: "margin of 1.645 standard deviations, in metres",
        set: &["orbit.margin=standard-deviations", "orbit.margin_sds=1.645"],
        undo: &[],
    },
    Improvement {
        name: "no margin but eps_m",
        set: &["orbit.margin=standard-deviations", "orbit.margin_sds=0"],
        undo: &["orbit.margin=mahalanobis"],
    },
    Improvement {
        name: "centre moved by the known jump of a change of members",
        set: &["orbit.on_membership_change=shift"],
        undo: &["orbit.on_membership_change=filter"],
    },
    Improvement { name: "centre at the centroid of the estimates", set: &["orbit.centre=centroid"], undo: &[] },
    Improvement {
        name: "centre of the smallest circle about the estimates",
        set: &["orbit.centre=smallest-circle"],
        undo: &["orbit.centre=centroid"],
    },
    Improvement {
        name: "sensors on the middle of the members as each UAV sees them",
        set: &["orbit.aim=middle"],
        undo: &["orbit.aim=centre"],
    },
    Improvement {
        name: "orbit about the centroid, moved within bounds that UAVs can follow",
        set: &["orbit.centre=centroid", "orbit.response_s=1.5"],
        undo: &["orbit.response_s=0"],
    },
    Improvement {
        name: "heading gain halved",
        set: &["guidance.heading_gain_1_s=1"],
        undo: &["guidance.heading_gain_1_s=2"],
    },
    Improvement {
        name: "speed relative to the centre",
        set: &["guidance.speed_reference=centre"],
        undo: &["guidance.speed_reference=ground"],
    },
];

/// All that `best/figure-9` has.
const ALL: [&str; 18] = [
    "filter.lost_in_view_s=2",
    "guidance.feedforward=actual",
    "guidance.heading_gain_1_s=1",
    "guidance.turn_rate_gain=0.3",
    "guidance.lead=predicted",
    "guidance.speed_reference=centre",
    "orbit.margin=standard-deviations",
    "orbit.margin_sds=0",
    "orbit.on_membership_change=shift",
    "orbit.centre=smallest-circle",
    "orbit.aim=middle",
    "orbit.response_s=1.5",
    "orbit.acceleration_max_m_s2=2.5",
    "orbit.take_back_fraction=0.97",
    "groups.count=needed",
    "groups.discard=widening",
    "groups.assignment_inertia=10",
    "groups.search=lost",
];

/// What the tables show of a mission: metric, heading.
const SHOWN: [(&str, &str); 5] = [
    ("standoff_error_m_settled", "standoff error, true (m)"),
    ("standoff_tracking_error_m_settled", "own view (m)"),
    ("phase_error_deg", "phase (deg)"),
    ("line_of_sight_max_deg", "line of sight, worst (deg)"),
    ("standoff_distance_m", "mean r_d (m)"),
];

/// Goals of `best/table-2-pair`: metric, what it is, at least, at most.
const GOALS: [(&str, &str, f64, f64); 3] = [
    ("standoff_error_m_settled", "standoff error once settled, true geometry (m)", 0.0, 3.0),
    ("standoff_tracking_error_m_settled", "the same by the agents' own view (m)", 0.0, 1.5),
    ("phase_error_deg", "phase error (deg)", 0.0, 0.8),
];

/// So many times as many runs look for a target out of view.
const VIEWS: u32 = 50;

const PAIR: &str = "paper/table-2-pair";
const BEST: &str = "best/table-2-pair";

/// Flies every mission with every improvement, and the best against its goals.
pub(crate) fn improvements(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "improvements",
        "Beyond the paper: improvements, one at a time",
        "Each improvement is a switch of the scenario. Differences from the paper's law, the same seeds, with 95 % \
         intervals; *true* is by the true geometry, *own view* against the agents' own unsmoothed (15), both once \
         settled. Over traffic the paper's law is flown too: its exact (25) and the printed margin (16).",
    );
    let mut missions = vec![
        (PAIR.to_owned(), Flown::of(PAIR, &[])),
        ("paper/figure-9".to_owned(), Flown::of("paper/figure-9", &[])),
        ("traffic/convoy".to_owned(), Flown::of("traffic/convoy", &PAPERS_LAW)),
        ("traffic/city".to_owned(), Flown::of("traffic/city", &PAPERS_LAW)),
    ];
    missions.extend(plan.traffic.iter().map(|file| (file_name(file), Flown::over(file, &PAPERS_LAW))));
    let names: Vec<&str> = SHOWN.iter().map(|(metric, _)| *metric).collect();
    let choice = Choice::parse(&names.join(",")).map_err(Failure::running)?;
    let mut data = Vec::new();
    for (index, (name, mission)) in missions.iter().enumerate() {
        let runs = |set: &[&str]| plan.fly(&mission.and(set), choice);
        let base = runs(&[])?;
        let mut table = gains(&format!("`{name}`: what each adds to the paper's law"), &base);
        let rows = IMPROVEMENTS.iter().map(|improvement| (improvement.name, improvement.set));
        for (number, (row, set)) in rows.chain([("all that best/figure-9 has", &ALL[..])]).enumerate() {
            let changed = runs(set)?;
            add(&mut table, row, &base, &changed);
            data.push(numbers(index, number, &base, &changed));
        }
        found.tables.push(table);
    }
    let all = Choice::parse("standard,limits").map_err(Failure::running)?;
    let best = plan.fly(&Flown::of(BEST, &[]), all)?;
    found.tables.push(without_each(plan, choice, &best)?);
    found.tables.push(goals(plan, &best, &plan.fly(&Flown::of(PAIR, &[]), all)?)?);
    let mut columns = "mission,improvement".to_owned();
    for (metric, _) in SHOWN {
        columns += &format!(",{metric}_before,{metric}_difference,{metric}_half_width");
    }
    found.data.push(Data::new("improvements", columns, data));
    Ok(found)
}

/// What `best/table-2-pair` loses without each of its improvements.
fn without_each(plan: &Plan, choice: Choice, best: &[Metrics]) -> Result<Table, Failure> {
    let mut table = gains(&format!("`{BEST}`: what it is without each"), best);
    for improvement in IMPROVEMENTS.iter().filter(|improvement| !improvement.undo.is_empty()) {
        let without = plan.fly(&Flown::of(BEST, improvement.undo), choice)?;
        add(&mut table, improvement.name, best, &without);
    }
    Ok(table)
}

/// A table of differences, with what they are differences from.
fn gains(title: &str, base: &[Metrics]) -> Table {
    let heads = [""].into_iter().chain(SHOWN.map(|(_, head)| head));
    let mut table = Table::new(format!("{title} (differences; first row: what they are from):"), heads);
    table.add("before", SHOWN.map(|(metric, _)| Estimate::mean(&measured(base, metric)).told(shown)));
    table
}

fn add(table: &mut Table, name: &str, base: &[Metrics], changed: &[Metrics]) {
    table.add(name, SHOWN.map(|(metric, _)| difference(base, changed, metric).told(signed)));
}

/// The mean paired difference of a metric.
pub(crate) fn difference(base: &[Metrics], changed: &[Metrics], metric: &str) -> Estimate {
    let pairs = base.iter().zip(changed).filter_map(|(from, to)| Some(to.value(metric)? - from.value(metric)?));
    Estimate::mean(&pairs.collect::<Vec<_>>())
}

fn numbers(mission: usize, improvement: usize, base: &[Metrics], changed: &[Metrics]) -> Vec<f64> {
    let mut row = vec![mission as f64, improvement as f64];
    for (metric, _) in SHOWN {
        let difference = difference(base, changed, metric);
        row.extend([
            Estimate::mean(&measured(base, metric)).value,
            difference.value,
            0.5 * (difference.high - difference.low),
        ]);
    }
    row
}

/// The goals, and the limits that forbid more.
fn goals(plan: &Plan, best: &[Metrics], paper: &[Metrics]) -> Result<Table, Failure> {
    let mut table = Table::new(format!("Goals of `{BEST}`, and its limits:"), ["", "goal", "reached", "value"]);
    let mut row = |what: &str, at_least: f64, at_most: f64, value: Estimate| {
        let within = |value: f64| (at_least..=at_most).contains(&value);
        let reached = match (within(value.value), within(value.low) && within(value.high)) {
            (true, true) => "yes",
            (true, false) => "yes, but not the whole interval",
            (false, _) => "no",
        };
        let goal = if at_least == 0.0 { format!("at most {at_most}") } else { format!("{at_least} to {at_most}") };
        table.add(what, [goal, reached.to_owned(), value.told(shown)]);
    };
    for (metric, what, at_least, at_most) in GOALS {
        row(what, at_least, at_most, Estimate::mean(&measured(best, metric)));
    }
    // The orbit about the smallest circle is smaller by rule: what is held to is the rule flown.
    let by_rule = plan.fly(&Flown::of(PAIR, &["orbit.centre=smallest-circle"]), Choice::standard())?;
    let [own, papers] = [best, &by_rule].map(|runs| measured(runs, "standoff_distance_m"));
    let percent = Estimate::percent(&papers, &own);
    row("mean r_d over the paper's law's about the smallest circle (percent more)", -2.0, 2.0, percent);
    let more = Plan { runs: plan.runs.saturating_mul(VIEWS), ..plan.clone() };
    let views = Choice::parse("out_of_view_longest_s,infeasible_fraction").map_err(Failure::running)?;
    let unseen = more.fly(&Flown::of(BEST, &[]), views)?;
    // Where no orbit holds a group its members may be lost.
    let feasible: Vec<&Metrics> = unseen.iter().filter(|run| run.infeasible_fraction == Some(0.0)).collect();
    let longest_s = feasible.iter().map(|run| run.out_of_view_longest_s.unwrap_or(f64::INFINITY)).fold(0.0, f64::max);
    let what =
        format!("longest out of view in {} runs (those always feasible of {}) (s)", feasible.len(), unseen.len());
    row(&what, 0.0, 0.0, Estimate::exact(longest_s));
    for (name, runs) in [(BEST, best), (PAIR, paper)] {
        for (ratio, numerator, denominator) in Metrics::POOLED {
            let value = Estimate::pooled(runs, numerator, denominator);
            row(&format!("`{ratio}` of `{name}`"), 0.97, 1.02, value);
        }
        for metric in ["anees", "nis"] {
            row(&format!("`{metric}` of `{name}`"), 0.95, 1.05, Estimate::mean(&measured(runs, metric)));
        }
    }
    for (metric, what) in [
        ("standoff_surprise_m_settled", "no guidance that knows no more has a smaller true standoff error than (m)"),
        ("standoff_tracking_surprise_m_settled", "nor by its own view than (m)"),
    ] {
        let limit = Estimate::mean(&measured(best, metric)).told(shown);
        table.add(what, [String::new(), String::new(), limit]);
    }
    Ok(table)
}
