#!/usr/bin/env bash
# Builds libomnistep.a for eight kinds of processors, packs it for Arduino, PlatformIO, ESP-IDF, Zephyr and CMake into
# out/archives, and tests all of it: every processor's program prints in QEMU what it prints on this computer, and every
# package is used by its own system's tools. Prints what it skips; with --required that is an error. With --if-possible:
# where a compiler or an emulator is missing, one line that names it, and success.
# OMNISTEP_COMMAND: an `omnistep` that is built already; unset: it is built.
set -euo pipefail
cd "$(dirname "$0")/.."
required=${1:-}
case $required in
"" | --required | --if-possible) ;;
*) echo "usage: $0 [--required | --if-possible]" >&2; exit 2 ;;
esac
rm -rf out/archives
missing=()
for needed in "arm-none-eabi-gcc gcc-arm-none-eabi" "riscv64-unknown-elf-gcc gcc-riscv64-unknown-elf" "cmake cmake" \
    "qemu-system-arm qemu-system-arm" "qemu-system-riscv32 qemu-system-misc"; do
    command -v "${needed% *}" >/dev/null || missing+=("${needed% *} (apt install ${needed#* })")
done
riscv64-unknown-elf-gcc --specs=picolibc.specs -E -xc /dev/null >/dev/null 2>&1 ||
    missing+=("a C library for RISC-V (apt install picolibc-riscv64-unknown-elf)")
if [ ${#missing[@]} -gt 0 ]; then
    printf -v list '%s, ' "${missing[@]}"
    [ "$required" = --if-possible ] && { echo "skipped the packages of the C library; missing: ${list%, }"; exit; }
    echo "missing: ${list%, }" >&2
    exit 1
fi
# What is looked at is what is built here.
unset CARGO_BUILD_TARGET RUSTFLAGS CMAKE_PREFIX_PATH CFLAGS LDFLAGS
if [ -z "${OMNISTEP_COMMAND:-}" ]; then
    cargo build --locked --quiet --release --bin omnistep
    OMNISTEP_COMMAND=$(realpath "${CARGO_TARGET_DIR:-target}/release/omnistep")
fi
unset CARGO_TARGET_DIR
mapfile -t targets < <(sed -n 's/^target = "\(.*\)"$/\1/p' firmware/packages/archives.toml | sort -u)
toolchain=$(scripts/tools/embedded-toolchain.sh "${targets[@]}")
work=$PWD/firmware/target/archives
timed() { # command
    local start=$SECONDS
    "$@"
    echo "$((SECONDS - start)) s: $1 $(basename "$2")"
}
# shellcheck disable=SC2086 # an empty toolchain must vanish
timed python3 scripts/release/archives.py $toolchain

# What the examples print on this computer, with the library of `make cpp`.
mkdir -p "$work/mecanum" "$work/three"
"$OMNISTEP_COMMAND" export firmware/packages/example/mecanum.toml --format c >"$work/mecanum/constants.h"
"$OMNISTEP_COMMAND" export firmware/scenarios/three.toml --format c >"$work/three/constants.h"
host=$(rustc -vV | sed -n 's/^host: //p')
(cd firmware && cargo build --locked --quiet --release -p omni-c --lib --target "$host")
here() { # example, its sources
    "${CC:-cc}" -std=c11 -O2 -Wall -Wextra -Werror -pedantic -Ifirmware/c/include -Ifirmware/c/example \
        -Ifirmware/packages/example "-I$work/$1" "${@:2}" firmware/packages/tests/host.c \
        "firmware/target/$host/release/libomnistep.a" -o "$work/$1/here"
    "$work/$1/here"
}
mecanum=$(here mecanum firmware/packages/{example/base,example/bench,cmake/example/main}.c)
three=$(here three firmware/c/example/{three,three_bench}.c)
printf '%s\n' "$mecanum" "$three"
grep -qxF -- "$mecanum" docs/without-rust.md ||
    { echo "docs/without-rust.md does not have this line of the example: $mecanum" >&2; exit 1; }

# Twice: the same bytes.
rm -rf "$work/again"
python3 scripts/release/packages.py "$work/mecanum/constants.h" "$mecanum"
python3 scripts/release/packages.py "$work/mecanum/constants.h" "$mecanum" "$work/again" >/dev/null
diff -r out/archives "$work/again"
(cd out/archives && sha256sum --check --quiet SHA256SUMS)
python3 scripts/release/build_places.py out/archives/*

# Every processor, and then every package.
rm -rf "$work/unpacked"
python3 -m zipfile -e out/archives/omnistep-cmake-*.zip "$work/unpacked"
timed python3 scripts/release/archive_tests.py "$work/unpacked/omnistep" "$work/three" "$mecanum" "$three"
tools=$PWD/out/tools/packages
if ! cmp --silent python/requirements-packages.txt "$tools/installed.txt"; then
    rm -rf "$tools"
    "${PYTHON:-python3}" -m venv "$tools"
    "$tools/bin/python" -m pip install --quiet --disable-pip-version-check --require-hashes \
        --requirement python/requirements-packages.txt
    cp python/requirements-packages.txt "$tools/installed.txt"
fi
timed python3 scripts/release/package_tests.py "$tools/bin" "$mecanum" "$required"
