"""The layers that a run can write, for QGIS and the commands alike: their fields, style, and layer of a drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Integral
from typing import Any

UNKNOWN_IN_METRES = 'LOCAL_CS["Undefined Cartesian SRS",UNIT["metre",1]]'
"""Written to outputs without a coordinate system: GDAL would otherwise take a GeoPackage's coordinates for degrees."""


@dataclass(frozen=True)
class Field:
    """A field of a result layer: int, float or str.

    `name` is that of the attribute of `RailLine`, `Centerline` or `TrackGeometry` that the field holds. It ends with
    the unit and has at most ten characters, so that a shapefile does not cut it. `meaning` is for the documentation and
    the help texts; more `decimals` would only show what no scanner resolves.
    """

    name: str
    kind: type
    meaning: str
    decimals: int = 0

    def value(self, known: Any) -> int | float | str | None:
        """Return what is written for an attribute: rounded numbers, ids separated by commas, None if unknown."""
        if known is None:
            return None
        if self.kind is str:
            return str(known) if isinstance(known, str) else ",".join(map(_word, known))
        if self.kind is int:
            return int(known)
        # Adding zero turns -0.0, which rounding may leave, into 0.0.
        return round(float(known), self.decimals) + 0.0 if math.isfinite(known) else None


def _word(item: Any) -> str:
    """Write an item of a list: a number, or start and end of a section in metres.

    >>> _word(7), _word((12.3, 15.678))
    ('7', '12.30-15.68')
    """
    return str(item) if isinstance(item, Integral) else "-".join(f"{value:.2f}" for value in item)


CLASS_CODE = Field("class_code", int, "class of the points")
LENGTH = Field("length_m", float, "length in 3D, metres", 3)
BRIDGED = Field(
    "bridged_m", float, "plan length without points, metres; for a track, where either rail has no points", 2
)
SIGMA = Field("sigma_mm", float, "standard error of the line's lateral position, millimetres", 2)
"""With two decimals because it is a few tenths of a millimetre in dense clouds."""

SIGMAZ = Field("sigmaz_mm", float, "standard error of the line's height, millimetres; it grows where no points are", 2)

RAIL_FIELDS = (
    Field("rail_id", int, "number of the rail, counted from west to east by the start of the line"),
    CLASS_CODE,
    LENGTH,
    Field("points", int, "points on the railhead that support the line"),
    Field("resid_mm", float, "lateral scatter of these points about the line (RMS), millimetres", 1),
    SIGMA,
    BRIDGED,
    Field(
        "track_ids",
        str,
        "track_id of the tracks that the rail belongs to, separated by commas; empty for a lone rail, and before rails "
        "are paired",
    ),
    Field(
        "gaps",
        str,
        "sections without points that bridged_m sums up: plan distances from the start of the line, metres, such as "
        "12.30-15.68,40.00-42.10",
    ),
    SIGMAZ,
)
CENTERLINE_FIELDS = (
    Field("track_id", int, "number of the track, counted from west to east by the start of the line"),
    CLASS_CODE,
    Field("left_ids", str, "rail_id of the rails on the left, in order along the line, separated by commas"),
    Field("right_ids", str, "the same for the right"),
    LENGTH,
    Field("gauge_mm", float, "mean gauge, millimetres", 1),
    Field("gaugesd_mm", float, "standard deviation of the gauge along the track, millimetres", 1),
    Field("cant_mm", float, "mean cant, left minus right, millimetres", 1),
    Field("cantmax_mm", float, "cant with the largest absolute value, with its sign, millimetres", 1),
    BRIDGED,
)
QUALITY_FIELDS = (
    Field("track_id", int, "number of the track"),
    Field("chainage_m", float, "plan distance from the start of the centerline, metres", 2),
    Field(
        "gauge_mm",
        float,
        "gauge: 3D distance between the rail lines minus the railhead width, millimetres; not measured 14 mm below the "
        "top",
        1,
    ),
    Field("cant_mm", float, "cant: left rail minus right rail, seen along the line, millimetres", 1),
    Field("twist_mm", float, "twist: change of cant over 3 m, ahead minus behind, millimetres; empty at the ends", 1),
    Field(
        "radius_m",
        float,
        "radius in plan over a chord of 20 m, metres; positive in left-hand curves, empty above 10 km",
        1,
    ),
    Field("grade_pm", float, "gradient over 10 m, per mille; positive uphill", 2),
    SIGMA,
    Field("points", int, "points on both rails for which this is the nearest station"),
    Field("bridged", int, "1 where a rail has no points, or is missing, for most of the step; else 0"),
    Field("strips", int, "number of strips, passes of the scanner, that show the rails"),
    Field(
        "strip_mm",
        float,
        "largest distance between two strips, across or in height, as they or the blur of heads show it, millimetres",
        1,
    ),
    SIGMAZ,
)
"""In a `TrackGeometry`, the first is a single value and the others have a value for each station."""

