//! HTML for notebooks.

use pyo3::prelude::*;

use crate::common_args::Dict;

/// Embeds a page in an iframe that loads nothing from other files or hosts.
pub(crate) fn framed(py: Python<'_>, page: &str) -> PyResult<String> {
    let style = "width: 100%; height: 640px; border: 0";
    Ok(format!("<iframe style=\"{style}\" srcdoc=\"{}\"></iframe>", escaped(py, page)?))
}

/// HTML table with one row per metric. The text that `mark` returns follows the metric's name.
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

/// Escapes text for HTML.
pub(crate) fn escaped(py: Python<'_>, text: &str) -> PyResult<String> {
    py.import("html")?.call_method1("escape", (text,))?.extract()
}
