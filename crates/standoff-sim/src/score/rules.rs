//! What a score needs to know of the scenario.

use std::collections::BTreeSet;
use std::sync::Arc;

use standoff::{CentreEstimate, Position, SensorParams, Spread, StandoffParams, TargetParams};

use crate::frame::Reported;
use crate::geometry::true_centre;
use crate::scenario::{CueError, Noise, Settings};

/// What a score needs to know of the scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct Rules {
    /// What the record tells of the brain.
    pub reported: Reported,
    /// The orbit's bounds and the field of view with its margin.
    pub standoff: StandoffParams,
    /// What an orbit is about: the centroid of its targets, or the centre of the smallest circle about them.
    pub centre: CentreEstimate,
    /// Field of view and sensing range, and the noise that the filters assume.
    pub sensor: SensorParams,
    /// The target model that the filters assume.
    pub target: TargetParams,
    /// The model that the targets really follow, if they follow one.
    pub motion: Option<TargetParams>,
    /// The targets of that model which manoeuvre besides, by id.
    pub manoeuvring: Arc<BTreeSet<u32>>,
    /// The sensors' real noise.
    pub noise: Noise,
    /// How well targets are handed over.
    pub cue: CueError,
    /// Separation of a pair, rad.
    pub separation_rad: f64,
    /// Time between two frames, s.
    pub period_s: f64,
    /// From when on the settled metrics count, s.
    pub settle_s: f64,
}

impl Rules {
    /// The rules of a mission whose brain tells all of itself.
    pub fn of(settings: &Settings) -> Self {
        Self {
            reported: Reported::default(),
            standoff: settings.team.group.standoff,
            centre: settings.team.group.centre,
            sensor: settings.team.track.sensor,
            target: settings.team.track.target,
            motion: settings.motion(),
            manoeuvring: Arc::clone(&settings.manoeuvring),
            noise: settings.noise,
            cue: settings.cue,
            separation_rad: settings.team.guidance.separation_rad,
            period_s: settings.period.s(),
            settle_s: settings.settle.s(),
        }
    }

    /// The orbit that members should have, by the rule flown: its centre, and r_d (15) about that without a margin, m.
    pub(super) fn orbit(&self, members: &[Position]) -> Option<(Position, f64)> {
        let centre = true_centre(self.centre, members)?;
        Some((centre, self.standoff_m(members, centre, 0.0)))
    }

    /// r_d (15) of members about a centre, m.
    pub(super) fn standoff_m(&self, members: &[Position], centre: Position, margin_m: f64) -> f64 {
        let squared_m2 = members.iter().map(|member| member.squared_distance_m2(centre));
        let spread = Spread { distance_m: squared_m2.fold(0.0, f64::max).sqrt(), rate_m_s: 0.0 };
        self.standoff.distance(spread, margin_m).distance_m
    }
}
