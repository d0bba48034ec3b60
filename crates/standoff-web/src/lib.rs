//! Missions in the browser: flies a scenario and encodes it for the replay page, without files, threads or a clock.
//!
//! A worker of the page calls [`Flight`], which is compiled to WebAssembly; see `page/flight-worker.js` in
//! `standoff-view`. The same code runs natively in the tests.

mod flight;
mod request;
mod seeds;

pub use flight::Flight;
pub use request::{Request, give_file, scenarios};
pub use seeds::{Seeds, statistics_of};
