"""One thread for the linear algebra of fits, whose matrices are tall and narrow: more threads wait for each other."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from threading import Lock
from typing import Any

from omnistep._estimates import scipy_part


class _Limit:
    """A limit of the whole process, from the first call that needs it to the end of the last one."""

    def __init__(self) -> None:
        self._lock, self._users = Lock(), 0
        self._limits: Any = None

    def enter(self) -> None:
        try:
            limits = import_module("threadpoolctl").threadpool_limits
        except ImportError:  # slower, and the same numbers
            return
        with self._lock:
            self._users += 1
            if self._users == 1:
                self._limits = limits(1, "blas")

    def leave(self) -> None:
        with self._lock:
            self._users = max(0, self._users - 1)
            if self._users == 0 and self._limits is not None:
                self._limits.restore_original_limits()
                self._limits = None


_LIMIT = _Limit()


@contextmanager
def one_thread(needed_by: str) -> Iterator[None]:
    """Let NumPy and SciPy compute in one thread meanwhile.

    >>> import omnistep._blas_threads as blas
    >>> with blas.one_thread("an example"):
    ...     pass
    """
    # A library that is loaded later would have its own threads.
    scipy_part("linalg", needed_by)
    _LIMIT.enter()
    try:
        yield
    finally:
        _LIMIT.leave()
