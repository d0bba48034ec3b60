//! The mission by the equations alone. docs/developer/benchmarks.md compares its cost with that of a run.

use standoff_score::MetricSelection;
use standoff_sim::run::fly;

use crate::common::load;
use crate::equations_alone::Equations;

/// Means of 300 runs each: errors of position, orbit and phase agree within 8 %, although starts and noise differ.
#[test]
fn the_equations_alone_fly_the_mission_of_the_runs() {
    let runs = 300;
    let scenario = |seed| load("paper/table-2-pair", &[], seed);
    let equations = Equations::new(scenario(0).settings);
    let mut sums = [[0.0; 3]; 2];
    for seed in 0..runs {
        let [position_m, _, standoff_m, phase_rad, _] = equations.fly(seed);
        let metrics = fly(&scenario(seed), MetricSelection::parse("table-2").unwrap()).unwrap();
        let metrics =
            [metrics["position_error_m"], metrics["standoff_error_own_estimate_m"], metrics["phase_error_deg"]];
        let pairs = [[position_m, standoff_m, phase_rad.to_degrees()], metrics.map(Option::unwrap)];
        for (sum, errors) in sums.iter_mut().zip(pairs) {
            sum.iter_mut().zip(errors).for_each(|(sum, error)| *sum += error / runs as f64);
        }
    }
    for (alone, flown) in sums[0].iter().zip(sums[1]) {
        assert!((alone / flown - 1.0).abs() < 0.08, "{sums:?}");
    }
}
