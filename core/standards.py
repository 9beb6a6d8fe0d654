"""Rail standards: gauge and railhead width by name.

Head widths come from tables of rail sections, which differ by 1 to 3 mm because they measure at different places on the
head. See docs/method.md section 10.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from .errors import ParameterError

Gauge = tuple[float, float]
"""Gauge, and width of a railhead on it, metres; their sum is the distance between the axes of the heads."""

DEFAULT = "EN_60E1_1435"
CUSTOM, DETECT = "CUSTOM", "DETECT"
"""Choices that are not standards: both numbers are given, or the standard is detected from the points."""

RAIL_CLASS, LAST_CLASS = 10, 255
"""Class of rail points in the LAS specification, and the largest class: a class is one byte."""

NOISE_CLASSES = (7, 18)
"""Classes of low and high noise in LAS 1.4."""

SEARCHED_CLASSES = tuple(code for code in range(LAST_CLASS + 1) if code not in NOISE_CLASSES)
"""Classes in which the rails of a raw cloud are looked for: whatever it has been classified for."""

GAUGE_RANGE_MM = (500.0, 2000.0)
"""From below the narrowest public railways (600 mm) to above the widest gauge in use (1676 mm)."""

HEAD_WIDTH_RANGE_MM = (40.0, 90.0)
"""From the lightest mine rails to above the widest head in tables (77.79 mm, 141RE); crane rails are wider."""

SPACING_RANGE_M = tuple((gauge + head) / 1000 for gauge, head in zip(GAUGE_RANGE_MM, HEAD_WIDTH_RANGE_MM))
"""Range of the distances between the axes of a track's rails."""


@dataclass(frozen=True)
class RailStandard:
    """A rail profile on a gauge, known by its name, a key of `STANDARDS` that never changes, or CUSTOM.

    `label` is shown to users, and `region` is where the profile is laid. `sources` has the letters of `SOURCES` that
    confirm the width of the head; empty if none does.
    """

    name: str
    label: str
    gauge_m: float
    head_width_m: float
    region: str = ""
    sources: str = ""

    @property
    def profile(self) -> str:
        """Name of the profile to show to users, without the gauge."""
        return self.label.rpartition(",")[0]

    @property
    def is_usual(self) -> bool:
        """Whether the profile is that of the default."""
        return self.name.rpartition("_")[0] == DEFAULT.rpartition("_")[0]

    @property
    def description(self) -> str:
        """Region, profile, gauge and head width, as a list sorts them by region."""
        return f"{self.region}: {self.label}, head {1000 * self.head_width_m:g} mm"


UNCONFIRMED = " (unconfirmed width)"

SOURCES = {
    "W": "Wirth Rail, American rails",
    "P": "Rail section properties (AREMA 2015, EN 13674-1, AS 1085, JIS)",
    "X": "cranerailclips, EN rails",
    "A": "AGICO, Australian rails",
    "K": "IIT Kanpur, Indian rails",
    "C": "chinarailfastener and railroad-fastener, Chinese rails",
    "G": "the example of Gribov and Chang",
}
"""Tables of rail sections that confirm head widths, by their letter."""

