//! The margin (16): its weighting is not that of a chi-square variable, and it adds a square without a unit to metres.

use std::collections::BTreeMap;

use standoff::coordination::group_centre::Centroid;
use standoff::coordination::group_centre::GroupCentre;
use standoff::coordination::group_centre::mahalanobis_squared;
use standoff::target::Transition;
use standoff::{Covariance, Estimate as Track, TargetState};
use standoff_record::{Frame, GroupRow, TrackRow};
use standoff_sim::scenario::Scenario;

use crate::claim::{Claim, Finding, Paper};
use crate::error::Failure;
use crate::missions::MISSION;
use crate::monte_carlo_plan::{IN_METRES, Plan, time_s, watch};
use crate::statistics::{Estimate, mean};
use crate::study::{Study, Table};

/// Duration of the evaluation of the orbit after a change of members, s.
const AFTER_S: f64 = 5.0;
/// Mean of a chi-square variable with two degrees of freedom.
const CHI_SQUARE_MEAN: f64 = 2.0;

pub(super) fn study_margin(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "errata",
        "Erratum of (16): the margin",
        format!(
            "The squared distances are evaluated on `paper/table-2-pair`, run by run, after the transient; margin and \
             r_d on `{MISSION}`, for {AFTER_S} s after every change of members, also with the margin in metres of \
             figure 10."
        ),
    );
    compare_weightings(&mut found, &plan.each("paper/table-2-pair", &[], squared_distances)?);
    compare_margins(&mut found, &plan.each(MISSION, &[], jump)?, &plan.each(MISSION, &IN_METRES, jump)?);
    Ok(found)
}

/// Compares the squared distances of the centre's innovation with those of a chi-square variable.
fn compare_weightings(found: &mut Study, runs: &[SquaredDistances]) {
    let mean = |which: fn(&SquaredDistances) -> f64| Estimate::mean(&runs.iter().map(which).collect::<Vec<f64>>());
    let published = mean(|distances| distances.published);
    let mut table = Table::new(
        "Mean squared distance of the centre's innovation with 95 % intervals (2 for a chi-square variable with two \
         degrees of freedom):",
        ["weighted with", "mean", "low", "high"],
    );
    table.estimates("predicted covariance, (16)", [published]);
    table.estimates("covariance of the innovation", [mean(|distances| distances.full)]);
    found.tables.push(table);
    found.claims.push(Claim {
        what: "(16) is the Mahalanobis distance of the centre's innovation: its mean is that of a chi-square variable"
            .into(),
        unit: "",
        finding: Finding::number(CHI_SQUARE_MEAN, published),
        runs: runs.len(),
        reason: "the weighting neglects the covariance of the measured centroid; in addition, the centroid is already \
                 filtered, so that its errors are not white",
    });
}

/// Compares the margins and orbits after changes of members: (16) as published, and a margin in metres.
fn compare_margins(found: &mut Study, square: &[Jump], metres: &[Jump]) {
    let mut table = Table::new(
        format!("After a change of members, `{MISSION}`, largest value of each run:"),
        ["margin", "median margin (m)", "5 %", "95 %", "runs in which r_d reaches r_d,max (%)", "low", "high"],
    );
    for (name, runs) in [("(16) as published", square), ("in metres", metres)] {
        let changed = || runs.iter().filter_map(|jump| Some((jump.margin_m?, jump.at_bound)));
        let margins: Vec<f64> = changed().map(|(margin_m, _)| margin_m).collect();
        let at_bound = Estimate::share(changed().map(|(_, at_bound)| at_bound));
        table.estimates(name, [Estimate::middle(&margins), at_bound]);
    }
    found.tables.push(table);
    found.claims.push(Claim::difference(
        "d_m is a margin for the error of the centre: at a change of members it is not larger than 1.645 standard \
         deviations of that error",
        "m",
        Paper::Less,
        metres.iter().zip(square).filter_map(|(metres, square)| metres.margin_m.zip(square.margin_m)),
        "d_m is a square in units of standard deviations, added to metres; the centroid jumps by tens of metres when a \
         target joins or leaves",
    ));
}

/// Mean squared distance of the centre's innovations in a run, with the published and the full covariance.
struct SquaredDistances {
    published: f64,
    full: f64,
}

