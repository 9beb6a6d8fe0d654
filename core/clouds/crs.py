"""Coordinate reference systems: their units, and whether lengths can be computed in them."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from ..errors import CrsError
from ..progress import Progress

if TYPE_CHECKING:
    import pyproj

MODEL_TYPE_KEY, MODEL_PROJECTED = 1024, 1
VERTICAL_CRS_KEY, VERTICAL_UNIT_KEY = 4096, 4099
"""GeoTIFF keys (OGC 19-008r4, section 7)."""

EPSG_CODES = range(1024, 32767)
"""Values of a GeoTIFF key that are EPSG codes (same standard)."""

LENGTH_UNITS = {9001: ("metre", 1.0), 9002: ("foot", 0.3048), 9003: ("US survey foot", 1200 / 3937)}
"""Name and length in metres of EPSG's units of length."""

MIN_UNIT_M, MAX_UNIT_M = 0.001, 2000.0
"""Lengths between which a unit of length can be: a millimetre, and somewhat more than a nautical mile."""

UNITS_OF_LENGTH = ("LinearUnit", "Unit")
"""Types of unit in PROJJSON that are lengths; the other types are angles, scales, times and parameters."""

MAX_COORDINATE = 1e10
"""Largest coordinate, in any unit of length: the earth's circumference is 4e9 cm."""

MAX_NAME = 80
"""Characters of a coordinate system's name that a message quotes: files may state any text."""

MAX_SCALE_ERROR = 0.005
"""Largest deviation of the scale factor from 1. It shifts a gauge of 1435 mm by 7 mm; the report marks deviations of
more than 10 mm. National grids stay below 0.0035; Web Mercator exceeds the limit even on the equator."""

BASELINE_M = 100.0
"""Length on which the scale factor is measured: short enough for the factor to be constant along it, and long
compared with the rounding of degrees."""

AREA_DEG = 2.0
"""How far outside of the area of its system a railway may be, degrees: grids are used beyond their borders."""

WGS_84 = "EPSG:4326"

SAME_PLACE = 1e-3
"""Largest difference, in units of the CRS, between the coordinates of a place in two descriptions of the same CRS."""


def import_pyproj():
    """Import pyproj when it is first needed; raise CrsError if it is not installed."""
    try:
        with warnings.catch_warnings():
            # In a virtual environment, pyproj warns that it can't find PROJ's data folder; PROJ itself finds it.
            warnings.simplefilter("ignore", UserWarning)
            import pyproj
    except ImportError as error:
        raise CrsError(
            "The Python package that reads coordinate systems is missing: run pip install pyproj."
        ) from error
    return pyproj


def parse_crs(text: str) -> pyproj.CRS:
    """Parse a coordinate system given as WKT or as a code such as EPSG:32643; raise CrsError if it is neither.

    Examples
    --------
    >>> parse_crs("EPSG:32643").name
    'WGS 84 / UTM zone 43N'
    """
    pyproj = import_pyproj()
    try:
        return pyproj.CRS.from_user_input(text)
    except pyproj.exceptions.CRSError as error:
        raise CrsError(f"The coordinate system {text[:60]!r} is unknown: give WKT or an EPSG code.") from error


def crs_of_geokeys(crs: pyproj.CRS | None, keys: dict[int, int]) -> pyproj.CRS | None:
    """Correct a coordinate system read from GeoTIFF keys, given by number, using those for model type and heights.

    The system given is built from the keys for projected and geographic systems only. Returns None for a projection
    without a code, because the coordinates are not in its geographic base.
    """
    if crs is None or (crs.is_geographic and keys.get(MODEL_TYPE_KEY) == MODEL_PROJECTED):
        return None
    vertical = _vertical_crs(keys.get(VERTICAL_CRS_KEY, 0), keys.get(VERTICAL_UNIT_KEY, 0))
    if vertical is None or crs.is_compound or crs.is_geographic:
        return crs
    return import_pyproj().crs.CompoundCRS(f"{crs.name} + {vertical.name}", [crs, vertical])


def _vertical_crs(code: int, unit: int) -> pyproj.CRS | None:
    """Look up the height system of an EPSG code, or build one that states only the unit."""
    pyproj = import_pyproj()
    if code in EPSG_CODES:
        try:
            vertical = pyproj.CRS.from_epsg(code)
        except pyproj.exceptions.CRSError:
            vertical = None
        if vertical is not None and vertical.is_vertical:
            return vertical
    if unit not in LENGTH_UNITS:
        return None
    name, metres = LENGTH_UNITS[unit]
    return pyproj.CRS.from_wkt(
        f'VERTCRS["height ({name})",VDATUM["unknown"],CS[vertical,1],AXIS["up",up],LENGTHUNIT["{name}",{metres!r}]]'
    )


