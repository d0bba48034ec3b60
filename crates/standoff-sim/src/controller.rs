//! Interface between the simulator and the controller that flies the UAVs: the built-in agents, or your own controller.
//!
//! In every time step each UAV observes, then each UAV receives the messages of the others, then each decides.
//! `docs/user/controllers.md` explains how to write a controller; `examples/follower.rs` is its example.

use standoff::{
    Agent, AgentOutput, AirVelocity, AreaOfInterest, Command, Geofence, Message, Observation, ParamError, Scan,
    TeamAgent, TeamParams, Time, UavId, UavState,
};

use crate::scenario::AgentSetup;
use standoff_record::agent_rows;
pub use standoff_record::{
    AgentEventRow, AgentRow, ByAgent, EventRow, GroupRow, MembershipState, PerAgentTables, ReportedState,
    ReportedTables, TeammateRow, TrackRow, TrackStatus,
};

/// Controller of a team, or the controllers of its UAVs. In every time step a mission calls its methods for every UAV,
/// in the order below.
///
/// Controllers do not depend on the lifetime of a scenario or a mission: inputs are borrowed for one call; outputs are
/// owned, or borrowed from the controller.
pub trait Controller {
    /// Notifies the controller that the computer of a UAV has restarted: the state of its agent is lost.
    /// `restart_count` is higher than before. While the computer is off, no method is called for the UAV.
    fn restart(&mut self, _uav: UavId, _restart_count: u32) {}

    /// Passes the observation of a UAV at time `now` by its own clock. `own` is the state that the UAV estimates for
    /// itself, `scan` the measurements of its sensor; `None` during an outage, in which the UAV neither measures nor
    /// sends, but receives.
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>);

    /// Passes the velocity of a UAV relative to the air, after [`Self::observe`]; not called without wind. In wind, the
    /// state of the observation is that over ground, and a command is airspeed and heading rate.
    fn observe_air(&mut self, _uav: UavId, _air: &AirVelocity) {}

    /// Returns the messages that a UAV sends after its last observation; the radio delivers them unchanged to the other
    /// UAVs. The mission does not call it during an outage of the UAV. Controllers without communication return
    /// nothing.
    fn outbox(&self, _uav: UavId) -> &[Message] {
        &[]
    }

    /// Passes a message that a UAV receives. With an ideal radio it belongs to the time step that the UAV observed
    /// last. The order is: teammates' reports by ascending UAV, then cues of targets that have just appeared, then
    /// reports of intruders.
    fn receive(&mut self, uav: UavId, message: &Message);

    /// Returns the command of a UAV until the next time step. A command outside the limits is limited; a command that
    /// is not finite is replaced by straight flight at nominal speed; a pointing target or an altitude that is not
    /// finite is ignored.
    fn decide(&mut self, uav: UavId) -> AgentOutput;

    /// Tables that [`Self::report`] fills; tables that are not reported are not scored.
    fn reported(&self) -> ReportedTables {
        ReportedTables::NOTHING
    }

    /// Writes what the team estimates and intends at this time step, after all UAVs have decided. The tables are empty
    /// before the call.
    fn report(&self, _beliefs: &mut ReportedState) {}

    /// Writes the state of each agent whose computer is on, for controllers with one agent per UAV; other controllers
    /// write nothing. The tables are empty before the call; the mission fills in the numbers of sent messages
    /// afterwards.
    fn report_per_agent(&self, _agents: &mut PerAgentTables) {}
}

impl<B: Controller + ?Sized> Controller for Box<B> {
    fn restart(&mut self, uav: UavId, restart_count: u32) {
        (**self).restart(uav, restart_count);
    }

    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        (**self).observe(now, uav, own, scan);
    }

    fn observe_air(&mut self, uav: UavId, air: &AirVelocity) {
        (**self).observe_air(uav, air);
    }

    fn outbox(&self, uav: UavId) -> &[Message] {
        (**self).outbox(uav)
    }

    fn receive(&mut self, uav: UavId, message: &Message) {
        (**self).receive(uav, message);
    }

    fn decide(&mut self, uav: UavId) -> AgentOutput {
        (**self).decide(uav)
    }

    fn reported(&self) -> ReportedTables {
        (**self).reported()
    }

    fn report(&self, beliefs: &mut ReportedState) {
        (**self).report(beliefs);
    }

    fn report_per_agent(&self, agents: &mut PerAgentTables) {
        (**self).report_per_agent(agents);
    }
}

/// Creates the built-in controller. Returns all parameters that are out of range.
pub fn team_controller(
    setup: AgentSetup,
    team: TeamParams,
    geofence: Geofence,
    areas: Vec<AreaOfInterest>,
    uavs: usize,
) -> Result<Box<dyn Controller + Send>, Vec<ParamError>> {
    Ok(match setup {
        AgentSetup::Shared => {
            let fleet = TeamAgent::new(team)?.with_geofence(geofence)?.with_areas_of_interest(areas)?;
            Box::new(SharedAgent { fleet, observed: Vec::new() })
        }
        AgentSetup::PerUav => Box::new(AgentPerUav::new(team, geofence, areas, uavs)?),
    })
}

/// The last observation of each UAV, by id.
type Observed = Vec<Option<Observation>>;

