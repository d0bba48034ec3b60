//! A run to look at, from its record: static figures, a page that replays it, and the server of such pages.

pub mod figures;
pub mod page;
pub mod replay;
pub mod serve;
pub mod site;
