//! The paper's tables, figures and claims, measured again; what is wrong in print; what this project's improvements gain.
//!
//! A study comes to claims, tables, figures and data. A claim holds the paper's number and ours, and its verdict follows
//! by rule. The page of all claims is a function of the studies.

mod claim;
mod errata;
mod failure;
mod flights;
mod history;
mod improvements;
mod missions;
mod observe;
mod page;
mod separation;
mod statistics;
mod study;
mod table_2;

pub use failure::Failure;
pub use flights::Plan;
pub use page::write_page;
pub use study::{Study, claims_file, save, summary};

/// Something that can be reproduced.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    /// What asks for it, and the name of its file of claims.
    pub name: &'static str,
    /// What it is, in a sentence.
    pub about: &'static str,
    /// Measures it. Fails if a scenario, or the traffic that the plan names, cannot be used.
    pub measure: fn(&Plan) -> Result<Vec<Study>, Failure>,
}

/// All there is, in the order of the page.
pub const PIECES: [Piece; 9] = [
    piece("table-2", "Mean errors of one and of two UAVs, with and without the active measures", table_2::table_2),
    piece("figure-6", "Information of a pair by the target's bearing", separation::figure_6),
    piece("figure-7", "Its mean, by sensor and separation", separation::figure_7),
    piece("figure-8", "Four targets, two UAVs", missions::figure_8),
    piece("figure-9", "Seven targets, four UAVs: a handoff, a discard", missions::figure_9),
    piece("figure-10", "Histories of that mission", missions::figure_10),
    piece("figure-11", "Its lines of sight, with and without measures and dwell", missions::figure_11),
    piece("errata", "What is wrong in print", errata::errata),
    piece("improvements", IMPROVEMENTS, improvements::improvements),
];

const IMPROVEMENTS: &str =
    "What this project's improvements gain, one at a time, and how close the best is to what is possible";

const fn piece(name: &'static str, about: &'static str, measure: fn(&Plan) -> Result<Vec<Study>, Failure>) -> Piece {
    Piece { name, about, measure }
}
