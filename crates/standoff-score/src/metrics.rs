//! Metric names, labels and units, and the selection of the metrics to compute.

use serde::ser::{Serialize, SerializeMap, Serializer};
use standoff_io::display_text::{did_you_mean, nearest, quoted};
use standoff_record::ReportedTables;

use crate::mean;

/// Worse direction of a metric.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum WorseDirection {
    /// Smaller values are worse.
    Small,
    /// Larger values are worse.
    Large,
}

/// Label and comparison settings of a metric; `docs/user/metrics.md` has the definitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MetricInfo {
    /// Name of the metric.
    pub name: &'static str,
    /// Section of the results table that shows the metric.
    pub section: &'static str,
    /// Short label for users.
    pub label: &'static str,
    /// True if the values of single runs are whole numbers.
    pub is_count: bool,
    /// Worse direction of the metric, `None` if it has no preferred one: a consistent filter has an `anees` of 1, and
    /// fewer handoffs may be good or bad.
    pub worse: Option<WorseDirection>,
    /// Smallest difference of practical interest, in the metric's unit: designs that differ by less are equivalent,
    /// even if the difference is statistically significant.
    pub interest: f64,
}

/// Display unit and conversion factor by suffix of the metric name; longer suffixes come first.
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

impl MetricInfo {
    /// Returns the display unit of a metric and the factor that converts its value to that unit. Fractions are shown in
    /// percent.
    #[must_use]
    pub fn unit(metric: &str) -> (&'static str, f64) {
        let plain = metric.trim_end_matches("_settled").trim_end_matches("_max");
        let (_, unit, factor) = UNITS.iter().find(|(end, ..)| plain.ends_with(end)).copied().unwrap_or_default();
        (unit, factor)
    }

    /// Returns the information about the metric with this name.
    #[must_use]
    pub fn of(metric: &str) -> Option<&'static Self> {
        Metrics::ABOUT.iter().find(|about| about.name == metric)
    }
}

/// Defines the metrics in one order, in sections: their fields, names, labels and the serialisation of the selected
/// ones.
macro_rules! metrics {
    ($(#[$struct_doc:meta])* $name:ident {
        $($section:literal {
            $($(#[$doc:meta])* $field:ident: $type:ident, $label:literal, $worse:expr, $interest:literal, $needs:expr;)*
        })*
    }) => {
        $(#[$struct_doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        pub struct $name { $($($(#[$doc])* pub $field: Option<$type>,)*)* }

        impl $name {
            /// All names, in the order of [`Self::values`].
            pub const NAMES: &'static [&'static str] = &[$($(stringify!($field),)*)*];

            /// Information about every metric, in the same order.
            pub const ABOUT: &'static [MetricInfo] = &[$($(
                MetricInfo {
                    name: stringify!($field),
                    section: $section,
                    label: $label,
                    is_count: matches!(stringify!($type).as_bytes(), b"u64"),
                    worse: $worse,
                    interest: $interest,
                },
            )*)*];

            /// All values, in the order of [`Self::NAMES`].
            pub fn values(&self) -> [Option<f64>; Self::NAMES.len()] {
                [$($(self.$field.map(|value| value as f64),)*)*]
            }

            /// Sets the metrics to `None` that need data the controller does not report.
            pub(crate) fn only_by(mut self, reported: ReportedTables) -> Self {
                $($(self.$field = self.$field.filter(|_| reported.has($needs));)*)*
                self
            }

            /// Replaces the metrics of the team state of one agent by the weighted means of `others`.
            pub(crate) fn averaged(mut self, others: &[(Self, u64)]) -> Self {
                $($(if is_of_one_agent(stringify!($field), $needs) {
                    let values = others.iter().filter_map(|(of, times)| Some((of.$field? as f64, *times)));
                    self.$field = mean::weighted(values).map(|value| value as $type);
                })*)*
                self
            }

            /// Names of the metrics of the team state of one agent.
            fn of_team_states() -> impl Iterator<Item = &'static str> {
                let all = [$($((stringify!($field), $needs),)*)*];
                all.into_iter().filter(|(name, needs)| is_of_one_agent(name, *needs)).map(|(name, _)| name)
            }
        }

        impl Serialize for SelectedMetrics {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut map = serializer.serialize_map(None)?;
                $($(if self.choice.includes(&[stringify!($field)]) {
                    map.serialize_entry(stringify!($field), &self.metrics.$field)?;
                })*)*
                map.end()
            }
        }
    };
}

