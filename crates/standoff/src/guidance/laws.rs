//! The named guidance laws, each in a file.

use crate::guidance::law::GuidanceLaw;
use crate::guidance::laws::oh_2015::Oh2015;
use crate::guidance::laws::standoff::Standoff;
use crate::params::{GuidanceParams, Law};

pub(crate) mod oh_2015;
pub(crate) mod standoff;

impl Law {
    /// The law's guidance.
    fn guidance(self) -> &'static dyn GuidanceLaw {
        match self {
            Self::Standoff => &Standoff,
            Self::Oh2015 => &Oh2015,
        }
    }
}

impl GuidanceParams {
    /// Guidance of the named law.
    pub(crate) fn law(&self) -> &'static dyn GuidanceLaw {
        self.law.guidance()
    }

    /// Returns the lead k_rd, s, on an orbit of `radius_m` that is flown at `speed_m_s` relative to its centre.
    pub fn lead_s(&self, radius_m: f64, speed_m_s: f64) -> f64 {
        self.law().lead_s(self, radius_m, speed_m_s)
    }
}
