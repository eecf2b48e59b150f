"""Columns of a study's results, from Parquet files, data frames, rows or dictionaries of columns."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from os import PathLike
from pathlib import Path
from typing import Any

from omnistep._omnistep import damage
from omnistep._toml_files import no_file
from omnistep.ensembles import StudyResult
from omnistep.errors import ConfigError

_ALLOWED = (
    "a StudyResult, the folder of a study, a .parquet file, a table of polars, pandas, pyarrow or duckdb, "
    "a list of dictionaries"
)


def columns(rows: Any, wanted: Mapping[str, str], *, optional: Sequence[str] = ()) -> dict[str, list[Any]]:
    """Read columns as lists of plain values, None for a missing value.

    Args:
        rows: files, a data frame, rows or columns.
        wanted: names of columns, each with the argument that named it.
        optional: columns that may be missing.

    Raises:
        ConfigError: the value has no columns or no rows, or a column is missing.
        ImportError: a path was given and no Parquet reader is installed.
    """
    table = _read(Path(rows)) if isinstance(rows, str | PathLike) else rows
    if isinstance(table, StudyResult):
        table = table.rows()
    if hasattr(table, "collect"):  # a lazy frame of polars
        table = table.collect()
    names = _names(table)
    if hasattr(table, "fetchall"):  # a relation of duckdb; every call runs it again, in any order: ask once
        here = [name for name in (*wanted, *optional) if name in names]
        fetched = table.select(", ".join(f'"{name}"' for name in here)).fetchall() if here else []
        table = {name: [row[number] for row in fetched] for number, name in enumerate(here)}
    found = {name: _values(table, name) for name in (*wanted, *optional) if name in names}
    if (isinstance(table, Sequence | Mapping) and not table) or (found and not any(found.values())):
        raise ConfigError("rows: none, allowed: at least one run", key="rows")
    for name, argument in wanted.items():
        if name not in found:
            near = get_close_matches(name, names, n=3, cutoff=0.5)
            hint = f"nearest: {', '.join(near)}" if near else f"there are: {', '.join(names)}"
            raise ConfigError(f"{argument}: no column {name!r}, {hint}", key=argument)
    return found


def _read(path: Path) -> Any:
    """Read Parquet with the reader that is installed."""
    parts = sorted(path.glob("*.parquet")) if path.is_dir() else [path]
    if not parts or not parts[0].is_file():
        what = f"{path}: no *.parquet in it" if path.is_dir() else no_file(path, "file or folder")
        raise ConfigError(f"rows = {what}, allowed: {_ALLOWED}", key="rows", file=str(path))
    for part in parts:
        if reason := damage(part):
            allowed = "an intact part; run the study again: it sets this part aside and repeats its runs"
            raise ConfigError(f"rows = {part}: {reason}, allowed: {allowed}", key="rows", file=str(part))
    files = [str(part) for part in parts]
    readers: dict[str, Callable[[Any], Any]] = {
        "pyarrow.dataset": lambda module: module.dataset(files, format="parquet").to_table(),
        "polars": lambda module: module.read_parquet(files),
        "duckdb": lambda module: module.read_parquet(files),
    }
    for name, read in readers.items():
        try:
            module = importlib.import_module(name)
        except ImportError:
            continue
        try:
            return read(module)
        except Exception as error:  # each reader has its own
            reason = (str(error).splitlines() or ["damaged"])[0]
            raise ConfigError(f"rows = {path}: not Parquet: {reason}", key="rows", file=str(path)) from error
    raise ImportError(f"rows = {path}: Parquet needs pyarrow, polars or duckdb: pip install pyarrow")


def _names(table: Any) -> list[str]:
    if isinstance(table, Mapping):
        return list(table)
    if isinstance(table, Sequence) and all(isinstance(row, Mapping) for row in table):
        return list(dict.fromkeys(name for row in table for name in row))
    names = getattr(table, "column_names", getattr(table, "columns", None))  # pyarrow's, and others
    if names is None or isinstance(table, str | bytes):
        raise ConfigError(f"rows: a {type(table).__name__}, allowed: {_ALLOWED}", key="rows")
    return [str(name) for name in names]


def _values(table: Any, name: str) -> list[Any]:
    if isinstance(table, Sequence):
        return [row.get(name) for row in table]
    column = table[name]
    if hasattr(column, "notna"):  # pandas has several ways to say that there is no value
        column = column.astype(object).where(column.notna(), None)
    for to_list in ("to_pylist", "to_list", "tolist"):
        if hasattr(column, to_list):
            return list(getattr(column, to_list)())
    return list(column)
