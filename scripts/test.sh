#!/usr/bin/env bash
# Every Rust and Python test, and the check that the documents name only what exists.
set -euo pipefail
cd "$(dirname "$0")/.."
unset CARGO_BUILD_TARGET # where the examples are looked for
cargo test --locked --release --config scripts/test_profile.toml
# A crate outside the workspace that has a controller of its own.
cargo test --locked --quiet --manifest-path examples/own-policy/Cargo.toml --target-dir "${CARGO_TARGET_DIR:-target}"
# Each example asserts the number that it is about.
for example in crates/omni-core/examples/*.rs crates/omni-sim/examples/*.rs; do
    name=$(basename "$example" .rs)
    "${CARGO_TARGET_DIR:-target}/release/examples/$name" >/dev/null || { echo "example $name failed" >&2; exit 1; }
done
scripts/tools/venv.sh
.venv/bin/python scripts/checks/documents.py --self-test
.venv/bin/python scripts/checks/documents.py
.venv/bin/python -m pytest --numprocesses auto --dist worksteal --durations 20
# FIRMWARE=separate: by `make firmware`, as in .ci/run, where what is missing is a failure.
[ "${FIRMWARE:-}" = separate ] || scripts/firmware.sh --if-possible
