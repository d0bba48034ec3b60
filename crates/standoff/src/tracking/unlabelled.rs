//! Tracks of detections without label: joint integrated probabilistic data association (JIPDA).
//!
//! Each track has a probability of existence. For each scan, the detections are associated with the tracks jointly; a
//! track becomes the mean and covariance of the mixture of all its associations, and its existence more likely with each
//! probable detection and less likely with each miss. The blind zone of the sensor enters both: a miss makes a low radial
//! speed more likely, a detection less likely.
//!
//! A detection of no track starts a *tentative* track. It is in no group and causes no event until its existence is
//! almost certain; then it enters the table of tracks.

use crate::math;
use crate::message::Detection;
use crate::time::{Duration, Time};
use crate::tracking::estimate::{Estimate, Mixture};
use crate::tracking::exchange::{self, ExchangeMixture, exchange_probability, squared_distance};
use crate::tracking::input::TrackerInput;
use crate::tracking::joint_association::{Edge, JointAssociation};
use crate::tracking::motion_modes::{MotionModes, MotionTransitions, StoredModes};
use crate::tracking::scan_model::{Hit, ScanModel, View, Views, new_target_fraction};
use crate::tracking::track::{Track, TrackChange, TrackChangeKind, TrackId};
use crate::tracking::track_table::{TrackRow, TrackTable};
use crate::uav::UavId;

/// Probability of existence at which a tentative track is confirmed.
const CONFIRMED: f64 = 0.99;

/// Number of scans whose new targets the first scan finds, unless there were cues: that of the mean time that a target
/// exists, 1 / [`END_RATE_1_S`], at three scans per second.
const UNDETECTED_SCANS: f64 = 1000.0;

/// Maximum probability of existence of a new tentative track: a single detection confirms no track.
const STARTED_MAX: f64 = 0.9;

/// Probability of existence at which a confirmed track is lost.
const LOST: f64 = 0.3;

/// Probability of an exchange above which two tracks cannot be distinguished.
const INDISTINCT: f64 = 0.2;

/// Number of tracks without target, expected among a track and those indistinct from it, at which the least probable one
/// ends: from there on, the expected number of targets is rounded to less than that of the tracks.
const DUPLICATES: f64 = 0.5;

/// Probability of existence at which a tentative track is dropped, as a fraction of that of a new one.
const DROPPED: f64 = 0.2;

/// Time after which a tentative track that is not confirmed is dropped, s.
const TENTATIVE_MAX_S: f64 = 20.0;

/// Time after which a track that is missed in view is lost, s. Only a stopped target can be missed for so long.
const MISSED_MAX_S: f64 = 90.0;

/// Maximum number of tentative tracks.
const TENTATIVE_MAX: usize = 400;

/// Rate at which targets cease to exist, or tracks to follow them, 1/s.
const END_RATE_1_S: f64 = 0.003;

/// Probability of existence of a target with a cue.
const CUED_EXISTENCE: f64 = 0.95;

/// Ratio of an edge below which a detection is certainly not of a track.
const RATIO_MIN: f64 = 1e-4;

/// Maximum number of detections of a scan that are used: the nearest ones.
const DETECTIONS_MAX: usize = 2000;

/// Maximum number of possible pairs of a track and a detection in a scan. Beyond it, tracks find no further detections.
const EDGES_MAX: usize = 20_000;

/// Number of time steps with detection after which a track is known well enough to stay while its target has stopped.
const DETECTED_MAX: u8 = 10;

/// Squared distance between the estimates of one target, in standard deviations, that 99 % do not exceed, for positions.
const POSITION_GATE: f64 = 9.2;

/// State of the tracks without labels, apart from what the table of tracks contains.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct UnlabelledTracks {
    /// State of each track in the table that has no label, by ascending id.
    confirmed: Vec<Confirmed>,
    /// Tentative tracks, by ascending id.
    tentative: Vec<Tentative>,
}