const SMALL: Option<WorseDirection> = Some(WorseDirection::Small);
const LARGE: Option<WorseDirection> = Some(WorseDirection::Large);
const NEITHER: Option<WorseDirection> = None;

// Data that the controller has to report for a metric to be computed.
const NOTHING: ReportedTables = ReportedTables::NOTHING;
const TRACKS: ReportedTables = ReportedTables { tracks: true, ..NOTHING };
const GROUPS: ReportedTables = ReportedTables { groups: true, ..NOTHING };
const BOTH: ReportedTables = ReportedTables { tracks: true, groups: true, ..NOTHING };
const EVENTS: ReportedTables = ReportedTables { events: true, ..NOTHING };

/// True if a metric depends on tracks or groups, and hence on the team state of one agent. The fractions of target time are
/// computed for all agents together, because they count the time without a running agent, too.
fn is_of_one_agent(name: &str, needs: ReportedTables) -> bool {
    (needs.tracks || needs.groups) && !["custody_fraction", "ungrouped_fraction"].contains(&name)
}

metrics! {
    /// Scores of a run, defined in `docs/user/metrics.md`. A value is `None` if it was not selected or if nothing could be
    /// measured, for example the phase error of a single UAV.
    Metrics {
        "Custody" {
            /// Fraction of target time in custody (in a group and in some UAV's view), 0 to 1.
            custody_fraction: f64, "target time in custody", SMALL, 0.01, BOTH;
            /// Fraction of target time in some UAV's view, in a group or not, 0 to 1.
            in_view_fraction: f64, "target time in view of a UAV", SMALL, 0.01, NOTHING;
            /// Longest uninterrupted time that an existing target was out of view, s.
            longest_out_of_view_s: f64, "longest time a target was out of view", LARGE, 1.0, NOTHING;
            /// Fraction of target time in no group, 0 to 1.
            ungrouped_fraction: f64, "target time in no group", LARGE, 0.01, BOTH;
            /// Fraction of group-member time out of view, 0 to 1.
            member_out_of_view_fraction: f64, "group-member time out of view", LARGE, 0.001, BOTH;
            /// Longest uninterrupted time that a group member was out of view, s.
            member_longest_out_of_view_s: f64, "longest time a group member was out of view", LARGE, 0.5, BOTH;
            /// Fraction of target losses after which the target came back into custody, 0 to 1.
            reacquired_fraction: f64, "lost targets reacquired", SMALL, 0.02, BOTH;
            /// Mean time from such a loss until the target is in custody again, reacquired targets only, s.
            reacquisition_time_s: f64, "time to reacquire a lost target", LARGE, 5.0, BOTH;
            /// Largest off-boresight angle of the group members of a UAV, mean over time and UAVs, degrees.
            off_boresight_mean_deg: f64, "outermost member's off-boresight angle, mean", LARGE, 0.5, BOTH;
            /// Maximum of those angles.
            off_boresight_max_deg: f64, "outermost member's off-boresight angle, maximum", LARGE, 1.0, BOTH;
        }
        "Estimation" {
            /// Mean position error of the estimates of group members, m.
            position_error_m: f64, "position error", LARGE, 0.1, BOTH;
            /// Mean position error of members of groups with one assigned UAV, m.
            position_error_single_uav_m: f64, "position error, groups with one UAV", LARGE, 0.1, BOTH;
            /// Mean position error of members of groups with two or more assigned UAVs, m.
            position_error_multi_uav_m: f64, "position error, groups with two or more UAVs", LARGE, 0.1, BOTH;
            /// Mean velocity error of the estimates of group members, m/s.
            velocity_error_m_s: f64, "velocity error", LARGE, 0.05, BOTH;
            /// Mean position error of all tracked targets, m.
            position_error_all_m: f64, "position error of all tracks", LARGE, 0.5, TRACKS;
            /// Average normalised estimation error squared of group members, divided by the number of random states; 1
            /// is consistent.
            anees: f64, "ANEES of group members", NEITHER, 0.05, BOTH;
            /// `anees` of the targets that never manoeuvre, if the scenario has manoeuvring targets.
            anees_nonmanoeuvring: f64, "ANEES, targets without manoeuvres", NEITHER, 0.05, BOTH;
            /// `anees` of the targets that manoeuvre.
            anees_manoeuvring: f64, "ANEES, manoeuvring targets", NEITHER, 0.05, BOTH;
            /// Normalised innovation squared, divided by the number of measured values; 1 is consistent.
            nis: f64, "NIS", NEITHER, 0.02, TRACKS;
            /// Root-mean-square position error of group members divided by its Cramer-Rao bound.
            position_crlb_ratio: f64, "position error / Cramer-Rao bound", NEITHER, 0.01, BOTH;
            /// Root-mean-square velocity error of group members divided by its Cramer-Rao bound.
            velocity_crlb_ratio: f64, "velocity error / Cramer-Rao bound", NEITHER, 0.01, BOTH;
            /// Mean squared position error of group members, m2.
            position_squared_error_m2: f64, "mean squared position error", NEITHER, 1.0, BOTH;
            /// Mean of its Cramer-Rao bound over the same samples, m2.
            position_crlb_m2: f64, "Cramer-Rao bound of the position", NEITHER, 1.0, BOTH;
            /// Mean squared velocity error of group members, m2/s2.
            velocity_squared_error_m2_s2: f64, "mean squared velocity error", NEITHER, 0.1, BOTH;
            /// Mean of its Cramer-Rao bound over the same samples, m2/s2.
            velocity_crlb_m2_s2: f64, "Cramer-Rao bound of the velocity", NEITHER, 0.1, BOTH;
        }
        "Association" {
            /// Root-mean-square GOSPA of the targets and tracks in view, m.
            gospa_m: f64, "GOSPA", LARGE, 0.5, TRACKS;
            /// Part of `gospa_m` due to position errors, m.
            gospa_localisation_m: f64, "GOSPA, position errors", LARGE, 0.5, TRACKS;
            /// Mean number of targets in view without a track within the cut-off.
            gospa_missed: f64, "targets in view without track", LARGE, 0.05, TRACKS;
            /// Mean number of tracks in view without a target within the cut-off.
            gospa_false: f64, "tracks in view without target", LARGE, 0.05, TRACKS;
            /// Number of times that a track changed its target.
            track_swaps: u64, "tracks that changed their target", LARGE, 0.1, TRACKS;
            /// Number of tracks that had no target for more than 90 % of their time.
            false_tracks: u64, "false tracks", LARGE, 0.1, TRACKS;
            /// Fraction of the time of targets with a track in which it is the track that the target had longest, 0 to 1.
            track_purity: f64, "track purity", SMALL, 0.01, TRACKS;
            /// Fraction of the targets in view of a scan that were detected, 0 to 1.
            detected_fraction: f64, "targets in view detected", SMALL, 0.01, NOTHING;
        }
        "Guidance" {
            /// Standoff distance r_d (15) from the agents' estimates, m.
            standoff_distance_m: f64, "desired standoff distance", NEITHER, 5.0, GROUPS;
            /// |r - r_d| with the true target positions, m.
            standoff_error_m: f64, "standoff error", LARGE, 0.5, BOTH;
            /// |r - r_d| with the agents' own estimate of the centre and of (15), m.
            standoff_error_own_estimate_m: f64, "standoff error (own estimate)", LARGE, 0.5, GROUPS;
            /// `standoff_error_m` of UAVs that have arrived on the orbit of their group, m.
            standoff_error_on_orbit_m: f64, "standoff error on the orbit", LARGE, 0.5, BOTH;
            /// Fraction of the time of UAVs with a group before they arrive on its orbit, 0 to 1.
            transit_fraction: f64, "UAV time in transit to an orbit", LARGE, 0.01, BOTH;
            /// `standoff_error_m` from `transient_s` on.
            standoff_error_m_settled: f64, "standoff error, settled", LARGE, 0.5, BOTH;
            /// `standoff_error_own_estimate_m` from `transient_s` on.
            standoff_error_own_estimate_m_settled: f64, "standoff error (own estimate), settled", LARGE, 0.5, GROUPS;
            /// `standoff_error_m_settled` relative to the unfiltered orbit of the time step, without motion limits.
            standoff_error_unfiltered_m_settled: f64, "standoff error (unfiltered orbit), settled", LARGE, 0.5, BOTH;
            /// Part of `standoff_error_m_settled` that no guidance law can predict, m.
            orbit_prediction_error_m_settled: f64, "one-step orbit prediction error", NEITHER, 0.2, BOTH;
            /// Part of `standoff_error_own_estimate_m_settled` that no guidance law can predict, m.
            own_orbit_prediction_error_m_settled: f64, "one-step orbit prediction error (own estimate)", NEITHER, 0.2, BOTH;
            /// Deviation from the desired phase, degrees.
            phase_error_deg: f64, "phase error", LARGE, 0.5, BOTH;
            /// Fraction of the time of UAVs with a pointed sensor without a feasible orbit, 0 to 1.
            infeasible_fraction: f64, "UAV time without a feasible orbit", LARGE, 0.01, GROUPS;
            /// Fraction of the time of UAVs with a pointed sensor with the turn rate at its limit, 0 to 1.
            turn_rate_saturated_fraction: f64, "UAV time with the turn rate at its limit", LARGE, 0.01, NOTHING;
            /// `turn_rate_saturated_fraction` from `transient_s` on.
            turn_rate_saturated_fraction_settled: f64, "UAV time with the turn rate at its limit, settled", LARGE, 0.01, NOTHING;
            /// Fraction of UAV time with a pointed sensor in which the law commands a speed outside the limits, 0 to 1.
            speed_saturated_fraction: f64, "UAV time with the speed at a limit", LARGE, 0.01, NOTHING;
            /// Reversals of the turn direction per UAV and minute.
            turn_reversals_per_min: f64, "turn reversals per UAV and minute", LARGE, 0.5, NOTHING;
        }
        "Separation and geofences" {
            /// Smallest horizontal distance between any two UAVs, m.
            separation_min_m: f64, "minimum separation", SMALL, 10.0, NOTHING;
            /// Smallest horizontal distance between two UAVs at the same altitude, m.
            separation_min_same_altitude_m: f64, "minimum separation at the same altitude", SMALL, 10.0, NOTHING;
            /// Smallest horizontal distance between two UAVs assigned to the same group, m.
            separation_min_same_group_m: f64, "minimum separation within a group", SMALL, 10.0, GROUPS;
            /// Number of times that two UAVs violated both minima of `[separation]`, or 50 m and 30 m by default.
            separation_violations: u64, "separation violations", LARGE, 0.1, NOTHING;
            /// Total time that UAVs spent on collision avoidance, s.
            avoidance_time_s: f64, "UAV time spent on collision avoidance", LARGE, 5.0, NOTHING;
            /// Number of times that a UAV entered a keep-out zone or left a keep-in zone. `None` without zones.
            zone_violations: u64, "geofence violations", LARGE, 0.1, NOTHING;
            /// Fraction of UAV time in which the geofence changed the flown command, 0 to 1. `None` without zones.
            geofence_detour_fraction: f64, "UAV time on geofence detours", LARGE, 0.01, NOTHING;
        }
        "Coordination" {
            /// Completed handoffs.
            handoffs: u64, "completed handoffs", NEITHER, 0.1, EVENTS;
            /// Targets removed from a group because no orbit could cover them.
            removals: u64, "targets removed from groups", NEITHER, 0.1, EVENTS;
            /// Changes of the assigned group per UAV and minute.
            reassignments_per_uav_min: f64, "reassignments per UAV and minute", LARGE, 0.05, GROUPS;
            /// Fraction of target time in two groups simultaneously that both have assigned UAVs, 0 to 1.
            duplicate_coverage_fraction: f64, "target time covered by two groups", LARGE, 0.01, NOTHING;
        }
        "Communication" {
            /// Fraction of time steps at which two or more agents disagree about the assignments, 0 to 1.
            assignment_disagreement_fraction: f64, "time with disagreement about assignments", LARGE, 0.01, NOTHING;
            /// Time from the end of the last fault to the last time step with such a disagreement, s.
            reconvergence_time_s: f64, "time to agree after the last fault", LARGE, 1.0, NOTHING;
            /// Mean delay between a time step and its commit, s.
            commit_lag_s: f64, "commit lag, mean", LARGE, 1.0, NOTHING;
            /// Maximum of these delays.
            commit_lag_max_s: f64, "commit lag, maximum", LARGE, 1.0, NOTHING;
            /// Mean data rate sent per UAV, bytes/s.
            sent_bytes_per_s: f64, "data rate sent per UAV, mean", LARGE, 50.0, NOTHING;
            /// Data rate of the UAV that sends most, bytes/s.
            sent_bytes_per_s_max: f64, "data rate sent per UAV, maximum", LARGE, 50.0, NOTHING;
            /// Fraction of agent time in which retransmissions wait because their budget is spent, 0 to 1.
            retransmission_limited_fraction: f64, "agent time with limited retransmission", LARGE, 0.01, NOTHING;
        }
    }
}

