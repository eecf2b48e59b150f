"""Tables of docs/study.md and docs/study-gates.md, each from the study's rows."""

from collections.abc import Iterable, Sequence

import pandas as pd

import omnistep
import study.safety
from study.gates import CELL, MORE, Gate, climbed, counted, difference, of, paired, part
from study.runs import ASKEW, COARSE, GROUNDS, IMPOSSIBLE, PERTURBED, POLICIES, grid_cells, hard_cells
from study.situations import SITUATIONS, VEHICLES

#: Engine and wheels as the tables call them.
PLACES = {
    ("articulated", "ball"): "articulated, balls",
    ("articulated", "rollers"): "articulated, rollers",
    ("rapier", "ball"): "rapier, balls",
    ("rapier", "rollers"): "rapier, rollers",
}
MEANS = {
    "crossing_s": ("time [s]", 2),
    "slip_speed_std": ("slip speed std", 3),
    "slip_rms": ("slip rms", 3),
    "torque_squared_n2m2s": ("torque squared [N2m2s]", 1),
    "peak_n": ("peak force [N]", 0),
    "retries": ("retries", 2),
}
PAIRED = {name: MEANS[name] for name in ("slip_speed_std", "torque_squared_n2m2s", "slip_rms", "crossing_s", "peak_n")}


