//! True motion of aircraft outside the team: they have the flight dynamics of the UAVs, fly relative to the air, and avoid
//! no other aircraft.

use standoff::params::Integrator;
use standoff::uav::AutopilotModel;
use standoff::{Command, Displacement, Message, TeamParams, Time, TrafficReport, UavId, UavParams, UavState};

use crate::scenario::{self, Scenario, Settings};
use crate::wind::{self, AirMotion};

/// All intruders, by number.
pub(crate) struct Intruders {
    all: Vec<Intruder>,
    /// Response to commands: that of the UAVs, integrated exactly.
    response: AutopilotModel,
    uav: UavParams,
}

/// One intruder.
pub(crate) struct Intruder {
    flown: scenario::Intruder,
    /// Its motion relative to the air; `None` without wind.
    air: Option<AirMotion>,
    /// True state.
    pub(crate) truth: UavState,
}

impl Intruder {
    /// Returns whether the intruder broadcasts its position.
    pub(crate) fn reports(&self, now: Time) -> bool {
        !self.flown.transponder_off_s.iter().any(|[from_s, until_s]| (*from_s..*until_s).contains(&now.s()))
    }
}

impl Intruders {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let Settings { team, period, wind, .. } = &scenario.settings;
        let uav = UavParams { integrator: Integrator::Exact, bank: None, ..team.uav };
        let intruder = |flown: &scenario::Intruder| {
            let wind = wind.map(|wind| wind.at(height_m(&flown.start, team)));
            let (air, truth) = AirMotion::start(&flown.start, wind);
            Intruder { flown: flown.clone(), air, truth }
        };
        Self { all: scenario.intruders.iter().map(intruder).collect(), response: uav.response(*period), uav }
    }

    pub(crate) fn all(&self) -> impl Iterator<Item = (u32, &Intruder)> {
        (0..).zip(&self.all)
    }

    /// Position reports that the intruders broadcast in this time step, by number.
    pub(crate) fn reports(&self, now: Time) -> impl Iterator<Item = (u32, Message)> {
        let broadcasting = self.all().filter(move |(_, intruder)| intruder.reports(now));
        broadcasting.map(move |(aircraft, Intruder { truth, .. })| {
            (aircraft, Message::Traffic(TrafficReport { aircraft, time: now, state: *truth }))
        })
    }

    /// Advances all intruders by one period; a pursuing intruder turns towards the current position of its UAV.
    pub(crate) fn fly<'a>(&mut self, settings: &Settings, truth_of: impl Fn(UavId) -> Option<&'a UavState>) {
        let Settings { team, period, wind, .. } = settings;
        let Self { all, response, uav } = self;
        for Intruder { flown, air, truth } in all {
            let heading = air.as_ref().map_or(truth.heading, |air| air.velocity().heading);
            let pursued = flown.pursued_uav.and_then(&truth_of);
            let desired_rad_s = pursued.map_or(flown.turn_rate_rad_s, |pursued| {
                let to_uav: Displacement = pursued.position - truth.position;
                // The steepest gain without overshoot: the heading is reached half a lag after the next time step.
                (to_uav.direction() - heading).rad() / (period.s() + uav.turn_rate_lag_s)
            });
            let turn_rate_rad_s = desired_rad_s.clamp(-uav.turn_rate_max_rad_s, uav.turn_rate_max_rad_s);
            let (before, speed_m_s) = (truth.vertical, flown.start.speed_m_s);
            let step = |before: &UavState| response.step(before, Command { speed_m_s, turn_rate_rad_s });
            *truth = match (air, wind) {
                (Some(air), Some(wind)) => air.fly(truth, *period, step, |after| wind.at(height_m(after, team))),
                _ => step(truth),
            };
            let uav_altitude_m = pursued.and_then(|pursued| pursued.vertical).map(|vertical| vertical.altitude_m);
            truth.vertical = uav
                .climb
                .zip(before)
                .map(|(climb, vertical)| climb.step(&vertical, flown.altitude_m.or(uav_altitude_m), *period));
        }
    }
}

/// Height of an intruder above the plane, m; if altitudes are not simulated, the initial one of the first UAV. It flies in
/// the wind there, without gusts.
fn height_m(intruder: &UavState, team: &TeamParams) -> f64 {
    wind::height_m(intruder, None, team, UavId(0))
}
