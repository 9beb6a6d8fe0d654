"""The model: the steps chained in the model designer of QGIS."""

from pathlib import Path

import make_model
import numpy as np
import pytest
from lines import farthest, read_features, read_lines
from qgis.core import QgsProcessingModelAlgorithm, QgsProcessingParameterDefinition

MODEL = Path(__file__).resolve().parents[2] / "models" / "extract_rails.model3"


def load(path):
    model = QgsProcessingModelAlgorithm()
    assert model.fromFile(str(path))
    return model


@pytest.fixture
def model(plugin):
    return load(MODEL)


def content(model):
    """Return the content of a model, except the format number and the names of outputs, which differ in newer QGIS."""
    content = model.toVariant()
    content.pop("internal_version", None)
    definitions = content.pop("parameterDefinitions")
    named = {one["description"]: {**one, "name": ""} for one in definitions.values()}
    assert len(named) == len(definitions)
    return content, named


def test_model_is_up_to_date(model, tmp_path):
    assert make_model.build().toFile(str(tmp_path / "made.model3"))
    assert content(load(tmp_path / "made.model3")) == content(model)


def test_model_is_valid_and_has_the_parameters_of_extract_rails(model, algorithm):
    valid, problems = model.validate()
    assert valid, problems
    assert all(child.algorithm() for child in model.childAlgorithms().values())
    names = [
        [definition.name() for definition in one.parameterDefinitions() if not definition.isDestination()]
        for one in (model, algorithm)
    ]
    assert names[0] == [name for name in names[1] if name not in make_model.WITHOUT_STEP]
    for name in names[0][1:]:
        assert model.parameterDefinition(name).defaultValue() == algorithm.parameterDefinition(name).defaultValue()


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
    assert dialog.model().provider().id() == "model"
    dialog.setDirty(False)
    dialog.close()
    plugin.unload()
    assert action not in ProviderContextMenuActions.actions
    plugin.initProcessing()


def test_model_gives_the_lines_of_extract_rails(model, run, run_step, write_cloud, track, tmp_path):
    inputs = {"INPUT": write_cloud(track()), "ITERATIONS": 1, "STEP": 0.5}
    whole = {name: tmp_path / f"{name}.gpkg" for name in ("RAILS", "CENTERLINES", "QUALITY")}
    names = ("rails:RAILS", "centerlines:CENTERLINES", "quality:QUALITY", "centerlines:PAIRED_RAILS")
    steps = {name: tmp_path / f"{number}.gpkg" for number, name in enumerate(names)}
    steps |= {"quality:FINDINGS": tmp_path / "findings.gpkg", "quality:REPORT": tmp_path / "report.html"}
    assert {definition.name() for definition in model.destinationParameterDefinitions()} == set(steps)
    assert model.parameterDefinition("quality:QUALITY").flags() & QgsProcessingParameterDefinition.Flag.FlagOptional
    for made in (run({**inputs, **whole}), run_step(model, {**inputs, **steps})):
        assert made.ok, made.error
    for mine, theirs in list(zip(steps.values(), whole.values()))[:2]:
        assert farthest(read_lines(mine), read_lines(theirs)) < 0.001
    for paired in (steps[names[3]], whole["RAILS"]):
        assert [items["track_ids"] for _, items in read_features(paired)] == ["1", "1"]
    assert "Good throughout" in steps["quality:REPORT"].read_text(encoding="utf-8")
    measured = [read_features(paths[name]) for paths, name in ((steps, names[2]), (whole, "QUALITY"))]
    assert len(measured[0]) == len(measured[1]) > 20
    for (mine, _), (theirs, _) in zip(*measured):
        np.testing.assert_allclose(mine, theirs, atol=1e-4)
    for name in ("gauge_mm", "cant_mm", "sigma_mm", "points"):
        np.testing.assert_allclose(*([items[name] for _, items in rows] for rows in measured), rtol=1e-3, atol=0.01)
