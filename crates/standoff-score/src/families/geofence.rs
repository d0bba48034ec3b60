//! Geofence violations along the flown paths, and detours, from the recorded states of the UAVs alone.

use std::collections::{BTreeMap, BTreeSet};

use standoff::{Geofence, TeamParams, UavId};
use standoff_record::UavRow;

use crate::config::ScoreConfig;
use crate::flown_path::{Curve, Recorded};
use crate::geometry::at;
use crate::mean::Mean;
use crate::metric::{Family, LARGE, Metric, NOTHING, count, metric};
use crate::step::Step;

/// Distance from the flown path at which a crossing is certain, m.
const ACCURACY_M: f64 = 1e-3;

/// Geofence statistics of all UAVs so far. Empty without zones.
#[derive(Debug, Default)]
pub(crate) struct Zones {
    /// State of every UAV in the last frame.
    before: BTreeMap<u32, Before>,
    /// Time of that frame.
    before_us: i64,
    violations: u64,
    /// UAV time steps at which the geofence changed the flown command.
    detour: Mean,
}

/// A UAV in the last frame.
#[derive(Debug, Clone)]
struct Before {
    recorded: Recorded,
    /// Lowest and highest altitude that it may have had, m.
    altitudes_m: [f64; 2],
    violated_zones: BTreeSet<usize>,
}

/// Lowest and highest altitude that a UAV may have, m: the recorded one. If altitudes are not simulated, it is the
/// commanded one; without one, all that the UAV can be commanded to fly at count.
fn altitudes_m(team: &TeamParams, uav: &UavRow) -> [f64; 2] {
    let recorded_m = uav.altitude_m.or(uav.commanded_altitude_m);
    recorded_m.map_or_else(|| team.altitudes_m(UavId(uav.uav), None), |altitude_m| [altitude_m; 2])
}

impl Family for Zones {
    const SECTION: &'static str = "Separation and geofences";
    const METRICS: &'static [Metric<Self>] = &[
        count(metric("zone_violations", "geofence violations", LARGE, 0.1, NOTHING, |of, _| {
            (of.detour.n > 0).then_some(of.violations as f64)
        })),
        metric("geofence_detour_fraction", "UAV time on geofence detours", LARGE, 0.01, NOTHING, |of, _| {
            of.detour.value()
        }),
    ];

    /// Adds the paths from the last frame to the next one, too.
    fn add(&mut self, Step { config, frame, paths, .. }: &Step<'_>) {
        let ScoreConfig { geofence, team, .. } = config;
        if geofence.is_empty() {
            return;
        }
        let duration_s = (frame.time_us - self.before_us) as f64 / 1e6;
        let mut after = BTreeMap::new();
        for uav in &frame.uavs {
            self.detour.add(f64::from(uav.limiting_zone.is_some()));
            let (position, recorded, altitudes_m) = (at(uav), Recorded::from(uav), altitudes_m(team, uav));
            let violated_zones: BTreeSet<usize> = geofence.violated_zones_between(position, altitudes_m).collect();
            // A UAV that leaves a zone, or crosses its corner between two time steps, crosses the outline as well.
            let mut violated = violated_zones.clone();
            let before = self.before.get(&uav.uav);
            if let Some(before) = before {
                let from = before.recorded.position();
                let bend_max_m = paths.bend_max_m(&before.recorded, &recorded, duration_s);
                if geofence.has_side_near(from.midpoint(position), 0.5 * from.distance_m(position) + bend_max_m + 1.0) {
                    let [low_m, high_m] = before.altitudes_m;
                    let between_m = [low_m.min(altitudes_m[0]), high_m.max(altitudes_m[1])];
                    let path = paths.path(&before.recorded, &recorded, duration_s);
                    path.curves().iter().for_each(|curve| add_crossed(geofence, curve, between_m, &mut violated));
                }
            }
            self.violations += match before {
                Some(before) => violated.difference(&before.violated_zones).count() as u64,
                None => violated.len() as u64,
            };
            after.insert(uav.uav, Before { recorded, altitudes_m, violated_zones });
        }
        (self.before, self.before_us) = (after, frame.time_us);
    }
}

