//! Distinguishes metres from degrees by the motion of the vehicles.

use standoff::math;
use standoff_io::geodesy::Unit;
use std::ops::RangeInclusive;

use super::vehicle::{Sample, seconds};

/// Plausible speeds of moving vehicles, m/s. A degree of latitude is 111 km, so a drive in degrees is no motion in
/// metres, and a drive in metres would leave the Earth in degrees.
const DRIVES_M_S: RangeInclusive<f64> = 0.1..=300.0;
/// Longest step between two samples that is evidence of motion, s.
const STEP_MAX_S: f64 = 300.0;
/// Length of a degree of latitude, m.
const DEGREE_M: f64 = 111_195.0;
/// Distance from its first position that a vehicle must reach before motion is evidence of degrees, m: the last decimal
/// of a position in metres may flicker.
const FAR_M: f64 = 5.0;
/// Required ratio of the distances that are plausible in the one unit and in the other: single positions may be wrong.
const CLEAR: f64 = 10.0;

/// Returns the unit of x and y that the motion of the vehicles shows; `None` if they hardly move or the result is not
/// clear.
pub(super) fn shows<'a>(vehicles: impl Iterator<Item = &'a Vec<Sample>>) -> Option<Unit> {
    let (mut in_metres, mut in_degrees, mut far_m, mut may_be_degrees) = (0.0, 0.0, 0.0, true);
    for samples in vehicles {
        for sample in samples {
            may_be_degrees &= sample.x.abs() <= 180.0 && sample.y.abs() <= 90.0;
            far_m = degrees_apart_m(&samples[0], sample).max(far_m);
        }
        for pair in samples.windows(2) {
            let step_s = seconds(pair[1].time_us - pair[0].time_us);
            if step_s > STEP_MAX_S {
                continue;
            }
            let by_metres = math::hypot(pair[1].x - pair[0].x, pair[1].y - pair[0].y);
            let by_degrees_m = degrees_apart_m(&pair[0], &pair[1]);
            match [by_metres, by_degrees_m].map(|way_m| DRIVES_M_S.contains(&(way_m / step_s))) {
                [true, false] => in_metres += by_metres,
                [false, true] => in_degrees += by_degrees_m,
                _ => {}
            }
        }
    }
    if in_degrees > CLEAR * in_metres {
        // Motion alone is no evidence if values exceed the range of degrees, such as longitudes up to 360.
        (may_be_degrees && far_m >= FAR_M).then_some(Unit::Degrees)
    } else {
        (!may_be_degrees || in_metres > CLEAR * in_degrees).then_some(Unit::Metres)
    }
}

/// Approximate distance between two positions in degrees, m: the short way round the Earth.
fn degrees_apart_m(one: &Sample, other: &Sample) -> f64 {
    let (east, north) = ((other.x - one.x).abs(), other.y - one.y);
    let east = if east > 180.0 { 360.0 - east } else { east };
    DEGREE_M * math::hypot(east * math::cos(one.y.to_radians()), north)
}

#[cfg(test)]
mod tests {
    use super::super::{Coordinates, Options, Traffic, TrafficError, read_from};
    use super::*;

    /// Paths of vehicles with a sample every second.
    fn shown(paths: &[&[(f64, f64)]]) -> Option<Unit> {
        let sample = |(second, &(x, y)): (i64, &(f64, f64))| Sample { time_us: second * 1_000_000, x, y };
        let vehicles: Vec<Vec<Sample>> = paths.iter().map(|path| (0..).zip(*path).map(sample).collect()).collect();
        shows(vehicles.iter())
    }

    #[test]
    fn motion_distinguishes_degrees_from_metres() {
        for (path, expected, why) in [
            (vec![(10.0, 50.0), (10.0001, 50.0)], Some(Unit::Degrees), "1e-4 degrees are 7 m"),
            (vec![(10.0, 50.0), (17.2, 50.0)], Some(Unit::Metres), "7.2 m"),
            (vec![(0.0, 0.0), (0.4, 0.3)], Some(Unit::Metres), "half a metre"),
            (vec![(10.0, 50.0), (10.0, 50.0)], None, "nothing moves"),
            (vec![(10.0, 50.0)], None, "there is only one sample"),
            (vec![(10.0, 50.0), (10.000_02, 50.0)], None, "1.4 m: hardly anything moves"),
            (vec![(10.0, 50.0), (10.0, 50.000_002), (10.0, 50.0), (10.0, 50.000_002)], None, "a decimal flickers"),
            (vec![(200.0, 50.0), (200.0, 50.0)], Some(Unit::Metres), "200 degrees do not exist"),
            (vec![(10.0, 91.0)], Some(Unit::Metres), "nor do 91 of latitude"),
            (vec![(200.0, 50.0), (200.0001, 50.0)], None, "but files contain such longitudes"),
            (vec![(179.9999, 5.0), (-179.9999, 5.0)], Some(Unit::Degrees), "22 m across the antimeridian"),
            (vec![(-180.0, 5.0), (179.9999, 5.0), (179.9997, 5.0)], Some(Unit::Degrees), "and back"),
            (vec![(10.0, 89.0), (10.003, 89.0)], Some(Unit::Degrees), "degrees are short there: 5.8 m"),
        ] {
            assert_eq!(shown(&[&path]), expected, "{why}");
        }
    }

