"""What the study demands of traction control, what was measured, and whether it held."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import pandas as pd

import study.safety
from omnistep._omnistep import mean_interval, wilson
from study.situations import SEEDS, VEHICLES
from study.situations import situations as planned_situations

CELL = ["height_m", "friction", "torque_n_m"]
#: Metrics of the grid and their largest allowed ratio to independent's.
PARTS = {"slip_speed_std": 0.55, "torque_squared_n2m2s": 0.9, "slip_rms": 0.85}
NAMES = {
    "slip_speed_std": "slip speed std",
    "torque_squared_n2m2s": "torque squared",
    "slip_rms": "slip rms",
    "crossing_s": "time",
}
GRID_RUNS, PERTURBED_RUNS, GROUND_RUNS = 48, 24, 8
#: Of the grid's 48 without retry.
ALONE = {"rapier": 34, "articulated": 44}
#: Of 24 perturbed runs.
CLIMB, CLIMB_WITH_LAG = 23, 21
#: On other grounds, the largest allowed ratio to independent's.
MORE = 1.10
#: Less is rounding: 0.15 mm/s at the rims.
NO_SPREAD = 5e-4
GROUND_METRICS = ["crossing_s", "torque_squared_n2m2s", "slip_speed_std"]
#: Reported without a requirement: levelling works against inclined ground, and plain loops hardly slip there.
REPORTED = {("half_step", "slip_speed_std")}
REACH_CELLS, REACH_RAPIER = 32, 14
APART_RPM, FALL_RPM = 6.0, 1.0
#: Of the situations an audit counted.
SITUATION_CLIMBS, SITUATION_RUNS = 190, 276


@dataclass(frozen=True)
class Gate:
    """One demand; ``held`` is None if a metric is reported without a requirement."""

    group: str
    name: str
    demand: str
    measured: str
    held: bool | None

    @property
    def verdict(self) -> str:
        """The verdict in one word."""
        return {True: "held", False: "FAILED", None: "reported"}[self.held]


def counted(yes: int, runs: int) -> str:
    """A count with its 95 % interval by Wilson's score."""
    low, high = wilson(yes, runs) or (0.0, 1.0)
    return f"{yes} of {runs} [{low:.2f}, {high:.2f}]"


def of(rows: pd.DataFrame, **values: object) -> pd.DataFrame:
    """The rows with these values."""
    for name, value in values.items():
        rows = rows[rows[name] == value]
    return rows


def climbed(rows: pd.DataFrame) -> int:
    """How many climbed."""
    return int(rows["climbed"].astype(bool).sum())


def paired(rows: pd.DataFrame, policy: str, against: str, only: str | None = "climbed") -> pd.DataFrame:
    """Runs of two policies side by side that are alike in all else, where both climbed: columns end in _x and _y."""
    by = [name for name in [*CELL, "seed", "case", "group", "scenario"] if name in rows]
    pairs = of(rows, policy=policy).merge(of(rows, policy=against), on=by)
    return pairs[pairs[f"{only}_x"].astype(bool) & pairs[f"{only}_y"].astype(bool)] if only else pairs


def part(pairs: pd.DataFrame, metric: str) -> float:
    """Mean of a metric over pairs, as a part of the other's; not a number without pairs."""
    ours, theirs = pairs[f"{metric}_x"].mean(), pairs[f"{metric}_y"].mean()
    return float(ours / theirs) if theirs else float("nan")


def difference(pairs: pd.DataFrame, metric: str) -> tuple[float, float, float]:
    """Mean difference over pairs and its 95 % interval by Student's t."""
    found = mean_interval((pairs[f"{metric}_x"] - pairs[f"{metric}_y"]).dropna().astype(float).tolist())
    mean, interval = found or (float("nan"), None)
    low, high = interval or (float("nan"), float("nan"))
    return mean, low, high


def complete(rows: pd.DataFrame, runs: int) -> bool:
    """Every run is there, and none failed."""
    return len(rows) == runs and not rows["error"].notna().any()


