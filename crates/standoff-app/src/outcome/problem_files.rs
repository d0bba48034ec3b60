//! CSV files of all alarms and gaps of a run.

use chrono::{DateTime, Utc};
use standoff::Position;
use standoff_io::geodesy::LocalPlane;
use standoff_record::{Manifest, target_name};
use standoff_score::{Alarm, Gap};

use crate::error::Failure;
use crate::export::utc;

/// Writes the files of a run.
pub(crate) struct ProblemFiles<'a> {
    /// Names of the targets, by id.
    names: &'a [String],
    /// Length of a time step, s.
    period_s: f64,
    plane: Option<LocalPlane>,
    begin: Option<DateTime<Utc>>,
}

impl<'a> ProblemFiles<'a> {
    /// Writes times in UTC, and latitudes and longitudes, if the manifest has a start and an origin.
    pub(crate) fn of(manifest: &Manifest, names: &'a [String]) -> Result<Self, Failure> {
        let plane = manifest.origin.map(|origin| origin.plane()).transpose().map_err(Failure::running)?;
        let begin = manifest.begin_unix_us.and_then(DateTime::from_timestamp_micros);
        Ok(Self { names, period_s: manifest.period_s, plane, begin })
    }

    pub(crate) fn alarms(&self, alarms: &[Alarm]) -> Result<String, Failure> {
        let heads = ["kind", "cause", "target", "group", "uav", "begin_s", "end_s", "duration_s", "reason"];
        let optional = |id: Option<u32>| id.map_or_else(String::new, |id| id.to_string());
        let rows = alarms.iter().map(|alarm| {
            let target = alarm.target.map_or_else(String::new, |target| target_name(target, self.names));
            let [begin_s, end_s] = [alarm.begin_us, alarm.end_us].map(seconds);
            let cause = alarm.cause.clone().unwrap_or_default();
            let (group, uav) = (optional(alarm.group), optional(alarm.uav));
            let (kind, duration_s) = (alarm.kind.to_owned(), alarm.duration_s().to_string());
            let mut row = vec![kind, cause, target, group, uav, begin_s, end_s, duration_s, alarm.reason.clone()];
            row.extend(self.times([alarm.begin_us, alarm.end_us]));
            row
        });
        csv_of(heads.into_iter().chain(self.time_heads()).collect(), rows)
    }

    pub(crate) fn gaps(&self, gaps: &[Gap]) -> Result<String, Failure> {
        let heads = ["target", "begin_s", "end_s", "duration_s", "x_m", "y_m", "cause"];
        let place_heads = self.plane.map(|_| ["latitude_deg", "longitude_deg"]);
        let rows = gaps.iter().map(|gap| {
            let [begin_s, end_s] = [gap.begin_us, gap.end_us].map(seconds);
            let duration_s = (f64::from(gap.steps) * self.period_s).to_string();
            let [x_m, y_m] = [gap.x_m, gap.y_m].map(|at_m| at_m.to_string());
            let (target, cause) = (target_name(gap.target, self.names), gap.cause.text().to_owned());
            let mut row = vec![target, begin_s, end_s, duration_s, x_m, y_m, cause];
            row.extend(self.times([gap.begin_us, gap.end_us]));
            row.extend(self.place(Position::from_m(gap.x_m, gap.y_m)).into_iter().flatten());
            row
        });
        csv_of(heads.into_iter().chain(self.time_heads()).chain(place_heads.into_iter().flatten()).collect(), rows)
    }

    fn time_heads(&self) -> impl Iterator<Item = &'static str> + use<> {
        self.begin.map(|_| ["begin_utc", "end_utc"]).into_iter().flatten()
    }

    fn times(&self, times_us: [i64; 2]) -> impl Iterator<Item = String> + use<> {
        self.begin.map(|begin| times_us.map(|time_us| utc(begin, time_us))).into_iter().flatten()
    }

    fn place(&self, position: Position) -> Option<[String; 2]> {
        let degrees = self.plane?.degrees_at(position).map(|degrees| degrees.map(|value| value.to_string()));
        // As in the tables: a position further away than the plane is a map of the Earth has no degrees.
        Some(degrees.unwrap_or_default())
    }
}

fn seconds(time_us: i64) -> String {
    (time_us as f64 / 1e6).to_string()
}

fn csv_of(heads: Vec<&str>, rows: impl Iterator<Item = Vec<String>>) -> Result<String, Failure> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(heads).map_err(Failure::running)?;
    rows.into_iter().try_for_each(|row| writer.write_record(row)).map_err(Failure::running)?;
    let bytes = writer.into_inner().map_err(|error| Failure::running(error.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(test)]
mod tests {
    use standoff_io::geodesy::Origin;
    use standoff_score::GapCause;

    use super::*;

    #[test]
    fn names_with_commas_and_quotes_are_quoted() {
        let names = ["a, \"b\"".to_owned()];
        let alarm = Alarm {
            kind: "lost",
            cause: Some("radius-exceeded".to_owned()),
            target: Some(0),
            group: Some(3),
            uav: None,
            begin_us: 0,
            end_us: 5_000_000,
            reason: "so".to_owned(),
        };
        let csv = ProblemFiles::of(&Manifest::new("s", 1, 60.0, 0.5), &names).unwrap().alarms(&[alarm]).unwrap();
        assert!(csv.ends_with("\nlost,radius-exceeded,\"a, \"\"b\"\"\",3,,0,5,5,so\n"), "{csv}");
    }

    #[test]
    fn known_places_and_dates_are_written() {
        let gap = |x_m: f64| Gap {
            target: 7,
            begin_us: 1_500_000,
            end_us: 4_000_000,
            steps: 5,
            x_m,
            y_m: 0.0,
            cause: GapCause::NoTrack,
        };
        let manifest = Manifest {
            origin: Some(Origin { latitude_deg: 0.0, longitude_deg: 180.0 }),
            begin_unix_us: Some(1_782_893_639_000_000),
            ..Manifest::new("s", 1, 60.0, 0.5)
        };
        let csv = ProblemFiles::of(&manifest, &[]).unwrap().gaps(&[gap(111.319_490_8), gap(1e9)]).unwrap();
        let lines: Vec<_> = csv.lines().collect();
        assert_eq!(
            lines[0],
            "target,begin_s,end_s,duration_s,x_m,y_m,cause,begin_utc,end_utc,latitude_deg,longitude_deg"
        );
        let times = "2026-07-01T08:14:00.500Z,2026-07-01T08:14:03.000Z";
        let near = lines[1].strip_prefix(&format!("target 7,1.5,4,2.5,111.3194908,0,no track,{times},0,")).unwrap();
        assert!((near.parse::<f64>().unwrap() + 179.999).abs() < 1e-9, "{near}");
        assert_eq!(lines[2], format!("target 7,1.5,4,2.5,1000000000,0,no track,{times},,"));
    }
}
