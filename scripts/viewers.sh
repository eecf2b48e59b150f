#!/usr/bin/env bash
# Opens a log of every scenario with foreign readers (Python's mcap and rosbags, npm's @mcap/core), serves a live run to
# a client, shows reports in headless Chromium, drives a run on its page there and one in the playground, whose module's
# logs are compared with the native ones. With --if-possible: skips, and says so, what a missing tool asks for.
set -euo pipefail
cd "$(dirname "$0")/.."
possible=${1:-}
need() { # tool, what it is for
    command -v "$1" >/dev/null && return
    [ "$possible" = --if-possible ] && { echo "skipped, $1 is missing: $2"; exit 0; }
    echo "$1 is missing: $2" >&2
    exit 1
}
need node "npm's readers of logs"
need npm "npm's readers of logs"
scripts/web.sh --check # the player that the report carries is the one in web/player
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
scripts/tools/venv.sh
omnistep=.venv/bin/omnistep # with the live view
# Two seconds of every scenario are messages of every kind; the step is whole, for the report.
for scenario in $($omnistep list | sed -n 's/^scenarios: *//p' | tr -d ,); do
    $omnistep run "$scenario" --quiet --set duration_s=2 --set physics.engine=rapier --out "$work/logs" >/dev/null
done
$omnistep compare step --quiet --out "$work/step" >/dev/null
# The playground's usual engine.
for scenario in $($omnistep list | sed -n 's/^scenarios: *//p' | tr -d ,); do
    $omnistep run "$scenario" --quiet --set duration_s=1 --set physics.engine=articulated --out "$work/articulated" >/dev/null
done
topics="/cmd_vel /ground_truth/odom /joint_states /markers /odom /robot_description /sensors /terrain/robot_description /tf /vehicle_state"
for log in "$work"/logs/*.mcap; do
    # shellcheck disable=SC2086
    .venv/bin/python scripts/checks/log.py "$log" --require $topics >"$work/said" || { cat "$work/said" >&2; exit 1; }
done
echo "logs of $(ls "$work"/logs/*.mcap | wc -l) scenarios: read by mcap and rosbags"
npm --prefix tests/viewers ci --silent --no-audit --no-fund
LOGS=$work/logs node --test --test-reporter=spec tests/viewers/mcap.test.mjs
OMNISTEP=$PWD/$omnistep node --test --test-reporter=spec tests/viewers/live.test.mjs
# The playground: the same messages from its module, and below its page.
scripts/playground.sh ${possible:+"$possible"}
playground=$PWD/out/playground
[ ! -d "$playground" ] || MODULE=$playground/omnistep.wasm LOGS=$work/logs ARTICULATED=$work/articulated node --test --test-reporter=spec tests/viewers/wasm.test.mjs
chromium=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)}
if [ -z "$chromium" ]; then
    [ "$possible" = --if-possible ] && { echo "skipped, chromium is missing: the report, the page of a live run and the playground in a browser"; exit 0; }
    echo "chromium is missing: the report, the page of a live run and the playground in a browser" >&2
    exit 1
fi
CHROMIUM=$chromium node --test --test-reporter=spec tests/viewers/player.test.mjs
.venv/bin/omnistep report "$work"/step/*.mcap -o "$work/report.html" >/dev/null
$omnistep run flat --quiet --set duration_s=2 --set vehicle=omni3 --out "$work/omni3" >/dev/null
.venv/bin/omnistep report "$work"/logs/{bumps,height_map,step}-*.mcap "$work"/omni3/*.mcap -o "$work/mixed.html" >/dev/null
$omnistep run flat --quiet --set duration_s=2 --set vehicle=mecanum4 --out "$work/mecanum4" >/dev/null
.venv/bin/omnistep report "$work"/logs/flat-*.mcap "$work"/mecanum4/*.mcap -o "$work/vehicles.html" >/dev/null
# Two paths; of one of them two policies.
for size in 1.5 2; do $omnistep run figure_eight --quiet --set duration_s=2 --set "command.path_size_m=$size" --out "$work/path$size" >/dev/null; done
$omnistep run figure_eight --quiet --set duration_s=2 --policy independent --out "$work/path2" >/dev/null
.venv/bin/omnistep report "$work"/path1.5/*.mcap "$work"/path2/*.mcap -o "$work/paths.html" >/dev/null
REPORT=$work/report.html VEHICLES=$work/vehicles.html PATHS=$work/paths.html MIXED=$work/mixed.html CHROMIUM=$chromium PICTURES=${PICTURES:-} node --test --test-reporter=spec tests/viewers/report.test.mjs
OMNISTEP=$PWD/$omnistep CHROMIUM=$chromium PICTURES=${PICTURES:-} node --test --test-reporter=spec tests/viewers/drive.test.mjs
[ ! -d "$playground" ] || PLAYGROUND=$playground CHROMIUM=$chromium PICTURES=${PICTURES:-} node --test --test-reporter=spec tests/viewers/playground.test.mjs
