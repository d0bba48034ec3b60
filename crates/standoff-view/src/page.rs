//! The replay page of a run and the pages of Monte Carlo results and sweeps, each as one self-contained file; `site.rs`
//! serves them.
//!
//! The sources of the pages are plain scripts in `page/`, without a build step. `build.rs` extracts the chart script
//! from the `plotly` crate.

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;

use crate::batch::Batch;
use crate::replay::{Head, Part, gzip};
use crate::sweep::SweepPage;

/// Script of the pages. Its files share one scope.
pub(crate) const SCRIPT: &str = concat!(
    "(() => {\n\"use strict\";\n",
    include_str!("../page/common.js"),
    include_str!("../page/replay-data.js"),
    include_str!("../page/per-agent.js"),
    include_str!("../page/data-source.js"),
    include_str!("../page/clock.js"),
    include_str!("../page/camera.js"),
    include_str!("../page/scene.js"),
    include_str!("../page/palette.js"),
    include_str!("../page/selection.js"),
    include_str!("../page/labels.js"),
    include_str!("../page/symbols.js"),
    include_str!("../page/detections.js"),
    include_str!("../page/trails.js"),
    include_str!("../page/links.js"),
    include_str!("../page/buildings.js"),
    include_str!("../page/layers.js"),
    include_str!("../page/view.js"),
    include_str!("../page/basemap.js"),
    include_str!("../page/road-names.js"),
    include_str!("../page/tiles.js"),
    include_str!("../page/zones.js"),
    include_str!("../page/map.js"),
    include_str!("../page/columns.js"),
    include_str!("../page/objects.js"),
    include_str!("../page/info-card.js"),
    include_str!("../page/run.js"),
    include_str!("../page/view-3d.js"),
    include_str!("../page/events.js"),
    include_str!("../page/timeline.js"),
    include_str!("../page/view-history.js"),
    include_str!("../page/link.js"),
    include_str!("../page/map-legend.js"),
    include_str!("../page/map-export.js"),
    include_str!("../page/map-video.js"),
    include_str!("../page/target-table.js"),
    include_str!("../page/state.js"),
    include_str!("../page/panels.js"),
    include_str!("../page/target-series.js"),
    include_str!("../page/legend.js"),
    include_str!("../page/hover.js"),
    include_str!("../page/export.js"),
    include_str!("../page/panel-menu.js"),
    include_str!("../page/compare-curves.js"),
    include_str!("../page/chart-pointer.js"),
    include_str!("../page/curve-summary.js"),
    include_str!("../page/charts.js"),
    include_str!("../page/compare-view.js"),
    include_str!("../page/outcome.js"),
    include_str!("../page/problems.js"),
    include_str!("../page/pointer.js"),
    include_str!("../page/search.js"),
    include_str!("../page/controls.js"),
    include_str!("../page/print.js"),
    include_str!("../page/replay.js"),
    include_str!("../page/flight.js"),
    include_str!("../page/batch-plots.js"),
    include_str!("../page/batch.js"),
    include_str!("../page/main.js"),
    "})();\n",
);
/// Script of the page of a sweep, which needs few of the other files.
const SWEEP_SCRIPT: &str = concat!(
    "(() => {\n\"use strict\";\n",
    include_str!("../page/common.js"),
    include_str!("../page/replay-data.js"),
    include_str!("../page/data-source.js"),
    include_str!("../page/palette.js"),
    include_str!("../page/batch-plots.js"),
    include_str!("../page/batch.js"),
    include_str!("../page/sweep-plots.js"),
    include_str!("../page/sweep.js"),
    "})();\n",
);
pub(crate) const STYLE: &str = include_str!("../page/style.css");
pub(crate) const REPLAY: &str = include_str!("../page/replay.html");
pub(crate) const BATCH: &str = include_str!("../page/batch.html");
const SWEEP: &str = include_str!("../page/sweep.html");
/// Controls of the page that flies missions, and the script of its worker.
const FLIGHT: &str = include_str!("../page/flight.html");
const FLIGHT_WORKER: &str = include_str!("../page/flight-worker.js");
/// Chart script (plotly.js), gzipped. A constant could be in the program twice.
pub(crate) static CHARTS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/plotly.js.gz"));

/// Decompresses the parts of a report, and runs the page script. It is the only script of a report in plain text.
const START: &str = include_str!("../page/boot.js");

/// Content security policy of a report: only its own contents may run, and nothing is fetched.
const REPORT_POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' blob:; style-src 'unsafe-inline'; \
                             img-src data: blob:; base-uri 'none'; form-action 'none'";

/// Content security policy of the page that flies missions: also its worker may run, and WebAssembly.
pub(crate) const FLIGHT_POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; worker-src blob:; \
                             style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'";

