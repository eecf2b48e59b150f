#!/usr/bin/env bash
# Everything about firmware: builds the images and the C library, runs them in QEMU, checks bits and budgets, closes
# the loop through the emulated processor. `--if-possible`: where a tool is missing, one line that says which, and
# success; else a missing tool is a failure. Never touches rustup's targets: where they are missing and apt-get is
# there, a toolchain is prepared from Debian's packages (`--if-possible` only uses one that is there already).
# OMNISTEP_COMMAND: an `omnistep` that is built already; unset: it is built.
set -euo pipefail
cd "$(dirname "$0")/.."
# What is measured is what lies in firmware/target, built as firmware/.cargo/config.toml says, for
# the built-in scenario.
unset CARGO_TARGET_DIR CARGO_BUILD_TARGET RUSTFLAGS OMNISTEP_SCENARIO
if_possible=${1:-}
missing=()
command -v qemu-system-arm >/dev/null || missing+=("qemu-system-arm (apt install qemu-system-arm)")
command -v qemu-system-riscv32 >/dev/null || missing+=("qemu-system-riscv32 (apt install qemu-system-misc)")
command -v arm-none-eabi-gcc >/dev/null || missing+=("arm-none-eabi-gcc (apt install gcc-arm-none-eabi)")
echo '#include <array>' | arm-none-eabi-g++ -x c++ -fsyntax-only - 2>/dev/null ||
    missing+=("C++ for arm-none-eabi (apt install libstdc++-arm-none-eabi-newlib)")
targets=(thumbv7em-none-eabihf thumbv6m-none-eabi riscv32imac-unknown-none-elf)
if [ "$if_possible" = --if-possible ]; then
    toolchain=$(EMBEDDED_TOOLCHAIN_CHECK=1 scripts/tools/embedded-toolchain.sh "${targets[@]}" 2>/dev/null) ||
        missing+=("bare-metal targets (rustup target add ${targets[*]}, or make embedded)")
