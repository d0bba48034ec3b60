//! Assignment problem: the possible choices and their scores.

use core::ops::RangeInclusive;

use nalgebra::Matrix2;

use crate::frame::Position;
use crate::group_id::GroupId;
use crate::math;
use crate::params::SensorParams;
use crate::uav::UavId;

/// Minimum determinant of a target's information, 1/m4: a position known to a thousand kilometres in each direction. It
/// replaces the determinant of targets that no UAV has in range, that are directly below a UAV, or whose position is
/// not finite. Its inverse is the maximum.
const DET_FLOOR_1_M4: f64 = 1e-24;

/// A UAV that can be assigned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AvailableUav {
    /// Id of the UAV.
    pub uav: UavId,
    /// Position of the UAV.
    pub position: Position,
    /// Current group of the UAV; staying there has a bonus.
    pub current_group: Option<GroupId>,
}

/// A group that can get UAVs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidateGroup<'a> {
    /// Id of the group.
    pub group: GroupId,
    /// Positions of its members.
    pub members: &'a [Position],
    /// Priorities of its members; empty if all are 1.
    pub priorities: &'a [f64],
}

impl CandidateGroup<'_> {
    /// Total priority of the members.
    fn priority(&self) -> f64 {
        if self.priorities.is_empty() { self.members.len() as f64 } else { self.priorities.iter().sum() }
    }
}

/// Natural logarithm of a determinant, or a sum of such logarithms, in millionths.
pub(super) type Score = i64;

/// Indices of the UAVs of one group, ascending.
pub(super) type UavSet = Vec<usize>;

/// A group that may get UAVs.
pub(super) struct Candidate {
    pub(super) group: GroupId,
    /// Allowed number of UAVs.
    pub(super) sizes: RangeInclusive<usize>,
    /// Information of each UAV about each target, 1/m2.
    information: Vec<Vec<Matrix2<f64>>>,
    /// Priority of each target; empty if all are 1.
    priorities: Vec<f64>,
    /// Bonus of each UAV for staying in this group.
    switching_cost: Vec<Score>,
}

/// All UAVs and groups of an assignment.
pub(super) struct Problem {
    pub(super) uavs: usize,
    pub(super) groups: Vec<Candidate>,
}

/// Allowed numbers of UAVs of each group; `None` for a group that gets none.
pub(super) fn allowed_sizes(uavs: usize, sites: &[CandidateGroup<'_>]) -> Vec<Option<RangeInclusive<usize>>> {
    let mut targets: Vec<f64> = sites.iter().map(CandidateGroup::priority).collect();
    targets.sort_unstable_by(|a, b| b.total_cmp(a));
    // With too few UAVs, groups of higher total priority get one, groups of lower priority get none, and groups of
    // exactly this priority may get one.
    let marginal = targets.get(uavs).and(targets.get(uavs - 1));
    let sizes = |site: &CandidateGroup<'_>| match marginal.map(|marginal| site.priority().total_cmp(marginal)) {
        None => Some(1..=uavs.div_ceil(sites.len()).max(2)),
        Some(core::cmp::Ordering::Greater) => Some(1..=1),
        Some(core::cmp::Ordering::Equal) => Some(0..=1),
        Some(core::cmp::Ordering::Less) => None,
    };
    sites.iter().map(sizes).collect()
}

