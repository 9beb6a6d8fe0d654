"""Profiles: the outlines of structure gauges that a public source prints, and those of the user's files.

`profiles.csv` holds the named ones with their sources. This module needs no numpy, so that the toolbox can list them.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Optional

CUSTOM = "CUSTOM"
"""Name of a profile that the user's file states."""

REFERENCE, LIMIT, SPACE, NO_RULE = "reference", "limit", "space", "none"
"""What an outline is, on which its widening in curves depends: the reference line of vehicles, the limit of the space
that must be free, a structure gauge, or one whose source states no widening."""

TABLE = Path(__file__).with_name("profiles.csv")

COLUMNS = ("v_m", "w_m")
"""Columns of the user's file: metres to the left of the middle of the track, and above the tops of the rails."""

Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Profile:
    """An outline across the track, in the plane of both rail tops.

    `points` are v and w of a closed ring, metres, of which the first is not repeated. For its rule see `REFERENCE`;
    `source` is where the numbers are printed, and `said` what was done to the points of a file.
    """

    name: str
    points: Points
    rule: str
    source: str
    said: Optional[str] = None

    @property
    def half_width_m(self) -> float:
        """Largest distance of the outline from the middle of the track."""
        return max(abs(v) for v, _ in self.points)

    @property
    def height_m(self) -> float:
        """Height of the top."""
        return max(w for _, w in self.points)

    @property
    def is_of_ebo(self) -> bool:
        """Whether the profile is one of the German regulations, whose least distance of tracks then applies."""
        return self.name.startswith("EBO")


@lru_cache(maxsize=1)
def named() -> dict[str, Profile]:
    """Return the profiles that `profiles.csv` names."""
    rows: dict[str, list[dict[str, str]]] = {}
    with TABLE.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            rows.setdefault(row["profile"], []).append(row)
    return {
        name: Profile(
            name,
            mirrored([(float(row["v_mm"]) / 1000, float(row["w_mm"]) / 1000) for row in own]),
            own[0]["widening"],
            own[0]["source"],
        )
        for name, own in rows.items()
    }


def mirrored(half: Sequence[tuple[float, float]]) -> Points:
    """Return the ring of a half outline that ends at v = 0, from its foot to its top.

    >>> mirrored([(1.0, 0.4), (1.0, 3.0), (0.0, 4.0)])
    ((1.0, 0.4), (1.0, 3.0), (0.0, 4.0), (-1.0, 3.0), (-1.0, 0.4))
    """
    other = [(-v, w) for v, w in reversed(half) if v > 0]
    return (*half, *other)
