#!/usr/bin/env python3
"""Runs a notebook from the start and writes it with its outputs: run_notebook.py NOTEBOOK OUT.ipynb.

Exits with 1 at the first cell that fails, or if fewer than two cells have outputs.
"""

import sys

import nbclient
import nbformat


def main() -> None:
    given, out = sys.argv[1:]
    notebook = nbformat.read(given, as_version=4)
    nbclient.NotebookClient(notebook, timeout=240, kernel_name="python3").execute()
    nbformat.write(notebook, out)
    shown = sum(bool(cell.outputs) for cell in notebook.cells if cell.cell_type == "code")
    if shown < 2:
        sys.exit(f"{given}: only {shown} cells have outputs; at least 2")


if __name__ == "__main__":
    main()
