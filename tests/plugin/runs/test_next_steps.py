"""What a dialog offers after a run."""

from memory_layers import layer_of
from qgis.core import QgsProject

LINE = "LINESTRING (500000 3000000, 500100 3000000)"


def test_proposed_guides_are_run_with_from_a_link(qgis, plugin, context):
    from rail_extract.rail_extract_plugin.runs.next_steps import after_success  # needs QGIS's processing framework

    context.setProject(QgsProject.instance())
    dialog = qgis.processingRegistry().createAlgorithmById("railextract:airbornecenterlines")
    dialog = dialog.createCustomParametersWidget()
    proposed, ran = QgsProject.instance().addMapLayer(layer_of(LINE)), []
    dialog.run_again = ran.append
    steps = {step.text: step for step in after_success(dialog, {"PROPOSED": proposed.id()}, context, "")}
    steps["Run again with the proposed guides"].take()
    assert ran == [{"GUIDE": proposed.id()}]
    dialog.close()
