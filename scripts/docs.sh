#!/usr/bin/env bash
# Builds the documentation site into out/site; a warning is an error. Network only to install the tools. Without node
# or a toolchain for WebAssembly the site has no playground, and says so; with PLAYGROUND=required that is an error.
set -euo pipefail
cd "$(dirname "$0")/.."
EXTRA=docs scripts/tools/venv.sh
python=.venv/bin/python
$python scripts/docs/check_site.py --self-test
if [ "${PLAYGROUND:-}" = required ]; then scripts/playground.sh; else scripts/playground.sh --if-possible; fi
$python scripts/docs/stage_pages.py
# Python finds the formatter of formulas in scripts/docs. Pages kept from an earlier build would not
# be checked again: --clean.
log=out/site.log
PYTHONPATH=scripts/docs $python -m zensical build --clean >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
# Strict means links; what mkdocstrings finds wrong with a docstring is only said.
if grep -vE '^(Build (started|finished in .*)|No issues found)?$' "$log" >&2; then
    echo "the site's generator warns" >&2
    exit 1
fi
$python scripts/docs/check_site.py
echo "out/site/index.html"
