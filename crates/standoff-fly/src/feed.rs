//! Feed of detections and cues: one JSON object per line, `docs/user/fly.md` describes it.

use serde::Deserialize;
use standoff::validation::Allowed;
use standoff::{Angle, Detection, Duration, ParamError, RangeBearingMeasurement, TargetLabel, Velocity};

/// Maximum number of detections in a scan.
const DETECTIONS_MAX: usize = 1000;

/// Maximum length of a line, bytes.
const LINE_MAX: usize = 65_536;

/// What is wrong with a line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FeedError {
    /// Not a JSON object of a known form.
    #[error("line of the feed: {0}")]
    Form(String),
    /// A number that is out of range.
    #[error("{0}")]
    Range(ParamError),
    /// Too long a line or list.
    #[error("{what} of {length}: must have at most {max}")]
    Length {
        /// What is too long.
        what: &'static str,
        /// Its length.
        length: usize,
        /// Highest allowed length.
        max: usize,
    },
}

/// A valid line.
#[derive(Debug, Clone, PartialEq)]
pub enum FeedLine {
    /// One look of the sensor.
    Scan(FeedScan),
    /// A target report from another source.
    Cue(FeedCue),
}

/// One look of the sensor over its field of view.
#[derive(Debug, Clone, PartialEq)]
pub struct FeedScan {
    /// Boresight; `None` if the sensor did not scan.
    pub boresight: Option<Angle>,
    /// Detections, relative to the position of the UAV at the time of the scan.
    pub detections: Vec<Detection>,
    /// Age of the scan when the line was sent.
    pub age: Duration,
}

