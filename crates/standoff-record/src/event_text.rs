//! Reason of an event as text, derived from the columns of its row.

use standoff_io::display_text::count;

use crate::frame::{EventRow, NO_TARGET};

/// Returns the name of a target, or of a track of no target.
#[must_use]
pub fn target_name(target: u32, names: &[String]) -> String {
    let number = || match target.checked_sub(NO_TARGET) {
        Some(track) => format!("track {track}"),
        None => format!("target {target}"),
    };
    names.get(target as usize).cloned().unwrap_or_else(number)
}

impl EventRow {
    /// Returns the target concerned, or the number of the track if its target is not known.
    #[must_use]
    pub fn target_or_track(&self) -> Option<u32> {
        self.target.or(self.track)
    }

    /// Returns the reason as text: derived from the columns, or `reason` as stored if the columns do not determine it.
    /// Records of versions without these columns and events of other controllers have only the stored reason.
    #[must_use]
    pub fn reason_text(&self) -> String {
        text(self).unwrap_or_else(|| self.reason.clone())
    }
}

fn text(event: &EventRow) -> Option<String> {
    let (kind, cause) = (event.kind.as_str(), event.cause.as_deref().unwrap_or_default());
    let constant = target_text(kind, cause).or_else(|| team_text(kind, cause));
    constant.map(str::to_owned).or_else(|| text_with_numbers(event, kind, cause))
}

/// Returns the text of an event of a target.
fn target_text(kind: &str, cause: &str) -> Option<&'static str> {
    Some(match (kind, cause) {
        ("cued", _) => "reported by a cue source",
        ("acquired", _) => "measured for the first time",
        ("reacquired", _) => "measured again",
        ("lost", "too-uncertain") => "not measured until its position was too uncertain",
        ("lost", "unseen-in-view") => "not measured where it should be in view",
        ("lost", "diverged") => "its estimate diverged",
        ("admitted", _) => "an orbit with it keeps the whole group in view",
        ("readmitted", _) => "an orbit with it keeps the whole group in view again",
        ("regrouped", "split") => "its group was split, because the UAVs suffice for another group",
        ("regrouped", "merged") => "its group was retired, and the orbit of a neighbouring group covers it",
        ("handoff-completed", "received") => "the new group has it in view",
        ("handoff-completed", "passing-group-cannot-cover") => "the old group's orbit can no longer cover it",
        ("handoff-completed", "passing-group-retired") => "the old group was retired",
        ("handoff-completed", "no-dwell") => "immediate, because the dwell is switched off",
        ("handoff-cancelled" | "not-admitted", cause) => match cause {
            "reassigned-by-clustering" => "at the end of the dwell it is closer to another group",
            "receiving-group-cannot-cover" => "the new group's orbit cannot cover it",
            "not-in-view" => "no UAV of the new group had it in view in time",
            "group-retired" => "its old or its new group was retired",
            "target-lost" => "its track was lost",
            _ => return None,
        },
        _ => return None,
    })
}

/// Returns the text of an event of a group or a UAV.
fn team_text(kind: &str, cause: &str) -> Option<&'static str> {
    Some(match (kind, cause) {
        ("group-retired", "empty") => "it has no members left",
        ("group-retired", "too-many") => "it is the smallest, and the UAVs suffice for fewer groups now",
        ("group-retired", "redundant") => "other groups can cover its targets, and its UAVs are needed elsewhere",
        ("reassigned", "group-created") => "a group was created",
        ("reassigned", "group-retired") => "a group was retired",
        ("reassigned", "group-changed") => {
            "the number of targets of a group has doubled or halved since the last assignment"
        }
        ("reassigned", "untracked") => {
            "one UAV moves to the new group, whose targets would otherwise be in no UAV's view"
        }
        ("reassigned", "pair") => "its group was retired, and two UAVs measure the other group better than one",
        ("reassigned", "uav-joined") => "a UAV has joined the team",
        ("reassigned", "uav-timeout") => "a UAV has been silent for too long",
        ("reassigned", "search-ended") => "a UAV has ended a search",
        ("reassigned", "custom-law") => "the custom assignment law requires it",
        ("search-started", _) => "no group needs the UAV, and the target can still be near its last known position",
        ("search-ended", "found") => "the target was measured again",
        ("search-ended", "given-up") => "the target can be anywhere by now",
        ("search-ended", "recalled") => "a group needs the UAV",
        ("uav-timeout", _) => "silent for too long; the team continues without it",
        ("uav-joined", _) => "its messages arrive for the first time, or again",
        ("orbit-infeasible", "too-fast") => "the group's centre is as fast as the UAVs can be",
        ("orbit-feasible", _) => "an orbit satisfies every constraint again",
        ("orbit-unblocked", _) => "no zone blocks any part of its orbit now",
        ("proximity-cleared", _) => "no two UAVs at its altitude are too close any more",
        ("retransmission-limited", _) => {
            "missing messages wait, because the bandwidth or the budget for retransmissions is spent; commits can be late"
        }
        _ => return None,
    })
}

