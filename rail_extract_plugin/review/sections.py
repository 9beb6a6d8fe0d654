"""The cross-section of a finding: its plane, the rails of the run, and the points, which are read in the background."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from qgis.core import QgsProject, QgsTask, QgsVectorLayer

from ...core.errors import Cancelled, RailExtractError
from ...core.jobs.lines import gaps_in
from ...core.polyline import Polyline, interpolate
from ..feedback import TaskProgress
from ..reading.layers import Row
from ..writing.layers import vertices_of
from ..writing.run import RUN, RunCloud, cloud_of, profile_of
from .findings import Review
from .swept import Pose, Swept

if TYPE_CHECKING:
    from ...core.clouds.cross_sections import CrossSection

REACH_M = 2.0
"""Distance from the place up to which points are shown: both rails of any track, and what lies next to them."""

WIDE_M = 6.0
"""The same for objects inside a profile, whose whole cross-section is shown."""

MOST_DRAWN = 6000
"""Points of a whole cross-section that are drawn: more take longer than a blink."""

THICKNESS_M = 0.5
"""Points up to this far ahead and behind are shown: fewer than this would not show the heads in sparse clouds."""


STEP_M = 0.1
"""Precision of the chainages at which a rail loses its points, those that the dock writes."""


@dataclass(frozen=True)
class Gap:
    """A part of a finding in which one rail has no points: its side, and chainages as in the finding."""

    side: str
    start_m: float
    end_m: float


@dataclass(frozen=True)
class Rail:
    """A rail of the run: its vertices, (n, 3), and plan distances, (k, 2), between which it has no points, metres."""

    xyz: np.ndarray
    gaps: np.ndarray


@dataclass(frozen=True)
class Picture:
    """What a cross-section shows, metres to the right and up as seen along the track.

    Points are None until they are read. A rail that is missing has no points here: it is where the line is drawn, or
    opposite to the other one. The note says what is missing, and why. The mark is the worst place of an object inside a
    profile, whose whole cross-section is shown with the outline of the profile, (k, 2), and what that is, in words.
    """

    points: np.ndarray | None
    rails: np.ndarray
    missing: np.ndarray
    head_width_m: float
    note: str = ""
    mark: np.ndarray | None = None
    outline: np.ndarray | None = None
    legend: str = ""


class Sections:
    """The cross-sections of a layer of findings."""

    def __init__(self, layer: QgsVectorLayer, found: Sequence[Review]) -> None:
        self.cloud = cloud_of(layer)
        self._units_m = np.array(self.cloud.units_m if self.cloud else (1.0, 1.0, 1.0))
        self._run = layer.customProperty(RUN)
        is_clearance = any(one.is_intrusion for one in found)
        self._stations = _stations_of_run(self._run) if is_clearance else {}
        self.lacks_stations = is_clearance and not self._stations
        profile = profile_of(layer)
        self._swept = Swept(profile) if profile and self._stations else None
        self._planes: dict[int, CrossSection] = {one.feature.id(): self._plane(one) for one in found}
        self.reach_m = WIDE_M if self._stations else REACH_M
        self.points: dict[int, np.ndarray] = {}
        self.note = "" if self.cloud else "The layer does not state its cloud: only rails are shown."
        if self.cloud and not all(Path(path).exists() for path in self.cloud.paths):
            self.note = f"{self.cloud.name} is not at its place any more: only rails are shown."
        if self.lacks_stations:
            self.note = "Load the output Clearance of the same run to see cross-sections."

    @property
    def places(self) -> dict[int, np.ndarray]:
        """Places of the sections by the id of the finding, metres from the zero of the coordinate system."""
        return {number: plane.place for number, plane in self._planes.items()}

    def picture(self, review: Review) -> Picture:
        """Return what the section of a finding shows."""
        plane, width_m = self._planes[review.feature.id()], self.cloud.head_width_m if self.cloud else 0.07
        rails, missing = self._rails(plane, review, width_m)
        points = self.points.get(review.feature.id())
        shown = None
        if points is not None:
            seen = plane.seen(points)
            shown = seen[np.abs(seen[:, 0]) <= THICKNESS_M, 1:]
        if review.is_intrusion:
            mark = plane.seen(self._line(review)[:1])[0, 1:]
            thin = None if shown is None else shown[:: max(len(shown) // MOST_DRAWN, 1)]
            picture = Picture(thin, np.nan_to_num(rails), missing, width_m, self.note, mark)
            return self._with_profile(picture, review, mark)
        level = np.array([0.0, _level(rails, shown)])
        moved = None if shown is None else shown - level
        return Picture(moved, np.nan_to_num(rails - level), missing, width_m, self.note)

    def _with_profile(self, picture: Picture, review: Review, mark: np.ndarray) -> Picture:
        """Return the section of an intrusion with the profile and both rails at its worst place, if they are known."""
        track, at_m, place_mm = review.value("track_id"), review.at_m, (review.value("v_mm"), review.value("w_mm"))
        if self._swept is None or track not in self._swept.spacing_m or track not in self._stations:
            return picture
        if at_m is None or None in place_mm:
            return picture
        stations, spacing_m = self._stations[track], self._swept.spacing_m[track]
        cant_m, left_m, right_m = interpolate(stations[:, 4:], stations[:, 0], np.array([at_m]))[0].tolist()
        pose = Pose.of(cant_m, spacing_m, np.array(place_mm) / 1000, mark)
        return replace(
            picture,
            rails=pose.seen(0.5 * spacing_m * np.array([[1.0, 0.0], [-1.0, 0.0]])),
            missing=np.zeros(2, dtype=bool),
            outline=pose.seen(self._swept.outline(left_m, right_m)),
            legend=self._swept.legend(left_m, right_m),
        )

    def gaps(self, review: Review) -> list[Gap]:
        """Return where which rail of a track has no points, within a finding."""
        start_m = review.value("from_m")
        if start_m is None or review.value("rail_id") is not None:
            return []
        plane, found = self._planes[review.feature.id()], []
        line = Polyline(self._line(review)).resampled(STEP_M)
        for rail in _rails_of_run(self._run, self._units_m):
            places, _ = _crossings(rail, plane)
            if not len(places):
                continue
            side = "Right" if places[0, 0] > 0 else "Left"
            for gap in rail.gaps:
                ends = Polyline(rail.xyz[:, :2]).at(gap)
                first, last = sorted(line.t[np.argmin(np.hypot(*(line.xy - end).T))] for end in ends)
                found.append(Gap(side, start_m + first, start_m + last))
        return sorted((gap for gap in found if gap.end_m > gap.start_m), key=lambda gap: gap.start_m)

    def _line(self, review: Review) -> np.ndarray:
        """Return the line of a finding, (n, 3) metres."""
        return np.nan_to_num(vertices_of(review.feature)) * self._units_m

    def _plane(self, review: Review) -> CrossSection:
        from ...core.clouds.cross_sections import cross_section_at

        if not review.is_intrusion:
            return cross_section_at(self._line(review), review.worst_share)
        stations, at_m = self._stations.get(review.value("track_id")), review.at_m
        if stations is None or at_m is None:
            place = self._line(review)[0]
            return cross_section_at(np.array([place, place + [1.0, 0.0, 0.0]]), 0.0)
        after = int(np.clip(np.searchsorted(stations[:, 0], at_m), 1, len(stations) - 1))
        (start, *first), (end, *second) = stations[after - 1 : after + 1, :4] * self._scale
        return cross_section_at(np.array([first, second]), float((at_m - start) / (end - start)))

    @property
    def _scale(self) -> np.ndarray:
        """Units of chainage, x, y and z."""
        return np.append(1.0, self._units_m)

    def _rails(self, plane: CrossSection, review: Review, width_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Return where the rails are in a plane, (k, 2), and which of them have no points there, (k,)."""
        crossings, missing = [np.empty((0, 2))], []
        for rail in _rails_of_run(self._run, self._units_m):
            places, at_m = _crossings(rail, plane)
            crossings.append(places)
            missing += [bool(np.any((rail.gaps[:, 0] <= at) & (at <= rail.gaps[:, 1]))) for at in at_m]
        rails = np.concatenate(crossings)
        if len(rails) == 1 and review.value("track_id") is not None:  # the other rail of the track was not found
            return np.concatenate([rails, rails * [-1, 1]]), np.array([*missing, True])
        if len(rails):
            return rails, np.array(missing)
        gauge, cant = review.value("gauge_mm"), review.value("cant_mm")
        if gauge is None:
            return np.empty((0, 2)), np.empty(0, bool)
        half_m, rise_m = 0.5 * (gauge / 1000 + width_m), 0.0005 * (cant or 0.0)
        return np.array([[-half_m, rise_m], [half_m, -rise_m]]), np.zeros(2, bool)


