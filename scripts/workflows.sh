#!/usr/bin/env bash
# Lints what only GitHub and other servers read: workflows (actionlint, zizmor), and Dependabot's file, issue forms and
# CITATION.cff by their schemas (check-jsonschema); that the files of packaging are read is a test
# (python/tests/test_packaging.py). Says what it skips; with --required that is an error. Tools that are not
# there are put into out/tools: actionlint by Go, the others by pip from python/requirements-workflows.txt, by hash.
set -euo pipefail
cd "$(dirname "$0")/.."
required=${1:-}
tools=$PWD/out/tools
mkdir -p "$tools"
export PATH=$tools/bin:$tools/venv/bin:$PATH
actionlint=1.7.12
skip() { # what, why
    [ "$required" != --required ] || { echo "$1: $2" >&2; exit 1; }
    echo "skipped, $2: $1"
}
if ! command -v actionlint >/dev/null && command -v go >/dev/null; then
    GOBIN=$tools/bin go install "github.com/rhysd/actionlint/cmd/actionlint@v$actionlint" 2>/dev/null || true
fi
if ! command -v zizmor >/dev/null || ! command -v check-jsonschema >/dev/null; then
    "${PYTHON:-python3}" -m venv "$tools/venv" &&
        "$tools/venv/bin/python" -m pip install --quiet --disable-pip-version-check --require-hashes \
            --requirement python/requirements-workflows.txt || true
fi
if command -v actionlint >/dev/null; then
    actionlint
    echo "workflows: actionlint finds nothing"
else
    skip "workflows" "actionlint is missing (go install github.com/rhysd/actionlint/cmd/actionlint@v$actionlint)"
fi
if command -v check-jsonschema >/dev/null; then
    schema() { # its name, files
        local said
        said=$(check-jsonschema --builtin-schema "vendor.$1" "${@:2}" 2>&1) || { echo "$said" >&2; exit 1; }
    }
    schema dependabot .github/dependabot.yml
    schema github-workflows .github/workflows/*.yml
    schema github-issue-config .github/ISSUE_TEMPLATE/config.yml
    schema github-issue-forms .github/ISSUE_TEMPLATE/{bug,idea}.yml
    schema citation-file-format CITATION.cff
    echo "issue forms, Dependabot's file, CITATION.cff: as their schemas have them"
else
    skip "issue forms, CITATION.cff" "check-jsonschema is missing (pip install check-jsonschema)"
fi
if command -v zizmor >/dev/null; then
    zizmor --offline --quiet --no-progress --strict-collection .github >"$tools/said" 2>&1 || { cat "$tools/said" >&2; exit 1; }
    echo "workflows and Dependabot's file: zizmor finds nothing"
else
    skip "workflows" "zizmor is missing (pip install zizmor)"
fi
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)".*/\1/p' Cargo.toml)
grep -qx "version: $version" CITATION.cff || { echo "CITATION.cff has another version than Cargo.toml, $version" >&2; exit 1; }