def grid(rows: pd.DataFrame, engine: str, wheels: str) -> list[Gate]:
    """The grid on one engine; on rollers nothing is demanded."""
    demanded = wheels == "ball"
    group = f"grid, {engine}, {'balls' if demanded else 'rollers'}"
    here = of(rows, group="grid", engine=engine, wheels=wheels)
    traction, plain, alone = (of(here, policy=p) for p in ("traction", "independent", "traction without retry"))
    whole = all(complete(each, GRID_RUNS) for each in (traction, plain, alone))

    def gate(name: str, demand: str, measured: str, held: bool) -> Gate:
        return Gate(group, name, demand, measured, (whole and held) if demanded else None)

    ours, theirs = (each.groupby(CELL)["climbed"].sum() for each in (traction, plain))
    kept = int((ours >= theirs.reindex(ours.index, fill_value=0)).sum()) if len(ours) else 0
    gates = [
        gate("cells in which traction climbs at least as often as independent", "all 12", f"{kept} of 12", kept == 12),
        gate(
            "traction climbs",
            "at least 46 of 48",
            f"{counted(climbed(traction), len(traction))}; independent {counted(climbed(plain), len(plain))}",
            climbed(traction) >= 46,
        ),
    ]
    pairs = paired(here, "traction", "independent")
    for metric, most in PARTS.items():
        mean, low, high = difference(pairs, metric)
        text = f"{part(pairs, metric):.3f} over {len(pairs)} pairs; difference {mean:.3f} [{low:.3f}, {high:.3f}]"
        gates.append(
            gate(f"{NAMES[metric]}, ratio to independent", f"at most {most}", text, part(pairs, metric) <= most)
        )
    if not demanded and alone.empty:  # the slowest of all
        return gates
    least = ALONE[engine]
    measured = counted(climbed(alone), len(alone))
    return [*gates, gate("traction without retry climbs", f"at least {least} of 48", measured, climbed(alone) >= least)]


def perturbed(rows: pd.DataFrame, cases: Iterable[str], engine: str) -> list[Gate]:
    """Each perturbation on its own; on rapier those that are run there."""
    gates = []
    for case in cases:
        here = of(rows, group="perturbed", case=case, engine=engine)
        traction, plain = of(here, policy="traction"), of(here, policy="independent")
        least = CLIMB_WITH_LAG if "lag" in case else CLIMB
        measured = counted(climbed(traction), len(traction))
        measured += f"; independent {climbed(plain)}" if len(plain) else ""
        held = complete(traction, PERTURBED_RUNS) and climbed(traction) >= least
        gates.append(Gate(f"perturbed, {engine}", case, f"at least {least} of 24", measured, held))
    return gates


def grounds(rows: pd.DataFrame, names: Iterable[str], engine: str, runs: int) -> list[Gate]:
    """Other grounds against independent: demanded with the articulated engine, reported with rapier."""
    gates = []
    for name in names:
        here = of(rows, group="grounds", case=name, engine=engine)
        traction, plain = of(here, policy="traction"), of(here, policy="independent")
        whole = complete(traction, runs) and complete(plain, runs) and climbed(traction) >= climbed(plain)
        # On the flat nothing is climbed and every run counts.
        pairs = paired(here, "traction", "independent", "climbed" if climbed(plain) else None)
        for metric in GROUND_METRICS:
            if len(plain) and plain[metric].isna().all():
                continue  # no crossing on the flat
            ours, theirs = pairs[f"{metric}_x"].mean(), pairs[f"{metric}_y"].mean()
            reported = (name, metric) in REPORTED or engine != "articulated"
            text = f"{part(pairs, metric):.2f} ({ours:.4g} against {theirs:.4g})"
            most = max(MORE * theirs, NO_SPREAD if metric == "slip_speed_std" else 0.0)
            held = None if reported else bool(whole and ours <= most)
            gates.append(
                Gate(
                    f"grounds, {engine}",
                    f"{name}: {NAMES[metric]}, ratio to independent",
                    f"at most {MORE}",
                    text,
                    held,
                )
            )
    return gates


def cells_climbed(rows: pd.DataFrame, cells: Sequence[tuple]) -> int:
    """Cells in which every run climbed; a cell without runs is none of them."""
    every = rows.groupby(CELL)["climbed"].agg(lambda each: bool(each.astype(bool).all()))
    return sum(bool(every.get(cell, False)) for cell in cells)


def runup(rows: pd.DataFrame, possible: Sequence[tuple], hard: Sequence[tuple], seeds: int) -> list[Gate]:
    """The harder table."""
    here = of(rows, group="hard", policy="traction_runup")
    ours, slow = of(here, engine="articulated"), of(here, engine="rapier")
    in_cells = ours[[tuple(row) in set(possible) for row in ours[CELL].itertuples(index=False)]]
    cells, whole = cells_climbed(ours, possible), complete(in_cells, len(possible) * seeds)
    some = counted(climbed(in_cells), len(in_cells))
    least, most = f"at least {REACH_CELLS} of {len(possible)}", f"at least {REACH_RAPIER} of {len(hard)}"
    found = counted(climbed(slow), len(slow))
    return [
        Gate(
            "traction_runup",
            "possible cells with every run climbed, articulated",
            least,
            f"{cells} of {len(possible)}; runs {some}",
            whole and cells >= REACH_CELLS,
        ),
        Gate(
            "traction_runup",
            "hard cells, rapier",
            most,
            found,
            complete(slow, len(hard)) and climbed(slow) >= REACH_RAPIER,
        ),
    ]


