"""Writes what docs/study.md and docs/study-gates.md hold between their markers, from the study's results."""

import re

import pandas as pd

import study.tables
from study.gates import Gate
from study.runs import ROOT

PAGE = ROOT / "docs" / "study.md"
GATES_PAGE = ROOT / "docs" / "study-gates.md"
#: The blocks of the page of gates; all others are on the study's page.
ON_GATES_PAGE = ("summary", "gates")
BLOCK = re.compile(r"(<!-- study: (\w+) -->\n).*?(<!-- end of study -->)", re.DOTALL)


def blocks(rows: pd.DataFrame, dampers: pd.DataFrame, gates: list[Gate]) -> dict[str, str]:
    """Every table by the name of its marker."""
    engines = [("articulated", "ball"), ("rapier", "ball"), ("articulated", "rollers"), ("rapier", "rollers")]
    held = sum(gate.held is True for gate in gates)
    demanded = sum(gate.held is not None for gate in gates)
    failed = [f"- {gate.group}: {gate.name}. Demanded: {gate.demand}; measured {gate.measured}." for gate in gates
              if gate.held is False]  # fmt: skip
    return {
        "answers": f"{study.tables.answers(rows)}\n\nRequirements on traction control were fixed before the runs:"
        f" {held} of {demanded} hold. [Gates of the study](study-gates.md) lists each of them.",
        "summary": "\n".join([f"{held} of {demanded} gates hold. These do not:", "", *failed])
        if failed
        else f"All {demanded} gates hold.",
        "gates": study.tables.gates(gates),
        "claims": study.tables.claims(rows),
        "dampers": study.tables.on_dampers(dampers),
        "grid": study.tables.grid(rows),
        "pairs": study.tables.pairs(rows),
        "cells": study.tables.cells(rows, "climbed", engines, ["independent", "traction"]),
        "impact": study.tables.impact(rows),
        "turned": study.tables.turned(rows),
        "perturbed": study.tables.perturbed(rows),
        "coarse": study.tables.coarse(rows),
        "losses": study.tables.losses(rows),
        "failures": study.tables.failures(rows),
        "grounds": study.tables.grounds(rows),
        "askew": study.tables.askew(rows),
        "situations": study.tables.situations(rows),
        "vehicles": study.tables.vehicles(rows),
        "safety": study.tables.safety(rows),
        "safety_causes": study.tables.safety_causes(rows),
        "hard": study.tables.hard(rows),
        "price": study.tables.price(rows),
        "bouncing": study.tables.bouncing(rows),
    }


def filled(page: str, texts: dict[str, str]) -> str:
    """A page with each marked block replaced; every marker needs its block and every block its marker."""
    marked = [name for _, name, _ in BLOCK.findall(page)]
    if sorted(marked) != sorted(texts):
        raise ValueError(f"markers {sorted(set(marked) ^ set(texts))} are on the page or made, not both; or one twice")
    return BLOCK.sub(lambda found: f"{found[1]}{texts[found[2]]}\n{found[3]}", page)


def write(rows: pd.DataFrame, dampers: pd.DataFrame, gates: list[Gate]) -> None:
    """Write both pages anew."""
    texts = blocks(rows, dampers, gates)
    on_gates_page = {name: texts.pop(name) for name in ON_GATES_PAGE}
    for page, its in ((PAGE, texts), (GATES_PAGE, on_gates_page)):
        page.write_text(filled(page.read_text(encoding="utf-8"), its), encoding="utf-8")
