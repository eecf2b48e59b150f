#!/usr/bin/env python3
"""Calls the compiler for cargo, and says what it took.

    RUSTC_WRAPPER=scripts/measure/rustc_seconds.py COMPILED=compiled.txt cargo build

A line for each crate is added to the file COMPILED: its name and CPU seconds. Seconds on the clock would
depend on what else is compiled at the same time.
"""

import os
import resource
import subprocess
import sys

code = subprocess.call(sys.argv[1:], close_fds=False)  # with the jobserver of cargo
used = resource.getrusage(resource.RUSAGE_CHILDREN)
if "--crate-name" in sys.argv:  # else cargo asks for the version
    name = sys.argv[sys.argv.index("--crate-name") + 1]
    with open(os.environ["COMPILED"], "a", encoding="utf-8") as file:
        file.write(f"{name} {used.ru_utime + used.ru_stime:.3f}\n")
sys.exit(code)
