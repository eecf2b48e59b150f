"""Whole runs: one run, one for each policy, or one read from its log."""

import warnings
from collections.abc import Iterable, Mapping
from os import PathLike
from typing import Any, Never, overload

from omnistep._argument_types import no_others
from omnistep._comparison import Comparison
from omnistep._omnistep import Log, Scenario, Trace, list_policies, policy_name, shortened
from omnistep._omnistep import read_mcap as _read_mcap
from omnistep._omnistep import run as _run
from omnistep._progress import bar
from omnistep.errors import ConfigError
from omnistep.own_policy import PolicyLike


def _warn(trace: Trace) -> None:
    """Warn the caller's caller of a run with invalid metrics."""
    if trace.outcome.verdict == "gained_energy":
        message = "the physics gained energy, so no metric of this run is valid; use a shorter physics.timestep_s"
        warnings.warn(message, RuntimeWarning, stacklevel=3)


def run(
    scenario: str | PathLike[str] | Scenario = "step",
    *,
    policy: PolicyLike | None = None,
    overrides: Mapping[str, Any] | None = None,
    seed: int | None = None,
    mcap: str | PathLike[str] | None = None,
    progress: bool = True,
    **others: Never,
) -> Trace:
    """Run a scenario from start to end.

    Other Python threads continue to run. Ctrl-C stops the run.

    Args:
        scenario: a built-in name (see :func:`list_scenarios`), the path of a .toml file or a :class:`Scenario`; the
            step by default.
        policy: coordination policy instead of the scenario's (see :func:`list_policies`), or a controller of your own:
            an object with ``reset(info)`` and ``step(observation)``, or a function of the observation (see
            :class:`Policy`).
        overrides: keys of the scenario, or of its vehicle behind ``vehicle.``, and their new values:
            ``{"terrain.height_m": 0.03, "vehicle.motor.stall_torque_n_m": 1.0}``. Elements of lists count from 0:
            ``"vehicle.wheel.0.radius_m"``. Values are numbers, strings, bools, or lists, arrays or dictionaries of
            them. A path is relative to the working directory; one in a file is relative to that file.
        seed: seed of the scenario's perturbation, 0 to 2**63 - 1.
        mcap: path of an MCAP log to write; the file gets that name only when the run has ended regularly.
        progress: show a bar, in a terminal or a notebook, when it takes more than a second.
        others: none is allowed; the message says where keys of a scenario go.

    Returns:
        Every signal of every control period. If the physics gained energy, the verdict ``gained_energy`` and a
        ``RuntimeWarning`` mark the result as invalid.

    Warns:
        UserWarning: one encoder count reads as a velocity for which the gains request more torque than the motor has;
            or ``traction`` or ``traction_runup`` lacks sensors or motor speed that it requires.

    Raises:
        ConfigError: a name, key or value is wrong, or a file cannot be read; the message names it and the allowed
            values.
        TypeError: a value has a type that no key can hold, or the policy is not a policy.
        SimulationError: the physics diverged (a value is not finite), or a policy of your own returned no valid
            torques. An exception of the policy itself is raised unchanged, with a note of the time.
        LogError: the log could not be written, or another run writes it.
        KeyboardInterrupt: Ctrl-C was pressed; no log is left.

    Example:
        >>> import omnistep
        >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> len(trace), trace.outcome.verdict
        (500, 'completed')
    """
    no_others(run, others)
    with bar("run", shown=progress) as advance:
        on_progress = advance if progress else None
        trace = _run(scenario, policy=policy, overrides=overrides, seed=seed, mcap=mcap, on_progress=on_progress)
    _warn(trace)
    return trace


