//! Collects the samples of a file by vehicle, and converts them to traffic.

use std::collections::BTreeMap;

use standoff_io::display_text::{count, printable, quoted};
use standoff_io::geodesy::{FURTHEST_M, Origin, Unit, wrapped};

use super::limits::{MAX_AT_ONCE, MAX_SAMPLES, MAX_SPEED_M_S, MAX_VEHICLES};
use super::names;
use super::notes;
use super::times::TimeForm;
use super::unit_detection;
use super::validate;
use super::vehicle::{Gaps, Sample, Vehicle, seconds};
use super::{Coordinates, Options, Traffic};

/// Minimum number of samples from which the sampling interval of a single vehicle is known.
const SAMPLES_MIN: usize = 4;
/// Minimum number of vehicles with one sample each that are taken for rows of a table.
const SINGLE_SAMPLES_MIN: usize = 3;

/// The samples read so far, in the file's own coordinates.
#[derive(Default)]
pub(super) struct Builder {
    vehicles: BTreeMap<String, Vec<Sample>>,
    /// Names as they look, with the name as it is written.
    names: BTreeMap<String, String>,
    /// First name of each folded form.
    folded: BTreeMap<String, String>,
    /// Pairs of names that may be spellings of one.
    alike: Vec<[String; 2]>,
    /// Times of the samples that begin a new segment of a track, by vehicle, microseconds.
    breaks_us: BTreeMap<String, Vec<i64>>,
    /// Highest priority of each vehicle that has any.
    priorities: BTreeMap<String, f64>,
    first: Option<Sample>,
    /// Number of samples.
    samples: usize,
    /// Samples without a position, by vehicle.
    without_position: BTreeMap<String, usize>,
    /// Samples that repeat an earlier one or its time, by vehicle.
    repeated: BTreeMap<String, usize>,
    /// Position that may have a separator of thousands, and whether others are whole numbers.
    pub(super) thousands: Option<(String, bool)>,
    /// True if persons or containers of SUMO were not read.
    pub(super) ignores_persons: bool,
    /// Notes of the reader.
    notes: Vec<String>,
    /// How the file writes its times.
    pub(super) times: TimeForm,
}

impl Builder {
    /// Checks the name of a vehicle, the value of `key`. Two names that look the same are rejected; those that may be
    /// spellings of one are noted.
    pub(super) fn check_name(&mut self, key: &str, name: &str) -> Result<(), String> {
        if self.vehicles.contains_key(name) {
            return Ok(());
        }
        validate::check_name(key, name)?;
        let shown = names::as_shown(name);
        match self.names.get(&shown) {
            Some(other) if other == name => return Ok(()),
            Some(other) => return Err(looks_the_same(key, name, other)),
            None => {}
        }
        let other = self.folded.entry(names::folded(&shown)).or_insert_with(|| name.to_owned());
        if other != name {
            self.alike.push([other.clone(), name.to_owned()]);
        }
        self.names.insert(shown, name.to_owned());
        Ok(())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.vehicles.is_empty()
    }

    /// Returns the unit of x and y as far as the motion of the vehicles determines it.
    pub(super) fn shows(&self) -> Option<Unit> {
        unit_detection::shows(self.vehicles.values())
    }

    /// Sets the priority of a vehicle; of several, the highest counts.
    pub(super) fn set_priority(&mut self, name: &str, priority: f64) {
        match self.priorities.get_mut(name) {
            Some(known) => *known = known.max(priority),
            None => {
                self.priorities.insert(name.to_owned(), priority);
            }
        }
    }

    /// Counts a sample without a position.
    pub(super) fn skip(&mut self, name: &str) {
        *self.without_position.entry(name.to_string()).or_default() += 1;
    }

    /// Begins a new segment of the track of a vehicle, before its sample at `time_us` is added. A segment that continues
    /// or repeats the one before it is no new one.
    pub(super) fn begin_segment(&mut self, name: &str, time_us: i64) {
        let last = self.vehicles.get(name).and_then(|samples| samples.last());
        if last.is_some_and(|last| last.time_us < time_us) {
            self.breaks_us.entry(name.to_owned()).or_default().push(time_us);
        }
    }

