//! Pieces of work, ready to be repeated: what the benchmarks time and the simulator's example `work` is counted on.

#![allow(dead_code, unreachable_pub, clippy::allow_attributes, reason = "a module shared by binaries")]

#[path = "../../tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use common::{OwnedScan, Team, observe_all, scan_of, step};
use standoff::*;

const PERIOD: Duration = Duration::from_us(500_000);

/// So many points on a sunflower's spiral, which fills a disc evenly and without symmetry; the first near its centre.
pub fn spread(centre: Position, n: u32, radius_m: f64) -> Vec<Position> {
    let point = |k| {
        let share = (f64::from(k) + 0.5) / f64::from(n);
        centre + Displacement::from_polar(radius_m * share.sqrt(), Angle::from_rad(2.399_963 * f64::from(k)))
    };
    (0..n).map(point).collect()
}

/// Targets in groups of twenty, 3 km from one another; the last group may have fewer.
pub fn field(targets: u32) -> Vec<Position> {
    let groups = targets.div_ceil(20);
    let side = (1..).find(|side| side * side >= groups).unwrap_or(1);
    let centre = |group: u32| Position::from_m(3000.0 * f64::from(group % side), 3000.0 * f64::from(group / side));
    (0..groups).flat_map(|group| spread(centre(group), 20, 150.0)).take(targets as usize).collect()
}

fn cue(label: TargetLabel, position: Position) -> Cue {
    let (velocity, position_sd_m, velocity_sd_m_s) = (Velocity::ZERO, 20.0, 2.0);
    let (searcher, said, number) = (0, Time::START, label.0 as u16);
    Cue { searcher, said, number, label, time: said, position, velocity, position_sd_m, velocity_sd_m_s }
}

/// One target's filter: a prediction, and an update fused from two UAVs, each time from the same start.
pub fn filter() -> impl FnMut() -> InformationFilter {
    let params = TeamParams::table_1().track;
    let transition = params.target.transition(PERIOD);
    let cue = cue(TargetLabel(0), Position::ORIGIN);
    let start = *Track::from_cue(&cue, &params, Time::START).expect("a sound cue").estimate();
    let filter = InformationFilter::new(start).expect("a positive covariance");
    let uavs = [Position::from_m(400.0, 0.0), Position::from_m(0.0, 400.0)];
    let looks = uavs.map(|uav| (uav, sensor::measure(uav, Position::from_m(1.0, 2.0))));
    move || {
        let mut filter = *black_box(&filter);
        filter.predict(&transition);
        let at = filter.estimate().state.position();
        let mut sum = Contribution::default();
        for (uav, z) in &looks {
            sum += Contribution::of_measurement(&params.sensor, *uav, z, at);
        }
        filter.update(&sum);
        assert!(filter.is_sound());
        filter
    }
}

/// One of two agents that share so many targets: a step, all reports heard.
pub fn agent(targets: u32) -> impl FnMut() -> Command {
    let mut team = Team::new(2, targets);
    for tick in 0..40 {
        team.tick(tick);
    }
    let (_, scans, mut inbox) = team.speak(40);
    let (mut agent, own) = (team.agents[0].clone(), team.states[0]);
    let mut instant = 39;
    move || {
        instant += 1;
        let at = |instant: i64| Time::from_us(instant * PERIOD.us());
        let now = at(instant);
        for message in &mut inbox {
            if let Message::Report(report) = message {
                (report.time, report.sequence) = (now, 1000 + instant as u32);
                // As it would say: it has heard all but what is said now.
                let knowledge = report.knowledge.get_or_insert_default();
                (knowledge.committed, knowledge.listed_after) = (at(instant - 3), at(instant - 43));
                let held = |id| Held { speaker: Speaker::Uav(UavId(id)), from: instant - 42, to: instant - 1 };
                knowledge.held.clear();
                knowledge.held.extend([0, 1].map(held));
            }
        }
        step(&mut agent, now, &own, scan_of(&scans[0]), &inbox).command
    }
}

/// A whole team with a perfect radio, at one instant for ever: two UAVs on each orbit about twenty targets.
pub struct FleetTicks {
    /// The team.
    pub fleet: Fleet,
    now: Time,
    states: Vec<UavState>,
    scans: Vec<OwnedScan>,
}

impl FleetTicks {
    /// A team that was told of its targets. With `outside`, half of them are measured but too far off for the orbit.
    pub fn new(uavs: u32, targets: u32, outside: bool) -> Self {
        let mut positions = field(targets);
        if outside {
            // To the south-west of the centre, in line with both UAVs.
            let away = Displacement::from_polar(650.0, Angle::from_deg(-135.0));
            for site in positions.chunks_mut(20) {
                site.iter_mut().skip(10).for_each(|at| *at = *at + away);
            }
        }
        let sensor = TeamParams::table_1().track.sensor;
        let mut fleet = Fleet::new(TeamParams::table_1()).expect("Table I is in range");
        let states: Vec<UavState> = (0..uavs)
            .map(|id: u32| {
                let phase = Angle::from_deg(90.0 * f64::from(id % 2));
                let centre = positions[20 * (id / 2) as usize];
                UavState::straight(centre + Displacement::from_polar(400.0, phase), phase + Angle::from_deg(90.0), 40.0)
            })
            .collect();
        let cue = |(id, position): (u32, &Position)| Message::Cue(cue(TargetLabel(id), *position));
        let cues: Vec<Message> = (0..).zip(&positions).map(cue).collect();
        let blind = vec![OwnedScan::default(); states.len()];
        let observed = observe_all(&mut fleet, Time::START, &states, &blind, &cues);
        let scans = states.iter().zip(&observed).map(|(state, observation)| {
            let look = fleet.decide(observation).look_at.expect("targets to look at");
            let boresight = look.boresight(state.position, Duration::ZERO);
            let seen = (0..).zip(&positions).filter(|(_, at)| sensor.in_view(state.position, boresight, **at));
            let detections = seen.map(|(id, at)| Detection {
                label: TargetLabel(id),
                measurement: sensor::measure(state.position, *at),
            });
            (Some(boresight), detections.collect())
        });
        let scans = scans.collect();
        Self { fleet, now: Time::START, states, scans }
    }

    /// Everything heard, the picture, every UAV's decision; the sum of the turn rates, in rad/s.
    pub fn tick(&mut self) -> f64 {
        self.now = self.now + PERIOD;
        let observed = observe_all(&mut self.fleet, self.now, &self.states, &self.scans, &[]);
        observed.iter().map(|observation| self.fleet.decide(observation).command.turn_rate_rad_s).sum()
    }
}
