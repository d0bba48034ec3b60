//! Frames in, parts of a replay out.

use std::collections::BTreeMap;

use standoff_sim::geometry::{separations, wanted_separation_rad};
use standoff_sim::record::{
    Agents, EventAllowance, EventRow, Frame, GroupRow, IntruderRow, TrackRow, TruthRow, UavRow,
};
use standoff_sim::score::{Custody, Judge, Judged, PositionBound, Rules};

use super::minds::{Crews, Pictures};
use super::part::{Bounds, Event, half};
use super::table::{Table, place_code, status_code};
use crate::colours::GroupColours;
use crate::serve::Bytes;

/// Instants after which a part is full.
const INSTANTS: usize = 256;
/// Rows of targets, or of groups or UAVs, after which it is.
const ROWS: usize = 50_000;
/// Most rows of targets in a part before the last instant joins it: every target that a part has takes a row for each of
/// its instants.
const MOST_ROWS: usize = 4 * ROWS;

/// Defines a table's columns, each beside what is in it: their names, and the row that a function gives of an object.
macro_rules! columns {
    ($names:ident: $row:ident($($of:ident: $type:ty),*) { $($column:ident: $value:expr,)+ }) => {
        const $names: [&str; [$(stringify!($column)),+].len()] = [$(stringify!($column)),+];

        fn $row($($of: $type),*) -> [Option<f64>; $names.len()] {
            [$($value),+]
        }
    };
}

columns! { UAV: uav(row: &UavRow, judged: &Judged<'_>) {
    group: row.group.map(f64::from),
    x_m: Some(row.x_m),
    y_m: Some(row.y_m),
    heading_rad: Some(row.heading_rad),
    speed_m_s: Some(row.speed_m_s),
    turn_rate_rad_s: Some(row.turn_rate_rad_s),
    boresight_rad: row.boresight_rad,
    speed_limited: Some(f64::from(row.speed_limited)),
    turn_rate_limited: Some(f64::from(row.turn_rate_limited)),
    centre_distance_m: row.centre_distance_m,
    avoids: row.avoids.map(f64::from),
    avoids_intruder: row.avoids_intruder.map(f64::from),
    foretold_m: row.foretold_m,
    border: row.border.map(f64::from),
    // worked out
    standoff_error_m: judged.standoff_error_m(row),
    line_of_sight_rad: judged.geometry.line_of_sight_rad(row),
} }

columns! { GROUP: group(row: &GroupRow, phase: Option<(f64, f64)>, errors: Option<(f64, Option<f64>)>,
    scan_sd_m: Option<f64>, colour: Option<usize>) {
    x_m: Some(row.x_m),
    y_m: Some(row.y_m),
    members: Some(f64::from(row.members)),
    spread_m: Some(row.spread_m),
    margin_m: Some(row.margin_m),
    standoff_distance_m: Some(row.standoff_distance_m),
    feasible: Some(f64::from(row.feasible)),
    separation_m: row.separation_m,
    // worked out
    phase_rad: phase.map(|(phase_rad, _)| phase_rad),
    phase_wanted_rad: phase.map(|(_, wanted_rad)| wanted_rad),
    position_error_m: errors.map(|(error_m, _)| error_m),
    position_bound_m: errors.and_then(|(_, bound_m)| bound_m),
    scan_sd_m: scan_sd_m,
    colour: colour.map(|place| place as f64),
} }

columns! { INTRUDER: intruder(row: &IntruderRow) {
    x_m: Some(row.x_m),
    y_m: Some(row.y_m),
    heading_rad: Some(row.heading_rad),
    speed_m_s: Some(row.speed_m_s),
    told: Some(f64::from(row.told)),
} }

columns! { RUN: run(custody: &Custody) {
    targets: Some(custody.targets as f64),
    tracked: Some(custody.tracked as f64),
    watched: custody.watched.map(|count| count as f64),
    seen: custody.seen.map(|count| count as f64),
    position_error_m: custody.position_error_m,
} }

