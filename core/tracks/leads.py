"""Rails seen out of the ends of matched stretches: how far they run on, and where they lead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import interpolate, left_normals, length_along
from ..rails import RailLine
from .pairing import RailPair


@dataclass(frozen=True)
class Lead:
    """A rail seen from the end of a stretch, outwards.

    Attributes
    ----------
    line : (n, 2) array
        The rail's plan.
    along : (n,) array
        Chainage of its vertices.
    end_m : float
        Chainage of the end.
    sense : int
        1 if chainages grow outwards, otherwise -1.
    """

    line: np.ndarray
    along: np.ndarray
    end_m: float
    sense: int

    @classmethod
    def of(cls, rail: RailLine, span: tuple[float, float], end: int) -> Lead:
        """Look out of the start (`end` 0) or the end (1) of a stretch."""
        line = rail.xyz[:, :2]
        return cls(line, length_along(line), span[end], 1 if span[end] > span[1 - end] else -1)

    @property
    def beyond_m(self) -> float:
        """How far the rail runs on."""
        return float(self.along[-1] - self.end_m if self.sense > 0 else self.end_m)

    def at(self, ahead_m: np.ndarray, left_m: float = 0.0) -> np.ndarray:
        """Places so far ahead of the end, (n,) metres, and to the left of the rail as seen outwards; (n, 2)."""
        places = interpolate(self.line, self.along, self.end_m + self.sense * ahead_m)
        return places + left_m * left_normals(places) if left_m else places


def leads(rails: Sequence[RailLine], pair: RailPair, end: int) -> tuple[Lead, Lead]:
    """Look out of one end of a stretch: its rails in the order left, right of the stretch's own direction."""
    return Lead.of(rails[pair.left], pair.left_span, end), Lead.of(rails[pair.right], pair.right_span, end)


def runs_on(span: tuple[float, float], following: tuple[float, float]) -> bool:
    """Tell whether a rail that leaves one stretch is the one that leads to the following, not back from it."""
    sense = span[1] - span[0]
    return sense * (following[1] - following[0]) > 0 and sense * (following[1] - span[1]) > 0
