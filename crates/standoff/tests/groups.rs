//! Several groups: what all agents agree on, and what holds in odd worlds.

mod common;

use std::collections::BTreeSet;

use common::{Team, observe_all, scan_of, step};
use proptest::prelude::*;
use standoff::coordination::clustering::group_count;
use standoff::*;

/// Two groups; the second target of the first drives over to the second.
fn two_groups(id: u32, now: Time) -> Option<(Position, Velocity)> {
    let (x_m, y_m) =
        [(0.0, 0.0), (50.0, 30.0), (-40.0, 60.0), (600.0, 40.0), (640.0, -30.0), (560.0, 0.0), (20.0, -60.0)]
            [id as usize % 7];
    let over = if id == 1 { 11.0 } else { 0.0 };
    let velocity = Velocity::from_m_s(3.0 + over, 2.0);
    Some((Position::from_m(x_m, y_m) + velocity * now.s(), velocity))
}

/// A cue to a target at rest.
fn cue(id: u32, time: Time, (x_m, y_m): (f64, f64), position_sd_m: f64) -> Message {
    let (label, position, velocity) = (TargetLabel(id), Position::from_m(x_m, y_m), Velocity::ZERO);
    Message::Cue(Cue {
        searcher: 0,
        said: time,
        number: label.0 as u16,
        label,
        time,
        position,
        velocity,
        position_sd_m,
        velocity_sd_m_s: 2.0,
    })
}

fn kinds(events: &[Event]) -> Vec<&'static str> {
    events.iter().map(|event| event.kind.name()).filter(|kind| *kind != "cued" && *kind != "acquired").collect()
}

/// With a perfect radio all agents found, assign, hand over and discard alike, to the
/// bit; and a fleet, which keeps one picture, answers as each of them does.
#[test]
fn all_agents_and_the_fleet_agree_to_the_bit() {
    let mut team = Team::new(5, 7).with_motion(two_groups);
    let mut fleet = Fleet::new(TeamParams::table_1()).unwrap();
    let mut happened = BTreeSet::new();
    for tick in 0..240 {
        let (now, scans, inbox) = team.speak(tick);
        let observed = observe_all(&mut fleet, now, &team.states, &scans, &inbox);
        let states = team.states.clone();
        for (index, agent) in team.agents.iter_mut().enumerate() {
            let alone = step(agent, now, &states[index], scan_of(&scans[index]), &inbox);
            let together = fleet.decide(&observed[index]);
            assert_eq!(alone.command, together.command, "tick {tick}");
            assert_eq!(format!("{:?}", alone.diagnostics), format!("{:?}", together.diagnostics));
            assert_eq!((alone.look_at, alone.altitude_m), (together.look_at, together.altitude_m));
            happened.extend(kinds(&agent.picture().events));
            assert_eq!(format!("{:?}", agent.picture()), format!("{:?}", fleet.picture()), "tick {tick}");
        }
        team.tick(tick);
    }
    for kind in ["group-founded", "handoff-requested", "handoff-completed"] {
        assert!(happened.contains(kind), "{happened:?}");
    }
}

