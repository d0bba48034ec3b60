//! Reproduction of the paper's tables, figures and claims; its errata; and an evaluation of this project's
//! improvements.
//!
//! A study produces claims, tables, figures and data. A claim contains the paper's number and ours; fixed rules derive
//! its verdict. The page of all claims depends only on the studies.

mod ablation;
mod claim;
mod coverage;
mod errata;
mod error;
mod metric_table;
mod missions;
mod monte_carlo_plan;
mod page;
mod percentile_bands;
mod phase_angle;
mod statistics;
mod street_traffic;
mod study;
mod table_2;
mod wind;

pub use error::Failure;
pub use monte_carlo_plan::{PAPER_LAW, Plan};
pub use page::write_page;
pub use study::{Study, claims_file, rules, save, summary};

/// A table, figure or topic that can be reproduced.
#[derive(Debug, Clone, Copy)]
pub struct StudyGroup {
    /// Command-line argument that selects it, and name of its file of claims.
    pub name: &'static str,
    /// Short description.
    pub about: &'static str,
    /// Functions that measure the paper's claims, which are on the page.
    claims: &'static [study::Measure],
    /// Functions that measure what goes beyond the paper.
    beyond: &'static [study::Measure],
}

impl StudyGroup {
    /// True if the page has some of its studies.
    pub fn has_claims(&self) -> bool {
        !self.claims.is_empty()
    }

    /// Measures the paper's claims. Fails if a scenario cannot be used.
    pub fn measure_claims(&self, plan: &Plan) -> Result<Vec<Study>, Failure> {
        self.claims.iter().map(|measure| measure(plan)).collect()
    }

    /// Runs all its studies. Fails if a scenario, or the traffic that the plan names, cannot be used.
    pub fn measure(&self, plan: &Plan) -> Result<Vec<Study>, Failure> {
        self.claims.iter().chain(self.beyond).map(|measure| measure(plan)).collect()
    }
}

/// All study groups, in the order of the page.
pub const STUDY_GROUPS: [StudyGroup; 11] = [
    StudyGroup {
        name: "table-2",
        about: "Mean errors of one and of two UAVs, with and without the active measures",
        claims: &[table_2::table_2],
        beyond: &[table_2::overconfident_filters],
    },
    StudyGroup {
        name: "figure-6",
        about: "Information of a pair of UAVs as a function of the target's bearing",
        claims: &[phase_angle::figure_6],
        beyond: &[],
    },
    StudyGroup {
        name: "figure-7",
        about: "Mean information of a pair, by sensor and phase difference",
        claims: &[phase_angle::figure_7],
        beyond: &[],
    },
    StudyGroup { name: "figure-8", about: "Four targets, two UAVs", claims: &[missions::figure_8], beyond: &[] },
    StudyGroup {
        name: "figure-9",
        about: "Seven targets, four UAVs: a handoff, a removal",
        claims: &[missions::figure_9],
        beyond: &[],
    },
    StudyGroup {
        name: "figure-10",
        about: "Time histories of the mission of figure 9",
        claims: &[missions::figure_10],
        beyond: &[],
    },
    StudyGroup {
        name: "figure-11",
        about: "Off-boresight angles in the mission of figure 9, with and without active measures and dwell",
        claims: &[missions::figure_11],
        beyond: &[],
    },
    StudyGroup { name: "errata", about: "Errors in the published equations", claims: &errata::ERRATA, beyond: &[] },
    StudyGroup {
        name: "improvements",
        about: "Effect of each improvement of this project, and the remaining distance from theoretical limits",
        claims: &[],
        beyond: &[ablation::improvements],
    },
    StudyGroup {
        name: "coverage",
        about: "Custody of traffic and control effort, with the paper's law and with the improvements",
        claims: &[],
        beyond: &[coverage::coverage],
    },
    StudyGroup {
        name: "wind",
        about: "A pair of UAVs in wind, and on aircraft that bank",
        claims: &[],
        beyond: &[wind::wind],
    },
];
