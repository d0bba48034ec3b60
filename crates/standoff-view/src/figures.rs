//! Static figures of a run: SVG documents drawn from one pass over its frames.
//!
//! The run is read as a stream and stored as small, thinned curves. Memory use and figure size therefore do not grow
//! with the length of the run. The same frames always give the same bytes.

mod chart;
mod collect;
mod curve;
mod figure;
pub mod study;
mod style;
mod symbol;
#[cfg(test)]
pub(crate) mod tests;
mod time_series;
mod trajectories;

use chart::Drawn;
use collect::Run;
pub use figure::{DetectionSetup, Figure, FigureError, Setup};
use standoff_record::Frame;
use standoff_score::FrameScorer;
pub(crate) use trajectories::arc;

type Draw = fn(&Run, &Setup) -> Drawn<Option<String>>;

/// All figures, in the order in which they are returned.
const PAGES: [(&str, Draw); 8] = [
    ("trajectories", trajectories::draw),
    ("standoff_distance", time_series::standoff_distance),
    ("phase", time_series::phase),
    ("separation", time_series::separation),
    ("margin", time_series::margin),
    ("off_boresight", time_series::off_boresight),
    ("speed_and_turn_rate", time_series::speed_and_turn_rate),
    ("agreement", time_series::agreement),
];

/// Reads the frames once and draws `trajectories`, `standoff_distance`, `phase`, `separation`, `margin`,
/// `off_boresight`, `speed_and_turn_rate` and `agreement` (only with one agent per UAV), in this order. Figures without
/// data are left out.
///
/// Values that are not finite or too large for a physical quantity are treated as missing.
pub fn figures<E>(
    frames: impl Iterator<Item = Result<Frame, E>>,
    setup: &Setup,
) -> Result<Vec<Figure>, FigureError<E>> {
    let (mut run, mut scorer) = (Run::default(), FrameScorer::new(setup.rules.clone()));
    for frame in frames {
        run.add(&frame.map_err(FigureError::Frame)?, &mut scorer);
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
