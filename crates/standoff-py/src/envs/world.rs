//! One mission after another, flown by a policy.

use standoff::{Command, ParamError, TeamParams, UavId, UavParams};
use standoff_sim::draws::{Draws, Stream};
use standoff_sim::record::UavRow;
use standoff_sim::run::Mission;
use standoff_sim::scenario::{ScenarioError, Template};
use standoff_sim::score::Judge;

use super::observation;
use super::reward::Worth;

/// Why a mission cannot begin.
pub(super) enum NoMission {
    Scenario(ScenarioError),
    Parameters { name: String, seed: u64, errors: Vec<ParamError> },
    Uavs { name: String, seed: u64, there: usize, wanted: usize },
}

/// What all missions of some worlds have alike.
pub(super) struct Kind {
    pub(super) template: Template,
    /// Number of UAVs.
    pub(super) uavs: usize,
}

/// Which seeds the missions of a world have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Seeds {
    first: u64,
    episode: u64,
}

impl Seeds {
    /// From a first mission's seed on.
    pub(super) fn from(first: u64) -> Self {
        Self { first, episode: 0 }
    }

    pub(super) fn next(self) -> Self {
        Self { episode: self.episode + 1, ..self }
    }

    /// That of the mission whose turn it is: the first one's, then such as depend on that and on their number alone.
    fn seed(self) -> u64 {
        match self.episode {
            0 => self.first,
            episode => Draws::new(self.first).at(Stream::Episode, 0, episode).seed(),
        }
    }
}

/// A mission, observed and judged at the instant that is to be decided.
pub(super) struct World {
    pub(super) seeds: Seeds,
    pub(super) seed: u64,
    duration_s: f64,
    team: TeamParams,
    mission: Mission,
    judge: Judge,
    /// Which targets ever had a live track.
    ever_known: Vec<bool>,
    /// By UAV, [`observation::LENGTH`] numbers each.
    pub(super) observations: Vec<f32>,
    /// What the product would have each UAV do: turn rate and speed, as an action has them.
    pub(super) law: Vec<f64>,
    /// The instant, judged.
    pub(super) worth: Worth,
    has_stepped: bool,
    /// No target that exists is known any more.
    pub(super) is_terminated: bool,
    /// The mission is over.
    pub(super) is_truncated: bool,
}

impl World {
    /// The mission of a seed, at its start.
    pub(super) fn begin(Kind { template, uavs }: &Kind, seeds: Seeds) -> Result<Self, NoMission> {
        let seed = seeds.seed();
        let scenario = template.draw(seed).map_err(NoMission::Scenario)?;
        let name = || template.name().to_owned();
        if scenario.uavs.len() != *uavs {
            return Err(NoMission::Uavs { name: name(), seed, there: scenario.uavs.len(), wanted: *uavs });
        }
        let parameters = |errors: Vec<ParamError>| NoMission::Parameters { name: name(), seed, errors };
        let mission = Mission::new(&scenario).map_err(parameters)?;
        let mut world = Self {
            seeds,
            seed,
            duration_s: (mission.frames() - 1) as f64 * scenario.settings.period.s(),
            team: scenario.settings.team,
            judge: Judge::new(mission.rules()),
            mission,
            ever_known: Vec::new(),
            observations: Vec::new(),
            law: Vec::new(),
            worth: Worth::default(),
            has_stepped: false,
            is_terminated: false,
            is_truncated: false,
        };
        world.observe();
        Ok(world)
    }

    pub(super) fn is_over(&self) -> bool {
        self.is_terminated || self.is_truncated
    }

    /// Time since the start of the mission, s.
    pub(super) fn time_s(&self) -> f64 {
        self.mission.now().s()
    }

    /// When the mission is over, s: its last instant.
    pub(super) fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// The team's reward of the last step, which has led to this instant; 0 before the first.
    pub(super) fn reward(&self) -> f64 {
        if self.has_stepped { self.worth.reward() } else { 0.0 }
    }

    /// The same of each UAV.
    pub(super) fn uav_rewards(&self) -> impl Iterator<Item = f64> {
        self.worth.rewards().map(|reward| if self.has_stepped { reward } else { 0.0 })
    }

    /// Flies actions, a turn rate and a speed each, until the next instant. Nothing happens once the mission is over.
    pub(super) fn step(&mut self, actions: &[f64]) {
        if self.is_over() {
            return;
        }
        for (action, uav) in actions.chunks_exact(2).zip(0..) {
            self.mission.order(UavId(uav), command(action[0], action[1], &self.team.uav));
        }
        self.mission.decide();
        self.has_stepped = true;
        self.observe();
    }

    /// Looks at the instant that has come.
    fn observe(&mut self) {
        self.is_truncated = self.mission.is_last();
        self.mission.observe();
        let Some(frame) = self.mission.propose() else { return };
        for track in &frame.tracks {
            let place = track.target as usize;
            if place >= self.ever_known.len() {
                self.ever_known.resize(place + 1, false);
            }
            self.ever_known[place] = true;
        }
        let ever_known = self.ever_known.iter().filter(|known| **known).count();
        self.observations.clear();
        observation::of(frame, ever_known, &self.team, &mut self.observations);
        self.law.clear();
        self.law.extend(frame.uavs.iter().flat_map(|uav| action(uav, &self.team.uav)));
        self.worth.judge(&mut self.judge, frame, self.team.group.standoff.radius_min_m);
        // Where no target exists, none can be lost.
        self.is_terminated = ever_known > 0 && frame.tracks.is_empty() && !frame.truth.is_empty();
    }
}

/// What an action asks of a UAV.
fn command(turn_rate: f64, speed: f64, uav: &UavParams) -> Command {
    let [turn_rate, speed] = [turn_rate, speed].map(|part| part.clamp(-1.0, 1.0));
    Command {
        speed_m_s: uav.speed_m_s + speed * uav.speed_change_max_m_s,
        turn_rate_rad_s: turn_rate * uav.turn_rate_max_rad_s,
    }
}

/// The action that asks for what a UAV is commanded.
fn action(row: &UavRow, uav: &UavParams) -> [f64; 2] {
    let speed = observation::speed_change(row.speed_command_m_s, uav);
    [row.turn_rate_command_rad_s / uav.turn_rate_max_rad_s, speed].map(|part| part.clamp(-1.0, 1.0))
}
