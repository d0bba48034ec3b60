use proptest::prelude::*;

use super::*;
use crate::angle::Angle;
use crate::frame::{Displacement, Position};
use crate::team::TeamParams;
use crate::time::Duration;
use crate::uav::{ClimbParams, Response};

const PERIOD_S: f64 = 0.5;

/// A UAV that wants to fly a course at a speed, and keeps apart, or not.
#[derive(Debug, Clone, Copy)]
struct Flier {
    state: UavState,
    course: Angle,
    speed_m_s: f64,
    keeps_apart: bool,
    /// The altitude that it wants.
    altitude_m: Option<f64>,
}

impl Flier {
    fn new((x_m, y_m): (f64, f64), course_deg: f64) -> Self {
        let (course, speed_m_s) = (Angle::from_deg(course_deg), 40.0);
        let position = Position::from_m(x_m, y_m);
        let state = UavState::straight(position, course, speed_m_s);
        Self { state, course, speed_m_s, keeps_apart: true, altitude_m: None }
    }

    /// On its way from one altitude to another.
    fn climbing(self, from_m: f64, to_m: f64) -> Self {
        let vertical = Some(Vertical { altitude_m: from_m, climb_rate_m_s: 0.0 });
        Self { state: UavState { vertical, ..self.state }, altitude_m: Some(to_m), ..self }
    }
}

/// What a flight came to.
#[derive(Debug)]
struct Flown {
    /// The least distance of two that were not apart in height, m.
    closest_m: f64,
    /// Instants of UAVs that flew something else than they wanted.
    avoided: usize,
    /// Turns the other way while doing so.
    reversals: usize,
    last: Vec<UavState>,
}

fn params() -> UavParams {
    UavParams { climb: Some(ClimbParams::default()), ..TeamParams::table_1().uav }
}

fn fly(mut fliers: Vec<Flier>, seconds: f64) -> Flown {
    let (uav, separation, dt) = (params(), SeparationParams::default(), Duration::from_s(PERIOD_S));
    let response: Response = uav.response(dt);
    let mut flown = Flown { closest_m: f64::INFINITY, avoided: 0, reversals: 0, last: Vec::new() };
    let mut sides = vec![0.0f64; fliers.len()];
    for _ in 0..(seconds / PERIOD_S) as usize {
        let others: Vec<Other> = (0..)
            .zip(&fliers)
            .map(|(id, flier)| Other { aircraft: Aircraft::Uav(UavId(id)), said: flier.state, age_s: 0.0 })
            .collect();
        for (place, flier) in fliers.iter_mut().enumerate() {
            for other in &others[place + 1..] {
                let up_m =
                    flier.state.vertical.zip(other.said.vertical).map(|(a, b)| (a.altitude_m - b.altitude_m).abs());
                if up_m.is_none_or(|up_m| up_m < separation.vertical_m) {
                    flown.closest_m = flown.closest_m.min(flier.state.position.distance_m(other.said.position));
                }
            }
            let off_rad = (flier.course - flier.state.heading).rad();
            let wanted = uav.limit(Command { speed_m_s: flier.speed_m_s, turn_rate_rad_s: off_rad }).command;
            let own = flier.state;
            let keeper = Keeper { separation: &separation, uav: &uav, id: UavId(place as u32), own: &own };
            let mates = others.iter().copied().filter(|other| other.aircraft != Aircraft::Uav(keeper.id));
            let mut altitude_m = flier.altitude_m;
            let mut command = wanted;
            if flier.keeps_apart {
                altitude_m = altitude_m.map(|wanted_m| keeper.altitude_m(wanted_m, mates.clone()));
                let (kept, avoided) = keeper.keep_apart((wanted, None), altitude_m, mates, |_| None, |_| true);
                assert_eq!(uav.limit(kept).command, kept, "inside the limits");
                flown.avoided += usize::from(avoided.is_some());
                command = kept;
            }
            let side =
                if command.turn_rate_rad_s.abs() > 0.05 { command.turn_rate_rad_s.signum() } else { sides[place] };
            flown.reversals += usize::from(side * sides[place] < 0.0);
            sides[place] = side;
            let climb = uav.climb.unwrap_or_default();
            flier.state = response.step(&own, command);
            flier.state.vertical = own.vertical.map(|vertical| climb.step(&vertical, altitude_m, dt));
        }
    }
    flown.last = fliers.iter().map(|flier| flier.state).collect();
    flown
}

