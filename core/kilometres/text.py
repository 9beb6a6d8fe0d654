"""Kilometres as text, in the ways in which railways write them, and read back."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

HECTOMETRES, KILOMETRES, GERMAN, MILES = "HECTOMETRES", "KILOMETRES", "GERMAN", "MILES"

KM_OF_MILE, M_OF_YARD = 1.609344, 0.9144
"""International mile in kilometres, and yard in metres."""

WRITTEN = re.compile(r"\s*([+-]?\d+(?:[.,]\d*)?)\s*(?:\+\s*(\d+(?:[.,]\d*)?))?\s*")
"""Kilometres with decimals, or kilometres or hectometres plus metres; the decimal sign is a point or a comma."""


@dataclass(frozen=True)
class Notation:
    """A way to write kilometres: a round number of the line and the length from there.

    `base_km` is the distance between the round numbers, `unit_km` the unit of these, `step_m` that of the length from
    there, metres, and `decimals` are those of this length. `pattern` formats the round number in its own unit and the
    length; `comma` makes the decimal sign a comma.
    """

    base_km: float
    step_m: float
    decimals: int
    pattern: str
    unit_km: float = 1.0
    comma: bool = False


NOTATIONS = {
    HECTOMETRES: Notation(0.1, 1.0, 2, "{:.1f}+{:05.2f}"),
    KILOMETRES: Notation(1.0, 1.0, 2, "{:.0f}+{:06.2f}"),
    GERMAN: Notation(0.1, 1.0, 0, "{:.1f} + {:.0f}", comma=True),
    MILES: Notation(KM_OF_MILE, M_OF_YARD, 2, "{:.0f} mi {:.2f} yd", KM_OF_MILE),
}
"""12.3+45.67, 12+345.67, 12,3 + 45 and 7 mi 1180.52 yd."""


def write_km(km: float, notation: str, counts_from_km: float = math.inf) -> str:
    """Write a kilometre in a notation.

    In an overlap, numbers from the one from which the section behind this place counts again are written as a length
    from the last round number before it.

    >>> [write_km(12.34567, notation) for notation in NOTATIONS]
    ['12.3+45.67', '12+345.67', '12,3 + 46', '7 mi 1181.39 yd']
    >>> write_km(4.35, GERMAN, counts_from_km=4.3)
    '4,2 + 150'
    """
    one = NOTATIONS[notation]
    step_km = one.step_m / 1000
    steps = round(km / step_km, one.decimals)
    per_base = one.base_km / step_km
    # Rounding comes first, so that 12.39999 is 12.4+00.00 and not 12.3+100.00.
    base = math.floor(round(steps / per_base, 9))
    if km >= counts_from_km:
        base = min(base, math.ceil(round(counts_from_km / one.base_km, 9)) - 1)
    rest = abs(round(steps - base * per_base, one.decimals))
    text = one.pattern.format(base * one.base_km / one.unit_km + 0.0, rest)
    return text.replace(".", ",") if one.comma else text


def read_km(text: str) -> float | None:
    """Read a kilometre as a post or a list states it; None if the text is something else.

    >>> [read_km(text) for text in ("12.345", "12.3+45", "12,3 + 45", "12+345", "signal 7")]
    [12.345, 12.345, 12.345, 12.345, None]
    """
    found = WRITTEN.fullmatch(text)
    if found is None:
        return None
    km, metres = ((part or "0").replace(",", ".") for part in found.groups())
    return round(float(km) + float(metres) / 1000, 9)
