//! Duplicates: several tracks of one target.

use crate::tracking::association::joint::JointUpdate;
use crate::tracking::candidate::Candidate;
use crate::tracking::deletion::LOST;
use crate::tracking::estimate::Estimate;
use crate::tracking::exchange::{self, exchange_probability};

/// Probability of an exchange above which two tracks cannot be distinguished.
const INDISTINCT: f64 = 0.2;

/// Number of tracks without target, expected among a track and those indistinct from it, at which the least probable one
/// ends: from there on, the expected number of targets is rounded to less than that of the tracks.
const DUPLICATES: f64 = 0.5;

impl JointUpdate {
    /// Ends duplicates. If fewer targets exist than tracks that cannot be distinguished, each of these keeps some detections
    /// and so its existence, although their number is known.
    pub(super) fn end_duplicates(&mut self) {
        let mut confirmed: Vec<usize> =
            (0..self.candidates.len()).filter(|index| self.candidates[*index].row.is_some()).collect();
        let estimate = |index: &usize| self.candidates[*index].modes.moments();
        let estimates: Vec<Estimate> = confirmed.iter().map(estimate).collect();
        let mut pairs = exchange::close_pairs(&estimates);
        pairs.retain(|(one, other)| exchange_probability(&estimates[*one], &estimates[*other]) > INDISTINCT);
        let indistinct: Vec<[usize; 2]> =
            pairs.iter().map(|(one, other)| [confirmed[*one], confirmed[*other]]).collect();
        // Stable: of equally probable tracks, that of lowest id ends first.
        confirmed.sort_by(|a, b| self.candidates[*a].existence.total_cmp(&self.candidates[*b].existence));
        for index in confirmed {
            let pairs = indistinct.iter().filter(|pair| pair.contains(&index));
            let others: Vec<usize> = pairs.map(|[one, other]| if *one == index { *other } else { *one }).collect();
            self.end_if_duplicate(index, &others);
        }
    }

    /// Ends a track if its target is probably that of one of the tracks that are indistinct from it. They get its existence.
    fn end_if_duplicate(&mut self, index: usize, others: &[usize]) {
        let others = others.iter().filter(|other| self.candidates[**other].existence >= LOST);
        let others: Vec<usize> = others.copied().collect();
        let lacking: f64 = others.iter().map(|other| 1.0 - self.candidates[*other].existence).sum();
        let existence = self.candidates[index].existence;
        if existence < LOST || lacking <= 0.0 || lacking + 1.0 - existence < DUPLICATES {
            return;
        }
        self.candidates[index].existence = 0.0;
        let share = (existence / lacking).min(1.0);
        for other in others {
            let Candidate { existence, .. } = &mut self.candidates[other];
            *existence += share * (1.0 - *existence);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance;
    use crate::target::TargetState;
    use crate::time::Time;
    use crate::tracking::motion_modes::MotionModes;
    use crate::tracking::track::TrackId;
    use nalgebra::Vector6;

    /// A track in the table at `x_m`, known to 5 m.
    fn candidate(row: usize, x_m: f64, existence: f64) -> Candidate {
        let mut mean = Vector6::zeros();
        mean[0] = x_m;
        let covariance = Covariance::from_diagonal([25.0, 1.0, 0.1, 25.0, 1.0, 0.1]);
        let modes = MotionModes::moving(Estimate { state: TargetState(mean), covariance });
        Candidate { row: Some(row), ..Candidate::new(TrackId(row as u64), modes, existence, Time::EPOCH) }
    }

    fn existences_after(tracks: [(f64, f64); 3]) -> [f64; 3] {
        let mut update = JointUpdate::default();
        update.candidates.extend((0..).zip(tracks).map(|(row, (x_m, existence))| candidate(row, x_m, existence)));
        update.end_duplicates();
        core::array::from_fn(|index| update.candidates[index].existence)
    }

    /// Of two tracks of one target, the less probable one ends, and the other one gets its existence.
    #[test]
    fn a_duplicate_ends() {
        assert_eq!(existences_after([(0.0, 0.8), (1.0, 0.6), (100.0, 0.6)]), [1.0, 0.0, 0.6]);
        // Both targets probably exist.
        assert_eq!(existences_after([(0.0, 0.8), (1.0, 0.9), (100.0, 0.4)]), [0.8, 0.9, 0.4]);
        // The tracks can be distinguished.
        assert_eq!(existences_after([(0.0, 0.5), (30.0, 0.5), (60.0, 0.5)]), [0.5, 0.5, 0.5]);
    }
}
