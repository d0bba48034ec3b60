//! Does one kind of work so many times and nothing else: what instructions and CPU time are counted on.
//!
//! `work NAME REPETITIONS`

use std::hint::black_box;
use std::process::ExitCode;

use standoff_sim::run::fly;
use standoff_sim::scenario::{Edits, Template};
use standoff_sim::score::Choice;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let n = arguments.get(1).and_then(|n| n.parse().ok());
    let (Some(name), Some(n)) = (arguments.first(), n) else {
        eprintln!("work NAME REPETITIONS");
        return ExitCode::from(2);
    };
    match name.as_str() {
        "draw" => draw(n),
        "pair" => pair(n, "table-2"),
        "pair-all" => pair(n, "all"),
        _ => return ExitCode::from(2),
    }
    ExitCode::SUCCESS
}

fn draw(n: u64) {
    let template = Template::load("paper/table-2-pair", &Edits::default()).expect("a built-in scenario");
    for seed in 0..n {
        black_box(template.draw(seed).expect("a scenario of any seed"));
    }
}

fn pair(n: u64, metrics: &str) {
    let template = Template::load("paper/table-2-pair", &Edits::default()).expect("a built-in scenario");
    let choice = Choice::parse(metrics).expect("names of metrics");
    let mut sums = vec![0.0; standoff_sim::score::Metrics::NAMES.len()];
    for seed in 0..n {
        let scores = fly(&template.draw(seed).expect("a scenario of any seed"), choice).expect("sound");
        for (sum, value) in sums.iter_mut().zip(scores.values()) {
            *sum += value.unwrap_or(0.0);
        }
    }
    for (name, sum) in standoff_sim::score::Metrics::NAMES.iter().zip(sums) {
        println!("{name} {}", sum / n as f64);
    }
}
