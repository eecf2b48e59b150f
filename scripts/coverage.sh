#!/usr/bin/env bash
# Line coverage of omni-core by its own tests and examples; exit code 1 below COVERAGE_MIN percent (95). Needs LLVM's
# llvm-profdata and llvm-cov of the compiler's LLVM version: rustup's component llvm-tools, or Debian's llvm-22.
set -euo pipefail
cd "$(dirname "$0")/.."
major=$(rustc -vV | sed -n 's/^LLVM version: \([0-9]*\).*/\1/p')
tool() { # name of an LLVM tool: its path
    local own; own=$(rustc --print target-libdir)/../bin/$1
    if [ -x "$own" ]; then echo "$own"; else command -v "$1-$major"; fi ||
        { echo "no $1 of LLVM $major: rustup component add llvm-tools, or apt install llvm-$major" >&2; return 1; }
}
profdata=$(tool llvm-profdata)
cov=$(tool llvm-cov)

export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}/coverage # instrumented builds leave the ordinary ones alone
out=$CARGO_TARGET_DIR/report
rm -rf "$out"
mkdir -p "$out/doctests"
export RUSTFLAGS="-Cinstrument-coverage" LLVM_PROFILE_FILE="$out/%p-%m.profraw"
# Keeping the compiled examples of the documentation is a flag that stable rustdoc hides; it changes no language rule.
export RUSTDOCFLAGS="-Cinstrument-coverage -Zunstable-options --persist-doctests=$out/doctests"
cargo test --locked --quiet -p omnistep-core --lib --tests --no-run --message-format=json >"$out/build.json"
# Which lines run is known after a few cases of a law; the whole of it, and what drives for long, is in `cargo test`.
export PROPTEST_CASES=16
cargo test --locked --quiet -p omnistep-core --lib --tests -- \
    --skip released_from_a_wall_overshoots --skip coarse_and_noisy_encoders_leave
RUSTC_BOOTSTRAP=1 cargo test --locked --quiet -p omnistep-core --doc
"$profdata" merge --sparse -o "$out/all.profdata" "$out"/*.profraw
mapfile -t binaries < <(
    grep -o '"executable":"[^"]*"' "$out/build.json" | cut -d'"' -f4
    find "$out/doctests" -type f -perm -u+x
)
"$cov" export --format=lcov --instr-profile="$out/all.profdata" "${binaries[@]/#/--object=}" \
    --sources "$PWD/crates/omni-core/src" >"$out/lcov.info"
python3 scripts/checks/coverage_report.py "$out/lcov.info" --minimum "${COVERAGE_MIN:-95}"
