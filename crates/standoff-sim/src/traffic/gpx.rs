//! Reads tracks of GPS receivers from GPX (version 1.0 or 1.1): each `trk` is a vehicle, with its `name` or a number. A
//! vehicle is absent between its segments (`trkseg`), because GPX defines that the receiver had no fix or was off then.

use std::collections::{BTreeMap, BTreeSet};

use quick_xml::events::BytesStart;
use standoff_io::display_text::quoted;
use standoff_io::geodesy::Unit;
use standoff_io::text_source::xml::{Elements, attributes};
use standoff_io::text_source::{Fault, Position};

use super::build::Builder;
use super::csv::Clock;
use super::model::{Coordinates, Options, Traffic};
use super::notes::some;
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
    /// Place of this name in the file.
    name_at: Option<Position>,
    /// Name of the current track as a vehicle, from its first point on.
    vehicle: Option<String>,
    /// Vehicles of the tracks, by the names of these.
    vehicles: BTreeMap<String, Vec<String>>,
    /// Names of all vehicles.
    taken: BTreeSet<String>,
    /// Current point: latitude and longitude, if they are known, and its position in the file.
    point: Option<(Option<[f64; 2]>, Position)>,
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
                self.name_at = None;
                self.vehicle = None;
            }
            (2, "name") => {
                self.name.clear();
                self.name_at = Some(start.after(b"<").after(element.as_bytes()).after(b">"));
                self.collects = Some(Collects::Name);
            }
            (2, "trkseg") => self.begins_segment = true,
            (3, "trkpt") => {
                let [lat, lon] = attributes(element, start, ["lat", "lon"])?;
                let [x_kind, y_kind] = validate::GPX_AXES;
                let missing = |key: &str| Fault::at(start, format!("trkpt: {key} is missing; must be an attribute"));
                let (lat, lon) = (lat.ok_or_else(|| missing("lat"))?, lon.ok_or_else(|| missing("lon"))?);
                let at = match [&lon, &lat].map(|found| validate::raw(&found.text)) {
                    [Some(x), Some(y)] if validate::is_unknown(Coordinates::Degrees, [x, y]) => None,
                    _ => {
                        Some([lat.read(|text| y_kind.parse("lat", text))?, lon.read(|text| x_kind.parse("lon", text))?])
                    }
                };
                self.point = Some((at, start));
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
        let Some((at, start)) = self.point.take_if(|_| depth == 3) else { return Ok(()) };
        let fault = |message| Fault::at(start, message);
        let vehicle = self.vehicle().map_err(|message| Fault::at(self.name_at.unwrap_or(start), message))?;
        let (Some([lat, lon]), false) = (at, self.time.trim().is_empty()) else {
            self.builder.skip(&vehicle);
            return Ok(());
        };
        let time_us = self.clock.date_time_us("time", self.time.trim()).map_err(fault)?;
        self.builder.times = self.clock.form();
        if std::mem::take(&mut self.begins_segment) {
            self.builder.begin_segment(&vehicle, time_us);
        }
        let sample = Sample { time_us, x: lon, y: lat };
        self.builder.add(&vehicle, sample).map_err(fault)
    }
}

impl Gpx {
    /// Returns the vehicle of the current track. Tracks of one name are separate vehicles until [`Self::finish`].
    fn vehicle(&mut self) -> Result<String, String> {
        if let Some(vehicle) = &self.vehicle {
            return Ok(vehicle.clone());
        }
        // A track without a name is never joined to another one.
        let given = self.name.trim().to_owned();
        let name = if given.is_empty() { format!("track {}", self.tracks) } else { given.clone() };
        self.builder.check_name("name", &name)?;
        if !given.is_empty() && !self.vehicles.contains_key(&name) && self.taken.contains(&name) {
            self.renumber(&name);
        }
        let vehicle = if self.taken.contains(&name) { self.numbered(&name) } else { name.clone() };
        self.taken.insert(vehicle.clone());
        if !given.is_empty() {
            self.vehicles.entry(name).or_default().push(vehicle.clone());
        }
        self.vehicle = Some(vehicle.clone());
        Ok(vehicle)
    }

    /// Returns the name of another vehicle of the tracks named `name`.
    fn numbered(&self, name: &str) -> String {
        let mut names = (2..).map(|n| format!("{name} ({n})"));
        names.find(|vehicle| !self.taken.contains(vehicle)).unwrap_or_default()
    }

