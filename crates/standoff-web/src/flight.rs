//! A mission that is flown in steps and encoded for the replay page while it flies.

use std::cell::RefCell;
use std::fmt::Display;
use std::io::{Cursor, Write};

use serde_json::{Map, Value};
use standoff_app::{Maps, lines, manifest};
use standoff_record::{Manifest, MemoryRecord};
use standoff_score::{FrameScorer, MetricSelection, Scorer, SelectedMetrics};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Scenario, Settings};
use standoff_sim::world::World;
use standoff_view::figures::Setup;
use standoff_view::replay::{Encoder, Head, Part};
use wasm_bindgen::prelude::wasm_bindgen;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::request::{Request, format_errors, message_of};

/// Maximum number of rows of targets (time steps times targets) of a mission without and with a record. With 485
/// vehicles and 6 UAVs, a row takes 27 bytes of replay and 435 bytes of record; the ZIP file is a second copy. A mission
/// thus takes less than 1 GB.
const ROWS_MAX: [u64; 2] = [10_000_000, 1_000_000];

/// A mission in the browser.
#[wasm_bindgen]
pub struct Flight {
    mission: Mission,
    settings: Settings,
    scorer: Scorer,
    encoder: Encoder,
    head: Head,
    warnings: Vec<String>,
    /// Values of the scenario by key.
    values: Map<String, Value>,
    record: Option<MemoryRecord>,
    /// Names and bytes of the files of the finished record.
    files: Vec<(String, Vec<u8>)>,
    sealed: Vec<Part>,
    is_done: bool,
}

#[wasm_bindgen]
impl Flight {
    /// Prepares the mission of a [`Request`] in JSON. The error is the message that the command would print.
    #[wasm_bindgen(constructor)]
    pub fn new(request: &str) -> Result<Self, String> {
        let request = Request::of_json(request)?;
        let scenario = request.scenario()?;
        let rows = World::rows(&scenario);
        let most = ROWS_MAX[usize::from(request.is_recorded)];
        if rows > most {
            return Err(format!(
                "error: the mission could have {rows} rows of targets; at most {most} fit into the memory of the \
                 page: choose a shorter duration_s, a longer period_s or fewer targets, or use the command"
            ));
        }
        let mission = Mission::new(&scenario).map_err(|errors| format_errors(&errors))?;
        let manifest = Manifest { reported: mission.reported_tables(), ..manifest(&scenario) };
        let setup = Setup::of(manifest.title(), &scenario.settings);
        let encoder = Encoder::new(&mission.score_config(), 1).with_detections(setup.detections);
        let names = World::names(&scenario);
        let record = request.is_recorded.then(|| recorded(&scenario, &mission, &manifest, &names)).transpose()?;
        let mut head = Head::new(&manifest, setup, names);
        head.live = true;
        let warnings = RefCell::new(scenario.warnings.clone());
        let map = Maps(request.maps).of_scenario(&scenario, &|warning| warnings.borrow_mut().push(warning.to_owned()));
        head.map = map.map_err(|failure| failure.message(false).join("\n"))?;
        Ok(Self {
            record,
            files: Vec::new(),
            warnings: warnings.into_inner(),
            values: values_of(&scenario)?,
            scorer: Scorer::new(mission.score_config(), MetricSelection::standard()),
            settings: scenario.settings,
            mission,
            encoder,
            head,
            sealed: Vec::new(),
            is_done: false,
        })
    }

    /// Head of the replay, JSON; complete, with the results, after the end of the mission.
    #[must_use]
    pub fn head(&self) -> String {
        self.head.json().unwrap_or_default()
    }

    /// Warnings about the scenario, one per line.
    #[must_use]
    pub fn warnings(&self) -> String {
        self.warnings.join("\n")
    }

    /// Values of the scenario by key, as a JSON object of texts.
    #[must_use]
    pub fn values(&self) -> String {
        Value::from(self.values.clone()).to_string()
    }

    /// Gzip of the background map; `undefined` if there is none.
    #[must_use]
    pub fn map(&self) -> Option<Vec<u8>> {
        self.head.map.as_ref().map(|map| map.to_vec())
    }

    /// Flies up to `steps` time steps, and returns the progress as JSON: `{"sealed": number of complete parts, "open":
    /// number of time steps in the open part, "done": whether the mission has ended}`.
    pub fn advance(&mut self, steps: u32) -> Result<String, String> {
        for _ in 0..steps {
            let Some(frame) = self.mission.frame() else {
                self.finish()?;
                break;
            };
            if let Some(record) = &mut self.record {
                record.frame(frame).map_err(message)?;
            }
            self.scorer.frame(frame);
            self.sealed.extend(self.encoder.frame(frame));
        }
        let open = self.encoder.open_steps();
        Ok(format!("{{\"sealed\":{},\"open\":{open},\"done\":{}}}", self.sealed.len(), self.is_done))
    }

    /// Gzip of a block of the replay: `overview`, `detail` or `team-states` of a part; `undefined` if there is none.
    #[must_use]
    pub fn block(&self, kind: &str, number: usize) -> Option<Vec<u8>> {
        let part = match self.sealed.get(number) {
            Some(part) => part,
            // Encoded only when the page asks for it.
            None if number == self.sealed.len() => &self.encoder.so_far()?,
            None => return None,
        };
        part.block(kind).map(|block| block.to_vec())
    }