// Of the state and of its covariance's upper triangle: [x, vx, ax, y, vy, ay], whose rows have 6, 5, 4, 3, 2, 1 numbers.
columns! { TARGET: target(truth: Option<&TruthRow>, track: Option<&TrackRow>, is_in_view: Option<bool>, detected: u32) {
    true_x_m: truth.map(|truth| truth.x_m),
    true_y_m: truth.map(|truth| truth.y_m),
    x_m: track.map(|track| track.state[0]),
    y_m: track.map(|track| track.state[3]),
    vx_m_s: track.map(|track| track.state[1]),
    vy_m_s: track.map(|track| track.state[4]),
    cov_x_x: track.map(|track| track.covariance[0]),
    cov_x_y: track.map(|track| track.covariance[3]),
    cov_y_y: track.map(|track| track.covariance[15]),
    status: track.map(|track| status_code(track.status)),
    place: track.map(|track| place_code(track.place)),
    group: track.and_then(|track| track.group).map(f64::from),
    to_group: track.and_then(|track| track.to_group).map(f64::from),
    // worked out
    in_view: is_in_view.map(f64::from),
    detections: Some(f64::from(detected)),
} }

/// Turns the frames of a run into parts.
#[derive(Debug)]
pub struct Encoder {
    judge: Judge,
    separation_rad: f64,
    stride: usize,
    pictures_stride: usize,
    bound: Option<PositionBound>,
    colours: GroupColours,
    allowance: EventAllowance,
    others_allowance: EventAllowance,
    draft: Draft,
}

/// Consecutive instants of a replay: gzipped halves, as the [module](super) tells.
#[derive(Debug, Clone)]
pub struct Part {
    /// The run as a whole, UAVs, groups and events.
    pub overview: Bytes,
    /// Targets.
    pub detail: Bytes,
    /// Tracks and groups of the other minds, where there are several.
    pub pictures: Option<Bytes>,
}

/// A part in the making.
#[derive(Debug)]
struct Draft {
    times_us: Vec<i64>,
    detail_times_us: Vec<i64>,
    events: Vec<Event>,
    bounds: Bounds,
    run: Table,
    uavs: Table,
    groups: Table,
    intruders: Table,
    targets: Table,
    crews: Crews,
    pictures: Pictures,
}

impl Encoder {
    /// An encoder at the start of a run. Only every `stride`-th instant of a part (at least 1) gets a detail.
    #[must_use]
    pub fn new(rules: &Rules, stride: usize) -> Self {
        Self {
            judge: Judge::new(rules.clone()),
            separation_rad: rules.separation_rad,
            stride: stride.max(1),
            pictures_stride: stride.max(1),
            bound: PositionBound::of(rules),
            colours: GroupColours::default(),
            allowance: EventAllowance::default(),
            others_allowance: EventAllowance::default(),
            draft: Draft::new(),
        }
    }

    /// Tells pictures of other minds only where there is a detail, and of these only every `pictures`-th of a part (at least 1).
    #[must_use]
    pub fn with_pictures_every(self, pictures: usize) -> Self {
        Self { pictures_stride: self.stride.saturating_mul(pictures.max(1)), ..self }
    }

    /// How many of the run's events are in no part, because they are too many for a page.
    #[must_use]
    pub fn events_left_out(&self) -> u64 {
        self.allowance.left_out()
    }

    /// How many of those events that only other minds tell of are in no part.
    #[must_use]
    pub fn other_events_left_out(&self) -> u64 {
        self.others_allowance.left_out()
    }

    /// Takes in the next frame; gives a part when one is full.
    pub fn frame(&mut self, frame: &Frame) -> Option<Part> {
        let full = if self.draft.has_room_for(frame) { None } else { self.part() };
        self.add(frame);
        full.or_else(|| if self.draft.is_full() { self.part() } else { None })
    }