fi
if [ ${#missing[@]} -gt 0 ]; then
    printf -v list '%s, ' "${missing[@]}"
    [ "$if_possible" = --if-possible ] && { echo "SKIPPED the firmware tests; missing: ${list%, }"; exit 0; }
    echo "missing: ${list%, }" >&2
    exit 1
fi
[ "$if_possible" = --if-possible ] || toolchain=$(scripts/tools/embedded-toolchain.sh "${targets[@]}")
if [ -z "${OMNISTEP_COMMAND:-}" ]; then
    cargo build --locked --quiet --release --bin omnistep
    OMNISTEP_COMMAND=$PWD/target/release/omnistep
fi

# omni-core with every combination of its features.
for features in "" defmt serde defmt,serde; do
    # shellcheck disable=SC2086 # an empty toolchain must vanish
    cargo $toolchain build --locked --quiet --release -p omnistep-core --features "$features" --target thumbv7em-none-eabihf
    echo "omni-core with features \"$features\": built for thumbv7em-none-eabihf"
done

cd firmware
# Everything for the images is compiled in one folder, so that what build scripts and macros need is
# compiled once; programs of one name go to folders of their own.
images() { CARGO_BUILD_BUILD_DIR=$PWD/target/build cargo $toolchain "$@"; } # unquoted: an empty toolchain must vanish
# First the images of the processor in the loop with a whole Drive, which their scenarios ask for:
# the last build is of another one.
OMNISTEP_SCENARIO=scenarios/drive.toml images build --locked --quiet --release --bin loop
cp target/thumbv7em-none-eabihf/release/loop target/drive_loop
OMNISTEP_SCENARIO=scenarios/traction.toml images build --locked --quiet --release --bin loop
cp target/thumbv7em-none-eabihf/release/loop target/traction_loop
images build --locked --quiet --release # for the Cortex-M4F, as in .cargo/config.toml
images build --locked --quiet --release -p omni-embassy
# Without --release, and for a control period whose reciprocal is no round number: it links, and its bits are the same.
OMNISTEP_SCENARIO=scenarios/period.toml CARGO_TARGET_DIR=target/dev images build --locked --quiet --bin self_test
cargo test --locked --quiet -p omni-embassy --lib --target "$(rustc -vV | sed -n 's/^host: //p')"
build() { CARGO_TARGET_DIR=target/$1 RUSTFLAGS="$2" images build --locked --quiet --release "${@:3}"; }
thumb="-C link-arg=-Tlink.x"
build m7 "$thumb -C target-cpu=cortex-m7" --bin self_test --target thumbv7em-none-eabihf
build m0plus "$thumb -C target-cpu=cortex-m0plus" --bin self_test --target thumbv6m-none-eabi
build riscv32imac "-C link-arg=-Tmemory.x -C link-arg=-Tlink.x" --bin self_test --target riscv32imac-unknown-none-elf

# The C and C++ examples: the library, the constants of the same scenarios, no warning, no C library.
c=target/c && mkdir -p $c
constants() { (cd .. && "$OMNISTEP_COMMAND" export "$@" --format c); }
constants step --set control.policy=scale_references >$c/constants.h
constants firmware/scenarios/drive.toml >$c/drive_constants.h
constants firmware/scenarios/traction.toml >$c/traction_constants.h
constants figure_eight >$c/path_constants.h
mkdir -p $c/three && constants firmware/scenarios/three.toml >$c/three/constants.h
m4="-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -O2 -Wall -Wextra -Werror -pedantic -ffreestanding -Ic/include"
link() { # program, its sources in C, where its constants are, other objects
    arm-none-eabi-gcc $m4 -std=c11 -nostdlib -I"${3:-$c}" -Ic/example $(printf 'c/example/%s.c ' $2) "${@:4}" c/example/startup.c \
        target/thumbv7em-none-eabihf/release/libomnistep.a -T c/example/link.ld \
        -Wl,--gc-sections -Wl,-z,noexecstack -Wl,--fatal-warnings -o "$c/$1"
}
link example main
link drive drive
link traction traction
link path path
link three_wheels "three three_bench" $c/three
mkdir -p $c/mecanum && constants firmware/scenarios/mecanum.toml >$c/mecanum/constants.h
link mecanum_wheels "mecanum mecanum_bench" $c/mecanum
# Three wheels in C++, with neither exceptions nor a library of C++.
arm-none-eabi-g++ $m4 -std=c++17 -fno-exceptions -fno-rtti -I$c/three -c c/example/three_in_cpp.cpp -o $c/three_in_cpp.o
link three_wheels_in_cpp three_bench $c/three $c/three_in_cpp.o
# What the steps cost in C, for the report: of a [drive] of defaults, with motors of constant torque
# and with ones that weaken with speed.
for vehicle in chugo7 mecanum4; do
    mkdir -p $c/$vehicle
    constants flat --set vehicle=$vehicle --set control.policy=scale_references --set drive.discretize=false >$c/$vehicle/constants.h
    link cost_$vehicle cost $c/$vehicle
    mkdir -p $c/$vehicle/traction
    constants firmware/scenarios/traction.toml --set vehicle=$vehicle >$c/$vehicle/traction/constants.h
    link cost_traction_$vehicle cost_traction $c/$vehicle/traction
done
# Every function of the library, linked: no panic; the report looks at its symbols.
link every_function every_function
./qemu.sh mps2-an386 $c/every_function
./qemu.sh mps2-an386 target/thumbv7em-none-eabihf/release/stops
./qemu.sh mps2-an386 target/thumbv7em-none-eabihf/release/constructors
./qemu.sh mps2-an386 target/dev/thumbv7em-none-eabihf/debug/self_test
echo '#include "omnistep.h"' | "${CXX:-c++}" -std=c++11 -Wall -Wextra -Werror -pedantic -fsyntax-only -Ic/include -x c++ -
same() { # program, what it says before the hash, the example that knows the hash and its arguments
    local said expected
    expected=$(cd .. && cargo run --locked --quiet --release --config scripts/test_profile.toml --example "${@:3}")
    said=$(./qemu.sh mps2-an386 "$c/$1" 2>&1) || true # where semihosting prints; what is wrong it says itself
    echo "$said"
    [ "$said" = "from C: $2, hash $expected" ] || { echo "C computes something else; wanted $expected" >&2; exit 1; }
}
same example "chugo7, scale_references" c_reference
same drive "the drive of chugo7" c_drive_reference firmware/scenarios/drive.toml
same traction "traction control of chugo7" c_traction_reference firmware/scenarios/traction.toml
# A path and an estimator, in C and Rust.
in_c=$(./qemu.sh mps2-an386 $c/path 2>&1) || { echo "$in_c" >&2; exit 1; }
in_rust=$(./qemu.sh mps2-an386 target/thumbv7em-none-eabihf/release/follow 2>&1) || { echo "$in_rust" >&2; exit 1; }
echo "$in_c, in C and Rust"
[ "$in_c" = "$in_rust" ] || { echo "Rust computes something else: $in_rust" >&2; exit 1; }
# Three wheels on computed motors, in C, C++ and Rust: all do what they should, and the same.
in_c=$(./qemu.sh mps2-an386 $c/three_wheels 2>&1) || { echo "$in_c" >&2; exit 1; }
in_rust=$(./qemu.sh mps2-an386 target/thumbv7em-none-eabihf/release/three 2>&1) || { echo "$in_rust" >&2; exit 1; }
in_cpp=$(./qemu.sh mps2-an386 $c/three_wheels_in_cpp 2>&1) || { echo "$in_cpp" >&2; exit 1; }
echo "$in_c, in C, C++ and Rust"
[ "$in_c" = "$in_cpp" ] || { echo "C++ computes something else: $in_cpp" >&2; exit 1; }
[ "$in_c" = "$in_rust" ] || { echo "Rust computes something else: $in_rust" >&2; exit 1; }
./qemu.sh mps2-an386 $c/mecanum_wheels

cd ..
# The processor in the loop: the whole climb, and faults of every kind in both directions.
ran=$(cargo test --locked --quiet --release --config scripts/test_profile.toml --test links -- --ignored)
echo "$ran"
grep -q "9 passed; 0 failed" <<<"$ran"
[ -x .venv/bin/python ] || scripts/tools/venv.sh
.venv/bin/python scripts/measure/firmware_report.py --self-test
.venv/bin/python scripts/measure/firmware_report.py
