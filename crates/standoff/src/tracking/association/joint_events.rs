//! Joint association of the detections of one scan with tracks: marginal probabilities of all joint events in which each
//! track has at most one detection, and each detection at most one track.
//!
//! Tracks that compete for detections form a cluster. Small clusters are solved exactly, by dynamic programming over the
//! sets of used detections (as in Musicki & Evans, *Joint Integrated Probabilistic Data Association*, 2004, without
//! listing the events); others by loopy belief propagation (Williams & Lau, *Approximate Evaluation of Marginal
//! Association Probabilities with Belief Propagation*, 2014).

/// Maximum number of detections of a cluster that is solved exactly.
const EXACT_DETECTIONS_MAX: usize = 12;

/// Maximum cost of an exact solution, sets of detections times pairs.
const EXACT_COST_MAX: usize = 1 << 15;

/// Maximum number of sweeps of belief propagation.
const SWEEPS_MAX: usize = 100;

/// Change of the messages at which belief propagation stops.
const CONVERGED: f64 = 1e-5;

/// A possible pair of a track and a detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edge {
    /// Index of the track.
    pub(crate) track: usize,
    /// Index of the detection.
    pub(crate) detection: usize,
    /// Likelihood ratio of "the detection is of the track" to "the detection is of no track, and the track has none".
    pub(crate) ratio: f64,
    /// Result: probability of the pair.
    pub(crate) probability: f64,
}

/// Computes the probability of each edge. `edges` are sorted by track. The buffers are reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct JointEvents {
    /// Cluster of each detection: index of another detection of it, or its own.
    parents: Vec<usize>,
    /// Edges with the cluster of their detection, sorted by cluster, then as given.
    clustered: Vec<(usize, usize)>,
    /// Detections of the current cluster, ascending.
    detections: Vec<usize>,
    forward: Vec<f64>,
    backward: Vec<f64>,
    /// Message of each edge from its detection to its track; those to the detections are in `forward`.
    to_track: Vec<f64>,
    /// Index of each edge's detection in `detections`.
    places: Vec<usize>,
    ratios: Vec<f64>,
}

impl JointEvents {
    /// Replaces the probabilities of all edges.
    pub(crate) fn solve(&mut self, edges: &mut [Edge], detection_count: usize) {
        let mut clustered = core::mem::take(&mut self.clustered);
        self.find_clusters(edges, detection_count, &mut clustered);
        for cluster in clustered.chunk_by(|a, b| a.0 == b.0) {
            self.detections.clear();
            self.detections.extend(cluster.iter().map(|(_, edge)| edges[*edge].detection));
            self.detections.sort_unstable();
            self.detections.dedup();
            let count = self.detections.len();
            let is_small = count <= EXACT_DETECTIONS_MAX && cluster.len() << count <= EXACT_COST_MAX;
            if cluster.len() == 1 {
                let edge = &mut edges[cluster[0].1];
                edge.probability = edge.ratio / (1.0 + edge.ratio);
            } else if is_small {
                self.solve_exactly(cluster, edges);
            } else {
                self.propagate(cluster, edges);
            }
        }
        self.clustered = clustered;
    }

    fn find_clusters(&mut self, edges: &[Edge], detection_count: usize, clustered: &mut Vec<(usize, usize)>) {
        let Self { parents, .. } = self;
        parents.clear();
        parents.extend(0..detection_count);
        for of_track in edges.chunk_by(|a, b| a.track == b.track) {
            for pair in of_track.windows(2) {
                let (a, b) = (root(parents, pair[0].detection), root(parents, pair[1].detection));
                parents[a.max(b)] = a.min(b);
            }
        }
        clustered.clear();
        clustered.extend(edges.iter().enumerate().map(|(index, edge)| (root(parents, edge.detection), index)));
        clustered.sort_unstable();
    }

