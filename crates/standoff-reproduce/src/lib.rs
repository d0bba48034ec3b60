//! The paper's tables, figures and claims, measured again; what is wrong in print; what this project's improvements gain.
//!
//! A study comes to claims, tables, figures and data. A claim holds the paper's number and ours, and its verdict follows
//! by rule. The page of all claims is a function of the studies.

mod claim;
mod coverage;
mod errata;
mod failure;
mod flights;
mod history;
mod improvements;
mod missions;
mod page;
mod separation;
mod statistics;
mod streets;
mod study;
mod table_2;

pub use failure::Failure;
pub use flights::{PAPERS_LAW, Plan};
pub use page::write_page;
pub use study::{Study, claims_file, save, summary};

/// Something that can be reproduced.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    /// What asks for it, and the name of its file of claims.
    pub name: &'static str,
    /// What it is, in a sentence.
    pub about: &'static str,
    /// What measures its studies.
    studies: &'static [study::Measure],
}

impl Piece {
    /// Measures it. Fails if a scenario, or the traffic that the plan names, cannot be used.
    pub fn measure(&self, plan: &Plan) -> Result<Vec<Study>, Failure> {
        self.studies.iter().map(|measure| measure(plan)).collect()
    }
}

/// All there is, in the order of the page.
pub const PIECES: [Piece; 10] = [
    Piece {
        name: "table-2",
        about: "Mean errors of one and of two UAVs, with and without the active measures",
        studies: &[table_2::table_2],
    },
    Piece {
        name: "figure-6",
        about: "Information of a pair by the target's bearing",
        studies: &[separation::figure_6],
    },
    Piece { name: "figure-7", about: "Its mean, by sensor and separation", studies: &[separation::figure_7] },
    Piece { name: "figure-8", about: "Four targets, two UAVs", studies: &[missions::figure_8] },
    Piece { name: "figure-9", about: "Seven targets, four UAVs: a handoff, a discard", studies: &[missions::figure_9] },
    Piece { name: "figure-10", about: "Histories of that mission", studies: &[missions::figure_10] },
    Piece {
        name: "figure-11",
        about: "Its lines of sight, with and without measures and dwell",
        studies: &[missions::figure_11],
    },
    Piece { name: "errata", about: "What is wrong in print", studies: &errata::ERRATA },
    Piece {
        name: "improvements",
        about: "What this project's improvements gain, one at a time, and how close the best is to what is possible",
        studies: &[improvements::improvements],
    },
    Piece {
        name: "coverage",
        about: "How much of the traffic is watched, and how calmly, by the paper's law and with what is new",
        studies: &[coverage::coverage],
    },
];
