//! A radio that fails, and computers and clocks that do: each key does what docs/scenarios.md says, and nothing else.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

use standoff::{
    Angle, Command, Detection, LookAt, Message, Position, Radio, RangeBearing, Report, Scan, Step, TargetLabel, Time,
    UavId, UavState, Velocity,
};
use standoff_sim::brain::{Beliefs, Brain, Reported, of_team};
use standoff_sim::radio::Sent;
use standoff_sim::record::{Frame, Manifest, Record, Writer};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Edits, Minds, Scenario, Settings, Template};
use standoff_sim::score::{Choice, Metrics, Rules, Scorer};
use standoff_sim::world::World;

fn template(text: &str) -> Result<Template, String> {
    Template::of_toml("mine", text, &Edits::default(), Path::new("")).map_err(|error| error.to_string())
}

fn scenario(text: &str) -> Scenario {
    template(text).and_then(|template| template.draw(1).map_err(|error| error.to_string())).unwrap()
}

/// So many UAVs over a target, with a fault, for 100 s of two instants a second.
fn team(uavs: usize, fault: &str) -> Scenario {
    scenario(&format!("uavs.count = {uavs}\n{fault}\n[[targets.at]]\n"))
}

/// A cue's place in the order of speakers.
const OUTSIDE: u32 = u32::MAX;

/// What a UAV heard, and when by the true time.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct Heard {
    at_s: f64,
    to: u32,
    from: u32,
    said_s: f64,
    number: u32,
}

#[derive(Debug, Clone, Default, PartialEq)]
struct Log {
    heard: Vec<Heard>,
    /// Who observed, when by its clock, and the bearings that it saw.
    observed: Vec<(u32, f64, Vec<f64>)>,
    restarts: Vec<(u32, u32)>,
    decided: usize,
}

fn report(uav: UavId, sequence: u32, now: Time, own: UavState, detections: usize) -> Message {
    let measurement = RangeBearing { range_m: 1.0, bearing: Angle::from_rad(0.0) };
    let detection = |label| Detection { label: TargetLabel(label), measurement };
    let detections = (0..detections as u32).map(detection).collect();
    Message::Report(Report { sequence, detections, ..Report::of(uav, now, own) })
}

/// What one with so many detections takes.
fn size_bytes(detections: usize) -> u64 {
    let own = scenario("[[targets.at]]\n").uavs[0];
    report(UavId(0), 0, Time::START, own, detections).size_bytes() as u64
}

/// Says so many reports an instant, with so many detections each, flies straight on, looks at the origin, and writes down
/// what happens to it.
struct Talker {
    says: u32,
    detections: usize,
    outbox: Vec<Vec<Message>>,
    now_s: Vec<f64>,
    log: Rc<RefCell<Log>>,
}

impl Brain for Talker {
    fn restart(&mut self, uav: UavId, epoch: u32) {
        self.log.borrow_mut().restarts.push((uav.0, epoch));
    }
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        let place = uav.0 as usize;
        self.outbox.resize(self.outbox.len().max(place + 1), Vec::new());
        self.now_s.resize(self.outbox.len(), 0.0);
        self.now_s[place] = now.s();
        let report = |sequence| report(uav, sequence, now, *own, self.detections);
        self.outbox[place] = (0..self.says).map(report).collect();
        let seen = scan.iter().flat_map(|scan| scan.detections).map(|seen| seen.measurement.bearing.rad()).collect();
        self.log.borrow_mut().observed.push((uav.0, now.s(), seen));
    }
    fn outbox(&self, uav: UavId) -> &[Message] {
        &self.outbox[uav.0 as usize]
    }
    fn hear(&mut self, uav: UavId, message: &Message) {
        let (from, said_s, number) = match message {
            Message::Report(report) => (report.uav.0, report.time.s(), report.sequence),
            Message::Cue(cue) => (OUTSIDE, cue.time.s(), cue.label.0),
            Message::Snapshot(_) | Message::Traffic(_) => panic!("nobody says that"),
        };
        let heard = Heard { at_s: self.now_s[uav.0 as usize], to: uav.0, from, said_s, number };
        self.log.borrow_mut().heard.push(heard);
    }
    fn decide(&mut self, _: UavId) -> Step {
        self.log.borrow_mut().decided += 1;
        let look_at = Some(LookAt { position: Position::ORIGIN, velocity: Velocity::ZERO });
        Step { look_at, ..Step::of(Command { speed_m_s: 40.0, turn_rate_rad_s: 0.0 }) }
    }
}

/// Flies a scenario whose UAVs say so much: what they heard, the frames, and what they sent instant by instant.
fn flown(scenario: &Scenario, says: u32, detections: usize) -> (Log, Vec<Frame>, Vec<Vec<Sent>>) {
    let log = Rc::default();
    let talker = Talker { says, detections, outbox: Vec::new(), now_s: Vec::new(), log: Rc::clone(&log) };
    let mut mission = Mission::with_brain(scenario, talker).unwrap();
    let (mut frames, mut sent) = (Vec::new(), Vec::new());
    while let Some(frame) = mission.frame().cloned() {
        frames.push(frame);
        sent.push(mission.sent().to_vec());
    }
    drop(mission);
    (Rc::try_unwrap(log).unwrap().into_inner(), frames, sent)
}

