"""Draws the pictures that the documents show, from runs: python scripts/docs/figures.py [NAME ...].

Without names it draws all. climb-map is of the study climb_map, which takes some minutes and leaves its results in
out/climb_map.
"""

import argparse
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes

import omnistep

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "images"
#: A wet patch, on which odometry is wrong: the run of docs/drive-a-path.md.
SQUARE = {
    "start.heading_rad": 0.3,
    "friction_patch": [{"x_m": [0.8, 1.2], "y_m": [0.0, 2.0], "friction": 0.1}],
}


def climb_map() -> Axes:
    """Draw the rates of the study climb_map."""
    results = ROOT / "out" / "climb_map"
    subprocess.run([sys.executable, "-m", "omnistep", "study", "climb_map", "--out", results], check=True)
    return omnistep.plot.climb_map(results)[0]


def motor_bench() -> Axes:
    """Draw the wheels of the paper's section 3.3."""
    return omnistep.plot.motor_bench(
        [omnistep.run_motor_bench(policy) for policy in ("scale_references", "scale_torques")]
    )[0]


def wheel_fight() -> Axes:
    """Draw the torques of three wheels during and after a climb, under two policies."""
    _, axes = plt.subplots(1, 2, figsize=(8.0, 3.2), sharey=True, layout="constrained")
    titles = {"independent": "one PID loop per wheel", "traction": "traction control"}
    for ax, (policy, title) in zip(axes, titles.items(), strict=True):
        trace = omnistep.run("step", policy=policy, overrides={"physics.engine": "articulated"}, progress=False)
        for wheel, colour in (("1", "#0072b2"), ("4", "#d55e00"), ("5", "#009e73")):
            ax.plot(trace["time_s"], trace[f"wheel_{wheel}_applied_n_m"], colour, label=f"wheel {wheel}", linewidth=1.2)
        end_s = trace.outcome.crossing_s + 1.3
        ax.set(title=title, xlabel="time [s]", xlim=(0.0, 6.0))
        ax.annotate("level ground,\nconstant speed", (end_s + 0.1, 1.6), fontsize=9)
        ax.axvline(end_s, color="0.6", linewidth=0.8, linestyle="--")
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("torque of the wheel [N.m]")
    axes[1].legend(loc="center right")
    return axes[0]


def climb_charts() -> Axes:
    """Draw charts: two that the tests of plans keep, and steps up of three more, which take two minutes."""
    kept = ROOT / "crates" / "omni-plan" / "tests" / "charts"
    chugo7, mecanum4 = (omnistep.ClimbChart.read(kept / f"{name}.toml") for name in ("chugo7", "mecanum4"))
    omni3, rocker_bogie6 = (
        omnistep.climb_chart(name, policy="traction", edges=["step"]) for name in ("omni3", "rocker_bogie6")
    )
    pid = omnistep.climb_chart("chugo7", policy="independent", edges=["step"])
    drawn = [
        (chugo7, "step"),
        (pid, "step"),
        (chugo7, "drop"),
        (mecanum4, "step"),
        (omni3, "step"),
        (rocker_bogie6, "step"),
    ]
    names = {"traction": "traction control", "independent": "plain PID"}
    _, axes = plt.subplots(3, 2, figsize=(7.8, 12.3), subplot_kw={"projection": "polar"}, layout="constrained")
    for ax, (chart, edge) in zip(axes.ravel(), drawn, strict=True):
        omnistep.plot.chart(chart, edge=edge, ax=ax).get_legend().remove()
        ax.set_title(ax.get_title().replace(":", f", {names[chart.policy]}:"), fontsize="large")
    most = max(ax.get_ylim()[1] for ax in axes[0])
    for ax in axes[0]:  # one vehicle under two policies: one scale
        ax.set_ylim(0.0, most)
        ax.set_yticks([20.0, 40.0])
    return axes[0, 0]


#: How each picture is drawn.
PICTURES: dict[str, Callable[[], Any]] = {
    "climb": lambda: omnistep.plot.side_view(omnistep.run("step"), every_s=0.6),
    "figure-8": motor_bench,
    "figure-9": lambda: omnistep.plot.side_views(
        [omnistep.run("step", policy=policy) for policy in ("scale_references", "independent")], every_s=0.6
    )[0],
    "figure-10": lambda: omnistep.plot.climb(omnistep.run("step", policy="scale_references"))[0],
    "figure-11": lambda: omnistep.plot.climb(omnistep.run("step", policy="independent"))[0],
    "climb-charts": climb_charts,
    "climb-map": climb_map,
    "two-policies": lambda: omnistep.plot.climbs(
        omnistep.compare("hard_step", policies=["independent", "traction"], overrides={"physics.engine": "articulated"})
    )[0, 0],
    "square-path": lambda: omnistep.plot.path(omnistep.run("square", overrides=SQUARE)),
    "wheel-fight": wheel_fight,
}


def main() -> None:
    """Write the pictures into docs/images."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(PICTURES))
    names = parser.parse_args().names or list(PICTURES)
    if unknown := [name for name in names if name not in PICTURES]:
        parser.error(f"{', '.join(unknown)}: not a picture; those are {', '.join(PICTURES)}")
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in names:
        PICTURES[name]().figure.savefig(FOLDER / f"{name}.png", dpi=90)


if __name__ == "__main__":
    main()
