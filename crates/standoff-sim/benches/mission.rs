//! What a 100 s mission costs, agents and world included: drawn only; drawn, flown and scored.

use criterion::{Criterion, criterion_group, criterion_main};
use standoff_score::MetricSelection;
use standoff_sim::run::fly;
use standoff_sim::scenario::{Overrides, ScenarioTemplate};

fn mission(c: &mut Criterion) {
    let load = |name| ScenarioTemplate::load(name, &Overrides::default()).expect("a built-in scenario");
    let template = load("paper/table-2-pair");
    c.bench_function("mission: paper/table-2-pair, drawn only", |b| {
        let mut seed = 0;
        b.iter(|| {
            seed += 1;
            template.draw(seed).expect("a scenario of any seed")
        });
    });
    for (scenario, metrics) in
        [("paper/table-2-pair", "table-2"), ("paper/table-2-pair", "all"), ("paper/figure-9", "standard")]
    {
        let template = load(scenario);
        let choice = MetricSelection::parse(metrics).expect("names of metrics");
        c.bench_function(&format!("mission: {scenario}, metrics {metrics}"), |b| {
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
