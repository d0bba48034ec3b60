//! Decides when commands may be sent to the autopilot: a pure state machine.
//!
//! ```text
//! Waiting ──all conditions──> Confirming ──first command accepted──> Engaged
//!    ^                            │                                     │
//!    ├──another mode, or disarmed: nothing more is sent─────────────────┤
//!    │                            │ refused, or no answer               │ any other condition fails
//!    └──pilot leaves GUIDED── Stopped <──────── safe orbit requested ───┘
//! ```
//!
//! It never arms the aircraft and never changes its mode. Once stopped, it commands again only after the pilot has left
//! GUIDED and selected it again. A change of mode by a failsafe does not count as the pilot's, and neither does GUIDED
//! in the first heartbeat that the program receives.

use core::fmt;

use standoff::{Duration, Time};

/// Maximum age of telemetry, of the feed and of the last time step of the program.
pub const STALE: Duration = Duration::from_us(1_000_000);

/// Maximum age of telemetry while commands are sent: from [`STALE`] on, the last turn is held.
pub const TELEMETRY_STALE: Duration = Duration::from_us(3_000_000);

/// Maximum age of the autopilot's heartbeat, which it sends every second, and of its reports about its navigation. A gap
/// of the link of [`TELEMETRY_STALE`] may follow the last one after their period.
pub const HEARTBEAT_STALE: Duration = Duration::from_us(4_000_000);

/// Time to wait for an answer before a command is repeated.
const ANSWER_TIMEOUT: Duration = Duration::from_us(1_000_000);

/// Number of times that a command without answer is sent.
const ATTEMPTS: u32 = 3;

/// Time after a stop in which the safe orbit is requested: later, it could replace a command of the pilot in GUIDED.
const REQUESTS_MAX: Duration = Duration::from_us(5_000_000);

/// A condition for commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Condition {
    /// Heartbeats of the autopilot arrive.
    Heartbeat,
    /// The aircraft is armed.
    Armed,
    /// The mode is GUIDED.
    Guided,
    /// The autopilot reports no failsafe.
    NoFailsafe,
    /// The aircraft is in the air.
    Airborne,
    /// Position and attitude arrive.
    Telemetry,
    /// The autopilot knows its position: GPS fix and EKF are good.
    Navigation,
    /// Commands arrive at the autopilot, and the aircraft follows them.
    Uplink,
    /// The parameters of the autopilot were read and are plausible.
    Parameters,
    /// The fence of the vehicle was read, its zones can be kept, and the aircraft is inside it.
    Fence,
    /// The feed of detections is alive.
    Feed,
    /// The agent knows a target to orbit.
    Target,
    /// All configured teammates report.
    Teammates,
    /// The program itself is on time.
    OnTime,
    /// The clock of this computer, which gives the team's time, was not set.
    Clock,
    /// The user has not ended the program.
    Running,
}

impl Condition {
    /// All conditions, in the order of the status line.
    pub const ALL: [Self; 16] = [
        Self::Heartbeat,
        Self::Armed,
        Self::Guided,
        Self::NoFailsafe,
        Self::Airborne,
        Self::Telemetry,
        Self::Navigation,
        Self::Uplink,
        Self::Parameters,
        Self::Fence,
        Self::Feed,
        Self::Target,
        Self::Teammates,
        Self::OnTime,
        Self::Clock,
        Self::Running,
    ];

    /// True if the pilot or the autopilot has taken over when the condition fails: then nothing more is sent.
    fn is_takeover(self) -> bool {
        matches!(self, Self::Armed | Self::Guided)
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Heartbeat => "heartbeat of the autopilot",
            Self::Armed => "arming by the pilot",
            Self::Guided => "mode GUIDED, selected by the pilot",
            Self::NoFailsafe => "system status without failsafe or battery warning",
            Self::Airborne => "flight at 20 m or higher with plausible airspeed",
            Self::Telemetry => "position and attitude",
            Self::Navigation => "GPS fix and healthy EKF",
            Self::Uplink => "answers to commands and a roll that follows them",
            Self::Parameters => "parameters of the autopilot",
            Self::Fence => "fence of the vehicle",
            Self::Feed => "feed of detections",
            Self::Target => "a target",
            Self::Teammates => "reports of all teammates",
            Self::OnTime => "processor time",
            Self::Clock => "clock of this computer without a step",
            Self::Running => "a new start, because the user has ended the program",
        })
    }
}