def units(crs: pyproj.CRS) -> tuple[float, float]:
    """Return the length in metres of the horizontal and the vertical unit; without a height system they are equal.

    Raises CrsError if the coordinates are degrees, geocentric or no lengths at all, or a unit is impossible.

    Examples
    --------
    >>> units(parse_crs("EPSG:2222"))  # Arizona, in feet
    (0.3048, 0.3048)
    """
    parts = [_unbound(part) for part in _unbound(crs).sub_crs_list or [crs]]
    if parts[0].is_geographic or parts[0].is_geocentric or not all(part.axis_info for part in parts[:2]):
        raise CrsError(f"Lengths can't be computed in {name_of(crs)}: use a projected coordinate system.")
    horizontal, *others = _lengths(parts[0])
    if len(parts) > 1:
        return horizontal, _lengths(parts[1])[0]
    return horizontal, others[1] if len(others) == 2 else horizontal


def _lengths(part: pyproj.CRS) -> list[float]:
    """Return the length in metres of the unit of each axis; CrsError if one is not that of a length, or impossible."""
    kinds = [axis["unit"] for axis in part.to_json_dict()["coordinate_system"]["axis"]]
    for axis, kind in zip(part.axis_info, kinds):
        if kind != "metre" and (isinstance(kind, str) or kind["type"] not in UNITS_OF_LENGTH):
            raise CrsError(
                f"Lengths can't be computed in {name_of(part)}, which measures in {axis.unit_name[:MAX_NAME]}: use a "
                "projected coordinate system."
            )
        if not MIN_UNIT_M <= axis.unit_conversion_factor <= MAX_UNIT_M:
            raise CrsError(
                f"{name_of(part)} states a unit of {axis.unit_conversion_factor:g} m, which is impossible: assign the "
                "right coordinate system."
            )
    return [axis.unit_conversion_factor for axis in part.axis_info]


def name_of(crs: pyproj.CRS) -> str:
    """Return the name of a coordinate system as a message quotes it: on one line, and not too long."""
    return " ".join(crs.name.split())[:MAX_NAME]


def title_of(wkt: str | None) -> str:
    """Return the code of a coordinate system, else its name, for messages.

    >>> title_of(parse_crs("EPSG:25832").to_wkt()), title_of(None)
    ('EPSG:25832', 'no coordinate system')
    """
    crs = parse_crs(wkt) if wkt else None
    authority = crs.to_authority() if crs else None
    return ":".join(authority) if authority else _name(crs)


def codes_and_names(crs: pyproj.CRS) -> tuple[int | None, str, str]:
    """Return the EPSG code of the plan, None without one, its name, and the name of the heights, empty without one.

    >>> codes_and_names(parse_crs("EPSG:25832+7837"))
    (25832, 'ETRS89 / UTM zone 32N', 'DHHN2016 height')
    """
    plane, parts = _plane(crs), _unbound(crs).sub_crs_list
    return plane.to_epsg(), plane.name, parts[1].name if len(parts) > 1 else ""


def lies_in_area(crs: pyproj.CRS, xy: tuple[float, float]) -> bool:
    """Return whether a place, in units of a projected system, is in or near the area for which it is made.

    It does also where the area is unknown.

    >>> lies_in_area(parse_crs("EPSG:25832"), (550_000.0, 5_800_000.0))
    True
    >>> lies_in_area(parse_crs("EPSG:25832"), (5_800_000.0, 550_000.0))
    False
    """
    pyproj, plane = import_pyproj(), _plane(crs)
    area = plane.area_of_use or crs.area_of_use
    if area is None or area.west > area.east:
        return True
    try:
        longitude, latitude = pyproj.Transformer.from_crs(plane, WGS_84, always_xy=True).transform(*xy)
    except pyproj.exceptions.ProjError:
        return True
    east, north = longitude - area.west, latitude - area.south
    width, height = area.east - area.west, area.north - area.south
    return bool(-AREA_DEG <= east <= width + AREA_DEG and -AREA_DEG <= north <= height + AREA_DEG)


def is_geographic(crs: pyproj.CRS) -> bool:
    """Return whether the plan coordinates are longitude and latitude."""
    return _plane(crs).is_geographic


def unit_in_plan(crs_wkt: str | None) -> float:
    """Return the length in metres of the unit in plan; that of degrees, or of an unknown system, counts as 1."""
    crs = parse_crs(crs_wkt) if crs_wkt else None
    return 1.0 if crs is None or is_geographic(crs) else units(crs)[0]


