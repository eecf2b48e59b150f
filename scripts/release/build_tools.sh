#!/usr/bin/env bash
# Prints the folder of the tools that build the release files (python/requirements-build.txt, by
# hash). Installs them into out/tools/build if they are missing. The folder is always the same,
# because Cargo compiles anew if the interpreter's path changes.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=$PWD/out/tools/build
bin() { for bin in "$folder/bin" "$folder/Scripts"; do [ ! -d "$bin" ] || break; done; } # Windows has Scripts
bin
if ! "$bin/python" -c "" 2>/dev/null || ! cmp --silent python/requirements-build.txt "$folder/installed.txt"; then
    rm -rf "$folder"
    "${PYTHON:-python3}" -m venv "$folder"
    bin
    "$bin/python" -m pip install --quiet --disable-pip-version-check --require-hashes --requirement python/requirements-build.txt
    cp python/requirements-build.txt "$folder/installed.txt"
fi
echo "$bin"