/// What is known when the authority decides. Times are those of the newest data; `None` if there were none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inputs {
    /// Last heartbeat of the autopilot.
    pub heartbeat_at: Option<Time>,
    /// Older one of the last position and the last attitude.
    pub telemetry_at: Option<Time>,
    /// Maximum age of `telemetry_at`: [`STALE`], or [`TELEMETRY_STALE`] while the last turn is held.
    pub telemetry_age_max: Duration,
    /// Older one of the last two good reports about GPS fix and EKF; `None` if one is missing or bad.
    pub navigation_at: Option<Time>,
    /// Last valid line of the feed.
    pub feed_at: Option<Time>,
    /// Last decision of the agent with a group to orbit.
    pub target_at: Option<Time>,
    /// Oldest one of the last reports of the configured teammates; `None` if one has not reported.
    pub teammates_at: Option<Time>,
    /// Maximum age of `teammates_at`.
    pub teammate_timeout: Duration,
    /// True if teammates are configured.
    pub has_teammates: bool,
    /// Last time step of the program before this one.
    pub step_at: Option<Time>,
    /// The last heartbeat reported an armed aircraft.
    pub is_armed: bool,
    /// The last heartbeat reported GUIDED.
    pub is_guided: bool,
    /// The last heartbeat reported a failsafe or a warning.
    pub is_failsafe: bool,
    /// The telemetry shows an aircraft in the air.
    pub is_airborne: bool,
    /// The required parameters were read and are plausible.
    pub has_parameters: bool,
    /// The fence of the vehicle was read and can be kept; before the first command, the aircraft is also inside it.
    pub has_fence: bool,
    /// Nothing shows that commands do not arrive, or are not followed.
    pub has_uplink: bool,
    /// The clock of this computer was not set since commands began.
    pub has_clock: bool,
    /// The user has ended the program.
    pub is_leaving: bool,
    /// Answer to the command last sent for [`Permission::Confirm`] or [`Permission::SafeOrbit`]; `None` without answer.
    pub is_accepted: Option<bool>,
}

impl Inputs {
    /// Nothing has been received yet.
    pub const NOTHING: Self = Self {
        heartbeat_at: None,
        telemetry_at: None,
        telemetry_age_max: STALE,
        navigation_at: None,
        feed_at: None,
        target_at: None,
        teammates_at: None,
        teammate_timeout: STALE,
        has_teammates: false,
        step_at: None,
        is_armed: false,
        is_guided: false,
        is_failsafe: false,
        is_airborne: false,
        has_parameters: false,
        has_fence: false,
        has_uplink: false,
        has_clock: false,
        is_leaving: false,
        is_accepted: None,
    };

    /// Returns whether a condition holds at `now`.
    pub fn holds(&self, condition: Condition, now: Time) -> bool {
        // A time in the future is an error of the clock and counts as stale.
        let is_fresh = |at: Option<Time>, age_max: Duration| {
            at.is_some_and(|at| (0..=age_max.us()).contains(&(now.us().saturating_sub(at.us()))))
        };
        match condition {
            Condition::Heartbeat => is_fresh(self.heartbeat_at, HEARTBEAT_STALE),
            Condition::Armed => self.is_armed,
            Condition::Guided => self.is_guided,
            Condition::NoFailsafe => !self.is_failsafe,
            Condition::Airborne => self.is_airborne,
            Condition::Telemetry => is_fresh(self.telemetry_at, self.telemetry_age_max),
            Condition::Navigation => is_fresh(self.navigation_at, HEARTBEAT_STALE),
            Condition::Uplink => self.has_uplink,
            Condition::Parameters => self.has_parameters,
            Condition::Fence => self.has_fence,
            Condition::Feed => is_fresh(self.feed_at, STALE),
            Condition::Target => is_fresh(self.target_at, STALE),
            Condition::Teammates => !self.has_teammates || is_fresh(self.teammates_at, self.teammate_timeout),
            Condition::OnTime => is_fresh(self.step_at, STALE),
            Condition::Clock => self.has_clock,
            Condition::Running => !self.is_leaving,
        }
    }

    /// True if a heartbeat that is not old shows that the pilot has left GUIDED, or disarmed.
    fn has_left_guided(&self, now: Time) -> bool {
        self.holds(Condition::Heartbeat, now) && (!self.is_armed || !self.is_guided && !self.is_failsafe)
    }

    /// Conditions that do not hold at `now`.
    pub fn missing(&self, now: Time) -> impl Iterator<Item = Condition> {
        Condition::ALL.into_iter().filter(move |condition| !self.holds(*condition, now))
    }
}

/// Commands that may be sent in a time step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Permission {
    /// No command.
    None,
    /// The first command; commands follow if the autopilot accepts it.
    Confirm,
    /// Roll, speed and altitude.
    Command,
    /// A request to fly a circle here, and no other command.
    SafeOrbit,
}

