#!/usr/bin/env bash
# Attacks: mutants of every kind of file under 2 GB and 10 s, bombs, random bits, lies, live clients, loss, leaks, and
# runs with wrong sensors and parts that fail. Quick, or with --long ten to twenty times as many from another seed and
# then the fuzzer, FUZZ seconds (300) a target. Uses what `make test` builds; see scripts/attack/__main__.py.
set -euo pipefail
cd "$(dirname "$0")/.."
[ -x .venv/bin/python ] || scripts/tools/venv.sh
if [ "${1:-}" = --long ]; then
    shift
    seed=${SEED:-$(date +%s)}
    echo "seed $seed"
    .venv/bin/python scripts/attack --long --seed "$seed" "$@"
    for target in toml height_map log link drive trace; do
        scripts/attack/fuzz.sh "$target" "${FUZZ:-300}"
    done
else
    .venv/bin/python scripts/attack "$@"
fi
