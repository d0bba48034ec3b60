//! Consistency of the filters: average normalised estimation error squared (ANEES).

use crate::mean::Mean;
use crate::metric::{BOTH, Family, Metric, NEITHER, metric};
use crate::step::{Inputs, Step};

/// Values of all group members; the scores of each target give the others.
#[derive(Debug, Default)]
pub(crate) struct Consistency {
    nees: Mean,
}

const ALL: &str = "anees";

impl Family for Consistency {
    const SECTION: &'static str = "Estimation";
    const METRICS: &'static [Metric<Self>] = &[
        metric(ALL, "ANEES of group members", NEITHER, 0.05, BOTH, |of, _| of.nees.value()),
        metric("anees_nonmanoeuvring", "ANEES, targets without manoeuvres", NEITHER, 0.05, BOTH, |_, run| {
            run.targets.anees(run.config, false)
        }),
        metric("anees_manoeuvring", "ANEES, manoeuvring targets", NEITHER, 0.05, BOTH, |_, run| {
            run.targets.anees(run.config, true)
        }),
    ];

    fn inputs(selected: &[&str]) -> Inputs {
        Inputs { nees: true, errors: true, targets: selected != [ALL], ..Inputs::default() }
    }

    fn add(&mut self, step: &Step<'_>) {
        step.nees.iter().flatten().for_each(|nees| self.nees.add(*nees));
    }
}
