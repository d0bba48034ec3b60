use super::*;
use crate::coordination::handoff::Handoff;
use crate::coordination::memberships::Membership;
use crate::{Cue, Fleet, Message, TargetLabel, UavState, Velocity};

/// What two UAVs know of three targets that were handed over.
fn known() -> Picture {
    let mut fleet = Fleet::new(TeamParams::table_1()).unwrap();
    let state = UavState { position: Position::ORIGIN, heading: Angle::ZERO, speed_m_s: 40.0, turn_rate_rad_s: 0.0 };
    let observed = [0, 1].map(|uav| fleet.observe(Time::START, UavId(uav), &state, Some(Default::default())));
    for number in 0..3 {
        let (said, time, searcher, label) = (Time::START, Time::START, 0, TargetLabel(u32::from(number)));
        let (position, velocity) = (Position::from_m(300.0, 0.0), Velocity::ZERO);
        let (position_sd_m, velocity_sd_m_s) = (20.0, 2.0);
        let cue = Cue { searcher, said, number, label, time, position, velocity, position_sd_m, velocity_sd_m_s };
        fleet.hear(&observed[0], &Message::Cue(cue));
    }
    let _ = fleet.decide(&observed[0]);
    fleet.picture().clone()
}

/// A picture that would hold for ever what is of a moment: who is long gone, or far beyond the Earth, a dwell or a bar that
/// does not end, no id left.
#[test]
fn a_picture_that_tells_of_what_cannot_be_is_none() {
    let lies: [fn(&mut Picture); 9] = [
        |picture| picture.team[0].said.position = Position::from_m(1e300, 0.0),
        |picture| picture.team[0].said_at = Time::from_us(1),
        |picture| _ = picture.memberships.new_group(Time::from_us(10_000_000), [0].into_iter()),
        |picture| _ = picture.memberships.new_group(Time::from_us(i64::MAX), [0].into_iter()),
        |picture| picture.memberships.bar(0, picture.groups[0].id, Time::from_us(30_000_001)),
        |picture| {
            let (from, to, requested_at) = (None, picture.groups[0].id, Time::from_us(1));
            picture.memberships.set(0, Membership::Dwell(Handoff { from, to, requested_at, dwell: Duration::ZERO }));
        },
        |picture| {
            let params = TeamParams::table_1().track;
            let before = *picture.memberships.track_mut(0);
            picture.memberships.track_mut(0).update(&before, None, Duration::from_us(-1), |_, _| true, &params);
        },
        |picture| picture.agenda = Agenda::reviewed_next(Time::from_us(30_000_001)),
        |picture| {
            let place = Position::from_m(300.0, 0.0);
            let seen = [(Position::ORIGIN, crate::sensor::measure(Position::ORIGIN, place))];
            for label in 3..=TARGETS_MAX as u32 {
                let track = Track::from_measurements(TargetLabel(label), seen, &TeamParams::table_1().track);
                picture.memberships.start(track.unwrap());
            }
        },
    ];
    let params = TeamParams::table_1();
    assert!(known().make_whole(&params) && !known().groups.is_empty());
    let bars_in_time = |picture: &mut Picture| picture.memberships.bar(0, GroupId(7), Time::from_us(30_000_000));
    let mut picture = known();
    bars_in_time(&mut picture);
    assert!(picture.make_whole(&params));
    for (which, lie) in lies.into_iter().enumerate() {
        let mut picture = known();
        lie(&mut picture);
        assert!(!picture.make_whole(&params), "{which}");
    }
}
