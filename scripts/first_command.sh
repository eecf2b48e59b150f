#!/usr/bin/env bash
# What the first command costs from nothing: builds `omnistep` without optional features into an empty target
# folder and runs `compare step`. Prints seconds on the clock, CPU seconds, crates, and how much more CPU time
# everything took than compiling rapier3d, parry3d and nalgebra did in the same build. The same build took 364
# to 808 CPU seconds on two slow cores, as neighbours shared them, so no time fails: exit code 1 beyond CRATES,
# 160, or beyond the ratio SHARE, which a machine hardly changes (5.6: two builds took 5.14 and 4.96). The
# argument names the folder; target/first if left out.
set -euo pipefail
cd "$(dirname "$0")/.."
share=${SHARE:-5.6} most=${CRATES:-160}
export LC_ALL=C CARGO_TERM_COLOR=never CARGO_TERM_QUIET=false # what is read below
export CARGO_TARGET_DIR=${1:-target/first}
[ -e "$CARGO_TARGET_DIR/release" ] && [ $# -gt 0 ] && { echo "$CARGO_TARGET_DIR/release is there already: nothing would be measured" >&2; exit 1; }
rm -rf "$CARGO_TARGET_DIR/release"
cargo fetch --locked --quiet # the network is not measured
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export RUSTC_WRAPPER=$PWD/scripts/measure/rustc_seconds.py COMPILED=$work/compiled
TIMEFORMAT='%R %U %S'
{ time cargo run --locked --release -- compare step --out "$work/out" >"$work/said" 2>"$work/build"; } 2>"$work/time" ||
    { tail -n 30 "$work/build" >&2; exit 1; }
if grep -q '^warning' "$work/build"; then
    echo "the build without optional features warns:" >&2
    grep -A 5 '^warning' "$work/build" >&2
    exit 1
fi
cat "$work/said"
# What is not built in says how to get it.
for words in "study ensemble" "climb-limits step" "run step --live"; do
    # shellcheck disable=SC2086 # words
    if refused=$("$CARGO_TARGET_DIR/release/omnistep" $words 2>&1) || [ $? != 2 ]; then echo "omnistep $words: not refused" >&2; exit 1; fi
    grep -q 'features full' <<<"$refused" || { echo "omnistep $words: $refused" >&2; exit 1; }
done
read -r clock user system <"$work/time"
awk -v clock="$clock" -v user="$user" -v kernel="$system" -v crates="$(grep -c '^ *Compiling' "$work/build")" -v most="$most" \
    -v share="$share" '
    /^(rapier3d_f64|parry3d_f64|nalgebra) / { engine += $2 }
    END {
        cpu = user + kernel
        ratio = cpu / engine
        printf "the first command from nothing: %.0f s on the clock, %.0f CPU seconds, %d crates (at most %d), %.2f times rapier3d, parry3d and nalgebra (at most %s)\n",
            clock, cpu, crates, most, ratio, share
        exit crates > most || ratio > share
    }' "$COMPILED"
