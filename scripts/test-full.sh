#!/usr/bin/env bash
# The tests, then what takes longer: release files for Linux, wheels of rollers, faults of the drive, intervals
# of identify, videos, ten minutes on ROS 2, ensembles around the torque threshold and the benchmarks.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/test.sh
scripts/coverage.sh # 99 % of omni-core's lines, at least 95 wanted: what guards a fault is in the tests themselves
scripts/release/sdist.sh
scripts/package.sh --verify
scripts/semver.sh
scripts/wasm.sh --whole
scripts/aarch64.sh --if-possible
scripts/dist.sh
ROS2_SOAK_S=600 scripts/ros2.sh # ten minutes of readers that come and go
cargo test --release --test physics -- --ignored
cargo run --locked --quiet --release --example gear_friction_energy 50 # 230 runs: energy closes
python3 scripts/measure/drive_campaign.py --check # 300 runs with random faults, and their table in docs/drive.md
.venv/bin/python scripts/mujoco/gate.py --map # the simulation and MuJoCo side by side: docs/mujoco.md
# 2800 identifications: intervals hold the truth in 90 to 99 % (or one log of 200 more) for each
# number of counts and noise, as in docs/own-robot.md.
OPENBLAS_NUM_THREADS=1 .venv/bin/python scripts/measure/identify_coverage.py --check
# 200 seeds of each of these intervals, of which `make test` takes 40.
COVERAGE_SEEDS=200 .venv/bin/python -m pytest python/tests/test_identify.py python/tests/test_calibrate.py -k cover_the_truth
# 600 logs of plants that share nothing with the simulator: at least 90 %.
OPENBLAS_NUM_THREADS=1 .venv/bin/python scripts/measure/plant_coverage.py
# Videos by Rerun, and its check of logs; on a machine without a graphics card they need Debian's mesa-vulkan-drivers.
.venv/bin/python -m pip install --quiet --disable-pip-version-check "$(echo out/wheel/*.whl)[view]"
.venv/bin/python -m pytest python/tests/test_video.py
# A sweep on a cluster of two processes, one of which is killed.
.venv/bin/python -m pip install --quiet --disable-pip-version-check "$(echo out/wheel/*.whl)[dask]"
.venv/bin/python -m pytest python/tests/test_sweep_dask.py
results=$(mktemp -d) # a new folder: results that are there are not computed again
trap 'rm -rf "$results"' EXIT
for torque in 1.0 1.4 1.8 2.0; do
    echo "torque limit $torque N.m"
    cargo run --release --quiet --features full -- study ensemble --set "vehicle.motor.stall_torque_n_m=$torque" --out "$results/$torque"
done
scripts/bench.sh
