"""The values of a run, as every job reads them; QGIS, and the files of a command line or of Python, provide them."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..disk import Destination
from ..errors import ParameterError
from ..fields import Field
from ..parameters import AirborneParameters, GrowParameters, Parameters
from ..standards import (
    CUSTOM,
    DEFAULT,
    DETECT,
    LAST_CLASS,
    Gauge,
    RailStandard,
    is_class,
    read_gauges,
    resolve,
)
from .clouds import Bounds, CloudSource, checked_crs, request_points
from .declaration import NAME, RAILS, Figure, Group, Output, Parameter
from .inputs import DECREASING

if TYPE_CHECKING:
    import numpy as np

    from ..airborne.survey import GuideLine
    from ..clouds.points import Request
    from ..files.rail_rasters import RasterSource
    from ..kilometres.axes import PlacedAxes
    from ..progress import Progress
    from ..run.tasks import Runner
    from .features import FeatureSource, PlacedFeatures
    from .lines import LayerLines, Rows
    from .result import Result

NUMBERS = {
    "SMOOTHING_XY": "smoothing_xy_m",
    "SMOOTHING_Z": "smoothing_z_m",
    "TOLERANCE_XY": "tolerance_xy_m",
    "TOLERANCE_Z": "tolerance_z_m",
    "CROWN_RADIUS": "crown_radius_m",
    "MAX_GAP": "max_gap_m",
    "GAP_ANGLE": "gap_angle_deg",
    "SIMPLIFY_XY": "simplify_xy_m",
    "SIMPLIFY_Z": "simplify_z_m",
    "MIN_LENGTH": "min_length_m",
    "CENTERLINE_TOLERANCE": "centerline_tolerance_m",
}
"""Attribute of `Parameters` for each number of the interface."""

CHOICES = {"ENGINE": "engine", "DEVICE": "device", "MODEL": "model", "STRIPS": "strips", "ITERATIONS": "passes"}
"""The same for choices and whole numbers."""

GROWTH = {
    "BOTH": "both",
    "SEARCH": "search_m",
    "THICKNESS": "thickness_m",
    "WINDOW": "window_m",
    "MIN_HEIGHT": "min_height_m",
    "TOLERANCE_Z": "tolerance_z_m",
    "MAX_OUTLIERS": "max_outliers",
    "MAX_LENGTH": "max_length_m",
}
"""The same for `GrowParameters`; TOLERANCE_Z has another default there."""

AIRBORNE = {"REACH": "reach_m", "FOOTPRINT": "footprint_m", "RAIL_HEIGHT": "rail_height_m"}
"""The same for `AirborneParameters`."""


def _run_elsewhere(values: Values, progress: Progress) -> Result:
    """Stand for the run of a job that only the plugin can do."""
    raise NotImplementedError


@dataclass(frozen=True)
class Job:
    """What an algorithm does, takes and gives.

    Attributes
    ----------
    name : str
        Identifier for models and scripts of QGIS; it never changes.
    label, summary, help : str
        Name, one sentence, and paragraphs.
    tags : tuple of str
        Words by which a search finds it.
    needs : tuple of tuple of str
        Python modules that it needs: of each inner tuple one is enough, and the first is recommended.
    parameters, outputs, figures : tuple
        In the order of the interface.
    fields : tuple of Field
        Fields of the main result, for the help on the command line.
    picture : str
        File in the folder of pictures, for the help panel.
    guide : str
        Page of the guide that describes it.
    pages : tuple of str
        Pages of the guide to which the help links.
    call : str
        Name as a function of Python, and with hyphens as a command; empty for what sets up QGIS.
    resumes : bool
        Whether a folder can keep what a run has finished for later ones: the command then has the option ``--work``.
    check : callable
        Checks the values before a run, in the main thread; it raises a `RailExtractError`.
    run : callable
        Reads what the values name, and computes.
    """

    name: str
    label: str
    summary: str
    help: str
    tags: tuple[str, ...]
    needs: tuple[tuple[str, ...], ...] = ()
    parameters: tuple[Parameter, ...] = ()
    outputs: tuple[Output, ...] = ()
    figures: tuple[Figure, ...] = ()
    group: Group = RAILS
    fields: tuple[Field, ...] = ()
    picture: str = ""
    guide: str = "parameters"
    pages: tuple[str, ...] = ("parameters",)
    call: str = ""
    resumes: bool = False
    check: Callable[[Values], None] = lambda values: None
    run: Callable[[Values, Progress], Result] = _run_elsewhere

    def reworded(self, sentence: str, spell: Callable[[Parameter], str]) -> str:
        """Return a sentence with other names for the parameters and outputs."""
        named = {one.name: spell(one) for one in (*self.parameters, *self.outputs)}
        return re.sub(NAME, lambda found: named.get(found[0], found[0]), sentence)


class Values(ABC):
    """Values of the parameters of one run of a job."""

    job: Job
    _read: dict[str, Any]
    """What was read, of which QGIS reads some in the main thread."""

    @property
    @abstractmethod
    def command(self) -> str:
        """What repeats the run, without passwords."""

    @abstractmethod
    def __getitem__(self, name: str) -> Any:
        """Return the value of a parameter, by its kind; None if it is empty, and the WKT of a coordinate system."""

    @abstractmethod
    def filled(self, name: str) -> bool:
        """Return whether a value was given; a default does not count."""

    @abstractmethod
    def wanted(self, name: str) -> bool:
        """Return whether an output is to be written."""

    @abstractmethod
    def path(self, name: str) -> Path:
        """Return the file that an output names, before the run."""

    @abstractmethod
    def destination(self, name: str) -> Destination:
        """Return the file of an output that is wanted."""

    @abstractmethod
    def title(self, name: str) -> str:
        """Return the name of the layer that was given for an input, to show to users; empty without one."""

    @abstractmethod
    def prepare(self, crs_wkt: str | None) -> None:
        """Learn which coordinate system the results will have."""

    @abstractmethod
    def runner(self) -> AbstractContextManager[Runner]:
        """Provide the runner with as many processes as WORKERS asks for."""

    @abstractmethod
    def source(self, name: str) -> FeatureSource:
        """Return a vector layer or a table."""

    @abstractmethod
    def picked(self, crs_wkt: str | None) -> Sequence[np.ndarray]:
        """Return the places of SEED in a coordinate system, (1, 2) each."""

    @abstractmethod
    def cloud(self, name: str = "INPUT") -> CloudSource:
        """Return the files of a cloud, and which of their points count."""

    @abstractmethod
    def raster(self, name: str) -> RasterSource:
        """Return a file of rail rasters."""

    @abstractmethod
    def extent(self, crs_wkt: str | None) -> Bounds | None:
        """Read EXTENT in a coordinate system."""

    @abstractmethod
    def scratch(self) -> AbstractContextManager[Path]:
        """Provide a folder for the points of a run."""

    def once(self, key: str, read: Callable[[], Any]) -> Any:
        """Return what was read before under a key, else read it."""
        if key not in self._read:
            self._read[key] = read()
        return self._read[key]

    def system(self, name: str) -> str | None:
        """Return the coordinate system of a layer as WKT; None if it has none."""
        return self.source(name).crs_wkt

    def rows(self, name: str, progress: Progress) -> Rows:
        """Read the fields of a layer; see `read_rows`."""
        from .features import read_rows

        return read_rows(self.source(name), progress)

    def lines(self, name: str, progress: Progress) -> LayerLines:
        """Read the lines of a layer; see `read_lines`."""
        from .features import read_lines

        return read_lines(self.source(name), progress)

    def axes(self, crs_wkt: str | None) -> PlacedAxes:
        """Read AXIS and what states its kilometres; see `read_axes`."""
        return self.once("axes", lambda: self._axes(crs_wkt))

    def _axes(self, crs_wkt: str | None) -> PlacedAxes:
        from .features import read_axes

        start = (self["START_KM"], self["DIRECTION"] == DECREASING) if self.filled("START_KM") else None
        posts, jumps = (self.source(name) if self.filled(name) else None for name in ("POSTS", "JUMPS"))
        return read_axes(self.source("AXIS"), start, posts, self["POST_FIELD"], jumps, self["FORMAT"], crs_wkt)

    def places(self, name: str, plane: str | None, progress: Progress) -> PlacedFeatures:
        """Read the features of a layer of any kind, in the plane of the axes; see `places_of`."""
        from .features import places_of

        return places_of(self.source(name), plane, progress)

    def lines_along(self, name: str, crs_wkt: str | None) -> Sequence[np.ndarray]:
        """Read lines that show places along tracks; see `read_lines_along`."""
        from .features import read_lines_along

        return self.once("lines along", lambda: read_lines_along(self.source(name), crs_wkt))

    def guides(self, name: str, crs_wkt: str | None) -> Sequence[GuideLine]:
        """Read such lines with what they state of their tracks; see `read_guides`."""
        from .features import read_guides

        return self.once("guides", lambda: read_guides(self.source(name), crs_wkt))

    def seeds(self, crs_wkt: str | None) -> Sequence[np.ndarray]:
        """Read SEEDS and SEED in a coordinate system: points, (1, 2), and lines, (k, 2)."""
        return self.once("seeds", lambda: self._seeds(crs_wkt))

    def _seeds(self, crs_wkt: str | None) -> list[np.ndarray]:
        from .features import read_seeds

        layer = read_seeds(self.source("SEEDS"), crs_wkt) if self.filled("SEEDS") else []
        return [*layer, *(self.picked(crs_wkt) if self.has("SEED") and self.filled("SEED") else [])]

    def with_mask(self, cloud: CloudSource) -> CloudSource:
        """Return a cloud limited to MASK and without what LEAVE_OUT names, where the job has these."""
        from .features import read_mask

        has_mask = self.has("MASK") and self.filled("MASK")
        mask = read_mask(self.source("MASK"), checked_crs(cloud)) if has_mask else None
        return replace(cloud, mask=mask, leave_out=(self["LEAVE_OUT"] or ()) if self.has("LEAVE_OUT") else ())

    @property
    def keeps(self) -> bool:
        """Whether the result stays after the run, so that its layers can be had without naming files."""
        return False

    def request(
        self, class_codes: Sequence[int], progress: Progress, unreadable: list[str] | None = None, name: str = "INPUT"
    ) -> Request:
        """Check which points are to be read, and read the headers of the files; see `request_points`."""
        bounds = self.extent if self.has("EXTENT") else lambda _: None
        return request_points(self.cloud(name), class_codes, bounds, progress, unreadable)

    def cloud_crs(self, name: str = "INPUT") -> str | None:
        """Return the coordinate system of the cloud; see `checked_crs`."""
        return checked_crs(self.cloud(name))

    def has(self, name: str) -> bool:
        """Return whether the job has a parameter."""
        return any(one.name == name for one in self.job.parameters)

    def rails_only(self) -> bool:
        """Return whether CONTENT leaves out what is not on rails."""
        return self["CONTENT"] == 1

    def airborne(self, standard: RailStandard) -> AirborneParameters:
        """Read how tracks are looked for in an airborne cloud."""
        return AirborneParameters(standard.gauge_m, standard.head_width_m, **self._stated(AIRBORNE))

    def growth(self) -> GrowParameters:
        """Read how rails are followed."""
        return GrowParameters(**self._stated(GROWTH))

    def has_axis(self) -> bool:
        """Return whether AXIS is filled in; raise ParameterError if only what states its kilometres is."""
        lone = next((name for name in ("START_KM", "POSTS", "JUMPS") if self.filled(name)), None)
        if lone and not self.filled("AXIS"):
            raise ParameterError(f"{lone} needs the line that it applies to: choose AXIS.")
        return self.filled("AXIS")

    def engine(self) -> str:
        """Read ENGINE, and check that it is installed and runs on DEVICE."""
        from ..frpdf.cleanup import choose_engine

        return choose_engine(self["ENGINE"], self["DEVICE"])

    def weights(self) -> Path | None:
        """Read METHOD and WEIGHTS: the weights of the network that finds rail points, or None for geometry."""
        from ..learned.model import weights_for

        return weights_for(self["METHOD"], self["WEIGHTS"])

    def class_codes(self) -> tuple[int, ...]:
        """Read RAIL_CLASSES."""
        return class_numbers(self["RAIL_CLASSES"], "RAIL_CLASSES")

    def detects(self) -> bool:
        """Return whether the points are to tell the rail standard."""
        return self["STANDARD"] == DETECT

    def standard(self, detected: str | None = None) -> RailStandard:
        """Read STANDARD, or take the one that was detected; GAUGE and HEAD_WIDTH override its values."""
        return resolve(detected or self["STANDARD"], self["GAUGE"], self["HEAD_WIDTH"])

    def head_width_m(self) -> float:
        """Read HEAD_WIDTH, or the value of STANDARD."""
        head_width_mm = self["HEAD_WIDTH"]
        if head_width_mm is None and self["STANDARD"] == CUSTOM:
            raise ParameterError("STANDARD CUSTOM needs the railhead width, in millimetres: fill in HEAD_WIDTH.")
        return resolve(DEFAULT if head_width_mm else self["STANDARD"], None, head_width_mm).head_width_m

    def other_gauges(self, standard: RailStandard) -> tuple[Gauge, ...]:
        """Read OTHER_GAUGES, and check that they can be distinguished from each other and from the standard's gauge."""
        own = self.has("CENTERLINE_TOLERANCE")
        tolerance_m = self["CENTERLINE_TOLERANCE"] if own else Parameters.centerline_tolerance_m
        return read_gauges(self["OTHER_GAUGES"] or "", "OTHER_GAUGES", standard, tolerance_m, own)[1:]

    def settings(self, standard: RailStandard, other_gauges: tuple[Gauge, ...] = ()) -> Parameters:
        """Return the job's parameters for the walk, with the defaults for all others."""
        given = self._stated({**NUMBERS, **CHOICES})
        return Parameters(standard.gauge_m, standard.head_width_m, **given).with_gauges(other_gauges)

    def _stated(self, names: Mapping[str, str]) -> dict[str, Any]:
        """Return the values of those parameters that the job has, by the attribute that each stands for."""
        return {field: self[name] for name, field in names.items() if self.has(name)}


def class_numbers(text: str, what: str) -> tuple[int, ...]:
    """Parse classes such as "10,11"; `what` is the name of the parameter, for the error."""
    words = [word for word in re.split(r"[;,\s]+", text) if word]
    if not words or not all(map(is_class, words)):
        raise ParameterError(f'{what} "{text}" must be whole numbers from 0 to {LAST_CLASS} such as 10 or 10,11.')
    return tuple(dict.fromkeys(int(word) for word in words))