/// A UAV that falls silent leaves the team, and its group's targets are watched by others; when it is back, it serves
/// again.
#[test]
fn a_lost_uav_is_replaced_and_may_come_back() {
    let mut team = Team::new(4, 6).with_motion(|id, now| two_groups(id, now).filter(|_| id != 1));
    let crew = |team: &Team, group: u32| {
        let picture = team.agents[0].picture();
        let crew = picture.crew.iter();
        crew.filter(|duty| picture.number(duty.group) == Some(group)).map(|duty| duty.uav).collect::<Vec<_>>()
    };
    // Flies; gives the first tick with so many groups, and of which instants groups were told to come and go.
    let fly = |team: &mut Team, ticks: core::ops::Range<i64>, groups: usize| {
        let (mut first, mut told) = (None, Vec::new());
        for tick in ticks {
            team.tick(tick);
            let agent = &team.agents[0];
            first = first.or(Some(tick).filter(|_| agent.picture().groups.len() == groups));
            for (picture, _) in agent.told() {
                let names = picture.events.iter().map(|event| event.kind.name());
                let of_groups = names.filter(|name| ["group-founded", "group-dissolved"].contains(name));
                told.extend(of_groups.map(|name| (picture.time.us() / 500_000, name)));
            }
        }
        (first, told)
    };
    assert_eq!(fly(&mut team, 0..60, 2), (Some(0), vec![(0, "group-founded"); 2]));
    assert_eq!((crew(&team, 0).len(), crew(&team, 1).len()), (2, 2));
    // Both UAVs of the second group, one of which is not the one whose picture is looked at.
    team.silent = crew(&team, if crew(&team, 0).contains(&UavId(0)) { 1 } else { 0 });
    // Silent for more than 3 s, to all alike, so nothing is missing: one group is left, of two UAVs.
    assert_eq!(fly(&mut team, 60..90, 1), (Some(66), vec![(66, "group-dissolved")]));
    let duties = &team.agents[0].picture().crew;
    assert!(duties.len() == 2 && duties.iter().all(|duty| !team.silent.contains(&duty.uav)), "{duties:?}");
    team.silent.clear();
    assert_eq!(fly(&mut team, 90..120, 2), (Some(90), vec![(90, "group-founded")]));
    assert_eq!((team.agents[0].picture().groups.len(), team.agents[0].picture().crew.len()), (2, 4));
}

/// The margin is in metres: so many standard deviations of where the furthest of a pair is from their centroid, along the
/// line between them. Relative to the centroid of two, each has a quarter of the sum of both covariances.
#[test]
fn the_margin_is_so_many_standard_deviations_along_the_line_to_the_furthest() {
    let mut params = TeamParams::table_1();
    params.group.centre = CentreEstimate::Centroid;
    params.group.margin = Margin::StandardDeviations(2.0);
    let mut agent = Agent::new(UavId(0), params).unwrap();
    let own = Team::new(1, 0).states[0];
    let cues = [cue(0, Time::START, (0.0, 0.0), 16.0), cue(1, Time::START, (120.0, 90.0), 12.0)];
    step(&mut agent, Time::START, &own, Scan::default(), &cues);
    let group = &agent.picture().groups[0];
    // Half of the root of 16^2 + 12^2 m, twice.
    assert!((group.margin_m - 20.0).abs() < 1e-9, "{}", group.margin_m);
    assert!((group.standoff.unclamped_m - 2.0 * (75.0 + 20.0)).abs() < 1e-9, "{:?}", group.standoff);
}

/// Two that part at 4 m/s, so that r_d grows by 4 m/s: where the orbit takes its time, what is steered for is what is
/// flown k_rd = 0.2 r_d / V seconds later, to a metre; it is some 7 m more than what is flown now.
#[test]
fn what_is_steered_for_is_what_a_moving_orbit_has_got_to_by_then() {
    let parting = |id: u32, now: Time| {
        let way = if id == 0 { 1.0 } else { -1.0 };
        Some((Position::from_m(way * (130.0 + 2.0 * now.s()), 0.0), Velocity::from_m_s(way * 2.0, 0.0)))
    };
    let mut params = TeamParams::table_1();
    params.group.centre = CentreEstimate::SmallestCircle;
    params.group.margin = Margin::StandardDeviations(0.0);
    params.group.motion = MotionParams { response_s: 1.5, ..params.group.motion };
    (params.guidance.lead, params.guidance.radial_gain) = (Lead::Predicted, 0.2);
    let mut team = Team::new(1, 2).with_motion(parting);
    team.agents = vec![Agent::new(UavId(0), params).unwrap()];
    let mut orbits = Vec::new();
    for tick in 0..120 {
        team.tick(tick);
        let group = &team.agents[0].picture().groups[0];
        orbits.push((f64::from(tick as u32) * 0.5, group.standoff.distance_m, group.smoothed.radius_m));
    }
    for (t_s, flown_m, steered_m) in orbits[60..80].iter().copied() {
        let lead_s = params.guidance.lead_s(flown_m, params.uav.speed_m_s);
        let after = ((t_s + lead_s) / 0.5) as usize;
        let part = (t_s + lead_s) / 0.5 - after as f64;
        let then_m = orbits[after].1 * (1.0 - part) + orbits[after + 1].1 * part;
        assert!((steered_m - then_m).abs() < 1.0, "{t_s} s: {flown_m} {steered_m} {then_m}");
        assert!(steered_m > flown_m + 5.0, "{t_s} s: {flown_m} {steered_m}");
    }
}

