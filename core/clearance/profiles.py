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

from ..errors import ParameterError
from ..progress import counted

CUSTOM = "CUSTOM"
"""Name of a profile that the user's file states."""

REFERENCE, LIMIT, SPACE, NO_RULE = "reference", "limit", "space", "none"
"""What an outline is, on which its widening in curves depends: the reference line of vehicles, the limit of the space
that must be free, a structure gauge, or one whose source states no widening."""

TABLE = Path(__file__).with_name("profiles.csv")

COLUMNS = ("v_m", "w_m")
"""Columns of the user's file: metres to the left of the middle of the track, and above the tops of the rails."""

MAX_M = 20.0
"""Larger coordinates are not in metres: the widest gauge in use is 6 m high."""

LEAST_POINTS = 3
"""Fewer points make no outline."""

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


def custom(points: Sequence[tuple[float, float]], name: str) -> Profile:
    """Make a profile from the points of the user's file of that name: v and w in metres.

    With all v >= 0 they are a half from its foot to its top; else the whole outline. Raises `ParameterError` if there
    are too few points, they are not in metres, or the outline crosses itself.
    """
    ring = list(dict.fromkeys(points)) if points and points[0] == points[-1] else list(points)
    if len(ring) < LEAST_POINTS:
        found = counted(len(ring), "point")
        raise ParameterError(f"PROFILE_FILE {name} has {found}: an outline needs {LEAST_POINTS} or more.")
    if any(not max(abs(v), abs(w)) <= MAX_M for v, w in ring):
        raise ParameterError(
            f"PROFILE_FILE {name} has coordinates above {MAX_M:g} m: are these millimetres? Give metres."
        )
    said = None
    if all(v >= 0 for v, _ in ring):
        if ring[-1][0] > 0:
            said = (
                f"The half outline of {name} does not end at v = 0: it was closed at its top, {ring[-1][1]:g} m high."
            )
            ring.append((0.0, ring[-1][1]))
        ring = list(mirrored(ring))
    if _crosses_itself(ring):
        raise ParameterError(f"The outline in PROFILE_FILE {name} crosses itself: give its points in order.")
    return Profile(CUSTOM, tuple(ring), REFERENCE, name, said)


def _crosses_itself(ring: Sequence[tuple[float, float]]) -> bool:
    """Return whether two edges of a ring that are not neighbours meet; outlines have few edges."""
    edges = list(zip(ring, [*ring[1:], ring[0]]))
    last = len(edges) - 1
    return any(_meet(*edges[i], *edges[j]) for i in range(last) for j in range(i + 2, last + 1) if (i, j) != (0, last))


def _meet(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float]) -> bool:
    """Return whether the segments a-b and c-d cross."""

    def turn(p: tuple[float, float], q: tuple[float, float], r: tuple[float, float]) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    return turn(a, b, c) * turn(a, b, d) < 0 and turn(c, d, a) * turn(c, d, b) < 0
