//! A time step: a frame, and what several metric families derive from it.

use standoff::Duration;
use standoff::by_group::ByGroup;
use standoff::target::Transition;
use standoff_record::Frame;

use crate::config::ScoreConfig;
use crate::flown_path::PathModel;
use crate::geometry::Coverage;
use crate::grouped::Grouped;
use crate::matching::{self, Matched, Matching};
use crate::nees::nees_per_state;
use crate::true_orbits::TrueOrbits;

/// Inputs that are computed only if a selected metric needs them.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Inputs {
    /// Scores of each target.
    pub(crate) targets: bool,
    /// Estimation errors in the scores of each target.
    pub(crate) errors: bool,
    /// Normalised estimation errors squared.
    pub(crate) nees: bool,
    /// Targets that each sensor covers.
    pub(crate) covered: bool,
    pub(crate) true_orbits: bool,
    /// Separation of aircraft that are not in the same group.
    pub(crate) all_pairs: bool,
}

impl Inputs {
    /// Returns the inputs that either needs.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            targets: self.targets || other.targets,
            errors: self.errors || other.errors,
            nees: self.nees || other.nees,
            covered: self.covered || other.covered,
            true_orbits: self.true_orbits || other.true_orbits,
            all_pairs: self.all_pairs || other.all_pairs,
        }
    }
}

/// A frame, and what is derived from it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step<'a> {
    pub(crate) config: &'a ScoreConfig,
    pub(crate) frame: &'a Frame,
    pub(crate) inputs: Inputs,
    /// Paths of aircraft since the last frame.
    pub(crate) paths: &'a PathModel,
    /// Target model that the filters assume, over one time step.
    pub(crate) transition: &'a Transition,
    pub(crate) matching: &'a Matching<'a>,
    pub(crate) grouped: &'a Grouped,
    /// UAVs of each group.
    pub(crate) uavs: &'a ByGroup<u32>,
    /// Empty unless the scores of each target or the covered targets are an input.
    pub(crate) coverage: &'a Coverage,
    /// Empty unless an input.
    pub(crate) true_orbits: &'a TrueOrbits,
    /// Of each pair of target and track: NEES if it is a group member. Empty unless an input.
    pub(crate) nees: &'a [Option<f64>],
}

/// The time steps of a run in sequence; the memory is reused.
#[derive(Debug)]
pub(crate) struct Steps {
    inputs: Inputs,
    paths: PathModel,
    transition: Transition,
    /// Empty between two time steps.
    matching: Matching<'static>,
    uavs: ByGroup<u32>,
    coverage: Coverage,
    true_orbits: TrueOrbits,
    nees: Vec<Option<f64>>,
}

impl Steps {
    /// Makes a sequence with these inputs that has not processed any frame.
    pub(crate) fn new(config: &ScoreConfig, inputs: Inputs) -> Self {
        Self {
            inputs,
            paths: PathModel::new(&config.team, config.period_s),
            transition: config.target.transition(Duration::from_s(config.period_s)),
            matching: Matching::default(),
            uavs: ByGroup::default(),
            coverage: Coverage::new(inputs.covered),
            true_orbits: TrueOrbits::default(),
            nees: Vec::new(),
        }
    }

    /// Calls `score` with the time step of the next frame.
    pub(crate) fn next(&mut self, config: &ScoreConfig, frame: &Frame, score: impl FnOnce(&Step<'_>)) {
        let Self { inputs, paths, transition, uavs, coverage, true_orbits, nees, .. } = self;
        let mut matching = std::mem::take(&mut self.matching);
        matching.fill(&frame.truth, &frame.tracks);
        uavs.fill(matching::assigned(frame));
        if inputs.targets || inputs.covered {
            coverage.fill(frame, &config.sensor);
        }
        if inputs.true_orbits {
            true_orbits.next(config, &frame.groups, &matching);
        }
        nees.clear();
        if inputs.nees {
            let of_member = |pair: &Matched<'_>| pair.track.group.and_then(|_| nees_per_state(config, *pair));
            nees.extend(matching.pairs().iter().map(of_member));
        }
        let (inputs, matching_of, grouped) = (*inputs, &matching, &Grouped::of(frame));
        score(&Step {
            config,
            frame,
            inputs,
            paths,
            transition,
            matching: matching_of,
            grouped,
            uavs,
            coverage,
            true_orbits,
            nees,
        });
        self.matching = matching.emptied();
    }
}
