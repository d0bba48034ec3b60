use super::*;
use crate::coordination::dwell::Handoff;
use crate::coordination::memberships::Membership;
use crate::frame::Position;
use crate::{Angle, Cue, Message, TeamAgent, UavState};

/// Team state of two UAVs with three cued targets.
fn known() -> TeamState {
    let mut fleet = TeamAgent::new(TeamParams::paper()).unwrap();
    let state = UavState::level_flight(Position::ORIGIN, Angle::ZERO, 40.0);
    let observed = [0, 1].map(|uav| fleet.observe(Time::EPOCH, UavId(uav), &state, Some(Default::default())));
    for number in 0..3 {
        let cue = Cue { sequence: number, ..Cue::at(u32::from(number), Position::from_m(300.0, 0.0)) };
        fleet.receive(&observed[0], &Message::Cue(cue));
    }
    let _ = fleet.decide(&observed[0]);
    fleet.team_state().clone()
}

/// A number beyond every possible team causes no overflow.
#[test]
fn a_group_with_an_impossible_member_count_has_changed() {
    let mut team_state = known();
    assert!(!team_state.groups[0].has_changed());
    team_state.groups[0].members_when_assigned = u32::MAX;
    assert!(team_state.rebuild_index(&TeamParams::paper()) && team_state.groups[0].has_changed());
}

/// Invalid states whose content would never expire: members that left long ago or are far beyond the Earth, a dwell or
/// a block without end, no group id left.
#[test]
fn impossible_team_states_are_rejected() {
    let corruptions: [fn(&mut TeamState); 9] = [
        |team_state| team_state.teammates[0].last_report.position = Position::from_m(1e300, 0.0),
        |team_state| team_state.teammates[0].last_report_at = Time::from_us(1),
        |team_state| _ = team_state.memberships.new_group(Time::from_us(10_000_000), [0].into_iter()),
        |team_state| _ = team_state.memberships.new_group(Time::from_us(i64::MAX), [0].into_iter()),
        |team_state| team_state.memberships.block(0, team_state.groups[0].id, Time::from_us(30_000_001)),
        |team_state| {
            let (from, to, requested_at) = (None, team_state.groups[0].id, Time::from_us(1));
            team_state
                .memberships
                .set(0, Membership::InHandoff(Handoff { from, to, requested_at, dwell: Duration::ZERO }));
        },
        |team_state| {
            let params = TeamParams::paper().track;
            let before = *team_state.memberships.track_mut(0);
            team_state.memberships.track_mut(0).update(&before, None, Duration::from_us(-1), |_, _| true, &params);
        },
        |team_state| team_state.grouping_state = GroupingState::next_regrouping(Time::from_us(30_000_001)),
        |team_state| {
            let position = Position::from_m(300.0, 0.0);
            let measurements = [(Position::ORIGIN, crate::sensor::measure(Position::ORIGIN, position))];
            for label in 3..=TARGETS_MAX as u32 {
                let track =
                    Track::from_measurements(TargetLabel(label).into(), measurements, &TeamParams::paper().track);
                team_state.memberships.start(track.unwrap());
            }
        },
    ];
    let params = TeamParams::paper();
    assert!(known().rebuild_index(&params) && !known().groups.is_empty());
    let block_in_time =
        |team_state: &mut TeamState| team_state.memberships.block(0, GroupId(7), Time::from_us(30_000_000));
    let mut team_state = known();
    block_in_time(&mut team_state);
    assert!(team_state.rebuild_index(&params));
    for (index, corrupt) in corruptions.into_iter().enumerate() {
        let mut team_state = known();
        corrupt(&mut team_state);
        assert!(!team_state.rebuild_index(&params), "{index}");
    }
}
