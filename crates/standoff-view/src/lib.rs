//! A run to look at, from its record: static figures, and a page that replays it.

pub mod figures;
pub mod page;
pub mod replay;
