#!/usr/bin/env bash
# Builds the wheel that is published into out/dist, installs it alone in an environment of its own, and
# runs a scenario outside the source tree. On Linux Zig links it, so that it runs on every distribution
# with glibc 2.17 or newer; auditwheel checks that. PYTHON chooses the interpreter; one wheel is for 3.11
# and all newer ones. scripts/release/wheel.sh TARGET builds for one of Rust's targets, and runs nothing.
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${1:-}
python=${PYTHON:-python3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
tools=$(scripts/release/build_tools.sh)
export MATURIN_PEP517_ARGS="--profile dist${target:+ --target $target}"
[ "$(uname)" != Linux ] || MATURIN_PEP517_ARGS+=" --zig --compatibility manylinux_2_17"
PATH=$tools:$PATH "$tools/python" -m pip --quiet --disable-pip-version-check \
    wheel --no-build-isolation --no-deps --wheel-dir "$work/dist" .
wheel=$(echo "$work"/dist/*.whl)
if [ "$(uname)" = Linux ]; then
    "$tools/auditwheel" show --json "$wheel" >"$work/audit"
    "$tools/python" - "$work/audit" <<'PYTHON'
import json, sys
with open(sys.argv[1]) as file:
    audit = json.load(file)
tag, libraries = audit["overall_tag"], audit["external_libs"]
print(f"auditwheel: {tag}, external libraries: {sorted(libraries) or 'none'}")
sys.exit(not tag.startswith("manylinux_2_17_") or bool(libraries))
PYTHON
fi
mkdir -p out/dist
cp "$wheel" out/dist
wheel=$PWD/out/dist/$(basename "$wheel")
[ -z "$target" ] || { echo "$(basename "$wheel"), $(du -h "$wheel" | cut -f1): built"; exit; }
"$python" -m venv "$work/alone"
bin=$work/alone/bin
[ -d "$bin" ] || bin=$work/alone/Scripts # Windows
"$bin/python" -m pip install --quiet --disable-pip-version-check "$wheel"
cd "$work"
"$bin/python" -I -c 'import omnistep; print(omnistep.__version__, omnistep.run("step", progress=False).outcome)'
"$bin/omnistep" list >/dev/null
echo "$(basename "$wheel"), $(du -h "$wheel" | cut -f1): built, installed and run"
