//! What clustering, assigning and a whole tick of a team cost against its size.

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use common::said;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use standoff::coordination::assignment::{Hand, Objective, Site, assign};
use standoff::coordination::clustering::Clusters;
use standoff::*;

/// So many points on a sunflower's spiral, which fills a disc evenly and without symmetry.
fn spread(centre: Position, n: u32, radius_m: f64) -> Vec<Position> {
    let point = |k| {
        let share = (f64::from(k) + 0.5) / f64::from(n);
        centre + Displacement::from_polar(radius_m * share.sqrt(), Angle::from_rad(2.399_963 * f64::from(k)))
    };
    (0..n).map(point).collect()
}

fn assignment(c: &mut Criterion) {
    let sensor = TeamParams::table_1().track.sensor;
    for (uavs, groups, targets) in [(4, 2, 7), (8, 4, 40), (12, 6, 120), (30, 15, 300), (100, 50, 1000)] {
        let radius_m = 1000.0 * f64::from(groups).sqrt();
        let team: Vec<Hand> = (0..)
            .zip(spread(Position::from_m(500.0, -200.0), uavs, radius_m))
            .map(|(id, position)| Hand { uav: UavId(id), position, serves: None })
            .collect();
        let members: Vec<Vec<Position>> = (0u32..)
            .zip(spread(Position::ORIGIN, groups, radius_m))
            .map(|(group, centre)| spread(centre, (targets + group) / groups, 150.0))
            .collect();
        assert_eq!(members.iter().map(Vec::len).sum::<usize>(), targets as usize);
        let sites: Vec<Site<'_>> =
            (0..).map(GroupId).zip(&members).map(|(group, members)| Site { group, members }).collect();
        let name = format!("assign: {uavs} UAVs, {groups} groups, {targets} targets");
        c.bench_function(&name, |b| b.iter(|| assign(black_box(&team), &sites, &sensor, Objective::LogDet)));
        if uavs <= 8 {
            c.bench_function(&format!("{name}, as printed"), |b| {
                b.iter(|| assign(black_box(&team), &sites, &sensor, Objective::Printed));
            });
        }
    }
}

/// Groups of twenty targets, 3 km from one another.
fn field(targets: u32) -> Vec<Position> {
    let side = (1..).find(|side| side * side >= targets.div_ceil(20)).unwrap_or(1);
    let centre = |group: u32| Position::from_m(3000.0 * f64::from(group % side), 3000.0 * f64::from(group / side));
    (0..targets.div_ceil(20)).flat_map(|group| spread(centre(group), 20, 150.0)).collect()
}

fn clustering(c: &mut Criterion) {
    for (targets, groups) in [(7, 2), (100, 5), (1000, 50)] {
        let positions: Vec<Position> = field(targets).into_iter().take(targets as usize).collect();
        let mut group = c.benchmark_group("cluster");
        group.throughput(Throughput::Elements(u64::from(targets)));
        let mut clusters = Clusters::default();
        group.bench_function(format!("from nothing: {targets} targets, {groups} groups"), |b| {
            b.iter(|| clusters.found(black_box(&positions), groups));
        });
        group.bench_function(format!("from the last: {targets} targets, {groups} groups"), |b| {
            b.iter(|| clusters.refine(black_box(&positions), groups, 50.0));
        });
    }
}

/// One tick of a whole team with a perfect radio: everything heard, the picture, every UAV's decision. Two UAVs on each
/// orbit about twenty targets; or about ten of twenty, the others measured but too far off for the orbit.
fn tick(c: &mut Criterion) {
    for (uavs, targets, outside) in
        [(2, 20, false), (10, 100, false), (100, 1000, false), (2, 20, true), (10, 100, true), (100, 1000, true)]
    {
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
                // The first of a spiral lies near its centre.
                let centre = positions[20 * (id / 2) as usize];
                UavState {
                    position: centre + Displacement::from_polar(400.0, phase),
                    heading: phase + Angle::from_deg(90.0),
                    speed_m_s: 40.0,
                    turn_rate_rad_s: 0.0,
                }
            })
            .collect();
        let cues: Vec<Cue> = (0..)
            .zip(&positions)
            .map(|(id, position)| Cue {
                target: TargetId(id),
                time: Time::START,
                position: *position,
                velocity: Velocity::ZERO,
                position_sd_m: 20.0,
                velocity_sd_m_s: 2.0,
            })
            .collect();
        let blind = vec![common::OwnedScan::default(); states.len()];
        fleet.hear(Time::START, said(&states, &blind), &cues);
        let scans: Vec<common::OwnedScan> = states
            .iter()
            .zip(0..)
            .map(|(state, id)| {
                let look = fleet.decide(UavId(id), state).look_at.expect("targets to look at");
                let boresight = look.boresight(state.position, Duration::ZERO);
                let seen = (0..).zip(&positions).filter(|(_, at)| sensor.in_view(state.position, boresight, **at));
                let detections = seen.map(|(id, at)| Detection {
                    target: TargetId(id),
                    measurement: sensor::measure(state.position, *at),
                });
                (Some(boresight), detections.collect())
            })
            .collect();
        let mut now = Time::START;
        let mut group = c.benchmark_group("tick");
        group.throughput(Throughput::Elements(u64::from(targets)));
        let half = if outside { ", half of them outside" } else { "" };
        group.bench_function(format!("{uavs} UAVs, {targets} targets{half}"), |b| {
            b.iter(|| {
                now = now + Duration::from_s(0.5);
                fleet.hear(now, said(&states, &scans), &[]);
                let turn_rates = (0..).zip(&states).map(|(id, state)| fleet.decide(UavId(id), state).command.command);
                turn_rates.map(|command| command.turn_rate_rad_s).sum::<f64>()
            });
        });
        assert_eq!(fleet.picture().groups.len(), uavs.div_ceil(2) as usize);
        assert_eq!(fleet.picture().unassigned > targets / 3, outside);
    }
}

criterion_group!(benches, clustering, assignment, tick);
criterion_main!(benches);
