//! Several groups: agreement of all agents, and invariants in unusual worlds.

use std::collections::BTreeSet;

use crate::common::{Team, observe_all, scan_of, step};
use proptest::prelude::*;
use standoff::coordination::assignment::Assignment;
use standoff::coordination::assignment::AssignmentLaw;
use standoff::coordination::assignment::AvailableUav;
use standoff::coordination::assignment::CandidateGroup;
use standoff::coordination::clustering::group_count;
use standoff::params::CentreEstimate;
use standoff::params::GroupCount;
use standoff::params::Margin;
use standoff::params::MotionParams;
use standoff::params::Pointing;
use standoff::params::RemovalRule;
use standoff::*;

/// Two groups; target 1 of the first group drives to the second group.
fn two_groups(id: u32, now: Time) -> Option<(Position, Velocity)> {
    let (x_m, y_m) =
        [(0.0, 0.0), (50.0, 30.0), (-40.0, 60.0), (600.0, 40.0), (640.0, -30.0), (560.0, 0.0), (20.0, -60.0)]
            [id as usize % 7];
    let over = if id == 1 { 11.0 } else { 0.0 };
    let velocity = Velocity::from_m_s(3.0 + over, 2.0);
    Some((Position::from_m(x_m, y_m) + velocity * now.s(), velocity))
}

/// A cue for a stationary target.
fn cue(id: u32, time: Time, (x_m, y_m): (f64, f64), position_sd_m: f64) -> Message {
    let (label, position, velocity) = (TargetLabel(id), Position::from_m(x_m, y_m), Velocity::ZERO);
    Message::Cue(Cue {
        source: 0,
        issued_at: time,
        sequence: label.0 as u16,
        label: Some(label),
        time,
        position,
        velocity,
        position_sd_m,
        velocity_sd_m_s: 2.0,
        priority: None,
    })
}

fn kinds(events: &[Event]) -> Vec<&'static str> {
    events.iter().map(|event| event.kind.name()).filter(|kind| *kind != "cued" && *kind != "acquired").collect()
}

/// With an ideal radio all agents create groups, assign UAVs, hand off and remove targets identically, bit for bit. A
/// fleet with a single team state gives the same results as each agent.
#[test]
fn all_agents_and_the_fleet_agree_to_the_bit() {
    let mut team = Team::new(5, 7).with_motion(two_groups);
    let mut fleet = TeamAgent::new(TeamParams::paper()).unwrap();
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
            assert_eq!((alone.pointing_target, alone.altitude_m), (together.pointing_target, together.altitude_m));
            happened.extend(kinds(&agent.team_state().events));
            assert_eq!(format!("{:?}", agent.team_state()), format!("{:?}", fleet.team_state()), "tick {tick}");
        }
        team.tick(tick);
    }
    for kind in ["group-created", "handoff-started", "handoff-completed"] {
        assert!(happened.contains(kind), "{happened:?}");
    }
}