    /// Returns whether each of several vehicles has a single sample: the names are then probably numbers of rows.
    pub(super) fn has_single_samples(&self) -> bool {
        self.vehicles.len() >= SINGLE_SAMPLES_MIN && self.samples == self.vehicles.len()
    }

    /// Returns the unit of x and y: as given, or as far as the motion of the vehicles determines it, otherwise metres.
    pub(super) fn unit(&self, coordinates: Coordinates) -> Unit {
        match coordinates {
            Coordinates::Auto => self.shows().unwrap_or(Unit::Metres),
            Coordinates::Metres => Unit::Metres,
            Coordinates::Degrees => Unit::Degrees,
        }
    }

    /// Adds a sample.
    pub(super) fn add(&mut self, name: &str, sample: Sample) -> Result<(), String> {
        if self.samples == MAX_SAMPLES {
            return Err(format!("one sample too many; at most {MAX_SAMPLES} in a file; cut the file into parts"));
        }
        self.samples += 1;
        if self.first.is_none_or(|first| validate::is_unknown(Coordinates::Degrees, [first.x, first.y])) {
            self.first = Some(sample);
        }
        let Some(samples) = self.vehicles.get_mut(name) else {
            if self.vehicles.len() == MAX_VEHICLES {
                return Err(format!("one vehicle too many; at most {MAX_VEHICLES} in a file; cut the file into parts"));
            }
            self.vehicles.insert(name.to_string(), vec![sample]);
            return Ok(());
        };
        if samples.last().is_some_and(|last| last.time_us > sample.time_us) {
            // Some programs write all earlier samples again into each part of a track.
            let same_time = samples.partition_point(|earlier| earlier.time_us < sample.time_us);
            let mut same_time = samples[same_time..].iter().take_while(|earlier| earlier.time_us == sample.time_us);
            if !same_time.any(|earlier| [earlier.x, earlier.y] == [sample.x, sample.y]) {
                return Err(self.times.back(name, samples, sample.time_us));
            }
            *self.repeated.entry(name.to_string()).or_default() += 1;
            return Ok(());
        }
        samples.push(sample);
        Ok(())
    }

    /// Joins vehicles that are parts of the first one, unless they overlap in time; returns whether they do not. The first
    /// one may be new.
    pub(super) fn join(&mut self, parts: &[String]) -> bool {
        let Some(first) = parts.first() else { return true };
        let mut all: Vec<&Vec<Sample>> = parts.iter().filter_map(|name| self.vehicles.get(name)).collect();
        all.sort_by_key(|samples| samples.first().map(|sample| sample.time_us));
        let ends = all.windows(2).filter_map(|pair| Some((pair[0].last()?.time_us, pair[1].first()?.time_us)));
        let mut breaks_us: Vec<i64> = ends.filter(|(last, next)| last < next).map(|(_, next)| next).collect();
        let joined: Vec<Sample> = all.into_iter().flatten().copied().collect();
        if joined.windows(2).any(|pair| pair[1].time_us < pair[0].time_us) {
            return false;
        }
        breaks_us.extend(parts.iter().filter_map(|name| self.breaks_us.remove(name)).flatten());
        breaks_us.sort_unstable();
        self.breaks_us.insert(first.clone(), breaks_us);
        for name in parts {
            self.vehicles.remove(name);
        }
        if !joined.is_empty() {
            self.vehicles.insert(first.clone(), joined);
        }
        for counts in [&mut self.without_position, &mut self.repeated] {
            let all: usize = parts.iter().filter_map(|name| counts.remove(name)).sum();
            if all > 0 {
                counts.insert(first.clone(), all);
            }
        }
        true
    }

    /// Adds a note for the user.
    pub(super) fn note(&mut self, note: String) {
        self.notes.push(note);
    }

