//! Separation of UAVs from each other and from intruders along their flown paths, and time spent on collision avoidance.

use std::collections::BTreeSet;

use standoff::by_group::ByGroup;
use standoff::grid::Grid;
use standoff::safety::predicted_trajectory::least_length;
use standoff::{Aircraft, SeparationParams, UavId};
use standoff_record::{Frame, IntruderRow, UavRow};

use crate::flown_path::{Curve, FlownPath, PathModel, Recorded};
use crate::metric::{Family, GROUPS, LARGE, Metric, NOTHING, SMALL, count, metric};
use crate::step::{Inputs, Step};

/// Accuracy of the distances, m.
const ACCURACY_M: f64 = 1e-3;

/// Maximum number of halvings of a curve.
const HALVINGS_MAX: u32 = 16;

/// Rules for the pairs of aircraft that count.
#[derive(Debug, Clone, Copy)]
struct SeparationRules<'a> {
    minima: SeparationParams,
    model: &'a PathModel,
    /// True if only pairs of one group count.
    is_of_groups: bool,
}

/// Separation statistics of all UAVs so far.
#[derive(Debug, Default)]
pub(crate) struct Separations {
    min_m: Option<f64>,
    min_same_altitude_m: Option<f64>,
    min_same_group_m: Option<f64>,
    /// Number of times that a UAV and another aircraft violated both minima.
    violations: u64,
    /// UAV time steps on collision avoidance.
    avoiding: u64,
    /// True if a UAV and at least one other aircraft have flown.
    has_pairs: bool,
    /// Pairs that violate the minima now.
    near: BTreeSet<(Aircraft, Aircraft)>,
    legs: Legs,
    candidates: Candidates,
}

/// Pairs of aircraft that can change a result; the buffers are reused.
#[derive(Debug, Clone, Default)]
struct Candidates {
    /// Distance now beyond which a pair of different groups changes no result, m.
    reach_m: f64,
    places: Grid,
    /// Aircraft of each group in the last frame and now, by their index now.
    groups: [ByGroup<u32>; 2],
    /// Other aircraft of one aircraft, ascending.
    others: Vec<usize>,
}

/// An aircraft in a frame.
#[derive(Debug, Clone, Copy)]
struct Flying {
    aircraft: Aircraft,
    group: Option<u32>,
    recorded: Recorded,
    /// Altitude, or the commanded one if altitudes are not simulated.
    layer_m: Option<f64>,
    /// Index in the last frame.
    last: Option<usize>,
    /// Distance that its path from the last frame keeps to straight motion at constant speed, m.
    bend_max_m: f64,
}

/// All aircraft in the last frame and now, and their paths in between, as far as they were needed.
#[derive(Debug, Clone, Default)]
struct Legs {
    before: Vec<Flying>,
    now: Vec<Flying>,
    paths: Vec<Option<FlownPath>>,
    now_us: i64,
    duration_s: f64,
}

/// Smallest horizontal distances, m: at any altitudes, and below the minimum vertical distance.
#[derive(Debug, Clone, Copy)]
struct Least {
    any_m: f64,
    same_altitude_m: f64,
}

impl From<&UavRow> for Flying {
    fn from(row: &UavRow) -> Self {
        let (aircraft, layer_m) = (Aircraft::Uav(UavId(row.uav)), row.altitude_m.or(row.commanded_altitude_m));
        Self { aircraft, group: row.group, recorded: row.into(), layer_m, last: None, bend_max_m: 0.0 }
    }
}

impl From<&IntruderRow> for Flying {
    fn from(row: &IntruderRow) -> Self {
        let (aircraft, layer_m) = (Aircraft::Intruder(row.intruder), row.altitude_m);
        Self { aircraft, group: None, recorded: row.into(), layer_m, last: None, bend_max_m: 0.0 }
    }
}

impl Flying {
    fn is_in_group_of(&self, other: &Self) -> bool {
        self.group.is_some() && self.group == other.group
    }

    fn distance_m(&self, other: &Self) -> f64 {
        self.recorded.position().distance_m(other.recorded.position())
    }

    /// Difference of altitude, m; `None` if altitudes are not simulated.
    fn vertical_m(&self, other: &Self) -> Option<f64> {
        let both_m = self.recorded.altitude_m().zip(other.recorded.altitude_m());
        both_m.map(|(one_m, other_m)| (one_m - other_m).abs())
    }

