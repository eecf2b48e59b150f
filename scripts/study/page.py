"""Writes what docs/study.md holds between its markers, from the study's results."""

import re

import pandas as pd
import study_tables
from study_gates import Gate
from study_runs import ROOT

PAGE = ROOT / "docs" / "study.md"
BLOCK = re.compile(r"(<!-- study: (\w+) -->\n).*?(<!-- end of study -->)", re.DOTALL)


def blocks(rows: pd.DataFrame, dampers: pd.DataFrame, gates: list[Gate]) -> dict[str, str]:
    """Every table by the name of its marker."""
    engines = [("articulated", "ball"), ("rapier", "ball"), ("articulated", "rollers"), ("rapier", "rollers")]
    held = sum(gate.held is True for gate in gates)
    demanded = sum(gate.held is not None for gate in gates)
    failed = [f"- {gate.group}: {gate.name}. Demanded: {gate.demand}; measured {gate.measured}." for gate in gates
              if gate.held is False]  # fmt: skip
    return {
        "summary": "\n".join([f"{held} of {demanded} gates hold. These do not:", "", *failed])
        if failed
        else f"All {demanded} gates hold.",
        "gates": study_tables.gates(gates),
        "claims": study_tables.claims(rows),
        "dampers": study_tables.on_dampers(dampers),
        "grid": study_tables.grid(rows),
        "pairs": study_tables.pairs(rows),
        "cells": study_tables.cells(rows, "climbed", engines, ["independent", "steady"]),
        "impact": study_tables.impact(rows),
        "turned": study_tables.turned(rows),
        "perturbed": study_tables.perturbed(rows),
        "coarse": study_tables.coarse(rows),
        "losses": study_tables.losses(rows),
        "failures": study_tables.failures(rows),
        "grounds": study_tables.grounds(rows),
        "askew": study_tables.askew(rows),
        "situations": study_tables.situations(rows),
        "vehicles": study_tables.vehicles(rows),
        "safety": study_tables.safety(rows),
        "hard": study_tables.hard(rows),
        "price": study_tables.price(rows),
        "bouncing": study_tables.bouncing(rows),
    }


def filled(page: str, texts: dict[str, str]) -> str:
    """A page with each marked block replaced; every marker needs its block and every block its marker."""
    marked = [name for _, name, _ in BLOCK.findall(page)]
    if sorted(marked) != sorted(texts):
        raise ValueError(f"markers {sorted(set(marked) ^ set(texts))} are on the page or made, not both; or one twice")
    return BLOCK.sub(lambda found: f"{found[1]}{texts[found[2]]}\n{found[3]}", page)


def write(rows: pd.DataFrame, dampers: pd.DataFrame, gates: list[Gate]) -> None:
    """Write the page anew."""
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8"), blocks(rows, dampers, gates)), encoding="utf-8")
