#!/usr/bin/env bash
# Builds the documentation site into out/site; a warning is an error. Network only to install the tools.
set -euo pipefail
cd "$(dirname "$0")/.."
EXTRA=docs scripts/venv.sh
python=.venv/bin/python
$python scripts/docs_pages.py stage
# Python finds the formatter of formulas in scripts/; the theme's advice about other site generators is left out. Not
# --quiet: under it MkDocs counts no warnings, and strict means nothing.
PYTHONPATH=scripts NO_MKDOCS_2_WARNING=1 $python -m mkdocs build --strict
$python scripts/docs_pages.py check
echo "out/site/index.html"
