//! Faults of radio, computers and clocks: each scenario key has the effect described in docs/user/scenarios.md, and no
//! other.

mod reference_replay;

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

use crate::common::{frames, load, overrides, writer};
use reference_replay::{Comparison, compare_while_flying};
use standoff::{
    AgentOutput, Angle, Command, Detection, LinkModel, Message, PointingTarget, Position, RangeBearingMeasurement,
    Report, Scan, TargetLabel, Time, UavId, UavState, Velocity,
};
use standoff_record::{Frame, Record};
use standoff_score::{MetricSelection, Scorer};
use standoff_sim::controller::{Controller, ReportedState, ReportedTables, team_controller};
use standoff_sim::radio::SentCounts;
use standoff_sim::run::Mission;
use standoff_sim::scenario::{AgentSetup, Overrides, Scenario, ScenarioTemplate, Settings};

fn template(text: &str) -> Result<ScenarioTemplate, String> {
    ScenarioTemplate::of_toml("mine", text, &Overrides::default(), Path::new("")).map_err(|error| error.to_string())
}

fn scenario(text: &str) -> Scenario {
    template(text).and_then(|template| template.draw(1).map_err(|error| error.to_string())).unwrap()
}

/// A team of this size with a target and a fault, for 100 s at two time steps per second.
fn team(uavs: usize, fault: &str) -> Scenario {
    scenario(&format!("uavs.count = {uavs}\n{fault}\n[[targets.start]]\n"))
}

/// Sender of cues in the sort order of senders.
const OUTSIDE: u32 = u32::MAX;

/// A received message, with the true time of reception.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct Received {
    at_s: f64,
    to: u32,
    from: u32,
    sent_s: f64,
    number: u32,
}

#[derive(Debug, Clone, Default, PartialEq)]
struct Log {
    received: Vec<Received>,
    /// UAV, time by its clock, and measured bearings of every call of `observe`.
    observed: Vec<(u32, f64, Vec<f64>)>,
    restarts: Vec<(u32, u32)>,
    decided: usize,
}

fn report(uav: UavId, sequence: u32, now: Time, own: UavState, detections: usize) -> Message {
    let measurement = RangeBearingMeasurement { range_m: 1.0, bearing: Angle::from_rad(0.0) };
    let detection = |label| Detection { label: Some(TargetLabel(label)), measurement, range_rate_m_s: None };
    let detections = (0..detections as u32).map(detection).collect();
    Message::Report(Report { sequence, detections, ..Report::position_only(uav, now, own) })
}

/// Size of a report with this number of detections.
fn size_bytes(detections: usize) -> u64 {
    let own = scenario("[[targets.start]]\n").uavs[0];
    report(UavId(0), 0, Time::EPOCH, own, detections).size_bytes() as u64
}

/// Test controller: sends `reports_per_step` reports per time step with this number of detections each, flies straight,
/// points the sensor at the origin, and records the calls.
struct TestController {
    reports_per_step: u32,
    detections: usize,
    outbox: Vec<Vec<Message>>,
    now_s: Vec<f64>,
    log: Rc<RefCell<Log>>,
}

impl Controller for TestController {
    fn restart(&mut self, uav: UavId, restart_count: u32) {
        self.log.borrow_mut().restarts.push((uav.0, restart_count));
    }
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        let place = uav.0 as usize;
        self.outbox.resize(self.outbox.len().max(place + 1), Vec::new());
        self.now_s.resize(self.outbox.len(), 0.0);
        self.now_s[place] = now.s();
        let report = |sequence| report(uav, sequence, now, *own, self.detections);
        self.outbox[place] = (0..self.reports_per_step).map(report).collect();
        let seen = scan.iter().flat_map(|scan| scan.detections).map(|seen| seen.measurement.bearing.rad()).collect();
        self.log.borrow_mut().observed.push((uav.0, now.s(), seen));
    }
    fn outbox(&self, uav: UavId) -> &[Message] {
        &self.outbox[uav.0 as usize]
    }
    fn receive(&mut self, uav: UavId, message: &Message) {
        let (from, sent_s, number) = match message {
            Message::Report(report) => (report.uav.0, report.time.s(), report.sequence),
            Message::Cue(cue) => (OUTSIDE, cue.time.s(), cue.label.unwrap().0),
            Message::Snapshot(_) | Message::Traffic(_) => panic!("unexpected message type"),
        };
        let received = Received { at_s: self.now_s[uav.0 as usize], to: uav.0, from, sent_s, number };
        self.log.borrow_mut().received.push(received);
    }
    fn decide(&mut self, _: UavId) -> AgentOutput {
        self.log.borrow_mut().decided += 1;
        let pointing_target = Some(PointingTarget { position: Position::ORIGIN, velocity: Velocity::ZERO });
        AgentOutput { pointing_target, ..AgentOutput::command_only(Command { speed_m_s: 40.0, turn_rate_rad_s: 0.0 }) }
    }
}

/// Flies a scenario whose UAVs send these reports. Returns what they received, the frames, and what they sent per time
/// step.
fn flown(scenario: &Scenario, reports_per_step: u32, detections: usize) -> (Log, Vec<Frame>, Vec<Vec<SentCounts>>) {
    let log = Rc::default();
    let controller =
        TestController { reports_per_step, detections, outbox: Vec::new(), now_s: Vec::new(), log: Rc::clone(&log) };
    let mut mission = Mission::with_controller(scenario, controller).unwrap();
    let (mut frames, mut sent) = (Vec::new(), Vec::new());
    while let Some(frame) = mission.frame().cloned() {
        frames.push(frame);
        sent.push(mission.sent().to_vec());
    }
    drop(mission);
    (Rc::try_unwrap(log).unwrap().into_inner(), frames, sent)
}