/// Head-on, from the side at several angles, overtaking, converging: two that apply the law stay apart, whoever has the
/// right of way, do not turn back and forth, and fly their course again afterwards.
#[test]
fn two_that_meet_go_past_one_another() {
    for angle_deg in [180.0, 175.0, 150.0, 120.0, 90.0, 60.0, 40.0, 20.0] {
        for offset_m in [0.0, 5.0, -5.0, 30.0, -30.0] {
            for first in [0, 1] {
                let angle = Angle::from_deg(angle_deg);
                // Both would be at the origin, or an offset away from it, after 15 s.
                let start = Position::ORIGIN + Displacement::from_polar(-600.0, angle);
                let mut fliers =
                    vec![Flier::new((-600.0, offset_m), 0.0), Flier::new((start.x_m(), start.y_m()), angle_deg)];
                fliers.rotate_left(first);
                let flown = fly(fliers.clone(), 60.0);
                let what = format!("{angle_deg} degrees, {offset_m} m, {first}: {flown:?}");
                assert!(flown.closest_m >= 50.0 && flown.avoided > 0, "{what}");
                assert!(flown.reversals <= 6, "{what}");
                for (flier, last) in fliers.iter().zip(&flown.last) {
                    assert!((last.heading - flier.course).abs_rad() < 0.01, "{what}");
                }
            }
        }
    }
}

/// One behind another on one course, 12 m/s faster. Of lower id it gives way and goes past; of higher id the one ahead gives
/// way, which is to fly faster.
#[test]
fn who_overtakes_stays_apart() {
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

/// Of two one does nothing, be it of lower or of higher id: the other one goes past it.
#[test]
fn one_that_does_not_keep_apart_is_kept_away_from() {
    for angle_deg in [180.0, 135.0, 90.0, 45.0] {
        for silent in [0, 1] {
            let start = Position::ORIGIN + Displacement::from_polar(-600.0, Angle::from_deg(angle_deg));
            let mut fliers = vec![Flier::new((-600.0, 0.0), 0.0), Flier::new((start.x_m(), start.y_m()), angle_deg)];
            fliers[silent].keeps_apart = false;
            let flown = fly(fliers, 60.0);
            // Who has the right of way waits for longer for the other one to give way.
            let least_m = if silent == 0 { 30.0 } else { 50.0 };
            assert!(flown.closest_m >= least_m, "{angle_deg} degrees, silent {silent}: {flown:?}");
        }
    }
}

/// Nobody near, nobody avoided: what is wanted is flown, to the bit.
#[test]
fn far_apart_nothing_is_changed() {
    let flown = fly(vec![Flier::new((0.0, 0.0), 90.0), Flier::new((400.0, 0.0), 90.0)], 60.0);
    assert!(flown.avoided == 0 && (flown.closest_m - 400.0).abs() < 1e-9, "{flown:?}");
}

/// Who is 30 m higher is not in the way; who climbs through another one's altitude is, and waits until it is gone.
#[test]
fn those_apart_in_height_pass_over_one_another() {
    let level =
        |altitude_m: f64, x_m: f64, course_deg| Flier::new((x_m, 0.0), course_deg).climbing(altitude_m, altitude_m);
    let flown = fly(vec![level(300.0, -600.0, 0.0), level(331.0, 600.0, 180.0)], 40.0);
    assert_eq!((flown.avoided, flown.closest_m), (0, f64::INFINITY));
    // Side by side, 150 m apart, the lower one wants to be above the upper one: not here.
    let beside = |y_m: f64| Flier::new((0.0, y_m), 0.0);
    let flown = fly(vec![beside(0.0).climbing(300.0, 400.0), beside(150.0).climbing(350.0, 350.0)], 60.0);
    let height_m = |place: usize| flown.last[place].vertical.map_or(0.0, |vertical| vertical.altitude_m);
    assert!((height_m(0) - 319.0).abs() < 0.1 && (height_m(1) - 350.0).abs() < 1e-9, "{flown:?}");
    // 700 m apart, it climbs.
    let flown = fly(vec![beside(0.0).climbing(300.0, 400.0), beside(700.0).climbing(350.0, 350.0)], 60.0);
    assert!(flown.last[0].vertical.is_some_and(|vertical| (vertical.altitude_m - 400.0).abs() < 0.5), "{flown:?}");
}

/// Two that want to change places, one over the other, and a third between them: all hold their heights.
#[test]
fn those_over_one_another_do_not_change_places() {
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
    /// Up to four from 300 m apart, whatever their courses: never nearer than the minimum.
    #[test]
    fn a_few_on_any_courses_stay_apart(
        starts in proptest::collection::vec((-800.0..800.0f64, -800.0..800.0f64, -180.0..180.0f64), 2..5),
    ) {
        let fliers: Vec<Flier> = starts.iter().map(|(x_m, y_m, course_deg)| Flier::new((*x_m, *y_m), *course_deg)).collect();
        let is_far = |place: usize| {
            fliers[..place].iter().all(|other| other.state.position.distance_m(fliers[place].state.position) >= 300.0)
        };
        prop_assume!((0..fliers.len()).all(is_far));
        let flown = fly(fliers, 60.0);
        prop_assert!(flown.closest_m >= 50.0, "{:?}", flown);
    }
}

/// 200, or more if `PROPTEST_CASES` says so.
fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(200)
}

