//! Controller interface: the built-in controller runs as one agent for the team or as one per UAV, and a third-party
//! controller uses the same interface.

#[expect(dead_code, reason = "the example has its own main function")]
#[path = "../../examples/follower.rs"]
mod follower;

use std::cell::RefCell;
use std::rc::Rc;

use crate::common::load;
use standoff::{AgentOutput, Command, Message, PointingTarget, Position, Scan, Time, UavId, UavState, Velocity};
use standoff_record::Frame;
use standoff_score::{MetricInfo, MetricSelection, Metrics, Scorer};
use standoff_sim::controller::{
    AgentRow, ByAgent, Controller, PerAgentTables, ReportedState, ReportedTables, TeammateRow, TrackRow,
};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{AgentSetup, BUILT_IN, Scenario};

fn same_frames(name: &str, set: &[&str]) {
    let one = load(name, set, 3);
    let each = load(name, &[set, &["team.agents=\"per-uav\""]].concat(), 3);
    assert_eq!((one.settings.agents, each.settings.agents), (AgentSetup::Shared, AgentSetup::PerUav));
    let (mut one, mut each) = (Mission::new(&one).unwrap(), Mission::new(&each).unwrap());
    let mut frames = 0;
    while let Some(frame) = one.frame() {
        let own = each.frame().unwrap();
        assert_eq!((&frame.agents, own.agents.all.len()), (&PerAgentTables::default(), own.uavs.len()));
        assert_eq!(*frame, Frame { agents: PerAgentTables::default(), ..own.clone() }, "{name}");
        frames += 1;
    }
    assert!(frames > 100 && each.frame().is_none());
}

/// With an ideal radio, one agent per UAV and one agent for the team fly identically, to the bit.
#[test]
fn one_agent_per_uav_and_one_per_team_give_the_same_records() {
    let (perfect, fallible): (Vec<&str>, Vec<&str>) = BUILT_IN
        .iter()
        .map(|scenario| scenario.name)
        .partition(|name| load(name, &[], 3).settings.agents == AgentSetup::Shared);
    assert_eq!(fallible, ["tour/07-lossy-radio", "tour/08-network-partition"]);
    perfect.iter().for_each(|name| same_frames(name, &[]));
}

/// Metrics of several agents are averaged. If all agents are equal, the average is bitwise equal to the value of a
/// single agent.
#[test]
fn one_agent_per_uav_and_one_per_team_have_the_same_scores() {
    let scored = |setting: &str| {
        let scenario = load("improved/figure-9", &[setting, "duration_s=60"], 3);
        Mission::new(&scenario).unwrap().score_while(MetricSelection::all(), || true)
    };
    let [one, each] = ["team.agents=\"shared\"", "team.agents=\"per-uav\""].map(scored);
    let mut agreement = Vec::new();
    for name in MetricInfo::all().iter().map(|info| info.name) {
        if one[name].is_none() && each[name].is_some() {
            agreement.push(name);
        } else {
            assert_eq!(one[name], each[name], "{name}");
        }
    }
    let expected = [
        "duplicate_coverage_fraction",
        "assignment_disagreement_fraction",
        "commit_lag_s",
        "commit_lag_max_s",
        "sent_bytes_per_s",
    ];
    let further = ["sent_bytes_per_s_max", "retransmission_limited_fraction"];
    assert_eq!(agreement, [&expected[..], &further].concat());
    assert_eq!(each["assignment_disagreement_fraction"], Some(0.0));
}

/// During an outage, a UAV receives messages, but neither scans nor sends.
#[test]
fn one_agent_per_uav_and_one_per_team_handle_outages_identically() {
    for uav in 0..2 {
        let outage = format!("uavs.outage=[{{uav={uav}, from_s=10, until_s=40}}, {{uav=1, from_s=50, until_s=52}}]");
        same_frames("paper/figure-9", &[&outage]);
    }
}

/// Calls that a controller received, in order.
#[derive(Debug, Clone, PartialEq)]
enum Call {
    Observe { uav: u32, looks: bool },
    Hear { uav: u32, is_cue: bool },
    Decide { uav: u32 },
}

/// Wraps the built-in controller, changes its track ids and records all calls.
struct Renamed {
    calls: Rc<RefCell<Vec<Call>>>,
    inner: Box<dyn Controller>,
}

