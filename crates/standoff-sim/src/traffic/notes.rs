//! Notes about implausible traffic: it is flown as it is in the file, but a sensor or a column may be wrong.

use std::collections::BTreeMap;

use standoff_io::display_text::{count, quoted};

use super::times::TimeForm;
use super::vehicle::{Gaps, Sample, seconds};

/// Speed above which a position is probably wrong, m/s: no car is faster.
const FAST_M_S: f64 = 100.0;
/// Distance below which a fast step is no wrong position, m.
const JUMP_M: f64 = 10.0;
/// Speed below which nothing moves although it should, m/s.
const SLOW_M_S: f64 = 0.1;
/// Distance that shows that a vehicle moves, m.
const MOVED_M: f64 = 20.0;
/// Minimum distance from the first sample to the last that shows a drive, as read from kilometres, m.
const STEADY_M: f64 = 0.05;
/// Minimum share of this distance in the path of a drive; the noise of a parked vehicle has less.
const STEADY: f64 = 0.8;
/// Minimum number of samples of such a drive.
const STEADY_SAMPLES: usize = 5;
/// Share of its time that a vehicle may be absent without a note.
const ABSENT: f64 = 0.1;
/// Maximum number of vehicles that are named in a note.
const NAMED: usize = 3;

/// A vehicle of a file, in metres: its name and samples, and the gaps between them.
type Found<'a> = ((&'a String, &'a Vec<Sample>), &'a Gaps);

/// Returns the notes about the motion of the vehicles. `thousands` is a position that may have a separator of thousands,
/// and whether others are whole numbers.
pub(super) fn of<'a>(
    vehicles: impl Iterator<Item = Found<'a>> + Clone,
    thousands: Option<&(String, bool)>,
    times: TimeForm,
) -> Vec<String> {
    let motion = Motion::of(vehicles.clone(), times);
    let absences = [absences(vehicles.clone(), false), absences(vehicles, true)];
    [motion.jumps()].into_iter().chain(absences).chain([motion.slowness(thousands)]).flatten().collect()
}

/// Returns the note about pairs of names that may be spellings of one.
pub(super) fn of_alike(alike: &[[String; 2]]) -> Option<String> {
    let pairs: Vec<_> = alike.iter().map(|[one, other]| format!("{} and {}", quoted(one), quoted(other))).collect();
    (!pairs.is_empty()).then(|| {
        format!(
            "names that may be of one vehicle, but are read as two: {}; write them alike if they are of one",
            some(&pairs)
        )
    })
}

/// Returns the note about skipped samples, by vehicle.
pub(super) fn of_skipped(skipped: &BTreeMap<String, usize>, why: &str) -> Option<String> {
    let rows: usize = skipped.values().sum();
    let named: Vec<_> = skipped.iter().map(|(name, rows)| format!("{} ({rows})", quoted(name))).collect();
    (rows > 0).then(|| format!("skipped {} {why}: {}", count(rows, "sample"), some(&named)))
}

/// Motion of all vehicles of a file.
#[derive(Default)]
struct Motion {
    /// Vehicles that are too fast: whether they move far in such a step, and their highest speed and its time.
    jumps: Vec<(bool, String)>,
    steps: usize,
    fast_steps: usize,
    fastest_m_s: f64,
    /// Greatest distance of a vehicle from its first position.
    furthest_m: f64,
    /// True if a vehicle moves as on a drive, and not as by the noise of its position.
    is_steady: bool,
}

