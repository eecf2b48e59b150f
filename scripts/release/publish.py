"""Uploads every crate that is to be published to crates.io; `scripts/package.sh --publish` calls it.

Not run by us so far: a test runs it with a program in cargo's place. Crates come after those that they need. A version
that the index has is left out, so the same command goes on where another one stopped. crates.io takes five new crates
at once and then one in ten minutes: where it says so, the upload is tried again after ten minutes.
"""

import json
import subprocess
import sys
import time
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WAIT_S = 610
TRIES = 12


def crates() -> dict[str, str]:
    """Names and versions of the crates to publish, each after those that it needs."""
    command = ["cargo", "metadata", "--locked", "--no-deps", "--format-version", "1"]
    said = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    packages = {each["name"]: each for each in json.loads(said)["packages"] if each["publish"] is None}
    needs = {
        # What tests need without a version, such as the crate itself with more features, is not in the package.
        name: [d["name"] for d in each["dependencies"] if d["name"] in packages and d["req"] != "*"]
        for name, each in packages.items()
    }
    return {name: packages[name]["version"] for name in TopologicalSorter(needs).static_order()}


def is_there(name: str, version: str) -> bool:
    """Does the index have this version?"""
    command = ["cargo", "info", "--quiet", "--registry", "crates-io", f"{name}@{version}"]
    # In the root folder, because in the repository the answer would be about the crate here.
    asked = subprocess.run(command, cwd=ROOT.anchor, capture_output=True, text=True)
    if asked.returncode == 0:
        return True
    if "could not find" in asked.stderr:
        return False
    sys.exit(f"{name} {version}: the index cannot be read: {asked.stderr.strip()}")


def upload(name: str) -> None:
    """Upload a crate; wait where the registry asks for it."""
    for tried in range(1, TRIES + 1):
        # `scripts/package.sh --verify` came before.
        command = ["cargo", "publish", "--locked", "--no-verify", "--package", name]
        ended = subprocess.run(command, cwd=ROOT, stderr=subprocess.PIPE, text=True)
        print(ended.stderr, end="", file=sys.stderr)
        if ended.returncode == 0:
            return
        said = ended.stderr.lower()
        if ("429" not in said and "too many requests" not in said) or tried == TRIES:
            sys.exit(f"{name} was not uploaded; run scripts/package.sh --publish again to go on with it")
        print(f"{name}: the registry takes no more crates now; again in {WAIT_S} s", flush=True)
        time.sleep(WAIT_S)


def main() -> None:
    """Upload what is not there."""
    for name, version in crates().items():
        if is_there(name, version):
            print(f"{name} {version} is there", flush=True)
        else:
            upload(name)
            print(f"{name} {version} is uploaded", flush=True)


if __name__ == "__main__":
    main()
