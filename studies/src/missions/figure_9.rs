//! Figure 9: seven targets, one of them manoeuvring, and four UAVs: two groups, a handoff and a removal.

use standoff_score::{MetricSelection, Scorer};
use standoff_sim::scenario::Scenario;

use super::{MISSION, ORBIT_GROWS, map};
use crate::claim::{Claim, Finding};
use crate::error::Failure;
use crate::monte_carlo_plan::{Plan, time_s, watch};
use crate::statistics::Estimate;
use crate::study::{Data, Study, Table};

/// Index of the manoeuvring target.
const MANOEUVRING: u32 = 0;
/// Time at which the handoff is triggered in the paper, s.
const HANDOFF_S: f64 = 35.0;

/// Observations of a run.
struct RunObservations {
    groups_at_start: usize,
    handoff_started_s: Option<f64>,
    handoff_completed_s: Option<f64>,
    removed_s: Option<f64>,
    all_in_view: bool,
    handoffs: f64,
    removals: f64,
}

/// Flies figure 9.
pub(crate) fn figure_9(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "figure-9",
        "Figure 9: seven targets, four UAVs, a handoff and a removal",
        format!(
            "`{MISSION}`: trajectories of one run, and events of all runs. The times refer to the manoeuvring target, \
             which drives from one group to the other and then away."
        ),
    );
    let runs = plan.each(MISSION, &[], observe)?;
    let always = |what: &str, held: fn(&RunObservations) -> bool, reason| {
        Claim::always(what, "runs", runs.iter().map(held), reason)
    };
    let started_s = times(&runs, |run| run.handoff_started_s);
    found.claims = vec![
        always("the targets are clustered into two groups", |run| run.groups_at_start == 2, ""),
        Claim {
            what: "the handoff of the manoeuvring target is triggered".into(),
            unit: "s",
            finding: Finding::OneRun { paper: HANDOFF_S, ours: Estimate::middle(&started_s) },
            runs: started_s.len(),
            reason: "",
        },
        always(
            "it is completed: the target becomes a member of the other group",
            |run| run.handoff_completed_s.is_some(),
            "",
        ),
        always("as the targets disperse, one is removed from its group", |run| run.removals > 0.0, ""),
        always("every target of a group is in some UAV's view at all times", |run| run.all_in_view, ORBIT_GROWS),
    ];
    found.tables.push(events(&runs));
    let row = |(seed, run): (u64, &RunObservations)| {
        let time = |at: Option<f64>| at.unwrap_or(f64::NAN);
        vec![
            seed as f64,
            time(run.handoff_started_s),
            time(run.handoff_completed_s),
            time(run.removed_s),
            run.handoffs,
            run.removals,
            f64::from(run.all_in_view),
        ]
    };
    let columns = "seed,handoff_started_s,handoff_completed_s,removed_s,handoffs,removals,all_in_view";
    found.data.push(Data::new("figure-9", columns, plan.seeds().zip(&runs).map(row)));
    found.figures.push(map("figure-9", &plan.first(MISSION, &[])?)?);
    Ok(found)
}

/// Returns the values of the runs that have one.
fn times(runs: &[RunObservations], which: fn(&RunObservations) -> Option<f64>) -> Vec<f64> {
    runs.iter().filter_map(which).collect()
}

/// Creates the table of the events of all runs.
fn events(runs: &[RunObservations]) -> Table {
    let mut table = Table::new("Events, in the runs in which they occur:", ["", "runs (%)", "median", "5 %", "95 %"]);
    let mut add = |name: &str, which: fn(&RunObservations) -> Option<f64>| {
        let values = times(runs, which);
        let (share, middle) = (100.0 * values.len() as f64 / runs.len() as f64, Estimate::middle(&values));
        table.row(name, [share, middle.value, middle.low, middle.high]);
    };
    add("first start of the manoeuvring target's handoff (s)", |run| run.handoff_started_s);
    add("first completion (s)", |run| run.handoff_completed_s);
    add("its first removal (s)", |run| run.removed_s);
    add("completed handoffs, all targets", |run| Some(run.handoffs));
    add("removals, all targets", |run| Some(run.removals));
    table
}

fn observe(scenario: &Scenario) -> Result<RunObservations, Failure> {
    let mut scorer = Scorer::new(scenario.settings.score_config(), MetricSelection::all());
    let [mut handoff_started_s, mut handoff_completed_s, mut removed_s] = [None; 3];
    let mut groups_at_start = None;
    watch(scenario, |frame| {
        scorer.frame(frame);
        groups_at_start.get_or_insert(frame.groups.len());
        for event in frame.events.iter().filter(|event| event.target == Some(MANOEUVRING)) {
            match event.kind.as_str() {
                "handoff-started" => _ = handoff_started_s.get_or_insert(time_s(frame)),
                "handoff-completed" => _ = handoff_completed_s.get_or_insert(time_s(frame)),
                "removed" => _ = removed_s.get_or_insert(time_s(frame)),
                _ => {}
            }
        }
    })?;
    let metrics = scorer.metrics();
    Ok(RunObservations {
        groups_at_start: groups_at_start.unwrap_or(0),
        handoff_started_s,
        handoff_completed_s,
        removed_s,
        all_in_view: metrics["member_longest_out_of_view_s"] == Some(0.0),
        handoffs: metrics["handoffs"].unwrap_or(0.0),
        removals: metrics["removals"].unwrap_or(0.0),
    })
}
