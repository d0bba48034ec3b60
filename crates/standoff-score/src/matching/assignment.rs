//! Optimal assignment of positions within a cut-off distance.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;
use pathfinding::undirected::connected_components::separate_components;
use standoff::Position;
use standoff::research::Grid;

/// Steps of the gain per cut-off squared: the assignment is optimal to this fraction for each pair.
const GAIN_STEPS: f64 = 1e12;

/// Maximum number of positions of one set in a cluster that is assigned optimally, because the time grows with its
/// cube. In a larger cluster, the nearest pairs are assigned first.
const CLUSTER_MAX: usize = 500;

/// Assigns positions of two sets to each other: pairs of an index of each, both at most once, nearer than the cut-off.
/// The sum of the squared distances is minimal, where each position without partner counts as half the cut-off squared.
pub(crate) fn assign(one: &[Position], other: &[Position], cutoff_m: f64) -> Vec<(usize, usize)> {
    let mut edges: Vec<(usize, usize, i64)> = Vec::new();
    let cutoff_m2 = cutoff_m * cutoff_m;
    let (places, mut near) = (Grid::of(other.iter().copied(), cutoff_m), Vec::new());
    for (i, a) in one.iter().enumerate() {
        for j in places.near_ascending(*a, cutoff_m, &mut near) {
            let squared_m2 = a.squared_distance_m2(other[j]);
            if squared_m2 < cutoff_m2 {
                edges.push((i, j, ((1.0 - squared_m2 / cutoff_m2) * GAIN_STEPS) as i64));
            }
        }
    }
    let mut pairs = take_separate_pairs(&mut edges, one.len(), other.len());
    for cluster in clusters(one.len(), &edges) {
        assign_cluster(&cluster, &mut pairs);
    }
    pairs.sort_unstable();
    pairs
}

/// Removes the edges of two positions that have no other one, usually all, and returns their pairs.
fn take_separate_pairs(edges: &mut Vec<(usize, usize, i64)>, ones: usize, others: usize) -> Vec<(usize, usize)> {
    let (mut of_one, mut of_other) = (vec![0u32; ones], vec![0u32; others]);
    for (i, j, _) in &*edges {
        of_one[*i] += 1;
        of_other[*j] += 1;
    }
    let is_separate = |i: usize, j: usize| of_one[i] == 1 && of_other[j] == 1;
    let pairs = edges.iter().map(|(i, j, _)| (*i, *j)).filter(|(i, j)| is_separate(*i, *j)).collect();
    edges.retain(|(i, j, _)| !is_separate(*i, *j));
    pairs
}

/// Splits the edges into those that share no position with others: few large problems become many small ones.
fn clusters(ones: usize, edges: &[(usize, usize, i64)]) -> Vec<Vec<(usize, usize, i64)>> {
    if edges.is_empty() {
        return Vec::new();
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
fn assign_cluster(edges: &[(usize, usize, i64)], pairs: &mut Vec<(usize, usize)>) {
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
fn assign_nearest_first(edges: &[(usize, usize, i64)], pairs: &mut Vec<(usize, usize)>) {
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

    /// The nearest pair, 4 and 5, would leave 0 and 9 without partners.
    #[test]
    fn assignment_minimises_the_sum_of_squared_distances() {
        assert_eq!(assign(&line(&[0.0, 5.0]), &line(&[4.0, 9.0]), 6.0), [(0, 0), (1, 1)]);
        assert_eq!(assign(&line(&[0.0, 5.0]), &line(&[4.0, 9.0]), 3.0), [(1, 0)]);
        // More of either set than of the other, and two separate clusters.
        assert_eq!(assign(&line(&[0.0, 1.0, 100.0]), &line(&[1.5, 99.0]), 20.0), [(1, 0), (2, 1)]);
        assert_eq!(assign(&line(&[1.5, 99.0]), &line(&[0.0, 1.0, 100.0]), 20.0), [(0, 1), (1, 2)]);
        // A cluster that is too large for that: the nearest pairs first.
        let many = [&[0.0, 5.0][..], &[5.0; CLUSTER_MAX]].concat();
        assert_eq!(assign(&line(&many), &line(&[4.0, 9.0]), 6.0), [(1, 0), (2, 1)]);
        assert_eq!(assign(&line(&[]), &line(&[0.0]), 20.0), []);
        assert_eq!(assign(&line(&[0.0]), &line(&[20.0]), 20.0), [], "the cut-off is excluded");
    }
}
