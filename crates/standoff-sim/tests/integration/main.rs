//! Integration tests, in one program, which is built faster than one for each file.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

#[path = "../common/mod.rs"]
mod common;
mod consistency;
mod controllers;
mod derived_columns;
mod dynamics;
mod equations;
#[path = "../../examples/equations/mod.rs"]
mod equations_alone;
mod intruders;
mod missions;
mod monte_carlo;
mod navigation;
mod properties_numbers;
mod radio;
#[path = "../../../standoff-record/tests/common/mod.rs"]
mod row_fixtures;
mod scenarios;
#[path = "../../../standoff-score/tests/common/mod.rs"]
mod score_fixtures;
mod separation;
mod traffic_files;
mod unlabelled;
mod wind;
