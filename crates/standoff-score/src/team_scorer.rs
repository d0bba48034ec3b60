//! Scores of one team state, frame by frame.

use standoff_record::Frame;

use crate::config::ScoreConfig;
use crate::families;
use crate::metric::{AnyFamily, Run};
use crate::metrics::{MetricSelection, Metrics};
use crate::per_target::PerTarget;
use crate::step::{Inputs, Steps};

/// Scorer of the team state in tables `tracks`, `groups` and `uavs`.
#[derive(Debug)]
pub(crate) struct TeamScorer {
    config: ScoreConfig,
    inputs: Inputs,
    steps: Steps,
    targets: PerTarget,
    /// Families with a selected metric, and the index of the first metric of each.
    families: Vec<(usize, Box<dyn AnyFamily>)>,
}

impl TeamScorer {
    /// Makes a scorer without data for the selected metrics; the other metrics may be `None`.
    pub(crate) fn new(config: ScoreConfig, choice: MetricSelection) -> Self {
        let (mut inputs, mut chosen, mut first) = (Inputs::default(), Vec::new(), 0);
        for family in families::all() {
            let all = family.metrics();
            let is_selected = |index: &usize| choice.has(first + index);
            let selected: Vec<&str> = (0..all.len()).filter(is_selected).map(|index| all[index].name).collect();
            if !selected.is_empty() {
                inputs = inputs.or(family.inputs_of(&selected));
                chosen.push((first, family));
            }
            first += all.len();
        }
        Self { steps: Steps::new(&config, inputs), config, inputs, targets: PerTarget::default(), families: chosen }
    }

    /// Adds the next frame.
    pub(crate) fn frame(&mut self, frame: &Frame) {
        let Self { config, inputs, steps, targets, families } = self;
        steps.next(config, frame, |step| {
            if inputs.targets {
                targets.add(step);
            }
            if inputs.targets && inputs.errors {
                targets.add_errors(step);
            }
            families.iter_mut().for_each(|(_, family)| family.add_step(step));
        });
    }

    /// Returns the metrics so far.
    pub(crate) fn metrics(&self) -> Metrics {
        let run = Run { config: &self.config, targets: &self.targets };
        let mut metrics = Metrics::of([]);
        for (first, family) in &self.families {
            metrics.set(*first, &family.values(&run));
        }
        metrics
    }

    pub(crate) fn config(&self) -> &ScoreConfig {
        &self.config
    }

    /// Scores of every target. Empty if no selected metric needs them.
    pub(crate) fn targets(&self) -> &PerTarget {
        &self.targets
    }
}
