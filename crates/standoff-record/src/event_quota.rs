//! Limit on the number of events that are listed: a small file may contain any number of them.

use crate::frame::EventRow;

/// Maximum number of listed events. Eleven vehicles in city traffic give ten events per minute, so this is more than
/// anyone reads.
const MAX_EVENTS: usize = 50_000;
/// Maximum text size of the listed events, bytes.
const MAX_TEXT_BYTES: usize = 8 << 20;

/// Remaining quota of listed events: events are listed in order until the quota is used up.
#[derive(Debug, Clone)]
pub struct EventQuota {
    events: usize,
    bytes: usize,
    left_out: u64,
}

impl Default for EventQuota {
    fn default() -> Self {
        Self { events: MAX_EVENTS, bytes: MAX_TEXT_BYTES, left_out: 0 }
    }
}

impl EventQuota {
    /// Returns true if the next event is to be listed, with the name of its target if given. After the first omitted
    /// event, all others are omitted.
    pub fn takes(&mut self, event: &EventRow, name: Option<&str>) -> bool {
        if self.events == 0 || self.left_out > 0 {
            self.left_out += 1;
            return false;
        }
        // A number in a list has up to 16 characters, and may get its own line.
        let bytes = event.kind.len() + event.reason_text().len() + name.map_or(0, str::len) + 16 * event.uavs.len();
        let left = self.bytes.checked_sub(bytes);
        match left {
            Some(left) => (self.events, self.bytes) = (self.events - 1, left),
            None => self.left_out += 1,
        }
        left.is_some()
    }

    /// Returns the number of omitted events.
    #[must_use]
    pub fn left_out(&self) -> u64 {
        self.left_out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(event: &EventRow, of: u64) -> (u64, u64) {
        let mut allowance = EventQuota::default();
        let listed = (0..of).filter(|_| allowance.takes(event, Some("x"))).count() as u64;
        (listed, allowance.left_out())
    }

    #[test]
    fn first_events_are_listed_and_others_counted() {
        let event = EventRow {
            kind: "lost".to_owned(),
            uavs: vec![0, 1],
            reason: "not seen".to_owned(),
            ..EventRow::default()
        };
        assert_eq!(listed(&event, 50_000), (50_000, 0));
        assert_eq!(listed(&event, 60_000), (50_000, 10_000));
        // 1,048 bytes each, with the name.
        let long = EventRow { reason: "x".repeat(1011), ..event };
        assert_eq!(listed(&long, 8_005), (8_004, 1));
    }

    #[test]
    fn no_event_is_listed_after_an_omitted_one() {
        let event = |bytes: usize| EventRow { reason: "x".repeat(bytes), ..EventRow::default() };
        let mut allowance = EventQuota::default();
        assert!(
            allowance.takes(&event(MAX_TEXT_BYTES - 1), None)
                && !allowance.takes(&event(2), None)
                && !allowance.takes(&event(1), None)
        );
        assert_eq!(allowance.left_out(), 2);
    }
}