/// Messages received by a team that sends one report per time step.
fn received(uavs: usize, fault: &str) -> Vec<Received> {
    flown(&team(uavs, fault), 1, 0).0.received
}

fn is_cue(received: &&Received) -> bool {
    received.from == OUTSIDE
}

/// Selects the reports.
fn reports(received: &[Received]) -> Vec<Received> {
    received.iter().filter(|received| !is_cue(received)).copied().collect()
}

/// Checks that `count` of `of` matches a probability within five standard errors.
#[track_caller]
fn check_share(count: usize, of: usize, share: f64) {
    let (count, of) = (count as f64, of as f64);
    let error = (of * share * (1.0 - share)).sqrt();
    assert!((count - of * share).abs() <= 5.0 * error, "{count} of {of}: not {share}");
}

/// Number of received reports without losses: four UAVs, 201 time steps, three receivers each.
const EXPECTED_REPORTS: usize = 201 * 12;

#[test]
fn ideal_radio_delivers_everything_immediately_ordered_by_sender() {
    for fault in
        ["", "[radio]", "radio.packet_loss = 0", "radio.fault_until_s = 0\nradio.packet_loss = 1\nradio.latency_s = 9"]
    {
        let received = received(4, fault);
        assert_eq!(reports(&received).len(), EXPECTED_REPORTS, "{fault}");
        assert!(received.iter().all(|received| received.at_s == received.sent_s && received.to != received.from));
        for to in 0..4 {
            let own: Vec<_> = received.iter().filter(|received| received.to == to).collect();
            assert!(own.is_sorted_by_key(|received| ((received.at_s * 2.0) as u32, received.from)), "{fault}");
            assert_eq!(own.iter().filter(|received| is_cue(received)).count(), 1);
        }
    }
}

/// Loss probability, fixed or drawn for each message and receiver independently.
#[test]
fn losses_have_the_given_probability_and_are_independent() {
    for (loss, mean) in [("0.2", 0.2), ("{ uniform = { min = 0.0, max = 1.0 } }", 0.5)] {
        let received = reports(&received(4, &format!("radio.packet_loss = {loss}")));
        check_share(EXPECTED_REPORTS - received.len(), EXPECTED_REPORTS, mean);
        for from in 0..4 {
            for to in (0..4).filter(|to| *to != from) {
                let of_pair = received.iter().filter(|received| (received.from, received.to) == (from, to)).count();
                check_share(201 - of_pair, 201, mean);
            }
        }
        // Losses of one sender at two receivers are independent, and so are those of two senders at one receiver: both
        // messages are received with probability (1 - p)^2.
        let of = |from, to| {
            received
                .iter()
                .filter(move |received| (received.from, received.to) == (from, to))
                .map(|received| received.sent_s)
        };
        for (one, other) in [((0, 1), (0, 2)), ((0, 2), (1, 2)), ((0, 1), (1, 0))] {
            let both = of(one.0, one.1).filter(|sent_s| of(other.0, other.1).any(|other_s| other_s == *sent_s)).count();
            check_share(both, 201, (1.0 - mean) * (1.0 - mean));
        }
    }
}

/// Cues use the same radio; each UAV receives them independently.
#[test]
fn cues_are_lost_delayed_and_duplicated_but_have_unlimited_range() {
    let cues = |fault: &str| {
        let text = format!("uavs.count = 2\nduration_s = 10\n{fault}\n[targets.random]\ncount = 500\n");
        let received = flown(&scenario(&text), 1, 0).0.received;
        received.into_iter().filter(|received| received.from == OUTSIDE).collect::<Vec<_>>()
    };
    let lost = cues("radio.packet_loss = 0.3");
    check_share(lost.len(), 1000, 0.7);
    let of = |to| lost.iter().filter(move |received| received.to == to).map(|received| received.number);
    check_share(of(0).filter(|cue| of(1).any(|other| other == *cue)).count(), 500, 0.49);
    let late = cues("radio.latency_s = 1.2");
    assert!(late.len() == 1000 && late.iter().all(|received| (received.sent_s, received.at_s) == (0.0, 1.5)));
    check_share(cues("radio.duplication = 0.3").len() - 1000, 1000, 0.3);
    let alone = cues("radio.range_m = 1\nradio.bandwidth_bytes_per_s = 1\nradio.partition = [{ sides = [[]] }]");
    assert_eq!(alone.len(), 1000);
}

#[test]
fn late_messages_are_received_at_the_first_time_step_after_arrival() {
    for (delay_s, arrival_s) in
        [("0.049", 0.0), ("0.05", 0.5), ("0.3", 0.5), ("0.5", 0.5), ("0.51", 1.0), ("1.5", 1.5), ("120", 120.0)]
    {
        let received = reports(&received(2, &format!("radio.latency_s = {delay_s}")));
        assert!(received.iter().all(|received| received.at_s - received.sent_s == arrival_s), "{delay_s}");
        // Messages that arrive after the end are not received.
        assert_eq!(received.len(), 2 * 201usize.saturating_sub((2.0 * arrival_s) as usize), "{delay_s}");
    }
    // Eleven periods of 0.1 s, not twelve.
    let fine =
        flown(&scenario("period_s = 0.1\nuavs.count = 2\nradio.latency_s = 1.1\n[[targets.start]]\n"), 1, 0).0.received;
    assert!(fine.iter().all(|received| ((received.at_s - received.sent_s) * 10.0).round() == 11.0));
}

