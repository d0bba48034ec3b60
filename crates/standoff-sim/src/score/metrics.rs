//! The metrics by name, what there is to know of each, and which of them are wanted.

use serde::ser::{Serialize, SerializeMap, Serializer};

use super::mean;
use crate::frame::Reported;

/// The end of a metric's values at which runs are bad.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum BadEnd {
    /// Small values are bad.
    Small,
    /// Large values are bad.
    Large,
}

/// What there is to know of a metric besides its definition in `docs/metrics.md`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct About {
    /// Its name.
    pub name: &'static str,
    /// What it is, in a few words.
    pub words: &'static str,
    /// At which end of its values runs are bad; `None` where that is not known: a consistent filter has an `anees` of 1,
    /// and fewer handoffs may be good or bad.
    pub bad: Option<BadEnd>,
    /// The size of interest: two designs that differ by less are alike, however surely they differ; in the metric's unit.
    pub interest: f64,
}

/// By the end of a metric's name, the longer first: the unit in which it is shown, and the factor into it.
const UNITS: [(&str, &str, f64); 10] = [
    ("_per_s", "B/s", 1.0),
    ("_m2_s2", "m\u{b2}/s\u{b2}", 1.0),
    ("_m_s", "m/s", 1.0),
    ("_m2", "m\u{b2}", 1.0),
    ("_deg", "\u{b0}", 1.0),
    ("_fraction", "%", 100.0),
    ("_min", "1/min", 1.0),
    ("_m", "m", 1.0),
    ("_s", "s", 1.0),
    ("", "", 1.0),
];

impl About {
    /// The unit in which a metric is shown to people, and what its value is multiplied by for that: shares are shown in
    /// percent.
    #[must_use]
    pub fn unit(metric: &str) -> (&'static str, f64) {
        let plain = metric.strip_suffix("_settled").unwrap_or(metric);
        let (_, unit, factor) = UNITS.iter().find(|(end, ..)| plain.ends_with(end)).copied().unwrap_or_default();
        (unit, factor)
    }

    /// Of a metric by its name.
    #[must_use]
    pub fn of(metric: &str) -> Option<&'static Self> {
        Metrics::ABOUT.iter().find(|about| about.name == metric)
    }
}

/// Defines the metrics: their fields, their names, what is to be known of them, and how those chosen are serialised, in
/// one order.
macro_rules! metrics {
    ($(#[$struct_doc:meta])* $name:ident {
        $($(#[$doc:meta])* $field:ident: $type:ty, $words:literal, $bad:expr, $interest:literal, $needs:expr;)*
    }) => {
        $(#[$struct_doc])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $name { $($(#[$doc])* pub $field: Option<$type>,)* }

        impl $name {
            /// All names, in the order of [`Self::values`].
            pub const NAMES: &'static [&'static str] = &[$(stringify!($field)),*];

            /// What there is to know of each, in the same order.
            pub const ABOUT: &'static [About] = &[$(
                About { name: stringify!($field), words: $words, bad: $bad, interest: $interest }
            ),*];

            /// All values, in the order of [`Self::NAMES`].
            pub fn values(&self) -> [Option<f64>; Self::NAMES.len()] {
                [$(self.$field.map(|value| value as f64)),*]
            }

            /// Those that can be told by what is reported; the others are `None`.
            pub(super) fn only_by(mut self, reported: Reported) -> Self {
                $(self.$field = self.$field.filter(|_| reported.has($needs));)*
                self
            }

            /// Those that are of tracks or groups, as the mean of others, each counted so often.
            pub(super) fn averaged(mut self, others: &[(Self, u64)]) -> Self {
                $(if is_of_picture($needs) {
                    let values = others.iter().filter_map(|(of, times)| Some((of.$field? as f64, *times)));
                    self.$field = mean::weighted(values).map(|value| value as $type);
                })*
                self
            }

            /// The names of these.
            fn of_pictures() -> impl Iterator<Item = &'static str> {
                [$((stringify!($field), $needs)),*].into_iter().filter(|(_, needs)| is_of_picture(*needs)).map(|(name, _)| name)
            }
        }

        impl Serialize for Chosen {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut map = serializer.serialize_map(None)?;
                $(if self.choice.wants(&[stringify!($field)]) {
                    map.serialize_entry(stringify!($field), &self.metrics.$field)?;
                })*
                map.end()
            }
        }
    };
}

