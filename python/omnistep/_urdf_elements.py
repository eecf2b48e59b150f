"""Elements of a URDF text and the numbers in them."""

from __future__ import annotations

import re
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]


# The standard parser: yourdfpy (200 MB with what it needs) repairs damaged files, lost masses and NaN in silence.
def parsed(text: str) -> ElementTree.Element:
    """Return the root element of a URDF; a ValueError if the text is not XML or declares a document type."""
    # Such files are from elsewhere: nothing in them may name other files or grow when it is read.
    if re.search(r"<!(DOCTYPE|ENTITY)", text):
        raise ValueError("the URDF declares entities, allowed: plain elements")
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"not a URDF: {error}") from error


def numbers(element: Any, name: str, default: str) -> _Floats:
    """Return an attribute's numbers, as many as in its default; a ValueError for another count, NaN or infinity."""
    text = default if element is None else element.get(name, default)
    try:
        found = np.array([float(word) for word in text.split()])
    except ValueError:
        found = np.array([])
    if found.shape != (len(default.split()),) or not np.isfinite(found).all():
        raise ValueError(f"{name} = {text!r}")
    return found


def sizes(element: Any, name: str, default: str) -> _Floats:
    """Return an attribute's numbers, as :func:`numbers`; a ValueError if one is not above 0."""
    found = numbers(element, name, default)
    if not (found > 0.0).all():
        raise ValueError(f"{name} = {element.get(name)!r}")
    return found


def turned(rpy: _Floats) -> _Floats:
    """Return the rotation about x, then y, then z, all fixed axes, as in URDF."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
