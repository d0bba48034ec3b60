//! What a 100 s mission of two UAVs and four targets costs: drawn, flown and scored, agents and world included.

use criterion::{Criterion, criterion_group, criterion_main};
use standoff_sim::run::fly;
use standoff_sim::scenario::{Edits, Template};
use standoff_sim::score::Choice;

fn mission(c: &mut Criterion) {
    let template = Template::load("paper/table-2-pair", &Edits::default()).expect("a built-in scenario");
    for (what, metrics) in [("the metrics of Table II", "table-2"), ("all metrics", "all")] {
        let choice = Choice::parse(metrics).expect("names of metrics");
        c.bench_function(&format!("mission: paper/table-2-pair, 100 s, {what}"), |b| {
            let mut seed = 0;
            b.iter(|| {
                seed += 1;
                fly(&template.draw(seed).expect("a scenario of any seed"), choice)
            });
        });
    }
}

criterion_group!(benches, mission);
criterion_main!(benches);