STATION_FIELDS = (
    Field("axis", str, "name of the axis; empty, as are the following fields, beyond the ends of all axes"),
    Field("piece", int, "number of the section of the axis between two jumps of the kilometres, from 1"),
    Field("km", float, "kilometre along the axis", 6),
    Field("km_text", str, "the kilometre as railways write it"),
    Field("offset_m", float, "distance from the axis, metres; positive to the left as kilometres increase", 3),
    Field("side", str, "left, right or on: side of the axis"),
    Field("ambiguous", int, "1 where another place of an axis is nearly as close, so that the kilometre may be wrong"),
)
"""In `Kilometres`; with an axis, points of the track geometry have them as well."""

KM_FIELDS = tuple(field for field in STATION_FIELDS if field.name in ("km", "km_text"))
"""With an axis, findings have those of their worst place."""

EXTENT_FIELDS = (
    Field("km_from", float, "smallest kilometre of its vertices", 6),
    Field("km_to", float, "largest kilometre of its vertices", 6),
)
"""Further fields of lines and polygons, whose `km` is that of a place in their middle."""

DIFFERENCE_FIELDS = (
    Field("line_id", int, "rail_id or track_id of the line of the reference; where it is extra, of the other survey"),
    Field("input_id", int, "the same of the other survey's line; empty where it is missing"),
    Field("chainage_m", float, "plan distance from the start of the line of line_id, metres", 2),
    Field("state", str, "both, missing in the other survey, or extra in it"),
    Field("across_mm", float, "difference across, millimetres; positive to the left of the reference", 1),
    Field("height_mm", float, "difference in height, millimetres; positive above the reference", 1),
    Field("gauge_mm", float, "difference of the gauge, millimetres", 1),
    Field("cant_mm", float, "difference of the cant, left minus right along the reference, millimetres", 1),
    Field("sigma_mm", float, "standard error of the difference across, millimetres", 2),
    Field("sigmaz_mm", float, "standard error of the difference in height, millimetres", 2),
    Field("shift_mm", float, "part of across_mm that is the constant shift, millimetres", 1),
    Field("shiftz_mm", float, "part of height_mm that is the constant shift, millimetres", 1),
    Field("moved", int, "1 where the line has moved by more than three standard errors, across or in height; else 0"),
    Field("shifted", int, "1 where the constant shift alone exceeds three standard errors; else 0"),
)
"""All differences are those of the other survey from the reference."""

FINDING_FIELDS = (
    Field(
        "finding",
        int,
        "number of the finding, from 1 for the one that may do most harm: whose possible error, times its length, is "
        "largest",
    ),
    Field("reason", str, "why to look there"),
    Field("track_id", int, "number of the track; empty for a lone rail"),
    Field("rail_id", int, "number of the lone rail; else empty"),
    Field("from_m", float, "chainage at which the section begins, along the track or the lone rail, metres", 1),
    Field("to_m", float, "chainage at which it ends, metres", 1),
    Field("doubt_m", float, "length in doubt within the section, metres", 1),
    Field("worst_m", float, "chainage of the worst place, metres", 1),
    Field("gauge_mm", float, "gauge there, millimetres", 1),
    Field("cant_mm", float, "cant there, millimetres", 1),
    Field("sigma_mm", float, "standard error there, millimetres", 2),
    Field("sigmaz_mm", float, "standard error of the height there, millimetres", 2),
    Field("points", int, "points on the rails of the section"),
    Field("review", str, "decision of the user: accepted or rejected; empty before"),
)

STOP_FIELDS = (
    Field("stop", int, "number of the stop, in the order of the seeds"),
    Field("reason", str, "why the rail is not followed further"),
)