def _plane(crs: pyproj.CRS) -> pyproj.CRS:
    """Return the horizontal part of a system."""
    return _unbound((_unbound(crs).sub_crs_list or [crs])[0])


def _unbound(crs: pyproj.CRS) -> pyproj.CRS:
    """Strip the datum shift that some WKT binds to a system."""
    return crs.source_crs or crs if crs.is_bound else crs


def utm_zone(longitude: float, latitude: float) -> str:
    """Name the UTM zone (WGS 84) of a place given in degrees.

    >>> utm_zone(77.2, 13.1)
    'UTM zone 43N (EPSG:32643)'
    """
    zone = int((longitude + 180) // 6) % 60 + 1
    hemisphere, code = ("N", 32600 + zone) if latitude >= 0 else ("S", 32700 + zone)
    return f"UTM zone {zone}{hemisphere} (EPSG:{code})"


def warn_of_scale(
    crs: pyproj.CRS, places: Sequence[tuple[float, float]], what: str, progress: Progress, it: str = "it"
) -> None:
    """Warn about a system in which lengths differ from those on the ground, as in Web Mercator.

    This is only a warning because local coordinates may be labelled with a system they are not in; their lengths are
    true. One place with an acceptable scale factor is enough: the others may belong to stray points. `what` and `it`
    are subject and verb of the sentence, such as "cloud.laz is", and the pronoun that refers to the subject.
    """
    plane = _plane(crs)
    known = [one for one in _scales(plane, places) if np.isfinite(one).all()] if plane.is_projected else []
    if not known:
        return
    factor, longitude, latitude = min(known, key=lambda one: abs(one[0] - 1))
    if abs(factor - 1) > MAX_SCALE_ERROR:
        progress.warning(
            f"{what} in {name_of(plane)}, whose scale factor of {factor:.3f} there makes lengths and gauges wrong: "
            f"reproject {it}, for example to {utm_zone(longitude, latitude)}."
        )


def _scales(plane: pyproj.CRS, places: Sequence[tuple[float, float]]) -> Iterator[tuple[float, float, float]]:
    """Yield scale factor, longitude and latitude at places; of the factors east and north, that farther from 1.

    They are NaN or infinite where they are unknown: far outside the system. There are none in a system that PROJ can't
    relate to others.
    """
    pyproj = import_pyproj()
    half = BASELINE_M / 2 / plane.axis_info[0].unit_conversion_factor
    ground = pyproj.Geod(ellps="WGS84")
    with suppress(pyproj.exceptions.ProjError):
        to_degrees = pyproj.Transformer.from_crs(plane, WGS_84, always_xy=True)
        for x, y in places:
            longitudes, latitudes = to_degrees.transform([x - half, x, x + half, x], [y, y - half, y, y + half])
            lengths_m = ground.inv(longitudes[:2], latitudes[:2], longitudes[2:], latitudes[2:])[2]
            factors = [BASELINE_M / length_m if length_m else np.nan for length_m in lengths_m]
            yield max(factors, key=lambda factor: abs(factor - 1)), longitudes[0], latitudes[0]


def common_crs(systems: Sequence[tuple[str, pyproj.CRS | None]]) -> pyproj.CRS | None:
    """Return the system that all files share, given (file name, CRS or None) of each; None if no file states one.

    Raises CrsError, whose message names both, if two files differ.
    """
    (first_name, first), *others = systems
    for name, crs in others:
        same = first is crs is None or (first is not None and crs is not None and first.equals(crs, True))
        if not same:
            raise CrsError(
                f"{first_name} is in {_name(first)} but {name} is in {_name(crs)}: "
                "reproject all tiles to one coordinate system first."
            )
    return first


def same_plane(first_wkt: str, second_wkt: str, xy: tuple[float, float]) -> bool:
    """Return whether plan coordinates mean the same place in two systems, in their units; heights are ignored.

    Descriptions of one system differ from file to file; what counts is where they put the rails.
    """
    pyproj = import_pyproj()
    plane = [_plane(parse_crs(wkt)) for wkt in (first_wkt, second_wkt)]
    try:
        there = pyproj.Transformer.from_crs(*plane, always_xy=True).transform(*xy)
    except pyproj.exceptions.ProjError:
        return plane[0].equals(plane[1], True)
    return max(abs(there[0] - xy[0]), abs(there[1] - xy[1])) < SAME_PLACE


def _name(crs: pyproj.CRS | None) -> str:
    return "no coordinate system" if crs is None else name_of(crs)