/// UAVs that fall silent leave the team, and other UAVs take over their targets. When they are back, they are assigned
/// again.
#[test]
fn a_lost_uav_is_replaced_and_may_come_back() {
    let mut team = Team::new(4, 6).with_motion(|id, now| two_groups(id, now).filter(|_| id != 1));
    let assigned_uavs = |team: &Team, group: u32| {
        let team_state = team.agents[0].team_state();
        let assigned_uavs = team_state.assignments.iter();
        assigned_uavs
            .filter(|assignment| team_state.group_number(assignment.group) == Some(group))
            .map(|assignment| assignment.uav)
            .collect::<Vec<_>>()
    };
    // Returns the first tick with `groups` groups, and the ticks at which groups were created and retired.
    let fly = |team: &mut Team, ticks: core::ops::Range<i64>, groups: usize| {
        let (mut first, mut published) = (None, Vec::new());
        for tick in ticks {
            team.tick(tick);
            let agent = &team.agents[0];
            first = first.or(Some(tick).filter(|_| agent.team_state().groups.len() == groups));
            for (team_state, _) in agent.published_states() {
                let names = team_state.events.iter().map(|event| event.kind.name());
                let of_groups = names.filter(|name| ["group-created", "group-retired"].contains(name));
                published.extend(of_groups.map(|name| (team_state.time.us() / 500_000, name)));
            }
        }
        (first, published)
    };
    assert_eq!(fly(&mut team, 0..60, 2), (Some(0), vec![(0, "group-created"); 2]));
    assert_eq!((assigned_uavs(&team, 0).len(), assigned_uavs(&team, 1).len()), (2, 2));
    // Silence both UAVs of a group; the agent whose team state is checked must not be one of them.
    team.silent = assigned_uavs(&team, if assigned_uavs(&team, 0).contains(&UavId(0)) { 1 } else { 0 });
    // They are silent for all teammates for more than 3 s, so no message is missing: one group with two UAVs remains.
    assert_eq!(fly(&mut team, 60..90, 1), (Some(66), vec![(66, "group-retired")]));
    let assignments = &team.agents[0].team_state().assignments;
    assert!(
        assignments.len() == 2 && assignments.iter().all(|assignment| !team.silent.contains(&assignment.uav)),
        "{assignments:?}"
    );
    team.silent.clear();
    assert_eq!(fly(&mut team, 90..120, 2), (Some(90), vec![(90, "group-created")]));
    assert_eq!((team.agents[0].team_state().groups.len(), team.agents[0].team_state().assignments.len()), (2, 4));
}

/// The margin is in metres: a number of standard deviations of the furthest member's position relative to the centroid,
/// along the line to it. Relative to the centroid of two, each member has a quarter of the sum of both covariances.
#[test]
fn the_margin_is_a_number_of_standard_deviations_along_the_line_to_the_furthest_member() {
    let mut params = TeamParams::paper();
    (params.group.margin, params.group.margin_sds) = (Margin::StandardDeviations, 2.0);
    let mut agent = Agent::new(UavId(0), params).unwrap();
    let own = Team::new(1, 0).states[0];
    let cues = [cue(0, Time::EPOCH, (0.0, 0.0), 16.0), cue(1, Time::EPOCH, (120.0, 90.0), 12.0)];
    step(&mut agent, Time::EPOCH, &own, Scan::default(), &cues);
    let group = &agent.team_state().groups[0];
    // Two standard deviations of sqrt(16^2 + 12^2) / 2 m.
    assert!((group.margin_m() - 20.0).abs() < 1e-9, "{}", group.margin_m());
    assert!((group.standoff.unclamped_m - 2.0 * (75.0 + 20.0)).abs() < 1e-9, "{:?}", group.standoff);
}

/// Two targets separate at 4 m/s, so r_d grows by 4 m/s. With a time constant, the steered radius is within a metre of
/// the radius that is flown k_rd = 0.2 r_d / V seconds later, about 7 m more than the current one.
#[test]
fn the_steered_radius_is_the_flown_radius_after_the_lead_time() {
    let diverging_for = |id: u32, now: Time| {
        let sign = if id == 0 { 1.0 } else { -1.0 };
        Some((Position::from_m(sign * (130.0 + 2.0 * now.s()), 0.0), Velocity::from_m_s(sign * 2.0, 0.0)))
    };
    let mut params = TeamParams::paper();
    params.group.centre = CentreEstimate::EnclosingCircle;
    params.group.margin_sds = 0.0;
    params.group.motion = MotionParams { time_constant_s: 1.5, ..params.group.motion };
    (params.guidance.law, params.guidance.radial_gain) = (Law::Standoff, 0.2);
    let mut team = Team::new(1, 2).with_motion(diverging_for);
    team.agents = vec![Agent::new(UavId(0), params).unwrap()];
    let mut orbits = Vec::new();
    for tick in 0..120 {
        team.tick(tick);
        let group = &team.agents[0].team_state().groups[0];
        orbits.push((f64::from(tick as u32) * 0.5, group.standoff.distance_m, group.orbit().steered.radius_m));
    }
    for (t_s, flown_m, steered_m) in orbits[60..80].iter().copied() {
        let lead_s = params.guidance.lead_s(flown_m, params.uav.speed_m_s);
        let after = ((t_s + lead_s) / 0.5) as usize;
        let fraction = (t_s + lead_s) / 0.5 - after as f64;
        let then_m = orbits[after].1 * (1.0 - fraction) + orbits[after + 1].1 * fraction;
        assert!((steered_m - then_m).abs() < 1.0, "{t_s} s: {flown_m} {steered_m} {then_m}");
        assert!(steered_m > flown_m + 5.0, "{t_s} s: {flown_m} {steered_m}");
    }
}

