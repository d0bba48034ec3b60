//! Folders of results that nobody has named.

use std::fs;
use std::path::{Path, PathBuf};
use std::process;

use pyo3::PyClass;
use pyo3::prelude::*;
use pyo3::types::PyCFunction;

/// The object whose files `make` puts into `out`, or into a temporary folder that goes with the object.
pub(crate) fn in_folder<T: PyClass + Into<PyClassInitializer<T>>>(
    py: Python<'_>,
    out: Option<PathBuf>,
    make: impl FnOnce(&Path) -> PyResult<T>,
) -> PyResult<Py<T>> {
    if let Some(out) = out {
        return Py::new(py, make(&out)?);
    }
    let folder = py.import("tempfile")?.call_method1("mkdtemp", ("", "standoff-"))?.extract::<PathBuf>()?;
    let made = make(&folder.join("results")).and_then(|object| Py::new(py, object));
    // A forked child that ends must not remove what its parent still has.
    let (here, owner) = (folder, process::id());
    let remove = move || {
        if process::id() == owner {
            fs::remove_dir_all(&here).unwrap_or_default();
        }
    };
    match &made {
        Err(_) => remove(),
        Ok(object) => {
            let remove = PyCFunction::new_closure(py, None, None, move |_, _| remove())?;
            py.import("weakref")?.getattr("finalize")?.call1((object, remove))?;
        }
    }
    made
}
