#!/usr/bin/env bash
# Builds the playground, a page without a server's help, into out/playground: the simulation for
# WebAssembly, and web/playground with the player (esbuild and three.js from npm). Its size is at
# most 2 MB compressed. With --if-possible: skips, and says so, where a tool is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
possible=${1:-}
missing() { # what is missing
    [ "$possible" = --if-possible ] && { echo "skipped, $1 is missing: the playground"; exit 0; }
    echo "$1 is missing: the playground" >&2
    exit 1
}
rm -rf out/playground
for tool in node npm; do command -v "$tool" >/dev/null || missing "$tool"; done
module=$(PROFILE=release scripts/tools/wasm_module.sh ${possible:+"$possible"}) || { [ $? = 3 ] && missing "$module"; exit 1; }
npm --prefix web ci --silent --no-audit --no-fund
node web/build-playground.mjs out/playground "$module"