/// Two straight ahead, and one on its way into their group so far to the left that with it the extent is 74 degrees: a
/// sensor of 70 degrees stays on the two whose view is its duty, one of 90 degrees takes all three in, from -4 to 70.
#[test]
fn who_is_in_the_group_stays_in_view_until_there_is_room_for_who_is_on_the_way() {
    let looks_deg = |field_of_view_deg: f64| {
        let mut params = TeamParams::table_1();
        (params.group.centre, params.group.aim) = (CentreEstimate::SmallestCircle, Aim::Middle);
        params.track.sensor.field_of_view_rad = field_of_view_deg.to_radians();
        params.group.standoff.field_of_view_rad = params.track.sensor.field_of_view_rad;
        let mut agent = Agent::new(UavId(0), params).unwrap();
        let position = Position::from_m(-300.0, 0.0);
        let own = UavState::straight(position, Angle::ZERO, 40.0);
        let start = Time::START;
        step(
            &mut agent,
            start,
            &own,
            Scan::default(),
            &[cue(0, start, (0.0, 20.0), 5.0), cue(1, start, (0.0, -20.0), 5.0)],
        );
        let next = Time::from_us(500_000);
        let step = step(&mut agent, next, &own, Scan::default(), &[cue(2, next, (-200.0, 280.0), 5.0)]);
        let known = agent.picture().find(TrackId(2)).unwrap();
        assert!(known.membership.group().is_none() && known.membership.receiving_group().is_some(), "{known:?}");
        step.look_at.unwrap().boresight(own.position, Duration::ZERO).rad().to_degrees()
    };
    assert!(looks_deg(70.0).abs() < 1e-9, "{}", looks_deg(70.0));
    // Half of what the two bearings add up to.
    let middle_deg = 0.5 * (math::atan2(280.0, 100.0) + math::atan2(-20.0, 300.0)).to_degrees();
    assert!((looks_deg(90.0) - middle_deg).abs() < 1e-9, "{} {middle_deg}", looks_deg(90.0));
}

/// So near that three members are 126 degrees apart, a sensor of 70 degrees looks at the two to the right, at 56 and 63
/// degrees, and not between all three.
#[test]
fn where_not_all_fit_in_a_sensor_looks_at_the_most() {
    let mut params = TeamParams::table_1();
    params.group.aim = Aim::Middle;
    let mut agent = Agent::new(UavId(0), params).unwrap();
    let own = UavState::straight(Position::from_m(-100.0, 0.0), Angle::ZERO, 40.0);
    let start = Time::START;
    let cues =
        [cue(0, start, (0.0, 200.0), 5.0), cue(1, start, (20.0, -180.0), 5.0), cue(2, start, (0.0, -200.0), 5.0)];
    let step = step(&mut agent, start, &own, Scan::default(), &cues);
    let looks_deg = step.look_at.unwrap().boresight(own.position, Duration::ZERO).rad().to_degrees();
    let middle_deg = -0.5 * (math::atan2(200.0, 100.0) + math::atan2(180.0, 120.0)).to_degrees();
    assert!((looks_deg - middle_deg).abs() < 1e-9, "{looks_deg} {middle_deg}");
}