/// Two members are straight ahead, and a target in handoff to their group is so far to the left that the extent of all
/// three is 74 degrees. A sensor of 70 degrees stays on the two members; one of 90 degrees covers all three, from -4 to
/// 70 degrees.
#[test]
fn a_group_member_stays_in_view_until_a_target_in_handoff_fits_in_too() {
    let boresight_deg = |field_of_view_deg: f64| {
        let mut params = TeamParams::paper();
        (params.group.centre, params.group.pointing) = (CentreEstimate::EnclosingCircle, Pointing::AngularMidpoint);
        params.track.sensor.field_of_view_rad = field_of_view_deg.to_radians();
        let mut agent = Agent::new(UavId(0), params).unwrap();
        let position = Position::from_m(-300.0, 0.0);
        let own = UavState::level_flight(position, Angle::ZERO, 40.0);
        let start = Time::EPOCH;
        step(
            &mut agent,
            start,
            &own,
            Scan::default(),
            &[cue(0, start, (0.0, 20.0), 5.0), cue(1, start, (0.0, -20.0), 5.0)],
        );
        let next = Time::from_us(500_000);
        let step = step(&mut agent, next, &own, Scan::default(), &[cue(2, next, (-200.0, 280.0), 5.0)]);
        let known = agent.team_state().track(TrackId(2)).unwrap();
        assert!(known.membership.group().is_none() && known.membership.receiving_group().is_some(), "{known:?}");
        step.pointing_target.unwrap().boresight(own.position, Duration::ZERO).rad().to_degrees()
    };
    assert!(boresight_deg(70.0).abs() < 1e-9, "{}", boresight_deg(70.0));
    // The mean of the outermost two bearings.
    let middle_deg = 0.5 * (standoff::math::atan2(280.0, 100.0) + standoff::math::atan2(-20.0, 300.0)).to_degrees();
    assert!((boresight_deg(90.0) - middle_deg).abs() < 1e-9, "{} {middle_deg}", boresight_deg(90.0));
}

/// The UAV is so near that three members extend over 126 degrees. A sensor of 70 degrees points at the two to the
/// right, at 56 and 63 degrees, and not between all three.
#[test]
fn a_sensor_points_at_the_largest_set_of_members_that_stays_in_view() {
    let mut params = TeamParams::paper();
    params.group.pointing = Pointing::AngularMidpoint;
    let mut agent = Agent::new(UavId(0), params).unwrap();
    let own = UavState::level_flight(Position::from_m(-100.0, 0.0), Angle::ZERO, 40.0);
    let start = Time::EPOCH;
    let cues =
        [cue(0, start, (0.0, 200.0), 5.0), cue(1, start, (20.0, -180.0), 5.0), cue(2, start, (0.0, -200.0), 5.0)];
    let step = step(&mut agent, start, &own, Scan::default(), &cues);
    let boresight_deg = step.pointing_target.unwrap().boresight(own.position, Duration::ZERO).rad().to_degrees();
    let middle_deg = -0.5 * (standoff::math::atan2(200.0, 100.0) + standoff::math::atan2(180.0, 120.0)).to_degrees();
    assert!((boresight_deg - middle_deg).abs() < 1e-9, "{boresight_deg} {middle_deg}");
}