/// State of a track in the table, apart from its estimate.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct Confirmed {
    id: TrackId,
    /// Probability that its target exists.
    existence: f64,
    /// Number of time steps in which it was detected, at most [`DETECTED_MAX`].
    detected_count: u8,
    modes: StoredModes,
    /// Estimate without exchanges; `None` if it is that in the table.
    own: Option<Estimate>,
    /// Tracks that may now follow its target, by ascending id, each with the odds.
    exchanges: Vec<(TrackId, f64)>,
}

impl Confirmed {
    fn new(id: TrackId, existence: f64, detected_count: u8, modes: StoredModes) -> Self {
        Self { id, existence, detected_count, modes, own: None, exchanges: Vec::new() }
    }

    /// Estimate of its track without exchanges.
    fn own_estimate<'a>(&'a self, track: &'a Track) -> &'a Estimate {
        self.own.as_ref().unwrap_or(track.estimate())
    }
}

/// A track that may be of no target.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
struct Tentative {
    id: TrackId,
    estimate: Estimate,
    existence: f64,
    started: Time,
}

/// A tentative track: a target that may exist. It is in no group and causes no event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TentativeTrack {
    /// Id that the track has if it is confirmed.
    pub id: TrackId,
    /// State and covariance.
    pub estimate: Estimate,
    /// Probability that the target exists.
    pub existence: f64,
}

/// A track while a time step is computed.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    id: TrackId,
    modes: MotionModes,
    existence: f64,
    detected_count: u8,
    /// Index in the table; `None` if it is tentative.
    row: Option<usize>,
    /// Start of a tentative track.
    started: Time,
    /// Probability that a detection of this time step is of it.
    detected: f64,
    /// True if it is probably in the view of a sensor.
    is_in_view: bool,
}

/// Computes time steps. It keeps no state between them, only buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct UnlabelledUpdate {
    /// Probability that a target in view still exists, and its track still follows it, after the time step.
    survival: f64,
    /// Number of targets that a scan may discover, as a multiple of those that have just appeared.
    undetected_factor: f64,
    candidates: Vec<Candidate>,
    views: Vec<Views>,
    joint: JointAssociation,
    edges: Vec<Edge>,
    /// Detections conditioned on being of a track, by edge.
    hits: Vec<Hit>,
    /// End of each edge's hits.
    hits_ends: Vec<usize>,
    /// Density of false alarms and of new targets at each detection.
    backgrounds: Vec<[f64; 2]>,
    /// For each detection, the probability that it is of a track.
    explained: Vec<f64>,
    /// Number of detections and pairs beyond a maximum, and of tracks that did not start because there were too many.
    pub(crate) rejected: u32,
}

impl UnlabelledTracks {
    pub(crate) fn is_empty(&self) -> bool {
        self.confirmed.is_empty() && self.tentative.is_empty()
    }

    /// Tentative tracks, by ascending id.
    pub(crate) fn tentative(&self) -> impl Iterator<Item = TentativeTrack> {
        self.tentative.iter().map(|&Tentative { id, estimate, existence, .. }| TentativeTrack {
            id,
            estimate,
            existence,
        })
    }

    /// True if a track belongs here and not to the labelled ones.
    pub(crate) fn contains(&self, id: TrackId) -> bool {
        self.confirmed(id).is_some()
    }

    fn confirmed(&self, id: TrackId) -> Option<&Confirmed> {
        self.confirmed.binary_search_by_key(&id, |of| of.id).ok().map(|index| &self.confirmed[index])
    }

    /// True if the state is one that a time step can leave.
    pub(crate) fn is_valid(&self, now: Time) -> bool {
        let is_probability = |probability: f64| (0.0..=1.0).contains(&probability);
        let is_possible = |of: &Confirmed| {
            let is_usable = of.own.is_none_or(|own| own.checked().is_some());
            let are_odds = of.exchanges.iter().all(|(_, odds)| (0.0..=1.0).contains(odds));
            let are_sorted = of.exchanges.is_sorted_by(|a, b| a.0 < b.0);
            is_probability(of.existence) && of.modes.is_valid() && is_usable && are_odds && are_sorted
        };
        let is_usable =
            |of: &Tentative| is_probability(of.existence) && of.started <= now && of.estimate.checked().is_some();
        self.confirmed.is_sorted_by(|a, b| a.id < b.id)
            && self.confirmed.iter().all(is_possible)
            && self.tentative.is_sorted_by(|a, b| a.id < b.id)
            && self.tentative.len() <= TENTATIVE_MAX
            && self.tentative.iter().all(is_usable)
    }

