//! Pilot: the half of a time step that is individual to one UAV, from the team state to its command.

use crate::command_law::{CommandLaw, LastDecision};
use crate::intruders::Intruders;
use crate::message::Manoeuvre;
use crate::output::{AgentOutput, Observation, Rejected};
use crate::params::WindParams;
use crate::safety::zones::GeofenceSafety;
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

    /// Wind that the UAV assumes.
    pub(crate) fn believed_wind(&self, params: Option<WindParams>) -> Option<Wind> {
        params.and_then(|params| params.believed(self.wind.as_ref()))
    }

    /// Returns the command of the observed UAV.
    pub(crate) fn decide(
        &mut self,
        updater: &TeamStateUpdater,
        team_state: &TeamState,
        geofence_safety: Option<&GeofenceSafety>,
        intruders: &Intruders,
        observation: &Observation,
        rejected: Rejected,
    ) -> AgentOutput {
        let params = &updater.params;
        let wind = self.believed_wind(params.wind);
        let fallbacks = updater.fallbacks.as_ref();
        let law = CommandLaw { params, team_state, geofence_safety, intruders, fallbacks, wind };
        let (output, decision) = law.decide(observation, rejected, &self.last_decision);
        self.last_decision = decision;
        output
    }
}
