//! Priorities of targets, by name or by the area around them.

use std::collections::BTreeMap;

use standoff::AreaOfInterest;
use standoff_io::display_text::{did_you_mean, nearest};
use standoff_score::Priorities;
use toml::{Table, Value};

use super::diagnostics::Problems;
use super::dotted::value_at;
use super::earth::Earth;
use super::error::ScenarioError;
use super::geofence;
use super::load::Typed;
use super::schema_types::{self, ScenarioFile};
use crate::traffic::{MAX_AT_ONCE, Traffic, Vehicle};

/// Replaces degrees by metres, and adds the priorities of the traffic file, except those of targets that the scenario
/// names. The scenario, and so its record, then contains the priorities that are flown.
pub(super) fn spell_out(typed: &mut Typed, traffic: Option<&Traffic>) -> Result<(), ScenarioError> {
    let mut all = value_at(&typed.table, "priorities").and_then(Value::as_array).cloned().unwrap_or_default();
    if typed.file.priorities.iter().any(|table| table.lat_deg.is_some() || table.lon_deg.is_some()) {
        let earth = Earth::of(typed, traffic);
        for (index, as_typed) in all.iter_mut().enumerate() {
            geofence::circle_in_metres(typed, &format!("priorities.{index}"), as_typed, &earth)?;
        }
        typed.set("priorities", all.clone().into())?;
    }
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
    let table = |(priority, names): (f64, Vec<Value>)| {
        Table::from_iter([("priority".to_owned(), priority.into()), ("targets".to_owned(), names.into())]).into()
    };
    all.extend(tables.into_values().map(table));
    typed.set("priorities", all.into())
}