/// What a team of so many hears that says one thing an instant.
fn heard(uavs: usize, fault: &str) -> Vec<Heard> {
    flown(&team(uavs, fault), 1, 0).0.heard
}

fn is_cue(heard: &&Heard) -> bool {
    heard.from == OUTSIDE
}

/// The reports in it.
fn reports(heard: &[Heard]) -> Vec<Heard> {
    heard.iter().filter(|heard| !is_cue(heard)).copied().collect()
}

/// `share` of `of` is what a probability makes of them, within five standard errors.
#[track_caller]
fn check_share(count: usize, of: usize, share: f64) {
    let (count, of) = (count as f64, of as f64);
    let error = (of * share * (1.0 - share)).sqrt();
    assert!((count - of * share).abs() <= 5.0 * error, "{count} of {of}: not {share}");
}

/// Reports of four UAVs over 201 instants, each for three to hear.
const SAID: usize = 201 * 12;

#[test]
fn a_perfect_radio_carries_all_to_all_at_once_by_ascending_speaker() {
    for fault in ["", "[radio]", "radio.loss = 0", "radio.until_s = 0\nradio.loss = 1\nradio.delay_s = 9"] {
        let heard = heard(4, fault);
        assert_eq!(reports(&heard).len(), SAID, "{fault}");
        assert!(heard.iter().all(|heard| heard.at_s == heard.said_s && heard.to != heard.from));
        for to in 0..4 {
            let own: Vec<_> = heard.iter().filter(|heard| heard.to == to).collect();
            assert!(own.is_sorted_by_key(|heard| ((heard.at_s * 2.0) as u32, heard.from)), "{fault}");
            assert_eq!(own.iter().filter(|heard| is_cue(heard)).count(), 1);
        }
    }
}

/// A probability, fixed or drawn for each message and receiver: each one's own.
#[test]
fn so_many_are_lost_and_each_receiver_loses_others() {
    for (loss, mean) in [("0.2", 0.2), ("{ uniform = { min = 0.0, max = 1.0 } }", 0.5)] {
        let heard = reports(&heard(4, &format!("radio.loss = {loss}")));
        check_share(SAID - heard.len(), SAID, mean);
        for from in 0..4 {
            for to in (0..4).filter(|to| *to != from) {
                let of_pair = heard.iter().filter(|heard| (heard.from, heard.to) == (from, to)).count();
                check_share(201 - of_pair, 201, mean);
            }
        }
        // What two receivers lose of one speaker is independent, and so is what one loses of two: both are heard with
        // (1 - p)^2.
        let of =
            |from, to| heard.iter().filter(move |heard| (heard.from, heard.to) == (from, to)).map(|heard| heard.said_s);
        for (one, other) in [((0, 1), (0, 2)), ((0, 2), (1, 2)), ((0, 1), (1, 0))] {
            let both = of(one.0, one.1).filter(|said_s| of(other.0, other.1).any(|other_s| other_s == *said_s)).count();
            check_share(both, 201, (1.0 - mean) * (1.0 - mean));
        }
    }
}

/// Cues come over the same radio, each UAV's by itself.
#[test]
fn cues_are_lost_late_and_double_too_but_come_from_everywhere() {
    let cues = |fault: &str| {
        let text = format!("uavs.count = 2\nduration_s = 10\n{fault}\n[targets.scatter]\ncount = 500\n");
        let heard = flown(&scenario(&text), 1, 0).0.heard;
        heard.into_iter().filter(|heard| heard.from == OUTSIDE).collect::<Vec<_>>()
    };
    let lost = cues("radio.loss = 0.3");
    check_share(lost.len(), 1000, 0.7);
    let of = |to| lost.iter().filter(move |heard| heard.to == to).map(|heard| heard.number);
    check_share(of(0).filter(|cue| of(1).any(|other| other == *cue)).count(), 500, 0.49);
    let late = cues("radio.delay_s = 1.2");
    assert!(late.len() == 1000 && late.iter().all(|heard| (heard.said_s, heard.at_s) == (0.0, 1.5)));
    check_share(cues("radio.duplicate = 0.3").len() - 1000, 1000, 0.3);
    let alone = cues("radio.range_m = 1\nradio.bytes_per_s = 1\nradio.partition = [{ sides = [[]] }]");
    assert_eq!(alone.len(), 1000);
}

#[test]
fn what_is_late_is_heard_at_the_first_instant_after_it_came() {
    for (delay_s, heard_s) in
        [("0.049", 0.0), ("0.05", 0.5), ("0.3", 0.5), ("0.5", 0.5), ("0.51", 1.0), ("1.5", 1.5), ("120", 120.0)]
    {
        let heard = reports(&heard(2, &format!("radio.delay_s = {delay_s}")));
        assert!(heard.iter().all(|heard| heard.at_s - heard.said_s == heard_s), "{delay_s}");
        // What comes after the end is heard by nobody.
        assert_eq!(heard.len(), 2 * 201usize.saturating_sub((2.0 * heard_s) as usize), "{delay_s}");
    }
    // Eleven periods of 0.1 s, not twelve.
    let fine = flown(&scenario("period_s = 0.1\nuavs.count = 2\nradio.delay_s = 1.1\n[[targets.at]]\n"), 1, 0).0.heard;
    assert!(fine.iter().all(|heard| ((heard.at_s - heard.said_s) * 10.0).round() == 11.0));
}

