//! Time of one filter step and of one agent step.

mod pieces;

use criterion::{Criterion, criterion_group, criterion_main};

fn filter(c: &mut Criterion) {
    c.bench_function("filter: predict, and update fused from two UAVs", |b| b.iter(pieces::filter()));
}

fn agent(c: &mut Criterion) {
    for targets in [4, 40] {
        let name = format!("agent: one step, two UAVs, {targets} targets");
        c.bench_function(&name, |b| b.iter(pieces::agent(targets)));
    }
}

criterion_group!(benches, filter, agent);
criterion_main!(benches);
