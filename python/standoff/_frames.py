"""Data frames and rows of tables; imported when a table is converted."""

from __future__ import annotations

import html as markup
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, TypeAlias

from standoff.errors import InputError

if TYPE_CHECKING:
    from standoff import Comparison, Table

DataFrame: TypeAlias = Any
"""A data frame of pandas, polars or pyarrow, which standoff does not depend on."""

SHOWN = 20
"""Maximum number of rows that a notebook displays."""


def to_pandas(table: Table) -> Any:
    """Makes a ``pandas.DataFrame``. It is made from NumPy arrays, because pandas reads Arrow tables only with pyarrow."""
    pandas = _imported("pandas")
    frame = pandas.DataFrame({name: table.to_numpy(name) for name in table.columns}, copy=False)
    if "time_utc" in frame:
        # NumPy has no time zones.
        frame["time_utc"] = frame["time_utc"].dt.tz_localize("UTC")
    return frame


def to_geodataframe(table: Table) -> Any:
    """Makes a ``geopandas.GeoDataFrame`` with the places of the rows as points."""
    geopandas = _imported("geopandas", "to_geodataframe")
    if "latitude_deg" not in table:
        raise InputError(
            "the rows have no latitude_deg and longitude_deg: only runs over traffic in degrees, and flights, have them, in "
            "tables with x_m and y_m"
        )
    frame = to_pandas(table)
    points = geopandas.points_from_xy(frame["longitude_deg"], frame["latitude_deg"], crs="EPSG:4326")
    return geopandas.GeoDataFrame(frame, geometry=points)


def csv(frame: object) -> str | None:
    """Formats a data frame as CSV; ``None`` if it is no data frame."""
    if hasattr(frame, "to_csv"):  # pandas
        text: str = frame.to_csv(index=False)
        return text
    if hasattr(frame, "write_csv"):  # polars
        text = frame.write_csv()
        return text
    if hasattr(frame, "__arrow_c_stream__"):
        pyarrow = _imported("pyarrow", "a data frame without to_csv")
        buffer = pyarrow.BufferOutputStream()
        _imported("pyarrow.csv").write_csv(pyarrow.table(frame), buffer)
        text = buffer.getvalue().to_pybytes().decode()
        return text
    return None


def to_polars(table: Table) -> Any:
    """Makes a ``polars.DataFrame``."""
    return _imported("polars").DataFrame(table)


def rows(table: Table) -> Iterator[tuple[Any, ...]]:
    """Iterates over the rows."""
    names = tuple(table.columns)
    # pandas takes the names of the columns from the attribute _fields. A namedtuple would refuse names with dots.
    row = type("Row", (tuple,), {"__slots__": (), "_fields": names})
    columns = [table.to_numpy(name).tolist() for name in names]
    return (row(values) for values in zip(*columns, strict=True))


def html(table: Table) -> str:
    """Formats the first rows as an HTML table."""
    names = table.columns
    first = table._head(SHOWN)
    columns = [first.to_numpy(name).tolist() for name in names]
    head = "".join(f"<th>{markup.escape(name)}</th>" for name in names)
    body = "".join(
        "<tr>" + "".join(f"<td>{markup.escape(_text(value))}</td>" for value in row) + "</tr>"
        for row in zip(*columns, strict=True)
    )
    left = len(table) - SHOWN
    return f"<table><tr>{head}</tr>{body}</table>" + (f"<p>and {left} more rows</p>" if left > 0 else "")


def comparison_html(comparison: Comparison) -> str:
    """Formats a comparison: the verdict, then one row per metric that has a value."""
    # The first line of the text is the overall verdict.
    verdict, *_ = str(comparison).splitlines()
    heading = f"A: {comparison.a}, B: {comparison.b}, {comparison.runs} runs of each with the same random draws"
    table = comparison.metrics_table
    heads = ["metric", "unit", "A", "B", "B - A", "95 % interval", "verdict"]
    body = ""
    for row in rows(table):
        of = dict(zip(table.columns, row, strict=True))
        if of["n"] == 0:
            continue
        interval = f"{_text(of['ci95_low'])} to {_text(of['ci95_high'])}" if of["ci95_low"] == of["ci95_low"] else "-"
        numbers = [_text(of[name]) for name in ("mean_a", "mean_b", "difference")]
        texts = [of["metric"], of["unit"], *numbers, interval, of["verdict"]]
        cells = "".join(f"<td>{markup.escape(text)}</td>" for text in texts)
        body += f'<tr title="{markup.escape(of["label"])}">{cells}</tr>'
    head = "".join(f"<th>{name}</th>" for name in heads)
    return f"<p>{markup.escape(verdict)}<br>{markup.escape(heading)}</p><table><tr>{head}</tr>{body}</table>"


def _text(value: object) -> str:
    if value is None or value != value:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _imported(name: str, caller: str = "") -> Any:
    """Imports a package that standoff does not depend on."""
    import importlib

    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"{caller or f'to_{name}'} needs {name}: pip install {name}", name=error.name) from error
