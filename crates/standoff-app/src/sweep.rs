//! Sweeps: a Monte Carlo batch at each point of a grid or a Latin hypercube of scenario keys.
//!
//! ```text
//! axes -> points -> a batch per point (fly_into) -> sweep.parquet, report.html
//! ```
//!
//! All points use the same seeds, so that they differ by the swept values only. The folder of a sweep contains its
//! definition (`sweep.json`) and the folder of each point's batch (`points/0`, ...). Points are resumed like batches.

mod axis;
mod definition;
mod design;
mod differences;
mod results;
mod text;

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use standoff_score::MetricSelection;
use standoff_sim::monte_carlo::{Batch, MonteCarloError, Progress, fly_into};
use standoff_sim::scenario::ScenarioTemplate;

pub use axis::Axis;
pub use definition::{SWEEP, Sweep};
pub use design::{LatinHypercube, POINTS_MAX};
pub use results::{SWEEP_TABLE, SweepResults};

use crate::error::{Failure, of_batch};

impl Sweep {
    /// Flies the missing runs of all points and completes the folder. If anything stops the sweep, another call with the
    /// same sweep continues it. `template` is the scenario without the values of the points; `report` is called with the progress, in runs of all points.
    pub fn fly_into(
        &self,
        dir: &Path,
        template: &ScenarioTemplate,
        threads: Option<NonZeroUsize>,
        stop: &AtomicBool,
        mut report: impl FnMut(Progress),
    ) -> Result<SweepResults, Failure> {
        self.prepare(dir)?;
        let choice = MetricSelection::parse(&self.metrics.join(",")).map_err(Failure::Input)?;
        let of = self.runs * self.size() as u64;
        // Runs that earlier points had at the start, or have now.
        let (mut before, mut done) = (0, 0);
        let mut results = Vec::new();
        for point in 0..self.size() {
            if stop.load(Ordering::Relaxed) {
                return Err(of_batch(MonteCarloError::Interrupted));
            }
            let template = template.changed(&self.changes(point)).map_err(Failure::Scenario)?;
            let batch = Batch::new(&template, self.seed, self.runs, None, choice).map_err(of_batch)?;
            let mut found = None;
            let flown = fly_into(&dir.join(self.point_dir(point)), &template, &batch, threads, stop, |progress| {
                found = Some(progress.before);
                report(Progress { before: before + progress.before, done: done + progress.done, of });
            });
            results.push(flown.map_err(|error| self.in_point(point, error))?);
            (before, done) = (before + found.unwrap_or(self.runs), done + self.runs);
        }
        SweepResults::of(self, &results)?.save(dir)
    }

    /// Adds the values of the point to an error of its batch.
    fn in_point(&self, point: usize, error: MonteCarloError) -> Failure {
        if matches!(error, MonteCarloError::Interrupted) {
            return of_batch(error);
        }
        let changes = self.changes(point).join(" ");
        match of_batch(error) {
            Failure::Input(message) => Failure::Input(format!("{changes}: {message}")),
            Failure::Running(message) => Failure::Running(format!("{changes}: {message}")),
            other => other,
        }
    }
}
