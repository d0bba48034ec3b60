//! Why something happened, in words for people, from the columns of its event.

use crate::frame::EventRow;

impl EventRow {
    /// Why, in words: from the columns, or as `reason` has it where they do not tell, as in records of versions that had
    /// no such columns, and of brains with events of their own.
    #[must_use]
    pub fn why(&self) -> String {
        told(self).unwrap_or_else(|| self.reason.clone())
    }
}

fn told(event: &EventRow) -> Option<String> {
    let plain = match (event.kind.as_str(), event.cause.as_deref().unwrap_or_default()) {
        ("cued", _) => "handed over by a search aircraft",
        ("acquired", _) => "measured for the first time",
        ("reacquired", _) => "measured again",
        ("lost", "widened") => "unseen until its position was too uncertain",
        ("lost", "vanished") => "unseen where it should be in plain view",
        ("lost", "diverged") => "its estimate broke down",
        ("group-founded", cause) => return founded(cause, event.members?),
        ("group-dissolved", "empty") => "its last member is gone",
        ("group-dissolved", "too-many") => "the smallest, and fewer groups can be served now",
        ("group-dissolved", "not-needed") => "others hold all of its targets, and its UAVs can watch others",
        ("group-dissolved", "merged") => {
            let others = count(event.together?, "unassigned target");
            let into = event.into_group?;
            return Some(format!("its UAVs can watch {others}, and group {into} can hold its own"));
        }
        ("group-dissolved", "outnumbered") => {
            let others = format!("{} targets, its own and unassigned ones, fit on one orbit", event.together?);
            return Some(format!("its UAVs can watch more: {others}"));
        }
        ("joined", _) => "an orbit with it keeps the whole group in view",
        ("taken-back", _) => "an orbit with it keeps the whole group in view again",
        ("regrouped", "split") => "its group was split: there are UAVs for another one",
        ("regrouped", "merged") => "its group ends, and a neighbour's orbit holds it too",
        ("handoff-requested", _) => {
            let dwell = format!("nearer to the new group; in both for {:.1} s", event.dwell_s?);
            return Some(format!("{dwell}, in which the new group's UAVs reach the orbit with it"));
        }
        ("handoff-completed", "received") => "the new group has it in view",
        ("handoff-completed", "passing-cannot-hold") => "the old group's orbit can hold it no longer",
        ("handoff-completed", "passing-ends") => "the old group ends",
        ("handoff-completed", "undelayed") => "at once: the dwell is switched off",
        ("handoff-withdrawn" | "left-out", cause) => match cause {
            "wanted-elsewhere" => "at the end of the dwell it is nearer to another group",
            "receiving-cannot-hold" => "the new group's orbit cannot hold it",
            "not-seen" => "no UAV of the new group got it into view in time",
            "group-ends" => "its old or its new group ends",
            "target-lost" => "its track was lost",
            _ => return None,
        },
        ("discarded", "too-wide") => {
            let [needed, allowed] = told_apart(event.needed_m?, event.allowed_m?);
            let orbit = format!("keeping it needs an orbit of {needed} m, the largest is {allowed} m");
            return Some(format!("furthest from the centre; {orbit}"));
        }
        ("discarded", "diverging") => {
            let [threshold, limit] = told_apart(event.threshold_m2_s?, event.limit_m2_s?);
            let runs_away = "furthest from the centre, and its orbit runs away from the UAVs";
            return Some(format!("{runs_away}: xi_th {threshold} m2/s, below {limit} m2/s for too long"));
        }
        ("discarded", "too-fast") => {
            let (speed_m_s, limit_m_s) = (event.speed_m_s?, event.limit_m_s?);
            let of = format!("of a group that outruns the UAVs, which fly {limit_m_s:.0} m/s at most");
            return Some(format!("the fastest, at {speed_m_s:.0} m/s, {of}"));
        }
        ("reassigned", "group-founded") => "a group was founded",
        ("reassigned", "group-dissolved") => "a group has ended",
        ("reassigned", "group-changed") => {
            "a group has twice, or half, as many targets as when UAVs were last assigned"
        }
        ("reassigned", "unwatched") => "one UAV to the new group: its targets would else be unwatched",
        ("reassigned", "pair") => "its group has ended, and two UAVs tell more of the other one than one",
        ("reassigned", "uav-joined") => "a UAV has joined the team",
        ("reassigned", "uav-lost") => "a UAV has been silent for too long",
        ("reassigned", "search-ended") => "a UAV is back from a search",
        ("reassigned", "own-law") => "the assignment law wants it so",
        ("search-started", _) => "no group needs it, and the target can still be near where it was lost",
        ("search-ended", "found") => "the target was measured again",
        ("search-ended", "given-up") => "the target can be anywhere by now",
        ("search-ended", "needed") => "a group needs the UAV",
        ("uav-lost", _) => "not heard for too long; the team goes on without it",
        ("uav-joined", _) => "heard for the first time, or again",
        ("orbit-infeasible", "too-wide") => {
            let [smallest, largest] = told_apart(event.needed_m?, event.allowed_m?);
            let needed = format!("view, turn rate and r_d,min need an orbit of at least {smallest} m");
            return Some(format!("{needed}, r_d,max and the sensing range allow at most {largest} m"));
        }
        ("orbit-infeasible", "too-fast") => "the group's centre is as fast as the UAVs can be",
        ("orbit-feasible", _) => "an orbit satisfies every constraint again",
        ("orbit-cut", cause) => {
            let left = 100.0 * event.clear_fraction?;
            let zone = zone_of(cause, event.zone?)?;
            return Some(format!("{zone} leaves {left:.0} % of its orbit; it is flown in part, and around"));
        }
        ("orbit-barred", cause) => {
            let zone = zone_of(cause, event.zone?)?;
            return Some(format!("{zone} leaves nothing of its orbit; UAVs fly a wider one, or as near as they can"));
        }
        ("orbit-clear", _) => "no zone cuts its orbit any more",
        ("uavs-close", _) => {
            return Some(format!("two UAVs at its altitude are {:.0} m apart", event.distance_m?));
        }
        ("avoidance", _) => {
            let (uav, other) = match (&event.uavs[..], event.intruder) {
                (&[uav, other], None) => (uav, format!("UAV {other}")),
                (&[uav], Some(intruder)) => (uav, format!("intruder {intruder}")),
                _ => return None,
            };
            return Some(format!("UAV {uav} would have come within {:.0} m of {other}", event.distance_m?));
        }
        ("uavs-apart", _) => "no two UAVs at its altitude are too close any more",
        _ => return None,
    };
    Some(plain.to_owned())
}