def situations(rows: pd.DataFrame) -> list[Gate]:
    """Situations beyond the paper's step: of as many as an audit had, 190 of 276."""
    here = of(rows, group="situations")
    traction = of(here, policy="traction")
    runs = sum(run["policy"] == "traction" for run in planned_situations())
    least = -(-SITUATION_CLIMBS * runs // SITUATION_RUNS)
    measured = f"{counted(climbed(traction), len(traction))}; independent {climbed(of(here, policy='independent'))}"
    held = complete(traction, runs) and climbed(traction) >= least
    return [Gate("situations", "traction climbs", f"at least {least} of {runs}", measured, held)]


def vehicles(rows: pd.DataFrame) -> list[Gate]:
    """Every vehicle on every height: no fewer climbs than independent, at most a tenth more time and torque squared."""
    gates = []
    for name, (_, _, heights_m) in VEHICLES.items():
        for height_m in heights_m:
            here = of(rows, group="vehicles", case=name, height_m=height_m)
            for policy in ("traction", "traction_runup"):
                ours, theirs = of(here, policy=policy), of(here, policy="independent")
                pairs = paired(here, policy, "independent")
                more = {
                    NAMES[metric]: part(pairs, metric)
                    for metric in ("crossing_s", "torque_squared_n2m2s")
                    if len(pairs)
                }
                held = complete(ours, len(SEEDS)) and complete(theirs, len(SEEDS)) and climbed(ours) >= climbed(theirs)
                held = held and all(each <= MORE for each in more.values())
                measured = f"{climbed(ours)}; independent {climbed(theirs)}"
                measured += "".join(f"; {metric} {each:.2f}" for metric, each in more.items())
                demand = f"no fewer climbs, time and torque squared at most {MORE}"
                gates.append(Gate("vehicles", f"{name}, {100 * height_m:g} cm, {policy}", demand, measured, held))
    return gates


def safety(rows: pd.DataFrame, draws: int) -> list[Gate]:
    """Drawn runs with wrong sensors: what may never be, and what plain loops do as often."""
    here = of(rows, group="safety")
    traction, plain = here[here["policy"] != "independent"], of(here, policy="independent")
    whole, gates = complete(traction, draws) and complete(plain, draws), []
    pairs = traction.merge(plain, on="seed", suffixes=("", "_plain"))
    for law in study.safety.LAWS:
        # Motors without a no-load speed have no limit of their rims.
        limited = pairs[pairs[law].notna()]
        ours, theirs = limited[law] > 1.0, limited[f"{law}_plain"] > 1.0
        only, other = int((ours & ~theirs).sum()), int((theirs & ~ours).sum())
        measured = f"{ours.sum()} of {len(limited)}; independent {theirs.sum()}"
        if law in study.safety.NEVER:
            gates.append(Gate("safety", law, "none", measured, whole and not ours.any()))
            continue
        # Of the draws where one went beyond and the other did not, is it surely traction control more often?
        often, most = wilson(only, only + other) if only + other else (0.0, 1.0)
        measured += f"; only this {only}, only independent {other}: this is [{often:.2f}, {most:.2f}] of them"
        demand = "not shown to be more often than independent"
        gates.append(Gate("safety", law, demand, measured, whole and often <= 0.5))
    sound = of(study.safety.with_causes(traction), cause="sound")
    for law in study.safety.SOUND:
        beyond = sound[law] > 1.0
        measured = f"{beyond.sum()} of {len(sound)}"
        gates.append(Gate("safety", f"{law}, sound draws", "none", measured, whole and not beyond.any()))
    return gates


def bouncing(rows: pd.DataFrame) -> list[Gate]:
    """Contacts that bounce: reported without a requirement."""
    gates = []
    for group, what in [("bouncing", "grid"), ("bouncing hard", "harder cells")]:
        here = of(rows, group=group)
        counts = [
            f"{policy} {counted(climbed(of(here, policy=policy)), len(of(here, policy=policy)))}"
            for policy in dict.fromkeys(here["policy"])
        ]
        gates.append(Gate("bouncing contacts", f"climbed on the {what}", "", "; ".join(counts), None))
    return gates


def on_dampers(metrics: pd.DataFrame) -> list[Gate]:
    """Section 3.3."""
    gates = []
    for policy in ("traction", "traction_runup"):
        row = of(metrics, policy=policy)
        apart, fall = (
            float(row[name].iloc[0]) if len(row) else float("nan") for name in ("apart_ever_rpm", "fall_rpm")
        )
        name = f"{policy}: fastest less slowest wheel"
        gates.append(Gate("section 3.3", name, f"at most {APART_RPM:g} rpm", f"{apart:.1f} rpm", apart <= APART_RPM))
        name = f"{policy}: drop of the slowest wheel at a release"
        gates.append(Gate("section 3.3", name, f"at most {FALL_RPM:g} rpm", f"{fall:.2f} rpm", fall <= FALL_RPM))
    return gates
