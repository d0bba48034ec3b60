//! How many of a run's events are told one by one: tables hold any number of them, for few bytes.

use crate::frame::EventRow;

/// Most events told of a run: more than a person reads or a page lists. Eleven vehicles in city traffic give ten a minute.
const MOST: usize = 50_000;
/// Most text of theirs, bytes.
const MOST_BYTES: usize = 8 << 20;

/// What is left of what may be told of a run's events: the first ones are, until it is used up.
#[derive(Debug, Clone)]
pub struct EventAllowance {
    events: usize,
    bytes: usize,
    left_out: u64,
}

impl Default for EventAllowance {
    fn default() -> Self {
        Self { events: MOST, bytes: MOST_BYTES, left_out: 0 }
    }
}

impl EventAllowance {
    /// Whether the next event is to be told, with its target's name if that is told, too. After one that is not, none is.
    pub fn takes(&mut self, event: &EventRow, name: Option<&str>) -> bool {
        if self.events == 0 || self.left_out > 0 {
            self.left_out += 1;
            return false;
        }
        // A number of a list has some digits, and may get a line.
        let bytes = event.kind.len() + event.why().len() + name.map_or(0, str::len) + 16 * event.uavs.len();
        let left = self.bytes.checked_sub(bytes);
        match left {
            Some(left) => (self.events, self.bytes) = (self.events - 1, left),
            None => self.left_out += 1,
        }
        left.is_some()
    }

    /// How many events were not told.
    #[must_use]
    pub fn left_out(&self) -> u64 {
        self.left_out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(event: &EventRow, of: u64) -> (u64, u64) {
        let mut allowance = EventAllowance::default();
        let told = (0..of).filter(|_| allowance.takes(event, Some("x"))).count() as u64;
        (told, allowance.left_out())
    }

    #[test]
    fn the_first_events_are_told_and_the_others_counted() {
        let event = EventRow {
            kind: "lost".to_owned(),
            uavs: vec![0, 1],
            reason: "not seen".to_owned(),
            ..EventRow::default()
        };
        assert_eq!(told(&event, 50_000), (50_000, 0));
        assert_eq!(told(&event, 60_000), (50_000, 10_000));
        // 1,048 bytes each, with the name.
        let long = EventRow { reason: "x".repeat(1011), ..event };
        assert_eq!(told(&long, 8_005), (8_004, 1));
    }

    #[test]
    fn after_one_that_is_left_out_none_is_told() {
        let event = |bytes: usize| EventRow { reason: "x".repeat(bytes), ..EventRow::default() };
        let mut allowance = EventAllowance::default();
        assert!(
            allowance.takes(&event(MOST_BYTES - 1), None)
                && !allowance.takes(&event(2), None)
                && !allowance.takes(&event(1), None)
        );
        assert_eq!(allowance.left_out(), 2);
    }
}
