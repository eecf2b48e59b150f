#!/usr/bin/env bash
# Is a tag (v1.2.3) the workspace's version, and has CHANGELOG.md a heading for it? Exit code 1 if not.
set -euo pipefail
cd "$(dirname "$0")/.."
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)".*/\1/p' Cargo.toml)
[ "${1:?usage: scripts/tag_fits.sh TAG}" = "v$version" ] || { echo "$1 is not v$version, the version in Cargo.toml" >&2; exit 1; }
grep -qF "## [$version]" CHANGELOG.md || { echo "CHANGELOG.md has no heading ## [$version]" >&2; exit 1; }
echo "$1 is the version, and CHANGELOG.md has it"