/// Adds the zones whose outline a curve crosses. It is halved until it is straight near an outline.
fn add_crossed(geofence: &Geofence, curve: &Curve, altitudes_m: [f64; 2], crossed: &mut BTreeSet<usize>) {
    let ([from, to], bend_m) = (curve.ends(), curve.bend_m());
    if !geofence.has_side_near(from.midpoint(to), 0.5 * from.distance_m(to) + bend_m + ACCURACY_M) {
        return;
    }
    if bend_m <= ACCURACY_M {
        crossed.extend(geofence.crosses(from, to, altitudes_m));
    } else {
        curve.halves().iter().for_each(|half| add_crossed(geofence, half, altitudes_m, crossed));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::score;
    use crate::metric::accumulated;
    use crate::row_fixtures::uav_row;
    use standoff::math;
    use standoff::{Position, Zone, ZoneKind};
    use standoff_record::Frame;

    fn config(geofence: &Geofence, team: &TeamParams) -> ScoreConfig {
        ScoreConfig { geofence: geofence.clone(), ..ScoreConfig::new(team, 0.5) }
    }

    fn violations(config: &ScoreConfig, frames: impl IntoIterator<Item = Frame>) -> Option<u64> {
        let zones: Zones = accumulated(config, frames);
        (zones.detour.n > 0).then_some(zones.violations)
    }

    fn flown(uav: UavRow) -> Frame {
        Frame { uavs: vec![uav], ..Frame::default() }
    }

    fn square(kind: ZoneKind, half_m: f64) -> Zone {
        let corners = [(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)];
        let outline = corners.map(|(x_m, y_m)| Position::from_m(x_m, y_m)).into();
        Zone { kind, vertices: outline, ..Zone::default() }
    }

    /// Twice into the keep-out zone, once out of the keep-in zone. Starting inside a keep-out zone counts as one
    /// violation.
    #[test]
    fn violations_count_once_per_uav_zone_and_entry() {
        let geofence = Geofence::new(vec![square(ZoneKind::KeepOut, 50.0), square(ZoneKind::KeepIn, 500.0)]).unwrap();
        let count = |places: &[f64]| {
            let frames = places.iter().map(|x_m| {
                let border = (*x_m > 100.0).then_some(0);
                flown(UavRow { x_m: *x_m, y_m: 0.0, limiting_zone: border, ..uav_row(0) })
            });
            let frames: Vec<Frame> = frames.collect();
            let metrics = score(&config(&geofence, &TeamParams::paper()), &frames);
            (metrics["zone_violations"], metrics["geofence_detour_fraction"])
        };
        assert_eq!(count(&[]), (None, None));
        assert_eq!(count(&[100.0, 60.0, 55.0, 60.0]), (Some(0.0), Some(0.0)));
        assert_eq!(count(&[60.0, 40.0, 0.0, 60.0, 40.0, 600.0]), (Some(3.0), Some(1.0 / 6.0)));
        assert_eq!(count(&[0.0, 0.0]), (Some(1.0), Some(0.0)));
    }

    /// UAVs inside a keep-out zone from 100 to 200 m and a keep-in zone up to 300 m, at recorded or commanded altitudes.
    #[test]
    fn violations_count_at_the_recorded_altitude_only() {
        let band = |kind, half_m, [altitude_min_m, altitude_max_m]: [Option<f64>; 2]| Zone {
            altitude_min_m,
            altitude_max_m,
            ..square(kind, half_m)
        };
        let geofence = Geofence::new(vec![
            band(ZoneKind::KeepOut, 50.0, [Some(100.0), Some(200.0)]),
            band(ZoneKind::KeepIn, 500.0, [None, Some(300.0)]),
        ]);
        let geofence = geofence.unwrap();
        // At 300 m, like all UAVs without a recorded altitude.
        let mut team = TeamParams::recommended();
        team.group.altitude_policy = standoff::params::AltitudePolicy::Common;
        let count = |places: &[(f64, Option<f64>, Option<f64>)]| {
            let frames = places.iter().map(|&(x_m, altitude_m, commanded_altitude_m)| {
                flown(UavRow { x_m, y_m: 0.0, altitude_m, commanded_altitude_m, ..uav_row(0) })
            });
            violations(&config(&geofence, &team), frames)
        };
        // Both limits are inside the band.
        for (altitude_m, violations) in [(99.0, 0), (100.0, 1), (200.0, 1), (201.0, 0), (300.0, 0), (301.0, 1)] {
            assert_eq!(count(&[(0.0, Some(altitude_m), Some(150.0))]), Some(violations), "{altitude_m} m");
            assert_eq!(count(&[(0.0, None, Some(altitude_m))]), Some(violations), "{altitude_m} m");
        }
        assert_eq!(count(&[(0.0, None, None)]), Some(0));
        // A descent into the band, and a passage below it.
        assert_eq!(count(&[(0.0, Some(201.0), None), (0.0, Some(199.0), None), (0.0, Some(99.0), None)]), Some(1));
        assert_eq!(count(&[(60.0, Some(90.0), None), (-60.0, Some(90.0), None)]), Some(0));
        // A UAV that descends into the band while it flies across the zone may have crossed it.
        assert_eq!(count(&[(60.0, Some(205.0), None), (-60.0, Some(195.0), None)]), Some(1));
        assert_eq!(count(&[(490.0, Some(90.0), None), (510.0, Some(90.0), None)]), Some(1));
    }

    /// Crossing a corner of the keep-out zone between two time steps counts once, and once more on the way back.
    /// Passing next to it does not count. Leaving a zone is no new violation.
    #[test]
    fn crossing_a_zone_between_time_steps_counts_once() {
        let geofence = Geofence::new(vec![square(ZoneKind::KeepOut, 50.0), square(ZoneKind::KeepIn, 500.0)]).unwrap();
        let count = |places: &[(f64, f64)]| {
            let frames = places.iter().map(|(x_m, y_m)| flown(UavRow { x_m: *x_m, y_m: *y_m, ..uav_row(0) }));
            violations(&config(&geofence, &TeamParams::paper()), frames)
        };
        assert_eq!(count(&[(55.0, 40.0), (40.0, 55.0)]), Some(1));
        assert_eq!(count(&[(55.0, 40.0), (40.0, 55.0), (20.0, 55.0), (55.0, 40.0)]), Some(2));
        assert_eq!(count(&[(55.0, 46.0), (46.0, 55.0)]), Some(0));
        assert_eq!(count(&[(60.0, 0.0), (45.0, 0.0), (60.0, 0.0)]), Some(1));
        // Across the keep-out zone, and out of the keep-in zone and back.
        assert_eq!(count(&[(60.0, 0.0), (-60.0, 0.0), (-60.0, 60.0), (600.0, 60.0), (-60.0, 60.0)]), Some(2));
    }

    /// A UAV turns left around a corner on an arc: the chord cuts a zone inside the arc, the arc a zone outside the chord.
    #[test]
    fn a_violation_is_one_of_the_flown_arc_and_not_of_its_chord() {
        let (speed_m_s, rate_rad_s, radius_m) = (80.0, 0.6, 80.0 / 0.6);
        let on_circle = |time_us: i64, angle_rad: f64| {
            let (sin, cos) = math::sin_cos(angle_rad);
            let uav = UavRow {
                x_m: radius_m * cos,
                y_m: radius_m * sin,
                heading_rad: angle_rad + 0.5 * math::PI,
                speed_m_s,
                speed_command_m_s: speed_m_s,
                turn_rate_rad_s: rate_rad_s,
                turn_rate_command_rad_s: rate_rad_s,
                ..uav_row(0)
            };
            Frame { time_us, uavs: vec![uav], ..Frame::default() }
        };
        // The chord passes the centre of the circle at 110 m, the arc at 133.3 m.
        for (corner_m, violations) in [(128.0, 0), (133.2, 0), (133.4, 1), (138.0, 1)] {
            let inside = [(corner_m, 0.0), (60.0, -20.0), (60.0, 20.0)];
            let outside = [(corner_m - 5.0 + 0.1, 0.0), (200.0, -20.0), (200.0, 20.0)];
            for (vertices, violations) in [(inside, violations), (outside, u64::from(corner_m < 138.2))] {
                let vertices = vertices.map(|(x_m, y_m)| Position::from_m(x_m, y_m)).into();
                let zone = Zone { kind: ZoneKind::KeepOut, vertices, ..Zone::default() };
                let geofence = Geofence::new(vec![zone]).unwrap();
                let score_config = ScoreConfig { period_s: 2.0, ..config(&geofence, &TeamParams::recommended()) };
                let frames = [(0, -0.6), (2_000_000, 0.6)].map(|(time_us, angle_rad)| on_circle(time_us, angle_rad));
                assert_eq!(self::violations(&score_config, frames), Some(violations), "{corner_m} m");
            }
        }
    }
}