    fn is_level_with(&self, other: &Self, minima: &SeparationParams) -> bool {
        self.vertical_m(other).unwrap_or(0.0) < self.vertical_min_m(other, minima)
    }

    /// Minimum vertical distance. If altitudes are not simulated, all aircraft are flown at altitude 0: the minimum is 0
    /// for commanded altitudes that are apart, otherwise infinite. An aircraft without altitude is near all others.
    fn vertical_min_m(&self, other: &Self, minima: &SeparationParams) -> f64 {
        let is_apart = |(one_m, other_m): (f64, f64)| (one_m - other_m).abs() >= minima.vertical_min_m;
        match (self.vertical_m(other), self.layer_m.zip(other.layer_m)) {
            (Some(_), _) => minima.vertical_min_m,
            (None, Some(layers_m)) if is_apart(layers_m) => 0.0,
            _ => f64::INFINITY,
        }
    }
}

impl Legs {
    /// Advances to the next frame.
    fn next(&mut self, model: &PathModel, frame: &Frame) {
        let Self { before, now, paths, now_us, duration_s } = self;
        std::mem::swap(before, now);
        *duration_s = (frame.time_us - *now_us) as f64 / 1e6;
        *now_us = frame.time_us;
        now.clear();
        now.extend(frame.uavs.iter().map(Flying::from));
        now.extend(frame.intruders.iter().map(Flying::from));
        for (index, flying) in now.iter_mut().enumerate() {
            // Aircraft keep their places unless some appear or vanish.
            let is_same = |of: &Flying| of.aircraft == flying.aircraft;
            let is_in_place = before.get(index).is_some_and(is_same);
            flying.last = if is_in_place { Some(index) } else { before.iter().position(is_same) };
            if let Some(last) = flying.last {
                flying.bend_max_m = model.bend_max_m(&before[last].recorded, &flying.recorded, *duration_s);
            }
        }
        paths.clear();
        paths.resize(now.len(), None);
    }

    /// Computes the path of an aircraft if it is missing.
    fn compute_path(&mut self, model: &PathModel, index: usize) {
        let to = &self.now[index];
        if let (Some(last), None) = (to.last, &self.paths[index]) {
            self.paths[index] = Some(model.path(&self.before[last].recorded, &to.recorded, self.duration_s));
        }
    }
}

/// With at most this many aircraft, all pairs are candidates.
const FEW: usize = 16;

impl Candidates {
    /// Replaces the aircraft.
    fn fill(&mut self, Legs { before, now, .. }: &Legs, reach_m: f64) {
        self.reach_m = if now.len() <= FEW { f64::INFINITY } else { reach_m };
        if self.reach_m.is_finite() {
            self.places.fill(now.iter().map(|flying| flying.recorded.position()), 0.5 * reach_m);
            let [was, is] = &mut self.groups;
            let all = || now.iter().enumerate();
            was.fill(all().filter_map(|(index, flying)| Some((before[flying.last?].group?, index))));
            is.fill(all().filter_map(|(index, flying)| Some((flying.group?, index))));
        }
    }

    /// Aircraft after one aircraft with which it forms a candidate, ascending.
    fn of(&mut self, Legs { before, now, .. }: &Legs, one: usize) -> &[usize] {
        let Self { reach_m, places, groups: [was, is], others } = self;
        others.clear();
        if reach_m.is_infinite() {
            others.extend(one + 1..now.len());
            return others;
        }
        let flying = &now[one];
        let was = flying.last.and_then(|last| before[last].group).into_iter().flat_map(|group| was.of(group));
        let is = flying.group.into_iter().flat_map(|group| is.of(group));
        let near = places.near(flying.recorded.position(), *reach_m);
        others.extend(near.chain(was).chain(is).filter(|other| *other > one));
        others.sort_unstable();
        others.dedup();
        others
    }
}

const SAME_GROUP: &str = "separation_min_same_group_m";