impl Controller for Renamed {
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        self.calls.borrow_mut().push(Call::Observe { uav: uav.0, looks: scan.is_some() });
        self.inner.observe(now, uav, own, scan);
    }
    fn receive(&mut self, uav: UavId, message: &Message) {
        self.calls.borrow_mut().push(Call::Hear { uav: uav.0, is_cue: matches!(message, Message::Cue(_)) });
        self.inner.receive(uav, message);
    }
    fn decide(&mut self, uav: UavId) -> AgentOutput {
        self.calls.borrow_mut().push(Call::Decide { uav: uav.0 });
        self.inner.decide(uav)
    }
    fn reported(&self) -> ReportedTables {
        ReportedTables::default()
    }
    fn report(&self, beliefs: &mut ReportedState) {
        self.inner.report(beliefs);
        beliefs.tracks.iter_mut().for_each(|track| track.track += 1000);
        beliefs.events.iter_mut().for_each(|event| event.track = event.track.map(|track| track + 1000));
    }
}

fn scored(scenario: &Scenario, controller: Box<dyn Controller>) -> Metrics {
    let mut mission = Mission::with_controller(scenario, controller).unwrap();
    let mut scorer = Scorer::new(mission.score_config(), MetricSelection::parse("all").unwrap());
    while let Some(frame) = mission.frame() {
        scorer.frame(frame);
    }
    scorer.metrics()
}

fn product(scenario: &Scenario) -> Box<dyn Controller> {
    standoff_sim::controller::team_controller(
        AgentSetup::Shared,
        scenario.settings.team,
        scenario.settings.geofence.clone(),
        Vec::new(),
        scenario.uavs.len(),
    )
    .unwrap()
}

/// Tracks have arbitrary ids: scores identify them by target, and the calls to a controller have a fixed order.
#[test]
fn scores_identify_tracks_by_target_not_by_id() {
    let scenario = load("tour/02-two-uavs", &["duration_s=30"], 1);
    let calls = Rc::default();
    let renamed = Renamed { calls: Rc::clone(&calls), inner: product(&scenario) };
    assert_eq!(scored(&scenario, Box::new(renamed)), scored(&scenario, product(&scenario)));
    let calls = calls.borrow();
    let observes = |uav| Call::Observe { uav, looks: true };
    let cues = scenario_targets(&scenario);
    assert_eq!(calls[..2], [observes(0), observes(1)]);
    assert!(calls[2..2 + 2 * cues].iter().all(|call| matches!(call, Call::Hear { is_cue: true, .. })));
    assert_eq!(calls[2 + 2 * cues..4 + 2 * cues], [Call::Decide { uav: 0 }, Call::Decide { uav: 1 }]);
    assert_eq!(calls[4 + 2 * cues..6 + 2 * cues], [observes(0), observes(1)]);
}

fn scenario_targets(scenario: &Scenario) -> usize {
    let mut mission = Mission::new(scenario).unwrap();
    mission.frame().unwrap().truth.len()
}

/// A controller that reports nothing is scored only by what its sensors see and where its UAVs fly.
#[test]
fn unreported_tables_are_not_scored() {
    let scenario = load("tour/02-two-uavs", &[], 1);
    let metrics = follower::follow(&scenario).unwrap();
    assert!(metrics["in_view_fraction"].unwrap() > 0.2, "{metrics:?}");
    assert!(metrics["longest_out_of_view_s"].is_some() && metrics["separation_min_m"].is_some());
    let nothing = [
        metrics["custody_fraction"],
        metrics["position_error_m"],
        metrics["position_error_all_m"],
        metrics["standoff_error_m"],
        metrics["member_out_of_view_fraction"],
        metrics["ungrouped_fraction"],
        metrics["infeasible_fraction"],
        metrics["anees"],
    ];
    assert_eq!(nothing, [None; 8]);
    assert_eq!((metrics["handoffs"], metrics["removals"]), (None, None));
}

#[test]
fn book_quotes_the_output_of_the_follower() {
    let page = include_str!("../../../../docs/user/controllers.md");
    let command = "--example follower -- tour/04-two-groups 1\n";
    let quoted = page.split(command).nth(1).unwrap().split("```").next().unwrap();
    assert_eq!(quoted.lines().collect::<Vec<_>>(), follower::compared("tour/04-two-groups", 1).unwrap());
}

/// A controller that reports invalid data and commands what no UAV can fly.
struct Wild;

impl Controller for Wild {
    fn observe(&mut self, _: Time, _: UavId, _: &UavState, _: Option<Scan>) {}
    fn receive(&mut self, _: UavId, _: &Message) {}
    fn decide(&mut self, uav: UavId) -> AgentOutput {
        let nowhere = PointingTarget { position: Position::from_m(f64::NAN, 0.0), velocity: Velocity::ZERO };
        let command = match uav.0 {
            0 => Command { speed_m_s: f64::NAN, turn_rate_rad_s: f64::INFINITY },
            _ => Command { speed_m_s: 1e9, turn_rate_rad_s: -1e9 },
        };
        AgentOutput {
            pointing_target: Some(nowhere),
            altitude_m: Some(f64::INFINITY),
            ..AgentOutput::command_only(command)
        }
    }
    fn reported(&self) -> ReportedTables {
        ReportedTables { groups: false, ..ReportedTables::default() }
    }
    fn report(&self, beliefs: &mut ReportedState) {
        let rows = [(1, 3.0), (0, 1.0), (0, 2.0), (0, f64::NAN)];
        beliefs.tracks.extend(rows.map(|(target, x_m)| track_row(target, x_m)));
    }
}