    /// Removes the samples, in degrees, of a receiver without a fix, and makes longitudes up to 360 negative.
    fn tidy_degrees(&mut self) {
        for (name, samples) in &mut self.vehicles {
            let before = samples.len();
            samples.retain(|sample| !validate::is_unknown(Coordinates::Degrees, [sample.x, sample.y]));
            if samples.len() < before {
                *self.without_position.entry(name.clone()).or_default() += before - samples.len();
            }
        }
        self.vehicles.retain(|_, samples| !samples.is_empty());
        for sample in self.vehicles.values_mut().flatten().chain(&mut self.first) {
            [sample.x, sample.y] = wrapped([sample.x, sample.y]);
        }
    }

    /// Describes a file without vehicles.
    fn empty(&self) -> String {
        let without: usize = self.without_position.values().sum();
        match without {
            0 if self.ignores_persons => {
                "contains no vehicles, only persons or containers of SUMO, which are ignored; \
                                          traffic.persons = \"included\" reads them"
                    .to_string()
            }
            0 => "contains no vehicles; must contain at least one; was the right file chosen?".to_string(),
            _ => format!("contains no vehicles with a position: {} without one", count(without, "sample")),
        }
    }

    /// Gaps of each vehicle, in the order of the vehicles.
    fn gaps(&mut self, options: &Options) -> Vec<Gaps> {
        let of_file_us = default_gap_us(self.vehicles.values());
        let limit_us = |samples: &Vec<Sample>| match options.gap_s {
            Some(gap_s) => (gap_s * 1e6).round() as i64,
            // A vehicle that is sampled less often than the others has a longer limit.
            None if samples.len() >= SAMPLES_MIN => default_gap_us([samples]).max(of_file_us),
            None => of_file_us,
        };
        let gaps = self.vehicles.iter().map(|(name, samples)| Gaps {
            limit_us: limit_us(samples),
            breaks_us: self.breaks_us.remove(name).unwrap_or_default(),
        });
        gaps.collect()
    }

    /// Returns the traffic; x and y are metres, or longitude and latitude.
    pub(super) fn finish(mut self, unit: Unit, options: &Options) -> Result<Traffic, String> {
        if unit == Unit::Degrees {
            self.tidy_degrees();
        }
        let Some(first) = self.first.filter(|_| !self.vehicles.is_empty()) else { return Err(self.empty()) };
        let of_first = Origin { latitude_deg: first.y, longitude_deg: first.x };
        let origin = (unit == Unit::Degrees).then_some(options.origin.unwrap_or(of_first));
        if let Some(origin) = origin {
            for (name, samples) in &mut self.vehicles {
                to_metres(name, samples, origin, self.times)?;
            }
        }
        for (name, samples) in &mut self.vehicles {
            let removed = self.times.remove_repeats(name, samples)?;
            if removed > 0 {
                *self.repeated.entry(name.clone()).or_default() += removed;
            }
        }
        let gaps = self.gaps(options);
        for ((name, samples), gaps) in self.vehicles.iter().zip(&gaps) {
            check_speed(name, samples, gaps, self.times)?;
        }
        let mut notes = self.notes;
        notes.extend(notes::of(self.vehicles.iter().zip(&gaps), self.thousands.as_ref(), self.times));
        notes.extend(notes::of_alike(&self.alike));
        notes.extend(notes::of_skipped(&self.without_position, "without a position or time"));
        notes.extend(notes::of_skipped(&self.repeated, "at the time of an earlier one of the same vehicle"));
        let mut vehicles: Vec<Vehicle> = self
            .vehicles
            .into_iter()
            .zip(gaps)
            .map(|((name, samples), gaps)| {
                let priority = self.priorities.get(&name).copied();
                Vehicle::new(name, priority, samples, gaps)
            })
            .collect();
        // The map yields the vehicles by name, and the sort is stable.
        vehicles.sort_by_key(Vehicle::first_us);
        check_crowd(&vehicles, self.times)?;
        Ok(Traffic {
            begin_us: vehicles.iter().map(Vehicle::first_us).min().unwrap_or(first.time_us),
            end_us: vehicles.iter().map(Vehicle::last_us).max().unwrap_or(first.time_us),
            vehicles,
            origin,
            notes,
            times: self.times,
        })
    }
}

