//! Errata of the paper, each with numerical evidence: equations (4), (16), (25), (27), (32) and (33).

mod assignment;
mod euler;
mod feedforward;
mod flight;
mod margin;
mod radius;

use super::study::Measure;

/// The studies of all errata.
pub(crate) const ERRATA: [Measure; 5] = [
    feedforward::study_feedforward,
    euler::study_euler,
    radius::study_radius,
    margin::study_margin,
    assignment::study_assignment,
];
