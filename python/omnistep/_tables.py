"""CSV and Parquet tables from other programs: the one reader of import, identify and calibrate.

A CSV file is UTF-8, with or without a byte order mark. Its first line lists the columns' names, quoted or not,
separated by commas, semicolons or tabs, whichever yields most names. Numbers have a decimal point. An empty cell, NaN,
null, None and NA are missing values. Empty lines are skipped.
"""

from __future__ import annotations

import csv
import importlib
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import shortened
from omnistep.errors import LogError, OmnistepError

Floats = NDArray[np.float64]

#: Most samples of a signal: an hour at 10 kHz.
MOST_SAMPLES = 36_000_000
#: Most numbers of a packed table: so many of any, or so many for each of its bytes. In memory each takes 30 or so.
MOST_CELLS, CELLS_PER_BYTE = 20_000_000, 8
#: Longest first line of a table [bytes].
MOST_HEADER = 2**20
#: Largest number of lines before the names, and the pattern of a number.
MOST_BEFORE, NUMBER = 1000, r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*$"
#: Suffixes of tables.
SUFFIXES = (".csv", ".parquet")
#: Separators of cells.
SEPARATORS = (",", ";", "\t")
#: Cells that are no number.
NOTHING = ["", "nan", "NaN", "NAN", "null", "NULL", "None", "NA", "N/A"]


@dataclass
class Skipped:
    """Lines of a CSV file that are left out instead of rejected."""

    count: int = 0
    #: The number of the first one.
    first: int | None = None

    def __str__(self) -> str:
        lines = "1 line is" if self.count == 1 else f"{self.count} lines are"
        return f"{lines} left out, the first is line {self.first}" if self.count else "no line is left out"


def needs(package: str, needed_by: str, extra: str) -> ImportError:
    """The error to raise where a reader is not installed."""
    return ImportError(f'{needed_by} needs {package}: pip install "omnistep[{extra}]"')


def extra(module: str, package: str) -> Any:
    """Import an optional package."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ImportError(f"this needs {module}: pip install {package}") from error


def module(name: str) -> Any:
    """Import a reader, which may be missing."""
    return importlib.import_module(name)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn any error of a foreign reader into one line."""
    try:
        yield
    except (OmnistepError, ImportError):
        raise
    except Exception as error:  # each reader has its own
        reason = (str(error).splitlines() or [""])[0] or type(error).__name__
        raise LogError(f"{path}: cannot be read: {shortened(reason)}", file=str(path)) from error


def names_of(path: Path, wanted: Sequence[str] = ()) -> list[str]:
    """The names of a table's columns, in their order; of a CSV file with lines before it, in the line with those."""
    if path.suffix.lower() == ".parquet":
        return list(module("pyarrow.parquet").ParquetFile(path).schema_arrow.names)
    return (_header(path, _before(path, wanted)) if wanted else _header(path))[0]


def columns_of(
    path: Path, wanted: Sequence[str], *, time: str | None = None, skipped: Skipped | None = None
) -> dict[str, Any]:
    """Columns of a table, each present once, as pyarrow arrays: all numbers, except times of any type."""
    if path.suffix.lower() == ".parquet":
        return _parquet(path, list(wanted), time)
    return _csv(path, list(wanted), time) if skipped is None else _csv_lines(path, list(wanted), time, skipped)


def floats(path: Path, name: str, column: Any) -> Floats:
    """A column as numbers; NaN for a missing one."""
    pyarrow = module("pyarrow")
    _numbers(path, name, column.type)
    return np.asarray(column.cast(pyarrow.float64(), safe=False).to_numpy(), dtype=np.float64)


def _before(path: Path, wanted: Sequence[str]) -> int:
    """Number of lines before the line with the names of these columns; 0 if there is no such line."""
    with path.open("rb") as file:
        for number in range(MOST_BEFORE):
            line = file.readline(MOST_HEADER).decode("utf-8-sig", "replace").strip()
            if set(wanted) <= {name.strip(' "') for name in re.split("[,;\t]", line)}:
                return number
    return 0


def _header(path: Path, before: int = 0) -> tuple[list[str], str]:
    with path.open("rb") as file:
        for _ in range(before):
            file.readline(MOST_HEADER)
        line = file.readline(MOST_HEADER)
    if len(line) == MOST_HEADER:
        raise LogError(
            f"{path}: a first line of more than {MOST_HEADER} bytes, allowed: the columns' names", file=str(path)
        )
    text = line.decode("utf-8-sig").rstrip("\r\n")
    parted = [(next(csv.reader([text], delimiter=separator), []), separator) for separator in SEPARATORS]
    names, separator = max(parted, key=lambda each: len(each[0]))
    if not text:
        raise LogError(f"{path}: an empty first line, allowed: the columns' names", file=str(path))
    return [name.strip() for name in names], separator


