//! One instant after the other: from what was said to what is known.

use std::sync::Arc;

use crate::coordination::assignment::AssignmentLaw;
use crate::guidance::airspace::Airspace;
use crate::guidance::borders::Borders;
use crate::param::ParamError;
use crate::picture::{News, Picture, Scratch};
use crate::row::Row;
use crate::target::Transition;
use crate::team::TeamParams;
use crate::time::Duration;

/// Makes a picture from the one before it and what was said in between; remembers nothing.
#[derive(Debug, Clone)]
pub(crate) struct Fold {
    pub(crate) params: TeamParams,
    /// The target model over the time that last went by between two pictures.
    transition: Transition,
    scratch: Scratch,
    pub(crate) assignment: Option<Arc<dyn AssignmentLaw>>,
    /// What keeps UAVs within their airspace, where that is not everywhere.
    pub(crate) borders: Option<Arc<Borders>>,
}

impl Fold {
    pub(crate) fn new(params: TeamParams) -> Result<Self, Vec<ParamError>> {
        let errors = params.errors();
        if !errors.is_empty() {
            return Err(errors);
        }
        let (transition, scratch, assignment) = (Transition::none(), Scratch::default(), None);
        Ok(Self { params, transition, scratch, assignment, borders: None })
    }

    /// The same within an airspace.
    pub(crate) fn within(self, airspace: Airspace) -> Self {
        let borders =
            (!airspace.is_empty()).then(|| Arc::new(Borders::new(airspace, self.params.uav, self.params.log.period_s)));
        Self { borders, ..self }
    }

    /// Makes `next` the picture of a row's instant, so long after `previous`.
    pub(crate) fn follow(&mut self, previous: &Picture, dt: Duration, row: &Row, next: &mut Picture) {
        self.step(previous, dt, row, false, next);
    }

    /// The same, with groups and duties as they were.
    pub(crate) fn carry_on(&mut self, previous: &Picture, dt: Duration, row: &Row, next: &mut Picture) {
        self.step(previous, dt, row, true, next);
    }

    fn step(&mut self, previous: &Picture, dt: Duration, row: &Row, is_carried_on: bool, next: &mut Picture) {
        if dt != self.transition.dt {
            self.transition = self.params.track.transition(dt);
        }
        let (transition, assignment) = (&self.transition, self.assignment.as_deref());
        let airspace = self.borders.as_deref().map(Borders::airspace);
        let news = News { now: row.time, row, transition, assignment, airspace, is_carried_on };
        next.follow(previous, &news, &self.params, &mut self.scratch);
    }
}