/// Delays of each message and receiver, of three messages an instant: whatever comes together is heard in one order.
#[test]
fn what_comes_at_one_instant_is_heard_by_speaker_then_by_age_then_by_number() {
    let fault = "radio.delay_s = { uniform = { min = 0.0, max = 2.0 } }\nradio.duplicate = 0.5";
    let heard = flown(&team(3, fault), 3, 0).0.heard;
    for to in 0..3 {
        let own: Vec<_> = heard.iter().filter(|heard| heard.to == to).collect();
        let key = |heard: &&Heard| {
            [heard.at_s * 2.0, f64::from(heard.from), heard.said_s * 2.0, f64::from(heard.number)].map(|x| x as u64)
        };
        assert!(own.is_sorted_by_key(key));
        // Late by 0 to 4 instants, a fortieth at once; some of one instant overtake those of the one before.
        let late = |instants: f64| own.iter().filter(|heard| (heard.at_s - heard.said_s) * 2.0 == instants).count();
        assert!((0..=4).all(|instants| late(f64::from(instants)) > 0) && late(0.0) < late(1.0));
    }
    let late_of = |to| heard.iter().filter(move |heard| heard.to == to && heard.from == 2).map(|heard| heard.at_s);
    assert!(!late_of(0).eq(late_of(1)), "a delay for each receiver");
}

#[test]
fn so_many_are_heard_twice_each_with_a_delay_of_its_own() {
    let twice = reports(&heard(4, "radio.duplicate = 0.25"));
    check_share(twice.len() - SAID, SAID, 0.25);
    let late = reports(&heard(4, "radio.duplicate = 1\nradio.delay_s = { uniform = { min = 0.0, max = 1.0 } }"));
    let apart = |one: &Heard, other: &Heard| {
        (one.from, one.to, one.said_s) == (other.from, other.to, other.said_s) && one.at_s != other.at_s
    };
    assert!(late.iter().any(|one| late.iter().any(|other| apart(one, other))));
}

#[test]
fn from_until_s_on_the_radio_is_perfect() {
    let fault = "[radio]\nloss = 0.5\nduplicate = 0.5\ndelay_s = { uniform = { min = 0.0, max = 3.0 } }\nrange_m = 1\n\
                 bytes_per_s = 10\nuntil_s = 40\n[[radio.link]]\nfrom = 1\nto = 0\nloss = 1\n";
    let heard = reports(&heard(4, fault));
    assert!(heard.iter().all(|heard| heard.at_s >= 40.0), "out of range before");
    // What waited is sent at last: at most one second's worth, which no message has room in.
    assert_eq!(heard.len(), (201 - 80) * 12);
    assert!(heard.iter().all(|heard| heard.at_s == heard.said_s));
    // What is under way still comes when it would.
    let late = reports(&self::heard(2, "radio.delay_s = 2\nradio.until_s = 40"));
    assert_eq!(late.len(), 2 * 201);
    assert!(late.iter().all(|heard| heard.at_s - heard.said_s == if heard.said_s < 40.0 { 2.0 } else { 0.0 }));
}

/// Also after `until_s`, and exactly from the first instant to before the last.
#[test]
fn a_partition_cuts_between_its_sides_and_off_who_is_in_none() {
    let partition = "radio = { until_s = 0, partition = [{ from_s = 20, until_s = 40, sides = [[0, 2], [1]] }] }";
    let heard = reports(&heard(4, partition));
    let cut = |heard: &Heard| (20.0..40.0).contains(&heard.at_s);
    let (during, beside): (Vec<_>, Vec<_>) = heard.into_iter().partition(cut);
    assert_eq!(beside.len(), (201 - 40) * 12);
    assert_eq!(during.len(), 40 * 2);
    assert!(during.iter().all(|heard| matches!((heard.from, heard.to), (0, 2) | (2, 0))));
    // Of two at one time, both count.
    let both = "radio = { partition = [{ sides = [[0, 1], [2, 3]] }, { from_s = 50, sides = [[0, 2, 3], [1]] }] }";
    let heard = reports(&self::heard(4, both));
    assert!(heard.iter().filter(|heard| heard.at_s >= 50.0).all(|heard| heard.from + heard.to == 5));
    assert_eq!(heard.len(), 100 * 4 + 101 * 2);
}

/// Two fly apart at 80 m/s.
#[test]
fn beyond_its_range_nobody_is_heard() {
    let text = "radio.range_m = 1010\nuavs.at = [{ heading_deg = 0 }, { heading_deg = 180 }]\n[[targets.at]]\n";
    let heard = reports(&flown(&scenario(text), 1, 0).0.heard);
    assert_eq!(heard.len(), 2 * 26);
    assert!(heard.iter().all(|heard| heard.at_s <= 12.5));
}

