#!/usr/bin/env bash
# Fuzzes one of toml, height_map, log, link, drive, trace for so many seconds (60): scripts/attack/fuzz.sh
# drive 600. On stable Rust: the compiler's coverage pass is an LLVM pass as any other, and libFuzzer is part
# of libfuzzer-sys. What is found goes on in out/fuzz/TARGET; an input that fails is out/fuzz/TARGET-crash-*,
# and `cargo test --test attack -- TARGET FILE` runs it again. Mend it, then copy it to fuzz/corpus/TARGET.
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${1:?toml, height_map, log, link, drive or trace}
seconds=${2:-60}
host=$(rustc -vV | sed -n 's/^host: //p')
# With --target, so that build scripts and macros are not measured.
RUSTFLAGS="--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares" \
    cargo build --locked --release --quiet --manifest-path fuzz/Cargo.toml --target "$host"
mkdir -p "out/fuzz/$target"
TARGET=$target "fuzz/target/$host/release/omnistep-fuzz" "out/fuzz/$target" "fuzz/corpus/$target" \
    -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -max_len=100000 -use_value_profile=1 \
    -print_final_stats=1 -artifact_prefix="out/fuzz/$target-"
