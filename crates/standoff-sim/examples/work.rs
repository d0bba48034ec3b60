//! Repeats one kind of work, to count its instructions and CPU time.
//!
//! `work KIND REPETITIONS`; docs/developer/benchmarks.md describes the kinds.

mod equations;
#[path = "../../standoff/benches/pieces/mod.rs"]
mod pieces;

use std::hint::black_box;
use std::process::ExitCode;

use equations::Equations;
use pieces::FleetTicks;
use standoff_score::MetricSelection;
use standoff_sim::run::fly;
use standoff_sim::scenario::{Overrides, ScenarioTemplate};

const USAGE: &str = "usage: work KIND REPETITIONS, where KIND is one of filter, agent, fleet-tick, draw, equations, pair, pair-standard, pair-all, figure-9";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [kind, repetitions] = arguments.as_slice() else { return usage() };
    let Ok(n) = repetitions.parse() else { return usage() };
    match kind.as_str() {
        "filter" => repeat(n, pieces::filter()),
        "agent" => repeat(n, pieces::agent(4)),
        "fleet-tick" => {
            let mut ticks = FleetTicks::new(2, 4, false);
            repeat(n, || ticks.tick());
        }
        "draw" => {
            let template = template("paper/table-2-pair");
            let mut seed = 0;
            repeat(n, || {
                seed += 1;
                template.draw(seed).expect("a scenario of any seed")
            });
        }
        "equations" => {
            let equations =
                Equations::new(template("paper/table-2-pair").draw(0).expect("a scenario of any seed").settings);
            let mut seed = 0;
            repeat(n, || {
                seed += 1;
                equations.fly(seed)
            });
        }
        "pair" => fly_each(n, "paper/table-2-pair", "table-2"),
        "pair-standard" => fly_each(n, "paper/table-2-pair", "standard"),
        "pair-all" => fly_each(n, "paper/table-2-pair", "all"),
        "figure-9" => fly_each(n, "paper/figure-9", "standard"),
        _ => return usage(),
    }
    ExitCode::SUCCESS
}

fn usage() -> ExitCode {
    eprintln!("{USAGE}");
    ExitCode::from(2)
}

fn repeat<T>(n: u64, mut work: impl FnMut() -> T) {
    for _ in 0..n {
        black_box(work());
    }
}

fn template(scenario: &str) -> ScenarioTemplate {
    ScenarioTemplate::load(scenario, &Overrides::default()).expect("a built-in scenario")
}

/// Draws, flies and scores the runs of seeds 0 to n - 1.
fn fly_each(n: u64, scenario: &str, metrics: &str) {
    let template = template(scenario);
    let choice = MetricSelection::parse(metrics).expect("names of metrics");
    for seed in 0..n {
        let scenario = template.draw(seed).expect("a scenario of any seed");
        black_box(fly(&scenario, choice).expect("a run that ends"));
    }
}
