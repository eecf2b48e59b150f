"""Runs of one scenario under several policies, by policy, with the command's table of their metrics."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Generic, NamedTuple, TypeVar

from omnistep import _metrics
from omnistep._omnistep import Outcome, Trace
from omnistep._tables import extra

#: A policy, or a policy and an engine.
Key = TypeVar("Key", bound="str | tuple[str, str]")

#: Characters of a line of the table; a column that needs more has them.
_WIDTH = 80


class Row(NamedTuple):
    """A metric of several runs.

    Attributes:
        heading: name and unit.
        explained: what it is, in sentences; empty where its name says it.
        cells: its value of each run, "-" where it was not measured.
    """

    heading: str
    explained: str
    cells: list[str]


class Comparison(Mapping[Key, Trace], Generic[Key]):
    """Traces by policy, or by policy and engine: what :func:`omnistep.compare` returns.

    It is a mapping that does not change. ``print`` shows the table that the command prints, without the speed of the
    computation, and a notebook shows it as a table of HTML.

    Example:
        >>> import omnistep
        >>> short = {"duration_s": 0.1}
        >>> runs = omnistep.compare("flat", policies=["independent", "shared_integral"], overrides=short)
        >>> print(str(runs).splitlines()[0])
        | policy                 | independent | shared_integral |
        >>> runs["independent"].outcome.verdict, len(runs)
        ('completed', 2)
        >>> list(runs.to_pandas()["verdict"])
        ['completed', 'completed']
    """

    def __init__(self, traces: Mapping[Key, Trace]) -> None:
        """Keep traces by policy, or by policy and engine, in their order."""
        self._traces: dict[Key, Trace] = dict(traces)

    def __getitem__(self, key: Key) -> Trace:
        """Return the trace of a policy, or of a policy and an engine."""
        try:
            return self._traces[key]
        except KeyError:
            known = ", ".join(map(repr, self._traces))
            raise KeyError(f"no run {key!r}, allowed: {known}") from None

    def __iter__(self) -> Iterator[Key]:
        return iter(self._traces)

    def __len__(self) -> int:
        return len(self._traces)

    def __repr__(self) -> str:
        verdicts = ", ".join(f"{' on '.join(words(key))} {trace.outcome.verdict}" for key, trace in self.items())
        return f"<omnistep.Comparison of {len(self)} runs: {verdicts}>"

    def __str__(self) -> str:
        """The table that the command prints."""
        head = ["policy", *(words(key)[0] for key in self)]
        lines = [[row.heading, *row.cells] for row in self._rows()]
        return text_table(head, lines, together=len({words(key)[1] for key in self if len(words(key)) > 1}))

    def _repr_html_(self) -> str:
        heads = ["policy", *(words(key)[0] for key in self)]
        return html_table(heads, self._rows(), caption=caption(list(self.values())))

    def to_pandas(self) -> Any:
        """Return a pandas data frame: a row for each run, by policy, or by policy and engine; a column for each metric.

        Raises:
            ImportError: pandas is not installed: ``pip install pandas``.
        """
        pandas = extra("pandas", "pandas")
        metrics = [trace.outcome.to_dict() for trace in self.values()]
        by_engine = any(not isinstance(key, str) for key in self)
        names = ["policy", "engine"] if by_engine else ["policy"]
        if by_engine:  # it is in the index
            metrics = [{name: value for name, value in each.items() if name != "engine"} for each in metrics]
        index = pandas.MultiIndex.from_tuples(map(words, self), names=names) if by_engine else None
        return pandas.DataFrame(metrics, index=index if by_engine else pandas.Index(list(self), name="policy"))

    def _rows(self) -> list[Row]:
        engines = [words(key)[1] for key in self if len(words(key)) > 1]
        return ([Row("engine", "", engines)] if engines else []) + rows([trace.outcome for trace in self.values()])


def words(key: str | tuple[str, str]) -> tuple[str, ...]:
    """Return a policy, or a policy and an engine."""
    return (key,) if isinstance(key, str) else key


def rows(outcomes: Sequence[Outcome]) -> list[Row]:
    """Return the rows of the command's table of these runs: the verdicts and the metrics that some run has."""
    found = [Row("verdict", _metrics.METRICS["verdict"].explained, [outcome.verdict for outcome in outcomes])]
    if any(outcome.limited_by for outcome in outcomes):
        found.append(Row("limited by", "What kept it from its way.", [each.limited_by or "-" for each in outcomes]))
    shown = [outcome._rows() for outcome in outcomes]
    for key, metric in _metrics.METRICS.items():
        cells = [each.get(key, (None, False)) for each in shown]
        if any(is_shown for _, is_shown in cells):
            found.append(Row(metric.heading, metric.explained, ["-" if text is None else text for text, _ in cells]))
    return found


