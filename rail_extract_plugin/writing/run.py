"""What a layer remembers of the run that made it, as properties that QGIS stores in the project."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from qgis.core import (
    QgsMapLayer,
    QgsProcessingContext,
    QgsProcessingFeatureSourceDefinition,
    QgsProcessingUtils,
    QgsProject,
    QgsProperty,
)

from ...core.jobs.clouds import CloudSource
from ...core.jobs.result import ShownProfile

if TYPE_CHECKING:
    from ...core.frame import LocalFrame

RUN, CLOUD, NUMBER = "rail_extract/run", "rail_extract/cloud", "rail_extract/number"
"""Names of the properties: the id that the layers of a run share, the cloud with its rail classes, and the number of
the run among those of the same algorithm and input in the project."""

TOOL, SOURCE, LAYER = "rail_extract/tool", "rail_extract/source", "rail_extract/input"
"""Names of further ones: the label of the algorithm, what it was run on, in words, and the id of that layer, if any."""

PROFILE = "rail_extract/profile"
"""Name of the property that states the profile that was swept."""

TABLE = "|layername="
"""What comes before the name of a table in the source of a layer."""


@dataclass(frozen=True)
class RunCloud:
    """The cloud of a run, with a coordinate system for files that state none, and the units of x, y and z in metres."""

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


def new_run(tool: str, value: Any, context: QgsProcessingContext) -> dict[str, str]:
    """Return the properties that the layers of a new run of a tool, by its label, share.

    The main input gives the layers their names: that of a layer, or of a file.
    """
    value = value.source if isinstance(value, QgsProcessingFeatureSourceDefinition) else value
    value = value.valueAsString(context.expressionContext())[0] if isinstance(value, QgsProperty) else value
    layer = (
        value if isinstance(value, QgsMapLayer) else QgsProcessingUtils.mapLayerFromString(str(value), context, False)
    )
    return {RUN: str(uuid4()), TOOL: tool, **(_of_layer(layer) if layer else _of_file(str(value or "")))}


def _of_layer(layer: QgsMapLayer) -> dict[str, str]:
    """Return what states an input that is a layer; nothing for one between two steps of a model."""
    if QgsProject.instance().mapLayer(layer.id()) is None:
        return {}
    return {SOURCE: layer.customProperty(SOURCE) or layer.name(), LAYER: layer.id()}


def _of_file(source: str) -> dict[str, str]:
    """Return what states an input that is a file or a table of one; nothing for one between two steps of a model."""
    file, _, table = source.partition(TABLE)
    is_between = Path(QgsProcessingUtils.tempFolder()) in Path(file).parents
    return {} if is_between else {SOURCE: table or Path(file).name.partition(".")[0]}


def properties_of(
    cloud: CloudSource, class_codes: Sequence[int], head_width_m: float, frame: LocalFrame
) -> dict[str, str]:
    """Return the property that states the cloud of a run."""
    paths = [str(path.resolve()) for path in cloud.paths]
    facts = {"paths": paths, "classes": list(class_codes), "crs": cloud.crs_wkt, "head_width_m": head_width_m}
    facts["units_m"] = [frame.horizontal_unit_m, frame.horizontal_unit_m, frame.vertical_unit_m]
    return {CLOUD: json.dumps(facts)}


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


def properties_of_profile(profile: ShownProfile) -> dict[str, str]:
    """Return the property that states the profile of a run."""
    return {PROFILE: json.dumps(asdict(profile))}


def profile_of(layer: QgsMapLayer) -> ShownProfile | None:
    """Return the profile of the run that made a layer; None if the layer states none."""
    try:
        facts = json.loads(layer.customProperty(PROFILE) or "")
        points = tuple((float(v), float(w)) for v, w in facts["points"])
        spacing_m = {int(track): float(one) for track, one in facts["spacing_m"].items()}
        return ShownProfile(str(facts["name"]), points, float(facts["margin_m"]), spacing_m)
    except (AttributeError, KeyError, TypeError, ValueError):
        return None


def name_run(layer: QgsMapLayer, title: str) -> str:
    """Return the name of the run that made a layer, from its algorithm and input; empty if the layer has none.

    Runs of the same algorithm and input are numbered from the second on. A layer that is called by its title gets the
    name of the input as well; others, such as those of files, are called as the user wants.
    """
    source = layer.customProperty(SOURCE)
    if not source:
        return ""
    number = _number_of_run(layer)
    layer.setCustomProperty(NUMBER, number)
    numbered = source if number == 1 else f"{source} {number}"
    if layer.name() == title:
        layer.setName(f"{title}: {numbered}")
    return f"{layer.customProperty(TOOL)}: {numbered}"


def _number_of_run(layer: QgsMapLayer) -> int:
    """Return the number that the run has already, or the next free one."""
    others = [one for one in QgsProject.instance().mapLayers().values() if one.id() != layer.id()]
    alike = [
        one for one in others if all(one.customProperty(key) == layer.customProperty(key) for key in (TOOL, SOURCE))
    ]
    numbers = {one.customProperty(RUN): int(one.customProperty(NUMBER)) for one in alike if one.customProperty(NUMBER)}
    return numbers.get(layer.customProperty(RUN)) or max(numbers.values(), default=0) + 1