AIRBORNE_FIELDS = (
    Field("track_id", int, "number of the line"),
    Field("guide_id", int, "number of its guide: that of the feature"),
    LENGTH,
    Field("seen_m", float, "length on which the track is seen, metres", 1),
    Field("sigma_mm", float, "standard error across where it is seen, without the flight's own error, millimetres", 1),
    Field("sigmaz_mm", float, "standard error of the height, likewise, millimetres", 1),
    Field("gauge_mm", float, "gauge that was looked for: that of the guide, or of the run, millimetres", 1),
    Field("name", str, "name of the guide"),
    Field("ref", str, "reference of the guide, such as the number of the line"),
    Field(
        "hint", int, "1 where the cloud has too few points for its footprint, so that the line is only a hint; else 0"
    ),
)
AIRBORNE_STATION_FIELDS = (
    Field("track_id", int, "number of the line; empty where there is none"),
    Field("guide_id", int, "number of the guide"),
    Field("s_m", float, "plan distance from the start of the guide, metres", 1),
    Field("seen", int, "1 where the track is seen, else 0"),
    Field("sigma_mm", float, "standard error across, without the flight's own error, millimetres", 1),
    Field("sigmaz_mm", float, "standard error of the height, likewise, millimetres", 1),
    Field("bed_m", float, "height of the bed between the rails, metres", 3),
    Field("cant_mm", float, "cant: left minus right, seen along the guide, millimetres", 0),
    Field("radius_m", float, "radius in plan over 80 m, positive in left-hand curves, empty above 10 km, metres", 0),
    Field("grade_pm", float, "gradient over 80 m, per mille; positive uphill", 2),
    Field("margin", float, "score of the course above that of one elsewhere", 1),
    Field("reason", str, "why the track is not seen; at a switch, that another one is near"),
)
"""In an `AirborneTrack`, `guide_id` is a single value and the others have a value for each station."""
ELEMENT_FIELDS = (
    Field("track_id", int, "number of the track"),
    Field("no", int, "number of the element within its track and layout, from 1"),
    Field("layout", str, "H in plan, V in height, C for cant"),
    Field("type", str, "in plan line, arc or clothoid; in height grade or parabola; for cant constant or ramp"),
    Field("km_from", float, "kilometre of the start; empty without an axis", 6),
    Field("km_to", float, "kilometre of the end; empty without an axis", 6),
    Field("s_from", float, "start: distance along the design in plan, from the first vertex of the line, metres", 4),
    Field("s_to", float, "end, metres", 4),
    Field("length_m", float, "length of the element in plan, metres", 4),
    Field(
        "r1_m",
        float,
        "radius at the start, metres; in plan positive to the left, in height positive in a sag; empty where straight",
        4,
    ),
    Field("r2_m", float, "radius at the end, metres", 4),
    Field("a_param", float, "parameter A of a clothoid, metres", 4),
    Field("rot", str, "L for a curve to the left, R to the right"),
    Field("x", float, "start, in the units of the coordinate system", 5),
    Field("y", float, "start, in the units of the coordinate system", 5),
    Field("z", float, "height of the start, in the units of the coordinate system", 5),
    Field("azimuth_gon", float, "direction at the start, gon clockwise from grid north", 6),
    Field("heading", float, "the same in radians, counterclockwise from the x axis", 9),
    Field("grade1_pm", float, "gradient at the start, per mille; positive uphill", 5),
    Field("grade2_pm", float, "gradient at the end, per mille", 5),
    Field("cant1_mm", float, "cant at the start, left rail minus right rail, millimetres", 3),
    Field("cant2_mm", float, "cant at the end, millimetres", 3),
    Field("dev_rms_mm", float, "deviation of the measured track from the element, root mean square, millimetres", 2),
    Field("dev_max_mm", float, "largest deviation, with its sign, millimetres", 2),
    Field("sigma_r_m", float, "standard error of the radius of an arc or a parabola, metres", 4),
    Field("sigma_len_m", float, "standard error of the length, metres", 4),
    Field("sigma_s_m", float, "standard error of s_from, metres", 4),
    Field("joint", str, "how the element begins: G2 if curvature, gradient or cant continue, G1 if they jump"),
    Field("r_round_m", float, "proposed round radius, metres; empty if none fits the measured track", 3),
    Field("dev_rms_round_mm", float, "dev_rms_mm with the round radii, millimetres", 2),
    Field("r_fit_m", float, "radius of an arc or a parabola as fitted; the next fit holds r1_m where you change it", 4),
    Field("s_fit_m", float, "s_from as fitted; the next fit holds s_from where you change it", 4),
)
"""The element table: `files.table` writes and reads its rows. A shapefile cuts its long names."""

DEVIATION_FIELDS = (
    Field("track_id", int, "number of the track"),
    Field("s", float, "distance along the design in plan, metres", 2),
    Field("slew_mm", float, "measured minus design across, positive to the left, millimetres", 2),
    Field("lift_mm", float, "measured minus design in height, millimetres", 2),
    Field("cant_diff_mm", float, "measured minus design cant, millimetres; empty where the cant is unknown", 2),
)

AXIS_FIELDS = (
    Field("track_id", int, "number of the track"),
    Field("name", str, "name of the alignment in its file"),
    Field("length_m", float, "length in plan, metres", 3),
    Field("km_from", float, "kilometre of the start", 6),
    Field("km_to", float, "kilometre of the end", 6),
)
"""Alignments as lines whose M values are kilometres."""


