//! Joins the traffic of several files.

use std::collections::BTreeMap;

use standoff_io::display_text::quoted;
use standoff_io::geodesy::Unit;
use standoff_io::text_source::Fault;

use super::build::check_crowd;
use super::limits::{MAX_SAMPLES, MAX_VEHICLES};
use super::model::Traffic;
use super::names::as_shown;
use super::validate::check_name;
use super::vehicle::Vehicle;
use super::{TrafficError, named};

/// Traffic of several files: their vehicles on one clock and in one plane.
#[derive(Default)]
pub(crate) struct Joined {
    files: Vec<Part>,
    samples: usize,
    vehicles: usize,
}

/// Traffic of one file.
struct Part {
    /// Name of the file in messages.
    file: String,
    /// Prefix of the vehicles whose names also occur in another file.
    stem: String,
    traffic: Traffic,
}

impl Joined {
    /// Adds a file. Fails if its unit or clock differs from that of the first file, or if there are too many samples or
    /// vehicles.
    pub(crate) fn add(&mut self, file: String, stem: String, traffic: Traffic) -> Result<(), TrafficError> {
        let refuse = |message: String| Err(named(&file)(Fault::whole(message)));
        if let Some(first) = self.files.first().filter(|first| first.traffic.unit() != traffic.unit()) {
            let [this, other] = [&traffic, &first.traffic].map(|traffic| match traffic.unit() {
                Unit::Metres => "metres",
                Unit::Degrees => "degrees",
            });
            return refuse(format!(
                "is in {this}, but {} in {other}; all traffic files of a run must be in one unit; convert one, or set \
                 traffic.coordinates if the unit was misjudged",
                quoted(&first.file)
            ));
        }
        if let Some(first) = self.files.first().filter(|first| first.traffic.epoch() != traffic.epoch()) {
            return refuse(format!(
                "has {}, but {} has {}; all traffic files of a run must have one clock; write all times alike",
                traffic.epoch().name(),
                quoted(&first.file),
                first.traffic.epoch().name()
            ));
        }
        self.samples += traffic.vehicles.iter().map(Vehicle::samples).sum::<usize>();
        self.vehicles += traffic.vehicles.len();
        for (what, count, most) in [("samples", self.samples, MAX_SAMPLES), ("vehicles", self.vehicles, MAX_VEHICLES)] {
            if count > most {
                return refuse(format!(
                    "together with the files before it, it has {count} {what}; at most {most}; leave out files"
                ));
            }
        }
        self.files.push(Part { file, stem, traffic });
        Ok(())
    }

    /// Returns the traffic of all files. Fails if two vehicles have one name, or if too many exist at one time.
    pub(crate) fn finish(mut self) -> Result<Traffic, TrafficError> {
        if self.files.len() == 1 {
            return Ok(self.files.remove(0).traffic);
        }
        let all_files = self.files.iter().map(|part| part.file.as_str()).collect::<Vec<_>>().join(", ");
        let refuse = |message: String| named(&all_files)(Fault::whole(message));
        self.number_equal_stems();
        let mut occurrences: BTreeMap<String, usize> = BTreeMap::new();
        for vehicle in self.files.iter().flat_map(|part| &part.traffic.vehicles) {
            *occurrences.entry(as_shown(vehicle.name())).or_default() += 1;
        }
        let mut vehicles = Vec::with_capacity(self.vehicles);
        let mut notes = Vec::new();
        let times = self.files.first().map(|part| part.traffic.times).unwrap_or_default();
        let mut origin = None;
        for Part { file, stem, traffic } in self.files {
            origin = origin.or(traffic.origin);
            notes.extend(traffic.notes.iter().map(|note| format!("{file}: {note}")));
            for mut vehicle in traffic.vehicles {
                if occurrences.get(&as_shown(vehicle.name())).is_some_and(|&count| count > 1) {
                    let name = format!("{stem}/{}", vehicle.name());
                    check_name("id", &name).map_err(refuse)?;
                    if occurrences.contains_key(&as_shown(&name)) {
                        return Err(refuse(format!(
                            "vehicle {} occurs in several files; rename it in one",
                            quoted(&name)
                        )));
                    }
                    vehicle.rename(name);
                }
                vehicles.push(vehicle);
            }
        }
        vehicles.sort_by(|one, other| (one.first_us(), one.name()).cmp(&(other.first_us(), other.name())));
        check_crowd(&vehicles, times).map_err(refuse)?;
        let begin_us = vehicles.iter().map(Vehicle::first_us).min().unwrap_or_default();
        let end_us = vehicles.iter().map(Vehicle::last_us).max().unwrap_or_default();
        Ok(Traffic { vehicles, begin_us, end_us, origin, notes, times })
    }