def _csv(path: Path, wanted: list[str], time: str | None) -> dict[str, Any]:
    pyarrow, reader = module("pyarrow"), module("pyarrow.csv")
    names, separator = _header(path)
    numbers = {name: pyarrow.float64() for name in wanted if name != time}
    try:
        table = reader.read_csv(
            path,
            # In one thread it reports the rows of errors.
            read_options=reader.ReadOptions(column_names=names, skip_rows=1, use_threads=False),
            parse_options=reader.ParseOptions(delimiter=separator),
            convert_options=reader.ConvertOptions(include_columns=wanted, column_types=numbers, null_values=NOTHING),
        )
    except pyarrow.ArrowInvalid as error:
        ragged = re.search(r"Row #(\d+): Expected (\d+) columns, got (\d+)", str(error))
        if ragged is not None:
            line = _line(path, int(ragged[1]))
            raise LogError(
                f"{path}: line {line}: {ragged[3]} cells, allowed: {ragged[2]}, as in the first line",
                file=str(path),
            ) from error
        wrong = re.search(
            r"In CSV column #(\d+): Row #(\d+): .*?: invalid value '([^\n]*?)'?$", str(error), re.MULTILINE
        )
        if wrong is None:
            raise
        line = _line(path, int(wrong[2]))
        raise LogError(
            f"{path}: line {line}, column {shortened(names[int(wrong[1])])}: {shortened(repr(wrong[3]))}, allowed:"
            " numbers, with a decimal point",
            file=str(path),
        ) from error
    _count(path, table.num_rows)
    return {name: table.column(name) for name in wanted}


def _csv_lines(path: Path, wanted: list[str], time: str | None, skipped: Skipped) -> dict[str, Any]:
    """Columns of the lines with as many cells as names and a number, or nothing, in each; nothing is no time."""
    pyarrow, reader, compute = module("pyarrow"), module("pyarrow.csv"), module("pyarrow.compute")
    before = _before(path, wanted)
    names, separator = _header(path, before)
    ragged: list[int] = []

    def skip(row: Any) -> str:
        ragged.append(int(row.number))
        return "skip"

    table = reader.read_csv(
        path,
        read_options=reader.ReadOptions(column_names=names, skip_rows=before + 1, use_threads=False),
        parse_options=reader.ParseOptions(delimiter=separator, invalid_row_handler=skip),
        convert_options=reader.ConvertOptions(
            include_columns=wanted,
            column_types=dict.fromkeys(wanted, pyarrow.string()),
            null_values=NOTHING,
            strings_can_be_null=True,
            check_utf8=False,
        ),
    )
    good = np.ones(table.num_rows, dtype=bool)
    for name in wanted:
        number = compute.match_substring_regex(table.column(name), NUMBER)
        good &= number.fill_null(name != time).to_numpy(zero_copy_only=False)
    # The rows of the file, from 1: of those with enough cells, between the ragged ones.
    rows = np.setdiff1d(np.arange(1, table.num_rows + len(ragged) + before + 2), ragged)[before + 1 :]
    bad = sorted([*ragged, *rows[~good].tolist()])
    skipped.count = before + len(bad)
    skipped.first = 1 if before else (_line(path, bad[0]) if bad else None)
    table = table.filter(pyarrow.array(good))
    _count(path, table.num_rows)
    columns = {name: compute.utf8_trim_whitespace(table.column(name)) for name in wanted}
    whole = time is not None and bool(compute.all(compute.match_substring_regex(columns[time], r"^-?\d+$")).as_py())
    return {
        name: column.cast(pyarrow.int64() if whole and name == time else pyarrow.float64())
        for name, column in columns.items()
    }


def _line(path: Path, row: int) -> int:
    """The line of a row, both from 1: empty lines are not rows."""
    rows = 0
    with path.open("rb") as file:
        for line, text in enumerate(file, start=1):
            rows += bool(text.rstrip(b"\r\n"))
            if rows == row:
                return line
    return row


def _parquet(path: Path, wanted: list[str], time: str | None) -> dict[str, Any]:
    batches, rows = [], 0
    file = module("pyarrow.parquet").ParquetFile(path)
    check_packed(path, wanted, time)
    # In pieces: a file of some bytes may unpack to anything.
    for batch in file.iter_batches(columns=wanted):
        rows += batch.num_rows
        _cells(path, rows, len(wanted))
        batches.append(batch)
    if not batches:
        raise LogError(f"{path}: no rows", file=str(path))
    table = module("pyarrow").Table.from_batches(batches)
    return {name: table.column(name) for name in wanted}


def _count(path: Path, rows: int) -> None:
    if not 0 < rows <= MOST_SAMPLES:
        found = "no rows" if rows == 0 else f"{rows} rows and more"
        raise LogError(f"{path}: {found}, allowed: 1 to {MOST_SAMPLES}", file=str(path))


def check_packed(path: Path, wanted: Sequence[str], time: str | None = None) -> None:
    """Reject columns of a packed table by its metadata, before anything is unpacked."""
    if path.suffix.lower() != ".parquet":
        return
    file = module("pyarrow.parquet").ParquetFile(path)
    timestamp = module("pyarrow").types.is_timestamp
    # A text of a million letters occupies a few bytes of a file each time it occurs.
    for name in wanted:
        kind = file.schema_arrow.field(name).type
        if not (name == time and timestamp(kind)):
            _numbers(path, name, kind)
    _cells(path, file.metadata.num_rows, len(wanted))


def _cells(path: Path, rows: int, columns: int) -> None:
    _count(path, rows)
    size = path.stat().st_size
    most = max(MOST_CELLS, CELLS_PER_BYTE * size)
    if rows * columns > most:
        found = f"{size} bytes with {rows} rows of {columns} columns, {rows * columns} numbers"
        raise LogError(f"{path}: {found}, allowed: {most} numbers", file=str(path))


def _numbers(path: Path, name: str, kind: Any) -> None:
    """Refuse a column of a type that is not numeric."""
    types = module("pyarrow").types
    if not (types.is_integer(kind) or types.is_floating(kind) or types.is_null(kind)):
        reason = shortened(f"of type {kind}")
        raise LogError(f"{path}: column {name}: {reason}, allowed: numbers", file=str(path))
