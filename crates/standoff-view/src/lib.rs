//! A run to look at, from its record: static figures, a page that replays it and the server of such pages, and an MCAP
//! file for viewers of robots.

pub mod figures;
#[cfg(feature = "mcap")]
pub mod mcap;
pub mod page;
pub mod replay;
pub mod serve;
pub mod site;
