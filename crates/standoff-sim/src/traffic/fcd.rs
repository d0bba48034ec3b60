//! Reads SUMO floating-car data.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use quick_xml::events::BytesStart;
use standoff_io::display_text::{nearest, quoted};
use standoff_io::geodesy::Unit;
use standoff_io::text_source::xml::{Elements, Found, attributes};
use standoff_io::text_source::{Fault, Position};

use super::build::Builder;
use super::model::{COORDINATES_HELP, Coordinates, Options, Persons, Traffic};
use super::validate::{self, Quantity};
use super::vehicle::{self, Sample};

/// Part of SUMO's header comment for a file in degrees.
const GEO_OPTION: &str = "fcd-output.geo value=\"true\"";
/// Part of SUMO's header comment for any file.
const OPTION: &str = "<fcd-output value=";
/// Elements that are read within `fcd-export`.
const TRAFFIC: [&str; 2] = ["timestep", "vehicle"];
/// Other elements that SUMO writes into a time step; they are ignored unless they are targets, too.
const LEFT_OUT: [&str; 2] = ["person", "container"];
/// Length of a name that can be a misspelt traffic element, bytes.
const MISSPELT_BYTES: RangeInclusive<usize> = 5..=10;
/// Maximum number of names of other elements that are compared with those of traffic: a comparison takes long, and a
/// large file may contain nothing else.
const MAX_OTHERS: usize = 1_000;

/// Creates the error of a missing attribute.
fn missing(start: Position, element: &str, key: &str) -> Fault {
    Fault::at(start, format!("{element}: {key} is missing; must be an attribute; have SUMO write id, x and y"))
}

fn out_of_place(element: &str, start: Position) -> Fault {
    let element = quoted(element);
    let message = format!(
        "element = {element} is out of place; fcd-export contains timestep, which contains vehicle; is the enclosing element \
         not closed?"
    );
    Fault::at(start, message)
}

/// State of the reader.
#[derive(Default)]
pub(super) struct Fcd {
    builder: Builder,
    in_root: bool,
    /// True if persons and containers are read, too.
    persons: bool,
    /// Time of the last time step, microseconds.
    last_us: Option<i64>,
    /// Time of the open element at depth 1, if that is a time step.
    step_us: Option<i64>,
    /// Unit of the coordinates; `Auto` until it is known.
    coordinates: Coordinates,
    /// True if the header comment is that of SUMO.
    is_of_sumo: bool,
    /// Names of other elements that do not resemble those of traffic.
    others: BTreeSet<String>,
}

impl Elements for Fcd {
    fn comment(&mut self, comment: &str) {
        if self.in_root {
            return;
        }
        self.is_of_sumo |= comment.contains(OPTION);
        if self.coordinates == Coordinates::Auto && comment.contains(GEO_OPTION) {
            self.coordinates = Coordinates::Degrees;
        }
    }

    fn element(&mut self, element: &BytesStart<'_>, start: Position, depth: usize) -> Result<(), Fault> {
        let name = element.name().into_inner();
        match (depth, name) {
            (0, "fcd-export") if !self.in_root => self.in_root = true,
            (0, _) => {
                let message = format!(
                    "element = {}; the only root element must be fcd-export or gpx; create the file with sumo --fcd-output",
                    quoted(name)
                );
                return Err(Fault::at(start, message));
            }
            (1, "timestep") => self.timestep(element, start)?,
            (2, name) if name == "vehicle" || self.persons && LEFT_OUT.contains(&name) => match self.step_us {
                Some(time_us) => self.vehicle(element, start, time_us)?,
                None => return Err(out_of_place(name, start)),
            },
            (depth, _) => {
                if depth == 1 {
                    self.step_us = None;
                }
                self.builder.ignores_persons |= self.step_us.is_some() && LEFT_OUT.contains(&name);
                self.other(element, start, depth)?;
            }
        }
        Ok(())
    }
}

impl Fcd {
    pub(super) fn new(options: &Options) -> Self {
        Self { coordinates: options.coordinates, persons: options.persons == Persons::Included, ..Self::default() }
    }

