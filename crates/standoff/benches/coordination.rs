//! What assigning UAVs to groups costs against their numbers.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use standoff::coordination::assignment::{Hand, Objective, Site, assign};
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

criterion_group!(benches, assignment);
criterion_main!(benches);
