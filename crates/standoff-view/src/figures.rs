//! Static figures of a run: SVG documents drawn from one pass over its frames.
//!
//! The run is read as a stream and kept as small, thinned curves, so that neither memory nor the size
//! of a figure grows with the length of the run. The same frames always give the same bytes.

mod chart;
mod curve;
mod gather;
mod line_of_sight;
mod margin;
mod phase;
mod separation;
mod speed_and_turn_rate;
mod standoff_distance;
pub mod study;
mod symbol;
#[cfg(test)]
pub(crate) mod tests;
mod trajectories;

use chart::Drawn;
use gather::Run;
use serde::Serialize;
use standoff_sim::record::Frame;
use standoff_sim::scenario::Settings;

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
        }
    }
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

type Draw = fn(&Run, &Setup) -> Drawn<Option<String>>;

/// Every figure that there is, in the order in which they are returned.
const PAGES: [(&str, Draw); 7] = [
    ("trajectories", trajectories::draw),
    ("standoff_distance", standoff_distance::draw),
    ("phase", phase::draw),
    ("separation", separation::draw),
    ("margin", margin::draw),
    ("line_of_sight", line_of_sight::draw),
    ("speed_and_turn_rate", speed_and_turn_rate::draw),
];

/// Reads the frames once and draws `trajectories`, `standoff_distance`, `phase`, `separation`, `margin`,
/// `line_of_sight` and `speed_and_turn_rate`, in this order; those without anything to show are left out.
///
/// Values that are not finite or beyond any physical size are taken as missing.
pub fn figures<E>(
    frames: impl Iterator<Item = Result<Frame, E>>,
    setup: &Setup,
) -> Result<Vec<Figure>, FigureError<E>> {
    let mut run = Run::default();
    for frame in frames {
        run.add(&frame.map_err(FigureError::Frame)?);
    }
    if run.frames == 0 {
        return Err(FigureError::NoFrames);
    }
    let finish = |(name, draw): (_, Draw)| match draw(&run, setup) {
        Ok(svg) => svg.map(|svg| Ok(Figure { name, svg })),
        Err(error) => Some(Err(FigureError::Draw { figure: name, reason: error.to_string() })),
    };
    PAGES.into_iter().filter_map(finish).collect()
}