#[test]
fn a_link_is_of_one_way_and_takes_from_the_radio_what_it_does_not_say() {
    let link = "[radio]\ndelay_s = 0.5\n[[radio.link]]\nfrom = 0\nto = 1\nloss = 1\n[[radio.link]]\nfrom = 2\nto = 1\n\
                delay_s = 1\n";
    let heard = reports(&heard(3, link));
    let of = |from, to| heard.iter().filter(move |heard| (heard.from, heard.to) == (from, to));
    assert_eq!(of(0, 1).count(), 0);
    for (from, to) in [(1, 0), (1, 2), (0, 2), (2, 0)] {
        assert_eq!(of(from, to).count(), 200);
        assert!(of(from, to).all(|heard| heard.at_s - heard.said_s == 0.5));
    }
    assert_eq!(of(2, 1).count(), 199);
    assert!(of(2, 1).all(|heard| heard.at_s - heard.said_s == 1.0));
    let better = "[radio]\nloss = 1\ndelay_s = 0.5\n[[radio.link]]\nfrom = 0\nto = 1\nloss = 0\n[[radio.link]]\nfrom = 2\n\
                  to = 1\ndelay_s = 0\n";
    let heard = reports(&self::heard(3, better));
    assert_eq!(heard.len(), 200);
    assert!(heard.iter().all(|heard| (heard.from, heard.to, heard.at_s - heard.said_s) == (0, 1, 0.5)));
}

/// Of three an instant two are sent, and four may wait.
#[test]
fn what_the_budget_does_not_hold_waits_and_then_is_dropped() {
    let size = size_bytes(0);
    let budget = format!("radio.bytes_per_s = {}", 4 * size);
    let (log, _, sent) = flown(&team(2, &budget), 3, 0);
    let own = log.heard.iter().filter(|heard| heard.from == 0);
    let mut heard: Vec<_> = own.map(|heard| (heard.at_s, heard.said_s, heard.number)).collect();
    assert!(sent.iter().all(|sent| *sent == [Sent { messages: 2, bytes: 2 * size }; 2]));
    heard.truncate(14);
    let expected = [
        [(0.0, 0.0, 0), (0.0, 0.0, 1)],
        [(0.5, 0.0, 2), (0.5, 0.5, 0)],
        [(1.0, 0.5, 1), (1.0, 0.5, 2)],
        [(1.5, 1.0, 0), (1.5, 1.0, 1)],
        [(2.0, 1.0, 2), (2.0, 1.5, 0)],
        [(2.5, 1.5, 1), (2.5, 1.5, 2)],
        // The third of 2.0 s found no room.
        [(3.0, 2.0, 0), (3.0, 2.0, 1)],
    ];
    assert_eq!(heard, expected.concat());
    // One that is more than an instant's worth takes as many as it needs.
    let detections = (0..).find(|detections| size_bytes(*detections) > 2 * size).unwrap();
    let (log, _, sent) = flown(&team(2, &budget), 1, detections);
    let first = log.heard.iter().find(|heard| heard.from == 0).unwrap();
    assert_eq!((first.said_s, first.at_s), (0.0, 0.5));
    let (bytes, second) = (sent.iter().map(|sent| sent[0].bytes).sum::<u64>(), 4 * size);
    assert!((99 * second..=101 * second).contains(&bytes), "{bytes} of {second} a second");
    // Without a budget all is sent, and counted: also by a perfect radio.
    for fault in ["", "[radio]"] {
        let sent = flown(&team(2, fault), 3, 1).2;
        assert!(sent.iter().all(|sent| *sent == [Sent { messages: 3, bytes: 3 * size_bytes(1) }; 2]), "{fault}");
    }
}

/// What waits when a UAV falls silent is forgotten.
#[test]
fn an_outage_empties_the_transmitter() {
    let outage = "uavs.outage = [{ uav = 0, from_s = 20, until_s = 30 }]";
    let heard = reports(&heard(2, &format!("radio.bytes_per_s = {}\n{outage}", size_bytes(0))));
    let of = |from| heard.iter().filter(move |heard| heard.from == from && heard.said_s <= 20.0);
    assert!(of(1).any(|heard| heard.at_s >= 20.0) && of(0).all(|heard| heard.at_s < 20.0));
    assert!(heard.iter().any(|heard| heard.from == 0 && heard.said_s >= 30.0));
}

/// From 20 s to before 25.2 s its computer is off.
#[test]
fn while_its_computer_is_off_a_uav_circles_unseeing_and_unheard() {
    let text = "uavs = { at = [{ x_m = -400 }, { x_m = 400 }], restart = [{ uav = 0, at_s = 20, down_s = 5.2 }, \
                { uav = 0, at_s = 60.1, down_s = 0.2 }] }\n[[targets.at]]\n";
    let (log, frames, sent) = flown(&scenario(text), 1, 0);
    let is_off = |s: f64| (20.0..25.2).contains(&s);
    for of in [0, 1] {
        let observed: Vec<f64> = log.observed.iter().filter(|(uav, ..)| *uav == of).map(|(_, s, _)| *s).collect();
        let on = (0..=200).map(|tick| f64::from(tick) / 2.0).filter(|s| of == 1 || !is_off(*s));
        assert_eq!(observed, on.collect::<Vec<_>>());
    }
    assert!(reports(&log.heard).iter().all(|heard| !is_off(heard.at_s)));
    assert_eq!(reports(&log.heard).len(), 2 * (201 - 11));
    assert_eq!(log.decided, 2 * 201 - 11);
    // The second one begins and ends between two instants.
    assert_eq!(log.restarts, [(0, 1), (0, 2)]);
    let before = &frames[39].uavs[0];
    assert!(before.boresight_rad.is_some());
    for (frame, sent) in frames.iter().zip(&sent) {
        let (s, row) = (frame.time_us as f64 / 1e6, &frame.uavs[0]);
        assert_eq!(sent[0].messages, u64::from(!is_off(s)));
        if is_off(s) {
            assert_eq!((row.group, row.boresight_rad, row.altitude_m), (None, None, None));
            assert_eq!((row.speed_command_m_s, row.turn_rate_command_rad_s), (40.0, 40.0 / 250.0));
            assert!(frame.detections.iter().all(|detection| detection.uav == 1));
        } else {
            assert_eq!(row.turn_rate_command_rad_s, 0.0);
        }
    }
    // It asks for a place to look at before it looks there.
    assert_eq!(frames[51].uavs[0].boresight_rad, None);
    assert!(frames[52].uavs[0].boresight_rad.is_some());
}

