#!/usr/bin/env bash
# Builds the simulation for 64-bit Arm (aarch64-unknown-linux-gnu), runs the first seconds of every
# built-in scenario in QEMU and natively, and compares poses and traces: bit-identical, or exit code 1. Needs, on
# Debian: apt install gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user-static. Where rustup has no such target, std
# is compiled from the sources that scripts/tools/embedded-toolchain.sh unpacks. With --if-possible: skips, and says so,
# what a missing tool asks for.
set -euo pipefail
cd "$(dirname "$0")/.."
unset CARGO_BUILD_TARGET # where the native program is looked for
possible=${1:-}
missing() { # what is missing, and how to get it
    [ "$possible" = --if-possible ] && { echo "skipped, $1 is missing ($2): the simulation on 64-bit Arm"; exit 0; }
    echo "$1 is missing: $2" >&2
    exit 1
}
packages="on Debian or Ubuntu: apt install gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user-static"
for tool in aarch64-linux-gnu-gcc qemu-aarch64-static; do command -v "$tool" >/dev/null || missing "$tool" "$packages"; done
[ -e /usr/aarch64-linux-gnu/lib/libc.so.6 ] || missing "a C library for 64-bit Arm" "$packages"
target=aarch64-unknown-linux-gnu
arguments=()
if ! compgen -G "$(rustc --print target-libdir --target $target)/libstd-*.rlib" >/dev/null; then
    [ "$possible" != --if-possible ] || export EMBEDDED_TOOLCHAIN_CHECK=1
    toolchain=$(scripts/tools/embedded-toolchain.sh wasm32-unknown-unknown) || true
    # If the WebAssembly targets are rustup's own, they lack the sources of std.
    [ -n "$toolchain" ] || missing "std for $target" "rustup target add $target"
    arguments=(-Zbuild-std=std,panic_unwind)
fi
output=${CARGO_TARGET_DIR:-target}
build() { cargo "$@" --locked --quiet --profile quick --manifest-path wasm/Cargo.toml --target-dir "$output"; }
seconds=3 # the front wheels are on the step by then
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# shellcheck disable=SC2086 # an empty toolchain must vanish
CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc RUSTC_BOOTSTRAP=1 \
    build ${toolchain:-} build "${arguments[@]}" --target $target
build build
"$output/quick/omnistep-wasm" $seconds >"$work/native"
qemu-aarch64-static -L /usr/aarch64-linux-gnu "$output/$target/quick/omnistep-wasm" $seconds >"$work/arm"
diff "$work/native" "$work/arm" >&2 || { echo "64-bit Arm (>) computes other bits than this machine (<)" >&2; exit 1; }
echo "$(wc -l <"$work/arm") runs, $seconds s each: 64-bit Arm and this machine agree bit for bit in every pose and trace"
