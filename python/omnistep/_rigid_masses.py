"""Places and masses of rigid parts: turned, moved and joined."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]


class Place(NamedTuple):
    """Pose of a frame in another.

    Attributes:
        turn: rotation of vectors from the frame into the other frame, (3, 3).
        at_m: its origin in the other frame, (3,).
    """

    turn: _Floats
    at_m: _Floats

    @staticmethod
    def middle() -> Place:
        """The frame itself."""
        return Place(np.eye(3), np.zeros(3))

    def point(self, point_m: _Floats) -> _Floats:
        """A point of the frame in the other frame, (3,)."""
        return self.turn @ point_m + self.at_m

    def then(self, inner: Place) -> Place:
        """The place of a frame that is placed in this one."""
        return Place(self.turn @ inner.turn, self.point(inner.at_m))


class Mass(NamedTuple):
    """A rigid mass.

    Attributes:
        mass_kg: its mass.
        com_m: its centre of mass, (3,).
        inertia_kg_m2: its inertia about that centre, (3, 3).

    Two halves of a rod of 2 kg, 0.5 m from its middle:

    >>> import numpy as np
    >>> from omnistep._rigid_masses import Mass
    >>> halves = [Mass(1.0, np.array([x, 0.0, 0.0]), np.zeros((3, 3))) for x in (-0.5, 0.5)]
    >>> float(Mass.joined(halves).inertia_kg_m2[2, 2])
    0.5
    """

    mass_kg: float
    com_m: _Floats
    inertia_kg_m2: _Floats

    @staticmethod
    def nothing() -> Mass:
        """No mass."""
        return Mass(0.0, np.zeros(3), np.zeros((3, 3)))

    @staticmethod
    def joined(parts: Iterable[Mass]) -> Mass:
        """All parts as one, by the theorem of parallel axes."""
        parts = [part for part in parts if part.mass_kg > 0.0]
        if not parts:
            return Mass.nothing()
        mass = sum(part.mass_kg for part in parts)
        com = np.sum([part.mass_kg * part.com_m for part in parts], axis=0) / mass
        about = [part.inertia_kg_m2 + part.mass_kg * _spread(part.com_m - com) for part in parts]
        return Mass(mass, com, np.sum(about, axis=0))

    def moved(self, place: Place) -> Mass:
        """The mass of a frame as it is in the frame that this place is in."""
        return Mass(self.mass_kg, place.point(self.com_m), place.turn @ self.inertia_kg_m2 @ place.turn.T)

    def about(self, point_m: _Floats, axis: _Floats) -> float:
        """Its moment of inertia about an axis through a point [kg.m^2]; the axis is a unit vector."""
        whole = self.inertia_kg_m2 + self.mass_kg * _spread(self.com_m - point_m)
        return float(axis @ whole @ axis)

    def box_squares_m2(self) -> _Floats:
        """Squares of the edges of the solid box with these moments [m^2], (3,): below 0 if there is none."""
        moments = np.diag(self.inertia_kg_m2)
        return np.asarray(6.0 * (moments.sum() - 2.0 * moments) / self.mass_kg)


def _spread(arm_m: _Floats) -> _Floats:
    """Inertia of 1 kg at an arm [m^2], (3, 3)."""
    return np.asarray(arm_m @ arm_m * np.eye(3) - np.outer(arm_m, arm_m))
