//! Names of metrics in earlier versions: nothing is read under them, but an error names the current one.

/// Metrics: earlier and current name.
const METRICS: [(&str, &str); 32] = [
    ("watched_fraction", "custody_fraction"),
    ("seen_fraction", "in_view_fraction"),
    ("longest_gap_s", "longest_out_of_view_s"),
    ("refound_fraction", "reacquired_fraction"),
    ("refind_time_s", "reacquisition_time_s"),
    ("position_error_one_m", "position_error_single_uav_m"),
    ("position_error_more_m", "position_error_multi_uav_m"),
    ("standoff_tracking_error_m", "standoff_error_own_estimate_m"),
    ("standoff_tracking_error_m_settled", "standoff_error_own_estimate_m_settled"),
    ("standoff_error_instant_m_settled", "standoff_error_unfiltered_m_settled"),
    ("line_of_sight_deg", "off_boresight_mean_deg"),
    ("line_of_sight_max_deg", "off_boresight_max_deg"),
    ("out_of_view_fraction", "member_out_of_view_fraction"),
    ("out_of_view_longest_s", "member_longest_out_of_view_s"),
    ("uncovered_fraction", "ungrouped_fraction"),
    ("separation_min_layer_m", "separation_min_same_altitude_m"),
    ("separation_min_group_m", "separation_min_same_group_m"),
    ("separation_time_s", "avoidance_time_s"),
    ("zone_detour_fraction", "geofence_detour_fraction"),
    ("crews_differ_fraction", "assignment_disagreement_fraction"),
    ("agreement_delay_s", "reconvergence_time_s"),
    ("double_served_fraction", "duplicate_coverage_fraction"),
    ("bytes_max_per_s", "sent_bytes_per_s_max"),
    ("anees_quiet", "anees_nonmanoeuvring"),
    ("standoff_surprise_m_settled", "orbit_prediction_error_m_settled"),
    ("standoff_tracking_surprise_m_settled", "own_orbit_prediction_error_m_settled"),
    ("position_bound_ratio", "position_crlb_ratio"),
    ("velocity_bound_ratio", "velocity_crlb_ratio"),
    ("position_bound_m2", "position_crlb_m2"),
    ("velocity_bound_m2_s2", "velocity_crlb_m2_s2"),
    ("discards", "removals"),
    ("bytes_per_s", "sent_bytes_per_s"),
];

/// Current name of a metric of an earlier version.
pub(crate) fn metric(name: &str) -> Option<&'static str> {
    METRICS.iter().find(|(earlier, _)| *earlier == name).map(|(_, current)| *current)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Metrics;

    /// No earlier name is a current one, and every current name exists.
    #[test]
    fn earlier_names_are_retired_and_current_names_exist() {
        for (earlier, current) in METRICS {
            assert!(Metrics::NAMES.contains(&current) && !Metrics::NAMES.contains(&earlier), "{earlier} -> {current}");
        }
    }
}
