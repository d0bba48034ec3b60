use super::*;
use crate::angle::Angle;
use crate::frame::Position;
use crate::group_id::GroupId;
use crate::message::{Cue, Report};
use crate::step_messages::ReportView;
use crate::uav::UavState;

/// After a partition in which both halves reassigned, each UAV would otherwise switch to the group that it believes the
/// other half has left.
#[test]
fn assignment_starts_from_the_reported_assignments() {
    let mut params = TeamParams::paper();
    params.group.assignment_switching_cost = 10.0;
    let mut updater = TeamStateUpdater::new(params).unwrap();
    let at = |step: i64| Time::from_us(step * 500_000);
    let state = UavState::level_flight(Position::ORIGIN, Angle::ZERO, 40.0);
    let row = |step: i64, uavs: u32, assignment: &dyn Fn(u32) -> Option<GroupId>| {
        let mut row = StepMessages::default();
        row.open(at(step));
        for uav in 0..uavs {
            let report =
                Report { assigned_group: assignment(uav), ..Report::position_only(UavId(uav), at(step), state) };
            row.put(ReportView::of(&report), f64::INFINITY);
        }
        for number in (0..4).filter(|_| step == 0) {
            // Both groups look the same from the middle.
            let x_m = if number < 2 { -900.0 } else { 900.0 };
            let position = Position::from_m(x_m, 40.0 * f64::from(number % 2) - 20.0);
            let (issued_at, time) = (at(0), at(0));
            row.put_cue(&Cue { sequence: number, issued_at, time, ..Cue::at(u32::from(number), position) });
        }
        row
    };
    let [mut first, mut second] = [TeamState::default(), TeamState::default()];
    updater.advance(&TeamState::default(), Duration::ZERO, &row(0, 4, &|_| None), &mut first);
    let assigned: Vec<GroupId> = first.assignments.iter().map(|assignment| assignment.group).collect();
    let [one, other] = [first.groups[0].id, first.groups[1].id];
    assert_eq!(assigned, [one, one, other, other]);
    // A fifth UAV joins, with an unknown group: all UAVs are reassigned. The other UAVs report the opposite assignment.
    let reported = |uav: u32| Some([other, other, one, one, GroupId(7)][uav as usize]);
    updater.advance(&first, Duration::from_s(0.5), &row(1, 5, &reported), &mut second);
    let assigned: Vec<GroupId> = second.assignments.iter().map(|assignment| assignment.group).take(4).collect();
    assert_eq!(assigned, [other, other, one, one]);
}
