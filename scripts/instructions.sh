#!/usr/bin/env bash
# Processor instructions of one whole control step next to as many loops of the `pid` crate as there are wheels,
# counted by valgrind: the same on a busy machine as on an idle one. Exit code 1 if a ratio is above INSTRUCTIONS_MAX
# (3.1: of three and four wheels at their limits it was 3.0 before every step looked whether torque is to end at rest,
# which that crate does not). Then those of a physics step, by scripts/measure/physics_instructions.sh.
set -euo pipefail
cd "$(dirname "$0")/.."
command -v valgrind >/dev/null || { echo "valgrind is needed; on Debian or Ubuntu: apt install valgrind" >&2; exit 1; }
cargo build --locked --quiet --release -p omnistep-core --example instructions
export PROGRAM=${CARGO_TARGET_DIR:-target}/release/examples/instructions
few=10000 many=20000

# Arguments of the program: prints them and the instructions executed.
count() {
    local log
    log=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null "$PROGRAM" "$@" 2>&1) || { echo "$log" >&2; return 1; }
    echo "$* $(sed -n 's/.*Collected *: *\([0-9]*\)$/\1/p' <<<"$log")"
}
export -f count

counts=$(
    for wheels in 3 4 7; do for scalar in f32 f64; do for case in free saturated; do for side in omni pid; do
        echo "$side $wheels $scalar $case $few"
        echo "$side $wheels $scalar $case $many"
    done; done; done; done | xargs -P "$(nproc)" -I{} bash -c 'count {}'
)
# Twice as many steps, so the difference is the steps' own: start and end of the program cancel.
awk -v few="$few" -v many="$many" -v limit="${INSTRUCTIONS_MAX:-3.1}" '
    NF == 6 { count[$1, $2, $3, $4, $5] = $6 }
    function step(side, n, scalar, kind) {
        if (!((side, n, scalar, kind, few) in count && (side, n, scalar, kind, many) in count)) { missing = 1; return 1 }
        return (count[side, n, scalar, kind, many] - count[side, n, scalar, kind, few]) / (many - few)
    }
    END {
        print "instructions per step; ratio allowed: " limit
        printf "%6s %6s %-9s %7s %7s %6s\n", "wheels", "scalar", "case", "omni", "pid", "ratio"
        split("3 4 7", wheels); split("f32 f64", scalars); split("free saturated", kinds)
        for (w = 1; w <= 3; w++) for (s = 1; s <= 2; s++) for (k = 1; k <= 2; k++) {
            omni = step("omni", wheels[w], scalars[s], kinds[k]); pid = step("pid", wheels[w], scalars[s], kinds[k])
            ratio = omni / pid
            over += (ratio > limit)
            printf "%6d %6s %-9s %7.0f %7.0f %6.2f%s\n", wheels[w], scalars[s], kinds[k], omni, pid, ratio, (ratio > limit ? "  too much" : "")
        }
        if (missing) print "a count is missing"
        exit (over > 0 || missing)
    }' <<<"$counts"
scripts/measure/physics_instructions.sh
