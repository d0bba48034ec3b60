//! Reads tracks of GPS receivers from GPX (version 1.0 or 1.1): each `trk` is a vehicle, with its `name` or a number. A
//! vehicle is absent between its segments (`trkseg`), because GPX defines that the receiver had no fix or was off then.

use quick_xml::events::BytesStart;
use standoff_io::geodesy::Unit;
use standoff_io::text_source::xml::{Elements, attributes};
use standoff_io::text_source::{Fault, Position};

use super::build::Builder;
use super::csv::Clock;
use super::model::{Coordinates, Options, Traffic};
use super::validate;
use super::vehicle::Sample;

/// Maximum length of a name or a time, bytes.
const TEXT_MAX: usize = 1_000;

/// State of the reader.
#[derive(Default)]
pub(super) struct Gpx {
    builder: Builder,
    /// Number of tracks so far.
    tracks: usize,
    /// Name of the current track.
    name: String,
    /// Current point: latitude, longitude and its position in the file.
    point: Option<([f64; 2], Position)>,
    /// Time of the current point.
    time: String,
    clock: Clock,
    /// True if the next point with a time and a position is the first of a segment.
    begins_segment: bool,
    has_points: bool,
    /// Element whose text is collected.
    collects: Option<Collects>,
}

#[derive(Clone, Copy)]
enum Collects {
    Name,
    Time,
}

impl Elements for Gpx {
    fn element(&mut self, element: &BytesStart<'_>, start: Position, depth: usize) -> Result<(), Fault> {
        self.collects = None;
        match (depth, element.local_name().into_inner()) {
            (1, "trk") => {
                self.tracks += 1;
                self.name.clear();
            }
            (2, "name") => {
                self.name.clear();
                self.collects = Some(Collects::Name);
            }
            (2, "trkseg") => self.begins_segment = true,
            (3, "trkpt") => {
                let [lat, lon] = attributes(element, start, ["lat", "lon"])?;
                let [x_kind, y_kind] = validate::axes(Coordinates::Degrees);
                let missing = |key: &str| Fault::at(start, format!("trkpt: {key} is missing; must be an attribute"));
                let lat = lat.ok_or_else(|| missing("lat"))?.read(|text| y_kind.parse("lat", text))?;
                let lon = lon.ok_or_else(|| missing("lon"))?.read(|text| x_kind.parse("lon", text))?;
                self.point = Some(([lat, lon], start));
                self.time.clear();
                self.has_points = true;
            }
            (4, "time") if self.point.is_some() => self.collects = Some(Collects::Time),
            _ => {}
        }
        Ok(())
    }

    fn text(&mut self, text: &str) {
        let target = match self.collects {
            Some(Collects::Name) => &mut self.name,
            Some(Collects::Time) => &mut self.time,
            None => return,
        };
        if target.len() + text.len() <= TEXT_MAX {
            target.push_str(text);
        }
    }

    fn end(&mut self, depth: usize) -> Result<(), Fault> {
        self.collects = None;
        let Some(([lat, lon], start)) = self.point.take_if(|_| depth == 3) else { return Ok(()) };
        let name = match self.name.trim() {
            "" => format!("track {}", self.tracks),
            name => name.to_owned(),
        };
        let fault = |message| Fault::at(start, message);
        self.builder.check_name("name", &name).map_err(fault)?;
        let time = self.time.trim();
        if time.is_empty() || lat == 0.0 && lon == 0.0 {
            self.builder.skip(&name);
            return Ok(());
        }
        let time_us = self.clock.date_time_us("time", time).map_err(fault)?;
        let sample = Sample { time_us, x: lon, y: lat, velocity: [f32::NAN; 2] };
        self.builder.add(&name, sample).map_err(fault)?;
        if std::mem::take(&mut self.begins_segment) {
            self.builder.begin_segment(&name, time_us);
        }
        Ok(())
    }
}

impl Gpx {
    pub(super) fn finish(self, options: &Options) -> Result<Traffic, Fault> {
        if self.builder.is_empty() {
            let message = match self.has_points {
                true => "none of its track points has a time and a position; export the track with both",
                false => {
                    "contains no track points; must contain trk with trkseg and trkpt; routes and waypoints have no times"
                }
            };
            return Err(Fault::whole(message.to_owned()));
        }
        let traffic = self.builder.finish(Unit::Degrees, options).map_err(Fault::whole)?;
        Ok(Traffic { epoch: self.clock.epoch(traffic.begin_us), ..traffic })
    }
}

#[cfg(test)]
mod tests {
    use super::super::read_from;
    use super::*;

    fn read(inside: &str) -> Result<Traffic, String> {
        let text = format!("<?xml version=\"1.0\"?>\n<gpx version=\"1.1\" creator=\"a\">\n{inside}</gpx>");
        read_from(text.as_bytes(), "f.gpx", &Options::default()).map_err(|error| error.to_string())
    }

    fn point(second: u32, lat: f64) -> String {
        format!("<trkpt lat=\"{lat}\" lon=\"9\"><ele>3</ele><time>2026-03-01T12:00:{second:02}.5Z</time></trkpt>\n")
    }

