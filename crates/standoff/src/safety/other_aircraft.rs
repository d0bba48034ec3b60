//! Other aircraft: their motion relative to the air, from their last reports.

use crate::coordination::teammate::Teammate;
use crate::message::Manoeuvre;
use crate::params::UavParams;
use crate::safety::flown::Flown;
use crate::safety::motion::Motion;
use crate::time::{Duration, Time};
use crate::uav::{Aircraft, Command, UavId, UavState, Vertical};
use crate::wind::Wind;

/// Maximum age of a report used for the uncertainty, s. Older reports count as this old.
pub(crate) const SILENT_MAX_S: f64 = 10.0;

/// Another aircraft, as last reported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OtherAircraft {
    pub(crate) aircraft: Aircraft,
    /// Motion at its last report, moved to where the wind has carried it since.
    pub(crate) motion: Motion,
    /// Age of the report, s.
    pub(crate) age_s: f64,
    /// Reported manoeuvre.
    pub(crate) manoeuvre: Option<Manoeuvre>,
}

impl OtherAircraft {
    /// A teammate. Its heading rate in wind and its commanded bank angle follow from its motion at an earlier report, if
    /// known.
    pub(crate) fn teammate(
        teammate: &Teammate,
        age_s: f64,
        wind: Option<Wind>,
        uav: &UavParams,
        before: Option<&Flown>,
    ) -> Self {
        let Teammate { last_report: state, last_report_at, manoeuvre, .. } = *teammate;
        let reported =
            Self { aircraft: Aircraft::Uav(teammate.uav), motion: Motion::steady(uav, &state), age_s, manoeuvre };
        if let Some(before) = before.filter(|before| before.from == last_report_at) {
            return Self { motion: before.motion.in_wind(wind), ..reported }.drifted();
        }
        let before = before.filter(|before| before.age_s(last_report_at).is_some());
        let command = manoeuvre.map(|manoeuvre| manoeuvre.command);
        let Some(before) = before else {
            let reported = wind.map_or(reported, |wind| reported.in_air(wind, uav));
            let motion = Motion::turning(uav, &reported.motion.state, command).in_wind(wind);
            return Self { motion, ..reported };
        };
        let acceleration_m_s2 = |airspeed_m_s| before.acceleration_m_s2(last_report_at, airspeed_m_s);
        let air = wind.map_or(state, |wind| wind.relative_to_air(&state, acceleration_m_s2));
        let flown = Flown { command: command.unwrap_or(before.command), ..*before };
        let motion = Flown::motion(Some(&flown), uav, &air, last_report_at).in_wind(wind);
        Self { motion, ..reported }.drifted()
    }

    /// An aircraft whose state is over ground, in the air.
    pub(crate) fn in_air(self, wind: Wind, uav: &UavParams) -> Self {
        let commanded_m_s = self.manoeuvre.map(|manoeuvre| manoeuvre.command.speed_m_s);
        let acceleration_m_s2 = |airspeed_m_s: f64| {
            let [slowest_m_s2, fastest_m_s2] = uav.accelerations_m_s2(airspeed_m_s);
            commanded_m_s.map_or(0.0, |commanded_m_s| {
                ((commanded_m_s - airspeed_m_s) / uav.speed_lag_s).clamp(slowest_m_s2, fastest_m_s2)
            })
        };
        let state = wind.relative_to_air(&self.motion.state, acceleration_m_s2);
        Self { motion: self.motion.with_state(state).in_wind(Some(wind)), ..self }.drifted()
    }

    /// The aircraft where the wind has carried it since its report.
    fn drifted(self) -> Self {
        Self { motion: self.after_drift(1.0), ..self }
    }

    /// Motion moved by a multiple of the drift with the wind since the report.
    fn after_drift(&self, times: f64) -> Motion {
        let drift = self.motion.wind.velocity * (times * self.age_s.min(SILENT_MAX_S));
        let state = self.motion.state;
        self.motion.with_state(UavState { position: state.position + drift, ..state })
    }

    /// Motion of a teammate at its report, for the next time step; `now` is the time of this one.
    pub(crate) fn as_flown(&self, now: Time) -> Option<(UavId, Flown)> {
        let uav = self.uav()?;
        let UavState { speed_m_s, turn_rate_rad_s, .. } = self.motion.state;
        let motion = self.after_drift(-1.0);
        let command = self.manoeuvre.map_or(Command { speed_m_s, turn_rate_rad_s }, |manoeuvre| manoeuvre.command);
        Some((uav, Flown { from: now + Duration::from_s(-self.age_s), motion, command, plan: None }))
    }

    /// Id of a teammate.
    pub(crate) fn uav(&self) -> Option<UavId> {
        match self.aircraft {
            Aircraft::Uav(uav) => Some(uav),
            Aircraft::Intruder(_) => None,
        }
    }

    /// Lowest and highest altitude within the prediction horizon, m; `None` if unknown.
    pub(crate) fn levels_m(&self, ahead_s: f64) -> Option<[f64; 2]> {
        self.motion.state.vertical.map(|vertical| altitudes_m(vertical, vertical.altitude_m, ahead_s + self.age_s))
    }
}

/// Lowest and highest altitude of a UAV on its way to `to_m`, m. Includes `after_s` seconds at the current climb rate.
pub(crate) fn altitudes_m(from: Vertical, to_m: f64, after_s: f64) -> [f64; 2] {
    let ends_m = [to_m, from.altitude_m + from.climb_rate_m_s * after_s];
    [ends_m.into_iter().fold(from.altitude_m, f64::min), ends_m.into_iter().fold(from.altitude_m, f64::max)]
}
