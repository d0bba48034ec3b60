//! Grouping: minimum enclosing circle, clustering (30), and assignment of UAVs to groups (32, 33).

use pyo3::prelude::*;
use standoff::coordination::assignment::{AvailableUav, CandidateGroup, assign};
use standoff::coordination::clustering::{self as k_means, KMeans};
use standoff::{EnclosingCircle, GroupId, Position, UavId};

use super::array::{COORDINATE_M, DISTANCE_M, Given, Made, PATIENCE, Rows, common, each, shape};
use super::parameters::Parameters;
use crate::common_args::{Whole, count};
use crate::exceptions::InputError;

/// Label of a missing point, of a target in no group and of a UAV that is assigned to no group.
const NONE: i64 = -1;

/// Maximum number of point-to-centroid distances in one pass of a clustering. A row of this size takes three seconds.
const DISTANCES_MAX: usize = 1_000_000;

/// Maximum number of UAVs and of groups in one assignment. This size takes a second or two with a thousand targets.
const UAVS_MAX: usize = 256;

/// Maximum number of UAVs times targets in one assignment.
const PAIRS_MAX: usize = 1_000_000;

/// Computes minimum enclosing circles of points.
///
/// :param position_m: shape (..., k, 2), k points of each row, east and north, m.
/// :param mask: shape (..., k): False marks missing points, whose coordinates are ignored.
/// :returns: centre, shape (..., 2), m, and radius, shape (...), m.
/// :raises InputError: if an argument has the wrong shape or type, a value is out of range, or a row has no points.
#[pyfunction]
#[pyo3(signature = (position_m, *, mask=None))]
pub(crate) fn enclosing_circle(
    py: Python<'_>,
    position_m: Given<'_>,
    mask: Option<Given<'_>>,
) -> PyResult<(Made<f64>, Made<f64>)> {
    let points = Points::read(&position_m, mask.as_ref())?;
    let circles = each(py, points.rows(), PATIENCE / (1 + points.k), |row| EnclosingCircle::of(points.of_row(row)))?;
    let of_row = |(row, circle): (usize, Option<EnclosingCircle>)| {
        let what = || format!("position_m: row {row} (counted over all leading axes) has no point");
        circle.ok_or_else(|| InputError::new_err(what()))
    };
    let circles = circles.into_iter().enumerate().map(of_row).collect::<PyResult<Vec<EnclosingCircle>>>()?;
    let centres = circles.iter().map(|circle| [circle.centre.x_m(), circle.centre.y_m()]).collect::<Vec<_>>();
    let radius_m = circles.iter().map(|circle| circle.radius_m).collect();
    Ok((Made::of(py, &points.lead, &[2], centres.into_flattened())?, Made::of(py, &points.lead, &[], radius_m)?))
}

/// Computes the number of groups K of Algorithm 1: half the number of UAVs, rounded up, but at most the number of
/// targets.
///
/// :param uavs: number of UAVs.
/// :param targets: number of targets.
/// :returns: number of groups.
/// :raises InputError: if a number is negative.
#[pyfunction]
pub(crate) fn group_count(uavs: Whole, targets: Whole) -> PyResult<usize> {
    let (uavs, targets) = (count("uavs", uavs, 0)?, count("targets", targets, 0)?);
    Ok(k_means::group_count(uavs as usize, targets as usize))
}

