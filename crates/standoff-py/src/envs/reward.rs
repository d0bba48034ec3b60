//! Reward of a time step, computed from the ground truth with the definitions of the metrics.

use standoff_record::Frame;
use standoff_score::{FrameScorer, FrameScores};

/// Score of a time step.
#[derive(Debug, Clone, Default)]
pub(super) struct StepScore {
    /// Number of existing targets.
    pub(super) targets: usize,
    /// Fraction of them that are in custody (in a group and in some UAV's view), as in `custody_fraction`; 0 if no
    /// target exists.
    pub(super) in_custody: f64,
    /// Closeness of each UAV to the true orbit of its group, 0 to 1.
    pub(super) on_orbit: Vec<f64>,
    /// Mean distance of the UAVs from their groups' true orbits, m; `None` if no UAV has one.
    pub(super) standoff_error_m: Option<f64>,
}

impl StepScore {
    /// Scores the next frame of a run. A UAV at `scale_m` from its orbit has an `on_orbit` value of 0.5.
    pub(super) fn update(&mut self, scorer: &mut FrameScorer, frame: &Frame, scale_m: f64) {
        let scores: FrameScores = scorer.frame(frame);
        let custody = scores.custody();
        self.targets = custody.targets;
        self.in_custody = custody.in_custody.map_or(0.0, |count| count as f64 / custody.targets.max(1) as f64);
        self.on_orbit.clear();
        let (mut sum_m, mut n) = (0.0, 0u32);
        for uav in &frame.uavs {
            let error_m = scores.standoff_error_m(uav).map(f64::abs);
            if let Some(error_m) = error_m {
                (sum_m, n) = (sum_m + error_m, n + 1);
            }
            // A UAV without a group, or whose group has no existing target, gets 0: losing a group never increases the
            // reward.
            self.on_orbit.push(error_m.map_or(0.0, |error_m| 1.0 / (1.0 + error_m / scale_m)));
        }
        self.standoff_error_m = (n > 0).then(|| sum_m / f64::from(n));
    }

    /// Reward of each UAV, 0 to 1.
    pub(super) fn rewards(&self) -> impl Iterator<Item = f64> {
        self.on_orbit.iter().map(|on_orbit| self.reward_with(*on_orbit))
    }

    /// Reward of the team, 0 to 1: the mean over its UAVs.
    pub(super) fn reward(&self) -> f64 {
        self.reward_with(self.mean_on_orbit())
    }

    /// Each target has the same weight as all orbits together. Losing a target therefore never increases the reward,
    /// even if the orbit becomes easier to fly without it.
    fn reward_with(&self, on_orbit: f64) -> f64 {
        let targets = self.targets as f64;
        (targets * self.in_custody + on_orbit) / (targets + 1.0)
    }

    pub(super) fn mean_on_orbit(&self) -> f64 {
        self.on_orbit.iter().sum::<f64>() / self.on_orbit.len().max(1) as f64
    }
}
