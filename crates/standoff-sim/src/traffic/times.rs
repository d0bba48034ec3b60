//! How a file writes its times, and what is wrong if those of a vehicle repeat or go back.

use chrono::DateTime;
use standoff_io::display_text::{count, quoted};

use super::vehicle::{Sample, seconds};

const HOUR_US: i64 = 3_600_000_000;
pub(crate) const DAY_US: i64 = 24 * HOUR_US;
const WEEK_US: i64 = 7 * DAY_US;
/// Time after which the week number of GPS starts again.
const ROLLOVER_US: i64 = 1024 * WEEK_US;
/// First time that counts from 1970 rather than from the start of a recording, microseconds: March 1973.
const SINCE_1970_US: i64 = 100_000_000_000_000;
/// Minimum number of samples after which a vehicle that goes back before its first one has started again.
const RUN_MIN: usize = 10;
/// Distance of two samples that errors of a receiver explain, m.
const NOISE_M: f64 = 15.0;
/// Step of times, at most, that is fine enough to keep one sample of each: some file systems count 2 s.
const FINE_US: i64 = 2_000_000;
/// Step of numbers in single precision, in their unit, from which they cannot be times of a log.
const COARSE: f32 = 64.0;
/// Minimum number of different times that show that all are in single precision.
const TIMES_MIN: usize = 4;

/// How a file writes its times.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum TimeForm {
    #[default]
    Seconds,
    Milliseconds,
    /// Dates with an offset from UTC, or in UTC.
    DateTime,
    /// Dates without an offset.
    LocalDateTime,
}

/// What the times of a file count from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Epoch {
    /// A start of its own.
    File,
    /// The start of 1970 in UTC.
    Utc,
    /// The start of 1970 in an unknown time zone.
    Local,
}

impl Epoch {
    /// Describes the times, for messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::File => "times from a start of its own",
            Self::Utc => "times in UTC (dates with an offset, or seconds since 1970)",
            Self::Local => "dates without an offset from UTC",
        }
    }
}

impl TimeForm {
    /// Describes a time, for messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Seconds | Self::Milliseconds => "number",
            Self::DateTime => "date-time with an offset",
            Self::LocalDateTime => "date-time without an offset",
        }
    }

    /// Returns what the times of a file count from; the first of them is `begin_us`.
    pub(super) fn epoch(self, begin_us: i64) -> Epoch {
        match self {
            Self::DateTime => Epoch::Utc,
            Self::LocalDateTime => Epoch::Local,
            Self::Seconds | Self::Milliseconds if begin_us >= SINCE_1970_US => Epoch::Utc,
            Self::Seconds | Self::Milliseconds => Epoch::File,
        }
    }

    /// Formats a time as in the file, with its unit; dates in UTC.
    pub(crate) fn shown(self, time_us: i64) -> String {
        let date = |zone: &str| {
            let time = DateTime::from_timestamp_micros(time_us).unwrap_or_default();
            format!("{}{zone}", time.format("%Y-%m-%dT%H:%M:%S%.f"))
        };
        match self {
            Self::Seconds => format!("{} s", seconds(time_us)),
            Self::Milliseconds => format!("{} ms", time_us as f64 / 1e3),
            Self::DateTime => date("Z"),
            Self::LocalDateTime => date(""),
        }
    }

    /// Describes a time that is before the last one of its vehicle, with the probable cause.
    pub(super) fn back(self, name: &str, samples: &[Sample], time_us: i64) -> String {
        let first_us = samples.first().map_or(time_us, |sample| sample.time_us);
        let last_us = samples.last().map_or(time_us, |sample| sample.time_us);
        let back_us = last_us - time_us;
        let starts_again_after = |period_us: i64| {
            let is_number = matches!(self, Self::Seconds | Self::Milliseconds);
            let near_end = last_us <= period_us && last_us > period_us / 10 * 9;
            is_number && near_end && (0..period_us / 10).contains(&time_us)
        };
        let advice = if is_rollover(back_us) {
            "the week number of GPS starts again after 1024 weeks: add 7168 days to these times".to_owned()
        } else if starts_again_after(DAY_US) || starts_again_after(WEEK_US) {
            let period = if starts_again_after(DAY_US) { "day" } else { "week" };
            let period_s = if period == "day" { DAY_US } else { WEEK_US } / 1_000_000;
            format!("the seconds of a {period} start again: add {period_s} s to these times")
        } else if self == Self::LocalDateTime && (HOUR_US / 2..=HOUR_US).contains(&back_us) {
            "if the local clock was put back, write the times in UTC".to_owned()
        } else if samples.len() >= RUN_MIN && time_us <= first_us {
            "the vehicle starts again: if two vehicles have one name, give each its own; if a clock was reset, correct \
             the times after it"
                .to_owned()
        } else {
            "sort them; if two vehicles have one name, give each its own; if a clock was put back, correct the times \
             after it"
                .to_owned()
        };
        let [time, last] = [time_us, last_us].map(|time_us| self.shown(time_us));
        format!(
            "vehicle {}: time = {time} comes after {last}; the times of a vehicle must increase; {advice}",
            quoted(name)
        )
    }

    /// Removes samples, in metres, at the time of an earlier one, and returns their number. A logger that cuts times to
    /// seconds writes them. The first sample is kept, because its time was cut least. Fails if the samples are those of
    /// two vehicles, or if their times are so coarse that little would remain.
    pub(super) fn remove_repeats(self, name: &str, samples: &mut Vec<Sample>) -> Result<usize, String> {
        let repeats = Repeats::of(samples);
        if let Some(step) = self.single_precision_step(samples, &repeats) {
            let what = format!("vehicle {}: {} at {}", quoted(name), count(samples.len(), "sample"), repeats.times());
            return Err(format!(
                "{what}: the times were stored in single precision, in which they differ by {step} at least; write them \
                 again in double precision, with all digits"
            ));
        }
        if repeats.moved > 0 {
            repeats.check(self, name, samples.len())?;
        }
        samples.dedup_by_key(|sample| sample.time_us);
        Ok(repeats.removed)
    }

    /// Returns the step of times that are all numbers of single precision, with all digits or as few as identify them, if
    /// it is so large as that of times since 1970.
    fn single_precision_step(self, samples: &[Sample], repeats: &Repeats) -> Option<String> {
        let (unit_us, unit) = match self {
            Self::Seconds => (1e6, "s"),
            Self::Milliseconds => (1e3, "ms"),
            Self::DateTime | Self::LocalDateTime => return None,
        };
        let step = |sample: &Sample| {
            let number = sample.time_us as f64 / unit_us;
            let single = number as f32;
            let step = single.next_up() - single;
            let is_single = f64::from(single) == number || single.to_string().parse() == Ok(number);
            (step >= COARSE && is_single).then_some(step)
        };
        let is_evident = repeats.moved > 0 || repeats.kept >= TIMES_MIN;
        let steps: Option<Vec<f32>> = samples.iter().filter(|_| is_evident).map(step).collect();
        steps?.first().map(|step| format!("{step} {unit}"))
    }
}

