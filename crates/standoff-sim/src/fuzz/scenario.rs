//! Scenarios, as TOML.

use super::{check_message, corpus, run, upsets};
use crate::scenario::{BUILT_IN, Excerpt, Problem, Settings, Template};

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
    "[[uavs.at]]",
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

/// It is told in a message fit for people, and drawn under a text fit for a terminal.
fn check(problem: &Problem) {
    check_message(&problem.to_string());
    if let Some((lines, span)) = problem.excerpt.as_ref().map(Excerpt::lines) {
        assert!(lines.get(span).is_some());
        assert!(!lines.contains(|c| upsets(c) && !['\n', '\t'].contains(&c)), "{lines:?}");
    }
}

/// Whether it was accepted.
fn try_one(text: &str) -> bool {
    if let Err(error) = Settings::of_record("file", text) {
        error.problems.iter().for_each(check);
    }
    let drawn = Template::of_text("file", text, None).and_then(|template| template.draw(1));
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
    // Traffic takes long to read, and is tried elsewhere.
    let built_in = BUILT_IN.iter().map(|scenario| scenario.text).filter(|text| !text.contains("[traffic]"));
    let files: Vec<Vec<u8>> =
        corpus("scenario").into_iter().chain(built_in.map(|text| text.as_bytes().to_vec())).collect();
    run("scenario", 0.1, |choices| {
        // Bytes that are no text never get as far as here.
        try_one(&String::from_utf8_lossy(&choices.mutated(&files, &TOML)))
    });
}