def table(head: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> str:
    """A table of Markdown: the first columns to the left, numbers to the right."""
    lines = [head, ["---"] * left + ["---:"] * (len(head) - left), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def mean(rows: pd.DataFrame, metric: str, digits: int) -> str:
    """A mean, or a dash where nothing was measured."""
    found = rows[metric].dropna().astype(float)
    return f"{found.mean():.{digits}f}" if len(found) else "-"


def with_interval(pairs: pd.DataFrame, metric: str, digits: int) -> str:
    """A mean difference with its interval."""
    value, low, high = difference(pairs, metric)
    return "-" if value != value else f"{value:+.{digits}f} [{low:+.{digits}f}, {high:+.{digits}f}]"


def ups(rows: pd.DataFrame) -> pd.DataFrame:
    """Those that climbed."""
    return rows[rows["climbed"].astype(bool)]


def gates(found: list[Gate]) -> str:
    """Every gate."""
    head = ["where", "what", "demand", "measured", "verdict"]
    return table(head, [[g.group, g.name, g.demand or "-", g.measured, g.verdict] for g in found], left=5)


def grid(rows: pd.DataFrame) -> str:
    """Counts, and means over the runs that climbed."""
    lines = []
    for (engine, wheels), place in PLACES.items():
        here = of(rows, group="grid", engine=engine, wheels=wheels)
        for policy in [*POLICIES, "traction without retry"]:
            if len(each := of(here, policy=policy)):
                means = [mean(ups(each), metric, digits) for metric, (_, digits) in MEANS.items()]
                name = f"`{policy}`".replace(" without retry`", "` without retry")
                lines.append([place, name, counted(climbed(each), len(each)), *means])
    head = ["engine, wheels", "policy", "climbed [95 %]", *[name for name, _ in MEANS.values()]]
    return table(head, lines, left=2)


def pairs(rows: pd.DataFrame) -> str:
    """`traction` less `independent`, seed by seed."""
    lines = []
    for (engine, wheels), place in PLACES.items():
        both = paired(of(rows, group="grid", engine=engine, wheels=wheels), "traction", "independent")
        if len(both):
            parts = [
                f"{with_interval(both, metric, digits)}; {part(both, metric):.2f}"
                for metric, (_, digits) in PAIRED.items()
            ]
            lines.append([place, str(len(both)), *parts])
    head = ["engine, wheels", "pairs", *[name for name, _ in PAIRED.values()]]
    return table(head, lines)


def cells(rows: pd.DataFrame, column: str, places: Sequence[tuple[str, str]], policies: Sequence[str]) -> str:
    """Counts a cell of the grid."""
    lines = []
    for cell in grid_cells():
        line = [f"{cell[1]:g}", f"{cell[2]:g}"]
        for engine, wheels in places:
            for policy in policies:
                each = of(rows, group="grid", engine=engine, wheels=wheels, policy=policy)
                each = of(each, friction=cell[1], torque_n_m=cell[2])
                line.append(f"{climbed(each)}" if column == "climbed" else mean(each, column, 2))
        lines.append([*line, climb_limits(cell)])
    names = [f"{engine}{' rollers' if wheels == 'rollers' else ''}: {p}" for engine, wheels in places for p in policies]
    return table(["mu", "torque limit", *names, "run-up, by statics [m/s]"], lines, left=2)


def climb_limits(cell: tuple[float, float, float]) -> str:
    """The run-up that the row which needs most needs: at least, and from where on its energy suffices [m/s]."""
    height, mu, torque = cell
    keys = {"terrain.height_m": height, "terrain.friction": mu, "vehicle.motor.stall_torque_n_m": torque}
    found = omnistep.climb_limits("step", overrides=keys)
    least, enough = found.run_up_m_s.max(), found.path_run_up_m_s.max()
    return "none" if enough == 0.0 else f"{least:.2f} to {enough:.2f}"


AFTER = {"impact_thrust": 3, "impact_push": 3, "impact_own": 2}


def impact(rows: pd.DataFrame) -> str:
    """What happens when wheel 4 meets the edge, by policy: all runs that get so far, and cells where it decides."""
    lines = []
    for policy in POLICIES:
        here = of(rows, group="grid", engine="articulated", wheels="ball", policy=policy)
        here = here[here["impact_m_s"].notna()]
        short = here[(here["friction"] > 0.6) & (here["torque_n_m"] == 1.4)]
        metrics = [("impact_m_s", 3), ("impact_windup", 2)]
        line = [f"`{policy}`", str(len(here)), *[spread(here, metric, digits) for metric, digits in metrics]]
        line += [spread(short, metric, digits) for metric, digits in AFTER.items()]
        rise = spread(short.assign(rise=100 * short["impact_rise_m"].astype(float)), "rise", 2)
        lines.append([*line, rise, counted(climbed(short), len(short))])
    head = ["policy", "runs", "speed at wheel 4 [m/s]", "wind-up", "thrust *", "push *", "wheel 4 at once *"]
    head += ["rise * [cm]", "climbed *"]
    return table(head, lines) + "\n\n\\* at 1.4 N.m with friction 0.7 and 0.85. Mean +- standard deviation."


TURNED_DEG = 15.0


def turned(rows: pd.DataFrame) -> str:
    """How those runs of the grid end that do not climb."""
    lines = []
    for engine in ("articulated", "rapier"):
        here = of(rows, group="grid", engine=engine, wheels="ball")
        for policy in dict.fromkeys(here["policy"]):
            each = of(here, policy=policy)
            down = each[~each["climbed"].astype(bool)]
            if down.empty:
                continue
            yaw = down["yaw_error_deg"].astype(float).abs()
            ends = f"{yaw.median():.1f} ({yaw.min():.1f} to {yaw.max():.1f})"
            short = len(of(down, friction=0.55))
            name = f"`{policy}`".replace(" without retry`", "` without retry")
            lines.append([engine, name, str(len(down)), str(short), str(int((yaw > TURNED_DEG).sum())), ends])
    head = ["engine", "policy", "did not climb", "of these at friction 0.55", f"turned by more than {TURNED_DEG:g} deg"]
    return table([*head, "heading error, median (range) [deg]"], lines, left=2)


def spread(rows: pd.DataFrame, metric: str, digits: int) -> str:
    """A mean with its standard deviation."""
    found = rows[metric].dropna().astype(float)
    return f"{found.mean():.{digits}f} +- {found.std():.{digits}f}" if len(found) > 1 else "-"


CLAIMS = {
    "slip_rms": ("slip rms (15)", 4),
    "speed_error_rms": ("speed error rms (14)", 4),
    "speed_error_realised_rms": ("the same, realised reference", 4),
    "speed_ratio_std": ("speed ratio std", 4),
    "slip_speed_std": ("slip speed std", 4),
    "crossing_s": ("crossing time [s]", 3),
    "peak_n": ("peak force [N]", 1),
    "torque_squared_n2m2s": ("torque squared [N2m2s]", 2),
}


def claims(rows: pd.DataFrame) -> str:
    """Each policy less `independent`, where both climbed."""
    columns = []
    for engine in ("articulated", "rapier"):
        for policy in ("scale_torques", "scale_references", "traction"):
            here = of(rows, group="grid", engine=engine, wheels="ball")
            columns.append((f"{engine}: `{policy}`", paired(here, policy, "independent")))
    lines = [
        [name, *[with_interval(both, metric, digits) for _, both in columns]]
        for metric, (name, digits) in CLAIMS.items()
    ]
    again = paired(of(rows, group="grid", engine="rapier", wheels="ball"), "traction", "independent")
    once = again[again["retries_x"] == 0]
    text = f"{with_interval(once, 'speed_error_rms', 3)} in the {len(once)} pairs without a retry"
    others = again[again["retries_x"] > 0]
    text += f", and by {with_interval(others, 'speed_error_rms', 3)} in the other {len(others)}"
    head = ["", *[f"{name} ({len(both)} pairs)" for name, both in columns]]
    return f"{table(head, lines)}\n\nWith rapier, the speed error rms of `traction` differs by {text}."


def answers(rows: pd.DataFrame) -> str:
    """The three questions of the page in a line each, with their numbers."""
    here = of(rows, group="grid", engine="articulated", wheels="ball")
    of_grid = {policy: of(here, policy=policy) for policy in (*POLICIES, "traction")}
    climbs = {policy: f"{climbed(each)} of {len(each)}" for policy, each in of_grid.items()}
    both = paired(here, "traction", "independent")
    times = {metric: f"{part(both, metric):.2f} times" for metric in PAIRED}
    hard = {p: of(rows, group="hard", engine="articulated", policy=p) for p in ("traction_runup", "independent")}
    harder = {policy: f"{climbed(each)} of {len(each)}" for policy, each in hard.items()}
    return "\n".join(
        [
            "- The speeds of the wheels converge with `scale_references`, and not with `scale_torques`, equation (12)"
            " as printed. Slip is reduced slightly, the speed error grows, and impacts are as hard as before.",
            f"- `independent` climbs {climbs['independent']} runs of the grid, `scale_torques`"
            f" {climbs['scale_torques']} and `scale_references` {climbs['scale_references']}, because scaling reduces"
            " the torque of wheels that could transmit more.",
            f"- `traction` climbs {climbs['traction']}, with {times['slip_speed_std']} the slip speed std,"
            f" {times['torque_squared_n2m2s']} the torque squared and {times['peak_n']} the peak force of"
            f" `independent`. `traction_runup` climbs {harder['traction_runup']} runs of the harder cells,"
            f" `independent` {harder['independent']}.",
        ]
    )


COMMANDED_M_S = 0.3


def losses(rows: pd.DataFrame) -> str:
    """Where `traction` is worse than `independent`, in words with their numbers."""
    lines = []
    for engine, wheels in PLACES:
        here = of(rows, group="grid", engine=engine, wheels=wheels)
        alone, plain = of(here, policy="traction without retry"), of(here, policy="independent")
        if climbed(alone) < climbed(plain) and len(alone):
            counts = f"{counted(climbed(alone), len(alone))} against {counted(climbed(plain), len(plain))}"
            lines.append(f"- *Without retry, {PLACES[engine, wheels]}*: it climbs {counts}.")
    for (engine, wheels), place in PLACES.items():
        both = paired(of(rows, group="grid", engine=engine, wheels=wheels), "traction", "independent")
        again = int((both["retries_x"] > 0).sum())
        for metric, (name, digits) in PAIRED.items():
            if metric != "peak_n" and len(both) and part(both, metric) > 1.0:
                text = f"{part(both, metric):.2f} times `independent`'s, {with_interval(both, metric, digits)}"
                lines.append(f"- *{name} on the grid, {place}*: {text}; {again} of {len(both)} runs have a retry.")
    more = [
        f"{part(both, 'peak_n'):.2f} ({place})"
        for (engine, wheels), place in PLACES.items()
        if len(both := paired(of(rows, group="grid", engine=engine, wheels=wheels), "traction", "independent"))
    ]
    lines.append(f"- *Peak force*, divided by `independent`'s: {', '.join(more)}. Later rows meet the edge faster.")
    for ground in GROUNDS:
        both = paired(of(rows, group="grounds", engine="articulated", case=ground), "traction", "independent")
        if len(both) and (worse := part(both, "torque_squared_n2m2s")) > 1.0:
            time = part(both, "crossing_s")
            lines.append(
                f"- *Torque squared on `{ground}`*: {worse:.2f} times `independent`'s, in {time:.2f} times its time."
            )
        if len(both) and (worse := part(both, "slip_speed_std")) > MORE:
            lines.append(f"- *Slip speed std on `{ground}`*: {worse:.2f} times `independent`'s.")
    for name, (_, _, heights_m) in VEHICLES.items():
        for height_m in heights_m:
            both = paired(of(rows, group="vehicles", case=name, height_m=height_m), "traction", "independent")
            if len(both) and (worse := part(both, "torque_squared_n2m2s")) > MORE:
                lines.append(
                    f"- *Torque squared of `{name}`, {100 * height_m:g} cm*: {worse:.2f} times `independent`'s."
                )
    here = of(rows, group="grounds", engine="articulated", case="half_step")
    slow, plain = (COMMANDED_M_S * of(here, policy=p)["slip_speed_std"].mean() for p in ("traction", "independent"))
    text = f"{1000 * slow:.1f} mm/s at the rims against {1000 * plain:.1f} mm/s"
    lines.append(
        f"- *Slip speed std on `half_step`*: {text}. Slip below 4 mm/s is not corrected, by design (`slip_free_m_s`)."
    )
    return "\n".join(lines)


def failures(rows: pd.DataFrame) -> str:
    """Runs in which an engine diverged."""
    gone = rows[rows["error"].notna()]
    if gone.empty:
        return "No engine ended a run with an error."
    lines = [f"Runs that an engine ended with an error, counted as not climbed: {len(gone)} of {len(rows)}.", ""]
    for _, row in gone.iterrows():
        cell = f"friction {row['friction']:g}, {row['torque_n_m']:g} N.m, seed {row['seed']}"
        place = PLACES[row["engine"], row["wheels"]]
        lines.append(f"- {row['group']}, {place}, `{row['policy']}`, {cell}: {row['error'].split(':')[0]}.")
    return "\n".join(lines)


def perturbed(rows: pd.DataFrame) -> str:
    """Counts and means of both laws, articulated; `traction` on rapier where that was run."""
    lines = []
    for case in PERTURBED:
        here = of(rows, group="perturbed", case=case)
        fast, slow = of(here, engine="articulated"), of(here, engine="rapier", policy="traction")
        both = paired(fast, "traction", "independent")
        line = [case, *[counted(climbed(each := of(fast, policy=p)), len(each)) for p in ("traction", "independent")]]
        line += [
            with_interval(both, metric, PAIRED[metric][1]) for metric in ("slip_speed_std", "torque_squared_n2m2s")
        ]
        line.append(mean(ups(of(fast, policy="traction")), "retries", 2))
        lines.append([*line, counted(climbed(slow), len(slow)) if len(slow) else "-"])
    head = [
        "",
        "`traction` climbed",
        "`independent` climbed",
        "slip speed std, difference",
        "torque squared, difference",
    ]
    return table([*head, "retries", "`traction` on rapier"], lines)


def grounds(rows: pd.DataFrame) -> str:
    """Means by ground and policy."""
    lines = []
    for engine, policies in [
        ("articulated", ["independent", "traction", "traction_runup"]),
        ("rapier", ["independent", "traction"]),
    ]:
        for ground in GROUNDS:
            here = of(rows, group="grounds", case=ground, engine=engine)
            line = [engine, f"`{ground}`"]
            for metric, digits in [("crossing_s", 2), ("torque_squared_n2m2s", 2), ("slip_speed_std", 3)]:
                line.append(" / ".join(mean(of(here, policy=policy), metric, digits) for policy in policies))
            of_all = [of(here, policy=policy) for policy in policies]
            flat = set(here["verdict"]) == {"completed"}
            counts = " / ".join(f"{len(each) if flat else climbed(each)} of {len(each)}" for each in of_all)
            lines.append([*line, counts])
    head = ["engine", "ground", "time [s]", "torque squared [N2m2s]", "slip speed std", "done"]
    return table(head, lines, left=2)


def coarse(rows: pd.DataFrame) -> str:
    """Counts and means by how coarse the encoders are."""
    lines = []
    fine = of(rows, group="grid", engine="articulated", wheels="ball")
    fine = fine[fine["seed"].isin(of(rows, group="coarse")["seed"])].assign(case="ideal")
    for case in ["ideal", *COARSE]:
        line = [case]
        for policy in ("traction", "independent"):
            each = of(pd.concat([fine, of(rows, group="coarse")]), case=case, policy=policy)
            metrics = [("slip_speed_std", 3), ("torque_squared_n2m2s", 1), ("crossing_s", 2)]
            line += [
                counted(climbed(each), len(each)),
                *[mean(ups(each), metric, digits) for metric, digits in metrics],
            ]
        lines.append(line)
    head = [
        f"`{policy}` {name}"
        for policy in ("traction", "independent")
        for name in ("climbed", "slip speed std", "torque squared", "time [s]")
    ]
    return table(["", *head], lines)


def askew(rows: pd.DataFrame) -> str:
    """How often an edge that is met askew is climbed."""
    here = of(rows, group="askew")
    columns = list(dict.fromkeys(here[["engine", "wheels", "policy"]].itertuples(index=False, name=None)))
    lines = []
    for case in ASKEW:
        each = [of(here, case=case, engine=engine, wheels=wheels, policy=p) for engine, wheels, p in columns]
        lines.append([case, *[f"{climbed(some)} of {len(some)}" for some in each]])
    every = [of(here, engine=engine, wheels=wheels, policy=p) for engine, wheels, p in columns]
    lines.append(["all", *[counted(climbed(some), len(some)) for some in every]])
    return table(["", *[f"{PLACES[engine, wheels]}: `{p}`" for engine, wheels, p in columns]], lines)


def _counts_and_means(here: pd.DataFrame) -> list[str]:
    """Climbs, time and torque squared of three policies."""
    every = [of(here, policy=policy) for policy in ("independent", "traction", "traction_runup")]
    counts = " / ".join(str(climbed(each)) for each in every)
    return [
        counts,
        *[
            " / ".join(mean(ups(each), f, d) for each in every)
            for f, d in (("crossing_s", 2), ("torque_squared_n2m2s", 1))
        ],
    ]


def situations(rows: pd.DataFrame) -> str:
    """Situations beyond the paper's step."""
    here = of(rows, group="situations")
    lines = [[case, *_counts_and_means(of(here, case=case))] for case in SITUATIONS]
    every = [of(here, policy=policy) for policy in ("independent", "traction", "traction_runup")]
    lines.append([f"all, of {len(every[0])}", " / ".join(str(climbed(each)) for each in every), "", ""])
    return table(["situation", "climbed of 4", "time [s]", "torque squared [N2m2s]"], lines)


def vehicles(rows: pd.DataFrame) -> str:
    """The other vehicles, by the height of the step."""
    here = of(rows, group="vehicles")
    lines = [
        [name, f"{100 * height_m:g}", *_counts_and_means(of(here, case=name, height_m=height_m))]
        for name, (_, _, heights_m) in VEHICLES.items()
        for height_m in heights_m
    ]
    return table(["vehicle", "height [cm]", "climbed of 4", "time [s]", "torque squared [N2m2s]"], lines, left=2)


def safety(rows: pd.DataFrame) -> str:
    """Drawn runs beyond each limit: traction control, plain loops on the same draws."""
    here = of(rows, group="safety")
    lines = [_beyond(vehicle, of(here, vehicle=vehicle)) for vehicle in study.safety.VEHICLES]
    return table(["vehicle", "draws", *study.safety.LAWS], [*lines, _beyond("all", here)])


def safety_causes(rows: pd.DataFrame) -> str:
    """The same by what misleads their control."""
    here = study.safety.with_causes(of(rows, group="safety"))
    lines = [_beyond(cause, of(here, cause=cause)) for cause in study.safety.CAUSES]
    return table(["what is wrong", "draws", *study.safety.LAWS], lines)


def _beyond(name: str, rows: pd.DataFrame) -> list[str]:
    plain = rows["policy"] == "independent"
    cells = [
        f"{int((rows[~plain][law] > 1).sum())}, {int((rows[plain][law] > 1).sum())}"
        if rows[law].notna().any()
        else "no limit"
        for law in study.safety.LAWS
    ]
    return [name, str(int(plain.sum())), *cells]


HARD = {
    "`traction_runup`": ("hard", "traction_runup"),
    "`traction`": ("hard", "traction"),
    "`traction_runup` without retry": ("hard", "traction_runup without retry"),
    "`independent`, 0.3 m/s": ("hard", "independent"),
    "`independent`, 1 m/s": ("fast", "independent"),
    "`traction_runup`, 15 rad/s": ("line", "traction_runup"),
    "`traction`, 15 rad/s": ("line", "traction"),
}


def hard(rows: pd.DataFrame) -> str:
    """The harder cells."""
    lines = []
    for cell in hard_cells():
        line = [f"{100 * cell[0]:g}", f"{cell[1]:g}", f"{cell[2]:g}"]
        for group, policy in HARD.values():
            each = of(rows, group=group, policy=policy, engine="articulated")
            line.append(str(climbed(of(each, **dict(zip(CELL, cell, strict=True))))))
        slow = of(rows, group="hard", policy="traction_runup", engine="rapier", **dict(zip(CELL, cell, strict=True)))
        line += [f"{climbed(slow)} of {len(slow)}" if len(slow) else "", "no" if cell in IMPOSSIBLE else "yes"]
        lines.append([*line, climb_limits(cell)])
    head = [
        "height [cm]",
        "mu",
        "torque limit",
        *HARD,
        "`traction_runup`, rapier",
        "seen possible",
        "run-up, by statics [m/s]",
    ]
    return table(head, lines, left=3)


def price(rows: pd.DataFrame) -> str:
    """Sums of the harder table, and what they cost."""
    lines = []
    every = [(name, "articulated", *value) for name, value in HARD.items()]
    for name, engine, group, policy in [*every, ("`traction_runup`, rapier", "rapier", "hard", "traction_runup")]:
        each = of(rows, group=group, policy=policy, engine=engine)
        for what, some in [("all climbs", ups(each)), ("first attempts", ups(each[each["retries"] == 0]))]:
            if what == "first attempts" and policy != "traction_runup":
                continue
            worst = f"{some['crossing_s'].max():.1f}" if len(some) else "-"
            count = counted(len(some), len(each))
            lines.append([name, what, count, *[mean(some, f, digits) for f, (_, digits) in MEANS.items()], worst])
    head = ["policy", "", "climbed [95 %]", *[name for name, _ in MEANS.values()], "longest [s]"]
    return table(head, lines, left=2)


def bouncing(rows: pd.DataFrame) -> str:
    """Contacts that bounce."""
    lines = []
    for group, what in [("bouncing", "the grid"), ("bouncing hard", "harder cells, seen possible")]:
        here = of(rows, group=group)
        for policy in dict.fromkeys(here["policy"]):
            each = of(here, policy=policy)
            means = [mean(ups(each), metric, digits) for metric, (_, digits) in MEANS.items()]
            lines.append([what, f"`{policy}`", counted(climbed(each), len(each)), *means])
    return table(["", "policy", "climbed [95 %]", *[name for name, _ in MEANS.values()]], lines, left=2)


def on_dampers(metrics: pd.DataFrame) -> str:
    """Section 3.3."""
    names = {
        "apart_rpm": 1, "apart_ever_rpm": 1, "fall_rpm": 2, "slowest_20_rpm": 1, "slowest_30_rpm": 1,
        "slowest_59_rpm": 1, "fastest_rpm": 1,
    }  # fmt: skip
    lines = [[f"`{row['policy']}`", *[f"{row[n]:.{d}f}" for n, d in names.items()]] for _, row in metrics.iterrows()]
    head = ["policy", "difference, settled", "difference, ever", "largest drop at a release"]
    return table([*head, "slowest at 20 s", "at 30 s", "at 59 s", "fastest ever"], lines)
