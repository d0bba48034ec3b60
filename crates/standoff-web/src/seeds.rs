//! Small batches: missions that differ by their seeds, without their records.

use serde::Serialize;
use standoff_score::{MetricInfo, MetricSelection};
use standoff_sim::monte_carlo::Statistics;
use standoff_sim::run::fly;
use standoff_sim::scenario::ScenarioTemplate;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::request::{Request, format_errors, message_of};

/// Missions of consecutive seeds, from the seed of the request on.
#[wasm_bindgen]
pub struct Seeds {
    template: ScenarioTemplate,
    first: u64,
}

/// Statistics of a metric over the missions of a batch, in its display unit.
#[derive(Serialize)]
struct Row {
    metric: &'static str,
    label: &'static str,
    unit: &'static str,
    n: u64,
    mean: Option<f64>,
    ci95: Option<[f64; 2]>,
}

#[wasm_bindgen]
impl Seeds {
    /// Reads the scenario of a [`Request`] in JSON. The error is the message that the command would print.
    #[wasm_bindgen(constructor)]
    pub fn new(request: &str) -> Result<Self, String> {
        let request = Request::of_json(request)?;
        Ok(Self { template: request.template()?, first: request.seed()? })
    }

    /// Flies the mission of a seed, counted from 0. Returns the values of all metrics in their fixed order; NaN if
    /// nothing was measured.
    pub fn values(&self, index: u32) -> Result<Vec<f64>, String> {
        let scenario = self.template.draw(self.first.wrapping_add(index.into())).map_err(message_of)?;
        let metrics = fly(&scenario, MetricSelection::standard()).map_err(|errors| format_errors(&errors))?;
        Ok(metrics.values().iter().map(|value| value.unwrap_or(f64::NAN)).collect())
    }
}

/// Statistics of the metrics that [`Seeds::values`] returned for several missions, one after the other, as JSON rows with
/// `metric`, `label`, `unit`, `n`, `mean` and `ci95`. Metrics without a value are left out.
#[must_use]
#[wasm_bindgen(js_name = statisticsOf)]
pub fn statistics_of(values: &[f64]) -> String {
    let infos = MetricInfo::all();
    let row = |(index, info): (usize, &MetricInfo)| {
        let (unit, factor) = MetricInfo::unit(info.name);
        let of_runs = values.chunks(infos.len()).filter_map(|run| run.get(index));
        let column: Vec<_> = of_runs.map(|value| Some(factor * value).filter(|value| !value.is_nan())).collect();
        let Statistics { n, mean, ci95, .. } = Statistics::of(&column);
        (n > 0).then_some(Row { metric: info.name, label: info.label, unit, n, mean, ci95 })
    };
    let rows: Vec<Row> = infos.iter().enumerate().filter_map(row).collect();
    serde_json::to_string(&rows).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use standoff_sim::scenario::{Overrides, Scenario};

    use super::*;

    /// The values are those of the missions of consecutive seeds; the mean is theirs.
    #[test]
    fn a_batch_flies_consecutive_seeds() {
        let set = vec!["duration_s=20".to_owned()];
        let request = serde_json::json!({"scenario": "tour/02-two-uavs", "seed": "7", "set": set});
        let seeds = Seeds::new(&request.to_string()).unwrap();
        let values: Vec<f64> = (0..3).flat_map(|index| seeds.values(index).unwrap()).collect();
        let errors_m = (7..10).map(|seed| {
            let overrides = Overrides { set: set.clone(), ..Overrides::default() };
            let scenario = Scenario::load("tour/02-two-uavs", &overrides, seed).unwrap();
            fly(&scenario, MetricSelection::standard()).unwrap()["standoff_error_m"].unwrap()
        });
        let mean_m = errors_m.sum::<f64>() / 3.0;
        let rows: serde_json::Value = serde_json::from_str(&statistics_of(&values)).unwrap();
        let row = rows.as_array().unwrap().iter().find(|row| row["metric"] == "standoff_error_m").unwrap();
        assert!((row["mean"].as_f64().unwrap() - mean_m).abs() < 1e-9 && row["n"] == 3 && row["unit"] == "m");
        assert_eq!(statistics_of(&[]), "[]");
    }
}
