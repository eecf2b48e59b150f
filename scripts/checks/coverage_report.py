"""Line coverage per file from an LCOV report, test code left out; exit code 1 below the minimum.

python scripts/checks/coverage_report.py REPORT --minimum PERCENT
"""

import argparse
import re
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_code(path: Path) -> tuple[set[int], list[Path]]:
    """Lines of a formatted Rust file that stand under `#[cfg(test)]`, and the modules kept elsewhere that do."""
    lines = path.read_text(encoding="utf-8").splitlines()
    inside: set[int] = set()
    elsewhere: list[Path] = []
    number = 0
    while number < len(lines):
        indent, attribute, _ = lines[number].partition("#[cfg(test)]")
        first = number
        number += 1
        if not attribute or indent.strip():
            continue
        # The item ends where a line at its own indent closes a brace, or with a semicolon.
        while number < len(lines) and not re.match(indent + r"(?:\}|[^\s/#].*;$|[^\s/#].*\}$)", lines[number]):
            number += 1
        inside |= set(range(first + 1, number + 2))
        if module := re.match(r"\s*(?:pub.* )?mod (\w+);", lines[min(number, len(lines) - 1)]):
            folder = path.parent if path.stem in ("lib", "main", "mod") else path.with_suffix("")
            elsewhere += [folder / f"{module[1]}.rs", folder / module[1] / "mod.rs"]
        number += 1
    return inside, elsewhere


def executed(report: Path) -> dict[Path, dict[int, int]]:
    """How often each line of each file ran."""
    counts: dict[Path, dict[int, int]] = defaultdict(dict)
    source = Path()
    for line in report.read_text(encoding="utf-8").splitlines():
        key, _, value = line.partition(":")
        if key == "SF":
            source = Path(value)
        elif key == "DA":
            number, count = map(int, value.split(",")[:2])
            counts[source][number] = counts[source].get(number, 0) + count
    return counts


def ranges(numbers: list[int]) -> str:
    """Line numbers as `3-5, 9`."""
    spans: list[list[int]] = []
    for number in numbers:
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in spans)


def main() -> int:
    """Prints the table; 1 if too little ran."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("report", type=Path)
    parser.add_argument("--minimum", type=float, required=True)
    arguments = parser.parse_args()
    counts = executed(arguments.report)
    tests = {path: test_code(path) for path in counts}
    left_out = {module for _, modules in tests.values() for module in modules}
    total = covered = 0
    for path in sorted(counts.keys() - left_out):
        lines = {n: count for n, count in counts[path].items() if n not in tests[path][0]}
        missed = sorted(n for n, count in lines.items() if count == 0)
        total += len(lines)
        covered += len(lines) - len(missed)
        if missed:
            share = 100 * (1 - len(missed) / len(lines))
            print(f"{path.relative_to(ROOT)}: {share:.1f} %, not run: {ranges(missed)}")
    if total == 0:
        print("no line of code was found in the report", file=sys.stderr)
        return 1
    percent = 100 * covered / total
    print(f"line coverage {percent:.2f} % ({covered} of {total} lines), at least {arguments.minimum:g} % wanted")
    return 0 if percent >= arguments.minimum else 1


if __name__ == "__main__":
    sys.exit(main())
