//! Assignment of many UAVs, from their current groups. Groups without a UAV get the nearest one that can be spared;
//! then the local search improves the neighbourhoods of the groups that have changed. What is far from a change stays.

use core::cmp::Reverse;
use core::ops::RangeInclusive;
use std::collections::{BinaryHeap, VecDeque};

use super::local_search::{improve, join};
use super::problem::{AvailableUav, CandidateGroup, Problem, UavSet, allowed_sizes};
use crate::frame::Position;
use crate::grid::Grid;
use crate::params::SensorParams;

/// Number of groups of a neighbourhood.
const GROUPS: usize = 12;

/// Number of trials in a neighbourhood.
const TRIALS: u32 = 24;

/// Maximum number of times that the neighbourhood of a group is searched.
const VISITS_MAX: u8 = 3;

/// An assignment in progress.
struct Assigning<'a> {
    uavs: &'a [AvailableUav],
    sites: &'a [CandidateGroup<'a>],
    /// Allowed numbers of UAVs of each group; `None` if it gets none.
    sizes: Vec<Option<RangeInclusive<usize>>>,
    uav_sets: Vec<UavSet>,
    /// Group of each UAV.
    site_of: Vec<Option<usize>>,
    /// Groups whose neighbourhoods are yet to be searched.
    open: VecDeque<usize>,
    is_open: Vec<bool>,
    centres: Grid,
    positions: Vec<Position>,
}

