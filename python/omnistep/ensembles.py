"""Many runs, one row each: studies and sweeps, on the cores of this machine or on remote workers."""

import itertools
import math
import operator
import queue
import tempfile
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import closing, contextmanager, nullcontext
from os import PathLike
from pathlib import Path
from typing import Any, Never, SupportsIndex

from omnistep._argument_types import no_others
from omnistep._omnistep import Plan, Rows, Scenario, Store, compute_batch, shortened
from omnistep._progress import counter
from omnistep._tables import extra
from omnistep.errors import ConfigError, StudyError
from omnistep.own_policy import Packed, PolicyLike, packed

#: Tasks that a sweep is cut into at least, as far as there are runs: so that no worker waits long for the last one.
_TASKS = 64
#: Most runs of a task per thread by default: some seconds of work.
_RUNS_PER_THREAD = 16

#: One point more than there may be: none is asked for after it.
_TOO_MANY = Plan.MOST_POINTS + 1

#: pandas' types that know what is missing.
_PANDAS = {"bool": "boolean", "int": "Int64", "float": "float64", "str": "str"}


class StudyResult:
    """Rows of a study or a sweep, one for each run, in the order of the runs.

    Data frame libraries read it directly (``polars.DataFrame(result)``, ``pyarrow.table(result)``, DuckDB), by the
    Arrow PyCapsule interface. Columns are ``key``, ``seed``, one for each varied key (with ``_`` for each dot), the
    metrics of :class:`omnistep.Outcome`, and ``error``: null, or why the run failed.

    Attributes:
        folder: the folder of the Parquet files; None where it was a temporary one.
        computed: number of runs that this call computed; the others existed already.

    >>> import omnistep, tempfile
    >>> with tempfile.TemporaryDirectory() as out:
    ...     points = {"terrain.friction": [0.5, 0.9]}
    ...     result = omnistep.sweep(points, scenario="flat", overrides={"duration_s": 0.1}, out=out, progress=False)
    >>> len(result), result.computed, result.failed
    (2, 2, 0)
    >>> [row["terrain_friction"] for row in result.rows()]
    [0.5, 0.9]
    """

    def __init__(self, rows: Rows, *, folder: Path | None, computed: int) -> None:
        self._rows = rows
        self.folder = folder
        self.computed = computed

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return list(self._rows.kinds)

    @property
    def failed(self) -> int:
        """Number of runs that failed: their rows have an ``error``."""
        return sum(cell["errors"] for cell in self.cells)

    @property
    def cells(self) -> list[dict[str, Any]]:
        """The map: a dictionary for each combination of values with counts and means over the seeds.

        ``runs`` is their number, ``errors`` the number that failed, ``unfinished`` the number of the others that
        ``duration_s`` cut off, ``beyond_balls`` the number with ``wheel_model_valid`` false. Means are of the metrics
        that the study's ``[map]`` names, ``climbed`` by default, over the runs that did not fail; True counts as 1;
        None if nothing was measured. ``climbed_low`` and ``climbed_high`` (likewise for other metrics) are the ends of
        the 95 % interval: Wilson's score for yes and no, Student's t for a mean of two runs or more.
        """
        return self._rows.cells()

    def summary(self, *metrics: str) -> list[dict[str, Any]]:
        """Return :attr:`cells` with other metrics: their means and 95 % intervals.

        Args:
            metrics: any columns of a row that are numbers, or yes and no; the map's by default.

        Returns:
            A dictionary for each combination of values, with ``METRIC``, ``METRIC_low`` and ``METRIC_high``.

        Raises:
            ConfigError: a name is not a metric.

        >>> import omnistep, tempfile
        >>> with tempfile.TemporaryDirectory() as out:
        ...     result = omnistep.run_study("ensemble", overrides={"duration_s": 0.1}, seeds=3, out=out, progress=False)
        >>> cell = result.summary("climbed", "required_friction")[0]
        >>> cell["climbed"], cell["climbed_low"], round(cell["climbed_high"], 3)  # none of three
        (0.0, 0.0, 0.561)
        """
        return self._rows.cells(list(metrics) or None)

    def paired(self, key: str, baseline: Any, metric: str = "climbed") -> list[dict[str, Any]]:
        """Compare runs that differ in one key alone, seed by seed: the effect of the common start cancels.

        Args:
            key: a varied key, such as ``control.policy``.
            baseline: the value with which the others are compared.
            metric: a column of a row that is a number, or yes and no.

        Returns:
            A dictionary for each combination of values that has another value of the key: each key by its column,
            ``pairs`` of runs that both have the metric, the mean ``difference``, its 95 % interval ``low`` to ``high``
            by Student's t (None for fewer than two pairs). For yes and no there are two counts of seeds in addition:
            yes with this value alone, ``only_here``, and with ``baseline`` alone, ``only_there``.

        Raises:
            ConfigError: the key does not vary, no run has that value, or the name is not a metric.

        >>> import omnistep, tempfile
        >>> with tempfile.TemporaryDirectory() as out:
        ...     points = {"control.policy": ["independent", "scale_torques"], "command.vx_m_s": [0.2, 0.4]}
        ...     given = {"scenario": "flat", "overrides": {"duration_s": 1.0}, "progress": False}
        ...     result = omnistep.sweep(points, out=out, **given)
        >>> [cell["pairs"] for cell in result.paired("control.policy", "independent", "work_j")]
        [1, 1]
        >>> faster, = {cell["difference"] > 1.0 for cell in result.paired("command.vx_m_s", 0.2, "work_j")}
        >>> faster  # more work in the same time
        True
        """
        return self._rows.paired(key, baseline, metric)

    def rows(self) -> list[dict[str, Any]]:
        """Return a dictionary for each run, by column; None if nothing was measured."""
        return self._rows.to_dicts()

    def to_arrow(self) -> Any:
        """Return a ``pyarrow.Table``.

        Raises:
            ImportError: pyarrow is not installed: ``pip install pyarrow``.
        """
        return extra("pyarrow", "pyarrow").table(self)

    def to_polars(self) -> Any:
        """Return a polars data frame.

        Raises:
            ImportError: polars is not installed: ``pip install polars``.
        """
        return extra("polars", "polars").DataFrame(self)

    def to_pandas(self) -> Any:
        """Return a pandas data frame, of pandas' nullable types if a boolean or an integer may be missing.

        Raises:
            ImportError: pandas is not installed: ``pip install pandas``.
        """
        pandas = extra("pandas", "pandas")
        rows = self.rows()
        columns = {name: [row[name] for row in rows] for name in self.names}
        types = self._rows.kinds
        return pandas.DataFrame(
            {name: pandas.Series(column, dtype=_PANDAS[types[name]]) for name, column in columns.items()}
        )

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self._rows.__arrow_c_stream__(requested_schema)

    def __len__(self) -> int:
        return len(self._rows)

    def _repr_html_(self) -> str:
        from omnistep._html import study_html

        return study_html(self)

    def __repr__(self) -> str:
        counts = f"{len(self)} runs, {self.failed} failed, {self.computed} computed now"
        where = "" if self.folder is None else f": {self.folder}"
        return f"<omnistep.StudyResult of {counts}{where}>"