    /// True if a cue without label is probably of a track that exists already. Tracks that other cues of the time step
    /// have started (`new`) do not count: these cues are of other targets.
    pub(crate) fn has_track_near<R: TrackRow>(
        &self,
        tracks: &TrackTable<R>,
        new: &[TrackChange],
        cued: &Estimate,
    ) -> bool {
        let is_new = |track: &Track| new.iter().any(|change| change.track == track.id);
        let mut live = tracks.rows().iter().map(TrackRow::track).filter(|track| !track.is_lost() && !is_new(track));
        live.any(|track| {
            let own = self.confirmed(track.id).map_or(track.estimate(), |of| of.own_estimate(track));
            squared_distance(own, cued) < POSITION_GATE
        })
    }

    /// Enters a track that a cue has started.
    pub(crate) fn enter_cued(&mut self, id: TrackId) {
        self.enter(Confirmed::new(id, CUED_EXISTENCE, 0, StoredModes::default()));
    }

    /// Enters the state of a track. Its exchanges stay.
    fn enter(&mut self, entry: Confirmed) {
        match self.confirmed.binary_search_by_key(&entry.id, |of| of.id) {
            Ok(index) => {
                let exchanges = core::mem::take(&mut self.confirmed[index].exchanges);
                self.confirmed[index] = Confirmed { exchanges, ..entry };
            }
            Err(index) => self.confirmed.insert(index, entry),
        }
    }

    /// Advances all tracks without labels to a time step, and updates them with its scans.
    pub(crate) fn step<R: TrackRow>(
        &mut self,
        tracks: &mut TrackTable<R>,
        input: &TrackerInput,
        update: &mut UnlabelledUpdate,
        changes: &mut Vec<TrackChange>,
    ) {
        update.rejected = 0;
        if self.is_empty() && !input.scans.have_unlabelled() {
            return;
        }
        self.confirmed.retain(|of| tracks.index(of.id).is_ok());
        update.gather(self, tracks, input, changes);
        for (uav, model, detections) in input.scans.unlabelled() {
            let used = &detections[..detections.len().min(DETECTIONS_MAX)];
            update.rejected += (detections.len() - used.len()) as u32;
            update.associate(&model, used);
            if input.scans.starts_tracks(uav) {
                update.start(&model, used, uav, input);
            }
        }
        self.finish(tracks, input, update, changes);
    }

    /// Writes the results of a time step back: tracks updated, lost, confirmed, reacquired and dropped.
    fn finish<R: TrackRow>(
        &mut self,
        tracks: &mut TrackTable<R>,
        input: &TrackerInput,
        update: &mut UnlabelledUpdate,
        changes: &mut Vec<TrackChange>,
    ) {
        self.tentative.clear();
        // Targets in a blind zone are missed for another reason: their detections are not those of a neighbour's track.
        if !input.has_blind_zone() {
            update.end_duplicates();
        }
        for candidate in &update.candidates {
            let Some(row) = candidate.row else { continue };
            let track = tracks.rows_mut()[row].track_mut();
            let estimate = candidate.modes.moments();
            let missed = if candidate.is_in_view { input.transition.dt } else { Duration::ZERO };
            let is_improbable = |missed: Duration| candidate.existence < LOST || missed.s() > MISSED_MAX_S;
            let change = track.conclude(&estimate, candidate.detected, missed, is_improbable, input.params);
            if let Some(kind) = change {
                changes.push(TrackChange { track: track.id, kind });
            }
            self.enter(candidate.entry(candidate.id));
        }
        let least_existence = DROPPED * new_target_fraction(&input.params.sensor);
        for candidate in update.candidates.iter().filter(|candidate| candidate.row.is_none()) {
            let estimate = candidate.modes.moments();
            let is_old = (input.now - candidate.started).s() > TENTATIVE_MAX_S;
            if candidate.existence >= CONFIRMED {
                self.confirm(candidate, estimate, tracks, input, changes, &mut update.rejected);
            } else if candidate.existence >= least_existence && !is_old && estimate.checked().is_some() {
                let Candidate { id, existence, started, .. } = *candidate;
                self.tentative.push(Tentative { id, estimate, existence, started });
            }
        }
        self.tentative.sort_unstable_by_key(|of| of.id);
        self.tentative.dedup_by_key(|of| of.id);
        self.include_exchanges(tracks);
    }

