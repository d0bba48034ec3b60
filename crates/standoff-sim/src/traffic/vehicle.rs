//! One vehicle of a traffic file: its samples and the interpolation between them.

use standoff::math;

/// Converts microseconds to seconds, for messages.
pub(super) fn seconds(time_us: i64) -> f64 {
    time_us as f64 / 1e6
}

/// Maximum distance that a parked vehicle seems to move while it is not sampled, m: the error of GPS.
const PARKED_M: f64 = 10.0;
/// Speed below which a vehicle that is not sampled is parked, m/s.
const PARKED_M_S: f64 = 0.5;
/// Half of the time over which a velocity is the mean, microseconds: SUMO changes lanes in one time step, and positions
/// are rounded. The speeds that SUMO writes are not used: they are means over the step before, half a step ahead of the
/// positions.
const HALF_WINDOW_US: i64 = 500_000;

/// One vehicle at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    pub(super) time_us: i64,
    pub(super) x: f64,
    pub(super) y: f64,
}

impl Sample {
    /// Distance to another sample, m.
    pub(super) fn distance_m(&self, other: &Self) -> f64 {
        math::hypot(other.x - self.x, other.y - self.y)
    }
}

/// Gaps between the samples of a vehicle, in which it is absent.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Gaps {
    /// Longest time between two samples without a gap, microseconds.
    pub(super) limit_us: i64,
    /// Times of the samples that begin a new segment of the track, in order, microseconds.
    pub(super) breaks_us: Vec<i64>,
}

impl Gaps {
    /// Returns whether the vehicle is absent between two consecutive samples, in metres. A vehicle that is afterwards
    /// where it was before has been parked, as loggers sleep then.
    pub(super) fn separate(&self, before: &Sample, after: &Sample) -> bool {
        let step_us = after.time_us - before.time_us;
        if step_us <= self.limit_us && !self.break_at(after) {
            return false;
        }
        let way_m = before.distance_m(after);
        way_m > PARKED_M || way_m > PARKED_M_S * seconds(step_us)
    }

    /// Returns whether a sample begins a new segment of the track.
    pub(super) fn break_at(&self, sample: &Sample) -> bool {
        self.breaks_us.binary_search(&sample.time_us).is_ok()
    }
}

/// State of a vehicle at some time, in the local frame: x east, y north.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleState {
    /// East, m.
    pub x_m: f64,
    /// North, m.
    pub y_m: f64,
    /// Velocity east, m/s.
    pub vx_m_s: f64,
    /// Velocity north, m/s.
    pub vy_m_s: f64,
}

/// One vehicle of a traffic file.
#[derive(Debug, Clone, PartialEq)]
pub struct Vehicle {
    name: String,
    /// Priority in the file, if it has one.
    pub priority: Option<f64>,
    /// Samples by strictly increasing time; never empty.
    samples: Vec<Sample>,
    gaps: Gaps,
}

impl Vehicle {
    /// Creates a vehicle from samples in metres by strictly increasing time.
    pub(super) fn new(name: String, priority: Option<f64>, mut samples: Vec<Sample>, gaps: Gaps) -> Self {
        samples.shrink_to_fit();
        Self { name, priority, samples, gaps }
    }

    /// Adds the vehicle to a checksum.
    pub(super) fn check_in(&self, crc: &mut crc32fast::Hasher) {
        for length in [self.name.len(), self.samples.len()] {
            crc.update(&(length as u64).to_le_bytes());
        }
        crc.update(self.name.as_bytes());
        self.priority.iter().for_each(|priority| crc.update(&priority.to_le_bytes()));
        crc.update(&self.gaps.limit_us.to_le_bytes());
        self.gaps.breaks_us.iter().for_each(|time_us| crc.update(&time_us.to_le_bytes()));
        for Sample { time_us, x, y } in &self.samples {
            crc.update(&time_us.to_le_bytes());
            [x, y].into_iter().for_each(|value| crc.update(&value.to_le_bytes()));
        }
    }

    /// Changes the name.
    pub(super) fn rename(&mut self, name: String) {
        self.name = name;
    }

    /// Number of samples.
    pub(super) fn samples(&self) -> usize {
        self.samples.len()
    }

    /// Name as in the file; it may contain any character.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Time of the first sample, microseconds.
    pub fn first_us(&self) -> i64 {
        self.samples.first().map_or(0, |sample| sample.time_us)
    }

