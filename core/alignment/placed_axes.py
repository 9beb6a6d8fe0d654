"""Axes in the plane of a coordinate system, and what layers state of their kilometres."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..design_numbers import KM, number_in, quoted
from ..design_places import are_places
from ..errors import RailExtractError
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from ..rails import Kilometres, TrackGeometry
from .axis import locate
from .km_text import read_km
from .stations import Axes

NAME_FIELDS = ("axis", "name", "ref")
"""Fields of an axis layer that name an axis, the first one that exists."""

KM_FIELDS = ("km", "kilometre", "kilometer", "km_text", "station")
"""Fields of a post layer with the kilometre, the first one that exists, if none is chosen."""

BACK, AHEAD = "km_back", "km_ahead"
"""Fields of the table of jumps."""


@dataclass(frozen=True)
class PlacedAxes:
    """Axes in the plane of a coordinate system.

    Attributes
    ----------
    axes : Axes
        In metres from the zero of the coordinate system.
    unit_m : float
        Length of the unit of its coordinates.
    notation : str
        One of `km_text.NOTATIONS`.
    """

    axes: Axes
    unit_m: float
    notation: str

    def locate(self, xy: np.ndarray, progress: Progress = SILENT) -> Kilometres:
        """Find the kilometres of places, (n, 2) in coordinates of the system, and say what is in doubt."""
        for notice in self.axes.notices:
            progress.warning(notice)
        found = self.kilometres(xy, progress)
        beyond, ambiguous = int(np.isnan(found.km).sum()), sum(map(bool, found.ambiguous))
        if beyond:
            progress.warning(f"{beyond} of {len(xy)} places are beyond the ends of AXIS: their kilometres are empty.")
        if ambiguous:
            progress.warning(
                f"{ambiguous} of {len(xy)} places are nearly as close to another place of AXIS: check the kilometres "
                "of those whose field ambiguous is 1."
            )
        return found

    def on_map(self, xy: np.ndarray, ids: Sequence[int], progress: Progress) -> np.ndarray:
        """Return which places are on the map, (n,) bool, and warn of those that are not.

        Parameters
        ----------
        xy : (n, 2) array
            Coordinates of the system; NaN for a feature without a place, which needs no warning.
        ids : sequence of int
            Of the features.
        progress : Progress
        """
        known = are_places(xy, self.unit_m)
        lost = np.flatnonzero(~known & ~np.isnan(xy).any(axis=1))
        if len(lost):
            progress.warning(
                f"{len(lost)} of {len(xy)} features have coordinates outside of any map, such as feature "
                f"{ids[lost[0]]}: their kilometres are empty. Repair or delete them."
            )
        return known

    def along(
        self, tracks: Sequence[TrackGeometry], frame: LocalFrame, progress: Progress = SILENT
    ) -> tuple[TrackGeometry, ...]:
        """Return measured tracks with the kilometres of their stations, and say what is in doubt."""
        places = [frame.to_crs(track.xyz)[:, :2] for track in tracks]
        found = self.locate(np.concatenate([np.empty((0, 2)), *places]), progress)
        ends = np.cumsum([len(one) for one in places], dtype=int)
        own = (found.part(end - len(one), end) for one, end in zip(places, ends))
        return tuple(replace(track, kilometres=kilometres) for track, kilometres in zip(tracks, own))

    def kilometres(self, xy: np.ndarray, progress: Progress = SILENT) -> Kilometres:
        """Find the same, without a word."""
        return locate(self.axes.axes, xy * self.unit_m, self.notation, progress)


def post_field(names: Collection[str]) -> str:
    """Return the field of a post layer with the kilometre.

    Raises
    ------
    RailExtractError
        It has none of the usual ones.
    """
    found = next((one for one in KM_FIELDS if one in names), "")
    if not found:
        raise RailExtractError(
            f"POSTS has no field {', '.join(KM_FIELDS)}: choose the field with the kilometre in POST_FIELD."
        )
    return found


AXIS_IN_DEGREES = (
    "AXIS and INPUT are in degrees, where lengths can't be measured: reproject AXIS, for example to the UTM zone of "
    "the place."
)
"""Message where no plane is known."""


def check_jumps(names: Collection[str]) -> None:
    """Check that a table of jumps has its fields.

    Raises
    ------
    RailExtractError
        One is missing.
    """
    for name in (BACK, AHEAD):
        if name not in names:
            raise RailExtractError(
                f"JUMPS has no field {name}: give a table with {BACK}, the kilometre before each jump, and {AHEAD}, "
                "the one behind it."
            )


def km_of(value: object, field: str, name: str, feature: int) -> float:
    """Return the kilometre in a field, a number or a text such as 12.3+45.

    Parameters
    ----------
    value : object
    field : str
        Name of the field.
    name : str
        Name of the layer's parameter.
    feature : int
        Its id, for the message.

    Raises
    ------
    RailExtractError
        It is something else.
    """
    km = read_km(value) if isinstance(value, str) else number_in(value)
    if km is not None and KM.holds(km):
        return km
    what = "is empty" if value is None else f"is {quoted(value)} and no kilometre"
    raise RailExtractError(
        f"{name} has a row (feature {feature}) whose field {field} {what}: correct it, or delete the row."
    )
