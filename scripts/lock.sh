#!/usr/bin/env bash
# Writes python/requirements-*.txt anew: the newest tools within the ranges of pyproject.toml, with hashes, for Python 3.11 on
# Linux (x86-64, glibc 2.35 or newer), which is what scripts/venv.sh uses them on.
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check "uv>=0.9,<1"
# What builds the wheel is pinned as well.
"$work/venv/bin/python" - >"$work/build.in" <<'PYTHON'
import tomllib
with open("pyproject.toml", "rb") as file:
    print(*tomllib.load(file)["build-system"]["requires"], sep="\n")
PYTHON
for extra in test docs; do
    rm -f "python/requirements-$extra.txt" # else what is there is kept
    "$work/venv/bin/uv" pip compile --quiet pyproject.toml "$work/build.in" --extra "$extra" --generate-hashes \
        --python-version 3.11 --python-platform x86_64-manylinux_2_36 --no-header --no-annotate \
        --output-file "python/requirements-$extra.txt"
    echo "python/requirements-$extra.txt: $(grep -c '^[a-z]' "python/requirements-$extra.txt") packages"
done