    /// Includes in the covariances of the tracks that other tracks may now follow their targets.
    fn include_exchanges<R: TrackRow>(&mut self, tracks: &mut TrackTable<R>) {
        let live_row = |id: TrackId| tracks.index(id).ok().filter(|row| !tracks.rows()[*row].track().is_lost());
        let entries = self.confirmed.iter().enumerate();
        let live: Vec<(usize, usize)> = entries.filter_map(|(entry, of)| Some((entry, live_row(of.id)?))).collect();
        let estimates: Vec<Estimate> = live.iter().map(|(_, row)| *tracks.rows()[*row].track().estimate()).collect();
        let ids: Vec<TrackId> = live.iter().map(|(entry, _)| self.confirmed[*entry].id).collect();
        let now = exchange::odds_of_all(&estimates);
        self.confirmed.iter_mut().for_each(|of| of.own = None);
        for (one, (entry, row)) in live.iter().enumerate() {
            let of = &mut self.confirmed[*entry];
            let index = |id: &TrackId| ids.binary_search(id).ok();
            let known: Vec<_> = of.exchanges.iter().filter_map(|(id, odds)| Some((index(id)?, *odds))).collect();
            let all = now[one]
                .iter()
                .map(|(other, odds)| (*other, odds.max(exchange::odds_after(&known, *other, &now[*other]))));
            let all: Vec<_> = all.filter(|(_, odds)| *odds > exchange::NEGLIGIBLE).collect();
            let mut mixture = ExchangeMixture::default();
            for (other, odds) in &all {
                mixture.add(*odds, &(estimates[*other].state.0 - estimates[one].state.0));
            }
            of.exchanges = all.into_iter().map(|(other, odds)| (ids[other], odds)).collect();
            if let Some(estimate) = mixture.estimate(&estimates[one]) {
                of.own = Some(estimates[one]);
                tracks.rows_mut()[*row].track_mut().refine(&estimate);
            }
        }
    }

    /// Enters a tentative track into the table; if it is near a lost one, in its place.
    fn confirm<R: TrackRow>(
        &mut self,
        candidate: &Candidate,
        estimate: Estimate,
        tracks: &mut TrackTable<R>,
        input: &TrackerInput,
        changes: &mut Vec<TrackChange>,
        rejected: &mut u32,
    ) {
        let predecessor = self.predecessor(tracks, &estimate, input);
        let (id, kind) = match predecessor {
            Some(id) => (id, TrackChangeKind::Reacquired),
            None => (candidate.id, TrackChangeKind::Started),
        };
        let Some(track) = Track::from_estimate(id, estimate) else { return };
        match tracks.index(id) {
            Ok(row) => *tracks.rows_mut()[row].track_mut() = track,
            Err(_) if tracks.start(track, input.tracks_max) => {}
            Err(_) => return *rejected += 1,
        }
        self.enter(candidate.entry(id));
        changes.push(TrackChange { track: id, kind });
    }

    /// Lost track whose target a new track probably has.
    fn predecessor<R: TrackRow>(
        &self,
        tracks: &TrackTable<R>,
        new: &Estimate,
        input: &TrackerInput,
    ) -> Option<TrackId> {
        let lost = tracks.rows().iter().map(TrackRow::track).filter(|track| track.is_lost() && self.contains(track.id));
        let near = lost.filter_map(|track| {
            let transition = input.params.transition(track.time_since_lost());
            let mut estimate = *track.estimate();
            estimate.predict(&transition);
            let is_known = estimate.position_sd_max_m() < 2.0 * input.params.deletion_position_sd_m;
            let distance = squared_distance(&estimate, new);
            (is_known && distance < POSITION_GATE).then_some((distance, track.id))
        });
        near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, id)| id)
    }
}

