use std::collections::BTreeSet;

use serde_json::Value;
use standoff::Presence;
use standoff_sim::record::{Frame, TeamRow};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Edits, Scenario};
use standoff_sim::score::{Choice, Rules, Scorer};

use crate::replay::encoder::Encoder;
use crate::replay::tests::{Half, encoded, head, near, read};
use crate::replay::{Part, Replay};

const FAULTS: [&str; 3] = [
    "radio.loss=0.2",
    "radio.partition=[{from_s=15, until_s=30, sides=[[0, 1], [2, 3]]}]",
    "uavs.restart=[{uav=0, at_s=40, down_s=8}]",
];

/// Four UAVs over two groups.
fn flight(sets: &[&str]) -> (Scenario, Vec<Frame>) {
    let set = sets.iter().chain(&["duration_s=60"]).map(|word| (*word).to_owned()).collect();
    let scenario = Scenario::load("tour/04-two-groups", &Edits { set, ..Edits::default() }, 1).unwrap();
    let mut mission = Mission::new(&scenario).unwrap();
    let mut frames = Vec::new();
    while let Some(frame) = mission.frame() {
        frames.push(frame.clone());
    }
    (scenario, frames)
}

/// A number of another mind as the page has it: its own, none, or that of the run's own picture.
fn believed(own: &Half, shown: &Half, [table, column]: [&str; 2], mind: u32, id: u32, instant: usize) -> Option<f64> {
    let at = |column: &str| own.find(&format!("{table}-{mind}"), column, id, instant);
    match at("own") {
        Some(0.0) => None,
        Some(_) => at(column),
        None => shown.find(if table == "tracks" { "targets" } else { table }, column, id, instant),
    }
}

/// Of every track and group of every mind, and of those that it lacks.
#[test]
fn every_picture_reads_back_from_the_differences() {
    let (scenario, frames) = flight(&FAULTS);
    let mut left = frames.iter();
    let (mut same, mut other, mut lacking) = (0, 0, 0);
    for part in encoded(&scenario, &frames, 1) {
        let [overview, detail, own] =
            [&part.overview, &part.detail, part.pictures.as_ref().unwrap()].map(|gz| read(gz));
        assert_eq!(own.directory["times_us"], overview.directory["times_us"]);
        for instant in 0..own.directory["times_us"].as_array().unwrap().len() {
            let frame = left.next().unwrap();
            let agents = &frame.agents;
            let tracks: BTreeSet<u32> = agents.tracks.iter().map(|of| of.row.target).collect();
            let groups: BTreeSet<u32> = agents.groups.iter().map(|of| of.row.group).collect();
            for mind in agents.all.iter().skip(1).map(|mind| mind.agent) {
                for target in &tracks {
                    let of = agents.tracks.iter().find(|of| (of.agent, of.row.target) == (mind, *target));
                    let row = of.map(|of| of.row);
                    let got = |column| believed(&own, &detail, ["tracks", column], mind, *target, instant);
                    assert!(near(got("x_m"), row.map(|row| row.state[0])), "{mind} {target} {}", frame.time_us);
                    assert!(near(got("vy_m_s"), row.map(|row| row.state[4])));
                    assert!(near(got("cov_x_y"), row.map(|row| row.covariance[3])));
                    assert!(near(got("group"), row.and_then(|row| row.group).map(f64::from)));
                    let told = own.find(&format!("tracks-{mind}"), "own", *target, instant);
                    same += usize::from(told.is_none());
                    other += usize::from(told == Some(1.0));
                    lacking += usize::from(told == Some(0.0));
                }
                for group in &groups {
                    let of = agents.groups.iter().find(|of| (of.agent, of.row.group) == (mind, *group));
                    let row = of.map(|of| of.row);
                    let got = |column| believed(&own, &overview, ["groups", column], mind, *group, instant);
                    assert!(near(got("y_m"), row.map(|row| row.y_m)));
                    assert!(near(got("members"), row.map(|row| f64::from(row.members))));
                    assert!(near(got("standoff_distance_m"), row.map(|row| row.standoff_distance_m)));
                }
            }
        }
    }
    assert!(left.next().is_none());
    assert!(same > 100 && other > 100 && lacking > 0, "{same} the same, {other} others, {lacking} lacking");
}

