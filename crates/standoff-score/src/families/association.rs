//! Scores of detection and association: GOSPA, swapped and false tracks, and the fraction of detected targets.

use standoff::Position;
use standoff_record::{Frame, TrackStatus};

use crate::by_id::ById;
use crate::config::ScoreConfig;
use crate::matching::{Assigner, estimate, position};
use crate::mean::Mean;
use crate::metric::{Family, LARGE, Metric, MetricSet, NOTHING, SMALL, TRACKS, count, metric};
use crate::step::{Inputs, Step};

/// Fraction of its time steps in which a track must have a target, otherwise it is false.
const TRUE_FRACTION: f64 = 0.1;

/// Scores so far.
#[derive(Debug, Default)]
pub(crate) struct Association {
    /// Squared GOSPA, and its part due to the distances of assigned targets and tracks, m2.
    squared_m2: Mean,
    localisation_m2: Mean,
    /// Numbers of targets and tracks that are not assigned.
    missed: Mean,
    false_tracks_in_view: Mean,
    /// Target-scans in the field of view, behind buildings or not, that were detected.
    detected: Mean,
    /// Number of times that a track has changed its target since its first measurement.
    swaps: u64,
    /// Tracks so far, by number.
    tracks: ById<TrackLife>,
    /// Time steps of each target with each of its tracks.
    of_targets: ById<ById<u64>>,
    in_view: InView,
    /// True if a sensor has been pointed.
    has_looked: bool,
}

/// What is in view at a time step; reused buffers.
#[derive(Debug, Clone, Default)]
struct InView {
    /// UAV and target of each detection.
    detected: Vec<(u32, u32)>,
    targets: Vec<Position>,
    tracks: Vec<Position>,
    assigner: Assigner,
}

/// Life of a track so far.
#[derive(Debug, Clone, Copy, Default)]
struct TrackLife {
    steps: u64,
    /// Time steps with a target.
    matched: u64,
    /// Last target since the first measurement.
    last_target: Option<u32>,
}

impl Family for Association {
    const SECTION: &'static str = "Association";
    const SET: MetricSet = MetricSet::Association;
    const METRICS: &'static [Metric<Self>] = &[
        metric("gospa_m", "GOSPA", LARGE, 0.5, TRACKS, |of, _| of.squared_m2.value().map(f64::sqrt)),
        metric("gospa_localisation_m", "GOSPA, position errors", LARGE, 0.5, TRACKS, |of, _| {
            of.localisation_m2.value().map(f64::sqrt)
        }),
        metric("gospa_missed", "targets in view without track", LARGE, 0.05, TRACKS, |of, _| of.missed.value()),
        metric("gospa_false", "tracks in view without target", LARGE, 0.05, TRACKS, |of, _| {
            of.false_tracks_in_view.value()
        }),
        count(metric("track_swaps", "tracks that changed their target", LARGE, 0.1, TRACKS, |of, _| {
            Some(of.swaps as f64)
        })),
        count(metric("false_tracks", "false tracks", LARGE, 0.1, TRACKS, |of, _| Some(of.false_tracks() as f64))),
        metric("track_purity", "track purity", SMALL, 0.01, TRACKS, |of, _| of.purity()),
        metric("detected_fraction", "targets in view detected", SMALL, 0.01, NOTHING, |of, _| of.detected.value()),
    ];

    fn inputs(_: &[&str]) -> Inputs {
        Inputs { covered: true, ..Inputs::default() }
    }

    fn add(&mut self, step: &Step<'_>) {
        if !step.coverage.is_blind() {
            self.has_looked = true;
            self.add_view(step);
        } else if self.has_looked {
            self.add_nothing_in_view(step.config, step.frame);
        }
        for pair in step.matching.pairs() {
            let (target, track) = (pair.target.target, pair.track.track);
            let life = self.tracks.entry(track, TrackLife::default);
            (life.steps, life.matched) = (life.steps + 1, life.matched + 1);
            // The target of a cue is not known before the first measurement.
            if pair.track.status != TrackStatus::Cued {
                self.swaps += u64::from(life.last_target.is_some_and(|last| last != target));
                life.last_target = Some(target);
            }
            *self.of_targets.entry(target, ById::default).entry(track, || 0) += 1;
        }
        for track in step.matching.unmatched_tracks() {
            self.tracks.entry(track.track, TrackLife::default).steps += 1;
        }
    }
}