impl Motion {
    fn of<'a>(vehicles: impl Iterator<Item = Found<'a>>, times: TimeForm) -> Self {
        let mut all = Self::default();
        for ((name, samples), gaps) in vehicles {
            let mut jump: Option<(bool, f64, i64)> = None;
            let mut path_m = 0.0;
            for pair in samples.windows(2).filter(|pair| !gaps.separate(&pair[0], &pair[1])) {
                let step_m = pair[0].distance_m(&pair[1]);
                let speed_m_s = step_m / seconds(pair[1].time_us - pair[0].time_us);
                path_m += step_m;
                all.fastest_m_s = all.fastest_m_s.max(speed_m_s);
                all.furthest_m = all.furthest_m.max(samples[0].distance_m(&pair[1]));
                all.steps += 1;
                all.fast_steps += usize::from(speed_m_s > FAST_M_S);
                // SUMO changes lanes in one time step, however short.
                let is_far = step_m > JUMP_M;
                if speed_m_s > FAST_M_S
                    && jump.is_none_or(|(far, fastest_m_s, _)| (is_far, speed_m_s) > (far, fastest_m_s))
                {
                    jump = Some((is_far, speed_m_s, pair[1].time_us));
                }
            }
            if let Some((is_far, speed_m_s, time_us)) = jump {
                let time = times.shown(time_us);
                all.jumps.push((is_far, format!("{} with {speed_m_s:.0} m/s before time = {time}", quoted(name))));
            }
            let way_m = samples.first().zip(samples.last()).map_or(0.0, |(first, last)| first.distance_m(last));
            all.is_steady |= samples.len() >= STEADY_SAMPLES && way_m >= STEADY_M && way_m >= STEADY * path_m;
        }
        all
    }

    /// Returns a note about vehicles that are too fast.
    fn jumps(&self) -> Option<String> {
        let is_fast = 2 * self.fast_steps > self.steps;
        let is_noted = |&&(is_far, _): &&(bool, String)| is_far || is_fast;
        let jumps: Vec<_> = self.jumps.iter().filter(is_noted).map(|(_, jump)| jump.clone()).collect();
        let what = format!("{} above {FAST_M_S} m/s between two samples", count(jumps.len(), "vehicle"));
        let advice = match is_fast {
            true => "are the times in another unit? then correct the name or the values of their column",
            false => "is a position wrong? correct it or remove the sample",
        };
        (!jumps.is_empty()).then(|| format!("{what}: {}; {advice}", some(&jumps)))
    }

    /// Returns a note if all vehicles are too slow, or if positions may have separators of thousands.
    fn slowness(&self, thousands: Option<&(String, bool)>) -> Option<String> {
        let Self { fastest_m_s, furthest_m, .. } = *self;
        let is_slow = fastest_m_s > 0.0 && fastest_m_s < SLOW_M_S;
        let slowest = format!("no vehicle is faster than {fastest_m_s:.3} m/s, although one");
        match thousands {
            Some((example, has_whole_numbers)) if fastest_m_s < SLOW_M_S || *has_whole_numbers => Some(format!(
                "{example} is read as a decimal number, but may mean thousands, because every decimal sign has three \
                 digits after it; if so, write the positions without it"
            )),
            _ if is_slow && furthest_m > MOVED_M => Some(format!(
                "{slowest} moves {furthest_m:.0} m; are the times milliseconds? then call their column time_ms"
            )),
            _ if is_slow && self.is_steady => {
                Some(format!("{slowest} moves steadily; are the positions kilometres? then convert them to metres"))
            }
            _ => None,
        }
    }
}

/// Returns a note about the vehicles that are absent for a considerable share of their time: between segments of their
/// tracks, or otherwise between samples.
fn absences<'a>(vehicles: impl Iterator<Item = Found<'a>>, between_segments: bool) -> Option<String> {
    let mut absent = Vec::new();
    for ((name, samples), gaps) in vehicles {
        let step_us = |pair: &[Sample]| pair[1].time_us - pair[0].time_us;
        let is_gap =
            |pair: &&[Sample]| gaps.separate(&pair[0], &pair[1]) && gaps.break_at(&pair[1]) == between_segments;
        let steps_us: Vec<i64> = samples.windows(2).filter(is_gap).map(step_us).collect();
        let whole_us: i64 = samples.windows(2).map(step_us).sum();
        let share = steps_us.iter().sum::<i64>() as f64 / whole_us as f64;
        if share >= ABSENT {
            absent.push(format!("{} ({:.0} %, {})", quoted(name), 100.0 * share, count(steps_us.len(), "gap")));
        }
    }
    let [place, advice] = match between_segments {
        true => ["segments of their tracks", "join the segments if they were there"],
        false => ["samples", "a longer traffic.gap_s keeps them"],
    };
    (!absent.is_empty()).then(|| {
        let vehicles = count(absent.len(), "vehicle");
        format!("{vehicles} absent between {place} for at least a tenth of the time: {}; {advice}", some(&absent))
    })
}

/// Lists the first names, and the number of the others.
pub(super) fn some(names: &[String]) -> String {
    let shown = names[..names.len().min(NAMED)].join(", ");
    if names.len() > NAMED { format!("{shown} and {} more", names.len() - NAMED) } else { shown }
}
