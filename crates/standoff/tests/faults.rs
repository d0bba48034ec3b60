//! What a team does when its radio, its computers, its clocks or one of its own fail.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::Team;
use common::radio::{PERIOD, Radio};
use standoff::*;

/// In periods: Table I's 3 s.
const LEASE: i64 = 6;

/// 5 and 10 s.
const SOON: i64 = 10;
const LATER: i64 = 20;

/// What must be the same in all who agree.
fn known(agent: &Agent) -> (Vec<Duty>, Option<Time>, Option<u64>, u64) {
    let picture = agent.picture();
    (picture.crew.clone(), agent.committed_at(), agent.committed().map(Picture::digest), picture.digest())
}

fn all_agree(team: &Team) -> bool {
    (0..team.agents.len()).all(|uav| is_one(team, [0, uav]))
}

/// Knows the same, and does; how much of that is certain may differ.
fn is_one(team: &Team, uavs: [usize; 2]) -> bool {
    let [one, other] = uavs.map(|uav| team.agents[uav].picture());
    one.crew == other.crew && one.digest() == other.digest()
}

/// Who serves a group, in what a UAV believes.
fn crew(agent: &Agent) -> Vec<u32> {
    agent.picture().crew.iter().map(|duty| duty.uav.0).collect()
}

fn group_ids(agent: &Agent) -> Vec<GroupId> {
    agent.picture().groups.iter().map(|group| group.id).collect()
}

fn labels(agent: &Agent) -> Vec<u32> {
    agent.picture().known().iter().map(|known| known.track.label.0).collect()
}

fn fly(team: &mut Team, radio: &mut Radio, ticks: core::ops::Range<i64>) {
    for tick in ticks {
        for (uav, step) in team.tick_over(tick, radio).steps {
            let Command { speed_m_s, turn_rate_rad_s } = step.command;
            assert!((25.0..=55.0).contains(&speed_m_s) && turn_rate_rad_s.abs() <= 0.3, "{tick}: {uav}: {step:?}");
        }
    }
}

fn fallible() -> TeamParams {
    TeamParams { radio: standoff::Radio::Fallible, ..TeamParams::table_1() }
}

/// In any order, the lowest id first or last.
#[test]
fn computers_that_start_up_to_30_s_apart_come_to_agree() {
    for starts in [[0, 20, 40, 60], [60, 0, 30, 59], [60, 40, 20, 0], [3, 0, 1, 2], [0, 60, 60, 1], [60, 60, 0, 60]] {
        let (mut team, mut radio) = (Team::of(4, 5, fallible()), Radio::new(1));
        for tick in 0..60 + LATER {
            team.off = (0..4).filter(|index| starts[*index] > tick).collect();
            fly(&mut team, &mut radio, tick..tick + 1);
        }
        assert!(all_agree(&team), "{starts:?}");
        assert_eq!(
            (crew(&team.agents[0]), labels(&team.agents[0])),
            (vec![0, 1, 2, 3], vec![0, 1, 2, 3, 4]),
            "{starts:?}"
        );
    }
}

/// Whichever it is, though it begins anew: its teammates tell it, and nobody takes over that it knows nothing.
#[test]
fn whose_computer_starts_anew_serves_again_within_5_s() {
    for uav in 0..3 {
        for down in [0, 2, LEASE, 40] {
            let (mut team, mut radio) = (Team::of(3, 4, fallible()), Radio::new(1));
            fly(&mut team, &mut radio, 0..30);
            let groups = group_ids(&team.agents[uav]);
            team.off = vec![uav];
            fly(&mut team, &mut radio, 30..30 + down);
            team.off.clear();
            team.agents[uav] = Agent::new(UavId(uav as u32), fallible()).unwrap().with_epoch(1);
            fly(&mut team, &mut radio, 30 + down..30 + down + SOON);
            for agent in &team.agents {
                assert_eq!((crew(agent), labels(agent)), (vec![0, 1, 2], vec![0, 1, 2, 3]), "{uav}, {down}");
                assert!(down > LEASE || group_ids(agent) == groups, "{uav}, {down}: {groups:?}");
            }
            fly(&mut team, &mut radio, 30 + down + SOON..30 + down + SOON + LATER);
            assert!(all_agree(&team), "{uav}, {down}");
        }
    }
}

