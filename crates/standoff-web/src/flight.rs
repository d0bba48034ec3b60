//! A mission that is flown in steps and encoded for the replay page while it flies.

use std::cell::RefCell;

use standoff_app::{Maps, lines, manifest};
use standoff_score::{MetricSelection, Scorer, SelectedMetrics};
use standoff_sim::run::Mission;
use standoff_sim::scenario::Settings;
use standoff_sim::world::World;
use standoff_view::figures::Setup;
use standoff_view::replay::{Encoder, Head, Part};
use wasm_bindgen::prelude::wasm_bindgen;

use crate::request::Request;

/// A mission in the browser.
#[wasm_bindgen]
pub struct Flight {
    mission: Mission,
    settings: Settings,
    scorer: Scorer,
    encoder: Encoder,
    head: Head,
    warnings: Vec<String>,
    sealed: Vec<Part>,
    /// Current state of the part that is being filled, and its number of time steps.
    open: Option<(Part, usize)>,
    is_done: bool,
}

#[wasm_bindgen]
impl Flight {
    /// Prepares the mission of a [`Request`] in JSON. The error is the message that the command would print.
    #[wasm_bindgen(constructor)]
    pub fn new(request: &str) -> Result<Self, String> {
        let request = Request::of_json(request)?;
        let scenario = request.scenario()?;
        let mission = Mission::new(&scenario)
            .map_err(|errors| errors.iter().map(|error| format!("error: {error}")).collect::<Vec<_>>().join("\n"))?;
        let manifest = manifest(&scenario);
        let setup = Setup::of(manifest.title(), &scenario.settings);
        let encoder = Encoder::new(&mission.score_config(), 1).with_detections(setup.detections);
        let mut head = Head::new(&manifest, setup, World::names(&scenario));
        head.live = true;
        let warnings = RefCell::new(scenario.warnings.clone());
        let map = Maps(request.maps).of_scenario(&scenario, &|warning| warnings.borrow_mut().push(warning.to_owned()));
        head.map = map.map_err(|failure| failure.message(false).join("\n"))?;
        Ok(Self {
            warnings: warnings.into_inner(),
            scorer: Scorer::new(mission.score_config(), MetricSelection::standard()),
            settings: scenario.settings,
            mission,
            encoder,
            head,
            sealed: Vec::new(),
            open: None,
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

    /// Gzip of the background map; `undefined` if there is none.
    #[must_use]
    pub fn map(&self) -> Option<Vec<u8>> {
        self.head.map.as_ref().map(|map| map.to_vec())
    }

    /// Flies up to `steps` time steps, and returns the progress as JSON: `{"sealed": number of complete parts, "open":
    /// number of time steps in the open part, "done": whether the mission has ended}`.
    pub fn advance(&mut self, steps: u32) -> String {
        for _ in 0..steps {
            let Some(frame) = self.mission.frame() else {
                self.finish();
                break;
            };
            self.scorer.frame(frame);
            self.sealed.extend(self.encoder.frame(frame));
        }
        self.open = self.encoder.so_far();
        let open = self.open.as_ref().map_or(0, |(_, steps)| *steps);
        format!("{{\"sealed\":{},\"open\":{open},\"done\":{}}}", self.sealed.len(), self.is_done)
    }

    /// Gzip of a block of the replay: `overview`, `detail` or `team-states` of a part; `undefined` if there is none.
    #[must_use]
    pub fn block(&self, kind: &str, number: usize) -> Option<Vec<u8>> {
        let open = self.open.as_ref().filter(|_| number == self.sealed.len()).map(|(part, _)| part);
        let part = self.sealed.get(number).or(open)?;
        let block = match kind {
            "overview" => &part.overview,
            "detail" => &part.detail,
            "team-states" => part.team_states.as_ref()?,
            _ => return None,
        };
        Some(block.to_vec())
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

    fn finish(&mut self) {
        if self.is_done {
            return;
        }
        self.is_done = true;
        self.sealed.extend(self.encoder.part());
        self.head.live = false;
        self.head.outcome = lines(&self.selected_metrics(), &self.settings);
        self.head.events_left_out = self.encoder.events_left_out();
        self.head.other_events_left_out = self.encoder.other_events_left_out();
    }
}
