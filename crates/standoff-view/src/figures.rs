//! Static figures of a run: SVG documents drawn from one pass over its frames.
//!
//! The run is read as a stream and kept as small, thinned curves, so that neither memory nor the size
//! of a figure grows with the length of the run. The same frames always give the same bytes.

mod chart;
mod curve;
mod figure;
mod gather;
mod ink;
mod over_time;
pub mod study;
mod symbol;
#[cfg(test)]
pub(crate) mod tests;
mod trajectories;

use chart::Drawn;
pub use figure::{Figure, FigureError, Setup};
use gather::Run;
use standoff_sim::record::Frame;
use standoff_sim::score::Judge;

type Draw = fn(&Run, &Setup) -> Drawn<Option<String>>;

/// Every figure that there is, in the order in which they are returned.
const PAGES: [(&str, Draw); 8] = [
    ("trajectories", trajectories::draw),
    ("standoff_distance", over_time::standoff_distance),
    ("phase", over_time::phase),
    ("separation", over_time::separation),
    ("margin", over_time::margin),
    ("line_of_sight", over_time::line_of_sight),
    ("speed_and_turn_rate", over_time::speed_and_turn_rate),
    ("agreement", over_time::agreement),
];

/// Reads the frames once and draws `trajectories`, `standoff_distance`, `phase`, `separation`, `margin`,
/// `line_of_sight`, `speed_and_turn_rate` and `agreement` (of several minds), in this order; those without anything to
/// show are left out.
///
/// Values that are not finite or beyond any physical size are taken as missing.
pub fn figures<E>(
    frames: impl Iterator<Item = Result<Frame, E>>,
    setup: &Setup,
) -> Result<Vec<Figure>, FigureError<E>> {
    let (mut run, mut judge) = (Run::default(), Judge::new(setup.rules.clone()));
    for frame in frames {
        run.add(&frame.map_err(FigureError::Frame)?, &mut judge);
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
