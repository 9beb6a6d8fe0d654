"""What a number of a design may be, or of what is placed by one: places, kilometres, lengths, radii, cants, turns.

A file may state any number. One that no railway has is refused where it is read, with the name of what states it:
further on, it would end in a traceback, in minutes of computing, or in a file that is wrong without a word.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional

from .errors import DesignNumberError

MAX_PLACE_M = 1e9
"""Largest coordinate, height or station, metres: twenty-five times round the earth, and exact to a micrometre."""

MAX_KM = MAX_PLACE_M / 1000.0
"""Largest kilometre: that of the largest station."""

MAX_LENGTH_M = 1e7
"""Longest element or line, metres: more than the longest railway, and a million places 10 m apart."""

MAX_CANT_M = 1.0
"""Largest cant, metres: six times that of any track."""

MAX_GRADE = 2.0
"""Steepest gradient: the steepest funicular climbs at 1.3."""

MAX_TURNS = 100.0
"""Most revolutions of an element: a helix has a few, and a radius in another unit than metres makes thousands."""

QUOTED = 40
"""Characters of a text that a message quotes."""


@dataclass(frozen=True)
class Kind:
    """A kind of numbers between `low` and `high`, in the unit in which they are stated; `zero` says if one may be 0.

    Messages say what such a number may be with `says`.
    """

    low: float
    high: float
    says: str
    zero: bool = True

    def holds(self, value: float) -> bool:
        """Return whether a number is of this kind; NaN and infinity are not."""
        return self.low <= value <= self.high and (self.zero or value != 0.0)


NUMBER = Kind(-MAX_PLACE_M, MAX_PLACE_M, f"numbers of a design are between {-MAX_PLACE_M:,.0f} and {MAX_PLACE_M:,.0f}")
WHOLE = Kind(-(2**31), 2**31 - 1, f"whole numbers are between {-(2**31)} and {2**31 - 1}")
KM = Kind(-MAX_KM, MAX_KM, f"kilometres are between {-MAX_KM:,.0f} and {MAX_KM:,.0f}")
LENGTH = Kind(0.0, MAX_LENGTH_M, f"lengths are above 0 and up to {MAX_LENGTH_M / 1000:,.0f} km", zero=False)
RADIUS = Kind(
    -MAX_PLACE_M, MAX_PLACE_M, f"radii are up to {MAX_PLACE_M:,.0f} m and never 0, and a straight has none", zero=False
)
GRADE = Kind(-MAX_GRADE, MAX_GRADE, f"gradients are up to {1000 * MAX_GRADE:g} per mille")
GRADE_PM = Kind(1000 * GRADE.low, 1000 * GRADE.high, GRADE.says)
CANT_MM = Kind(-1000 * MAX_CANT_M, 1000 * MAX_CANT_M, f"cants are up to {1000 * MAX_CANT_M:g} mm")
TURNS = Kind(0.0, MAX_TURNS, f"an element turns by up to {MAX_TURNS:g} revolutions")


def checked(value: float, kind: Kind, where: str, name: str) -> float:
    """Return a number if it is of a kind, else raise a DesignNumberError that names `name` and `where` it stands.

    Examples
    --------
    >>> checked(12.5, LENGTH, "Curve 3", "length")
    12.5
    """
    if kind.holds(value):
        return value
    raise DesignNumberError(f"{where} has the {name} {value:.10g}, but {kind.says}: correct it.")


def check_turn(length_m: float, k_from: float, k_to: float, where: str) -> None:
    """Refuse an element, with curvatures in 1/m at its ends, that turns more often than any: drawing it takes hours."""
    checked(0.5 * length_m * (abs(k_from) + abs(k_to)) / math.tau, TURNS, where, "turn")


def number_in(value: object) -> Optional[float]:
    """Return the number in a field; NaN for what is not one, and None for an empty field.

    The fields of a CSV file may all be texts.

    >>> number_in(3), number_in(" 2.5"), number_in(""), number_in("R 300")
    (3.0, 2.5, None, nan)
    """
    if value is None or (isinstance(value, str) and not value.strip()):
        return None
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return float("nan")


def quoted(value: object) -> str:
    """Return a value of a field as messages show it, on one line and not too long."""
    text = repr(value)
    return text if len(text) <= QUOTED else f"{text[:QUOTED]}…"
