#!/usr/bin/env bash
# Builds the simulation for WebAssembly (wasm32-unknown-unknown), runs the first seconds of every
# built-in scenario in node and natively, and compares poses and traces: bit-identical, or exit code 1. Where rustup has
# no such target the first run prepares a toolchain from Debian's packages. With --if-possible: skips, and says so,
# where node or the toolchain is missing. The native runs are those of the Python package in .venv, and the last poses
# are compared; with --whole they are those of the same program built natively, which takes some minutes more, and whole
# traces are compared too.
set -euo pipefail
cd "$(dirname "$0")/.."
unset CARGO_BUILD_TARGET # where the native program is looked for
possible=${1:-}
missing() { # what is missing
    [ "$possible" = --if-possible ] && { echo "skipped, $1 is missing: the simulation in WebAssembly"; exit 0; }
    echo "$1 is missing: the simulation in WebAssembly" >&2
    exit 1
}
command -v node >/dev/null || missing "node (apt install nodejs)"
export PROFILE=${PROFILE:-quick} # PROFILE=release: what a page loads, and how large that is
module=$(scripts/tools/wasm_module.sh ${possible:+"$possible"}) || { [ $? = 3 ] && missing "$module"; exit 1; }
output=${CARGO_TARGET_DIR:-target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
seconds=3 # the front wheels are on the step by then
node wasm/run.mjs "$module" $seconds >"$work/wasm" || { cat "$work/wasm" >&2; exit 1; }
if [ "$possible" = --whole ]; then
    cargo build --locked --quiet --profile "$PROFILE" --manifest-path wasm/Cargo.toml --target-dir "$output"
    "$output/$PROFILE/omnistep-wasm" $seconds >"$work/native"
    what="pose and trace"
else
    [ -x .venv/bin/python ] || scripts/tools/venv.sh
    .venv/bin/python wasm/poses.py $seconds >"$work/native"
    cut -d ' ' -f -9 "$work/wasm" >"$work/poses"
    mv "$work/poses" "$work/wasm"
    what="last pose"
fi
diff "$work/native" "$work/wasm" >&2 || { echo "WebAssembly (>) computes other bits than the native program (<)" >&2; exit 1; }
echo "$(wc -l <"$work/wasm") runs, $seconds s each: node and the native program agree bit for bit in every $what"
cut -d ' ' -f -9 "$work/wasm" | sed -n 's/^step [0-9]*/step ends at/p'
echo "$module: $(wc -c <"$module") bytes, $(gzip -9 <"$module" | wc -c) compressed"
