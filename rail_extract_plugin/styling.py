"""Styles that results get when QGIS loads them."""

from __future__ import annotations

from functools import cache

from qgis.core import (
    QgsMapLayer,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingLayerPostProcessorInterface,
)

from .paths import STYLES


class _Styler(QgsProcessingLayerPostProcessorInterface):
    def __init__(self, style: str) -> None:
        super().__init__()
        self._path = str(STYLES / f"{style}.qml")

    def postProcessLayer(
        self, layer: QgsMapLayer, context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> None:
        layer.loadNamedStyle(self._path)
        layer.triggerRepaint()


@cache
def _styler(style: str) -> _Styler:
    """Make one object a style and keep it: QGIS calls it after the algorithm is gone, and holds no reference."""
    return _Styler(style)


def style_on_load(layer_id: str, style: str, context: QgsProcessingContext) -> None:
    """Have QGIS apply `style` (a .qml file of the plugin) if it loads the layer when the run is done."""
    if context.willLoadLayerOnCompletion(layer_id):
        context.layerToLoadOnCompletionDetails(layer_id).setPostProcessor(_styler(style))