impl Metrics {
    /// Returns the value of a metric by its name; `None` if the name is unknown or nothing was measured.
    pub fn value(&self, name: &str) -> Option<f64> {
        Self::NAMES.iter().position(|known| *known == name).and_then(|index| self.values()[index])
    }

    /// Metrics that compare several agents; `None` if one agent acts for the whole team.
    pub const AGREEMENT: &'static [&'static str] = &[
        "assignment_disagreement_fraction",
        "reconvergence_time_s",
        "duplicate_coverage_fraction",
        "commit_lag_s",
        "commit_lag_max_s",
        "sent_bytes_per_s",
        "sent_bytes_per_s_max",
        "retransmission_limited_fraction",
    ];

    /// Ratios pooled over runs as the square root of the ratio of two means: ratio, numerator, denominator. Selecting
    /// the ratio selects all three.
    pub const POOLED: [(&'static str, &'static str, &'static str); 2] = [
        ("position_crlb_ratio", "position_squared_error_m2", "position_crlb_m2"),
        ("velocity_crlb_ratio", "velocity_squared_error_m2_s2", "velocity_crlb_m2_s2"),
    ];
}

/// Metrics with a selection; serialised as a map from the selected names to their values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelectedMetrics {
    /// Values of the metrics.
    pub metrics: Metrics,
    /// Metrics that were selected.
    pub choice: MetricSelection,
}

