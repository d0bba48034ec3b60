//! What a score needs to know of the scenario.

use std::collections::BTreeSet;
use std::sync::Arc;

use standoff::{
    Airspace, CentreEstimate, MotionParams, OrbitMotion, SensorParams, SeparationParams, Spread, StandoffDistance,
    StandoffParams, TargetParams, TargetState, Velocity,
};

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
    /// How quick an orbit's centre and radius may be.
    pub orbit_motion: MotionParams,
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
    /// How far apart UAVs are to be, whether they keep to it or not.
    pub separation: SeparationParams,
    /// The team's own brain keeps them so.
    pub keeps_apart: bool,
    /// Separation of a pair, rad.
    pub separation_rad: f64,
    /// Time between two frames, s.
    pub period_s: f64,
    /// From when on the settled metrics count, s.
    pub settle_s: f64,
    /// Where UAVs may fly.
    pub airspace: Airspace,
    /// When the last of those faults of the radio, and restarts, is over that are so within the mission, s.
    pub faults_end_s: Option<f64>,
}

impl Rules {
    /// The rules of a mission whose brain tells all of itself.
    pub fn of(settings: &Settings) -> Self {
        Self {
            reported: Reported::default(),
            standoff: settings.team.group.standoff,
            centre: settings.team.group.centre,
            orbit_motion: settings.team.group.motion,
            sensor: settings.team.track.sensor,
            target: settings.team.track.target,
            motion: settings.motion(),
            manoeuvring: Arc::clone(&settings.manoeuvring),
            noise: settings.noise,
            cue: settings.cue,
            separation: settings.team.separation.unwrap_or_default(),
            keeps_apart: settings.team.separation.is_some(),
            separation_rad: settings.team.guidance.separation_rad,
            period_s: settings.period.s(),
            settle_s: settings.settle.s(),
            airspace: settings.airspace.clone(),
            faults_end_s: settings.faults_end_s,
        }
    }

    /// The orbit that members should have if it could be there at once: about the centre by the rule flown, as fast as
    /// they are on average, with r_d (15) about it without a margin. `None` for no members.
    pub(super) fn orbit(&self, members: &[TargetState]) -> Option<OrbitMotion> {
        let centre = true_centre(self.centre, members.iter().map(TargetState::position))?;
        let mean_m_s = |of: fn(Velocity) -> f64| {
            members.iter().map(|member| of(member.velocity())).sum::<f64>() / members.len() as f64
        };
        let velocity = Velocity::from_m_s(mean_m_s(Velocity::x_m_s), mean_m_s(Velocity::y_m_s));
        let centre = TargetState::new(centre, velocity, [0.0; 2]);
        Some(OrbitMotion::start(&centre, &self.standoff_distance(members, &centre, 0.0)))
    }

    /// The orbit flown a period after another, when it should be where `wanted` is: the centre on its way there, and the
    /// radius on its way to (15) of the members about that, with a margin. Without a motion, `wanted` itself.
    pub(super) fn orbit_after(
        &self,
        flown: &OrbitMotion,
        wanted: &OrbitMotion,
        members: &[TargetState],
        margin_m: f64,
    ) -> OrbitMotion {
        let (motion, period_s) = (&self.orbit_motion, self.period_s);
        if motion.is_at_once() {
            return *wanted;
        }
        let flown = flown.centred_on(&wanted.state(), motion, period_s);
        let wanted_m = self.standoff_distance(members, &flown.state(), margin_m).distance_m;
        flown.widened_to(wanted_m, &self.standoff, motion, period_s)
    }

    /// (15) of members about a centre.
    pub(super) fn standoff_distance(
        &self,
        members: &[TargetState],
        centre: &TargetState,
        margin_m: f64,
    ) -> StandoffDistance {
        let at = centre.position();
        let squared_m2 = |member: &TargetState| member.position().squared_distance_m2(at);
        let furthest = members.iter().max_by(|one, other| squared_m2(one).total_cmp(&squared_m2(other)));
        let spread = furthest.map_or(Spread::default(), |furthest| Spread {
            distance_m: squared_m2(furthest).sqrt(),
            ..Spread::of(furthest, centre)
        });
        self.standoff.distance(spread, margin_m)
    }
}