impl UnlabelledUpdate {
    /// Ends duplicates. If fewer targets exist than tracks that cannot be distinguished, each of these keeps some detections
    /// and so its existence, although their number is known.
    fn end_duplicates(&mut self) {
        let mut confirmed: Vec<usize> =
            (0..self.candidates.len()).filter(|index| self.candidates[*index].row.is_some()).collect();
        let estimate = |index: &usize| self.candidates[*index].modes.moments();
        let estimates: Vec<Estimate> = confirmed.iter().map(estimate).collect();
        let mut pairs = exchange::close_pairs(&estimates);
        pairs.retain(|(one, other)| exchange_probability(&estimates[*one], &estimates[*other]) > INDISTINCT);
        let indistinct: Vec<[usize; 2]> =
            pairs.iter().map(|(one, other)| [confirmed[*one], confirmed[*other]]).collect();
        // Stable: of equally probable tracks, that of lowest id ends first.
        confirmed.sort_by(|a, b| self.candidates[*a].existence.total_cmp(&self.candidates[*b].existence));
        for index in confirmed {
            let pairs = indistinct.iter().filter(|pair| pair.contains(&index));
            let others: Vec<usize> = pairs.map(|[one, other]| if *one == index { *other } else { *one }).collect();
            self.end_if_duplicate(index, &others);
        }
    }

    /// Ends a track if its target is probably that of one of the tracks that are indistinct from it. They get its existence.
    fn end_if_duplicate(&mut self, index: usize, others: &[usize]) {
        let others = others.iter().filter(|other| self.candidates[**other].existence >= LOST);
        let others: Vec<usize> = others.copied().collect();
        let lacking: f64 = others.iter().map(|other| 1.0 - self.candidates[*other].existence).sum();
        let existence = self.candidates[index].existence;
        if existence < LOST || lacking <= 0.0 || lacking + 1.0 - existence < DUPLICATES {
            return;
        }
        self.candidates[index].existence = 0.0;
        let share = (existence / lacking).min(1.0);
        for other in others {
            let Candidate { existence, .. } = &mut self.candidates[other];
            *existence += share * (1.0 - *existence);
        }
    }

    /// Predicts all tracks without label to the time step.
    fn gather<R: TrackRow>(
        &mut self,
        state: &UnlabelledTracks,
        tracks: &TrackTable<R>,
        input: &TrackerInput,
        changes: &[TrackChange],
    ) {
        let transitions = MotionTransitions::new(input.transition, input.params);
        self.survival = math::exp(-END_RATE_1_S * input.transition.dt.s());
        // With a blind zone, misses would not end the false tracks that start then.
        let is_first_look = input.is_first_scan && tracks.rows().is_empty() && !input.has_blind_zone();
        self.undetected_factor = if is_first_look { UNDETECTED_SCANS } else { 1.0 };
        self.candidates.clear();
        for (row, of) in tracks.rows().iter().enumerate() {
            let track = of.track();
            let Some(known) = state.confirmed(track.id).filter(|_| !track.is_lost()) else { continue };
            let mut modes = known.modes.restored(known.own_estimate(track));
            // A track that a cue has just started is already at this time step.
            if !changes.iter().any(|change| change.track == track.id) {
                let can_stop = known.detected_count >= DETECTED_MAX && input.has_blind_zone();
                modes.predict(&transitions, can_stop);
            }
            self.candidates.push(Candidate {
                id: track.id,
                modes,
                existence: known.existence,
                detected_count: known.detected_count,
                row: Some(row),
                started: input.now,
                detected: 0.0,
                is_in_view: false,
            });
        }
        for tentative in &state.tentative {
            let mut modes = MotionModes::moving(tentative.estimate);
            modes.predict(&transitions, false);
            self.candidates.push(Candidate {
                id: tentative.id,
                modes,
                existence: tentative.existence,
                detected_count: 0,
                row: None,
                started: tentative.started,
                detected: 0.0,
                is_in_view: false,
            });
        }
    }

