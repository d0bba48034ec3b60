//! All metric families.

use std::sync::LazyLock;

use crate::metric::{FamilyEntry, MetricInfo};

mod agreement;
pub(crate) mod association;
mod consistency;
mod control_effort;
mod coordination;
pub(crate) mod cramer_rao;
mod custody;
mod duplicate_coverage;
mod estimation;
mod geofence;
mod innovation;
mod off_boresight;
mod phase;
mod prediction_error;
mod separation;
mod standoff;

/// All families, in the order of the results table.
pub(crate) const FAMILIES: &[FamilyEntry] = &[
    FamilyEntry::of::<custody::Custody>(),
    FamilyEntry::of::<off_boresight::OffBoresight>(),
    FamilyEntry::of::<estimation::Estimation>(),
    FamilyEntry::of::<consistency::Consistency>(),
    FamilyEntry::of::<innovation::Innovations>(),
    FamilyEntry::of::<cramer_rao::CramerRao>(),
    FamilyEntry::of::<association::Association>(),
    FamilyEntry::of::<standoff::Standoff>(),
    FamilyEntry::of::<prediction_error::PredictionErrors>(),
    FamilyEntry::of::<phase::Phase>(),
    FamilyEntry::of::<control_effort::ControlEffort>(),
    FamilyEntry::of::<separation::Separation>(),
    FamilyEntry::of::<geofence::Zones>(),
    FamilyEntry::of::<coordination::Coordination>(),
    FamilyEntry::of::<duplicate_coverage::DuplicateCoverage>(),
    FamilyEntry::of::<agreement::Agreement>(),
];

static METRICS: LazyLock<Vec<MetricInfo>> =
    LazyLock::new(|| FAMILIES.iter().flat_map(|family| (family.metrics)()).collect());

impl MetricInfo {
    /// Returns all metrics, in the order of the results table.
    #[must_use]
    pub fn all() -> &'static [Self] {
        &METRICS
    }

    /// Returns the information about the metric with this name.
    #[must_use]
    pub fn of(name: &str) -> Option<&'static Self> {
        METRICS.iter().find(|info| info.name == name)
    }
}