const SMALL: Option<BadEnd> = Some(BadEnd::Small);
const LARGE: Option<BadEnd> = Some(BadEnd::Large);
const NEITHER: Option<BadEnd> = None;

// What a brain has to report for a metric to be told.
const NOTHING: Reported = Reported::NOTHING;
const TRACKS: Reported = Reported { tracks: true, ..NOTHING };
const GROUPS: Reported = Reported { groups: true, ..NOTHING };
const BOTH: Reported = Reported { tracks: true, groups: true, ..NOTHING };
const EVENTS: Reported = Reported { events: true, ..NOTHING };

/// What is of tracks or groups is of one mind's picture.
fn is_of_picture(needs: Reported) -> bool {
    needs.tracks || needs.groups
}

metrics! {
    /// The scores of a run, defined in `docs/metrics.md`; `None` where there was nothing to measure (the phase of a
    /// single UAV, say) or nothing was asked for.
    Metrics {
        /// Share of the time of existing targets in which they are in a group and in some UAV's view, 0 to 1.
        watched_fraction: f64, "time of targets in a group and in some UAV's view", SMALL, 0.01, BOTH;
        /// Share of the time of existing targets in which they are in some UAV's view, in a group or not, 0 to 1.
        seen_fraction: f64, "time of targets in some UAV's view, group or not", SMALL, 0.01, NOTHING;
        /// Longest time without a break that an existing target was in no view, s.
        longest_gap_s: f64, "longest time of a target in no view", LARGE, 1.0, NOTHING;
        /// Share of the losses of targets that had been watched after which one was watched again, 0 to 1.
        refound_fraction: f64, "losses of watched targets that were found again", SMALL, 0.02, BOTH;
        /// Mean time from such a loss until the target is watched again, of those found, s.
        refind_time_s: f64, "time until lost targets are found again", LARGE, 5.0, BOTH;
        /// Estimated against true position of group members, m.
        position_error_m: f64, "position error", LARGE, 0.1, BOTH;
        /// The same of the members of groups that one UAV serves, m.
        position_error_one_m: f64, "position error, one UAV to the group", LARGE, 0.1, BOTH;
        /// The same of the members of groups that two UAVs or more serve, m.
        position_error_more_m: f64, "position error, two UAVs or more to the group", LARGE, 0.1, BOTH;
        /// Estimated against true velocity of group members, m/s.
        velocity_error_m_s: f64, "velocity error", LARGE, 0.05, BOTH;
        /// Estimated against true position of every known target, m.
        position_error_all_m: f64, "position error, all known targets", LARGE, 0.5, TRACKS;
        /// The agents' own r_d (15), m.
        standoff_distance_m: f64, "standoff distance", NEITHER, 5.0, GROUPS;
        /// |r - r_d| by the true geometry, m.
        standoff_error_m: f64, "standoff error, true geometry", LARGE, 0.5, BOTH;
        /// |r - r_d| by the agents' own centre and (15), m.
        standoff_tracking_error_m: f64, "standoff error, the agents' own view", LARGE, 0.5, GROUPS;
        /// `standoff_error_m` from `settle_s` on.
        standoff_error_m_settled: f64, "standoff error, true geometry, settled", LARGE, 0.5, BOTH;
        /// `standoff_tracking_error_m` from `settle_s` on.
        standoff_tracking_error_m_settled: f64, "standoff error, own view, settled", LARGE, 0.5, GROUPS;
        /// `standoff_error_m_settled` against the orbit of the instant, without its motion.
        standoff_error_instant_m_settled: f64, "standoff error, no motion allowed, settled", LARGE, 0.5, BOTH;
        /// Distance from the wanted separation, degrees.
        phase_error_deg: f64, "phase error", LARGE, 0.5, BOTH;
        /// Largest angle between boresight and a group member, mean over time and UAVs, degrees.
        line_of_sight_deg: f64, "furthest member off boresight, mean", LARGE, 0.5, BOTH;
        /// The largest of those angles.
        line_of_sight_max_deg: f64, "furthest member off boresight, at worst", LARGE, 1.0, BOTH;
        /// Share of the time of group members in no view, 0 to 1.
        out_of_view_fraction: f64, "time of group members in no view", LARGE, 0.001, BOTH;
        /// Longest time without a break that one was in no view, s.
        out_of_view_longest_s: f64, "longest time of a group member in no view", LARGE, 0.5, BOTH;
        /// Share of the time of existing targets in no group, 0 to 1.
        uncovered_fraction: f64, "time of targets in no group", LARGE, 0.01, BOTH;
        /// Share of UAV-time without a feasible orbit, 0 to 1.
        infeasible_fraction: f64, "time without a feasible orbit", LARGE, 0.01, GROUPS;
        /// Share of UAV-time with the turn rate at its limit, 0 to 1.
        turn_rate_saturated_fraction: f64, "time with turn rate at its limit", LARGE, 0.01, NOTHING;
        /// Share of UAV-time, with a pointed sensor, in which the law asks for a speed outside the limits, 0 to 1.
        speed_saturated_fraction: f64, "time with speed at a limit", LARGE, 0.01, NOTHING;
        /// Turns the other way per UAV and minute.
        turn_reversals_per_min: f64, "turns the other way, per UAV and minute", LARGE, 0.5, NOTHING;
        /// Changes of group per UAV and minute.
        reassignments_per_uav_min: f64, "calls to another group, per UAV and minute", LARGE, 0.05, GROUPS;
        /// Smallest horizontal distance between any two UAVs, m.
        separation_min_m: f64, "smallest separation of two UAVs", SMALL, 10.0, NOTHING;
        /// The same of two at one altitude, m.
        separation_min_layer_m: f64, "smallest separation of two UAVs at one altitude", SMALL, 10.0, NOTHING;
        /// The same of two of one group, m.
        separation_min_group_m: f64, "smallest separation of two UAVs of a group", SMALL, 10.0, GROUPS;
        /// Times that two UAVs came nearer than both minima of `[separation]`, or than 50 m and 30 m.
        separation_violations: u64, "times that two UAVs came too near", LARGE, 0.1, NOTHING;
        /// Time that UAVs spent keeping away from one another, all together, s.
        separation_time_s: f64, "time spent keeping away from other UAVs", LARGE, 5.0, NOTHING;
        /// Times that a UAV came where a zone does not let it; where there are zones.
        zone_violations: u64, "times a UAV entered a keep-out, or left a keep-in", LARGE, 0.1, NOTHING;
        /// Share of UAV-time in which zones changed what was flown, 0 to 1; where there are zones.
        zone_detour_fraction: f64, "time on ways around zones", LARGE, 0.01, NOTHING;
        /// Completed handoffs.
        handoffs: u64, "handoffs", NEITHER, 0.1, EVENTS;
        /// Targets removed from a group because no orbit could hold them.
        discards: u64, "discards", NEITHER, 0.1, EVENTS;
        /// Share of the instants at which two minds or more differ in who serves which group, 0 to 1.
        crews_differ_fraction: f64, "time in which minds differ in who serves which group", LARGE, 0.01, NOTHING;
        /// From the end of the last fault to the last instant at which they do, s.
        agreement_delay_s: f64, "time from the end of the last fault until they agree", LARGE, 1.0, NOTHING;
        /// Share of the time of existing targets under two crewed groups at once, 0 to 1.
        double_served_fraction: f64, "time of targets under two crewed groups at once", LARGE, 0.01, NOTHING;
        /// From the instant up to which nothing can change any more to now, s.
        commit_lag_s: f64, "time until nothing can change any more", LARGE, 1.0, NOTHING;
        /// The longest of those times.
        commit_lag_max_s: f64, "time until nothing can change any more, at worst", LARGE, 1.0, NOTHING;
        /// What a UAV sends, bytes/s.
        bytes_per_s: f64, "sent by a UAV", LARGE, 50.0, NOTHING;
        /// The same of the UAV that sends most.
        bytes_max_per_s: f64, "sent by the UAV that sends most", LARGE, 50.0, NOTHING;
        /// Instants of minds whose picture knows more than was said, each report counted once: 0.
        double_count: u64, "pictures in which something counts twice", LARGE, 0.1, NOTHING;
        /// Normalised estimation error squared of group members over the number of random states; 1 is consistent.
        anees: f64, "consistency of estimates (1 is right)", NEITHER, 0.05, BOTH;
        /// The same of the targets that never manoeuvre, where some do.
        anees_quiet: f64, "consistency, targets that never manoeuvre (1 is right)", NEITHER, 0.05, BOTH;
        /// The same of those that manoeuvre.
        anees_manoeuvring: f64, "consistency, targets that manoeuvre (1 is right)", NEITHER, 0.05, BOTH;
        /// What of `standoff_error_m_settled` no guidance can know, m.
        standoff_surprise_m_settled: f64, "standoff surprise, true geometry", NEITHER, 0.2, BOTH;
        /// What of `standoff_tracking_error_m_settled` no guidance can know, m.
        standoff_tracking_surprise_m_settled: f64, "standoff surprise, own view", NEITHER, 0.2, BOTH;
        /// Normalised innovation squared over the numbers measured; 1 is consistent.
        nis: f64, "consistency of innovations (1 is right)", NEITHER, 0.02, TRACKS;
        /// Root-mean-square position error of group members over its Cramer-Rao bound.
        position_bound_ratio: f64, "position error over its bound", NEITHER, 0.01, BOTH;
        /// The same of the velocity.
        velocity_bound_ratio: f64, "velocity error over its bound", NEITHER, 0.01, BOTH;
        /// Mean squared position error of group members, m2.
        position_squared_error_m2: f64, "position error squared", NEITHER, 1.0, BOTH;
        /// Mean of its Cramer-Rao bound over the same samples, m2.
        position_bound_m2: f64, "position bound", NEITHER, 1.0, BOTH;
        /// Mean squared velocity error of group members, m2/s2.
        velocity_squared_error_m2_s2: f64, "velocity error squared", NEITHER, 0.1, BOTH;
        /// Mean of its Cramer-Rao bound over the same samples, m2/s2.
        velocity_bound_m2_s2: f64, "velocity bound", NEITHER, 0.1, BOTH;
    }
}