impl SelectedMetrics {
    /// Returns the value of a selected metric; the inner value is `None` if nothing was measured.
    pub fn get(&self, name: &str) -> Option<Option<f64>> {
        let index = Metrics::NAMES.iter().position(|known| *known == name)?;
        self.choice.includes(&[name]).then(|| self.metrics.values()[index])
    }
}

/// Selection of metrics; metrics that are not selected are not computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MetricSelection(u128);

/// Metrics that compare a run with theoretical limits. They take longer than most and are computed on request only.
const LIMITS: &[&str] = &[
    "orbit_prediction_error_m_settled",
    "own_orbit_prediction_error_m_settled",
    "nis",
    "position_crlb_ratio",
    "velocity_crlb_ratio",
    "position_squared_error_m2",
    "position_crlb_m2",
    "velocity_squared_error_m2_s2",
    "velocity_crlb_m2_s2",
];

/// Metrics of sensors that do not detect every target or report no identities: those of the section on association. They
/// are computed on request only.
pub(crate) fn association() -> Vec<&'static str> {
    Metrics::ABOUT.iter().filter(|about| about.section == "Association").map(|about| about.name).collect()
}

/// Columns of Table II.
const TABLE_2: &[&str] = &[
    "position_error_m",
    "velocity_error_m_s",
    "standoff_error_m",
    "standoff_error_own_estimate_m",
    "phase_error_deg",
    "off_boresight_mean_deg",
];

