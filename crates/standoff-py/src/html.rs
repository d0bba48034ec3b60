//! What a notebook shows.

use pyo3::prelude::*;

use crate::asked_for::Dict;

/// A page in a frame of its own, with nothing to fetch.
pub(crate) fn framed(py: Python<'_>, page: &str) -> PyResult<String> {
    let style = "width: 100%; height: 640px; border: 0";
    Ok(format!("<iframe style=\"{style}\" srcdoc=\"{}\"></iframe>", escaped(py, page)?))
}

/// Numbers by metric as a table; behind a metric's name what `mark` says of it.
pub(crate) fn html_table(
    py: Python<'_>,
    metrics: &Dict<'_>,
    columns: &[&str],
    mark: impl Fn(&Bound<'_, PyAny>) -> PyResult<&'static str>,
) -> PyResult<String> {
    let heads: String = columns.iter().map(|name| format!("<th>{name}</th>")).collect();
    let mut table = format!("<table><tr><th>metric</th>{heads}</tr>");
    for (metric, numbers) in &metrics.0 {
        table += &format!("<tr><td>{}{}</td>", escaped(py, &metric.to_string())?, mark(&numbers)?);
        for name in columns {
            let number = numbers.get_item(name)?;
            let number = if number.is_none() { None } else { Some(number.call_method1("__format__", (".4g",))?) };
            table += &format!("<td>{}</td>", number.map_or_else(|| "-".to_owned(), |number| number.to_string()));
        }
        table += "</tr>";
    }
    Ok(table + "</table>")
}

/// Text as HTML.
pub(crate) fn escaped(py: Python<'_>, text: &str) -> PyResult<String> {
    py.import("html")?.call_method1("escape", (text,))?.extract()
}