/// A picture that takes longer to say than others are given to answer is taken from one of them, not from each a part.
#[test]
fn a_picture_of_many_targets_is_taken_from_whoever_has_begun_to_tell_it() {
    let (mut team, mut radio) = (Team::of(3, 60, fallible()), Radio::new(1));
    fly(&mut team, &mut radio, 0..30);
    team.agents[1] = Agent::new(UavId(1), fallible()).unwrap().with_epoch(1);
    fly(&mut team, &mut radio, 30..30 + 4 * LEASE);
    assert!(is_one(&team, [0, 1]));
}

/// A part that names whoever is asked as its speaker, and a time that is not yet, keeps out no true part.
#[test]
fn a_forged_part_of_the_future_keeps_no_picture_out() {
    let (mut team, mut radio) = (Team::of(2, 4, fallible()), Radio::new(1));
    fly(&mut team, &mut radio, 0..30);
    team.agents[1] = Agent::new(UavId(1), fallible()).unwrap().with_epoch(1);
    for tick in 30..30 + SOON {
        let stamp = Stamp { time: FAR, digest: 1 };
        let forged = SnapshotPart { stamp, count: 2, bytes: vec![0; 512], ..SnapshotPart::default() };
        radio.tell(tick, 1, Message::Snapshot(forged));
        fly(&mut team, &mut radio, tick..tick + 1);
    }
    let step = team.tick_over(30 + SOON, &mut radio).steps.remove(1).1;
    assert!(step.diagnostics.refused.nonsense > 0);
    fly(&mut team, &mut radio, 31 + SOON..30 + SOON + LATER);
    assert!(is_one(&team, [0, 1]));
}

/// Who starts anew twice is told what is known now, not what it was told the first time; also where the horizon is short, and
/// what some UAVs have measured while they were silent will never be known.
#[test]
fn whose_computer_starts_anew_twice_is_told_what_is_known_now() {
    let mut params = fallible();
    params.log.horizon_s = 15.0;
    let (mut team, mut radio) = (Team::of(4, 2, params), Radio::new(1));
    for tick in 0..37 + SOON {
        if tick == 9 || tick == 33 {
            team.agents[0] = Agent::new(UavId(0), params).unwrap().with_epoch(tick as u32);
        }
        team.silent = match tick {
            21..25 => vec![UavId(1)],
            29..37 => vec![UavId(0)],
            _ => Vec::new(),
        };
        fly(&mut team, &mut radio, tick..tick + 1);
    }
    assert!((1..4).all(|uav| is_one(&team, [0, uav])));
}

/// Each side goes on with what it knows, and is told of targets of its own. When they meet, all know the same within 10 s.
#[test]
fn two_halves_that_were_apart_for_longer_than_the_horizon_agree_within_10_s() {
    let mut params = fallible();
    params.log.horizon_s = 15.0;
    let sides = [[0, 2], [1, 3]];
    let mut team = Team::of(4, 6, params).with_motion(|id, now| {
        let start = [0.0, 60.0, 0.0, 60.0, -3000.0, 3000.0][id as usize];
        let velocity = Velocity::from_m_s(6.0, 2.0);
        let is_there = now >= Time::from_us([0, 0, 0, 0, 80, 84][id as usize] * PERIOD.us());
        is_there.then(|| (Position::from_m(start, 20.0 * f64::from(id)) + velocity * now.s(), velocity))
    });
    let mut radio = Radio::new(1);
    fly(&mut team, &mut radio, 0..40);
    assert!(all_agree(&team));
    radio.part(&sides[0], &sides[1]);
    for tick in 40..140 {
        radio.uncued = sides[usize::from(tick < 82)].to_vec();
        fly(&mut team, &mut radio, tick..tick + 1);
    }
    for (side, other) in [(sides[0], 4), (sides[1], 5)] {
        for uav in side {
            let agent = &team.agents[uav];
            assert_eq!(crew(agent), side.map(|uav| uav as u32), "{uav}");
            assert!(
                labels(agent).contains(&other) && !labels(agent).contains(&(9 - other)),
                "{uav}: {:?}",
                labels(agent)
            );
        }
    }
    radio.heal();
    fly(&mut team, &mut radio, 140..140 + LATER);
    let all: Vec<_> = team.agents.iter().map(|agent| (crew(agent), labels(agent), agent.committed_at())).collect();
    assert!(all_agree(&team), "{all:?}");
    assert_eq!(crew(&team.agents[0]), [0, 1, 2, 3]);
    // What the first half, whose picture counts, knows.
    assert!((0..5).all(|label| labels(&team.agents[3]).contains(&label)), "{all:?}");
}

