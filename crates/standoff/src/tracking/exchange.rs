//! Exchanges of targets: after a meeting, two tracks may each follow the target that the other one followed before.
//!
//! Exchanges follow each other: if one track may have exchanged its target with a second, and then the second with a
//! third, the third may follow the target of the first.
//!
//! The association sums over all joint events but keeps one estimate for each track. The places of the targets are then
//! known as well as before, but not which track follows which target. The reported estimate includes this: its covariance
//! is that of the mixture over the possible exchanges, about the mean of the track. The tracker itself continues with the
//! estimate without exchanges.

use nalgebra::Vector6;

use crate::covariance::Covariance;
use crate::math;
use crate::tracking::estimate::{Estimate, inverse_2};
use crate::tracking::existence::UnlabelledTracks;
use crate::tracking::track::TrackId;
use crate::tracking::track_table::{TrackRow, TrackTable};

/// Distance of two tracks beyond which an exchange no longer counts, m: 1.5 times the distance up to which the simulator
/// pairs a target with its track. Otherwise the covariances would grow without limit as the tracks part.
const DISTANCE_MAX_M: f64 = 45.0;

/// Odds below which an exchange does not count.
pub(crate) const NEGLIGIBLE: f64 = 0.01;

/// Maximum number of pairs of tracks that are compared in a time step.
const PAIRS_MAX: usize = 20_000;

/// Pairs of tracks that are close to each other, as ascending indices into their estimates, in ascending order.
pub(crate) fn close_pairs(estimates: &[Estimate]) -> Vec<(usize, usize)> {
    let x_m = |index: usize| estimates[index].state.position().x_m();
    let mut from_west: Vec<usize> = (0..estimates.len()).collect();
    from_west.sort_by(|a, b| x_m(*a).total_cmp(&x_m(*b)));
    let compared = from_west.iter().enumerate().flat_map(|(place, one)| {
        let next = from_west[place + 1..].iter().take_while(|other| x_m(**other) - x_m(*one) < DISTANCE_MAX_M);
        next.map(|other| (*one.min(other), *one.max(other)))
    });
    let is_close = |(one, other): &(usize, usize)| {
        let [one, other] = [one, other].map(|index| estimates[*index].state.position());
        one.squared_distance_m2(other) < DISTANCE_MAX_M * DISTANCE_MAX_M
    };
    let mut pairs: Vec<_> = compared.take(PAIRS_MAX).filter(is_close).collect();
    pairs.sort_unstable();
    pairs
}

/// Probability of mistaking one target for the other, given the estimates of both: its upper bound, half the
/// Bhattacharyya coefficient of Gaussians with the mean of both covariances.
pub(crate) fn exchange_probability(one: &Estimate, other: &Estimate) -> f64 {
    let squared = squared_distance(one, other);
    0.5 * math::exp(-0.25 * squared)
}

/// For each estimate, those close to it, by ascending index, with the odds of mistaking one target for the other. With
/// odds, any number of tracks that are completely mixed up are equally probable.
pub(crate) fn odds_of_all(estimates: &[Estimate]) -> Vec<Vec<(usize, f64)>> {
    let mut odds = vec![Vec::new(); estimates.len()];
    for (one, other) in close_pairs(estimates) {
        let probability = exchange_probability(&estimates[one], &estimates[other]);
        let of_pair = probability / (1.0 - probability);
        odds[one].push((other, of_pair));
        odds[other].push((one, of_pair));
    }
    odds.iter_mut().for_each(|of| of.sort_by_key(|(other, _)| *other));
    odds
}

/// Odds that track `other` follows a target after this time step, by earlier exchanges: those that it did before, or
/// those of a third track before times those of an exchange of both now. `known` are the tracks that may have followed
/// the target before, `now` those with which `other` may be mistaken now, by ascending index.
pub(crate) fn odds_after(known: &[(usize, f64)], other: usize, now: &[(usize, f64)]) -> f64 {
    let of = |all: &[(usize, f64)], track: usize| {
        all.binary_search_by_key(&track, |(track, _)| *track).map_or(0.0, |found| all[found].1)
    };
    let by_way_of = |(third, odds): &(usize, f64)| odds * of(now, *third);
    known.iter().map(by_way_of).fold(of(known, other), f64::max)
}