/// Returns the text of an event with numbers of its row; `None` if one of them is missing.
fn text_with_numbers(event: &EventRow, kind: &str, cause: &str) -> Option<String> {
    Some(match (kind, cause) {
        ("group-created", cause) => created_text(cause, event.members?)?,
        ("group-retired", "merged") => {
            let others = count(event.coverable_targets? as usize, "ungrouped target");
            format!("its UAVs can cover {others}, and group {} can cover its own", event.into_group?)
        }
        ("group-retired", "better-coverage") => {
            let others = format!("{} targets, its own and ungrouped ones, fit on one orbit", event.coverable_targets?);
            format!("its UAVs can cover more: {others}")
        }
        ("handoff-started", _) => {
            let dwell = format!("closer to the new group; in both for {:.1} s", event.dwell_s?);
            format!("{dwell}, until the new group's UAVs have reached the orbit that includes it")
        }
        ("removed", "radius-exceeded") => {
            let [needed, allowed] = distinguished(event.required_radius_m?, event.allowed_radius_m?);
            let orbit = format!("keeping it needs an orbit of {needed} m, the largest allowed is {allowed} m");
            format!("furthest from the centre; {orbit}")
        }
        ("removed", "diverging") => {
            let [threshold, limit] = distinguished(event.threshold_m2_s?, event.limit_m2_s?);
            let diverging = "furthest from the centre, and the UAVs cannot converge to its orbit";
            format!("{diverging}: xi_th {threshold} m2/s, below {limit} m2/s for too long")
        }
        ("removed", "too-fast") => {
            let (speed_m_s, limit_m_s) = (event.speed_m_s?, event.limit_m_s?);
            let of = format!("of a group that is faster than the UAVs, which fly {limit_m_s:.0} m/s at most");
            format!("the fastest target, at {speed_m_s:.0} m/s, {of}")
        }
        ("orbit-infeasible", "radius-exceeded") => {
            let [smallest, largest] = distinguished(event.required_radius_m?, event.allowed_radius_m?);
            let needed = format!("field of view, turn rate and r_d,min need an orbit of at least {smallest} m");
            format!("{needed}, r_d,max and the sensing range allow at most {largest} m")
        }
        ("orbit-partly-blocked", cause) => {
            let (left, zone) = (100.0 * event.clear_fraction?, zone_of(cause, event.zone?)?);
            format!("{zone} leaves {left:.0} % of its orbit free; UAVs fly that part and a detour")
        }
        ("orbit-blocked", cause) => {
            let zone = zone_of(cause, event.zone?)?;
            format!("{zone} blocks all of its orbit; UAVs fly a wider one, or as close as they can")
        }
        ("proximity-alert", _) => format!("two UAVs at its altitude are {:.0} m apart", event.distance_m?),
        ("avoidance", _) => {
            let (uav, other) = avoidance(event)?;
            format!("UAV {uav} would have come within {:.0} m of {other}", event.distance_m?)
        }
        ("separation-given-up", _) => {
            let (uav, other) = avoidance(event)?;
            let limits = "within the limits and the geofence";
            format!("no command of UAV {uav} keeps the minimum separation from {other} {limits}")
        }
        _ => return None,
    })
}

/// UAV that avoids another aircraft, and the name of that aircraft.
fn avoidance(event: &EventRow) -> Option<(u32, String)> {
    match (&event.uavs[..], event.intruder) {
        (&[uav, other], None) => Some((uav, format!("UAV {other}"))),
        (&[uav], Some(intruder)) => Some((uav, format!("intruder {intruder}"))),
        _ => None,
    }
}