/// The groups fly at different altitudes.
#[test]
fn each_group_has_its_own_altitude() {
    let mut team = Team::new(6, 7).with_motion(two_groups);
    for tick in 0..40 {
        team.tick(tick);
        let mut altitudes: Vec<_> = team.agents[0].team_state().groups.iter().map(|group| group.altitude_m).collect();
        altitudes.sort_by(f64::total_cmp);
        assert_eq!(altitudes, [300.0, 350.0, 400.0]);
    }
}

/// Unusual motions of targets.
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
    /// For any target motion and any numbers of UAVs and targets: commands stay within the limits, every target has a
    /// valid membership, every UAV at most one group, every group a UAV, a member and a distinct altitude, and there
    /// are not more groups than the rule allows.
    #[test]
    fn invariants_hold_in_unusual_worlds(odd in any_world(), uavs in 1u32..10, targets in 0u32..14, seed in 0u32..1000, silent in 0u32..10, is_new in any::<bool>(), by_need in any::<bool>()) {
        let mut params = TeamParams::paper();
        if is_new {
            params.group = GroupingParams { centre: CentreEstimate::EnclosingCircle, pointing: Pointing::AngularMidpoint, removal: RemovalRule::LargestRadiusReduction, search_lost_targets: true, ..params.group };
            params.guidance.law = Law::Standoff;
        }
        if by_need {
            // A short regrouping period, so that groups are also retired.
            (params.group.count, params.group.regrouping_period_s) = (GroupCount::AsNeeded, 5.0);
        }
        let mut fleet = TeamAgent::new(params).unwrap();
        let start = |id: u32| {
            let position = Position::from_m(400.0 * f64::from(id % 3), -300.0 * f64::from(id / 3));
            UavState::level_flight(position, Angle::from_rad(f64::from(id)), 40.0)
        };
        let mut states: Vec<UavState> = (0..uavs).map(start).collect();
        let mut pointing_target = vec![None::<PointingTarget>; states.len()];
        for tick in 0..80i64 {
            let now = Time::from_us(tick * 500_000);
            let targets: Vec<_> = (0..targets).filter_map(|id| Some((id, place(odd, id, tick, seed)?))).collect();
            let cues: Vec<Message> = targets.iter().filter(|_| tick == 0).map(|(id, (position, velocity))| Message::Cue(Cue {
                source: 0, issued_at: now, sequence: *id as u16, label: Some(TargetLabel(*id)), time: now, position: *position, velocity: *velocity, position_sd_m: 20.0, velocity_sd_m_s: 2.0, priority: None,
            })).collect();
            let scans: Vec<(Option<Angle>, Vec<Detection>)> = states.iter().zip(&pointing_target).map(|(state, look)| {
                let boresight = look.map(|look| look.boresight(state.position, Duration::from_s(0.5)));
                let seen = targets.iter().filter(|(_, (at, _))| boresight.is_some_and(|boresight| params.track.sensor.in_view(state.position, boresight, *at)));
                (boresight, seen.map(|(id, (at, _))| Detection { label: Some(TargetLabel(*id)), measurement: standoff::sensor::measure(state.position, *at), range_rate_m_s: None }).collect())
            }).collect();
            // One UAV reports an invalid state for a while, which counts as silence.
            let mut reported = states.clone();
            if let Some(state) = reported.get_mut(silent as usize).filter(|_| (30..50).contains(&tick)) {
                state.speed_m_s = f64::NAN;
            }
            let observed = observe_all(&mut fleet, now, &reported, &scans, &cues);
            fleet.decide(&observed[0]);
            let team_state = fleet.team_state().clone();
            let team = team_state.assignments.len();
            let live = team_state.tracks().iter().filter(|known| !known.track.is_lost()).count();
            let team_max = team.max(uavs as usize);
            let groups_max = if by_need { team_max.min(live) } else { group_count(team_max, live) };
            prop_assert!(team_state.groups.len() <= groups_max, "{team_state:?}");
            prop_assert!(live == 0 || !team_state.groups.is_empty());
            for known in team_state.tracks() {
                for group in known.membership.groups() {
                    prop_assert!(team_state.group(group).is_some());
                    prop_assert!(!known.track.is_lost());
                }
            }
            for (index, group) in team_state.groups.iter().enumerate() {
                prop_assert!(group.members > 0 && group.spread().rate_m_s.is_finite() && group.standoff.distance_m.is_finite() && group.margin_m().is_finite());
                prop_assert!((250.0..=700.0).contains(&group.standoff.distance_m));
                let others = &team_state.groups[..index];
                prop_assert!(others.iter().all(|other| (other.altitude_m - group.altitude_m).abs() > 49.0));
                let is_served = team_state.assignments.iter().any(|assignment| assignment.group == group.id);
                prop_assert!(team == 0 || is_served, "a group without UAVs: {team_state:?}");
                let is_member = |known: &&GroupedTrack| known.membership.groups().any(|id| id == group.id);
                let members = team_state.tracks().iter().filter(is_member).count();
                prop_assert_eq!(members, group.members as usize);
            }
            for (id, state) in states.iter_mut().enumerate() {
                let step = fleet.decide(&observed[id]);
                let command = step.command;
                prop_assert!((25.0..=55.0).contains(&command.speed_m_s) && command.turn_rate_rad_s.abs() <= 0.3);
                let mut assigned = team_state.assignments.iter().map(|assignment| assignment.uav);
                let is_assigned = !team_state.groups.is_empty() && assigned.any(|uav| uav == UavId(id as u32));
                prop_assert_eq!(step.diagnostics.group.is_some(), is_assigned && reported[id].is_finite());
                pointing_target[id] = step.pointing_target;
                *state = params.uav.response(Duration::from_s(0.5)).step(state, command);
                prop_assert!(state.is_finite());
            }
        }
    }
}

