//! Fuzz target: scenarios as TOML.

use crate::fuzz_harness::{check_message, corpus, is_unsafe_to_print, run};
use crate::scenario::{BUILT_IN, Excerpt, Problem, ScenarioTemplate, Settings};

const TOML: [&str; 34] = [
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    ".",
    ",",
    "\"\"\"",
    "'''",
    "true",
    "[uavs]",
    "[[uavs.start]]",
    "[targets]",
    "[sensor]",
    "[orbit]",
    "[guidance]",
    "[traffic]",
    "count = 2\n",
    "count",
    "file = \"/dev/zero\"\n",
    "x_m",
    "y_m",
    "mean",
    "sd",
    "min",
    "max",
    "{ mean = 1, sd = 2 }",
    "[1, 2, 3]",
    "1979-05-27T07:32:00Z",
    "a.b.c = 1\n",
    "duration_s = 1\n",
    "[[[[[[[[[[",
];

/// Checks that the message of a problem and its source excerpt are safe to print in a terminal.
fn check(problem: &Problem) {
    check_message(&problem.to_string());
    if let Some((lines, span)) = problem.excerpt.as_ref().map(Excerpt::lines) {
        assert!(lines.get(span).is_some());
        assert!(!lines.contains(|c| is_unsafe_to_print(c) && !['\n', '\t'].contains(&c)), "{lines:?}");
    }
}

/// Loads and draws a scenario; returns whether it was accepted.
fn try_one(text: &str) -> bool {
    if let Err(error) = Settings::of_record("file", text, &[]) {
        error.problems.iter().for_each(check);
    }
    let drawn = ScenarioTemplate::of_text("file", text, &[]).and_then(|template| template.draw(1));
    match drawn {
        Ok(scenario) => {
            assert!(scenario.resolved().is_ok());
            let numbers =
                |uav: &standoff::UavState| [uav.position.x_m(), uav.position.y_m(), uav.heading.rad(), uav.speed_m_s];
            assert!(scenario.uavs.iter().flat_map(numbers).all(f64::is_finite));
            true
        }
        Err(error) => {
            assert!(!error.problems.is_empty());
            error.problems.iter().for_each(check);
            false
        }
    }
}

#[test]
fn any_scenario_is_read_or_refused() {
    // Reading traffic takes long; the traffic targets cover it.
    let built_in = BUILT_IN.iter().map(|scenario| scenario.text).filter(|text| !text.contains("[traffic]"));
    let files: Vec<Vec<u8>> =
        corpus("scenario").into_iter().chain(built_in.map(|text| text.as_bytes().to_vec())).collect();
    run("scenario", 0.1, |choices| {
        // Scenario loading rejects non-UTF-8 bytes before this point.
        try_one(&String::from_utf8_lossy(&choices.mutated(&files, &TOML)))
    });
}