/// What is on its way to a computer that is off is lost, what comes after it is on again is heard.
#[test]
fn what_arrives_while_a_computer_is_off_is_lost() {
    let late = "radio.delay_s = 3\nuavs.restart = [{ uav = 0, at_s = 20, down_s = 5 }]";
    let heard = reports(&heard(2, late));
    let to_0: Vec<f64> = heard.iter().filter(|heard| heard.to == 0).map(|heard| heard.at_s).collect();
    let expected = (6..=200).map(|tick| f64::from(tick) / 2.0).filter(|s| !(20.0..25.0).contains(s));
    assert_eq!(to_0, expected.collect::<Vec<_>>());
    // What it had said before is heard.
    assert!(heard.iter().any(|heard| heard.from == 0 && heard.at_s == 22.5));
}

#[test]
fn a_late_start_is_drawn_for_each_uav_and_begins_the_first_epoch() {
    let (log, frames, _) = flown(&team(4, "uavs.start_late_s = 10.2"), 1, 0);
    assert!(log.observed.iter().all(|(_, s, _)| *s >= 10.5) && log.observed.len() == 4 * (201 - 21));
    assert_eq!(log.restarts, []);
    let cues =
        |log: &Log| log.heard.iter().filter(is_cue).map(|cue| (cue.at_s, cue.said_s, cue.to)).collect::<Vec<_>>();
    assert_eq!(cues(&log), [0, 1, 2, 3].map(|to| (10.5, 10.5, to)), "not before there is somebody to tell");
    assert_eq!(frames[0].uavs[3].turn_rate_command_rad_s, 40.0 / 250.0);
    let drawn = |uavs| {
        let log = flown(&team(uavs, "uavs.start_late_s = { uniform = { min = 5.0, max = 50.0 } }"), 1, 0).0;
        let first = |of: u32| log.observed.iter().find(|(uav, ..)| *uav == of).unwrap().1;
        let starts = (0..3).map(first).collect::<Vec<_>>();
        let earliest_s = starts.iter().copied().fold(first(uavs as u32 - 1), f64::min);
        assert!(
            cues(&log).iter().all(|cue| cue.0 == earliest_s) && cues(&log).len() < uavs,
            "once, to whoever is there"
        );
        starts
    };
    let starts = drawn(3);
    assert!(starts.iter().all(|s| (5.0..=50.5).contains(s)) && starts[0] != starts[1] && starts[1] != starts[2]);
    assert_eq!(starts, drawn(4));
    // A restart counts from when the computer first runs.
    let restarts =
        "uavs = { start_late_s = 10, restart = [{ uav = 0, at_s = 3 }, { uav = 0, at_s = 30, down_s = 2 }] }";
    assert_eq!(flown(&scenario(&format!("{restarts}\n[[targets.at]]\n")), 1, 0).0.restarts, [(0, 1)]);
}

#[test]
fn a_clock_that_is_off_shows_in_now_and_nowhere_else() {
    let text = |clock: &str| {
        format!("uavs.count = 2\nsensor.range_sd_m = 5\nsensor.bearing_sd_deg = 1\n{clock}\n[[targets.at]]\n")
    };
    let right = flown(&scenario(&text("[radio]")), 1, 0);
    let wrong = flown(&scenario(&text("uavs.clock = [{ uav = 1, offset_s = -3.25, drift_ppm = 200 }]")), 1, 0);
    assert_eq!(right.1, wrong.1, "what is flown and seen");
    for (right, wrong) in right.0.observed.iter().zip(&wrong.0.observed) {
        assert_eq!((right.0, &right.2), (wrong.0, &wrong.2));
        let ahead_s = if right.0 == 1 { -3.25 + 200e-6 * right.1 } else { 0.0 };
        assert!((wrong.1 - right.1 - ahead_s).abs() < 1e-6);
    }
    assert!(wrong.0.heard.iter().any(|heard| heard.from == 1 && heard.said_s == -3.25), "its reports say so");
}

/// Everything at once, for those who are named.
const ALL: &str = "[radio]\nloss = 0.3\nduplicate = 0.2\ndelay_s = { uniform = { min = 0.0, max = 2.0 } }\n";

