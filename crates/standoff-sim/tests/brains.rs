//! The seam: the product flies as one mind or as a mind each, and a foreign brain flies through the same door.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

#[expect(dead_code, reason = "it has a main of its own")]
#[path = "../examples/follower.rs"]
mod follower;

use std::cell::RefCell;
use std::rc::Rc;

use standoff::{Command, LookAt, Message, Position, Scan, Step, Time, UavId, UavState, Velocity};
use standoff_sim::brain::{AgentRow, Agents, Beliefs, Brain, OfAgent, Place, Reported, TeamRow, TrackRow, TrackStatus};
use standoff_sim::record::Frame;
use standoff_sim::run::Mission;
use standoff_sim::scenario::{BUILT_IN, Edits, Minds, Scenario};
use standoff_sim::score::{Choice, Metrics, Scorer};

fn load(name: &str, set: &[&str], seed: u64) -> Scenario {
    let set = set.iter().map(|key| (*key).to_owned()).collect();
    Scenario::load(name, &Edits { set, ..Edits::default() }, seed).unwrap()
}

fn same_frames(name: &str, set: &[&str]) {
    let one = load(name, set, 3);
    let each = load(name, &[set, &["team.minds=\"each\""]].concat(), 3);
    assert_eq!((one.settings.minds, each.settings.minds), (Minds::One, Minds::Each));
    let (mut one, mut each) = (Mission::new(&one).unwrap(), Mission::new(&each).unwrap());
    let mut frames = 0;
    while let Some(frame) = one.frame() {
        let own = each.frame().unwrap();
        assert_eq!((&frame.agents, own.agents.all.len()), (&Agents::default(), own.uavs.len()));
        assert_eq!(*frame, Frame { agents: Agents::default(), ..own.clone() }, "{name}");
        frames += 1;
    }
    assert!(frames > 100 && each.frame().is_none());
}

/// With a perfect radio a mind each and one mind for all fly alike, to the bit.
#[test]
fn a_mind_each_and_one_mind_for_all_give_the_same_records() {
    let (perfect, fallible): (Vec<&str>, Vec<&str>) =
        BUILT_IN.iter().map(|scenario| scenario.name).partition(|name| load(name, &[], 3).settings.minds == Minds::One);
    assert_eq!(fallible, ["tour/07-a-radio-that-fails", "tour/08-two-halves-meet"]);
    perfect.iter().for_each(|name| same_frames(name, &[]));
}

/// What each of several minds comes to is averaged; of equal ones that is what one comes to, to the bit.
#[test]
fn a_mind_each_and_one_mind_for_all_are_scored_alike() {
    let scored = |minds: &str| {
        let scenario = load("best/figure-9", &[minds, "duration_s=60"], 3);
        Mission::new(&scenario).unwrap().scored_while(Choice::ALL, || true)
    };
    let [one, each] = ["team.minds=\"one\"", "team.minds=\"each\""].map(scored);
    let of_minds = Metrics::NAMES.iter().zip(one.values().into_iter().zip(each.values()));
    let mut agreement = Vec::new();
    for (name, (one, each)) in of_minds {
        if one.is_none() && each.is_some() {
            agreement.push(*name);
        } else {
            assert_eq!(one, each, "{name}");
        }
    }
    let expected =
        ["crews_differ_fraction", "double_served_fraction", "commit_lag_s", "commit_lag_max_s", "bytes_per_s"];
    assert_eq!(agreement, [&expected[..], &["bytes_max_per_s"]].concat());
    assert_eq!(each.crews_differ_fraction, Some(0.0));
}

/// In an outage a UAV hears, but neither scans nor speaks.
#[test]
fn a_mind_each_and_one_mind_for_all_live_through_outages_alike() {
    for uav in 0..2 {
        let outage = format!("uavs.outage=[{{uav={uav}, from_s=10, until_s=40}}, {{uav=1, from_s=50, until_s=52}}]");
        same_frames("paper/figure-9", &[&outage]);
    }
}

/// What a brain was asked for, in order.
#[derive(Debug, Clone, PartialEq)]
enum Asked {
    Observe { uav: u32, looks: bool },
    Hear { uav: u32, is_cue: bool },
    Decide { uav: u32 },
}

/// Passes on what the product does, under ids of tracks of its own, and writes down what it was asked for.
struct Renamed {
    asked: Rc<RefCell<Vec<Asked>>>,
    inner: Box<dyn Brain>,
}

