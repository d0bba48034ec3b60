//! Table II: three columns, five rows, and the differences between the columns.

use standoff_sim::score::{Choice, Metrics};

use super::claim::{Claim, Finding, Paper, shown};
use super::flights::{Plan, score};
use super::statistics::Estimate;
use super::study::{Data, Study, Table};
use crate::failure::Failure;

/// A row of the table: the paper's numbers by column.
struct Row {
    name: &'static str,
    unit: &'static str,
    metric: &'static str,
    paper: [Option<f64>; 3],
    /// Why the numbers, or the difference, do not come out where they do not.
    numbers: &'static str,
    difference: &'static str,
}

const COLUMNS: [(&str, &str); 3] = [
    ("one UAV", "paper/table-2-single"),
    ("two UAVs, basic", "paper/table-2-pair-basic"),
    ("two UAVs, active measures", "paper/table-2-pair"),
];

/// What the paper leaves open decides all numbers at once.
const UNPUBLISHED: &str = "it hangs on what the paper does not print";

const ROWS: [Row; 5] = [
    Row {
        name: "position error",
        unit: "m",
        metric: "position_error_m",
        paper: [Some(9.5227), Some(6.8615), Some(6.8570)],
        numbers: UNPUBLISHED,
        difference: "the measures hardly change the geometry of the measurements",
    },
    Row {
        name: "velocity error",
        unit: "m/s",
        metric: "velocity_error_m_s",
        paper: [Some(1.6252), Some(1.2887), Some(1.2768)],
        numbers: UNPUBLISHED,
        difference: "the measures hardly change the geometry of the measurements",
    },
    Row {
        name: "standoff distance error",
        unit: "m",
        metric: "standoff_tracking_error_m",
        paper: [Some(31.5984), Some(29.8649), Some(9.1261)],
        numbers: "it hangs on the way onto the orbit (see the settled row), so on where the UAVs start and how long a run \
                  is, which the paper does not print",
        difference: "the way onto the orbit, which the measures shorten but do not spare, weighs more here",
    },
    Row {
        name: "phase error",
        unit: "deg",
        metric: "phase_error_deg",
        paper: [None, Some(2.3173), Some(1.6205)],
        numbers: "it hangs on how far apart the UAVs start, which the paper does not print; here they start at theta_d",
        difference: "measure 1 does it, with measure 2 or without: with its steeper field the turn rate is far more often at \
                     its limit",
    },
    Row {
        name: "line of sight",
        unit: "deg",
        metric: "line_of_sight_deg",
        paper: [Some(15.6864), Some(15.4000), Some(14.5131)],
        numbers: UNPUBLISHED,
        difference: "it follows the standoff distance error",
    },
];

/// Numbers beside the paper's: metric, name, factor to its unit.
const BESIDES: [(&str, &str, f64); 4] = [
    ("standoff_tracking_error_m_settled", "standoff distance error, once settled (m)", 1.0),
    ("standoff_error_m", "standoff distance error, true geometry (m)", 1.0),
    ("standoff_error_m_settled", "the same, once settled (m)", 1.0),
    ("turn_rate_saturated_fraction", "turn rate at its limit (% of the time)", 100.0),
];

/// The differences that the paper draws attention to: column from, column to, rows.
const DIFFERENCES: [(usize, usize, &[usize]); 2] = [(0, 1, &[0, 1]), (1, 2, &[2, 3, 4, 0, 1])];

/// Flies the table.
pub(crate) fn table_2(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "table-2",
        "Table II: tracking one group of four targets",
        "Three scenarios, the same seeds. *Basic* is the field (13) with a variable standoff distance (VSD-LVFG), *active \
         measures* adds (20) and (22) (MVSD-LVFG). The standoff distance error is |r - r_d| by the agents' own view, as \
         in the paper; by the true geometry it is in the table below. The paper does not print the \
         targets' acceleration, spread and speed, where the UAVs start, the length of a run, nor what its filter assumes; \
         the scenarios say what is flown here.",
    );
    let besides: Vec<&str> = BESIDES.iter().map(|(metric, ..)| *metric).collect();
    let choice = Choice::parse(&format!("table-2,{}", besides.join(","))).map_err(Failure::running)?;
    let mut columns = Vec::new();
    for (_, scenario) in COLUMNS {
        columns.push(plan.each(scenario, &[], |scenario| score(scenario, choice))?);
    }
    for row in &ROWS {
        for (column, runs) in columns.iter().enumerate() {
            let Some(paper) = row.paper[column] else { continue };
            let values = measured(runs, row.metric);
            found.claims.push(Claim {
                what: format!("{}, {}", row.name, COLUMNS[column].0),
                unit: row.unit,
                finding: Finding::number(paper, Estimate::mean(&values)),
                runs: values.len(),
                reason: row.numbers,
            });
        }
    }
    for (from, to, rows) in DIFFERENCES {
        for row in rows.iter().map(|&row| &ROWS[row]) {
            found.claims.extend(difference(row, from, to, &columns));
        }
    }
    found.tables.push(side_by_side(&columns));
    found.data.push(every_run(plan, &columns));
    Ok(found)
}