# profile, name to show to users, head width in mm, letters of the tables that confirm it, gauges in mm
_PROFILES = (
    ("US_90ARAA", "US 90 ARA-A", 65.09, "W", (1435,)),
    ("US_100ARAA", "US 100 ARA-A", 69.85, "W", (1435,)),
    ("US_100RE", "US 100RE", 68.26, "W", (1435,)),
    ("US_115RE", "US 115RE", 69.06, "W, P", (1435,)),  # Esri's tool: 66.675
    ("US_119RE", "US 119RE", 67.47, "W", (1435,)),
    ("US_132RE", "US 132RE", 76.20, "W, G", (1435,)),
    ("US_133RE", "US 133RE", 76.20, "W", (1435,)),
    ("US_136RE", "US 136RE", 74.61, "W, P", (1435,)),
    ("US_141RE", "US 141RE", 77.79, "W, P", (1435,)),
    ("EN_45E1", "EN 45E1 (BS 90A)", 66.6, "X", (1435,)),
    ("EN_46E2", "EN 46E2 (U33)", 62.0, "X", (1435,)),
    ("EN_49E1", "EN 49E1 (S49)", 67.0, "X", (1435, 1000)),
    ("EN_50E2", "EN 50E2", 72.0, "X", (1435,)),
    ("EN_50E4", "EN 50E4", 70.0, "X", (1435,)),
    ("EN_50E6", "EN 50E6 (U50)", 65.0, "X", (1435,)),
    ("EN_54E1", "EN 54E1 (UIC 54)", 70.0, "P, X", (1435, 1600, 1668, 1000)),
    ("EN_60E1", "EN 60E1 (UIC 60)", 72.0, "P", (1435, 1668)),  # 74.3 at the widest point in K and C
    ("BS_113A", "BS 113A (56E1)", 69.85, "", (1435,)),
    ("GB_50", "GB 50 kg/m", 70.0, "C", (1435,)),
    ("GB_60", "GB 60 kg/m", 73.0, "", (1435,)),
    ("GB_75", "GB 75 kg/m", 75.0, "C", (1435,)),
    ("AS_60", "AS 60 kg/m", 70.0, "P, A", (1435, 1067, 1600)),
    ("AS_68", "AS 68 kg/m", 74.6, "P", (1435,)),  # 73 in A
    ("JIS_60", "JIS 60 kg", 65.0, "P", (1435, 1067)),
    ("JIS_40N", "JIS 40N", 64.0, "P", (1067,)),
    ("JIS_37A", "JIS 37A", 62.71, "P", (1067,)),
    ("AS_41", "AS 41 kg/m", 63.5, "A", (1067,)),
    ("IN_52KG", "India 52 kg", 67.0, "K", (1676,)),
    ("IN_60KG", "India 60 kg", 72.0, "P", (1676,)),  # 74.3 at the widest point in K
    ("IN_90R", "India 90R", 66.7, "K", (1676, 1000)),
    ("IN_75R", "India 75R", 61.91, "G", (1000,)),
    ("IN_60R", "India 60R", 57.15, "", (1000,)),
    ("RU_R50", "Russia R50", 72.0, "", (1520,)),  # a trader: 70
    ("RU_R65", "Russia R65", 75.0, "", (1520,)),  # about 73 at the top
    ("S33", "S33", 58.0, "", (1000,)),
    ("S41", "S41", 67.0, "", (1000,)),
    ("EN_46E1", "EN 46E1 (SBB I)", 65.0, "", (1000,)),
)


_REGIONS = {
    "US": "North America",
    "EN": "Europe",
    "S33": "Europe",
    "S41": "Europe",
    "BS": "Great Britain",
    "GB": "China",
    "AS": "Australia",
    "JIS": "Japan",
    "IN": "India",
    "RU": "Russia",
}
"""Regions by the first word of a profile."""


def _standards() -> dict[str, RailStandard]:
    table = {}
    for profile, label, head_width_mm, sources, gauges_mm in _PROFILES:
        for gauge_mm in gauges_mm:
            name = f"{profile}_{gauge_mm}"
            text = f"{label}, {gauge_mm} mm" + ("" if sources else UNCONFIRMED)
            region = _REGIONS[profile.split("_")[0]]
            table[name] = RailStandard(name, text, gauge_mm / 1000, head_width_mm / 1000, region, sources)
    return table


LEAST_ERROR_M = 0.001
"""Least standard deviation of a track across and in height: no survey is better."""

SAME_GAUGE_M = 0.02
"""Largest deviation of a measured gauge from a nominal one: half the difference between the closest two, and worn track
deviates less."""

SAME_M = 0.002
"""Difference between two standards that measuring does not show: the default profile is preferred by this much."""

