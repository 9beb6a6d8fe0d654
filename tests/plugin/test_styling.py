import gc

import pytest
from qgis.core import QgsProcessingContext, QgsProject, QgsVectorLayer
from rail_extract.rail_extract_plugin.styling import style_on_load


@pytest.mark.parametrize(("style", "color"), [("rails", "#1565c0"), ("centerlines", "#e64a19")])
def test_loaded_layer_gets_its_style(context, new_feedback, style, color):
    layer = QgsVectorLayer("LineStringZ", "lines", "memory")
    details = QgsProcessingContext.LayerDetails("lines", QgsProject.instance(), "RAILS")
    context.addLayerToLoadOnCompletion(layer.id(), details)
    style_on_load(layer.id(), style, context)
    gc.collect()
    post_processor = context.layerToLoadOnCompletionDetails(layer.id()).postProcessor()
    post_processor.postProcessLayer(layer, context, new_feedback())
    assert layer.renderer().symbol().color().name() == color


def test_layer_that_is_not_loaded_is_left_alone(context):
    style_on_load("unknown", "rails", context)
    assert not context.layersToLoadOnCompletion()
