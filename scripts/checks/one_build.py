#!/usr/bin/env python3
"""Says what the command, the Python package and the tests do not share of their release builds.

All are built in CI, and a library with one more feature in one of them is compiled twice, with all that stands on it.
Cargo.toml of the workspace names the features that keep them alike; this fails where others have come.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# These differ: the package has the optional features, and tests generate the schemas.
OWN = {"omni_config", "omni_log", "omnistep"}
ALONE = {"quick_xml"}  # quick to compile, and nearly nothing stands on them
TESTS = ("--no-run", "--config", "scripts/test_profile.toml")


def units(verb: str, *what: str) -> dict[tuple[str, ...], set[tuple[str, ...]]]:
    """What is compiled: package, target and mode, each with its sets of features."""
    # The list of units is a flag that stable cargo hides; it compiles nothing.
    command = ["cargo", verb, "--release", "--locked", "-Zunstable-options", "--unit-graph", *what]
    environment = {**os.environ, "RUSTC_BOOTSTRAP": "1"}
    said = subprocess.run(command, cwd=ROOT, env=environment, check=True, stdout=subprocess.PIPE, text=True).stdout
    found: dict[tuple[str, ...], set[tuple[str, ...]]] = {}
    for unit in json.loads(said)["units"]:
        key = (unit["pkg_id"], unit["target"]["name"], unit["mode"], unit["profile"]["opt_level"])
        found.setdefault(key, set()).add(tuple(sorted(unit["features"])))
    return found


def main() -> int:
    """Print a line for each unit that differs; exit code 1 if there is any."""
    package = units("build", "-p", "omni-py")
    differ = 0
    for others in (units("build", "--bin", "omnistep"), units("test", *TESTS)):
        for key, features in sorted(others.items()):
            if key[1] in OWN | ALONE or not (more := package.get(key, set())) or features <= more:
                continue
            differ += 1
            only = [sorted(set(ours) ^ set(theirs)) for ours in features for theirs in more]
            print(f"{key[0].rpartition('/')[2]}: features of one of the two alone: {only}", file=sys.stderr)
    if differ:
        print(f"{differ} parts are compiled twice: name the features in Cargo.toml, [dependencies]", file=sys.stderr)
    return min(differ, 1)


if __name__ == "__main__":
    raise SystemExit(main())
