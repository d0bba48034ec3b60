//! K-means clustering: targets near one another form a group (30, Algorithm 1).
//!
//! ```text
//! J = 1/m sum_i |x_i - mu_c(i)|^2                                                         Eq. (30)
//! ```
//!
//! Erratum: (30) contains the norm, but the text refers to squares; squares are used here, for which the mean is the
//! best centroid. The paper starts from random centroids. Here, several starts are tried, identical in every run. Later
//! clusterings start from the last one, so that clusters keep their identity between time steps. No cluster is ever
//! empty: its last target stays.

use crate::frame::Position;
use crate::grid::Grid;

/// Maximum number of Lloyd iterations. They normally end much earlier; the limit prevents a cycle caused by rounding.
const ITERATIONS_MAX: u32 = 100;

/// Numbers of starts without a previous clustering: centroids spread as far as possible, and random ones.
const STARTS: (usize, usize) = (8, 24);

/// Maximum number of distances that the starts compute. Above 100 UAVs and 1,000 targets, fewer starts are tried.
const START_DISTANCES_MAX: usize = 2_000_000;

/// Number of groups: half the number of UAVs, rounded up, but at most the number of targets.
///
/// Implements the K of Algorithm 1: round(N_u / 2), halves away from zero.
pub fn group_count(uavs: usize, targets: usize) -> usize {
    uavs.div_ceil(2).min(targets)
}

/// Clusters, and buffers for their computation.
#[derive(Debug, Clone, Default)]
pub struct KMeans {
    /// Index of the cluster of each position.
    pub cluster_of: Vec<usize>,
    centroids: Vec<Position>,
    sizes: Vec<usize>,
    /// Squared half distance of each cluster's centroid to the nearest other centroid.
    safe_m2: Vec<f64>,
    /// Index of the centroids, for the nearest one.
    grid: Grid,
}

impl KMeans {
    /// Clusters the positions into `k` groups from scratch; fewer if there are fewer positions.
    ///
    /// Implements Algorithm 1. Some starts spread their centroids as far as possible from different first positions;
    /// the others draw them from a fixed sequence, with a probability that grows with the distance. The result with the
    /// smallest (30) counts, the first one of ties.
    pub fn seed(&mut self, positions: &[Position], k: usize) {
        let k = k.min(positions.len());
        let n = positions.len();
        let (spread, drawn) = if k > 1 { (n.min(STARTS.0), STARTS.1) } else { (1, 0) };
        let starts = (spread + drawn).min((START_DISTANCES_MAX / (n * k).max(1)).max(1));
        let mut draw = Draw(0x9E37_79B9_7F4A_7C15);
        let mut best: Option<(f64, Vec<usize>)> = None;
        for start in 0..starts {
            match start.checked_sub(spread) {
                None => self.start(start * n / spread, positions, k, furthest),
                Some(_) => self.start(draw.below(n), positions, k, |distances_m2| draw.likelier_further(distances_m2)),
            }
            self.refine(positions, k, 0.0);
            let cost_m2 = self.cost_m2(positions);
            if best.as_ref().is_none_or(|(least_m2, _)| cost_m2 < *least_m2) {
                best = Some((cost_m2, self.cluster_of.clone()));
            }
        }
        self.cluster_of = best.map_or_else(Vec::new, |(_, of)| of);
    }

    /// Refines the clusters in `cluster_of`; each of the `k` clusters must have at least one position, and keeps one.
    ///
    /// Implements Algorithm 1, lines 2 to 9. A position only moves if that reduces its distance by more than
    /// `margin_m`; the paper has no such margin.
    pub fn refine(&mut self, positions: &[Position], k: usize, margin_m: f64) {
        if k < 2 {
            return;
        }
        for _ in 0..ITERATIONS_MAX {
            self.average(positions, k);
            self.measure_safety();
            let mut moved = false;
            for (cluster, position) in self.cluster_of.iter_mut().zip(positions) {
                if position.squared_distance_m2(self.centroids[*cluster]) < self.safe_m2[*cluster] {
                    continue;
                }
                let own_m2 = position.squared_distance_m2(self.centroids[*cluster]);
                // Of ties, the own one counts.
                let nearest = self.grid.nearest(*position, |_| true).filter(|(squared_m2, _)| *squared_m2 < own_m2);
                let nearest = nearest.map_or(*cluster, |(_, nearest)| nearest);
                let gain_m =
                    || position.distance_m(self.centroids[*cluster]) - position.distance_m(self.centroids[nearest]);
                if nearest != *cluster && self.sizes[*cluster] > 1 && (margin_m <= 0.0 || gain_m() > margin_m) {
                    self.sizes[*cluster] -= 1;
                    self.sizes[nearest] += 1;
                    *cluster = nearest;
                    moved = true;
                }
            }
            if !moved {
                return;
            }
        }
    }

