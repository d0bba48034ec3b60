//! Status lines for the operator.

use standoff::{Duration, Time};

use crate::authority::{STALE, State};
use crate::companion::Companion;
use crate::period::is_due;
use crate::requests::ATTEMPTS;

/// Period of the status lines.
const PERIOD: Duration = Duration::from_us(1_000_000);

/// Reports the status periodically, and warnings about the parameters of the autopilot once.
#[derive(Debug, Default)]
pub(crate) struct Reporter {
    at: Option<Time>,
    has_warned: bool,
    /// Last warnings about conditions that come and go, without repetition.
    warned: Vec<String>,
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
            let warnings = warnings(companion);
            warnings.iter().filter(|text| !self.warned.contains(text)).for_each(|text| report(text));
            self.warned = warnings;
            report(&line(now, companion));
        }
    }
}

/// Warnings about conditions that come and go.
fn warnings(companion: &Companion) -> Vec<String> {
    let mut warnings = Vec::new();
    let given_up: Vec<_> = companion.requests.given_up(&companion.vehicle.parameters).collect();
    if !given_up.is_empty() {
        let names = given_up.join(", ");
        warnings.push(format!("warning: the autopilot has not sent after {ATTEMPTS} requests: {names}"));
    }
    if let Some([(first, first_m), (second, second_m)]) = companion.shared_altitudes() {
        warnings.push(format!(
            "warning: --altitude and the fence make UAV {} fly at {first_m:.0} m and UAV {} at {second_m:.0} m: they are \
             separated by turns only; change --altitude, FENCE_ALT_MAX, or groups.altitude_lowest_m in all scenarios",
            first.0, second.0
        ));
    }
    if companion.vehicle.is_doubled() {
        let id = companion.vehicle.system_id();
        warnings
            .push(format!("warning: two vehicles with system id {id} send on one link; give each vehicle another one"));
    }
    if companion.vehicle.is_other_autopilot() {
        let id = companion.vehicle.system_id();
        warnings.push(format!(
            "warning: the autopilot with system id {id} is not ArduPilot, the only one that is supported"
        ));
    }
    warnings
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
    let notes = notes(companion);
    let wind = companion.wind_error().map_or_else(String::new, |error| format!("; {error}"));
    let orbit = orbit(companion);
    format!(
        "{state}; mode {mode}; {orbit}; age, s: heartbeat {heartbeat}, telemetry {telemetry}, feed {feed}, \
         teammates {teammates}{waits}{notes}{parameters}{fence}{wind}"
    )
}

/// Causes that the ages do not show.
fn notes(companion: &Companion) -> String {
    let vehicle = &companion.vehicle;
    let late = vehicle.telemetry_delay().filter(|delay| *delay > STALE).map(|delay| {
        format!("telemetry arrives {:.1} s late: the link or the clock of the autopilot is slow", delay.s())
    });
    let navigation = vehicle.navigation_error().filter(|_| vehicle.heartbeat.is_some());
    let clock = companion.clock_step().map(|step| format!("the clock of this computer was set by {:+.1} s", step.s()));
    let uplink = companion.uplink_failure().map(str::to_owned);
    let limited = companion.agent().is_retransmission_limited().then(|| {
        "retransmissions to teammates wait: the bandwidth or their budget is spent, so that commits can be late"
            .to_owned()
    });
    [late, navigation, clock, uplink, limited].into_iter().flatten().map(|note| format!("; {note}")).collect()
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
