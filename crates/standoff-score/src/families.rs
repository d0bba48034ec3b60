//! All metric families.

use std::sync::LazyLock;

use crate::metric::{AnyFamily, MetricInfo};

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

/// Returns all families without data, in the order of the results table.
pub(crate) fn all() -> [Box<dyn AnyFamily>; 16] {
    [
        Box::<custody::Custody>::default(),
        Box::<off_boresight::OffBoresight>::default(),
        Box::<estimation::Estimation>::default(),
        Box::<consistency::Consistency>::default(),
        Box::<innovation::Innovations>::default(),
        Box::<cramer_rao::CramerRao>::default(),
        Box::<association::Association>::default(),
        Box::<standoff::Standoff>::default(),
        Box::<prediction_error::PredictionErrors>::default(),
        Box::<phase::Phase>::default(),
        Box::<control_effort::ControlEffort>::default(),
        Box::<separation::Separations>::default(),
        Box::<geofence::Zones>::default(),
        Box::<coordination::Coordination>::default(),
        Box::<duplicate_coverage::DuplicateCoverage>::default(),
        Box::<agreement::Agreement>::default(),
    ]
}

static METRICS: LazyLock<Vec<MetricInfo>> =
    LazyLock::new(|| all().iter().flat_map(|family| family.metrics()).collect());

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