/// A convoy disappears for 15 s and reappears a little further on. Without targets, the UAVs circle around the position
/// where it was lost, point their sensors there, and reacquire it.
#[test]
fn targets_that_reappear_where_they_were_lost_are_reacquired() {
    let mut team = Team::new(2, 4).with_motion(|id, now| {
        let position = Position::from_m(20.0 * f64::from(id) + 2.0 * now.s(), 10.0 * f64::from(id % 2));
        Some((position, Velocity::from_m_s(2.0, 0.0))).filter(|_| !(30.0..45.0).contains(&now.s()))
    });
    let lost = |team: &Team| team.agents[0].team_state().tracks().iter().filter(|known| known.track.is_lost()).count();
    for tick in 0..90 {
        team.tick(tick);
    }
    assert_eq!((lost(&team), team.agents[0].team_state().groups.len()), (4, 0));
    for tick in 90..120 {
        team.tick(tick);
    }
    assert_eq!((lost(&team), team.agents[0].team_state().groups.len()), (0, 1));
}

/// Every teammate that times out or joins has an event, also if no teammate is left in between.
#[test]
fn teammates_that_leave_and_join_have_events() {
    let mut team = Team::new(3, 2);
    let mut uav_events = Vec::new();
    for tick in 0..60 {
        // The team state of UAV 0 is checked; the other UAVs are silent for a while.
        team.silent = if (20..40).contains(&tick) { vec![UavId(1), UavId(2)] } else { Vec::new() };
        let (now, scans, inbox) = team.speak(tick);
        let own = team.states[0];
        step(&mut team.agents[0], now, &own, scan_of(&scans[0]), &inbox);
        let events = &team.agents[0].team_state().events;
        let of_uavs = events.iter().filter(|event| matches!(event.kind, EventKind::UavTimeout | EventKind::UavJoined));
        uav_events.extend(of_uavs.map(|event| (tick, event.kind.name(), event.uav)));
        team.tick(tick);
    }
    let (one, two) = (Some(UavId(1)), Some(UavId(2)));
    let expected =
        [(26, "uav-timeout", one), (26, "uav-timeout", two), (40, "uav-joined", one), (40, "uav-joined", two)];
    assert_eq!(uav_events, expected);
}