/// Makes the replay page of a run as one file that opens from disk without a network.
///
/// ```
/// use standoff_record::Manifest;
/// use standoff_sim::run::Mission;
/// use standoff_sim::scenario::{Overrides, Scenario};
/// use standoff_score::ScoreConfig;
/// use standoff_sim::world::World;
/// use standoff_view::figures::Setup;
/// use standoff_view::page::report;
/// use standoff_view::replay::{Encoder, Head};
///
/// let scenario = Scenario::load("tour/02-two-uavs", &Overrides::default(), 1)?;
/// let settings = &scenario.settings;
/// let manifest = Manifest::new(&scenario.name, scenario.seed, settings.duration.s(), settings.period.s());
/// let setup = Setup::of(manifest.title(), settings);
/// let mut encoder = Encoder::new(&settings.score_config(), 1);
/// let mut mission = Mission::new(&scenario).expect("the parameters of a built-in scenario are valid");
/// let mut parts = Vec::new();
/// while let Some(frame) = mission.frame() {
///     parts.extend(encoder.frame(frame));
/// }
/// parts.extend(encoder.part());
/// let page = report(&Head::new(&manifest, setup, World::names(&scenario)), &parts)?;
/// assert!(page.starts_with("<!DOCTYPE html>") && page.len() > 1_000_000);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn report(head: &Head, parts: &[Part]) -> serde_json::Result<String> {
    let mut page = begin(REPLAY, REPORT_POLICY);
    put(&mut page, "head", &gzip(head.json()?.as_bytes()));
    for (number, part) in parts.iter().enumerate() {
        put(&mut page, &format!("overview-{number}"), &part.overview);
        put(&mut page, &format!("detail-{number}"), &part.detail);
        if let Some(states) = &part.team_states {
            put(&mut page, &format!("team-states-{number}"), states);
        }
    }
    if let Some(map) = &head.map {
        put(&mut page, "map", map);
    }
    Ok(end(page, SCRIPT))
}

/// Makes the page that flies missions, as one file that opens from disk without a network. `engine` is the library
/// `standoff-web` compiled to WebAssembly, `glue` the script that wasm-bindgen makes for it, without modules, and
/// `scenarios` the texts of the built-in scenarios by name, as a JSON object.
pub fn flight_page(engine: &[u8], glue: &str, scenarios: &str) -> String {
    let mut page = begin(&format!("{FLIGHT}{REPLAY}"), FLIGHT_POLICY);
    put(&mut page, "engine", &gzip(engine));
    put(&mut page, "worker", &gzip(format!("{glue}\n{FLIGHT_WORKER}").as_bytes()));
    put(&mut page, "scenarios", &gzip(scenarios.as_bytes()));
    end(page, SCRIPT)
}

/// Makes the page of Monte Carlo results as one file that opens from disk without a network.
pub fn batch_report(batch: &Batch) -> serde_json::Result<String> {
    let mut page = begin(BATCH, REPORT_POLICY);
    put(&mut page, "batch", &gzip(batch.json()?.as_bytes()));
    Ok(end(page, SCRIPT))
}

/// Makes the page of a sweep as one file that opens from disk without a network.
pub fn sweep_report(sweep: &SweepPage) -> serde_json::Result<String> {
    let mut page = begin(SWEEP, REPORT_POLICY);
    put(&mut page, "sweep", &gzip(serde_json::to_string(sweep)?.as_bytes()));
    Ok(end(page, SWEEP_SCRIPT))
}

/// Start of a report file, up to its data.
fn begin(body: &str, policy: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>standoff</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{STYLE}</style>\n</head>\n<body>\n{body}"
    )
}

/// Appends a data block to a report file.
fn put(page: &mut String, name: &str, gz: &[u8]) {
    *page += &format!("<script type=\"application/gzip\" data-part=\"{name}\">{}</script>\n", BASE64.encode(gz));
}

/// Appends the page's script and plotly.js, and completes a report file.
fn end(mut page: String, script: &str) -> String {
    put(&mut page, "page", &gzip(script.as_bytes()));
    put(&mut page, "charts", CHARTS);
    page + &format!("<script>\n{START}</script>\n</body>\n</html>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn the_chart_script_contains_only_plotly() {
        let mut script = String::new();
        flate2::read::GzDecoder::new(CHARTS).read_to_string(&mut script).unwrap();
        assert!(script.contains("plotly.js v") && !script.contains("MathJax.js v"));
        assert!(CHARTS.len() < 2_000_000, "{} bytes", CHARTS.len());
    }

    /// The scripts share one scope: a name that is declared twice would be a syntax error.
    #[test]
    fn no_name_is_declared_in_two_scripts() {
        for script in [SCRIPT, SWEEP_SCRIPT] {
            check_names(script);
        }
    }

    fn check_names(script: &str) {
        let mut names = std::collections::BTreeSet::new();
        for line in script.lines() {
            let words: Vec<&str> = line.trim_start_matches("async ").split([' ', '(', ';']).collect();
            if let [kind, name, ..] = words[..]
                && ["const", "let", "class", "function", "function*"].contains(&kind)
            {
                assert!(names.insert(name), "{name} is declared twice");
            }
        }
        assert!(names.len() > 30, "{} names", names.len());
    }

    /// The page's own text is the only part that is not compressed, so it must not contain a script end tag.
    #[test]
    fn the_page_text_contains_no_script_end_tag() {
        assert!(!START.contains("</script"));
        assert!([REPLAY, BATCH, SWEEP, FLIGHT].iter().all(|body| !body.contains("<script")));
        for script in [SCRIPT, SWEEP_SCRIPT] {
            assert!(!script.contains("innerHTML") && !script.contains("document.write") && !script.contains("eval("));
        }
    }
}
