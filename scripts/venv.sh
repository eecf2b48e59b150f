#!/usr/bin/env bash
# Makes the virtual environment .venv with the extension built from this tree and everything the Python tests need.
# Prints nothing but errors and one line a step. PYTHON chooses the interpreter, 3.11 or newer; EXTRA=docs installs what
# the site needs instead of what the tests need.
set -euo pipefail
cd "$(dirname "$0")/.."
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
echo "building the extension and installing the tools (the first time takes some minutes)"
# The wheel as users get it; the tests try it in a clean environment as well.
rm -rf out/wheel
if .venv/bin/python scripts/lock_fits.py; then
    # Exactly these files: versions and hashes, of what builds the wheel too.
    pip install --require-hashes --requirement "$lock"
    PATH=$PWD/.venv/bin:$PATH pip wheel --no-build-isolation --no-deps --wheel-dir out/wheel .
else
    echo "$lock is for Python 3.11 on Linux (x86-64, glibc 2.35 or newer): here the newest versions that pyproject.toml allows"
    pip wheel --no-deps --wheel-dir out/wheel .
fi
# By name and version alone pip would keep the one that is there.
pip install --force-reinstall --no-deps out/wheel/*.whl
# With the lock everything is there already, and nothing is fetched.
pip install "$(echo out/wheel/*.whl)[$extra]"