/// Whatever a controller commands and reports, its UAVs stay within their limits, the record shows that they were
/// limited, and all recorded numbers are finite.
#[test]
fn no_controller_exceeds_uav_limits_or_corrupts_frames() {
    let scenario = load("tour/02-two-uavs", &[], 1);
    let mut mission = Mission::with_controller(&scenario, Box::new(Wild)).unwrap();
    while let Some(frame) = mission.frame() {
        for uav in &frame.uavs {
            assert!(uav.speed_limited && uav.turn_rate_limited);
            assert!((25.0..=55.0).contains(&uav.speed_command_m_s) && uav.turn_rate_command_rad_s.abs() <= 0.3);
            assert!(uav.x_m.is_finite() && uav.y_m.is_finite() && uav.heading_rad.is_finite());
            assert_eq!((uav.boresight_rad, uav.commanded_altitude_m), (None, None));
        }
        let tracks: Vec<_> = frame.tracks.iter().map(|track| (track.target, track.state[0])).collect();
        assert_eq!(tracks, [(0, 1.0), (1, 3.0)]);
    }
    let metrics = scored(&scenario, Box::new(Wild));
    assert!(metrics["position_error_all_m"].is_some_and(f64::is_finite) && metrics["custody_fraction"].is_none());
    assert_eq!(metrics["handoffs"], Some(0.0));
}

/// A track of a target at this distance east.
fn track_row(target: u32, x_m: f64) -> TrackRow {
    TrackRow {
        state: [x_m, 0.0, 0.0, 0.0, 0.0, 0.0],
        covariance: [1.0; 21],
        ..crate::row_fixtures::track_row(target, None)
    }
}

/// Reports unsorted, duplicate and non-finite rows of two agents, one of whose UAVs has sent nothing.
struct Untidy;

impl Controller for Untidy {
    fn observe(&mut self, _: Time, _: UavId, _: &UavState, _: Option<Scan>) {}
    fn receive(&mut self, _: UavId, _: &Message) {}
    fn decide(&mut self, _: UavId) -> AgentOutput {
        AgentOutput::command_only(Command { speed_m_s: 40.0, turn_rate_rad_s: 0.0 })
    }
    fn report_per_agent(&self, agents: &mut PerAgentTables) {
        let row_of_agent = |agent| AgentRow { agent, sent_messages: 7, sent_bytes: 7, ..AgentRow::default() };
        agents.all.extend([1, 0, 1].map(row_of_agent));
        let tracks = [(1, 0, 1.0), (0, 1, f64::NAN), (0, 0, 2.0), (0, 0, 3.0)];
        agents.tracks.extend(tracks.map(|(agent, target, x_m)| ByAgent { agent, row: track_row(target, x_m) }));
        let (group, group_id) = (Some(0), |agent| Some(u64::from(agent)));
        let mate =
            |(agent, uav)| TeammateRow { agent, uav, group, group_id: group_id(agent), ..TeammateRow::default() };
        agents.teammates.extend([(1, 1), (1, 0), (0, 1), (0, 0), (0, 1)].map(mate));
    }
}

/// Rows of third-party agents are sorted and cleaned, and the sent bytes are those that the radio counted.
#[test]
fn agents_of_a_third_party_controller_are_recorded_and_scored() {
    let scenario = load("paper/table-2-pair", &[], 1);
    let mut mission = Mission::with_controller(&scenario, Untidy).unwrap();
    let agents = mission.frame().unwrap().agents.clone();
    let agent_rows: Vec<_> = agents.all.iter().map(|row| (row.agent, row.sent_messages, row.sent_bytes)).collect();
    assert_eq!(agent_rows, [(0, 0, 0), (1, 0, 0)]);
    let tracks: Vec<_> = agents.tracks.iter().map(|of| (of.agent, of.row.target, of.row.state[0])).collect();
    assert_eq!(tracks, [(0, 0, 2.0), (1, 0, 1.0)]);
    let team: Vec<_> = agents.teammates.iter().map(|row| (row.agent, row.uav)).collect();
    assert_eq!(team, [(0, 0), (0, 1), (1, 0), (1, 1)]);
    let metrics =
        Mission::with_controller(&scenario, Untidy).unwrap().score_while(MetricSelection::standard(), || true);
    assert_eq!((metrics["assignment_disagreement_fraction"], metrics["sent_bytes_per_s"]), (Some(1.0), Some(0.0)));
}
