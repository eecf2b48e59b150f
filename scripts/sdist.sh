#!/usr/bin/env bash
# The source distribution holds all it needs: built and installed from the archive alone, with nothing but a Rust toolchain,
# and run outside the source tree. Takes as long as a first build. scripts/sdist.sh FOLDER puts it there then.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# = 0 ] || { mkdir -p "$1"; kept=$(cd "$1" && pwd); }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check "maturin>=1.10,<2"
"$folder/venv/bin/maturin" sdist --out "$folder" 2> /dev/null
archive=$(echo "$folder"/omnistep-*.tar.gz)
CARGO_TARGET_DIR="$folder/target" "$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check "$archive"
cd "$folder"
venv/bin/python -I -c 'import omnistep; print(omnistep.__version__, omnistep.run("step", progress=False).outcome)'
venv/bin/omnistep list > /dev/null
echo "$(basename "$archive"), $(du -h "$archive" | cut -f1): built, installed and run"
[ -z "${kept:-}" ] || cp "$archive" "$kept"
