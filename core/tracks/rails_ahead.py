"""The rails beyond the ends of paired sections: how far they continue, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import interpolate, left_normals, length_along
from ..rails import RailLine
from .pairing import RailPair


@dataclass(frozen=True)
class RailAhead:
    """A rail seen outwards from the end of a section.

    Attributes
    ----------
    line : (n, 2) array
        The rail in plan.
    along : (n,) array
        Chainage of its vertices.
    end_m : float
        Chainage of the end of the section.
    sense : int
        1 if chainages increase outwards, otherwise -1.
    """

    line: np.ndarray
    along: np.ndarray
    end_m: float
    sense: int

    @classmethod
    def of(cls, rail: RailLine, span: tuple[float, float], end: int) -> RailAhead:
        """Return a rail seen from the start (`end` 0) or from the end (1) of a section.

        Parameters
        ----------
        rail : RailLine
        span : tuple of float
            Chainages of the section's start and end along the rail.
        end : int
        """
        line = rail.xyz[:, :2]
        return cls(line, length_along(line), span[end], 1 if span[end] > span[1 - end] else -1)

    @property
    def beyond_m(self) -> float:
        """Length of the rail beyond the section."""
        return float(self.along[-1] - self.end_m if self.sense > 0 else self.end_m)

    def at(self, ahead_m: np.ndarray, left_m: float = 0.0) -> np.ndarray:
        """Return places along the rail, (n, 2).

        Parameters
        ----------
        ahead_m : (n,) array
            Distances beyond the end of the section; negative ones are inside it.
        left_m : float
            Offset from the rail, to the left as seen outwards.
        """
        places = interpolate(self.line, self.along, self.end_m + self.sense * ahead_m)
        return places + left_m * left_normals(places) if left_m else places


def rails_ahead(rails: Sequence[RailLine], pair: RailPair, end: int) -> tuple[RailAhead, RailAhead]:
    """Return the left and the right rail of a section, seen from its start (`end` 0) or its end (1).

    Left and right refer to the direction of the section.

    Parameters
    ----------
    rails : sequence of RailLine
    pair : RailPair
    end : int
    """
    return RailAhead.of(rails[pair.left], pair.left_span, end), RailAhead.of(rails[pair.right], pair.right_span, end)


def runs_on(span: tuple[float, float], following: tuple[float, float]) -> bool:
    """Return whether a rail leads forwards from one section to the following one.

    Parameters
    ----------
    span, following : tuple of float
        Chainages of start and end of both sections along the rail.
    """
    sense = span[1] - span[0]
    return sense * (following[1] - following[0]) > 0 and sense * (following[1] - span[1]) > 0
