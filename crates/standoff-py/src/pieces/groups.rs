//! Who belongs together and who watches whom: the smallest circle, clusters (30), the assignment (32, 33).

use pyo3::prelude::*;
use standoff::coordination::assignment::{AvailableUav, Site, assign};
use standoff::coordination::clustering::{self as k_means, Clusters};
use standoff::{GroupId, Position, SmallestCircle, UavId};

use super::array::{COORDINATE_M, DISTANCE_M, Given, Made, PATIENCE, Rows, common, each, shape};
use super::parameters::Parameters;
use crate::asked_for::{Whole, count};
use crate::failure::InputError;

/// Whoever stands in no group, and a UAV that serves none.
const NONE: i64 = -1;

/// Distances that a clustering may have to measure in one of its passes: a row of so many takes three seconds.
const DISTANCES_MAX: usize = 1_000_000;

/// UAVs, and groups, of one assignment: that of so many takes a second or two with a thousand targets.
const CREW_MAX: usize = 256;

/// UAVs times targets of one assignment.
const LOOKS_MAX: usize = 1_000_000;

/// The smallest circle about points.
///
/// :param position_m: shape (..., k, 2), k points of each row, east and north, m.
/// :param mask: shape (..., k): False where there is no point; what stands there is not looked at.
/// :returns: centre, shape (..., 2), m, and radius, shape (...), m.
/// :raises InputError: an argument of another shape or type, a number out of range, or a row without points.
#[pyfunction]
#[pyo3(signature = (position_m, *, mask=None))]
pub(crate) fn smallest_circle(
    py: Python<'_>,
    position_m: Given<'_>,
    mask: Option<Given<'_>>,
) -> PyResult<(Made<f64>, Made<f64>)> {
    let points = Points::read(&position_m, mask.as_ref())?;
    let circles = each(py, points.rows(), PATIENCE / (1 + points.k), |row| SmallestCircle::of(points.of_row(row)))?;
    let of_row = |(row, circle): (usize, Option<SmallestCircle>)| {
        let what = || format!("position_m: row {row} (of all leading axes, in order) has no point, so no circle");
        circle.ok_or_else(|| InputError::new_err(what()))
    };
    let circles = circles.into_iter().enumerate().map(of_row).collect::<PyResult<Vec<SmallestCircle>>>()?;
    let centres = circles.iter().map(|circle| [circle.centre.x_m(), circle.centre.y_m()]).collect::<Vec<_>>();
    let radius_m = circles.iter().map(|circle| circle.radius_m).collect();
    Ok((Made::of(py, &points.lead, &[2], centres.into_flattened())?, Made::of(py, &points.lead, &[], radius_m)?))
}

/// Number of groups for so many UAVs and targets: half the UAVs, halves rounded up, never more than the targets
/// (the K of Algorithm 1).
///
/// :param uavs: how many UAVs.
/// :param targets: how many targets.
/// :returns: how many groups.
/// :raises InputError: a number below 0.
#[pyfunction]
pub(crate) fn group_count(uavs: Whole, targets: Whole) -> PyResult<usize> {
    let (uavs, targets) = (count("uavs", uavs, 0)?, count("targets", targets, 0)?);
    Ok(k_means::group_count(uavs as usize, targets as usize))
}