    /// Objective J, m2; 0 without positions.
    ///
    /// Implements Eq. (30), with squares.
    pub fn cost_m2(&mut self, positions: &[Position]) -> f64 {
        let k = self.cluster_of.iter().max().map_or(0, |last| last + 1);
        self.average(positions, k);
        let squares =
            self.cluster_of.iter().zip(positions).map(|(cluster, x)| x.squared_distance_m2(self.centroids[*cluster]));
        squares.sum::<f64>() / positions.len().max(1) as f64
    }

    /// Computes centroids and sizes of the clusters.
    fn average(&mut self, positions: &[Position], k: usize) {
        self.sizes.clear();
        self.sizes.resize(k, 0);
        self.centroids.clear();
        self.centroids.resize(k, Position::ORIGIN);
        for (cluster, position) in self.cluster_of.iter().zip(positions) {
            let sum = self.centroids[*cluster];
            self.centroids[*cluster] = Position::from_m(sum.x_m() + position.x_m(), sum.y_m() + position.y_m());
            self.sizes[*cluster] += 1;
        }
        for (centroid, size) in self.centroids.iter_mut().zip(&self.sizes) {
            let n = (*size).max(1) as f64;
            *centroid = Position::from_m(centroid.x_m() / n, centroid.y_m() / n);
        }
    }

    /// Computes for each centroid the distance within which positions need not be compared with other centroids: half
    /// the distance to the next one.
    fn measure_safety(&mut self) {
        self.grid.fill_evenly(self.centroids.iter().copied());
        self.safe_m2.clear();
        for (index, own) in self.centroids.iter().enumerate() {
            let nearest = self.grid.nearest(*own, |other| other != index);
            self.safe_m2.push(0.25 * nearest.map_or(f64::INFINITY, |(squared_m2, _)| squared_m2));
        }
    }

    /// Selects `first`, then repeatedly the result of `pick`, which receives the squared distances to the nearest
    /// selected position (-1 for selected ones); the other positions join the nearest selected one.
    fn start(&mut self, first: usize, positions: &[Position], k: usize, mut pick: impl FnMut(&[f64]) -> usize) {
        self.cluster_of.clear();
        self.cluster_of.resize(positions.len(), 0);
        let mut distances_m2: Vec<f64> = positions.iter().map(|x| x.squared_distance_m2(positions[first])).collect();
        distances_m2.get_mut(first).into_iter().for_each(|distance_m2| *distance_m2 = -1.0);
        for cluster in 1..k {
            let next = pick(&distances_m2);
            for (index, position) in positions.iter().enumerate() {
                let to_next_m2 = position.squared_distance_m2(positions[next]);
                if to_next_m2 < distances_m2[index] {
                    (distances_m2[index], self.cluster_of[index]) = (to_next_m2, cluster);
                }
            }
            // A selected position starts its own cluster even if positions coincide.
            (distances_m2[next], self.cluster_of[next]) = (-1.0, cluster);
        }
    }
}

/// Index of the furthest position, the first one of ties.
fn furthest(distances_m2: &[f64]) -> usize {
    let mut best = 0;
    for (index, distance_m2) in distances_m2.iter().enumerate() {
        if *distance_m2 > distances_m2[best] {
            best = index;
        }
    }
    best
}

/// Pseudorandom numbers, identical in every run: xorshift.
pub(crate) struct Draw(pub(crate) u64);

