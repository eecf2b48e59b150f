"""Search for gains, or any keys, by Optuna."""

import importlib
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from math import isnan
from os import PathLike
from pathlib import Path
from typing import Any, Literal, TypeAlias

from omnistep._omnistep import Plan, Scenario
from omnistep._progress import counter
from omnistep.ensembles import complete, listed, points_of, positive
from omnistep.errors import ConfigError, StudyError

#: From, to, and ``"log"`` for a search over the logarithm; or a list of values.
Range: TypeAlias = tuple[float, float] | tuple[float, float, Literal["log"]] | Sequence[Any]


@dataclass(frozen=True, kw_only=True)
class TuneResult:
    """Result of :func:`tune`.

    Attributes:
        overrides: the best values, for ``overrides`` of :func:`omnistep.run`.
        value: the objective at the best values.
        study: the ``optuna.Study`` with every trial, for Optuna's plots and analyses. A trial's
            ``user_attrs["failed"]`` is the number of its runs that failed or lack the metric.
        folder: the folder of the rows of all runs; None if they were not kept.
        failed: number of runs of the best trial that failed or lack the metric.
    """

    overrides: dict[str, Any]
    value: float
    study: Any
    folder: Path | None
    failed: int


def tune(
    scenario: str | PathLike[str] | Scenario = "step",
    *,
    space: Mapping[str, Range],
    objective: str | Callable[[list[dict[str, Any]]], float] = "crossing_s",
    direction: Literal["minimize", "maximize"] = "minimize",
    points: Mapping[str, Iterable[Any]] | Iterable[Mapping[str, Any]] | None = None,
    policy: str | None = None,
    overrides: Mapping[str, Any] | None = None,
    trials: int = 50,
    seeds: int | Sequence[int] = 5,
    seed: int = 0,
    worst: float = 1e6,
    out: str | PathLike[str] | None = None,
    jobs: int | None = None,
    progress: bool = True,
) -> TuneResult:
    """Search for the values of keys that optimise an objective.

    Each trial is a small study: its values are run at every point with every seed, on all cores. Optuna's TPE chooses
    the next values from those before. Equal arguments produce equal trials, so that with ``out`` an interrupted search
    continues from its last trial, and a search with more trials begins with the existing trials.

    A run that failed, or lacks the metric because it did not climb, counts as ``worst``. Therefore fewer failures are
    always better, and the metric ranks trials with equally many failures. Seeds differ only if the scenario has a
    perturbation or noise: set some in ``overrides``, because otherwise the values fit only a single run.

    Args:
        scenario: a built-in name, the path of a .toml file or an :class:`omnistep.Scenario`.
        space: for each key, as in ``overrides`` of :func:`omnistep.run`, the values to search: ``(0.1, 10.0)``, ``(0.1,
            10.0, "log")``, two integers for whole numbers, or a list of values.
        objective: a metric of :class:`omnistep.Outcome`, averaged over all runs; or a function of the rows (one
            dictionary per run, by column), called only if no run failed.
        direction: ``minimize`` or ``maximize``.
        points: the points of each trial, as in :func:`omnistep.sweep`; the unchanged scenario by default.
        policy: coordination policy instead of the scenario's.
        overrides: keys to replace in every run.
        trials: number of trials, 1 or more.
        seeds: number of seeds per trial, counted from 0, or a list of them.
        seed: seed of the search.
        worst: the value of a failed run, above 0: more than any metric.
        out: a folder to keep the rows in.
        jobs: threads; as many as there are cores by default.
        progress: show a bar, in a terminal or a notebook, when it takes more than a second.

    Returns:
        The best values and Optuna's study.

    Raises:
        ConfigError: a name, key or value is wrong, or a range reaches beyond what its key allows. Values within the
            range that do not fit together are no error: they count as ``worst``.
        ImportError: Optuna is not installed; install the extra ``tune``.
        StudyError: the folder cannot be read or written; or no run of any trial has the metric.
        KeyboardInterrupt: Ctrl-C was pressed.

    >>> import omnistep
    >>> found = omnistep.tune(
    ...     "flat", space={"command.vx_m_s": (0.1, 0.5)}, objective="work_j", overrides={"duration_s": 0.5},
    ...     trials=4, seeds=1, progress=False)
    >>> len(found.study.trials), 0.1 <= found.overrides["command.vx_m_s"] <= 0.5
    (4, True)
    """
    trials = positive("trials", trials) or 0
    if direction not in ("minimize", "maximize"):
        raise ConfigError(f"direction = {direction!r}, allowed: minimize, maximize", key="direction")
    if not worst > 0.0:
        raise ConfigError(f"worst = {worst!r}, allowed: above 0", key="worst")
    optuna = _optuna()
    ranges = {key: _distribution(optuna, key, given) for key, given in space.items()}
    if not ranges:
        raise ConfigError("space: empty, allowed: at least one key", key="space")
    at = points_of(points) if points is not None else [{}]
    fixed = {key for point in at for key in point} | set(overrides or {}) | ({"control.policy"} if policy else set())
    if twice := sorted(fixed & set(space)):
        raise ConfigError(f"space: {twice[0]} is also given elsewhere, allowed: one of the two", key=twice[0])

    at_seeds = listed(seeds)

    def plan(values: Mapping[str, Any]) -> Plan:
        each = [{**point, **values} for point in at]
        return Plan.of_points(each, scenario=scenario, policy=policy, overrides=overrides, seeds=at_seeds)

    low, high = ({key: _ends(range_)[corner] for key, range_ in ranges.items()} for corner in (0, 1))
    checked, _ = plan(low), plan(high)
    for key, range_ in ranges.items():
        for choice in getattr(range_, "choices", ())[1:-1]:
            try:
                plan({**low, key: choice})
            except ConfigError:
                # It may fit only what the others are there.
                plan({**high, key: choice})
    if isinstance(objective, str) and objective not in checked.metrics:
        known = ", ".join(checked.metrics)
        raise ConfigError(f"objective = {objective!r}, allowed: a function, or {known}", key="objective")
    bad = worst if direction == "minimize" else -worst

    with ExitStack() as stack:
        folder = Path(out if out is not None else stack.enter_context(tempfile.TemporaryDirectory()))
        bar = stack.enter_context(counter(shown=progress, total=trials, unit="trial"))
        study = _study(optuna, direction, seed)
        errors = []
        for _ in range(trials):
            trial = study.ask(ranges)
            try:
                of_trial = plan(trial.params)
            except ConfigError as error:
                trial.set_user_attr("refused", str(error))
                study.tell(trial, bad)
            else:
                rows = complete(of_trial, folder, jobs=jobs, retry_errors=False, progress=False).rows()
                value, failed = _value(rows, objective, bad)
                trial.set_user_attr("failed", failed)
                study.tell(trial, value)
                errors += [row["error"] for row in rows if row["error"] is not None][:1]
            bar.set_postfix_str(f"best {study.best_value:.4g}", refresh=False)
            bar.update()
    if study.best_value == bad:
        raise StudyError(_nothing(study, objective, errors), key="objective")
    return TuneResult(
        overrides=dict(study.best_params),
        value=float(study.best_value),
        study=study,
        folder=folder if out is not None else None,
        failed=study.best_trial.user_attrs["failed"],
    )


