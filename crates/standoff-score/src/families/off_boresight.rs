//! Off-boresight angles of group members.

use crate::geometry::off_boresight_angles_rad;
use crate::mean::Mean;
use crate::metric::{BOTH, Family, LARGE, Metric, metric};
use crate::step::Step;

/// Largest off-boresight angles of the group members of each UAV, degrees. Frames before the sensors are first pointed
/// are skipped.
#[derive(Debug, Default)]
pub(crate) struct OffBoresight {
    mean_deg: Mean,
    max_deg: Option<f64>,
}

impl Family for OffBoresight {
    const SECTION: &'static str = "Custody";
    const METRICS: &'static [Metric<Self>] = &[
        metric("off_boresight_mean_deg", "largest off-boresight angle, mean", LARGE, 0.5, BOTH, |of, _| {
            of.mean_deg.value()
        }),
        metric("off_boresight_max_deg", "largest off-boresight angle, maximum", LARGE, 1.0, BOTH, |of, _| of.max_deg),
    ];

    fn add(&mut self, step: &Step<'_>) {
        // UAVs are processed in pairs (SIMD). A single last UAV is paired with itself.
        for pair in step.frame.uavs.chunks(2) {
            let angles_rad = off_boresight_angles_rad([&pair[0], &pair[pair.len() - 1]], step.matching);
            for angle_rad in angles_rad.into_iter().take(pair.len()).flatten() {
                let largest_deg = angle_rad.to_degrees();
                self.mean_deg.add(largest_deg);
                self.max_deg = Some(self.max_deg.map_or(largest_deg, |max_deg| max_deg.max(largest_deg)));
            }
        }
    }
}