    /// Associates the detections of one scan with all candidates, and updates these.
    fn associate(&mut self, model: &ScanModel, detections: &[Detection]) {
        let Self {
            survival,
            undetected_factor,
            candidates,
            views,
            joint,
            edges,
            hits,
            hits_ends,
            backgrounds,
            explained,
            rejected,
        } = self;
        edges.clear();
        hits.clear();
        hits_ends.clear();
        explained.clear();
        explained.resize(detections.len(), 0.0);
        backgrounds.clear();
        let background = |[false_alarms, new_targets]: [f64; 2]| [false_alarms, new_targets * *undetected_factor];
        backgrounds.extend(detections.iter().map(|detection| background(model.background(detection))));
        views.clear();
        views.extend(candidates.iter().map(|candidate| model.views(&candidate.modes)));
        for (track, (candidate, views)) in candidates.iter_mut().zip(&*views).enumerate() {
            if views.iter().all(Option::is_none) {
                continue;
            }
            if !candidate.is_in_view && views.iter().flatten().any(View::is_in_view) {
                (candidate.existence, candidate.is_in_view) = (candidate.existence * *survival, true);
            }
            let missed = 1.0 - candidate.existence * detection_probability(&candidate.modes, views);
            for detection in model.possible(views, detections) {
                if edges.len() >= EDGES_MAX {
                    *rejected += 1;
                    break;
                }
                let density = model.add_hits(&candidate.modes, views, &detections[detection], hits);
                let background: f64 = backgrounds[detection].iter().sum();
                let ratio = candidate.existence * density / (missed.max(1e-9) * background);
                if ratio < RATIO_MIN {
                    hits.truncate(hits_ends.last().copied().unwrap_or(0));
                } else {
                    edges.push(Edge { track, detection, ratio, probability: 0.0 });
                    hits_ends.push(hits.len());
                }
            }
        }
        joint.solve(edges, detections.len());
        let mut start = 0;
        for of_track in edges.chunk_by(|a, b| a.track == b.track) {
            of_track.iter().for_each(|edge| explained[edge.detection] += edge.probability);
        }
        for (track, (candidate, views)) in candidates.iter_mut().zip(&*views).enumerate() {
            let end = start + edges[start..].iter().take_while(|edge| edge.track == track).count();
            if !views.iter().all(Option::is_none) {
                let first = start.checked_sub(1).map_or(0, |before| hits_ends[before]);
                candidate.update(model, views, &edges[start..end], hits, first, &hits_ends[start..end]);
            }
            start = end;
        }
    }

    /// Starts tentative tracks from the detections of a scan that are probably of no track.
    fn start(&mut self, model: &ScanModel, detections: &[Detection], uav: UavId, input: &TrackerInput) {
        let mut tentative_count = self.candidates.iter().filter(|candidate| candidate.row.is_none()).count();
        let mut repeats = 0;
        for (index, detection) in detections.iter().enumerate() {
            let is_repeat = index > 0 && detections[index - 1].order() == detection.order();
            repeats = if is_repeat { repeats + 1 } else { 0 };
            let [false_alarms, new_targets] = self.backgrounds[index];
            let unexplained = (1.0 - self.explained[index]).max(0.0);
            let existence = (unexplained * new_targets / (new_targets + false_alarms)).min(STARTED_MAX);
            if unexplained < 0.1 {
                continue;
            }
            if tentative_count >= TENTATIVE_MAX {
                self.rejected += 1;
                continue;
            }
            let (_, _, range, bearing, rate) = detection.order();
            let time = input.now.us().cast_unsigned();
            let id = TrackId::minted([time, uav.0.into(), range, bearing, rate.unwrap_or(0), repeats]);
            let measured = (model.uav_position(), detection.measurement);
            let Some(track) = Track::from_measurements(id, [measured], input.params) else { continue };
            let mut estimate = *track.estimate();
            if let Some(rate) = model.range_rate(&estimate, detection) {
                estimate.condition(&rate);
            }
            tentative_count += 1;
            self.candidates.push(Candidate {
                id,
                modes: MotionModes::moving(estimate),
                existence,
                detected_count: 0,
                row: None,
                started: input.now,
                detected: 1.0,
                is_in_view: true,
            });
        }
    }
}

