import pytest
from qgis.core import QgsSettings
from rail_extract.core.standards import STANDARDS
from rail_extract.rail_extract_plugin.dialog.standard_setting import LAST


@pytest.fixture
def dialog(qgis, plugin):
    """Open a dialog."""
    opened = []

    def dialog(name="extractrails"):
        opened.append(
            qgis.processingRegistry().createAlgorithmById(f"railextract:{name}").createCustomParametersWidget()
        )
        return opened[-1]

    yield dialog
    QgsSettings().remove(LAST)
    for one in opened:
        one.close()


@pytest.fixture
def wrapper(dialog):
    """Open a dialog and give what connects it with the list of standards."""
    return lambda name="extractrails": dialog(name).mainWidget().wrappers["STANDARD"]


def test_standards_are_listed_in_words_by_region(wrapper):
    combo = wrapper().widget
    texts = [combo.itemText(row) for row in range(combo.count())]
    assert texts[:3] == [
        "Detect from the points",
        "Custom: gauge and railhead width of the advanced parameters",
        "Australia: AS 41 kg/m, 1067 mm, head 63.5 mm",
    ]
    assert texts[2:] == sorted(texts[2:])
    assert {combo.itemData(row) for row in range(combo.count())} == {*STANDARDS, "CUSTOM", "DETECT"}
    assert combo.currentText() == "Detect from the points"
    assert wrapper("rasterizerailpoints").widget.currentText() == "Europe: EN 60E1 (UIC 60), 1435 mm, head 72 mm"


def test_only_extract_rails_detects(wrapper):
    combo = wrapper("buildtrackcenterlines").widget
    assert combo.findData("DETECT") == -1
    assert combo.findData("CUSTOM") == 0


def chosen(dialog, standard):
    """Choose a standard as a user does."""
    combo = dialog.mainWidget().wrappers["STANDARD"].widget
    combo.setCurrentIndex(combo.findData(standard))
    combo.activated.emit(combo.currentIndex())


def test_a_choice_is_remembered_once_a_run_has_used_it(dialog, wrapper, context):
    first = dialog()
    chosen(first, "IN_75R_1000")
    first.close()
    assert wrapper().value() == "DETECT"
    first.after_run(True, {}, context)
    assert wrapper().value() == "IN_75R_1000"
    assert wrapper("rasterizerailpoints").value() == "IN_75R_1000"
    chosen(first, "DETECT")
    first.after_run(True, {}, context)
    assert wrapper("rasterizerailpoints").value() == "EN_60E1_1435"
