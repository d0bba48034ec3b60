//! A building as text of a scenario, in whole centimetres, because a scenario may contain thousands of them.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use standoff::Position;
use standoff_score::Building;

/// Outlines of a building, then courtyards, and its height.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Outline {
    /// Height, cm; `None`: that of the scenario.
    pub(super) height_cm: Option<i64>,
    /// Vertices, east and north, cm.
    pub(super) rings_cm: Vec<Vec<[i64; 2]>>,
}

/// Range of coordinates and heights, cm: that of typed coordinates.
const RANGE_CM: RangeInclusive<i64> = -1_000_000_000..=1_000_000_000;

impl Outline {
    /// Rounds a building in m. The last vertex of a ring may repeat the first one.
    pub(super) fn of_m(height_m: Option<f64>, rings_m: &[Vec<[f64; 2]>]) -> Self {
        // A cast saturates; the range is checked later.
        let cm = |metres: f64| (metres * 100.0).round() as i64;
        let ring_cm = |ring_m: &Vec<[f64; 2]>| {
            let mut ring: Vec<_> = ring_m.iter().map(|point| point.map(cm)).collect();
            ring.dedup();
            if ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            ring
        };
        Self {
            height_cm: height_m.map(|height_m| cm(height_m).max(1)),
            rings_cm: rings_m.iter().map(ring_cm).collect(),
        }
    }

    /// Describes what is wrong with the outlines, if anything.
    pub(super) fn check(&self) -> Result<(), String> {
        if let Some(ring) = self.rings_cm.iter().find(|ring| ring.len() < 3) {
            return Err(format!("an outline has {} different vertices; needs at least three", ring.len()));
        }
        if !self.rings_cm.iter().flatten().flatten().all(|cm| RANGE_CM.contains(cm)) {
            return Err("coordinates must be at most 1e7 m from the origin".to_owned());
        }
        if self.rings_cm.is_empty() { Err("has no outline".to_owned()) } else { Ok(()) }
    }

    /// Returns the building; `height_m` is the height of the scenario.
    pub(super) fn building(&self, height_m: f64) -> Building {
        let m = |cm: i64| cm as f64 / 100.0;
        let ring = |ring: &Vec<[i64; 2]>| ring.iter().map(|[x, y]| Position::from_m(m(*x), m(*y))).collect();
        Building { height_m: self.height_cm.map_or(height_m, m), rings: self.rings_cm.iter().map(ring).collect() }
    }
}

impl fmt::Display for Outline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(height_cm) = self.height_cm {
            write!(f, "{height_cm}: ")?;
        }
        for (index, ring) in self.rings_cm.iter().enumerate() {
            f.write_str(if index > 0 { "; " } else { "" })?;
            for (index, [x, y]) in ring.iter().enumerate() {
                write!(f, "{}{x},{y}", if index > 0 { " " } else { "" })?;
            }
        }
        Ok(())
    }
}

impl FromStr for Outline {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse().ok().filter(|cm| RANGE_CM.contains(cm));
        let wrong = || "must be \"HEIGHT: X,Y X,Y X,Y\" in whole cm; HEIGHT: may be absent".to_owned();
        let (height_cm, rings) = match text.split_once(':') {
            Some((height, rings)) => (Some(number(height).ok_or_else(wrong)?), rings),
            None => (None, text),
        };
        let point = |point: &str| {
            let (x, y) = point.split_once(',')?;
            Some([number(x)?, number(y)?])
        };
        let ring = |ring: &str| ring.split_whitespace().map(point).collect::<Option<Vec<_>>>().ok_or_else(wrong);
        let outline = Self { height_cm, rings_cm: rings.split(';').map(ring).collect::<Result<_, _>>()? };
        outline.check().map(|()| outline)
    }
}
