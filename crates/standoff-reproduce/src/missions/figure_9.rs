//! Figure 9: seven targets, one of them manoeuvring, four UAVs: two groups, a handoff, a discard.

use standoff_sim::scenario::Scenario;
use standoff_sim::score::{Choice, Rules, Scorer};

use super::{MISSION, ORBIT_GROWS, map};
use crate::claim::{Claim, Finding};
use crate::failure::Failure;
use crate::flights::{Plan, time_s, watch};
use crate::statistics::Estimate;
use crate::study::{Data, Study, Table};

/// The manoeuvring target.
const MANOEUVRING: u32 = 0;
/// When the paper's handoff is triggered, s.
const HANDOFF_S: f64 = 35.0;

/// What happens in a run.
struct Seen {
    groups_at_start: usize,
    requested_s: Option<f64>,
    completed_s: Option<f64>,
    discarded_s: Option<f64>,
    all_in_view: bool,
    handoffs: f64,
    discards: f64,
}

/// Flies figure 9.
pub(crate) fn figure_9(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "figure-9",
        "Figure 9: seven targets, four UAVs, a handoff and a discard",
        format!(
            "`{MISSION}`: one run's trajectories, and what happens in all runs. Times are those of the manoeuvring target, \
             which the scenario sends from one group to the other, and then away."
        ),
    );
    let runs = plan.each(MISSION, &[], look)?;
    let always =
        |what: &str, held: fn(&Seen) -> bool, reason| Claim::always(what, "runs", runs.iter().map(held), reason);
    let times = |which: fn(&Seen) -> Option<f64>| runs.iter().filter_map(which).collect::<Vec<f64>>();
    let requested = times(|run| run.requested_s);
    found.claims = vec![
        always("the targets are clustered into two groups", |run| run.groups_at_start == 2, ""),
        Claim {
            what: "the handoff of the manoeuvring target is triggered".into(),
            unit: "s",
            finding: Finding::OneRun { paper: HANDOFF_S, ours: Estimate::middle(&requested) },
            runs: requested.len(),
            reason: "",
        },
        always("it is completed: the target becomes a member of the other group", |run| run.completed_s.is_some(), ""),
        always("as the targets disperse, one is discarded from its group", |run| run.discards > 0.0, ""),
        always("every target of a group is in some UAV's view at all times", |run| run.all_in_view, ORBIT_GROWS),
    ];
    let mut table =
        Table::new("Events, over the runs in which they happen:", ["", "runs (%)", "median", "5 %", "95 %"]);
    let mut add = |name: &str, values: Vec<f64>| {
        let (share, middle) = (100.0 * values.len() as f64 / runs.len() as f64, Estimate::middle(&values));
        table.row(name, [share, middle.value, middle.low, middle.high]);
    };
    add("first request of the manoeuvring target's handoff (s)", requested);
    add("first completion (s)", times(|run| run.completed_s));
    add("its first discard (s)", times(|run| run.discarded_s));
    add("completed handoffs, all targets", times(|run| Some(run.handoffs)));
    add("discards, all targets", times(|run| Some(run.discards)));
    found.tables.push(table);
    let row = |(seed, run): (u64, &Seen)| {
        let time = |at: Option<f64>| at.unwrap_or(f64::NAN);
        vec![
            seed as f64,
            time(run.requested_s),
            time(run.completed_s),
            time(run.discarded_s),
            run.handoffs,
            run.discards,
            f64::from(run.all_in_view),
        ]
    };
    let columns = "seed,requested_s,completed_s,discarded_s,handoffs,discards,all_in_view";
    found.data.push(Data::new("figure-9", columns, plan.seeds().zip(&runs).map(row)));
    found.figures.push(map("figure-9", &plan.first(MISSION, &[])?)?);
    Ok(found)
}

fn look(scenario: &Scenario) -> Result<Seen, Failure> {
    let mut scorer = Scorer::new(Rules::of(&scenario.settings), Choice::ALL);
    let [mut requested_s, mut completed_s, mut discarded_s] = [None; 3];
    let mut groups_at_start = None;
    watch(scenario, |frame| {
        scorer.frame(frame);
        groups_at_start.get_or_insert(frame.groups.len());
        for event in frame.events.iter().filter(|event| event.target == Some(MANOEUVRING)) {
            match event.kind.as_str() {
                "handoff-requested" => _ = requested_s.get_or_insert(time_s(frame)),
                "handoff-completed" => _ = completed_s.get_or_insert(time_s(frame)),
                "discarded" => _ = discarded_s.get_or_insert(time_s(frame)),
                _ => {}
            }
        }
    })?;
    let metrics = scorer.metrics();
    Ok(Seen {
        groups_at_start: groups_at_start.unwrap_or(0),
        requested_s,
        completed_s,
        discarded_s,
        all_in_view: metrics.out_of_view_longest_s == Some(0.0),
        handoffs: metrics.handoffs.unwrap_or(0) as f64,
        discards: metrics.discards.unwrap_or(0) as f64,
    })
}
