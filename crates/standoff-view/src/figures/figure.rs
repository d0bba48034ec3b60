//! Input of the figures in addition to the frames, and their output.

use serde::Serialize;
use standoff::tracking::association::scan_model::GATE;
use standoff_score::ScoreConfig;
use standoff_sim::scenario::Settings;

/// Properties of a run that the figures need in addition to its frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setup {
    /// Caption of every figure.
    pub title: String,
    /// Description of the scenario in one line; empty if it has none.
    #[serde(skip)]
    pub about: String,
    /// Full angle of a sensor's field of view, rad.
    pub field_of_view_rad: f64,
    /// Sensing range, m.
    pub sensing_range_m: f64,
    /// Minimum speed of a UAV, m/s.
    pub speed_min_m_s: f64,
    /// Maximum speed of a UAV, m/s.
    pub speed_max_m_s: f64,
    /// Maximum turn rate of a UAV, rad/s.
    pub turn_rate_max_rad_s: f64,
    /// Smallest standoff distance allowed, m.
    pub radius_min_m: f64,
    /// Largest standoff distance allowed, m.
    pub radius_max_m: f64,
    /// Desired phase between two UAVs on one orbit, rad.
    pub desired_phase_rad: f64,
    /// Number of intruders.
    #[serde(skip_serializing_if = "is_none")]
    pub intruders: usize,
    /// What the replay page needs to show detections; `None` for ideal sensors, which detect and identify every target
    /// in view and nothing else.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detections: Option<DetectionSetup>,
    /// Rules for scoring the run.
    #[serde(skip)]
    pub rules: ScoreConfig,
}

impl Setup {
    /// Makes the setup of a run with these settings.
    pub fn of(title: String, settings: &Settings) -> Self {
        let (uav, standoff) = (&settings.team.uav, &settings.team.group.standoff);
        let [speed_min_m_s, speed_max_m_s] = uav.speeds_m_s();
        Self {
            title,
            about: settings.about.clone(),
            field_of_view_rad: settings.team.track.sensor.field_of_view_rad,
            sensing_range_m: settings.team.track.sensor.sensing_range_m,
            speed_min_m_s,
            speed_max_m_s,
            turn_rate_max_rad_s: uav.turn_rate_max_rad_s,
            radius_min_m: standoff.radius_min_m,
            radius_max_m: standoff.radius_max_m,
            desired_phase_rad: settings.team.guidance.desired_phase_rad,
            intruders: settings.intruders,
            detections: DetectionSetup::of(settings),
            rules: settings.score_config(),
        }
    }
}

/// Properties of sensors that are not ideal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DetectionSetup {
    /// True if the sensors report the identities of targets.
    pub has_labels: bool,
    /// Standard deviation of the range that the team assumes, m.
    pub range_sd_m: f64,
    /// Standard deviation of the bearing that the team assumes, rad.
    pub bearing_sd_rad: f64,
    /// Largest squared distance of a detection from its prediction, in standard deviations, at which they are associated.
    pub gate: f64,
    /// True minimum detectable velocity, m/s; 0: no limit.
    pub mdv_m_s: f64,
}

impl DetectionSetup {
    /// Returns the properties of the sensors of a run; `None` if they are ideal.
    fn of(settings: &Settings) -> Option<Self> {
        let (sensor, assumed) = (&settings.sensor, &settings.team.track.sensor);
        let is_ideal = sensor.has_labels && sensor.always_detects() && sensor.truth.false_alarms_per_scan <= 0.0;
        (!is_ideal).then_some(Self {
            has_labels: sensor.has_labels,
            range_sd_m: assumed.range_sd_m,
            bearing_sd_rad: assumed.bearing_sd_rad,
            gate: GATE,
            mdv_m_s: sensor.truth.mdv_m_s,
        })
    }
}

fn is_none(intruders: &usize) -> bool {
    *intruders == 0
}

/// A finished figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// File name without its extension.
    pub name: &'static str,
    /// The SVG document.
    pub svg: String,
}

/// Reason why no figures could be drawn.
#[derive(Debug, thiserror::Error)]
pub enum FigureError<E> {
    /// The run has no frames.
    #[error("the run has no frames, so there is nothing to draw")]
    NoFrames,
    /// A frame could not be read.
    #[error("a frame of the run could not be read")]
    Frame(#[source] E),
    /// The SVG writer failed.
    #[error("figure `{figure}` could not be drawn: {reason}")]
    Draw {
        /// Name of the figure.
        figure: &'static str,
        /// Error message of the writer.
        reason: String,
    },
}