INTRUSION_FIELDS = (
    Field("intrusion", int, "number of the object, from 1 for the deepest sure one; what is allowed there comes last"),
    Field("track_id", int, "number of the track whose profile is entered"),
    Field("from_m", float, "chainage at which the object begins inside, metres", 2),
    Field("to_m", float, "chainage at which it ends, metres", 2),
    Field("chainage_m", float, "chainage of the worst place, metres", 2),
    Field("side", str, "left or right, seen along the line"),
    Field("v_mm", float, "worst place: to the left in the plane of the rail tops, millimetres", 1),
    Field("w_mm", float, "worst place: above this plane, millimetres", 1),
    Field("wmin_mm", float, "lowest point inside, above the plane of the rail tops, millimetres", 0),
    Field("wmax_mm", float, "highest point inside, millimetres", 0),
    Field("pen_mm", float, "penetration of the surface, margin and widening included, millimetres", 1),
    Field("raw_mm", float, "penetration of the deepest point, noise included, millimetres", 1),
    Field("sigma_mm", float, "standard error of pen_mm, millimetres; not that of the strips against each other", 1),
    Field("sure", int, "1 where pen_mm exceeds two standard errors, else 0"),
    Field("points", int, "points inside"),
    CLASS_CODE,
    Field("what", str, "vehicle on track N, platform or contact wire, which do not count; else empty"),
    Field("km", float, "kilometre of the worst place; empty without an axis", 6),
    Field("km_text", str, "the kilometre as railways write it"),
    Field("review", str, "decision of the user: accepted or rejected; empty before"),
)
BAND_NAMES = (
    "from the lowest height to 380 mm",
    "380 to 1170 mm",
    "1170 to 3250 mm",
    "3250 to 4310 mm",
    "4310 to 7000 mm",
)
"""Height bands of the stations of the clearance, over the rail tops."""

SIDES = (("l", "left"), ("r", "right"))
CLEARANCE_FIELDS = (
    Field("track_id", int, "number of the track"),
    Field("chainage_m", float, "plan distance from the start of the centerline, metres", 2),
    Field("cant_mm", float, "cant used: left rail minus right rail, millimetres", 1),
    Field("radius_m", float, "radius over 15 m, positive in left-hand curves, empty above 10 km, metres", 1),
    *(Field(f"wide_{one}_mm", float, f"widening used on the {side}, millimetres", 1) for one, side in SIDES),
    *(
        Field(f"{one}mar_mm", float, f"least margin on the {side}, millimetres; negative inside", 1)
        for one, side in SIDES
    ),
    *(
        Field(f"{one}{band}_mm", float, f"{side}: distance of the third nearest point, {name}, millimetres", 1)
        for one, side in SIDES
        for band, name in enumerate(BAND_NAMES, start=1)
    ),
    *(
        Field(f"{one}{band}m_mm", float, f"{side}: margin of the third nearest point, {name}, millimetres", 1)
        for one, side in SIDES
        for band, name in enumerate(BAND_NAMES, start=1)
    ),
    *(
        field
        for one, side in SIDES
        for field in (
            Field(f"{one}dist_m", float, f"distance of the track on the {side}, metres", 4),
            Field(f"{one}track", int, f"number of the track on the {side}"),
            Field(f"{one}dz_mm", float, f"height of the track on the {side} above this one, millimetres", 1),
        )
    ),
    *(
        field
        for one, side in SIDES
        for field in (
            Field(f"{one}off_mm", float, f"distance of the platform edge on the {side}, millimetres", 1),
            Field(f"{one}hgt_mm", float, f"height of the platform edge on the {side}, millimetres", 1),
        )
    ),
    Field("wire_mm", float, "height of the contact wire over the rail tops, millimetres", 1),
    Field("stagger_mm", float, "stagger of the contact wire, positive to the left, millimetres", 1),
    Field("points", int, "points within reach"),
    Field("bridged", int, "1 where a rail has no points, or is missing, so that the cant is interpolated; else 0"),
    Field("km", float, "kilometre; empty without an axis", 6),
    Field("km_text", str, "the kilometre as railways write it"),
)
PLATFORM_FIELDS = (
    Field("platform", int, "number of the platform edge"),
    Field("track_id", int, "number of the track"),
    Field("side", str, "left or right, seen along the line"),
    Field("from_m", float, "chainage at which the edge begins, metres", 1),
    Field("to_m", float, "chainage at which it ends, metres", 1),
    Field("length_m", float, "length along the track, metres", 1),
    Field(
        "offset_mm", float, "mean distance from the middle of the track in the plane of the rail tops, millimetres", 1
    ),
    Field("offmin_mm", float, "least distance, millimetres", 1),
    Field("offmax_mm", float, "largest distance, millimetres", 1),
    Field("height_mm", float, "mean height over the plane of the rail tops, millimetres", 1),
    Field("hmin_mm", float, "least height, millimetres", 1),
    Field("hmax_mm", float, "largest height, millimetres", 1),
    Field("nominal_mm", int, "nominal height, 550 or 760, if one is within 60 mm"),
    Field("sigma_mm", float, "standard error of the distance at a place, millimetres", 1),
    Field("sigmaz_mm", float, "standard error of the height at a place, millimetres", 1),
    *EXTENT_FIELDS,
)
WIRE_FIELDS = (
    Field("wire", int, "number of the contact wire"),
    Field("track_id", int, "number of the track"),
    Field("from_m", float, "chainage at which the wire begins, metres", 1),
    Field("to_m", float, "chainage at which it ends, metres", 1),
    Field("length_m", float, "length along the track, metres", 1),
    Field("height_mm", float, "mean height over the plane of the rail tops, millimetres", 1),
    Field("hmin_mm", float, "least height, millimetres", 1),
    Field("hmax_mm", float, "largest height, millimetres", 1),
    Field("stagmin_mm", float, "least stagger, positive to the left, millimetres", 1),
    Field("stagmax_mm", float, "largest stagger, millimetres", 1),
    Field("grade_pm", float, "steepest gradient against the track over 20 m, per mille", 2),
    Field("sigma_mm", float, "standard error at a place, millimetres", 1),
    *EXTENT_FIELDS,
)


