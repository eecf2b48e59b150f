#!/usr/bin/env bash
# Processor instructions of one physics step of the articulated engine on its way over the built-in step, counted
# by valgrind: the same on a busy machine as on an idle one. Twice as many steps in the same simulated time cost
# twice the physics and nothing else more, so the difference is the steps' own. Exit code 1 above the budgets.
set -euo pipefail
cd "$(dirname "$0")/../.."
command -v valgrind >/dev/null || { echo "valgrind is needed; on Debian or Ubuntu: apt install valgrind" >&2; exit 1; }
unset CARGO_BUILD_TARGET # where the program is looked for
cargo build --locked --quiet --release --bin omnistep
program=${CARGO_TARGET_DIR:-target}/release/omnistep
seconds=3 # the front wheels are on the step by then
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
count() { # engine, wheel model, step [us]
    local log
    log=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" run step --quiet --out "$work/$1-$2-$3" \
        --set "duration_s=$seconds" --set "physics.engine=$1" --set "physics.wheel_model=$2" --set "physics.timestep_s=${3}e-6" 2>&1) ||
        { echo "$log" >&2; return 1; }
    sed -n 's/.*Collected *: *\([0-9]*\)$/\1/p' <<<"$log"
}
failed=0
printf '%-12s %-8s %12s %10s\n' engine wheels instructions budget
while read -r engine wheels budget; do
    few=$(count "$engine" "$wheels" 500)
    many=$(count "$engine" "$wheels" 250)
    own=$(((many - few) / (seconds * 2000)))
    printf '%-12s %-8s %12d %10s\n' "$engine" "$wheels" "$own" "$budget"
    [ "$budget" = - ] || [ "$own" -le "$budget" ] || failed=1
done <<'END'
articulated ball 23000
articulated rollers 39000
rapier ball -
END
exit $failed
