import pytest


@pytest.fixture
def dialog(algorithm):
    from processing.gui.AlgorithmDialog import AlgorithmDialog

    dialog = AlgorithmDialog(algorithm)
    yield dialog
    dialog.close()


def test_dialog_shows_every_parameter(dialog, algorithm):
    assert set(dialog.mainWidget().wrappers) == {definition.name() for definition in algorithm.parameterDefinitions()}


def test_dialog_opens_with_the_defaults(dialog, algorithm):
    for name in ("RAIL_CLASSES", "STANDARD", "ENGINE", "ITERATIONS", "SMOOTHING_XY", "SIMPLIFY_Z", "MAX_GAP"):
        wrapper = dialog.mainWidget().wrappers[name]
        assert wrapper.parameterValue() == algorithm.parameterDefinition(name).defaultValue()
