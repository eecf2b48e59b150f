#!/usr/bin/env bash
# The study of traction control: its runs, its gates, docs/study.md and its pictures; some forty minutes on two cores.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/venv.sh
PYTHONWARNINGS=ignore::UserWarning .venv/bin/python scripts/study.py "$@"
