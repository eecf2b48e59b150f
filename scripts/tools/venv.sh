#!/usr/bin/env bash
# Makes the virtual environment .venv with the extension built from this tree and everything the Python
# tests need. Prints only errors and one line per step. PYTHON chooses the interpreter, 3.11 or newer; EXTRA=docs
# installs what the site needs instead of what the tests need. What the wheel is made of is summed up in .venv: while
# nothing of it has changed, nothing is built or installed again.
set -euo pipefail
cd "$(dirname "$0")/../.."
python=${PYTHON:-python3}
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
    { echo "Python 3.11 or newer is needed; name one with PYTHON=... (found: $("$python" --version 2>&1))" >&2; exit 1; }
if [ ! -x .venv/bin/python ]; then
    echo "making .venv"
    "$python" -m venv .venv ||
        { echo "no virtual environment can be made; on Debian or Ubuntu: apt install python3-venv" >&2; exit 1; }
fi
pip() { .venv/bin/python -m pip "$@" --quiet --disable-pip-version-check; }
extra=${EXTRA:-test}
lock=python/requirements-$extra.txt
digest() { # of what is read below, and of more files
    { "$python" -VV; rustc -vV; find "$@" -type f ! -path '*/__pycache__/*' ! -path '*/tests/*' -print0 | sort -z | xargs -0 sha256sum; } |
        sha256sum
}
wheel=$(digest crates python Cargo.toml Cargo.lock pyproject.toml README.md LICENSE-* scripts/tools/venv.sh scripts/release/{wheel_backend,build_places,licences}.py)
tools=$(digest pyproject.toml "$lock")
compgen -G 'out/wheel/*.whl' >/dev/null && [ "$(cat .venv/wheel 2>/dev/null)" = "$wheel" ] && built=true || built=false
$built && [ "$(cat ".venv/tools-$extra" 2>/dev/null)" = "$tools" ] && exit 0
echo "building the extension and installing the tools (the first time takes some minutes)"
rm -f ".venv/tools-$extra"
if .venv/bin/python scripts/tools/lock_fits.py; then
    # Exactly these files: versions and hashes, also of the wheel's build tools.
    pip install --require-hashes --requirement "$lock"
    build=(--no-build-isolation)
else
    echo "$lock is for Python 3.11 on Linux (x86-64, glibc 2.35 or newer): here the newest versions that pyproject.toml allows"
    build=()
fi
if ! $built; then
    # The wheel as users get it; the tests try it in a clean environment as well.
    rm -rf .venv/wheel out/wheel
    PATH=$PWD/.venv/bin:$PATH pip wheel "${build[@]}" --no-deps --wheel-dir out/wheel .
    # By name and version alone pip would keep the one that is there.
    pip install --force-reinstall --no-deps out/wheel/*.whl
    echo "$wheel" >.venv/wheel
fi
# With the lock everything is there already, and nothing is fetched.
pip install "$(echo out/wheel/*.whl)[$extra]"
echo "$tools" >".venv/tools-$extra"