/// Delays of each message and receiver, with three messages per time step: simultaneous arrivals have one order.
#[test]
fn messages_of_a_time_step_are_ordered_by_sender_age_and_number() {
    let fault = "radio.latency_s = { uniform = { min = 0.0, max = 2.0 } }\nradio.duplication = 0.5";
    let received = flown(&team(3, fault), 3, 0).0.received;
    for to in 0..3 {
        let own: Vec<_> = received.iter().filter(|received| received.to == to).collect();
        let key = |received: &&Received| {
            [received.at_s * 2.0, f64::from(received.from), received.sent_s * 2.0, f64::from(received.number)]
                .map(|x| x as u64)
        };
        assert!(own.is_sorted_by_key(key));
        // Delays of 0 to 4 time steps, one in forty without delay; some messages overtake those of the previous time
        // step.
        let late = |steps: f64| own.iter().filter(|received| (received.at_s - received.sent_s) * 2.0 == steps).count();
        assert!((0..=4).all(|steps| late(f64::from(steps)) > 0) && late(0.0) < late(1.0));
    }
    let late_of = |to| {
        received.iter().filter(move |received| received.to == to && received.from == 2).map(|received| received.at_s)
    };
    assert!(!late_of(0).eq(late_of(1)), "each receiver has its own delay");
}

#[test]
fn duplicates_have_the_given_probability_and_their_own_delay() {
    let twice = reports(&received(4, "radio.duplication = 0.25"));
    check_share(twice.len() - EXPECTED_REPORTS, EXPECTED_REPORTS, 0.25);
    let late = reports(&received(4, "radio.duplication = 1\nradio.latency_s = { uniform = { min = 0.0, max = 1.0 } }"));
    let apart = |one: &Received, other: &Received| {
        (one.from, one.to, one.sent_s) == (other.from, other.to, other.sent_s) && one.at_s != other.at_s
    };
    assert!(late.iter().any(|one| late.iter().any(|other| apart(one, other))));
}

#[test]
fn radio_is_ideal_after_until_s() {
    let fault = "[radio]\npacket_loss = 0.5\nduplication = 0.5\nlatency_s = { uniform = { min = 0.0, max = 3.0 } }\nrange_m = 1\n\
                 bandwidth_bytes_per_s = 10\nfault_until_s = 40\n[[radio.link]]\nfrom = 1\nto = 0\npacket_loss = 1\n";
    let received = reports(&received(4, fault));
    assert!(received.iter().all(|received| received.at_s >= 40.0), "nothing is received out of range");
    // Queued messages are finally sent: at most one second's worth, which is less than one message.
    assert_eq!(received.len(), (201 - 80) * 12);
    assert!(received.iter().all(|received| received.at_s == received.sent_s));
    // Messages in transit keep their delay.
    let late = reports(&self::received(2, "radio.latency_s = 2\nradio.fault_until_s = 40"));
    assert_eq!(late.len(), 2 * 201);
    assert!(
        late.iter().all(|received| received.at_s - received.sent_s == if received.sent_s < 40.0 { 2.0 } else { 0.0 })
    );
}

/// It also applies after `until_s`, and exactly from its first time step to before its end.
#[test]
fn partition_separates_its_sides_and_isolates_other_uavs() {
    let partition = "radio = { fault_until_s = 0, partition = [{ from_s = 20, until_s = 40, sides = [[0, 2], [1]] }] }";
    let received = reports(&received(4, partition));
    let cut = |received: &Received| (20.0..40.0).contains(&received.at_s);
    let (during, outside): (Vec<_>, Vec<_>) = received.into_iter().partition(cut);
    assert_eq!(outside.len(), (201 - 40) * 12);
    assert_eq!(during.len(), 40 * 2);
    assert!(during.iter().all(|received| matches!((received.from, received.to), (0, 2) | (2, 0))));
    // Of two simultaneous partitions, both apply.
    let both = "radio = { partition = [{ sides = [[0, 1], [2, 3]] }, { from_s = 50, sides = [[0, 2, 3], [1]] }] }";
    let received = reports(&self::received(4, both));
    assert!(received.iter().filter(|received| received.at_s >= 50.0).all(|received| received.from + received.to == 5));
    assert_eq!(received.len(), 100 * 4 + 101 * 2);
}

/// Two UAVs fly apart at 80 m/s.
#[test]
fn nothing_is_received_beyond_the_range() {
    let text = "radio.range_m = 1010\nuavs.start = [{ heading_deg = 0 }, { heading_deg = 180 }]\n[[targets.start]]\n";
    let received = reports(&flown(&scenario(text), 1, 0).0.received);
    assert_eq!(received.len(), 2 * 26);
    assert!(received.iter().all(|received| received.at_s <= 12.5));
}

#[test]
fn link_is_directed_and_inherits_unset_keys() {
    let link = "[radio]\nlatency_s = 0.5\n[[radio.link]]\nfrom = 0\nto = 1\npacket_loss = 1\n[[radio.link]]\nfrom = 2\nto = 1\n\
                latency_s = 1\n";
    let received = reports(&received(3, link));
    let of = |from, to| received.iter().filter(move |received| (received.from, received.to) == (from, to));
    assert_eq!(of(0, 1).count(), 0);
    for (from, to) in [(1, 0), (1, 2), (0, 2), (2, 0)] {
        assert_eq!(of(from, to).count(), 200);
        assert!(of(from, to).all(|received| received.at_s - received.sent_s == 0.5));
    }
    assert_eq!(of(2, 1).count(), 199);
    assert!(of(2, 1).all(|received| received.at_s - received.sent_s == 1.0));
    let better = "[radio]\npacket_loss = 1\nlatency_s = 0.5\n[[radio.link]]\nfrom = 0\nto = 1\npacket_loss = 0\n[[radio.link]]\nfrom = 2\n\
                  to = 1\nlatency_s = 0\n";
    let received = reports(&self::received(3, better));
    assert_eq!(received.len(), 200);
    assert!(
        received.iter().all(|received| (received.from, received.to, received.at_s - received.sent_s) == (0, 1, 0.5))
    );
}

