//! Custody: targets in view and in a group, targets that were lost, and targets in no group.

use crate::mean::Mean;
use crate::metric::{BOTH, Family, LARGE, Metric, NOTHING, SMALL, metric, of_all_agents};
use crate::per_target::Tally;
use crate::step::{Inputs, Step};

/// The scores of each target give all metrics but one.
#[derive(Debug, Default)]
pub(crate) struct Custody {
    ungrouped: Mean,
}

const UNGROUPED: &str = "ungrouped_fraction";

impl Family for Custody {
    const SECTION: &'static str = "Custody";
    // The fractions of target time in a group count the time without a running agent, too.
    const METRICS: &'static [Metric<Self>] = &[
        of_all_agents(metric("custody_fraction", "target time in custody", SMALL, 0.01, BOTH, |_, run| {
            run.targets.total(Tally::in_custody).value()
        })),
        of_all_agents(metric(
            "priority_custody_fraction",
            "time of targets of priority above 1 in custody",
            SMALL,
            0.01,
            BOTH,
            |_, run| run.targets.total(Tally::in_custody_by_priority).value(),
        )),
        metric("in_view_fraction", "target time in view of a UAV", SMALL, 0.01, NOTHING, |_, run| {
            run.targets.total(Tally::in_view).value()
        }),
        metric("longest_out_of_view_s", "longest time a target was out of view", LARGE, 1.0, NOTHING, |_, run| {
            let has_existed = run.targets.total(Tally::in_view).n > 0;
            has_existed.then(|| run.targets.longest(|tally| tally.longest_gap) as f64 * run.config.period_s)
        }),
        of_all_agents(metric(UNGROUPED, "target time in no group", LARGE, 0.01, BOTH, |of, _| of.ungrouped.value())),
        metric("member_out_of_view_fraction", "group-member time out of view", LARGE, 0.001, BOTH, |_, run| {
            run.targets.total(Tally::member_out_of_view).value()
        }),
        metric(
            "member_longest_out_of_view_s",
            "longest time a group member was out of view",
            LARGE,
            0.5,
            BOTH,
            |_, run| {
                let has_members = run.targets.total(Tally::member_out_of_view).n > 0;
                has_members.then(|| run.targets.longest(|tally| tally.longest_streak) as f64 * run.config.period_s)
            },
        ),
        metric("reacquired_fraction", "lost targets reacquired", SMALL, 0.02, BOTH, |_, run| {
            run.targets.total(Tally::reacquired).value()
        }),
        metric("reacquisition_time_s", "time to reacquire a lost target", LARGE, 5.0, BOTH, |_, run| {
            run.targets.total(|tally| tally.found).value().map(|time_steps| time_steps * run.config.period_s)
        }),
    ];

    fn inputs(selected: &[&str]) -> Inputs {
        Inputs { targets: selected != [UNGROUPED], ..Inputs::default() }
    }

    fn add(&mut self, step: &Step<'_>) {
        for (target, track) in step.matching.targets() {
            self.ungrouped.add(1.0 - step.grouped.fraction(target, track));
        }
    }
}
