//! Repeatable workloads for the benchmarks, and for the simulator's example `work`, whose instructions are counted.

#![allow(dead_code, unreachable_pub, clippy::allow_attributes, reason = "a module shared by binaries")]

#[path = "../../tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use common::{OwnedScan, Team, observe_all, scan_of, step};
use standoff::message::MessageSource;
use standoff::message::ReceivedRange;
use standoff::tracking::information_filter::Contribution;
use standoff::*;

const PERIOD: Duration = Duration::from_us(500_000);

/// Returns `n` points on a sunflower spiral, which fills a disc evenly and without symmetry. The first is near the
/// centre.
pub fn spread(centre: Position, n: u32, radius_m: f64) -> Vec<Position> {
    let point = |k| {
        let share = (f64::from(k) + 0.5) / f64::from(n);
        centre + Displacement::from_polar(radius_m * share.sqrt(), Angle::from_rad(2.399_963 * f64::from(k)))
    };
    (0..n).map(point).collect()
}

/// Targets in groups of twenty that are 3 km apart; the last group may have fewer.
pub fn field(targets: u32) -> Vec<Position> {
    let groups = targets.div_ceil(20);
    let side = (1..).find(|side| side * side >= groups).unwrap_or(1);
    let centre = |group: u32| Position::from_m(3000.0 * f64::from(group % side), 3000.0 * f64::from(group / side));
    (0..groups).flat_map(|group| spread(centre(group), 20, 150.0)).take(targets as usize).collect()
}

fn cue(label: TargetLabel, position: Position) -> Cue {
    let (velocity, position_sd_m, velocity_sd_m_s) = (Velocity::ZERO, 20.0, 2.0);
    let (source, issued_at, sequence) = (0, Time::EPOCH, label.0 as u16);
    Cue {
        source,
        issued_at,
        sequence,
        label: Some(label),
        time: issued_at,
        position,
        velocity,
        position_sd_m,
        velocity_sd_m_s,
        priority: None,
    }
}

/// Workload: prediction of one target's filter, and an update with measurements of two UAVs, always from the same
/// start.
pub fn filter() -> impl FnMut() -> Estimate {
    let params = TeamParams::paper().track;
    let transition = params.target.transition(PERIOD);
    let cue = cue(TargetLabel(0), Position::ORIGIN);
    let start = *Track::from_cue(&cue, &params, Time::EPOCH).expect("the cue is valid").estimate();
    let uavs = [Position::from_m(400.0, 0.0), Position::from_m(0.0, 400.0)];
    let measurements = uavs.map(|uav| (uav, standoff::sensor::measure(uav, Position::from_m(1.0, 2.0))));
    move || {
        let mut estimate = *black_box(&start);
        estimate.predict(&transition);
        let at = estimate.state.position();
        let mut sum = Contribution::default();
        for (uav, z) in &measurements {
            sum += Contribution::from_measurement(&params.sensor, *uav, z, at);
        }
        estimate.update(&sum);
        assert!(estimate.is_valid());
        estimate
    }
}

/// Workload: a time step of one of two agents that share `targets` targets, with all reports received.
pub fn agent(targets: u32) -> impl FnMut() -> Command {
    let mut team = Team::new(2, targets);
    for tick in 0..40 {
        team.tick(tick);
    }
    let (_, scans, mut inbox) = team.speak(40);
    let (mut agent, own) = (team.agents[0].clone(), team.states[0]);
    let mut tick = 39;
    move || {
        tick += 1;
        let at = |tick: i64| Time::from_us(tick * PERIOD.us());
        let now = at(tick);
        for message in &mut inbox {
            if let Message::Report(report) = message {
                (report.time, report.sequence) = (now, 1000 + tick as u32);
                // The log status of a sender that has received everything except the current messages.
                let log_status = report.log_status.get_or_insert_default();
                (log_status.committed_until, log_status.listed_after) = (at(tick - 3), at(tick - 43));
                let held = |id| ReceivedRange { source: MessageSource::Uav(UavId(id)), from: tick - 42, to: tick - 1 };
                log_status.received.clear();
                log_status.received.extend([0, 1].map(held));
            }
        }
        step(&mut agent, now, &own, scan_of(&scans[0]), &inbox).command
    }
}

/// Workload: time steps of a whole team with an ideal radio, in an unchanging world. Two UAVs fly around each group of
/// twenty targets.
pub struct FleetTicks {
    /// The team.
    pub fleet: TeamAgent,
    now: Time,
    states: Vec<UavState>,
    scans: Vec<OwnedScan>,
}

impl FleetTicks {
    /// Creates a team that has received the cues of its targets. With `outside`, half of the targets are measured but
    /// too far away for the orbit.
    pub fn new(uavs: u32, targets: u32, outside: bool) -> Self {
        let mut positions = field(targets);
        if outside {
            // To the south-west of the centre, within view of both UAVs.
            let away = Displacement::from_polar(650.0, Angle::from_deg(-135.0));
            for site in positions.chunks_mut(20) {
                site.iter_mut().skip(10).for_each(|at| *at = *at + away);
            }
        }
        let sensor = TeamParams::paper().track.sensor;
        let mut fleet = TeamAgent::new(TeamParams::paper()).expect("the parameters of Table I are valid");
        let states: Vec<UavState> = (0..uavs)
            .map(|id: u32| {
                let phase = Angle::from_deg(90.0 * f64::from(id % 2));
                let centre = positions[20 * (id / 2) as usize];
                UavState::level_flight(
                    centre + Displacement::from_polar(400.0, phase),
                    phase + Angle::from_deg(90.0),
                    40.0,
                )
            })
            .collect();
        let cue = |(id, position): (u32, &Position)| Message::Cue(cue(TargetLabel(id), *position));
        let cues: Vec<Message> = (0..).zip(&positions).map(cue).collect();
        let blind = vec![OwnedScan::default(); states.len()];
        let observed = observe_all(&mut fleet, Time::EPOCH, &states, &blind, &cues);
        let scans = states.iter().zip(&observed).map(|(state, observation)| {
            let look = fleet.decide(observation).pointing_target.expect("the sensor has a target");
            let boresight = look.boresight(state.position, Duration::ZERO);
            let seen = (0..).zip(&positions).filter(|(_, at)| sensor.in_view(state.position, boresight, **at));
            let detections = seen.map(|(id, at)| Detection {
                label: Some(TargetLabel(id)),
                measurement: standoff::sensor::measure(state.position, *at),
                range_rate_m_s: None,
            });
            (Some(boresight), detections.collect())
        });
        let scans = scans.collect();
        Self { fleet, now: Time::EPOCH, states, scans }
    }

    /// Runs one time step: messages, team state and the decisions of all UAVs. Returns the sum of the turn rates,
    /// rad/s.
    pub fn tick(&mut self) -> f64 {
        self.now = self.now + PERIOD;
        let observed = observe_all(&mut self.fleet, self.now, &self.states, &self.scans, &[]);
        observed.iter().map(|observation| self.fleet.decide(observation).command.turn_rate_rad_s).sum()
    }
}