/// A group that admits many targets gets a UAV from a small group.
#[test]
fn uavs_are_reassigned_when_a_group_doubles() {
    let mut team = Team::new(3, 19).with_motion(|id, now| {
        let (east_m, from_s) = match id {
            0..4 => (0.0, 0.0),
            4..7 => (1200.0, 0.0),
            _ => (1200.0, 20.0),
        };
        let position = Position::from_m(east_m + 15.0 * f64::from(id % 4), 20.0 * f64::from(id / 4));
        Some((position, Velocity::ZERO)).filter(|_| now.s() >= from_s)
    });
    let assigned = |team: &Team, group: u32| {
        let team_state = team.agents[0].team_state();
        team_state
            .assignments
            .iter()
            .filter(|assignment| team_state.group_number(assignment.group) == Some(group))
            .count()
    };
    for tick in 0..38 {
        team.tick(tick);
    }
    assert_eq!((assigned(&team, 0), assigned(&team, 1)), (2, 1));
    for tick in 38..60 {
        team.tick(tick);
    }
    assert_eq!((assigned(&team, 0), assigned(&team, 1)), (1, 2));
}

/// Three cars that diverge, disappear for 20 s, and reappear at other positions.
fn gone_for_a_while(id: u32, now: Time) -> Option<(Position, Velocity)> {
    let velocity = Velocity::from_polar(7.0, Angle::from_deg(120.0 * f64::from(id)));
    let position = Position::ORIGIN + velocity * now.s();
    Some((position, velocity)).filter(|_| !(30.0..50.0).contains(&now.s()))
}

/// When all three cars are lost, each of three UAVs searches for another one, identically in all agents and in a fleet,
/// bit for bit. A UAV that has found its car is assigned to its group, and no UAV searches and is assigned at the same
/// time.
#[test]
fn each_uav_searches_for_another_lost_target() {
    let mut params = TeamParams::paper();
    (params.group.count, params.group.search_lost_targets) = (GroupCount::AsNeeded, true);
    let mut team = Team::new(3, 3).with_motion(gone_for_a_while);
    team.agents = (0..3).map(|id| Agent::new(UavId(id), params).unwrap()).collect();
    let mut fleet = TeamAgent::new(params).unwrap();
    let mut events = BTreeSet::new();
    for tick in 0..200 {
        let (now, scans, inbox) = team.speak(tick);
        let observed = observe_all(&mut fleet, now, &team.states, &scans, &inbox);
        for (index, one) in observed.iter().enumerate() {
            let alone = step(&mut team.agents[index], now, &team.states[index], scan_of(&scans[index]), &inbox);
            let together = fleet.decide(one);
            assert_eq!(
                (alone.command, alone.pointing_target),
                (together.command, together.pointing_target),
                "tick {tick}"
            );
            assert_eq!(
                format!("{:?}", team.agents[index].team_state()),
                format!("{:?}", fleet.team_state()),
                "tick {tick}"
            );
        }
        let team_state = fleet.team_state();
        let searched: BTreeSet<TrackId> =
            team_state.search_assignments.iter().map(|assignment| assignment.track).collect();
        assert_eq!(searched.len(), team_state.search_assignments.len(), "two UAVs search for the same target");
        let mut busy: Vec<UavId> = team_state.assignments.iter().map(|assignment| assignment.uav).collect();
        busy.extend(team_state.search_assignments.iter().map(|assignment| assignment.uav));
        busy.sort_unstable_by_key(|uav| uav.0);
        assert_eq!(busy, [UavId(0), UavId(1), UavId(2)], "tick {tick}");
        for group in &team_state.groups {
            assert!(
                team_state.assignments.iter().any(|assignment| assignment.group == group.id),
                "no UAV is assigned to {:?}",
                group.id
            );
        }
        events.extend(team_state.events.iter().map(|event| (event.kind.name(), event.kind.cause())));
        if tick == 99 {
            assert_eq!((team_state.groups.len(), searched.len()), (0, 3), "not all targets are lost");
        }
        team.tick(tick);
    }
    assert!(events.contains(&("search-started", None)), "{events:?}");
    assert!(events.contains(&("search-ended", Some("found"))), "{events:?}");
    let team_state = team.agents[0].team_state();
    assert!(
        team_state.search_assignments.is_empty() && team_state.tracks().iter().all(|known| !known.track.is_lost()),
        "{team_state:?}"
    );
}