/// One report that one UAV does not hear at the first instant.
#[test]
fn one_lost_word_at_the_first_instant_divides_nobody() {
    for speaker in 0..3 {
        for hearer in (0..3).filter(|hearer| *hearer != speaker) {
            let (mut team, mut radio) = (Team::of(3, 5, fallible()), Radio::new(1));
            radio.deaf.push((speaker, hearer));
            fly(&mut team, &mut radio, 0..1);
            radio.heal();
            fly(&mut team, &mut radio, 1..30);
            assert!(all_agree(&team), "{speaker}, {hearer}");
        }
    }
}

/// A clock that jumps by an hour, either way, and is set right later: nobody else knows otherwise, and after a reset all agree.
#[test]
fn a_clock_that_jumps_is_no_matter_of_the_others() {
    for hours in [1, -1] {
        let (mut team, mut radio) = (Team::of(3, 4, fallible()), Radio::new(1));
        let (mut without, mut silence) = (team.clone(), Radio::new(1));
        for tick in 0..100 {
            if tick == 30 {
                team.clock_ahead[1] = Duration::from_us(hours * 3_600_000_000);
                without.off = vec![1];
            }
            // It is made to follow that time, then the right one.
            if tick == 45 || tick == 62 {
                team.agents[1].reset();
            }
            if tick == 60 {
                team.clock_ahead[1] = Duration::ZERO;
            }
            let is_refused = (30..45).contains(&tick) || (60..62).contains(&tick);
            let before = team.agents[1].clone();
            let steps = team.tick_over(tick, &mut radio).steps;
            let refused = steps[1].1.diagnostics.refused.instants;
            assert_eq!(refused, (tick - 29).clamp(0, 15) as u32 + (tick - 59).clamp(0, 2) as u32, "{tick}");
            if is_refused {
                assert_eq!(format!("{:?}", before.picture()), format!("{:?}", team.agents[1].picture()));
            }
            assert!(is_one(&team, [0, 2]), "{tick}");
            if tick < 62 {
                without.tick_over(tick, &mut silence);
                assert_eq!(known(&team.agents[0]), known(&without.agents[0]), "{tick}");
            }
        }
        assert!(all_agree(&team) && crew(&team.agents[1]) == [0, 1, 2]);
    }
}

/// What a UAV that lies says at an instant to one of the others: its report, as it should be, and what it makes of it.
type Lie = fn(i64, usize, &Report) -> Vec<Message>;

fn report_with(report: &Report, change: impl Fn(&mut Report)) -> Vec<Message> {
    let mut report = report.clone();
    change(&mut report);
    vec![Message::Report(report)]
}

fn knowing(report: &Report, change: impl Fn(&mut Knowledge)) -> Vec<Message> {
    report_with(report, |report| change(report.knowledge.get_or_insert_default()))
}

fn held(uav: u32, from: i64, to: i64) -> Held {
    Held { speaker: Speaker::Uav(UavId(uav)), from, to }
}

const FAR: Time = Time::from_us(i64::MAX);
const LONG_AGO: Time = Time::from_us(i64::MIN);

