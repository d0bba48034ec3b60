//! Targets of tracks without identity: pairs of target and track that persist.

use std::collections::{BTreeMap, BTreeSet};

use standoff::Position;
use standoff_record::{AgentEventRow, EventRow, Frame, NO_TARGET, TrackRow, TrackStatus, TruthRow};

use super::assignment::Assigner;
use super::{estimate, position};

/// Largest distance between a target and the track that is paired with it, m.
pub const CUTOFF_M: f64 = 30.0;

/// Number of time steps after which a track that has ended is forgotten. Events of a track follow its end by less.
const KEPT_STEPS: u64 = 2_000;

/// Finds the true target of each track in the frames of a run, if sensors report no identities.
///
/// A pair of target and track persists as long as both exist within [`CUTOFF_M`] of each other: if two targets meet,
/// their tracks do not swap for being nearer to the other target for a moment. The other tracks and targets are
/// assigned at each time step, so that the sum of squared distances is minimal. So are cued tracks, because the error of
/// a cue is as large as the distance of many targets: the first measurement shows which target the track is of. A track
/// of no target gets a key that no target has.
#[derive(Debug, Clone, Default)]
pub struct Identities {
    /// Numbers of the tracks, by key: the order of their first appearance.
    numbers: BTreeMap<TrackKey, u32>,
    of_team: TargetsOfTracks,
    of_agents: BTreeMap<u32, TargetsOfTracks>,
    steps: u64,
}

/// Identifies a track over time: id of a track without label, or number that a third-party controller gives it.
type TrackKey = (bool, u64);

/// Targets of the tracks of one team state.
type TargetsOfTracks = BTreeMap<TrackKey, Identity>;

#[derive(Debug, Clone, Copy)]
struct Identity {
    /// Target, or number of the track.
    target: u32,
    /// Last time step at which the track existed.
    step: u64,
    /// True if the track has been measured.
    is_measured: bool,
}

impl Identity {
    fn of(row: &TrackRow, step: u64) -> Self {
        Self { target: row.target, step, is_measured: row.status != TrackStatus::Cued }
    }

    /// True if the target is that of the track also at the next time step, `step`, if it is still near.
    fn persists_at(&self, step: u64) -> bool {
        self.is_measured && self.step + 1 == step
    }
}

impl Identities {
    /// Sets target and number of all tracks and events of the next frame of the run, and puts the tracks into the order
    /// of their targets. Of several rows of one track the first counts.
    pub fn identify(&mut self, frame: &mut Frame) {
        self.steps += 1;
        let Self { numbers, of_team, of_agents, steps } = self;
        let Frame { truth, tracks, events, agents, .. } = frame;
        let mut known = BTreeSet::new();
        tracks.retain(|row| known.insert(key_of(row)));
        let mut rows: Vec<&mut TrackRow> = tracks.iter_mut().collect();
        pair(&mut rows, truth, numbers, of_team, *steps);
        tracks.sort_by_key(|row| row.target);
        events.iter_mut().for_each(|event| name(event, numbers, of_team));
        let mut known = BTreeSet::new();
        agents.tracks.retain(|of| known.insert((of.agent, key_of(&of.row))));
        agents.tracks.sort_by_key(|of| of.agent);
        for rows in agents.tracks.chunk_by_mut(|one, next| one.agent == next.agent) {
            let of_agent = of_agents.entry(rows[0].agent).or_default();
            pair(&mut rows.iter_mut().map(|of| &mut of.row).collect::<Vec<_>>(), truth, numbers, of_agent, *steps);
        }
        agents.tracks.sort_by_key(|of| (of.agent, of.row.target));
        for AgentEventRow { agent, event, .. } in &mut agents.events {
            name(event, numbers, of_agents.entry(*agent).or_default());
        }
        for targets in of_agents.values_mut().chain([of_team]) {
            targets.retain(|_, identity| identity.step + KEPT_STEPS > *steps);
        }
    }
}

