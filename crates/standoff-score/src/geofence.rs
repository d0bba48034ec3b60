//! Geofence violations and detours, from the recorded UAV positions alone.

use std::collections::{BTreeMap, BTreeSet};

use standoff::{Geofence, Position};
use standoff_record::Frame;

use crate::geometry::at;
use crate::mean::Mean;

/// Geofence statistics of all UAVs so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Zones {
    /// Position of every UAV in the last frame, and the zones that it violated there.
    before: BTreeMap<u32, (Position, BTreeSet<usize>)>,
    violations: u64,
    /// UAV time steps at which the geofence changed the flown command.
    pub(crate) detour: Mean,
}

impl Zones {
    /// Adds the next frame.
    pub(crate) fn frame(&mut self, geofence: &Geofence, frame: &Frame) {
        let mut after = BTreeMap::new();
        for uav in &frame.uavs {
            self.detour.add(f64::from(uav.limiting_zone.is_some()));
            let violated_zones: BTreeSet<usize> = geofence.violated_zones(at(uav)).collect();
            // A UAV that leaves a zone, or crosses its corner between two time steps, crosses the outline as well.
            let mut violated = violated_zones.clone();
            let before = self.before.get(&uav.uav);
            violated.extend(before.into_iter().flat_map(|(was_at, _)| geofence.crosses(*was_at, at(uav))));
            self.violations += match before {
                Some((_, forbade)) => violated.difference(forbade).count() as u64,
                None => violated.len() as u64,
            };
            after.insert(uav.uav, (at(uav), violated_zones));
        }
        self.before = after;
    }

    /// Returns the number of violations that began; `None` before the first frame and without zones.
    pub(crate) fn violations(&self) -> Option<u64> {
        (self.detour.n > 0).then_some(self.violations)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row_fixtures::uav_row;
    use standoff::{Position, Zone, ZoneKind};
    use standoff_record::UavRow;

    fn square(kind: ZoneKind, half_m: f64) -> Zone {
        let corners = [(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)];
        let outline = corners.map(|(x_m, y_m)| Position::from_m(x_m, y_m)).into();
        Zone { name: String::new(), kind, vertices: outline }
    }

    /// Twice into the keep-out zone, once out of the keep-in zone. Starting inside a keep-out zone counts as one
    /// violation.
    #[test]
    fn violations_count_once_per_uav_zone_and_entry() {
        let geofence = Geofence::new(vec![square(ZoneKind::KeepOut, 50.0), square(ZoneKind::KeepIn, 500.0)]).unwrap();
        let count = |places: &[f64]| {
            let mut zones = Zones::default();
            for x_m in places {
                let border = (*x_m > 100.0).then_some(0);
                let uavs = vec![UavRow { x_m: *x_m, y_m: 0.0, limiting_zone: border, ..uav_row(0) }];
                zones.frame(&geofence, &Frame { uavs, ..Frame::default() });
            }
            (zones.violations(), zones.detour.value())
        };
        assert_eq!(count(&[]), (None, None));
        assert_eq!(count(&[100.0, 60.0, 55.0, 60.0]), (Some(0), Some(0.0)));
        assert_eq!(count(&[60.0, 40.0, 0.0, 60.0, 40.0, 600.0]), (Some(3), Some(1.0 / 6.0)));
        assert_eq!(count(&[0.0, 0.0]), (Some(1), Some(0.0)));
    }

    /// Crossing a corner of the keep-out zone between two time steps counts once, and once more on the way back.
    /// Passing next to it does not count. Leaving a zone is no new violation.
    #[test]
    fn crossing_a_zone_between_time_steps_counts_once() {
        let geofence = Geofence::new(vec![square(ZoneKind::KeepOut, 50.0), square(ZoneKind::KeepIn, 500.0)]).unwrap();
        let count = |places: &[(f64, f64)]| {
            let mut zones = Zones::default();
            for (x_m, y_m) in places {
                let uavs = vec![UavRow { x_m: *x_m, y_m: *y_m, ..uav_row(0) }];
                zones.frame(&geofence, &Frame { uavs, ..Frame::default() });
            }
            zones.violations()
        };
        assert_eq!(count(&[(55.0, 40.0), (40.0, 55.0)]), Some(1));
        assert_eq!(count(&[(55.0, 40.0), (40.0, 55.0), (20.0, 55.0), (55.0, 40.0)]), Some(2));
        assert_eq!(count(&[(55.0, 46.0), (46.0, 55.0)]), Some(0));
        assert_eq!(count(&[(60.0, 0.0), (45.0, 0.0), (60.0, 0.0)]), Some(1));
        // Across the keep-out zone, and out of the keep-in zone and back.
        assert_eq!(count(&[(60.0, 0.0), (-60.0, 0.0), (-60.0, 60.0), (600.0, 60.0), (-60.0, 60.0)]), Some(2));
    }
}
