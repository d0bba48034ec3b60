//! Events as log messages.

use foxglove::messages::{Log, log::Level};
use standoff_record::{EventRow, target_name};

use super::pose::timestamp;

/// Events logged as warnings: loss of custody of a target, or problems of a UAV or an orbit.
const WARNINGS: [&str; 7] =
    ["lost", "removed", "not-admitted", "uav-timeout", "orbit-infeasible", "orbit-blocked", "proximity-alert"];

/// Makes the log message of an event: its kind is the name, affected objects and the reason are the text.
pub(super) fn entry(time_us: i64, event: &EventRow, target_names: &[String]) -> Log {
    let level = if WARNINGS.contains(&event.kind.as_str()) { Level::Warning } else { Level::Info };
    let uavs = event.uavs.iter().map(u32::to_string).collect::<Vec<_>>();
    let concerned = [
        event.target_or_track().map(|target| target_name(target, target_names)),
        event.group.map(|group| format!("group {group}")),
        event.to_group.map(|group| format!("to group {group}")),
        (!uavs.is_empty()).then(|| format!("UAV {}", uavs.join(" "))),
    ];
    let concerned = concerned.into_iter().flatten().collect::<Vec<_>>().join(", ");
    Log {
        timestamp: Some(timestamp(time_us)),
        level: level.into(),
        message: format!("{} ({concerned}): {}", event.kind, event.reason_text()),
        name: event.kind.clone(),
        ..Log::default()
    }
}