/// Describes a name that looks the same as an earlier one.
fn looks_the_same(key: &str, name: &str, other: &str) -> String {
    let is_blank_only = name.split_whitespace().eq(other.split_whitespace());
    let [name, other, what] = if is_blank_only {
        [quoted(name), quoted(other), "in whitespace".to_owned()]
    } else {
        let codes = |name: &str| format!("\"{}\"", printable(&name.escape_default().to_string().replace("\\'", "'")));
        [codes(name), codes(other), "in its Unicode form or in invisible characters".to_owned()]
    };
    format!(
        "{key} = {name} differs only {what} from the earlier {other}; a vehicle has one name; write both alike, or \
         rename one"
    )
}

/// Rejects more vehicles at one time than a mission supports; the vehicles are ordered by their first times.
pub(super) fn check_crowd(vehicles: &[Vehicle], times: TimeForm) -> Result<(), String> {
    let mut last_us: Vec<i64> = vehicles.iter().map(Vehicle::last_us).collect();
    last_us.sort_unstable();
    let mut gone = 0;
    for (come, vehicle) in vehicles.iter().enumerate() {
        let now_us = vehicle.first_us();
        gone += last_us[gone..].iter().take_while(|last_us| **last_us < now_us).count();
        if come + 1 - gone > MAX_AT_ONCE {
            let time = times.shown(now_us);
            return Err(format!(
                "more than {MAX_AT_ONCE} vehicles at time = {time}; at most {MAX_AT_ONCE}; select a smaller area"
            ));
        }
    }
    Ok(())
}

/// Default gap limit: 2.5 times the median step of these vehicles, at least 1 s.
fn default_gap_us<'a>(vehicles: impl IntoIterator<Item = &'a Vec<Sample>>) -> i64 {
    let mut steps: Vec<i64> = vehicles
        .into_iter()
        .flat_map(|samples| samples.windows(2).map(|pair| pair[1].time_us - pair[0].time_us))
        .collect();
    if steps.is_empty() {
        return 1_000_000;
    }
    let middle = steps.len() / 2;
    let (_, &mut median, _) = steps.select_nth_unstable(middle);
    (median * 5 / 2).max(1_000_000)
}

/// Rejects positions, in metres, that no vehicle could reach in time; positions on both sides of a gap are not checked.
fn check_speed(name: &str, samples: &[Sample], gaps: &Gaps, times: TimeForm) -> Result<(), String> {
    for pair in samples.windows(2) {
        let step_us = pair[1].time_us - pair[0].time_us;
        let distance = pair[0].distance_m(&pair[1]);
        if !gaps.separate(&pair[0], &pair[1]) && distance > MAX_SPEED_M_S * seconds(step_us) {
            return Err(format!(
                "vehicle {}: from time = {} to {} it moves {distance:.3} m; at most {MAX_SPEED_M_S} m/s; is one of the \
                 samples wrong, or does the file mix degrees and metres?",
                quoted(name),
                times.shown(pair[0].time_us),
                times.shown(pair[1].time_us)
            ));
        }
    }
    Ok(())
}

