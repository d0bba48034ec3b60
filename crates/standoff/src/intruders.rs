//! Aircraft that are not of the team, as one UAV, or a fleet, has heard of them.

use crate::guidance::separation::Other;
use crate::message::Traffic;
use crate::step::{Refused, count};
use crate::time::{Duration, Time};
use crate::uav::Aircraft;

/// So many are kept in mind: where there are more, those heard last are.
const KEPT_MAX: usize = 100;

/// Who has told nothing for longer than this may be anywhere.
const FORGOTTEN_AFTER: Duration = Duration::from_us(30_000_000);

/// Clocks differ: what is told of a time further ahead than this is told by a wrong one.
const AHEAD_MAX: Duration = Duration::from_us(1_000_000);

/// What each of them told last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Intruders {
    last: Vec<Traffic>,
}

impl Intruders {
    /// Takes in what an aircraft tells. What is older than what it told last changes nothing, whenever it comes.
    pub(crate) fn hear(&mut self, traffic: &Traffic, now: Time, refused: &mut Refused) {
        self.last.retain(|known| now - known.time <= FORGOTTEN_AFTER);
        if !traffic.state.is_sound() {
            return count(&mut refused.nonsense);
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
        if self.last.len() >= KEPT_MAX {
            let oldest = (0..self.last.len()).min_by_key(|place| self.last[*place].time);
            match oldest.filter(|place| self.last[*place].time < traffic.time) {
                Some(oldest) => self.last.remove(oldest),
                None => return count(&mut refused.nonsense),
            };
        }
        self.last.push(*traffic);
    }

    /// Those that are to be kept away from, at an instant.
    pub(crate) fn others(&self, now: Time) -> impl Iterator<Item = Other> + Clone {
        let told = self.last.iter().filter(move |told| now - told.time <= FORGOTTEN_AFTER);
        told.map(move |told| Other {
            aircraft: Aircraft::Intruder(told.aircraft),
            said: told.state,
            age_s: (now - told.time).s().max(0.0),
        })
    }

    pub(crate) fn clear(&mut self) {
        self.last.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::Angle;
    use crate::frame::Position;
    use crate::uav::UavState;

    fn told(aircraft: u32, at_s: f64, x_m: f64) -> Traffic {
        let state = UavState::straight(Position::from_m(x_m, 0.0), Angle::ZERO, 40.0);
        Traffic { aircraft, time: Time::from_us((at_s * 1e6) as i64), state }
    }

    /// The aircraft that are known at a time, where they were, and how long ago.
    fn known(intruders: &Intruders, now_s: f64) -> Vec<(Aircraft, f64, f64)> {
        let others = intruders.others(Time::from_us((now_s * 1e6) as i64));
        others.map(|other| (other.aircraft, other.said.position.x_m(), other.age_s)).collect()
    }

    #[test]
    fn the_newest_of_each_counts_whatever_order_it_comes_in_for_half_a_minute() {
        let (mut intruders, mut refused) = (Intruders::default(), Refused::NONE);
        let now = Time::from_us(12_000_000);
        for traffic in [told(7, 10.0, 100.0), told(9, 11.0, 5.0), told(7, 12.0, 180.0), told(7, 11.0, 140.0)] {
            intruders.hear(&traffic, now, &mut refused);
        }
        let both = [(Aircraft::Intruder(7), 180.0, 0.0), (Aircraft::Intruder(9), 5.0, 1.0)];
        assert_eq!((known(&intruders, 12.0), refused), (both.to_vec(), Refused::NONE));
        assert_eq!(known(&intruders, 41.5), [(Aircraft::Intruder(7), 180.0, 29.5)]);
        assert_eq!(known(&intruders, 42.5), []);
    }

    #[test]
    fn what_makes_no_sense_or_is_of_another_time_is_refused_and_counted() {
        let (mut intruders, mut refused) = (Intruders::default(), Refused::NONE);
        let now = Time::from_us(100_000_000);
        let mut hear = |traffic| {
            intruders.hear(&traffic, now, &mut refused);
            (refused.nonsense, refused.off_grid, refused.late, known(&intruders, 100.0).len())
        };
        assert_eq!(hear(told(1, 100.0, f64::NAN)), (1, 0, 0, 0));
        assert_eq!(hear(told(1, 100.0, 2e8)), (2, 0, 0, 0));
        assert_eq!(hear(told(1, 101.1, 0.0)), (2, 1, 0, 0));
        assert_eq!(hear(told(1, 69.9, 0.0)), (2, 1, 1, 0));
        // A clock may be ahead a little.
        assert_eq!(hear(told(1, 100.9, 0.0)), (2, 1, 1, 1));
    }

    /// Whoever speaks under ever new names takes no more room than that.
    #[test]
    fn of_too_many_those_heard_last_are_kept() {
        let (mut intruders, mut refused) = (Intruders::default(), Refused::NONE);
        for aircraft in 0..150 {
            let at_s = 0.1 * f64::from(aircraft);
            intruders.hear(&told(aircraft, at_s, 0.0), Time::from_us((at_s * 1e6) as i64), &mut refused);
        }
        let names: Vec<Aircraft> = known(&intruders, 15.0).into_iter().map(|(aircraft, ..)| aircraft).collect();
        assert_eq!(names, (50..150).map(Aircraft::Intruder).collect::<Vec<_>>());
        intruders.hear(&told(200, 1.0, 0.0), Time::from_us(15_000_000), &mut refused);
        assert_eq!((known(&intruders, 15.0).len(), refused.nonsense), (100, 1));
    }
}
