//! What an instant is worth, by the truth and as the metrics judge it.

use standoff_sim::record::Frame;
use standoff_sim::score::{Judge, Judged};

/// An instant, judged.
#[derive(Debug, Clone, Default)]
pub(super) struct Worth {
    /// Targets that exist.
    pub(super) targets: usize,
    /// Share of them that are in a group and in some UAV's view: that of `watched_fraction`; 0 where none exists.
    pub(super) watched: f64,
    /// How near each UAV is to the true orbit of its group, 0 to 1.
    pub(super) on_orbit: Vec<f64>,
    /// Mean distance of the UAVs from their groups' true orbits, m; `None` where no UAV has one.
    pub(super) standoff_error_m: Option<f64>,
}

impl Worth {
    /// Judges the next frame of a run. A UAV that is `scale_m` off its orbit is half on it.
    pub(super) fn judge(&mut self, judge: &mut Judge, frame: &Frame, scale_m: f64) {
        let judged: Judged = judge.frame(frame);
        let custody = judged.custody();
        self.targets = custody.targets;
        self.watched = custody.watched.map_or(0.0, |watched| watched as f64 / custody.targets.max(1) as f64);
        self.on_orbit.clear();
        let (mut sum_m, mut n) = (0.0, 0u32);
        for uav in &frame.uavs {
            let error_m = judged.standoff_error_m(uav).map(f64::abs);
            if let Some(error_m) = error_m {
                (sum_m, n) = (sum_m + error_m, n + 1);
            }
            // Who has no group, or one of nobody who exists, is on no orbit: nothing is won by losing it.
            self.on_orbit.push(error_m.map_or(0.0, |error_m| 1.0 / (1.0 + error_m / scale_m)));
        }
        self.standoff_error_m = (n > 0).then(|| sum_m / f64::from(n));
    }

    /// The reward of each UAV, 0 to 1.
    pub(super) fn rewards(&self) -> impl Iterator<Item = f64> {
        self.on_orbit.iter().map(|on_orbit| self.reward_with(*on_orbit))
    }

    /// The reward of the team, 0 to 1: the mean of its UAVs'.
    pub(super) fn reward(&self) -> f64 {
        self.reward_with(self.mean_on_orbit())
    }

    /// Every target counts as much as all orbits together: however much easier the orbit is without a target, to lose it
    /// never pays.
    fn reward_with(&self, on_orbit: f64) -> f64 {
        let targets = self.targets as f64;
        (targets * self.watched + on_orbit) / (targets + 1.0)
    }

    pub(super) fn mean_on_orbit(&self) -> f64 {
        self.on_orbit.iter().sum::<f64>() / self.on_orbit.len().max(1) as f64
    }
}