impl Brain for Renamed {
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        self.asked.borrow_mut().push(Asked::Observe { uav: uav.0, looks: scan.is_some() });
        self.inner.observe(now, uav, own, scan);
    }
    fn hear(&mut self, uav: UavId, message: &Message) {
        self.asked.borrow_mut().push(Asked::Hear { uav: uav.0, is_cue: matches!(message, Message::Cue(_)) });
        self.inner.hear(uav, message);
    }
    fn decide(&mut self, uav: UavId) -> Step {
        self.asked.borrow_mut().push(Asked::Decide { uav: uav.0 });
        self.inner.decide(uav)
    }
    fn reported(&self) -> Reported {
        Reported::default()
    }
    fn report(&self, beliefs: &mut Beliefs) {
        self.inner.report(beliefs);
        beliefs.tracks.iter_mut().for_each(|track| track.track += 1000);
        beliefs.events.iter_mut().for_each(|event| event.track = event.track.map(|track| track + 1000));
    }
}

fn scored(scenario: &Scenario, brain: Box<dyn Brain>) -> Metrics {
    let mut mission = Mission::with_brain(scenario, brain).unwrap();
    let mut scorer = Scorer::new(mission.rules(), Choice::parse("all").unwrap());
    while let Some(frame) = mission.frame() {
        scorer.frame(frame);
    }
    scorer.metrics()
}

fn product(scenario: &Scenario) -> Box<dyn Brain> {
    standoff_sim::brain::of_team(
        Minds::One,
        scenario.settings.team,
        scenario.settings.airspace.clone(),
        scenario.uavs.len(),
    )
    .unwrap()
}

/// Tracks have names of their own: scores find what they are about by the target, and a brain is asked in order.
#[test]
fn scores_go_by_targets_whatever_a_brain_calls_its_tracks() {
    let scenario = load("tour/02-two-uavs", &["duration_s=30"], 1);
    let asked = Rc::default();
    let renamed = Renamed { asked: Rc::clone(&asked), inner: product(&scenario) };
    assert_eq!(scored(&scenario, Box::new(renamed)), scored(&scenario, product(&scenario)));
    let asked = asked.borrow();
    let observes = |uav| Asked::Observe { uav, looks: true };
    let cues = scenario_targets(&scenario);
    assert_eq!(asked[..2], [observes(0), observes(1)]);
    assert!(asked[2..2 + 2 * cues].iter().all(|asked| matches!(asked, Asked::Hear { is_cue: true, .. })));
    assert_eq!(asked[2 + 2 * cues..4 + 2 * cues], [Asked::Decide { uav: 0 }, Asked::Decide { uav: 1 }]);
    assert_eq!(asked[4 + 2 * cues..6 + 2 * cues], [observes(0), observes(1)]);
}

fn scenario_targets(scenario: &Scenario) -> usize {
    let mut mission = Mission::new(scenario).unwrap();
    mission.frame().unwrap().truth.len()
}

/// A brain that reports nothing is scored by what its sensors see and by where its UAVs fly, and by nothing else.
#[test]
fn what_a_brain_does_not_report_is_not_scored() {
    let scenario = load("tour/02-two-uavs", &[], 1);
    let metrics = follower::follow(&scenario).unwrap();
    assert!(metrics.seen_fraction.unwrap() > 0.2, "{metrics:?}");
    assert!(metrics.longest_gap_s.is_some() && metrics.separation_min_m.is_some());
    let nothing = [
        metrics.watched_fraction,
        metrics.position_error_m,
        metrics.position_error_all_m,
        metrics.standoff_error_m,
        metrics.out_of_view_fraction,
        metrics.uncovered_fraction,
        metrics.infeasible_fraction,
        metrics.anees,
    ];
    assert_eq!(nothing, [None; 8]);
    assert_eq!((metrics.handoffs, metrics.discards), (None, None));
}

#[test]
fn the_book_quotes_what_the_follower_prints() {
    let page = include_str!("../../../docs/brains.md");
    let command = "--example follower -- tour/04-two-groups 1\n";
    let quoted = page.split(command).nth(1).unwrap().split("```").next().unwrap();
    assert_eq!(quoted.lines().collect::<Vec<_>>(), follower::compared("tour/04-two-groups", 1).unwrap());
}

/// Tells what nobody can make sense of, and asks for what no UAV can fly.
struct Wild;

impl Brain for Wild {
    fn observe(&mut self, _: Time, _: UavId, _: &UavState, _: Option<Scan>) {}
    fn hear(&mut self, _: UavId, _: &Message) {}
    fn decide(&mut self, uav: UavId) -> Step {
        let nowhere = LookAt { position: Position::from_m(f64::NAN, 0.0), velocity: Velocity::ZERO };
        let command = match uav.0 {
            0 => Command { speed_m_s: f64::NAN, turn_rate_rad_s: f64::INFINITY },
            _ => Command { speed_m_s: 1e9, turn_rate_rad_s: -1e9 },
        };
        Step { look_at: Some(nowhere), altitude_m: Some(f64::INFINITY), ..Step::of(command) }
    }
    fn reported(&self) -> Reported {
        Reported { groups: false, ..Reported::default() }
    }
    fn report(&self, beliefs: &mut Beliefs) {
        let told = [(1, 3.0), (0, 1.0), (0, 2.0), (0, f64::NAN)];
        beliefs.tracks.extend(told.map(|(target, x_m)| track_row(target, x_m)));
    }
}