impl Problem {
    pub(super) fn new(
        uavs: &[AvailableUav],
        sites: &[CandidateGroup<'_>],
        sensor: &SensorParams,
        switching_cost: f64,
    ) -> Self {
        Self::with_sizes(uavs, sites, &allowed_sizes(uavs.len(), sites), sensor, switching_cost)
    }

    /// Creates a part of a larger problem, with these allowed numbers of UAVs for each group.
    pub(super) fn with_sizes(
        uavs: &[AvailableUav],
        sites: &[CandidateGroup<'_>],
        sizes: &[Option<RangeInclusive<usize>>],
        sensor: &SensorParams,
        switching_cost: f64,
    ) -> Self {
        let information_of = |uav: Position, target: &Position| {
            let information = sensor.information(uav, *target);
            if information.iter().all(|entry| entry.is_finite()) { information } else { Matrix2::zeros() }
        };
        let choice = |(site, sizes): (&CandidateGroup<'_>, &Option<RangeInclusive<usize>>)| {
            let sizes = sizes.clone()?;
            let information = uavs
                .iter()
                .map(|uav| site.members.iter().map(|target| information_of(uav.position, target)).collect())
                .collect();
            let staying = in_millionths(switching_cost * site.priority());
            let switching_cost =
                uavs.iter().map(|uav| if uav.current_group == Some(site.group) { staying } else { 0 }).collect();
            Some(Candidate {
                group: site.group,
                sizes,
                information,
                priorities: site.priorities.to_vec(),
                switching_cost,
            })
        };
        Self { uavs: uavs.len(), groups: sites.iter().zip(sizes).filter_map(choice).collect() }
    }

    /// Score of a group with its UAVs.
    pub(super) fn score(&self, site: usize, uav_set: &[usize]) -> Score {
        let choice = &self.groups[site];
        if uav_set.is_empty() { 0 } else { choice.score(&choice.sums(uav_set), None) + choice.switching_cost(uav_set) }
    }

    pub(super) fn total(&self, uav_sets: &[UavSet]) -> Score {
        uav_sets.iter().enumerate().map(|(site, uav_set)| self.score(site, uav_set)).sum()
    }

    /// Possible numbers of UAVs of a group in an assignment of all UAVs.
    fn sizes(&self, site: usize) -> RangeInclusive<usize> {
        let (own, all) = (&self.groups[site].sizes, || self.groups.iter().map(|choice| &choice.sizes));
        let least_of_others = all().map(|sizes| sizes.start()).sum::<usize>() - own.start();
        let most_of_others = all().map(|sizes| sizes.end()).sum::<usize>() - own.end();
        let (least, most) = (self.uavs.saturating_sub(most_of_others), self.uavs.saturating_sub(least_of_others));
        least.max(*own.start())..=most.min(*own.end())
    }

    /// All possible sets of UAVs of a group, as bits, in the order in which they win ties: the first UAV is the highest
    /// bit.
    fn candidates(&self, site: usize) -> Vec<usize> {
        let sizes = self.sizes(site);
        (0..1 << self.uavs).rev().filter(|uav_set: &usize| sizes.contains(&(uav_set.count_ones() as usize))).collect()
    }

    fn uav_set(&self, bits: usize) -> UavSet {
        (0..self.uavs).filter(|uav| bits >> (self.uavs - 1 - uav) & 1 == 1).collect()
    }

    /// Finds the best assignment by dynamic programming over the sets of UAVs that the last groups share.
    pub(super) fn exact(&self) -> Vec<UavSet> {
        let all = (1 << self.uavs) - 1;
        let mut best = vec![None; all + 1];
        best[0] = Some(0);
        let mut picks = Vec::new();
        for site in (0..self.groups.len()).rev() {
            let scored = |bits| (bits, self.score(site, &self.uav_set(bits)));
            let candidates: Vec<(usize, Score)> = self.candidates(site).into_iter().map(scored).collect();
            let (mut next, mut pick) = (vec![None; all + 1], vec![0; all + 1]);
            for shared in if site == 0 { all } else { 0 }..=all {
                for &(bits, score) in candidates.iter().filter(|(bits, _)| bits & shared == *bits) {
                    let total: Option<Score> = best[shared ^ bits].map(|rest: Score| rest + score);
                    if total > next[shared] {
                        (next[shared], pick[shared]) = (total, bits);
                    }
                }
            }
            best = next;
            picks.push(pick);
        }
        let mut shared = all;
        let mut take = |pick: Vec<usize>| {
            let bits = pick[shared];
            shared ^= bits;
            self.uav_set(bits)
        };
        picks.into_iter().rev().map(&mut take).collect()
    }

    /// Finds the best assignment by the objective of the paper, by enumeration.
    pub(super) fn paper_objective(&self) -> Vec<UavSet> {
        let candidate = |site: usize, bits| {
            let sum: Matrix2<f64> = self.groups[site].sums(&self.uav_set(bits)).iter().sum();
            (bits, sum)
        };
        let site = |site| self.candidates(site).into_iter().map(|bits| candidate(site, bits)).collect();
        let candidates: Vec<Vec<(usize, Matrix2<f64>)>> = (0..self.groups.len()).map(site).collect();
        let mut best = (Score::MIN, Vec::new());
        enumerate(&candidates, (1 << self.uavs) - 1, Matrix2::zeros(), &mut Vec::new(), &mut best);
        best.1.into_iter().map(|bits| self.uav_set(bits)).collect()
    }
}

/// Continues from the sets `chosen` for the first groups, whose information is `sum`, and keeps the `best` result.
fn enumerate(
    candidates: &[Vec<(usize, Matrix2<f64>)>],
    free: usize,
    sum: Matrix2<f64>,
    chosen: &mut Vec<usize>,
    best: &mut (Score, Vec<usize>),
) {
    let Some(site) = candidates.get(chosen.len()) else {
        let score = in_millionths(math::ln(floored_det(&sum)));
        if free == 0 && score > best.0 {
            *best = (score, chosen.clone());
        }
        return;
    };
    for (bits, information) in site.iter().filter(|(bits, _)| bits & free == *bits) {
        chosen.push(*bits);
        enumerate(candidates, free ^ bits, sum + information, chosen, best);
        chosen.pop();
    }
}

impl Candidate {
    /// Information of a set of UAVs about each target, 1/m2.
    pub(super) fn sums(&self, uav_set: &[usize]) -> Vec<Matrix2<f64>> {
        let mut uavs = uav_set.iter().map(|uav| &self.information[*uav]);
        let mut sums = uavs.next().cloned().unwrap_or_default();
        for information in uavs {
            sums.iter_mut().zip(information).for_each(|(sum, term)| *sum += term);
        }
        sums
    }

    /// Bonus of a set of UAVs for staying.
    pub(super) fn switching_cost(&self, uav_set: &[usize]) -> Score {
        uav_set.iter().map(|uav| self.switching_cost[*uav]).sum()
    }

    /// Score of `sums`, optionally with one more UAV, without the bonus for staying.
    pub(super) fn score(&self, sums: &[Matrix2<f64>], joined: Option<usize>) -> Score {
        let with_joined = |(index, sum): (usize, &Matrix2<f64>)| match joined {
            None => floored_det(sum),
            Some(uav) => floored_det(&(sum + self.information[uav][index])),
        };
        let dets = sums.iter().enumerate().map(with_joined);
        if self.priorities.is_empty() {
            return ln_product(dets);
        }
        in_millionths(dets.zip(&self.priorities).map(|(det, priority)| priority * math::ln(det)).sum())
    }
}

/// Sum of the logarithms of floored determinants. It computes as few logarithms as possible, because most of the time
/// is spent here.
fn ln_product(dets: impl Iterator<Item = f64>) -> Score {
    let (mut ln, mut product) = (0.0, 1.0);
    for det in dets {
        product *= det;
        if !(1e-200..=1e200).contains(&product) {
            ln += math::ln(product);
            product = 1.0;
        }
    }
    in_millionths(ln + math::ln(product))
}

/// Determinant of a target's information, 1/m4, limited to the range that counts. NaN becomes the minimum.
fn floored_det(information: &Matrix2<f64>) -> f64 {
    let det = information.determinant();
    if det > DET_FLOOR_1_M4 { det.min(1.0 / DET_FLOOR_1_M4) } else { DET_FLOOR_1_M4 }
}

fn in_millionths(ln: f64) -> Score {
    (1e6 * ln).round() as Score
}
