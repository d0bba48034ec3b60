//! Intruders: aircraft outside the team, from the traffic messages that one UAV, or a whole team, has received.

use crate::message::TrafficReport;
use crate::output::{Rejected, count};
use crate::safety::motion::Motion;
use crate::safety::other_aircraft::OtherAircraft;
use crate::time::{Duration, Time};
use crate::uav::{Aircraft, UavState};

/// Maximum number of intruders kept; if there are more, those that can meet a UAV soonest stay.
const KEPT_MAX: usize = 100;

/// Age at which a report is forgotten, because the aircraft may be anywhere by then.
const FORGOTTEN_AFTER: Duration = Duration::from_us(30_000_000);

/// Maximum lead of a report's time over the agent's clock; a report further ahead comes from a wrong clock.
const AHEAD_MAX: Duration = Duration::from_us(1_000_000);

/// Last report of each intruder.
#[derive(Debug, Clone, Default)]
pub(crate) struct Intruders {
    last: Vec<TrafficReport>,
}

impl Intruders {
    /// Processes a traffic message. A message older than the aircraft's last one changes nothing. `uavs` are the states of
    /// the UAVs that avoid the intruders.
    pub(crate) fn receive<'a>(
        &mut self,
        traffic: &TrafficReport,
        now: Time,
        uavs: impl Iterator<Item = &'a UavState> + Clone,
        refused: &mut Rejected,
    ) {
        self.last.retain(|known| now - known.time <= FORGOTTEN_AFTER);
        if !traffic.state.is_valid() {
            return count(&mut refused.malformed);
        }
        if traffic.time - now > AHEAD_MAX {
            return count(&mut refused.off_grid);
        }
        if now - traffic.time > FORGOTTEN_AFTER {
            return count(&mut refused.late);
        }
        if let Some(known) = self.last.iter_mut().find(|known| known.aircraft == traffic.aircraft) {
            if known.time < traffic.time {
                *known = *traffic;
            }
            return;
        }
        self.last.push(*traffic);
        if self.last.len() > KEPT_MAX {
            let meets_s = |place: &usize| earliest_meeting_s(&self.last[*place], now, uavs.clone());
            let latest = (0..self.last.len()).max_by(|a, b| meets_s(a).total_cmp(&meets_s(b)));
            self.last.swap_remove(latest.unwrap_or_default());
            count(&mut refused.malformed);
        }
    }

    /// Intruders to avoid at time `now`.
    pub(crate) fn others(&self, now: Time) -> impl Iterator<Item = OtherAircraft> + Clone {
        let report = self.last.iter().filter(move |report| now - report.time <= FORGOTTEN_AFTER);
        report.map(move |report| OtherAircraft {
            aircraft: Aircraft::Intruder(report.aircraft),
            motion: Motion::steady_course(&report.state),
            age_s: (now - report.time).s().max(0.0),
            manoeuvre: None,
        })
    }

    pub(crate) fn clear(&mut self) {
        self.last.clear();
    }
}

