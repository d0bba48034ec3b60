//! The metrics by name, and which of them are wanted.

use serde::Serialize;

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

/// Defines the metrics: their fields and their names, in one order.
macro_rules! metrics {
    ($(#[$struct_doc:meta])* $name:ident { $($(#[$doc:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$struct_doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Serialize)]
        pub struct $name { $($(#[$doc])* pub $field: $type,)* }

        impl $name {
            /// All names, in the order of [`Self::values`].
            pub const NAMES: &'static [&'static str] = &[$(stringify!($field)),*];

            /// All values, in the order of [`Self::NAMES`].
            pub fn values(&self) -> [Option<f64>; Self::NAMES.len()] {
                [$(self.$field.value()),*]
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
    }
}

/// Which metrics are wanted: what nobody wants is not computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice(u64);

/// Sets of metrics with a name of their own.
const SETS: [(&str, &[&str]); 1] = [(
    "table-2",
    &[
        "position_error_m",
        "velocity_error_m_s",
        "standoff_error_m",
        "standoff_tracking_error_m",
        "phase_error_deg",
        "line_of_sight_deg",
    ],
)];

impl Choice {
    /// Every metric.
    pub const ALL: Self = Self((1 << Metrics::NAMES.len()) - 1);

    /// The metrics of a comma-separated list of names and of sets: `table-2`, `all`.
    pub fn parse(list: &str) -> Result<Self, String> {
        let mut choice = Self(0);
        for word in list.split(',').map(str::trim).filter(|word| !word.is_empty()) {
            let set = SETS.iter().find(|(name, _)| *name == word).map(|(_, metrics)| *metrics);
            match (word, set) {
                ("all", _) => choice.0 |= Self::ALL.0,
                (_, Some(set)) => set.iter().for_each(|name| choice.0 |= bit(name).unwrap_or(0)),
                (name, None) => {
                    choice.0 |= bit(name).ok_or_else(|| {
                        format!("\"{name}\": no such metric; there are all, table-2, {}", Metrics::NAMES.join(", "))
                    })?;
                }
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
        names.iter().any(|name| bit(name).is_some_and(|bit| self.0 & bit != 0))
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
        assert!(names("speed").unwrap_err().contains("no such metric"));
        assert!(names("").is_err());
    }
}