/// The groups fly at altitudes of their own.
#[test]
fn each_group_has_its_own_altitude() {
    let mut team = Team::new(6, 7).with_motion(two_groups);
    for tick in 0..40 {
        team.tick(tick);
        let mut altitudes: Vec<_> = team.agents[0].picture().groups.iter().map(|group| group.altitude_m).collect();
        altitudes.sort_by(f64::total_cmp);
        assert_eq!(altitudes, [300.0, 350.0, 400.0]);
    }
}

/// How odd targets move.
#[derive(Debug, Clone, Copy)]
enum Odd {
    Steady,
    Together,
    InLine,
    Leaving,
    Teleporting,
    Spreading,
    FasterThanUavs,
}

fn place(odd: Odd, id: u32, tick: i64, seed: u32) -> Option<(Position, Velocity)> {
    let (n, t) = (f64::from(id), tick as f64 * 0.5);
    let scatter = |k: u32| f64::from(id.wrapping_mul(2_654_435_761).wrapping_add(seed.wrapping_mul(k)) % 4001) - 2000.0;
    let at = |x_m, y_m, vx, vy| Some((Position::from_m(x_m, y_m), Velocity::from_m_s(vx, vy)));
    match odd {
        Odd::Steady => at(scatter(3) + 5.0 * t, scatter(7), 5.0, 0.0),
        Odd::Together => at(100.0, 50.0, 0.0, 0.0),
        Odd::InLine => at(60.0 * n, 0.0, 0.0, 0.0),
        Odd::Leaving => at(50.0 * n, 20.0 * n, 0.0, 0.0).filter(|_| tick < 20),
        Odd::Teleporting => at(scatter(3 + tick as u32 / 7), scatter(11 + tick as u32 / 5), 0.0, 0.0),
        Odd::Spreading => at((n - 3.0) * (5.0 + 12.0 * t), n * 9.0 * t, 12.0 * (n - 3.0), 9.0 * n),
        Odd::FasterThanUavs => at(90.0 * n + (50.0 + n) * t, 40.0 * n, 50.0 + n, 0.0),
    }
}