const LIES: [(&str, Lie); 12] = [
    ("epochs", |tick, _, report| {
        let absurd = [(u32::MAX, u32::MAX), (0, 0), (u32::MAX, 0), (7, u32::MAX)][tick as usize % 4];
        report_with(report, |report| (report.epoch, report.sequence) = absurd)
    }),
    ("gaps", |tick, _, report| {
        knowing(report, |told| {
            told.held = (0..1024).map(|run| held(run % 2, 2 * tick - 4 * i64::from(run), 2 * tick)).collect()
        })
    }),
    ("more than there is", |_, _, report| {
        knowing(report, |told| told.held = (0..300).map(|uav| held(uav, i64::MIN, i64::MAX)).collect())
    }),
    ("ghosts", |tick, _, report| {
        knowing(report, |told| told.held = (0..300).map(|uav| held(uav, tick - 9, tick - 1)).collect())
    }),
    ("cues", |tick, _, report| {
        let cue = |number: u16| {
            let place = Position::from_m(1e300, f64::from(number));
            let (velocity, position_sd_m, velocity_sd_m_s) = (Velocity::from_m_s(-1e300, 0.0), 1e-300, 1e300);
            let label = TargetLabel(u32::MAX - u32::from(number) % 3);
            let (searcher, said, time) = (u32::MAX, report.time, Time::from_us(i64::MIN + tick));
            Message::Cue(Cue {
                searcher,
                said,
                number,
                label,
                time,
                position: place,
                velocity,
                position_sd_m,
                velocity_sd_m_s,
            })
        };
        (0..20).chain([u16::MAX]).map(cue).collect()
    }),
    ("times", |tick, _, report| {
        let wrong =
            [FAR, LONG_AGO, report.time + Duration::from_us(1_500_000), report.time + Duration::from_us(77_777)];
        report_with(report, |report| report.time = wrong[tick as usize % 4])
    }),
    ("stamps", |_, _, report| {
        knowing(report, |told| {
            (told.since, told.stamp, told.committed) = (LONG_AGO, Stamp { time: told.committed, digest: 1 }, FAR)
        })
    }),
    ("lists", |_, _, report| {
        knowing(report, |told| (told.listed_after, told.disturbed, told.held) = (FAR, FAR, Vec::new()))
    }),
    ("snapshots", |tick, to, report| {
        let part = |index| {
            let stamp = Stamp { time: report.time, digest: tick as u64 };
            SnapshotPart { uav: UavId(2), since: LONG_AGO, stamp, index, count: 2, bytes: vec![255; 512] }
        };
        let mut said =
            knowing(report, |told| told.asks = Some(Ask { of: UavId(to as u32), stamp: None, next: 0, after: 0 }));
        said.extend([0, 1, 1, 7].map(|index| Message::Snapshot(part(index))));
        said
    }),
    ("jumps", |tick, _, report| {
        let far_m = [1e4, -1e4, 1e300][tick as usize % 3];
        report_with(report, |report| report.state.position = Position::from_m(far_m, far_m))
    }),
    ("measurements", |_, _, report| {
        report_with(report, |report| {
            for detection in &mut report.detections {
                detection.measurement.range_m = 5e3;
            }
        })
    }),
    ("duties", |tick, _, report| report_with(report, |report| report.duty = Some(GroupId(tick as u64 * 77)))),
];

/// Of a UAV that lies to all alike the others make the same of it, at every instant.
#[test]
fn who_lies_to_all_divides_nobody() {
    for (name, lie) in LIES {
        let (team, apart) = with_a_liar(lie);
        assert_eq!(apart, 0, "{name}");
        assert!(is_one(&team, [0, 1]) && is_one(&team, [0, 2]), "{name}");
    }
}