/// A further UAV, or another fault, changes nothing of what is not its own.
#[test]
fn draws_are_keyed_by_who_speaks_who_hears_and_when() {
    let three = heard(3, ALL);
    let of_three: Vec<_> =
        heard(4, ALL).into_iter().filter(|heard| heard.to < 3 && (heard.from < 3 || heard.from == OUTSIDE)).collect();
    assert_eq!(three, of_three);
    let link = format!("{ALL}[[radio.link]]\nfrom = 2\nto = 0\nloss = 1\n");
    let restart = format!("uavs.restart = [{{ uav = 2, at_s = 20, down_s = 20 }}]\n{ALL}");
    let outage = format!("uavs.outage = [{{ uav = 2, from_s = 20, until_s = 40 }}]\n{ALL}");
    for (fault, hears) in [(link, true), (restart, false), (outage, true)] {
        let is_other = |heard: &&Heard| heard.from != 2 && (hears || heard.to != 2);
        let other = |heard: &[Heard]| heard.iter().filter(is_other).copied().collect::<Vec<_>>();
        let faulty = heard(3, &fault);
        assert_ne!(faulty, three, "{fault}");
        assert_eq!(other(&faulty), other(&three), "{fault}");
    }
    // Nor does what else its speaker says: the first message of an instant fares as it does alone.
    let more = flown(&team(3, ALL), 2, 0).0.heard;
    let first: Vec<_> = more.into_iter().filter(|heard| heard.from == OUTSIDE || heard.number == 0).collect();
    assert_eq!(first, three);
    // But another seed does.
    let other_seed = template(&format!("uavs.count = 3\n{ALL}\n[[targets.at]]\n")).unwrap().draw(2).unwrap();
    assert_ne!(flown(&other_seed, 1, 0).0.heard, three);
}

fn frames(scenario: &Scenario) -> Vec<Frame> {
    let mut mission = Mission::new(scenario).unwrap();
    std::iter::from_fn(|| mission.frame().cloned()).collect()
}

fn built_in(name: &str, set: &[&str]) -> Result<Scenario, String> {
    let set = set.iter().map(|key| (*key).to_owned()).collect();
    Scenario::load(name, &Edits { set, ..Edits::default() }, 3).map_err(|error| error.to_string())
}

/// Agents that fly over a radio that is told of and perfect, as over one that is not told of, to the bit: with computers that
/// start at once, and anew after the end.
#[test]
fn a_radio_without_faults_changes_no_bit() {
    for name in ["paper/table-2-pair", "tour/04-two-groups", "traffic/convoy"] {
        let set = ["radio={}", "uavs.start_late_s=0", "uavs.restart=[{uav=0,at_s=1e6}]"];
        let [plain, told] = [&[][..], &set].map(|set| built_in(name, set).unwrap());
        let frames = |scenario: &Scenario| {
            let brain =
                of_team(Minds::Each, plain.settings.team, plain.settings.airspace.clone(), plain.uavs.len()).unwrap();
            let mut mission = Mission::with_brain(scenario, brain).unwrap();
            std::iter::from_fn(|| mission.frame().cloned()).collect::<Vec<_>>()
        };
        assert!(frames(&plain) == frames(&told), "{name}");
    }
}

/// A resolved scenario is the same run, with distributions for what is drawn many times.
#[test]
fn a_resolved_scenario_fails_alike() {
    let fault = format!(
        "uavs.start_late_s = {{ uniform = {{ min = 0.0, max = 5.0 }} }}\n\
         uavs.restart = [{{ uav = 1, at_s = {{ uniform = {{ min = 30.0, max = 40.0 }} }}, down_s = 3 }}]\n\
         uavs.clock = [{{ uav = 0, drift_ppm = 3 }}]\n{ALL}bytes_per_s = 500\n[[radio.link]]\nloss = 0.4\n\
         [[radio.partition]]\nfrom_s = 10\nuntil_s = 20\nsides = [[0, 1], [2]]\n"
    );
    let first = team(3, &fault);
    let again = scenario(&first.resolved().unwrap());
    assert_eq!((&again.radio, &again.starts_s, &again.restarts), (&first.radio, &first.starts_s, &first.restarts));
    assert_eq!(frames(&again), frames(&first));
    assert_eq!(again.resolved(), first.resolved());
    let typed = template(&format!("uavs.count = 3\n{fault}\n[[targets.at]]\n")).unwrap();
    assert_eq!(scenario(&typed.text().unwrap()).resolved(), first.resolved());
    assert!((30.0..40.0).contains(&first.restarts[0].at_s));
}

/// Passes on what the product does, and writes down which epochs it speaks of.
struct Spy {
    inner: Box<dyn Brain + Send>,
    epochs: Rc<RefCell<Vec<(u32, u32)>>>,
}

