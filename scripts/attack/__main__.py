"""Attacks the built program and the installed package, prints one table, and ends with 1 if anything failed.

`make attack` is quick; `make attack-long` tries more, from another seed. `--only toml,mcap` runs some campaigns.
Every failure names what makes it fail again: an input file in out/attack, or the command.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import bombs
import closed_loop
import files
import firmware
import leaks
import live
import loss
import mcap_mutants
import measured
import pickles
import snapshots
from campaign import Campaign, Setting, faults, run

TOP = Path(__file__).resolve().parents[2]


def built(folder: Path) -> tuple[Path, Path]:
    """The command and the Rust campaign, as `make test` builds them: with overflow checks."""
    # A test of the command's package makes Cargo build the command, with the features that all tests share.
    profile = ["--release", "--config", "scripts/test_profile.toml"]
    cargo = ["cargo", "test", "--locked", *profile, "--no-run", "--test", "attack", "--test", "commands"]
    cargo.append("--message-format=json")
    lines = subprocess.run(cargo, cwd=TOP, stdout=subprocess.PIPE, check=True, text=True).stdout.splitlines()
    made = [json.loads(line) for line in lines if '"executable":"' in line]
    paths = {item["target"]["name"]: Path(item["executable"]) for item in made}
    # A copy, because other builds replace it.
    folder.mkdir()
    return Path(shutil.copy(paths["omnistep"], folder)), paths["attack"]


def in_rust(setting: Setting, attack: Path) -> list[Campaign]:
    """The corpus, Drive and link under random bits; a process each, because memory that is not there ends one."""
    campaigns = []
    for words in [*(["corpus", folder.name] for folder in sorted((TOP / "fuzz/corpus").iterdir())), ["random"]]:
        table = setting.work / f"{'-'.join(words)}.jsonl"
        arguments = ["--seed", setting.seed, "--times", 20 if setting.long else 1, "--table", table, *words]
        running = setting.keep / "running"
        running.unlink(missing_ok=True)
        # 1: some of it failed, and the table says what.
        ended = run([attack, *arguments], TOP, seconds=7200 if setting.long else 600)
        if ended.code not in (0, 1):
            inputs = running.read_text() if running.exists() else "before the first input"
            wrong = f"{'; '.join(faults(ended))}: {inputs}: {ended.command}"
            campaigns.append(Campaign(": ".join(words), 1, "runs", [wrong]))
            continue
        said = ended.out.splitlines()
        for row in map(json.loads, table.read_text().splitlines()):
            failures = [line for line in said if line.startswith(row["campaign"] + ": ")]
            campaigns.append(Campaign(row["campaign"], row["tried"], row["unit"], failures))
    return campaigns


def main() -> int:
    """Runs the campaigns and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--long", action="store_true", help="ten to twenty times as many")
    parser.add_argument("--seed", type=int, default=1, help="of the random bits and mutants")
    parser.add_argument("--only", default="", metavar="NAMES", help="of campaigns, with commas between")
    arguments = parser.parse_args()
    keep = TOP / "out/attack"
    shutil.rmtree(keep, ignore_errors=True)
    work = keep / "work"
    work.mkdir(parents=True)
    omnistep, attack = built(work / "program")
    setting = Setting(omnistep, TOP, work, keep, arguments.seed, arguments.long)
    campaigns = {
        "rust": lambda: in_rust(setting, attack),
        "toml": lambda: files.toml(setting),
        "png": lambda: files.png(setting),
        "mcap": lambda: mcap_mutants.campaigns(setting),
        "parquet": lambda: files.parquet(setting),
        "measured": lambda: measured.campaigns(setting),
        "pickles": lambda: pickles.campaigns(setting),
        "bombs": lambda: bombs.campaigns(setting),
        "snapshots": lambda: snapshots.campaigns(setting),
        "sensors": lambda: closed_loop.sensors(setting),
        "stops": lambda: closed_loop.stops(setting),
        "safety": lambda: closed_loop.safety(setting),
        "firmware": lambda: firmware.campaigns(setting, attack),
        "live": lambda: live.campaigns(setting),
        "loss": lambda: loss.campaigns(setting),
        "leaks": lambda: leaks.campaigns(setting),
    }
    only = [name for name in arguments.only.split(",") if name]
    if unknown := set(only) - set(campaigns):
        parser.error(f"--only {','.join(sorted(unknown))}: allowed are {', '.join(campaigns)}")
    rows: list[tuple[Campaign, float]] = []
    for name, campaign in campaigns.items():
        if only and name not in only:
            continue
        start = time.monotonic()
        done = campaign()
        took = time.monotonic() - start
        rows += [(one, took / len(done)) for one in done]
        for one in done:
            for failure in one.failures:
                print(f"FAILED {one.name}: {' '.join(failure.split())}".replace(f"{TOP}/", ""), flush=True)
    width = max(len(one.name) for one, _ in rows)
    print(f"\n{'campaign':{width}} {'tried':>16} {'passed':>8} {'failed':>7} {'s':>6}")
    for one, took in rows:
        tried, failed = f"{one.tried} {one.unit}", len(one.failures)
        print(f"{one.name:{width}} {tried:>16} {max(one.tried - failed, 0):>8} {failed:>7} {took:>6.1f}")
        for note in one.notes:
            print(f"  {note}")
    if not any(one.failures for one, _ in rows):
        shutil.rmtree(work)
        return 0
    return 1


if __name__ == "__main__":
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # threads of a library that is not attacked take memory
    sys.exit(main())