/// Targets without end: no more are kept than there may be, the same ones by all, and each one too many is told of. Once
/// they are lost there is room again.
#[test]
fn targets_that_are_not_there_are_only_so_many() {
    let mut params = fallible();
    params.track.lost_position_sd_m = 25.0;
    let (mut team, mut radio) = (Team::of(2, 3, params), Radio::new(1));
    let false_cues = |tick: i64| {
        let said = Time::from_us(tick * PERIOD.us());
        let cue = move |number: u16| Cue {
            searcher: 7,
            said,
            number,
            label: TargetLabel(1000 + 5000 * tick as u32 + u32::from(number)),
            time: said,
            position: Position::from_m(5e4, f64::from(number)),
            velocity: Velocity::ZERO,
            position_sd_m: 20.0,
            velocity_sd_m_s: 2.0,
        };
        (0..5000).map(cue)
    };
    for tick in 0..12 {
        for cue in false_cues(tick).filter(|_| (5..8).contains(&tick)) {
            (0..2).for_each(|to| radio.tell(tick, to, Message::Cue(cue)));
        }
        let (steps, known) = (team.tick_over(tick, &mut radio).steps, team.agents[0].picture().known().len());
        assert!(is_one(&team, [0, 1]) && known <= 8000, "{tick}: {known}");
        let refused = steps[1].1.diagnostics.refused.impossible;
        assert_eq!(refused > 0, tick > 5, "{tick}: {refused}");
    }
    // One that is there.
    fly(&mut team, &mut radio, 12..40);
    let last = false_cues(40).next().unwrap();
    (0..2).for_each(|to| radio.tell(40, to, Message::Cue(last)));
    fly(&mut team, &mut radio, 40..41);
    assert!(is_one(&team, [0, 1]) && team.agents[0].picture().find_label(last.label).is_some());
}

/// Who says one thing to one and another to another divides them until it stops.
#[test]
fn who_says_two_things_of_one_instant_divides_nobody_for_long() {
    let (team, _) = with_a_liar(|tick, to, report| {
        report_with(report, |report| {
            let by_m = if to == 0 { 20.0 } else { -20.0 };
            report.state.position = report.state.position + Displacement::from_m(by_m, 0.0);
            report.sequence += if tick % 2 == 0 { to as u32 } else { 0 };
        })
    });
    assert!(is_one(&team, [0, 1]));
}

/// A team of which the third lies from the 5th second to the 20th, and 20 s more; at how many instants the others were not one.
fn with_a_liar(lie: Lie) -> (Team, i64) {
    let (mut team, mut radio) = (Team::of(3, 4, fallible()), Radio::new(1));
    let mut apart = 0;
    for tick in 0..80 {
        radio.deaf.clear();
        if (10..40).contains(&tick) {
            tell_lies(&team, &mut radio, tick, lie);
        }
        fly(&mut team, &mut radio, tick..tick + 1);
        apart += i64::from(!is_one(&team, [0, 1]));
    }
    (team, apart)
}

/// In the place of what the third would say the others hear what it makes of it.
fn tell_lies(team: &Team, radio: &mut Radio, tick: i64, lie: Lie) {
    radio.deaf = vec![(2, 0), (2, 1)];
    let said = team.clone().tick_over(tick, &mut Radio::new(1)).said;
    let own = said.iter().find_map(|(speaker, message)| match message {
        Message::Report(report) if *speaker == Some(2) => Some(report),
        _ => None,
    });
    for to in 0..2 {
        lie(tick, to, own.unwrap()).into_iter().for_each(|message| radio.tell(tick, to, message));
    }
}

