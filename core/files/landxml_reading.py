"""Alignments of a LandXML file: those of this program, and those of other programs.

Branches of the file are read piece by piece, so that it may be larger than the memory. The parser never resolves
entities: a file that declares any, such as one that expands to gigabytes, is refused.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET  # nosec B405 - files with a DOCTYPE are refused before any entity is read
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Optional
from xml.parsers import expat

import numpy as np

from ..alignment.elements import Alignment, PlanElement
from ..errors import AlignmentFileError
from ..frame import ORIGIN_STEP, LocalFrame
from ..progress import SILENT, Progress
from .design import within_plan
from .landxml_parts import Part, cant_of, parts_of, placed, profile_of, stations_of_file, with_kilometres

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