    fn add(&mut self, frame: &Frame) {
        if let Some(bound) = &mut self.bound {
            bound.frame(frame);
        }
        let judged = self.judge.frame(frame);
        let draft = &mut self.draft;
        draft.times_us.push(frame.time_us);
        let told = frame.events.iter().filter(|row| self.allowance.takes(row, None));
        if frame.agents.all.is_empty() {
            draft.events.extend(told.map(|row| Event::of(frame.time_us, row)));
        } else {
            draft.events.extend(by_minds(frame, told, &mut self.others_allowance));
        }
        draft.crews.next_instant(frame);
        draft.bounds.take(frame);
        draft.run.next_instant();
        draft.run.put(0, &run(&judged.custody()));
        draft.uavs.next_instant();
        for row in &frame.uavs {
            draft.uavs.put(row.uav, &uav(row, &judged));
        }
        draft.intruders.next_instant();
        for row in &frame.intruders {
            draft.intruders.put(row.intruder, &intruder(row));
        }
        let phases = phases(frame, self.separation_rad);
        draft.groups.next_instant();
        self.colours.next_instant(&frame.groups);
        for row in &frame.groups {
            let errors = errors(frame, &judged, self.bound.as_ref(), row.group);
            let phase = phases.get(&row.group).copied();
            let colour = self.colours.place(row.group);
            draft.groups.put(row.group, &group(row, phase, errors, judged.scan_sd_m(row.group), colour));
        }
        // Every part begins with one, so that nothing is shown before its time.
        if (draft.times_us.len() - 1).is_multiple_of(self.stride) {
            draft.detail(frame, &judged);
        }
        if (draft.times_us.len() - 1).is_multiple_of(self.pictures_stride) {
            draft.pictures.next_instant(frame);
        }
    }

    /// What there is since the last part; `None` if nothing. The next part begins after it.
    pub fn part(&mut self) -> Option<Part> {
        let part = self.so_far()?.0;
        self.draft = Draft::new();
        Some(part)
    }

    /// The part that is being filled as it is so far, and of how many instants it is; `None` if of none.
    #[must_use]
    pub fn so_far(&self) -> Option<(Part, usize)> {
        let Draft { times_us, detail_times_us, events, bounds, run, uavs, groups, intruders, targets, crews, pictures } =
            &self.draft;
        let intruders = Some(intruders).filter(|table| table.rows() > 0);
        let tables = || [run, uavs, groups].into_iter().chain(intruders).chain(crews.tables());
        let part = || Part {
            overview: half(times_us, bounds.told_m(), events, tables()),
            detail: half(detail_times_us, None, &[], [targets]),
            pictures: crews.tables().next().map(|_| half(&pictures.times_us, None, &[], pictures.tables())),
        };
        (!times_us.is_empty()).then(|| (part(), times_us.len()))
    }
}

impl Draft {
    fn new() -> Self {
        Self {
            times_us: Vec::new(),
            detail_times_us: Vec::new(),
            events: Vec::new(),
            bounds: Bounds::default(),
            run: Table::new("run", &RUN),
            uavs: Table::new("uavs", &UAV),
            groups: Table::new("groups", &GROUP),
            intruders: Table::new("intruders", &INTRUDER),
            targets: Table::new("targets", &TARGET),
            crews: Crews::new(),
            pictures: Pictures::default(),
        }
    }

    fn is_full(&self) -> bool {
        let Self { uavs, groups, targets, crews, pictures, .. } = self;
        let rows = [uavs.rows(), groups.rows(), targets.rows(), crews.rows()];
        self.times_us.len() >= INSTANTS || rows.iter().any(|&rows| rows >= ROWS) || pictures.is_full()
    }

    /// The rows of targets stay bounded even if all of the frame's are new to the part.
    fn has_room_for(&self, frame: &Frame) -> bool {
        let most = self.targets.rows_with(frame.truth.len() + frame.tracks.len());
        !self.is_full() && (self.times_us.is_empty() || most <= MOST_ROWS)
    }