/// K-means: points near one another form a cluster, and none is empty (30, Algorithm 1).
///
/// :param position_m: shape (..., k, 2), k points of each row, east and north, m.
/// :param count: how many clusters to each row; fewer where there are fewer points.
/// :param before: shape (..., k), labels to go on from, 0 to count - 1, each at least once; from nothing if left out.
/// :param margin_m: with ``before``: a point changes its cluster only if that brings it nearer to its centroid by more
///     than this, m; the paper has none.
/// :param mask: shape (..., k): False where there is no point; what stands there is not looked at.
/// :returns: labels, shape (..., k), 0 to count - 1; -1 where there is no point.
/// :raises InputError: an argument of another shape or type, or a number out of range.
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
    let count = count.ok_or_else(|| InputError::new_err("count: there is at least 1 cluster"))?;
    if !DISTANCE_M.contains(margin_m) {
        return Err(InputError::new_err(format!("margin_m = {margin_m}: must be {DISTANCE_M}")));
    }
    let points = Points::read(&position_m, mask.as_ref())?;
    let k = points.k;
    if k.saturating_mul(count.min(k)) > DISTANCES_MAX {
        return Err(InputError::new_err(format!(
            "{k} points in {} clusters are too many: their product is at most {DISTANCES_MAX}",
            count.min(k)
        )));
    }
    let before = Rows::<i64, 1>::read_if(before.as_ref(), "before", "..., k")?;
    let before = before.map(|before| before.over(&points.all)).transpose()?;
    let mut clusters = Clusters::default();
    let patience = PATIENCE / (1 + k * count.min(k));
    let labels = each(py, points.rows(), patience, |row| {
        let present: Vec<Position> = points.of_row(row).collect();
        match &before {
            None => clusters.found(&present, count),
            Some(before) => {
                let labels = points.indices(row).map(|index| before.one(index));
                let is_label = |label: &i64| (0..count as i64).contains(label);
                clusters.of = labels.filter(is_label).map(|label| label as usize).collect();
                let count = count.min(present.len());
                let is_kept =
                    clusters.of.len() == present.len() && (0..count).all(|label| clusters.of.contains(&label));
                if !is_kept || clusters.of.iter().any(|label| *label >= count) {
                    return Err(row);
                }
                clusters.refine(&present, count, margin_m);
            }
        }
        let mut of = clusters.of.iter();
        let label =
            |index: usize| if points.is_there(index) { of.next().map_or(NONE, |label| *label as i64) } else { NONE };
        Ok((row * k..(row + 1) * k).map(label).collect::<Vec<_>>())
    })?;
    let labels: Result<Vec<Vec<i64>>, usize> = labels.into_iter().collect();
    let labels = labels.map_err(|row| {
        InputError::new_err(format!(
            "before: in row {row} (of all leading axes, in order) not every point has a label from 0 to {}, or not every \
             label has a point",
            count.min(k).saturating_sub(1)
        ))
    })?;
    Made::of(py, &points.all, &[], labels.concat())
}

