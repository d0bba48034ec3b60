//! Detections on the page, the tentative tracks that they start, and the true velocities that blind zones need: tables of
//! details of runs whose sensors are not ideal.
//!
//! Detections have no ids, and those of tentative tracks have 64 bits. The number of a row is its place in its time step.

use std::borrow::Cow;

use standoff_record::Frame;

use super::recorded::Recorded;
use super::table::Table;
use crate::figures::DetectionSetup;

/// Maximum number of detections, and of tentative tracks, of a time step on the page. Further ones are left out: no map
/// could show them.
const SHOWN_MAX: usize = 4000;

const COLUMNS: [&str; 5] = ["uav", "target", "range_m", "bearing_rad", "range_rate_m_s"];

const VELOCITY: [&str; 2] = ["true_vx_m_s", "true_vy_m_s"];

/// Tables of the detections of a part.
#[derive(Debug)]
pub(super) struct DetectionTables {
    detections: Table,
    /// Tentative tracks, if the sensors report no identities.
    tentative: Option<Table>,
    /// True velocities of targets, if the sensors have a minimum detectable velocity.
    velocities: Option<Table>,
}

impl DetectionTables {
    pub(super) fn new(setup: &DetectionSetup, recorded: &Recorded) -> Self {
        let tentative = || Table::new("tentative", recorded.tentative.names());
        Self {
            tentative: (!setup.has_labels).then(tentative),
            detections: Table::new("detections", COLUMNS.map(Cow::from)),
            velocities: (setup.mdv_m_s > 0.0).then(|| Table::new("velocities", VELOCITY.map(Cow::from))),
        }
    }

    /// Adds the next time step.
    pub(super) fn next_step(&mut self, frame: &Frame, recorded: &Recorded) {
        self.detections.next_step();
        for (place, row) in (0..).zip(frame.detections.iter().take(SHOWN_MAX)) {
            let measured =
                [Some(row.range_m), Some(row.bearing_rad), row.range_rate_m_s].map(|value| value.map(rounded::<16>));
            let names = [Some(f64::from(row.uav)), row.target.map(f64::from)];
            self.detections.put(place, names.into_iter().chain(measured));
        }
        if let Some(tentative) = &mut self.tentative {
            tentative.next_step();
            for (place, row) in (0..).zip(frame.tentative.iter().take(SHOWN_MAX)) {
                tentative.put(place, recorded.tentative.values(Some(row)).map(|value| value.map(rounded::<12>)));
            }
        }
        if let Some(velocities) = &mut self.velocities {
            velocities.next_step();
            for row in &frame.truth {
                velocities.put(row.target, [row.vx_m_s, row.vy_m_s].map(|value| Some(rounded::<16>(value))));
            }
        }
    }

    pub(super) fn tables(&self) -> impl Iterator<Item = &Table> {
        std::iter::once(&self.detections).chain(&self.tentative).chain(&self.velocities)
    }

    /// Largest number of rows of detections or tentative tracks.
    pub(super) fn rows(&self) -> usize {
        self.detections.rows().max(self.tentative.as_ref().map_or(0, Table::rows))
    }

    /// Maximum number of these rows after one more time step.
    pub(super) fn rows_with(&self, frame: &Frame) -> usize {
        let tentative = self.tentative.as_ref().map(|table| table.rows_with(frame.tentative.len().min(SHOWN_MAX)));
        self.detections.rows_with(frame.detections.len().min(SHOWN_MAX)).max(tentative.unwrap_or(0))
    }
}

/// Rounds to this number of significant bits: with 16, to 1 cm in 1 km. Noise does not compress, so that its last bits
/// would only take space.
fn rounded<const BITS: u32>(value: f64) -> f64 {
    let last = 1u32 << (f32::MANTISSA_DIGITS - BITS);
    let bits = (value as f32).to_bits();
    f64::from(f32::from_bits(bits.saturating_add(last / 2) & !(last - 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_the_first_bits_and_missing_values() {
        for value in [1.0, -0.25, 1234.5, 3.0, -1e-3, 65_535.0, 0.0] {
            let error = |got: f64| (got - value).abs() / value.abs().max(1e-30);
            assert!(error(rounded::<16>(value)) <= 1.0 / f64::from(1 << 16), "{value}");
            assert!(error(rounded::<12>(value)) <= 1.0 / f64::from(1 << 12), "{value}");
        }
        assert_eq!([1.0, -0.25, 0.0].map(rounded::<12>), [1.0, -0.25, 0.0]);
        assert!([f64::NAN, 1e300].map(rounded::<12>).iter().all(|value| !value.is_finite()));
    }
}