@dataclass(frozen=True)
class Product:
    """A kind of layer, with lines as features, or else points.

    `style` is the name of the style that QGIS gives it, `drawn` the first word of its layers in a drawing, and `layer`
    its name in the GeoPackages of the commands; that of the style if empty.
    """

    style: str
    fields: tuple[Field, ...]
    drawn: str
    is_line: bool = True
    layer: str = ""

    @property
    def name(self) -> str:
        """Name of the layer in the GeoPackages of the commands."""
        return self.layer or self.style


RAILS = Product("rails", RAIL_FIELDS, "RAILS")
CENTERLINES = Product("centerlines", CENTERLINE_FIELDS, "TRACK")
QUALITY = Product("quality", QUALITY_FIELDS, "STATIONS", is_line=False)
LOCATED_QUALITY = Product("quality", (*QUALITY_FIELDS, *STATION_FIELDS), "STATIONS", is_line=False)
"""With an axis."""

FINDINGS = Product("findings", FINDING_FIELDS, "FINDINGS")
LOCATED_FINDINGS = Product("findings", (*FINDING_FIELDS, *KM_FIELDS), "FINDINGS")
"""With an axis."""

STOPS = Product("stops", STOP_FIELDS, "STOPS", is_line=False)
AIRBORNE = Product("airborne", AIRBORNE_FIELDS, "TRACK", layer="centerlines")
STATIONS = Product("stations", AIRBORNE_STATION_FIELDS, "STATIONS", is_line=False)
DIFFERENCES = Product("differences", DIFFERENCE_FIELDS, "DIFFERENCES", is_line=False)
ELEMENTS = Product("elements", ELEMENT_FIELDS, "ELEMENTS")
AXES = Product("axes", AXIS_FIELDS, "ALIGNMENT", layer="axis")
DEVIATIONS = Product("deviations", DEVIATION_FIELDS, "DEVIATIONS", is_line=False)
INTRUSIONS = Product("intrusions", INTRUSION_FIELDS, "INTRUSIONS", is_line=False)
CLEARANCE = Product("clearance", CLEARANCE_FIELDS, "CLEARANCE", is_line=False)
PLATFORMS = Product("platforms", PLATFORM_FIELDS, "PLATFORMS")
WIRES = Product("wires", WIRE_FIELDS, "WIRES")
PLACES = Product("places", (*STATION_FIELDS, *EXTENT_FIELDS), "PLACES")
"""The fields that copies of layers of any kind get in addition; their style only names these."""

PRODUCTS = (
    *(RAILS, CENTERLINES, QUALITY, LOCATED_QUALITY, FINDINGS, LOCATED_FINDINGS, STOPS, AIRBORNE, STATIONS),
    *(DIFFERENCES, ELEMENTS, AXES, DEVIATIONS, INTRUSIONS, CLEARANCE, PLATFORMS, WIRES, PLACES),
)
"""Every kind of layer that a run can write."""
