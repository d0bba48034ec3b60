//! Encodes frames into parts of a replay.

use std::borrow::Cow;
use std::collections::BTreeMap;

use standoff_record::{EventQuota, EventRow, Frame, PerAgentTables, TruthRow, UavRow};
use standoff_score::geometry::{desired_pair_phase_rad, phase_differences};
use standoff_score::{
    Alarm, Alarms, CustodyCounts, FrameScorer, FrameScores, Gap, Gaps, PositionBound, ScoreConfig, View,
};

use super::chunk::{Event, PartBounds, block};
use super::detections::DetectionTables;
use super::per_agent::{AssignmentTables, TeamStates};
use super::recorded::Recorded;
use super::table::Table;
use crate::Bytes;
use crate::colours::GroupColours;
use crate::figures::DetectionSetup;

/// Number of time steps after which a part is full.
const MAX_STEPS: usize = 256;
/// Number of rows of one table (targets, groups or UAVs) after which a part is full.
const ROWS: usize = 50_000;
/// Maximum number of target rows in a part with which another time step is added. Every target in a part occupies a row
/// for each time step of the part.
const MAX_ROWS: usize = 4 * ROWS;

// Derived columns of the tables, each with its value in a row.

type OfUav = fn(&UavRow, &FrameScores<'_>) -> Option<f64>;
type OfGroup = fn(&GroupScores) -> Option<f64>;
type OfRun = fn(&CustodyCounts) -> Option<f64>;
type OfTarget = fn(&TargetScores<'_>) -> Option<f64>;

const UAV: [(&str, OfUav); 2] = [
    ("standoff_error_m", |row, scores| scores.standoff_error_m(row)),
    ("off_boresight_rad", |row, scores| scores.geometry.off_boresight_rad(row)),
];

const GROUP: [(&str, OfGroup); 6] = [
    ("phase_rad", |of| of.phase.map(|(phase_rad, _)| phase_rad)),
    ("desired_phase_rad", |of| of.phase.map(|(_, desired_rad)| desired_rad)),
    ("position_error_m", |of| of.errors.map(|(error_m, _)| error_m)),
    ("position_crlb_m", |of| of.errors.and_then(|(_, bound_m)| bound_m)),
    ("scan_sd_m", |of| of.scan_sd_m),
    ("colour", |of| of.colour.map(|place| place as f64)),
];

const RUN: [(&str, OfRun); 5] = [
    ("targets", |custody| Some(custody.targets as f64)),
    ("tracked", |custody| Some(custody.tracked as f64)),
    ("in_custody", |custody| custody.in_custody.map(|count| count as f64)),
    ("in_view", |custody| custody.in_view.map(|count| count as f64)),
    ("position_error_m", |custody| custody.position_error_m),
];

const TARGET: [(&str, OfTarget); 5] = [
    ("true_x_m", |of| of.truth.map(|truth| truth.x_m)),
    ("true_y_m", |of| of.truth.map(|truth| truth.y_m)),
    ("in_view", |of| of.view.and_then(|view| view.is_in_view).map(f64::from)),
    ("out_of_view_steps", |of| of.view.map(|view| f64::from(view.out_of_view_steps()))),
    ("detections", |of| Some(f64::from(of.detections))),
];

/// Scores of a group at a time step.
struct GroupScores {
    /// Phase with the largest error, and the desired phase, rad.
    phase: Option<(f64, f64)>,
    /// RMS position error of the members, and its bound, m.
    errors: Option<(f64, Option<f64>)>,
    scan_sd_m: Option<f64>,
    colour: Option<usize>,
}

/// Scores of a target at a time step; empty for the track of no target.
#[derive(Default)]
struct TargetScores<'a> {
    truth: Option<&'a TruthRow>,
    view: Option<View>,
    detections: u32,
}

/// Encodes the frames of a run into parts.
#[derive(Debug)]
pub struct Encoder {
    scorer: FrameScorer,
    desired_phase_rad: f64,
    stride: usize,
    team_states_stride: usize,
    bound: Option<PositionBound>,
    detections: Option<DetectionSetup>,
    colours: GroupColours,
    allowance: EventQuota,
    others_allowance: EventQuota,
    recorded: Recorded,
    gaps: Gaps,
    alarms: Alarms,
    draft: Draft,
}

/// Consecutive time steps of a replay as gzipped blocks, described in the [module](super).
#[derive(Debug, Clone)]
pub struct Part {
    /// The run as a whole, UAVs, groups and events.
    pub overview: Bytes,
    /// Targets.
    pub detail: Bytes,
    /// Tracks and groups of the other agents, with one agent per UAV.
    pub team_states: Option<Bytes>,
}

impl Part {
    /// Returns the block of this name: `overview`, `detail` or `team-states`.
    #[must_use]
    pub fn block(&self, name: &str) -> Option<&Bytes> {
        match name {
            "overview" => Some(&self.overview),
            "detail" => Some(&self.detail),
            "team-states" => self.team_states.as_ref(),
            _ => None,
        }
    }
}

/// The part that is being filled.
#[derive(Debug)]
struct Draft {
    times_us: Vec<i64>,
    detail_times_us: Vec<i64>,
    events: Vec<Event>,
    bounds: PartBounds,
    run: Table,
    uavs: Table,
    groups: Table,
    intruders: Table,
    targets: Table,
    detections: Option<DetectionTables>,
    agents: AssignmentTables,
    team_states: TeamStates,
}

impl Encoder {
    /// Makes an encoder for a new run. Only every `stride`-th time step of a part (at least 1) gets a detail.
    #[must_use]
    pub fn new(rules: &ScoreConfig, stride: usize) -> Self {
        let recorded = Recorded::default();
        Self {
            scorer: FrameScorer::new(rules.clone()),
            desired_phase_rad: rules.desired_phase_rad,
            stride: stride.max(1),
            team_states_stride: stride.max(1),
            bound: PositionBound::of(rules),
            colours: GroupColours::default(),
            allowance: EventQuota::default(),
            gaps: Gaps::new(rules.period_s),
            alarms: Alarms::default(),
            others_allowance: EventQuota::default(),
            detections: None,
            draft: Draft::new(&recorded, None),
            recorded,
        }
    }

    /// Encodes the states of other agents only at every `team_states`-th detail of a part (at least 1).
    #[must_use]
    pub fn with_team_states_every(self, team_states: usize) -> Self {
        Self { team_states_stride: self.stride.saturating_mul(team_states.max(1)), ..self }
    }

    /// Encodes the detections of a run, if it has a setup for them. Call it before the first frame.
    #[must_use]
    pub fn with_detections(self, detections: Option<DetectionSetup>) -> Self {
        Self { draft: Draft::new(&self.recorded, detections.as_ref()), detections, ..self }
    }

    /// Number of events of the run that are in no part, because a page could not show them all.
    #[must_use]
    pub fn events_left_out(&self) -> u64 {
        self.allowance.left_out()
    }

    /// Number of events reported only by other agents that are in no part.
    #[must_use]
    pub fn other_events_left_out(&self) -> u64 {
        self.others_allowance.left_out()
    }

    /// Returns the times in which targets were in no UAV's view.
    #[must_use]
    pub fn gaps(&self) -> Vec<Gap> {
        self.gaps.all()
    }

    /// Returns the alarms of the run.
    #[must_use]
    pub fn alarms(&self) -> &[Alarm] {
        self.alarms.all()
    }

    /// Adds the next frame; returns a part when it is full.
    pub fn frame(&mut self, frame: &Frame) -> Option<Part> {
        let full = if self.draft.has_room_for(frame) { None } else { self.part() };
        self.add(frame);
        full.or_else(|| if self.draft.is_full() { self.part() } else { None })
    }

    fn add(&mut self, frame: &Frame) {
        let scores = self.scorer.frame(frame);
        if let Some(bound) = &mut self.bound {
            bound.frame(frame, scores.geometry.matching());
        }
        self.gaps.add(frame, &scores);
        self.alarms.add(frame);
        let (draft, recorded) = (&mut self.draft, &self.recorded);
        draft.times_us.push(frame.time_us);
        let shown = frame.events.iter().filter(|row| self.allowance.takes(row, None));
        if frame.agents.all.is_empty() {
            draft.events.extend(shown.map(|row| Event::of(frame.time_us, row)));
        } else {
            draft.events.extend(by_agents(frame, shown, &mut self.others_allowance));
        }
        draft.agents.next_step(frame);
        draft.bounds.take(frame);
        draft.run.next_step();
        // Without true targets, as in the record of a flight, there is nothing to count.
        let custody = scores.custody();
        if custody.targets > 0 {
            draft.run.put(0, RUN.map(|(_, value)| value(&custody)));
        }
        draft.uavs.next_step();
        for row in &frame.uavs {
            let derived = UAV.map(|(_, value)| value(row, &scores));
            draft.uavs.put(row.uav, recorded.uavs.values(Some(row)).chain(derived));
        }
        draft.intruders.next_step();
        for row in &frame.intruders {
            draft.intruders.put(row.intruder, recorded.intruders.values(Some(row)));
        }
        let phases = phases(frame, self.desired_phase_rad);
        draft.groups.next_step();
        self.colours.next_step(&frame.groups);
        for row in &frame.groups {
            let of = GroupScores {
                phase: phases.get(&row.group).copied(),
                errors: errors(&scores, self.bound.as_ref(), row.group),
                scan_sd_m: scores.scan_sd_m(row.group),
                colour: self.colours.place(row.group),
            };
            let derived = GROUP.map(|(_, value)| value(&of));
            draft.groups.put(row.group, recorded.groups.values(Some(row)).chain(derived));
        }
        // Every part starts with a detail, so that the page never shows a later detail too early.
        if (draft.times_us.len() - 1).is_multiple_of(self.stride) {
            draft.detail(frame, &scores, &self.gaps, recorded);
        }
        if (draft.times_us.len() - 1).is_multiple_of(self.team_states_stride) {
            draft.team_states.next_step(frame, recorded);
        }
    }

    /// Returns the time steps since the last part as a part and starts the next one; `None` if there are none.
    pub fn part(&mut self) -> Option<Part> {
        let part = self.so_far()?;
        self.draft = Draft::new(&self.recorded, self.detections.as_ref());
        Some(part)
    }

    /// Number of time steps in the part that is being filled.
    #[must_use]
    pub fn open_steps(&self) -> usize {
        self.draft.times_us.len()
    }

    /// Encodes the part that is being filled; `None` if it has no time step.
    #[must_use]
    pub fn so_far(&self) -> Option<Part> {
        let Draft {
            times_us,
            detail_times_us,
            events,
            bounds,
            run,
            uavs,
            groups,
            intruders,
            targets,
            detections,
            agents,
            team_states,
        } = &self.draft;
        let intruders = Some(intruders).filter(|table| table.rows() > 0);
        let tables = || [run, uavs, groups].into_iter().chain(intruders).chain(agents.tables());
        let of_detections = || detections.iter().flat_map(DetectionTables::tables);
        let part = || Part {
            overview: block(times_us, bounds.listed_m(), events, tables()),
            detail: block(detail_times_us, None, &[], std::iter::once(targets).chain(of_detections())),
            team_states: agents.tables().next().map(|_| block(&team_states.times_us, None, &[], team_states.tables())),
        };
        (!times_us.is_empty()).then(part)
    }
}

impl Draft {
    fn new(recorded: &Recorded, detections: Option<&DetectionSetup>) -> Self {
        let Recorded { uavs, groups, intruders, tracks, .. } = recorded;
        Self {
            times_us: Vec::new(),
            detail_times_us: Vec::new(),
            events: Vec::new(),
            bounds: PartBounds::default(),
            run: Table::new("run", RUN.map(|(name, _)| Cow::from(name))),
            uavs: Table::new("uavs", uavs.names().chain(UAV.map(|(name, _)| Cow::from(name)))),
            groups: Table::new("groups", groups.names().chain(GROUP.map(|(name, _)| Cow::from(name)))),
            intruders: Table::new("intruders", intruders.names()),
            targets: Table::new("targets", tracks.names().chain(TARGET.map(|(name, _)| Cow::from(name)))),
            detections: detections.map(|setup| DetectionTables::new(setup, recorded)),
            agents: AssignmentTables::new(),
            team_states: TeamStates::default(),
        }
    }

    fn is_full(&self) -> bool {
        let Self { uavs, groups, targets, detections, agents, team_states, .. } = self;
        let detected = detections.as_ref().map_or(0, DetectionTables::rows);
        let rows = [uavs.rows(), groups.rows(), targets.rows(), detected, agents.rows()];
        self.times_us.len() >= MAX_STEPS || rows.iter().any(|&rows| rows >= ROWS) || team_states.is_full()
    }

    /// Returns true if the rows of targets and detections stay bounded even if all of the frame are new to the part.
    fn has_room_for(&self, frame: &Frame) -> bool {
        let detected = self.detections.as_ref().map_or(0, |tables| tables.rows_with(frame));
        let most = self.targets.rows_with(frame.truth.len() + frame.tracks.len()).max(detected);
        !self.is_full() && (self.times_us.is_empty() || most <= MAX_ROWS)
    }

    /// Adds the targets: existing ones with their tracks, and tracks of targets that no longer exist.
    fn detail(&mut self, frame: &Frame, scores: &FrameScores<'_>, gaps: &Gaps, recorded: &Recorded) {
        self.detail_times_us.push(frame.time_us);
        self.targets.next_step();
        if let Some(tables) = &mut self.detections {
            tables.next_step(frame, recorded);
        }
        let mut detections: BTreeMap<u32, u32> = BTreeMap::new();
        for target in frame.detections.iter().filter_map(|detection| detection.target) {
            *detections.entry(target).or_default() += 1;
        }
        let matching = scores.geometry.matching();
        for (truth, track) in matching.targets() {
            let detections = detections.get(&truth.target).copied().unwrap_or(0);
            let of = TargetScores { truth: Some(truth), view: gaps.view(truth.target), detections };
            let derived = TARGET.map(|(_, value)| value(&of));
            self.targets.put(truth.target, recorded.tracks.values(track).chain(derived));
        }
        for track in matching.unmatched_tracks() {
            let derived = TARGET.map(|(_, value)| value(&TargetScores::default()));
            self.targets.put(track.target, recorded.tracks.values(Some(track)).chain(derived));
        }
    }
}

/// The events of a time step with the agents that report them. Those of the run's main tables, given as `run_events`,
/// come first. Events that are no part of a team state, such as `retransmission-limited`, are of no agent.
fn by_agents<'a>(
    frame: &'a Frame,
    run_events: impl Iterator<Item = &'a EventRow>,
    allowance: &mut EventQuota,
) -> Vec<Event> {
    let PerAgentTables { all, events, .. } = &frame.agents;
    let first = all.first().map(|row| row.agent);
    let mut own = events.iter().filter(|of| Some(of.agent) == first);
    let mut found: Vec<Event> = Vec::new();
    for row in run_events {
        let mut event = Event::of(frame.time_us, row);
        // Events before it may be left out.
        let mut rest = own.clone();
        if let Some(of) = rest.find(|of| of.event == *row) {
            event.reported_by(of);
            own = rest;
        }
        found.push(event);
    }
    let shown = found.len();
    for of in events.iter().filter(|of| Some(of.agent) != first) {
        let mut event = Event::of(frame.time_us, &of.event);
        event.reported_by(of);
        if let Some(same) = found.iter_mut().find(|other| other.is_same(&event) && !other.by.contains(&of.agent)) {
            same.by.push(of.agent);
        } else if allowance.takes(&of.event, None) {
            found.push(event);
        }
    }
    // Events of the main tables stay first; the others are sorted by agent.
    found[shown..].sort_by_key(|event| event.by[0]);
    found
}