/// Of three messages per time step, two are sent, and up to four can be queued.
#[test]
fn messages_beyond_the_bandwidth_are_queued_then_dropped() {
    let size = size_bytes(0);
    let budget = format!("radio.bandwidth_bytes_per_s = {}", 4 * size);
    let (log, _, sent) = flown(&team(2, &budget), 3, 0);
    let own = log.received.iter().filter(|received| received.from == 0);
    let mut received: Vec<_> = own.map(|received| (received.at_s, received.sent_s, received.number)).collect();
    assert!(sent.iter().all(|sent| *sent == [SentCounts { messages: 2, bytes: 2 * size }; 2]));
    received.truncate(14);
    let expected = [
        [(0.0, 0.0, 0), (0.0, 0.0, 1)],
        [(0.5, 0.0, 2), (0.5, 0.5, 0)],
        [(1.0, 0.5, 1), (1.0, 0.5, 2)],
        [(1.5, 1.0, 0), (1.5, 1.0, 1)],
        [(2.0, 1.0, 2), (2.0, 1.5, 0)],
        [(2.5, 1.5, 1), (2.5, 1.5, 2)],
        // The third message of 2.0 s did not fit into the queue.
        [(3.0, 2.0, 0), (3.0, 2.0, 1)],
    ];
    assert_eq!(received, expected.concat());
    // A message larger than the budget of a time step takes several.
    let detections = (0..).find(|detections| size_bytes(*detections) > 2 * size).unwrap();
    let (log, _, sent) = flown(&team(2, &budget), 1, detections);
    let first = log.received.iter().find(|received| received.from == 0).unwrap();
    assert_eq!((first.sent_s, first.at_s), (0.0, 0.5));
    let (bytes, second) = (sent.iter().map(|sent| sent[0].bytes).sum::<u64>(), 4 * size);
    assert!((99 * second..=101 * second).contains(&bytes), "{bytes} of {second} a second");
    // Without a budget, everything is sent and counted, also by an ideal radio.
    for fault in ["", "[radio]"] {
        let sent = flown(&team(2, fault), 3, 1).2;
        assert!(sent.iter().all(|sent| *sent == [SentCounts { messages: 3, bytes: 3 * size_bytes(1) }; 2]), "{fault}");
    }
}

/// The send queue is cleared when an outage starts.
#[test]
fn outage_clears_the_send_queue() {
    let outage = "uavs.outage = [{ uav = 0, from_s = 20, until_s = 30 }]";
    let received = reports(&received(2, &format!("radio.bandwidth_bytes_per_s = {}\n{outage}", size_bytes(0))));
    let of = |from| received.iter().filter(move |received| received.from == from && received.sent_s <= 20.0);
    assert!(of(1).any(|received| received.at_s >= 20.0) && of(0).all(|received| received.at_s < 20.0));
    assert!(received.iter().any(|received| received.from == 0 && received.sent_s >= 30.0));
}

/// Its computer is off from 20 s to before 25.2 s.
#[test]
fn uav_without_computer_circles_without_sensing_and_sending() {
    let text = "uavs = { start = [{ x_m = -400 }, { x_m = 400 }], restart = [{ uav = 0, at_s = 20, down_s = 5.2 }, \
                { uav = 0, at_s = 60.1, down_s = 0.2 }] }\n[[targets.start]]\n";
    let (log, frames, sent) = flown(&scenario(text), 1, 0);
    let is_off = |s: f64| (20.0..25.2).contains(&s);
    for of in [0, 1] {
        let observed: Vec<f64> = log.observed.iter().filter(|(uav, ..)| *uav == of).map(|(_, s, _)| *s).collect();
        let on = (0..=200).map(|tick| f64::from(tick) / 2.0).filter(|s| of == 1 || !is_off(*s));
        assert_eq!(observed, on.collect::<Vec<_>>());
    }
    assert!(reports(&log.received).iter().all(|received| !is_off(received.at_s)));
    assert_eq!(reports(&log.received).len(), 2 * (201 - 11));
    assert_eq!(log.decided, 2 * 201 - 11);
    // The second restart begins and ends between two time steps.
    assert_eq!(log.restarts, [(0, 1), (0, 2)]);
    let before = &frames[39].uavs[0];
    assert!(before.boresight_rad.is_some());
    for (frame, sent) in frames.iter().zip(&sent) {
        let (s, row) = (frame.time_us as f64 / 1e6, &frame.uavs[0]);
        assert_eq!(sent[0].messages, u64::from(!is_off(s)));
        if is_off(s) {
            assert_eq!((row.group, row.boresight_rad, row.commanded_altitude_m), (None, None, None));
            assert_eq!((row.speed_command_m_s, row.turn_rate_command_rad_s), (40.0, 40.0 / 250.0));
            assert!(frame.detections.iter().all(|detection| detection.uav == 1));
        } else {
            assert_eq!(row.turn_rate_command_rad_s, 0.0);
        }
    }
    // The sensor is pointed one time step after the first pointing command.
    assert_eq!(frames[51].uavs[0].boresight_rad, None);
    assert!(frames[52].uavs[0].boresight_rad.is_some());
}

/// Messages that arrive while the computer is off are lost; later ones are received.
#[test]
fn messages_to_a_computer_that_is_off_are_lost() {
    let late = "radio.latency_s = 3\nuavs.restart = [{ uav = 0, at_s = 20, down_s = 5 }]";
    let received = reports(&received(2, late));
    let to_0: Vec<f64> = received.iter().filter(|received| received.to == 0).map(|received| received.at_s).collect();
    let expected = (6..=200).map(|tick| f64::from(tick) / 2.0).filter(|s| !(20.0..25.0).contains(s));
    assert_eq!(to_0, expected.collect::<Vec<_>>());
    // Messages that it sent earlier are received.
    assert!(received.iter().any(|received| received.from == 0 && received.at_s == 22.5));
}