/// Who is live, silent or gone for whom, how old reports are, and who serves what.
#[test]
fn what_minds_believe_of_the_team_reads_back() {
    let (scenario, frames) = flight(&FAULTS);
    let mut left = frames.iter();
    let mut met = BTreeSet::new();
    for part in encoded(&scenario, &frames, 1) {
        let overview = read(&part.overview);
        for instant in 0..overview.directory["times_us"].as_array().unwrap().len() {
            let frame = left.next().unwrap();
            let row = |agent: u32, uav: u32| frame.agents.team.iter().find(|row| (row.agent, row.uav) == (agent, uav));
            for uav in &frame.uavs {
                let mind = frame.agents.all.iter().find(|mind| mind.agent == uav.uav);
                let got = |column| overview.find("minds", column, uav.uav, instant);
                assert_eq!(got("disturbed"), mind.map(|mind| f64::from(mind.disturbed)));
                let lag_us = mind.and_then(|mind| mind.committed_us).map(|committed_us| frame.time_us - committed_us);
                assert!(near(got("lag_s"), lag_us.map(|lag_us| lag_us as f64 / 1e6)));
            }
            for mind in &frame.agents.all {
                for uav in frame.uavs.iter().map(|uav| uav.uav) {
                    let told = |column| overview.find(&format!("team-{}", mind.agent), column, uav, instant);
                    let own = |column| overview.find("minds", column, uav, instant);
                    let [presence, age_s, group] = match told("presence") {
                        Some(presence) => [Some(presence), told("age_s"), told("group")],
                        None => [Some(0.0), Some(0.0), own("group")],
                    };
                    let row = row(mind.agent, uav);
                    let word = row.and_then(|row| row.presence);
                    let code = match word {
                        Some(Presence::Live) => 0.0,
                        Some(Presence::Silent) => 1.0,
                        Some(Presence::Gone) => 2.0,
                        Some(Presence::Left) => 3.0,
                        None => 4.0,
                    };
                    met.insert(code as u32);
                    let heard_us = row.and_then(|row| row.heard_us);
                    assert_eq!(presence, Some(code), "{} of {uav} at {} us", mind.agent, frame.time_us);
                    assert_eq!(age_s, heard_us.map(|heard_us| (frame.time_us - heard_us) as f64 / 1e6));
                    assert_eq!(group, row.and_then(|row| row.group).map(f64::from));
                }
            }
        }
    }
    assert_eq!(met, BTreeSet::from([0, 1, 2, 4]), "nobody has left");
}

/// By the same rule as the metric: of the instants with two minds or more, those at which any of them names another crew.
#[test]
fn minds_differ_where_the_metric_says_so() {
    let (scenario, frames) = flight(&FAULTS);
    let mut scorer = Scorer::new(Rules::of(&scenario.settings), Choice::ALL);
    frames.iter().for_each(|frame| scorer.frame(frame));
    let (mut differ, mut all) = (0, 0);
    for part in encoded(&scenario, &frames, 1) {
        let overview = read(&part.overview);
        for instant in 0..overview.directory["times_us"].as_array().unwrap().len() {
            let crews = (0..4).filter_map(|uav| overview.find("minds", "crew", uav, instant).map(|crew| (uav, crew)));
            let crews: Vec<(u32, f64)> = crews.collect();
            all += usize::from(crews.len() > 1);
            differ += usize::from(crews.iter().any(|(_, crew)| *crew != f64::from(crews[0].0)));
        }
    }
    assert!(differ > 0 && differ < all);
    assert_eq!(scorer.metrics().crews_differ_fraction, Some(differ as f64 / all as f64));
}

/// Every event of every mind once, beside all that tell it; those of the run's own picture are the events of the run.
#[test]
fn events_are_told_beside_the_minds_that_tell_them() {
    let (scenario, frames) = flight(&FAULTS);
    let events: Vec<Value> = encoded(&scenario, &frames, 1)
        .iter()
        .flat_map(|part| read(&part.overview).directory["events"].as_array().unwrap().clone())
        .collect();
    let (mut shared, mut provisional) = (0, 0);
    for frame in &frames {
        let now: Vec<&Value> = events.iter().filter(|event| event["time_us"] == frame.time_us).collect();
        let by = |event: &Value, mind: u32| event["by"].as_array().unwrap().contains(&mind.into());
        let first = frame.agents.all.first().map(|mind| mind.agent);
        for mind in frame.agents.all.iter().map(|mind| mind.agent) {
            let told = now.iter().filter(|event| by(event, mind)).map(|event| {
                let happened_us = event.get("happened_us").unwrap_or(&event["time_us"]).as_i64();
                let is_provisional = event.get("provisional").is_some();
                provisional += usize::from(is_provisional);
                (event["kind"].as_str().unwrap(), event["reason"].as_str().unwrap(), happened_us, is_provisional)
            });
            let of = frame.agents.events.iter().filter(|of| of.agent == mind);
            let row = of.map(|of| (&*of.event.kind, &*of.event.reason, Some(of.happened_us), of.provisional));
            let (mut told, mut row): (Vec<_>, Vec<_>) = (told.collect(), row.collect());
            told.sort_unstable();
            row.sort_unstable();
            assert_eq!(told, row, "of {mind} at {} us", frame.time_us);
        }
        let of_run = now.iter().filter(|event| first.is_some_and(|first| by(event, first)));
        assert!(of_run.map(|event| &event["kind"]).eq(frame.events.iter().map(|row| row.kind.as_str())));
        shared += now.iter().filter(|event| event["by"].as_array().unwrap().len() > 1).count();
    }
    assert!(shared > 0 && provisional > 0, "{shared} shared, {provisional} provisional");
}

