//! What goes into a run's figures beside its frames, and what comes out.

use serde::Serialize;
use standoff_sim::scenario::Settings;
use standoff_sim::score::Rules;

/// What the figures need to know of a run beyond its frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setup {
    /// Caption of every figure.
    pub title: String,
    /// Full field of view of a sensor, rad.
    pub field_of_view_rad: f64,
    /// Slowest speed of a UAV, m/s.
    pub speed_min_m_s: f64,
    /// Fastest speed of a UAV, m/s.
    pub speed_max_m_s: f64,
    /// Largest turn rate of a UAV, rad/s.
    pub turn_rate_max_rad_s: f64,
    /// Smallest standoff distance allowed, m.
    pub radius_min_m: f64,
    /// Largest standoff distance allowed, m.
    pub radius_max_m: f64,
    /// Phase separation wanted between the two UAVs of one orbit, rad.
    pub separation_rad: f64,
    /// How many aircraft fly there that are not of the team.
    #[serde(skip_serializing_if = "is_none")]
    pub intruders: usize,
    /// The rules by which its orbits are judged.
    #[serde(skip)]
    pub rules: Rules,
}

impl Setup {
    /// Of a run with these settings.
    pub fn of(title: String, settings: &Settings) -> Self {
        let (uav, standoff) = (&settings.team.uav, &settings.team.group.standoff);
        Self {
            title,
            field_of_view_rad: settings.team.track.sensor.field_of_view_rad,
            speed_min_m_s: uav.speed_m_s - uav.speed_change_max_m_s,
            speed_max_m_s: uav.speed_m_s + uav.speed_change_max_m_s,
            turn_rate_max_rad_s: uav.turn_rate_max_rad_s,
            radius_min_m: standoff.radius_min_m,
            radius_max_m: standoff.radius_max_m,
            separation_rad: settings.team.guidance.separation_rad,
            intruders: settings.intruders,
            rules: Rules::of(settings),
        }
    }
}

fn is_none(intruders: &usize) -> bool {
    *intruders == 0
}

/// One finished figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// File name without its extension.
    pub name: &'static str,
    /// The SVG document.
    pub svg: String,
}

/// Why there are no figures.
#[derive(Debug, thiserror::Error)]
pub enum FigureError<E> {
    /// The run holds no instant.
    #[error("the run holds no frames, so there is nothing to draw")]
    NoFrames,
    /// A frame could not be read.
    #[error("a frame of the run could not be read")]
    Frame(#[source] E),
    /// The SVG writer refused a shape.
    #[error("figure `{figure}` could not be drawn: {reason}")]
    Draw {
        /// Name of the figure.
        figure: &'static str,
        /// What the writer said.
        reason: String,
    },
}