impl Metrics {
    /// The value of a metric by its name; `None` where there is no such metric or nothing was measured.
    pub fn value(&self, name: &str) -> Option<f64> {
        Self::NAMES.iter().position(|known| *known == name).and_then(|index| self.values()[index])
    }

    /// What is told of several minds; of one for all there is nothing.
    pub const AGREEMENT: &'static [&'static str] = &[
        "crews_differ_fraction",
        "agreement_delay_s",
        "double_served_fraction",
        "commit_lag_s",
        "commit_lag_max_s",
        "bytes_per_s",
        "bytes_max_per_s",
        "double_count",
    ];

    /// Ratios that are pooled over runs, as the root of the ratio of two means over all runs: ratio, numerator,
    /// denominator. Choosing the ratio chooses all three.
    pub const POOLED: [(&'static str, &'static str, &'static str); 2] = [
        ("position_bound_ratio", "position_squared_error_m2", "position_bound_m2"),
        ("velocity_bound_ratio", "velocity_squared_error_m2_s2", "velocity_bound_m2_s2"),
    ];
}

/// Metrics of which only the chosen ones are told; serialised as a map from name to value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chosen {
    /// The values.
    pub metrics: Metrics,
    /// Which of them were asked for.
    pub choice: Choice,
}

impl Chosen {
    /// The value of a metric, if it was chosen; inside, `None` if there was nothing to measure.
    pub fn get(&self, name: &str) -> Option<Option<f64>> {
        let index = Metrics::NAMES.iter().position(|known| *known == name)?;
        self.choice.wants(&[name]).then(|| self.metrics.values()[index])
    }
}

