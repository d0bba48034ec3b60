use proptest::prelude::*;

use super::*;
use crate::angle::Angle;
use crate::frame::{Displacement, Position, Velocity};
use crate::math::PI;
use crate::params::{ClimbParams, TeamParams, UavParams};
use crate::safety::fallback::Sense;
use crate::safety::geofence::{Geofence, Zone, ZoneKind};
use crate::safety::motion::Airframe;
use crate::safety::zones::Of;
use crate::safety::zones::tests::Drawn;
use crate::time::Duration;
use crate::uav::{AutopilotModel, Vertical};
use crate::wind::Wind;

const PERIOD_S: f64 = 0.5;

/// A simulated UAV with a desired course and speed, with or without collision avoidance.
#[derive(Debug, Clone, Copy)]
struct Flier {
    state: UavState,
    course: Angle,
    speed_m_s: f64,
    avoids: bool,
    /// Desired altitude, m.
    altitude_m: Option<f64>,
}

impl Flier {
    fn new((x_m, y_m): (f64, f64), course_deg: f64) -> Self {
        let (course, speed_m_s) = (Angle::from_deg(course_deg), 40.0);
        let position = Position::from_m(x_m, y_m);
        let state = UavState::level_flight(position, course, speed_m_s);
        Self { state, course, speed_m_s, avoids: true, altitude_m: None }
    }

    /// A UAV at one altitude that wants to fly at another.
    fn climbing(self, from_m: f64, to_m: f64) -> Self {
        let vertical = Some(Vertical { altitude_m: from_m, climb_rate_m_s: 0.0 });
        Self { state: UavState { vertical, ..self.state }, altitude_m: Some(to_m), ..self }
    }
}

/// Teammates that fly to their courses.
struct Courses<'a>(&'a [Flier], UavParams);

impl Courses<'_> {
    fn command(&self, of: usize, state: &UavState) -> Command {
        let Flier { course, speed_m_s, .. } = self.0[of];
        self.1.limit(Command { speed_m_s, turn_rate_rad_s: (course - state.heading).rad() }).command
    }
}

impl DesiredCommands for Courses<'_> {
    fn intent_of(&self, _: UavId) -> Option<Intent> {
        None
    }

    fn desired(&self, teammate: UavId, motion: &Motion) -> Intent {
        Intent::held(self.command(teammate.0 as usize, &motion.state))
    }
}

/// Results of a simulated flight.
#[derive(Debug)]
struct Flown {
    /// Minimum distance of two UAVs that were not separated by altitude, m.
    closest_m: f64,
    /// Number of UAV time steps with an avoidance command.
    avoided: usize,
    /// Number of reversals of the turn direction.
    reversals: usize,
    last: Vec<UavState>,
    /// Distance of the first two UAVs after each time step, m.
    apart_m: Vec<f64>,
}

fn steady(state: &UavState) -> Motion {
    Motion::steady(&params(), state)
}

fn params() -> UavParams {
    UavParams { climb: Some(ClimbParams::default()), ..TeamParams::paper().uav }
}

fn fly(fliers: Vec<Flier>, seconds: f64) -> Flown {
    fly_with(params(), fliers, seconds, 0)
}