/// Which UAV serves which group: every one of them one group, so that they tell most about the targets (32, 33, restated:
/// docs/ledger.md).
///
/// Exact up to 12 UAVs, beyond a search of bounded length, alike in every run. With fewer UAVs than groups those with the
/// most targets are served.
///
/// :param uav_position_m: shape (..., u, 2), east and north, m.
/// :param target_position_m: shape (..., t, 2), east and north, m.
/// :param group: shape (..., t), the group of each target, any number from 0; -1: none.
/// :param serves: shape (..., u), the group that each UAV serves until now, or -1: staying counts assignment_inertia.
/// :param parameters: range_sd_m, bearing_sd_rad, objective, assignment_inertia; the paper's Table I if left out.
/// :returns: shape (..., u), the group of each UAV; -1 where there is no group.
/// :raises InputError: an argument of another shape or type, or a number out of range.
#[pyfunction]
#[pyo3(signature = (uav_position_m, target_position_m, group, *, serves=None, parameters=None))]
pub(crate) fn assignment(
    py: Python<'_>,
    uav_position_m: Given<'_>,
    target_position_m: Given<'_>,
    group: Given<'_>,
    serves: Option<Given<'_>>,
    parameters: Option<&Bound<'_, Parameters>>,
) -> PyResult<Made<i64>> {
    let team = Parameters::or_table_1(parameters);
    let uav = Rows::<f64, 2>::read(&uav_position_m, "uav_position_m", "..., u, 2")?.within(COORDINATE_M, None)?;
    let target =
        Rows::<f64, 2>::read(&target_position_m, "target_position_m", "..., t, 2")?.within(COORDINATE_M, None)?;
    let group = Rows::<i64, 1>::read(&group, "group", "..., t")?;
    let serves = Rows::<i64, 1>::read_if(serves.as_ref(), "serves", "..., u")?;
    let ((uav_axes, uavs), (target_axes, targets)) = (uav.outer_axes(), target.outer_axes());
    let (group_axes, grouped) = group.outer_axes();
    let mut outer = vec![uav_axes, target_axes, group_axes];
    let serving = serves.as_ref().map(Rows::outer_axes);
    outer.extend(serving.iter().map(|(axes, _)| *axes));
    let lead = common(&outer)?;
    if grouped != targets || serving.is_some_and(|(_, serving)| serving != uavs) {
        let (wanted, name) = if grouped == targets { (uavs, "serves") } else { (targets, "group") };
        return Err(InputError::new_err(format!("{name}: the last axis must be {wanted} long, one for each position")));
    }
    if uavs > CREW_MAX || uavs * targets > LOOKS_MAX {
        return Err(InputError::new_err(format!(
            "{uavs} UAVs and {targets} targets are too many: at most {CREW_MAX} UAVs, and {LOOKS_MAX} of both multiplied"
        )));
    }
    let (of_uavs, of_targets) = ([&lead[..], &[uavs]].concat(), [&lead[..], &[targets]].concat());
    let (uav, target, group) = (uav.over(&of_uavs)?, target.over(&of_targets)?, group.over(&of_targets)?);
    let serves = serves.map(|serves| serves.over(&of_uavs)).transpose()?;
    let assigned = each(py, lead.iter().product(), PATIENCE / (1 + uavs * uavs * uavs), |row| {
        let (uav_row, target_row) = (row * uavs..(row + 1) * uavs, row * targets..(row + 1) * targets);
        let mut labels: Vec<i64> =
            target_row.clone().map(|index| group.one(index)).filter(|label| *label >= 0).collect();
        labels.sort_unstable();
        labels.dedup();
        if labels.len() > CREW_MAX {
            return Err(labels.len());
        }
        let id = |label: i64| labels.binary_search(&label).ok().map(|index| GroupId(index as u64));
        let mut members = vec![Vec::new(); labels.len()];
        for index in target_row {
            if let Ok(place) = labels.binary_search(&group.one(index)) {
                members[place].push(target.position(index));
            }
        }
        let sites = members.iter().enumerate();
        let sites: Vec<Site<'_>> =
            sites.map(|(place, members)| Site { group: GroupId(place as u64), members }).collect();
        let available = uav_row.enumerate().map(|(number, index)| AvailableUav {
            uav: UavId(number as u32),
            position: uav.position(index),
            serves: serves.as_ref().and_then(|serves| id(serves.one(index))),
        });
        let available: Vec<AvailableUav> = available.collect();
        let (sensor, inertia) = (&team.track.sensor, team.group.assignment_inertia);
        let duties = assign(&available, &sites, sensor, team.group.objective, inertia);
        let mut of = vec![NONE; uavs];
        for duty in duties {
            of[duty.uav.0 as usize] = labels[duty.group.0 as usize];
        }
        Ok(of)
    })?;
    let assigned: Result<Vec<Vec<i64>>, usize> = assigned.into_iter().collect();
    let assigned = assigned
        .map_err(|groups| InputError::new_err(format!("group: {groups} groups are too many: at most {CREW_MAX}")))?;
    Made::of(py, &lead, &[uavs], assigned.concat())
}

/// Rows of k points each, some of which may not be there.
struct Points {
    position: Rows<f64, 2>,
    mask: Rows<bool, 1>,
    /// The leading axes, without that of the points.
    lead: Vec<usize>,
    /// With it.
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
            let what = format!("{name} has the shape {mask_axes}: its last axis must be that of the points, {axes}");
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

    fn is_there(&self, index: usize) -> bool {
        self.mask.one(index)
    }

    /// Of the points that are there.
    fn indices(&self, row: usize) -> impl Iterator<Item = usize> + Clone {
        (row * self.k..(row + 1) * self.k).filter(|index| self.is_there(*index))
    }

    fn of_row(&self, row: usize) -> impl Iterator<Item = Position> + Clone {
        self.indices(row).map(|index| self.position.position(index))
    }
}
