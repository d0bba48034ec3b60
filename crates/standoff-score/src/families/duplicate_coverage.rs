//! Targets that UAVs of two groups cover at the same time.

use standoff_record::AgentRow;

use crate::matching::Matching;
use crate::mean::Mean;
use crate::metric::{Family, LARGE, Metric, MetricSet, NOTHING, metric};
use crate::step::Step;

/// Fraction of existing targets that are covered by two groups with assigned UAVs at the same time. Empty if one agent
/// acts for the whole team.
#[derive(Debug, Default)]
pub(crate) struct DuplicateCoverage {
    fraction: Mean,
    /// Targets, and the group of the UAV that covers each; reused buffer.
    served: Vec<(u32, u64)>,
}

impl Family for DuplicateCoverage {
    const SECTION: &'static str = "Coordination";
    const SET: MetricSet = MetricSet::Agents;
    const METRICS: &'static [Metric<Self>] =
        &[metric("duplicate_coverage_fraction", "target time covered by two groups", LARGE, 0.01, NOTHING, |of, _| {
            of.fraction.value()
        })];

    /// A UAV covers a target if it believes that the target is in its own group, because it flies the orbit of that
    /// group.
    fn add(&mut self, step: &Step<'_>) {
        let (frame, agents) = (step.frame, &step.frame.agents);
        if agents.all.is_empty() {
            return;
        }
        self.served.clear();
        let mut matching = Matching::default();
        for AgentRow { agent, .. } in &agents.all {
            let assignment = agents.teammate(*agent, *agent).and_then(|own| own.group.zip(own.group_id));
            let Some((group, id)) = assignment else { continue };
            matching.fill(&frame.truth, agents.tracks_of(*agent).iter().map(|of| &of.row));
            let members = matching.pairs().iter().filter(|pair| pair.track.group == Some(group));
            self.served.extend(members.map(|pair| (pair.target.target, id)));
        }
        self.served.sort_unstable();
        self.served.dedup();
        for truth in &frame.truth {
            let first = self.served.partition_point(|(target, _)| *target < truth.target);
            let second = self.served.get(first + 1).filter(|(target, _)| *target == truth.target);
            self.fraction.add(f64::from(second.is_some()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::score_config;
    use crate::families::agreement::tests::{ALIKE, APART, AgentAssignments, frame};
    use crate::metric::accumulated;

    /// The second target is in the groups of both UAVs, each by its own estimate. The first target is in one group,
    /// which both report.
    #[test]
    fn target_in_two_groups_with_uavs_is_doubly_covered() {
        let share = |agents: &[AgentAssignments]| {
            accumulated::<DuplicateCoverage>(&score_config(), [frame(0, agents)]).fraction.value()
        };
        let twice = [(0, [Some(1), Some(2)], [Some(1), Some(1)]), (1, [Some(1), Some(2)], [Some(1), Some(2)])];
        assert_eq!(share(&twice), Some(0.5));
        assert_eq!((share(&ALIKE), share(&APART)), (Some(0.0), Some(0.0)));
        // Two UAVs in the same group, or one UAV without an assignment, are no double coverage.
        let together = [(0, [Some(1), Some(1)], [Some(1), Some(1)]), (1, [Some(1), Some(1)], [Some(1), Some(1)])];
        let idle = [(0, [Some(1), Some(2)], [Some(1), Some(1)]), (1, [Some(1), None], [Some(1), Some(2)])];
        assert_eq!((share(&together), share(&idle)), (Some(0.0), Some(0.0)));
        assert_eq!(share(&[]), None);
    }
}