/// A UAV on its orbit of 400 m, and an intruder that turns at it all the while, from 1 km: how near that comes, m, and for
/// which part of the time something else was flown than the orbit.
fn pursued(intruder_m_s: f64, direction_deg: f64, seconds: f64) -> (f64, f64) {
    let (uav, separation, dt) = (params(), SeparationParams::default(), Duration::from_s(PERIOD_S));
    let response: Response = uav.response(dt);
    let guidance = TeamParams::table_1().guidance;
    let ramp = crate::guidance::standoff_distance::Ramp { radius_m: 400.0, rate_m_s: 0.0 };
    let orbit = crate::guidance::heading::Orbit {
        centre: Position::ORIGIN,
        centre_velocity: crate::frame::Velocity::ZERO,
        distance_m: 400.0,
        rate_m_s: 0.0,
        steered: ramp,
    };
    let mut own = UavState::straight(Position::from_m(400.0, 0.0), Angle::from_deg(90.0), 40.0);
    let direction = Angle::from_deg(direction_deg);
    let start = own.position + Displacement::from_polar(1000.0, direction);
    let mut intruder = UavState::straight(start, direction + Angle::from_deg(180.0), intruder_m_s);
    let (mut closest_m, mut avoided, steps) = (f64::INFINITY, 0, (seconds / PERIOD_S) as usize);
    for _ in 0..steps {
        closest_m = closest_m.min(own.position.distance_m(intruder.position));
        let steering = crate::guidance::heading::steer(&guidance, &own, &orbit, 40.0);
        let wanted = uav.limit(Command { speed_m_s: 40.0, turn_rate_rad_s: steering.turn_rate_rad_s }).command;
        let keeper = Keeper { separation: &separation, uav: &uav, id: UavId(3), own: &own };
        let other = Other { aircraft: Aircraft::Intruder(0), said: intruder, age_s: 0.0 };
        let (kept, avoidance) =
            keeper.keep_apart((wanted, Some(&steering)), None, core::iter::once(other), |_| None, |_| true);
        avoided += usize::from(avoidance.is_some());
        let off_rad = ((own.position - intruder.position).direction() - intruder.heading).rad();
        let turn_rate_rad_s = (1.2 * off_rad).clamp(-uav.turn_rate_max_rad_s, uav.turn_rate_max_rad_s);
        intruder = response.step(&intruder, Command { speed_m_s: intruder_m_s, turn_rate_rad_s });
        own = response.step(&own, kept);
    }
    (closest_m, avoided as f64 / steps as f64)
}

/// Pursued from wherever by one as fast as it likes to fly itself, it comes no nearer than the least distance, and is back on
/// its orbit most of the time.
#[test]
fn who_pursues_is_kept_away_from_and_does_nothing_for_it() {
    for direction in 0..12 {
        let (closest_m, avoided) = pursued(40.0, 30.0 * f64::from(direction), 120.0);
        assert!(closest_m >= 60.0 && avoided < 0.6, "from {direction}/12: {closest_m} m, {avoided}");
    }
}
