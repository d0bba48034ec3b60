use std::collections::BTreeSet;

use serde_json::Value;
use standoff::TeammateStatus;
use standoff_record::{Frame, TeammateRow};
use standoff_sim::scenario::Scenario;

use crate::common::{frames, load};
use crate::replay::encoder::Encoder;
use crate::replay::tests::{Block, encoded, head, near, read};
use crate::replay::{Part, Replay};
use crate::score_fixtures::score;

const FAULTS: [&str; 3] = [
    "radio.packet_loss=0.2",
    "radio.partition=[{from_s=15, until_s=30, sides=[[0, 1], [2, 3]]}]",
    "uavs.restart=[{uav=0, at_s=40, down_s=8}]",
];

/// Four UAVs with two groups.
fn flight(sets: &[&str]) -> (Scenario, Vec<Frame>) {
    let scenario = load("tour/04-two-groups", &[sets, &["duration_s=60"]].concat(), 1);
    let frames = frames(&scenario);
    (scenario, frames)
}

/// A value of another agent as the page reads it: from its own table, missing, or from the main table.
fn value_of(own: &Block, shown: &Block, [table, column]: [&str; 2], agent: u32, id: u32, step: usize) -> Option<f64> {
    let at = |column: &str| own.find(&format!("{table}-{agent}"), column, id, step);
    match at("present") {
        Some(0.0) => None,
        Some(_) => at(column),
        None => shown.find(if table == "tracks" { "targets" } else { table }, column, id, step),
    }
}

/// Checks every track and group of every agent, including missing ones.
#[test]
fn the_state_of_every_agent_reads_back_from_the_differences() {
    let (scenario, frames) = flight(&FAULTS);
    let mut left = frames.iter();
    let (mut same, mut other, mut lacking) = (0, 0, 0);
    for part in encoded(&scenario, &frames, 1) {
        let [overview, detail, own] =
            [&part.overview, &part.detail, part.team_states.as_ref().unwrap()].map(|gz| read(gz));
        assert_eq!(own.directory["times_us"], overview.directory["times_us"]);
        for step in 0..own.directory["times_us"].as_array().unwrap().len() {
            let frame = left.next().unwrap();
            let agents = &frame.agents;
            let tracks: BTreeSet<u32> = agents.tracks.iter().map(|of| of.row.target).collect();
            let groups: BTreeSet<u32> = agents.groups.iter().map(|of| of.row.group).collect();
            for agent in agents.all.iter().skip(1).map(|agent| agent.agent) {
                for target in &tracks {
                    let of = agents.tracks.iter().find(|of| (of.agent, of.row.target) == (agent, *target));
                    let row = of.map(|of| of.row);
                    let got = |column| value_of(&own, &detail, ["tracks", column], agent, *target, step);
                    assert!(near(got("x_m"), row.map(|row| row.state[0])), "{agent} {target} {}", frame.time_us);
                    assert!(near(got("vy_m_s"), row.map(|row| row.state[4])));
                    assert!(near(got("cov_x_y"), row.map(|row| row.covariance[3])));
                    assert!(near(got("group"), row.and_then(|row| row.group).map(f64::from)));
                    let stored = own.find(&format!("tracks-{agent}"), "present", *target, step);
                    same += usize::from(stored.is_none());
                    other += usize::from(stored == Some(1.0));
                    lacking += usize::from(stored == Some(0.0));
                }
                for group in &groups {
                    let of = agents.groups.iter().find(|of| (of.agent, of.row.group) == (agent, *group));
                    let row = of.map(|of| of.row);
                    let got = |column| value_of(&own, &overview, ["groups", column], agent, *group, step);
                    assert!(near(got("y_m"), row.map(|row| row.y_m)));
                    assert!(near(got("members"), row.map(|row| f64::from(row.members))));
                    assert!(near(got("standoff_distance_m"), row.map(|row| row.standoff_distance_m)));
                }
            }
        }
    }
    assert!(left.next().is_none());
    assert!(same > 100 && other > 100 && lacking > 0, "{same} equal, {other} different, {lacking} missing");
}