/// Finds the targets of the tracks of one team state.
fn pair(
    tracks: &mut [&mut TrackRow],
    truth: &[TruthRow],
    numbers: &mut BTreeMap<TrackKey, u32>,
    targets: &mut TargetsOfTracks,
    step: u64,
) {
    let mut paired: BTreeSet<u32> = BTreeSet::new();
    let mut free = Vec::new();
    for row in tracks {
        let key = key_of(row);
        let before = targets.get(&key).copied();
        row.track = number(key, numbers);
        let target = before.filter(|identity| identity.persists_at(step)).and_then(|identity| {
            let index = truth.binary_search_by_key(&identity.target, |target| target.target).ok()?;
            let is_near = estimate(row).distance_m(position(&truth[index])) < CUTOFF_M;
            (is_near && paired.insert(identity.target)).then_some(identity.target)
        });
        row.target = target.unwrap_or(row.track);
        targets.insert(key, Identity::of(row, step));
        if target.is_none() {
            free.push((key, row));
        }
    }
    let free_targets: Vec<&TruthRow> = truth.iter().filter(|target| !paired.contains(&target.target)).collect();
    let positions: Vec<Position> = free.iter().map(|(_, row)| estimate(row)).collect();
    let places: Vec<Position> = free_targets.iter().map(|target| position(target)).collect();
    for &(track, target) in Assigner::default().assign(&positions, &places, CUTOFF_M) {
        let (key, row) = &mut free[track];
        row.target = free_targets[target].target;
        targets.insert(*key, Identity::of(row, step));
    }
}

/// Sets target and number of the track of an event. An event of a track that is not known has no target.
fn name(event: &mut EventRow, numbers: &mut BTreeMap<TrackKey, u32>, targets: &TargetsOfTracks) {
    let key = match (event.track_uid, event.track.or(event.target)) {
        (Some(uid), _) => (true, uid),
        (None, Some(track)) => (false, track.into()),
        (None, None) => return,
    };
    event.track = Some(number(key, numbers));
    let target = targets.get(&key).map(|identity| identity.target).or(event.track);
    event.target = event.target.and(target);
}

fn number(key: TrackKey, numbers: &mut BTreeMap<TrackKey, u32>) -> u32 {
    let next = u32::try_from(numbers.len()).unwrap_or(u32::MAX).min(NO_TARGET - 1);
    *numbers.entry(key).or_insert(NO_TARGET + next)
}

