//! State update: applies the messages of one time step to the team state.

use std::sync::Arc;

use crate::coordination::assignment::AssignmentLaw;
use crate::guidance::geofence::Geofence;
use crate::guidance::geofence_safety::GeofenceSafety;
use crate::params::TeamParams;
use crate::step_messages::StepMessages;
use crate::target::Transition;
use crate::team_state::{Buffers, StepInput, TeamState};
use crate::time::Duration;
use crate::validation::ParamError;

/// Computes the next team state from the previous one and the messages of one time step; keeps no state itself.
#[derive(Debug, Clone)]
pub(crate) struct TeamStateUpdater {
    pub(crate) params: TeamParams,
    /// Target model over the last time difference between two team states.
    transition: Transition,
    scratch: Buffers,
    pub(crate) assignment: Option<Arc<dyn AssignmentLaw>>,
    /// Geofence safety function; `None` without zones.
    pub(crate) geofence_safety: Option<Arc<GeofenceSafety>>,
}

impl TeamStateUpdater {
    pub(crate) fn new(params: TeamParams) -> Result<Self, Vec<ParamError>> {
        let errors = params.errors();
        if !errors.is_empty() {
            return Err(errors);
        }
        let (transition, scratch, assignment) = (Transition::none(), Buffers::default(), None);
        Ok(Self { params, transition, scratch, assignment, geofence_safety: None })
    }

    /// Adds a geofence.
    pub(crate) fn with_geofence_zones(self, geofence: Geofence) -> Self {
        let geofence_safety = (!geofence.is_empty())
            .then(|| Arc::new(GeofenceSafety::new(geofence, self.params.uav, self.params.log.period_s)));
        Self { geofence_safety, ..self }
    }

    /// Computes the team state `next` at the time of `row`, `dt` after `previous`.
    pub(crate) fn advance(&mut self, previous: &TeamState, dt: Duration, row: &StepMessages, next: &mut TeamState) {
        self.step(previous, dt, row, false, next);
    }

    /// Computes the team state `next` like [`Self::advance`], but keeps groups and assignments unchanged.
    pub(crate) fn extrapolate(&mut self, previous: &TeamState, dt: Duration, row: &StepMessages, next: &mut TeamState) {
        self.step(previous, dt, row, true, next);
    }

    fn step(
        &mut self,
        previous: &TeamState,
        dt: Duration,
        row: &StepMessages,
        is_extrapolated: bool,
        next: &mut TeamState,
    ) {
        if dt != self.transition.dt {
            self.transition = self.params.track.transition(dt);
        }
        let (transition, assignment) = (&self.transition, self.assignment.as_deref());
        let geofence = self.geofence_safety.as_deref().map(GeofenceSafety::geofence);
        let news = StepInput { now: row.time, messages: row, transition, assignment, geofence, is_extrapolated };
        next.advance(previous, &news, &self.params, &mut self.scratch);
    }
}
