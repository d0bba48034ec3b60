//! Converts the truth to rows of the record.

use standoff::Time;
use standoff_record::{Frame, IntruderRow, TruthRow};

use crate::intruders::Intruder;
use crate::world::Truth;

/// Starts the frame of a time step: fills in the truth and empties all other tables.
pub(crate) fn begin(now: Time, truth: &[Truth], frame: &mut Frame) {
    let Frame { time_us, uavs, truth: rows, tracks, tentative, groups, detections, events, intruders, agents } = frame;
    *time_us = now.us();
    uavs.clear();
    rows.clear();
    tracks.clear();
    tentative.clear();
    groups.clear();
    detections.clear();
    events.clear();
    intruders.clear();
    agents.clear();
    rows.extend(truth.iter().map(|target| {
        let (position, velocity) = (target.state.position(), target.state.velocity());
        let [ax, ay] = target.state.acceleration_m_s2();
        TruthRow {
            target: target.target.0,
            x_m: position.x_m(),
            y_m: position.y_m(),
            vx_m_s: velocity.x_m_s(),
            vy_m_s: velocity.y_m_s(),
            ax_m_s2: target.has_known_acceleration.then_some(ax),
            ay_m_s2: target.has_known_acceleration.then_some(ay),
        }
    }));
}

pub(crate) fn intruder(number: u32, intruder: &Intruder, now: Time) -> IntruderRow {
    let state = &intruder.truth;
    IntruderRow {
        intruder: number,
        x_m: state.position.x_m(),
        y_m: state.position.y_m(),
        heading_rad: state.heading.rad(),
        speed_m_s: state.speed_m_s,
        altitude_m: state.vertical.map(|vertical| vertical.altitude_m),
        transponder_on: intruder.reports(now),
    }
}
