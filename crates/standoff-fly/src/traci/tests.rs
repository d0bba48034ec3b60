//! The client against bytes recorded from SUMO 1.28 (two cars on a road of four junctions), and arbitrary bytes.

use std::io::{self, Cursor, Read, Write};

use bolero::check;
use standoff::math;

use super::*;

/// Answers to: order, time, step length, junctions, subscription, two steps.
const ANSWERS: [&str; 7] = [
    "0000000b07030000000000",
    "0000001b07ab000000000010bb66000000000b0000000000000000",
    "0000001b07ab000000000010bb7b000000000b3fe0000000000000",
    "0000002b07a9000000000020b900000000000e000000040000000161000000016200000001630000000164",
    "0000001c078900000000000000000011990000000161a40300000000",
    "0000008407020000000000000000010000000075990000000161a40300000002000000056361722e304200014043ee019f7689cb400d939c\
     1013ca0440000b401800000000000043000b405499e614435060000000056361722e3142000140243ea57680c73cbfd12ab364f7244c4000\
     0b401800000000000043000b405499e614435060",
    "0000008407020000000000000000010000000075990000000161a40300000002000000056361722e3042000140456aa40c725f6340105fda\
     27dfa0ee40000b401800000000000043000b405499e614435060000000056361722e31420001402a312f2a701da03fc06c1d30c935104000\
     0b401800000000000043000b405499e614435060",
];

/// The subscription as sent by the recording client; the length has one byte there and five here.
const SUBSCRIPTION: &str = "89c1d0000000000000c1d00000000000000000000161a4412e84800000000003424043";

fn bytes(digits: &str) -> Vec<u8> {
    (0..digits.len() / 2).map(|at| u8::from_str_radix(&digits[2 * at..2 * at + 2], 16).unwrap()).collect()
}

/// A connection that answers with given bytes, whatever is sent.
#[derive(Debug)]
struct Recorded {
    answers: Cursor<Vec<u8>>,
    sent: Vec<u8>,
}

impl Recorded {
    fn new(answers: Vec<u8>) -> Self {
        Self { answers: Cursor::new(answers), sent: Vec::new() }
    }
}

impl Read for Recorded {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        self.answers.read(to)
    }
}

impl Write for Recorded {
    fn write(&mut self, from: &[u8]) -> io::Result<usize> {
        self.sent.extend(from);
        Ok(from.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn the_vehicles_of_a_recorded_simulation_are_read() {
    let mut client = Client::start(Recorded::new(bytes(&ANSWERS.concat())), 1).unwrap();
    assert_eq!((client.time_s, client.step_length_s), (0.0, 0.5));
    let subscription = bytes(SUBSCRIPTION);
    assert!(client.stream.sent.ends_with(&subscription));
    let [before, after] = [0.5, 1.0].map(|time_s| client.step_to(time_s).unwrap());
    let names: Vec<_> = after.iter().map(|vehicle| vehicle.name.as_str()).collect();
    assert_eq!(names, ["car.0", "car.1"]);
    for (before, after) in before.iter().zip(&after) {
        assert_eq!((after.speed_m_s, after.course_deg.round()), (6.0, 82.0));
        let [x_m, y_m] = [0, 1].map(|axis| after.position_m[axis] - before.position_m[axis]);
        // Half a second at 6 m/s.
        assert!((math::hypot(x_m, y_m) - 3.0).abs() < 0.01 && (y_m / x_m - 80.0 / 600.0).abs() < 0.01, "{x_m} {y_m}");
    }
}

#[test]
fn a_refused_command_is_an_error_with_the_reason() {
    let refused = "000000252189ff0000001a4a756e6374696f6e20277a7a27206973206e6f74206b6e6f776e";
    let answers = [&ANSWERS[..4].concat(), refused].concat();
    let error = Client::start(Recorded::new(bytes(&answers)), 1).unwrap_err();
    assert_eq!(error.to_string(), "SUMO refused a command: Junction 'zz' is not known");
}

#[test]
fn a_vehicle_with_a_number_out_of_range_is_left_out() {
    // The position of the first car becomes NaN.
    let step = ANSWERS[5].replacen("4043ee019f7689cb", "7ff8000000000000", 1);
    let answers = [&ANSWERS[..5].concat(), step.as_str()].concat();
    let vehicles = Client::start(Recorded::new(bytes(&answers)), 1).unwrap().step_to(0.5).unwrap();
    assert_eq!(vehicles.iter().map(|vehicle| vehicle.name.as_str()).collect::<Vec<_>>(), ["car.1"]);
}

#[test]
fn truncated_damaged_and_arbitrary_answers_are_errors_or_valid_vehicles() {
    let whole = bytes(&ANSWERS.concat());
    let read = |answers: Vec<u8>| {
        let Ok(mut client) = Client::start(Recorded::new(answers), 1) else { return };
        for vehicle in client.step_to(0.5).into_iter().flatten() {
            assert!(vehicle.position_m.iter().all(|m| m.abs() <= COORDINATE_MAX_M));
        }
    };
    (0..whole.len()).for_each(|length| read(whole[..length].to_vec()));
    check!().with_type::<(Vec<u8>, Vec<(u16, u8)>)>().for_each(|(arbitrary, changes)| {
        read(arbitrary.clone());
        let mut damaged = whole.clone();
        for (at, byte) in changes {
            let length = damaged.len();
            damaged[usize::from(*at) % length] = *byte;
        }
        read(damaged);
    });
}