def run_study(
    study: str | PathLike[str],
    *,
    overrides: Mapping[str, Any] | None = None,
    seeds: int | Sequence[int] | None = None,
    out: str | PathLike[str] | None = None,
    jobs: int | None = None,
    retry_errors: bool = False,
    progress: bool = True,
    **others: Never,
) -> StudyResult:
    """Run the missing runs of a study, on all cores.

    Ctrl-C loses no finished run, and the same call continues from there. ``omnistep study`` uses the same folder of
    results. Other Python threads continue to run.

    Args:
        study: a built-in name (``climb_map``, ``ensemble``, ``wheel_models``, ``traction``, ``traction_runup``) or the
            path of a .toml file.
        overrides: keys to replace in every run, as in :func:`omnistep.run`; not an axis of the study, and not the seed.
        seeds: number of seeds, counted from 0, or a list of them; the study's own by default.
        out: the folder of results; ``out/NAME`` by default.
        jobs: threads, 1 or more; as many as there are cores by default.
        retry_errors: run failed runs again.
        progress: show a bar, in a terminal or a notebook, when it takes more than a second.
        others: none is allowed; the message says where keys of a scenario go.

    Returns:
        A row for each run of the study; a run that failed is a row with an ``error``.

    Warns:
        UserWarning: in some runs ``traction`` or ``traction_runup`` lacks sensors or motor speed that it uses.

    Raises:
        ConfigError: a name, key or value is wrong; or the folder holds results of another study, or of another
            version, or is being written by another program.
        StudyError: the folder cannot be read or written.
        KeyboardInterrupt: Ctrl-C was pressed.

    >>> import omnistep, tempfile
    >>> with tempfile.TemporaryDirectory() as out:
    ...     result = omnistep.run_study("ensemble", overrides={"duration_s": 0.1}, seeds=2, out=out, progress=False)
    >>> len(result), result.cells[0]["control_policy"], result.cells[0]["runs"]
    (10, 'independent', 2)
    """
    no_others(run_study, others)
    plan = Plan.of_study(study, overrides=overrides, seeds=listed(seeds) if seeds is not None else None)
    folder = Path(out) if out is not None else Path("out") / plan.name
    return complete(plan, folder, jobs=jobs, retry_errors=retry_errors, progress=progress)