impl Family for Separations {
    const SECTION: &'static str = "Separation and geofences";
    const METRICS: &'static [Metric<Self>] = &[
        metric("separation_min_m", "minimum separation", SMALL, 10.0, NOTHING, |of, _| of.min_m),
        metric(
            "separation_min_same_altitude_m",
            "minimum separation at the same altitude",
            SMALL,
            10.0,
            NOTHING,
            |of, _| of.min_same_altitude_m,
        ),
        metric(SAME_GROUP, "minimum separation within a group", SMALL, 10.0, GROUPS, |of, _| of.min_same_group_m),
        count(metric("separation_violations", "separation violations", LARGE, 0.1, NOTHING, |of, _| {
            of.has_pairs.then_some(of.violations as f64)
        })),
        metric("avoidance_time_s", "UAV time spent on collision avoidance", LARGE, 5.0, NOTHING, |of, run| {
            of.has_pairs.then_some(of.avoiding as f64 * run.config.period_s)
        }),
    ];

    fn inputs(selected: &[&str]) -> Inputs {
        Inputs { all_pairs: selected != [SAME_GROUP], ..Inputs::default() }
    }

    fn add(&mut self, Step { config, frame, inputs, paths, .. }: &Step<'_>) {
        let rules = SeparationRules { minima: config.separation, model: paths, is_of_groups: !inputs.all_pairs };
        self.frame(&rules, frame);
    }
}

impl Separations {
    /// Adds the next frame, and the paths from the last frame to it.
    fn frame(&mut self, rules: &SeparationRules<'_>, frame: &Frame) {
        let avoids = |uav: &&UavRow| uav.avoided_uav.is_some() || uav.avoided_intruder.is_some();
        self.avoiding += frame.uavs.iter().filter(avoids).count() as u64;
        self.legs.next(rules.model, frame);
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.fill(&self.legs, self.reach_m(rules));
        self.has_pairs |= !rules.is_of_groups && !frame.uavs.is_empty() && self.legs.now.len() > 1;
        for one in 0..frame.uavs.len() {
            for &other in candidates.of(&self.legs, one) {
                let has_violated = self.fly(rules, one, other);
                let violates = self.meet(rules, one, other);
                let pair = (self.legs.now[one].aircraft, self.legs.now[other].aircraft);
                let was_near = if violates { !self.near.insert(pair) } else { self.near.remove(&pair) };
                self.violations += u64::from((has_violated || violates) && !was_near);
            }
        }
        self.candidates = candidates;
    }

    /// Distance now beyond which a pair of different groups changes no result, m: it was not nearer on the way.
    fn reach_m(&self, rules: &SeparationRules<'_>) -> f64 {
        let Legs { before, now, .. } = &self.legs;
        let least_m = |least_m: Option<f64>| least_m.unwrap_or(f64::INFINITY);
        let least_m = least_m(self.min_m).max(least_m(self.min_same_altitude_m)).max(rules.minima.horizontal_min_m);
        // A pair with an aircraft that has just appeared may still count as near.
        let moved_m = |of: &Flying| of.last.map_or(f64::INFINITY, |last| of.distance_m(&before[last]) + of.bend_max_m);
        let moved_max_m = now.iter().map(moved_m).fold(0.0, f64::max);
        // The difference exceeds rounding errors.
        if rules.is_of_groups { 0.0 } else { (least_m + 2.0 * moved_max_m) * (1.0 + 1e-9) }
    }

    /// Adds the distance of two aircraft in a frame. Returns true if they violate both minima.
    fn meet(&mut self, rules: &SeparationRules<'_>, one: usize, other: usize) -> bool {
        let [one, other] = [one, other].map(|index| &self.legs.now[index]);
        let distance_m = one.distance_m(other);
        let is_level = one.is_level_with(other, &rules.minima);
        if one.is_in_group_of(other) {
            take_least(&mut self.min_same_group_m, distance_m);
        }
        if rules.is_of_groups {
            return false;
        }
        take_least(&mut self.min_m, distance_m);
        if is_level {
            take_least(&mut self.min_same_altitude_m, distance_m);
        }
        is_level && distance_m < rules.minima.horizontal_min_m
    }