/// Flies with reports that arrive after `latency` time steps.
fn fly_with(uav: UavParams, mut fliers: Vec<Flier>, seconds: f64, latency: usize) -> Flown {
    let (separation, dt) = (SeparationParams::default(), Duration::from_s(PERIOD_S));
    let escapes = FallbackModel::in_air(Airframe::new(uav, 0.0), PERIOD_S);
    let mut manoeuvres = vec![None; fliers.len()];
    let response: AutopilotModel = uav.response(dt);
    let mut flown = Flown { closest_m: f64::INFINITY, avoided: 0, reversals: 0, last: Vec::new(), apart_m: Vec::new() };
    let mut sides = vec![0.0f64; fliers.len()];
    let mut reports: Vec<Vec<OtherAircraft>> = Vec::new();
    for step in 0..(seconds / PERIOD_S) as usize {
        let report = |(id, flier): (u32, &Flier)| OtherAircraft {
            aircraft: Aircraft::Uav(UavId(id)),
            motion: steady(&flier.state),
            age_s: latency as f64 * PERIOD_S,
            manoeuvre: manoeuvres[id as usize],
        };
        reports.push((0..).zip(&fliers).map(report).collect());
        let now = &reports[step];
        let received = step.checked_sub(latency).map_or(&[][..], |step| &reports[step]);
        let before = fliers.clone();
        let courses = Courses(&before, uav);
        for (index, flier) in fliers.iter_mut().enumerate() {
            for other in &now[index + 1..] {
                let up_m = flier
                    .state
                    .vertical
                    .zip(other.motion.state.vertical)
                    .map(|(a, b)| (a.altitude_m - b.altitude_m).abs());
                if up_m.is_none_or(|up_m| up_m < separation.vertical_min_m) {
                    flown.closest_m = flown.closest_m.min(flier.state.position.distance_m(other.motion.state.position));
                }
            }
            let own = flier.state;
            let desired = courses.command(index, &own);
            let avoidance = CollisionAvoidance {
                separation: &separation,
                fallbacks: &escapes,
                plan: None,
                geofence: None,
                id: UavId(index as u32),
                own: &steady(&own),
                manoeuvre: now[index].manoeuvre,
            };
            let teammates = received.iter().copied().filter(|other| other.aircraft != Aircraft::Uav(avoidance.id));
            let mut altitude_m = flier.altitude_m;
            let mut command = desired;
            if flier.avoids {
                altitude_m = altitude_m.map(|desired_m| avoidance.altitude_m(desired_m, teammates.clone()));
                let (safe, avoided) = avoidance.avoid(Intent::held(desired), altitude_m, teammates, &courses);
                manoeuvres[index] = avoided.map(|avoided| Manoeuvre {
                    avoids: Some(avoided.aircraft),
                    command: safe,
                    is_left: avoided.is_left,
                });
                assert_eq!(uav.limit(safe).command, safe, "command exceeds the limits");
                flown.avoided += usize::from(avoided.is_some());
                command = safe;
            }
            let side =
                if command.turn_rate_rad_s.abs() > 0.05 { command.turn_rate_rad_s.signum() } else { sides[index] };
            flown.reversals += usize::from(side * sides[index] < 0.0);
            sides[index] = side;
            let climb = uav.climb.unwrap_or_default();
            flier.state = response.step(&own, command);
            flier.state.vertical = own.vertical.map(|vertical| climb.step(&vertical, altitude_m, dt));
        }
        if let [a, b, ..] = &fliers[..] {
            flown.apart_m.push(a.state.position.distance_m(b.state.position));
        }
    }
    flown.last = fliers.iter().map(|flier| flier.state).collect();
    flown
}

/// Head-on, from the side at several angles, overtaking, converging: two UAVs keep the minimum distance, independent of
/// the right of way. They do not turn back and forth, and return to their courses.
#[test]
fn two_uavs_that_meet_pass_each_other() {
    for angle_deg in [180.0, 175.0, 150.0, 120.0, 90.0, 60.0, 40.0, 20.0] {
        for offset_m in [0.0, 5.0, -5.0, 30.0, -30.0] {
            for first in [0, 1] {
                let angle = Angle::from_deg(angle_deg);
                // Without avoidance, both would be at the origin after 15 s, or one of them at an offset from it.
                let start = Position::ORIGIN + Displacement::from_polar(-600.0, angle);
                let mut fliers =
                    vec![Flier::new((-600.0, offset_m), 0.0), Flier::new((start.x_m(), start.y_m()), angle_deg)];
                fliers.rotate_left(first);
                let flown = fly(fliers.clone(), 60.0);
                let case = format!("{angle_deg} degrees, {offset_m} m, {first}: {flown:?}");
                assert!(flown.closest_m >= 50.0 && flown.avoided > 0, "{case}");
                assert!(flown.reversals <= 6, "{case}");
                for (flier, last) in fliers.iter().zip(&flown.last) {
                    assert!((last.heading - flier.course).abs_rad() < 0.01, "{case}");
                }
            }
        }
    }
}

/// A UAV follows another one on the same course, 12 m/s faster. With the lower id it gives way and passes. With the
/// higher id, the UAV ahead gives way by flying faster.
#[test]
fn an_overtaking_uav_keeps_the_minimum_distance() {
    for first in [0, 1] {
        let mut fliers = vec![
            Flier { speed_m_s: 50.0, ..Flier::new((-300.0, 2.0), 0.0) },
            Flier { speed_m_s: 38.0, ..Flier::new((0.0, 0.0), 0.0) },
        ];
        fliers.rotate_left(first);
        let flown = fly(fliers, 120.0);
        assert!(flown.closest_m >= 50.0, "{first}: {flown:?}");
        let ahead_m = flown.last[first].position.x_m() - flown.last[1 - first].position.x_m();
        assert_eq!(ahead_m > 200.0, first == 0, "{first}: {ahead_m} m ahead");
    }
}

