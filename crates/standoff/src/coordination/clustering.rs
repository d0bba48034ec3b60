//! K-means: targets near one another form a group (30, Algorithm 1).
//!
//! ```text
//! J = 1/m sum_i |x_i - mu_c(i)|^2                                                         Eq. (30)
//! ```
//!
//! Erratum: (30) prints the norm, the text says squares; squares it is, for which the mean is the best centroid. The
//! paper starts from random centroids; here a few starts are tried, the same in every run, and from then on each
//! clustering starts from the last one, so that a cluster stays itself from tick to tick. No cluster is ever empty: its
//! last target stays.

use crate::frame::Position;

/// Lloyd's iterations end by themselves long before; this bounds them where rounding would let them cycle.
const ITERATIONS_MAX: u32 = 100;

/// When there is no last clustering, so many starts are spread as far as can be, and so many are drawn.
const STARTS: (usize, usize) = (8, 24);

/// Number of groups for so many UAVs and targets: half the UAVs, halves rounded up, and never more than the targets.
///
/// Implements the K of Algorithm 1: round(N_u / 2), halves away from zero.
pub fn group_count(uavs: usize, targets: usize) -> usize {
    uavs.div_ceil(2).min(targets)
}

/// Clusters, and the room that finding them takes.
#[derive(Debug, Clone, Default)]
pub struct Clusters {
    /// Of each position, the index of its cluster.
    pub of: Vec<usize>,
    centroids: Vec<Position>,
    sizes: Vec<usize>,
    /// Of each cluster, the square of half the way to the nearest other centroid.
    safe_m2: Vec<f64>,
}

impl Clusters {
    /// Clusters the positions into `k` groups from nothing; fewer if there are fewer positions.
    ///
    /// Implements Algorithm 1. Some starts spread their centroids as far as can be from different first positions, some
    /// draw them, likelier the further they are, from a fixed sequence; the one that ends with the smallest (30) counts,
    /// the first of equals.
    pub fn found(&mut self, positions: &[Position], k: usize) {
        let k = k.min(positions.len());
        let n = positions.len();
        let (spread, drawn) = if k > 1 { (n.min(STARTS.0), STARTS.1) } else { (1, 0) };
        let mut draw = Draw(0x9E37_79B9_7F4A_7C15);
        let mut best: Option<(f64, Vec<usize>)> = None;
        for start in 0..spread + drawn {
            match start.checked_sub(spread) {
                None => self.start(start * n / spread, positions, k, furthest),
                Some(_) => self.start(draw.below(n), positions, k, |distances_m2| draw.likelier_further(distances_m2)),
            }
            self.refine(positions, k, 0.0);
            let cost_m2 = self.cost_m2(positions);
            if best.as_ref().is_none_or(|(least_m2, _)| cost_m2 < *least_m2) {
                best = Some((cost_m2, self.of.clone()));
            }
        }
        self.of = best.map_or_else(Vec::new, |(_, of)| of);
    }