class ReadingTask(QgsTask):
    """Reads the points of all sections from the cloud, in a thread of QGIS.

    `done` is called in the main thread with the points by id, and with a sentence if they could not be read.
    """

    def __init__(
        self,
        cloud: RunCloud,
        places: Mapping[int, np.ndarray],
        reach_m: float,
        done: Callable[[dict[int, np.ndarray], str], None],
    ) -> None:
        super().__init__("Rail Extract: cross-sections", QgsTask.Flag.CanCancel)
        self._cloud, self._places, self._reach_m, self._done = cloud, dict(places), reach_m, done
        self._points: dict[int, np.ndarray] = {}
        self._error = ""

    def run(self) -> bool:
        """Read the points; no exception may leave this method."""
        try:
            from ...core.clouds.cross_sections import points_near
            from ...core.clouds.points import ask

            request = ask(self._cloud.paths, self._cloud.class_codes, self._cloud.crs_wkt)
            found = points_near(request, list(self._places.values()), self._reach_m, TaskProgress(self))
            self._points = dict(zip(self._places, found))
        except Cancelled:
            return False
        except RailExtractError as error:
            self._error = str(error)
        except Exception as error:
            self._error = f"The points can't be read ({type(error).__name__}: {error})."
        return True

    def finished(self, result: bool) -> None:
        """Pass the points on, in the main thread."""
        if result:
            self._done(self._points, self._error)


