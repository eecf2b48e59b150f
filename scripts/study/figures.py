"""Pictures of docs/study.md, each from the study's rows."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import omnistep
from study.gates import CELL, NAMES, PARTS, of, paired
from study.runs import IMPOSSIBLE, POLICIES, ROOT, hard_cells
from study.safety import VEHICLES
from study.tables import HARD, PLACES

FOLDER = ROOT / "docs" / "images"
#: Of every picture [inch]: at the page's 700 pixels its letters are as large as the text's.
WIDTH = 7.8
DPI = 130
UNITS = {"torque_squared_n2m2s": " [N$^2$m$^2$s]"}
#: Of the axes with a logarithmic scale.
TICKS = (0.03, 0.05, 0.1, 0.2, 0.4, 2, 4, 6, 8, 10, 15, 20)
MARKS = dict(zip(PLACES, "os^v", strict=True))


def grid(rows: pd.DataFrame) -> plt.Figure:
    """One point per pair of runs: traction over independent, with the largest mean ratio that the gate allows."""
    figure, axes = plt.subplots(1, len(PARTS), figsize=(WIDTH, 3.5), layout="constrained")
    for ax, (name, part) in zip(axes, PARTS.items(), strict=True):
        ends = (np.inf, 0.0)
        for (engine, wheels), place in PLACES.items():
            pairs = paired(of(rows, group="grid", engine=engine, wheels=wheels), "traction", "independent")
            if pairs.empty:
                continue
            x, y = pairs[f"{name}_y"].astype(float), pairs[f"{name}_x"].astype(float)
            ends = min(ends[0], x.min(), y.min()), max(ends[1], x.max(), y.max())
            ax.plot(x, y, MARKS[engine, wheels], ms=4, alpha=0.6, mew=0, label=f"{place} ({len(pairs)} pairs)")
        ends = np.array([ends[0] / 1.1, 1.1 * ends[1]])
        ax.plot(ends, ends, color="0.6", lw=1, label="equal")
        ax.plot(ends, part * ends, "k--", lw=1, label="gate, for the means")
        ax.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
        ax.set_title(f"{NAMES[name]}\n(gate: {part:g} times)", fontsize="medium")
        ax.xaxis.set_minor_formatter(plt.NullFormatter())
        ax.yaxis.set_minor_formatter(plt.NullFormatter())
        ticks = [tick for tick in TICKS if ends[0] < tick < ends[1]]
        ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        ax.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        ax.set_xlabel(f"independent{UNITS.get(name, '')}")
        ax.set_ylabel(f"traction{UNITS.get(name, '')}")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize="small")
    return figure


def impact(rows: pd.DataFrame) -> plt.Figure:
    """What decides at wheel 4, by torque limit and policy, where friction is not what is short."""
    here = of(rows, group="grid", engine="articulated", wheels="ball")
    here = here[here["policy"].isin(POLICIES) & (here["friction"] > 0.6)]
    figure, axes = plt.subplots(3, 1, figsize=(WIDTH, 8.2), layout="constrained", sharex=True)
    metrics = ["climbed", "impact_m_s", "impact_thrust"]
    records = here[["policy", "torque_n_m", *metrics]].astype(object).where(lambda each: each.notna(), None)
    omnistep.plot.ensemble(records.to_dict("records"), metrics, x="torque_n_m", lines="policy", axes=axes)
    axes[-1].set_xlabel("torque limit [N.m]")
    labels = ["share that climbed", "vehicle speed when\nwheel 4 meets the edge [m/s]"]
    labels.append("commanded torque / torque limit,\nmean of the 0.3 s after that")
    for ax, label in zip(axes, labels, strict=True):
        ax.set_ylabel(label)
    return figure


def runup(rows: pd.DataFrame) -> plt.Figure:
    """Runs that climbed a cell, one panel per policy; a cross if no law is known to climb the cell."""
    cells = hard_cells()
    levels = sorted({cell[:2] for cell in cells})
    torques = sorted({cell[2] for cell in cells})
    figure, places = plt.subplots(-(-len(HARD) // 4), 4, figsize=(WIDTH, 8.0), layout="constrained")
    axes, *rest = np.split(places.ravel(), [len(HARD)])
    for number, (ax, (title, (group, policy))) in enumerate(zip(axes, HARD.items(), strict=True)):
        here = of(rows, group=group, policy=policy, engine="articulated")
        counts = here.groupby(CELL)["climbed"].agg(lambda each: float(each.astype(bool).mean()))
        shares = np.full((len(levels), len(torques)), np.nan)
        for cell in cells:
            shares[levels.index(cell[:2]), torques.index(cell[2])] = counts.get(cell, np.nan)
        image = ax.imshow(shares, vmin=0, vmax=1, origin="lower", aspect="auto", cmap="viridis")
        for height, mu, torque in sorted(IMPOSSIBLE):
            place = torques.index(torque), levels.index((height, mu))
            (cross,) = ax.plot(*place, "x", color="0.75")
        ax.set_xticks(range(len(torques)), [f"{torque:g}" for torque in torques], fontsize="x-small", rotation=90)
        ax.set_xlabel("torque limit [N.m]")
        ax.set_yticks(range(len(levels)), [])
        if number % 4 == 0:
            ax.set_yticklabels([f"{100 * height:g} cm, {mu:g}" for height, mu in levels])
            ax.set_ylabel("height of the step, friction")
        first, *more = title.replace("`", "").replace(" without", ", without").split(", ")
        ax.set_title("\n".join([first, *more]), fontsize="medium")
    # What no panel is in: the meaning of cross and colours.
    (free,) = rest[0]
    free.axis("off")
    legend = free.legend([cross], ["no law is known\nto climb this cell"], loc="upper left", fontsize="small")
    legend.get_frame().set_facecolor("0.3")
    for text in legend.get_texts():
        text.set_color("1")
    bar = free.inset_axes((0.1, 0.05, 0.12, 0.6))
    figure.colorbar(image, cax=bar, label="share of the runs that climbed")
    return figure


def on_dampers(speeds: pd.DataFrame) -> plt.Figure:
    """Section 3.3: every wheel's speed over time, one panel per policy."""
    policies = [policy for policy in dict.fromkeys(speeds["policy"]) if policy != "traction_runup"]
    figure, axes = plt.subplots(2, 2, figsize=(WIDTH, 5.4), layout="constrained", sharex=True, sharey=True)
    names = {"wheel_1": "A (wheel 1)", "wheel_4": "B (wheel 4)", "wheel_5": "C (wheel 5)"}
    names |= {"wheel_3": "no load (wheels 3, 7)", "wheel_7": None}
    for ax, policy in zip(axes.ravel(), policies, strict=True):
        here = of(speeds, policy=policy)
        for number, (wheel, label) in enumerate(names.items()):
            style = {"color": "0.6", "lw": 2.5, "zorder": 1} if number > 2 else {"lw": 1.2, "zorder": 2}
            ax.plot(here["time_s"], here[wheel], label=label, **style)
        ax.set_title(policy, fontsize="medium")
        ax.grid(alpha=0.3)
    axes[0, 0].set_ylim(-5, 125)
    for ax in axes[:, 0]:
        ax.set_ylabel("wheel speed [rpm]")
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize="small")
    return figure