def sweep(
    points: Mapping[str, Iterable[Any]] | Iterable[Mapping[str, Any]],
    *,
    scenario: str | PathLike[str] | Scenario = "step",
    policy: PolicyLike | None = None,
    overrides: Mapping[str, Any] | None = None,
    seeds: int | Sequence[int] = 1,
    out: str | PathLike[str] | None = None,
    executor: Executor | None = None,
    batch: int | None = None,
    jobs: int | None = None,
    retry_errors: bool = False,
    progress: bool = True,
    **others: Never,
) -> StudyResult:
    """Run the missing runs of a scenario at many points, each with every seed.

    Rows, keys and files are as in :func:`run_study`. With an executor the runs go to its workers in batches, as
    text: each point's scenario once, 4 to 35 kB with its vehicle. A worker adds each row to the folder as soon as it is
    done. Therefore every worker must see ``out`` under the same path and run the same version of omnistep. A killed
    worker loses no row: the same call computes only the missing rows.

    Executors: ``concurrent.futures.ProcessPoolExecutor``, ``dask.distributed``'s ``Client.get_executor(pure=False)``,
    ``mpi4py.futures.MPIPoolExecutor``. If the executor itself fails, its exception is raised.

    Args:
        points: a dictionary of keys to replace for each point; or one dictionary of a list of values for each key: then
            every combination is a point, the last key fastest. Keys and values as in ``overrides`` of
            :func:`omnistep.run`. At most 100000 points.
        scenario: a built-in name, the path of a .toml file or an :class:`omnistep.Scenario`.
        policy: coordination policy instead of the scenario's, or a controller of your own (see :class:`Policy`). Every
            run receives its own copy from a pickle; rows then have the column ``control_policy`` with its name. Rows of
            different laws are never mixed: a string ``version`` of the controller distinguishes laws, else its pickle
            and the source of its class. Threads share one interpreter, so processes are faster.
        overrides: keys to replace in every run; not one that a point replaces, and not the seed.
        seeds: how many seeds, counted from 0, or which. They differ only where the scenario has a perturbation or
            noise.
        out: the folder of results. None is a temporary one, removed afterwards: the result has every row, but what
            Ctrl-C leaves is lost. With an executor the folder is needed.
        executor: the executor that computes; by default this process, on all cores.
        batch: runs per task, 1 or more; by default 16 for each of its threads, or fewer if there are few runs.
        jobs: threads; by default all cores without an executor, and one a task with one.
        retry_errors: run failed runs again.
        progress: show a bar, in a terminal or a notebook, when it takes more than a second; with an executor it moves
            by batches.
        others: none is allowed; the message says where keys of a scenario go.

    Returns:
        A row for each point and seed; a run that failed is a row with an ``error``.

    Warns:
        UserWarning: in some runs ``traction`` or ``traction_runup`` lacks sensors or motor speed that it uses.

    Raises:
        ConfigError: a name, key or value is wrong, with the point's number, counted from 0; or a policy cannot be
            pickled; or the folder is another study's.
        StudyError: the folder cannot be read or written, or workers do not share it.
        TypeError: points are neither dictionary nor list, or the policy is not a policy.
        KeyboardInterrupt: Ctrl-C was pressed. Batches that an executor has started are completed.

    >>> import omnistep
    >>> points = [{"command.vx_m_s": 0.2}, {"command.vy_m_s": 0.1}]
    >>> result = omnistep.sweep(points, scenario="flat", overrides={"duration_s": 0.1}, progress=False)
    >>> [(row["command_vx_m_s"], row["command_vy_m_s"]) for row in result.rows()]
    [(0.2, 0.0), (0.3, 0.1)]
    """
    no_others(sweep, others)
    if out is None and executor is not None:
        raise ConfigError("out = None, allowed: with an executor, a folder that every worker sees", key="out")
    every = points_of(points)
    for given, where in [(overrides or {}, "overrides"), ({"control.policy": policy} if policy else {}, "policy")]:
        if twice := sorted({key for point in every for key in point} & set(given)):
            raise ConfigError(f"{where}: {twice[0]} is also replaced by points, allowed: one of the two", key=twice[0])
    batch = positive("batch", batch)
    preset, own = (policy, None) if policy is None or isinstance(policy, str) else (None, packed(policy))
    plan = Plan.of_points(every, scenario=scenario, policy=preset, overrides=overrides, seeds=listed(seeds), own=own)
    with tempfile.TemporaryDirectory() if out is None else nullcontext(out) as folder:
        result = complete(
            plan,
            Path(folder),
            jobs=jobs,
            retry_errors=retry_errors,
            progress=progress,
            executor=executor,
            batch=batch,
            own=own,
        )
    if out is None:
        result.folder = None
    return result