    /// Adds the distances of two aircraft along their paths. Returns true if they violated both minima.
    fn fly(&mut self, rules: &SeparationRules<'_>, one: usize, other: usize) -> bool {
        let SeparationRules { minima, model, is_of_groups } = rules;
        let Legs { before, now, .. } = &self.legs;
        let (Some(one_last), Some(other_last)) = (now[one].last, now[other].last) else { return false };
        let (one_from, other_from) = (&before[one_last], &before[other_last]);
        let is_same_group = one_from.is_in_group_of(other_from);
        if *is_of_groups && !is_same_group {
            return false;
        }
        // Larger distances change no result.
        let of_group_m = if is_same_group { self.min_same_group_m.unwrap_or(f64::INFINITY) } else { 0.0 };
        let relevant = if *is_of_groups {
            Least { any_m: of_group_m, same_altitude_m: 0.0 }
        } else {
            let [any_m, level_m] =
                [self.min_m, self.min_same_altitude_m].map(|least_m| least_m.unwrap_or(f64::INFINITY));
            Least { any_m: any_m.max(of_group_m), same_altitude_m: level_m.max(minima.horizontal_min_m) }
        };
        let vertical_min_m = one_from.vertical_min_m(other_from, minima);
        let apart = |one: &Flying, other: &Flying| (one.recorded.position() - other.recorded.position()).vector();
        let (from, to) = (apart(one_from, other_from), apart(&now[one], &now[other]));
        let bend_max_m = now[one].bend_max_m + now[other].bend_max_m;
        let reach_m = least_length([from, to]) - bend_max_m;
        if reach_m >= relevant.any_m && (vertical_min_m <= 0.0 || reach_m >= relevant.same_altitude_m) {
            return false;
        }
        // Where the distance falls or rises throughout, the frames contain its minimum. The path bends by at most four
        // times the maximum per time from an end.
        let counts_at_end = |one: &Flying, other: &Flying| {
            (vertical_min_m <= 0.0 || one.is_level_with(other, minima)) && (!is_same_group || one.is_in_group_of(other))
        };
        let falls = -to.dot(&(to - from)) >= 4.0 * bend_max_m * to.norm() && counts_at_end(&now[one], &now[other]);
        let rises = from.dot(&(to - from)) >= 4.0 * bend_max_m * from.norm() && counts_at_end(one_from, other_from);
        if falls || rises {
            return false;
        }
        let mut least = relevant;
        self.legs.compute_path(model, one);
        self.legs.compute_path(model, other);
        if let [Some(one), Some(other)] = [one, other].map(|index| &self.legs.paths[index]) {
            for (curve, other_curve) in one.curves().iter().zip(other.curves()) {
                closest(&curve.relative_to(other_curve), vertical_min_m, HALVINGS_MAX, &mut least);
            }
        }
        if is_same_group && least.any_m < relevant.any_m {
            take_least(&mut self.min_same_group_m, least.any_m);
        }
        if *is_of_groups {
            return false;
        }
        if least.any_m < relevant.any_m {
            take_least(&mut self.min_m, least.any_m);
        }
        let is_found = least.same_altitude_m < relevant.same_altitude_m;
        if is_found {
            take_least(&mut self.min_same_altitude_m, least.same_altitude_m);
        }
        is_found && least.same_altitude_m < minima.horizontal_min_m
    }
}

/// Lowers `least` to the smallest distances from the origin along the motion of one aircraft relative to another, if it
/// comes closer. The curve is within [`Curve::bend_m`] of a straight line; it is halved until that is accurate.
fn closest(relative: &Curve, vertical_min_m: f64, halvings_max: u32, least: &mut Least) {
    let (nearest_m, bend_m) = (relative.straight_to_origin_m(), relative.bend_m());
    let [low_m, high_m] = relative.altitudes_m();
    let is_level = -vertical_min_m < low_m && high_m < vertical_min_m;
    let is_apart = low_m >= vertical_min_m || high_m <= -vertical_min_m;
    let is_nearer = |least_m: f64| nearest_m - bend_m < least_m - ACCURACY_M;
    if !is_nearer(least.any_m) && (is_apart || !is_nearer(least.same_altitude_m)) {
        return;
    }
    if bend_m <= ACCURACY_M {
        least.any_m = least.any_m.min(nearest_m);
        if is_level {
            least.same_altitude_m = least.same_altitude_m.min(nearest_m);
        }
        if is_level || is_apart || !is_nearer(least.same_altitude_m) {
            return;
        }
    }
    if halvings_max > 0 {
        relative.halves().iter().for_each(|half| closest(half, vertical_min_m, halvings_max - 1, least));
    }
}

