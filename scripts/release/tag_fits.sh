#!/usr/bin/env bash
# Is a tag (v1.2.3) the version that every file says, do the texts speak of a release, on the same day,
# and is this the repository that the files name (in a workflow)? Names each file that differs; exit
# code 1 if one does.
set -euo pipefail
cd "$(dirname "$0")/../.."
tag=${1:?usage: scripts/release/tag_fits.sh TAG}
of_workspace() { sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)".*/\1/p' "$1"; }
version=$(of_workspace Cargo.toml)
wrong=()
[ "$tag" = "v$version" ] || wrong+=("$tag is not v$version, the version in Cargo.toml")
# Crates that need one another do so by version where they are published.
while IFS= read -r line; do
    grep -qF "version = \"$version\"" <<<"$line" || wrong+=("Cargo.toml: another version than $version: $line")
done < <(sed -n '/^\[workspace.dependencies\]/,/^\[/p' Cargo.toml | grep 'path = "crates/')
# The C and C++ package has the version of the firmware's workspace.
[ "$(of_workspace firmware/Cargo.toml)" = "$version" ] ||
    wrong+=("firmware/Cargo.toml has another version than Cargo.toml, $version")
# A lock file with another version is rejected by --locked.
for lock in Cargo.lock */Cargo.lock examples/*/Cargo.lock; do
    other=$(awk -v wanted="\"$version\"" '/^name = "omni(step|-)/ { name = $3 } /^version = / && name { if ($3 != wanted && $3 != "\"0.0.0\"") print name; name = "" }' "$lock")
    [ -z "$other" ] || wrong+=("$lock has another version than $version of ${other//$'\n'/, }")
done
grep -qx "version: $version" CITATION.cff || wrong+=("CITATION.cff has another version than Cargo.toml, $version")
released=$(sed -n 's/^date-released: \([0-9]\{4\}-[0-9]\{2\}-[0-9]\{2\}\)$/\1/p' CITATION.cff)
[ -n "$released" ] || wrong+=("CITATION.cff has no date-released: YYYY-MM-DD")
grep -qE "^## \[${version//./\\.}\] - ${released:-[0-9-]+}\$" CHANGELOG.md ||
    wrong+=("CHANGELOG.md has no heading ## [$version] - ${released:-YYYY-MM-DD}${released:+, the date-released of CITATION.cff}")
grep -qxF "  version: \"$version\"" packaging/conda/recipe.yaml ||
    wrong+=("packaging/conda/recipe.yaml has another version than Cargo.toml, $version")
grep -qxF "  \"version\": \"$version\"," packaging/npm/package.json ||
    wrong+=("packaging/npm/package.json has another version than Cargo.toml, $version")
addresses=$("${PYTHON:-python3}" scripts/checks/addresses.py --release) || wrong+=("$addresses")
! grep -qF "Nothing has been released yet" CHANGELOG.md || wrong+=("CHANGELOG.md says that nothing has been released yet")
! tr '\n' ' ' <README.md | grep -qF "not yet on PyPI" || wrong+=("README.md says that omnistep is not yet on PyPI")
if [ ${#wrong[@]} != 0 ]; then
    printf '%s\n' "${wrong[@]}" >&2
    exit 1
fi
echo "$tag is the version of every file, and the texts speak of a release"
