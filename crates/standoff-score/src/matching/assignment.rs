//! Optimal assignment of positions within a cut-off distance.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;
use pathfinding::undirected::connected_components::separate_components;
use standoff::Position;
use standoff::grid::Grid;

/// Steps of the gain per cut-off squared: the assignment is optimal to this fraction for each pair.
const GAIN_STEPS: f64 = 1e12;

/// Maximum number of positions of one set in a cluster that is assigned optimally, because the time grows with its
/// cube. In a larger cluster, the nearest pairs are assigned first.
const CLUSTER_MAX: usize = 500;

/// A position of each set, nearer to each other than the cut-off, and the gain of their pair.
type Edge = (usize, usize, i64);

/// With at most this many edges, one problem is solved faster than it is split.
const FEW_EDGES: usize = 32;

/// Assigns positions of two sets to each other; its memory is reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct Assigner {
    places: Grid,
    near: Vec<usize>,
    edges: Vec<Edge>,
    /// Number of edges of each position of both sets.
    counts: [Vec<u32>; 2],
    pairs: Vec<(usize, usize)>,
}

impl Assigner {
    /// Returns pairs of an index of each set, both at most once, nearer than the cut-off. The sum of the squared
    /// distances is minimal, where each position without partner counts as half the cut-off squared.
    pub(crate) fn assign(&mut self, one: &[Position], other: &[Position], cutoff_m: f64) -> &[(usize, usize)] {
        self.find_edges(one, other, cutoff_m);
        self.take_separate_pairs();
        for cluster in clusters(one.len(), &self.edges) {
            assign_cluster(&cluster, &mut self.pairs);
        }
        self.pairs.sort_unstable();
        &self.pairs
    }

    fn find_edges(&mut self, one: &[Position], other: &[Position], cutoff_m: f64) {
        let Self { places, near, edges, counts: [of_one, of_other], .. } = self;
        edges.clear();
        for (counts, positions) in [(&mut *of_one, one), (&mut *of_other, other)] {
            counts.clear();
            counts.resize(positions.len(), 0);
        }
        let cutoff_m2 = cutoff_m * cutoff_m;
        places.fill(other.iter().copied(), cutoff_m);
        for (i, a) in one.iter().enumerate() {
            for j in places.near_ascending(*a, cutoff_m, near) {
                let squared_m2 = a.squared_distance_m2(other[j]);
                if squared_m2 < cutoff_m2 {
                    edges.push((i, j, ((1.0 - squared_m2 / cutoff_m2) * GAIN_STEPS) as i64));
                    of_one[i] += 1;
                    of_other[j] += 1;
                }
            }
        }
    }

    /// Removes the edges of two positions that have no other one, usually all; their pairs are assigned.
    fn take_separate_pairs(&mut self) {
        let Self { edges, counts: [of_one, of_other], pairs, .. } = self;
        pairs.clear();
        edges.retain(|&(i, j, _)| {
            let is_separate = of_one[i] == 1 && of_other[j] == 1;
            pairs.extend(is_separate.then_some((i, j)));
            !is_separate
        });
    }
}

/// Splits the edges into those that share no position with others: a large problem becomes many small ones.
fn clusters(ones: usize, edges: &[Edge]) -> Vec<Vec<Edge>> {
    match edges.len() {
        0 => return Vec::new(),
        1..=FEW_EDGES => return vec![edges.to_vec()],
        _ => {}
    }
    let ends: Vec<Vec<usize>> = edges.iter().map(|(i, j, _)| vec![*i, ones + j]).collect();
    let (_, cluster_of_edge) = separate_components(&ends);
    let mut clusters: BTreeMap<usize, Vec<_>> = BTreeMap::new();
    for (edge, cluster) in edges.iter().zip(cluster_of_edge) {
        clusters.entry(cluster).or_default().push(*edge);
    }
    clusters.into_values().collect()
}

/// Adds the pairs of one cluster with the largest total gain.
fn assign_cluster(edges: &[Edge], pairs: &mut Vec<(usize, usize)>) {
    let sorted = |mut indices: Vec<usize>| {
        indices.sort_unstable();
        indices.dedup();
        indices
    };
    let ones = sorted(edges.iter().map(|edge| edge.0).collect());
    let others = sorted(edges.iter().map(|edge| edge.1).collect());
    if ones.len().max(others.len()) > CLUSTER_MAX {
        assign_nearest_first(edges, pairs);
        return;
    }
    // The algorithm needs at least as many columns as rows.
    let is_tall = ones.len() > others.len();
    let (rows, columns) = if is_tall { (&others, &ones) } else { (&ones, &others) };
    let mut gains = Matrix::new(rows.len(), columns.len(), 0i64);
    for (i, j, gain) in edges {
        let (row, column) = if is_tall { (j, i) } else { (i, j) };
        if let (Ok(row), Ok(column)) = (rows.binary_search(row), columns.binary_search(column)) {
            gains[(row, column)] = *gain;
        }
    }
    let (_, chosen) = kuhn_munkres(&gains);
    for (row, column) in chosen.into_iter().enumerate().filter(|place| gains[*place] > 0) {
        let (row, column) = (rows[row], columns[column]);
        pairs.push(if is_tall { (column, row) } else { (row, column) });
    }
}

/// Adds pairs of one cluster by ascending distance.
fn assign_nearest_first(edges: &[Edge], pairs: &mut Vec<(usize, usize)>) {
    let (mut ones, mut others) = (BTreeSet::new(), BTreeSet::new());
    let mut sorted = edges.to_vec();
    sorted.sort_unstable_by_key(|(i, j, gain)| (Reverse(*gain), *i, *j));
    for (i, j, _) in sorted {
        if !ones.contains(&i) && others.insert(j) {
            ones.insert(i);
            pairs.push((i, j));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(x_m: &[f64]) -> Vec<Position> {
        x_m.iter().map(|x_m| Position::from_m(*x_m, 0.0)).collect()
    }

    fn assigned(one: &[f64], other: &[f64], cutoff_m: f64) -> Vec<(usize, usize)> {
        let mut assigner = Assigner::default();
        // A used assigner keeps nothing but its memory.
        assigner.assign(&line(&[0.0, 1.0, 50.0]), &line(&[0.0, 1.0, 50.0]), 10.0);
        assigner.assign(&line(one), &line(other), cutoff_m).to_vec()
    }

    /// The nearest pair, 4 and 5, would leave 0 and 9 without partners.
    #[test]
    fn assignment_minimises_the_sum_of_squared_distances() {
        assert_eq!(assigned(&[0.0, 5.0], &[4.0, 9.0], 6.0), [(0, 0), (1, 1)]);
        assert_eq!(assigned(&[0.0, 5.0], &[4.0, 9.0], 3.0), [(1, 0)]);
        // More of either set than of the other, and two separate clusters.
        assert_eq!(assigned(&[0.0, 1.0, 100.0], &[1.5, 99.0], 20.0), [(1, 0), (2, 1)]);
        assert_eq!(assigned(&[1.5, 99.0], &[0.0, 1.0, 100.0], 20.0), [(0, 1), (1, 2)]);
        // A cluster that is too large for that: the nearest pairs first.
        let many = [&[0.0, 5.0][..], &[5.0; CLUSTER_MAX]].concat();
        assert_eq!(assigned(&many, &[4.0, 9.0], 6.0), [(1, 0), (2, 1)]);
        assert_eq!(assigned(&[], &[0.0], 20.0), []);
        assert_eq!(assigned(&[0.0], &[20.0], 20.0), [], "the cut-off is excluded");
    }
}