    /// Time of the last sample, microseconds.
    pub fn last_us(&self) -> i64 {
        self.samples.last().map_or(0, |sample| sample.time_us)
    }

    /// Times of the samples, microseconds.
    pub(super) fn times_us(&self) -> impl Iterator<Item = i64> {
        self.samples.iter().map(|sample| sample.time_us)
    }

    /// Positions of the samples, east and north, m.
    pub fn places(&self) -> impl Iterator<Item = [f64; 2]> {
        self.samples.iter().map(|sample| [sample.x, sample.y])
    }

    /// Returns the state at `time_us` (microseconds, on the clock of the file): the position is interpolated linearly, and
    /// the velocity is the mean from half a second before to half a second after. `None` before the first sample, after
    /// the last, and in gaps.
    pub fn at(&self, time_us: i64) -> Option<VehicleState> {
        let window_us = [time_us.saturating_sub(HALF_WINDOW_US), time_us.saturating_add(HALF_WINDOW_US)];
        let near = self.samples_near(time_us, window_us)?;
        let begin_us = window_us[0].max(near.first()?.time_us);
        let end_us = window_us[1].min(near.last()?.time_us);
        let (here, begin, end) = (sample_at(near, time_us)?, sample_at(near, begin_us)?, sample_at(near, end_us)?);
        let mean = |way_m: f64| if end_us > begin_us { way_m / seconds(end_us - begin_us) } else { 0.0 };
        Some(VehicleState { x_m: here.x, y_m: here.y, vx_m_s: mean(end.x - begin.x), vy_m_s: mean(end.y - begin.y) })
    }

    /// Returns the samples between which the vehicle is present without a gap from `begin_us`, or later, over `time_us` to
    /// `end_us`, or earlier. `None` if it is absent at `time_us`.
    fn samples_near(&self, time_us: i64, [begin_us, end_us]: [i64; 2]) -> Option<&[Sample]> {
        let joined = |index: usize| {
            let pair = index.checked_sub(1).and_then(|before| self.samples.get(before)).zip(self.samples.get(index));
            pair.is_some_and(|(before, after)| !self.gaps.separate(before, after))
        };
        let mut last = self.samples.partition_point(|sample| sample.time_us < time_us);
        let mut first = last;
        if self.samples.get(last)?.time_us > time_us {
            first = joined(last).then(|| last - 1)?;
        }
        while self.samples.get(first)?.time_us > begin_us && joined(first) {
            first -= 1;
        }
        while self.samples.get(last)?.time_us < end_us && joined(last + 1) {
            last += 1;
        }
        self.samples.get(first..=last)
    }
}

