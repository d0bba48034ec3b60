//! How often UAVs are where a zone does not let them, and what keeping off it costs: by where they are, whatever they thought.

use std::collections::{BTreeMap, BTreeSet};

use standoff::{Airspace, Position};

use super::mean::Mean;
use crate::frame::Frame;
use crate::geometry::at;

/// All UAVs so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Zones {
    /// Where everybody was at the last frame, and which zones did not let it be there.
    before: BTreeMap<u32, (Position, BTreeSet<usize>)>,
    violations: u64,
    /// Instants in which zones changed what a UAV flies.
    pub(super) detour: Mean,
}

impl Zones {
    /// Takes in the next frame.
    pub(super) fn frame(&mut self, airspace: &Airspace, frame: &Frame) {
        let mut after = BTreeMap::new();
        for uav in &frame.uavs {
            self.detour.add(f64::from(uav.border.is_some()));
            let forbidding: BTreeSet<usize> = airspace.forbidding(at(uav)).collect();
            // Whoever comes out of a zone, or flies over its corner from one instant to the next, crosses its outline, too.
            let mut met = forbidding.clone();
            let before = self.before.get(&uav.uav);
            met.extend(before.into_iter().flat_map(|(was_at, _)| airspace.crossed(*was_at, at(uav))));
            self.violations += match before {
                Some((_, forbade)) => met.difference(forbade).count() as u64,
                None => met.len() as u64,
            };
            after.insert(uav.uav, (at(uav), forbidding));
        }
        self.before = after;
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

    /// Over a corner of the keep-out, both instants outside: once, and once more on the way back. Past it: never. Out again: the one
    /// time that it came in.
    #[test]
    fn what_is_flown_through_between_two_instants_is_counted_once() {
        let airspace = Airspace::new(vec![square(ZoneKind::KeepOut, 50.0), square(ZoneKind::KeepIn, 500.0)]).unwrap();
        let count = |places: &[(f64, f64)]| {
            let mut zones = Zones::default();
            for (x_m, y_m) in places {
                let uavs = vec![UavRow { x_m: *x_m, y_m: *y_m, ..uav_row(0) }];
                zones.frame(&airspace, &Frame { uavs, ..Frame::default() });
            }
            zones.violations()
        };
        assert_eq!(count(&[(55.0, 40.0), (40.0, 55.0)]), Some(1));
        assert_eq!(count(&[(55.0, 40.0), (40.0, 55.0), (20.0, 55.0), (55.0, 40.0)]), Some(2));
        assert_eq!(count(&[(55.0, 46.0), (46.0, 55.0)]), Some(0));
        assert_eq!(count(&[(60.0, 0.0), (45.0, 0.0), (60.0, 0.0)]), Some(1));
        // Across the keep-out, and over the keep-in's outline and back.
        assert_eq!(count(&[(60.0, 0.0), (-60.0, 0.0), (-60.0, 60.0), (600.0, 60.0), (-60.0, 60.0)]), Some(2));
    }
}
