"""Stations of an alignment: the kilometres, in metres, that its file states along the curve, with their jumps.

A design file knows the distance along the curve; where kilometres do not continue it, as at a gap or an overlap of the
line's kilometres, it has an equation with the station behind and the station ahead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from .elements import Alignment

MIN_JUMP_M = 0.05
"""Smallest jump of the stations that becomes an equation, metres: kilometres come from an axis, on which a parallel
track gains or loses millimetres from element to element."""

SAME_PLACE_M = 1e-4
"""Places along the curve that differ by less are the same, metres: files have four decimals or more."""


@dataclass(frozen=True)
class Piece:
    """A part of the curve on which stations continue.

    Attributes
    ----------
    s : float
        Its start, metres along the curve.
    station : float
        Station of its start, metres.
    rises : bool
        Whether stations rise along the curve.
    """

    s: float
    station: float
    rises: bool = True

    def at(self, s: float) -> float:
        """Return the station of a place, metres."""
        return self.station + (s - self.s if self.rises else self.s - s)


@dataclass(frozen=True)
class Stations:
    """The stations along a curve.

    Attributes
    ----------
    pieces : tuple of Piece
        At least one, in order of `s`.

    Examples
    --------
    >>> stations = Stations((Piece(0.0, 1000.0), Piece(50.0, 1200.0)))
    >>> stations.ahead(50.0), stations.behind(50.0)
    (1200.0, 1050.0)
    """

    pieces: tuple[Piece, ...]

    def ahead(self, s: float) -> float:
        """Return the station of a place, metres; at a jump, that ahead."""
        return next((one for one in reversed(self.pieces) if one.s <= s + SAME_PLACE_M), self.pieces[0]).at(s)

    def behind(self, s: float) -> float:
        """Return the station of a place, metres; at a jump, that behind."""
        return next((one for one in reversed(self.pieces) if one.s < s - SAME_PLACE_M), self.pieces[0]).at(s)


def stations_of(alignment: Alignment) -> Optional[Stations]:
    """Return the stations that the kilometres of the plan elements make; None if no element states a kilometre."""
    known = [one for one in alignment.plan if one.figures.km_from is not None]
    if not known:
        return None
    last = known[-1].figures.km_to if known[-1].figures.km_to is not None else known[-1].figures.km_from
    rises = last >= known[0].figures.km_from
    pieces: list[Piece] = []
    for one in known:
        piece = Piece(one.s_from, 1000.0 * one.figures.km_from, rises)
        if not pieces or abs(pieces[-1].at(piece.s) - piece.station) >= MIN_JUMP_M:
            pieces.append(piece)
    start = Piece(alignment.s_from, pieces[0].at(alignment.s_from), rises)
    return Stations((start, *pieces[1:]))

