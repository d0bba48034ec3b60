//! A run to look at, from its record: static figures, a page that replays it, and an MCAP file for viewers of robots. Many
//! runs to look at, from their results. And the server of such pages.

pub mod batch;
mod colours;
pub mod figures;
#[cfg(feature = "mcap")]
pub mod mcap;
pub mod page;
pub mod replay;
pub mod serve;
pub mod site;
