//! What is wrong in print, each with numbers: equations (4), (16), (25), (27), (32) and (33).

mod assignment;
mod euler;
mod feedforward;
mod flight;
mod margin;
mod radius;

use super::flights::Plan;
use super::study::Study;
use crate::failure::Failure;

/// Every erratum.
pub(crate) fn errata(plan: &Plan) -> Result<Vec<Study>, Failure> {
    Ok(vec![
        feedforward::study_feedforward()?,
        euler::study_euler()?,
        radius::study_radius()?,
        margin::study_margin(plan)?,
        assignment::study_assignment(plan)?,
    ])
}
