"""The model: the steps chained in QGIS's own graphical modeler."""

from pathlib import Path

import make_model
import pytest
from lines import farthest, read_lines
from qgis.core import QgsProcessingModelAlgorithm

MODEL = Path(__file__).resolve().parents[2] / "models" / "extract_rails.model3"


def load(path):
    model = QgsProcessingModelAlgorithm()
    assert model.fromFile(str(path))
    return model


@pytest.fixture
def model(plugin):
    return load(MODEL)


def test_model_is_what_its_command_writes(model, tmp_path):
    assert make_model.build().toFile(str(tmp_path / "made.model3"))
    assert load(tmp_path / "made.model3").toVariant() == model.toVariant()


def test_model_is_sound_and_takes_what_extract_rails_takes(model, algorithm):
    valid, problems = model.validate()
    assert valid, problems
    assert all(child.algorithm() for child in model.childAlgorithms().values())
    names = [
        [definition.name() for definition in one.parameterDefinitions() if not definition.isDestination()]
        for one in (model, algorithm)
    ]
    assert names[0] == names[1]
    for name in names[0][1:]:
        assert model.parameterDefinition(name).defaultValue() == algorithm.parameterDefinition(name).defaultValue()


def test_graphical_modeler_opens_it(model):
    from processing.modeler.ModelerDialog import ModelerDialog

    dialog = ModelerDialog()
    dialog.loadModel(str(MODEL))
    assert dialog.model().childAlgorithms().keys() == model.childAlgorithms().keys()
    dialog.setDirty(False)
    dialog.close()


def test_context_menu_of_extract_rails_opens_a_copy(qgis, plugin, model):
    from processing.gui.ProviderActions import ProviderContextMenuActions

    plugin.unload()
    plugin.initGui()
    (action,) = [one for one in ProviderContextMenuActions.actions if one.name == "Open as Model…"]
    for algorithm in qgis.processingRegistry().providerById("railextract").algorithms():
        action.setData(algorithm, None)
        assert action.isEnabled() == (algorithm.name() == "extractrails")
    action.execute()
    dialog = action.dialog
    assert dialog.model().childAlgorithms().keys() == model.childAlgorithms().keys()
    assert dialog.model().sourceFilePath() == ""
    dialog.setDirty(False)
    dialog.close()
    plugin.unload()
    assert action not in ProviderContextMenuActions.actions
    plugin.initProcessing()


def test_model_gives_the_lines_of_extract_rails(model, run, outcome, write_cloud, track, tmp_path):
    inputs = {"INPUT": write_cloud(track()), "ITERATIONS": 1}
    whole = {"RAILS": tmp_path / "rails.gpkg", "CENTERLINES": tmp_path / "tracks.gpkg"}
    steps = {"rails:RAILS": tmp_path / "r.gpkg", "centerlines:CENTERLINES": tmp_path / "t.gpkg"}
    assert {definition.name() for definition in model.destinationParameterDefinitions()} == set(steps)
    for made in (run({**inputs, **whole}), outcome(model, {**inputs, **steps})):
        assert made.ok, made.error
    for mine, theirs in zip(steps.values(), whole.values()):
        assert farthest(read_lines(mine), read_lines(theirs)) < 0.001