    #[test]
    fn one_wrong_position_does_not_decide() {
        let degrees: Vec<(f64, f64)> = (0..200).map(|n| (11.3 + 1e-4 * f64::from(n), 44.5)).collect();
        let metres: Vec<(f64, f64)> = (0..200).map(|n| (8.0 * f64::from(n % 10), 0.0)).collect();
        let jump = [(11.3, 44.5), (0.0, 0.0), (11.3, 44.5)];
        assert_eq!(shown(&[&degrees, &jump]), Some(Unit::Degrees));
        assert_eq!(shown(&[&metres, &[(1.0, 1.0), (1.000_01, 1.0)]]), Some(Unit::Metres));
        assert_eq!(shown(&[&degrees[..20], &jump]), None, "143 m compared with 92 m");
    }

    #[test]
    fn samples_hours_apart_are_no_evidence() {
        let sample = |hour: i64, x| Sample { time_us: hour * 3_600_000_000, x, y: 0.0 };
        assert_eq!(shows([vec![sample(0, 0.0), sample(24, 1.0)]].iter()), None, "a metre or 111 km in a day");
    }

    /// One vehicle that moves east from `from` to `to` in 1 s, in a file with the header `comment`.
    fn mover(comment: &str, [from, to]: [f64; 2], coordinates: Coordinates) -> Result<Traffic, TrafficError> {
        let step =
            |time: i32, x: f64| format!("<timestep time=\"{time}\"><vehicle id=\"a\" x=\"{x}\" y=\"50\"/></timestep>");
        let text = format!("{comment}<fcd-export>{}{}</fcd-export>", step(0, from), step(1, to));
        read_from(text.as_bytes(), "f.xml", &Options { coordinates, ..Options::default() })
    }

    const GEO: &str = "<!-- <fcd-output value=\"a\"/> <fcd-output.geo value=\"true\"/> -->";

    #[test]
    fn the_sumo_header_decides_if_motion_does_not() {
        let is_degrees = |comment, path| mover(comment, path, Coordinates::Auto).unwrap().origin.is_some();
        assert!(is_degrees("", [10.0, 10.0001]));
        assert!(is_degrees("", [179.9999, -179.9999]), "although it has no speed");
        assert!(!is_degrees("", [10.0, 17.2]));
        assert!(is_degrees(GEO, [10.0, 10.0]), "the header states it");
        assert!(!is_degrees("<!-- <fcd-output value=\"a.xml\"/> -->", [10.0, 10.0]));
        let error = mover("<!-- mine -->", [10.0, 10.0], Coordinates::Auto).unwrap_err().to_string();
        assert_eq!(
            error,
            "f.xml: its x and y may be metres or degrees: SUMO's header comment is missing, and the vehicles' \
             motion does not determine it; set traffic.coordinates = \"metres\" or \"degrees\" (--set traffic.coordinates=degrees)"
        );
    }

    #[test]
    fn the_option_of_the_caller_has_priority() {
        assert!(mover(GEO, [10.0, 10.0001], Coordinates::Metres).unwrap().origin.is_none());
        assert!(mover("", [10.0, 10.0], Coordinates::Degrees).unwrap().origin.is_some());
    }

    #[test]
    fn a_table_with_degrees_in_metre_columns_is_rejected() {
        let read = |header: &str, coordinates| {
            let rows = "0,a,11.3,44.5\n1,a,11.3001,44.5\n2,a,11.3002,44.5\n";
            read_from(format!("{header}\n{rows}").as_bytes(), "f.csv", &Options { coordinates, ..Options::default() })
        };
        let error = read("t,id,x,y", Coordinates::Auto).unwrap_err().to_string();
        assert!(
            error.starts_with("f.csv: the vehicles move as if column \"x\" were degrees; its name means"),
            "{error}"
        );
        assert!(read("t,id,x,y", Coordinates::Metres).unwrap().origin.is_none());
        assert!(read("t,id,x_m,y_m", Coordinates::Auto).unwrap().origin.is_none(), "the name states metres");
        assert!(read("t,id,lon,lat", Coordinates::Auto).unwrap().origin.is_some());
    }

    #[test]
    fn known_degrees_are_checked_at_their_position() {
        let error = mover("", [400.0, 401.0], Coordinates::Degrees).unwrap_err();
        assert!(
            error.to_string().contains("f.xml:1:48: vehicle \"a\": x = \"400\" is out of range; -180 to 360"),
            "{error}"
        );
    }
}
