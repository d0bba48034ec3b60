//! The table of metrics that every command prints: a section per topic, and a row per metric with its label and unit.

use standoff_io::display_text::{WIDTH, printable, wrapped};
use standoff_score::{MetricInfo, MetricSelection};

/// Width of the labels: that of the longest one.
const LABEL: usize = 43;
/// Width of the units.
const UNIT: usize = 6;

/// A row of the table.
pub(crate) struct MetricRow<'a> {
    /// Name of the metric.
    pub(crate) metric: &'a str,
    /// Values as text, in the unit of the metric.
    pub(crate) cells: Vec<String>,
    /// Text after the unit.
    pub(crate) end: String,
    /// Lines below the row.
    pub(crate) remarks: Vec<String>,
}

/// Formats the table under the heads of its cells (each with its width), unit excepted, and of the text at the end.
pub(crate) fn metric_table(heads: &[(&str, usize)], end: &str, rows: &[MetricRow<'_>], width: usize) -> String {
    let cells = |cells: &mut dyn Iterator<Item = &str>| {
        heads.iter().zip(cells).map(|((_, width), cell)| format!(" {cell:>width$}")).collect::<String>()
    };
    let heading = cells(&mut heads.iter().map(|(head, _)| *head));
    let mut text =
        format!("\n{:width$}{heading} {:UNIT$} {end}", "", "", width = LABEL + 2).trim_end().to_owned() + "\n";
    let mut section = "";
    for row in rows {
        let info = MetricInfo::of(row.metric);
        let name = printable(row.metric);
        let (label, topic) = info.map_or((name.as_ref(), "Other"), |info| (info.label, info.section));
        if topic != section {
            section = topic;
            text += &format!("{section}\n");
        }
        let values = cells(&mut row.cells.iter().map(String::as_str));
        let (unit, _) = MetricInfo::unit(row.metric);
        text += format!("  {label:LABEL$}{values} {unit:UNIT$} {}", row.end).trim_end();
        text += "\n";
        row.remarks.iter().for_each(|remark| text += &wrapped("      ", remark, width));
    }
    text
}

/// Selection of the metrics of several runs; `None` for metrics of another version.
pub(crate) struct Shown(Option<MetricSelection>);

impl Shown {
    /// Returns the selection of exactly these metrics.
    pub(crate) fn of<T>(metrics: &[(String, T)]) -> Self {
        let names: Vec<&str> = metrics.iter().map(|(name, _)| name.as_str()).collect();
        Self(MetricSelection::parse(&names.join(",")).ok())
    }

    /// True if a table shows the metric: the main ones if they are the default selection, otherwise all.
    pub(crate) fn has(&self, metric: &str) -> bool {
        self.0.zip(MetricInfo::of(metric)).is_none_or(|(choice, info)| choice.shows(info))
    }

    /// True if the user named the metrics: those without a value are then shown, too.
    pub(crate) fn are_named(&self) -> bool {
        self.0.is_some_and(|choice| ![MetricSelection::standard(), MetricSelection::all()].contains(&choice))
    }
}

/// Formats the remarks below a table of several runs: the shown metrics (each with the number of runs that have a value)
/// that some of the `runs` do not have, and the number of metrics that the table leaves out.
pub(crate) fn remarks<'a>(shown: impl Iterator<Item = (&'a str, u64)>, runs: u64, left_out: usize) -> String {
    let label = |metric| MetricInfo::of(metric).map_or(metric, |info| info.label);
    let partly = shown.filter(|(_, n)| (1..runs).contains(n)).map(|(metric, n)| format!("{} ({n})", label(metric)));
    let partly = partly.collect::<Vec<_>>().join(", ");
    let mut text = "\n".to_owned();
    if !partly.is_empty() {
        text += &wrapped("", &format!("measured in fewer runs: {partly}"), WIDTH);
    }
    if left_out > 0 {
        text += &format!("{left_out} more metrics with --metrics all\n");
    }
    text
}

/// Formats a number with four significant digits.
fn number(value: f64) -> String {
    let size = value.abs();
    match size {
        0.0 => "0".to_owned(),
        _ if size >= 1000.0 => format!("{value:.0}"),
        _ if size >= 100.0 => format!("{value:.1}"),
        _ if size >= 10.0 => format!("{value:.2}"),
        _ if size >= 1.0 => format!("{value:.3}"),
        _ if size >= 1e-4 => format!("{value:.4}"),
        _ => format!("{value:.1e}"),
    }
}

/// Formats a value of a metric in its display unit, or `-` if it does not exist.
pub(crate) fn in_unit(metric: &str, value: Option<f64>) -> String {
    let (unit, factor) = MetricInfo::unit(metric);
    let value = value.map(|value| factor * value);
    value.map_or_else(|| "-".to_owned(), |value| distinct(value, unit, number(value)))
}

/// Returns the text of a value, so that a percentage that is not quite 0 or 100 does not look like it.
pub(crate) fn distinct(value: f64, unit: &str, text: String) -> String {
    match text {
        text if unit == "%" && value < 100.0 && text.starts_with("100") => ">99.99".to_owned(),
        text if unit == "%" && value > 0.0 && text == "0.00" => "<0.01".to_owned(),
        text => text,
    }
}

/// Formats an interval of a metric as `a to b`, or `-` if it does not exist.
pub(crate) fn interval(metric: &str, ends: Option<[f64; 2]>) -> String {
    let text = |[low, high]: [f64; 2]| format!("{} to {}", in_unit(metric, Some(low)), in_unit(metric, Some(high)));
    ends.map_or_else(|| "-".to_owned(), text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_are_in_percent_and_do_not_look_like_1_below_it() {
        let percent = |value| in_unit("custody_fraction", Some(value));
        assert_eq!([0.5, 0.99994, 0.99996, 1.0].map(percent), ["50.00", "99.99", ">99.99", "100.0"]);
        assert_eq!(interval("custody_fraction", Some([-0.001, 0.25])), "-0.1000 to 25.00");
        assert_eq!(in_unit("position_error_m", None), "-");
    }

    /// Metrics of another version have no label.
    #[test]
    fn an_unknown_metric_is_shown_by_its_name() {
        let row = MetricRow { metric: "new_m", cells: vec!["1.5".to_owned()], end: String::new(), remarks: Vec::new() };
        let text = metric_table(&[("mean", 8)], "", &[row], WIDTH);
        assert_eq!(text, format!("\n{:49} mean\nOther\n  {:43}      1.5 m\n", "", "new_m"));
        assert!(Shown::of(&[("new_m".to_owned(), ())]).has("new_m"));
    }
}