#[test]
fn late_start_is_drawn_per_uav_and_has_restart_count_zero() {
    let (log, frames, _) = flown(&team(4, "uavs.boot_delay_s = 10.2"), 1, 0);
    assert!(log.observed.iter().all(|(_, s, _)| *s >= 10.5) && log.observed.len() == 4 * (201 - 21));
    assert_eq!(log.restarts, []);
    let cues =
        |log: &Log| log.received.iter().filter(is_cue).map(|cue| (cue.at_s, cue.sent_s, cue.to)).collect::<Vec<_>>();
    assert_eq!(cues(&log), [0, 1, 2, 3].map(|to| (10.5, 10.5, to)), "cues wait until a computer runs");
    assert_eq!(frames[0].uavs[3].turn_rate_command_rad_s, 40.0 / 250.0);
    let drawn = |uavs| {
        let log = flown(&team(uavs, "uavs.boot_delay_s = { uniform = { min = 5.0, max = 50.0 } }"), 1, 0).0;
        let first = |of: u32| log.observed.iter().find(|(uav, ..)| *uav == of).unwrap().1;
        let starts = (0..3).map(first).collect::<Vec<_>>();
        let earliest_s = starts.iter().copied().fold(first(uavs as u32 - 1), f64::min);
        assert!(
            cues(&log).iter().all(|cue| cue.0 == earliest_s) && cues(&log).len() < uavs,
            "cues are sent once, to the running computers"
        );
        starts
    };
    let starts = drawn(3);
    assert!(starts.iter().all(|s| (5.0..=50.5).contains(s)) && starts[0] != starts[1] && starts[1] != starts[2]);
    assert_eq!(starts, drawn(4));
    // The time of a restart counts from the first start of the computer.
    let restarts =
        "uavs = { boot_delay_s = 10, restart = [{ uav = 0, at_s = 3 }, { uav = 0, at_s = 30, down_s = 2 }] }";
    assert_eq!(flown(&scenario(&format!("{restarts}\n[[targets.start]]\n")), 1, 0).0.restarts, [(0, 1)]);
}

#[test]
fn clock_error_affects_only_the_time_passed_to_the_agent() {
    let text = |clock: &str| {
        format!("uavs.count = 2\nsensor.range_sd_m = 5\nsensor.bearing_sd_deg = 1\n{clock}\n[[targets.start]]\n")
    };
    let right = flown(&scenario(&text("[radio]")), 1, 0);
    let wrong = flown(&scenario(&text("uavs.clock = [{ uav = 1, offset_s = -3.25, drift_ppm = 200 }]")), 1, 0);
    assert_eq!(right.1, wrong.1, "motion and detections are unchanged");
    for (right, wrong) in right.0.observed.iter().zip(&wrong.0.observed) {
        assert_eq!((right.0, &right.2), (wrong.0, &wrong.2));
        let ahead_s = if right.0 == 1 { -3.25 + 200e-6 * right.1 } else { 0.0 };
        assert!((wrong.1 - right.1 - ahead_s).abs() < 1e-6);
    }
    assert!(
        wrong.0.received.iter().any(|received| received.from == 1 && received.sent_s == -3.25),
        "its reports have the wrong time"
    );
}

/// All radio faults together.
const ALL: &str = "[radio]\npacket_loss = 0.3\nduplication = 0.2\nlatency_s = { uniform = { min = 0.0, max = 2.0 } }\n";

/// Another UAV or another fault changes no draws of the others.
#[test]
fn draws_are_keyed_by_sender_receiver_and_time() {
    let three = received(3, ALL);
    let of_three: Vec<_> = received(4, ALL)
        .into_iter()
        .filter(|received| received.to < 3 && (received.from < 3 || received.from == OUTSIDE))
        .collect();
    assert_eq!(three, of_three);
    let link = format!("{ALL}[[radio.link]]\nfrom = 2\nto = 0\npacket_loss = 1\n");
    let restart = format!("uavs.restart = [{{ uav = 2, at_s = 20, down_s = 20 }}]\n{ALL}");
    let outage = format!("uavs.outage = [{{ uav = 2, from_s = 20, until_s = 40 }}]\n{ALL}");
    for (fault, keeps_receiving) in [(link, true), (restart, false), (outage, true)] {
        let is_other = |received: &&Received| received.from != 2 && (keeps_receiving || received.to != 2);
        let other = |received: &[Received]| received.iter().filter(is_other).copied().collect::<Vec<_>>();
        let faulty = received(3, &fault);
        assert_ne!(faulty, three, "{fault}");
        assert_eq!(other(&faulty), other(&three), "{fault}");
    }
    // Other messages of the same sender have no influence either: the first message of a time step is received or lost
    // as if it were alone.
    let more = flown(&team(3, ALL), 2, 0).0.received;
    let first: Vec<_> = more.into_iter().filter(|received| received.from == OUTSIDE || received.number == 0).collect();
    assert_eq!(first, three);
    // Another seed does have an influence.
    let other_seed = template(&format!("uavs.count = 3\n{ALL}\n[[targets.start]]\n")).unwrap().draw(2).unwrap();
    assert_ne!(flown(&other_seed, 1, 0).0.received, three);
}

