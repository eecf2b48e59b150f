"""Writes what a wheel's signals are into the message's definition and the stub, from the table in wheel_signals.rs.

The exit code is 1 if docs/columns.md does not explain a signal.
"""

import argparse
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "crates" / "omni-sim" / "src" / "wheel_signals.rs"
MESSAGE = ROOT / "crates" / "omni-log" / "src" / "schemas" / "VehicleState.msg"
STUB = ROOT / "python" / "omnistep" / "_omnistep.pyi"
PAGE = ROOT / "docs" / "columns.md"
#: A row: its doc, its name, and where it is.
ROW = re.compile(r"^ +/// (.+)\n +(\w+): (log|trace) =", re.MULTILINE)
#: Position of the signals: the fields after the wheel's name, and the attributes before `touches`.
FIELDS = re.compile(r"(^string name\n)(?:# .+\nfloat64 \w+\n)+", re.MULTILINE)
ATTRIBUTES = re.compile(
    r"(\nclass Sample:\n.*?)    @property\n    def reference_rad_s\(.*?(?=    @property\n    def touches\()",
    re.DOTALL,
)


def attribute(name: str, doc: str) -> str:
    """A property of the stub; of `saturated` Python shows yes or no."""
    kind, doc = ("_Bools", "The request was outside the limits.") if name == "saturated" else ("_Floats", doc)
    return f'    @property\n    def {name}(self) -> {kind}:\n        """{doc}"""\n'


def main() -> int:
    """Write both, or compare them; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="writes nothing; the exit code is 1 if one is old")
    arguments = parser.parse_args()
    rows = ROW.findall(TABLE.read_text(encoding="utf-8"))
    fields = "".join(f"# {doc}\nfloat64 {name}\n" for doc, name, place in rows if place == "log")
    attributes = "".join(attribute(name, doc) for doc, name, _ in rows)
    old = 0
    for path, place, text in ((MESSAGE, FIELDS, fields), (STUB, ATTRIBUTES, attributes)):
        before = path.read_text(encoding="utf-8")
        after, found = place.subn(lambda at, text=text: at[1] + text, before)
        if found != 1:
            sys.exit(f"{path.relative_to(ROOT)}: the signals stand in {found} places, allowed: 1")
        if after == before:
            continue
        if arguments.check:
            print(f"{path.relative_to(ROOT)} has old signals: make generated")
            old = 1
        else:
            path.write_text(after, encoding="utf-8")
    page = PAGE.read_text(encoding="utf-8")
    for _, name, _ in rows:
        if f"`{name}`" not in page:
            print(f"docs/columns.md does not explain the signal `{name}`")
            old = 1
    return old


if __name__ == "__main__":
    sys.exit(main())
