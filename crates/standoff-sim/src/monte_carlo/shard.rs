//! Shard of a batch.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// One of several equal parts of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Shard {
    /// Index of the shard, from 0.
    pub index: u64,
    /// Number of shards.
    pub of: u64,
}

impl FromStr for Shard {
    type Err = String;

    /// Parses `I/N`.
    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((index, of)) if index < of => Ok(Self { index, of }),
            _ => Err("must be I/N with whole numbers, I from 0 to N - 1, like 0/4".to_owned()),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl Shard {
    /// Returns the runs of this shard. Shards are consecutive, and their sizes differ by at most one run.
    pub(super) fn of_runs(self, runs: u64) -> Range<u64> {
        let bound = |index: u64| (u128::from(index) * u128::from(runs) / u128::from(self.of)) as u64;
        bound(self.index)..bound(self.index + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_divide_all_runs_evenly_and_in_order() {
        for (runs, of) in [(1, 1), (7, 3), (200, 8), (10, 10), (u64::MAX, 3)] {
            let mut next = 0;
            for index in 0..of {
                let part = Shard { index, of }.of_runs(runs);
                assert_eq!(part.start, next);
                assert!([runs / of, runs / of + 1].contains(&(part.end - part.start)), "{part:?}");
                next = part.end;
            }
            assert_eq!(next, runs);
        }
    }

    #[test]
    fn shard_is_parsed_from_its_displayed_form() {
        assert_eq!("2/5".parse(), Ok(Shard { index: 2, of: 5 }));
        for wrong in ["5/5", "0/0", "-1/5", "1", "a/b", "1/2/3", ""] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