impl Draw {
    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 33) as usize % n.max(1)
    }

    /// Draws a position that is not selected, with a probability that grows with its squared distance.
    fn likelier_further(&mut self, distances_m2: &[f64]) -> usize {
        const PARTS: usize = 1 << 24;
        let sum_m2: f64 = distances_m2.iter().filter(|distance_m2| **distance_m2 > 0.0).sum();
        let mut left_m2 = sum_m2 * self.below(PARTS) as f64 / PARTS as f64;
        for (index, distance_m2) in distances_m2.iter().enumerate().filter(|(_, distance_m2)| **distance_m2 > 0.0) {
            left_m2 -= distance_m2;
            if left_m2 < 0.0 {
                return index;
            }
        }
        furthest(distances_m2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(points: &[(f64, f64)]) -> Vec<Position> {
        points.iter().map(|(x, y)| Position::from_m(*x, *y)).collect()
    }

    fn found(points: &[(f64, f64)], k: usize) -> Vec<usize> {
        let mut clusters = KMeans::default();
        clusters.seed(&at(points), k);
        clusters.cluster_of
    }

    /// Checks Algorithm 1's K: halves away from zero (ties to even would give 0, 2 and 2), limited by the targets.
    #[test]
    fn group_count_is_half_the_uav_count_rounded_up() {
        let counts: Vec<_> = (0..=8).map(|uavs| group_count(uavs, 100)).collect();
        assert_eq!(counts, [0, 1, 1, 2, 2, 3, 3, 4, 4]);
        assert_eq!((group_count(8, 3), group_count(8, 0)), (3, 0));
    }

    /// Checks Eq. (30): distances of 1, 1, 4 and 4 m from the centroids, squared, divided by four.
    #[test]
    fn the_cost_is_the_mean_of_squares() {
        let positions = at(&[(0.0, 0.0), (2.0, 0.0), (100.0, 4.0), (100.0, -4.0)]);
        let mut clusters = KMeans { cluster_of: vec![0, 0, 1, 1], ..KMeans::default() };
        assert!((clusters.cost_m2(&positions) - 8.5).abs() < 1e-12);
        assert_eq!(KMeans::default().cost_m2(&[]), 0.0);
    }

    /// Checks Algorithm 1: clear clusters are found in any order.
    #[test]
    fn clear_clusters_are_found() {
        assert_eq!(found(&[(0.0, 0.0), (900.0, 5.0), (10.0, 9.0), (905.0, 0.0), (3.0, 4.0)], 2), [0, 1, 0, 1, 0]);
        assert_eq!(found(&[(0.0, 0.0), (10.0, 0.0)], 5).len(), 2);
        assert_eq!(found(&[], 2), [0; 0]);
    }

    /// Checks Algorithm 1 against every partition of eight targets into three groups: the best (30) in 99 of 100 worlds
    /// without any structure, and never more than a tenth worse.
    #[test]
    fn few_starts_nearly_reach_the_best_of_all_partitions() {
        let (mut best_found, mut draw) = (0, 1u64);
        for _ in 0..300 {
            let mut next = || {
                draw = draw.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (draw >> 40) as f64 / 16_777.216
            };
            let positions: Vec<_> = (0..8).map(|_| Position::from_m(next(), next())).collect();
            let mut clusters = KMeans::default();
            clusters.seed(&positions, 3);
            let got = clusters.cost_m2(&positions);
            let mut least = f64::INFINITY;
            for code in 0..6561usize {
                let of: Vec<usize> = (0..8).map(|digit| code / 3usize.pow(digit) % 3).collect();
                if (0..3).all(|cluster| of.contains(&cluster)) {
                    least = least.min(KMeans { cluster_of: of, ..KMeans::default() }.cost_m2(&positions));
                }
            }
            assert!(got <= 1.1 * least, "{got} {least}");
            best_found += u32::from(got <= least * (1.0 + 1e-9));
        }
        assert!(best_found >= 297, "{best_found} of 300");
    }

    /// A cluster keeps its identity while its targets move, also past the former position of another cluster.
    #[test]
    fn a_cluster_keeps_its_identity_while_its_targets_move() {
        let mut clusters = KMeans { cluster_of: vec![0, 0, 1, 1], ..KMeans::default() };
        for step in 0..60 {
            let x_m = 20.0 * f64::from(step);
            clusters.refine(&at(&[(x_m, 0.0), (x_m + 9.0, 0.0), (x_m - 800.0, 0.0), (x_m - 790.0, 0.0)]), 2, 0.0);
            assert_eq!(clusters.cluster_of, [0, 0, 1, 1]);
        }
    }

    /// Beyond Algorithm 1: with a margin, a position near the border stays in its cluster.
    #[test]
    fn a_margin_keeps_positions_near_the_border_in_their_cluster() {
        let positions = at(&[(0.0, 0.0), (70.0, 0.0), (100.0, 0.0)]);
        let refined = |margin_m| {
            let mut clusters = KMeans { cluster_of: vec![0, 0, 1], ..KMeans::default() };
            clusters.refine(&positions, 2, margin_m);
            clusters.cluster_of
        };
        // The second position is 35 m from its own centroid, 30 m from the other.
        assert_eq!((refined(0.0), refined(4.0), refined(6.0)), (vec![0, 1, 1], vec![0, 1, 1], vec![0, 0, 1]));
    }

    proptest! {
        /// No cluster is empty and the result is reproducible for all positions: also if they coincide, lie on a line,
        /// or are extremely far away.
        #[test]
        fn no_cluster_is_ever_empty(
            points in proptest::collection::vec((-3..3i32, -1..1i32, prop_oneof![Just(1.0), Just(1e3), Just(1e200)]), 1..20),
            k in 1usize..9,
        ) {
            let positions: Vec<_> =
                points.iter().map(|(x, y, s)| Position::from_m(f64::from(*x) * s, f64::from(*y) * s)).collect();
            let k = k.min(positions.len());
            let mut clusters = KMeans::default();
            clusters.seed(&positions, k);
            prop_assert!((0..k).all(|cluster| clusters.cluster_of.contains(&cluster)));
            let once = clusters.cluster_of.clone();
            clusters.refine(&positions, k, 0.0);
            let mut again = KMeans::default();
            again.seed(&positions, k);
            prop_assert_eq!(&once, &again.cluster_of);
            prop_assert!((0..k).all(|cluster| clusters.cluster_of.contains(&cluster)));
        }
    }
}