/// Returns the UAVs of each group. `has_changed` selects the groups to be reconsidered, in addition to those whose UAVs
/// change anyway.
pub(super) fn search(
    uavs: &[AvailableUav],
    sites: &[CandidateGroup<'_>],
    has_changed: &dyn Fn(usize) -> bool,
    sensor: &SensorParams,
    switching_cost: f64,
) -> Vec<UavSet> {
    let mut assigning = Assigning::new(uavs, sites);
    assigning.supply();
    assigning.place_others();
    (0..sites.len()).filter(|site| has_changed(*site)).for_each(|site| assigning.open(site));
    let mut visits = vec![0; sites.len()];
    while let Some(site) = assigning.open.pop_front() {
        assigning.is_open[site] = false;
        if assigning.sizes[site].is_some() && visits[site] < VISITS_MAX {
            visits[site] += 1;
            assigning.search_around(site, sensor, switching_cost);
        }
    }
    assigning.uav_sets
}

impl<'a> Assigning<'a> {
    /// Starts from the current groups of the UAVs, as far as they are allowed.
    fn new(uavs: &'a [AvailableUav], sites: &'a [CandidateGroup<'a>]) -> Self {
        let positions: Vec<Position> = sites.iter().map(|site| centre(site.members)).collect();
        let mut centres = Grid::default();
        centres.fill_evenly(positions.iter().copied());
        let mut assigning = Self {
            uavs,
            sites,
            sizes: allowed_sizes(uavs.len(), sites),
            uav_sets: vec![UavSet::new(); sites.len()],
            site_of: vec![None; uavs.len()],
            open: VecDeque::new(),
            is_open: vec![false; sites.len()],
            centres,
            positions,
        };
        for (uav, available) in uavs.iter().enumerate() {
            let current = available.current_group;
            let site = current.and_then(|group| sites.binary_search_by_key(&group, |site| site.group).ok());
            if let Some(site) = site.filter(|site| assigning.has_room(*site)) {
                assigning.put(uav, site);
            }
        }
        assigning
    }

    fn has_room(&self, site: usize) -> bool {
        self.sizes[site].as_ref().is_some_and(|sizes| self.uav_sets[site].len() < *sizes.end())
    }

    /// True if a UAV has no group, or its group can spare it.
    fn is_spare(&self, uav: usize) -> bool {
        self.site_of[uav]
            .is_none_or(|site| self.sizes[site].as_ref().is_none_or(|sizes| self.uav_sets[site].len() > *sizes.start()))
    }

    /// Assigns a UAV to a group instead of its former one.
    fn put(&mut self, uav: usize, site: usize) {
        if let Some(old) = self.site_of[uav].replace(site) {
            self.uav_sets[old].retain(|member| *member != uav);
        }
        join(&mut self.uav_sets[site], uav);
    }

    fn open(&mut self, site: usize) {
        if !core::mem::replace(&mut self.is_open[site], true) {
            self.open.push_back(site);
        }
    }

    /// Gives each group that lacks UAVs the nearest ones that are spare; the shortest ways first.
    fn supply(&mut self) {
        let mut places = Grid::default();
        places.fill_evenly(self.uavs.iter().map(|uav| finite(uav.position)));
        let nearest = |assigning: &Self, site: usize| {
            let found = places.nearest(assigning.positions[site], |uav| assigning.is_spare(uav));
            // Squares are not negative, so that their bits have the same order.
            found.map(|(squared_m2, uav)| Reverse((squared_m2.to_bits(), site, uav)))
        };
        let lacks = |assigning: &Self, site: usize| {
            assigning.sizes[site].as_ref().is_some_and(|sizes| assigning.uav_sets[site].len() < *sizes.start())
        };
        let lacking = (0..self.sites.len()).filter(|site| lacks(self, *site));
        let mut ways: BinaryHeap<_> = lacking.filter_map(|site| nearest(self, site)).collect();
        while let Some(Reverse((_, site, uav))) = ways.pop() {
            if self.is_spare(uav) {
                if let Some(old) = self.site_of[uav] {
                    self.open(old);
                }
                self.put(uav, site);
                self.open(site);
            }
            if lacks(self, site) {
                ways.extend(nearest(self, site));
            }
        }
    }

    /// Assigns the UAVs without a group to the nearest groups with room.
    fn place_others(&mut self) {
        for uav in 0..self.uavs.len() {
            if self.site_of[uav].is_none() {
                let nearest = self.centres.nearest(finite(self.uavs[uav].position), |site| self.has_room(site));
                if let Some((_, site)) = nearest {
                    self.put(uav, site);
                    self.open(site);
                }
            }
        }
    }

    /// Improves the assignment of the UAVs of a group and the groups nearest to it.
    fn search_around(&mut self, site: usize, sensor: &SensorParams, switching_cost: f64) {
        let mut group: Vec<usize> = self.centres.nearest_few(self.positions[site], GROUPS);
        group.retain(|site| self.sizes[*site].is_some());
        group.sort_unstable();
        let mut uavs: Vec<usize> = group.iter().flat_map(|site| &self.uav_sets[*site]).copied().collect();
        uavs.sort_unstable();
        let sizes: Vec<_> = group.iter().map(|site| self.sizes[*site].clone()).collect();
        let available: Vec<AvailableUav> = uavs.iter().map(|uav| self.uavs[*uav]).collect();
        let sites: Vec<CandidateGroup<'_>> = group.iter().map(|site| self.sites[*site]).collect();
        let problem = Problem::with_sizes(&available, &sites, &sizes, sensor, switching_cost);
        let number = |uav: &usize| uavs.partition_point(|other| other < uav);
        let before: Vec<UavSet> = group.iter().map(|site| self.uav_sets[*site].iter().map(number).collect()).collect();
        let after = improve(&problem, before.clone(), TRIALS);
        for ((site, before), after) in group.iter().zip(&before).zip(after) {
            if *before != after {
                after.iter().for_each(|uav| self.site_of[uavs[*uav]] = Some(*site));
                self.uav_sets[*site] = after.into_iter().map(|uav| uavs[uav]).collect();
                self.open(*site);
            }
        }
    }
}

/// Mean of the positions that are numbers.
fn centre(members: &[Position]) -> Position {
    let valid = || members.iter().filter(|member| finite(**member) == **member);
    let count = valid().count().max(1) as f64;
    let sum = valid().fold((0.0, 0.0), |sum, member| (sum.0 + member.x_m(), sum.1 + member.y_m()));
    finite(Position::from_m(sum.0 / count, sum.1 / count))
}

/// The position, or the origin instead of one that is not a number.
fn finite(position: Position) -> Position {
    if position.is_finite() { position } else { Position::ORIGIN }
}