/// Recomputes the filter of the centre from the recorded tracks; it restarts whenever the members change.
fn squared_distances(scenario: &Scenario) -> Result<SquaredDistances, Failure> {
    let settings = &scenario.settings;
    let transition = settings.team.track.target.transition(settings.period);
    let (mut published, mut full, mut last, mut members) = (Vec::new(), Vec::new(), None, Vec::new());
    watch(scenario, |frame| {
        let Some(group) = frame.groups.first() else { return };
        let now: Vec<u32> = of_group(frame, group).map(|track| track.target).collect();
        if now != members {
            (last, members) = (None, now);
        }
        let Some(centroid) = centroid(frame, group) else { return };
        let step = last.and_then(|last| innovation(&last, &transition, &centroid));
        if let Some((_, distances)) = step.as_ref().filter(|_| time_s(frame) >= settings.transient.s()) {
            published.push(distances.published);
            full.push(distances.full);
        }
        last = step.map(|(centre, _)| centre).or_else(|| GroupCentre::start(&centroid));
    })?;
    Ok(SquaredDistances { published: mean(&published), full: mean(&full) })
}

/// Returns the next centre, and the squared distances of the centroid from its prediction.
fn innovation(
    last: &GroupCentre,
    transition: &Transition,
    centroid: &Centroid,
) -> Option<(GroupCentre, SquaredDistances)> {
    let expected = transition.predict(&last.estimate().state).position();
    let mut predicted = *last.estimate();
    transition.predict_covariance(&mut predicted.covariance);
    let (measured, p) = (centroid.mean.state.position(), predicted.position_covariance());
    let distances = SquaredDistances {
        published: mahalanobis_squared(measured, expected, &p),
        full: mahalanobis_squared(measured, expected, &(p + centroid.mean.position_covariance())),
    };
    Some((last.advance(transition, centroid)?, distances))
}

/// Returns the centroid of a group's members.
fn centroid(frame: &Frame, group: &GroupRow) -> Option<Centroid> {
    let estimate = |track: &TrackRow| {
        let covariance = Covariance::from_upper_triangle(&track.covariance);
        Track { state: TargetState(track.state.into()), covariance }
    };
    let members: Vec<Track> = of_group(frame, group).map(estimate).collect();
    Centroid::of(members.iter())
}

/// Returns the tracks of a group's members, including those in dwell.
fn of_group<'a>(frame: &'a Frame, group: &GroupRow) -> impl Iterator<Item = &'a TrackRow> {
    let id = Some(group.group);
    frame.tracks.iter().filter(move |track| track.group == id || track.receiving_group == id)
}

/// Changes of the orbits in a run soon after changes of members.
struct Jump {
    /// Largest margin, m; `None` if members never change.
    margin_m: Option<f64>,
    /// True if some r_d reaches its upper bound.
    at_bound: bool,
}

fn jump(scenario: &Scenario) -> Result<Jump, Failure> {
    let radius_max_m = scenario.settings.team.group.standoff.radius_max_m;
    let mut found = Jump { margin_m: None, at_bound: false };
    // By group: its members at the last time step, and the time of their last change.
    let mut groups: BTreeMap<u32, (Vec<u32>, f64)> = BTreeMap::new();
    watch(scenario, |frame| {
        for group in &frame.groups {
            let members: Vec<u32> = of_group(frame, group).map(|track| track.target).collect();
            let (before, changed_s) = groups.entry(group.group).or_insert_with(|| (members.clone(), f64::NEG_INFINITY));
            if *before != members {
                (*before, *changed_s) = (members, time_s(frame));
            }
            if time_s(frame) - *changed_s <= AFTER_S {
                found.margin_m = Some(found.margin_m.map_or(group.margin_m, |most| most.max(group.margin_m)));
                found.at_bound |= group.standoff_distance_m >= radius_max_m;
            }
        }
    })?;
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks Eq. (16): the distance recomputed from the record equals the margin of the flight.
    #[test]
    fn the_recomputed_distance_is_the_margin_of_the_record() {
        let scenario = Plan { runs: 2, first_seed: 3, threads: None, traffic: Vec::new() }
            .first("paper/table-2-pair", &[])
            .map_err(|_| ())
            .unwrap();
        let transition = scenario.settings.team.track.target.transition(scenario.settings.period);
        let (mut last, mut compared) = (None, 0);
        let run = watch(&scenario, |frame| {
            let group = &frame.groups[0];
            let centroid = centroid(frame, group).unwrap();
            let step = last.and_then(|last| innovation(&last, &transition, &centroid));
            if let Some((_, distances)) = &step {
                let rounding = 1e-6 * (1.0 + group.margin_m);
                assert!(
                    (distances.published - group.margin_m).abs() < rounding,
                    "{} {}",
                    distances.published,
                    group.margin_m
                );
                assert!(distances.full < distances.published);
                compared += 1;
            }
            last = step.map(|(centre, _)| centre).or_else(|| GroupCentre::start(&centroid));
        });
        assert!(run.is_ok() && compared > 150, "{compared}");
    }
}