@overload
def compare(
    scenario: str | PathLike[str] | Scenario = ...,
    *,
    policies: Iterable[PolicyLike] | None = ...,
    engines: None = ...,
    overrides: Mapping[str, Any] | None = ...,
    seed: int | None = ...,
    progress: bool = ...,
) -> Comparison[str]: ...
@overload
def compare(
    scenario: str | PathLike[str] | Scenario = ...,
    *,
    policies: Iterable[PolicyLike] | None = ...,
    engines: Iterable[str],
    overrides: Mapping[str, Any] | None = ...,
    seed: int | None = ...,
    progress: bool = ...,
) -> Comparison[tuple[str, str]]: ...
def compare(
    scenario: str | PathLike[str] | Scenario = "step",
    *,
    policies: Iterable[PolicyLike] | None = None,
    engines: Iterable[str] | None = None,
    overrides: Mapping[str, Any] | None = None,
    seed: int | None = None,
    progress: bool = True,
    **others: Never,
) -> Comparison[str] | Comparison[tuple[str, str]]:
    """Run a scenario under several policies, and on several engines.

    Args:
        scenario: a built-in name, the path of a .toml file or a :class:`Scenario`.
        policies: names of coordination policies and controllers of your own, as in :func:`run`, in any combination; all
            coordination policies by default.
        engines: ``"rapier"``, ``"articulated"`` or both; the scenario's by default.
        overrides: keys to replace, as in :func:`run`.
        seed: seed of the scenario's perturbation.
        progress: show a bar, in a terminal or a notebook, when it takes more than a second.
        others: none is allowed; the message says where keys of a scenario go.

    Returns:
        The trace of each policy by name, in the order given; with ``engines`` by name and engine. ``print`` shows the
        table of ``omnistep compare``, and so does a notebook.

    Warns:
        UserWarning: as in :func:`run`, for each policy.

    Raises:
        ConfigError: a name, key or value is wrong, no policy is named, or one is named twice.
        TypeError: ``policies`` or ``engines`` is one string, or a policy is not a policy.
        SimulationError: as in :func:`run`.

    Example:
        >>> import omnistep
        >>> short = {"duration_s": 0.1}
        >>> traces = omnistep.compare("flat", policies=["independent", "shared_integral"], overrides=short)
        >>> [trace.policy for trace in traces.values()]
        ['independent', 'shared_integral']
        >>> def coast(observation):
        ...     return 0.0 * observation.wheels_rad_s
        >>> both = ["rapier", "articulated"]
        >>> traces = omnistep.compare("flat", policies=["independent", coast], engines=both, overrides=short)
        >>> list(traces)
        [('independent', 'rapier'), ('independent', 'articulated'), ('coast', 'rapier'), ('coast', 'articulated')]
    """
    no_others(compare, others)
    listed = _listed("policies", policies, "a list of names and controllers")
    given = _all_policies() if listed is None else listed
    names = [policy_name(each) for each in given]
    if not _each_once(given, names):
        hint = "" if all(isinstance(each, str) for each in given) else "; an object's attribute `name` is its name"
        raise ConfigError(f"policies: {names}, allowed: at least one name, each only once{hint}", key="policies")
    on = _listed("engines", engines, "a list of names")
    if on is not None:
        if not _each_once(on, on):
            raise ConfigError(f"engines: {on}, allowed: at least one name, each only once", key="engines")
        if "physics.engine" in (overrides or {}):
            message = "overrides: physics.engine is also given by engines, allowed: one of the two"
            raise ConfigError(message, key="physics.engine")
    runs = [(policy, name, engine) for policy, name in zip(given, names, strict=True) for engine in on or [None]]
    traces: dict[Any, Trace] = {}
    with bar("compare", shown=progress) as advance:

        def advance_all(part: float) -> None:
            advance((len(traces) + part) / len(runs))

        on_progress = advance_all if progress else None
        for policy, name, engine in runs:
            keys = overrides if engine is None else {**(overrides or {}), "physics.engine": engine}
            trace = _run(scenario, policy=policy, overrides=keys, seed=seed, on_progress=on_progress)
            _warn(trace)
            traces[name if engine is None else (name, engine)] = trace
    return Comparison(traces)


def _listed(name: str, given: Iterable[Any] | None, allowed: str) -> list[Any] | None:
    if given is None:
        return None
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise TypeError(shortened(f"{name}: {given!r}, allowed: {allowed}"))
    return list(given)


def _each_once(given: list[Any], names: list[str]) -> bool:
    return bool(given) and None not in given and len(set(names)) == len(names)


_all_policies = list_policies


def read_mcap(path: str | PathLike[str], *, progress: bool = True) -> Log:
    """Read an MCAP log of a run, finished or not; every checksum is checked.

    Other Python threads continue to run. Ctrl-C stops it.

    Args:
        path: the log; the log of a killed run ends with ``.mcap.part``.
        progress: show a bar, in a terminal or a notebook, when it takes more than a second.

    Returns:
        The run.

    Raises:
        LogError: the file cannot be read, is damaged, or is not a log of omnistep.
        ConfigError: its scenario is not of this version.

    Example:
        >>> import omnistep, pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder) / "flat.mcap"
        ...     trace = omnistep.run("flat", overrides={"duration_s": 0.5}, mcap=path)
        ...     log = omnistep.read_mcap(path)
        >>> log.complete, log.outcome == trace.outcome
        (True, True)
    """
    with bar("read", shown=progress) as advance:
        return _read_mcap(path, on_progress=advance if progress else None)
