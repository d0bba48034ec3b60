//! Phases of the UAVs on one orbit.

use standoff::{Displacement, math};

use crate::geometry::{at, desired_pair_phase_rad, phase_gaps_rad};
use crate::mean::Mean;
use crate::metric::{BOTH, Family, LARGE, Metric, metric};
use crate::step::{Inputs, Step};

/// Phase errors about the true centres.
#[derive(Debug, Default)]
pub(crate) struct Phase {
    error_deg: Mean,
    /// Positions of the UAVs on one orbit relative to its centre; reused buffer.
    from_centre: Vec<Displacement>,
}

impl Family for Phase {
    const SECTION: &'static str = "Guidance";
    const METRICS: &'static [Metric<Self>] =
        &[metric("phase_error_deg", "phase error", LARGE, 0.5, BOTH, |of, _| of.error_deg.value())];

    fn inputs(_: &[&str]) -> Inputs {
        Inputs { true_orbits: true, ..Inputs::default() }
    }

    fn add(&mut self, step: &Step<'_>) {
        for group in &step.frame.groups {
            let Some(orbit) = step.true_orbits.of(group.group) else { continue };
            self.from_centre.clear();
            let uavs = step.uavs.of(group.group).map(|index| at(&step.frame.uavs[index]));
            self.from_centre.extend(uavs.map(|uav| uav - orbit.flown.centre));
            let error_deg = phase_error_deg(&self.from_centre, step.config.desired_phase_rad);
            error_deg.into_iter().for_each(|error_deg| self.error_deg.add(error_deg));
        }
    }
}

/// Deviation of the UAVs' phases about a centre from the desired phases, degrees: for a pair, relative to the desired
/// phase in either direction; for more UAVs, mean over the gaps, as in [`crate::geometry::phase_differences`]. `None`
/// for fewer than two UAVs.
fn phase_error_deg(uavs_rel_centre: &[Displacement], desired_phase_rad: f64) -> Option<f64> {
    match uavs_rel_centre {
        [] | [_] => None,
        [a, b] => {
            let (a, b) = (a.vector(), b.vector());
            let apart_rad = math::atan2(a.perp(&b).abs(), a.dot(&b));
            Some((apart_rad - desired_phase_rad).abs().to_degrees())
        }
        _ => {
            let phases = (0..).zip(uavs_rel_centre).map(|(uav, from_centre)| (uav, from_centre.direction()));
            let gaps = phase_gaps_rad(phases.collect());
            let desired_rad = desired_pair_phase_rad(gaps.len(), desired_phase_rad);
            let errors_rad = gaps.iter().map(|(_, gap_rad)| (gap_rad - desired_rad).abs());
            Some((errors_rad.sum::<f64>() / gaps.len() as f64).to_degrees())
        }
    }
}