/// One of two UAVs does not avoid. Whether it has the lower or the higher id, the other one avoids it.
#[test]
fn a_uav_without_avoidance_is_avoided() {
    for angle_deg in [180.0, 135.0, 90.0, 45.0] {
        for passive in [0, 1] {
            let start = Position::ORIGIN + Displacement::from_polar(-600.0, Angle::from_deg(angle_deg));
            let mut fliers = vec![Flier::new((-600.0, 0.0), 0.0), Flier::new((start.x_m(), start.y_m()), angle_deg)];
            fliers[passive].avoids = false;
            let flown = fly(fliers, 60.0);
            // The UAV with the right of way counts on the other one to give way until its own escape needs all room.
            let least_m = if passive == 0 { 25.0 } else { 50.0 };
            assert!(flown.closest_m >= least_m, "{angle_deg} degrees, UAV {passive} passive: {flown:?}");
        }
    }
}

/// Two UAVs that start within the minimum distance, side by side, one behind the other, at one place or on diverging
/// courses, open to the minimum in 4 s and keep it, at any speed.
#[test]
fn two_uavs_within_the_minimum_distance_open_it_fast() {
    for speed_m_s in [25.0, 40.0, 60.0] {
        let uav = UavParams { speed_m_s, ..params() };
        for (x_m, y_m) in [(0.0, 0.0), (0.0, 30.0), (0.0, -10.0), (30.0, 0.0), (-45.0, 5.0), (20.0, 20.0)] {
            for course_deg in [0.0, 20.0, -20.0, 90.0] {
                let mut fliers = vec![Flier::new((0.0, 0.0), 0.0), Flier::new((x_m, y_m), course_deg)];
                for flier in &mut fliers {
                    (flier.speed_m_s, flier.state.speed_m_s) = (speed_m_s, speed_m_s);
                }
                let flown = fly_with(uav, fliers, 60.0, 0);
                let later = &flown.apart_m[(4.0 / PERIOD_S) as usize - 1..];
                let least_m = later.iter().copied().fold(f64::INFINITY, f64::min);
                assert!(least_m >= 50.0, "{speed_m_s} m/s, {x_m} m, {y_m} m, {course_deg} deg: {:?}", flown.apart_m);
            }
        }
    }
}

/// Slow UAVs within the minimum distance need longer than 4 s. They take at most 1.2 times the shortest time, and one
/// period. The shortest time is that of the best pair of manoeuvres, each a turn at full rate and then a straight flight,
/// at one speed.
#[test]
fn slow_uavs_within_the_minimum_distance_open_it_nearly_as_fast_as_possible() {
    let min_m = SeparationParams::default().horizontal_min_m;
    for (speed_m_s, turn_rate_max_rad_s) in [(10.0, 0.3), (15.0, 0.5), (20.0, 0.2)] {
        let uav = UavParams { speed_m_s, turn_rate_max_rad_s, speed_change_max_m_s: 0.3 * speed_m_s, ..params() };
        for (x_m, y_m) in [(0.0, 0.0), (0.0, 30.0), (0.0, -10.0), (30.0, 0.0), (-45.0, 5.0), (20.0, 20.0)] {
            for course_deg in [0.0, 20.0, -20.0, 90.0] {
                let mut fliers = vec![Flier::new((0.0, 0.0), 0.0), Flier::new((x_m, y_m), course_deg)];
                for flier in &mut fliers {
                    (flier.speed_m_s, flier.state.speed_m_s) = (speed_m_s, speed_m_s);
                }
                let shortest_s = shortest_time_s([fliers[0].state, fliers[1].state], uav, min_m);
                let flown = fly_with(uav, fliers, 60.0, 0);
                let open = flown.apart_m.iter().rposition(|apart_m| *apart_m < min_m).map_or(1, |last| last + 2);
                let open_s = open as f64 * PERIOD_S;
                assert!(
                    open_s <= 1.2 * shortest_s + PERIOD_S,
                    "{speed_m_s} m/s, {x_m} m, {y_m} m, {course_deg} deg: {open_s} s, not {shortest_s} s"
                );
            }
        }
    }
}