    #[test]
    fn each_track_is_a_vehicle() {
        let points =
            |from: u32| (from..from + 3).map(|second| point(second, 44.0 + 1e-4 * f64::from(second))).collect();
        let [one, two]: [String; 2] = [points(0), points(5)];
        let traffic = read(&format!(
            "<metadata><name>tour</name></metadata><wpt lat=\"1\" lon=\"2\"><name>w</name></wpt>\
             <trk><name>Smith &amp; Co</name><desc>x</desc><trkseg>{one}</trkseg><trkseg>{two}</trkseg></trk>\
             <trk><trkseg>{one}</trkseg></trk>"
        ))
        .unwrap();
        let names: Vec<_> = traffic.vehicles.iter().map(|vehicle| vehicle.name()).collect();
        assert_eq!(names, ["Smith & Co", "track 2"]);
        assert_eq!((traffic.span_s(), traffic.notes.len()), (7.0, 1));
        let state = traffic.vehicles[0].at(traffic.begin_us + 500_000).unwrap();
        assert!((state.vy_m_s - 11.1).abs() < 0.1, "{state:?}");
        let prefixed = "<g:gpx xmlns:g=\"http://www.topografix.com/GPX/1/1\"><g:trk><g:name>&#233;</g:name><g:trkseg>\
                        <g:trkpt lat=\"44\" lon=\"9\"><g:time>2026-03-01T12:00:00Z</g:time></g:trkpt></g:trkseg></g:trk></g:gpx>";
        let traffic = read_from(prefixed.as_bytes(), "f.gpx", &Options::default()).unwrap();
        assert_eq!(traffic.vehicles[0].name(), "\u{e9}");
    }

    #[test]
    fn a_pause_between_segments_is_a_gap_and_no_drive() {
        let segment = |points: &[(u32, f64)]| {
            let points: String = points.iter().map(|&(second, lat)| point(second, lat)).collect();
            format!("<trkseg>{points}</trkseg>")
        };
        let [one, two] = [segment(&[(0, 44.0), (10, 44.001)]), segment(&[(20, 44.002), (30, 44.003)])];
        let exists = |segments: &str| {
            let traffic = read(&format!("<trk>{segments}</trk>")).unwrap();
            let exists = traffic.vehicles[0].at(traffic.begin_us + 15_000_000).is_some();
            (exists, traffic.notes)
        };
        let note = "1 vehicle absent between segments of their tracks for at least a tenth of the time: \"track 1\" (33 %, \
                    1 gap); join the segments if they were there";
        assert_eq!(exists(&format!("{one}{two}")), (false, vec![note.to_owned()]));
        let parked = segment(&[(20, 44.001), (30, 44.001)]);
        assert_eq!(exists(&format!("{one}{parked}")), (true, vec![]));
    }

    #[test]
    fn times_with_and_without_offset_are_refused() {
        let local = "<trkpt lat=\"44\" lon=\"9\"><time>2026-03-01T13:00:01</time></trkpt>";
        let mixed = read(&format!("<trk><trkseg>{}{local}</trkseg></trk>", point(0, 44.0))).unwrap_err();
        assert!(mixed.contains("is a date-time without an offset, the time before it a date-time with"), "{mixed}");
    }

    #[test]
    fn entities_are_refused_by_name() {
        let named = |name: &str| read(&format!("<trk><name>{name}</name><trkseg>{}</trkseg></trk>", point(0, 44.0)));
        assert_eq!(named("&lt;&#x61;&gt;").unwrap().vehicles[0].name(), "<a>");
        for entity in ["&van;", "&#0;"] {
            let error = named(entity).unwrap_err();
            assert!(
                error.starts_with(&format!("f.gpx:3:12: entity = \"{entity}\" is not read; only &amp;")),
                "{error}"
            );
        }
    }

    #[test]
    fn points_without_a_fix_or_a_time_are_skipped_and_reported() {
        let none = "<trkpt lat=\"0\" lon=\"0\"><time>2026-03-01T12:00:01Z</time></trkpt><trkpt lat=\"44\" lon=\"9\"/>";
        let traffic = read(&format!("<trk><trkseg>{}{none}{}</trkseg></trk>", point(0, 44.0), point(3, 44.0))).unwrap();
        assert_eq!(traffic.notes, ["skipped 2 samples without a position or time: \"track 1\" (2)"]);
        let untimed = read("<trk><trkseg><trkpt lat=\"44\" lon=\"9\"/></trkseg></trk>").unwrap_err();
        let none = read("<rte><rtept lat=\"44\" lon=\"9\"/></rte>").unwrap_err();
        assert!(none.starts_with("f.gpx: contains no track points; must contain trk"), "{none}");
        assert_eq!(untimed, "f.gpx: none of its track points has a time and a position; export the track with both");
    }

    #[test]
    fn wrong_values_are_shown_with_their_place() {
        let wrong = read("<trk><trkseg><trkpt lat=\"91\" lon=\"9\"/></trkseg></trk>").unwrap_err();
        assert!(wrong.starts_with("f.gpx:3:21: lat = \"91\" is out of range; -90 to 90"), "{wrong}");
        let wrong =
            read("<trk><trkseg><trkpt lat=\"1\" lon=\"9\"><time>noon</time></trkpt></trkseg></trk>").unwrap_err();
        assert!(wrong.starts_with("f.gpx:3:14: time = \"noon\" is not a date-time"), "{wrong}");
    }
}