impl MetricSelection {
    /// All metrics.
    pub const ALL: Self = Self((1 << Metrics::NAMES.len()) - 1);

    /// Default selection: all metrics except the comparisons with limits and those of the association.
    pub fn standard() -> Self {
        Self(Self::ALL.0 & !Self::of(LIMITS).0 & !Self::of(&association()).0)
    }

    /// Parses a comma-separated list of metric names and sets (`standard`, `limits`, `association`, `table-2`,
    /// `all`).
    pub fn parse(list: &str) -> Result<Self, String> {
        let mut choice = Self(0);
        for word in list.split(',').map(str::trim).filter(|word| !word.is_empty()) {
            choice.0 |= match word {
                "all" => Self::ALL.0,
                "standard" => Self::standard().0,
                "limits" => Self::of(LIMITS).0,
                "association" => Self::of(&association()).0,
                "table-2" => Self::of(TABLE_2).0,
                name if bit(name).is_none() => {
                    let advice = match nearest(name, Metrics::NAMES) {
                        Some(near) => did_you_mean(near),
                        None => {
                            format!(
                                "allowed: standard, limits, association, table-2, all, {}",
                                Metrics::NAMES.join(", ")
                            )
                        }
                    };
                    return Err(format!("{}: no such metric; {advice}", quoted(name)));
                }
                name => Self::of(&[name]).0,
            };
        }
        for (ratio, numerator, denominator) in Metrics::POOLED {
            if choice.includes(&[ratio]) {
                choice.0 |= Self::of(&[numerator, denominator]).0;
            }
        }
        if choice.0 == 0 { Err("must name at least one metric".to_owned()) } else { Ok(choice) }
    }