/// Replaces `least` by `value` if that is smaller.
fn take_least(least: &mut Option<f64>, value: f64) {
    *least = Some(least.map_or(value, |least| least.min(value)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row_fixtures::uav_row;
    use standoff::math::{self, PI};
    use standoff::{Angle, TeamParams, Velocity};

    fn model(period_s: f64) -> PathModel {
        PathModel::new(&TeamParams::recommended(), period_s)
    }

    fn rules(model: &PathModel) -> SeparationRules<'_> {
        SeparationRules { minima: SeparationParams::default(), model, is_of_groups: false }
    }

    /// Frames of two UAVs at rest, 1 s apart, with this distance and difference in altitude each.
    fn flown(steps: &[(f64, Option<f64>)]) -> Separations {
        let mut separations = Separations::default();
        for (time_us, (x_m, up_m)) in (0..).step_by(1_000_000).zip(steps) {
            let rows = [(0, 0.0, 0.0), (1, *x_m, up_m.unwrap_or_default())].map(|(uav, x_m, up_m_of)| UavRow {
                x_m,
                altitude_m: up_m.map(|_| 300.0 + up_m_of),
                ..uav_row(uav)
            });
            separations.frame(&rules(&model(0.5)), &Frame { time_us, uavs: rows.to_vec(), ..Frame::default() });
        }
        separations
    }

    /// Both minima are violated at 49 m and 29 m, and again after the UAVs have been apart. Consecutive time steps in
    /// violation count once.
    #[test]
    fn violation_requires_horizontal_and_vertical_proximity() {
        let near = [(49.0, Some(29.0)), (48.0, Some(0.0)), (60.0, Some(0.0)), (60.0, Some(30.0)), (49.9, Some(29.9))];
        let separations = flown(&near);
        assert_eq!(
            (separations.violations, separations.min_m, separations.min_same_altitude_m),
            (2, Some(48.0), Some(48.0))
        );
        let apart = flown(&[(0.0, Some(30.0)), (50.0, Some(30.0)), (50.0, Some(0.0)), (70.0, Some(29.9))]);
        assert_eq!((apart.violations, apart.min_m, apart.min_same_altitude_m), (0, Some(0.0), Some(50.0)));
        // UAVs with unknown altitudes count as being at the same altitude.
        assert_eq!(flown(&[(49.0, None)]).violations, 1);
        assert!(!flown(&[]).has_pairs);
    }

    /// Two UAVs approach while one descends past the other: they are 31 m apart horizontally when their difference of
    /// altitude falls below 30 m, after four of five equal parts of the time step.
    #[test]
    fn a_distance_counts_from_when_the_vertical_minimum_is_violated() {
        let separations = flown(&[(135.0, Some(150.0)), (5.0, Some(0.0))]);
        assert_eq!((separations.violations, separations.min_m), (1, Some(5.0)));
        let crossing = flown(&[(-119.0, Some(150.0)), (31.0, Some(0.0))]);
        assert_eq!((crossing.violations, crossing.min_m), (1, Some(0.0)));
        let level_m = crossing.min_same_altitude_m.unwrap();
        assert!((level_m - 1.0).abs() < 0.01, "{level_m}");
    }

    /// Commanded altitudes that are 1 to 29 m apart count as one altitude, with and without simulated altitudes.
    #[test]
    fn altitudes_below_the_vertical_minimum_count_as_one() {
        for (up_m, violations) in [(0.0, 1), (1.0, 1), (29.0, 1), (30.0, 0), (50.0, 0)] {
            for is_simulated in [false, true] {
                let rows = [(0, 0.0, 300.0), (1, 20.0, 300.0 + up_m)].map(|(uav, x_m, altitude_m)| UavRow {
                    x_m,
                    altitude_m: is_simulated.then_some(altitude_m),
                    commanded_altitude_m: Some(altitude_m),
                    ..uav_row(uav)
                });
                let mut separations = Separations::default();
                for time_us in [0, 500_000] {
                    separations.frame(&rules(&model(0.5)), &Frame { time_us, uavs: rows.to_vec(), ..Frame::default() });
                }
                assert_eq!(separations.violations, violations, "{up_m} m, {is_simulated}");
                assert_eq!(separations.min_same_altitude_m.is_some(), violations == 1);
            }
        }
    }

    /// One UAV flies a circle, clockwise, within 10 m of another one at rest between two time steps; both are
    /// recorded 2 s apart, on the circle. The chord passes at more than 40 m.
    #[test]
    fn distances_are_those_of_the_flown_arcs() {
        let (speed_m_s, rate_rad_s) = (80.0, -0.6);
        let radius_m = speed_m_s / -rate_rad_s;
        let on_circle = |angle_rad: f64| UavRow {
            x_m: radius_m * math::cos(angle_rad),
            y_m: radius_m * math::sin(angle_rad),
            heading_rad: angle_rad - 0.5 * PI,
            speed_m_s,
            speed_command_m_s: speed_m_s,
            turn_rate_rad_s: rate_rad_s,
            turn_rate_command_rad_s: rate_rad_s,
            ..uav_row(0)
        };
        let other = UavRow { x_m: radius_m + 10.0, speed_m_s: 0.0, speed_command_m_s: 0.0, ..uav_row(1) };
        // A wind of 13 m/s moves both alike.
        let wind = Velocity::from_m_s(12.0, -5.0);
        let in_wind = |row: &UavRow, after_s: f64| {
            let ground = Velocity::from_polar(row.speed_m_s, Angle::from_rad(row.heading_rad)) + wind;
            UavRow {
                x_m: row.x_m + wind.x_m_s() * after_s,
                y_m: row.y_m + wind.y_m_s() * after_s,
                heading_rad: ground.direction().rad(),
                speed_m_s: ground.speed_m_s(),
                airspeed_m_s: Some(row.speed_m_s),
                air_heading_rad: Some(row.heading_rad),
                wind_x_m_s: Some(wind.x_m_s()),
                wind_y_m_s: Some(wind.y_m_s()),
                ..*row
            }
        };
        for is_calm in [true, false] {
            let mut separations = Separations::default();
            for (after_s, angle_rad) in [(0.0, 0.6), (2.0, -0.6)] {
                let calm = [on_circle(angle_rad), other];
                let uavs = calm.map(|row| if is_calm { row } else { in_wind(&row, after_s) }).to_vec();
                let time_us = (1e6 * after_s) as i64;
                separations.frame(&rules(&model(2.0)), &Frame { time_us, uavs, ..Frame::default() });
            }
            for least_m in [separations.min_m, separations.min_same_altitude_m, separations.min_same_group_m] {
                assert!((least_m.unwrap() - 10.0).abs() < 0.01, "{least_m:?}");
            }
            assert_eq!(separations.violations, 1);
        }
        let chord_m = radius_m + 10.0 - radius_m * math::cos(0.6);
        assert!(chord_m > 30.0);
    }

    /// One UAV, and an intruder at a distance of 49 m: 29 m above it, then 30 m above it.
    #[test]
    fn intruders_count_like_uavs() {
        let mut separations = Separations::default();
        for (time_us, altitude_m) in [(0, 329.0), (500_000, 330.0)] {
            let uavs = vec![UavRow { altitude_m: Some(300.0), speed_m_s: 0.0, speed_command_m_s: 0.0, ..uav_row(0) }];
            let intruder = IntruderRow { x_m: 49.0, altitude_m: Some(altitude_m), ..IntruderRow::default() };
            let frame = Frame { time_us, uavs, intruders: vec![intruder], ..Frame::default() };
            separations.frame(&rules(&model(0.5)), &frame);
        }
        let Separations { min_m, min_same_altitude_m: min_layer_m, violations, has_pairs, .. } = separations;
        assert_eq!((min_m, min_layer_m, violations, has_pairs), (Some(49.0), Some(49.0), 1, true));
    }

    /// Only pairs of one group count for one agent's team state.
    #[test]
    fn pairs_of_groups_exclude_all_others() {
        let mut separations = Separations::default();
        let rows = [(0, 0.0, 5), (1, 10.0, 6), (2, 70.0, 5)].map(|(uav, x_m, group)| UavRow {
            x_m,
            group: Some(group),
            ..uav_row(uav)
        });
        let model = model(0.5);
        let rules = SeparationRules { is_of_groups: true, ..rules(&model) };
        for time_us in [0, 500_000] {
            separations.frame(&rules, &Frame { time_us, uavs: rows.to_vec(), ..Frame::default() });
        }
        assert_eq!((separations.min_same_group_m, separations.min_m, separations.violations), (Some(70.0), None, 0));
    }

    #[test]
    fn avoiding_uavs_are_counted_at_every_time_step() {
        let mut separations = Separations::default();
        let rows = [Some(1), None, Some(0)].map(|avoids| UavRow { avoided_uav: avoids, ..uav_row(0) });
        separations.frame(&rules(&model(0.5)), &Frame { uavs: rows.to_vec(), ..Frame::default() });
        assert_eq!(separations.avoiding, 2);
    }
}