/// Which metrics are wanted: what nobody wants is not computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice(u64);

/// Metrics whose working out takes longer than most: they compare with limits, and are worked out where asked for.
const LIMITS: &[&str] = &[
    "standoff_surprise_m_settled",
    "standoff_tracking_surprise_m_settled",
    "nis",
    "position_bound_ratio",
    "velocity_bound_ratio",
    "position_squared_error_m2",
    "position_bound_m2",
    "velocity_squared_error_m2_s2",
    "velocity_bound_m2_s2",
];

/// What is worked out beside every mind, for half as much work again, and only where asked for.
const AUDIT: &str = "double_count";

/// The columns of Table II.
const TABLE_2: &[&str] = &[
    "position_error_m",
    "velocity_error_m_s",
    "standoff_error_m",
    "standoff_tracking_error_m",
    "phase_error_deg",
    "line_of_sight_deg",
];

impl Choice {
    /// Every metric.
    pub const ALL: Self = Self((1 << Metrics::NAMES.len()) - 1);

    /// What a run is told by if nothing else is asked for: all but what compares it with limits, and `double_count`.
    pub fn standard() -> Self {
        Self(Self::ALL.0 & !Self::of(LIMITS).0 & !Self::of(&[AUDIT]).0)
    }

    /// The metrics of a comma-separated list of names and of sets: `standard`, `limits`, `table-2`, `all`.
    pub fn parse(list: &str) -> Result<Self, String> {
        let mut choice = Self(0);
        for word in list.split(',').map(str::trim).filter(|word| !word.is_empty()) {
            choice.0 |= match word {
                "all" => Self::ALL.0,
                "standard" => Self::standard().0,
                "limits" => Self::of(LIMITS).0,
                "table-2" => Self::of(TABLE_2).0,
                name if bit(name).is_none() => {
                    let names = Metrics::NAMES.join(", ");
                    return Err(format!(
                        "\"{name}\": no such metric; there are the sets standard, limits, table-2 and all, and {names}"
                    ));
                }
                name => Self::of(&[name]).0,
            };
        }
        for (ratio, numerator, denominator) in Metrics::POOLED {
            if choice.wants(&[ratio]) {
                choice.0 |= Self::of(&[numerator, denominator]).0;
            }
        }
        if choice.0 == 0 { Err("names no metric".to_owned()) } else { Ok(choice) }
    }

