"""The lines of vector layers, those of Rail Extract or drawn by hand, tracks with their cant, and design elements."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from ..clouds.crs import MAX_COORDINATE, is_geographic, name_of, parse_crs, units, warn_of_scale
from ..comparison import SurveyedLine
from ..design_places import has_stray
from ..errors import CrsError, MissingError, RailExtractError
from ..fields import CENTERLINE_FIELDS, RAIL_FIELDS, Field
from ..frame import ORIGIN_STEP, LocalFrame
from ..polyline import Polyline, project
from ..progress import Progress
from ..rails import NO_GAPS, SAME_SUM_M, Centerline, RailLine
from ..standards import SPACING_RANGE_M
from .clouds import check_same_plane

Row = Mapping[str, Any]

Rows = tuple[Sequence[Row], Sequence[str]]
"""Values of the features of a layer by the name of the field, None where one is empty; and the names of all fields."""

Made = TypeVar("Made")

MAX_WHOLE, ID = 2**31 - 1, re.compile(r"\s*\d{1,10}\s*")
"""Largest whole number of a field in every format, and an id in a list of them."""


@dataclass(frozen=True)
class LayerLines:
    """The parts of all lines of a layer, each a line of its own.

    A part is its feature, the values by field, and the vertices, (n, 3) local metres; z is NaN without heights.
    """

    parts: list[tuple[int, Row, np.ndarray]]
    fields: Collection[str]
    frame: LocalFrame

    @classmethod
    def of(
        cls,
        name: str,
        parts: Iterable[tuple[int, Row, np.ndarray]],
        fields: Collection[str],
        system: tuple[str | None, float, float],
        progress: Progress,
    ) -> LayerLines:
        """Check the lines of a layer, and put them into a local frame; `system` is that of `system_of`.

        Messages name the parameter of the layer, `name`. Raises RailExtractError if there is no line, or one with
        an impossible vertex.
        """
        crs_wkt, horizontal_unit_m, vertical_unit_m = system
        found = list(parts)
        if not found:
            raise MissingError(name, "line")
        lost = next((feature for feature, _, vertices in found if _is_impossible(vertices)), None)
        if lost is not None:
            raise RailExtractError(
                f"{name} has a line (feature {lost}) with a coordinate that is not a number, or larger than "
                f"{MAX_COORDINATE:.0e}: repair or delete it."
            )
        stray = (feature for feature, _, vertices in found if has_stray(vertices[:, :2] * horizontal_unit_m))
        feature = next(stray, None)
        if feature is not None:
            raise RailExtractError(f"{name} has a line (feature {feature}) with a stray vertex: repair or delete it.")
        middle = np.median(np.concatenate([vertices for _, _, vertices in found]), axis=0)
        origin = np.round(np.nan_to_num(middle) / ORIGIN_STEP) * ORIGIN_STEP
        if crs_wkt:
            warn_of_scale(parse_crs(crs_wkt), [tuple(middle[:2])], "The lines are", progress, "them")
        frame = LocalFrame(origin, horizontal_unit_m, vertical_unit_m, crs_wkt)
        return cls([(feature, row, frame.to_local(vertices)) for feature, row, vertices in found], fields, frame)

    def rails(self, progress: Progress, default_class: int = 0) -> tuple[RailLine, ...]:
        """Return the lines as rails, with what their fields state; warn of flat ones and copies.

        Those without a `rail_id` get the id of their feature, and those without a `class_code` get `default_class`.
        """
        rails = self._made(RailLine, RAIL_FIELDS, "rail_id", class_code=default_class)
        rails = tuple(
            dataclasses.replace(rail, gaps=gaps_in(row, rail.xyz)) for rail, (_, row, _) in zip(rails, self.parts)
        )
        flat = sum(bool(np.isnan(rail.xyz[0, 2])) for rail in rails)
        if flat:
            progress.warning(f"{flat} of {len(rails)} lines have no heights, so their results have none.")
        copies = len(rails) - len({rail.xyz.tobytes() for rail in rails})
        if copies:
            progress.warning(f"{copies} of {len(rails)} lines are duplicates: their results appear twice.")
        return rails

    def centerlines(self) -> tuple[Centerline, ...]:
        """Return the lines as centerlines; figures without a field are NaN.

        Those without a `track_id` get the id of their feature; those without `left_ids` or `right_ids` have none.
        """
        return self._made(Centerline, CENTERLINE_FIELDS, "track_id")

    def surveyed(self) -> tuple[SurveyedLine, ...]:
        """Return the lines with their standard errors.

        A line's number is its `rail_id`, else its `track_id`, else the id of its feature. With a `track_id` only, it is
        a centerline.
        """
        id_field = next((one for one in ("rail_id", "track_id") if one in self.fields), "")
        kind = {"rail_id": "rail", "track_id": "track"}.get(id_field, "line")
        numbers = [_whole(row, id_field, feature) for feature, row, _ in self.parts]
        return tuple(
            SurveyedLine(
                number,
                xyz,
                _number(row, "sigma_mm", math.nan) / 1000,
                _number(row, "sigmaz_mm", math.nan) / 1000,
                id_field != "track_id",
                f"{kind} {number}{within}",
            )
            for number, within, (_, row, xyz) in zip(numbers, self._in_tracks(), self.parts)
        )

    def _in_tracks(self) -> Iterator[str]:
        """Yield for each rail its side and its track in words; nothing for lines that belong to no track, or several.

        The other rails of the track show the side.
        """
        rails: dict[str, list[np.ndarray]] = {}
        for _, row, xyz in self.parts:
            rails.setdefault(str(row.get("track_ids") or ""), []).append(xyz)
        for _, row, xyz in self.parts:
            track = str(row.get("track_ids") or "")
            mates = [one for one in rails[track] if one is not xyz] if ID.fullmatch(track) else []
            most_m = SPACING_RANGE_M[1]  # pieces of one rail are closer than a quarter of it
            across = project([xyz], np.concatenate(mates)[:, :2], most_m).across if mates else np.empty(0)
            across = across[np.abs(across) > most_m / 4]
            yield f" ({'right' if np.median(across) > 0 else 'left'} in track {track})" if len(across) else ""

    def _made(
        self, kind: Callable[..., Made], columns: Sequence[Field], id_field: str, **defaults: float
    ) -> tuple[Made, ...]:
        """Return the lines with the attributes that their fields state.

        Whole numbers without a default become 0 where a field is missing or holds no number, others NaN. Fields that
        the kind of line computes itself, such as the length, are not read.
        """
        stored = {attribute.name for attribute in dataclasses.fields(kind)}  # type: ignore[arg-type]
        read = [column for column in columns if column.name in stored and column.name != "gaps"]
        return tuple(
            kind(xyz, **{column.name: _value(row, column, {**defaults, id_field: feature}) for column in read})
            for feature, row, xyz in self.parts
        )


def system_of(crs_wkt: str | None, progress: Progress) -> tuple[str | None, float, float]:
    """Return a coordinate system with its units in plan and in height, metres; raise CrsError if it is in degrees."""
    if not crs_wkt:
        progress.warning("The lines have no coordinate system: their coordinates are taken as metres.")
        return None, 1.0, 1.0
    crs = parse_crs(crs_wkt)
    if is_geographic(crs):
        raise CrsError(
            f"The lines are in degrees ({name_of(crs)}), where lengths can't be measured: reproject them, for "
            "example to the UTM zone of the place."
        )
    return (crs_wkt, *units(crs))


def without_steps(xyz: np.ndarray) -> np.ndarray:
    """Return vertices, (n, 3), without those that repeat the place before; heights are NaN unless all have one."""
    if not np.isfinite(xyz[:, 2]).all():
        xyz[:, 2] = np.nan
    return xyz[np.diff(xyz[:, :2], axis=0, prepend=np.nan).any(axis=1)]


def _is_impossible(vertices: np.ndarray) -> bool:
    """Return whether a vertex, of (n, 3), has no place in plan, or a coordinate larger than that of any place."""
    return not (np.abs(vertices[:, :2]) <= MAX_COORDINATE).all() or bool(
        (np.abs(vertices[:, 2]) > MAX_COORDINATE).any()
    )


def _value(row: Row, column: Field, defaults: Mapping[str, float]) -> Any:
    """Return the value of a field of a line."""
    if column.kind is str:
        return _ids(row, column.name)
    if column.kind is int:
        return _whole(row, column.name, int(defaults.get(column.name, 0)))
    return _number(row, column.name, defaults.get(column.name, math.nan))


def _number(row: Row, name: str, default: float) -> float:
    """Return the number in a field, or `default` if the field is missing or holds no finite number."""
    try:
        value = float(row.get(name, default))
    except (TypeError, ValueError):
        return default
    return value if math.isfinite(value) else default


def _whole(row: Row, name: str, default: int) -> int:
    """Return the number in a field without its fraction, or `default` if it does not fit a field of whole numbers."""
    value = _number(row, name, default)
    return int(value) if abs(value) <= MAX_WHOLE else default


def _ids(row: Row, name: str) -> tuple[int, ...]:
    """Return the ids in a field such as "3,5"; none if the field is missing or holds something else."""
    words = str(row.get(name) or "").split(",")
    if not all(ID.fullmatch(word) for word in words):
        return ()
    ids = tuple(int(word) for word in words)
    return ids if max(ids) <= MAX_WHOLE else ()


def gaps_in(row: Row, xyz: np.ndarray) -> np.ndarray:
    """Return the sections in the field `gaps`, (k, 2) metres; none if the field does not hold those of this line."""
    words = str(row.get("gaps") or "").split(",")
    try:
        gaps = np.array([[float(bound) for bound in word.split("-")] for word in words], dtype=float)
    except ValueError:
        return NO_GAPS.copy()
    rise = np.diff(gaps.ravel()) if gaps.ndim == 2 and gaps.shape[1] == 2 else np.array([-1.0])
    in_order = bool((rise >= 0).all()) and gaps[-1, 1] <= Polyline(xyz).length_m + SAME_SUM_M
    return gaps if in_order else NO_GAPS.copy()


def way(name: str, own: LocalFrame, other_name: str, frame: LocalFrame) -> np.ndarray:
    """Return the vector, (3,) metres, from the frame of an input to that of another; see `check_same_plane`."""
    check_same_plane(name, own.crs_wkt, other_name, frame)
    check_same_plane(other_name, frame.crs_wkt, name, own)
    return own.shift_to(frame)
