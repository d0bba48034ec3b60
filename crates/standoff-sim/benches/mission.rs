//! What a 100 s mission of two UAVs and four targets costs, agents, world and scores included.

use criterion::{Criterion, criterion_group, criterion_main};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Edits, Scenario};
use standoff_sim::score::{Rules, Scorer};

fn mission(c: &mut Criterion) {
    let scenario = Scenario::load("paper/table-2-pair", &Edits::default(), 1).expect("a built-in scenario");
    c.bench_function("mission: paper/table-2-pair, 100 s, flown and scored", |b| {
        b.iter(|| {
            let mut mission = Mission::new(&scenario).expect("a checked scenario");
            let mut scorer = Scorer::new(Rules::of(&scenario.settings));
            while let Some(frame) = mission.frame() {
                scorer.frame(&frame);
            }
            scorer.metrics()
        });
    });
}

criterion_group!(benches, mission);
criterion_main!(benches);
