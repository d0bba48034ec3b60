//! The metrics by name, and which of them are wanted.

use serde::ser::{Serialize, SerializeMap, Serializer};

/// A metric as a plain number; `None` where there was nothing to measure.
trait Value {
    fn value(self) -> Option<f64>;
}

impl Value for Option<f64> {
    fn value(self) -> Option<f64> {
        self
    }
}

impl Value for f64 {
    fn value(self) -> Option<f64> {
        Some(self)
    }
}

impl Value for u64 {
    fn value(self) -> Option<f64> {
        Some(self as f64)
    }
}

/// Defines the metrics: their fields, their names and how those chosen are serialised, in one order.
macro_rules! metrics {
    ($(#[$struct_doc:meta])* $name:ident { $($(#[$doc:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$struct_doc])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $name { $($(#[$doc])* pub $field: $type,)* }

        impl $name {
            /// All names, in the order of [`Self::values`].
            pub const NAMES: &'static [&'static str] = &[$(stringify!($field)),*];

            /// All values, in the order of [`Self::NAMES`].
            pub fn values(&self) -> [Option<f64>; Self::NAMES.len()] {
                [$(self.$field.value()),*]
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

metrics! {
    /// The scores of a run, defined in `docs/metrics.md`; `None` where there was nothing to measure (the phase of a
    /// single UAV, say) or nothing was asked for.
    Metrics {
        /// Estimated against true position of group members, m.
        position_error_m: Option<f64>,
        /// Estimated against true velocity of group members, m/s.
        velocity_error_m_s: Option<f64>,
        /// Estimated against true position of every known target, m.
        position_error_all_m: Option<f64>,
        /// The agents' own r_d (15), m.
        standoff_distance_m: Option<f64>,
        /// |r - r_d| by the true geometry, m.
        standoff_error_m: Option<f64>,
        /// |r - r_d| by the agents' own centre and (15), m.
        standoff_tracking_error_m: Option<f64>,
        /// `standoff_error_m` from `settle_s` on.
        standoff_error_m_settled: Option<f64>,
        /// `standoff_tracking_error_m` from `settle_s` on.
        standoff_tracking_error_m_settled: Option<f64>,
        /// Distance from the wanted separation, degrees.
        phase_error_deg: Option<f64>,
        /// Largest angle between boresight and a group member, mean over time and UAVs, degrees.
        line_of_sight_deg: Option<f64>,
        /// The largest of those angles.
        line_of_sight_max_deg: Option<f64>,
        /// Share of the time of group members in no view, 0 to 1.
        out_of_view_fraction: Option<f64>,
        /// Longest time without a break that one was in no view, s.
        out_of_view_longest_s: f64,
        /// Share of the time of existing targets in no group, 0 to 1.
        uncovered_fraction: Option<f64>,
        /// Share of UAV-time without a feasible orbit, 0 to 1.
        infeasible_fraction: Option<f64>,
        /// Share of UAV-time with the turn rate at its limit, 0 to 1.
        turn_rate_saturated_fraction: Option<f64>,
        /// Smallest distance between two UAVs of one group, m.
        separation_min_m: Option<f64>,
        /// Completed handoffs.
        handoffs: u64,
        /// Targets removed from a group because no orbit could hold them.
        discards: u64,
        /// Normalised estimation error squared of group members over the size of the state; 1 is consistent.
        anees: Option<f64>,
        /// What of `standoff_error_m_settled` no guidance can know, m.
        standoff_surprise_m_settled: Option<f64>,
        /// What of `standoff_tracking_error_m_settled` no guidance can know, m.
        standoff_tracking_surprise_m_settled: Option<f64>,
        /// Normalised innovation squared over the numbers measured; 1 is consistent.
        nis: Option<f64>,
        /// Root-mean-square position error of group members over its Cramer-Rao bound.
        position_bound_ratio: Option<f64>,
        /// The same of the velocity.
        velocity_bound_ratio: Option<f64>,
        /// Mean squared position error of group members, m2.
        position_squared_error_m2: Option<f64>,
        /// Mean of its Cramer-Rao bound over the same samples, m2.
        position_bound_m2: Option<f64>,
        /// Mean squared velocity error of group members, m2/s2.
        velocity_squared_error_m2_s2: Option<f64>,
        /// Mean of its Cramer-Rao bound over the same samples, m2/s2.
        velocity_bound_m2_s2: Option<f64>,
    }
}

impl Metrics {
    /// The value of a metric by its name; `None` where there is no such metric or nothing was measured.
    pub fn value(&self, name: &str) -> Option<f64> {
        Self::NAMES.iter().position(|known| *known == name).and_then(|index| self.values()[index])
    }

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

    /// What a run is told by if nothing else is asked for: all but what compares it with limits.
    pub fn standard() -> Self {
        Self(Self::ALL.0 & !Self::of(LIMITS).0)
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
        assert_eq!(names("standard,limits").unwrap(), Metrics::NAMES);
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