def _nothing(study: Any, objective: str | Callable[[list[dict[str, Any]]], float], errors: list[str]) -> str:
    """Return the reason why no trial has a result."""
    trials = len(study.trials)
    refused = [trial.user_attrs["refused"] for trial in study.trials if "refused" in trial.user_attrs]
    if len(refused) == trials:
        return f"none of {trials} trials can run: {refused[0]}"
    metric = objective if isinstance(objective, str) else "value of the objective"
    return ": ".join([f"no run of {trials} trials has a {metric}", *errors[:1]])


def _value(
    rows: list[dict[str, Any]], objective: str | Callable[[list[dict[str, Any]]], float], bad: float
) -> tuple[float, int]:
    """Objective of a trial, and the number of its failed runs."""
    if isinstance(objective, str):
        metrics = [None if row["error"] is not None else row[objective] for row in rows]
        failed = sum(metric is None for metric in metrics)
        return sum(bad if metric is None else float(metric) for metric in metrics) / len(metrics), failed
    failed = sum(row["error"] is not None for row in rows)
    if failed:
        return bad * failed / len(rows), failed
    value = float(objective(rows))
    return (bad if isnan(value) else value), 0


def _distribution(optuna: Any, key: str, given: Range) -> Any:
    """Optuna's distribution of a range."""
    distributions = optuna.distributions
    if isinstance(given, list) and given:
        return distributions.CategoricalDistribution(given)
    if isinstance(given, tuple) and len(given) in (2, 3) and given[2:] in ((), ("log",)):
        low, high = given[:2]
        numbers = all(isinstance(end, int | float) and not isinstance(end, bool) for end in (low, high))
        log = len(given) == 3
        if numbers and low < high and not (log and low <= 0):
            whole = isinstance(low, int) and isinstance(high, int)
            kind = distributions.IntDistribution if whole else distributions.FloatDistribution
            return kind(low, high, log=log)
    allowed = 'allowed: (from, to), (from, to, "log") with from < to, above 0 for "log", or a list of values'
    raise ConfigError(f"space: {key} = {given!r}, {allowed}", key=key)


def _ends(distribution: Any) -> tuple[Any, Any]:
    choices = getattr(distribution, "choices", None)
    return (choices[0], choices[-1]) if choices else (distribution.low, distribution.high)


def _study(optuna: Any, direction: str, seed: int) -> Any:
    """Make a study in memory, without a line on standard error."""
    logging = optuna.logging
    before = logging.get_verbosity()
    logging.set_verbosity(logging.WARNING)
    try:
        return optuna.create_study(direction=direction, sampler=optuna.samplers.TPESampler(seed=seed))
    finally:
        logging.set_verbosity(before)


def _optuna() -> Any:
    try:
        return importlib.import_module("optuna")
    except ImportError as error:
        raise ImportError('omnistep.tune needs Optuna: pip install "omnistep[tune]"') from error