/// Returns whether a clock that is late by this time has lost 1024 weeks.
pub(crate) fn is_rollover(late_us: i64) -> bool {
    (late_us - ROLLOVER_US).abs() <= DAY_US
}

/// Samples of a vehicle at the time of an earlier one.
struct Repeats {
    /// Number of different times.
    kept: usize,
    /// Number of samples at the time of an earlier one.
    removed: usize,
    /// Number of those with another position.
    moved: usize,
    /// Number of those that are further from the earlier one than the vehicle moves until the next time.
    apart: usize,
    /// Time of the first of these, or of the first moved one, and its distance from the earlier one, m.
    first_us: i64,
    distance_m: f64,
    /// Median of the steps between different times.
    step_us: Option<i64>,
}

impl Repeats {
    fn of(samples: &[Sample]) -> Self {
        let groups: Vec<&[Sample]> = samples.chunk_by(|one, other| one.time_us == other.time_us).collect();
        let (kept, removed) = (groups.len(), samples.len() - groups.len());
        let mut all = Self { kept, removed, moved: 0, apart: 0, first_us: 0, distance_m: 0.0, step_us: None };
        if removed == 0 && kept < TIMES_MIN {
            return all;
        }
        for (place, group) in groups.iter().enumerate() {
            let Some((first, others)) = group.split_first() else { continue };
            let next =
                groups.get(place + 1).or_else(|| groups.get(place.checked_sub(1)?)).and_then(|next| next.first());
            let reach_m = next.map_or(f64::INFINITY, |next| first.distance_m(next)) + NOISE_M;
            for distance_m in others.iter().map(|other| first.distance_m(other)).filter(|distance_m| *distance_m > 0.0)
            {
                let is_apart = distance_m > reach_m;
                if all.moved == 0 || is_apart && all.apart == 0 {
                    (all.first_us, all.distance_m) = (first.time_us, distance_m);
                }
                all.moved += 1;
                all.apart += usize::from(is_apart);
            }
        }
        let mut steps: Vec<i64> = groups.windows(2).map(|pair| pair[1][0].time_us - pair[0][0].time_us).collect();
        let middle = steps.len() / 2;
        all.step_us = (!steps.is_empty()).then(|| *steps.select_nth_unstable(middle).1);
        all
    }

    fn times(&self) -> String {
        if self.kept == 1 { "one time".to_owned() } else { format!("{} different times", self.kept) }
    }

    fn check(&self, form: TimeForm, name: &str, samples: usize) -> Result<(), String> {
        let name = quoted(name);
        let time = form.shown(self.first_us);
        if 2 * self.apart > self.moved {
            let more = match self.moved - 1 {
                0 => String::new(),
                more => format!(", with {}", count(more, "more such pair")),
            };
            return Err(format!(
                "vehicle {name}: two samples at time = {time} are {:.0} m apart{more}; if two vehicles have one name, give \
                 each its own; otherwise remove the wrong samples",
                self.distance_m
            ));
        }
        if self.moved >= self.kept && self.step_us.is_none_or(|step_us| step_us > FINE_US) {
            return Err(format!(
                "vehicle {name}: {} at {}, the first at time = {time}; a vehicle has one position at a time; the times are \
                 rounded: write more digits",
                count(samples, "sample"),
                self.times()
            ));
        }
        Ok(())
    }
}
