//! Index of the UAVs by their last reported positions.

use crate::coordination::teammate::Teammate;
use crate::frame::Position;
use crate::grid::Grid;

/// Width of a cell, m: collision avoidance searches within one or two kilometres.
const CELL_M: f64 = 1000.0;

/// Last reported positions of the UAVs of a team.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ReportedPlaces {
    grid: Grid,
    /// Highest reported speed, m/s.
    pub(crate) fastest_m_s: f64,
}

impl ReportedPlaces {
    pub(crate) fn rebuild(&mut self, team: &[Teammate]) {
        self.grid.fill(team.iter().map(|teammate| teammate.last_report.position), CELL_M);
        let speeds_m_s = team.iter().map(|teammate| teammate.last_report.speed_m_s.abs());
        self.fastest_m_s = speeds_m_s.fold(0.0, f64::max);
    }

    /// Indices of the UAVs within a distance, and of some beyond it; ascending.
    pub(crate) fn near<'a>(
        &self,
        at: Position,
        radius_m: f64,
        buffer: &'a mut Vec<usize>,
    ) -> impl Iterator<Item = usize> + Clone + use<'a> {
        self.grid.near_ascending(at, radius_m, buffer)
    }
}