def safety(rows: pd.DataFrame) -> plt.Figure:
    """One point per draw: how far traction control and plain loops went, 1 is the limit."""
    here, keys = of(rows, group="safety"), ["seed", "vehicle"]
    plain = here["policy"] == "independent"
    pairs = here[~plain].merge(here[plain], on=keys)
    laws = {"too fast": "speed", "back": "way back", "rim": "rims"}
    figure, axes = plt.subplots(1, len(laws), figsize=(WIDTH, 3.5), layout="constrained")
    for ax, (law, title) in zip(axes, laws.items(), strict=True):
        for vehicle in VEHICLES:
            each = of(pairs, vehicle=vehicle)
            x, y = (each[f"{law}_{end}"].astype(float).clip(lower=0.01) for end in "yx")
            ax.plot(x, y, "o", ms=3, alpha=0.5, mew=0, label=vehicle)
        ax.axhline(1, color="0.6", lw=1)
        ax.axvline(1, color="0.6", lw=1)
        ax.set(xscale="log", yscale="log", title=f"{title} / its limit", xlabel="independent")
    axes[0].set_ylabel("traction control")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, markerscale=2, fontsize="small")
    return figure


def draw(rows: pd.DataFrame, speeds: pd.DataFrame) -> None:
    """Write every picture."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    pictures = {"grid": grid(rows), "impact": impact(rows), "runup": runup(rows), "dampers": on_dampers(speeds)}
    pictures["safety"] = safety(rows)
    for name, figure in pictures.items():
        figure.savefig(FOLDER / f"study-{name}.png", dpi=DPI)
        plt.close(figure)