    /// Gives another number to the vehicle whose numbered name is the name of another track.
    fn renumber(&mut self, vehicle: &str) {
        let is_numbered = |(_, vehicles): &(&String, &Vec<String>)| vehicles.iter().any(|other| other == vehicle);
        let Some(name) = self.vehicles.iter().find(is_numbered).map(|(name, _)| name.clone()) else { return };
        let renamed = self.numbered(&name);
        self.builder.join(&[renamed.clone(), vehicle.to_owned()]);
        self.taken.remove(vehicle);
        self.taken.insert(renamed.clone());
        let of_name = self.vehicles.entry(name).or_default().iter_mut().find(|other| *other == vehicle);
        if let Some(other) = of_name {
            *other = renamed;
        }
    }

    /// Returns the traffic. Tracks of one name that overlap in time are separate vehicles, others are one.
    pub(super) fn finish(mut self, options: &Options) -> Result<Traffic, Fault> {
        let mut overlapping = Vec::new();
        for (name, tracks) in self.vehicles {
            if tracks.len() > 1 && !self.builder.join(&tracks) {
                overlapping.push(format!("{} ({})", quoted(&name), tracks.len()));
            }
        }
        if !overlapping.is_empty() {
            let names = some(&overlapping);
            let note = format!("tracks of one name overlap in time, so that each is a vehicle, with a number: {names}");
            self.builder.note(note);
        }
        if self.builder.is_empty() {
            let message = match self.has_points {
                true => "none of its track points has a time and a position; export the track with both",
                false => {
                    "contains no track points; must contain trk with trkseg and trkpt; routes and waypoints have no times"
                }
            };
            return Err(Fault::whole(message.to_owned()));
        }
        self.builder.finish(Unit::Degrees, options).map_err(Fault::whole)
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
        let next = segment(&[(10, 44.001), (20, 44.002)]);
        let skipped = "skipped 1 sample at the time of an earlier one of the same vehicle: \"track 1\" (1)";
        assert_eq!(exists(&format!("{one}{next}")), (true, vec![skipped.to_owned()]));
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
    fn an_ampersand_that_begins_no_entity_is_named() {
        for (name, column) in [("A & B", 14), ("A&B", 13), ("A & B; C", 14), ("&", 12), ("A && B", 14)] {
            let error = read(&format!("<trk><name>{name}</name></trk>")).unwrap_err();
            let expected = "not well-formed XML: & begins no entity; write &amp; for it";
            assert_eq!(error, format!("f.gpx:3:{column}: {expected}"));
        }
        let error = read("<trk><trkseg><trkpt lat=\"1\" lon=\"A & B\"/></trkseg></trk>").unwrap_err();
        assert!(error.ends_with("& begins no entity; write &amp; for it"), "{error}");
    }

    #[test]
    fn tracks_of_one_name_are_one_vehicle_unless_they_overlap() {
        let track = |from: u32, to: u32| {
            let points: String = (from..to).map(|second| point(second, 44.0 + 1e-4 * f64::from(second))).collect();
            format!("<trk><name>Morning drive</name><trkseg>{points}</trkseg></trk>")
        };
        let names = |traffic: &Traffic| traffic.vehicles.iter().map(|v| v.name().to_owned()).collect::<Vec<_>>();
        let parts = read(&(track(9, 12) + &track(0, 5))).unwrap();
        assert_eq!((names(&parts), parts.span_s()), (vec!["Morning drive".to_owned()], 11.0));
        let absent = "1 vehicle absent between segments of their tracks for at least a tenth of the time: \"Morning drive\" \
                      (45 %, 1 gap); join the segments if they were there";
        assert_eq!(parts.notes, [absent]);
        let next = read(&(track(4, 12) + &track(0, 5))).unwrap();
        let skipped = "skipped 1 sample at the time of an earlier one of the same vehicle: \"Morning drive\" (1)";
        assert_eq!((names(&next), next.notes), (vec!["Morning drive".to_owned()], vec![skipped.to_owned()]));
        let two = read(&(track(0, 9) + &track(3, 12))).unwrap();
        assert_eq!(names(&two), ["Morning drive", "Morning drive (2)"]);
        assert!(two.notes[0].starts_with("tracks of one name overlap in time, so that each"), "{:?}", two.notes);
        let numbered = track(2, 6).replace("drive", "drive (2)");
        let three = read(&(track(0, 9) + &track(3, 12) + &numbered)).unwrap();
        let shown: Vec<_> = three.vehicles.iter().map(|vehicle| (vehicle.name(), vehicle.samples())).collect();
        assert_eq!(shown, [("Morning drive", 9), ("Morning drive (2)", 4), ("Morning drive (3)", 9)]);
    }

    #[test]
    fn a_track_without_a_name_is_a_separate_vehicle() {
        let track = |name: &str, from: u32| {
            let points: String =
                (from..from + 3).map(|second| point(second, 44.0 + 1e-4 * f64::from(second))).collect();
            format!("<trk>{name}<trkseg>{points}</trkseg></trk>")
        };
        let named = |name: &str, from: u32| track(&format!("<name>{name}</name>"), from);
        let names = |tracks: String| {
            let traffic = read(&tracks).unwrap();
            traffic.vehicles.iter().map(|vehicle| vehicle.name().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(names(named("track 2", 0) + &track("", 5)), ["track 2", "track 2 (2)"]);
        let both = named("van", 0) + &track("", 5) + &named("track 2", 10) + &named("track 2", 15);
        assert_eq!(names(both), ["van", "track 2", "track 2 (2)"]);
    }

    #[test]
    fn segments_that_repeat_earlier_points_are_read() {
        let segments: String = (1..4)
            .map(|part| {
                let points: String =
                    (0..3 * part).map(|second| point(second, 44.0 + 1e-4 * f64::from(second))).collect();
                format!("<trkseg>{points}</trkseg>")
            })
            .collect();
        let traffic = read(&format!("<trk><name>van</name>{segments}</trk>")).unwrap();
        assert_eq!((traffic.vehicles[0].samples(), traffic.span_s()), (9, 8.0));
        assert_eq!(traffic.notes, ["skipped 9 samples at the time of an earlier one of the same vehicle: \"van\" (9)"]);
    }

    #[test]
    fn points_without_a_fix_or_a_time_are_skipped_and_reported() {
        let none = "<trkpt lat=\"0\" lon=\"0\"><time>2026-03-01T12:00:01Z</time></trkpt><trkpt lat=\"44\" lon=\"9\"/>\
                    <trkpt lat=\"91\" lon=\"181\"><time>2026-03-01T12:00:02Z</time></trkpt><trkpt lat=\"\" lon=\"NaN\"/>";
        let traffic = read(&format!("<trk><trkseg>{}{none}{}</trkseg></trk>", point(0, 44.0), point(3, 44.0))).unwrap();
        assert_eq!(traffic.notes, ["skipped 4 samples without a position or time: \"track 1\" (4)"]);
        let untimed = read("<trk><trkseg><trkpt lat=\"44\" lon=\"9\"/></trkseg></trk>").unwrap_err();
        let none = read("<rte><rtept lat=\"44\" lon=\"9\"/></rte>").unwrap_err();
        assert!(none.starts_with("f.gpx: contains no track points; must contain trk"), "{none}");
        assert_eq!(untimed, "f.gpx: none of its track points has a time and a position; export the track with both");
    }

    #[test]
    fn wrong_values_are_shown_with_their_place() {
        let named = |name: &str| format!("<trk><name>{name}</name><trkseg>{}</trkseg></trk>\n", point(0, 44.0));
        let wrong = read(&(named("Caf\u{e9}") + &named("Cafe\u{301}"))).unwrap_err();
        assert!(wrong.starts_with("f.gpx:5:12: name = "), "{wrong}");
        let wrong = read("<trk><trkseg><trkpt lat=\"91\" lon=\"9\"/></trkseg></trk>").unwrap_err();
        assert!(wrong.starts_with("f.gpx:3:21: lat = \"91\" is out of range; -90 to 90"), "{wrong}");
        let wrong =
            read("<trk><trkseg><trkpt lat=\"1\" lon=\"9\"><time>noon</time></trkpt></trkseg></trk>").unwrap_err();
        assert!(wrong.starts_with("f.gpx:3:14: time = \"noon\" is not a date-time"), "{wrong}");
    }
}
