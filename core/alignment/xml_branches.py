"""Branches of an XML file: read piece by piece, so that a file may be larger than the memory.

The parser never resolves entities: a file that declares any, such as one that expands to gigabytes, is refused.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET  # nosec B405 - files with a DOCTYPE are refused before any entity is read
from collections.abc import Collection, Iterator
from pathlib import Path
from xml.parsers import expat

from ..errors import AlignmentFileError
from ..progress import SILENT, Progress

CHUNK = 1 << 18
"""Bytes parsed between two checks for cancellation: some milliseconds."""

MAX_NODES, MAX_CHARACTERS = 2_000_000, 100_000_000
"""Largest branches: a hundred times those of a whole railway, and some hundred megabytes of memory."""

MAX_DEPTH = 100
"""Deepest nesting: that of LandXML is ten."""


def branches(path: Path, root: str, names: Collection[str], progress: Progress = SILENT) -> Iterator[ET.Element]:
    """Yield the children of the root with the given names, in the order of the file, whole; others are passed over.

    Parameters
    ----------
    path : Path
    root : str
        Name of the root.
    names : collection of str
        Names, without a namespace.
    progress : Progress

    Raises
    ------
    AlignmentFileError
        The file can't be read, is not XML with this root, is damaged, declares entities, or its branches are too large.
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