/// What does not differ takes no room, and a run of one mind has no more than it had.
#[test]
fn only_differences_take_room() {
    let length =
        |parts: &[Part]| -> usize { parts.iter().filter_map(|part| part.pictures.as_ref()).map(|gz| gz.len()).sum() };
    let (scenario, frames) = flight(&["team.minds=each"]);
    let alike = encoded(&scenario, &frames, 1);
    let parted = |frames: &[Frame]| -> bool { frames.iter().any(|frame| frame.agents.all.len() > 1) };
    assert!(parted(&frames) && length(&alike) < 500, "{} bytes", length(&alike));
    let (faulty, other) = flight(&FAULTS);
    assert!(length(&encoded(&faulty, &other, 1)) > 10_000);
    // Of one mind there are the same bytes as before there were several.
    let one: Vec<Frame> = frames.iter().map(|frame| Frame { agents: Default::default(), ..frame.clone() }).collect();
    for (part, with) in encoded(&scenario, &one, 1).iter().zip(&alike) {
        assert!(part.pictures.is_none());
        assert_eq!(part.detail, with.detail);
        let directory = read(&part.overview).directory;
        let names: Vec<&str> =
            directory["tables"].as_array().unwrap().iter().map(|of| of["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["run", "uavs", "groups"]);
        assert!(directory["events"].as_array().unwrap().iter().all(|event| event.get("by").is_none()));
    }
}

/// They are told where there is a detail, beside which the page shows them.
#[test]
fn a_stride_thins_out_the_pictures_alone() {
    let (scenario, frames) = flight(&FAULTS);
    let mut encoder = Encoder::new(&Rules::of(&scenario.settings), 2).with_pictures_every(3);
    let mut parts: Vec<Part> = frames.iter().filter_map(|frame| encoder.frame(frame)).collect();
    parts.extend(encoder.part());
    let times = |gz: &[u8]| -> Vec<i64> { serde_json::from_value(read(gz).directory["times_us"].clone()).unwrap() };
    for part in &parts {
        let [overview, detail, own] =
            [&part.overview, &part.detail, part.pictures.as_ref().unwrap()].map(|gz| times(gz));
        assert_eq!(detail, overview.iter().copied().step_by(2).collect::<Vec<_>>());
        assert_eq!(own, overview.iter().copied().step_by(6).collect::<Vec<_>>());
    }
}

/// Tables of minds have an end, too: a part does not hold more of them than of targets.
#[test]
fn a_part_with_many_differing_tracks_is_soon_full() {
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
    let frames: Vec<Frame> = (0..50).map(|instant| Frame { time_us: instant * 500_000, ..crowd.clone() }).collect();
    let instants = |part: &Part| read(part.pictures.as_ref().unwrap()).directory["times_us"].as_array().unwrap().len();
    assert_eq!(encoded(&scenario, &frames, 1).iter().map(instants).collect::<Vec<_>>(), [20, 20, 10]);
}

/// A mind that is not told a UAV serves what it says itself is told otherwise.
#[test]
fn another_belief_of_a_duty_is_told() {
    let (scenario, frames) = flight(&FAULTS);
    let mut frame = frames.iter().find(|frame| frame.agents.all.len() == 4).unwrap().clone();
    let row = |agent: u32, uav: u32| move |row: &&mut TeamRow| (row.agent, row.uav) == (agent, uav);
    let now_us = frame.time_us;
    for (agent, id) in [(3, 7 << 40), (0, 8 << 40)] {
        let told = frame.agents.team.iter_mut().find(row(agent, 3)).unwrap();
        (told.presence, told.heard_us, told.group, told.group_id) =
            (Some(Presence::Live), Some(now_us), Some(1), Some(id));
    }
    let overview = read(&encoded(&scenario, &[frame], 1)[0].overview);
    let founded_s = |id: u64| (id >> 16) as f64 / 1e6;
    assert!(near(overview.find("minds", "founded_s", 3, 0), Some(founded_s(7 << 40))));
    assert!(near(overview.find("team-0", "founded_s", 3, 0), Some(founded_s(8 << 40))));
    assert_eq!(overview.find("team-0", "group", 3, 0), Some(1.0));
}

/// Whoever watches asks for them beside the other halves; of one mind there are none to ask for.
#[test]
fn a_replay_that_grows_has_the_pictures_of_its_parts() {
    let (scenario, frames) = flight(&FAULTS);
    let replay = Replay::new(&head()).unwrap();
    let instants = |path: &str| {
        let body = replay.get(path)?.body;
        Some(read(&body).directory["times_us"].as_array().unwrap().len())
    };
    let mut encoder = Encoder::new(&Rules::of(&scenario.settings), 1);
    frames[..5].iter().for_each(|frame| drop(encoder.frame(frame)));
    let (part, told) = encoder.so_far().unwrap();
    replay.show(part, told);
    assert_eq!((instants("pictures/0"), instants("pictures/1")), (Some(5), None));
    let one = Frame { agents: Default::default(), ..frames[0].clone() };
    replay.show(encoded(&scenario, &[one], 1).remove(0), 1);
    assert_eq!((instants("overview/0"), instants("pictures/0")), (Some(1), None));
}
