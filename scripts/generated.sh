#!/usr/bin/env bash
# Writes every committed file that is made from others: tables of docs/design.md, signals of wheels, docstrings, schemas
# of files, the C header, and the player where node is. `git diff` then shows what was old.
set -euo pipefail
cd "$(dirname "$0")/.."
python3 scripts/docs/design_tables.py
python3 scripts/docs/wheel_signals.py
python3 scripts/docs/docstrings.py
# The schemas are compiled in: the run that writes them fails if they were old, and the next one has them.
schemas() {
    OMNISTEP_WRITE_SCHEMAS=1 cargo test --locked --quiet --release --config scripts/test_profile.toml \
        -p omni-config --test schema
}
schemas || { echo "the schemas were old; once more with those that were written"; schemas; }
(cd firmware && unset CARGO_TARGET_DIR && OMNISTEP_WRITE_HEADER=1 cargo build --locked --quiet --release -p omni-c --lib \
    --target "$(rustc -vV | sed -n 's/^host: //p')")
scripts/web.sh --if-possible
