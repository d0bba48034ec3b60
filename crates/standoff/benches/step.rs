//! What one filter step and one agent step cost.

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use common::{Team, scan_of};
use criterion::{Criterion, criterion_group, criterion_main};
use standoff::*;

fn filter(c: &mut Criterion) {
    let params = TeamParams::table_1().track;
    let transition = params.target.transition(Duration::from_s(0.5));
    let cue = Cue {
        target: TargetId(0),
        time: Time::START,
        position: Position::ORIGIN,
        velocity: Velocity::ZERO,
        position_sd_m: 20.0,
        velocity_sd_m_s: 2.0,
    };
    let start = *Track::from_cue(&cue, &params, Time::START).expect("a sound cue").estimate();
    let filter = InformationFilter::new(start).expect("a positive covariance");
    let uavs = [Position::from_m(400.0, 0.0), Position::from_m(0.0, 400.0)];
    let looks = uavs.map(|uav| (uav, sensor::measure(uav, Position::from_m(1.0, 2.0))));
    c.bench_function("filter: predict, and update fused from two UAVs", |b| {
        b.iter(|| {
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
        });
    });
}

fn agent(c: &mut Criterion) {
    for targets in [4, 40] {
        let mut team = Team::new(2, targets);
        for tick in 0..40 {
            team.tick(tick);
        }
        let (_, scans, mut inbox) = team.speak(40);
        let (mut agent, own) = (team.agents[0].clone(), team.states[0]);
        let mut now = Time::from_us(20_000_000);
        let mut sequence = 1000;
        c.bench_function(&format!("agent: one step, two UAVs, {targets} targets"), |b| {
            b.iter(|| {
                now = now + Duration::from_s(0.5);
                sequence += 1;
                for message in &mut inbox {
                    if let Message::Report(report) = message {
                        (report.time, report.sequence) = (now, sequence);
                    }
                }
                black_box(agent.step(now, &own, scan_of(&scans[0]), &inbox).command)
            });
        });
    }
}

criterion_group!(benches, filter, agent);
criterion_main!(benches);
