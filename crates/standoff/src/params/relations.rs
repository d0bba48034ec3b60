//! Checks of parameters that depend on parameters of other structs.

use super::{CentreEstimate, GroupingParams, TeamParams};
use crate::validation::{Allowed, ParamError};

/// The smallest orbit must lie within the sensing range, and the margin of the orbits must leave some of the sensor's
/// field of view.
pub(super) fn of_team(team: &TeamParams, errors: &mut Vec<ParamError>) {
    Allowed::above(team.group.standoff.radius_min_m)
        .with_reason("the centre must be in view from the smallest orbit, radius_min_m")
        .check("track.sensor.sensing_range_m", team.track.sensor.sensing_range_m, errors);
    let (sensor_rad, margin_rad) = (team.track.sensor.field_of_view_rad, team.group.standoff.field_of_view_margin_rad);
    if sensor_rad.is_finite() && margin_rad >= 0.0 {
        Allowed::at_least(0.0).below(sensor_rad).with_reason("the margin must leave some of the field of view").check(
            "group.standoff.field_of_view_margin_rad",
            margin_rad,
            errors,
        );
    }
}

/// The filter of a filtered centre would continue from the centre that the motion model has moved, so that neither
/// would behave as documented.
pub(super) fn of_groups(group: &GroupingParams, errors: &mut Vec<ParamError>) {
    if group.centre == CentreEstimate::Filtered && group.motion.time_constant_s > 0.0 {
        Allowed::exactly(0.0)
            .with_reason(
                "a filtered centre has its own motion model; to use this one, choose the centroid or the enclosing circle",
            )
            .check("motion.time_constant_s", group.motion.time_constant_s, errors);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::MotionParams;

    #[test]
    fn a_margin_of_at_least_the_field_of_view_is_rejected() {
        let mut params = TeamParams::paper();
        params.group.standoff.field_of_view_margin_rad = 1.25;
        let messages: Vec<String> = params.errors().iter().map(ToString::to_string).collect();
        assert_eq!(
            messages,
            ["group.standoff.field_of_view_margin_rad = 1.25: must be at least 0 and below 1.221730476 \
                 (the margin must leave some of the field of view)"]
        );
        params.track.sensor.field_of_view_rad = 1.26;
        assert!(params.errors().is_empty());
        // Each wrong number is reported once.
        for (field_of_view_rad, margin_rad) in [(f64::NAN, 0.1), (1.0, f64::NAN), (1.0, -0.1)] {
            params.track.sensor.field_of_view_rad = field_of_view_rad;
            params.group.standoff.field_of_view_margin_rad = margin_rad;
            assert_eq!(params.errors().len(), 1, "{field_of_view_rad} {margin_rad}");
        }
    }

    #[test]
    fn a_filtered_centre_excludes_the_motion_model() {
        let mut params = TeamParams::paper().group;
        params.motion.time_constant_s = 1.5;
        let messages: Vec<String> = params.errors().iter().map(ToString::to_string).collect();
        assert_eq!(
            messages,
            ["motion.time_constant_s = 1.5: must be exactly 0 (a filtered centre has its own motion \
                 model; to use this one, choose the centroid or the enclosing circle)"]
        );
        for centre in [CentreEstimate::Centroid, CentreEstimate::EnclosingCircle] {
            assert!(GroupingParams { centre, ..params }.errors().is_empty());
        }
        params.motion = MotionParams { time_constant_s: 61.0, ..params.motion };
        assert_eq!(
            GroupingParams { centre: CentreEstimate::Centroid, ..params }.errors()[0].path,
            "motion.time_constant_s"
        );
    }
}
