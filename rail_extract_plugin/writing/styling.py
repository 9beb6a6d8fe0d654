"""Applies styles to results when QGIS loads them."""

from __future__ import annotations

from collections.abc import Mapping

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsLayerTree,
    QgsLayerTreeGroup,
    QgsMapLayer,
    QgsMapLayerStyle,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingLayerPostProcessorInterface,
    QgsProject,
)
from qgis.PyQt import sip

from ...core.fields import PLACES
from ..notices import notices
from ..paths import STYLES
from .run import LAYER, RUN, name_run
from .view_3d import show_lines_in_3d

FINDINGS = "findings", "intrusions"
"""Styles of the layers that the user is asked to review."""

STYLE = "rail_extract/style"
"""Name of the property that states the style of a layer."""

NO_PROPERTIES: Mapping[str, str] = {}

TOP_TO_BOTTOM = (
    *("stops", "findings", "intrusions", "differences", "elements", "deviations", "axes", "wires", "platforms"),
    *("centerlines", "airborne", "rails", "stations", "quality", "clearance", "places", "raster"),
)
"""Order of the layers of a run, by style: what is to be looked at first, then the lines, and what they rest on."""


class _Styler(QgsProcessingLayerPostProcessorInterface):
    def __init__(self, style: str, title: str, properties: Mapping[str, str], has_system: bool) -> None:
        super().__init__()
        self._style, self._title, self._properties, self._has_system = style, title, dict(properties), has_system

    def postProcessLayer(
        self, layer: QgsMapLayer, context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> None:
        # If a run replaces the file of a layer in the project, it gets this layer, which still reads the old file.
        layer.reload()
        if not self._has_system:
            # QGIS marks such a layer and asks for its system; it can't place the one that stands for an unknown one.
            layer.setCrs(QgsCoordinateReferenceSystem())
        layer.loadNamedStyle(str(STYLES / f"{self._style}.qml"))
        if self._style == PLACES.style:
            _look_like(layer, QgsProject.instance().mapLayer(self._properties.get(LAYER, "")))
        layer.setCustomProperty(STYLE, self._style)
        show_lines_in_3d(layer, self._style)
        for name, value in self._properties.items():
            layer.setCustomProperty(name, value)
        run = name_run(layer, self._title)
        if run:
            _put_into_group(layer, run)
        layer.triggerRepaint()
        if self._style in FINDINGS:
            notices.findings_loaded.emit(layer.id())


def _look_like(copy: QgsMapLayer, original: QgsMapLayer | None) -> None:
    """Give a copy with further fields style and properties of its original, and keep the names in words it has."""
    if original is None:
        return
    names = [copy.attributeAlias(number) for number in range(copy.fields().count())]
    style = QgsMapLayerStyle()
    style.readFromLayer(original)
    style.writeToLayer(copy)
    for number, name in enumerate(names):
        if name:
            copy.setFieldAlias(number, name)


def _put_into_group(layer: QgsMapLayer, run: str) -> None:
    """Move a layer into the group of its run, at its place there; a new group is where the layer was."""
    node = QgsProject.instance().layerTreeRoot().findLayer(layer.id())
    if node is None:
        return
    before = node.parent()
    outside = before.parent() if before.customProperty(RUN) else before
    mine = layer.customProperty(RUN)
    groups = [one for one in outside.children() if QgsLayerTree.isGroup(one)]
    group = next((one for one in groups if one.customProperty(RUN) == mine), None)
    if group is None:
        neighbour = node if outside is before else before
        group = outside.insertGroup(outside.children().index(neighbour), run)
        group.setCustomProperty(RUN, mine)
    group.insertChildNode(_place_in(group, layer), node.clone())
    before.removeChildNode(node)  # last, because QGIS removes layers that are in no group
    if outside is not before and not before.children():
        outside.removeChildNode(before)


def _place_in(group: QgsLayerTreeGroup, layer: QgsMapLayer) -> int:
    """Return the place of a layer in a group, by the styles of its layers."""
    ranks = {style: number for number, style in enumerate(TOP_TO_BOTTOM)}
    children = group.children()
    loaded = [one.layer() if QgsLayerTree.isLayer(one) else None for one in children]
    below = (
        number
        for number, one in enumerate(loaded)
        if one is not None and one != layer
        if ranks.get(one.customProperty(STYLE), 0) > ranks.get(layer.customProperty(STYLE), 0)
    )
    return next(below, len(children))


_kept: list[_Styler] = []
"""QGIS calls these after the algorithm has been deleted, holds no reference, and deletes them with its context."""


def _styler(style: str, title: str, properties: Mapping[str, str], has_system: bool) -> _Styler:
    """Create the object for one layer, and keep it until QGIS deletes it."""
    _kept[:] = [one for one in _kept if not sip.isdeleted(one)]
    _kept.append(_Styler(style, title, properties, has_system))
    return _kept[-1]


def style_on_load(
    layer_id: str,
    style: str,
    context: QgsProcessingContext,
    properties: Mapping[str, str] = NO_PROPERTIES,
    title: str = "",
    has_system: bool = True,
) -> None:
    """Apply a style, by the name of its .qml file, if QGIS loads the layer after the run.

    The layers of a run are in one group, in the order of `TOP_TO_BOTTOM`. The properties are stored with the layer. A
    layer whose name is the title of the output gets that of the input as well; a model, for example, gives its own.
    `has_system` says whether the coordinate system of the layer is known.
    """
    if context.willLoadLayerOnCompletion(layer_id):
        details = context.layerToLoadOnCompletionDetails(layer_id)
        details.setPostProcessor(_styler(style, title, properties, has_system))