/// Names a zone by its kind and its index.
fn zone_of(kind: &str, zone: u32) -> Option<String> {
    ["keep-out", "keep-in"].contains(&kind).then(|| format!("{kind} zone {zone}"))
}

fn created_text(cause: &str, members: u32) -> Option<String> {
    let which = match (cause, members) {
        ("first", 1) => " by itself",
        ("first", _) => " near one another",
        ("uav-shortage", 1) => " that would otherwise be in no group; not every group has two UAVs now",
        ("uav-shortage", _) => {
            " that fit on one orbit and would otherwise be in no group; not every group has two UAVs now"
        }
        ("ungrouped", 1) => " that was in no group",
        ("ungrouped", _) => " that were in no group",
        ("split", _) => " split off, because the UAVs suffice for another group",
        _ => return None,
    };
    Some(count(members as usize, "target") + which)
}

/// Formats two different values with as few decimals as show that they differ.
fn distinguished(a: f64, b: f64) -> [String; 2] {
    let rounded = |digits: usize| [a, b].map(|value| format!("{value:.digits$}"));
    (0..=12).map(rounded).find(|[a, b]| a != b).unwrap_or_else(|| rounded(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(kind: &str, cause: &str) -> EventRow {
        EventRow {
            kind: kind.to_owned(),
            cause: Some(cause.to_owned()),
            reason: "so".to_owned(),
            ..EventRow::default()
        }
    }

    #[test]
    fn needed_and_allowed_radius_never_look_equal() {
        let wide = |kind, required_radius_m, allowed_radius_m| {
            EventRow {
                required_radius_m: Some(required_radius_m),
                allowed_radius_m: Some(allowed_radius_m),
                ..event(kind, "radius-exceeded")
            }
            .reason_text()
        };
        for (required_radius_m, expected) in [
            (896.2, "an orbit of 896 m, the largest allowed is 700 m"),
            (700.3, "an orbit of 700.3 m, the largest allowed is 700.0 m"),
            (700.0004, "an orbit of 700.0004 m, the largest allowed is 700.0000 m"),
        ] {
            let why = wide("removed", required_radius_m, 700.0);
            assert!(why.ends_with(expected), "{why}");
        }
        let why = wide("orbit-infeasible", 499.8, 499.6);
        assert!(why.contains("at least 499.8 m") && why.contains("at most 499.6 m"), "{why}");
        let xi = EventRow { threshold_m2_s: Some(-6000.4), limit_m2_s: Some(-6000.0), ..event("removed", "diverging") };
        assert!(xi.reason_text().contains("xi_th -6000.4 m2/s, below -6000.0 m2/s"), "{}", xi.reason_text());
    }

    #[test]
    fn the_reason_of_a_new_group_depends_on_its_size() {
        let why = |members| EventRow { members: Some(members), ..event("group-created", "first") }.reason_text();
        assert_eq!([why(1), why(3)], ["1 target by itself", "3 targets near one another"]);
    }

    #[test]
    fn the_reason_states_why_a_group_has_one_uav_or_two() {
        let created = EventRow { members: Some(3), ..event("group-created", "uav-shortage") }.reason_text();
        assert!(created.starts_with("3 targets") && created.ends_with("not every group has two UAVs now"), "{created}");
        let (alone, pair) = (event("reassigned", "untracked").reason_text(), event("reassigned", "pair").reason_text());
        assert!(
            alone.contains("would otherwise be in no UAV's view") && pair.contains("two UAVs measure"),
            "{alone} {pair}"
        );
    }

    /// A record of a version without these columns has no cause; other controllers have their own event kinds.
    #[test]
    fn events_without_a_known_cause_keep_the_recorded_reason() {
        let old = EventRow { cause: None, ..event("lost", "") };
        for row in
            [old, event("lost", "eaten"), event("daydreamt", "too-uncertain"), event("removed", "radius-exceeded")]
        {
            assert_eq!(row.reason_text(), "so", "{row:?}");
        }
        assert_eq!(event("lost", "too-uncertain").reason_text(), "not measured until its position was too uncertain");
    }
}
