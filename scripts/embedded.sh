#!/usr/bin/env bash
# Builds omni-core for bare metal: Cortex-M4F, Cortex-M0 (neither floating-point unit nor atomic
# swap) and a 32-bit RISC-V. Fails where a target cannot be built; none is ever skipped. Where rustup
# has no such target the first run prepares a toolchain from Debian's packages: about a minute.
set -euo pipefail
cd "$(dirname "$0")/.."
targets=(thumbv7em-none-eabihf thumbv6m-none-eabi riscv32imac-unknown-none-elf)
toolchain=$(scripts/tools/embedded-toolchain.sh "${targets[@]}") # empty where rustup has the targets
output=${CARGO_TARGET_DIR:-target}
for target in "${targets[@]}"; do rm -f "$output/$target/release/libomni_core.rlib"; done
# shellcheck disable=SC2086 # an empty toolchain must vanish
cargo $toolchain build --locked --quiet --release -p omnistep-core --no-default-features "${targets[@]/#/--target=}"
for target in "${targets[@]}"; do
    [ -s "$output/$target/release/libomni_core.rlib" ] || { echo "$target: nothing was built" >&2; exit 1; }
    # shellcheck disable=SC2086
    echo "$target: omni-core built with $(rustc $toolchain --version)"
done