/// Converts longitude and latitude to metres east and north of `origin`, all on the ellipsoid.
fn to_metres(name: &str, samples: &mut [Sample], origin: Origin, times: TimeForm) -> Result<(), String> {
    let plane = origin.plane().map_err(|error| error.to_string())?;
    for sample in samples {
        let position = plane.position(sample.y, sample.x).map_err(|far| {
            format!(
                "vehicle {}: at time = {} it is {:.0} km from the first sample; at most {} km; correct or remove a wrong \
                 position, or cut the file into parts",
                quoted(name),
                times.shown(sample.time_us),
                far.value / 1e3,
                FURTHEST_M / 1e3
            )
        })?;
        (sample.x, sample.y) = (position.x_m(), position.y_m());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use standoff::math;

    use super::*;

    const HOUR_US: i64 = 3_600_000_000;

    fn sample(time_us: i64, x: f64, y: f64) -> Sample {
        Sample { time_us, x, y }
    }

    fn traffic(samples: &[(&str, i64)], gap_s: Option<f64>) -> Traffic {
        let mut builder = Builder::default();
        for &(name, time_us) in samples {
            // At 100 m/s, because a parked vehicle has no gaps.
            builder.add(name, sample(time_us, 1e-4 * time_us as f64, 0.0)).unwrap();
        }
        builder.finish(Unit::Metres, &Options { gap_s, ..Options::default() }).unwrap()
    }

    /// A vehicle with a sample every hour.
    fn degrees(samples: &[(f64, f64)]) -> Result<Traffic, String> {
        let mut builder = Builder::default();
        for (hour, &(longitude, latitude)) in (0..).zip(samples) {
            builder.add("v", sample(hour * HOUR_US, longitude, latitude)).unwrap();
        }
        builder.finish(Unit::Degrees, &Options::default())
    }

    #[test]
    fn vehicles_are_ordered_by_first_appearance_then_name() {
        let traffic = traffic(&[("late", 9), ("b", 5), ("a", 5), ("z", 1), ("b", 30)], None);
        let names: Vec<&str> = traffic.vehicles.iter().map(Vehicle::name).collect();
        assert_eq!(names, ["z", "a", "b", "late"]);
        assert_eq!((traffic.begin_us, traffic.end_us), (1, 30));
    }

    #[test]
    fn the_times_of_a_vehicle_must_increase() {
        let mut builder = Builder::default();
        let second = sample(2_000_000, 0.0, 0.0);
        assert_eq!(builder.add("v", second), Ok(()));
        let earlier = builder.add("v", sample(1_500_000, 0.0, 0.0)).unwrap_err();
        assert!(earlier.starts_with("vehicle \"v\": time = 1.5 s comes after 2 s"), "{earlier}");
        assert_eq!(builder.add("v", sample(3_000_000, 0.0, 0.0)), Ok(()));
    }

    #[test]
    fn names_that_differ_by_blanks_only_are_refused() {
        let mut builder = Builder::default();
        for name in [" a b", "ab", "c"] {
            assert_eq!(builder.check_name("id", name), Ok(()));
            builder.add(name, sample(0, 0.0, 0.0)).unwrap();
            assert_eq!(builder.check_name("id", name), Ok(()));
        }
        for name in ["a b", "a  b", " a b ", "\ta\u{a0}b", "c "] {
            let error = builder.check_name("id", name).unwrap_err();
            let other = if name == "c " { "c" } else { " a b" };
            let expected = format!("id = {} differs only in whitespace from the earlier \"{other}\"", quoted(name));
            assert!(error.starts_with(&expected), "{error}");
        }
    }

    #[test]
    fn names_that_look_the_same_are_refused_and_similar_ones_noted() {
        let mut builder = Builder::default();
        let names = ["caf\u{e9}", "1", "bus", "1.0", "1.00", "Bus"];
        for name in names {
            assert_eq!(builder.check_name("id", name), Ok(()));
            builder.add(name, sample(0, 0.0, 0.0)).unwrap();
        }
        assert_eq!(
            builder.check_name("id", "cafe\u{301}").unwrap_err(),
            "id = \"cafe\\u{301}\" differs only in its Unicode form or in invisible characters from the earlier \
             \"caf\\u{e9}\"; a vehicle has one name; write both alike, or rename one"
        );
        assert!(builder.check_name("id", "b\u{200b}us").unwrap_err().contains("\"b\\u{200b}us\" differs only in its"));
        let traffic = builder.finish(Unit::Metres, &Options::default()).unwrap();
        let expected = "names that may be of one vehicle, but are read as two: \"1\" and \"1.0\", \"1\" and \"1.00\", \"bus\" \
                        and \"Bus\"; write them alike if they are of one";
        assert_eq!(traffic.notes, [expected]);
    }

    #[test]
    fn the_numbers_of_samples_and_vehicles_are_limited() {
        let at = |time_us| sample(time_us, 0.0, 0.0);
        let mut builder = Builder { samples: MAX_SAMPLES - 2, ..Builder::default() };
        assert!(builder.add("a", at(0)).is_ok() && builder.add("b", at(0)).is_ok());
        assert!(builder.add("b", at(1)).unwrap_err().contains("one sample too many; at most 5000000"));
        let mut builder = Builder::default();
        assert!((0..MAX_VEHICLES).all(|name| builder.add(&name.to_string(), at(0)).is_ok()));
        assert!(builder.add("0", at(1)).is_ok());
        assert!(builder.add("b", at(1)).unwrap_err().contains("one vehicle too many; at most 100000"));
    }

    #[test]
    fn unreachable_positions_are_rejected() {
        let path = |x: f64, gap_s| {
            let mut builder = Builder::default();
            for (time_us, x) in [(0, 11.3), (1_000_000, x)] {
                builder.add("v", sample(time_us, x, 0.0)).unwrap();
            }
            builder.finish(Unit::Metres, &Options { gap_s, ..Options::default() })
        };
        assert!(path(10_011.0, None).is_ok());
        let error = path(685_000.0, None).unwrap_err();
        assert!(
            error.starts_with("vehicle \"v\": from time = 0 s to 1 s it moves 684988.700 m; at most 10000 m/s"),
            "{error}"
        );
        assert!(path(685_000.0, Some(0.5)).is_ok(), "the two samples are separated by a gap");
    }

    #[test]
    fn the_default_gap_is_two_and_a_half_median_steps_but_at_least_a_second() {
        let steady = traffic(&[("v", 0), ("v", 1_000_000), ("v", 2_000_000), ("v", 4_500_001)], None);
        assert_eq!(steady.vehicles[0].at(3_000_000), None, "2.500001 s is more than 2.5 steps");
        let steady = traffic(&[("v", 0), ("v", 1_000_000), ("v", 2_000_000), ("v", 4_500_000)], None);
        assert!(steady.vehicles[0].at(3_000_000).is_some(), "2.5 s is not");
        let fast = traffic(&[("v", 0), ("v", 9), ("v", 18), ("v", 27), ("v", 1_000_027), ("v", 2_000_028)], None);
        let fast = &fast.vehicles[0];
        assert!(fast.at(28).is_some() && fast.at(1_000_028).is_none(), "at least 1 s");
    }

    #[test]
    fn the_gap_may_be_chosen() {
        let samples = [("v", 0), ("v", 500_000), ("v", 1_100_000)];
        let vehicle = &traffic(&samples, Some(0.5)).vehicles[0];
        assert!(vehicle.at(400_000).is_some() && vehicle.at(600_000).is_none());
    }

    #[test]
    fn degrees_become_metres_about_the_first_sample() {
        let traffic = degrees(&[(11.3, 44.5), (11.3, 44.501), (11.301, 44.5)]).unwrap();
        assert_eq!(traffic.origin, Some(Origin { latitude_deg: 44.5, longitude_deg: 11.3 }));
        let state = |hour| traffic.vehicles[0].at(hour * HOUR_US).unwrap();
        // One degree at 44.5 N: 111 122 m along the meridian, 79 530 m along the parallel (WGS84 radii of curvature).
        assert!(math::hypot(state(0).x_m, state(0).y_m) < 1e-6);
        assert!((state(1).y_m - 111.122).abs() < 0.01 && state(1).x_m.abs() < 1e-3, "{:?}", state(1));
        assert!((state(2).x_m - 79.530).abs() < 0.01 && state(2).y_m.abs() < 1e-3, "{:?}", state(2));
    }

    #[test]
    fn samples_too_far_from_the_first_are_refused() {
        assert!(degrees(&[(1.0, 0.0), (9.9, 0.0)]).is_ok());
        assert!(degrees(&[(1.0, 0.0), (-179.0, 0.0)]).unwrap_err().contains("12756 km from the first sample"));
    }

    #[test]
    fn traffic_without_vehicles_is_an_error() {
        assert!(Builder::default().finish(Unit::Metres, &Options::default()).unwrap_err().contains("no vehicles"));
    }
}
