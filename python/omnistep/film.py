"""Pictures and films of logged runs."""






from os import PathLike

from typing import Any

from omnistep import plot
from omnistep._omnistep import read_mcap


def strip(path: str | PathLike[str], out: str | PathLike[str], *, every_s: float = 0.3) -> None:
    """Draw a logged run from the side, like figure 9 of the paper.

    Args:
        path: an MCAP log.
        out: the picture: png, svg or pdf.
        every_s: time between two points of the middle joint's way [s].

    Raises:
        LogError: the log cannot be read.
        ValueError: the time is not positive, or no picture has that ending.
        ImportError: matplotlib is not there: ``pip install "omnistep[plot]"``.
    """
    ax = plot.strip(read_mcap(path), every_s=every_s)
    figure: Any = ax.figure
    figure.savefig(out, dpi=150)