fn key_of(row: &TrackRow) -> TrackKey {
    row.track_uid.map_or((false, row.track.into()), |uid| (true, uid))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row_fixtures::{track_row, truth_row};
    use standoff_record::ByAgent;

    fn track(uid: u64, x_m: f64, y_m: f64) -> TrackRow {
        TrackRow { track_uid: Some(uid), state: [x_m, 0.0, 0.0, y_m, 0.0, 0.0], ..track_row(NO_TARGET, None) }
    }

    fn frame(truth: &[(u32, f64)], tracks: &[(u64, f64)]) -> Frame {
        Frame {
            truth: truth.iter().map(|(id, x_m)| truth_row(*id, *x_m, 0.0)).collect(),
            tracks: tracks.iter().map(|(uid, x_m)| track(*uid, *x_m, 0.0)).collect(),
            ..Frame::default()
        }
    }

    /// Track id and target of each track after identification, as far as numbers are concerned relative to `NO_TARGET`.
    fn identified(identities: &mut Identities, mut frame: Frame) -> Vec<(u64, u32)> {
        identities.identify(&mut frame);
        assert!(frame.tracks.is_sorted_by_key(|row| row.target));
        frame.tracks.iter().map(|row| (row.track_uid.unwrap(), row.target)).collect()
    }

    #[test]
    fn pair_persists_within_the_cutoff_and_is_assigned_again_beyond() {
        let mut identities = Identities::default();
        let targets = [(3, 0.0), (5, 20.0)];
        assert_eq!(identified(&mut identities, frame(&targets, &[(70, 1.0), (80, 19.0)])), [(70, 3), (80, 5)]);
        // Both tracks are nearer to the other target.
        assert_eq!(identified(&mut identities, frame(&targets, &[(70, 19.0), (80, 1.0)])), [(70, 3), (80, 5)]);
        // Track 70 is too far from its target, the other one is free.
        assert_eq!(identified(&mut identities, frame(&[(3, 0.0), (5, 60.0)], &[(70, 50.0)])), [(70, 5)]);
        // A track that has no target near it has its own key, also at the next time step.
        let lone = [(90, 500.0)];
        assert_eq!(identified(&mut identities, frame(&targets, &lone)), [(90, NO_TARGET + 2)]);
        assert_eq!(identified(&mut identities, frame(&targets, &lone)), [(90, NO_TARGET + 2)]);
        // A pair that ended does not come back by itself.
        assert_eq!(identified(&mut identities, frame(&targets, &[(70, 1.0)])), [(70, 3)]);
    }

    /// The first measurement of a cued track decides which target it is of.
    #[test]
    fn a_cued_track_is_assigned_again_until_it_is_measured() {
        let mut identities = Identities::default();
        let with = |status, x_m| {
            let mut frame = frame(&[(3, 0.0), (5, 20.0)], &[(70, x_m)]);
            frame.tracks[0].status = status;
            frame
        };
        let cued = |x_m| with(TrackStatus::Cued, x_m);
        assert_eq!(identified(&mut identities, cued(9.0)), [(70, 3)]);
        assert_eq!(identified(&mut identities, cued(12.0)), [(70, 5)]);
        assert_eq!(identified(&mut identities, with(TrackStatus::Updated, 8.0)), [(70, 3)]);
        assert_eq!(identified(&mut identities, with(TrackStatus::Updated, 12.0)), [(70, 3)]);
    }

    /// Tracks have the same number in all team states, but each agent has its own pairs. Events have the target of
    /// their track, also after its end.
    #[test]
    fn agents_have_their_own_pairs_and_events_the_target_of_their_track() {
        let mut identities = Identities::default();
        let of = |agent, uid, x_m| ByAgent { agent, row: track(uid, x_m, 0.0) };
        let event = |uid| EventRow { track_uid: Some(uid), track: Some(0), target: Some(0), ..EventRow::default() };
        let mut first = frame(&[(3, 0.0), (5, 200.0)], &[(70, 1.0)]);
        first.agents.tracks = vec![of(0, 80, 2.0), of(0, 70, 199.0), of(1, 70, 1.0)];
        first.agents.events = vec![AgentEventRow { agent: 0, event: event(70), ..AgentEventRow::default() }];
        first.events = vec![event(70), event(99)];
        identities.identify(&mut first);
        let rows = first.agents.tracks.iter().map(|of| (of.agent, of.row.target, of.row.track - NO_TARGET));
        assert_eq!(rows.collect::<Vec<_>>(), [(0, 3, 2), (0, 5, 0), (1, 3, 0)]);
        assert_eq!(first.agents.events[0].event.target, Some(5));
        let named = |event: &EventRow| (event.target, event.track);
        assert_eq!(named(&first.events[0]), (Some(3), Some(NO_TARGET)));
        assert_eq!(first.events[1].target, first.events[1].track, "a track that was never reported");
        let mut second = Frame { events: vec![event(70), EventRow::default()], ..frame(&[(3, 0.0)], &[]) };
        identities.identify(&mut second);
        assert_eq!(named(&second.events[0]), (Some(3), Some(NO_TARGET)));
        assert_eq!(named(&second.events[1]), (None, None));
    }

    /// A third-party controller that gives no ids is identified by its own numbers. Of two rows of a track one remains.
    #[test]
    fn tracks_without_id_are_identified_by_their_number() {
        let mut identities = Identities::default();
        let own = |track, x_m| TrackRow { track, track_uid: None, ..self::track(0, x_m, 0.0) };
        for targets in [[3, 5], [5, 3]] {
            let mut frame = Frame {
                truth: vec![truth_row(3, 0.0, 0.0), truth_row(5, 25.0, 0.0)],
                tracks: vec![
                    own(8, f64::from(targets[0] - 3) * 12.5),
                    own(9, f64::from(targets[1] - 3) * 12.5),
                    own(9, 0.0),
                ],
                ..Frame::default()
            };
            identities.identify(&mut frame);
            let rows = frame.tracks.iter().map(|row| (row.target, row.track - NO_TARGET)).collect::<Vec<_>>();
            assert_eq!(rows, [(3, 0), (5, 1)]);
        }
    }
}
