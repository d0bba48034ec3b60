//! Pilot: the half of a time step that is individual to one UAV, from the team state to its command.

use crate::command_law::{CommandLaw, LastDecision};
use crate::intruders::Intruders;
use crate::message::Manoeuvre;
use crate::output::{AgentOutput, Observation, Rejected};
use crate::params::WindParams;
use crate::safety::team_geofence::TeamGeofence;
use crate::state_update::TeamStateUpdater;
use crate::team_state::TeamState;
use crate::wind::{AirVelocity, Wind, WindEstimate};

/// What one UAV knows besides the team state: the wind, and what it flies.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Pilot {
    last_decision: LastDecision,
    wind: Option<WindEstimate>,
}

impl Pilot {
    /// Manoeuvre that the UAV reports.
    pub(crate) fn manoeuvre(&self) -> Option<Manoeuvre> {
        self.last_decision.manoeuvre
    }

    /// Estimates the wind from the UAV's velocity relative to the air.
    pub(crate) fn observe_air(&mut self, params: &WindParams, observation: &Observation, air: &AirVelocity) {
        let measured = Wind::measured(observation.own.velocity(), air);
        self.wind = WindEstimate::updated(self.wind, params, observation.time, measured);
    }

    /// Returns the command of the observed UAV. `own_zones` replace those of the team.
    pub(crate) fn decide(
        &mut self,
        (updater, team_state): (&mut TeamStateUpdater, &TeamState),
        own_zones: Option<&mut TeamGeofence>,
        intruders: &Intruders,
        observation: &Observation,
        rejected: Rejected,
    ) -> AgentOutput {
        let wind = updater.params.wind.and_then(|params| params.believed(self.wind.as_ref()));
        let safety = updater.geofence_safety(own_zones, observation.uav, &observation.own, wind);
        let law = CommandLaw {
            params: &updater.params,
            team_state,
            geofence_safety: safety.as_deref(),
            intruders,
            fallbacks: updater.fallbacks.as_ref(),
            wind,
        };
        let (output, decision) = law.decide(observation, rejected, &self.last_decision);
        self.last_decision = decision;
        output
    }
}
