"""Parameters, outputs and figures of jobs, declared once for QGIS, the command line and Python.

A module of this package declares a job and imports neither numpy nor anything that needs it, so that the toolbox opens
before the packages are installed; what runs imports the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

NAME = r"(?<![\w./\\])[A-Z][A-Z_]+(?![\w/\\]|\.\w)"
"""A word in capitals that is not part of a path: in a message, the name of a parameter."""

UNBOUNDED = 1e9
"""Maximum of a number without an upper limit."""

M_DECIMALS, FINE_M_DECIMALS, MM_DECIMALS = 3, 4, 2
"""Decimals that a field shows for metres, for metres where tenths of a millimetre count, and for millimetres."""

FEW = 6
"""Most options of a choice that the help of a command lists."""

LINE, POINT, POLYGON, PLACES, TABLE = "line", "point", "polygon", "places", "table"
"""Kinds of layers; places are geometries of any kind, and a table needs none."""


@dataclass(frozen=True)
class Parameter:
    """What a run can be told; the subclasses are the kinds of values.

    Attributes
    ----------
    name : str
        As models, batch files and scripts know it, in capitals; it never changes.
    label : str
        As a dialog shows it, with the unit.
    advanced : bool
        Whether a dialog shows it on demand only.
    optional : bool
        Whether it may be left empty.
    default : object
        None if there is none.
    """

    name: str
    label: str
    help: str = ""
    advanced: bool = False
    optional: bool = False
    default: Any = None

    @property
    def required(self) -> bool:
        """Whether it must be given: there is no default."""
        return self.default is None and not self.optional

    @property
    def accepted(self) -> str:
        """What is accepted, in words."""
        first_sentence = self.help.split(". ")[0].rstrip(".")
        return first_sentence[:1].lower() + first_sentence[1:]

    def refusal(self, value: Any) -> str:
        """Return what is wrong with a value, and what to give instead."""
        return f"{self.name} can't be {'empty' if value in (None, '') else value}: give {self.accepted}."


@dataclass(frozen=True)
class Number(Parameter):
    """A number from `low` to `high`, in the unit of its label; `decimals` are those that a field shows."""

    low: float = 0.0
    high: float = UNBOUNDED
    whole: bool = False
    decimals: int = M_DECIMALS

    @property
    def accepted(self) -> str:
        """See `Parameter`."""
        return (
            f"{self.low:g} or more"
            if self.high == UNBOUNDED
            else f"a number from {self.low:,.10g} to {self.high:,.10g}"
        )


@dataclass(frozen=True)
class Flag(Parameter):
    """Yes or no."""


@dataclass(frozen=True)
class Choice(Parameter):
    """One of some options, or any number of them if there may be `several`; with `numbered` ones, the place of one."""

    options: tuple[str, ...] = ()
    several: bool = False
    numbered: bool = False

    @property
    def accepted(self) -> str:
        """See `Parameter`."""
        return f"one of its {len(self.options)} choices, such as {self.options[0]}"


@dataclass(frozen=True)
class Text(Parameter):
    """A text."""


@dataclass(frozen=True)
class Input(Parameter):
    """What is read, or how it is to be read; without a default."""


@dataclass(frozen=True)
class Cloud(Input):
    """Point clouds: files, folders of tiles, or virtual point clouds."""


@dataclass(frozen=True)
class LayerInput(Input):
    """A vector layer of one of some kinds; `transformed` if it may have another coordinate system than the cloud."""

    kinds: tuple[str, ...] = (LINE,)
    transformed: bool = False
    accepted = "a vector layer, or a vector file that can be read"


@dataclass(frozen=True)
class RasterInput(Input):
    """A rail raster."""

    accepted = "a raster layer, or a raster file that can be read"


@dataclass(frozen=True)
class FileInput(Input):
    """A file; `kinds` are the names that a dialog offers, as Qt writes them."""

    kinds: str = ""


@dataclass(frozen=True)
class FieldInput(Input):
    """A field of the layer `of`."""

    of: str = ""


@dataclass(frozen=True)
class System(Input):
    """A coordinate system."""


@dataclass(frozen=True)
class Extent(Input):
    """A rectangle."""

    accepted = "four numbers: xmin,xmax,ymin,ymax"


@dataclass(frozen=True)
class Place(Input):
    """A place on the map."""


@dataclass(frozen=True)
class Output(Parameter):
    """What is written; `on_demand`, only if the user asks for it."""

    on_demand: bool = False
    accepted = "the name of a file"


@dataclass(frozen=True)
class LayerOutput(Output):
    """A vector layer, of a kind of geometry."""

    kind: str = LINE


@dataclass(frozen=True)
class RasterOutput(Output):
    """A rail raster."""


@dataclass(frozen=True)
class FileOutput(Output):
    """A file; see `FileInput`."""

    kinds: str = ""


@dataclass(frozen=True)
class Figure:
    """A figure about the result; a text, a folder or yes or no if `kind` says so."""

    name: str
    label: str
    kind: str = "number"


@dataclass(frozen=True)
class Group:
    """A group of the toolbox: its identifier, which never changes, and its label."""

    id: str
    label: str


RAILS = Group("railsandtracks", "Rails and tracks")
ALIGNMENT = Group("alignment", "Alignment")
RAW_CLOUDS = Group("rawclouds", "Raw clouds")
STEPS = Group("singlesteps", "Single steps")
SETUP = Group("setup", "Setup")


# Search terms, also in the languages of the larger railways: the toolbox search compares whole words.
RAIL_WORDS = (
    *("rail", "rails", "railway", "railroad", "track", "Gleis", "Schiene", "Bahn"),
    *("voie ferrée", "vía", "binario"),
)
CLOUD_WORDS = ("lidar", "las", "laz", "copc", "point cloud", "laser scanning", "Punktwolke", "nuage de points")
TRACK_WORDS = ("gauge", "cant", "superelevation", "alignment", "Spurweite", "Gleisachse", "Überhöhung", "écartement")
ALIGNMENT_WORDS = ("alignment", "elements", "straight", "clothoid", "arc", "Trasse", "Trassierung", "tracé")

LINE_NEEDS = (("numpy",), ("scipy",), ("pyproj",))
CLOUD_NEEDS = (("numpy",), ("scipy",), ("laspy",), ("lazrs",), ("pyproj",))
"""Modules for lines, and for clouds as well."""
