//! Status lines for the operator.

use standoff::{Duration, Time};

use crate::authority::State;
use crate::companion::Companion;
use crate::period::is_due;

/// Period of the status lines.
const PERIOD: Duration = Duration::from_us(1_000_000);

/// Reports the status periodically, and warnings about the parameters of the autopilot once.
#[derive(Debug, Default)]
pub(crate) struct Reporter {
    at: Option<Time>,
    has_warned: bool,
}

impl Reporter {
    pub(crate) fn report(&mut self, now: Time, companion: &Companion, report: &mut dyn FnMut(&str)) {
        let parameters = &companion.vehicle.parameters;
        if !self.has_warned && parameters.limits().is_ok() && parameters.has_failsafes() {
            self.has_warned = true;
            parameters.warnings().iter().for_each(|warning| report(&format!("warning: {warning}")));
        }
        if is_due(self.at, now, PERIOD) {
            self.at = Some(now);
            report(&line(now, companion));
        }
    }
}

/// Status line: authority, mode, orbit, ages of the links and what is waited for.
pub fn line(now: Time, companion: &Companion) -> String {
    let inputs = companion.last_inputs();
    let state = match companion.authority() {
        State::Waiting => "waiting".to_owned(),
        State::Confirming { .. } => "confirming".to_owned(),
        State::Engaged => "engaged".to_owned(),
        State::Stopped { reason, .. } => format!("stopped ({reason}); select another mode, then GUIDED, to resume"),
    };
    let mode = companion.vehicle.heartbeat.map_or_else(|| "-".to_owned(), |heartbeat| mode_name(heartbeat.mode));
    let age = |at: Option<Time>| at.map_or_else(|| "-".to_owned(), |at| format!("{:.1}", (now - at).s()));
    let ages = [inputs.heartbeat_at, inputs.telemetry_at, inputs.feed_at, inputs.teammates_at].map(age);
    let [heartbeat, telemetry, feed, teammates] = ages;
    let missing: Vec<_> = inputs.missing(now).map(|condition| condition.to_string()).collect();
    let waits = if missing.is_empty() { String::new() } else { format!("; waits for: {}", missing.join(", ")) };
    let parameters = match companion.parameter_error() {
        Some(error) if inputs.heartbeat_at.is_some() => format!("; {error}"),
        _ => String::new(),
    };
    // Without parameters, the fence cannot be known.
    let fence = match companion.fence() {
        Err(error) if parameters.is_empty() && inputs.heartbeat_at.is_some() => format!("; {error}"),
        Ok(_) if !inputs.has_fence => "; the aircraft is outside the fence of the vehicle".to_owned(),
        _ => String::new(),
    };
    let wind = companion.wind_error().map_or_else(String::new, |error| format!("; {error}"));
    let orbit = orbit(companion);
    format!(
        "{state}; mode {mode}; {orbit}; age, s: heartbeat {heartbeat}, telemetry {telemetry}, feed {feed}, \
         teammates {teammates}{waits}{parameters}{fence}{wind}"
    )
}

/// Group, orbit error and angle between boresight and group.
fn orbit(companion: &Companion) -> String {
    let (agent, diagnostics) = (companion.agent(), &companion.output.diagnostics);
    let group = agent.team_state().group_of(agent.id()).zip(diagnostics.steering);
    let Some((group, steering)) = group else { return "no group".to_owned() };
    let number = diagnostics.group_number.map_or_else(|| "-".to_owned(), |number| number.to_string());
    let (radius_m, distance_m) = (group.orbit_radius_m(), steering.centre_distance_m);
    let off = companion
        .off_boresight_rad()
        .map_or_else(String::new, |rad| format!(", {:.0} deg off boresight", rad.to_degrees()));
    format!("group {number}: {distance_m:.0} m, orbit {radius_m:.0} m, error {:+.0} m{off}", distance_m - radius_m)
}

/// Name of a mode of ArduPlane.
fn mode_name(mode: u32) -> String {
    let names = [
        (0, "MANUAL"),
        (2, "STABILIZE"),
        (5, "FBWA"),
        (6, "FBWB"),
        (7, "CRUISE"),
        (10, "AUTO"),
        (11, "RTL"),
        (12, "LOITER"),
        (13, "TAKEOFF"),
        (15, "GUIDED"),
    ];
    let name = names.iter().find(|(number, _)| *number == mode);
    name.map_or_else(|| mode.to_string(), |(_, name)| (*name).to_owned())
}
