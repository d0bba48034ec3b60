//! How often UAVs are where a zone does not let them, and what keeping off it costs: by where they are, whatever they thought.

use std::collections::BTreeSet;

use standoff::Airspace;

use super::mean::Mean;
use crate::frame::Frame;
use crate::geometry::at;

/// All UAVs so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Zones {
    /// Who is where which zone does not let it, since the last frame.
    trespassing: BTreeSet<(u32, usize)>,
    violations: u64,
    /// Instants in which zones changed what a UAV flies.
    pub(super) detour: Mean,
}

impl Zones {
    /// Takes in the next frame.
    pub(super) fn frame(&mut self, airspace: &Airspace, frame: &Frame) {
        let mut trespassing = BTreeSet::new();
        for uav in &frame.uavs {
            self.detour.add(f64::from(uav.border.is_some()));
            trespassing.extend(airspace.forbidding(at(uav)).map(|zone| (uav.uav, zone)));
        }
        self.violations += trespassing.difference(&self.trespassing).count() as u64;
        self.trespassing = trespassing;
    }

    /// How often one began; `None` before the first frame, and without zones.
    pub(super) fn violations(&self) -> Option<u64> {
        (self.detour.n > 0).then_some(self.violations)
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::uav_row;
    use super::*;
    use crate::frame::UavRow;
    use standoff::{Position, Zone, ZoneKind};

    fn square(kind: ZoneKind, half_m: f64) -> Zone {
        let corners = [(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)];
        let outline = corners.map(|(x_m, y_m)| Position::from_m(x_m, y_m)).into();
        Zone { name: String::new(), kind, outline }
    }

    /// Twice into the keep-out, once out of the keep-in; who begins inside has come there, once.
    #[test]
    fn a_violation_is_counted_when_it_begins_by_uav_and_zone() {
        let airspace = Airspace::new(vec![square(ZoneKind::KeepOut, 50.0), square(ZoneKind::KeepIn, 500.0)]).unwrap();
        let count = |places: &[f64]| {
            let mut zones = Zones::default();
            for x_m in places {
                let border = (*x_m > 100.0).then_some(0);
                let uavs = vec![UavRow { x_m: *x_m, y_m: 0.0, border, ..uav_row(0) }];
                zones.frame(&airspace, &Frame { uavs, ..Frame::default() });
            }
            (zones.violations(), zones.detour.value())
        };
        assert_eq!(count(&[]), (None, None));
        assert_eq!(count(&[100.0, 60.0, 55.0, 60.0]), (Some(0), Some(0.0)));
        assert_eq!(count(&[60.0, 40.0, 0.0, 60.0, 40.0, 600.0]), (Some(3), Some(1.0 / 6.0)));
        assert_eq!(count(&[0.0, 0.0]), (Some(1), Some(0.0)));
    }
}