fn any_world() -> impl Strategy<Value = Odd> {
    prop_oneof![
        Just(Odd::Steady),
        Just(Odd::Together),
        Just(Odd::InLine),
        Just(Odd::Leaving),
        Just(Odd::Teleporting),
        Just(Odd::Spreading),
        Just(Odd::FasterThanUavs),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    /// Whatever the targets do and however many UAVs and targets there are: commands stay inside the limits, every
    /// target has its place, every UAV one group, every group a UAV, a member and an altitude of its own, and never are
    /// there more groups than the rule allows.
    #[test]
    fn odd_worlds_are_answered(odd in any_world(), uavs in 1u32..10, targets in 0u32..14, seed in 0u32..1000, silent in 0u32..10, is_new in any::<bool>(), by_need in any::<bool>()) {
        let mut params = TeamParams::table_1();
        if is_new {
            params.group = GroupParams { centre: CentreEstimate::SmallestCircle, aim: Aim::Middle, discard: Discard::Widening, search: Search::Lost, ..params.group };
            params.guidance.lead = Lead::Predicted;
        }
        if by_need {
            // Reviewed so often that groups are wound up, too.
            (params.group.count, params.group.review_period_s) = (GroupCount::Needed, 5.0);
        }
        let mut fleet = Fleet::new(params).unwrap();
        let start = |id: u32| {
            let position = Position::from_m(400.0 * f64::from(id % 3), -300.0 * f64::from(id / 3));
            UavState::straight(position, Angle::from_rad(f64::from(id)), 40.0)
        };
        let mut states: Vec<UavState> = (0..uavs).map(start).collect();
        let mut look_at = vec![None::<LookAt>; states.len()];
        for tick in 0..80i64 {
            let now = Time::from_us(tick * 500_000);
            let targets: Vec<_> = (0..targets).filter_map(|id| Some((id, place(odd, id, tick, seed)?))).collect();
            let cues: Vec<Message> = targets.iter().filter(|_| tick == 0).map(|(id, (position, velocity))| Message::Cue(Cue {
                searcher: 0, said: now, number: *id as u16, label: TargetLabel(*id), time: now, position: *position, velocity: *velocity, position_sd_m: 20.0, velocity_sd_m_s: 2.0,
            })).collect();
            let scans: Vec<(Option<Angle>, Vec<Detection>)> = states.iter().zip(&look_at).map(|(state, look)| {
                let boresight = look.map(|look| look.boresight(state.position, Duration::from_s(0.5)));
                let seen = targets.iter().filter(|(_, (at, _))| boresight.is_some_and(|boresight| params.track.sensor.in_view(state.position, boresight, *at)));
                (boresight, seen.map(|(id, (at, _))| Detection { label: TargetLabel(*id), measurement: sensor::measure(state.position, *at) }).collect())
            }).collect();
            // One UAV says nonsense of itself for a while: it is silent.
            let mut said = states.clone();
            if let Some(state) = said.get_mut(silent as usize).filter(|_| (30..50).contains(&tick)) {
                state.speed_m_s = f64::NAN;
            }
            let observed = observe_all(&mut fleet, now, &said, &scans, &cues);
            fleet.decide(&observed[0]);
            let picture = fleet.picture().clone();
            let team = picture.crew.len();
            let live = picture.known().iter().filter(|known| !known.track.is_lost()).count();
            let team_max = team.max(uavs as usize);
            let groups_max = if by_need { team_max.min(live) } else { group_count(team_max, live) };
            prop_assert!(picture.groups.len() <= groups_max, "{picture:?}");
            prop_assert!(live == 0 || !picture.groups.is_empty());
            for known in picture.known() {
                for group in known.membership.groups() {
                    prop_assert!(picture.group(group).is_some());
                    prop_assert!(!known.track.is_lost());
                }
            }
            for (index, group) in picture.groups.iter().enumerate() {
                prop_assert!(group.members > 0 && group.spread.rate_m_s.is_finite() && group.standoff.distance_m.is_finite() && group.margin_m.is_finite());
                prop_assert!((250.0..=700.0).contains(&group.standoff.distance_m));
                prop_assert!(picture.groups[..index].iter().all(|other| (other.altitude_m - group.altitude_m).abs() > 49.0));
                prop_assert!(team == 0 || picture.crew.iter().any(|duty| duty.group == group.id), "a group without UAVs: {picture:?}");
                let members = picture.known().iter().filter(|known| known.membership.groups().any(|id| id == group.id)).count();
                prop_assert_eq!(members, group.members as usize);
            }
            for (id, state) in states.iter_mut().enumerate() {
                let step = fleet.decide(&observed[id]);
                let command = step.command;
                prop_assert!((25.0..=55.0).contains(&command.speed_m_s) && command.turn_rate_rad_s.abs() <= 0.3);
                let serves = !picture.groups.is_empty() && picture.crew.iter().any(|duty| duty.uav == UavId(id as u32));
                prop_assert_eq!(step.diagnostics.group.is_some(), serves && said[id].is_finite());
                look_at[id] = step.look_at;
                *state = params.uav.response(Duration::from_s(0.5)).step(state, command);
                prop_assert!(state.is_finite());
            }
        }
    }
}

/// A convoy that is gone for a quarter of a minute and comes back a little further on is found again: without anything
/// to watch the UAVs circle about where it was lost, and look there.
#[test]
fn what_comes_back_where_it_was_lost_is_found_again() {
    let mut team = Team::new(2, 4).with_motion(|id, now| {
        let position = Position::from_m(20.0 * f64::from(id) + 2.0 * now.s(), 10.0 * f64::from(id % 2));
        Some((position, Velocity::from_m_s(2.0, 0.0))).filter(|_| !(30.0..45.0).contains(&now.s()))
    });
    let lost = |team: &Team| team.agents[0].picture().known().iter().filter(|known| known.track.is_lost()).count();
    for tick in 0..90 {
        team.tick(tick);
    }
    assert_eq!((lost(&team), team.agents[0].picture().groups.len()), (4, 0));
    for tick in 90..120 {
        team.tick(tick);
    }
    assert_eq!((lost(&team), team.agents[0].picture().groups.len()), (0, 1));
}

/// Everybody who leaves the team or comes to it is told of, also when nobody is left in between.
#[test]
fn who_comes_and_goes_is_told_of() {
    let mut team = Team::new(3, 2);
    let mut told = Vec::new();
    for tick in 0..60 {
        // The agent whose picture is looked at stays; the others are silent for a while.
        team.silent = if (20..40).contains(&tick) { vec![UavId(1), UavId(2)] } else { Vec::new() };
        let (now, scans, inbox) = team.speak(tick);
        let own = team.states[0];
        step(&mut team.agents[0], now, &own, scan_of(&scans[0]), &inbox);
        let events = &team.agents[0].picture().events;
        let of_uavs = events.iter().filter(|event| matches!(event.kind, EventKind::UavLost | EventKind::UavJoined));
        told.extend(of_uavs.map(|event| (tick, event.kind.name(), event.uav)));
        team.tick(tick);
    }
    let (one, two) = (Some(UavId(1)), Some(UavId(2)));
    assert_eq!(told, [(26, "uav-lost", one), (26, "uav-lost", two), (40, "uav-joined", one), (40, "uav-joined", two)]);
}

/// A group that takes in many targets gets the UAV that a small one can spare.
#[test]
fn uavs_are_assigned_anew_when_a_group_doubles() {
    let mut team = Team::new(3, 19).with_motion(|id, now| {
        let (east_m, from_s) = match id {
            0..4 => (0.0, 0.0),
            4..7 => (1200.0, 0.0),
            _ => (1200.0, 20.0),
        };
        let position = Position::from_m(east_m + 15.0 * f64::from(id % 4), 20.0 * f64::from(id / 4));
        Some((position, Velocity::ZERO)).filter(|_| now.s() >= from_s)
    });
    let serving = |team: &Team, group: u32| {
        let picture = team.agents[0].picture();
        picture.crew.iter().filter(|duty| picture.number(duty.group) == Some(group)).count()
    };
    for tick in 0..38 {
        team.tick(tick);
    }
    assert_eq!((serving(&team, 0), serving(&team, 1)), (2, 1));
    for tick in 38..60 {
        team.tick(tick);
    }
    assert_eq!((serving(&team, 0), serving(&team, 1)), (1, 2));
}

/// Three cars that part, gone for a quarter of a minute, and elsewhere when they come back.
fn gone_for_a_while(id: u32, now: Time) -> Option<(Position, Velocity)> {
    let velocity = Velocity::from_polar(7.0, Angle::from_deg(120.0 * f64::from(id)));
    let position = Position::ORIGIN + velocity * now.s();
    Some((position, velocity)).filter(|_| !(30.0..50.0).contains(&now.s()))
}

/// Each of three UAVs searches for a car of its own when all are lost, in every agent's picture and in a fleet's to the bit;
/// who has found its car serves its group, and nobody does both.
#[test]
fn each_searches_for_a_lost_one_of_its_own() {
    let mut params = TeamParams::table_1();
    (params.group.count, params.group.search) = (GroupCount::Needed, Search::Lost);
    let mut team = Team::new(3, 3).with_motion(gone_for_a_while);
    team.agents = (0..3).map(|id| Agent::new(UavId(id), params).unwrap()).collect();
    let mut fleet = Fleet::new(params).unwrap();
    let mut told = BTreeSet::new();
    for tick in 0..200 {
        let (now, scans, inbox) = team.speak(tick);
        let observed = observe_all(&mut fleet, now, &team.states, &scans, &inbox);
        for (index, one) in observed.iter().enumerate() {
            let alone = step(&mut team.agents[index], now, &team.states[index], scan_of(&scans[index]), &inbox);
            let together = fleet.decide(one);
            assert_eq!((alone.command, alone.look_at), (together.command, together.look_at), "tick {tick}");
            assert_eq!(format!("{:?}", team.agents[index].picture()), format!("{:?}", fleet.picture()), "tick {tick}");
        }
        let picture = fleet.picture();
        let searched: BTreeSet<TrackId> = picture.searches.iter().map(|duty| duty.track).collect();
        assert_eq!(searched.len(), picture.searches.len(), "two after one");
        let mut busy: Vec<UavId> = picture.crew.iter().map(|duty| duty.uav).collect();
        busy.extend(picture.searches.iter().map(|duty| duty.uav));
        busy.sort_unstable_by_key(|uav| uav.0);
        assert_eq!(busy, [UavId(0), UavId(1), UavId(2)], "tick {tick}");
        for group in &picture.groups {
            assert!(picture.crew.iter().any(|duty| duty.group == group.id), "nobody serves {:?}", group.id);
        }
        told.extend(picture.events.iter().map(|event| (event.kind.name(), event.kind.cause())));
        if tick == 99 {
            assert_eq!((picture.groups.len(), searched.len()), (0, 3), "all lost");
        }
        team.tick(tick);
    }
    assert!(told.contains(&("search-started", None)) && told.contains(&("search-ended", Some("found"))), "{told:?}");
    let picture = team.agents[0].picture();
    assert!(picture.searches.is_empty() && picture.known().iter().all(|known| !known.track.is_lost()), "{picture:?}");
}

/// An assignment law of one's own: it says the same at every instant, wherever it is asked: UAVs, and the how many'th site
/// each is to serve.
#[derive(Debug)]
struct Fixed(Option<Vec<(u32, usize)>>);

impl AssignmentLaw for Fixed {
    fn assign(&self, _: Time, uavs: &[AvailableUav], sites: &[Site<'_>]) -> Option<Vec<Duty>> {
        assert!(uavs.is_sorted_by_key(|uav| uav.uav) && sites.is_sorted_by_key(|site| site.group));
        // Where there are not so many, of a group that is not there.
        let group = |site: usize| sites.get(site).map_or(GroupId(site as u64), |site| site.group);
        let duties = self.0.as_ref()?.iter();
        Some(duties.map(|(uav, site)| Duty { uav: UavId(*uav), group: group(*site) }).collect())
    }
}

/// Who serves which group after two minutes under an assignment law, or none; and who was moved by it.
fn crew_under(law: Option<Fixed>) -> (Vec<(u32, Option<u32>)>, Vec<u32>) {
    let mut team = Team::new(4, 6).with_motion(two_groups);
    let fleet = Fleet::new(TeamParams::table_1()).expect("the paper's parameters are in range");
    let mut fleet = match law {
        Some(law) => fleet.assigned_by(std::sync::Arc::new(law)),
        None => fleet,
    };
    let mut moved = Vec::new();
    for tick in 0..60 {
        let (now, scans, inbox) = team.speak(tick);
        let observed = observe_all(&mut fleet, now, &team.states, &scans, &inbox);
        for observation in &observed {
            let _ = fleet.decide(observation);
        }
        let events = fleet.picture().events.iter();
        moved.extend(events.filter(|event| event.kind.cause() == Some("own-law")).filter_map(|event| event.uav));
        team.tick(tick);
    }
    let picture = fleet.picture();
    let crew = picture.crew.iter().map(|duty| (duty.uav.0, picture.number(duty.group))).collect();
    (crew, moved.into_iter().map(|uav| uav.0).collect())
}

/// A law of one's own is obeyed as far as it can be: of UAVs and groups that there are, each UAV once; who is given no
/// group has none. Without an answer the product assigns, to the bit.
#[test]
fn an_assignment_law_of_ones_own_is_obeyed_as_far_as_it_can_be() {
    let (ours, moved) = crew_under(None);
    assert_eq!((ours.len(), &moved[..]), (4, &[][..]));
    assert_eq!(crew_under(Some(Fixed(None))), (ours, moved));
    let (crew, _) = crew_under(Some(Fixed(Some(vec![(3, 0), (0, 1), (9, 0), (1, 7), (0, 0)]))));
    assert_eq!(crew, [(0, Some(1)), (3, Some(0))]);
}
