"""Alignments of a LandXML file: those of this program, and those of other programs.

Branches of the file are read piece by piece, so that it may be larger than the memory. The parser never resolves
entities: a file that declares any, such as one that expands to gigabytes, is refused. Each plan element is placed by
its two ends and shaped by its length and radii. Directions that a file states are not used, because programs disagree
on their sense.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET  # nosec B405 - files with a DOCTYPE are refused before any entity is read
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Optional
from xml.parsers import expat

import numpy as np

from ..alignment.elements import (
    SAME_PLACE_M,
    Alignment,
    CantElement,
    Element,
    Figures,
    PlanElement,
    StationRange,
    Stations,
    VerticalElement,
    displaced,
)
from ..design_numbers import CANT_MM, GRADE, LENGTH, NUMBER, RADIUS, Kind, check_turn, checked, quoted
from ..errors import AlignmentFileError
from ..frame import ORIGIN_STEP, LocalFrame
from ..progress import SILENT, Progress
from .design import BREAK_M, within_plan

METRE = ("meter", "metre")

EPSG_CODE = re.compile(r"\s*(?:EPSG:)?(\d{4,6})\s*")

OWN_NAME = re.compile(r"Track (\d{1,9})")
"""Name that this program gives to a track."""

HEADS = {
    b"ISO-10303-21": "an IFC file",
    b"PK\x03\x04": "a ZIP archive",
    b"LASF": "a point cloud",
    b"SQLite format 3": "a GeoPackage",
    b"  0\r\nSECTION": "a DXF file",
    b"  0\nSECTION": "a DXF file",
    b"%PDF": "a PDF file",
}
"""How files begin that are given by mistake."""

MAX_MISFIT_M = 0.02
"""Largest difference between the stated ends of an element and those that its length and radii give, metres: programs
that write millimetres stay below 3 mm."""

MAX_GAP_M = 0.1
"""Gap between two elements (in the profile, overlap of two curves) that is a mistake, metres: the user is told
of one of `BREAK_M`; a published file of a railway has an overlap of 21 mm."""

MIN_BULGE_M = 0.005
"""Distance of a spiral's PI from its chord above which it shows to which side the spiral turns, metres: the PI may be
rounded to millimetres."""

STRAIGHT = ("inf", "infinity")
"""Radii of a straight end of a spiral, in small letters."""

TURNS = {"ccw": 1.0, "cw": -1.0}


def read_landxml(path: Path, east_first: bool = False, progress: Progress = SILENT) -> tuple[Alignment, ...]:
    """Read the alignments of a LandXML file, of which points may be written easting first, against the format.

    They are in local metres of one frame without a coordinate system. Tracks are numbered in the order of the file; `s`
    starts at 0. Raises AlignmentFileError if the file is damaged, or states something that can't be read.
    """
    _check_kind(path)
    found = list(branches(path, "LandXML", ("Units", "Alignments"), progress))
    _check_units(path.name, [unit for branch in found if branch.tag == "Units" for unit in branch], progress)
    drawn = [node for branch in found for node in branch.iterfind("Alignment") if node.find("CoordGeom") is not None]
    if not drawn:
        raise AlignmentFileError(
            f"{path.name} has no alignment with a CoordGeom: export the alignments from the design program, too."
        )
    wheres = [f"alignment {_name_of(node)[:60] or number} of {path.name}" for number, node in enumerate(drawn, 1)]
    plans = [parts_of(node, where, progress) for node, where in zip(drawn, wheres)]
    _check_turns(path.name, [part for plan in plans for part in plan], east_first)
    start = plans[0][0].start if east_first else plans[0][0].start[::-1]
    frame = LocalFrame(np.append(np.round(start / ORIGIN_STEP) * ORIGIN_STEP, 0.0))
    return tuple(
        _alignment(node, where, track_id, placed(plan, frame, east_first, progress), frame, progress)
        for node, where, track_id, plan in zip(drawn, wheres, _track_ids(drawn), plans)
    )


def stated_system(path: Path) -> Optional[str]:
    """Return the code of the coordinate system that a LandXML file states before its alignments, such as EPSG:25832."""
    _check_kind(path)
    first = next(branches(path, "LandXML", ("CoordinateSystem", "Alignments")), None)
    code = EPSG_CODE.fullmatch(first.get("epsgCode", "")) if first is not None else None
    return f"EPSG:{code[1]}" if code else None


def _alignment(
    node: ET.Element,
    where: str,
    track_id: int,
    plan: tuple[PlanElement, ...],
    frame: LocalFrame,
    progress: Progress,
) -> Alignment:
    """Return an alignment with its profile, cant and kilometres."""
    stations = stations_of_file(node, where)
    profile, cant = profile_of(node, where, progress), cant_of(node, where, progress)
    made = Alignment(track_id, frame, plan, profile, cant, _name_of(node))
    return with_kilometres(within_plan(made, where, progress, float(node.get("staStart", "0"))), stations, progress)


def _name_of(node: ET.Element) -> str:
    """Return the name of an alignment on one line, as messages and layers state it."""
    return " ".join(node.get("name", "").split())


def _track_ids(nodes: Sequence[ET.Element]) -> list[int]:
    """Return the numbers in the names if this program has given them, else numbers from 1."""
    found = [OWN_NAME.fullmatch(_name_of(node)) for node in nodes]
    numbers = [int(one[1]) for one in found if one]
    return numbers if len(set(numbers)) == len(nodes) else list(range(1, len(nodes) + 1))


def _check_kind(path: Path) -> None:
    """Refuse files of other kinds that are given by mistake."""
    try:
        with path.open("rb") as file:
            head = file.read(64).lstrip(b"\xef\xbb\xbf")
    except OSError as error:
        raise AlignmentFileError(f"{path} can't be read ({error.strerror}): check its name and your rights.") from error
    kind = next((kind for start, kind in HEADS.items() if head.startswith(start)), None)
    if kind or not head:
        raise AlignmentFileError(f"{path.name} is {kind or 'empty'}, not LandXML: export the alignments as LandXML.")


def _check_units(name: str, stated: Sequence[ET.Element], progress: Progress) -> None:
    """Refuse lengths in other units than metres."""
    unit = stated[0].get("linearUnit", "") if stated else ""
    if not unit:
        progress.warning(f"{name} states no unit of length: it is read as metres.")
    elif unit not in METRE:
        raise AlignmentFileError(
            f"{name} is in another unit than metres ({unit[:40]}): export it again with metres as the unit of length."
        )


def _check_turns(name: str, parts: Sequence[Part], east_first: bool) -> None:
    """Check that curves turn to the side that they state: easting and northing exchanged mirror the plane."""
    votes = [(part, (part.k_from + part.k_to) * part.seen * (-1.0 if east_first else 1.0)) for part in parts]
    against = [part for part, vote in votes if vote < 0]
    if not against:
        return
    if not any(vote > 0 for _, vote in votes):
        first, remedy = ("northing", "leave EAST_FIRST off") if east_first else ("easting", "set EAST_FIRST")
        raise AlignmentFileError(
            f"All curves of {name} turn to the other side than they state, because its points are written {first} "
            f"first: {remedy}."
        )
    raise AlignmentFileError(f"The {against[0].where} turns to the other side than it states: repair it.")


CHUNK = 1 << 18
"""Bytes parsed between two checks for cancellation: some milliseconds."""

MAX_NODES, MAX_CHARACTERS = 2_000_000, 100_000_000
"""Largest branches: a hundred times those of a whole railway, and some hundred megabytes of memory."""

MAX_DEPTH = 100
"""Deepest nesting: that of LandXML is ten."""


def branches(path: Path, root: str, names: Collection[str], progress: Progress = SILENT) -> Iterator[ET.Element]:
    """Yield the children of the root with the given names, in the order of the file, whole; others are passed over.

    Raises AlignmentFileError if the file can't be read, is not XML with this root, is damaged, declares entities, or
    its branches are too large.
    """
    try:
        with path.open("rb") as file:
            size = max(path.stat().st_size, 1)
            gardener = _Gardener(path.name, root, names)
            while True:
                progress.check()
                chunk = file.read(CHUNK)
                gardener.feed(chunk)
                yield from gardener.harvest()
                if not chunk:
                    return
                progress.set_fraction(file.tell() / size)
    except OSError as error:
        raise AlignmentFileError(f"{path} can't be read ({error.strerror}): check its name and your rights.") from error


class _Gardener:
    """Grows the wanted branches while the file is parsed."""

    def __init__(self, name: str, root: str, names: Collection[str]) -> None:
        self._name, self._root, self._names = name, root, names
        self._done: list[ET.Element] = []
        self._open: list[ET.Element] = []
        self._last: ET.Element | None = None  # which text follows
        self._text: list[str] = []
        self._depth = self._nodes = self._characters = 0
        self._parser = expat.ParserCreate()
        self._parser.buffer_text = True
        self._parser.StartDoctypeDeclHandler = self._refuse_declarations
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._add

    def feed(self, chunk: bytes) -> None:
        """Parse a part of the file; an empty one ends it."""
        try:
            self._parser.Parse(chunk, not chunk)
        except (expat.ExpatError, LookupError, ValueError) as error:  # ValueError: an encoding that no parser knows
            raise AlignmentFileError(
                f"{self._name} is cut off, damaged or not XML ({error}): write it again in the program that made it."
            ) from None

    def harvest(self) -> list[ET.Element]:
        """Return the branches that have been completed since the last call."""
        done, self._done = self._done, []
        return done

    def _refuse_declarations(self, *_: object) -> None:
        raise AlignmentFileError(
            f"{self._name} declares a document type, which may hide anything behind its entities and which LandXML "
            "does not need: remove the DOCTYPE."
        )

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        name = tag.rpartition(":")[2]
        if self._depth == 0 and name != self._root:
            raise AlignmentFileError(f"{self._name} is XML of another kind: its root is {name[:40]}, not {self._root}.")
        if self._open or (self._depth == 1 and name in self._names):
            self._nodes += 1
            self._characters += sum(map(len, attributes.values()))
            self._check_size()
            self._end_text()
            self._last = ET.Element(name, attributes)
            if self._open:
                self._open[-1].append(self._last)
            self._open.append(self._last)
        self._depth += 1

    def _end(self, _: str) -> None:
        self._depth -= 1
        if self._open:
            branch = self._open.pop()
            self._end_text()
            if not self._open:
                self._done.append(branch)

    def _add(self, text: str) -> None:
        if self._last is not None:
            self._characters += len(text)
            self._check_size()
            self._text.append(text)

    def _end_text(self) -> None:
        """Give the last node its text, whose parts come in turn."""
        if self._last is not None and self._text:
            self._last.text = "".join(self._text)
        self._last, self._text = None, []

    def _check_size(self) -> None:
        if self._nodes > MAX_NODES or self._characters > MAX_CHARACTERS or self._depth > MAX_DEPTH:
            raise AlignmentFileError(
                f"{self._name} has more in its alignments than any railway: export the alignments you need only."
            )


@dataclass(frozen=True)
class Part:
    """A plan element as the file states it; messages name it by `where`.

    `start` and `end`, (2,), have the coordinates in the order of the file; curvatures are in 1/m, positive to the left.
    `seen` is 1 if the points, taken northing first, turn to the left, -1 to the right, 0 if they do not show it.
    """

    where: str
    start: np.ndarray
    end: np.ndarray
    length_m: float
    k_from: float
    k_to: float
    seen: float

    @property
    def chord_m(self) -> float:
        """Distance of the end from the start."""
        return math.dist(self.start, self.end)


def parts_of(node: ET.Element, name: str, progress: Progress) -> list[Part]:
    """Return the plan elements of the node of an alignment, which messages call `name`."""
    readers = {"Line": _line, "Curve": _curve, "Spiral": _spiral}
    found = []
    for number, child in enumerate((one for one in node.iterfind("CoordGeom/*") if one.tag != "Feature"), start=1):
        progress.check()
        where = f"{child.tag} {number} of {name}"
        if child.tag not in readers:
            raise AlignmentFileError(f"The {where} is neither line, arc nor clothoid: export an alignment of these.")
        part = readers[child.tag](child, where)
        if part.length_m <= SAME_PLACE_M and part.chord_m <= SAME_PLACE_M:
            continue
        checked(part.length_m, LENGTH, f"The {where}", "length")
        check_turn(part.length_m, part.k_from, part.k_to, f"The {where}")
        found.append(part)
    if not found:
        raise AlignmentFileError(f"The {name} has no element: export it with its geometry.")
    return found


def placed(parts: Sequence[Part], frame: LocalFrame, east_first: bool, progress: Progress) -> tuple[PlanElement, ...]:
    """Return plan elements in local metres, from `s` = 0; warn of gaps.

    Raises AlignmentFileError if an element is missing, or one does not fit its ends.
    """
    made: list[PlanElement] = []
    s, widest_m = 0.0, 0.0
    for before, part in zip([None, *parts], parts):
        progress.check()
        if before is not None:
            gap_m = float(np.hypot(*(part.start - before.end)))
            widest_m = max(widest_m, gap_m)
            if gap_m > MAX_GAP_M:
                raise AlignmentFileError(
                    f"The {part.where} starts {gap_m:.2f} m from the end of the element before: the file lacks one."
                )
        made.append(_placed(part, s, frame, east_first))
        s += part.length_m
    if widest_m > BREAK_M:
        progress.warning(f"The elements up to the {parts[-1].where} have gaps of up to {1000 * widest_m:.1f} mm.")
    return tuple(made)


def _placed(part: Part, s: float, frame: LocalFrame, east_first: bool) -> PlanElement:
    """Return an element whose chord runs from the stated start to the stated end."""
    places = [place if east_first else place[::-1] for place in (part.start, part.end)]
    start, end = (frame.to_local(np.append(place, 0.0))[:2] for place in places)
    u, k_from = np.array([part.length_m]), np.array([part.k_from])
    change = np.array([(part.k_to - part.k_from) / part.length_m])
    way, chord = displaced(u, np.zeros(1), k_from, change)[0], end - start
    misfit_m = abs(math.hypot(*way) - math.hypot(*chord))
    if misfit_m > MAX_MISFIT_M:
        raise AlignmentFileError(
            f"The {part.where} misses its end by {misfit_m:.3f} m with its length and radii: export the file again."
        )
    heading = math.atan2(chord[1], chord[0]) - math.atan2(way[1], way[0])
    return PlanElement(s, part.length_m, float(start[0]), float(start[1]), heading, part.k_from, part.k_to)


def _line(node: ET.Element, where: str) -> Part:
    start, end = (_place(node, name, where) for name in ("Start", "End"))
    _optional(node, "length", where, LENGTH if math.dist(start, end) > SAME_PLACE_M else NUMBER)
    return Part(where, start, end, math.dist(start, end), 0.0, 0.0, 0.0)


def _curve(node: ET.Element, where: str) -> Part:
    start, centre, end = (_place(node, name, where) for name in ("Start", "Center", "End"))
    turn, seen_m = _turn(node, where), math.dist(start, centre)
    if seen_m <= SAME_PLACE_M:
        raise AlignmentFileError(f"The start of the {where} coincides with its centre: export the file again.")
    radius_m = abs(_optional(node, "radius", where, RADIUS) or seen_m)
    if abs(radius_m - seen_m) > MAX_MISFIT_M:
        raise AlignmentFileError(
            f"The {where} states a radius of {radius_m:.3f} m, but its centre is {seen_m:.3f} m from its start: export "
            "the file again."
        )
    half = math.asin(min(0.5 * math.dist(start, end) / radius_m, 1.0))
    length_m = _optional(node, "length", where, LENGTH)
    if length_m is None:
        length_m = 2.0 * half * radius_m
    # The centre of more than half a circle is on the other side of the chord.
    side = _side(start, end, centre) * (1.0 if length_m <= math.pi * radius_m else -1.0)
    return Part(where, start, end, length_m, turn / radius_m, turn / radius_m, side)


def _spiral(node: ET.Element, where: str) -> Part:
    kind = node.get("spiType", "")
    if kind != "clothoid":
        raise AlignmentFileError(
            f"The {where} is a transition of type {kind[:40] or 'unknown'}, and only clothoids can be read: export the "
            "alignment with clothoids."
        )
    start, meet, end = (_place(node, name, where) for name in ("Start", "PI", "End"))
    turn = _turn(node, where)
    k_from, k_to = (turn / _radius(node, name, where) for name in ("radiusStart", "radiusEnd"))
    chord = end - start
    aside = chord[0] * (meet - start)[1] - chord[1] * (meet - start)[0]
    bulge_m = abs(float(aside)) / max(float(np.hypot(*chord)), SAME_PLACE_M)
    side = -_side(start, end, meet) if bulge_m > MIN_BULGE_M else 0.0
    return Part(where, start, end, _needed(node, "length", where, LENGTH), k_from, k_to, side)


def _side(start: np.ndarray, end: np.ndarray, place: np.ndarray) -> float:
    """Return 1 if a place, northing first, lies to the left of a chord, else -1."""
    north, east = end - start
    place_north, place_east = place - start
    return math.copysign(1.0, east * place_north - north * place_east)


def profile_of(node: ET.Element, name: str, progress: Progress) -> tuple[VerticalElement, ...]:
    """Return grades and parabolas of the first profile of an alignment; none if it has no profile.

    A circle becomes the parabola of the same tangents. See `parts_of`.
    """
    profiles = [one for one in node.iterfind("Profile/ProfAlign") if len(one)]
    if len(profiles) > 1:
        progress.warning(f"The {name} has {len(profiles)} profiles: the first one is read.")
    start = _needed(node, "staStart", name)
    meetings = [_meeting(one, start, name) for one in profiles[0] if one.tag != "Feature"] if profiles else []
    if len(meetings) < 2:
        return ()
    s, z, nodes = (list(column) for column in zip(*meetings))
    steps = np.diff(s)
    if (steps <= 0).any():
        raise AlignmentFileError(f"The profile of the {name} goes back at {s[int(np.argmin(steps))]:.2f} m: repair it.")
    grades = np.diff(z) / steps
    steepest = int(np.argmax(np.abs(grades)))
    checked(float(grades[steepest]), GRADE, f"The profile of the {name} at {s[steepest]:.2f} m", "gradient")
    lengths = [0.0, *(_curve_length(*one, name) for one in zip(nodes[1:-1], grades[:-1], grades[1:])), 0.0]
    return tuple(_tangents_and_curves(s, z, grades, lengths, name))


def _tangents_and_curves(
    s: Sequence[float], z: Sequence[float], grades: np.ndarray, lengths: Sequence[float], name: str
) -> Iterator[VerticalElement]:
    """Yield the elements between points where tangents meet."""
    done, height = s[0], z[0]
    for number, grade in enumerate(grades):
        tangent_m = s[number + 1] - 0.5 * lengths[number + 1] - done
        if tangent_m < -MAX_GAP_M:
            raise AlignmentFileError(
                f"Two curves of the profile of the {name} overlap by {-tangent_m:.2f} m at {done:.2f} m: repair it."
            )
        if tangent_m > BREAK_M:
            yield VerticalElement(done, tangent_m, height, grade, grade)
            done, height = done + tangent_m, height + tangent_m * grade
        length_m = lengths[number + 1]
        if length_m:
            following = grades[number + 1]
            yield VerticalElement(done, length_m, height, grade, following)
            done, height = done + length_m, height + 0.5 * length_m * (grade + following)


def _meeting(node: ET.Element, start: float, name: str) -> tuple[float, float, ET.Element]:
    """Return place along the curve, height and node of a point where tangents meet."""
    where = f"{node.tag} in the profile of the {name}"
    if node.tag not in ("PVI", "CircCurve", "ParaCurve"):
        raise AlignmentFileError(f"The {where} is neither circle nor parabola: export a profile of these.")
    station, z = _numbers(node.text, 2, where)
    return station - start, z, node


def _curve_length(node: ET.Element, before: float, after: float, name: str) -> float:
    """Return the plan length of a curve between two gradients; 0 where the tangents meet without one."""
    where = f"{node.tag} in the profile of the {name}"
    if node.tag == "PVI" or before == after:
        return 0.0
    radius = _optional(node, "radius", where, RADIUS) if node.tag == "CircCurve" else None
    if radius:
        return abs(radius) * abs(math.atan(after) - math.atan(before))
    return _needed(node, "length", where, LENGTH)


def cant_of(node: ET.Element, name: str, progress: Progress) -> tuple[CantElement, ...]:
    """Return constant cant and ramps of an alignment; none if it has no cant. See `parts_of`."""
    cant = node.find("Cant")
    if cant is None:
        return ()
    stations = cant.findall("CantStation")
    where = f"cant of the {name}"
    if any(one.get("transitionType", "clothoid") != "clothoid" for one in stations):
        progress.warning(f"The {where} has ramps that are not straight: they are read as straight ones.")
    if cant.get("rotationPoint", "center") != "center":
        progress.warning(
            f"The {where} turns about {cant.get('rotationPoint')}: the profile is that of this rail, not of the "
            "centerline, and lifts include half the cant."
        )
    start = _needed(node, "staStart", where)
    knots = [(_needed(one, "station", where) - start, _signed_cant_m(one, where)) for one in stations]
    if any(after[0] < before[0] for before, after in zip(knots, knots[1:])):
        raise AlignmentFileError(f"The stations of the {where} are out of order: repair it.")
    return tuple(
        CantElement(one[0], after[0] - one[0], one[1], after[1])
        for one, after in zip(knots, knots[1:])
        if after[0] - one[0] > SAME_PLACE_M
    )


def _signed_cant_m(node: ET.Element, where: str) -> float:
    """Return the cant, left rail minus right rail; adverse cant is negative, or positive and marked."""
    outer_mm = _needed(node, "appliedCant", where, CANT_MM)
    if node.get("adverse") in ("true", "1"):
        outer_mm = -abs(outer_mm)
    return -_turn(node, where, "curvature") * outer_mm / 1000.0 + 0.0


def stations_of_file(node: ET.Element, name: str) -> Stations:
    """Return the stations of an alignment, with its station equations."""
    start = _needed(node, "staStart", name)
    pieces = [StationRange(0.0, start)]
    equations = sorted(node.iterfind("StaEquation"), key=lambda one: _needed(one, "staInternal", name))
    for one in equations:
        s = _needed(one, "staInternal", name) - start
        rises = {"increasing": True, "decreasing": False}.get(one.get("staIncrement", ""), pieces[-1].rises)
        if s - pieces[-1].s <= SAME_PLACE_M:  # also where the alignment begins behind its first equation
            pieces.pop()
        pieces.append(StationRange(s, _needed(one, "staAhead", name), rises))
    return Stations(tuple(pieces))


def with_kilometres(alignment: Alignment, stations: Stations, progress: Progress) -> Alignment:
    """Return an alignment with the kilometres of the ends of all its elements."""

    def numbered(elements: Sequence[Any]) -> tuple[Any, ...]:
        made = []
        for one in elements:
            progress.check()
            made.append(replace(one, figures=_kilometres(one, stations)))
        return tuple(made)

    vertical, cant = numbered(alignment.vertical), numbered(alignment.cant)
    return replace(alignment, plan=numbered(alignment.plan), vertical=vertical, cant=cant)


def _kilometres(one: Element, stations: Stations) -> Figures:
    return replace(one.figures, km_from=stations.ahead(one.s_from) / 1000, km_to=stations.behind(one.s_to) / 1000)


def _turn(node: ET.Element, where: str, name: str = "rot") -> float:
    """Return 1 for a curve to the left, -1 for one to the right."""
    turn = TURNS.get(node.get(name, ""))
    if turn is None:
        raise AlignmentFileError(f"The {where} does not state cw or ccw as its {name}: export the file again.")
    return turn


def _radius(node: ET.Element, name: str, where: str) -> float:
    """Return a radius; infinity where the element is straight."""
    straight = (node.get(name) or "").strip().lstrip("+-").lower() in STRAIGHT
    return math.inf if straight else abs(_needed(node, name, where, RADIUS))


def _place(node: ET.Element, name: str, where: str) -> np.ndarray:
    """Return a point in plan, (2,), in the order of the file."""
    child = node.find(name)
    if child is None or not (child.text or "").strip():
        raise AlignmentFileError(
            f"The {where} has no coordinates for its {name}: export the file with the coordinates of all points."
        )
    return np.array(_numbers(child.text, 2, f"{name} of the {where}"))


def _numbers(text: Optional[str], count: int, where: str) -> list[float]:
    """Return the first numbers of a text."""
    try:
        found = [float(word) for word in (text or "").split()[:count]]
    except ValueError:
        found = []
    if len(found) < count or any(map(math.isnan, found)):
        raise AlignmentFileError(f"The {where} is not a list of numbers ({quoted((text or '').strip())}): repair it.")
    return [checked(value, NUMBER, f"The {where}", "coordinate") for value in found]


def _needed(node: ET.Element, name: str, where: str, kind: Kind = NUMBER) -> float:
    """Return a number of a kind that an element must state."""
    value = _optional(node, name, where, kind)
    if value is None:
        raise AlignmentFileError(f"The {where} does not state its {name}: export the file again.")
    return value


def _optional(node: ET.Element, name: str, where: str, kind: Kind = NUMBER) -> Optional[float]:
    """Return a number of a kind; None where it is not stated."""
    text = node.get(name)
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise AlignmentFileError(f"The {where} states {quoted(text)} as its {name}, which is not a number: repair it.")
    return checked(value, kind, f"The {where}", name)