    /// The chosen names, in the order of [`Metrics::NAMES`].
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Metrics::NAMES.iter().enumerate().filter(move |(index, _)| self.0 & (1 << index) != 0).map(|(_, name)| *name)
    }

    /// Those of tracks or groups: where minds are several, each has its own.
    pub(super) fn of_pictures(self) -> Self {
        Self(Metrics::of_pictures().filter_map(bit).fold(0, |bits, bit| bits | bit) & self.0)
    }

    /// Somebody has to look for what counts twice.
    pub(crate) fn wants_audit(self) -> bool {
        self.wants(&[AUDIT])
    }

    /// Nothing is chosen.
    pub(super) fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Any of these is chosen.
    pub(crate) fn wants(self, names: &[&str]) -> bool {
        self.0 & Self::of(names).0 != 0
    }

    /// Anything is chosen for which the Cramer-Rao bound is worked out.
    pub(crate) fn wants_bound(self) -> bool {
        Metrics::POOLED.iter().any(|(ratio, error, bound)| self.wants(&[ratio, error, bound]))
    }

    fn of(names: &[&str]) -> Self {
        Self(names.iter().filter_map(|name| bit(name)).fold(0, |bits, bit| bits | bit))
    }
}

fn bit(name: &str) -> Option<u64> {
    Metrics::NAMES.iter().position(|known| *known == name).map(|index| 1 << index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_holds_what_was_named_in_the_metrics_own_order() {
        let names = |list: &str| Choice::parse(list).map(|choice| choice.names().collect::<Vec<_>>());
        assert_eq!(names("anees, position_error_m").unwrap(), ["position_error_m", "anees"]);
        assert_eq!(names("all").unwrap(), Metrics::NAMES);
        assert!(names("table-2,handoffs").unwrap().contains(&"phase_error_deg"));
        assert_eq!(names("standard,limits,double_count").unwrap(), Metrics::NAMES);
        assert!(!names("standard").unwrap().contains(&"nis"));
        assert!(names("speed").unwrap_err().contains("no such metric"));
        assert!(names("").is_err());
    }

    /// What is pooled over runs needs its two parts, and every set is made of metrics that there are.
    #[test]
    fn a_pooled_ratio_brings_its_parts() {
        for (ratio, numerator, denominator) in Metrics::POOLED {
            let chosen: Vec<_> = Choice::parse(ratio).unwrap().names().collect();
            assert_eq!(chosen, [ratio, numerator, denominator]);
        }
        for set in [LIMITS, TABLE_2] {
            assert_eq!(Choice::of(set).names().count(), set.len());
        }
    }
}