fn store(observed: &mut Observed, observation: Observation) {
    let index = observation.uav().0 as usize;
    if index >= observed.len() {
        observed.resize(index + 1, None);
    }
    observed[index] = Some(observation);
}

fn last(observed: &Observed, uav: UavId) -> Option<&Observation> {
    observed.get(uav.0 as usize)?.as_ref()
}

/// Returns the output for a UAV that has never observed.
fn idle_command() -> AgentOutput {
    AgentOutput::command_only(Command { speed_m_s: 0.0, turn_rate_rad_s: 0.0 })
}

/// One agent for the whole team: with an ideal radio, one team state serves all UAVs.
struct SharedAgent {
    fleet: TeamAgent,
    observed: Observed,
}

impl Controller for SharedAgent {
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        let observation = self.fleet.observe(now, uav, own, scan);
        store(&mut self.observed, observation);
    }

    fn observe_air(&mut self, uav: UavId, air: &AirVelocity) {
        if let Some(observation) = last(&self.observed, uav) {
            self.fleet.observe_air(observation, air);
        }
    }

    /// All UAVs receive the same messages, so those of UAV 0 suffice.
    fn receive(&mut self, uav: UavId, message: &Message) {
        if let Some(observation) = last(&self.observed, uav).filter(|_| uav.0 == 0) {
            self.fleet.receive(observation, message);
        }
    }

    fn decide(&mut self, uav: UavId) -> AgentOutput {
        last(&self.observed, uav).map_or_else(idle_command, |observation| self.fleet.decide(observation))
    }

    fn reported(&self) -> ReportedTables {
        ReportedTables::default()
    }

    fn report(&self, beliefs: &mut ReportedState) {
        agent_rows::team_state(self.fleet.team_state(), beliefs);
    }
}

/// One agent per UAV, by id. With an ideal radio all agents have the same team state; the record stores that of the
/// first UAV whose computer is on.
struct AgentPerUav {
    team: TeamParams,
    geofence: Geofence,
    areas: Vec<AreaOfInterest>,
    agents: Vec<Agent>,
    observed: Observed,
    /// UAVs that have observed in this time step, ascending.
    awake: Vec<UavId>,
    /// True after a decision, so that the next observation starts a new time step.
    is_decided: bool,
}

impl Controller for AgentPerUav {
    fn restart(&mut self, uav: UavId, restart_count: u32) {
        // The parameters were valid when the first agent was created.
        let new = Self::agent(uav, self.team, &self.geofence, &self.areas);
        if let (Some(agent), Ok(new)) = (self.agents.get_mut(uav.0 as usize), new) {
            *agent = new.with_restart_count(restart_count);
        }
    }

    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        if std::mem::take(&mut self.is_decided) {
            self.awake.clear();
        }
        self.awake.push(uav);
        if let Some(agent) = self.agents.get_mut(uav.0 as usize) {
            let observation = agent.observe(now, own, scan);
            store(&mut self.observed, observation);
        }
    }

    fn observe_air(&mut self, uav: UavId, air: &AirVelocity) {
        if let Some(observation) = last(&self.observed, uav) {
            self.agents[uav.0 as usize].observe_air(observation, air);
        }
    }

    fn outbox(&self, uav: UavId) -> &[Message] {
        last(&self.observed, uav).map_or(&[], |observation| self.agents[uav.0 as usize].outbox(observation))
    }

    fn receive(&mut self, uav: UavId, message: &Message) {
        if let Some(observation) = last(&self.observed, uav) {
            self.agents[uav.0 as usize].receive(observation, message);
        }
    }

    fn decide(&mut self, uav: UavId) -> AgentOutput {
        self.is_decided = true;
        last(&self.observed, uav)
            .map_or_else(idle_command, |observation| self.agents[uav.0 as usize].decide(observation))
    }

    fn reported(&self) -> ReportedTables {
        ReportedTables::default()
    }

    fn report(&self, beliefs: &mut ReportedState) {
        if let Some(agent) = self.awake().next() {
            agent_rows::agent(agent, beliefs);
        }
    }

    fn report_per_agent(&self, agents: &mut PerAgentTables) {
        self.awake().for_each(|agent| agent_rows::own_rows(agent, agents));
    }
}

impl AgentPerUav {
    fn new(
        team: TeamParams,
        geofence: Geofence,
        areas: Vec<AreaOfInterest>,
        uavs: usize,
    ) -> Result<Self, Vec<ParamError>> {
        let agent = |uav| Self::agent(uav, team, &geofence, &areas);
        let agents = (0..).map(UavId).take(uavs).map(agent).collect::<Result<_, _>>()?;
        Ok(Self { team, geofence, areas, agents, observed: Vec::new(), awake: Vec::new(), is_decided: true })
    }

    fn agent(
        uav: UavId,
        team: TeamParams,
        geofence: &Geofence,
        areas: &[AreaOfInterest],
    ) -> Result<Agent, Vec<ParamError>> {
        Agent::new(uav, team)?.with_geofence(geofence.clone())?.with_areas_of_interest(areas.to_vec())
    }

    /// Agents of the UAVs whose computer is on, ascending.
    fn awake(&self) -> impl Iterator<Item = &Agent> {
        self.awake.iter().filter_map(|uav| self.agents.get(uav.0 as usize))
    }
}
