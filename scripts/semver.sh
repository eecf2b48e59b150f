#!/usr/bin/env bash
# Compares what the crates show with their last release (the newest tag v*, or the commit in
# BASELINE) by cargo-semver-checks: a change that breaks users without a new version is an error.
# Where there is no release yet, says so, and nothing is compared.
set -euo pipefail
cd "$(dirname "$0")/.."
baseline=${BASELINE:-$(git describe --tags --abbrev=0 --match 'v*' 2>/dev/null || true)}
if [ -z "$baseline" ]; then
    echo "skipped, no release to compare with: neither a tag v* nor BASELINE"
    exit 0
fi
version=0.51.0
if [ "$(cargo semver-checks --version 2>/dev/null)" != "cargo-semver-checks $version" ]; then
    echo "installing cargo-semver-checks $version (takes some minutes once)"
    CARGO_PROFILE_DEV_DEBUG=0 cargo install --quiet --locked --profile dev "cargo-semver-checks@$version"
fi
# The tests' package and the Python bindings are not published.
cargo semver-checks --workspace --exclude omnistep-workspace --exclude omni-py --baseline-rev "$baseline" "$@"