impl Association {
    /// Adds the targets and tracks in view at a time step.
    fn add_view(&mut self, Step { config, frame, coverage, .. }: &Step<'_>) {
        let InView { detected, targets, tracks, assigner } = &mut self.in_view;
        detected.clear();
        detected.extend(frame.detections.iter().filter_map(|row| Some((row.uav, row.target?))));
        detected.sort_unstable();
        targets.clear();
        for truth in &frame.truth {
            let before = self.detected.n;
            // Targets behind buildings count, too.
            for pointed in coverage.of(truth.target) {
                let is_detected = detected.binary_search(&(pointed.uav, truth.target)).is_ok();
                self.detected.add(f64::from(is_detected));
            }
            targets.extend((self.detected.n > before).then_some(position(truth)));
        }
        tracks.clear();
        tracks.extend(frame.tracks.iter().map(estimate).filter(|at| coverage.includes(&config.sensor, *at)));
        let gospa = Gospa::of(targets, tracks, config.gospa_cutoff_m, assigner);
        self.add_gospa(gospa);
    }

    /// Adds a time step at which no sensor is pointed any more: all existing targets are missed.
    fn add_nothing_in_view(&mut self, config: &ScoreConfig, frame: &Frame) {
        frame.truth.iter().for_each(|_| self.detected.add(0.0));
        self.add_gospa(Gospa {
            cutoff_m: config.gospa_cutoff_m,
            localisation_m2: 0.0,
            missed: frame.truth.len(),
            false_tracks: 0,
        });
    }

    fn add_gospa(&mut self, gospa: Gospa) {
        self.squared_m2.add(gospa.squared_m2());
        self.localisation_m2.add(gospa.localisation_m2);
        self.missed.add(gospa.missed as f64);
        self.false_tracks_in_view.add(gospa.false_tracks as f64);
    }

    /// Number of tracks so far that have had no target for more than 90 % of their time steps.
    fn false_tracks(&self) -> u64 {
        let is_false = |life: &&TrackLife| (life.matched as f64) < TRUE_FRACTION * life.steps as f64;
        self.tracks.values().filter(is_false).count() as u64
    }

    /// Fraction of the time steps of targets with a track in which it is the one that the target has had longest.
    fn purity(&self) -> Option<f64> {
        let mut purity = Mean::default();
        for tracks in self.of_targets.values() {
            let main = tracks.values().copied().max().unwrap_or(0);
            purity = purity.and(Mean { sum: main as f64, n: tracks.values().sum() });
        }
        purity.value()
    }
}

/// Returns the means of this many missed targets per time step while no agent runs, by metric.
pub(crate) fn without_tracks(missed: f64, cutoff_m: f64) -> [(&'static str, f64); 4] {
    let gospa_m = cutoff_m * (0.5 * missed).sqrt();
    [("gospa_m", gospa_m), ("gospa_localisation_m", 0.0), ("gospa_missed", missed), ("gospa_false", 0.0)]
}

/// GOSPA of order 2 with alpha = 2: the smallest root of the squared distances of pairs, plus half the cut-off squared
/// for each target and track without partner.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Gospa {
    cutoff_m: f64,
    localisation_m2: f64,
    missed: usize,
    false_tracks: usize,
}

impl Gospa {
    fn of(targets: &[Position], tracks: &[Position], cutoff_m: f64, assigner: &mut Assigner) -> Self {
        let pairs = assigner.assign(targets, tracks, cutoff_m);
        let squared_m2 = |(target, track): &(usize, usize)| targets[*target].squared_distance_m2(tracks[*track]);
        Self {
            cutoff_m,
            localisation_m2: pairs.iter().map(squared_m2).sum(),
            missed: targets.len() - pairs.len(),
            false_tracks: tracks.len() - pairs.len(),
        }
    }

