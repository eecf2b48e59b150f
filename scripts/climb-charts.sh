#!/usr/bin/env bash
# The climb chart of every built-in vehicle, its check from fresh starts and with both engines; some
# twenty minutes.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/tools/venv.sh
.venv/bin/python scripts/measure/climb_charts.py "$@"