    /// Rejects an element of traffic that cannot be read in its place; ignores all other elements.
    fn other(&mut self, element: &BytesStart<'_>, start: Position, depth: usize) -> Result<(), Fault> {
        let name = element.name().into_inner();
        if TRAFFIC.contains(&name) {
            return Err(out_of_place(name, start));
        }
        let meant = match self.meant(name) {
            Some(meant) => meant,
            None => {
                // An element with a position and a time is traffic, whatever its name.
                let may_be_traffic = depth == 2 && self.step_us.is_some() && !LEFT_OUT.contains(&name);
                if !may_be_traffic || matches!(attributes(element, start, ["x"])?, [None]) {
                    return Ok(());
                }
                "vehicle"
            }
        };
        let name = quoted(name);
        Err(Fault::at(start, format!("element = {name} would be ignored; did you mean {meant}? rename or remove it")))
    }

    /// Returns the traffic element that `name` probably misspells.
    fn meant(&mut self, name: &str) -> Option<&'static str> {
        let local = name.rsplit(':').next().unwrap_or(name);
        if !MISSPELT_BYTES.contains(&local.len()) || self.others.len() >= MAX_OTHERS || self.others.contains(local) {
            return None;
        }
        let meant = nearest(local, &TRAFFIC);
        if meant.is_none() {
            self.others.insert(local.to_string());
        }
        meant
    }

    fn timestep(&mut self, element: &BytesStart<'_>, start: Position) -> Result<(), Fault> {
        let [time] = attributes(element, start, ["time"])?;
        let time = time.ok_or_else(|| missing(start, "timestep", "time"))?;
        let time_us = time.read(|text| validate::time_us("time", text))?;
        if let Some(last_us) = self.last_us.filter(|&last_us| last_us >= time_us) {
            let (now, last) = (vehicle::seconds(time_us), vehicle::seconds(last_us));
            let advice = match now < last {
                true => "sort or split the file",
                false => "if the times are rounded, have SUMO write more digits, with --precision",
            };
            let message =
                format!("time = {now} s is not after the previous time step ({last} s); must increase; {advice}");
            return Err(Fault::at(time.position, message));
        }
        self.last_us = Some(time_us);
        self.step_us = Some(time_us);
        Ok(())
    }

    fn vehicle(&mut self, element: &BytesStart<'_>, start: Position, time_us: i64) -> Result<(), Fault> {
        let [id, x, y, priority] = attributes(element, start, ["id", "x", "y", "priority"])?;
        let id = id.ok_or_else(|| missing(start, "vehicle", "id"))?;
        id.read(|name| self.builder.check_name("id", name))?;
        let vehicle = || format!("vehicle {}", quoted(&id.text));
        let need = |key: &str, found: Option<Found<'_>>, quantity: &Quantity| {
            let found = found.ok_or_else(|| missing(start, &vehicle(), key))?;
            found.read(|text| quantity.parse(key, text).map_err(|message| format!("{}: {message}", vehicle())))
        };
        if let Some(priority) = priority.filter(|found| !found.text.trim().is_empty()) {
            let priority = priority.read(|text| {
                validate::PRIORITY.parse("priority", text).map_err(|message| format!("{}: {message}", vehicle()))
            })?;
            self.builder.set_priority(&id.text, priority);
        }
        if let [Some(x), Some(y)] = [&x, &y].map(|found| found.as_ref().and_then(|found| validate::raw(&found.text)))
            && validate::is_unknown(self.coordinates, [x, y])
        {
            self.builder.skip(&id.text);
            return Ok(());
        }
        let [x_kind, y_kind] = validate::axes(self.coordinates);
        let (x, y) = (need("x", x, &x_kind)?, need("y", y, &y_kind)?);
        self.builder.add(&id.text, Sample { time_us, x, y }).map_err(|message| Fault::at(start, message))
    }

    pub(super) fn finish(self, options: &Options) -> Result<Traffic, Fault> {
        let known = match self.coordinates {
            Coordinates::Auto => self.builder.shows().or(self.is_of_sumo.then_some(Unit::Metres)),
            Coordinates::Metres => Some(Unit::Metres),
            Coordinates::Degrees => Some(Unit::Degrees),
        };
        let unit = match known {
            Some(unit) => unit,
            None if self.builder.is_empty() => Unit::Metres,
            None => {
                return Err(Fault::whole(format!(
                    "its x and y may be metres or degrees: SUMO's header comment is missing, and the vehicles' motion does \
                     not determine it; set {COORDINATES_HELP}"
                )));
            }
        };
        self.builder.finish(unit, options).map_err(Fault::whole)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{TrafficError, VehicleState, read_from};
    use super::*;

    fn read(text: &str) -> Result<Traffic, TrafficError> {
        let coordinates = Coordinates::Metres;
        read_from(text.as_bytes(), "f.xml", &Options { coordinates, ..Options::default() })
    }

    /// A file with one time step at 1 s that contains `inside`, from line 2 on.
    fn step(inside: &str) -> Result<Traffic, TrafficError> {
        read(&format!("<fcd-export><timestep time=\"1\">\n{inside}</timestep></fcd-export>"))
    }

    fn error(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    #[test]
    fn an_attribute_gives_priorities() {
        let vehicle = |priority: &str| step(&format!("<vehicle id=\"a\" x=\"3\" y=\"4\" priority=\"{priority}\"/>"));
        assert_eq!([vehicle("5"), vehicle("")].map(|traffic| traffic.unwrap().vehicles[0].priority), [Some(5.0), None]);
        assert_eq!(
            vehicle("0").unwrap_err().to_string(),
            "f.xml:2:29: vehicle \"a\": priority = \"0\" is out of range; 0.01 to 100; leave it blank for 1"
        );
    }

    #[test]
    fn a_file_is_read() {
        let traffic = read(
            "<?xml version=\"1.0\"?>\r\n<!-- made by sumo -->\r\n<fcd-export>\r\n<timestep time=\"1250.00\">\r\n\
             <vehicle id=\"a\" x=\"1.5\" y=\"-2\" angle=\"90\" speed=\"8\" type=\"car\"/>\r\n</timestep>\r\n\
             <timestep time=\"1250.50\"/>\r\n<timestep time=\"1251.00\">\r\n\
             <vehicle id='a' x='9.5' y='-2' angle='180' speed='4'></vehicle></timestep>\r\n</fcd-export>\r\n",
        )
        .unwrap();
        assert_eq!((traffic.begin_us, traffic.end_us, traffic.origin), (1_250_000_000, 1_251_000_000, None));
        let state = |time_us| traffic.vehicles[0].at(time_us).unwrap();
        assert_eq!((state(1_250_000_000).x_m, state(1_250_000_000).y_m), (1.5, -2.0));
        let near = |state: VehicleState, vx: f64, vy: f64| {
            assert!((state.vx_m_s - vx).abs() < 1e-6 && (state.vy_m_s - vy).abs() < 1e-6, "{state:?}");
        };
        // Not the stated speeds and angles.
        for half_second in 0..=2 {
            near(state(1_250_000_000 + half_second * 500_000), 8.0, 0.0);
        }
    }

    #[test]
    fn other_elements_are_ignored() {
        let traffic = read(
            "<fcd-export><meta><author id=\"no\" x=\"1\"/></meta><timestep time=\"1\"><person id=\"no\" x=\"1\"/>\
             <container id=\"no\" x=\"1\"><a/></container>text<weather/><vehicle id=\"yes\" x=\"0\" y=\"0\"><a x=\"1\"/></vehicle>\
             </timestep></fcd-export>",
        );
        let traffic = traffic.unwrap();
        assert_eq!(traffic.vehicles.iter().map(|vehicle| vehicle.name()).collect::<Vec<_>>(), ["yes"]);
    }

    #[test]
    fn a_file_with_persons_alone_is_refused_with_the_way_to_read_them() {
        let only = "contains no vehicles, only persons or containers of SUMO, which are ignored; traffic.persons = \"included\" \
                    reads them";
        for name in LEFT_OUT {
            let error = step(&format!("<{name} id=\"p\" x=\"0\" y=\"0\"/>")).unwrap_err();
            assert_eq!(error.message, only);
        }
        assert!(step("").unwrap_err().message.ends_with("was the right file chosen?"));
    }

    #[test]
    fn traffic_that_would_be_ignored_is_rejected() {
        let vehicle = |name: &str| format!("<{name} id=\"v\" x=\"0\" y=\"0\"/>");
        for name in ["vehcle", "Vehicle", "vehicles", "sumo:vehicle", "car", "tram"] {
            let error = step(&vehicle(name)).unwrap_err().to_string();
            let expected = format!("f.xml:2:1: element = \"{name}\" would be ignored; did you mean vehicle? rename");
            assert!(error.starts_with(&expected), "{error}");
        }
        for name in ["timstep", "TimeStep", "timesteps"] {
            let error =
                error(&format!("<fcd-export>\n <{name} time=\"1\">{}</{name}></fcd-export>", vehicle("vehicle")));
            let expected = format!("f.xml:2:2: element = \"{name}\" would be ignored; did you mean timestep? rename");
            assert!(error.starts_with(&expected), "{error}");
        }
        for around in ["vehicle id=\"w\" x=\"0\" y=\"0\"", "person", "container"] {
            let end = around.split(' ').next().unwrap();
            let error = step(&format!("<{around}>\n{}</{end}>", vehicle("vehicle"))).unwrap_err().to_string();
            assert!(
                error.starts_with("f.xml:3:1: element = \"vehicle\" is out of place; fcd-export contains"),
                "{error}"
            );
        }
        let others: String = (0..2 * MAX_OTHERS).map(|n| format!("<other{n}/>")).collect();
        let late = error(&format!("<fcd-export><meta>{others}\n<vehicle/></meta></fcd-export>"));
        assert!(late.starts_with("f.xml:2:1: element = \"vehicle\" is out of place"), "{late}");
        let meta = error("<fcd-export><meta>\n<vehicle/></meta></fcd-export>");
        assert!(meta.starts_with("f.xml:2:1: element = \"vehicle\" is out of place"), "{meta}");
    }

    #[test]
    fn names_that_differ_in_blanks_are_rejected_with_their_position() {
        let error =
            step("<vehicle id=\"a\" x=\"0\" y=\"0\"/>\n<vehicle x=\"9\" id=\"a \" y=\"0\"/>").unwrap_err().to_string();
        assert!(
            error.starts_with("f.xml:3:16: id = \"a \" differs only in whitespace from the earlier \"a\""),
            "{error}"
        );
    }

    #[test]
    fn names_are_kept_verbatim_and_shown_escaped() {
        let hostile = "a&#10;&lt;\u{1b}[2J\u{202e}\u{e9}";
        let traffic = step(&format!("<vehicle id=\"{hostile}\" x=\"0\" y=\"0\"/>")).unwrap();
        assert_eq!(traffic.vehicles[0].name(), "a\n<\u{1b}[2J\u{202e}\u{e9}");
        let error = step(&format!("<vehicle id=\"{hostile}\" x=\"0\" y=\"?\"/>")).unwrap_err().to_string();
        assert!(error.contains(r#"vehicle "a\n<\u{1b}[2J\u{202e}é": y = "?" is not a number"#), "{error}");
    }

    #[test]
    fn wrong_values_are_shown_with_their_place() {
        for (vehicle, expected) in [
            (r#"<vehicle id="v" x="abc" y="0"/>"#, r#"f.xml:2:17: vehicle "v": x = "abc" is not a number; -1"#),
            ("<vehicle id=\"v\" x=\"0\"\n y=\"NaN\"/>", r#"f.xml:3:2: vehicle "v": y = "NaN" is not finite; -1"#),
            (r#"<vehicle id="v" x="0" y="-1e9"/>"#, r#"f.xml:2:23: vehicle "v": y = "-1e9" is out of range"#),
            (r#"<vehicle x="0" y="0"/>"#, "f.xml:2:1: vehicle: id is missing"),
            (r#"<vehicle id="v" y="0"/>"#, r#"f.xml:2:1: vehicle "v": x is missing"#),
            (r#"<vehicle id="v" x="0"/>"#, r#"f.xml:2:1: vehicle "v": y is missing"#),
            (r#"<vehicle id="" x="0" y="0"/>"#, r#"f.xml:2:10: id = "" has 0 characters"#),
            (r#"<vehicle id="v" id="w"/>"#, "f.xml:2:1: not well-formed XML"),
            (r#"<vehicle id="&nosuch;"/>"#, "f.xml:2:10: entity = \"&nosuch;\" is not read; only &amp;"),
            (r#" <vehicle id="v" x=0/>"#, "f.xml:2:2: not well-formed XML"),
            ("</vehicle>", "f.xml:2:1: not well-formed XML"),
            (r#"<timestep time="2"/>"#, "f.xml:2:1: element = \"timestep\" is out of place"),
        ] {
            let error = step(vehicle).unwrap_err().to_string();
            assert!(error.starts_with(expected) && !error.contains('\n'), "{error}");
        }
        let long = step(&format!("<vehicle id=\"{}\" x=\"0\" y=\"0\"/>", "x".repeat(201))).unwrap_err();
        assert!(long.message.contains("has 201 characters"), "{long}");
    }

    #[test]
    fn a_vehicle_has_one_position_in_a_time_step() {
        let vehicle = |x: i32| format!(r#"<vehicle id="v" x="{x}" y="0"/>"#);
        let same = step(&(vehicle(0) + &vehicle(0))).unwrap();
        assert_eq!(same.notes, ["skipped 1 sample at the time of an earlier one of the same vehicle: \"v\" (1)"]);
        let error = step(&(vehicle(0) + &vehicle(9))).unwrap_err().to_string();
        assert!(error.starts_with(r#"f.xml: vehicle "v": 2 samples at one time, the first at time = 1 s"#), "{error}");
    }

    #[test]
    fn vehicles_without_a_position_are_skipped() {
        for at in ["-1073741824.00", "nan", ""] {
            let vehicles = format!("<vehicle id=\"v\" x=\"{at}\" y=\"{at}\"/><vehicle id=\"w\" x=\"1\" y=\"2\"/>");
            assert_eq!(step(&vehicles).unwrap().notes, ["skipped 1 sample without a position or time: \"v\" (1)"]);
        }
    }

    #[test]
    fn time_steps_must_increase() {
        for times in [["2", "2"], ["2", "1.5"], ["2", "2.0000001"]] {
            let error = error(&format!(
                "<fcd-export>\n<timestep time=\"{}\"/>\n<timestep time=\"{}\"/></fcd-export>",
                times[0], times[1]
            ));
            assert!(error.starts_with("f.xml:3:11: time = ") && error.contains("must increase"), "{error}");
        }
        assert!(error("<fcd-export><timestep/></fcd-export>").contains("timestep: time is missing"));
        assert!(error("<fcd-export><timestep time=\"x\"/></fcd-export>").starts_with("f.xml:1:23: time = \"x\""));
    }

    #[test]
    fn the_only_root_element_must_be_fcd_export() {
        assert!(error("<routes/>").starts_with("f.xml:1:1: element = \"routes\"; the only root element must be"));
        assert!(
            error("<fcd-export/><fcd-export/>")
                .starts_with("f.xml:1:14: element = \"fcd-export\"; the only root element must be")
        );
        assert!(error("<fcd-export><vehicle/></fcd-export>").starts_with("f.xml:1:13: element = \"vehicle\" is out"));
    }

    #[test]
    fn a_file_without_vehicles_is_refused() {
        assert!(error("<fcd-export/>").starts_with("f.xml: contains no vehicles"));
        assert!(error("<fcd-export><timestep time=\"1\"/></fcd-export>").starts_with("f.xml: contains no vehicles"));
        assert!(error("<!-- only a comment -->").starts_with("f.xml: contains no vehicles"));
    }

    #[test]
    fn a_file_cut_off_anywhere_is_refused() {
        let whole = "<fcd-export>\n<timestep time=\"1\"><vehicle id=\"v\" x=\"0\" y=\"0\"/></timestep></fcd-export>";
        assert!(read(whole).is_ok());
        for length in 0..whole.len() {
            let error = error(&whole[..length]);
            let expected = if length == 0 { "is empty" } else { "cut off" };
            assert!(error.contains(expected), "{length}: {error}");
        }
        assert!(error(&whole[..60]).starts_with("f.xml:2:20: "), "start of the open tag");
        assert!(error(&whole[..72]).starts_with("f.xml:2:60: "), "end of the text");
    }

    #[test]
    fn oversized_or_too_deep_elements_are_rejected() {
        let long = format!("<fcd-export>\n<!--{}--></fcd-export>", "x".repeat(1 << 20));
        let error = read(&long).unwrap_err();
        assert!(error.message.contains("at most 1 MiB"), "{error}");
        assert_eq!(error.position.unwrap().line, 2);
        let blank = read(&format!("<fcd-export>\n{}", " ".repeat(3 << 20))).unwrap_err();
        assert!(blank.to_string().starts_with("f.xml:1:13: more than 1 MiB of blanks"), "{blank}");
        let name = "n".repeat(100_000);
        assert!(read(&format!("<fcd-export><{name}></fcd-export>")).unwrap_err().message.len() < 300);
        let deep = format!("<fcd-export>{}", "<a>".repeat(100_000));
        assert!(read(&deep).unwrap_err().message.contains("nested too deeply"));
    }

    #[test]
    fn text_that_is_not_utf8_is_refused() {
        let error = read_from(&b"<fcd-export a=\"\xff\"/>"[..], "f.xml", &Options::default()).unwrap_err();
        assert!(error.to_string().starts_with("f.xml:1:1: not text; must be UTF-8; save the file"), "{error}");
    }
}
