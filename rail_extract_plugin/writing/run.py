"""What a layer remembers of the run that made it, as properties that QGIS stores in the project."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import uuid4

from qgis.core import QgsMapLayer, QgsProject

from ...core.jobs.clouds import CloudSource

if TYPE_CHECKING:
    from ...core.frame import LocalFrame

RUN, CLOUD, NUMBER = "rail_extract/run", "rail_extract/cloud", "rail_extract/number"
"""Names of the properties: the id that the layers of a run share, the cloud with its rail classes, and the number of
the run among those of the same cloud in the project."""


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


def new_run() -> dict[str, str]:
    """Return the property that the layers of a new run share."""
    return {RUN: str(uuid4())}


def properties_of(
    cloud: CloudSource, class_codes: Sequence[int], head_width_m: float, frame: LocalFrame
) -> dict[str, str]:
    """Return the properties of the layers of a new run."""
    paths = [str(path.resolve()) for path in cloud.paths]
    facts = {"paths": paths, "classes": list(class_codes), "crs": cloud.crs_wkt, "head_width_m": head_width_m}
    facts["units_m"] = [frame.horizontal_unit_m, frame.horizontal_unit_m, frame.vertical_unit_m]
    return {**new_run(), CLOUD: json.dumps(facts)}


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


def run_name(layer: QgsMapLayer, title: str) -> str:
    """Return a layer's title with the name of its cloud, and a number from the second run on; the title without a run.

    Parameters
    ----------
    layer : QgsMapLayer
        Gets the number as a property.
    title : str
    """
    cloud = cloud_of(layer)
    if cloud is None:
        return title
    number = _number_of_run(layer, cloud)
    layer.setCustomProperty(NUMBER, number)
    return f"{title}: {cloud.name}" if number == 1 else f"{title}: {cloud.name} {number}"


def _number_of_run(layer: QgsMapLayer, cloud: RunCloud) -> int:
    """Return the number that the run has already, or the next free one."""
    others = [one for one in QgsProject.instance().mapLayers().values() if one.id() != layer.id()]
    numbered = [(one, int(one.customProperty(NUMBER))) for one in others if one.customProperty(NUMBER)]
    run = layer.customProperty(RUN)
    own = [number for one, number in numbered if one.customProperty(RUN) == run]
    known = (cloud_of(one) for one, _ in numbered)
    taken = [number for (_, number), other in zip(numbered, known) if other is not None and other.name == cloud.name]
    return own[0] if own else max(taken, default=0) + 1
