//! Output folders: the one that the caller names, or a temporary one.

use std::fs;
use std::path::{Path, PathBuf};
use std::process;

use pyo3::PyClass;
use pyo3::prelude::*;
use pyo3::types::PyCFunction;

/// Makes the object whose files `make` writes to `out`, or to a temporary folder that is deleted with the object.
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
    // A forked child that exits must not delete the folder that its parent still uses.
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
