#!/usr/bin/env bash
# Ratios within one run: of the controller and the simulation, then of Python.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo bench --locked
scripts/tools/venv.sh
.venv/bin/python benches/python.py
.venv/bin/python benches/learn.py
.venv/bin/python benches/rollers.py