/// A custom assignment law that always returns the same assignment: pairs of a UAV and the index of its candidate
/// group.
#[derive(Debug)]
struct Fixed(Option<Vec<(u32, usize)>>);

impl AssignmentLaw for Fixed {
    fn assign(&self, _: Time, uavs: &[AvailableUav], sites: &[CandidateGroup<'_>]) -> Option<Vec<Assignment>> {
        assert!(uavs.is_sorted_by_key(|uav| uav.uav) && sites.is_sorted_by_key(|site| site.group));
        // An index out of range gives a group that does not exist.
        let group = |site: usize| sites.get(site).map_or(GroupId(site as u64), |site| site.group);
        let assignments = self.0.as_ref()?.iter();
        Some(assignments.map(|(uav, site)| Assignment { uav: UavId(*uav), group: group(*site) }).collect())
    }
}

/// Assignments after 30 s with or without a custom assignment law, and the UAVs that it has reassigned.
fn assigned_uavs_under(law: Option<Fixed>) -> (Vec<(u32, Option<u32>)>, Vec<u32>) {
    let mut team = Team::new(4, 6).with_motion(two_groups);
    let fleet = TeamAgent::new(TeamParams::paper()).expect("the paper's parameters are in range");
    let mut fleet = match law {
        Some(law) => fleet.with_assignment_law(std::sync::Arc::new(law)),
        None => fleet,
    };
    let mut moved = Vec::new();
    for tick in 0..60 {
        let (now, scans, inbox) = team.speak(tick);
        let observed = observe_all(&mut fleet, now, &team.states, &scans, &inbox);
        for observation in &observed {
            let _ = fleet.decide(observation);
        }
        let events = fleet.team_state().events.iter();
        moved.extend(events.filter(|event| event.kind.cause() == Some("custom-law")).filter_map(|event| event.uav));
        team.tick(tick);
    }
    let team_state = fleet.team_state();
    let assigned_uavs = team_state
        .assignments
        .iter()
        .map(|assignment| (assignment.uav.0, team_state.group_number(assignment.group)))
        .collect();
    (assigned_uavs, moved.into_iter().map(|uav| uav.0).collect())
}

/// The result of a custom law is applied to existing UAVs and groups, at most once per UAV; a UAV without a group in
/// the result is not assigned. If the law returns `None`, the default assignment is used, bit for bit.
#[test]
fn an_assignment_law_is_applied_to_existing_uavs_and_groups() {
    let (ours, moved) = assigned_uavs_under(None);
    assert_eq!((ours.len(), &moved[..]), (4, &[][..]));
    assert_eq!(assigned_uavs_under(Some(Fixed(None))), (ours, moved));
    let (assigned_uavs, _) = assigned_uavs_under(Some(Fixed(Some(vec![(3, 0), (0, 1), (9, 0), (1, 7), (0, 0)]))));
    assert_eq!(assigned_uavs, [(0, Some(1)), (3, Some(0))]);
}