/// Position of a target from another source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedCue {
    /// Identity of the target, if the source knows it.
    pub label: Option<TargetLabel>,
    /// Latitude and longitude, degrees.
    pub point_deg: [f64; 2],
    /// Velocity of the target.
    pub velocity: Velocity,
    /// Standard deviation of the position per axis, m.
    pub position_sd_m: f64,
    /// Standard deviation of the velocity per axis, m/s.
    pub velocity_sd_m_s: f64,
    /// New priority of the target; `None`: unchanged.
    pub priority: Option<f64>,
    /// Age of the position when the line was sent.
    pub age: Duration,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Line {
    Scan(ScanLine),
    Cue(CueLine),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScanLine {
    boresight_deg: Option<f64>,
    #[serde(default)]
    age_s: f64,
    detections: Vec<DetectionLine>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DetectionLine {
    label: Option<u32>,
    range_m: f64,
    bearing_deg: f64,
    range_rate_m_s: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CueLine {
    label: Option<u32>,
    latitude_deg: f64,
    longitude_deg: f64,
    course_deg: f64,
    speed_m_s: f64,
    position_sd_m: f64,
    velocity_sd_m_s: f64,
    priority: Option<f64>,
    #[serde(default)]
    age_s: f64,
}

impl FeedLine {
    /// Parses a line. Bearings and courses are degrees clockwise from true north.
    pub fn parse(line: &str) -> Result<Self, FeedError> {
        if line.len() > LINE_MAX {
            return Err(FeedError::Length { what: "line of the feed, bytes", length: line.len(), max: LINE_MAX });
        }
        let parsed = serde_json::from_str(line).map_err(|error| FeedError::Form(error.to_string()))?;
        Ok(match parsed {
            Line::Scan(scan) => Self::Scan(scan.validated()?),
            Line::Cue(cue) => Self::Cue(cue.validated()?),
        })
    }
}

impl ScanLine {
    fn validated(self) -> Result<FeedScan, FeedError> {
        let Self { boresight_deg, age_s, detections } = self;
        if detections.len() > DETECTIONS_MAX {
            let length = detections.len();
            return Err(FeedError::Length { what: "`scan.detections`", length, max: DETECTIONS_MAX });
        }
        let boresight = boresight_deg.map(|deg| compass("scan.boresight_deg", deg)).transpose()?;
        let detection = |(index, line): (usize, DetectionLine)| {
            let key = |name| format!("scan.detections[{index}].{name}");
            let range_m = in_range(key("range_m"), line.range_m, 1.0, 1e6)?;
            let bearing = compass(&key("bearing_deg"), line.bearing_deg)?;
            let rate = line.range_rate_m_s.map(|m_s| in_range(key("range_rate_m_s"), m_s, -1000.0, 1000.0));
            Ok(Detection {
                label: line.label.map(TargetLabel),
                measurement: RangeBearingMeasurement { range_m, bearing },
                range_rate_m_s: rate.transpose()?,
            })
        };
        let detections = detections.into_iter().enumerate().map(detection).collect::<Result<_, _>>()?;
        Ok(FeedScan { boresight, detections, age: age("scan.age_s", age_s)? })
    }
}

impl CueLine {
    fn validated(self) -> Result<FeedCue, FeedError> {
        let latitude_deg = in_range("cue.latitude_deg", self.latitude_deg, -90.0, 90.0)?;
        let longitude_deg = in_range("cue.longitude_deg", self.longitude_deg, -180.0, 180.0)?;
        let course = compass("cue.course_deg", self.course_deg)?;
        let speed_m_s = in_range("cue.speed_m_s", self.speed_m_s, 0.0, 200.0)?;
        Ok(FeedCue {
            label: self.label.map(TargetLabel),
            point_deg: [latitude_deg, longitude_deg],
            velocity: Velocity::from_polar(speed_m_s, course),
            position_sd_m: in_range("cue.position_sd_m", self.position_sd_m, 0.1, 1e4)?,
            velocity_sd_m_s: in_range("cue.velocity_sd_m_s", self.velocity_sd_m_s, 0.01, 1e3)?,
            priority: self.priority.map(|priority| in_range("cue.priority", priority, 0.01, 100.0)).transpose()?,
            age: age("cue.age_s", self.age_s)?,
        })
    }
}

/// Converts degrees clockwise from north, in [-360, 360], to an angle anticlockwise from east.
fn compass(key: &str, deg: f64) -> Result<Angle, FeedError> {
    Ok(Angle::from_deg(90.0 - in_range(key, deg, -360.0, 360.0)?))
}

fn age(key: &str, age_s: f64) -> Result<Duration, FeedError> {
    Ok(Duration::from_s(in_range(key, age_s, 0.0, 10.0)?))
}

fn in_range(key: impl Into<String>, value: f64, min: f64, max: f64) -> Result<f64, FeedError> {
    let allowed = Allowed::at_least(min).at_most(max);
    let error = || FeedError::Range(ParamError { path: key.into(), value, allowed });
    if allowed.contains(value) { Ok(value) } else { Err(error()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_and_cues_are_converted_to_the_frame_of_the_library() {
        let scan = r#"{"scan": {"boresight_deg": 90, "age_s": 0.1, "detections":
            [{"range_m": 250.5, "bearing_deg": 0, "label": 7}, {"range_m": 300, "bearing_deg": 270, "range_rate_m_s": -2}]}}"#;
        let Ok(FeedLine::Scan(scan)) = FeedLine::parse(scan) else { panic!("a valid scan") };
        assert_eq!((scan.boresight, scan.age), (Some(Angle::from_deg(0.0)), Duration::from_us(100_000)));
        let bearings = scan.detections.iter().map(|detection| detection.measurement.bearing.deg());
        assert_eq!(bearings.collect::<Vec<_>>(), [90.0, 180.0]);
        assert_eq!(scan.detections[0].label, Some(TargetLabel(7)));
        let cue = r#"{"cue": {"latitude_deg": 47.4, "longitude_deg": 8.5, "course_deg": 180, "speed_m_s": 6.7,
            "position_sd_m": 20, "velocity_sd_m_s": 2}}"#;
        let Ok(FeedLine::Cue(cue)) = FeedLine::parse(cue) else { panic!("a valid cue") };
        assert!((cue.velocity.y_m_s() + 6.7).abs() < 1e-9 && cue.velocity.x_m_s().abs() < 1e-9);
        assert_eq!((cue.label, cue.point_deg, cue.priority), (None, [47.4, 8.5], None));
    }

    #[test]
    fn errors_name_the_key_and_the_allowed_range() {
        for (line, error) in [
            ("", "line of the feed: EOF while parsing a value at line 1 column 0"),
            (
                r#"{"scans": {}}"#,
                "line of the feed: unknown variant `scans`, expected `scan` or `cue` at line 1 column 8",
            ),
            (r#"{"scan": {"detection": []}}"#, "line of the feed: unknown field `detection`, expected one of"),
            (r#"{"scan": {}}"#, "line of the feed: missing field `detections`"),
            (
                r#"{"scan": {"detections": [{"range_m": -3, "bearing_deg": 0}]}}"#,
                "scan.detections[0].range_m = -3: must be at least 1 and at most 1000000",
            ),
            (
                r#"{"scan": {"detections": [{"range_m": 1e999, "bearing_deg": 0}]}}"#,
                "line of the feed: number out of range",
            ),
            (
                r#"{"cue": {"latitude_deg": 47.4, "longitude_deg": 8.5, "course_deg": 180, "speed_m_s": 6.7,
                    "position_sd_m": 20, "velocity_sd_m_s": 2, "priority": 0}}"#,
                "cue.priority = 0: must be at least 0.01 and at most 100",
            ),
            (r#"{"scan": {"age_s": 11, "detections": []}}"#, "scan.age_s = 11: must be at least 0 and at most 10"),
        ] {
            let stated = FeedLine::parse(line).unwrap_err().to_string();
            assert!(stated.starts_with(error), "{stated}");
        }
        let long = " ".repeat(LINE_MAX + 1);
        assert!(matches!(FeedLine::parse(&long), Err(FeedError::Length { .. })));
    }
}