/// Whatever a brain asks for and tells, its UAVs fly what they can, the record says that they were limited, and no number
/// in it is none.
#[test]
fn no_brain_flies_a_uav_beyond_its_limits_or_breaks_a_frame() {
    let scenario = load("tour/02-two-uavs", &[], 1);
    let mut mission = Mission::with_brain(&scenario, Box::new(Wild)).unwrap();
    while let Some(frame) = mission.frame() {
        for uav in &frame.uavs {
            assert!(uav.speed_limited && uav.turn_rate_limited);
            assert!((25.0..=55.0).contains(&uav.speed_command_m_s) && uav.turn_rate_command_rad_s.abs() <= 0.3);
            assert!(uav.x_m.is_finite() && uav.y_m.is_finite() && uav.heading_rad.is_finite());
            assert_eq!((uav.boresight_rad, uav.altitude_m), (None, None));
        }
        let tracks: Vec<_> = frame.tracks.iter().map(|track| (track.target, track.state[0])).collect();
        assert_eq!(tracks, [(0, 1.0), (1, 3.0)]);
    }
    let metrics = scored(&scenario, Box::new(Wild));
    assert!(metrics.position_error_all_m.is_some_and(f64::is_finite) && metrics.watched_fraction.is_none());
    assert_eq!(metrics.handoffs, Some(0));
}

/// A track of a target that is so far east.
fn track_row(target: u32, x_m: f64) -> TrackRow {
    TrackRow {
        target,
        track: target,
        status: TrackStatus::Held,
        place: Place::Unassigned,
        group: None,
        to_group: None,
        state: [x_m, 0.0, 0.0, 0.0, 0.0, 0.0],
        covariance: [1.0; 21],
    }
}

/// Tells of two minds what is out of order, twice there or no number; and of one whose UAV has sent nothing.
struct Untidy;

impl Brain for Untidy {
    fn observe(&mut self, _: Time, _: UavId, _: &UavState, _: Option<Scan>) {}
    fn hear(&mut self, _: UavId, _: &Message) {}
    fn decide(&mut self, _: UavId) -> Step {
        Step::of(Command { speed_m_s: 40.0, turn_rate_rad_s: 0.0 })
    }
    fn report_each(&self, agents: &mut Agents) {
        let (committed_us, double_counted) = (None, None);
        let (sent_messages, sent_bytes) = (7, 7);
        let mind =
            |agent| AgentRow { agent, committed_us, disturbed: false, sent_messages, sent_bytes, double_counted };
        agents.all.extend([1, 0, 1].map(mind));
        let tracks = [(1, 0, 1.0), (0, 1, f64::NAN), (0, 0, 2.0), (0, 0, 3.0)];
        agents.tracks.extend(tracks.map(|(agent, target, x_m)| OfAgent { agent, row: track_row(target, x_m) }));
        let (presence, heard_us, group) = (None, None, Some(0));
        let mate = |(agent, uav)| TeamRow { agent, uav, presence, heard_us, group, group_id: Some(u64::from(agent)) };
        agents.team.extend([(1, 1), (1, 0), (0, 1), (0, 0), (0, 1)].map(mate));
    }
}

/// What foreign minds tell is brought into order, and how much their UAVs sent is the radio's to say.
#[test]
fn minds_of_a_foreign_brain_are_recorded_and_scored() {
    let scenario = load("paper/table-2-pair", &[], 1);
    let mut mission = Mission::with_brain(&scenario, Untidy).unwrap();
    let agents = mission.frame().unwrap().agents.clone();
    let minds: Vec<_> = agents.all.iter().map(|row| (row.agent, row.sent_messages, row.sent_bytes)).collect();
    assert_eq!(minds, [(0, 0, 0), (1, 0, 0)]);
    let tracks: Vec<_> = agents.tracks.iter().map(|of| (of.agent, of.row.target, of.row.state[0])).collect();
    assert_eq!(tracks, [(0, 0, 2.0), (1, 0, 1.0)]);
    let team: Vec<_> = agents.team.iter().map(|row| (row.agent, row.uav)).collect();
    assert_eq!(team, [(0, 0), (0, 1), (1, 0), (1, 1)]);
    let metrics = Mission::with_brain(&scenario, Untidy).unwrap().scored_while(Choice::standard(), || true);
    assert_eq!((metrics.crews_differ_fraction, metrics.bytes_per_s), (Some(1.0), Some(0.0)));
}
