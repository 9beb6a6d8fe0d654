"""What a layer remembers of the run that made it, as properties that QGIS stores in the project."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import uuid4

from qgis.core import QgsMapLayer

from ..reading.clouds import CloudSource

if TYPE_CHECKING:
    from ...core.frame import LocalFrame

RUN, CLOUD = "rail_extract/run", "rail_extract/cloud"
"""Names of the properties: the id that the layers of a run share, and the cloud with its rail classes."""


@dataclass(frozen=True)
class RunCloud:
    """The cloud of a run.

    Attributes
    ----------
    paths : tuple of str
    class_codes : tuple of int
    crs_wkt : str or None
        Coordinate system for files that state none.
    head_width_m : float
    units_m : tuple of float
        Lengths of the units of x, y and z.
    """

    paths: tuple[str, ...]
    class_codes: tuple[int, ...]
    crs_wkt: str | None
    head_width_m: float
    units_m: tuple[float, float, float]

    @property
    def name(self) -> str:
        """Name of the cloud without folder and suffix."""
        first = Path(self.paths[0]).name.partition(".")[0]
        return f"{first} and {len(self.paths) - 1} more" if len(self.paths) > 1 else first


def properties_of(
    cloud: CloudSource, class_codes: Sequence[int], head_width_m: float, frame: LocalFrame
) -> dict[str, str]:
    """Return the properties of the layers of a new run."""
    paths = [str(path.resolve()) for path in cloud.paths]
    facts = {"paths": paths, "classes": list(class_codes), "crs": cloud.crs_wkt, "head_width_m": head_width_m}
    facts["units_m"] = [frame.horizontal_unit_m, frame.horizontal_unit_m, frame.vertical_unit_m]
    return {RUN: str(uuid4()), CLOUD: json.dumps(facts)}


def cloud_of(layer: QgsMapLayer) -> RunCloud | None:
    """Return the cloud of the run that made a layer; None if the layer states none."""
    try:
        facts = json.loads(layer.customProperty(CLOUD) or "")
        paths, codes = tuple(map(str, facts["paths"])), tuple(map(int, facts["classes"]))
        east, north, up = map(float, facts["units_m"])
        width_m = float(facts["head_width_m"])
        return RunCloud(paths, codes, facts["crs"], width_m, (east, north, up)) if paths else None
    except (KeyError, TypeError, ValueError):
        return None
