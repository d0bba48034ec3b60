//! Time of clustering, of assignment and of a whole time step of a team, for different team sizes.

mod pieces;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pieces::{FleetTicks, field, spread};
use standoff::coordination::assignment::AvailableUav;
use standoff::coordination::assignment::CandidateGroup;
use standoff::coordination::assignment::assign;
use standoff::coordination::clustering::KMeans;
use standoff::params::Objective;
use standoff::*;

fn assignment(c: &mut Criterion) {
    let sensor = TeamParams::paper().track.sensor;
    for (uavs, groups, targets) in [(4, 2, 7), (8, 4, 40), (12, 6, 120), (30, 15, 300), (100, 50, 1000)] {
        let radius_m = 1000.0 * f64::from(groups).sqrt();
        let team: Vec<AvailableUav> = (0..)
            .zip(spread(Position::from_m(500.0, -200.0), uavs, radius_m))
            .map(|(id, position)| AvailableUav { uav: UavId(id), position, current_group: None })
            .collect();
        let members: Vec<Vec<Position>> = (0u32..)
            .zip(spread(Position::ORIGIN, groups, radius_m))
            .map(|(group, centre)| spread(centre, (targets + group) / groups, 150.0))
            .collect();
        assert_eq!(members.iter().map(Vec::len).sum::<usize>(), targets as usize);
        let sites: Vec<CandidateGroup<'_>> = (0..)
            .map(GroupId)
            .zip(&members)
            .map(|(group, members)| CandidateGroup { group, members, priorities: &[] })
            .collect();
        let name = format!("assign: {uavs} UAVs, {groups} groups, {targets} targets");
        c.bench_function(&name, |b| b.iter(|| assign(black_box(&team), &sites, &sensor, Objective::LogDet, 0.5)));
        if uavs <= 8 {
            c.bench_function(&format!("{name}, as printed"), |b| {
                b.iter(|| assign(black_box(&team), &sites, &sensor, Objective::Paper, 0.5));
            });
        }
    }
}

fn clustering(c: &mut Criterion) {
    for (targets, groups) in [(7, 2), (100, 5), (1000, 50)] {
        let positions: Vec<Position> = field(targets);
        let mut group = c.benchmark_group("cluster");
        group.throughput(Throughput::Elements(u64::from(targets)));
        let mut clusters = KMeans::default();
        group.bench_function(format!("from nothing: {targets} targets, {groups} groups"), |b| {
            b.iter(|| clusters.seed(black_box(&positions), groups));
        });
        group.bench_function(format!("from the last: {targets} targets, {groups} groups"), |b| {
            b.iter(|| clusters.refine(black_box(&positions), groups, 50.0));
        });
    }
}

fn tick(c: &mut Criterion) {
    for (uavs, targets, outside) in [
        (2, 4, false),
        (2, 20, false),
        (10, 100, false),
        (100, 1000, false),
        (2, 20, true),
        (10, 100, true),
        (100, 1000, true),
    ] {
        let mut ticks = FleetTicks::new(uavs, targets, outside);
        let mut group = c.benchmark_group("tick");
        group.throughput(Throughput::Elements(u64::from(targets)));
        let half = if outside { ", half of them outside" } else { "" };
        group.bench_function(format!("{uavs} UAVs, {targets} targets{half}"), |b| b.iter(|| ticks.tick()));
        assert_eq!(ticks.fleet.team_state().groups.len(), uavs.div_ceil(2) as usize);
        assert_eq!(ticks.fleet.team_state().ungrouped_count > targets / 3, outside);
    }
}

criterion_group!(benches, clustering, assignment, tick);
criterion_main!(benches);