/// A difference between two columns, run by run.
fn difference(row: &Row, from: usize, to: usize, columns: &[Vec<Metrics>]) -> Option<Claim> {
    let (paper_from, paper_to) = (row.paper[from]?, row.paper[to]?);
    let both = columns[from].iter().zip(&columns[to]);
    let both = both.filter_map(|(from, to)| value(from, row.metric).zip(value(to, row.metric)));
    let (before, after): (Vec<f64>, Vec<f64>) = both.unzip();
    let change: Vec<f64> = before.iter().zip(&after).map(|(before, after)| after - before).collect();
    let finding = Finding::Difference {
        paper: Paper::Percent(100.0 * (paper_to / paper_from - 1.0)),
        ours: Estimate::mean(&change),
        percent: Estimate::percent(&before, &after),
    };
    let what = format!("{}: {} to {}", row.name, COLUMNS[from].0, COLUMNS[to].0);
    Some(Claim { what, unit: row.unit, finding, runs: change.len(), reason: row.difference })
}

/// The paper's table and ours.
fn side_by_side(columns: &[Vec<Metrics>]) -> Table {
    let mut table = Table::new(
        "Mean errors, the paper's and ours with 95 % intervals:",
        &["", "one UAV: paper", "ours", "two UAVs, basic: paper", "ours", "active measures: paper", "ours"],
    );
    let ours = |runs: &Vec<Metrics>, metric: &str, scale: f64| {
        let values: Vec<f64> = measured(runs, metric).iter().map(|value| scale * value).collect();
        let mean = Estimate::mean(&values);
        if mean.value.is_nan() {
            return "-".to_owned();
        }
        format!("{} [{}, {}]", shown(mean.value), shown(mean.low), shown(mean.high))
    };
    for row in &ROWS {
        let cells = columns.iter().zip(row.paper).flat_map(|(runs, paper)| {
            [paper.map_or_else(|| "-".to_owned(), |paper| format!("{paper:.4}")), ours(runs, row.metric, 1.0)]
        });
        table.rows.push([format!("{} ({})", row.name, row.unit)].into_iter().chain(cells).collect());
    }
    for (metric, name, scale) in BESIDES {
        let cells = columns.iter().flat_map(|runs| ["-".to_owned(), ours(runs, metric, scale)]);
        table.rows.push([name.to_owned()].into_iter().chain(cells).collect());
    }
    table
}

fn every_run(plan: &Plan, columns: &[Vec<Metrics>]) -> Data {
    let metrics = ROWS.iter().map(|row| row.metric).chain(BESIDES.iter().map(|(metric, ..)| *metric));
    let names = ["single", "pair_basic", "pair"];
    let heads = names.iter().flat_map(|name| metrics.clone().map(move |metric| format!("{name}_{metric}")));
    let row = |(index, seed): (usize, u64)| {
        let values = columns.iter().flat_map(|runs| metrics.clone().map(move |metric| value(&runs[index], metric)));
        [seed as f64].into_iter().chain(values.map(|value| value.unwrap_or(f64::NAN))).collect()
    };
    Data {
        name: "table-2",
        columns: ["seed".to_owned()].into_iter().chain(heads).collect(),
        rows: plan.seeds().enumerate().map(row).collect(),
    }
}

fn measured(runs: &[Metrics], metric: &str) -> Vec<f64> {
    runs.iter().filter_map(|metrics| value(metrics, metric)).collect()
}

fn value(metrics: &Metrics, name: &str) -> Option<f64> {
    let index = Metrics::NAMES.iter().position(|known| *known == name)?;
    metrics.values()[index]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_names_a_metric() {
        for metric in ROWS.iter().map(|row| row.metric).chain(BESIDES.iter().map(|(metric, ..)| *metric)) {
            assert!(Metrics::NAMES.contains(&metric), "{metric}");
        }
    }

    #[test]
    fn every_number_and_every_difference_of_the_table_is_a_claim() {
        let claims = table_2(&Plan { runs: 2, first_seed: 1, threads: None }).map_err(|_| ()).unwrap().claims;
        assert_eq!(claims.len(), 14 + 7);
        assert!(claims.iter().all(|claim| claim.runs == 2 && !claim.reason.is_empty()));
    }
}