/// Clusters points with k-means (30, Algorithm 1); no cluster is empty.
///
/// :param position_m: shape (..., k, 2), k points of each row, east and north, m.
/// :param count: number of clusters per row; fewer in rows with fewer points.
/// :param before: shape (..., k), labels to start from, 0 to count - 1, each used at least once; by default, new
///     clusters are seeded.
/// :param margin_m: with ``before``: a point changes its cluster only if the new centroid is closer by more than this,
///     m; 0 by default, as in the paper.
/// :param mask: shape (..., k): False marks missing points, whose coordinates are ignored.
/// :returns: labels, shape (..., k), 0 to count - 1; -1 for missing points.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyfunction]
#[pyo3(signature = (position_m, *, count, before=None, margin_m=0.0, mask=None))]
pub(crate) fn clustering(
    py: Python<'_>,
    position_m: Given<'_>,
    count: i64,
    before: Option<Given<'_>>,
    margin_m: f64,
    mask: Option<Given<'_>>,
) -> PyResult<Made<i64>> {
    let count = usize::try_from(count).ok().filter(|count| *count > 0);
    let count = count.ok_or_else(|| InputError::new_err("count: must be at least 1"))?;
    if !DISTANCE_M.contains(margin_m) {
        return Err(InputError::new_err(format!("margin_m = {margin_m}: must be {DISTANCE_M}")));
    }
    let points = Points::read(&position_m, mask.as_ref())?;
    let k = points.k;
    if k.saturating_mul(count.min(k)) > DISTANCES_MAX {
        return Err(InputError::new_err(format!(
            "{k} points in {} clusters are too many: the product must be at most {DISTANCES_MAX}",
            count.min(k)
        )));
    }
    let before = Rows::<i64, 1>::read_if(before.as_ref(), "before", "..., k")?;
    let before = before.map(|before| before.over(&points.all)).transpose()?;
    let mut clusters = KMeans::default();
    let patience = PATIENCE / (1 + k * count.min(k));
    let labels = each(py, points.rows(), patience, |row| {
        let present: Vec<Position> = points.of_row(row).collect();
        match &before {
            None => clusters.seed(&present, count),
            Some(before) => {
                let labels = points.indices(row).map(|index| before.one(index));
                let is_label = |label: &i64| (0..count as i64).contains(label);
                clusters.cluster_of = labels.filter(is_label).map(|label| label as usize).collect();
                let count = count.min(present.len());
                let is_complete = clusters.cluster_of.len() == present.len()
                    && (0..count).all(|label| clusters.cluster_of.contains(&label));
                if !is_complete || clusters.cluster_of.iter().any(|label| *label >= count) {
                    return Err(row);
                }
                clusters.refine(&present, count, margin_m);
            }
        }
        let mut of = clusters.cluster_of.iter();
        let label =
            |index: usize| if points.is_present(index) { of.next().map_or(NONE, |label| *label as i64) } else { NONE };
        Ok((row * k..(row + 1) * k).map(label).collect::<Vec<_>>())
    })?;
    let labels: Result<Vec<Vec<i64>>, usize> = labels.into_iter().collect();
    let labels = labels.map_err(|row| {
        InputError::new_err(format!(
            "before: in row {row} (counted over all leading axes) not every point has a label from 0 to {}, or not \
             every label has a point",
            count.min(k).saturating_sub(1)
        ))
    })?;
    Made::of(py, &points.all, &[], labels.concat())
}

