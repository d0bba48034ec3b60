//! Notes about implausible traffic: it is flown as it is in the file, but a sensor or a column may be wrong.

use std::collections::BTreeMap;

use standoff::research::math;
use standoff_io::display_text::{count, quoted};

use super::validate::seconds;
use super::vehicle::Sample;

/// Speed above which a position is probably wrong, m/s: no car is faster.
const FAST_M_S: f64 = 100.0;
/// Speed below which nothing moves although it should, m/s.
const SLOW_M_S: f64 = 0.1;
/// Distance that shows that a vehicle moves, m.
const MOVED_M: f64 = 20.0;
/// Maximum number of vehicles that are named in a note.
const NAMED: usize = 3;

/// Returns the notes about the vehicles of a file, in metres, and their samples without a position. `gap_us` is the gap
/// limit of a vehicle.
pub(super) fn of(
    vehicles: &BTreeMap<String, Vec<Sample>>,
    without_position: &BTreeMap<String, usize>,
    gap_us: impl Fn(&Vec<Sample>) -> i64,
) -> Vec<String> {
    let (mut jumps, mut gaps) = (Vec::new(), Vec::new());
    let (mut steps, mut fast_steps) = (0, 0);
    let (mut fastest_m_s, mut furthest_m) = (0.0f64, 0.0f64);
    for (name, samples) in vehicles {
        let gap_us = gap_us(samples);
        let mut jump: Option<(f64, i64)> = None;
        let mut absent = 0;
        for pair in samples.windows(2) {
            let step_us = pair[1].time_us - pair[0].time_us;
            if step_us > gap_us {
                absent += 1;
                continue;
            }
            let speed_m_s = distance_m(&pair[0], &pair[1]) / seconds(step_us);
            fastest_m_s = fastest_m_s.max(speed_m_s);
            steps += 1;
            fast_steps += usize::from(speed_m_s > FAST_M_S);
            if speed_m_s > FAST_M_S && jump.is_none_or(|(fastest_m_s, _)| speed_m_s > fastest_m_s) {
                jump = Some((speed_m_s, pair[1].time_us));
            }
            furthest_m = furthest_m.max(distance_m(&samples[0], &pair[1]));
        }
        if let Some((speed_m_s, time_us)) = jump {
            jumps.push(format!("{} with {speed_m_s:.0} m/s before time = {} s", quoted(name), seconds(time_us)));
        }
        if samples.len() >= 3 && 2 * absent >= samples.len() - 1 {
            gaps.push(format!("{} ({absent} gaps)", quoted(name)));
        }
    }
    let mut notes = Vec::new();
    if !jumps.is_empty() {
        let what = format!("{} above {FAST_M_S} m/s between two samples", count(jumps.len(), "vehicle"));
        let advice = match 2 * fast_steps > steps {
            true => "are the times in another unit? then correct the name or the values of their column",
            false => "is a position wrong? correct it or remove the sample",
        };
        notes.push(format!("{what}: {}; {advice}", some(&jumps)));
    }
    if !gaps.is_empty() {
        let what = format!("{} absent between most samples", count(gaps.len(), "vehicle"));
        notes.push(format!("{what}: {}; a longer traffic.gap_s keeps them", some(&gaps)));
    }
    if fastest_m_s > 0.0 && fastest_m_s < SLOW_M_S && furthest_m > MOVED_M {
        notes.push(format!(
            "no vehicle is faster than {fastest_m_s:.3} m/s, although one moves {furthest_m:.0} m; are the times \
             milliseconds? then call their column time_ms"
        ));
    }
    if !without_position.is_empty() {
        let rows: usize = without_position.values().sum();
        let named: Vec<_> = without_position.iter().map(|(name, rows)| format!("{} ({rows})", quoted(name))).collect();
        notes.push(format!("skipped {} without a position or time: {}", count(rows, "sample"), some(&named)));
    }
    notes
}

fn distance_m(one: &Sample, other: &Sample) -> f64 {
    math::hypot(other.x - one.x, other.y - one.y)
}

/// Lists the first names, and the number of the others.
fn some(names: &[String]) -> String {
    let shown = names[..names.len().min(NAMED)].join(", ");
    if names.len() > NAMED { format!("{shown} and {} more", names.len() - NAMED) } else { shown }
}