    /// Returns the selected names, in the order of [`Metrics::NAMES`].
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Metrics::NAMES.iter().enumerate().filter(move |(index, _)| self.0 & (1 << index) != 0).map(|(_, name)| *name)
    }

    /// Returns the selected metrics that depend on tracks or groups: each of several agents has its own values.
    pub(crate) fn of_team_states(self) -> Self {
        Self(Metrics::of_team_states().filter_map(bit).fold(0, |bits, bit| bits | bit) & self.0)
    }

    /// True if nothing is selected.
    pub(crate) fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// True if any of these metrics is selected.
    pub(crate) fn includes(self, names: &[&str]) -> bool {
        self.0 & Self::of(names).0 != 0
    }

    /// True if any metric is selected that needs the Cramer-Rao bound.
    pub(crate) fn needs_bound(self) -> bool {
        Metrics::POOLED.iter().any(|(ratio, error, bound)| self.includes(&[ratio, error, bound]))
    }

    fn of(names: &[&str]) -> Self {
        Self(names.iter().filter_map(|name| bit(name)).fold(0, |bits, bit| bits | bit))
    }
}

fn bit(name: &str) -> Option<u128> {
    Metrics::NAMES.iter().position(|known| *known == name).map(|index| 1 << index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parsed_selection_is_in_the_order_of_the_metrics() {
        let names = |list: &str| MetricSelection::parse(list).map(|choice| choice.names().collect::<Vec<_>>());
        assert_eq!(names("anees, position_error_m").unwrap(), ["position_error_m", "anees"]);
        assert_eq!(names("all").unwrap(), Metrics::NAMES);
        assert!(names("table-2,handoffs").unwrap().contains(&"phase_error_deg"));
        assert_eq!(names("standard,limits,association").unwrap(), Metrics::NAMES);
        assert!(!names("standard").unwrap().contains(&"nis"));
        assert!(names("speed").unwrap_err().contains("no such metric"));
        assert!(names("").is_err());
    }

    /// A pooled ratio also selects its numerator and denominator, and every set contains only known metrics.
    #[test]
    fn pooled_ratio_selects_its_numerator_and_denominator() {
        for (ratio, numerator, denominator) in Metrics::POOLED {
            let chosen: Vec<_> = MetricSelection::parse(ratio).unwrap().names().collect();
            assert_eq!(chosen, [ratio, numerator, denominator]);
        }
        for set in [LIMITS, &association(), TABLE_2] {
            assert_eq!(MetricSelection::of(set).names().count(), set.len());
        }
    }
}