/// Checks presence of teammates, age of reports and assignments.
#[test]
fn the_teammates_of_every_agent_read_back() {
    let (scenario, frames) = flight(&FAULTS);
    let mut left = frames.iter();
    let mut met = BTreeSet::new();
    for part in encoded(&scenario, &frames, 1) {
        let overview = read(&part.overview);
        for step in 0..overview.directory["times_us"].as_array().unwrap().len() {
            let frame = left.next().unwrap();
            let row =
                |agent: u32, uav: u32| frame.agents.teammates.iter().find(|row| (row.agent, row.uav) == (agent, uav));
            for uav in &frame.uavs {
                let agent = frame.agents.all.iter().find(|agent| agent.agent == uav.uav);
                let got = |column| overview.find("agents", column, uav.uav, step);
                assert_eq!(got("link_degraded"), agent.map(|agent| f64::from(agent.link_degraded)));
                let limited = agent.and_then(|agent| agent.retransmission_limited);
                assert_eq!(got("limited"), limited.map(f64::from));
                let lag_us =
                    agent.and_then(|agent| agent.committed_us).map(|committed_us| frame.time_us - committed_us);
                assert!(near(got("lag_s"), lag_us.map(|lag_us| lag_us as f64 / 1e6)));
            }
            for agent in &frame.agents.all {
                for uav in frame.uavs.iter().map(|uav| uav.uav) {
                    let stored = |column| overview.find(&format!("team-{}", agent.agent), column, uav, step);
                    let own = |column| overview.find("agents", column, uav, step);
                    let [status, age_s, group] = match stored("status") {
                        Some(status) => [Some(status), stored("age_s"), stored("group")],
                        None => [Some(0.0), Some(0.0), own("group")],
                    };
                    let row = row(agent.agent, uav);
                    let code = match row.and_then(|row| row.status) {
                        Some(TeammateStatus::Live) => 0.0,
                        Some(TeammateStatus::Silent) => 1.0,
                        Some(TeammateStatus::TimedOut) => 2.0,
                        Some(TeammateStatus::Left) => 3.0,
                        None => 4.0,
                    };
                    met.insert(code as u32);
                    let report_us = row.and_then(|row| row.last_report_us);
                    assert_eq!(status, Some(code), "{} of {uav} at {} us", agent.agent, frame.time_us);
                    assert_eq!(age_s, report_us.map(|report_us| (frame.time_us - report_us) as f64 / 1e6));
                    assert_eq!(group, row.and_then(|row| row.group).map(f64::from));
                }
            }
        }
    }
    assert_eq!(met, BTreeSet::from([0, 1, 2, 4]), "no UAV has left the team");
}

/// Same definition as in the metric: fraction of the time steps with at least two agents at which their assignments
/// differ.
#[test]
fn disagreement_of_agents_matches_the_metric() {
    let (scenario, frames) = flight(&FAULTS);
    let metrics = score(&scenario.settings.score_config(), &frames);
    let (mut differ, mut all) = (0, 0);
    for part in encoded(&scenario, &frames, 1) {
        let overview = read(&part.overview);
        for step in 0..overview.directory["times_us"].as_array().unwrap().len() {
            let agents =
                (0..4).filter_map(|uav| overview.find("agents", "assignments", uav, step).map(|same| (uav, same)));
            let agents: Vec<(u32, f64)> = agents.collect();
            all += usize::from(agents.len() > 1);
            differ += usize::from(agents.iter().any(|(_, same)| *same != f64::from(agents[0].0)));
        }
    }
    assert!(differ > 0 && differ < all);
    assert_eq!(metrics["assignment_disagreement_fraction"], Some(differ as f64 / all as f64));
}