/// Who claims that its picture is the oldest, and gives none, or begins to give ever another one, holds up nobody who starts
/// anew for longer than it takes to find that out.
#[test]
fn who_promises_a_picture_and_gives_none_keeps_nobody_out() {
    let lies: [Lie; 2] = [
        |_, _, report| knowing(report, |told| (told.since, told.stamp.digest) = (LONG_AGO, 1)),
        |tick, _, report| {
            let mut said = knowing(report, |told| (told.since, told.stamp.digest) = (LONG_AGO, 1));
            let stamp = Stamp { time: Time::from_us((tick - 1) * PERIOD.us()), digest: 1 };
            let (uav, since, bytes) = (UavId(2), LONG_AGO, vec![255; 512]);
            said.push(Message::Snapshot(SnapshotPart { uav, since, stamp, index: 0, count: 2, bytes }));
            said
        },
    ];
    for (which, lie) in lies.into_iter().enumerate() {
        let (mut team, mut radio) = (Team::of(3, 4, fallible()), Radio::new(1));
        for tick in 0..30 + LATER {
            if tick == 30 {
                team.agents[1] = Agent::new(UavId(1), fallible()).unwrap().with_epoch(1);
            }
            if tick >= 10 {
                tell_lies(&team, &mut radio, tick, lie);
            }
            fly(&mut team, &mut radio, tick..tick + 1);
        }
        assert!(is_one(&team, [0, 1]), "{which}");
    }
}

/// A UAV that hears nobody any more: after the lease it is a team of one, goes on with what it watches, and keeps its altitude.
#[test]
fn who_hears_nobody_goes_on_alone_at_its_own_altitude() {
    let params = fallible();
    let altitude_m = |uav: usize| Some(params.group.altitude_lowest_m + params.group.altitude_step_m * uav as f64);
    let (mut team, mut radio) = (Team::of(2, 4, params), Radio::new(1));
    for tick in 0..120 {
        if tick == 40 {
            radio.part(&[0], &[1]);
        }
        for (uav, step) in team.tick_over(tick, &mut radio).steps {
            assert_eq!(step.altitude_m, altitude_m(uav), "{tick}");
            let serves_alone = step.diagnostics.group.is_some() && crew(&team.agents[uav]) == [uav as u32];
            assert!(tick < 40 + LEASE + 1 || serves_alone, "{tick}: {uav}: {:?}", crew(&team.agents[uav]));
        }
    }
    for (uav, agent) in team.agents.iter().enumerate() {
        let picture = agent.picture();
        assert!(picture.known().iter().all(|known| known.track.status == TrackStatus::Held), "{uav}: {picture:?}");
        let error_m = team.states[uav].position.distance_m(picture.groups[0].centre.estimate().state.position())
            - picture.groups[0].standoff.distance_m;
        assert!(error_m.abs() < 30.0, "{uav}: {error_m}");
    }
    // With nothing to watch it holds a circle.
    let (mut team, mut radio) = (Team::of(2, 0, params), Radio::new(1));
    radio.part(&[0], &[1]);
    for tick in 0..20 {
        for (uav, step) in team.tick_over(tick, &mut radio).steps {
            let circle = Command { speed_m_s: 40.0, turn_rate_rad_s: 0.16 };
            assert_eq!((step.command, step.altitude_m), (circle, altitude_m(uav)));
        }
    }
}

/// Who is dead is noticed within the lease and one period, by the team, the crew and whoever asks who is there.
#[test]
fn who_is_dead_is_noticed_within_the_lease_and_a_period() {
    for dead in 0..3 {
        let (mut team, mut radio) = (Team::of(3, 4, fallible()), Radio::new(1));
        fly(&mut team, &mut radio, 0..40);
        team.off = vec![dead];
        // Its last word was of the instant before.
        fly(&mut team, &mut radio, 40..40 + LEASE);
        let rest: Vec<u32> = (0..3).filter(|uav| *uav != dead as u32).collect();
        let told = |agent: &Agent| {
            let mates: Vec<u32> = agent.picture().team.iter().map(|mate| mate.uav.0).collect();
            (mates, crew(agent), agent.presence().nth(dead))
        };
        let presence = |presence| Some((UavId(dead as u32), presence));
        for uav in &rest {
            let all = vec![0, 1, 2];
            assert_eq!(told(&team.agents[*uav as usize]), (all.clone(), all, presence(Presence::Silent)));
        }
        fly(&mut team, &mut radio, 40 + LEASE..40 + LEASE + 1);
        for uav in &rest {
            assert_eq!(told(&team.agents[*uav as usize]), (rest.clone(), rest.clone(), presence(Presence::Gone)));
        }
    }
}
