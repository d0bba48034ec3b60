//! Memory: a time step of a warm agent allocates nothing, and memory stays bounded while teammates and targets come and
//! go.

use crate::common::{Team, scan_of};
use allocation_counter::measure;
use standoff::params::CentreEstimate;
use standoff::params::Pointing;
use standoff::*;

#[test]
fn a_warm_time_step_allocates_nothing() {
    let mut team = Team::new(3, 12);
    let mut params = TeamParams::paper();
    // Without handoffs back and forth, whose events need memory.
    params.group.handoff_margin_m = 50.0;
    let mut agent = Agent::new(UavId(0), params).unwrap();
    // The agent uses the paper's rules, the fleet the modified ones.
    (params.group.centre, params.group.pointing) = (CentreEstimate::EnclosingCircle, Pointing::AngularMidpoint);
    let mut fleet = TeamAgent::new(params).unwrap();
    let mut observed = Vec::new();
    let mut radio = Message::Report(report());
    // The log reuses its memory once it covers the whole horizon of one minute.
    let warm_from = 130;
    for tick in 0..warm_from + 270 {
        let (now, scans, inbox) = team.speak(tick);
        let own = team.states[0];
        let of_agent = measure(|| {
            let observation = agent.observe(now, &own, Some(scan_of(&scans[0])));
            // Like the simulated radio, which reuses the memory of older messages.
            agent.outbox(&observation).iter().for_each(|message| radio.clone_from(message));
            inbox.iter().for_each(|message| agent.receive(&observation, message));
            assert!(agent.decide(&observation).command.turn_rate_rad_s.is_finite());
        });
        let of_fleet = measure(|| {
            observed.clear();
            for ((id, own), scan) in (0..).zip(&team.states).zip(&scans) {
                observed.push(fleet.observe(now, UavId(id), own, Some(scan_of(scan))));
            }
            inbox.iter().for_each(|message| fleet.receive(&observed[0], message));
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

/// A message that announces more elements than it has does not reserve memory for them.
#[test]
fn a_decoded_message_takes_memory_in_proportion_to_its_bytes() {
    let detection = Detection {
        label: Some(TargetLabel(0)),
        measurement: RangeBearingMeasurement { range_m: 1.0, bearing: Angle::ZERO },
        range_rate_m_s: None,
    };
    for detections in [0, 1, 100, 10_000] {
        let report = Report { detections: vec![detection; detections], ..report() };
        let mut bytes = wire::encode(&Message::Report(report)).unwrap();
        // The number of detections follows the 78 bytes of the report's header.
        for announced in [detections as u16, u16::MAX] {
            bytes.truncate(bytes.len() - 4);
            bytes[78..80].copy_from_slice(&announced.to_le_bytes());
            bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
            let memory = measure(|| assert_eq!(wire::decode(&bytes).is_ok(), usize::from(announced) == detections));
            assert!(memory.bytes_max <= 100 + 5 * bytes.len() as u64, "{detections}, {announced}: {memory:?}");
        }
    }
}

/// A report without detections.
fn report() -> Report {
    Report::position_only(UavId(1), Time::EPOCH, Team::new(1, 0).states[0])
}

/// Numbers of the objects present at a tick. A new object appears every `every` ticks and stays for `stays` ticks.
/// Numbers are never reused.
fn present(tick: i64, every: i64, stays: i64) -> impl Iterator<Item = u32> {
    let first = (tick - stays + every).max(0) / every;
    (first..=tick / every).map(|number| number as u32)
}

/// Flies one agent with targets and teammates that come and go. Returns the growth of its memory in bytes, per block of
/// `steps` time steps.
fn growth_bytes(blocks: i64, steps: i64) -> Vec<i64> {
    let mut params = TeamParams::paper();
    params.track.lost_track_retention_s = 30.0;
    let mut agent = Agent::new(UavId(0), params).unwrap();
    let own = Team::new(1, 0).states[0];
    let boresight = Angle::from_deg(180.0);
    let mut report = report();
    let mut block = |block: i64| {
        for tick in block * steps..(block + 1) * steps {
            let now = Time::from_us(tick * 500_000);
            let at = |target: u32| Position::from_m(10.0 * f64::from(target % 7), 40.0 * f64::from(target % 3));
            let of = |target| Detection {
                label: Some(TargetLabel(target)),
                measurement: standoff::sensor::measure(own.position, at(target)),
                range_rate_m_s: None,
            };
            let detections: Vec<Detection> = present(tick, 40, 100).map(of).collect();
            let scan = Scan { boresight: Some(boresight), detections: &detections };
            let observation = agent.observe(now, &own, Some(scan));
            for uav in present(tick, 100, 150) {
                (report.uav, report.time, report.boresight) = (UavId(1 + uav), now, Some(boresight));
                report.detections.clone_from(&detections);
                agent.receive(&observation, &Message::Report(report.clone()));
            }
            agent.decide(&observation);
            let team_state = agent.team_state();
            assert!(team_state.tracks().len() < 12 && team_state.teammates.len() < 5, "{team_state:?}");
        }
    };
    (0..blocks).map(|number| measure(|| block(number)).bytes_current).collect()
}

fn stays_flat(blocks: i64, steps: i64) {
    let growth_bytes = growth_bytes(blocks, steps);
    // The first block allocates the memory, the others reuse it.
    let later: i64 = growth_bytes[1..].iter().sum();
    assert!(growth_bytes[0] > 0 && later.abs() < 4096, "{growth_bytes:?}");
}

#[test]
fn memory_stays_flat_while_teammates_and_targets_come_and_go() {
    stays_flat(5, 4_000);
}

#[test]
#[ignore = "long: for .ci/long"]
fn memory_stays_flat_over_ten_million_time_steps() {
    stays_flat(10, 1_000_000);
}
