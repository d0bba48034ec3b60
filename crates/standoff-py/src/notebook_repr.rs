//! HTML for notebooks.

use pyo3::prelude::*;

use crate::table::Table;

/// Embeds a page in an iframe that loads nothing from other files or hosts.
pub(crate) fn framed(py: Python<'_>, page: &str) -> PyResult<String> {
    let style = "width: 100%; height: 640px; border: 0";
    Ok(format!("<iframe style=\"{style}\" srcdoc=\"{}\"></iframe>", escaped(py, page)?))
}

/// HTML of a table.
pub(crate) fn frame_html(py: Python<'_>, table: Table) -> PyResult<String> {
    Py::new(py, table)?.call_method0(py, "_repr_html_")?.extract(py)
}

/// Escapes text for HTML.
fn escaped(py: Python<'_>, text: &str) -> PyResult<String> {
    py.import("html")?.call_method1("escape", (text,))?.extract()
}
