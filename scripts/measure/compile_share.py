"""How much longer a whole build took than the physics engine that it stands on, rapier3d with parry3d and nalgebra.

It reads cargo's own report of a build (`--timings`): the sum of what all crates took, divided by what those three took.
Both are of one build on one machine, so the ratio holds where seconds do not.

    python3 scripts/measure/compile_share.py target/cargo-timings/cargo-timing.html
"""

import json
import re
import sys
from pathlib import Path

REFERENCE = {"rapier3d-f64", "parry3d-f64", "nalgebra"}


def share(report: str) -> float:
    """The ratio. ValueError where the text has no units, or the reference is not among them."""
    found = re.search(r"^const UNIT_DATA = (\[.*?^\]);", report, re.MULTILINE | re.DOTALL)
    if not found:
        raise ValueError("no UNIT_DATA: is this cargo's report of a build?")
    units = json.loads(found[1])
    missing = REFERENCE - {unit["name"] for unit in units}
    if missing:
        raise ValueError(f"not compiled in this build: {', '.join(sorted(missing))}")
    took = [(unit["name"], unit["duration"]) for unit in units]
    return sum(time for _, time in took) / sum(time for name, time in took if name in REFERENCE)


if __name__ == "__main__":
    try:
        print(f"{share(Path(sys.argv[1]).read_text(encoding='utf-8')):.3f}")
    except (OSError, ValueError) as error:
        sys.exit(f"{sys.argv[1]}: {error}")
