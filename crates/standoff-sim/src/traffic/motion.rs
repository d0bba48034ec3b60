//! Tells metres from degrees by the way vehicles move.

use super::super::Coordinates;
use super::super::value::{axes, seconds};
use super::super::vehicle::Sample;
use standoff::math;

/// How far the vehicles went, by two accounts: it tells metres from degrees.
#[derive(Default)]
pub(super) struct Motion {
    beyond_degrees: bool,
    /// Length of all paths, in the unit of x, y.
    by_position: f64,
    by_speed_m: f64,
}

impl Motion {
    /// Adds a sample, its `speed` in m/s, and the one before it of the same vehicle.
    pub(super) fn add(&mut self, previous: Option<Sample>, sample: Sample, speed: Option<f64>) {
        let [longitude, latitude] = axes(Coordinates::Degrees);
        self.beyond_degrees |= !(longitude.allows(sample.x) && latitude.allows(sample.y));
        if let (Some(previous), Some(speed)) = (previous, speed) {
            self.by_position += math::hypot(sample.x - previous.x, sample.y - previous.y);
            self.by_speed_m += speed * seconds(sample.time_us - previous.time_us);
        }
    }

    /// Whether x and y must be degrees.
    ///
    /// A degree is some 1e5 m, so any ratio between 1e-5 and 1 would do; vehicles that stand show nothing.
    pub(super) fn shows_degrees(&self) -> bool {
        !self.beyond_degrees && self.by_speed_m > 5.0 && self.by_position < 0.01 * self.by_speed_m
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Coordinates, Options, Traffic, TrafficError, read_from};

    /// One vehicle that goes east from `from` to `to` in 1 s, with `speed`, under the header `comment`.
    fn mover(
        comment: &str,
        [from, to]: [f64; 2],
        speed: f64,
        coordinates: Coordinates,
    ) -> Result<Traffic, TrafficError> {
        let step = |time: i32, x: f64| {
            format!("<timestep time=\"{time}\"><vehicle id=\"a\" x=\"{x}\" y=\"50\" speed=\"{speed}\"/></timestep>")
        };
        let text = format!("{comment}<fcd-export>{}{}</fcd-export>", step(0, from), step(1, to));
        read_from(text.as_bytes(), "f.xml", &Options { coordinates, gap_s: None })
    }

    #[test]
    fn degrees_are_told_from_metres() {
        let is_degrees =
            |comment, path, speed| mover(comment, path, speed, Coordinates::Auto).unwrap().origin.is_some();
        let geo = "<!-- <fcd-output.geo value=\"true\"/> -->";
        assert!(is_degrees("", [10.0, 10.0001], 7.2), "1e-4 degrees are 7 m");
        assert!(!is_degrees("", [10.0, 17.2], 7.2), "it went 7.2 m");
        assert!(!is_degrees("", [10.0, 10.0], 0.0), "nothing moves");
        assert!(!is_degrees("", [10.0, 10.0001], 4.9), "hardly anything moves");
        assert!(!is_degrees("", [200.0, 200.0001], 7.2), "200 degrees do not exist");
        assert!(is_degrees(geo, [10.0, 10.0], 0.0), "the header says so");
        assert!(!is_degrees("<!-- <fcd-output.geo value=\"false\"/> -->", [10.0, 10.0], 0.0));
    }

    #[test]
    fn what_the_caller_says_goes() {
        let geo = "<!-- <fcd-output.geo value=\"true\"/> -->";
        assert!(mover(geo, [10.0, 10.0001], 7.2, Coordinates::Metres).unwrap().origin.is_none());
        assert!(mover("", [10.0, 10.0], 0.0, Coordinates::Degrees).unwrap().origin.is_some());
    }

    #[test]
    fn known_degrees_are_checked_where_they_stand() {
        let error = mover("", [200.0, 201.0], 7.2, Coordinates::Degrees).unwrap_err();
        assert!(
            error.to_string().contains("f.xml:1:48: vehicle \"a\": x = \"200\" is out of range; -180 to 180"),
            "{error}"
        );
    }
}