impl Brain for Spy {
    fn restart(&mut self, uav: UavId, epoch: u32) {
        self.inner.restart(uav, epoch);
    }
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        self.inner.observe(now, uav, own, scan);
        if let Some(Message::Report(report)) = self.inner.outbox(uav).first() {
            self.epochs.borrow_mut().push((uav.0, report.epoch));
        }
    }
    fn outbox(&self, uav: UavId) -> &[Message] {
        self.inner.outbox(uav)
    }
    fn hear(&mut self, uav: UavId, message: &Message) {
        self.inner.hear(uav, message);
    }
    fn decide(&mut self, uav: UavId) -> Step {
        self.inner.decide(uav)
    }
    fn reported(&self) -> Reported {
        self.inner.reported()
    }
    fn report(&self, beliefs: &mut Beliefs) {
        self.inner.report(beliefs);
    }
}

/// The product's: an empty picture, an epoch one higher, and meanwhile the next one's picture is recorded.
#[test]
fn a_restarted_agent_knows_nothing_and_counts_its_epochs() {
    let restart = |uavs: usize| {
        let fault = "uavs.restart = [{ uav = 0, at_s = 20, down_s = 5 }]";
        let scenario = team(uavs, fault);
        let inner = of_team(Minds::Each, scenario.settings.team, scenario.settings.airspace.clone(), uavs).unwrap();
        let epochs: Rc<RefCell<Vec<(u32, u32)>>> = Rc::default();
        let mut mission = Mission::with_brain(&scenario, Spy { inner, epochs: Rc::clone(&epochs) }).unwrap();
        let frames: Vec<_> = std::iter::from_fn(|| mission.frame().cloned()).collect();
        let epochs = epochs.borrow().clone();
        (frames, epochs)
    };
    let (alone, epochs) = restart(1);
    assert_eq!((alone[39].tracks.len(), alone[40].tracks.len()), (1, 0));
    assert!(alone[40..].iter().all(|frame| frame.tracks.is_empty() && frame.groups.is_empty()), "nobody cues it again");
    assert_eq!(epochs, [[(0, 0); 40].as_slice(), &[(0, 1); 151]].concat());
    let (pair, epochs) = restart(2);
    assert!(pair[40..50].iter().all(|frame| frame.tracks.len() == 1), "the other one's");
    assert!(
        pair[40..50].windows(2).all(|two| two[0].tracks[0].covariance != two[1].tracks[0].covariance),
        "a live one"
    );
    // The first one's again, of nothing but what the other reports now.
    let variance_m2 = |frame: &Frame| frame.tracks[0].covariance[0];
    assert!(variance_m2(&pair[50]) > 4.0 * variance_m2(&pair[49]));
    assert!(epochs.iter().all(|(uav, epoch)| *uav == 0 || *epoch == 0));
}

