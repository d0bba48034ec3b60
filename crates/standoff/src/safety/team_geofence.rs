//! Geofence of a team whose UAVs may fly at different altitudes: a geofence safety function for each set of zones that
//! binds a UAV.

use std::sync::Arc;

use crate::params::TeamParams;
use crate::safety::geofence::{Geofence, ZoneSet};
use crate::safety::motion::Airframe;
use crate::safety::zones::GeofenceSafety;
use crate::time::Duration;
use crate::uav::UavId;
use crate::validation::{Allowed, ParamError};
use crate::wind::Wind;

/// Maximum number of safety functions that are kept. Teams need about one per altitude; UAVs that climb through many
/// zones need more for a short time.
const KEPT_MAX: usize = 16;

/// The zones of a team, and safety functions for sets of them.
#[derive(Debug, Clone)]
pub(crate) struct TeamGeofence {
    pub(crate) zones: Geofence,
    /// By zones and speed of the wind, m/s, that they allow for. The newest is last.
    safety: Vec<((ZoneSet, f64), Arc<GeofenceSafety>)>,
}

impl TeamGeofence {
    /// Returns `None` without zones, and an error if a UAV cannot circle in the intersection of the keep-in zones.
    pub(crate) fn new(zones: Geofence, params: &TeamParams) -> Result<Option<Self>, Vec<ParamError>> {
        if zones.is_empty() {
            return Ok(None);
        }
        if let Some([found_m, required_m]) =
            zones.lacking_room(&params.uav, Duration::from_s(params.log.period_s), params.orbit_wind_m_s())
        {
            let allowed = Allowed::at_least(required_m).with_reason(
                "the largest circle inside all keep-in zones must contain the tightest circle at the lowest speed, 5 m from \
                 their outlines",
            );
            return Err(vec![ParamError { path: "geofence.room_m".to_owned(), value: found_m, allowed }]);
        }
        let mut geofence = Self { zones, safety: Vec::new() };
        // Building a safety function takes longer than a decision, so the most probable one is built before the flight.
        geofence.safety(params.altitudes_m(UavId(0), None), params, None);
        Ok(Some(geofence))
    }