STANDARDS = _standards()
"""All standards by name, except CUSTOM."""


def resolve(name: str, gauge_mm: float | None = None, head_width_mm: float | None = None) -> RailStandard:
    """Look up a standard; a gauge or a head width, if given, overrides that of the standard, and CUSTOM needs both.

    Raises ParameterError if the name is unknown, a number is missing for CUSTOM, or a number is outside the range of
    railways.

    Examples
    --------
    >>> resolve("EN_60E1_1435").description
    'Europe: EN 60E1 (UIC 60), 1435 mm, head 72 mm'
    >>> resolve("EN_60E1_1435", gauge_mm=1440).gauge_m
    1.44
    >>> resolve("CUSTOM", 600, 50).label
    '50 mm head, 600 mm'
    """
    if name != CUSTOM and name not in STANDARDS:
        raise ParameterError(f"The rail standard {name!r} is unknown: choose a name such as {DEFAULT}, or {CUSTOM}.")
    if gauge_mm is not None:
        _check("gauge", gauge_mm, GAUGE_RANGE_MM)
    if head_width_mm is not None:
        _check("railhead width", head_width_mm, HEAD_WIDTH_RANGE_MM)
    if name == CUSTOM:
        if gauge_mm is None or head_width_mm is None:
            raise ParameterError(
                "STANDARD CUSTOM needs both the gauge and the railhead width, in millimetres: fill in GAUGE and "
                "HEAD_WIDTH."
            )
        return _custom(gauge_mm / 1000, head_width_mm / 1000)
    standard = STANDARDS[name]
    if gauge_mm is None and head_width_mm is None:
        return standard
    return _custom(
        standard.gauge_m if gauge_mm is None else gauge_mm / 1000,
        standard.head_width_m if head_width_mm is None else head_width_mm / 1000,
    )


def closest_standard(spacing_m: float, head_width_m: float) -> RailStandard | None:
    """Find the standard that fits rails as they were measured: `spacing_m` is the distance between their axes.

    None if no standard has such a gauge, nor rails as far apart: heads in blunt clouds, or more than heads in a class,
    look wider than they are, and the distance is right nevertheless. The usual profile of a gauge stands for the others
    then.

    Examples
    --------
    >>> closest_standard(1.0619, 0.0622).name
    'IN_75R_1000'
    """

    def apart(standard: RailStandard) -> float:
        return abs(standard.gauge_m + standard.head_width_m - spacing_m)

    def misfit(standard: RailStandard) -> float:
        return apart(standard) + abs(standard.head_width_m - head_width_m) - SAME_M * standard.is_usual

    gauge_m = spacing_m - head_width_m
    nearest = min(STANDARDS.values(), key=lambda one: abs(one.gauge_m - gauge_m))
    if abs(nearest.gauge_m - gauge_m) <= SAME_GAUGE_M:
        return min(of_gauge(nearest.gauge_m), key=misfit)
    nearest = min(STANDARDS.values(), key=apart)
    if apart(nearest) > SAME_GAUGE_M:
        return None
    return min(of_gauge(nearest.gauge_m), key=lambda one: (not one.is_usual, apart(one)))


def of_gauge(gauge_m: float) -> list[RailStandard]:
    """Return the standards of a gauge."""
    return [one for one in STANDARDS.values() if one.gauge_m == gauge_m]


def _custom(gauge_m: float, head_width_m: float) -> RailStandard:
    label = f"{head_width_m * 1000:g} mm head, {gauge_m * 1000:g} mm"
    return RailStandard(CUSTOM, label, gauge_m, head_width_m)


def is_class(word: str) -> bool:
    """Return whether a text is a class. Python refuses to read numbers of thousands of digits.

    >>> is_class("10"), is_class("256"), is_class("ten")
    (True, False, False)
    """
    return re.fullmatch(r"\d{1,9}", word) is not None and int(word) <= LAST_CLASS


