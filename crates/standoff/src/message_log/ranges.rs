//! Received entries of one source.

use crate::message::{MessageSource, ReceivedRange};

/// Set of numbers, stored as ascending ranges with gaps between them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Ranges(Vec<(i64, i64)>);

impl Ranges {
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// First and last number of each range.
    pub(crate) fn runs(&self) -> &[(i64, i64)] {
        &self.0
    }

    pub(crate) fn holds(&self, number: i64) -> bool {
        self.cover(number, number)
    }

    /// True if all numbers of a range are contained.
    pub(crate) fn cover(&self, from: i64, to: i64) -> bool {
        let covers = |run: &(i64, i64)| run.0 <= from && to <= run.1;
        // Usually the last range matches.
        self.0.last().is_some_and(covers) || self.0.get(self.0.partition_point(|run| run.1 < from)).is_some_and(covers)
    }

    pub(crate) fn add(&mut self, number: i64) {
        // Usually the number follows the last one.
        if let Some(last) = self.0.last_mut().filter(|last| last.1 + 1 == number) {
            last.1 = number;
            return;
        }
        let index = self.0.partition_point(|run| run.1 < number);
        if self.0.get(index).is_some_and(|run| run.0 <= number) {
            return;
        }
        let joins_last = index > 0 && self.0[index - 1].1 + 1 == number;
        let joins_next = self.0.get(index).is_some_and(|run| run.0 - 1 == number);
        match (joins_last, joins_next) {
            (true, true) => {
                self.0[index - 1].1 = self.0[index].1;
                self.0.remove(index);
            }
            (true, false) => self.0[index - 1].1 = number,
            (false, true) => self.0[index].0 = number,
            (false, false) => self.0.insert(index, (number, number)),
        }
    }

    /// Removes the entries of earlier time steps.
    pub(crate) fn forget_before(&mut self, source: MessageSource, step: i64) {
        let first = first_of(source, step);
        if self.0.first().is_some_and(|run| run.0 < first) {
            self.0.retain(|run| run.1 >= first);
            if let Some(run) = self.0.first_mut() {
                run.0 = run.0.max(first);
            }
        }
    }

    /// Passes the contained numbers in this interval that are not in `others` to `emit`; `others` is ascending with
    /// gaps.
    pub(crate) fn without(&self, others: &[ReceivedRange], (from, to): (i64, i64), mut emit: impl FnMut(i64)) {
        // Usually `others` contains all numbers.
        if let (&[(start, end)], &[ReceivedRange { from: first, to: last, .. }]) = (&self.0[..], others)
            && first <= start.max(from)
            && end.min(to) <= last
        {
            return;
        }
        let start = self.0.partition_point(|run| run.1 < from);
        for run in self.0[start..].iter().take_while(|run| run.0 <= to) {
            let mut next = run.0.max(from);
            let last = run.1.min(to);
            let skipped = others.partition_point(|other| other.to < next);
            for other in others[skipped..].iter().take_while(|other| other.from <= last) {
                (next..other.from).for_each(&mut emit);
                // `others` comes from a message and may end at the largest number.
                next = other.to.saturating_add(1);
            }
            (next..=last).for_each(&mut emit);
        }
    }
}

/// Lowest number of an entry of a time step.
pub(crate) fn first_of(source: MessageSource, step: i64) -> i64 {
    match source {
        MessageSource::Uav(_) => step,
        MessageSource::CueSource(_) => number_of_cue(step, 0),
    }
}

/// Highest number of an entry of a time step.
pub(crate) fn last_of(source: MessageSource, step: i64) -> i64 {
    match source {
        MessageSource::Uav(_) => step,
        MessageSource::CueSource(_) => number_of_cue(step, u16::MAX),
    }
}

/// Number of a cue among the entries of its source.
pub(crate) fn number_of_cue(step: i64, number: u16) -> i64 {
    step.saturating_mul(1 << 16).saturating_add(i64::from(number))
}

/// Time step of an entry.
pub(crate) fn step_of(source: MessageSource, number: i64) -> i64 {
    match source {
        MessageSource::Uav(_) => number,
        MessageSource::CueSource(_) => number >> 16,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn ranges_behave_like_a_set_of_numbers(numbers in proptest::collection::vec(0i64..60, 0..80), other in proptest::collection::vec(0i64..60, 0..80), before in 0i64..60) {
            let (mut runs, mut others) = (Ranges::default(), Ranges::default());
            numbers.iter().for_each(|number| runs.add(*number));
            other.iter().for_each(|number| others.add(*number));
            let (mut set, other): (BTreeSet<i64>, BTreeSet<i64>) = (numbers.into_iter().collect(), other.into_iter().collect());
            let uav = MessageSource::Uav(crate::uav::UavId(0));
            runs.forget_before(uav, before);
            set.retain(|number| *number >= before);
            prop_assert!((0..60).all(|number| runs.holds(number) == set.contains(&number)));
            prop_assert!(runs.runs().windows(2).all(|pair| pair[0].1 + 1 < pair[1].0));
            prop_assert_eq!(runs.runs().last().map(|run| run.1), set.last().copied());
            let mut missing = Vec::new();
            let held: Vec<ReceivedRange> = others.runs().iter().map(|(from, to)| ReceivedRange { source: uav, from: *from, to: *to }).collect();
            runs.without(&held, (10, 50), |number| missing.push(number));
            let expected: Vec<i64> = set.difference(&other).copied().filter(|number| (10..=50).contains(number)).collect();
            prop_assert_eq!(missing, expected);
        }
    }

    #[test]
    fn listed_ranges_may_extend_to_the_largest_number() {
        let mut runs = Ranges::default();
        (3..9).for_each(|number| runs.add(number));
        let without = |from, to| {
            let mut missing = Vec::new();
            let source = MessageSource::Uav(crate::uav::UavId(0));
            runs.without(&[ReceivedRange { source, from, to }], (i64::MIN, i64::MAX), |number| missing.push(number));
            missing
        };
        assert_eq!((without(5, i64::MAX), without(i64::MIN, 6)), (vec![3, 4], vec![7, 8]));
        assert_eq!((without(i64::MIN, i64::MAX), without(i64::MAX, i64::MAX).len()), (vec![], 6));
    }
}
