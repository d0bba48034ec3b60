//! Memory: an instant allocates nothing once the agent has warmed up, and whoever comes and goes, it stays bounded.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod common;

use allocation_counter::measure;
use common::{Team, scan_of};
use standoff::*;

#[test]
fn a_warm_instant_allocates_nothing() {
    let mut team = Team::new(3, 12);
    let mut agent = Agent::new(UavId(0), TeamParams::table_1()).unwrap();
    let mut params = TeamParams::table_1();
    // One of them by the paper's rules, one by the others.
    (params.group.centre, params.group.aim) = (CentreEstimate::SmallestCircle, Aim::Middle);
    let mut fleet = Fleet::new(params).unwrap();
    let mut observed = Vec::new();
    let mut radio = Message::Report(report());
    // Once the log has as many instants as are kept of it, it lives in their room: a horizon, a minute.
    let warm_from = 130;
    for tick in 0..warm_from + 270 {
        let (now, scans, inbox) = team.speak(tick);
        let own = team.states[0];
        let of_agent = measure(|| {
            let observation = agent.observe(now, &own, Some(scan_of(&scans[0])));
            // As the simulator's radio does, which keeps messages in the room of older ones.
            agent.outbox(&observation).iter().for_each(|said| radio.clone_from(said));
            inbox.iter().for_each(|message| agent.hear(&observation, message));
            assert!(agent.decide(&observation).command.turn_rate_rad_s.is_finite());
        });
        let of_fleet = measure(|| {
            observed.clear();
            for ((id, own), scan) in (0..).zip(&team.states).zip(&scans) {
                observed.push(fleet.observe(now, UavId(id), own, Some(scan_of(scan))));
            }
            inbox.iter().for_each(|message| fleet.hear(&observed[0], message));
            for observation in &observed {
                assert!(fleet.decide(observation).command.turn_rate_rad_s.is_finite());
            }
        });
        let allocations = (of_agent.count_total, of_fleet.count_total);
        assert!(
            if tick < warm_from { tick > 0 || allocations.0 > 0 } else { allocations == (0, 0) },
            "{tick}: {allocations:?}"
        );
        team.decide(now, &scans, &inbox);
    }
}

/// A report of nothing.
fn report() -> Report {
    Report::of(UavId(1), Time::START, Team::new(1, 0).states[0])
}

/// Of every so many instants one brings another one of a kind, which stays for some; their numbers never come again.
fn there(tick: i64, every: i64, stays: i64) -> impl Iterator<Item = u32> {
    let first = (tick - stays + every).max(0) / every;
    (first..=tick / every).map(|number| number as u32)
}

/// Flies one agent for so many instants with targets and teammates that come and go; gives, per block of instants, by how
/// many bytes its memory grew.
fn growth_bytes(blocks: i64, instants: i64) -> Vec<i64> {
    let mut params = TeamParams::table_1();
    params.track.forget_lost_s = 30.0;
    let mut agent = Agent::new(UavId(0), params).unwrap();
    let own = Team::new(1, 0).states[0];
    let look = Angle::from_deg(180.0);
    let mut said = report();
    let mut block = |block: i64| {
        for tick in block * instants..(block + 1) * instants {
            let now = Time::from_us(tick * 500_000);
            let at = |target: u32| Position::from_m(10.0 * f64::from(target % 7), 40.0 * f64::from(target % 3));
            let of = |target| Detection {
                label: TargetLabel(target),
                measurement: sensor::measure(own.position, at(target)),
            };
            let detections: Vec<Detection> = there(tick, 40, 100).map(of).collect();
            let scan = Scan { boresight: Some(look), detections: &detections };
            let observation = agent.observe(now, &own, Some(scan));
            for uav in there(tick, 100, 150) {
                (said.uav, said.time, said.boresight) = (UavId(1 + uav), now, Some(look));
                said.detections.clone_from(&detections);
                agent.hear(&observation, &Message::Report(said.clone()));
            }
            agent.decide(&observation);
            let picture = agent.picture();
            assert!(picture.known().len() < 12 && picture.team.len() < 5, "{picture:?}");
        }
    };
    (0..blocks).map(|number| measure(|| block(number)).bytes_current).collect()
}

fn stays_flat(blocks: i64, instants: i64) {
    let growth_bytes = growth_bytes(blocks, instants);
    // The first block makes the room, the others live in it.
    let later: i64 = growth_bytes[1..].iter().sum();
    assert!(growth_bytes[0] > 0 && later.abs() < 4096, "{growth_bytes:?}");
}

#[test]
fn memory_stays_flat_whoever_comes_and_goes() {
    stays_flat(5, 4_000);
}

#[test]
#[ignore = "long: for .ci/long"]
fn memory_stays_flat_over_ten_million_instants() {
    stays_flat(10, 1_000_000);
}