def caption(traces: Sequence[Trace]) -> str:
    """Return scenario, vehicle, ground and engine of runs that share them."""
    if not traces:
        return ""
    first = traces[0]
    ground = [_with_unit(key, value) for key, value in first.terrain.items() if key != "kind"]
    engines = sorted({trace.outcome.engine for trace in traces})
    return ", ".join([f"{first.scenario} with {first.vehicle}", *ground, f"engine {' and '.join(engines)}"])


def _with_unit(key: str, value: str | float) -> str:
    """Return a number of the ground in words: ``height 0.05 m``."""
    name, _, unit = key.rpartition("_")
    named, unit = (name, unit) if unit in ("m", "rad") else (key, "")
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return " ".join(part for part in (named.replace("_", " "), text, unit) if part)


def text_table(head: Sequence[str], lines: Sequence[Sequence[str]], *, together: int = 1) -> str:
    """Return lines of cells as text; columns that do not fit beside one another follow below, so many together."""
    columns = list(range(1, len(head)))
    width = [max(len(line[k]) for line in [head, *lines]) for k in range(len(head))]
    blocks: list[list[int]] = []
    left = 0
    size = max(together, 1)
    for group in (columns[start : start + size] for start in range(0, len(columns), size)):
        needed = sum(3 + width[k] for k in group)
        if blocks and needed <= left:
            blocks[-1].extend(group)
            left -= needed
        else:
            blocks.append(list(group))
            left = _WIDTH - 4 - width[0] - needed
    tables = []
    for block in blocks:
        rule = "|".join("-" * (2 + width[k]) for k in (0, *block))
        made = [_line([0, *block], line, width) for line in (head, *lines)]
        tables.append("\n".join([made[0], f"|{rule}|", *made[1:]]))
    return "\n\n".join(tables)


def _line(columns: Sequence[int], cells: Sequence[str], width: Sequence[int]) -> str:
    parts = [f" {cells[k].rjust(width[k]) if k else cells[k].ljust(width[k])} " for k in columns]
    return f"|{'|'.join(parts)}|"


def html_table(heads: Sequence[str], lines: Sequence[Row], *, caption: str = "") -> str:
    """Return rows as a table of HTML, with what each metric means as its tooltip."""
    said = f'<caption style="caption-side:top;text-align:left">{html.escape(caption)}</caption>' if caption else ""
    cells = "".join(f'<th scope="col">{html.escape(head)}</th>' for head in heads)
    top = f"<thead><tr>{cells}</tr></thead>" if heads else ""
    body = []
    for row in lines:
        about = f' title="{html.escape(row.explained)}"' if row.explained else ""
        values = "".join(f'<td style="text-align:right">{html.escape(cell)}</td>' for cell in row.cells)
        body.append(f'<tr><th scope="row" style="text-align:left"{about}>{html.escape(row.heading)}</th>{values}</tr>')
    return f"<table>{said}{top}<tbody>{''.join(body)}</tbody></table>"
