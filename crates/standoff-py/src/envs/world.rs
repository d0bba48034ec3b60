//! One world: a sequence of missions flown by a policy.

use std::collections::BTreeSet;

use standoff::{Command, ParamError, TeamParams, UavId, UavParams};
use standoff_record::UavRow;
use standoff_score::FrameScorer;
use standoff_sim::random::{Draws, Stream};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{ScenarioError, ScenarioTemplate};
use standoff_view::image;

use super::observation;
use super::reward::StepScore;

/// Reason why a mission cannot start.
pub(super) enum NoMission {
    Scenario(ScenarioError),
    Parameters { name: String, seed: u64, errors: Vec<ParamError> },
    Uavs { name: String, seed: u64, there: usize, expected: usize },
}

/// Properties that all missions of the worlds share.
pub(super) struct Kind {
    pub(super) template: ScenarioTemplate,
    /// Number of UAVs.
    pub(super) uavs: usize,
}

/// Sequence of the seeds of a world's missions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Seeds {
    first: u64,
    episode: u64,
}

impl Seeds {
    /// Starts the sequence with the seed of the first mission.
    pub(super) fn from(first: u64) -> Self {
        Self { first, episode: 0 }
    }

    pub(super) fn next(self) -> Self {
        Self { episode: self.episode + 1, ..self }
    }

    /// Seed of the current mission: the given one for the first mission, then one that depends only on the given seed
    /// and on the index of the mission.
    fn seed(self) -> u64 {
        match self.episode {
            0 => self.first,
            episode => Draws::new(self.first).at(Stream::Episode, 0, episode).seed(),
        }
    }
}

/// A mission with the observations and the score of the current time step, before its commands are decided.
pub(super) struct World {
    pub(super) seeds: Seeds,
    pub(super) seed: u64,
    duration_s: f64,
    team: TeamParams,
    mission: Mission,
    scorer: FrameScorer,
    /// Numbers of the live tracks so far.
    ever_known: BTreeSet<u32>,
    /// Features by UAV, [`observation::LENGTH`] values each.
    pub(super) observations: Vec<f32>,
    /// Commands of the built-in guidance law for each UAV, in action units: turn rate and speed.
    pub(super) law: Vec<f64>,
    /// Score of the current time step.
    pub(super) score: StepScore,
    has_stepped: bool,
    /// True if targets exist but none has a live track any more.
    pub(super) is_terminated: bool,
    /// True if the mission has reached its duration.
    pub(super) is_truncated: bool,
}

impl World {
    /// Starts the mission of the current seed.
    pub(super) fn begin(Kind { template, uavs }: &Kind, seeds: Seeds) -> Result<Self, NoMission> {
        let seed = seeds.seed();
        let scenario = template.draw(seed).map_err(NoMission::Scenario)?;
        let name = || template.name().to_owned();
        if scenario.uavs.len() != *uavs {
            return Err(NoMission::Uavs { name: name(), seed, there: scenario.uavs.len(), expected: *uavs });
        }
        let parameters = |errors: Vec<ParamError>| NoMission::Parameters { name: name(), seed, errors };
        let mission = Mission::new(&scenario).map_err(parameters)?;
        let mut world = Self {
            seeds,
            seed,
            duration_s: (mission.frames() - 1) as f64 * scenario.settings.period.s(),
            team: scenario.settings.team,
            scorer: FrameScorer::new(mission.score_config()),
            mission,
            ever_known: BTreeSet::new(),
            observations: Vec::new(),
            law: Vec::new(),
            score: StepScore::default(),
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

    /// Image of the current time step, as rows of red, green and blue.
    pub(super) fn image(&mut self, size: u32) -> Result<Vec<u8>, String> {
        let frame = self.mission.propose().ok_or("the mission has no time step")?;
        image::rgb(frame, &self.team.track.sensor, size).map_err(|error| error.to_string())
    }

    /// Time since the start of the mission, s.
    pub(super) fn time_s(&self) -> f64 {
        self.mission.now().s()
    }

    /// Time of the last time step of the mission, s.
    pub(super) fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Team reward of the last step; 0 before the first step.
    pub(super) fn reward(&self) -> f64 {
        if self.has_stepped { self.score.reward() } else { 0.0 }
    }

    /// Reward of each UAV for the last step; 0 before the first step.
    pub(super) fn uav_rewards(&self) -> impl Iterator<Item = f64> {
        self.score.rewards().map(|reward| if self.has_stepped { reward } else { 0.0 })
    }

    /// Applies the actions (turn rate and speed of each UAV) for one time step. Has no effect after the end of the
    /// mission.
    pub(super) fn step(&mut self, actions: &[f64]) {
        if self.is_over() {
            return;
        }
        for (action, uav) in actions.chunks_exact(2).zip(0..) {
            self.mission.override_command(UavId(uav), command(action[0], action[1], &self.team.uav));
        }
        self.mission.decide();
        self.has_stepped = true;
        self.observe();
    }

    /// Computes observations, baseline actions and score of the current time step.
    fn observe(&mut self) {
        self.is_truncated = self.mission.is_last();
        self.mission.observe();
        let Some(frame) = self.mission.propose() else { return };
        self.ever_known.extend(frame.tracks.iter().map(|track| track.track));
        let ever_known = self.ever_known.len();
        self.observations.clear();
        observation::of(frame, ever_known, &self.team, &mut self.observations);
        self.law.clear();
        self.law.extend(frame.uavs.iter().flat_map(|uav| action(uav, &self.team.uav)));
        self.score.update(&mut self.scorer, frame, self.team.group.standoff.radius_min_m);
        // If no target exists, none can be lost.
        self.is_terminated = ever_known > 0 && frame.tracks.is_empty() && !frame.truth.is_empty();
    }
}

/// The command of an action; values outside -1 to 1 are clipped.
fn command(turn_rate: f64, speed: f64, uav: &UavParams) -> Command {
    let [turn_rate, speed] = [turn_rate, speed].map(|part| part.clamp(-1.0, 1.0));
    Command {
        speed_m_s: uav.speed_m_s + speed * uav.speed_change_max_m_s,
        turn_rate_rad_s: turn_rate * uav.turn_rate_max_rad_s,
    }
}

/// The action that corresponds to the command of a UAV.
fn action(row: &UavRow, uav: &UavParams) -> [f64; 2] {
    let speed = observation::speed_change(row.speed_command_m_s, uav);
    [row.turn_rate_command_rad_s / uav.turn_rate_max_rad_s, speed].map(|part| part.clamp(-1.0, 1.0))
}
