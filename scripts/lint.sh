#!/usr/bin/env bash
# Formatting and lints, warnings as errors; docs/design.md lists the files as they are; public items
# that teach have examples.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo fmt --all --check
cargo fmt --manifest-path firmware/Cargo.toml --all --check
cargo fmt --manifest-path wasm/Cargo.toml --check
cargo fmt --manifest-path fuzz/Cargo.toml --check
cargo fmt --manifest-path examples/own-policy/Cargo.toml --check
# In release: macros and build scripts are those of the command and the wheel.
cargo clippy --locked --release --workspace --all-targets -- -D warnings
python3 scripts/checks/one_build.py
python3 scripts/docs/design_tables.py --check
python3 scripts/docs/wheel_signals.py --check
python3 scripts/checks/addresses.py --self-test
python3 scripts/checks/addresses.py
scripts/tools/venv.sh
.venv/bin/python scripts/checks/comment_width.py --self-test
.venv/bin/python scripts/checks/comment_width.py
.venv/bin/python scripts/checks/english.py --self-test
.venv/bin/python scripts/checks/english.py
.venv/bin/python scripts/checks/circles.py --self-test
.venv/bin/python scripts/checks/circles.py
.venv/bin/python scripts/checks/examples.py --self-test
.venv/bin/python scripts/checks/examples.py
.venv/bin/ruff check python scripts benches tests
.venv/bin/ruff format --check python scripts benches tests
.venv/bin/mypy