    /// Clusters on from the clusters that `of` tells; each of the `k` has at least one position, and keeps one.
    ///
    /// Implements Algorithm 1, lines 2 to 9. A position moves only if that brings it nearer by more than `margin_m`; the
    /// paper has none.
    pub fn refine(&mut self, positions: &[Position], k: usize, margin_m: f64) {
        if k < 2 {
            return;
        }
        for _ in 0..ITERATIONS_MAX {
            self.average(positions, k);
            self.measure_safety();
            let mut moved = false;
            for (cluster, position) in self.of.iter_mut().zip(positions) {
                if position.squared_distance_m2(self.centroids[*cluster]) < self.safe_m2[*cluster] {
                    continue;
                }
                let nearest = nearest(&self.centroids, *position, *cluster);
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

    /// The objective J, m2; 0 for no positions.
    ///
    /// Implements Eq. (30), with squares.
    pub fn cost_m2(&mut self, positions: &[Position]) -> f64 {
        let k = self.of.iter().max().map_or(0, |last| last + 1);
        self.average(positions, k);
        let squares = self.of.iter().zip(positions).map(|(cluster, x)| x.squared_distance_m2(self.centroids[*cluster]));
        squares.sum::<f64>() / positions.len().max(1) as f64
    }

    /// Centroids and sizes of the clusters.
    fn average(&mut self, positions: &[Position], k: usize) {
        self.sizes.clear();
        self.sizes.resize(k, 0);
        self.centroids.clear();
        self.centroids.resize(k, Position::ORIGIN);
        for (cluster, position) in self.of.iter().zip(positions) {
            let sum = self.centroids[*cluster];
            self.centroids[*cluster] = Position::from_m(sum.x_m() + position.x_m(), sum.y_m() + position.y_m());
            self.sizes[*cluster] += 1;
        }
        for (centroid, size) in self.centroids.iter_mut().zip(&self.sizes) {
            let n = (*size).max(1) as f64;
            *centroid = Position::from_m(centroid.x_m() / n, centroid.y_m() / n);
        }
    }

    /// A position nearer to its centroid than half-way to the next one need not be compared with any.
    fn measure_safety(&mut self) {
        self.safe_m2.clear();
        for (index, own) in self.centroids.iter().enumerate() {
            let others = self.centroids.iter().enumerate().filter(|(other, _)| *other != index);
            let nearest_m2 = others.map(|(_, other)| own.squared_distance_m2(*other)).fold(f64::INFINITY, f64::min);
            self.safe_m2.push(0.25 * nearest_m2);
        }
    }

    /// Picks `first`, then again and again what `pick` says, given the squared distances to the nearest pick, of picks
    /// -1; the others go to the nearest pick.
    fn start(&mut self, first: usize, positions: &[Position], k: usize, mut pick: impl FnMut(&[f64]) -> usize) {
        self.of.clear();
        self.of.resize(positions.len(), 0);
        let mut distances_m2: Vec<f64> = positions.iter().map(|x| x.squared_distance_m2(positions[first])).collect();
        distances_m2.get_mut(first).into_iter().for_each(|distance_m2| *distance_m2 = -1.0);
        for cluster in 1..k {
            let next = pick(&distances_m2);
            for (index, position) in positions.iter().enumerate() {
                let to_next_m2 = position.squared_distance_m2(positions[next]);
                if to_next_m2 < distances_m2[index] {
                    (distances_m2[index], self.of[index]) = (to_next_m2, cluster);
                }
            }
            // Also where positions coincide, a pick founds its own cluster.
            (distances_m2[next], self.of[next]) = (-1.0, cluster);
        }
    }
}

/// The furthest position, the first of equals.
fn furthest(distances_m2: &[f64]) -> usize {
    let mut best = 0;
    for (index, distance_m2) in distances_m2.iter().enumerate() {
        if *distance_m2 > distances_m2[best] {
            best = index;
        }
    }
    best
}

/// Numbers without a pattern, the same in every run: xorshift.
pub(crate) struct Draw(pub(crate) u64);

impl Draw {
    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 33) as usize % n.max(1)
    }

    /// A position that is no pick, with a probability that grows with its squared distance.
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

/// The nearest centroid; of equals the one that is `now`, else the first.
fn nearest(centroids: &[Position], position: Position, now: usize) -> usize {
    let mut best = (now, position.squared_distance_m2(centroids[now]));
    for (index, centroid) in centroids.iter().enumerate() {
        let distance_m2 = position.squared_distance_m2(*centroid);
        if distance_m2 < best.1 {
            best = (index, distance_m2);
        }
    }
    best.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(points: &[(f64, f64)]) -> Vec<Position> {
        points.iter().map(|(x, y)| Position::from_m(*x, *y)).collect()
    }

    fn found(points: &[(f64, f64)], k: usize) -> Vec<usize> {
        let mut clusters = Clusters::default();
        clusters.found(&at(points), k);
        clusters.of
    }

    /// Checks Algorithm 1's K: halves away from zero (ties to even would give 0, 2 and 2), bounded by the targets.
    #[test]
    fn half_as_many_groups_as_uavs() {
        let counts: Vec<_> = (0..=8).map(|uavs| group_count(uavs, 100)).collect();
        assert_eq!(counts, [0, 1, 1, 2, 2, 3, 3, 4, 4]);
        assert_eq!((group_count(8, 3), group_count(8, 0)), (3, 0));
    }

    /// Checks Eq. (30): 1, 1, 4 and 4 m from the centroids, squared, over four.
    #[test]
    fn the_cost_is_the_mean_of_squares() {
        let positions = at(&[(0.0, 0.0), (2.0, 0.0), (100.0, 4.0), (100.0, -4.0)]);
        let mut clusters = Clusters { of: vec![0, 0, 1, 1], ..Clusters::default() };
        assert!((clusters.cost_m2(&positions) - 8.5).abs() < 1e-12);
        assert_eq!(Clusters::default().cost_m2(&[]), 0.0);
    }

    /// Checks Algorithm 1: clear clusters are found whatever the order.
    #[test]
    fn clear_clusters_are_found() {
        assert_eq!(found(&[(0.0, 0.0), (900.0, 5.0), (10.0, 9.0), (905.0, 0.0), (3.0, 4.0)], 2), [0, 1, 0, 1, 0]);
        assert_eq!(found(&[(0.0, 0.0), (10.0, 0.0)], 5).len(), 2);
        assert_eq!(found(&[], 2), [0; 0]);
    }

    /// Checks Algorithm 1 against every partition of eight targets into three groups: the best (30) in 99 of 100
    /// worlds without any structure, and nowhere worse by a tenth.
    #[test]
    fn few_starts_come_close_to_the_best_of_all_partitions() {
        let (mut best_found, mut draw) = (0, 1u64);
        for _ in 0..300 {
            let mut next = || {
                draw = draw.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (draw >> 40) as f64 / 16_777.216
            };
            let positions: Vec<_> = (0..8).map(|_| Position::from_m(next(), next())).collect();
            let mut clusters = Clusters::default();
            clusters.found(&positions, 3);
            let got = clusters.cost_m2(&positions);
            let mut least = f64::INFINITY;
            for code in 0..6561usize {
                let of: Vec<usize> = (0..8).map(|digit| code / 3usize.pow(digit) % 3).collect();
                if (0..3).all(|cluster| of.contains(&cluster)) {
                    least = least.min(Clusters { of, ..Clusters::default() }.cost_m2(&positions));
                }
            }
            assert!(got <= 1.1 * least, "{got} {least}");
            best_found += u32::from(got <= least * (1.0 + 1e-9));
        }
        assert!(best_found >= 297, "{best_found} of 300");
    }

    /// A cluster stays itself while its targets move, also past another one's old place.
    #[test]
    fn identity_follows_the_targets() {
        let mut clusters = Clusters { of: vec![0, 0, 1, 1], ..Clusters::default() };
        for step in 0..60 {
            let x_m = 20.0 * f64::from(step);
            clusters.refine(&at(&[(x_m, 0.0), (x_m + 9.0, 0.0), (x_m - 800.0, 0.0), (x_m - 790.0, 0.0)]), 2, 0.0);
            assert_eq!(clusters.of, [0, 0, 1, 1]);
        }
    }

    /// Beyond Algorithm 1: with a margin, a position on the border stays where it is.
    #[test]
    fn a_margin_keeps_positions_on_the_border() {
        let positions = at(&[(0.0, 0.0), (70.0, 0.0), (100.0, 0.0)]);
        let refined = |margin_m| {
            let mut clusters = Clusters { of: vec![0, 0, 1], ..Clusters::default() };
            clusters.refine(&positions, 2, margin_m);
            clusters.of
        };
        // The second is 35 m from its own centroid, 30 m from the other.
        assert_eq!((refined(0.0), refined(4.0), refined(6.0)), (vec![0, 1, 1], vec![0, 1, 1], vec![0, 0, 1]));
    }

    proptest! {
        /// No cluster is empty and the same comes out twice, wherever the positions are: also all in one place, on a
        /// line, or absurdly far.
        #[test]
        fn no_cluster_is_ever_empty(
            points in proptest::collection::vec((-3..3i32, -1..1i32, prop_oneof![Just(1.0), Just(1e3), Just(1e200)]), 1..20),
            k in 1usize..9,
        ) {
            let positions: Vec<_> =
                points.iter().map(|(x, y, s)| Position::from_m(f64::from(*x) * s, f64::from(*y) * s)).collect();
            let k = k.min(positions.len());
            let mut clusters = Clusters::default();
            clusters.found(&positions, k);
            prop_assert!((0..k).all(|cluster| clusters.of.contains(&cluster)));
            let once = clusters.of.clone();
            clusters.refine(&positions, k, 0.0);
            let mut again = Clusters::default();
            again.found(&positions, k);
            prop_assert_eq!(&once, &again.of);
            prop_assert!((0..k).all(|cluster| clusters.of.contains(&cluster)));
        }
    }
}
