//! Scenario parameters that the scoring needs.

use std::collections::BTreeSet;
use std::sync::Arc;

use standoff::research::{OrbitMotion, Spread};
use standoff::{
    CentreEstimate, Geofence, MotionParams, SensorParams, SeparationParams, StandoffDistance, StandoffParams,
    TargetParams, TargetState, Velocity,
};

use crate::frame::ReportedTables;
use crate::geometry::true_centre;
use crate::scenario::{CueError, Noise, Settings};

/// Scenario parameters that the scoring needs.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreConfig {
    /// Tables that the controller reports.
    pub reported: ReportedTables,
    /// Radius limits, and the margin of the field of view.
    pub standoff: StandoffParams,
    /// Definition of the orbit centre: centroid of the targets or centre of their minimum enclosing circle.
    pub centre: CentreEstimate,
    /// Motion limits of the orbit's centre and radius.
    pub orbit_motion: MotionParams,
    /// Field of view, sensing range, and the noise that the filters assume.
    pub sensor: SensorParams,
    /// Target model that the filters assume.
    pub target: TargetParams,
    /// Model that the targets really follow, if any.
    pub motion: Option<TargetParams>,
    /// Ids of the targets of that model that also manoeuvre.
    pub manoeuvring: Arc<BTreeSet<u32>>,
    /// Real noise of the sensors.
    pub noise: Noise,
    /// Accuracy of the cues.
    pub cue: CueError,
    /// Minimum separation of the UAVs, whether collision avoidance is on or off.
    pub separation: SeparationParams,
    /// True if the team's own controller does collision avoidance.
    pub has_separation: bool,
    /// Desired phase of a pair, rad.
    pub desired_phase_rad: f64,
    /// Time between two frames, s.
    pub period_s: f64,
    /// Start time of the `*_settled` metrics, s.
    pub transient_s: f64,
    /// Geofence.
    pub geofence: Geofence,
    /// End of the last radio fault or restart that ends within the mission, s.
    pub faults_end_s: Option<f64>,
}

impl ScoreConfig {
    /// Returns the scoring configuration of a mission whose controller reports all tables.
    pub fn of(settings: &Settings) -> Self {
        Self {
            reported: ReportedTables::default(),
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
            has_separation: settings.team.separation.is_some(),
            desired_phase_rad: settings.team.guidance.desired_phase_rad,
            period_s: settings.period.s(),
            transient_s: settings.transient.s(),
            geofence: settings.geofence.clone(),
            faults_end_s: settings.faults_end_s,
        }
    }

    /// Returns the orbit of the members without motion limits: centre by the configured rule, mean velocity of the
    /// members, and radius r_d (15) without a margin. `None` without members.
    pub(super) fn orbit(&self, members: &[TargetState]) -> Option<OrbitMotion> {
        let centre = true_centre(self.centre, members.iter().map(TargetState::position))?;
        let mean_m_s = |of: fn(Velocity) -> f64| {
            members.iter().map(|member| of(member.velocity())).sum::<f64>() / members.len() as f64
        };
        let velocity = Velocity::from_m_s(mean_m_s(Velocity::x_m_s), mean_m_s(Velocity::y_m_s));
        let centre = TargetState::new(centre, velocity, [0.0; 2]);
        Some(OrbitMotion::start(&centre, &self.standoff_distance(members, &centre, 0.0)))
    }

    /// Returns the orbit one period after `flown`, on its way to `desired`: the centre moves towards that of `desired`,
    /// and the radius towards (15) of the members about the moved centre, with a margin. Returns `desired` itself if
    /// motion limits are off.
    pub(super) fn orbit_after(
        &self,
        flown: &OrbitMotion,
        desired: &OrbitMotion,
        members: &[TargetState],
        margin_m: f64,
    ) -> OrbitMotion {
        let (motion, period_s) = (&self.orbit_motion, self.period_s);
        if motion.is_instantaneous() {
            return *desired;
        }
        let flown = flown.with_centre(&desired.state(), motion, period_s);
        let target_radius_m = self.standoff_distance(members, &flown.state(), margin_m).distance_m;
        flown.with_radius(target_radius_m, &self.standoff, motion, period_s)
    }

    /// Computes (15) of members about a centre.
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
        self.standoff.distance(spread, margin_m, &self.sensor)
    }
}
