"""Packs the simulation's WebAssembly module for npm, with the licences of what is linked into it.

python scripts/release/npm_package.py MODULE: writes out/npm/omnistep-VERSION.tgz. MODULE is the file that
`scripts/playground.sh` built, out/playground/omnistep.wasm. The package is tried in node before it is written. Needs
node and npm.
"""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import licences

ROOT = Path(__file__).resolve().parents[2]
FROM = ROOT / "packaging" / "npm"
OUT = ROOT / "out" / "npm"


def main() -> int:
    """Stage the files, run the example of the README with them, and pack them."""
    if len(sys.argv) != 2:
        print("usage: python scripts/release/npm_package.py MODULE", file=sys.stderr)
        return 2
    shutil.rmtree(OUT, ignore_errors=True)
    folder = OUT / "node_modules" / "omnistep"
    shutil.copytree(FROM, folder)
    shutil.copy(sys.argv[1], folder / "omnistep.wasm")
    for path in ("web/playground/engine.js", "LICENSE-MIT", "LICENSE-APACHE"):
        shutil.copy(ROOT / path, folder)
    texts = licences.collected("module", licences.WEBASSEMBLY)
    (folder / licences.NAME).write_text(texts, encoding="utf-8", newline="\n")
    named = json.loads((folder / "package.json").read_text(encoding="utf-8"))["files"]
    if missing := [name for name in named if not (folder / name).is_file()]:
        sys.exit(f"packaging/npm/package.json names files that are not there: {', '.join(missing)}")
    # As a user has it: installed beside a program, which is the README's.
    example = re.findall(r"```js\n(.*?)```", (FROM / "README.md").read_text(encoding="utf-8"), re.DOTALL)[0]
    (OUT / "example.mjs").write_text(example, encoding="utf-8")
    subprocess.run(["node", "example.mjs"], cwd=OUT, check=True)
    command = ["npm", "pack", "--silent", "--pack-destination", str(OUT)]
    subprocess.run(command, cwd=folder, check=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