impl Candidate {
    /// Replaces the estimate by the moments over all associations with the detections of one scan. The hits of the
    /// first edge start at `first`, those of each edge end at its element of `ends`.
    fn update(&mut self, model: &ScanModel, views: &Views, edges: &[Edge], hits: &[Hit], first: usize, ends: &[usize]) {
        let pd = detection_probability(&self.modes, views);
        let hit_probability: f64 = edges.iter().map(|edge| edge.probability).sum();
        let missed = (1.0 - hit_probability).max(0.0);
        let exists_missed = missed * self.existence * (1.0 - pd) / (1.0 - self.existence * pd).max(1e-12);
        let mut mixtures = self.modes.all().each_ref().map(|(_, estimate)| Mixture::about(estimate.state.0));
        let mut start = first;
        for (edge, end) in edges.iter().zip(ends) {
            let of_edge = &hits[start..*end];
            let density: f64 = of_edge.iter().map(|hit| hit.weight).sum();
            for hit in of_edge {
                mixtures[hit.mode].add(edge.probability * hit.weight / density, &hit.posterior);
            }
            start = *end;
        }
        for ((mixture, view), (prior, estimate)) in mixtures.iter_mut().zip(views).zip(self.modes.all()) {
            let weight = exists_missed * prior / (1.0 - pd).max(1e-9);
            model.add_miss(estimate, view.as_ref(), weight, mixture);
        }
        self.modes.replace(&mixtures);
        self.existence = (hit_probability + exists_missed).min(1.0);
        self.detected = self.detected.max(hit_probability);
    }

    /// State to keep of it as a track in the table with an id.
    fn entry(&self, id: TrackId) -> Confirmed {
        let detected_count = self.detected_count.saturating_add(u8::from(self.detected > 0.5)).min(DETECTED_MAX);
        Confirmed::new(id, self.existence, detected_count, self.modes.stored())
    }
}

/// Probability that a target is detected in a scan, over all motion models.
fn detection_probability(modes: &MotionModes, views: &Views) -> f64 {
    let of_mode = |((probability, _), view): (&(f64, Estimate), &Option<View>)| {
        view.as_ref().map_or(0.0, |view| probability * view.detection_probability())
    };
    modes.all().iter().zip(views).map(of_mode).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance;
    use crate::target::TargetState;
    use nalgebra::Vector6;

    /// A track in the table at `x_m`, known to 5 m.
    fn candidate(row: usize, x_m: f64, existence: f64) -> Candidate {
        let mut mean = Vector6::zeros();
        mean[0] = x_m;
        let covariance = Covariance::from_diagonal([25.0, 1.0, 0.1, 25.0, 1.0, 0.1]);
        Candidate {
            id: TrackId(row as u64),
            modes: MotionModes::moving(Estimate { state: TargetState(mean), covariance }),
            existence,
            detected_count: 0,
            row: Some(row),
            started: Time::EPOCH,
            detected: 0.0,
            is_in_view: true,
        }
    }

    fn existences_after(tracks: [(f64, f64); 3]) -> [f64; 3] {
        let mut update = UnlabelledUpdate::default();
        update.candidates.extend((0..).zip(tracks).map(|(row, (x_m, existence))| candidate(row, x_m, existence)));
        update.end_duplicates();
        core::array::from_fn(|index| update.candidates[index].existence)
    }

    /// Of two tracks of one target, the less probable one ends, and the other one gets its existence.
    #[test]
    fn a_duplicate_ends() {
        assert_eq!(existences_after([(0.0, 0.8), (1.0, 0.6), (100.0, 0.6)]), [1.0, 0.0, 0.6]);
        // Both targets probably exist.
        assert_eq!(existences_after([(0.0, 0.8), (1.0, 0.9), (100.0, 0.4)]), [0.8, 0.9, 0.4]);
        // The tracks can be distinguished.
        assert_eq!(existences_after([(0.0, 0.5), (30.0, 0.5), (60.0, 0.5)]), [0.5, 0.5, 0.5]);
    }
}