/// Every event of every agent occurs once, with all agents that report it. Those of the first agent are the run's
/// events.
#[test]
fn events_list_the_agents_that_report_them() {
    let (scenario, frames) = flight(&FAULTS);
    let events: Vec<Value> = encoded(&scenario, &frames, 1)
        .iter()
        .flat_map(|part| read(&part.overview).directory["events"].as_array().unwrap().clone())
        .collect();
    let (mut shared, mut provisional) = (0, 0);
    for frame in &frames {
        let now: Vec<&Value> = events.iter().filter(|event| event["time_us"] == frame.time_us).collect();
        let by = |event: &Value, agent: u32| event["by"].as_array().is_some_and(|by| by.contains(&agent.into()));
        let first = frame.agents.all.first().map(|agent| agent.agent);
        for agent in frame.agents.all.iter().map(|agent| agent.agent) {
            let listed = now.iter().filter(|event| by(event, agent)).map(|event| {
                let event_time_us = event.get("event_time_us").unwrap_or(&event["time_us"]).as_i64();
                let is_provisional = event.get("provisional").is_some();
                provisional += usize::from(is_provisional);
                (event["kind"].as_str().unwrap(), event["reason"].as_str().unwrap(), event_time_us, is_provisional)
            });
            let of = frame.agents.events.iter().filter(|of| of.agent == agent);
            let row = of.map(|of| (&*of.event.kind, &*of.event.reason, Some(of.event_time_us), of.provisional));
            let (mut listed, mut row): (Vec<_>, Vec<_>) = (listed.collect(), row.collect());
            listed.sort_unstable();
            row.sort_unstable();
            assert_eq!(listed, row, "of {agent} at {} us", frame.time_us);
        }
        // The simulator adds the limits of the UAVs' transmitters.
        let is_of_simulator = |event: &Value| event.get("by").is_none() && event["kind"] == "retransmission-limited";
        let of_run = now.iter().filter(|event| is_of_simulator(event) || first.is_some_and(|first| by(event, first)));
        assert!(of_run.map(|event| &event["kind"]).eq(frame.events.iter().map(|row| row.kind.as_str())));
        shared += now.iter().filter(|event| event["by"].as_array().is_some_and(|by| by.len() > 1)).count();
    }
    assert!(shared > 0 && provisional > 0, "{shared} shared, {provisional} provisional");
}