/// Agents with a configured, but faultless radio fly as with the default radio, to the bit, including computers that
/// start immediately and restarts after the end.
#[test]
fn radio_without_faults_changes_no_bit() {
    for name in ["paper/table-2-pair", "tour/04-two-groups", "traffic/convoy"] {
        // Otherwise, a radio implies another policy.
        let common = "groups.altitude_policy=common";
        let set = [common, "radio={}", "uavs.boot_delay_s=0", "uavs.restart=[{uav=0,at_s=1e6}]"];
        let [plain, configured] = [&[common][..], &set].map(|set| load(name, set, 3));
        let frames = |scenario: &Scenario| {
            let controller = team_controller(
                AgentSetup::PerUav,
                plain.settings.team,
                plain.settings.geofence.clone(),
                Vec::new(),
                plain.uavs.len(),
            )
            .unwrap();
            let mut mission = Mission::with_controller(scenario, controller).unwrap();
            std::iter::from_fn(|| mission.frame().cloned()).collect::<Vec<_>>()
        };
        assert!(frames(&plain) == frames(&configured), "{name}");
    }
}

/// A resolved scenario gives the same run and keeps the distributions of values that are drawn many times.
#[test]
fn resolved_scenario_has_the_same_faults() {
    let fault = format!(
        "uavs.boot_delay_s = {{ uniform = {{ min = 0.0, max = 5.0 }} }}\n\
         uavs.restart = [{{ uav = 1, at_s = {{ uniform = {{ min = 30.0, max = 40.0 }} }}, down_s = 3 }}]\n\
         uavs.clock = [{{ uav = 0, drift_ppm = 3 }}]\n{ALL}bandwidth_bytes_per_s = 500\n[[radio.link]]\npacket_loss = 0.4\n\
         [[radio.partition]]\nfrom_s = 10\nuntil_s = 20\nsides = [[0, 1], [2]]\n"
    );
    let first = team(3, &fault);
    let again = scenario(&first.resolved().unwrap());
    assert_eq!((&again.radio, &again.starts_s, &again.restarts), (&first.radio, &first.starts_s, &first.restarts));
    assert_eq!(frames(&again), frames(&first));
    assert_eq!(again.resolved(), first.resolved());
    let typed = template(&format!("uavs.count = 3\n{fault}\n[[targets.start]]\n")).unwrap();
    assert_eq!(scenario(&typed.text().unwrap()).resolved(), first.resolved());
    assert!((30.0..40.0).contains(&first.restarts[0].at_s));
}

/// Wraps the built-in controller and records the restart counts in its reports.
struct Spy {
    inner: Box<dyn Controller + Send>,
    restart_counts: Rc<RefCell<Vec<(u32, u32)>>>,
}

impl Controller for Spy {
    fn restart(&mut self, uav: UavId, restart_count: u32) {
        self.inner.restart(uav, restart_count);
    }
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        self.inner.observe(now, uav, own, scan);
        if let Some(Message::Report(report)) = self.inner.outbox(uav).first() {
            self.restart_counts.borrow_mut().push((uav.0, report.restart_count));
        }
    }
    fn outbox(&self, uav: UavId) -> &[Message] {
        self.inner.outbox(uav)
    }
    fn receive(&mut self, uav: UavId, message: &Message) {
        self.inner.receive(uav, message);
    }
    fn decide(&mut self, uav: UavId) -> AgentOutput {
        self.inner.decide(uav)
    }
    fn reported(&self) -> ReportedTables {
        self.inner.reported()
    }
    fn report(&self, beliefs: &mut ReportedState) {
        self.inner.report(beliefs);
    }
}

/// Built-in controller: the agent restarts with an empty team state and the next restart count. Meanwhile, the team
/// state of the next agent is recorded.
#[test]
fn restarted_agent_has_an_empty_state_and_the_next_restart_count() {
    let restart = |uavs: usize| {
        let fault = "uavs.restart = [{ uav = 0, at_s = 20, down_s = 5 }]";
        let scenario = team(uavs, fault);
        let inner = team_controller(
            AgentSetup::PerUav,
            scenario.settings.team,
            scenario.settings.geofence.clone(),
            Vec::new(),
            uavs,
        )
        .unwrap();
        let restart_counts: Rc<RefCell<Vec<(u32, u32)>>> = Rc::default();
        let mut mission =
            Mission::with_controller(&scenario, Spy { inner, restart_counts: Rc::clone(&restart_counts) }).unwrap();
        let frames: Vec<_> = std::iter::from_fn(|| mission.frame().cloned()).collect();
        let restart_counts = restart_counts.borrow().clone();
        (frames, restart_counts)
    };
    let (alone, restart_counts) = restart(1);
    assert_eq!((alone[39].tracks.len(), alone[40].tracks.len()), (1, 0));
    assert!(
        alone[40..].iter().all(|frame| frame.tracks.is_empty() && frame.groups.is_empty()),
        "there is no second cue"
    );
    assert_eq!(restart_counts, [[(0, 0); 40].as_slice(), &[(0, 1); 151]].concat());
    let (pair, restart_counts) = restart(2);
    assert!(pair[40..50].iter().all(|frame| frame.tracks.len() == 1), "the tracks of the other agent");
    assert!(
        pair[40..50].windows(2).all(|two| two[0].tracks[0].covariance != two[1].tracks[0].covariance),
        "the other agent keeps updating"
    );
    // The tracks of the first agent again, from nothing but the current reports of the other one.
    let variance_m2 = |frame: &Frame| frame.tracks[0].covariance[0];
    assert!(variance_m2(&pair[50]) > 4.0 * variance_m2(&pair[49]));
    assert!(restart_counts.iter().all(|(uav, restart_count)| *uav == 0 || *restart_count == 0));
}

