//! Events, as a log.

use foxglove::messages::{Log, log::Level};
use standoff_sim::record::EventRow;

use super::pose::timestamp;

/// Events after which a target is not watched, or a UAV or an orbit not to be counted on.
const WARNINGS: [&str; 7] =
    ["lost", "discarded", "left-out", "uav-lost", "orbit-infeasible", "orbit-barred", "uavs-close"];

/// An event: its kind as the entry's name, whom it concerns and the reason as its text.
pub(super) fn entry(time_us: i64, event: &EventRow, target_names: &[String]) -> Log {
    let level = if WARNINGS.contains(&event.kind.as_str()) { Level::Warning } else { Level::Info };
    let uavs = event.uavs.iter().map(u32::to_string).collect::<Vec<_>>();
    let concerned = [
        event.target.map(|target| target_name(target, target_names)),
        event.group.map(|group| format!("group {group}")),
        event.to_group.map(|group| format!("to group {group}")),
        (!uavs.is_empty()).then(|| format!("UAV {}", uavs.join(" "))),
    ];
    let concerned = concerned.into_iter().flatten().collect::<Vec<_>>().join(", ");
    Log {
        timestamp: Some(timestamp(time_us)),
        level: level.into(),
        message: format!("{} ({concerned}): {}", event.kind, event.why()),
        name: event.kind.clone(),
        ..Log::default()
    }
}

/// What a target is called.
pub(super) fn target_name(target: u32, target_names: &[String]) -> String {
    target_names.get(target as usize).cloned().unwrap_or_else(|| format!("target {target}"))
}
