#!/usr/bin/env bash
# Builds the simulation for WebAssembly (wasm32-unknown-unknown) with the profile in PROFILE, `release` or
# `quick`, and prints where the module is. Where rustup has no such target the first run prepares a toolchain
# from Debian's packages; with --if-possible it does not. Exit code 3 where the toolchain is missing.
set -euo pipefail
cd "$(dirname "$0")/../.."
unset CARGO_BUILD_TARGET # where the native program is looked for
target=wasm32-unknown-unknown
[ "${1:-}" != --if-possible ] || export EMBEDDED_TOOLCHAIN_CHECK=1
toolchain=$(scripts/tools/embedded-toolchain.sh $target) || { echo "a toolchain for $target (rustup target add $target${1:+, or make wasm})"; exit 3; }
# What is built is what is used: no version that is not the workspace's.
if grep '^checksum' wasm/Cargo.lock | grep -qvxFf Cargo.lock; then
    echo "wasm/Cargo.lock has other versions than Cargo.lock: cp Cargo.lock wasm/ && cargo tree --manifest-path wasm/Cargo.toml" >&2
    exit 1
fi
output=${CARGO_TARGET_DIR:-target}
profile=${PROFILE:-release}
# shellcheck disable=SC2086 # an empty toolchain must vanish
cargo $toolchain rustc --locked --quiet --profile "$profile" --manifest-path wasm/Cargo.toml --target-dir "$output" --lib --crate-type=cdylib --target=$target
echo "$output/$target/$profile/omnistep_wasm.wasm"
