//! Visualisation of runs: static figures, a page that replays a run, pages for Monte Carlo results and sweeps, and a
//! local web server for these pages.

pub mod batch;
mod colours;
#[cfg(test)]
#[path = "../../standoff-sim/tests/common/mod.rs"]
mod common;
pub mod figures;
pub mod image;
pub mod page;
pub mod replay;
#[cfg(test)]
#[path = "../../standoff-record/tests/common/mod.rs"]
mod row_fixtures;
#[cfg(test)]
#[path = "../../standoff-score/tests/common/mod.rs"]
mod score_fixtures;
#[cfg(feature = "server")]
pub mod serve;
#[cfg(feature = "server")]
pub mod site;
pub mod sweep;
#[cfg(feature = "server")]
pub mod tiles;

pub use bytes::Bytes;