    fn squared_m2(&self) -> f64 {
        let unassigned = (self.missed + self.false_tracks) as f64;
        self.localisation_m2 + 0.5 * self.cutoff_m * self.cutoff_m * unassigned
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{score, score_config};
    use crate::row_fixtures::{track_row, truth_row, uav_row};
    use standoff_record::{DetectionRow, NO_TARGET, TrackRow, UavRow};
    use standoff_sim::random::{Draws, Stream};

    /// Smallest squared GOSPA over all assignments of the targets from `first` on to tracks that are free.
    fn enumerated_m2(targets: &[Position], tracks: &[Position], used: &mut Vec<bool>, cutoff_m: f64) -> f64 {
        let half_m2 = 0.5 * cutoff_m * cutoff_m;
        let Some((first, rest)) = targets.split_first() else {
            return half_m2 * used.iter().filter(|used| !**used).count() as f64;
        };
        let mut best_m2 = half_m2 + enumerated_m2(rest, tracks, used, cutoff_m);
        for index in 0..tracks.len() {
            if !used[index] {
                used[index] = true;
                let squared_m2 = first.squared_distance_m2(tracks[index]);
                best_m2 = best_m2.min(squared_m2 + enumerated_m2(rest, tracks, used, cutoff_m));
                used[index] = false;
            }
        }
        best_m2
    }

    #[test]
    fn gospa_equals_the_minimum_over_all_assignments() {
        let mut draw = Draws::new(1).at(Stream::Measurement, 0, 0);
        let mut assigner = Assigner::default();
        for _ in 0..500 {
            let [targets, tracks] = [6.0, 7.0].map(|most| {
                let n = (draw.uniform() * most) as usize;
                (0..n).map(|_| Position::from_m(60.0 * draw.uniform(), 30.0 * draw.uniform())).collect::<Vec<_>>()
            });
            let cutoff_m = 5.0 + 40.0 * draw.uniform();
            let gospa = Gospa::of(&targets, &tracks, cutoff_m, &mut assigner);
            let expected_m2 = enumerated_m2(&targets, &tracks, &mut vec![false; tracks.len()], cutoff_m);
            assert!((gospa.squared_m2() - expected_m2).abs() < 1e-9 * expected_m2.max(1.0), "{targets:?} {tracks:?}");
            assert_eq!(targets.len() - gospa.missed, tracks.len() - gospa.false_tracks);
        }
    }

    /// Targets 0 and 1 in view at 400 m and 450 m, target 2 behind the UAV. A track 3 m off target 0, a false one in
    /// view, and one behind the UAV.
    fn frame(step: i64) -> Frame {
        let track = |target, track, x_m, y_m| TrackRow {
            track,
            state: [x_m, 0.0, 0.0, y_m, 0.0, 0.0],
            ..track_row(target, None)
        };
        Frame {
            time_us: step * 500_000,
            uavs: vec![UavRow { x_m: 0.0, y_m: 0.0, boresight_rad: Some(0.0), ..uav_row(0) }],
            truth: vec![truth_row(0, 400.0, 0.0), truth_row(1, 450.0, 0.0), truth_row(2, -400.0, 0.0)],
            tracks: vec![
                track(0, NO_TARGET, 400.0, 3.0),
                track(2, NO_TARGET + 1, -400.0, 0.0),
                track(NO_TARGET + 2, NO_TARGET + 2, 300.0, 0.0),
            ],
            detections: vec![
                DetectionRow { target: Some(1), ..DetectionRow::default() },
                DetectionRow { target: None, ..DetectionRow::default() },
            ],
            ..Frame::default()
        }
    }

    #[test]
    fn only_targets_and_tracks_in_view_count_for_gospa() {
        let metrics = score(&score_config(), &[frame(0), frame(1)]);
        assert_eq!((metrics["gospa_missed"], metrics["gospa_false"]), (Some(1.0), Some(1.0)));
        assert_eq!(metrics["gospa_localisation_m"], Some(3.0));
        assert_eq!(metrics["gospa_m"], Some(409f64.sqrt()));
        assert_eq!(metrics["detected_fraction"], Some(0.5));
        let narrow = ScoreConfig { gospa_cutoff_m: 2.0, ..score_config() };
        assert_eq!(score(&narrow, &[frame(0)])["gospa_m"], Some(8f64.sqrt()), "two targets missed, two false tracks");
        // Before a sensor has been pointed nothing is in view. Later, all targets are then missed.
        let mut blind = frame(1);
        blind.uavs[0].boresight_rad = None;
        let metrics = score(&score_config(), [&blind]);
        assert_eq!((metrics["gospa_m"], metrics["detected_fraction"]), (None, None));
        let metrics = score(&score_config(), [&frame(0), &blind]);
        assert_eq!((metrics["gospa_missed"], metrics["detected_fraction"]), (Some(2.0), Some(0.2)));
    }

    /// Track 0 has target 0 for six time steps, then target 1 for two, and in between none. Target 1 has another track
    /// for six time steps.
    #[test]
    fn swaps_false_tracks_and_purity_follow_the_targets_of_tracks() {
        let targets = [0, 0, 0, 0, 0, 0, NO_TARGET, 1, 1];
        let frames: Vec<Frame> = (0..)
            .zip(targets)
            .map(|(step, target)| {
                let mut frame = frame(step);
                let other = TrackRow { target: 1, track: NO_TARGET + 3, ..frame.tracks[0] };
                frame.tracks[0].target = target;
                if target == 0 {
                    frame.tracks.push(other);
                }
                frame.tracks.sort_by_key(|track| track.target);
                frame
            })
            .collect();
        let metrics = score(&score_config(), &frames);
        assert_eq!((metrics["track_swaps"], metrics["false_tracks"]), (Some(1.0), Some(1.0)));
        let cued = |mut frame: Frame| {
            frame.tracks.iter_mut().for_each(|track| track.status = TrackStatus::Cued);
            frame
        };
        let metrics_if_cued = score(&score_config(), &frames.iter().cloned().map(cued).collect::<Vec<_>>());
        assert_eq!(metrics_if_cued["track_swaps"], Some(0.0), "cues have no known target");
        // Targets 0 and 2 have one track each for 6 and 9 time steps, target 1 two tracks for 6 and 2.
        assert_eq!(metrics["track_purity"], Some(21.0 / 23.0));
    }
}
