#!/usr/bin/env bash
# The source distribution holds all it needs: built and installed from the archive alone, with
# nothing but a Rust toolchain, and run outside the source tree. Takes as long as a first build.
# scripts/release/sdist.sh FOLDER puts it there then.
set -euo pipefail
cd "$(dirname "$0")/../.."
[ $# = 0 ] || { mkdir -p "$1"; kept=$(cd "$1" && pwd); }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
tools=$(scripts/release/build_tools.sh)
PATH=$tools:$PATH "$tools/python" -c 'import sys; sys.path.insert(0, "scripts/release"); import wheel_backend; wheel_backend.build_sdist(sys.argv[1])' \
    "$folder" > "$folder/said" 2>&1 || { cat "$folder/said" >&2; exit 1; }
archive=$(echo "$folder"/omnistep-*.tar.gz)
# Its lock file fits what is packed, and holds no version that the repository's does not.
tar -xzf "$archive" -C "$folder"
unpacked=${archive%.tar.gz}
cargo metadata --locked --format-version 1 --manifest-path "$unpacked/Cargo.toml" > /dev/null
pinned() { awk '/^name = / { name = $3 } /^version = / && name { print name, $3; name = "" }' "$1" | sort; }
other=$(comm -13 <(pinned Cargo.lock) <(pinned "$unpacked/Cargo.lock"))
[ -z "$other" ] || { printf 'not in Cargo.lock: %s\n' "$other" >&2; exit 1; }
"${PYTHON:-python3}" -m venv "$folder/venv"
CARGO_TARGET_DIR="$folder/target" "$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check "$archive"
cd "$folder"
venv/bin/python -I -c 'import omnistep; print(omnistep.__version__, omnistep.run("step", progress=False).outcome)'
venv/bin/omnistep list > /dev/null
echo "$(basename "$archive"), $(du -h "$archive" | cut -f1): built, installed and run"
[ -z "${kept:-}" ] || cp "$archive" "$kept"
