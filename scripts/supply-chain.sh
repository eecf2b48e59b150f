#!/usr/bin/env bash
# Licences, duplicates and sources of every Rust dependency, as deny.toml has them; known
# vulnerabilities too where the database can be reached.
set -euo pipefail
cd "$(dirname "$0")/.."
version=0.20.2
if [ "$(cargo deny --version 2>/dev/null)" != "cargo-deny $version" ]; then
    echo "installing cargo-deny $version (takes some minutes once)"
    # Unoptimised: it runs for seconds, and compiles in a third of the time.
    CARGO_PROFILE_DEV_DEBUG=0 cargo install --quiet --locked --profile dev "cargo-deny@$version"
fi
deny() { cargo deny --config deny.toml --log-level error --locked --manifest-path "$@"; }
# An exception that is no longer needed is also an error.
deny Cargo.toml --workspace check --deny unmatched-skip --deny unnecessary-skip licenses bans sources
# Duplicates in images cost nothing that their budgets do not show.
deny firmware/Cargo.toml check licenses sources
database=https://github.com/rustsec/advisory-db
if git ls-remote --quiet --exit-code "$database" HEAD >/dev/null 2>&1; then
    deny Cargo.toml --workspace check advisories
    deny firmware/Cargo.toml check advisories
else
    echo "skipped, $database cannot be reached: known vulnerabilities"
fi