/// Equal states use no space, and a run with a shared state has no tables of agents.
#[test]
fn only_differences_use_space() {
    let length = |parts: &[Part]| -> usize {
        parts.iter().filter_map(|part| part.team_states.as_ref()).map(|gz| gz.len()).sum()
    };
    let (scenario, frames) = flight(&["team.agents=per-uav"]);
    let alike = encoded(&scenario, &frames, 1);
    let has_agents = |frames: &[Frame]| -> bool { frames.iter().any(|frame| frame.agents.all.len() > 1) };
    assert!(has_agents(&frames) && length(&alike) < 500, "{} bytes", length(&alike));
    let (faulty, other) = flight(&FAULTS);
    assert!(length(&encoded(&faulty, &other, 1)) > 10_000);
    // Without the agents, the other bytes are the same.
    let one: Vec<Frame> = frames.iter().map(|frame| Frame { agents: Default::default(), ..frame.clone() }).collect();
    for (part, with) in encoded(&scenario, &one, 1).iter().zip(&alike) {
        assert!(part.team_states.is_none());
        assert_eq!(part.detail, with.detail);
        let directory = read(&part.overview).directory;
        let names: Vec<&str> =
            directory["tables"].as_array().unwrap().iter().map(|of| of["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["run", "uavs", "groups"]);
        assert!(directory["events"].as_array().unwrap().iter().all(|event| event.get("by").is_none()));
    }
}

/// States of agents exist only at time steps with a detail, because the page shows both together.
#[test]
fn the_stride_of_agent_states_thins_out_only_them() {
    let (scenario, frames) = flight(&FAULTS);
    let mut encoder = Encoder::new(&scenario.settings.score_config(), 2).with_team_states_every(3);
    let mut parts: Vec<Part> = frames.iter().filter_map(|frame| encoder.frame(frame)).collect();
    parts.extend(encoder.part());
    let times = |gz: &[u8]| -> Vec<i64> { serde_json::from_value(read(gz).directory["times_us"].clone()).unwrap() };
    for part in &parts {
        let [overview, detail, own] =
            [&part.overview, &part.detail, part.team_states.as_ref().unwrap()].map(|gz| times(gz));
        assert_eq!(detail, overview.iter().copied().step_by(2).collect::<Vec<_>>());
        assert_eq!(own, overview.iter().copied().step_by(6).collect::<Vec<_>>());
    }
}

/// The size of the tables of agents in a part is limited, like that of the targets.
#[test]
fn many_differing_tracks_fill_a_part_early() {
    let (scenario, frames) = flight(&FAULTS);
    let frame = frames.iter().find(|frame| !frame.agents.tracks.is_empty() && frame.agents.all.len() == 4).unwrap();
    let mut crowd = Frame { tracks: Vec::new(), truth: Vec::new(), ..frame.clone() };
    let of = crowd.agents.tracks.iter().find(|of| of.agent == 3).copied().unwrap();
    crowd.agents.tracks = (0..10_000)
        .map(|target| {
            let mut of = of;
            of.row.target = target;
            of
        })
        .collect();
    let frames: Vec<Frame> = (0..50).map(|step| Frame { time_us: step * 500_000, ..crowd.clone() }).collect();
    let steps = |part: &Part| read(part.team_states.as_ref().unwrap()).directory["times_us"].as_array().unwrap().len();
    assert_eq!(encoded(&scenario, &frames, 1).iter().map(steps).collect::<Vec<_>>(), [20, 20, 10]);
}

/// If an agent has another assignment for a UAV than the UAV itself, a row is stored.
#[test]
fn differing_assignments_are_stored() {
    let (scenario, frames) = flight(&FAULTS);
    let mut frame = frames.iter().find(|frame| frame.agents.all.len() == 4).unwrap().clone();
    let row = |agent: u32, uav: u32| move |row: &&mut TeammateRow| (row.agent, row.uav) == (agent, uav);
    let now_us = frame.time_us;
    for (agent, id) in [(3, 7 << 40), (0, 8 << 40)] {
        let mate = frame.agents.teammates.iter_mut().find(row(agent, 3)).unwrap();
        (mate.status, mate.last_report_us, mate.group, mate.group_id) =
            (Some(TeammateStatus::Live), Some(now_us), Some(1), Some(id));
    }
    let overview = read(&encoded(&scenario, &[frame], 1)[0].overview);
    let created_s = |id: u64| (id >> 16) as f64 / 1e6;
    assert!(near(overview.find("agents", "created_s", 3, 0), Some(created_s(7 << 40))));
    assert!(near(overview.find("team-0", "created_s", 3, 0), Some(created_s(8 << 40))));
    assert_eq!(overview.find("team-0", "group", 3, 0), Some(1.0));
}

/// A page requests the agents' states separately. Parts without agents have none.
#[test]
fn a_growing_replay_serves_the_agent_states_of_its_parts() {
    let (scenario, frames) = flight(&FAULTS);
    let replay = Replay::new(&head()).unwrap();
    let steps = |path: &str| {
        let body = replay.get(path)?.body;
        Some(read(&body).directory["times_us"].as_array().unwrap().len())
    };
    let mut encoder = Encoder::new(&scenario.settings.score_config(), 1);
    frames[..5].iter().for_each(|frame| drop(encoder.frame(frame)));
    let (part, shown) = (encoder.so_far().unwrap(), encoder.open_steps());
    replay.show(part, shown);
    assert_eq!((steps("team-states/0"), steps("team-states/1")), (Some(5), None));
    let one = Frame { agents: Default::default(), ..frames[0].clone() };
    replay.show(encoded(&scenario, &[one], 1).remove(0), 1);
    assert_eq!((steps("overview/0"), steps("team-states/0")), (Some(1), None));
}
