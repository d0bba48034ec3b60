//! A run as it is exported.

use chrono::{DateTime, SecondsFormat, TimeDelta, Utc};

/// A recorded run in latitude and longitude (WGS84).
#[derive(Debug, Clone)]
pub struct Export {
    pub(crate) name: String,
    pub(crate) begin: DateTime<Utc>,
    pub(crate) end_s: f64,
    pub(crate) paths: Vec<Path>,
    pub(crate) outlines: Vec<Outline>,
    pub(crate) gaps: Vec<Gap>,
}

/// Longitude and latitude, degrees.
pub(crate) type Degrees = [f64; 2];

/// The path of a UAV or a track.
#[derive(Debug, Clone)]
pub(crate) struct Path {
    pub(crate) kind: &'static str,
    pub(crate) name: String,
    pub(crate) fixes: Vec<Fix>,
}

/// A position of a path.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fix {
    pub(crate) time_s: f64,
    pub(crate) at: Degrees,
    /// Altitude above the plane, m, if it is known.
    pub(crate) altitude_m: Option<f64>,
    /// Standard deviation of the estimated position in its most uncertain direction, m.
    pub(crate) position_sd_m: Option<f64>,
}

/// An outline that is shown for some time.
#[derive(Debug, Clone)]
pub(crate) struct Outline {
    pub(crate) kind: &'static str,
    pub(crate) name: String,
    pub(crate) begin_s: f64,
    pub(crate) end_s: f64,
    /// Anticlockwise; the last point is the first one.
    pub(crate) ring: Vec<Degrees>,
}

/// A time in which an existing target was in no UAV's view.
#[derive(Debug, Clone)]
pub(crate) struct Gap {
    pub(crate) name: String,
    pub(crate) begin_s: f64,
    pub(crate) end_s: f64,
    pub(crate) at: Degrees,
    pub(crate) cause: &'static str,
}

impl Export {
    /// Wall-clock time of a time of the mission, ISO 8601.
    pub(crate) fn utc(&self, time_s: f64) -> String {
        utc(self.begin, (time_s * 1e6).round() as i64)
    }
}

/// Wall-clock time of a time of a mission, ISO 8601.
pub(crate) fn utc(begin: DateTime<Utc>, time_us: i64) -> String {
    (begin + TimeDelta::microseconds(time_us)).to_rfc3339_opts(SecondsFormat::Millis, true)
}
