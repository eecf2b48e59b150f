#!/usr/bin/env bash
# Every Rust and Python test, and the checks that the documents name only what exists and that public items have examples.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo test --locked
scripts/venv.sh
.venv/bin/python scripts/check_docs.py --self-test
.venv/bin/python scripts/check_docs.py
.venv/bin/python scripts/check_examples.py --self-test
.venv/bin/python scripts/check_examples.py
.venv/bin/python -m pytest
# FIRMWARE=required: what is missing is a failure, as in .ci/run.
if [ "${FIRMWARE:-}" = required ]; then scripts/firmware.sh; else scripts/firmware.sh --if-possible; fi