/// Interpolates linearly between samples; `None` before the first and after the last.
fn sample_at(samples: &[Sample], time_us: i64) -> Option<Sample> {
    let index = samples.partition_point(|sample| sample.time_us < time_us);
    let after = samples.get(index)?;
    if after.time_us == time_us {
        return Some(*after);
    }
    let before = samples.get(index.checked_sub(1)?)?;
    let part = (time_us - before.time_us) as f64 / (after.time_us - before.time_us) as f64;
    let mix = |from: f64, to: f64| from + (to - from) * part;
    Some(Sample { time_us, x: mix(before.x, after.x), y: mix(before.y, after.y) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vehicle(samples: &[(i64, f64, f64)], gap_us: i64) -> Vehicle {
        let samples = samples.iter().map(|&(time_us, x, y)| Sample { time_us, x, y });
        Vehicle::new("v".to_string(), None, samples.collect(), Gaps { limit_us: gap_us, ..Gaps::default() })
    }

    fn state(x_m: f64, y_m: f64, vx_m_s: f64, vy_m_s: f64) -> Option<VehicleState> {
        Some(VehicleState { x_m, y_m, vx_m_s, vy_m_s })
    }

    #[test]
    fn the_state_is_interpolated_between_samples_and_exact_at_them() {
        let vehicle = vehicle(&[(0, 0.0, 8.0), (1_000_000, 2.0, 8.0), (2_000_000, 8.0, 4.0)], 1_000_000);
        assert_eq!(vehicle.at(0), state(0.0, 8.0, 2.0, 0.0));
        assert_eq!(vehicle.at(1_000_000), state(2.0, 8.0, 4.0, -2.0));
        assert_eq!(vehicle.at(1_500_000), state(5.0, 6.0, 6.0, -4.0));
        assert_eq!(vehicle.at(2_000_000), state(8.0, 4.0, 6.0, -4.0));
        assert_eq!((vehicle.first_us(), vehicle.last_us()), (0, 2_000_000));
    }

    #[test]
    fn a_vehicle_is_absent_before_its_first_and_after_its_last_sample() {
        let vehicle = vehicle(&[(10, 0.0, 0.0), (20, 1.0, 0.0)], 100);
        assert_eq!([i64::MIN, 9, 21, i64::MAX].map(|time_us| vehicle.at(time_us)), [None; 4]);
    }

    #[test]
    fn a_vehicle_is_absent_strictly_inside_a_gap() {
        let vehicle = vehicle(&[(0, 0.0, 0.0), (100, 1.0, 0.0), (201, 2.0, 0.0)], 100);
        assert!(vehicle.at(50).is_some() && vehicle.at(100).is_some() && vehicle.at(201).is_some());
        assert_eq!([vehicle.at(101), vehicle.at(200)], [None; 2]);
    }

    #[test]
    fn a_vehicle_that_is_where_it_was_before_a_gap_has_been_parked() {
        const S: i64 = 1_000_000;
        let exists = |samples: &[(i64, f64, f64)]| vehicle(samples, S).at(5 * S).is_some();
        assert!(exists(&[(0, 0.0, 0.0), (60 * S, 0.0, 0.0)]));
        assert!(exists(&[(0, 0.0, 0.0), (60 * S, 6.0, -8.0)]), "10 m, as GPS is not exact");
        assert!(!exists(&[(0, 0.0, 0.0), (60 * S, 6.0, -8.1)]));
        assert!(!exists(&[(0, 0.0, 0.0), (6 * S, 3.1, 0.0)]), "it moves");
    }

    #[test]
    fn a_vehicle_is_absent_before_a_new_segment_unless_it_is_parked() {
        let sample = |time_us, x| Sample { time_us, x, y: 0.0 };
        let gaps = Gaps { limit_us: 10_000_000, breaks_us: vec![2_000_000, 4_000_000] };
        let samples = vec![sample(0, 0.0), sample(2_000_000, 20.0), sample(4_000_000, 20.5)];
        let vehicle = Vehicle::new("v".to_string(), None, samples, gaps);
        assert_eq!([1_000_000, 3_000_000].map(|time_us| vehicle.at(time_us).is_some()), [false, true]);
        assert_eq!(vehicle.at(0).unwrap().vx_m_s, 0.0, "no slope reaches into the next segment");
    }

    #[test]
    fn slopes_do_not_reach_across_a_gap() {
        let samples = [(0, 0.0, 0.0), (1_000_000, 1.0, 0.0), (9_000_000, 100.0, 0.0), (10_000_000, 103.0, 0.0)];
        let vehicle = vehicle(&samples, 1_000_000);
        let states = [(0.0, 1.0), (1.0, 1.0), (100.0, 3.0), (103.0, 3.0)].map(|(x, vx)| state(x, 0.0, vx, 0.0));
        assert_eq!(samples.map(|(time_us, ..)| vehicle.at(time_us)), states);
    }

    #[test]
    fn a_vehicle_with_one_sample_is_stationary() {
        assert_eq!(vehicle(&[(5, 1.0, 2.0)], 1).at(5), state(1.0, 2.0, 0.0, 0.0));
    }

    #[test]
    fn a_leap_between_close_samples_is_spread_over_the_time_of_the_mean() {
        let samples: Vec<_> = (0..=40).map(|n| (n * 100_000, n as f64, if n < 20 { 0.0 } else { 3.2 })).collect();
        let vehicle = vehicle(&samples, 1_000_000);
        for (time_us, vy_m_s) in
            [(1_400_000, 0.0), (1_500_000, 3.2), (2_000_000, 3.2), (2_400_000, 3.2), (2_500_000, 0.0)]
        {
            let state = vehicle.at(time_us).unwrap();
            assert!((state.vx_m_s - 10.0).abs() < 1e-9 && (state.vy_m_s - vy_m_s).abs() < 1e-9, "{state:?}");
        }
    }
}