/// The product over all of it: whatever it believes then, what it flies stays in its limits, and a run is a function of
/// scenario and seed.
#[test]
fn the_product_flies_on_whatever_fails() {
    let fault = format!(
        "uavs.start_late_s = {{ uniform = {{ min = 0.0, max = 9.0 }} }}\nuavs.restart = [{{ at_s = 40, down_s = 9 }}]\n\
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
fn minds_are_several_where_they_know_different_things() {
    let minds = |fault: &str| {
        template(&format!("{fault}\n[[targets.at]]\n")).and_then(|template| {
            template.draw(1).map(|scenario| scenario.settings.minds).map_err(|error| error.to_string())
        })
    };
    let faults = ["[radio]", "uavs.start_late_s = 0", "uavs.restart = [{}]", "uavs.clock = [{}]"];
    assert_eq!(minds(""), Ok(Minds::One));
    assert_eq!(minds("team.minds = \"each\""), Ok(Minds::Each));
    // Altitudes and turns hang on no agreement where words may be missing.
    assert_eq!(
        (team(2, "").settings.team.radio, team(2, "[radio]").settings.team.radio),
        (Radio::Perfect, Radio::Fallible)
    );
    for fault in faults {
        assert_eq!(minds(fault), Ok(Minds::Each), "{fault}");
        assert_eq!(minds(&format!("team.minds = \"each\"\n{fault}")), Ok(Minds::Each), "{fault}");
        let refused = minds(&format!("team.minds = \"one\"\n{fault}")).unwrap_err();
        let expected = "mine:1:6: team.minds = \"one\": one mind for all hears everything at once: for a radio that does \
                        not, restarts, late starts or clocks give \"each\", or leave it out";
        assert_eq!(refused, expected, "{fault}");
    }
    let one = built_in("tour/04-two-groups", &["radio={}", "team.minds=one"]).unwrap_err();
    assert!(one.starts_with("command line: team.minds = \"one\": one mind"), "{one}");
    let other = built_in("tour/04-two-groups", &["radio={}", "team.teammate_timeout_s=5"]).unwrap();
    assert_eq!(other.settings.minds, Minds::Each);
}

#[test]
fn what_is_wrong_with_a_fault_is_told_at_its_key() {
    let wrong = |fault: &str, expected: &str| {
        let text = format!("[[targets.at]]\n[uavs]\ncount = 3\n{fault}\n");
        let drawn = template(&text).and_then(|template| template.draw(1).map_err(|error| error.to_string()));
        let error = drawn.unwrap_err();
        let (_, message) = error.split_once(": ").unwrap();
        assert_eq!(message, expected, "{error}");
        assert!(error.starts_with("mine:4:") || error.starts_with("mine:5:"), "{error}");
    };
    let probability = "must be at least 0 and at most 1";
    wrong("[radio]\nloss = 1.5", &format!("radio.loss = 1.5: {probability}"));
    wrong("[radio]\nloss = nan", "radio.loss = nan: must be a finite number");
    wrong("[radio]\nloss = { uniform = { min = 0, max = 2 } }", &format!("radio.loss: up to 2: {probability}"));
    wrong("[radio]\nduplicate = -1", &format!("radio.duplicate = -1: {probability}"));
    wrong("[radio]\ndelay_s = -0.1", "radio.delay_s = -0.1: must be at least 0 and at most 120");
    wrong(
        "[radio]\ndelay_s = { normal = { mean = 1, sd = 1 } }",
        "radio.delay_s: up to -5: must be at least 0 and at most 120",
    );
    wrong("[radio]\nrange_m = 0", "radio.range_m = 0: must be above 0 and at most 10000000");
    wrong("[radio]\nbytes_per_s = 0", "radio.bytes_per_s = 0: must be above 0 and at most 1000000000");
    wrong("[radio]\nuntil_s = -1", "radio.until_s = -1: must be at least 0 and at most 1000000000");
    wrong("[radio]\nlos = 1", "radio.los: there is no such key; did you mean `loss`?");
    let one = "must be at least 0 and at most 2 (one of the UAVs, counted from 0)";
    wrong("[[radio.link]]\nto = 3", &format!("radio.link.0.to = 3: {one}"));
    wrong("[[radio.link]]\nto = 0", "radio.link.0.to = 0: must be another UAV than `from`");
    wrong("[[radio.link]]\nfrom = 0.5", "radio.link.0.from = 0.5: must be a whole number");
    wrong("[[radio.link]]\nloss = 2", &format!("radio.link.0.loss = 2: {probability}"));
    wrong(
        "[radio]\nlink = [{ from = 0, to = 1 }, { from = 0, to = 1 }]",
        "radio.link.1: stands between the same two UAVs as another one; keep one",
    );
    wrong("[[radio.partition]]\nsides = []", "radio.partition.0.sides: must be lists of UAVs, like [[0, 1], [2, 3]]");
    wrong("[[radio.partition]]\nsides = 3", "radio.partition.0.sides = 3: must be an array, in []");
    wrong("[[radio.partition]]\nsides = [[0, 7]]", &format!("radio.partition.0.sides.0.1 = 7: {one}"));
    wrong(
        "[[radio.partition]]\nsides = [[0, 1], [2, 0]]",
        "radio.partition.0.sides.1.1 = 0: is named already; a UAV is on one side, and once",
    );
    wrong(
        "[radio]\npartition = [{ from_s = 9, until_s = 3, sides = [[0]] }]",
        "radio.partition.0.until_s = 3: must be at least 9 and at most 1000000000 (not before from_s)",
    );
    wrong("start_late_s = -1", "uavs.start_late_s = -1: must be at least 0 and at most 1000000000");
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
    wrong("clock = [{ uav = 1 }, { uav = 1 }]", "uavs.clock.1.uav = 1: has a clock already; a UAV has one");
}

/// From a record the same scores follow as in flight, those of what each mind believes, too; and when the last fault ends.
#[test]
fn a_record_of_several_minds_gives_the_scores_of_the_flight() {
    let faults = "duration_s = 60
        [radio]
        loss = 0.2
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
        [[targets.at]]
        [[targets.at]]
        x_m = 900.0
        ";
    let scenario = scenario(&format!("uavs.count = 3\nuavs.start_late_s = {{ uniform = [0, 5] }}\n{faults}"));
    assert_eq!(scenario.settings.faults_end_s, Some(40.0), "what ends after the mission does not count");
    let choice = Choice::parse("all").unwrap();
    let mut mission = Mission::scored_by(&scenario, choice).unwrap();
    let home = tempfile::tempdir().unwrap();
    let dir = home.path().join("run");
    let (duration_s, period_s) = (scenario.settings.duration.s(), scenario.settings.period.s());
    let manifest = Manifest::new("mine", 1, duration_s, period_s);
    let mut writer = Writer::create(&dir, &manifest, &scenario.resolved().unwrap(), &World::names(&scenario)).unwrap();
    let mut flown = Scorer::new(mission.rules(), choice);
    while let Some(frame) = mission.frame() {
        flown.frame(frame);
        writer.frame(frame).unwrap();
    }
    writer.finish().unwrap();
    let record = Record::open(&dir).unwrap();
    let settings = Settings::of_record("mine", record.scenario_toml()).unwrap();
    let mut read = Scorer::new(Rules::of(&settings), choice);
    record.frames().unwrap().for_each(|frame| read.frame(&frame.unwrap()));
    assert_eq!(flown.metrics(), read.metrics());
    let Metrics { crews_differ_fraction, agreement_delay_s, double_count, bytes_per_s, .. } = read.metrics();
    assert!(crews_differ_fraction > Some(0.0) && agreement_delay_s.is_some() && bytes_per_s > Some(0.0));
    assert_eq!(double_count, Some(0));
    // Of faults that do not end, and of none, nothing can be told.
    assert_eq!(team(2, "radio.loss = 0.1").settings.faults_end_s, None);
    assert_eq!(team(2, "radio = { loss = 0.1, until_s = 99 }").settings.faults_end_s, Some(99.0));
}