    /// Appends the number of the file to stems that several files have.
    fn number_equal_stems(&mut self) {
        let stems: Vec<String> = self.files.iter().map(|part| part.stem.clone()).collect();
        for (index, part) in self.files.iter_mut().enumerate() {
            if stems.iter().filter(|stem| **stem == part.stem).count() > 1 {
                part.stem = format!("{}-{}", part.stem, index + 1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Options, read_from};
    use super::*;

    /// Joins CSV files, each given by its stem and rows.
    fn joined(header: &str, files: &[(&str, &str)]) -> Result<Traffic, String> {
        let mut joined = Joined::default();
        let mut options = Options::default();
        for (stem, rows) in files {
            let text = format!("t,id,{header}\n{rows}");
            let traffic = read_from(text.as_bytes(), stem, &options).map_err(|error| error.to_string())?;
            options.origin = options.origin.or(traffic.origin);
            joined.add(format!("{stem}.csv"), (*stem).to_owned(), traffic).map_err(|error| error.to_string())?;
        }
        joined.finish().map_err(|error| error.to_string())
    }

    #[test]
    fn vehicles_of_several_files_are_joined_by_time_and_name() {
        let traffic = joined(
            "x,y",
            &[("north", "5,a,0,0\n6,a,9,0\n5,c,0,9\n6,c,9,9\n"), ("south", "2,a,0,5\n3,a,9,5\n5,b,1,1\n9,b,9,1\n")],
        )
        .unwrap();
        let names: Vec<_> = traffic.vehicles.iter().map(Vehicle::name).collect();
        assert_eq!(names, ["south/a", "b", "c", "north/a"]);
        assert_eq!((traffic.begin_us, traffic.end_us, traffic.origin), (2_000_000, 9_000_000, None));
        let rows = "0,a,0,0\n1,a,9,0\n";
        let names = |files: &[(&str, &str)]| {
            let vehicles = joined("x,y", files).unwrap().vehicles;
            vehicles.iter().map(|vehicle| vehicle.name().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(names(&[("a", rows), ("a", rows)]), ["a-1/a", "a-2/a"]);
        assert_eq!(names(&[("a", rows)]), ["a"]);
    }

    #[test]
    fn degrees_have_the_plane_of_the_first_file() {
        let traffic =
            joined("lat,lon", &[("a", "0,v,44,9\n1,v,44,9.0001\n"), ("b", "0,w,44.01,9\n1,w,44.01,9.0001\n")]);
        let traffic = traffic.unwrap();
        assert_eq!(traffic.origin.map(|origin| origin.latitude_deg), Some(44.0));
        let north_m = traffic.vehicles[1].at(0).unwrap().y_m;
        assert!((1_110.0..1_112.0).contains(&north_m), "{north_m}");
    }

    #[test]
    fn files_with_different_clocks_are_refused() {
        let file = |time: [&str; 2], name: &str| {
            let text = format!("t,id,x,y\n{},{name},0,0\n{},{name},9,0\n", time[0], time[1]);
            read_from(text.as_bytes(), name, &Options::default()).unwrap()
        };
        let utc = || file(["2026-07-01T08:00:00Z", "2026-07-01T08:00:01+00:00"], "utc");
        let both = |first: Traffic, second: Traffic| {
            let mut joined = Joined::default();
            joined.add("a.csv".to_owned(), "a".to_owned(), first).unwrap();
            joined.add("b.csv".to_owned(), "b".to_owned(), second).map_err(|error| error.to_string())
        };
        let local = file(["2026-07-01T10:00:00", "2026-07-01T10:00:01"], "local");
        let offset = file(["2026-07-01T10:00:00+02:00", "2026-07-01T10:00:01+02:00"], "offset");
        let unix = file(["1782892800", "1782892801"], "unix");
        for (traffic, expected) in [(&offset, true), (&unix, true), (&local, false), (&file(["0", "1"], "own"), false)]
        {
            assert_eq!(traffic.begin_unix_us(), expected.then_some(1_782_892_800_000_000));
        }
        assert_eq!(
            both(utc(), local.clone()).unwrap_err(),
            "b.csv: has dates without an offset from UTC, but \"a.csv\" has times in UTC (dates with an offset, or seconds \
             since 1970); all traffic files of a run must have one clock; write all times alike"
        );
        let own = both(utc(), file(["0", "1"], "own")).unwrap_err();
        assert!(own.starts_with("b.csv: has times from a start of its own, but \"a.csv\" has times in UTC"), "{own}");
        assert!(both(local.clone(), file(["1782892800", "1782892801"], "unix")).is_err());
        assert!(both(utc(), file(["1782892800", "1782892801"], "unix")).is_ok(), "both count from 1970");
        assert!(both(file(["5", "6"], "own"), file(["0", "1"], "other")).is_ok());
        assert!(both(local.clone(), local).is_ok());
    }

    #[test]
    fn names_that_look_the_same_in_two_files_get_the_names_of_the_files() {
        let traffic = joined("x,y", &[("a", "0,caf\u{e9},0,0\n"), ("b", "0,cafe\u{301},0,0\n")]).unwrap();
        let names: Vec<_> = traffic.vehicles.iter().map(Vehicle::name).collect();
        assert_eq!(names, ["a/caf\u{e9}", "b/cafe\u{301}"]);
    }

    #[test]
    fn files_that_do_not_fit_together_are_refused() {
        let mut files = Joined::default();
        let of = |text: &str| read_from(text.as_bytes(), "f", &Options::default()).unwrap();
        files.add("m.csv".to_owned(), "m".to_owned(), of("t,id,x,y\n0,v,1,2\n")).unwrap();
        let error =
            files.add("d.csv".to_owned(), "d".to_owned(), of("t,id,lat,lon\n0,v,1,2\n")).unwrap_err().to_string();
        assert!(error.starts_with("d.csv: is in degrees, but \"m.csv\" in metres; all traffic"), "{error}");
        let twice = joined("x,y", &[("a", "0,v,0,0\n"), ("b", "0,v,0,0\n0,a/v,0,0\n")]).unwrap_err();
        assert!(twice.starts_with("a.csv, b.csv: vehicle \"a/v\" occurs in several files"), "{twice}");
        let far = joined("lat,lon", &[("a", "0,v,44,9\n"), ("b", "0,w,54,9\n")]).unwrap_err();
        assert!(far.starts_with("b: vehicle \"w\": at time = 0 s it is 1111 km from the first sample"), "{far}");
        let mut full = Joined { samples: MAX_SAMPLES, ..Joined::default() };
        let error = full.add("m.csv".to_owned(), "m".to_owned(), of("t,id,x,y\n0,v,1,2\n")).unwrap_err().to_string();
        assert!(error.contains("it has 5000001 samples; at most 5000000"), "{error}");
    }
}