    /// The targets: those that exist beside their tracks, and tracks of those that do not any more.
    fn detail(&mut self, frame: &Frame, judged: &Judged<'_>) {
        self.detail_times_us.push(frame.time_us);
        self.targets.next_instant();
        let mut detections: BTreeMap<u32, u32> = BTreeMap::new();
        for detection in &frame.detections {
            *detections.entry(detection.target).or_default() += 1;
        }
        let truth = |id: u32| frame.truth.binary_search_by_key(&id, |row| row.target).ok().map(|at| &frame.truth[at]);
        let track = |id: u32| frame.tracks.binary_search_by_key(&id, |row| row.target).ok().map(|at| &frame.tracks[at]);
        let ids = frame.truth.iter().map(|row| row.target).chain(frame.tracks.iter().map(|row| row.target));
        for id in ids {
            let seen = detections.get(&id).copied().unwrap_or(0);
            self.targets.put(id, &target(truth(id), track(id), judged.in_view(id), seen));
        }
    }
}

/// The events of an instant, each beside the minds that tell it: first those of the run's own picture that are `told`.
fn by_minds<'a>(
    frame: &'a Frame,
    told: impl Iterator<Item = &'a EventRow>,
    allowance: &mut EventAllowance,
) -> Vec<Event> {
    let Agents { all, events, .. } = &frame.agents;
    let first = all.first().map(|mind| mind.agent);
    let mut own = events.iter().filter(|of| Some(of.agent) == first).peekable();
    let mut found: Vec<Event> = Vec::new();
    for row in told {
        let mut event = Event::of(frame.time_us, row);
        match own.next_if(|of| of.event == *row) {
            Some(of) => event.told_by(of),
            None => event.by.extend(first),
        }
        found.push(event);
    }
    let shown = found.len();
    for of in events.iter().filter(|of| Some(of.agent) != first) {
        let mut event = Event::of(frame.time_us, &of.event);
        event.told_by(of);
        if let Some(same) = found.iter_mut().find(|other| other.is_same(&event) && !other.by.contains(&of.agent)) {
            same.by.push(of.agent);
        } else if allowance.takes(&of.event, None) {
            found.push(event);
        }
    }
    // What all tell comes first, then by mind.
    found[shown..].sort_by_key(|event| event.by[0]);
    found
}

/// The phase separation of each group that is furthest from what is wanted, and what is wanted, rad.
fn phases(frame: &Frame, pair_rad: f64) -> BTreeMap<u32, (f64, f64)> {
    let mut worst: BTreeMap<u32, (f64, f64)> = BTreeMap::new();
    for (group, (count, ..), phase_rad) in separations(frame) {
        let wanted_rad = wanted_separation_rad(count, pair_rad);
        let off_rad = |(phase_rad, wanted_rad): (f64, f64)| (phase_rad - wanted_rad).abs();
        let this = (phase_rad, wanted_rad);
        let entry = worst.entry(group).or_insert(this);
        if off_rad(this) > off_rad(*entry) {
            *entry = this;
        }
    }
    worst
}

/// Root of the mean squared position error of a group's members, and of the mean of its bound, m.
fn errors(frame: &Frame, judged: &Judged<'_>, bound: Option<&PositionBound>, group: u32) -> Option<(f64, Option<f64>)> {
    let members = frame.tracks.iter().filter(|track| track.group == Some(group));
    let both = members.filter_map(|track| {
        let error_m = judged.geometry.position_error_m(track)?;
        Some((error_m * error_m, bound.and_then(|bound| bound.position_m2(track.target))))
    });
    let both: Vec<(f64, Option<f64>)> = both.collect();
    let mean = |sum: f64| (sum / both.len() as f64).sqrt();
    let bound_m2: Option<f64> = both.iter().map(|(_, bound_m2)| *bound_m2).sum();
    (!both.is_empty()).then(|| (mean(both.iter().map(|(error_m2, _)| error_m2).sum()), bound_m2.map(mean)))
}
