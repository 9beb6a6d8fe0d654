"""Applies styles to results when QGIS loads them."""

from __future__ import annotations

from collections.abc import Mapping

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsLayerTree,
    QgsMapLayer,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingLayerPostProcessorInterface,
    QgsProject,
)
from qgis.PyQt import sip

from .. import compat
from ..notices import notices
from ..paths import STYLES
from .run import RUN, run_name
from .view_3d import show_lines_in_3d

FINDINGS = "findings"
"""Style of the findings, which the user is asked to review."""

STYLE = "rail_extract/style"
"""Name of the property that states the style of a layer."""

NO_PROPERTIES: Mapping[str, str] = {}

TOP_TO_BOTTOM = (
    *("stops", "findings", "differences", "deviations", "elements", "axes", "centerlines", "airborne", "rails"),
    *("proposed", "stations", "quality", "places", "raster"),
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
        layer.setCustomProperty(STYLE, self._style)
        show_lines_in_3d(layer, self._style)
        for name, value in self._properties.items():
            layer.setCustomProperty(name, value)
        if layer.name() == self._title:
            layer.setName(run_name(layer, self._title))
        _put_in_order(layer)
        layer.triggerRepaint()
        if self._style == FINDINGS:
            notices.findings_loaded.emit(layer.id())


def _put_in_order(layer: QgsMapLayer) -> None:
    """Sort the layers of a run that are next to the one that has just been loaded.

    QGIS sorts new layers only, and puts them above one of an earlier run whose file is written again.
    """
    node = QgsProject.instance().layerTreeRoot().findLayer(layer.id())
    if node is None:
        return
    group = node.parent()
    loaded = [one for one in group.children() if QgsLayerTree.isLayer(one) and one.layer() is not None]
    mine = [one for one in loaded if one.layer().customProperty(RUN) == layer.customProperty(RUN)]
    styles = [one.layer().customProperty(STYLE) for one in mine]
    if not all(style in TOP_TO_BOTTOM for style in styles):
        return
    places = list(map(TOP_TO_BOTTOM.index, styles))
    if places == sorted(places):
        return
    top = group.children().index(mine[0])
    for number in sorted(range(len(mine)), key=places.__getitem__, reverse=True):
        group.insertChildNode(top, mine[number].clone())
    for one in mine:
        group.removeChildNode(one)


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
    """Apply a style if QGIS loads the layer after the run.

    The layers of a run are in the order of `TOP_TO_BOTTOM`, and in one group if QGIS supports groups for results.

    Parameters
    ----------
    layer_id : str
    style : str
        Name of a .qml file of the plugin, without its suffix.
    context : QgsProcessingContext
    properties : mapping of str to str
        To be stored with the layer.
    title : str
        Name of the output. A layer with this name gets that of the cloud as well; a model, for example, gives its own.
    has_system : bool
        Whether the coordinate system of the layer is known.
    """
    if context.willLoadLayerOnCompletion(layer_id):
        details = context.layerToLoadOnCompletionDetails(layer_id)
        details.setPostProcessor(_styler(style, title, properties, has_system))
        if compat.GROUPS_LAYERS:
            details.groupName = "Rail Extract"
