use super::*;
use crate::coordination::handoff::Handoff;
use crate::coordination::memberships::Membership;
use crate::{Cue, Fleet, Message, TargetLabel, UavState, Velocity};

/// What two UAVs know of three targets that were handed over.
fn known() -> Picture {
    let mut fleet = Fleet::new(TeamParams::table_1()).unwrap();
    let state = UavState::straight(Position::ORIGIN, Angle::ZERO, 40.0);
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

/// Of a number that no team has nothing overflows.
#[test]
fn a_group_that_had_members_without_number_has_changed() {
    let mut picture = known();
    assert!(!picture.groups[0].has_changed());
    picture.groups[0].members_when_assigned = u32::MAX;
    assert!(picture.make_whole(&TeamParams::table_1()) && picture.groups[0].has_changed());
}

/// Two halves that have assigned anew apart from one another would, each by what it believes, both fly to the other's group.
#[test]
fn an_assignment_begins_from_what_each_says_that_it_does() {
    let mut params = TeamParams::table_1();
    params.group.assignment_inertia = 10.0;
    let mut fold = crate::fold::Fold::new(params).unwrap();
    let at = |instant: i64| Time::from_us(instant * 500_000);
    let state = UavState::straight(Position::ORIGIN, Angle::ZERO, 40.0);
    let row = |instant: i64, uavs: u32, duty: &dyn Fn(u32) -> Option<GroupId>| {
        let mut row = Row::default();
        row.open(at(instant));
        for uav in 0..uavs {
            let report = Report { duty: duty(uav), ..Report::of(UavId(uav), at(instant), state) };
            row.put(crate::row::Said::of(&report));
        }
        for number in (0..4).filter(|_| instant == 0) {
            // Both groups are alike, seen from the middle.
            let x_m = if number < 2 { -900.0 } else { 900.0 };
            let position = Position::from_m(x_m, 40.0 * f64::from(number % 2) - 20.0);
            let (said, searcher, label) = (at(0), 0, TargetLabel(u32::from(number)));
            let (velocity, position_sd_m, velocity_sd_m_s) = (Velocity::ZERO, 20.0, 2.0);
            row.put_cue(&Cue {
                searcher,
                said,
                number,
                label,
                time: said,
                position,
                velocity,
                position_sd_m,
                velocity_sd_m_s,
            });
        }
        row
    };
    let [mut first, mut second] = [Picture::default(), Picture::default()];
    fold.follow(&Picture::default(), Duration::ZERO, &row(0, 4, &|_| None), &mut first);
    let served: Vec<GroupId> = first.crew.iter().map(|duty| duty.group).collect();
    let [one, other] = [first.groups[0].id, first.groups[1].id];
    assert_eq!(served, [one, one, other, other]);
    // A fifth UAV comes, with a group that nobody knows: all are assigned anew. The others say that they do the opposite.
    let says = |uav: u32| Some([other, other, one, one, GroupId(7)][uav as usize]);
    fold.follow(&first, Duration::from_s(0.5), &row(1, 5, &says), &mut second);
    let served: Vec<GroupId> = second.crew.iter().map(|duty| duty.group).take(4).collect();
    assert_eq!(served, [other, other, one, one]);
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