    /// Safety function of a UAV with altitudes between two, m, in the wind that it assumes; `None` if no zone binds it.
    pub(crate) fn safety(
        &mut self,
        altitudes_m: [f64; 2],
        params: &TeamParams,
        wind: Option<Wind>,
    ) -> Option<Arc<GeofenceSafety>> {
        let binding = self.zones.binding(altitudes_m);
        if binding == ZoneSet::default() {
            return None;
        }
        let wind_m_s = params.geofence_wind_m_s(wind);
        let key = (binding, wind_m_s);
        if let Some((_, safety)) = self.safety.iter().find(|(known, _)| *known == key) {
            return Some(Arc::clone(safety));
        }
        let zones = self.zones.part(binding);
        let airframe = Airframe::new(params.uav, wind_m_s);
        let safety = Arc::new(GeofenceSafety::new(zones, airframe, params.log.period_s));
        if self.safety.len() == KEPT_MAX {
            self.safety.remove(0);
        }
        self.safety.push((key, Arc::clone(&safety)));
        Some(safety)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Position;
    use crate::params::{AltitudePolicy, ClimbParams, LinkModel};
    use crate::safety::geofence::{Zone, ZoneKind};
    use crate::uav::Vertical;

    /// Keep-out zones 100 m high, one above the other from the ground, each in another place.
    fn towers(count: usize) -> Geofence {
        let tower = |nth: usize| {
            let at = |x_m: f64, y_m: f64| Position::from_m(1000.0 * nth as f64 + x_m, y_m);
            let floor_m = 100.0 * nth as f64;
            Zone {
                vertices: vec![at(0.0, 0.0), at(100.0, 0.0), at(0.0, 100.0)],
                altitude_min_m: Some(floor_m),
                altitude_max_m: Some(floor_m + 99.0),
                ..Zone::default()
            }
        };
        Geofence::new((0..count).map(tower).collect()).unwrap()
    }

    fn params(policy: AltitudePolicy) -> TeamParams {
        let mut params = TeamParams::recommended();
        params.group.altitude_policy = policy;
        params
    }

    /// Index of the zones that bind a UAV.
    fn bound(geofence: &mut TeamGeofence, params: &TeamParams, uav: u32, vertical: Option<Vertical>) -> Vec<usize> {
        let altitudes_m = params.altitudes_m(UavId(uav), vertical);
        let safety = geofence.safety(altitudes_m, params, None);
        let mut zones: Vec<usize> =
            safety.iter().flat_map(|safety| safety.geofence().sides()).map(|side| side.zone).collect();
        zones.dedup();
        zones
    }

    #[test]
    fn a_uav_is_bound_by_the_zones_at_its_own_altitude() {
        let params = params(AltitudePolicy::PerUav);
        let mut geofence = TeamGeofence::new(towers(5), &params).unwrap().unwrap();
        // UAV 0 flies at 300 m, UAV 1 at 350 m, UAV 2 at 400 m, UAV 4 above all zones.
        for (uav, expected) in [(0, vec![3]), (1, vec![3]), (2, vec![4]), (4, vec![])] {
            assert_eq!(bound(&mut geofence, &params, uav, None), expected, "UAV {uav}");
        }
        assert_eq!(geofence.safety.len(), 2, "UAVs at altitudes with the same zones share a safety function");
        assert!(TeamGeofence::new(Geofence::default(), &params).unwrap().is_none());
    }

    #[test]
    fn a_uav_that_can_change_groups_is_bound_by_the_zones_at_all_their_altitudes() {
        let mut params = params(AltitudePolicy::PerGroup);
        let mut geofence = TeamGeofence::new(towers(5), &params).unwrap().unwrap();
        assert_eq!(bound(&mut geofence, &params, 0, None), [3, 4]);
        params.uav.climb = Some(ClimbParams { altitude_max_m: 399.0, ..ClimbParams::default() });
        assert_eq!(bound(&mut geofence, &params, 0, None), [3]);
        // If messages can be lost, each UAV has its own altitude.
        params.link = LinkModel::Lossy;
        params.uav.climb = None;
        assert_eq!(bound(&mut geofence, &params, 2, None), [4]);
    }

    #[test]
    fn a_climbing_uav_is_bound_by_the_zones_on_its_way() {
        let mut params = params(AltitudePolicy::Common);
        params.uav.climb = Some(ClimbParams { lag_s: 2.0, ..ClimbParams::default() });
        let mut geofence = TeamGeofence::new(towers(5), &params).unwrap().unwrap();
        let mut at = |altitude_m, climb_rate_m_s| {
            bound(&mut geofence, &params, 0, Some(Vertical { altitude_m, climb_rate_m_s }))
        };
        assert_eq!(at(100.0, 0.0), [1, 2, 3]);
        assert_eq!(at(199.5, 3.0), [2, 3]);
        assert_eq!(at(300.0, 0.0), [3]);
        assert_eq!(at(450.0, 0.0), [3, 4]);
        // It levels off at 404 m before it descends.
        assert_eq!(at(398.0, 3.0), [3, 4]);
        assert_eq!(at(f64::NAN, f64::NAN), [3]);
    }

    #[test]
    fn the_number_of_kept_safety_functions_is_limited() {
        let params = params(AltitudePolicy::Common);
        let mut geofence = TeamGeofence::new(towers(100), &params).unwrap().unwrap();
        for altitude_m in (400..4000).step_by(50) {
            let altitudes_m =
                params.altitudes_m(UavId(0), Some(Vertical { altitude_m: altitude_m.into(), climb_rate_m_s: 0.0 }));
            let safety = geofence.safety(altitudes_m, &params, None).unwrap();
            let sides = safety.geofence().sides().count();
            assert_eq!(sides, 3 * (altitude_m / 100 - 2) as usize, "{altitude_m}");
        }
        assert_eq!(geofence.safety.len(), KEPT_MAX);
    }
    /// Table I: 25 m/s and 0.3 rad/s.
    #[test]
    fn a_keep_in_zone_without_room_for_a_turning_circle_is_refused() {
        let params = TeamParams::recommended();
        let square = |half_m: f64| {
            let vertices = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            let vertices = vertices.map(|(x, y)| Position::from_m(x * half_m, y * half_m)).into();
            let zone = Zone { kind: ZoneKind::KeepIn, vertices, ..Zone::default() };
            TeamGeofence::new(Geofence::new(vec![zone]).unwrap(), &params).map(|_| ())
        };
        // 25 / 0.3 = 83.3 m, the margin of 5 m, and the deviation of an arc from its chord.
        assert_eq!(square(89.0), Ok(()));
        let error = square(88.0).unwrap_err()[0].to_string();
        assert!(error.starts_with("geofence.room_m = 88: must be at least 88."), "{error}");
    }
}
