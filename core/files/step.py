"""Text of a STEP file (ISO 10303-21), the form in which IFC models are exchanged."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from ..progress import SILENT, Progress

GUID_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$"
"""Digits in which IFC writes a GUID, by value."""

NAMESPACE = uuid.UUID("5b0a9f52-0d0c-4d67-9a3b-6d3a3e2f7c11")
"""Of the GUIDs: equal names give equal ids, so that a file that is written again replaces what it showed."""


@dataclass(frozen=True)
class Ref:
    """Reference to an instance."""

    number: int


@dataclass(frozen=True)
class Enum:
    """Item of an enumeration."""

    name: str


@dataclass(frozen=True)
class Measure:
    """Value with the name of its type, where an attribute admits several types."""

    type: str
    value: float | bool


@dataclass(frozen=True)
class Whole:
    """Number of the type INTEGER; all others are written as REAL."""

    value: int


DERIVED = Enum("")
"""Attribute that the schema computes."""


class StepFile:
    """Instances of a STEP file, in the order in which they are added; adding them can be cancelled."""

    def __init__(self, progress: Progress = SILENT) -> None:
        self._lines: list[str] = []
        self._progress = progress

    def add(self, entity: str, *attributes: Any) -> Ref:
        """Add an instance of a type such as IfcProject; see `written` for the attributes."""
        self._progress.check()
        number = len(self._lines) + 1
        self._lines.append(f"#{number}={entity.upper()}({','.join(map(written, attributes))});\n")
        return Ref(number)

    def text(self, schema: str, view: str, name: str, program: str, made: datetime) -> str:
        """Return the text of the file, given schema, model view, its name, the program that writes it, and the time."""
        stamp = written(made.replace(microsecond=0).isoformat())
        head = (
            f"FILE_DESCRIPTION(({written(f'ViewDefinition [{view}]')}),'2;1');\n"
            f"FILE_NAME({written(name)},{stamp},(''),(''),{written(program)},{written(program)},'');\n"
            f"FILE_SCHEMA(({written(schema)}));\n"
        )
        return f"ISO-10303-21;\nHEADER;\n{head}ENDSEC;\nDATA;\n{''.join(self._lines)}ENDSEC;\nEND-ISO-10303-21;\n"


def guid(*names: object) -> str:
    """Return the id, 22 digits, that IFC writes for what these names name."""
    number = uuid.uuid5(NAMESPACE, "/".join(map(str, names))).int
    return "".join(GUID_DIGITS[number >> 6 * place & 63] for place in range(21, -1, -1))


def written(value: Any) -> str:
    """Write a value.

    >>> written(("Track 1", None, True, Whole(2), 1, Ref(7), Enum("LINE"), Measure("IFCLENGTHMEASURE", 1), DERIVED))
    "('Track 1',$,.T.,2,1.0,#7,.LINE.,IFCLENGTHMEASURE(1.0),*)"
    """
    if value is None:
        return "$"
    if isinstance(value, bool):
        return ".T." if value else ".F."
    if isinstance(value, str):
        return f"'{_escaped(value)}'"
    if isinstance(value, Ref):
        return f"#{value.number}"
    if isinstance(value, Enum):
        return f".{value.name}." if value.name else "*"
    if isinstance(value, Measure):
        return f"{value.type}({written(value.value)})"
    if isinstance(value, Sequence):
        return f"({','.join(map(written, value))})"
    return str(value.value) if isinstance(value, Whole) else _real(float(value))


def _real(value: float) -> str:
    """Write a number with all its digits; the format wants a point in it."""
    mantissa, exponent, power = repr(value + 0.0).upper().partition("E")
    return f"{mantissa if '.' in mantissa else mantissa + '.'}{exponent}{power}"


def _escaped(text: str) -> str:
    """Write characters outside ASCII by their numbers; double quotes and backslashes."""
    parts = []
    for one in text:
        if " " <= one <= "~":
            parts.append({"'": "''", "\\": "\\\\"}.get(one, one))
        else:
            parts.append(f"\\X2\\{one.encode('utf-16-be', 'replace').hex().upper()}\\X0\\")
    return "".join(parts)
