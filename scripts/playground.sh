#!/usr/bin/env bash
# Builds the playground, a page without a server's help, into out/playground: the simulation for
# WebAssembly, and web/playground with the player (esbuild and three.js from npm). Its size is at
# most 2 MB compressed. With --if-possible: skips, and says so, where a tool is missing. With wasm-opt
# (Debian's binaryen) the module is 2 % smaller, and its runs are bit-identical.
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
if command -v wasm-opt >/dev/null; then
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    # What the compiler uses; the module itself does not say it.
    features=(bulk-memory sign-ext nontrapping-float-to-int mutable-globals reference-types multivalue)
    wasm-opt -O2 "${features[@]/#/--enable-}" "$module" -o "$work/omnistep.wasm"
    module=$work/omnistep.wasm
else
    echo "wasm-opt is missing (apt install binaryen): the playground is 2 % larger"
fi
npm --prefix web ci --silent --no-audit --no-fund
node web/build-playground.mjs out/playground "$module"
