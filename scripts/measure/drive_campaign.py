"""Writes the table of docs/drive.md: runs of the firmware's drive with random faults, judged by laws.

Half a minute once the example is built. The exit code is 1 if a law is broken.
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "drive.md"


def main() -> None:
    """Run, write, and say whether every law held."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=300, help="seeds, from 0")
    parser.add_argument("--check", action="store_true", help="write nothing: the page must have the table already")
    arguments = parser.parse_args()
    cargo = ["cargo", "run", "--locked", "--quiet", "--release", "--example", "drive_campaign", "--"]
    command = [*cargo, str(arguments.runs), "--seeds"]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    page = PAGE.read_text(encoding="utf-8")
    written, found = re.subn(r"\| ground, vehicle \|.*\n(?:\|.*\n)*", lambda _: done.stdout, page)
    assert found == 1, "docs/drive.md has no table that begins with | ground, vehicle |"
    print(done.stdout, end="")
    if not arguments.check:
        PAGE.write_text(written, encoding="utf-8")
    elif written != page:
        print("docs/drive.md has another table: scripts/measure/drive_campaign.py writes it anew", file=sys.stderr)
        sys.exit(1)
    sys.exit(done.returncode)


if __name__ == "__main__":
    main()