def complete(
    plan: Plan,
    folder: Path,
    *,
    jobs: int | None,
    retry_errors: bool,
    progress: bool,
    executor: Executor | None = None,
    batch: int | None = None,
    own: Packed | None = None,
) -> StudyResult:
    """Compute the rows of a plan that a folder lacks. See :func:`sweep`."""
    jobs = positive("jobs", jobs)
    for note in plan.policy_notes():
        warnings.warn(note, stacklevel=3)
    with closing(Store(folder, plan)) as store:
        if retry_errors:
            store.forget_errors()
        found = store.read()
        for path, reason in found.damaged:
            message = f"{path}: cannot be read ({reason}); renamed to .damaged, its runs are repeated"
            warnings.warn(message, stacklevel=3)
        missing = found.missing
        if missing == 0:
            return StudyResult(found, folder=folder, computed=0)
        with _bar(missing, progress) as bar:
            if executor is None:
                store.compute(found, jobs=jobs, watch=bar.at)
            else:
                threads = jobs or 1
                size = batch or threads * max(1, min(_RUNS_PER_THREAD, missing // (_TASKS * threads)))
                _compute_on(executor, found.batches(size), folder, threads, own, bar)
        rows = store.read()
    if rows.missing:
        raise StudyError(
            f"{folder}: {rows.missing} computed rows are missing; every worker must see the same folder",
            key="out",
            file=str(folder),
        )
    return StudyResult(rows, folder=folder, computed=missing)


def points_of(points: Mapping[str, Iterable[Any]] | Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return the points of a grid, or the given points."""
    if isinstance(points, Mapping):
        for key, values in points.items():
            if isinstance(values, str | Mapping) or not isinstance(values, Iterable):
                raise TypeError(shortened(f"points: {key} = {values!r}, allowed: a list of values"))
        each = [list(itertools.islice(values, _TOO_MANY)) for values in points.values()]
        if (count := math.prod(map(len, each))) >= _TOO_MANY:
            raise ConfigError(f"points: {count}, allowed: {Plan.MOST_POINTS} at most", key="points")
        combinations = itertools.product(*each) if points else ()
        return [dict(zip(points, values, strict=True)) for values in combinations]
    if isinstance(points, str) or not isinstance(points, Iterable):
        raise TypeError(shortened(f"points: {points!r}, allowed: a list of dictionaries, or a dictionary of lists"))
    every = list(itertools.islice(points, _TOO_MANY))
    for number, point in enumerate(every):
        if not isinstance(point, Mapping):
            raise TypeError(shortened(f"points[{number}]: {point!r}, allowed: a dictionary of keys and values"))
    return every


def listed(seeds: int | Sequence[int]) -> int | list[int]:
    """Return seeds as a list, also from a range or a generator; a count unchanged."""
    return list(seeds) if isinstance(seeds, Iterable) and not isinstance(seeds, str) else seeds


def positive(name: str, value: int | None) -> int | None:
    """Return a count as a Python integer, also from NumPy; reject a count below 1."""
    if value is None:
        return None
    if isinstance(value, SupportsIndex) and not isinstance(value, bool) and (count := operator.index(value)) >= 1:
        return count
    raise ConfigError(f"{name} = {value!r}, allowed: a whole number from 1", key=name)


class _Bar:
    """A progress bar that counts runs."""

    def __init__(self, bar: Any) -> None:
        self._bar = bar
        self._failed = 0

    def at(self, rows: int, failed: int) -> None:
        """Stand at so many rows, so many of them failed."""
        if failed != self._failed:
            self._failed = failed
            self._bar.set_postfix_str(f"{failed} failed", refresh=False)
        self._bar.update(rows - self._bar.n)


@contextmanager
def _bar(runs: int, shown: bool) -> Iterator[_Bar]:
    with counter(shown=shown, total=runs, unit="run") as bar:
        yield _Bar(bar)


def _work(batch: str, folder: str, jobs: int, own: Packed | None) -> tuple[int, int]:
    """Compute a batch on a worker."""
    return compute_batch(batch, folder, jobs=jobs, own=own)


def _compute_on(executor: Executor, batches: list[str], folder: Path, jobs: int, own: Packed | None, bar: _Bar) -> None:
    """Have every batch computed; stop handing them out when one fails."""
    ended: queue.SimpleQueue[Future[tuple[int, int]]] = queue.SimpleQueue()
    futures: list[Future[tuple[int, int]]] = []
    rows = failed = 0
    try:
        for batch in batches:
            futures.append(executor.submit(_work, batch, str(folder.absolute()), jobs, own))
            futures[-1].add_done_callback(ended.put)
        for _ in batches:
            of_batch = _next(ended).result()
            rows, failed = rows + of_batch[0], failed + of_batch[1]
            bar.at(rows, failed)
    except BaseException as error:
        for future in futures:
            future.cancel()
        error.add_note(f"the finished runs of the sweep are kept in {folder}; the same call continues from there")
        raise


def _next(ended: "queue.SimpleQueue[Future[tuple[int, int]]]") -> Future[tuple[int, int]]:
    while True:
        try:
            # Not for ever: on some systems Ctrl-C waits as long.
            return ended.get(timeout=0.1)
        except queue.Empty:
            continue