/// Shortest time in which two UAVs open to a distance, s.
fn shortest_time_s(start: [UavState; 2], uav: UavParams, min_m: f64) -> f64 {
    let response: AutopilotModel = uav.response(Duration::from_s(PERIOD_S));
    let paths = start.map(|start| {
        let mut paths = Vec::new();
        for (side, turn_steps) in (0..12).flat_map(|steps| [(1.0, steps), (-1.0, steps)]) {
            for change_m_s in [-1.0, 0.0, 1.0].map(|share| share * uav.speed_change_max_m_s) {
                let mut state = start;
                let path: Vec<Position> = (0..20)
                    .map(|step| {
                        let turn_rate_rad_s = if step < turn_steps { side * uav.turn_rate_max_rad_s } else { 0.0 };
                        let command = Command { turn_rate_rad_s, speed_m_s: uav.speed_m_s + change_m_s };
                        state = response.step(&state, command);
                        state.position
                    })
                    .collect();
                paths.push(path);
            }
        }
        paths
    });
    let opened =
        |one: &[Position], other: &[Position]| one.iter().zip(other).position(|(a, b)| a.distance_m(*b) >= min_m);
    let steps = paths[0].iter().flat_map(|one| paths[1].iter().filter_map(move |other| opened(one, other))).min();
    steps.map_or(f64::INFINITY, |steps| (steps + 1) as f64 * PERIOD_S)
}

/// If no aircraft is near, the desired command is flown unchanged.
#[test]
fn commands_of_distant_uavs_are_unchanged() {
    let flown = fly(vec![Flier::new((0.0, 0.0), 90.0), Flier::new((400.0, 0.0), 90.0)], 60.0);
    assert!(flown.avoided == 0 && (flown.closest_m - 400.0).abs() < 1e-9, "{flown:?}");
}

/// A UAV more than 30 m higher is no conflict. A UAV that wants to climb past a nearby one waits until that one is
/// away.
#[test]
fn uavs_separated_by_altitude_pass_over_each_other() {
    let level =
        |altitude_m: f64, x_m: f64, course_deg| Flier::new((x_m, 0.0), course_deg).climbing(altitude_m, altitude_m);
    let flown = fly(vec![level(300.0, -600.0, 0.0), level(331.0, 600.0, 180.0)], 40.0);
    assert_eq!((flown.avoided, flown.closest_m), (0, f64::INFINITY));
    // Side by side at 150 m: the lower UAV wants to climb above the upper one and must wait below it.
    let abreast = |y_m: f64| Flier::new((0.0, y_m), 0.0);
    let flown = fly(vec![abreast(0.0).climbing(300.0, 400.0), abreast(150.0).climbing(350.0, 350.0)], 60.0);
    let altitude_m = |index: usize| flown.last[index].vertical.map_or(0.0, |vertical| vertical.altitude_m);
    assert!((altitude_m(0) - 319.0).abs() < 0.1 && (altitude_m(1) - 350.0).abs() < 1e-9, "{flown:?}");
    // At 700 m, it climbs.
    let flown = fly(vec![abreast(0.0).climbing(300.0, 400.0), abreast(700.0).climbing(350.0, 350.0)], 60.0);
    assert!(flown.last[0].vertical.is_some_and(|vertical| (vertical.altitude_m - 400.0).abs() < 0.5), "{flown:?}");
}