/// Assigns each UAV to one group such that the information about the targets is maximal (32, 33; restated in
/// docs/ledger.md).
///
/// The result is optimal for up to 12 UAVs. For more UAVs, a deterministic search of bounded length is used. With fewer
/// UAVs than groups, the groups with the most targets get UAVs.
///
/// :param uav_position_m: shape (..., u, 2), east and north, m.
/// :param target_position_m: shape (..., t, 2), east and north, m.
/// :param group: shape (..., t), group of each target, any number from 0; -1: no group.
/// :param current_group: shape (..., u), current group of each UAV; -1: no group. Keeping it adds
///     assignment_switching_cost to the objective.
/// :param parameters: uses range_sd_m, bearing_sd_rad, objective, assignment_switching_cost; ``Parameters()`` by
///     default.
/// :returns: shape (..., u), assigned group of each UAV; -1: no group.
/// :raises InputError: if an argument has the wrong shape or type, or a value is out of range.
#[pyfunction]
#[pyo3(signature = (uav_position_m, target_position_m, group, *, current_group=None, parameters=None))]
pub(crate) fn assignment(
    py: Python<'_>,
    uav_position_m: Given<'_>,
    target_position_m: Given<'_>,
    group: Given<'_>,
    current_group: Option<Given<'_>>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<Made<i64>> {
    let team = Parameters::or_recommended(parameters);
    let uav = Rows::<f64, 2>::read(&uav_position_m, "uav_position_m", "..., u, 2")?.within(COORDINATE_M, None)?;
    let target =
        Rows::<f64, 2>::read(&target_position_m, "target_position_m", "..., t, 2")?.within(COORDINATE_M, None)?;
    let group = Rows::<i64, 1>::read(&group, "group", "..., t")?;
    let current_group = Rows::<i64, 1>::read_if(current_group.as_ref(), "current_group", "..., u")?;
    let ((uav_axes, uavs), (target_axes, targets)) = (uav.outer_axes(), target.outer_axes());
    let (group_axes, grouped) = group.outer_axes();
    let mut outer = vec![uav_axes, target_axes, group_axes];
    let current = current_group.as_ref().map(Rows::outer_axes);
    outer.extend(current.iter().map(|(axes, _)| *axes));
    let lead = common(&outer)?;
    if grouped != targets || current.is_some_and(|(_, current)| current != uavs) {
        let (length, name) = if grouped == targets { (uavs, "current_group") } else { (targets, "group") };
        return Err(InputError::new_err(format!("{name}: the last axis must be {length} long, one for each position")));
    }
    if uavs > UAVS_MAX || uavs * targets > PAIRS_MAX {
        return Err(InputError::new_err(format!(
            "{uavs} UAVs and {targets} targets are too many: at most {UAVS_MAX} UAVs and {PAIRS_MAX} UAV-target pairs"
        )));
    }
    let (of_uavs, of_targets) = ([&lead[..], &[uavs]].concat(), [&lead[..], &[targets]].concat());
    let (uav, target, group) = (uav.over(&of_uavs)?, target.over(&of_targets)?, group.over(&of_targets)?);
    let current_group = current_group.map(|current_group| current_group.over(&of_uavs)).transpose()?;
    let assigned = each(py, lead.iter().product(), PATIENCE / (1 + uavs * uavs * uavs), |row| {
        let (uav_row, target_row) = (row * uavs..(row + 1) * uavs, row * targets..(row + 1) * targets);
        let mut labels: Vec<i64> =
            target_row.clone().map(|index| group.one(index)).filter(|label| *label >= 0).collect();
        labels.sort_unstable();
        labels.dedup();
        if labels.len() > UAVS_MAX {
            return Err(labels.len());
        }
        let id = |label: i64| labels.binary_search(&label).ok().map(|index| GroupId(index as u64));
        let mut members = vec![Vec::new(); labels.len()];
        for index in target_row {
            if let Ok(place) = labels.binary_search(&group.one(index)) {
                members[place].push(target.position(index));
            }
        }
        let candidates = members.iter().enumerate();
        let candidates: Vec<CandidateGroup<'_>> =
            candidates.map(|(place, members)| CandidateGroup { group: GroupId(place as u64), members }).collect();
        let available = uav_row.enumerate().map(|(number, index)| AvailableUav {
            uav: UavId(number as u32),
            position: uav.position(index),
            current_group: current_group.as_ref().and_then(|current_group| id(current_group.one(index))),
        });
        let available: Vec<AvailableUav> = available.collect();
        let (sensor, switching_cost) = (&team.track.sensor, team.group.assignment_switching_cost);
        let assignments = assign(&available, &candidates, sensor, team.group.objective, switching_cost);
        let mut of = vec![NONE; uavs];
        for assignment in assignments {
            of[assignment.uav.0 as usize] = labels[assignment.group.0 as usize];
        }
        Ok(of)
    })?;
    let assigned: Result<Vec<Vec<i64>>, usize> = assigned.into_iter().collect();
    let assigned = assigned
        .map_err(|groups| InputError::new_err(format!("group: {groups} groups are too many: at most {UAVS_MAX}")))?;
    Made::of(py, &lead, &[uavs], assigned.concat())
}

/// Rows of k points each; single points may be masked out.
struct Points {
    position: Rows<f64, 2>,
    mask: Rows<bool, 1>,
    /// Leading axes, without the axis of the points.
    lead: Vec<usize>,
    /// Leading axes, with the axis of the points.
    all: Vec<usize>,
    k: usize,
}

impl Points {
    fn read(position_m: &Given<'_>, mask: Option<&Given<'_>>) -> PyResult<Self> {
        let position = Rows::read(position_m, "position_m", "..., k, 2")?;
        let mask = Rows::or(Rows::read_if(mask, "mask", "..., k")?, "mask", [true]);
        let ((_, axes), (name, mask_axes)) = (position.axes(), mask.axes());
        if let (Some(k), Some(masked)) = (axes.last(), mask_axes.last())
            && k != masked
        {
            let (axes, mask_axes) = (shape(axes), shape(mask_axes));
            let what = format!("{name} has the shape {mask_axes}: its last axis must match that of the points, {axes}");
            return Err(InputError::new_err(what));
        }
        let all = common(&[position.axes(), mask.axes()])?;
        let mask = mask.over(&all)?;
        let position = position.over(&all)?.within(COORDINATE_M, Some(&mask))?;
        let (k, lead) = all.split_last().map_or((0, &[][..]), |(k, lead)| (*k, lead));
        Ok(Self { position, mask, lead: lead.to_vec(), k, all: all.clone() })
    }

    fn rows(&self) -> usize {
        self.lead.iter().product()
    }

    fn is_present(&self, index: usize) -> bool {
        self.mask.one(index)
    }

    /// Indices of the points of a row that are not masked out.
    fn indices(&self, row: usize) -> impl Iterator<Item = usize> + Clone {
        (row * self.k..(row + 1) * self.k).filter(|index| self.is_present(*index))
    }

    fn of_row(&self, row: usize) -> impl Iterator<Item = Position> + Clone {
        self.indices(row).map(|index| self.position.position(index))
    }
}
