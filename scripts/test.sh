#!/usr/bin/env bash
# Every Rust and Python test, and the check that the documents name only what exists.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo test --locked
scripts/venv.sh
.venv/bin/python scripts/check_docs.py --self-test
.venv/bin/python scripts/check_docs.py
.venv/bin/python -m pytest