/// A zone, by its kind and its place among all.
fn zone_of(kind: &str, zone: u32) -> Option<String> {
    ["keep-out", "keep-in"].contains(&kind).then(|| format!("the {kind} zone {}", zone + 1))
}

fn founded(cause: &str, members: u32) -> Option<String> {
    let which = match (cause, members) {
        ("first", 1) => " by itself",
        ("first", _) => " near one another",
        ("scarce", 1) => " that would else be in no group; not every group has two UAVs now",
        ("scarce", _) => " that one orbit holds and would else be in no group; not every group has two UAVs now",
        ("unassigned", 1) => " that was in no group",
        ("unassigned", _) => " that were in no group",
        ("split", _) => " split off: there are UAVs for another group",
        _ => return None,
    };
    Some(count(members, "target") + which)
}

fn count(n: u32, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

/// Two values that differ, whole if that tells them apart, else with the decimals it takes.
fn told_apart(a: f64, b: f64) -> [String; 2] {
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
    fn what_is_needed_never_reads_like_what_is_allowed() {
        let wide = |kind, needed_m, allowed_m| {
            EventRow { needed_m: Some(needed_m), allowed_m: Some(allowed_m), ..event(kind, "too-wide") }.why()
        };
        for (needed_m, words) in [
            (896.2, "an orbit of 896 m, the largest is 700 m"),
            (700.3, "an orbit of 700.3 m, the largest is 700.0 m"),
            (700.0004, "an orbit of 700.0004 m, the largest is 700.0000 m"),
        ] {
            let why = wide("discarded", needed_m, 700.0);
            assert!(why.ends_with(words), "{why}");
        }
        let why = wide("orbit-infeasible", 499.8, 499.6);
        assert!(why.contains("at least 499.8 m") && why.contains("at most 499.6 m"), "{why}");
        let xi =
            EventRow { threshold_m2_s: Some(-6000.4), limit_m2_s: Some(-6000.0), ..event("discarded", "diverging") };
        assert!(xi.why().contains("xi_th -6000.4 m2/s, below -6000.0 m2/s"), "{}", xi.why());
    }

    #[test]
    fn one_target_is_not_near_another() {
        let why = |members| EventRow { members: Some(members), ..event("group-founded", "first") }.why();
        assert_eq!([why(1), why(3)], ["1 target by itself", "3 targets near one another"]);
    }

    #[test]
    fn it_is_told_why_a_group_has_one_uav_or_two() {
        let founded = EventRow { members: Some(3), ..event("group-founded", "scarce") }.why();
        assert!(founded.starts_with("3 targets") && founded.ends_with("not every group has two UAVs now"), "{founded}");
        let (alone, pair) = (event("reassigned", "unwatched").why(), event("reassigned", "pair").why());
        assert!(alone.contains("would else be unwatched") && pair.contains("two UAVs tell more"), "{alone} {pair}");
    }

    /// A record of a version without the columns has no cause, a brain of somebody else its own kinds.
    #[test]
    fn where_the_columns_do_not_tell_the_words_of_the_record_do() {
        let old = EventRow { cause: None, ..event("lost", "") };
        for told in [old, event("lost", "eaten"), event("daydreamt", "widened"), event("discarded", "too-wide")] {
            assert_eq!(told.why(), "so", "{told:?}");
        }
        assert_eq!(event("lost", "widened").why(), "unseen until its position was too uncertain");
    }
}
