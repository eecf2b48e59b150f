"""Is this interpreter one that python/requirements-*.txt are for? Exit code 0 if so.

`scripts/tools/lock.sh` writes them.
"""

import platform
import sys

libc, version = platform.libc_ver()
fits = (
    sys.implementation.name == "cpython"
    and sys.version_info[:2] == (3, 11)
    and (sys.platform, platform.machine()) == ("linux", "x86_64")
    and libc == "glibc"
    and tuple(int(part) for part in version.split(".")[:2]) >= (2, 35)
)
sys.exit(not fits)
