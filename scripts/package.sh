#!/usr/bin/env bash
# Packages every crate that is to be published, without uploading any, and lists each package's
# files and size; --publish uploads those that crates.io does not have, in the order in which they
# need one another (scripts/release/publish.py). It was never run. Fails where a package lacks its
# README or a licence. Needs the registry's index, as any first build does.
#
# --verify also builds each package from nothing but what is in it, as publishing does: for a
# release. The first time that takes some ten minutes of one core, because packages do not know the
# workspace's profiles and every dependency is compiled anew; without it six seconds.
set -euo pipefail
cd "$(dirname "$0")/.."
case "$*" in
    "") verify=false ;;
    --verify) verify=true ;;
    --publish) ;;
    *) echo "usage: scripts/package.sh [--verify | --publish]" >&2; exit 2 ;;
esac
target=${CARGO_TARGET_DIR:-target}
# The tests' package and the Python bindings stay here: publish = false.
all=(--locked --workspace --exclude omnistep-workspace --exclude omni-py)
if [ "$*" = --publish ]; then
    exec "${PYTHON:-python3}" scripts/release/publish.py
fi
package_all() { # more options
    # Nothing is uploaded, so a change that is not committed yet does no harm.
    cargo package --quiet --allow-dirty "${all[@]}" "$@"
}

rm -f "$target"/package/*.crate # of other versions
package_all --no-verify
names=()
printf '%-24s %5s %12s %12s\n' package files 'packed [B]' 'unpacked [B]'
for package in "$target"/package/*.crate; do
    name=$(basename "$package" .crate)
    names+=("$name")
    files=$(tar -tzf "$package")
    for needed in Cargo.toml README.md LICENSE-MIT LICENSE-APACHE; do
        grep -qx "$name/$needed" <<<"$files" || { echo "$name: no $needed in the package" >&2; exit 1; }
    done
    printf '%-24s %5d %12d %12d\n' "$name" "$(wc -l <<<"$files")" "$(wc -c <"$package")" \
        "$(tar -tzvf "$package" | awk '{ sum += $3 } END { print sum }')"
done

if $verify; then
    # Packages depend on one another by version, and Cargo takes a version for unchangeable: what it once unpacked and
    # built of one it uses again, whatever is in the package today. (Registries in a folder are called `-` and a hash.)
    for name in "${names[@]}"; do rm -rf "${CARGO_HOME:-$HOME/.cargo}"/registry/src/-*/"$name"; done
    rm -rf "$target"/verify/debug/{deps,.fingerprint}/*omni*
    package_all --target-dir "$target/verify"
    echo "each builds from what is in it"
fi
