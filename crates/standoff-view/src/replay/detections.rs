//! Detections on the page, and the true velocities that its blind zones need: tables of details of runs whose sensors
//! are not ideal.
//!
//! A detection has no id. Its number in the table is its place among the detections of its time step.

use std::borrow::Cow;

use standoff_record::Frame;

use super::table::Table;
use crate::figures::DetectionSetup;

/// Maximum number of detections of a time step on the page. Further ones are left out: no map could show them.
const SHOWN_MAX: usize = 4000;

const COLUMNS: [&str; 5] = ["uav", "target", "range_m", "bearing_rad", "range_rate_m_s"];

const VELOCITY: [&str; 2] = ["true_vx_m_s", "true_vy_m_s"];

/// Tables of the detections of a part.
#[derive(Debug)]
pub(super) struct DetectionTables {
    detections: Table,
    /// True velocities of targets, if the sensors have a minimum detectable velocity.
    velocities: Option<Table>,
}

impl DetectionTables {
    pub(super) fn new(setup: &DetectionSetup) -> Self {
        Self {
            detections: Table::new("detections", COLUMNS.map(Cow::from)),
            velocities: (setup.mdv_m_s > 0.0).then(|| Table::new("velocities", VELOCITY.map(Cow::from))),
        }
    }

    /// Adds the next time step.
    pub(super) fn next_step(&mut self, frame: &Frame) {
        self.detections.next_step();
        for (place, row) in (0..).zip(frame.detections.iter().take(SHOWN_MAX)) {
            let measured =
                [Some(row.range_m), Some(row.bearing_rad), row.range_rate_m_s].map(|value| value.map(rounded));
            let names = [Some(f64::from(row.uav)), row.target.map(f64::from)];
            self.detections.put(place, names.into_iter().chain(measured));
        }
        if let Some(velocities) = &mut self.velocities {
            velocities.next_step();
            for row in &frame.truth {
                velocities.put(row.target, [row.vx_m_s, row.vy_m_s].map(|value| Some(rounded(value))));
            }
        }
    }

    pub(super) fn tables(&self) -> impl Iterator<Item = &Table> {
        std::iter::once(&self.detections).chain(&self.velocities)
    }

    /// Number of rows of detections.
    pub(super) fn rows(&self) -> usize {
        self.detections.rows()
    }

    /// Maximum number of rows of detections after one more time step.
    pub(super) fn rows_with(&self, frame: &Frame) -> usize {
        self.detections.rows_with(frame.detections.len().min(SHOWN_MAX))
    }
}

/// Rounds to 16 significant bits: 1 cm in 1 km. Noise does not compress, so that its last bits would only take space.
fn rounded(value: f64) -> f64 {
    const LOW: u32 = 1 << 8;
    let bits = (value as f32).to_bits();
    f64::from(f32::from_bits(bits.saturating_add(LOW / 2) & !(LOW - 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_16_bits_and_missing_values() {
        for value in [1.0, -0.25, 1234.5, 3.0, -1e-3, 65_535.0, 0.0] {
            let got = rounded(value);
            assert!((got - value).abs() <= value.abs() / f64::from(1 << 16), "{value}: {got}");
        }
        assert_eq!([rounded(1.0), rounded(-0.25), rounded(0.0)], [1.0, -0.25, 0.0]);
        assert!(!rounded(f64::NAN).is_finite() && !rounded(1e300).is_finite());
    }
}
