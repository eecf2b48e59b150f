#!/usr/bin/env bash
# Packages every crate that is to be published, without uploading any, and lists each package's files and size.
# Fails where a package lacks its README or a licence. Needs the registry's index, as any first build does.
#
# --verify also builds each package from nothing but what is in it, as publishing does: for a release. Some ten minutes of
# one core, because packages do not know the workspace's profiles and every dependency is compiled anew; without it six
# seconds.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
    "") verify=(--no-verify) ;;
    --verify) verify=() ;;
    *) echo "usage: scripts/package.sh [--verify]" >&2; exit 2 ;;
esac
packages=${CARGO_TARGET_DIR:-target}/package
rm -f "$packages"/*.crate # of other versions
# The tests' package and the Python bindings stay here: publish = false. Nothing is uploaded, so a change that is not
# committed yet does no harm.
cargo package --quiet --locked --allow-dirty "${verify[@]}" \
    --workspace --exclude omnistep-workspace --exclude omni-py

printf '%-24s %5s %12s %12s\n' package files 'packed [B]' 'unpacked [B]'
for package in "$packages"/*.crate; do
    name=$(basename "$package" .crate)
    files=$(tar -tzf "$package")
    for needed in Cargo.toml README.md LICENSE-MIT LICENSE-APACHE; do
        grep -qx "$name/$needed" <<<"$files" || { echo "$name: no $needed in the package" >&2; exit 1; }
    done
    printf '%-24s %5d %12d %12d\n' "$name" "$(wc -l <<<"$files")" "$(wc -c <"$package")" \
        "$(tar -tzvf "$package" | awk '{ sum += $3 } END { print sum }')"
done