def _level(rails: np.ndarray, points: np.ndarray | None) -> float:
    """Return the height of the middle of the picture: the rails' or, without heights, the points'."""
    for heights in (rails[:, 1], np.empty(0) if points is None else points[:, 1]):
        if np.isfinite(heights).any():
            return float(np.nanmedian(heights))
    return 0.0


def _crossings(rail: Rail, plane: CrossSection) -> tuple[np.ndarray, np.ndarray]:
    """Return where a rail crosses a plane within reach, (k, 2), and at which of its plan distances, (k,)."""
    along = Polyline(rail.xyz).t
    ahead, right, up = plane.seen(rail.xyz).T
    numbers = np.flatnonzero((ahead[:-1] < 0) != (ahead[1:] < 0))
    share = ahead[numbers] / (ahead[numbers] - ahead[numbers + 1])
    rights, ups, at_m = (one[numbers] + share * (one[numbers + 1] - one[numbers]) for one in (right, up, along))
    near = np.abs(rights) <= REACH_M
    return np.column_stack([rights, ups])[near], at_m[near]


def _stations_of_run(run: str | None) -> dict[int, np.ndarray]:
    """Return the stations of the clearance of a run, (n, 7), by track.

    They have chainage, x, y, z, cant, and the widening on the left and on the right; the last three are metres, 0 where
    the layer states none.
    """
    found: dict[int, list[list[float]]] = {}
    for layer in QgsProject.instance().mapLayers().values():
        is_mine = run and layer.customProperty(RUN) == run and isinstance(layer, QgsVectorLayer)
        if is_mine and layer.fields().lookupField("lmar_mm") >= 0:
            for feature in layer.getFeatures():
                row = Row(feature)
                across = ((row[name] or 0.0) / 1000 for name in ("cant_mm", "wide_l_mm", "wide_r_mm"))
                found.setdefault(row["track_id"], []).append([row["chainage_m"], *vertices_of(feature)[0], *across])
    return {track: np.array(sorted(rows)) for track, rows in found.items() if len(rows) > 1}


def _rails_of_run(run: str | None, units_m: np.ndarray) -> list[Rail]:
    """Return the rails that the same run has loaded."""
    layers = QgsProject.instance().mapLayers().values()
    mine = [
        layer
        for layer in layers
        if run and layer.customProperty(RUN) == run and isinstance(layer, QgsVectorLayer)
        if layer.fields().lookupField("rail_id") >= 0 and layer.fields().lookupField("resid_mm") >= 0
    ]
    features = [feature for layer in mine for feature in layer.getFeatures() if feature.hasGeometry()]
    lines = [vertices_of(feature) * units_m for feature in features]
    return [Rail(line, gaps_in(Row(feature), line)) for feature, line in zip(features, lines)]