impl UnlabelledTracks {
    /// Includes in the covariances of the tracks that other tracks may now follow their targets.
    pub(super) fn include_exchanges<R: TrackRow>(&mut self, tracks: &mut TrackTable<R>) {
        let live_row = |id: TrackId| tracks.index(id).ok().filter(|row| !tracks.rows()[*row].track().is_lost());
        let entries = self.confirmed.iter().enumerate();
        let live: Vec<(usize, usize)> = entries.filter_map(|(entry, of)| Some((entry, live_row(of.id)?))).collect();
        let estimates: Vec<Estimate> = live.iter().map(|(_, row)| *tracks.rows()[*row].track().estimate()).collect();
        let ids: Vec<TrackId> = live.iter().map(|(entry, _)| self.confirmed[*entry].id).collect();
        let now = odds_of_all(&estimates);
        self.confirmed.iter_mut().for_each(|of| of.own = None);
        for (one, (entry, row)) in live.iter().enumerate() {
            let of = &mut self.confirmed[*entry];
            let index = |id: &TrackId| ids.binary_search(id).ok();
            let known: Vec<_> = of.exchanges.iter().filter_map(|(id, odds)| Some((index(id)?, *odds))).collect();
            let all = now[one].iter().map(|(other, odds)| (*other, odds.max(odds_after(&known, *other, &now[*other]))));
            let all: Vec<_> = all.filter(|(_, odds)| *odds > NEGLIGIBLE).collect();
            let mut mixture = ExchangeMixture::default();
            for (other, odds) in &all {
                mixture.add(*odds, &(estimates[*other].state.0 - estimates[one].state.0));
            }
            of.exchanges = all.into_iter().map(|(other, odds)| (ids[other], odds)).collect();
            if let Some(estimate) = mixture.estimate(&estimates[one]) {
                of.own = Some(estimates[one]);
                tracks.rows_mut()[*row].track_mut().refine(&estimate);
            }
        }
    }
}

/// Mixture of a track with the tracks that it may have exchanged its target with.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ExchangeMixture {
    odds: f64,
    /// Sum of the second moments of the other tracks about the mean of this one, by their odds.
    second_moment: Covariance,
}

impl ExchangeMixture {
    /// Adds a track at a distance `between`, with the odds that it follows the target.
    pub(crate) fn add(&mut self, odds: f64, between: &Vector6<f64>) {
        self.odds += odds;
        self.second_moment += Covariance::outer(between) * odds;
    }

    /// Estimate of the target, with the mean of its track; `None` if it cannot be that of another track.
    pub(crate) fn estimate(&self, own: &Estimate) -> Option<Estimate> {
        if self.odds <= 0.0 {
            return None;
        }
        let mut mixed = *own;
        mixed.covariance += self.second_moment * (1.0 / (1.0 + self.odds));
        Some(mixed)
    }
}

/// Squared distance between two independent estimates of a position, in standard deviations.
pub(crate) fn squared_distance(a: &Estimate, b: &Estimate) -> f64 {
    let between = (a.state.position() - b.state.position()).vector();
    let covariance = a.position_covariance() + b.position_covariance();
    inverse_2(&covariance).map_or(f64::INFINITY, |inverse| between.dot(&(inverse * between)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::target::TargetState;

    /// A target at `x_m` east, known to `sd_m` and 1 m/s.
    fn estimate(x_m: f64, sd_m: f64) -> Estimate {
        let mut mean = Vector6::zeros();
        mean[0] = x_m;
        let position = sd_m * sd_m;
        let covariance = Covariance::from_diagonal([position, 1.0, 0.1, position, 1.0, 0.1]);
        Estimate { state: TargetState(mean), covariance }
    }

    #[test]
    fn close_tracks_exchange_their_targets_and_distant_ones_do_not() {
        let at = |x_m: f64| exchange_probability(&estimate(0.0, 3.0), &estimate(x_m, 3.0));
        assert_eq!(at(0.0), 0.5);
        assert!((at(6.0) - 0.5 * math::exp(-0.5)).abs() < 1e-12);
        assert!(at(20.0) < NEGLIGIBLE);
    }

    /// Tracks 1 and 2 have met before, tracks 2 and 3 meet now: track 3 may follow the target of track 1.
    #[test]
    fn exchanges_follow_each_other_in_time() {
        let now: [&[(usize, f64)]; 4] = [&[], &[], &[(3, 0.5)], &[(2, 0.5)]];
        assert_eq!(odds_after(&[(2, 0.4)], 3, now[3]), 0.2);
        assert_eq!(odds_after(&[(2, 0.4), (3, 0.3)], 3, now[3]), 0.3);
        assert_eq!(odds_after(&[], 1, now[1]), 0.0);
    }

    #[test]
    fn close_pairs_are_found_in_any_order() {
        let estimates = [300.0, 0.0, 280.0, 44.0, 90.0].map(|x_m| estimate(x_m, 1.0));
        assert_eq!(close_pairs(&estimates), [(0, 2), (1, 3)]);
        let odds = odds_of_all(&[0.0, 100.0, 1.0].map(|x_m| estimate(x_m, 30.0)));
        assert!(odds[1].is_empty() && odds[0][0].0 == 2 && odds[2] == [(0, odds[0][0].1)] && odds[0][0].1 > 0.9);
    }

    /// Of tracks that are completely mixed up, each has the target with the same probability.
    #[test]
    fn the_covariance_is_that_of_the_mixture_about_the_track() {
        let own = estimate(0.0, 2.0);
        let mut mixture = ExchangeMixture::default();
        assert!(mixture.estimate(&own).is_none());
        for x_m in [-10.0, 20.0] {
            mixture.add(1.0, &(estimate(x_m, 2.0).state.0 - own.state.0));
        }
        let admitted = mixture.estimate(&own).unwrap();
        assert_eq!(admitted.state, own.state);
        let covariance = admitted.position_covariance();
        assert!((covariance[(0, 0)] - (4.0 + 500.0 / 3.0)).abs() < 1e-9 && covariance[(1, 1)] == 4.0);
    }
}
