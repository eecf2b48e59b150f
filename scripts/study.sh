#!/usr/bin/env bash
# The study of traction control: its runs, its gates, docs/study.md and its pictures; some forty minutes on two cores.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/tools/venv.sh
PYTHONPATH=scripts PYTHONWARNINGS=ignore::UserWarning .venv/bin/python -m study "$@"
