"""The results of Measure clearance as layers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..clearance.along import Trace, grade_pm, nominal_mm, traced_at
from ..clearance.measure import BANDS_M, Clearance, Stations
from ..clearance.neighbours import Side
from ..fields import CLEARANCE, INTRUSIONS, PLATFORMS, SIDES, WIRES
from ..kilometres.axes import PlacedAxes
from ..spread import known, rms
from .layers import Layer

FLATTEST_M = 10_000.0
"""Radius above which a track is straight."""


def clearance_makers(found: Clearance, axes: PlacedAxes | None) -> dict[str, Callable[[], Layer]]:
    """Return the functions that make the layers, by the name of the output."""
    return {
        "INTRUSIONS": lambda: intrusions_layer(found),
        "OUTPUT": lambda: stations_layer(found),
        "PLATFORMS": lambda: platforms_layer(found, axes),
        "WIRES": lambda: wires_layer(found, axes),
    }


def intrusions_layer(found: Clearance) -> Layer:
    """Make the layer of the objects inside the profile."""
    columns = [[getattr(one, field.name) for one in found.intrusions] for field in INTRUSIONS.fields]
    return Layer(INTRUSIONS, columns, [one.xyz for one in found.intrusions])


def stations_layer(found: Clearance) -> Layer:
    """Make the layer of the stations."""
    tables = [_station_columns(found, number, one) for number, one in enumerate(found.stations)]
    columns = [[value for table in tables for value in table[field.name]] for field in CLEARANCE.fields]
    return Layer(CLEARANCE, columns, [place for one in found.stations for place in one.xyz])


def _station_columns(found: Clearance, number: int, stations: Stations) -> dict[str, Any]:
    """Return the values of the fields of the stations of one track."""
    course, s = stations.course, stations.s
    curvature = course.at(s, course.curvature)
    with np.errstate(divide="ignore"):
        radius_m = np.where(np.abs(curvature) * FLATTEST_M >= 1.0, 1.0 / curvature, np.nan)
    least, unknown = stations.least_m, np.full(len(s), None, dtype=object)
    columns: dict[str, Any] = {
        "track_id": np.full(len(s), course.track_id),
        "chainage_m": s,
        "cant_mm": 1000 * course.at(s, course.cant_m) if course.has_cant else np.full(len(s), np.nan),
        "radius_m": radius_m,
        "points": stations.points,
        "bridged": course.bridged[course.station(s)].astype(int) if course.has_cant else np.ones(len(s), dtype=int),
        "km": unknown if stations.kilometres is None else stations.kilometres.km,
        "km_text": unknown if stations.kilometres is None else stations.kilometres.km_text,
    }
    for at, (one, _) in enumerate(SIDES):
        columns[f"wide_{one}_mm"] = 1000 * stations.wide_m[:, at]
        columns[f"{one}mar_mm"] = 1000 * least[:, at]
        for band in range(len(BANDS_M)):
            columns[f"{one}{band + 1}_mm"] = 1000 * stations.aside_m[:, at, band]
            columns[f"{one}{band + 1}m_mm"] = 1000 * stations.margin_m[:, at, band]
        columns.update(_neighbour(found, (stations.left, stations.right)[at], one))
        edge, height = 1000 * traced_at(found.platforms, number, s, (1, -1)[at]).T
        columns[f"{one}off_mm"], columns[f"{one}hgt_mm"] = np.abs(edge), height
    stagger, height = 1000 * traced_at(found.wires, number, s).T
    return {**columns, "wire_mm": height, "stagger_mm": stagger}


def _neighbour(found: Clearance, side: Side, one: str) -> dict[str, Any]:
    """Return the fields of the neighbour track on a side."""
    ids = [found.courses[at].track_id if at >= 0 else None for at in side.track]
    return {f"{one}dist_m": side.distance_m, f"{one}track": ids, f"{one}dz_mm": 1000 * side.above_m}


def platforms_layer(found: Clearance, axes: PlacedAxes | None) -> Layer:
    """Make the layer of the platform edges."""
    lines = [_line(found, one) for one in found.platforms]
    table = [
        {
            "platform": number,
            **_extent(found, one, axes, line),
            "side": "left" if one.side > 0 else "right",
            **dict(zip(("offset_mm", "offmin_mm", "offmax_mm"), _mean_and_ends(np.abs(one.v)))),
            **dict(zip(("height_mm", "hmin_mm", "hmax_mm"), _mean_and_ends(one.w))),
            "nominal_mm": nominal_mm(one),
            "sigma_mm": 1000 * np.hypot(rms(one.sigma_m), found.courses[one.course].sigma_m),
            "sigmaz_mm": 1000 * np.hypot(rms(one.sigmaz_m), found.courses[one.course].cant_sigma_m),
        }
        for number, (one, line) in enumerate(zip(found.platforms, lines), start=1)
    ]
    return Layer(PLATFORMS, [[row[field.name] for row in table] for field in PLATFORMS.fields], lines)


def wires_layer(found: Clearance, axes: PlacedAxes | None) -> Layer:
    """Make the layer of the contact wires."""
    lines = [_line(found, one) for one in found.wires]
    table = [
        {
            "wire": number,
            **_extent(found, one, axes, line),
            **dict(zip(("height_mm", "hmin_mm", "hmax_mm"), _mean_and_ends(one.w))),
            "stagmin_mm": 1000 * one.v.min(),
            "stagmax_mm": 1000 * one.v.max(),
            "grade_pm": grade_pm(one),
            "sigma_mm": 1000 * rms(one.sigma_m),
        }
        for number, (one, line) in enumerate(zip(found.wires, lines), start=1)
    ]
    return Layer(WIRES, [[row[field.name] for row in table] for field in WIRES.fields], lines)


def _line(found: Clearance, one: Trace) -> np.ndarray:
    """Return the vertices of what follows a track."""
    return found.courses[one.course].places(one.s, one.v, one.w)


def _mean_and_ends(values_m: np.ndarray) -> tuple[float, float, float]:
    """Return mean, least and largest value, millimetres."""
    return 1000 * float(values_m.mean()), 1000 * float(values_m.min()), 1000 * float(values_m.max())


def _extent(found: Clearance, one: Trace, axes: PlacedAxes | None, line: np.ndarray) -> dict[str, Any]:
    """Return the track of what follows it, the chainages of its ends, its length, and its kilometres."""
    km = np.empty(0) if axes is None else axes.kilometres(found.frame.to_crs(line)[:, :2]).km
    km = known(km)
    km_from, km_to = (float(km.min()), float(km.max())) if len(km) else (None, None)
    columns = (found.courses[one.course].track_id, *one.ends, one.length_m, km_from, km_to)
    return dict(zip(("track_id", "from_m", "to_m", "length_m", "km_from", "km_to"), columns))
