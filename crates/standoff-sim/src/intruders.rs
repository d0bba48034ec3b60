//! Aircraft that are not of the team, in the world: they fly as UAVs do, and keep away from nobody.

use standoff::{Command, Displacement, Integrator, Message, Response, Time, Traffic, UavId, UavParams, UavState};

use crate::scenario::{self, Scenario};

/// All of them, by number.
pub(crate) struct Intruders {
    all: Vec<Intruder>,
    /// How they answer commands: as UAVs do, exactly.
    response: Response,
    uav: UavParams,
    period: standoff::Duration,
}

/// One of them.
pub(crate) struct Intruder {
    flown: scenario::Intruder,
    /// Where it is.
    pub(crate) truth: UavState,
}

impl Intruder {
    /// It tells where it is.
    pub(crate) fn tells(&self, now: Time) -> bool {
        !self.flown.silent_s.iter().any(|[from_s, until_s]| (*from_s..*until_s).contains(&now.s()))
    }
}

impl Intruders {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let uav = UavParams { integrator: Integrator::Exact, ..scenario.settings.team.uav };
        let intruder = |flown: &scenario::Intruder| Intruder { truth: flown.start, flown: flown.clone() };
        let period = scenario.settings.period;
        Self { all: scenario.intruders.iter().map(intruder).collect(), response: uav.response(period), uav, period }
    }

    pub(crate) fn all(&self) -> impl Iterator<Item = (u32, &Intruder)> {
        (0..).zip(&self.all)
    }

    /// What they tell at an instant, by number.
    pub(crate) fn told(&self, now: Time) -> impl Iterator<Item = (u32, Message)> {
        let telling = self.all().filter(move |(_, intruder)| intruder.tells(now));
        telling.map(move |(aircraft, Intruder { truth, .. })| {
            (aircraft, Message::Traffic(Traffic { aircraft, time: now, state: *truth }))
        })
    }

    /// They fly on until the next instant: whoever pursues turns at where its UAV is now.
    pub(crate) fn fly<'a>(&mut self, truth_of: impl Fn(UavId) -> Option<&'a UavState>) {
        let Self { all, response, uav, period } = self;
        for Intruder { flown, truth } in all {
            let pursued = flown.pursues.and_then(&truth_of);
            let wanted_rad_s = pursued.map_or(flown.turn_rate_rad_s, |pursued| {
                let to_uav: Displacement = pursued.position - truth.position;
                // Half of a lag after the instant the turn would have it there: no gain is steeper without overshoot.
                (to_uav.direction() - truth.heading).rad() / (period.s() + uav.turn_rate_lag_s)
            });
            let turn_rate_rad_s = wanted_rad_s.clamp(-uav.turn_rate_max_rad_s, uav.turn_rate_max_rad_s);
            let (before, speed_m_s) = (truth.vertical, flown.start.speed_m_s);
            *truth = response.step(truth, Command { speed_m_s, turn_rate_rad_s });
            let its_m = pursued.and_then(|pursued| pursued.vertical).map(|vertical| vertical.altitude_m);
            truth.vertical = uav
                .climb
                .zip(before)
                .map(|(climb, vertical)| climb.step(&vertical, flown.altitude_m.or(its_m), *period));
        }
    }
}