/// Returns the names of the targets by id.
pub(super) fn target_names(file: &ScenarioFile, traffic: Option<&Traffic>) -> Vec<String> {
    let random = || {
        file.targets
            .as_ref()
            .map_or(0, |of| of.start.len().saturating_add(of.random.as_ref().map_or(0, |of| of.count as usize)))
    };
    match traffic {
        Some(traffic) => traffic.vehicles.iter().map(Vehicle::name).map(str::to_owned).collect(),
        // More are refused elsewhere.
        None => (0..random().min(MAX_AT_ONCE)).map(|number| format!("target-{number}")).collect(),
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
                    let what = format!("is not the name of a target{near}");
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use standoff::Position;

    use super::super::{Overrides, Scenario, ScenarioTemplate, Settings};
    use super::*;
    use crate::common::overrides;

    fn load(toml: &str, folder: &Path) -> Result<Scenario, String> {
        let template = ScenarioTemplate::of_toml("mine", toml, &Overrides::default(), folder);
        template.and_then(|template| template.draw(1)).map_err(|error| error.to_string())
    }

    /// The traffic file gives priorities to two vehicles, and the scenario another one to one of them. The record
    /// contains all of them.
    #[test]
    fn priorities_of_the_traffic_file_are_spelt_out_unless_the_scenario_names_the_target() {
        let folder = tempfile::tempdir().unwrap();
        let csv = "t,id,x,y,priority\n0,a,0,0,3\n0,b,9,0,7\n0,c,9,9,\n9,a,9,0,3\n9,b,9,0,7\n9,c,0,9,\n";
        std::fs::write(folder.path().join("cars.csv"), csv).unwrap();
        let area = "[[priorities]]\npriority = 2\nx_m = 500\ny_m = 0\nradius_m = 100\n";
        let named = "[[priorities]]\npriority = 5\ntargets = [\"b\"]\n";
        let scenario = load(&format!("[traffic]\nfile = \"cars.csv\"\n{area}{named}"), folder.path()).unwrap();
        let priorities = &scenario.settings.priorities;
        assert_eq!(priorities.of_target, BTreeMap::from([(0, 3.0), (1, 5.0)]));
        let at = |target, x_m| priorities.at(target, Position::from_m(x_m, 0.0));
        assert_eq!([at(0, 0.0), at(1, 590.0), at(2, 590.0), at(2, 610.0)], [3.0, 5.0, 2.0, 1.0]);
        let names = ["a", "b", "c"].map(str::to_owned);
        let of_record = Settings::of_record("r", &scenario.resolved().unwrap(), &names).unwrap();
        assert_eq!(of_record.priorities, scenario.settings.priorities);
        let replaced = Overrides { traffic: vec![folder.path().join("cars.csv")], ..overrides(&[]) };
        let toml = format!("{area}[targets.random]\n");
        let other = ScenarioTemplate::of_toml("mine", &toml, &replaced, Path::new("")).unwrap().draw(1).unwrap();
        assert!(other.settings.priorities.areas.is_empty(), "areas are of another place");
        assert!(!other.settings.priorities.is_empty(), "priorities of the file remain");
    }

    /// 0.001 degrees of latitude are 111 m.
    #[test]
    fn a_circle_in_degrees_is_where_the_traffic_is() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("cars.csv"), "t,id,lat,lon\n0,a,47,8\n9,a,47.002,8\n").unwrap();
        let with = |area: &str| {
            load(&format!("[traffic]\nfile = \"cars.csv\"\n[[priorities]]\npriority = 5\n{area}"), folder.path())
        };
        let scenario = with("lat_deg = 47\nlon_deg = 8\nradius_m = 120\n").unwrap();
        let vehicle = &scenario.traffic().unwrap().vehicles[0];
        let at = |time_ms: i64| {
            let state = vehicle.at(vehicle.first_us() + 1000 * time_ms).unwrap();
            scenario.settings.priorities.at(0, Position::from_m(state.x_m, state.y_m))
        };
        assert_eq!([at(0), at(4700), at(5000)], [5.0, 5.0, 1.0], "24.7 m/s; the circle ends after 4.85 s");
        let error = with("lat_deg = 47\nradius_m = 120\n").unwrap_err();
        assert!(error.contains("priorities.0.lat_deg: a circle needs both lat_deg and lon_deg"), "{error}");
        let area = "[[targets.start]]\n[[priorities]]\npriority = 5\nlat_deg = 47\nlon_deg = 8\nradius_m = 9\n";
        let error = load(area, Path::new("")).unwrap_err();
        assert!(error.contains("priorities.0.lat_deg: "), "{error}");
    }

    /// `standoff fly` states where the plane is: the traffic is not flown, and may be elsewhere.
    #[test]
    fn a_stated_origin_places_degrees_whatever_the_traffic_is() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("cars.csv"), "t,id,lat,lon\n0,a,47.05,8\n9,a,47.05,8\n").unwrap();
        let area = "[[priorities]]\npriority = 5\nlat_deg = 47.01\nlon_deg = 8\nradius_m = 10\n";
        let zone = "[[geofence]]\nlat_deg = 47.02\nlon_deg = 8\nradius_m = 10\n";
        let origin = Some(standoff_io::geodesy::Origin { latitude_deg: 47.0, longitude_deg: 8.0 });
        let overrides = Overrides { origin, ..Overrides::default() };
        for targets in ["[traffic]\nfile = \"cars.csv\"\n", "[[targets.start]]\n"] {
            let toml = format!("{targets}{area}{zone}");
            let template = ScenarioTemplate::of_toml("mine", &toml, &overrides, folder.path()).unwrap();
            // As `standoff fly` does for the length of the record.
            let changed = template.changed(&["duration_s=9".to_owned()]).unwrap();
            for scenario in [template.draw(1).unwrap(), changed.draw(1).unwrap()] {
                let at = |north_m| scenario.settings.priorities.at(9, Position::from_m(0.0, north_m));
                assert_eq!([at(1111.8), at(1130.0)], [5.0, 1.0], "a degree of latitude is 111.18 km here");
                let zone = scenario.settings.geofence.zones().next().unwrap();
                assert!(zone.vertices.iter().all(|corner| (corner.y_m() - 2223.6).abs() < 11.0), "{zone:?}");
            }
        }
    }

    #[test]
    fn wrong_priorities_are_refused_at_their_key() {
        for (table, expected) in [
            ("targets = [\"target-0\"]", "priorities.0.priority: is missing; must be 0.01 to 100"),
            ("priority = 0", "priorities.0.priority = 0: must be at least 0.01 and at most 100"),
            ("priority = 101", "priorities.0.priority = 101: must be at least 0.01 and at most 100"),
            ("priority = 2", "priorities.0: must have `targets`, `vertices`, or `x_m`, `y_m` and `radius_m`"),
            (
                "priority = 2\ntargets = [\"target-1\"]",
                "priorities.0.targets.0 = \"target-1\": is not the name of a target; did you mean `target-0`?",
            ),
            ("priority = 2\nx_m = 3", "priorities.0: a circle needs `x_m`, `y_m` and `radius_m`"),
            ("priority = 2\nvertices = [[0, 0], [9, 0]]", "priorities.0.vertices: has 2 different vertices"),
            ("priority = 2\nvertices = [[0, 0], [9], [9, 9]]", "priorities.0.vertices.1: must be [east, north], m"),
        ] {
            let error = load(&format!("[[targets.start]]\n[[priorities]]\n{table}\n"), Path::new("")).unwrap_err();
            assert!(error.starts_with("mine:") && error.contains(expected), "{error}");
        }
    }
}