/// State of the authority.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Waits for all conditions.
    Waiting,
    /// Waits for the answer to the first command.
    Confirming {
        /// Last time at which the command was sent.
        sent_at: Time,
        /// Number of times that it was sent.
        attempts: u32,
    },
    /// Commands.
    Engaged,
    /// Has stopped, and waits for the pilot to leave GUIDED.
    Stopped {
        /// Why.
        reason: StopReason,
        /// Time of the stop.
        since: Time,
        /// Last time at which the safe orbit was requested.
        sent_at: Time,
        /// Number of further requests, while there is no answer.
        repeats: u32,
    },
}

/// Why the authority has stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// A condition that does not depend on pilot and autopilot failed.
    Failed(Condition),
    /// The autopilot refused the first command.
    Refused,
    /// The autopilot did not answer the first command.
    NoAnswer,
    /// The first heartbeat already reported GUIDED: the program may have restarted in flight.
    AlreadyGuided,
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Failed(condition) => write!(f, "missing: {condition}"),
            Self::Refused => f.write_str("the autopilot refused the first command"),
            Self::NoAnswer => f.write_str("the autopilot did not answer the first command"),
            Self::AlreadyGuided => f.write_str("GUIDED was selected before this program heard the autopilot"),
        }
    }
}

/// The state machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Authority {
    state: State,
    /// True if GUIDED counts as selected by the pilot even if the next heartbeat is the first one.
    trusts_guided: bool,
}

impl Authority {
    /// Creates the state machine at the start of the program. `engages_after_restart`: GUIDED in the first heartbeat counts
    /// as the pilot's selection.
    pub fn new(engages_after_restart: bool) -> Self {
        Self { state: State::Waiting, trusts_guided: engages_after_restart }
    }

    /// Current state.
    pub fn state(&self) -> State {
        self.state
    }

    /// Advances to `now` and returns which commands may be sent now.
    pub fn step(&mut self, now: Time, inputs: &Inputs) -> Permission {
        if !self.trusts_guided && inputs.heartbeat_at.is_some() {
            self.trusts_guided = true;
            if inputs.is_guided && inputs.is_armed {
                self.state = stopped(StopReason::AlreadyGuided, now, 0);
            }
        }
        let takeover = inputs.missing(now).find(|condition| condition.is_takeover());
        let failure = inputs.missing(now).find(|condition| !condition.is_takeover());
        let (state, permission) = match self.state {
            State::Waiting if takeover.or(failure).is_none() => {
                (State::Confirming { sent_at: now, attempts: 1 }, Permission::Confirm)
            }
            State::Waiting => (State::Waiting, Permission::None),
            State::Confirming { .. } if takeover.or(failure).is_some() => (State::Waiting, Permission::None),
            State::Confirming { sent_at, attempts } => match inputs.is_accepted {
                Some(true) => (State::Engaged, Permission::Command),
                // The aircraft still flies what the pilot chose.
                Some(false) => (stopped(StopReason::Refused, now, 0), Permission::None),
                None if now - sent_at < ANSWER_TIMEOUT => (self.state, Permission::None),
                None if attempts < ATTEMPTS => {
                    (State::Confirming { sent_at: now, attempts: attempts + 1 }, Permission::Confirm)
                }
                None => (stopped(StopReason::NoAnswer, now, 0), Permission::None),
            },
            State::Engaged => match (takeover, failure) {
                // A failsafe has changed the mode, and may select GUIDED again when it ends.
                (Some(_), _) if inputs.is_failsafe => {
                    (stopped(StopReason::Failed(Condition::NoFailsafe), now, 0), Permission::None)
                }
                (Some(_), _) => (State::Waiting, Permission::None),
                (None, Some(condition)) => {
                    (stopped(StopReason::Failed(condition), now, ATTEMPTS - 1), Permission::SafeOrbit)
                }
                (None, None) => (State::Engaged, Permission::Command),
            },
            State::Stopped { .. } if inputs.has_left_guided(now) => (State::Waiting, Permission::None),
            State::Stopped { reason, since, sent_at, repeats } => {
                let is_due = repeats > 0 && inputs.is_accepted.is_none() && now - sent_at >= ANSWER_TIMEOUT;
                if is_due && takeover.is_none() && now - since < REQUESTS_MAX {
                    (State::Stopped { reason, since, sent_at: now, repeats: repeats - 1 }, Permission::SafeOrbit)
                } else {
                    (self.state, Permission::None)
                }
            }
        };
        self.state = state;
        permission
    }
}

/// The state after a stop, with the number of further requests of the safe orbit.
fn stopped(reason: StopReason, now: Time, repeats: u32) -> State {
    State::Stopped { reason, since: now, sent_at: now, repeats }
}

#[cfg(test)]
mod tests;