def read_gauges(
    text: str, what: str, standard: RailStandard, tolerance_m: float, has_parameter: bool = True
) -> tuple[Gauge, ...]:
    """Read the gauges that tracks may have: that of the standard, and those of a text such as "1000/66;1067".

    The width of the railhead, millimetres like the gauge, may follow it; it is that of the standard otherwise. `what`
    names the parameter or option, for the ParameterError; `has_parameter` as in `distinct_gauges`.

    Examples
    --------
    >>> read_gauges("1000/66; 1067", "OTHER_GAUGES", STANDARDS["EN_60E1_1435"], 0.05)
    ((1.435, 0.072), (1.0, 0.066), (1.067, 0.072))
    """
    words = [word for word in re.split(r"[;,\s]+", re.sub(r"\s*/\s*", "/", text)) if word]
    numbers = [[float(part) for part in word.split("/")] if _PAIR.fullmatch(word) else [0.0] for word in words]
    if not all(all(pair) for pair in numbers):
        raise ParameterError(
            f'{what} "{text}" must be millimetres such as 1000;1067, or 1000/66 with the width of the railhead.'
        )
    heads_m = {standard.gauge_m: standard.head_width_m}
    for gauge_mm, *head_mm in numbers:
        for one in head_mm:
            _check("railhead width", one, HEAD_WIDTH_RANGE_MM)
        head_m = head_mm[0] / 1000 if head_mm else heads_m.get(gauge_mm / 1000, standard.head_width_m)
        if heads_m.setdefault(gauge_mm / 1000, head_m) != head_m:
            raise ParameterError(
                f"Tracks of {gauge_mm:g} mm gauge can't have railheads of {1000 * heads_m[gauge_mm / 1000]:g} and "
                f"{1000 * head_m:g} mm: give one width."
            )
    return tuple((one, heads_m[one]) for one in distinct_gauges(tuple(heads_m), tolerance_m, has_parameter))


_PAIR = re.compile(r"\d+(\.\d+)?(/\d+(\.\d+)?)?")
"""A gauge, and maybe the width of the railhead."""


def distinct_gauges(gauges_m: Sequence[float], tolerance_m: float, has_parameter: bool = True) -> tuple[float, ...]:
    """Return the gauges to pair rails by, without repetitions.

    `tolerance_m` is the largest deviation of a track from its gauge; `has_parameter` says whether the user can choose
    it. Raises ParameterError if a gauge is outside the range of railways, or two differ by less than the tolerance:
    tracks would be found twice.
    """
    distinct = tuple(dict.fromkeys(gauges_m))
    for gauge_m in distinct:
        _check("gauge", 1000 * gauge_m, GAUGE_RANGE_MM)
    for low, high in zip(sorted(distinct), sorted(distinct)[1:]):
        if high - low < tolerance_m:
            within, remedy = "", ""
            if has_parameter:
                within, remedy = f" within CENTERLINE_TOLERANCE ({tolerance_m:g} m)", ", or a smaller tolerance"
            raise ParameterError(
                f"Gauges of {1000 * low:g} and {1000 * high:g} mm can't be distinguished{within}: give one of "
                f"them{remedy}."
            )
    return distinct


def _check(quantity: str, value_mm: float, allowed_mm: tuple[float, float]) -> None:
    lowest, highest = allowed_mm
    if not (math.isfinite(value_mm) and lowest <= value_mm <= highest):
        raise ParameterError(
            f"A {quantity} of {value_mm:g} mm is not possible: give millimetres from {lowest:g} to {highest:g}."
        )


def width_at(spacing_m: float, gauges: Sequence[Gauge]) -> float:
    """Return the width of the railheads of a track whose rails are at a distance, that of the nearest gauge, metres.

    Examples
    --------
    >>> width_at(1.061, [(1.435, 0.072), (1.0, 0.066)])
    0.066
    """
    return min(gauges, key=lambda one: abs(sum(one) - spacing_m))[1]