/// Shortest time in which an intruder can meet one of the UAVs, s: if both fly straight towards each other.
fn earliest_meeting_s<'a>(intruder: &TrafficReport, now: Time, uavs: impl Iterator<Item = &'a UavState>) -> f64 {
    let TrafficReport { time, state, .. } = intruder;
    let meets_s = |uav: &UavState| {
        let closing_m_s = uav.speed_m_s.abs() + state.speed_m_s.abs();
        state.position.distance_m(uav.position) / closing_m_s.max(1.0)
    };
    uavs.filter(|uav| uav.is_finite()).map(meets_s).fold(f64::INFINITY, f64::min) - (now - *time).s()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::Angle;
    use crate::frame::Position;

    fn traffic_at(aircraft: u32, at_s: f64, x_m: f64) -> TrafficReport {
        let state = UavState::level_flight(Position::from_m(x_m, 0.0), Angle::ZERO, 40.0);
        TrafficReport { aircraft, time: Time::from_us((at_s * 1e6) as i64), state }
    }

    /// Known aircraft at a time, with their last positions and the ages of these.
    fn known(intruders: &Intruders, now_s: f64) -> Vec<(Aircraft, f64, f64)> {
        let others = intruders.others(Time::from_us((now_s * 1e6) as i64));
        others.map(|other| (other.aircraft, other.motion.state.position.x_m(), other.age_s)).collect()
    }

    #[test]
    fn the_newest_report_of_each_intruder_counts_for_30_s_in_any_order() {
        let (mut intruders, mut refused) = (Intruders::default(), Rejected::default());
        let now = Time::from_us(12_000_000);
        for traffic in [
            traffic_at(7, 10.0, 100.0),
            traffic_at(9, 11.0, 5.0),
            traffic_at(7, 12.0, 180.0),
            traffic_at(7, 11.0, 140.0),
        ] {
            intruders.receive(&traffic, now, [own()].iter(), &mut refused);
        }
        let both = [(Aircraft::Intruder(7), 180.0, 0.0), (Aircraft::Intruder(9), 5.0, 1.0)];
        assert_eq!((known(&intruders, 12.0), refused), (both.to_vec(), Rejected::default()));
        assert_eq!(known(&intruders, 41.5), [(Aircraft::Intruder(7), 180.0, 29.5)]);
        assert_eq!(known(&intruders, 42.5), []);
    }

    #[test]
    fn invalid_and_untimely_reports_are_rejected_and_counted() {
        let (mut intruders, mut refused) = (Intruders::default(), Rejected::default());
        let now = Time::from_us(100_000_000);
        let mut hear = |traffic| {
            intruders.receive(&traffic, now, [own()].iter(), &mut refused);
            (refused.malformed, refused.off_grid, refused.late, known(&intruders, 100.0).len())
        };
        assert_eq!(hear(traffic_at(1, 100.0, f64::NAN)), (1, 0, 0, 0));
        assert_eq!(hear(traffic_at(1, 100.0, 2e8)), (2, 0, 0, 0));
        assert_eq!(hear(traffic_at(1, 101.1, 0.0)), (2, 1, 0, 0));
        assert_eq!(hear(traffic_at(1, 69.9, 0.0)), (2, 1, 1, 0));
        // A clock may be slightly ahead.
        assert_eq!(hear(traffic_at(1, 100.9, 0.0)), (2, 1, 1, 1));
    }

    fn own() -> UavState {
        UavState::level_flight(Position::ORIGIN, Angle::ZERO, 40.0)
    }

    /// A sender that uses ever new ids cannot exceed the maximum, and does not displace a near intruder.
    #[test]
    fn at_the_limit_the_intruders_that_can_meet_a_uav_soonest_are_kept() {
        let (mut intruders, mut refused) = (Intruders::default(), Rejected::default());
        let mut hear = |aircraft, at_s: f64, x_m| {
            let now = Time::from_us((at_s * 1e6) as i64);
            intruders.receive(&traffic_at(aircraft, at_s, x_m), now, [own()].iter(), &mut refused);
        };
        hear(1000, 0.0, 300.0);
        for aircraft in 0..150 {
            hear(aircraft, 0.1 * f64::from(aircraft), 2000.0 + 100.0 * f64::from(aircraft));
        }
        hear(1001, 15.0, 400.0);
        let names: Vec<Aircraft> = known(&intruders, 15.0).into_iter().map(|(aircraft, ..)| aircraft).collect();
        assert_eq!((names.len(), refused.malformed), (100, 52));
        for near in (0..98).chain([1000, 1001]) {
            assert!(names.contains(&Aircraft::Intruder(near)), "{near}: {names:?}");
        }
    }

    /// With the same distance, an intruder whose report is older may be nearer now.
    #[test]
    fn an_older_report_counts_as_nearer() {
        let now = Time::from_us(10_000_000);
        let meets_s = |at_s| earliest_meeting_s(&traffic_at(0, at_s, 800.0), now, [own()].iter());
        assert_eq!((meets_s(10.0), meets_s(7.0)), (10.0, 7.0));
    }
}