    /// Sums over all joint events, track by track: `forward[set]` is the sum over the events of the tracks so far in
    /// which exactly the detections of `set` are used, `backward[set]` that of the tracks to come, without those of
    /// `set`.
    fn solve_exactly(&mut self, cluster: &[(usize, usize)], edges: &mut [Edge]) {
        let Self { detections, forward, backward, .. } = self;
        let sets = 1usize << detections.len();
        let bit = |edge: &Edge| 1usize << detections.binary_search(&edge.detection).unwrap_or(0);
        let tracks: Vec<&[(usize, usize)]> = cluster.chunk_by(|a, b| edges[a.1].track == edges[b.1].track).collect();
        backward.clear();
        backward.resize(sets * (tracks.len() + 1), 1.0);
        for (index, track) in tracks.iter().enumerate().rev() {
            let (this, next) = backward.split_at_mut(sets * (index + 1));
            let this = &mut this[sets * index..];
            let next = &next[..sets];
            this.copy_from_slice(next);
            for (_, edge) in *track {
                let (bit, ratio) = (bit(&edges[*edge]), edges[*edge].ratio);
                (0..sets).filter(|set| set & bit == 0).for_each(|set| this[set] += ratio * next[set | bit]);
            }
        }
        let total = backward[0];
        forward.clear();
        forward.resize(sets, 0.0);
        forward[0] = 1.0;
        for (index, track) in tracks.iter().enumerate() {
            let next = &backward[sets * (index + 1)..sets * (index + 2)];
            for (_, edge) in *track {
                let bit = bit(&edges[*edge]);
                let without = (0..sets).filter(|set| set & bit == 0);
                let sum: f64 = without.map(|set| forward[set] * next[set | bit]).sum();
                edges[*edge].probability = edges[*edge].ratio * sum / total;
            }
            // From the largest set down, so that each still has its value from before this track.
            for set in (0..sets).rev() {
                for (_, edge) in *track {
                    let bit = bit(&edges[*edge]);
                    if set & bit != 0 {
                        forward[set] += edges[*edge].ratio * forward[set ^ bit];
                    }
                }
            }
        }
    }

    /// Loopy belief propagation. It converges; the marginals are approximate in clusters with cycles.
    fn propagate(&mut self, cluster: &[(usize, usize)], edges: &mut [Edge]) {
        let Self { detections, forward: to_detection, backward: sums, to_track, places, ratios, .. } = self;
        ratios.clear();
        ratios.extend(cluster.iter().map(|(_, edge)| edges[*edge].ratio));
        places.clear();
        places.extend(cluster.iter().map(|(_, edge)| detections.partition_point(|of| *of < edges[*edge].detection)));
        to_track.clear();
        to_track.resize(cluster.len(), 1.0);
        to_detection.clear();
        to_detection.resize(cluster.len(), 0.0);
        let is_of_same_track = |a: &(usize, usize), b: &(usize, usize)| edges[a.1].track == edges[b.1].track;
        let counts: Vec<usize> = cluster.chunk_by(is_of_same_track).map(<[_]>::len).collect();
        for _ in 0..SWEEPS_MAX {
            sums.clear();
            sums.resize(detections.len(), 1.0);
            let mut start = 0;
            for count in &counts {
                let range = start..start + count;
                let total: f64 = 1.0 + range.clone().map(|index| ratios[index] * to_track[index]).sum::<f64>();
                for index in range {
                    to_detection[index] = ratios[index] / (total - ratios[index] * to_track[index]).max(1.0);
                    sums[places[index]] += to_detection[index];
                }
                start += count;
            }
            let mut change: f64 = 0.0;
            for (index, old) in to_track.iter_mut().enumerate() {
                let message = 1.0 / (sums[places[index]] - to_detection[index]).max(1.0);
                change = change.max((message - *old).abs());
                *old = message;
            }
            if change < CONVERGED {
                break;
            }
        }
        let mut start = 0;
        for count in &counts {
            let range = start..start + count;
            let total: f64 = 1.0 + range.clone().map(|index| ratios[index] * to_track[index]).sum::<f64>();
            for index in range {
                edges[cluster[index].1].probability = ratios[index] * to_track[index] / total;
            }
            start += count;
        }
    }
}

