//! Scores for the tests of this crate and of the crates that build on it.

#![allow(dead_code, unreachable_pub, clippy::allow_attributes, reason = "a module shared by test binaries")]

use std::sync::Arc;

use standoff::TeamParams;
use standoff_record::Frame;
use standoff_score::{CueError, MetricSelection, Metrics, Noise, ScoreConfig, Scorer};
use standoff_sim::scenario::Settings;

/// Scoring configuration of a team with the paper's parameters and the cues of its missions.
pub fn score_config() -> ScoreConfig {
    let cue = CueError { position_sd_m: 20.0, velocity_sd_m_s: 2.0 };
    ScoreConfig { cue, transient_s: 60.0, ..ScoreConfig::new(&TeamParams::paper(), 0.5) }
}

/// Same as `Settings::score_config`, but with the types of the crate under test, which differ in its unit tests.
pub fn config_of(settings: &Settings) -> ScoreConfig {
    ScoreConfig {
        noise: Noise {
            range_sd_m: settings.sensor.truth.range_sd_m,
            bearing_sd_rad: settings.sensor.truth.bearing_sd_rad,
        },
        cue: CueError { position_sd_m: settings.cue.position_sd_m, velocity_sd_m_s: settings.cue.velocity_sd_m_s },
        motion: settings.motion(),
        manoeuvring: Arc::clone(&settings.manoeuvring),
        transient_s: settings.transient.s(),
        geofence: settings.geofence.clone(),
        faults_end_s: settings.faults_end_s,
        ..ScoreConfig::new(&settings.team, settings.period.s())
    }
}

/// All metrics of these frames.
pub fn score<'a>(config: &ScoreConfig, frames: impl IntoIterator<Item = &'a Frame>) -> Metrics {
    let mut scorer = Scorer::new(config.clone(), MetricSelection::all());
    frames.into_iter().for_each(|frame| scorer.frame(frame));
    scorer.metrics()
}