/// Two UAVs above each other want to swap altitudes, also with a third one between them: all keep their altitudes.
#[test]
fn uavs_above_each_other_do_not_swap_altitudes() {
    let at = |y_m: f64, from_m: f64, to_m: f64| Flier::new((0.0, y_m), 0.0).climbing(from_m, to_m);
    for apart_m in [32.0, 40.0, 55.0, 80.0] {
        let flown = fly(vec![at(0.0, 300.0, 400.0), at(10.0, 300.0 + apart_m, 200.0)], 60.0);
        assert_eq!(flown.closest_m, f64::INFINITY, "{apart_m} m: {flown:?}");
        let top_m = 300.0 + 2.0 * apart_m;
        let all = vec![at(0.0, 300.0, 400.0), at(10.0, 300.0 + apart_m, top_m), at(20.0, top_m, 200.0)];
        let flown = fly(all, 60.0);
        assert_eq!(flown.closest_m, f64::INFINITY, "{apart_m} m: {flown:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(cases()) })]
    /// Up to four UAVs that start at least 300 m apart on random courses never come nearer than the minimum.
    #[test]
    fn a_few_uavs_on_random_courses_keep_the_minimum_distance(
        starts in proptest::collection::vec((-800.0..800.0f64, -800.0..800.0f64, -180.0..180.0f64), 2..5),
    ) {
        let fliers: Vec<Flier> = starts.iter().map(|(x_m, y_m, course_deg)| Flier::new((*x_m, *y_m), *course_deg)).collect();
        let is_far = |index: usize| {
            fliers[..index].iter().all(|other| other.state.position.distance_m(fliers[index].state.position) >= 300.0)
        };
        prop_assume!((0..fliers.len()).all(is_far));
        let flown = fly(fliers, 60.0);
        prop_assert!(flown.closest_m >= 50.0, "{:?}", flown);
    }
}

/// UAVs that start separable keep the minimum distance, although their desired courses change without notice and their
/// lags are long.
#[test]
fn uavs_whose_courses_jump_keep_the_minimum_distance() {
    let mut drawn = crate::safety::zones::tests::Drawn(11);
    for case in 0..40 {
        let uav =
            UavParams { speed_lag_s: drawn.between(0.2, 2.0), turn_rate_lag_s: drawn.between(0.2, 2.0), ..params() };
        let count = 2 + drawn.below(4);
        let at = |index: usize| (600.0 * (index % 2) as f64, 600.0 * (index / 2) as f64);
        let mut fliers: Vec<Flier> =
            (0..count).map(|index| Flier::new(at(index), drawn.between(-180.0, 180.0))).collect();
        for _ in 0..8 {
            for flier in &mut fliers {
                let to_middle = (Position::from_m(300.0, 300.0) - flier.state.position).direction();
                flier.course = to_middle + Angle::from_rad(drawn.between(-1.0, 1.0));
                flier.speed_m_s = drawn.between(25.0, 55.0);
            }
            let flown = fly_with(uav, fliers.clone(), 8.0, 0);
            assert!(flown.closest_m >= 50.0, "case {case}: {flown:?}");
            fliers.iter_mut().zip(&flown.last).for_each(|(flier, last)| flier.state = *last);
        }
    }
}

/// UAVs near each other in a small area: whatever a UAV avoids, an escape manoeuvre after its command stays inside.
#[test]
fn avoidance_keeps_to_the_geofence() {
    let (uav, separation) = (params(), SeparationParams::default());
    let corners = [(-300.0, -300.0), (300.0, -300.0), (300.0, 300.0), (-300.0, 300.0)];
    let vertices = corners.map(|(x_m, y_m)| Position::from_m(x_m, y_m)).into();
    let geofence = Geofence::new(vec![Zone { kind: ZoneKind::KeepIn, vertices, ..Zone::default() }]).unwrap();
    let safety = GeofenceSafety::new(geofence, Airframe::new(uav, 0.0), PERIOD_S);
    let escapes = FallbackModel::in_air(Airframe::new(uav, 0.0), PERIOD_S);
    let mut drawn = crate::safety::zones::tests::Drawn(5);
    let (mut safe, mut changed) = (0, 0);
    for case in 0..1000 {
        let fliers: Vec<Flier> = (0..4)
            .map(|_| {
                let at = (drawn.between(-280.0, 280.0), drawn.between(-280.0, 280.0));
                Flier::new(at, drawn.between(-180.0, 180.0))
            })
            .collect();
        let own = fliers[3].state;
        if !safety.is_safe(&steady(&own)) {
            continue;
        }
        let others = (0..3).map(|id: u32| OtherAircraft {
            aircraft: Aircraft::Uav(UavId(id)),
            motion: steady(&fliers[id as usize].state),
            age_s: 0.0,
            manoeuvre: None,
        });
        let (id, geofence) = (UavId(3), Some(&safety));
        let avoidance = CollisionAvoidance {
            separation: &separation,
            fallbacks: &escapes,
            plan: None,
            geofence,
            id,
            own: &steady(&own),
            manoeuvre: None,
        };
        let courses = Courses(&fliers, uav);
        let (desired, _) = safety.make_safe(&steady(&own), courses.command(3, &own), None);
        let (command, _) = avoidance.avoid(Intent::held(desired), None, others, &courses);
        let (motion, outlines) = (steady(&own), safety.outlines(&steady(&own)));
        let is_clear = |sense| safety.is_clear(&safety.model.path(&motion, command, sense), &outlines, Of::Avoidance);
        assert!(Sense::BOTH.into_iter().any(is_clear), "case {case}: {command:?}");
        safe += 1;
        changed += usize::from(command != desired);
    }
    assert!(safe > 300 && changed > 100, "{safe} {changed}");
}

/// Number of cases: `PROPTEST_CASES`, or 200 if it is not set.
fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(200)
}

/// A UAV on an orbit of 400 m, and an intruder that starts 1 km away and keeps turning towards it. Returns the minimum
/// distance, m, and the fraction of the time steps with avoidance.
fn pursued(intruder_m_s: f64, direction_deg: f64, seconds: f64) -> (f64, f64) {
    let (uav, separation, dt) = (params(), SeparationParams::default(), Duration::from_s(PERIOD_S));
    let response: AutopilotModel = uav.response(dt);
    let guidance = TeamParams::paper().guidance;
    let ramp = crate::guidance::standoff_distance::Ramp { radius_m: 400.0, rate_m_s: 0.0 };
    let orbit = crate::guidance::heading::Orbit {
        centre: Position::ORIGIN,
        centre_velocity: crate::frame::Velocity::ZERO,
        distance_m: 400.0,
        rate_m_s: 0.0,
        steered: ramp,
    };
    let escapes = FallbackModel::in_air(Airframe::new(uav, 0.0), PERIOD_S);
    let mut own = UavState::level_flight(Position::from_m(400.0, 0.0), Angle::from_deg(90.0), 40.0);
    let direction = Angle::from_deg(direction_deg);
    let start = own.position + Displacement::from_polar(1000.0, direction);
    let mut intruder = UavState::level_flight(start, direction + Angle::from_deg(180.0), intruder_m_s);
    let (mut closest_m, mut avoided, steps) = (f64::INFINITY, 0, (seconds / PERIOD_S) as usize);
    for _ in 0..steps {
        closest_m = closest_m.min(own.position.distance_m(intruder.position));
        let steering = crate::guidance::heading::steer(&guidance, &uav, &own, &orbit, 40.0);
        let desired = uav.limit(Command { speed_m_s: 40.0, turn_rate_rad_s: steering.turn_rate_rad_s }).command;
        let avoidance = CollisionAvoidance {
            separation: &separation,
            fallbacks: &escapes,
            plan: None,
            geofence: None,
            id: UavId(3),
            own: &steady(&own),
            manoeuvre: None,
        };
        let (aircraft, age_s, manoeuvre) = (Aircraft::Intruder(0), 0.0, None);
        let other = OtherAircraft { aircraft, motion: steady(&intruder), age_s, manoeuvre };
        let (safe, avoided_aircraft) = avoidance.avoid(
            Intent::of(desired, own.heading, &steering),
            None,
            core::iter::once(other),
            &Courses(&[], uav),
        );
        avoided += usize::from(avoided_aircraft.is_some());
        let off_rad = ((own.position - intruder.position).direction() - intruder.heading).rad();
        let turn_rate_rad_s = (1.2 * off_rad).clamp(-uav.turn_rate_max_rad_s, uav.turn_rate_max_rad_s);
        intruder = response.step(&intruder, Command { speed_m_s: intruder_m_s, turn_rate_rad_s });
        own = response.step(&own, safe);
    }
    (closest_m, avoided as f64 / steps as f64)
}

/// A UAV pursued by an intruder of its own nominal speed keeps the minimum distance and its buffer, and flies its orbit
/// for a large part of the time. Without the prediction of a pursuit, the distance falls to 66 m.
#[test]
fn a_pursuing_intruder_is_avoided() {
    let required_m = SeparationParams::default().horizontal_min_m + INTRUDER_BUFFER_M;
    for direction in 0..12 {
        let direction_deg = 30.0 * f64::from(direction);
        let (closest_m, avoided) = pursued(40.0, direction_deg, 120.0);
        assert!(closest_m >= required_m && avoided < 0.6, "from {direction_deg} degrees: {closest_m} m, {avoided}");
    }
}

/// With old reports, a manoeuvre against a teammate ends later: at an additional 12 m per second of age.
#[test]
fn a_manoeuvre_against_a_teammate_with_an_old_report_ends_later() {
    let separation = SeparationParams::default();
    let fallbacks = &FallbackModel::in_air(Airframe::new(params(), 0.0), PERIOD_S);
    let own = UavState::level_flight(Position::ORIGIN, Angle::from_deg(0.0), 40.0);
    let additional_m = |avoids, aircraft, age_s| {
        let command = Command { speed_m_s: 40.0, turn_rate_rad_s: 0.1 };
        let manoeuvre = Some(Manoeuvre { avoids: Some(avoids), command, is_left: true });
        let (own, geofence, id) = (&steady(&own), None, UavId(0));
        let avoidance =
            CollisionAvoidance { separation: &separation, fallbacks, geofence, id, own, manoeuvre, plan: None };
        let required = avoidance.required(AHEAD_S, BUFFER_M, age_s);
        avoidance.kept(aircraft, required).now_m - required.now_m
    };
    let (teammate, intruder) = (Aircraft::Uav(UavId(1)), Aircraft::Intruder(1));
    assert_eq!([0.0, 1.5].map(|age_s| additional_m(teammate, teammate, age_s)), [4.0, 22.0]);
    assert_eq!(additional_m(intruder, intruder, 1.5), 4.0);
    assert_eq!(additional_m(teammate, intruder, 1.5), 0.0);
}

/// Three UAVs that meet, with reports that are half a second to one and a half seconds old: they hold their turns, and
/// rarely come below the minimum distance.
#[test]
fn uavs_with_old_reports_hold_their_turns() {
    for (latency, reversals_max) in [(1, 288), (2, 432), (3, 504)] {
        let cases = (0..24).flat_map(|turned| [0.0, 20.0, 60.0].map(|offset_m| (turned, offset_m)));
        let flown: Vec<Flown> = cases
            .map(|(turned, offset_m)| {
                let flier = |index: u32| {
                    let course_deg = 120.0 * f64::from(index) + f64::from(3 * turned * index.min(1));
                    let start_m = -500.0 - offset_m * f64::from(index);
                    let from = Displacement::from_polar(start_m, Angle::from_deg(course_deg));
                    Flier::new((from.x_m(), from.y_m() + offset_m), course_deg)
                };
                fly_with(params(), [0, 1, 2].map(flier).to_vec(), 60.0, latency)
            })
            .collect();
        let below = flown.iter().filter(|flown| flown.closest_m < 50.0).count();
        let reversals: usize = flown.iter().map(|flown| flown.reversals).sum();
        assert!(
            below <= 1 && reversals <= reversals_max,
            "latency {latency}: {below} runs below 50 m, {reversals} reversals"
        );
    }
}

/// In the frame of the air, an old report of an aircraft that turns at constant airspeed predicts its current position,
/// and its current state relative to the air.
#[test]
fn an_old_report_in_wind_predicts_the_current_position() {
    let mut drawn = Drawn(11);
    for _ in 0..200 {
        let wind = Wind { velocity: Velocity::from_m_s(drawn.between(-15.0, 15.0), drawn.between(-15.0, 15.0)) };
        let age_s = drawn.between(0.0, 5.0);
        let then = UavState {
            position: Position::from_m(drawn.between(-500.0, 500.0), drawn.between(-500.0, 500.0)),
            heading: Angle::from_rad(drawn.between(-PI, PI)),
            speed_m_s: drawn.between(25.0, 55.0),
            turn_rate_rad_s: drawn.between(-0.3, 0.3),
            vertical: None,
        };
        let now = then.extrapolated(age_s);
        let (aircraft, manoeuvre) = (Aircraft::Uav(UavId(1)), None);
        let motion = steady(&wind.over_ground(&then, 0.0));
        let in_air = OtherAircraft { aircraft, motion, age_s, manoeuvre }.in_air(wind, &params());
        let predicted = in_air.motion.state.extrapolated(age_s);
        let drifted = now.position + wind.velocity * age_s;
        assert!(predicted.position.distance_m(drifted) < 1e-6, "{then:?} {wind:?} {age_s}");
        assert!((predicted.heading - now.heading).abs_rad() < 1e-9);
        assert!((predicted.speed_m_s - now.speed_m_s).abs() < 1e-9);
        assert!((predicted.turn_rate_rad_s - now.turn_rate_rad_s).abs() < 1e-9);
    }
}
