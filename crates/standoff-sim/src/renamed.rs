//! Names of earlier versions: nothing is read under them, but an error names the current one.

/// Scenario keys without the indices of arrays: earlier and current name.
const KEYS: [(&str, &str); 44] = [
    ("map", "basemap"),
    ("settle_s", "transient_s"),
    ("zones", "geofence"),
    ("uavs.ring", "uavs.start_ring"),
    ("uavs.at", "uavs.start"),
    ("uavs.start_late_s", "uavs.boot_delay_s"),
    ("team.horizon_s", "team.message_retention_s"),
    ("team.minds", "team.agents"),
    ("radio.loss", "radio.packet_loss"),
    ("radio.delay_s", "radio.latency_s"),
    ("radio.duplicate", "radio.duplication"),
    ("radio.bytes_per_s", "radio.bandwidth_bytes_per_s"),
    ("radio.until_s", "radio.fault_until_s"),
    ("radio.link.loss", "radio.link.packet_loss"),
    ("radio.link.delay_s", "radio.link.latency_s"),
    ("filter.lost_position_sd_m", "filter.deletion_position_sd_m"),
    ("filter.lost_in_view_s", "filter.deletion_unseen_in_view_s"),
    ("filter.start_velocity_sd_m_s", "filter.initial_velocity_sd_m_s"),
    ("filter.forget_lost_s", "filter.lost_track_retention_s"),
    ("orbit.aim", "orbit.pointing"),
    ("orbit.response_s", "orbit.time_constant_s"),
    ("orbit.approach_max_m_s", "orbit.closing_speed_max_m_s"),
    ("orbit.on_membership_change", "orbit.centre_jump"),
    ("orbit.take_back_fraction", "orbit.readmission_radius_fraction"),
    ("groups.convergence_limit_m2_s", "groups.divergence_limit_m2_s"),
    ("groups.convergence_patience_s", "groups.divergence_time_s"),
    ("groups.review_period_s", "groups.regrouping_period_s"),
    ("groups.reach_ahead_s", "groups.assignment_reach_s"),
    ("groups.assignment_inertia", "groups.assignment_switching_cost"),
    ("groups.search", "groups.search_lost_targets"),
    ("groups.discard", "groups.removal"),
    ("groups.altitudes", "groups.altitude_policy"),
    ("groups.separation_alarm_m", "groups.proximity_alert_m"),
    ("guidance.sense", "guidance.orbit_direction"),
    ("guidance.spacing_gain_1_s", "guidance.phase_gain_1_s"),
    ("guidance.separation_deg", "guidance.desired_phase_deg"),
    ("separation.minimum_m", "separation.horizontal_min_m"),
    ("separation.vertical_m", "separation.vertical_min_m"),
    ("targets.scatter", "targets.random"),
    ("targets.at", "targets.start"),
    ("geofence.points", "geofence.vertices"),
    ("intruders.pursues", "intruders.pursued_uav"),
    ("intruders.direction_deg", "intruders.bearing_deg"),
    ("intruders.silent", "intruders.transponder_off"),
];

/// Built-in scenarios: earlier and current name.
const SCENARIOS: [(&str, &str); 5] = [
    ("best/figure-9", "improved/figure-9"),
    ("best/table-2-pair", "improved/table-2-pair"),
    ("tour/07-a-radio-that-fails", "tour/07-lossy-radio"),
    ("tour/08-two-halves-meet", "tour/08-network-partition"),
    ("tour/09-apart", "tour/09-separation"),
];

/// Current name of a scenario key of an earlier version; `key` is dotted and may contain indices (`uavs.at.0`).
pub(crate) fn key(key: &str) -> Option<&'static str> {
    let parts: Vec<&str> = key.split('.').filter(|part| part.parse::<usize>().is_err()).collect();
    current(&KEYS, &parts.join("."))
}

/// Current name of a built-in scenario of an earlier version.
pub(crate) fn scenario(name: &str) -> Option<&'static str> {
    current(&SCENARIOS, name)
}

fn current(names: &[(&str, &'static str)], earlier: &str) -> Option<&'static str> {
    names.iter().find(|(name, _)| *name == earlier).map(|(_, current)| *current)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{built_in, schema};

    /// No earlier name is a current one, and every current name exists.
    #[test]
    fn earlier_names_are_retired_and_current_names_exist() {
        let schema = schema().to_string();
        for (earlier, current) in KEYS {
            let leaf = |key: &str| format!("\"{}\"", key.rsplit('.').next().unwrap());
            assert!(schema.contains(&leaf(current)), "{earlier} -> {current}");
            assert_eq!(key(current), None, "{current}");
        }
        for (earlier, current) in SCENARIOS {
            assert!(built_in(current).is_some() && built_in(earlier).is_none(), "{earlier} -> {current}");
        }
    }

    #[test]
    fn indices_of_arrays_are_ignored() {
        assert_eq!((key("uavs.at.3"), key("radio.link.0.loss")), (Some("uavs.start"), Some("radio.link.packet_loss")));
    }
}
