#!/usr/bin/env bash
# The tests, then what takes longer: ensembles around the torque threshold and the benchmarks.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/test.sh
for torque in 1.0 1.4 1.8 2.0; do
    echo "torque limit $torque N.m"
    cargo run --release --quiet --example ensemble -- 24 "vehicle.motor.stall_torque_n_m=$torque"
done
cargo bench