/// For each group the phase between two UAVs with the largest phase error, and the desired phase, rad.
fn phases(frame: &Frame, pair_rad: f64) -> BTreeMap<u32, (f64, f64)> {
    let mut worst: BTreeMap<u32, (f64, f64)> = BTreeMap::new();
    for (group, (count, ..), phase_rad) in phase_differences(frame) {
        let desired_rad = desired_pair_phase_rad(count, pair_rad);
        let off_rad = |(phase_rad, desired_rad): (f64, f64)| (phase_rad - desired_rad).abs();
        let this = (phase_rad, desired_rad);
        let entry = worst.entry(group).or_insert(this);
        if off_rad(this) > off_rad(*entry) {
            *entry = this;
        }
    }
    worst
}

/// RMS position error of a group's members, and the root of the mean of its bound, m.
fn errors(scores: &FrameScores<'_>, bound: Option<&PositionBound>, group: u32) -> Option<(f64, Option<f64>)> {
    let members = scores.geometry.matching().pairs().iter().filter(|pair| pair.track.group == Some(group));
    let both = members.map(|pair| {
        let error_m = pair.position_error_m();
        (error_m * error_m, bound.and_then(|bound| bound.position_m2(pair.target.target)))
    });
    let both: Vec<(f64, Option<f64>)> = both.collect();
    let mean = |sum: f64| (sum / both.len() as f64).sqrt();
    let bound_m2: Option<f64> = both.iter().map(|(_, bound_m2)| *bound_m2).sum();
    (!both.is_empty()).then(|| (mean(both.iter().map(|(error_m2, _)| error_m2).sum()), bound_m2.map(mean)))
}
