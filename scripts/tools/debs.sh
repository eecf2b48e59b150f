#!/usr/bin/env bash
# Unpacks Debian packages of another processor into a folder, with their dependencies:
# scripts/tools/debs.sh arm64 FOLDER PACKAGE... With --alone after the folder, without dependencies.
# It installs nothing and does not change this machine's apt.
set -euo pipefail
[ $# -ge 3 ] || { echo "usage: $0 ARCHITECTURE FOLDER [--alone] PACKAGE..." >&2; exit 2; }
architecture=$1 folder=$2
shift 2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$folder" "$work/state/lists/partial" "$work/cache/archives/partial"
: >"$work/status" # no package is installed yet
apt=(apt-get -qq -y -o "APT::Architecture=$architecture" -o "APT::Architectures=$architecture" -o "Dir::State=$work/state"
    -o "Dir::State::status=$work/status" -o "Dir::Cache=$work/cache" -o Debug::NoLocking=1 -o APT::Sandbox::User=
    -o Acquire::Languages=none)
"${apt[@]}" update
if [ "$1" = --alone ]; then
    shift
    (cd "$work/cache/archives" && "${apt[@]}" download "$@")
else
    "${apt[@]}" --no-install-recommends --download-only install "$@" >/dev/null
fi
for package in "$work/cache/archives/"*.deb; do dpkg-deb -x "$package" "$folder"; done