/// Built-in controller with all faults: the commands stay within their limits, and a run is a function of scenario and
/// seed.
#[test]
fn built_in_controller_stays_within_limits_under_all_faults() {
    let fault = format!(
        "uavs.boot_delay_s = {{ uniform = {{ min = 0.0, max = 9.0 }} }}\nuavs.restart = [{{ at_s = 40, down_s = 9 }}]\n\
         uavs.clock = [{{ uav = 1, offset_s = 700 }}, {{ uav = 2, drift_ppm = -1e5 }}]\n{ALL}"
    );
    let scenario = team(4, &fault);
    let flown = frames(&scenario);
    assert_eq!(flown, frames(&scenario));
    for row in flown.iter().flat_map(|frame| &frame.uavs) {
        assert!((25.0..=55.0).contains(&row.speed_command_m_s) && row.turn_rate_command_rad_s.abs() <= 0.3);
        assert!(row.x_m.is_finite() && row.y_m.is_finite());
    }
}

#[test]
fn faults_require_one_agent_per_uav() {
    let agents = |fault: &str| {
        template(&format!("{fault}\n[[targets.start]]\n")).and_then(|template| {
            template.draw(1).map(|scenario| scenario.settings.agents).map_err(|error| error.to_string())
        })
    };
    let faults = ["[radio]", "uavs.boot_delay_s = 0", "uavs.restart = [{}]", "uavs.clock = [{}]"];
    assert_eq!(agents(""), Ok(AgentSetup::Shared));
    assert_eq!(agents("team.agents = \"per-uav\""), Ok(AgentSetup::PerUav));
    // If messages may be missing, altitudes and turns must not depend on agreement.
    assert_eq!(
        (team(2, "").settings.team.link, team(2, "[radio]").settings.team.link),
        (LinkModel::Ideal, LinkModel::Lossy)
    );
    for fault in faults {
        assert_eq!(agents(fault), Ok(AgentSetup::PerUav), "{fault}");
        assert_eq!(agents(&format!("team.agents = \"per-uav\"\n{fault}")), Ok(AgentSetup::PerUav), "{fault}");
        let refused = agents(&format!("team.agents = \"shared\"\n{fault}")).unwrap_err();
        let expected = "mine:1:6: team.agents = \"shared\": a single agent for all UAVs needs an ideal radio: with [radio], \
                        restarts, late starts or clocks set \"per-uav\", or leave out the key";
        assert_eq!(refused, expected, "{fault}");
    }
    let shared = overrides(&["radio={}", "team.agents=shared"]);
    let one = Scenario::load("tour/04-two-groups", &shared, 3).unwrap_err().to_string();
    assert!(one.starts_with("command line: team.agents = \"shared\": a single agent"), "{one}");
    let other = load("tour/04-two-groups", &["radio={}", "team.teammate_timeout_s=5"], 3);
    assert_eq!(other.settings.agents, AgentSetup::PerUav);
}

#[test]
fn errors_in_faults_are_reported_at_their_key() {
    let wrong = |fault: &str, expected: &str| {
        let text = format!("[[targets.start]]\n[uavs]\ncount = 3\n{fault}\n");
        let drawn = template(&text).and_then(|template| template.draw(1).map_err(|error| error.to_string()));
        let error = drawn.unwrap_err();
        let (_, message) = error.split_once(": ").unwrap();
        assert_eq!(message, expected, "{error}");
        assert!(error.starts_with("mine:4:") || error.starts_with("mine:5:"), "{error}");
    };
    let probability = "must be at least 0 and at most 1";
    wrong("[radio]\npacket_loss = 1.5", &format!("radio.packet_loss = 1.5: {probability}"));
    wrong("[radio]\npacket_loss = nan", "radio.packet_loss = nan: must be a finite number");
    wrong(
        "[radio]\npacket_loss = { uniform = { min = 0, max = 2 } }",
        &format!("radio.packet_loss: up to 2: {probability}"),
    );
    wrong("[radio]\nduplication = -1", &format!("radio.duplication = -1: {probability}"));
    wrong("[radio]\nlatency_s = -0.1", "radio.latency_s = -0.1: must be at least 0 and at most 120");
    wrong(
        "[radio]\nlatency_s = { normal = { mean = 1, sd = 1 } }",
        "radio.latency_s: up to -5: must be at least 0 and at most 120",
    );
    wrong("[radio]\nrange_m = 0", "radio.range_m = 0: must be above 0 and at most 10000000");
    wrong(
        "[radio]\nbandwidth_bytes_per_s = 0",
        "radio.bandwidth_bytes_per_s = 0: must be above 0 and at most 1000000000",
    );
    wrong("[radio]\nfault_until_s = -1", "radio.fault_until_s = -1: must be at least 0 and at most 1000000000");
    wrong("[radio]\npacket_los = 1", "radio.packet_los: there is no such key; did you mean `packet_loss`?");
    let one = "must be at least 0 and at most 2 (one of the UAVs, counted from 0)";
    wrong("[[radio.link]]\nto = 3", &format!("radio.link.0.to = 3: {one}"));
    wrong("[[radio.link]]\nto = 0", "radio.link.0.to = 0: must be another UAV than `from`");
    wrong("[[radio.link]]\nfrom = 0.5", "radio.link.0.from = 0.5: must be a whole number");
    wrong("[[radio.link]]\npacket_loss = 2", &format!("radio.link.0.packet_loss = 2: {probability}"));
    wrong(
        "[radio]\nlink = [{ from = 0, to = 1 }, { from = 0, to = 1 }]",
        "radio.link.1: is the second link between the same two UAVs; keep one",
    );
    wrong("[[radio.partition]]\nsides = []", "radio.partition.0.sides: must be lists of UAVs, like [[0, 1], [2, 3]]");
    wrong("[[radio.partition]]\nsides = 3", "radio.partition.0.sides = 3: must be an array, in []");
    wrong("[[radio.partition]]\nsides = [[0, 7]]", &format!("radio.partition.0.sides.0.1 = 7: {one}"));
    wrong(
        "[[radio.partition]]\nsides = [[0, 1], [2, 0]]",
        "radio.partition.0.sides.1.1 = 0: is listed already; a UAV is on one side, and once",
    );
    wrong(
        "[radio]\npartition = [{ from_s = 9, until_s = 3, sides = [[0]] }]",
        "radio.partition.0.until_s = 3: must be at least 9 and at most 1000000000 (not before from_s)",
    );
    wrong("boot_delay_s = -1", "uavs.boot_delay_s = -1: must be at least 0 and at most 1000000000");
    wrong("[[uavs.restart]]\nuav = 3", &format!("uavs.restart.0.uav = 3: {one}"));
    wrong("[[uavs.restart]]\nat_s = -1", "uavs.restart.0.at_s = -1: must be at least 0 and at most 1000000000");
    wrong("[[uavs.restart]]\ndown_s = -1", "uavs.restart.0.down_s = -1: must be at least 0 and at most 1000000000");
    wrong("[[uavs.clock]]\nuav = -1", &format!("uavs.clock.0.uav = -1: {one}"));
    wrong(
        "[[uavs.clock]]\noffset_s = 1e7",
        "uavs.clock.0.offset_s = 10000000: must be at least -1000000 and at most 1000000",
    );
    wrong(
        "[[uavs.clock]]\ndrift_ppm = -1e6",
        "uavs.clock.0.drift_ppm = -1000000: must be at least -100000 and at most 100000",
    );
    wrong("clock = [{ uav = 1 }, { uav = 1 }]", "uavs.clock.1.uav = 1: already has a clock; at most one per UAV");
}