    /// The record of the finished mission as a ZIP file, without compression: the tables are compressed.
    pub fn record(&self) -> Result<Vec<u8>, String> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        for (name, bytes) in &self.files {
            zip.start_file(name.as_str(), options).map_err(message)?;
            zip.write_all(bytes).map_err(message)?;
        }
        Ok(zip.finish().map_err(message)?.into_inner())
    }

    /// The selected metrics by name, JSON, as `standoff run --json` prints them.
    #[must_use]
    pub fn metrics(&self) -> String {
        serde_json::to_string(&self.selected_metrics()).unwrap_or_default()
    }
}

impl Flight {
    fn selected_metrics(&self) -> SelectedMetrics {
        SelectedMetrics { metrics: self.scorer.metrics(), choice: MetricSelection::standard() }
    }

    /// Names and bytes of the files of the finished record.
    #[must_use]
    pub fn files(&self) -> &[(String, Vec<u8>)] {
        &self.files
    }

    fn finish(&mut self) -> Result<(), String> {
        if self.is_done {
            return Ok(());
        }
        self.is_done = true;
        self.sealed.extend(self.encoder.part());
        self.head.complete(lines(&self.selected_metrics(), &self.settings), &self.encoder);
        if let Some(record) = self.record.take() {
            self.files = record.finish().map_err(message)?;
        }
        Ok(())
    }
}

/// Values of all keys that are no lists, as texts; that of `world` is the number of its buildings.
fn values_of(scenario: &Scenario) -> Result<Map<String, Value>, String> {
    let tables: toml::Table = scenario.resolved().map_err(message_of)?.parse().map_err(message)?;
    let mut values = Map::new();
    for (table, keys) in tables {
        for (key, value) in keys.as_table().into_iter().flatten().filter(|(_, value)| !value.is_array()) {
            let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            values.insert(format!("{table}.{key}"), text.into());
        }
    }
    let count = scenario.settings.buildings.all().len();
    if count > 0 {
        values.insert("world".to_owned(), format!("{count} buildings").into());
    }
    Ok(values)
}

/// Starts the record of a mission.
fn recorded(
    scenario: &Scenario,
    mission: &Mission,
    manifest: &Manifest,
    names: &[String],
) -> Result<MemoryRecord, String> {
    let resolved = scenario.resolved().map_err(message_of)?;
    let mut scorer = FrameScorer::new(mission.score_config());
    MemoryRecord::create(manifest, &resolved, names, move |frame| scorer.derived_columns(frame)).map_err(message)
}

fn message(error: impl Display) -> String {
    format!("error: {error}")
}

#[cfg(test)]
mod tests {
    use standoff_sim::scenario::{BUILT_IN, Overrides};

    use super::*;

    /// The files of a record in memory have the bytes of those in a folder, for every built-in scenario.
    #[test]
    fn records_in_memory_equal_those_on_disk() {
        let home = tempfile::tempdir().unwrap();
        for built_in in BUILT_IN {
            let name = built_in.name;
            let set = vec!["duration_s=20".to_owned()];
            let request = serde_json::json!({"scenario": name, "seed": "3", "set": set, "is_recorded": true});
            let mut flight = Flight::new(&request.to_string()).unwrap();
            assert_eq!(flight.advance(u32::MAX).unwrap(), flight.advance(1).unwrap());
            let scenario = Scenario::load(name, &Overrides { set, ..Overrides::default() }, 3).unwrap();
            let mut mission = Mission::new(&scenario).unwrap();
            let out = home.path().join(name.replace('/', "-"));
            let ignore = |_: &str| {};
            let closed = standoff_app::fly(&scenario, &mut mission, &out, None, &ignore, || true, |_| ()).ok().unwrap();
            let mut count = 0;
            for file in std::fs::read_dir(closed.dir()).unwrap() {
                let file = file.unwrap();
                let (_, bytes) =
                    flight.files().iter().find(|(name, _)| file.file_name() == name.as_str()).expect("the same files");
                assert!(std::fs::read(file.path()).unwrap() == *bytes, "{name}: {:?}", file.file_name());
                count += 1;
            }
            assert_eq!(count, flight.files().len(), "{name}");
            assert!(flight.record().unwrap().len() > 1000);
        }
    }

    #[test]
    fn wrong_requests_get_the_messages_of_the_command() {
        let error = |json: &str| Flight::new(json).err().unwrap();
        assert!(error("{").starts_with("error: the request is wrong"));
        assert!(error(r#"{"scenario": "tour/01-one-uav", "seed": "x"}"#).contains("must be a whole number from 0"));
        let unknown = error(r#"{"scenario": "tour/01-one-uav", "seed": "1", "set": ["uavs.sped_m_s=3"]}"#);
        assert!(unknown.contains("there is no such key") && unknown.contains("did you mean"), "{unknown}");
        let long = r#"{"scenario": "improved/figure-9", "seed": "1", "set": ["duration_s=1e6"]}"#;
        assert!(error(long).contains("at most 10000000 fit into the memory"), "{}", error(long));
    }
}
