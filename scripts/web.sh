#!/usr/bin/env bash
# Bundles web/player with three.js into the Python package: python/omnistep/assets/player.js.
# With --check: builds it aside and says whether the committed one is the same in every byte.
# With --if-possible: skips, and says so, where node or npm is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
built=python/omnistep/assets/player.js
for tool in node npm; do
    command -v "$tool" >/dev/null && continue
    case " $* " in *" --if-possible "*) echo "skipped, $tool is missing: the bundle of the player"; exit 0 ;; esac
    echo "$tool is missing: the bundle of the player" >&2
    exit 1
done
npm --prefix web ci --silent --no-audit --no-fund
case " $* " in
*" --check "*)
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    node web/build.mjs "$work/player.js"
    cmp "$work/player.js" "$built" || { echo "$built is stale: run scripts/web.sh" >&2; exit 1; }
    ;;
*) node web/build.mjs "$built" ;;
esac
most=200000
size=$(gzip -9 -n -c "$built" | wc -c)
echo "$built: $size bytes with gzip, at most $most"
[ "$size" -le "$most" ]