/// Whatever the radio does to messages, a committed state follows to the bit from the messages sent, each counted
/// once.
#[test]
fn no_report_counts_twice_under_any_radio_fault() {
    let faults = [
        &["radio={}"][..],
        &["radio.packet_loss=0.5"],
        &["radio.latency_s={uniform=[0, 3]}", "radio.duplication=0.5"],
        &["radio.packet_loss=0.2", "radio.partition=[{from_s=20,until_s=50,sides=[[0,1],[2,3]]}]"],
        &["radio.packet_loss=0.2", "uavs.restart=[{uav=0,at_s=30,down_s=10}, {uav=2,at_s=50.2,down_s=0.1}]"],
        &["uavs.boot_delay_s={uniform=[0, 20]}", "radio.packet_loss=0.2"],
        &["geofence=[{vertices=[[100,100],[900,100],[900,900],[100,900]]}]", "radio.packet_loss=0.2"],
        &[
            "priorities=[{priority=9,targets=[\"target-1\"]},{priority=3,x_m=0,y_m=0,radius_m=300}]",
            "radio.packet_loss=0.2",
            "uavs.restart=[{uav=0,at_s=30,down_s=10}]",
        ],
    ];
    for fault in faults {
        for seed in 1..3 {
            let Comparison { compared, differ, double_counted } =
                compare_while_flying(&load("tour/04-two-groups", fault, seed));
            assert_eq!((differ, double_counted), (0, 0), "{fault:?}, seed {seed}");
            assert!(compared > 900, "{fault:?}, seed {seed}: {compared}");
        }
    }
}

/// Scores computed from a record equal those of the flight, including those of each agent and the end of the last
/// fault.
#[test]
fn record_of_several_agents_gives_the_scores_of_the_flight() {
    let faults = "duration_s = 60
        [radio]
        packet_loss = 0.2
        [[radio.partition]]
        until_s = 30.0
        sides = [[0], [1, 2]]
        [[radio.partition]]
        from_s = 40.0
        until_s = 70.0
        sides = [[0, 1, 2]]
        [[uavs.restart]]
        uav = 1
        at_s = 35.0
        down_s = 5.0
        [[targets.start]]
        [[targets.start]]
        x_m = 900.0
        [[priorities]]
        priority = 5
        targets = [\"target-1\"]
        [[priorities]]
        priority = 2
        x_m = 0
        y_m = 0
        radius_m = 20
        ";
    let scenario = scenario(&format!("uavs.count = 3\nuavs.boot_delay_s = {{ uniform = [0, 5] }}\n{faults}"));
    assert_eq!(scenario.settings.faults_end_s, Some(40.0), "faults that end after the mission do not count");
    let choice = MetricSelection::parse("all").unwrap();
    let mut mission = Mission::new(&scenario).unwrap();
    let home = tempfile::tempdir().unwrap();
    let dir = home.path().join("run");
    let mut writer = writer(&dir, &scenario);
    let mut flown = Scorer::new(mission.score_config(), choice);
    while let Some(frame) = mission.frame() {
        flown.frame(frame);
        writer.frame(frame).unwrap();
    }
    writer.finish().unwrap();
    let record = Record::open(&dir).unwrap();
    let settings = Settings::of_record("mine", record.scenario_toml(), record.target_names()).unwrap();
    let mut read = Scorer::new(settings.score_config(), choice);
    record.frames().unwrap().for_each(|frame| read.frame(&frame.unwrap()));
    assert_eq!(flown.metrics(), read.metrics());
    let metrics = read.metrics();
    assert!(metrics["assignment_disagreement_fraction"] > Some(0.0) && metrics["sent_bytes_per_s"] > Some(0.0));
    assert!(metrics["reconvergence_time_s"].is_some());
    assert!(metrics["priority_custody_fraction"].is_some_and(|fraction| fraction > 0.5));
    let Comparison { compared, differ, double_counted } = compare_while_flying(&scenario);
    assert!(compared > 0 && (differ, double_counted) == (0, 0), "{compared}, {differ}, {double_counted}");
    // Without faults, and with faults that do not end, there is no end time.
    assert_eq!(team(2, "radio.packet_loss = 0.1").settings.faults_end_s, None);
    assert_eq!(team(2, "radio = { packet_loss = 0.1, fault_until_s = 99 }").settings.faults_end_s, Some(99.0));
}