/// First detection of the cluster of a detection.
fn root(parents: &mut [usize], mut detection: usize) -> usize {
    while parents[detection] != detection {
        parents[detection] = parents[parents[detection]];
        detection = parents[detection];
    }
    detection
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math;
    use proptest::prelude::*;

    /// Probabilities by listing all joint events.
    fn enumerated(edges: &[Edge]) -> Vec<f64> {
        fn events(
            tracks: &[&[(usize, Edge)]],
            used: &mut Vec<usize>,
            chosen: &mut Vec<usize>,
            weight: f64,
            sums: &mut [f64],
        ) -> f64 {
            let Some((first, rest)) = tracks.split_first() else {
                chosen.iter().for_each(|edge| sums[*edge] += weight);
                return weight;
            };
            let mut total = events(rest, used, chosen, weight, sums);
            for (index, edge) in *first {
                if !used.contains(&edge.detection) {
                    used.push(edge.detection);
                    chosen.push(*index);
                    total += events(rest, used, chosen, weight * edge.ratio, sums);
                    used.pop();
                    chosen.pop();
                }
            }
            total
        }
        let indexed: Vec<(usize, Edge)> = edges.iter().copied().enumerate().collect();
        let tracks: Vec<_> = indexed.chunk_by(|a, b| a.1.track == b.1.track).collect();
        let mut sums = vec![0.0; edges.len()];
        let total = events(&tracks, &mut Vec::new(), &mut Vec::new(), 1.0, &mut sums);
        sums.iter().map(|sum| sum / total).collect()
    }

    fn edges(ratios: &[(usize, usize, f64)]) -> Vec<Edge> {
        let mut edges: Vec<Edge> = ratios
            .iter()
            .map(|(track, detection, ratio)| Edge {
                track: *track,
                detection: *detection,
                ratio: *ratio,
                probability: f64::NAN,
            })
            .collect();
        edges.sort_by_key(|edge| (edge.track, edge.detection));
        edges.dedup_by_key(|edge| (edge.track, edge.detection));
        edges
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        /// 1,000 random clusters of up to 5 tracks and 6 detections: equal to the enumerated probabilities.
        #[test]
        fn exact_probabilities_equal_enumerated_ones(
            ratios in prop::collection::vec((0..5usize, 0..6usize, (-7.0..7.0f64)), 1..20)
        ) {
            let ratios: Vec<_> = ratios.iter().map(|(t, d, ln)| (*t, *d, math::exp(*ln))).collect();
            let mut edges = edges(&ratios);
            let expected = enumerated(&edges);
            let mut joint = JointEvents::default();
            joint.solve(&mut edges, 6);
            for (edge, expected) in edges.iter().zip(&expected) {
                prop_assert!((edge.probability - expected).abs() < 1e-9, "{edge:?} {expected}");
            }
        }
    }

    /// Mean error of belief propagation over the pairs of 1,000 random clusters with cycles.
    #[test]
    fn belief_propagation_is_wrong_by_a_hundredth_on_average() {
        let mut random = 1u64;
        let mut next = || {
            random = random.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            (random >> 40) as f64 / (1u64 << 24) as f64
        };
        let (mut sum, mut count) = (0.0, 0);
        for _ in 0..1000 {
            let pairs: Vec<_> = (0..25).filter(|_| next() < 0.6).collect();
            let ratios: Vec<_> =
                pairs.iter().map(|pair| (pair / 5, pair % 5, math::exp(12.0 * next() - 6.0))).collect();
            let mut edges = edges(&ratios);
            let expected = enumerated(&edges);
            let all: Vec<(usize, usize)> = (0..edges.len()).map(|index| (0, index)).collect();
            let mut joint = JointEvents { detections: (0..5).collect(), ..JointEvents::default() };
            joint.propagate(&all, &mut edges);
            sum += edges.iter().zip(&expected).map(|(edge, expected)| (edge.probability - expected).abs()).sum::<f64>();
            count += edges.len();
        }
        let mean = sum / f64::from(u32::try_from(count).unwrap());
        assert!((0.001..0.02).contains(&mean), "{mean}");
    }

    /// A cluster of more detections than are solved exactly still gives probabilities.
    #[test]
    fn a_large_cluster_has_probabilities() {
        let ratios: Vec<_> = (0..30).flat_map(|track| (0..30).map(move |detection| (track, detection, 2.0))).collect();
        let mut edges = edges(&ratios);
        JointEvents::default().solve(&mut edges, 30);
        for of_track in edges.chunk_by(|a, b| a.track == b.track) {
            let sum: f64 = of_track.iter().map(|edge| edge.probability).sum();
            assert!(sum > 0.5 && sum <= 1.0 + 1e-9, "{sum}");
        }
    }
}
