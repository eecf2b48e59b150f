#!/usr/bin/env bash
# Builds the release files for Linux on x86_64 and aarch64 into out/dist: wheels for glibc 2.17 or newer, and static
# programs; and the packages of the C library for microcontrollers, by scripts/archives.sh. Runs 6 s of `flat` with
# each, aarch64 in QEMU, and compares the logs byte by byte; exit code 1 if they differ. Then searches all files for
# paths of this machine, and writes SHA256SUMS. Needs Linux on x86_64; to run the files for aarch64 also
# qemu-user-static and Debian's apt-get. If rustup lacks a target, scripts/tools/embedded-toolchain.sh prepares a
# toolchain. Prints what it skips; with --required that is an error. The first build takes half an hour or more.
set -euo pipefail
cd "$(dirname "$0")/.."
required=${1:-}
case $required in "" | --required) ;; *) echo "usage: $0 [--required]" >&2; exit 2 ;; esac
unset CARGO_BUILD_TARGET
seconds=6
missing() { # what is not done, why
    [ "$required" != --required ] || { echo "$1: $2" >&2; exit 1; }
    echo "skipped, $2: $1"
}
everything="wheels and programs for Linux"
[ "$(uname -sm)" = "Linux x86_64" ] || { missing "$everything" "this is not Linux on x86_64"; exit; }
processors=(x86_64 aarch64)
targets=("${processors[@]/%/-unknown-linux-gnu}" "${processors[@]/%/-unknown-linux-musl}")
toolchain=$(scripts/tools/embedded-toolchain.sh "${targets[@]}") ||
    { missing "$everything" "Rust's standard library is missing (rustup target add ${targets[*]})"; exit; }
# One compiler for all targets, so that build scripts and macros are compiled once.
[ -z "$toolchain" ] || export RUSTUP_TOOLCHAIN=${toolchain#+}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
rm -rf out/dist
timed() { # command
    local start=$SECONDS
    "$@"
    echo "$((SECONDS - start)) s: $*"
}
for processor in "${processors[@]}"; do timed scripts/release/wheel.sh "$processor-unknown-linux-gnu"; done
for processor in "${processors[@]}"; do timed python3 scripts/release/command.py "$processor-unknown-linux-musl"; done
timed scripts/archives.sh "${required:---if-possible}"
for archive in out/archives/*.zip; do [ ! -e "$archive" ] || cp "$archive" out/dist; done

# A run with each file; programs for aarch64 need an emulator.
declare -A emulator=([x86_64]="" [aarch64]=qemu-aarch64-static)
for processor in "${processors[@]}"; do
    for archive in "out/dist/"*"-$processor-unknown-linux-musl.tar.gz"; do tar -xzf "$archive" -C "$work"; done
    if [ -n "${emulator[$processor]}" ] && ! command -v "${emulator[$processor]}" >/dev/null; then
        missing "the run of the files for $processor" "${emulator[$processor]} is missing (on Debian: apt install qemu-user-static)"
        unset "emulator[$processor]"
        continue
    fi
    program=$(echo "$work"/*"-$processor-unknown-linux-musl/omnistep")
    ${emulator[$processor]} "$program" run flat --set "duration_s=$seconds" --quiet --out "$work/$processor" >/dev/null
    mv "$work/$processor/"*.mcap "$work/program-$processor.mcap"
done
cat >"$work/run.py" <<'PYTHON'
import hashlib, platform, sys
import numpy, omnistep
trace = omnistep.run("flat", overrides={"duration_s": float(sys.argv[1])}, mcap=sys.argv[2], progress=False)
signals = trace.to_numpy()
assert isinstance(signals, numpy.ndarray) and numpy.isfinite(signals).any(), signals
print(signals.shape, hashlib.sha256(signals.tobytes()).hexdigest())
print(f"{platform.machine()}: Python {platform.python_version()}, NumPy {numpy.__version__}", file=sys.stderr)
PYTHON
pip=("$(scripts/release/build_tools.sh)/python" -m pip --quiet --disable-pip-version-check)
wheel() { echo "$PWD"/out/dist/omnistep-*_"$1".whl; } # processor
python3 -m venv --without-pip "$work/venv"
"${pip[@]}" --python "$work/venv/bin/python" install "$(wheel x86_64)"
"$work/venv/bin/python" -I "$work/run.py" $seconds "$work/wheel-x86_64.mcap" >"$work/signals-x86_64"
if [ -n "${emulator[aarch64]:-}" ]; then
    # Debian's Python for aarch64 with its libraries, and NumPy's own wheel for it.
    if command -v apt-get >/dev/null && scripts/tools/debs.sh arm64 "$work/arm64" python3-minimal libpython3-stdlib libstdc++6; then
        python=$(echo "$work"/arm64/usr/bin/python3.[0-9]*)
        "${pip[@]}" install --target "$work/arm64/usr/lib/python3/dist-packages" --only-binary=:all: \
            --platform manylinux_2_17_aarch64 --platform manylinux_2_28_aarch64 --implementation cp --python-version "${python##*python}" "$(wheel aarch64)"
        qemu-aarch64-static -L "$work/arm64" "$python" -I "$work/run.py" $seconds "$work/wheel-aarch64.mcap" >"$work/signals-aarch64"
        diff "$work/signals-x86_64" "$work/signals-aarch64" >&2 || { echo "NumPy has other numbers on aarch64 (>) than on x86_64 (<)" >&2; exit 1; }
    else
        missing "the run of the wheel for aarch64" "Debian's packages for arm64 are missing (apt-get)"
    fi
fi
for log in "$work"/*.mcap; do
    cmp "$work/wheel-x86_64.mcap" "$log" || { echo "$(basename "$log" .mcap) and wheel-x86_64 write different logs" >&2; exit 1; }
    echo "$(basename "$log" .mcap): $seconds s of flat, $(wc -c <"$log") bytes of log, sha256 $(sha256sum <"$log" | cut -c 1-16)"
done
python3 scripts/release/build_places.py out/dist/*
(cd out/dist && sha256sum -- * >SHA256SUMS && sha256sum --check --quiet SHA256SUMS)
(cd out/dist && du -h --apparent-size -- *)
