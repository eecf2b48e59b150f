"""Progress bars: in a terminal or in a notebook, and none where no one looks."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

#: A call that is done by then shows no bar.
SHORT_S = 1.0


def is_seen() -> bool:
    """Does anybody look? Standard error is a terminal, or the kernel of a notebook runs this."""
    try:
        if sys.stderr.isatty():
            return True
    except (AttributeError, ValueError):  # there is none, or it is closed
        pass
    ipython = sys.modules.get("IPython")
    return ipython is not None and getattr(ipython.get_ipython(), "kernel", None) is not None


class Unseen:
    """A bar of tqdm that does nothing, without tqdm, which loads for longer than most of this package."""

    n = 0.0

    def __enter__(self) -> "Unseen":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def update(self, n: float = 1.0) -> None:
        """Ignore what is done."""

    def set_postfix_str(self, s: str = "", refresh: bool = True) -> None:
        """Ignore what is to be shown."""


def counter(*, shown: bool, **options: Any) -> Any:
    """Return a bar of tqdm with these options; in a notebook it is a widget, where no one looks it does nothing."""
    if not (shown and is_seen()):
        return Unseen()
    from tqdm.auto import tqdm

    return tqdm(delay=SHORT_S, **options)


@contextmanager
def bar(label: str, *, shown: bool) -> Iterator[Callable[[float], None]]:
    """A progress bar and its function of the part done, 0 to 1."""
    layout = "{desc}: {percentage:3.0f}% |{bar}| {elapsed}, {remaining} to go"
    with counter(shown=shown, total=1.0, desc=label, leave=False, bar_format=layout) as bar:

        def advance(part: float) -> None:
            bar.update(part - bar.n)

        yield advance
