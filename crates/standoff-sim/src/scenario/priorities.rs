//! Priorities of targets, by name or by the area around them.

use std::collections::BTreeMap;

use standoff::AreaOfInterest;
use standoff_io::display_text::{did_you_mean, nearest, printable, quoted};
use standoff_score::Priorities;
use toml::{Table, Value};

use super::diagnostics::Problems;
use super::dotted::value_at;
use super::error::ScenarioError;
use super::geofence;
use super::load::Typed;
use super::schema_types::{self, ScenarioFile};
use crate::traffic::{Traffic, Vehicle};

/// Adds the priorities of the traffic file, except those of targets that the scenario names. The scenario, and so its
/// record, then contains them.
pub(super) fn spell_out(typed: &mut Typed, traffic: Option<&Traffic>) -> Result<(), ScenarioError> {
    let is_named = |name: &str| typed.file.priorities.iter().any(|table| table.targets.iter().any(|of| of == name));
    let mut tables: BTreeMap<u64, (f64, Vec<Value>)> = BTreeMap::new();
    for vehicle in traffic.iter().flat_map(|traffic| &traffic.vehicles).filter(|of| !is_named(of.name())) {
        if let Some(priority) = vehicle.priority {
            // The bits of positive numbers have their order.
            let (_, names) = tables.entry(priority.to_bits()).or_insert_with(|| (priority, Vec::new()));
            names.push(vehicle.name().into());
        }
    }
    if tables.is_empty() {
        return Ok(());
    }
    let mut all = value_at(&typed.table, "priorities").and_then(Value::as_array).cloned().unwrap_or_default();
    let table = |(priority, names): (f64, Vec<Value>)| {
        Table::from_iter([("priority".to_owned(), priority.into()), ("targets".to_owned(), names.into())]).into()
    };
    all.extend(tables.into_values().map(table));
    typed.set("priorities", all.into())
}

/// Returns the names of the targets by id.
pub(super) fn target_names(file: &ScenarioFile, traffic: Option<&Traffic>) -> Vec<String> {
    let random =
        || file.targets.as_ref().map_or(0, |of| of.start.len() + of.random.as_ref().map_or(0, |of| of.count as usize));
    match traffic {
        Some(traffic) => traffic.vehicles.iter().map(Vehicle::name).map(str::to_owned).collect(),
        None => (0..random()).map(|number| format!("target-{number}")).collect(),
    }
}

/// Returns the priorities; `names` are those of the targets, by id.
pub(super) fn priorities(tables: &[schema_types::Priority], names: &[String], problems: &mut Problems) -> Priorities {
    let ids: BTreeMap<&str, u32> = names.iter().map(String::as_str).zip(0..).collect();
    let mut priorities = Priorities::default();
    for (index, table) in tables.iter().enumerate() {
        let key = |name: &str| format!("priorities.{index}.{name}");
        let Some(priority) = table.priority else {
            problems.add(key("priority"), "is missing; must be 0.01 to 100", None);
            continue;
        };
        for (place, name) in table.targets.iter().enumerate() {
            match ids.get(name.as_str()) {
                Some(id) => {
                    priorities.of_target.insert(*id, priority);
                }
                None => {
                    let all: Vec<&str> = ids.keys().copied().collect();
                    let near = nearest(name, &all).map_or_else(String::new, |near| format!("; {}", did_you_mean(near)));
                    let what = format!("{} is not the name of a target{near}", printable(&quoted(name)));
                    problems.add(key(&format!("targets.{place}")), what, None);
                }
            }
        }
        let has_outline =
            !table.vertices.is_empty() || [table.x_m, table.y_m, table.radius_m].iter().any(Option::is_some);
        if has_outline {
            let vertices = geofence::area(table, &format!("priorities.{index}"), problems);
            priorities.areas.extend(vertices.map(|vertices| AreaOfInterest { vertices, priority }));
        } else if table.targets.is_empty() {
            problems.add(
                format!("priorities.{index}"),
                "must have `targets`, `vertices`, or `x_m`, `y_m` and `radius_m`",
                None,
            );
        }
    }
    priorities
}
